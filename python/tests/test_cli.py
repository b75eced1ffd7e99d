"""The console script is the Rust program."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import apgstmd
from scenes import textured_square, write_png

SCRIPT = [str(Path(sys.executable).with_name("apgstmd"))]
MODULE = [sys.executable, "-m", "apgstmd"]


def call(*argv: str, program: list[str] = SCRIPT) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*program, *argv], capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize("program", [SCRIPT, MODULE], ids=["script", "module"])
def test_version_and_help(program: list[str]) -> None:
    result = call("--version", program=program)
    assert (result.returncode, result.stdout.splitlines()[0]) == (0, f"apgstmd {apgstmd.__version__}")
    help_text = call("run", "--help", program=program)
    assert help_text.returncode == 0 and "Usage: apgstmd run" in help_text.stdout


def test_run(tmp_path: Path) -> None:
    frames = tmp_path / "frames"
    frames.mkdir()
    for t, frame in enumerate(textured_square(40)):
        write_png(frames / f"{t}.png", frame)
    result = call("run", str(frames), "--speed", "1", "--out", str(tmp_path / "out"))
    assert result.returncode == 0, result.stderr
    rows = (tmp_path / "out" / "detections.csv").read_text().splitlines()
    assert rows[0] == "frame,name,time_s,x,y,score,direction_rad,trace,speed,size,contrast"
    assert len(rows) == 1 + len(apgstmd.run(frames, speed=1.0).detections) > 1


def test_params_is_the_same_file() -> None:
    result = call("params", "--preset", "paper", "--speed", "2")
    assert result.stdout.strip() == apgstmd.params("paper", speed=2.0).strip()


def test_failures_are_one_line_and_a_code(tmp_path: Path) -> None:
    absent = call("run", str(tmp_path / "absent"))
    assert absent.returncode == 1
    assert absent.stderr.startswith("error: ") and "absent" in absent.stderr
    wrong = call("run", str(tmp_path), "--speed", "-1")
    assert wrong.returncode == 2 and "speed" in wrong.stderr
    for result in (absent, wrong):
        assert "Traceback" not in result.stderr and "panicked" not in result.stderr


def test_ctrl_c_ends_quietly_with_130(tmp_path: Path) -> None:
    frames = tmp_path / "frames"
    frames.mkdir()
    write_png(frames / "0.png", next(textured_square(1)))
    for t in range(1, 3000):
        (frames / f"{t}.png").hardlink_to(frames / "0.png")
    argv = [*SCRIPT, "run", str(frames), "--out", str(tmp_path / "out"), "--dump", "P", "--threads", "1"]
    with subprocess.Popen(argv, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + 60
        while not (tmp_path / "out" / "dump" / "P_000002.npy").exists():
            assert process.poll() is None and time.monotonic() < deadline
            time.sleep(0.005)
        process.send_signal(signal.SIGINT)
        _, stderr = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in stderr
