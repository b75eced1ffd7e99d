"""The NumPy model computes what apgstmd computes: every stage to a thousandth of its maximum, and the same detections."""

from __future__ import annotations

import math

import numpy as np
import pytest

import apgstmd
from model import ApgStmd

SCENE = """
width = 112
height = 72
frames = 46
seed = 3
noise = 0.004

[background]
kind = "natural"
contrast = 0.16
velocity = [-15.0, 6.0]

[[target]]
shade = { dark = 0.5 }
path = { kind = "straight", start = [30, 30], speed = 60 }

[[target]]
width = 4
height = 4
shade = { dark = 0.5 }
path = { kind = "straight", start = [90, 60], speed = 60, direction = 2.5 }
"""
TOLERANCE = 1e-3
# A pixel at the very edge of a region may fall on the other side in another order of rounding.
STRAY = 0.005
# Before the delays have passed a target on, all there is of E lies at the response floor, on either side of it.
SETTLED = 20


@pytest.mark.parametrize("separable", [False, True], ids=["filter2D", "separable"])
def test_every_stage(separable: bool, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    path.write_text(SCENE)
    scene = apgstmd.synth(path)
    height, width = scene[0].shape
    # The NumPy model lets no gain go, and follows the background as a translation, which costs it less.
    exact = {"prediction_negligible": 1e-5, "rejection_background": "translation"}
    ours = apgstmd.Detector((height, width), speed=1.0, localise="response", **exact)
    theirs = ApgStmd(height, width, ours.params, separable=separable)
    attended = found = 0
    for t, frame in enumerate(scene):
        out, other = ours.process(frame), theirs.process(frame)
        for name, value in theirs.stages.items():
            expected = ours.stage(name)
            largest = float(np.abs(expected).max())
            off = np.abs(value - expected) > TOLERANCE * largest
            if t >= SETTLED and largest > 0:
                assert off.mean() <= STRAY, f"frame {t}, {name}: {off.sum()} pixels off"
        attended += bool(theirs.stages["A"].any())
        assert [row[4] for row in other.detections] == [d.trace for d in out.detections], f"frame {t}"
        for row, detection in zip(other.detections, out.detections, strict=True):
            assert math.hypot(row[0] - detection.x, row[1] - detection.y) < 0.01
            # A score is a value of Q: a faint one is no nearer to the truth than the stage is.
            faint = TOLERANCE * float(out.response.max())
            assert t < SETTLED or math.isclose(row[2], detection.score, rel_tol=0.01, abs_tol=faint)
        found += bool(out.detections)
    assert attended > 10 and found > 15, (attended, found)
