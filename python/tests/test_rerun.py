"""Logging to Rerun: what a recording holds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

import apgstmd


def test_log(tmp_path: Path) -> None:
    scene = apgstmd.synth("demo")
    detector = apgstmd.Detector(scene.shape, speed=1.0)
    recording = rr.RecordingStream("apgstmd_test")
    recording.save(str(tmp_path / "found.rrd"))
    outs = [detector.process(scene[t]) for t in range(40)]
    for t, out in enumerate(outs):
        apgstmd.rerun.log(t, scene[t], out, time=t / scene.rate, entity="eye", response=t == 39, recording=recording)
    recording.flush()
    recording.disconnect()
    rows: dict[str, dict[int, dict[str, Any]]] = {}
    for chunk in RrdReader(tmp_path / "found.rrd").stream():
        batch = chunk.to_record_batch()
        for row in batch.to_pylist() if "frame" in batch.schema.names else []:
            rows.setdefault(chunk.entity_path, {})[row["frame"]] = row
    for t in (20, 39):
        found = outs[t].detections
        seen, heading = rows["/eye/camera/detections"][t], rows["/eye/camera/heading"][t]
        places = np.column_stack([found.x, found.y]) + 0.5
        np.testing.assert_allclose(np.array(seen["Points2D:positions"]), places, atol=1e-5)
        up = -np.array(heading["Arrows2D:vectors"])[:, 1]
        np.testing.assert_allclose(up, 16 * np.sin(found.direction), atol=1e-4)
        assert rows["/eye/detections"][t]["Scalars:scalars"] == [len(found)]
    assert sorted(rows["/eye/strongest"]) == list(range(40)) and list(rows["/eye/response"]) == [39]
    assert rows["/eye/camera"][30]["time"].total_seconds() == pytest.approx(30 / scene.rate)
