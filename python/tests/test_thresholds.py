"""Thresholds by false alarms a frame: set by the clip, and by an empty one."""

from __future__ import annotations

from pathlib import Path

import pytest

import apgstmd

SCENE = """
width = 160
height = 120
rate = 30.0
frames = 60
seed = 4
noise = 0.01
[background]
kind = "natural"
contrast = 0.15
velocity = [-24.0, 9.0]
"""


def scene(tmp_path: Path) -> Path:
    file = tmp_path / "scene.toml"
    file.write_text(SCENE)
    return file


def test_so_many_are_listed(tmp_path: Path) -> None:
    clip = scene(tmp_path)
    everything = apgstmd.run(clip, speeds=[1.0], false_alarms="off")
    few = apgstmd.run(clip, speeds=[1.0], false_alarms=0.2)
    assert len(few.detections) < min(40, len(everything.detections))
    assert few.summary["threshold"]["false_alarms"] == 0.2
    with pytest.raises(ValueError, match="between 0.001 and 10"):
        apgstmd.run(clip, false_alarms=100.0)


def test_an_empty_clip_sets_the_threshold(tmp_path: Path) -> None:
    clip, file = scene(tmp_path), tmp_path / "tuned.toml"
    text = apgstmd.tune(clip, file, speeds=[1.0, 2.0], false_alarms=0.2)
    assert text == file.read_text() and "[bank]" in text and "95 %" in text
    found = apgstmd.run(clip, params=file)
    assert 1 <= len(found.detections) <= 12
    # The path as text is the same file, its members included.
    again = apgstmd.run(clip, params=str(file))
    assert again.summary["bank"] == found.summary["bank"] and len(again.detections) == len(found.detections)
    bank = apgstmd.Bank((120, 160), params=file)
    assert bank.members == [(1.0, 5.0), (2.0, 5.0)]
    assert bank.params["detection"]["least_score"] > 0
    assert len(apgstmd.Bank((120, 160), params=file, speeds=[1.0]).members) == 1
    with pytest.raises(RuntimeError, match="is there already"):
        apgstmd.tune(clip, file, false_alarms=0.2)
    with pytest.raises(RuntimeError, match="take 300 to be measured"):
        apgstmd.tune(clip, tmp_path / "other.toml", speeds=[1.0], false_alarms=0.01)
