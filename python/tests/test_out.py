"""Maps written into the caller's arrays."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import apgstmd
from scenes import HEIGHT, WIDTH, textured_square

SIZE = (HEIGHT, WIDTH)
FRAMES = list(textured_square(25))
MAKERS: list[Callable[[], apgstmd.Detector | apgstmd.Bank]] = [
    lambda: apgstmd.Detector(SIZE, speed=1.0, rejection="off", threads=1),
    lambda: apgstmd.Bank(SIZE, speeds=[1.0], threads=1),
]


def empty(*shape: int) -> NDArray[np.float32]:
    return np.full(shape or SIZE, -7, np.float32)


@pytest.mark.parametrize("make", MAKERS, ids=["detector", "bank"])
def test_the_same_numbers_in_the_callers_arrays(make: Callable[[], apgstmd.Detector | apgstmd.Bank]) -> None:
    plain, given, half = make(), make(), make()
    response, direction = empty(), empty()
    for frame in FRAMES:
        wanted = plain.process(frame)
        out = given.process(frame, out=(response, direction))
        assert out.response is response and out.direction is direction
        mixed = half.process(frame, out=(None, empty()))
        assert mixed.response is not response
        for got in (out, mixed):
            assert np.array_equal(got.response, wanted.response)
            assert np.array_equal(got.direction, wanted.direction, equal_nan=True)
            assert list(got.detections) == list(wanted.detections)
    assert response.any()
    # New arrays are the caller's own all the same.
    kept = plain.process(FRAMES[0])
    copy = kept.response.copy()
    plain.process(FRAMES[1], out=(response, direction))
    plain.process(FRAMES[2])
    assert np.array_equal(kept.response, copy)


def test_a_part_of_a_stack() -> None:
    plain, detector = (apgstmd.Detector(SIZE, speed=1.0, rejection="off", threads=1) for _ in range(2))
    stack = empty(len(FRAMES), 2, *SIZE)
    for frame, maps in zip(FRAMES, stack, strict=True):
        detector.process(frame, out=(maps[0], maps[1]))
    for frame, maps in zip(FRAMES, stack, strict=True):
        assert np.array_equal(plain.process(frame).response, maps[0])


def read_only() -> NDArray[np.float32]:
    array = empty()
    array.flags.writeable = False
    return array


@pytest.mark.parametrize(
    ("out", "error", "message"),
    [
        (empty(), TypeError, "out must be a pair of arrays (response, direction)"),
        ((empty(),), TypeError, "out must be a pair of arrays"),
        ((empty(), 3), TypeError, "out[1] (direction) must be a C-contiguous array of float32 and the shape (64, 96), not int"),
        ((np.empty(SIZE), None), TypeError, "out[0] (response) must be a C-contiguous array of float32"),
        ((np.empty(SIZE, ">f4"), None), TypeError, "but it is of >f4"),
        ((empty(WIDTH, HEIGHT), None), ValueError, "shape (64, 96), but its shape is [96, 64]"),
        ((empty(1, *SIZE), None), ValueError, "but its shape is [1, 64, 96]"),
        ((empty(WIDTH, HEIGHT).T, None), ValueError, "but it is a view with gaps"),
        ((empty(HEIGHT, 2 * WIDTH)[:, ::2], None), ValueError, "but it is a view with gaps"),
        ((read_only(), None), ValueError, "out[0] (response) is read-only"),
    ],
)
def test_arrays_that_cannot_be_written(out: Any, error: type[Exception], message: str) -> None:
    for make in MAKERS:
        detector = make()
        with pytest.raises(error, match=re.escape(message)):
            detector.process(FRAMES[0], out=out)
        assert detector.frames == 0


def test_overlaps() -> None:
    detector = MAKERS[0]()
    frame = np.zeros(SIZE, np.float32)
    shared = empty(HEIGHT + 1, WIDTH)
    for out in ((frame, None), (None, frame), (shared[:-1], shared[1:]), (shared[1:], shared[1:])):
        with pytest.raises(ValueError, match="overlaps the frame or the other map: each needs memory of its own"):
            detector.process(frame, out=out)
    assert detector.frames == 0 and not frame.any()
    detector.process(frame, out=(shared[:-1], None))
