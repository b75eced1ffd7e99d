"""The programs in `examples`: each runs, on a scene of its own making, and finds what is in it."""

from __future__ import annotations

import importlib
import importlib.util
import zipfile
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import apgstmd
import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_all_are_on_their_page() -> None:
    page = (EXAMPLES.parent / "docs" / "examples.md").read_text(encoding="utf-8")
    for path in EXAMPLES.glob("*.py"):
        assert f"literalinclude}} ../examples/{path.name}" in page, f"docs/examples.md does not show {path.name}"


def test_webcam(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cv2: Any = importlib.import_module("cv2")
    clip, marked = tmp_path / "clip.avi", tmp_path / "marked.avi"
    scene = apgstmd.synth("demo", frames=40)
    height, width = scene.shape
    writer = cv2.VideoWriter(str(clip), cv2.VideoWriter.fourcc(*"FFV1"), 30, (width, height))
    for frame in scene:
        writer.write(np.repeat(np.rint(255 * frame).astype(np.uint8)[:, :, None], 3, axis=2))
    writer.release()

    webcam = example("webcam_opencv")
    webcam.main([str(clip), "--speed", "1", "--most", "3", "--out", str(marked)])
    assert "40 frames" in capsys.readouterr().out
    reader = cv2.VideoCapture(str(marked))
    frames = [picture for there, picture in iter(reader.read, (False, None)) if there]
    assert len(frames) == 40
    # Rings are the only colour in a grey picture.
    coloured = [int((np.ptp(picture.astype(int), axis=2) > 60).sum()) for picture in frames]
    assert coloured[0] == 0 and coloured[-1] > 50

    with pytest.raises(SystemExit):
        webcam.main([str(tmp_path / "none.avi")])
    assert "nothing comes from" in capsys.readouterr().err


def message(picture: np.ndarray[Any, Any], encoding: str, padding: int = 0) -> SimpleNamespace:
    """What to_array reads of a sensor_msgs/Image."""
    height, width = picture.shape[:2]
    rows = picture.reshape(height, -1).view(np.uint8)
    rows = np.concatenate([rows, np.full((height, padding), 9, np.uint8)], axis=1)
    big = picture.dtype.byteorder == ">"
    step = rows.shape[1]
    return SimpleNamespace(height=height, width=width, encoding=encoding, step=step, data=rows.tobytes(), is_bigendian=big)


def test_ros2_pictures_and_boxes() -> None:
    node = example("ros2_node")
    grey = np.arange(20 * 16, dtype=np.uint16).reshape(20, 16)
    for kind, encoding in ((np.uint8, "mono8"), ("<u2", "mono16"), (">u2", "mono16")):
        picture = grey.astype(kind)
        got = node.to_array(message(picture, encoding, padding=6))
        assert got.dtype == (np.uint8 if encoding == "mono8" else np.uint16)
        assert np.array_equal(got, picture.astype(got.dtype))
    colour = np.random.default_rng(1).integers(0, 256, (20, 16, 4), np.uint8)
    for encoding, expected in (("rgba8", colour[:, :, :3]), ("bgra8", colour[:, :, 2::-1])):
        assert np.array_equal(node.to_array(message(colour, encoding, padding=4)), expected)
    three = np.ascontiguousarray(colour[:, :, :3])
    assert np.array_equal(node.to_array(message(three, "rgb8")), three)
    assert np.array_equal(node.to_array(message(three, "bgr8")), three[:, :, ::-1])
    # What it gives is what a detector takes.
    apgstmd.Detector((20, 16), bit_depth=12).process(node.to_array(message(grey.astype(">u2"), "mono16")))
    with pytest.raises(ValueError, match="'yuv422'.*one of mono8"):
        node.to_array(message(three, "yuv422"))
    two = np.array([2], np.float32)
    found = apgstmd.Detections(x=two, y=two, score=two, direction=two, trace=np.array([7]))
    assert node.boxes(found, 5) == [("7", 2.0, 2.0, 2.0, 5.0)]


def test_thermal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    thermal = example("thermal_14bit")
    rows = thermal.main(["--speeds", "1"])
    out = capsys.readouterr().out
    scene = thermal.make_stack("again.tif")
    assert Path("again.tif").read_bytes() == Path("thermal.tif").read_bytes()
    result = apgstmd.evaluate(rows, scene.truth, frames=len(scene), start=30)
    assert result.area > 0.8 and "120 frames, counts 70" in out
    # As it comes out of the camera, on the scale of 14 bits, a bank lists nothing of it.
    import tifffile

    bank = apgstmd.Bank(scene.shape, speeds=[1], bit_depth=14)
    assert sum(len(bank.process(frame).detections) for frame in tifffile.imread("thermal.tif")) == 0
    tifffile.imwrite("still.tif", np.full((40, 32, 32), 7000, np.uint16), photometric="minisblack")
    assert thermal.main(["--stack", "still.tif", "--speeds", "1"])["frame"] == []
    tifffile.imwrite("flat.tif", np.zeros((4, 4), np.uint8))
    with pytest.raises(SystemExit):
        thermal.main(["--stack", "flat.tif"])


def test_export(tmp_path: Path) -> None:
    export = example("export_cvat_mot")
    scene = apgstmd.synth("demo", frames=60)
    scene.save(tmp_path / "scene")
    export.main([str(tmp_path / "scene"), "--out", str(tmp_path / "labels"), "--speed", "1", "--box-size", "6"])
    found = apgstmd.run(tmp_path / "scene", speed=1.0)
    tracks = found.tracks

    with zipfile.ZipFile(tmp_path / "labels" / "cvat-mot.zip") as archive:
        assert sorted(archive.namelist()) == ["gt/gt.txt", "gt/labels.txt"]
        lines = archive.read("gt/gt.txt").decode().splitlines()
    assert len(lines) == len(tracks) > 0
    assert all(len(line.split(",")) == 9 and line.endswith(",1,1,1") for line in lines)

    root = ElementTree.parse(tmp_path / "labels" / "cvat-video.xml").getroot()
    for element in root.iter("track"):
        points = tracks[tracks.track == int(element.attrib["id"])]
        boxes = list(element)
        shown = [box for box in boxes if box.attrib["outside"] == "0"]
        assert [int(box.attrib["frame"]) for box in shown] == points.frame.tolist()
        middle = (float(shown[0].attrib["xtl"]) + float(shown[0].attrib["xbr"])) / 2 - 0.5
        assert middle == pytest.approx(points.x[0], abs=0.01)
        # It ends where the track does.
        assert len(boxes) - len(shown) == (points.frame[-1] < 59)
    assert {int(element.attrib["id"]) for element in root.iter("track")} == set(tracks.track.tolist())
    truth = apgstmd.evaluate(tmp_path / "labels" / "tracks.txt", tmp_path / "scene", frames=60)
    assert truth.tracks is not None and truth.tracks.points == len(tracks)
