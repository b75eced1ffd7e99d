"""Detections against truth."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import apgstmd
from test_scene import small

# 4 frames with a target each at (20, 20); scores 9 true, 8 false, 7 true and false, 6 true, 5 false three times.
FOUND: dict[str, Any] = {
    "frame": [0, 0, 1, 3, 2, 1, 2, 3],
    "x": [20, 90, 20, 90, 20, 90, 90, 90],
    "y": [21, 90, 21, 90, 21, 90, 90, 90],
    "score": [9, 8, 7, 7, 6, 5, 5, 5],
}
BOXES: dict[str, Any] = {"frame": [0, 1, 2, 3], "x": [18.5] * 4, "y": [18.5] * 4, "w": [4] * 4, "h": [4] * 4}


def test_numbers_worked_by_hand() -> None:
    e = apgstmd.evaluate(FOUND, BOXES, frames=4)
    assert (e.targets, e.true_detections, e.false_detections, e.neutral_detections) == (4, 3, 5, 0)
    assert e.area == 0.5 * 0.25 + 0.5 * 0.75
    assert e.average_precision == 0.25 * 1.0 + 0.25 * 0.5 + 0.25 * 0.6
    assert [point.limit for point in e.at] == [0.1, 0.5, 1, 5, 10]
    assert [point.detection_rate for point in e.at] == [e.rate_at(point.limit or 0) for point in e.at]
    assert [e.rate_at(x) for x in (0, 0.1, 0.49, 0.5, 100)] == [0.25, 0.25, 0.25, 0.75, 0.75]
    assert e.rate_at(-1) == 0
    np.testing.assert_array_equal(e.curve.threshold, [9, 8, 7, 6, 5])
    np.testing.assert_array_equal(e.curve.true_detections, [1, 1, 2, 3, 3])
    np.testing.assert_array_equal(e.curve.false_alarms, [0, 0.25, 0.5, 0.5, 1.25])
    assert [column.dtype.kind for column in e.curve.columns.values()] == list("fiiffff")
    assert e.best_f1.point is not None
    assert e.best_f1.point.threshold == 6.0
    assert e.best_f1.point.f1 == pytest.approx(2 / 3)
    assert e.everything.localisation_error == 1.0
    assert e.everything.direction_error is None
    assert (e.frames, e.first_frame, e.last_frame, e.frames_from) == (4, 0, 3, "given")
    assert repr(e).startswith("Evaluation(4 frames, 4 targets, area=0.500, rate_at(1)=0.750")


def test_range_radius_flags_and_directions() -> None:
    part = apgstmd.evaluate(FOUND, BOXES, frames=8, start=1, stop=3)
    assert (part.frames, part.first_frame, part.targets) == (2, 1, 2)
    assert "do not count" in part.notes[0]
    assert apgstmd.evaluate(FOUND, BOXES).frames_from == "named"
    assert apgstmd.evaluate(FOUND, BOXES, radius=0.5, margin=0.0).true_detections == 3, "inside the box"
    boxes = BOXES | {"visible": [True, False, True, True], "ignore": [0, 0, 1, 0]}
    assert (apgstmd.evaluate(FOUND, boxes).targets, apgstmd.evaluate(FOUND, boxes).neutral_detections) == (2, 2)
    moving = BOXES | {"x": [18.5, 22.5, 26.5, 30.5], "id": [3, 3, 3, 3]}
    found = {"frame": [1, 2], "x": [24, 28], "y": [20, 20], "score": [1, 1], "direction": [math.pi / 2, np.nan]}
    assert apgstmd.evaluate(found, moving).everything.direction_error == pytest.approx(math.pi / 2)
    nothing: dict[str, Any] = {name: [] for name in FOUND}
    empty = apgstmd.evaluate(nothing, BOXES)
    assert (empty.area, len(empty.curve), empty.best_f1.point, empty.rate_at(5)) == (0.0, 0, None, 0.0)


def test_every_form_gives_the_same(tmp_path: Path) -> None:
    scene = small()
    out = tmp_path / "found"
    run = apgstmd.run(scene, speed=1.0, out=out)
    folder = scene.save(tmp_path / "scene")
    expected = apgstmd.evaluate(run, scene)
    assert expected.frames_from == "run.json"
    assert expected.targets == 40
    assert expected.rate_at(1) > 0.3
    structured = np.zeros(len(run.detections), [("frame", "i4"), ("x", "f4"), ("y", "f4"), ("score", "f4")])
    for name in structured.dtype.names or ():
        structured[name] = run.detections.columns[name]
    forms: list[tuple[Any, Any]] = [
        (out, folder),
        (str(out / "detections.csv"), folder / "truth.csv"),
        (run.detections, scene.truth),
        (run.detections.columns, folder / "scene.toml"),
        (structured, scene.truth.columns),
    ]
    for found, truth in forms:
        got = apgstmd.evaluate(found, truth, frames=40)
        assert got.area == pytest.approx(expected.area)
        np.testing.assert_allclose(got.curve.detection_rate, expected.curve.detection_rate)
        np.testing.assert_allclose(got.curve.false_alarms, expected.curve.false_alarms)


def test_steps_of_a_run_are_no_misses() -> None:
    scene = small()
    run = apgstmd.run(scene, speed=2.0, step=2, start=4)
    e = apgstmd.evaluate(run, scene)
    assert (e.frames, e.targets, e.first_frame, e.last_frame) == (18, 18, 4, 38)


def test_the_page(tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    apgstmd.evaluate(FOUND, BOXES, frames=4, html=page)
    text = page.read_text(encoding="utf-8")
    assert text.count("<svg") == 2
    assert "0.500" in text
    with pytest.raises(RuntimeError, match="cannot write"):
        apgstmd.evaluate(FOUND, BOXES, frames=4, html=tmp_path / "no" / "report.html")


@pytest.mark.parametrize(
    ("found", "boxes", "options", "error", "match"),
    [
        ("nowhere", BOXES, {}, FileNotFoundError, "nowhere"),
        (FOUND, "nowhere", {}, FileNotFoundError, "nowhere"),
        (3, BOXES, {}, TypeError, "detections must be a path or columns"),
        ({"frame": [0]}, BOXES, {}, TypeError, "no column 'x'"),
        (FOUND, FOUND, {}, TypeError, "truth have no column 'w'"),
        (FOUND | {"x": [1, 2]}, BOXES, {}, ValueError, "one length"),
        (FOUND | {"x": [[1]] * 8}, BOXES, {}, ValueError, "one dimension"),
        (FOUND | {"frame": [-1] * 8}, BOXES, {}, ValueError, "holds -1"),
        (FOUND | {"frame": [0.5] * 8}, BOXES, {}, ValueError, "whole numbers"),
        (FOUND | {"score": [np.nan] * 8}, BOXES, {}, ValueError, "detection 0 .* score = NaN"),
        (FOUND, BOXES | {"w": [math.inf] * 4}, {}, ValueError, "truth box 0 .* width = inf"),
        (FOUND, BOXES, {"frames": 0}, ValueError, "frames"),
        (FOUND, BOXES, {"start": 9}, ValueError, "9"),
        (FOUND, BOXES, {"start": 3, "stop": 2}, ValueError, "stop"),
        (FOUND, BOXES, {"radius": -1.0}, ValueError, "radius is -1 px"),
    ],
)
def test_what_cannot_be_judged(
    found: Any, boxes: Any, options: dict[str, Any], error: type[Exception], match: str
) -> None:
    with pytest.raises(error, match=match):
        apgstmd.evaluate(found, boxes, **options)


def test_a_broken_file_names_its_line(tmp_path: Path) -> None:
    file = tmp_path / "found.csv"
    file.write_text("frame,x,y,score\n0,1,2,3\n0,1,2,x\n")
    with pytest.raises(RuntimeError, match=r"found\.csv: line 3: found score = \"x\""):
        apgstmd.evaluate(file, BOXES)
