"""Scenes: frames on demand, truth, files."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import apgstmd
from scenes import write_png

SMALL: dict[str, Any] = {
    "width": 96,
    "height": 64,
    "rate": 100,
    "frames": 40,
    "background": {"kind": "uniform", "luminance": 0.85},
    "target": [{"path": {"kind": "straight", "start": [20, 32], "speed": 100.0}, "stop": None}],
}


def small(**changes: Any) -> apgstmd.Scene:
    return apgstmd.synth(SMALL | changes)


def test_frames_come_as_they_are_asked_for() -> None:
    scene = small(noise=0.01)
    assert (len(scene), scene.shape, scene.rate) == (40, (64, 96), 100.0)
    frames = list(scene)
    assert [frame.dtype for frame in frames[:2]] == [np.float32, np.float32]
    assert all(frame.shape == (64, 96) for frame in frames)
    np.testing.assert_array_equal(scene[7], frames[7])
    np.testing.assert_array_equal(scene[-1], frames[39])
    np.testing.assert_array_equal(scene[np.int64(3)], frames[3])
    np.testing.assert_array_equal(scene[30:2:-9], np.stack(frames)[30:2:-9])
    assert scene[5:5].shape == (0, 64, 96)
    for index in (40, -41):
        with pytest.raises(IndexError, match="40 frames"):
            scene[index]
    with ThreadPoolExecutor(4) as pool:
        for frame, again in zip(frames, pool.map(scene.__getitem__, range(40)), strict=True):
            np.testing.assert_array_equal(frame, again)


def test_a_black_square_where_the_truth_says() -> None:
    scene = small()
    assert apgstmd.Truth.names == ("frame", "id", "x", "y", "w", "h", "visible", "contrast")
    assert [column.dtype.kind for column in scene.truth.columns.values()] == list("iiffffbf")
    assert scene.truth[5][:7] == (5, 0, 23.0, 30.0, 5.0, 5.0, True)
    assert scene.truth[5].contrast == pytest.approx(0.85)
    for row, frame in zip(scene.truth, scene, strict=True):
        x, y = int(row.x), int(row.y)
        assert (frame[y : y + 5, x : x + 5] == 0).all()
        assert frame.sum() == pytest.approx((64 * 96 - 25) * 0.85, rel=1e-5)


@pytest.mark.parametrize("form", ["dict", "text", "path", "str"])
def test_every_form_is_the_same_scene(form: str, tmp_path: Path) -> None:
    expected = small(seed=4, background={"kind": "natural"})
    file = tmp_path / "small.toml"
    file.write_text(expected.toml)
    given: Any = {"dict": SMALL | {"background": {"kind": "natural"}}, "text": expected.toml, "path": file, "str": str(file)}
    scene = apgstmd.synth(given[form], seed=4, frames=12)
    assert len(scene) == 12
    np.testing.assert_array_equal(scene[11], expected[11])
    again = pickle.loads(pickle.dumps(scene))
    assert again.toml == scene.toml


def test_built_in_scenes() -> None:
    assert repr(apgstmd.synth("paper")) == "Scene(1000 frames of 250 x 500, 1000 Hz)"
    demo = apgstmd.synth("demo", frames=3, seed=9)
    assert len(demo) == 3
    assert set(demo.truth.id) == {0, 1, 2, 3}
    assert not np.array_equal(demo[0], apgstmd.synth("demo", seed=10)[0])


def test_saved_as_the_command_line_does(tmp_path: Path) -> None:
    scene = small(noise=0.01)
    out = scene.save(tmp_path / "out", bit_depth=16, threads=2)
    assert len(list(out.glob("scene_*.png"))) == 40
    lines = (out / "truth.csv").read_text().splitlines()
    assert lines[0] == ",".join(apgstmd.Truth.names)
    assert lines[6] == "5,0,23.000,30.000,5.000,5.000,1,0.8500"
    assert apgstmd.synth(out / "scene.toml").toml == scene.toml
    with pytest.raises(RuntimeError, match="earlier scene"):
        scene.save(out)
    scene.save(out, force=True)
    with pytest.raises(ValueError, match="8 or 16"):
        scene.save(tmp_path / "other", bit_depth=12)  # type: ignore[arg-type]


def test_run_draws_it_on_the_way(tmp_path: Path) -> None:
    scene = small()
    found = apgstmd.run(scene, speed=1.0)
    detector = apgstmd.Detector(scene.shape, speed=1.0)
    rows = [(t, t / 100, *row) for t, frame in enumerate(scene) for row in detector.process(frame).detections]
    assert [(row.frame, row.time, *row[3:8]) for row in found.detections] == rows
    assert rows
    assert found.summary["input"]["scene"]["width"] == 96


def test_a_panorama_beside_its_file(tmp_path: Path) -> None:
    picture = np.arange(30 * 50, dtype=np.uint16).reshape(30, 50) * 40
    write_png(tmp_path / "hills.png", picture)
    file = tmp_path / "pan.toml"
    file.write_text("width = 50\nheight = 30\nframes = 1\n[background]\nkind = 'panorama'\nfile = 'hills.png'\n")
    np.testing.assert_allclose(apgstmd.synth(file)[0], picture / 65535, atol=1e-6)
    background = {"kind": "panorama", "file": tmp_path / "hills.png"}
    scene = apgstmd.synth({"width": 50, "height": 30, "frames": 1, "background": background})
    np.testing.assert_allclose(scene[0], picture / 65535, atol=1e-6)
    (tmp_path / "hills.png").unlink()
    with pytest.raises(RuntimeError, match=r"hills\.png.*no such file"):
        apgstmd.synth(file)


@pytest.mark.parametrize(
    ("scene", "error", "match"),
    [
        ("nowhere.toml", FileNotFoundError, r"nowhere\.toml"),
        (3, TypeError, "not int"),
        ("width = 3\nheigth = 4\n", ValueError, "line 2, column 1.*heigth"),
        ({"width": 0}, ValueError, "width is 0"),
        ({"widht": 96}, ValueError, "widht"),
        ({"width": object()}, TypeError, r"scene\.width must be a number"),
        ({"target": [{"path": {"kind": object()}}]}, TypeError, r"scene\.target\[0\]\.path\.kind"),
        (SMALL | {"target": [{"path": {"kind": "straight", "start": [500, 3]}}]}, ValueError, "never in the picture"),
    ],
)
def test_scenes_that_cannot_be(scene: Any, error: type[Exception], match: str) -> None:
    with pytest.raises(error, match=match):
        apgstmd.synth(scene)


@pytest.mark.parametrize("options", [{"frames": 0}, {"seed": -1}, {"seed": 2**63}])
def test_numbers_out_of_range(options: dict[str, int]) -> None:
    with pytest.raises(ValueError, match=next(iter(options))):
        apgstmd.synth("demo", **options)
