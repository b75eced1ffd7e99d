"""A bank of detectors: results, members, errors, and `run` with and without one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import apgstmd
from scenes import write_png


def frames(count: int = 45) -> list[np.ndarray]:
    shown = np.full((count, 64, 96), 220, np.uint8)
    for t in range(count):
        shown[t, 30:35, 18 + t : 23 + t] = 20
    return list(shown)


def test_a_target_of_unknown_speed() -> None:
    bank = apgstmd.Bank((64, 96), threads=1)
    assert len(bank.members) == 15 and (0.25, 5.0) in bank.members and (8.0, 20.0) in bank.members
    for frame in frames():
        out = bank.process(frame)
    found = out.detections
    assert isinstance(found, apgstmd.BankDetections)
    assert list(found.columns) == ["x", "y", "score", "direction", "trace", "speed", "size", "contrast"]
    best = found[0]
    assert abs(best.x - 64) < 1 and abs(best.y - 32) < 1 and abs(best.direction) < 0.3
    assert 0.3 < best.score <= best.contrast <= 1 and 0.5 <= best.speed <= 2 and best.size == 5
    assert out.response.max() <= 1 and out.response.shape == (64, 96)
    assert bank.frames == 45 and bank.latency > 25
    bank.reset()
    assert bank.frames == 0 and len(bank.process(frames(1)[0]).detections) == 0


def test_the_numbers_do_not_depend_on_threads() -> None:
    banks = [apgstmd.Bank((64, 96), speeds=[1, 2], sizes=[5, 10], threads=threads) for threads in (1, 3)]
    for frame in frames():
        one, three = (bank.process(frame) for bank in banks)
        assert list(one.detections) == list(three.detections) and np.array_equal(one.response, three.response)


def test_contrast_is_a_floor() -> None:
    bank = apgstmd.Bank((64, 96), speeds=[1.0], contrast=0.95)
    assert bank.members == [(1.0, 5.0)]
    assert all(len(bank.process(frame).detections) == 0 for frame in frames())


def test_what_is_wrong_is_named() -> None:
    for wrong, named in [
        ({"speeds": []}, "members is 0"),
        ({"speeds": [0.0]}, "bank.speed is 0"),
        ({"contrast": 2.0}, "bank.contrast is 2"),
        ({"bit_depth": 17}, "bit_depth is 17"),
        ({"retina_sigma": 99.0}, "retina.sigma"),
    ]:
        with pytest.raises(ValueError, match=named):
            apgstmd.Bank((64, 96), **wrong)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="did you mean 'speeds'"):
        apgstmd.Bank((64, 96), speed=1.0)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="20 x 20"):
        apgstmd.Bank((64, 96), speeds=[1.0]).process(np.zeros((20, 20), np.uint8))


def test_run(tmp_path: Path) -> None:
    for t, frame in enumerate(frames()):
        write_png(tmp_path / f"{t}.png", frame)
    found = apgstmd.run(tmp_path, threads=1)
    bank = apgstmd.Bank((64, 96), threads=1)
    seen = [row for frame in frames() for row in bank.process(frame).detections]
    assert found.detections.x.tolist() == pytest.approx([row.x for row in seen], abs=1e-4)
    assert len(found.summary["bank"]["members"]) == 15
    assert len(apgstmd.run(tmp_path, speed="auto", speeds=[1, 2], sizes=[5]).summary["bank"]["members"]) == 2
    assert not apgstmd.run(tmp_path, speed=1.0).detections.contrast.any()
    assert apgstmd.run(tmp_path, speed="30px/s", fps=30).summary["speed"] == 1.0
    assert "bank" not in apgstmd.run(tmp_path, retina_sigma=1.1).summary
    with pytest.raises(ValueError, match="--fps"):
        apgstmd.run(tmp_path, speed="30px/s")
