"""The inner maps and how they hang together."""

from __future__ import annotations

import numpy as np
import pytest

import apgstmd
from scenes import HEIGHT, WIDTH, textured_square

SIZE = (HEIGHT, WIDTH)
SHAPES = {"C": (4, *SIZE), **{name: (8, *SIZE) for name in ("D", "E", "Ep", "F", "Q")}}

OWN = apgstmd.Detector(SIZE, threads=1).stages


@pytest.fixture(scope="module")
def seen() -> tuple[apgstmd.Detector, apgstmd.Output]:
    # Fast enough for attention to come in: its region is the prediction of 6 frames ago.
    detector = apgstmd.Detector(SIZE, speed=1.0, rejection="off", threads=1, attention_alpha=0.75)
    for frame in textured_square(30):
        out = detector.process(frame)
    return detector, out


def test_names() -> None:
    assert " ".join(apgstmd.STAGES) == "P C A Pe L L1 Tm3 Tm2 Mi1 Tm1_4 Tm1_5 ON OFF OFFd Y Yd D E Ep F M Q"
    assert " ".join(OWN) == "P C A Pe L Tm3 Tm2 Mi1 Tm1_4 Tm1_5 D E Ep F M Q"


@pytest.mark.parametrize("name", OWN)
def test_every_stage_is_there_and_alive(name: str, seen: tuple[apgstmd.Detector, apgstmd.Output]) -> None:
    stage = seen[0].stage(name)
    assert stage.shape == SHAPES.get(name, SIZE)
    assert stage.dtype == np.float32
    assert np.isfinite(stage).all()
    assert stage.any(), f"{name} is all zero"


def test_relations(seen: tuple[apgstmd.Detector, apgstmd.Output]) -> None:
    detector, out = seen
    stage = {name: detector.stage(name) for name in OWN}
    assert np.array_equal(stage["Tm3"], np.maximum(stage["L"], 0))
    assert np.array_equal(stage["Tm2"], np.maximum(-stage["L"], 0))
    np.testing.assert_allclose(stage["Pe"], stage["P"] + 0.75 * stage["A"], rtol=0, atol=3e-7)
    assert np.array_equal(stage["Ep"], stage["E"])
    assert np.array_equal(out.response, stage["Q"].max(axis=0))
    assert (stage["E"] >= 0).all() and (stage["Q"] >= stage["Ep"]).all()
    # A sum over 8 directions, in whatever order.
    np.testing.assert_allclose(stage["M"], stage["F"].sum(axis=0), rtol=1e-5, atol=1e-12)


def test_rejection_only_takes_away() -> None:
    detector = apgstmd.Detector(SIZE, speed=1.0, threads=1)
    for frame in textured_square(30):
        detector.process(frame)
    before, after = detector.stage("E"), detector.stage("Ep")
    assert ((after == before) | (after == 0)).all()
    assert after.any()


def test_before_the_first_frame_and_after_reset_all_is_zero() -> None:
    detector = apgstmd.Detector(SIZE, threads=1)
    for _ in range(2):
        for name in OWN:
            assert not detector.stage(name).any(), name
        for frame in textured_square(3):
            detector.process(frame)
        assert detector.stage("P").any()
        detector.reset()


def test_a_stage_is_a_copy() -> None:
    detector = apgstmd.Detector(SIZE, threads=1)
    detector.process(next(textured_square(1)))
    kept = detector.stage("P")
    detector.process(np.zeros(SIZE, np.uint8))
    assert kept.any() and not detector.stage("P").any()


def test_an_unknown_stage() -> None:
    detector = apgstmd.Detector(SIZE, threads=1)
    with pytest.raises(ValueError, match="there is no stage `X`: the stages are P, C, A"):
        detector.stage("X")
    with pytest.raises(TypeError):
        detector.stage(3)  # type: ignore[arg-type]
