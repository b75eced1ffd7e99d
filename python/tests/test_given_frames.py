"""`run` over frames that Python has: the rows are those of the same frames as files."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

import apgstmd
from scenes import HEIGHT, WIDTH, textured_square, write_png

FRAMES = list(textured_square(40))
ONE: dict[str, Any] = {"speed": 1.0, "rejection": "off", "threads": 1}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("frames")
    for t, frame in enumerate(FRAMES):
        write_png(path / f"f{t:03}.png", frame)
    return path


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("clip") / "grey.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=8)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "gray"
        for frame in FRAMES:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="gray")))
        container.mux(stream.encode())
    return path


def assert_same(found: apgstmd.Run, wanted: apgstmd.Run, *, time: bool = True) -> None:
    for table, other in ((found.detections, wanted.detections), (found.tracks, wanted.tracks)):
        for name, column in other.columns.items():
            if name != "name" and (time or name != "time"):
                equal_nan = column.dtype.kind == "f"
                assert np.array_equal(table.columns[name], column, equal_nan=equal_nan), name
    assert found.frames == wanted.frames and len(wanted.detections) > 0


def again(frames: Iterable[NDArray[np.uint8]]) -> Iterator[NDArray[np.uint8]]:
    """One array for all frames, as a camera may have it."""
    buffer = np.empty((HEIGHT, WIDTH), np.uint8)
    for frame in frames:
        buffer[:] = frame
        yield buffer


FORMS: dict[str, Callable[[], Any]] = {
    "list": lambda: FRAMES,
    "array": lambda: np.array(FRAMES),
    "strides": lambda: np.array(FRAMES).transpose(2, 1, 0)[::-1].copy()[::-1].transpose(2, 1, 0),
    "iterator": lambda: iter(FRAMES),
    "one buffer": lambda: again(FRAMES),
    "uint16": lambda: (frame.astype(np.uint16) * 257 for frame in FRAMES),
    "one channel": lambda: np.array(FRAMES)[..., None],
}


@pytest.mark.parametrize("form", FORMS)
def test_the_rows_are_those_of_the_command_line(form: str, folder: Path, tmp_path: Path) -> None:
    # 1: what the program itself prints for the files.
    command = [sys.executable, "-m", "apgstmd", "run", str(folder), "--out", "-", "--speed", "1", "--rejection", "off", "--fps", "8", "--quiet"]
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    apgstmd.run(FORMS[form](), fps=8, out=tmp_path / "out", **ONE)
    rows = (tmp_path / "out" / "detections.csv").read_text().splitlines()

    def without_name(text: Iterable[str]) -> list[list[str]]:
        return [line.split(",")[:1] + line.split(",")[2:] for line in text]

    if form == "uint16":
        # 257 v / 65535 is v / 255, but not always the same float.
        assert len(rows) == len(printed.splitlines())
    else:
        assert without_name(rows) == without_name(printed.splitlines())
        assert_same(apgstmd.run(FORMS[form](), fps=8, **ONE), apgstmd.run(folder, fps=8, **ONE))


def test_a_bank_and_all_options(folder: Path) -> None:
    options: dict[str, Any] = {"speeds": [1.0], "start": 3, "stop": "4.5s", "step": 1, "fps": 8}
    assert_same(apgstmd.run(iter(FRAMES), **options), apgstmd.run(folder, **options))
    found = apgstmd.run(FRAMES, start=5, stop=9, step=2, **ONE)
    assert found.frames == 2 and set(found.detections.frame) <= {5, 7}
    assert set(found.detections.name) <= {"frame_000005", "frame_000007"}
    assert np.isnan(found.detections.time).all()


def test_float_and_few_bits() -> None:
    wanted = apgstmd.run([frame / 255 for frame in FRAMES], **ONE)
    found = apgstmd.run(np.array(FRAMES, np.float64) / 255, **ONE)
    assert_same(found, wanted)
    deep = apgstmd.run([frame.astype(np.uint16) << 2 for frame in FRAMES], bit_depth=10, **ONE)
    assert deep.summary["input"]["bit_depth"] == 10 and len(deep.detections) > 10
    few = apgstmd.run([frame > 100 for frame in FRAMES], **ONE)
    assert_same(few, apgstmd.run([(frame > 100).astype(np.float32) for frame in FRAMES], **ONE))
    assert_same(apgstmd.run([(frame > 100).astype(np.uint8) for frame in FRAMES], bit_depth=1, **ONE), few)


def test_pyav(clip: Path, folder: Path) -> None:
    wanted = apgstmd.run(folder, fps=8, **ONE)
    assert_same(apgstmd.run(clip, **ONE), wanted)
    with av.open(str(clip)) as container:
        assert_same(apgstmd.run(container, **ONE), wanted)
    with av.open(str(clip)) as container:
        assert_same(apgstmd.run(container.streams.video[0], **ONE), wanted)
    with av.open(str(clip)) as container:
        assert_same(apgstmd.run(container.decode(video=0), fps=8, **ONE), wanted)


def test_pyav_in_colour(tmp_path: Path) -> None:
    path = tmp_path / "colour.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=8)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "bgr0"
        for frame in FRAMES:
            colour = np.stack([frame, frame // 2, frame // 3], axis=2)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(colour, format="rgb24")))
        container.mux(stream.encode())
    with av.open(str(path)) as container, pytest.raises(ValueError, match=r"pixels bgr0, but colour is not made grey"):
        apgstmd.run(container, **ONE)
    wanted = apgstmd.run([np.stack([frame, frame // 2, frame // 3], axis=2) for frame in FRAMES], grey="rgb", **ONE)
    with av.open(str(path)) as container:
        assert_same(apgstmd.run(container, grey="rgb", **ONE), wanted, time=False)


def test_opencv(clip: Path, folder: Path) -> None:
    wanted = apgstmd.run([np.stack([frame] * 3, axis=2) for frame in FRAMES], grey="rgb", fps=8, **ONE)
    capture = cv2.VideoCapture(str(clip))
    found = apgstmd.run(capture, grey="bgr", **ONE)
    assert_same(found, wanted, time=False)
    np.testing.assert_allclose(found.detections.time, wanted.detections.time, rtol=0, atol=1e-3)
    capture.release()
    with pytest.raises(ValueError, match="the capture is not open"):
        apgstmd.run(capture)
    capture = cv2.VideoCapture(str(clip))
    with pytest.raises(ValueError, match=r"3 channels, but colour is not made grey unasked: say grey='rgb' or grey='bgr'"):
        apgstmd.run(capture)
    capture.release()


def test_colour_is_asked_for() -> None:
    colour = [np.stack([frame, frame // 2, frame // 3], axis=2) for frame in FRAMES]
    for frames in (colour, np.array(colour)):
        with pytest.raises(ValueError, match=r"frame @ \[0.299, 0.587, 0.114\]"):
            apgstmd.run(frames, **ONE)
        rgb = apgstmd.run(frames, grey="rgb", **ONE)
        assert_same(apgstmd.run([frame[..., ::-1] for frame in colour], grey="bgr", **ONE), rgb)
    detector = apgstmd.Detector((HEIGHT, WIDTH), **ONE)
    rows = [tuple(row) for frame in colour for row in detector.process(frame).detections]
    assert [row[3:8] for row in rgb.detections] == rows
    with pytest.raises(ValueError, match="grey is 'gbr', but it must be 'rgb' or 'bgr'"):
        apgstmd.run(colour, grey="gbr")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="grey is for arrays"):
        apgstmd.run(".", grey="rgb")


@pytest.mark.parametrize(
    ("frames", "error", "message"),
    [
        (3, TypeError, "an OpenCV capture, not int"),
        (np.zeros((64, 96), np.uint8), ValueError, r"this one has \(64, 96\): put a single frame into a list"),
        (np.zeros((64, 96, 3), np.uint8), ValueError, "looks like one frame in colour"),
        ([np.zeros((64, 96), np.int64)], TypeError, "must be uint8, uint16, float32 or float64"),
        (["f0.png"], TypeError, "NumPy array of uint8.*, not str"),
        ([], RuntimeError, "there are no frames"),
        ([np.zeros((64, 96)), np.zeros((64, 95))], RuntimeError, "frame 1 of the frames given: it is 64 x 95"),
        ([np.full((64, 96), 255.0)], RuntimeError, "frame 0 of the frames given: .*is 255, outside"),
    ],
)
def test_what_cannot_be_used(frames: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        apgstmd.run(frames, **ONE)
    with pytest.raises(error, match=message):
        list(apgstmd.watch(frames, **ONE))


class Trouble(Exception):
    """Of the iterable's own kind."""


