"""A folder of pictures at once."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import apgstmd
from scenes import HEIGHT, WIDTH, panned, textured_square, write_png

FRAMES = list(textured_square(40))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("frames")
    for t, frame in enumerate(FRAMES):
        # 2 before 10: the natural order is not that of the names.
        write_png(path / f"f{t}.png", frame)
    return path


@pytest.mark.parametrize(
    "options",
    [
        {"speed": 1.0},
        {"speed": 1.0, "preset": "paper", "rejection": "off", "localise": "response"},
        {"speed": 1.0, "attention_alpha": 0.5, "rejection": "off"},
        {"params": {"rejection": {"mode": "off"}}, "speed": 1.0, "threshold": 1e-9, "threads": 1},
    ],
    ids=["practical", "paper", "keyword", "dict"],
)
def test_a_folder_is_a_loop_over_a_detector(folder: Path, options: dict[str, Any]) -> None:
    found = apgstmd.run(folder, fps=8, **options)
    detector = apgstmd.Detector((HEIGHT, WIDTH), **options)
    rows = [
        (t, f"f{t}.png", t / 8, *row)
        for t, frame in enumerate(FRAMES)
        for row in detector.process(frame).detections
    ]
    assert [row[:-3] for row in found.detections] == rows
    assert rows
    assert found.frames == len(FRAMES)
    assert found.out is None
    assert found.summary["params"] == detector.params


def test_results_are_kept_where_asked(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    found = apgstmd.run(folder, out=out, speed=1.0, formats=["jsonl"], dump=["P", "E"], dump_frames=[3, 5])
    assert found.out == out
    assert repr(found) == f"Run(40 frames, {len(found.detections)} detections, 1 track, out={str(out)!r})"
    assert json.loads((out / "run.json").read_text()) == found.summary
    assert found.summary["speed"] == 1.0
    assert len((out / "detections.jsonl").read_text().splitlines()) == len(found.detections)
    detector = apgstmd.Detector((HEIGHT, WIDTH), speed=1.0)
    for t, frame in enumerate(FRAMES[:6]):
        detector.process(frame)
        for stage in ("P", "E"):
            file = out / "dump" / f"{stage}_{t:06}.npy"
            assert file.exists() == (t in (3, 5))
            if file.exists():
                assert np.array_equal(np.load(file), detector.stage(stage))
    with pytest.raises(RuntimeError, match="detections.csv is there already from an earlier run"):
        apgstmd.run(folder, out=out)
    assert apgstmd.run(folder, out=out, force=True, stop=3).frames == 3


def test_the_motion_of_the_camera() -> None:
    frames = np.stack(list(panned(30, cut=12, blank=range(20, 24))))
    found = apgstmd.run(frames, fps=25, speed=1.0)
    camera = found.camera
    assert camera.frame.tolist() == list(range(30))
    assert camera.time[25] == 1.0
    assert np.flatnonzero(camera.cut).tolist() == [12, 20, 24]
    assert np.flatnonzero(camera.unexplained).tolist() == [21, 22, 23]
    # The camera goes to the left, the picture to the right.
    assert np.abs(camera.background_x[1:12] - 2).max() < 0.1 and np.abs(camera.background_y[1:12]).max() < 0.1
    assert np.abs(camera.rotation).max() < 0.01 and np.abs(camera.zoom - 1).max() < 0.01
    row = camera[5]
    assert isinstance(row, apgstmd.CameraMotion) and row.frame == 5 and row.cut is False
    assert camera[camera.cut].frame.tolist() == [12, 20, 24]
    assert camera.detections.sum() == len(found.detections)
    # A file has four places of it.
    for seen, row in zip(apgstmd.watch(frames, fps=25, speed=1.0), camera, strict=True):
        assert np.abs(np.subtract(seen.background_shift, (row.background_x, row.background_y))).max() < 6e-5
        assert (seen.ego_motion.unexplained, seen.cut) == (row.unexplained, row.cut)


def test_a_run_goes_on(tmp_path: Path) -> None:
    whole = apgstmd.run(FRAMES, fps=8, speed=1.0)
    options: dict[str, Any] = {"fps": 8, "speed": 1.0, "out": tmp_path / "out", "checkpoint": 5}

    def torn(last: int) -> Iterator[NDArray[np.uint8]]:
        yield from FRAMES[:last]
        raise OSError("the disk is gone")

    with pytest.raises(OSError, match="the disk is gone"):
        apgstmd.run(torn(25), **options)
    assert (tmp_path / "out" / "checkpoint.safetensors").exists()
    with pytest.raises(RuntimeError, match="is there already"):
        apgstmd.run(FRAMES, **options)
    found = apgstmd.run(FRAMES, resume=True, **options)
    assert 5 <= found.summary["resumed_after"] <= 25
    assert found.frames == 40
    for name in ("detections", "tracks", "camera"):
        table, expected = getattr(found, name), getattr(whole, name)
        for column in table.names:
            np.testing.assert_array_equal(getattr(table, column), getattr(expected, column))
    # It is through: nothing is asked for.
    again = apgstmd.run(torn(0), resume=True, **options)
    assert len(again.detections) == len(found.detections) > 0 and again.summary == found.summary
    with pytest.raises(RuntimeError, match="other settings"):
        apgstmd.run(FRAMES, resume=True, **(options | {"speed": 2.0}))


def test_a_watched_scene_goes_on(tmp_path: Path) -> None:
    scene = apgstmd.synth("demo")
    options: dict[str, Any] = {"speed": 1.0, "stop": 50, "checkpoint": 5}
    watched = apgstmd.watch(scene, out=tmp_path / "out", **options)
    assert [next(watched).frame for _ in range(30)] == list(range(30))
    watched.close()
    rest = [seen.frame for seen in apgstmd.watch(scene, out=tmp_path / "out", resume=True, **options)]
    assert 5 <= rest[0] <= 45 and rest == list(range(rest[0], 50))
    found = apgstmd.run(scene, out=tmp_path / "out", resume=True, **options)
    whole = apgstmd.run(scene, speed=1.0, stop=50)
    assert found.frames == 50 and found.detections.name[0].startswith("scene_")
    assert list(found.detections) == list(whole.detections) and list(found.tracks) == list(whole.tracks)


def test_what_resuming_and_large_frames_need(folder: Path, tmp_path: Path) -> None:
    for options in ({"checkpoint": 5}, {"resume": True}):
        with pytest.raises(ValueError, match="name one with out="):
            apgstmd.run(folder, speed=1.0, **options)
    with pytest.raises(ValueError, match="checkpoint is 0, but it must lie between 1"):
        apgstmd.run(folder, out=tmp_path / "out", checkpoint=0)
    with pytest.raises(ValueError, match="--checkpoint is for tables"):
        apgstmd.run(folder, out=tmp_path / "out", checkpoint=5, report=tmp_path / "page.html")
    with pytest.raises(ValueError, match="largest_frame is 300, but it must lie between 1 and 268"):
        apgstmd.run(folder, largest_frame=300)
    write_png(tmp_path / "large.png", np.zeros((1000, 1001), np.uint8))
    with pytest.raises(RuntimeError, match="at most 1 million pixels are read"):
        apgstmd.run(str(tmp_path / "*.png"), speed=1.0, largest_frame=1)
    assert apgstmd.run(str(tmp_path / "*.png"), speed=1.0, largest_frame=2).frames == 1


def test_part_of_a_folder(folder: Path) -> None:
    found = apgstmd.run(folder, start=4, stop=20, step=3, rejection="off", speed=1.0)
    assert found.frames == 6
    assert set(found.detections.frame) <= set(range(4, 20, 3))
    assert apgstmd.run(folder / "f1*.png").frames == 11


def test_a_video(folder: Path, tmp_path: Path) -> None:
    clip = tmp_path / "clip.avi"
    pictures = ["-framerate", "8", "-start_number", "0", "-i", str(folder / "f%d.png")]
    subprocess.run(["ffmpeg", "-loglevel", "error", *pictures, "-pix_fmt", "gray", "-c:v", "ffv1", str(clip)], check=True)
    found = apgstmd.run(clip, speed=1.0, rejection="off", start="1s", stop=30)
    expected = apgstmd.run(folder, speed=1.0, rejection="off", start=8, stop="3.75s", fps=8)
    assert (found.frames, expected.frames) == (22, 22)
    assert len(found.detections) > 10
    for name, column in found.detections.columns.items():
        assert name == "name" or np.array_equal(column, expected.detections.columns[name])
    assert np.isnan(apgstmd.run(folder, speed=1.0, rejection="off").detections.time).all()
    with pytest.raises(RuntimeError, match=r"rtsp://127.0.0.1:9/x"):
        apgstmd.run("rtsp://127.0.0.1:9/x", live=False)
    with pytest.raises(ValueError, match="2.5x"):
        apgstmd.run(clip, start="2.5x")


def test_the_table(folder: Path) -> None:
    found = apgstmd.run(str(folder), speed=1.0, rejection="off").detections
    assert found.frame.dtype == np.int64 and found.trace.dtype == np.int64 and found.x.dtype == np.float32
    assert list(found.columns) == ["frame", "name", "time", "x", "y", "score", "direction", "trace", "speed", "size", "contrast"]
    last = found[found.frame == 39]
    assert last[0].name == "f39.png" and last[0].frame == 39
    assert len(apgstmd.run(folder, stop=1).detections) == 0


def test_nothing_is_printed(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    apgstmd.run(folder, stop=3)
    with pytest.raises(RuntimeError):
        apgstmd.run(folder / "*.jpg")
    assert capfd.readouterr() == ("", "")


def test_wrong_input(tmp_path: Path, folder: Path) -> None:
    with pytest.raises(FileNotFoundError, match="absent"):
        apgstmd.run(tmp_path / "absent")
    with pytest.raises(RuntimeError, match="no pictures|holds no|no frames"):
        apgstmd.run(tmp_path)
    for t in range(3):
        write_png(tmp_path / f"{t}.png", FRAMES[t])
    (tmp_path / "1.png").write_bytes((tmp_path / "1.png").read_bytes()[:90])
    with pytest.raises(RuntimeError, match="1.png"):
        apgstmd.run(tmp_path)
    assert apgstmd.run(tmp_path, on_error="skip").summary["skipped"][0]["name"] == "1.png"
    write_png(tmp_path / "1.png", FRAMES[1][1:])
    with pytest.raises(RuntimeError, match="1.png.*63 x 96"):
        apgstmd.run(tmp_path)


def test_wrong_options(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="no parameter 'spede': did you mean 'speed'"):
        apgstmd.run(folder, spede=1.0)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="no parameter 'overlai': did you mean 'overlay'"):
        apgstmd.run(folder, overlai=True)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="retina.sigma is 99"):
        apgstmd.run(folder, retina_sigma=99.0)
    with pytest.raises(ValueError, match="name a folder for them with out="):
        apgstmd.run(folder, overlay=True)
    with pytest.raises(ValueError, match="start is -1, but it must lie between 0"):
        apgstmd.run(folder, start=-1)
    with pytest.raises(ValueError, match="no stage `X`"):
        apgstmd.run(folder, out=tmp_path / "out", dump=["X"])
    with pytest.raises(ValueError, match="on-error"):
        apgstmd.run(folder, on_error="panic")  # type: ignore[arg-type]


def test_ctrl_c_ends_a_run_between_frames(folder: Path, tmp_path: Path) -> None:
    long = tmp_path / "long"
    long.mkdir()
    for t in range(3000):
        (long / f"{t}.png").hardlink_to(folder / "f0.png")
    # A shell's background jobs ignore SIGINT, and their children with them.
    script = f"""
import apgstmd, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    apgstmd.run({str(long)!r}, out={str(tmp_path / "out")!r}, threads=1, dump=["P"])
except KeyboardInterrupt:
    print("interrupted", flush=True)
    print(apgstmd.run({str(long)!r}, stop=5, threads=1).frames)  # and the next run is a fresh one
"""
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + 60
        while not (tmp_path / "out" / "dump" / "P_000002.npy").exists():
            assert process.poll() is None and time.monotonic() < deadline
            time.sleep(0.005)
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=60)[0].split() == ["interrupted", "5"]
    summary = json.loads((tmp_path / "out" / "run.json").read_text())
    assert summary["interrupted"] and 2 < summary["frames"] < 3000
