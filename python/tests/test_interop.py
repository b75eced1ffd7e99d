"""Tables as other packages have them."""

from __future__ import annotations

import html.parser
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import apgstmd


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> tuple[apgstmd.Run, Path]:
    mot = tmp_path_factory.mktemp("mot") / "tracks.txt"
    return apgstmd.run(apgstmd.synth("demo"), speed=1.0, stop=50, mot=mot, box_size=7.5), mot


def test_data_frames(found: tuple[apgstmd.Run, Path]) -> None:
    run = found[0]
    for table in (run.detections, run.tracks, run.camera, run.detections[:0]):
        pandas, polars, arrow = table.to_pandas(), table.to_polars(), table.to_arrow()
        for name, column in table.columns.items():
            assert pandas[name].tolist() == polars[name].to_list() == arrow[name].to_pylist() == column.tolist()
        assert list(pandas.columns) == polars.columns == arrow.column_names == list(table.names)
    assert run.detections.to_pandas()["x"].dtype == np.float32
    camera = run.camera.to_pandas()
    assert camera["cut"].dtype == camera["unexplained"].dtype == np.bool_
    assert camera["detections"].sum() == len(run.detections)
    # What comes out goes in again: the evaluation takes a data frame.
    truth = apgstmd.synth("demo")
    summary = {"frames": run.frames}
    given = apgstmd.evaluate(run.detections.to_pandas(), truth, frames=summary["frames"])
    assert given.area == apgstmd.evaluate(run.detections, truth, frames=run.frames).area > 0


def test_supervision(found: tuple[apgstmd.Run, Path]) -> None:
    run = found[0]
    boxes = run.detections.to_supervision(box_size=8)
    assert len(boxes) == len(run.detections) > 20
    centre = boxes.get_anchors_coordinates(anchor=__import__("supervision").Position.CENTER)
    places = np.column_stack([run.detections.x, run.detections.y]) + 0.5
    assert np.abs(centre.astype(float) - places).max() < 1e-4
    assert boxes.tracker_id is not None and boxes.tracker_id.tolist() == run.detections.trace.tolist()
    np.testing.assert_array_equal(boxes.data["direction"], run.detections.direction)
    # Of a bank: the size of the member that saw it.
    bank = apgstmd.BankDetections(
        **{name: np.array([12], np.float32) for name in ("x", "y", "score", "direction", "speed", "size", "contrast")},
        trace=np.array([3]),
    )
    assert bank.to_supervision().xyxy.tolist() == [[6.5, 6.5, 18.5, 18.5]]


def test_mot_is_what_the_command_line_writes(found: tuple[apgstmd.Run, Path], tmp_path: Path) -> None:
    run, mot = found
    written = np.loadtxt(mot, delimiter=",")
    given = np.loadtxt(run.tracks.to_mot(tmp_path / "own.txt", box_size=7.5).splitlines(), delimiter=",")
    # A thousandth of a pixel: tracks.csv is rounded to that.
    order = np.lexsort((written[:, 1], written[:, 0]))
    np.testing.assert_allclose(given, written[order], atol=1.1e-3)
    assert (tmp_path / "own.txt").read_text() == run.tracks.to_mot(box_size=7.5)
    assert {row.split(",")[1] for row in run.detections.to_mot().splitlines()} == {"-1"}
    with pytest.raises(ValueError, match="box_size is 0, but it must be more than 0 px"):
        run.tracks.to_mot(box_size=0)


class Tags(html.parser.HTMLParser):
    """Counts tags, and asserts that they close in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.seen.append(tag)
        if not (self.get_starttag_text() or "").endswith("/>"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: object) -> None:
        self.seen.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def tags(table: apgstmd.Detections | apgstmd.Tracks) -> list[str]:
    parser = Tags()
    parser.feed(table._repr_html_())
    assert not parser.open
    return parser.seen


def test_notebook(found: tuple[apgstmd.Run, Path]) -> None:
    run = found[0]
    seen = tags(run.tracks)
    assert seen.count("polyline") == len(np.unique(run.tracks.track)) and seen.count("tr") == 11
    assert tags(run.detections[:3]).count("tr") == 4
    assert "svg" not in tags(run.tracks[:0])
    sly = run.detections[:1]
    sly.name = np.array(["<script>alert(1)</script>"])
    assert "<script>" not in sly._repr_html_() and "&lt;script&gt;" in sly._repr_html_()
    # A long run does not make a page of megabytes.
    many = run.tracks[np.arange(100_000) % len(run.tracks)]
    assert len(many._repr_html_()) < 200_000


def test_what_is_missing_is_named() -> None:
    code = """
import sys
for name in ("pandas", "polars", "pyarrow", "supervision", "matplotlib", "rerun"):
    sys.modules[name] = None
import apgstmd, numpy as np
found = apgstmd.Detections(x=(z := np.zeros(1, np.float32)), y=z, score=z, direction=z, trace=np.zeros(1, int))
out = apgstmd.Output(found, z[None], z[None], (0, 0), apgstmd.EgoMotion(0, 1, 0, False), False)
for call in (found.to_pandas, found.to_polars, found.to_arrow, found.to_supervision,
             lambda: apgstmd.plot.response(out), lambda: apgstmd.rerun.log(0, z[None], out)):
    try:
        call()
    except ImportError as error:
        print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    extras = [line.rsplit("apgstmd[", 1)[1].rstrip("]'") for line in done.stdout.splitlines()]
    assert extras == ["pandas", "polars", "arrow", "supervision", "plot", "rerun"], done.stdout
    import tomllib

    project = Path(__file__).parents[2] / "pyproject.toml"
    # That of `batch` needs a cluster to be missed: test_batch.py.
    declared = set(tomllib.loads(project.read_text())["project"]["optional-dependencies"])
    assert {*extras, "batch"} == declared


def test_import_is_quick_and_light() -> None:
    code = "import sys, apgstmd; print([m for m in ('pandas', 'polars', 'matplotlib', 'rerun') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