@pytest.mark.parametrize("error", [Trouble, KeyboardInterrupt])
def test_what_an_iterable_raises_is_raised(error: type[BaseException], tmp_path: Path) -> None:
    table = tmp_path / "out" / "detections.csv"

    def failing(until: Callable[[], bool]) -> Iterator[NDArray[np.uint8]]:
        yield from FRAMES[:20]
        # An interrupt may be heard before the first frame is through.
        end = time.monotonic() + 60
        while not until() and time.monotonic() < end:
            time.sleep(0.01)
        raise error("no more")

    with pytest.raises(error, match="no more"):
        apgstmd.run(failing(table.exists), out=table.parent, **ONE)
    assert table.exists()
    with pytest.raises(error, match="no more"):
        for _ in apgstmd.watch(failing(lambda: True), **ONE):
            pass
    # And the next one is a fresh one.
    assert apgstmd.run(FRAMES[:5], **ONE).frames == 5


def test_a_bad_frame_can_be_left_out() -> None:
    bad = [*FRAMES[:5], FRAMES[5][1:], *FRAMES[6:]]
    found = apgstmd.run(bad, on_error="skip", **ONE)
    assert [skipped["frame"] for skipped in found.summary["skipped"]] == [5]


@pytest.mark.parametrize("options", [ONE, {"speeds": [1.0]}], ids=["detector", "bank"])
def test_a_stream_has_the_same_rows(options: dict[str, Any], folder: Path) -> None:
    for input in (folder, FRAMES):
        wanted = apgstmd.run(input, fps=8, **options)
        seen = list(apgstmd.watch(input, fps=8, **options))
        assert [one.frame for one in seen] == list(range(40))
        assert [one.time for one in seen] == [t / 8 for t in range(40)]
        rows = [row for one in seen for row in one.detections]
        assert rows == list(wanted.detections) and len(rows) > 0
        points = sorted((point for one in seen for point in one.tracks), key=lambda point: (point.frame, point.track))
        assert len(points) == len(wanted.tracks) > 0
        for point, written in zip(points, wanted.tracks, strict=True):
            assert (point.frame, point.track, point.age, point.state) == (written.frame, written.track, written.age, written.state)
            # The file rounds to thousandths of a pixel.
            assert point.x == pytest.approx(written.x, abs=0.00051) and point.vy == pytest.approx(written.vy, abs=0.000051)
    assert repr(seen[3]) == f"RunFrame(frame_000003, {len(seen[3].detections)} detections, {len(seen[3].tracks)} points of tracks)"


def tasks() -> int:
    return len(os.listdir("/proc/self/task"))


def tasks_fall_to(most: int) -> bool:
    """A thread that was waited for is listed for a moment longer."""
    end = time.monotonic() + 10
    while tasks() > most and time.monotonic() < end:
        time.sleep(0.01)
    return tasks() <= most


@pytest.mark.parametrize("end", ["closed", "left alone", "never begun", "through"])
def test_a_stream_leaves_nothing_behind(end: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    before = tasks()
    taken = 0

    def endless() -> Iterator[NDArray[np.uint8]]:
        nonlocal taken
        while taken < 50 or end != "through":
            yield FRAMES[taken % 40]
            taken += 1

    stream = apgstmd.watch(endless(), **ONE)
    if end == "through":
        assert len(list(stream)) == 50
    elif end != "never begun":
        assert [next(stream).frame for _ in range(5)] == [0, 1, 2, 3, 4]
        assert len(list(tmp_path.iterdir())) == 1 and tasks() > before
    if end == "closed":
        stream.close()
        assert list(stream) == []
    del stream
    assert list(tmp_path.iterdir()) == [] and tasks_fall_to(before)
    # It reads ahead, but not without end.
    assert taken < 200


def test_a_stream_with_files(tmp_path: Path) -> None:
    out = tmp_path / "out"
    stream = apgstmd.watch(FRAMES, out=out, **ONE)
    for _ in range(10):
        last = next(stream)
    stream.close()
    summary = json.loads((out / "run.json").read_text())
    assert summary["interrupted"] and summary["error"] is None and 10 <= summary["frames"] < 40
    assert (out / "tracks.csv").exists() and last.frame == 9
    assert len(list(apgstmd.watch(FRAMES, out=out, force=True, report=tmp_path / "page.html", **ONE))) == 40
    assert json.loads((out / "run.json").read_text())["frames"] == 40 and (tmp_path / "page.html").exists()


def test_streams_beside_each_other() -> None:
    one, other = (apgstmd.watch(FRAMES, **ONE) for _ in range(2))
    next(other)
    one.close()
    assert len(list(other)) == 39
    both = [apgstmd.watch(FRAMES, fps=8, **ONE) for _ in range(2)]
    for a, b in zip(*both, strict=True):
        assert list(a.detections) == list(b.detections)


def test_a_result_does_not_wait_for_all_frames() -> None:
    came: list[float] = []

    def camera() -> Iterator[NDArray[np.uint8]]:
        for frame in FRAMES[:8]:
            time.sleep(0.05)
            came.append(time.monotonic())
            yield frame

    for seen in apgstmd.watch(camera(), **ONE):
        # One more may be on its way while this one is computed; the rest is room for a busy machine.
        assert len(came) <= seen.frame + 4
