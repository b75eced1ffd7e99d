"""What counts as a frame: types, strides, colours, and what is refused."""

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
Picture = NDArray[Any]


def retina(picture: Picture, **options: Any) -> NDArray[np.float32]:
    """P of one frame: linear in luminance, so that it tells how the frame was read."""
    # P does not depend on the speed; a fast detector is made fast.
    detector = apgstmd.Detector(picture.shape[:2], threads=1, speed=8.0, **options)
    detector.process(picture)
    return detector.stage("P")


@pytest.fixture(scope="module")
def grey() -> NDArray[np.uint8]:
    return next(textured_square(1))


@pytest.fixture(scope="module")
def reference(grey: NDArray[np.uint8]) -> NDArray[np.float32]:
    return retina(grey / 255.0)


def test_the_reference_is_the_blurred_luminance(grey: Picture, reference: NDArray[np.float32]) -> None:
    assert reference.dtype == np.float32
    assert abs(reference.mean() - grey.mean() / 255) < 2e-3
    assert reference.std() < grey.std() / 255


@pytest.mark.parametrize(
    "convert",
    [
        lambda grey: grey,
        lambda grey: grey.astype(np.uint16) * 257,
        lambda grey: (grey / 255).astype(np.float32),
        lambda grey: grey / 255,
    ],
    ids=["uint8", "uint16", "float32", "float64"],
)
def test_all_types_mean_the_same_luminance(
    convert: Callable[[Picture], Picture], grey: Picture, reference: Picture
) -> None:
    # Half a unit in the last place of a sample near 1, through a kernel that sums to 1.
    np.testing.assert_allclose(retina(convert(grey)), reference, rtol=0, atol=3e-7)


def test_bool_is_black_and_white(grey: Picture) -> None:
    mask = grey > 200
    assert np.array_equal(retina(mask), retina(mask.astype(np.float32)))
    assert np.array_equal(retina(mask[::-1, ::-2]), retina(mask[::-1, ::-2].astype(np.float32)))
    assert np.array_equal(retina(mask, bit_depth=12), retina(mask))


@pytest.mark.parametrize("bits", [10, 12, 14])
def test_bit_depth(bits: int) -> None:
    deep = np.random.default_rng(bits).integers(0, 1 << bits, SIZE, np.uint16)
    np.testing.assert_allclose(retina(deep, bit_depth=bits), retina(deep / ((1 << bits) - 1)), rtol=0, atol=3e-7)
    with pytest.raises(ValueError, match=f"above the declared full scale of {(1 << bits) - 1}"):
        retina(np.full(SIZE, 1 << bits, np.uint16), bit_depth=bits)


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32", "float64"])
@pytest.mark.parametrize(
    "view",
    [
        lambda a: a[::-1],
        lambda a: a[:, ::-1],
        lambda a: a[::-2, ::-3],
        lambda a: a.T,
        lambda a: np.asfortranarray(a),
        lambda a: a[5:40, 7:60],
        lambda a: np.broadcast_to(a[:1], a.shape),
    ],
    ids=["up", "left", "both", "transposed", "fortran", "window", "broadcast"],
)
def test_any_strides(view: Callable[[Picture], Picture], dtype: str, grey: Picture) -> None:
    picture: Picture = (grey / 255).astype(dtype) if dtype.startswith("float") else grey.astype(dtype)
    seen = view(picture)
    assert np.array_equal(retina(seen), retina(np.ascontiguousarray(seen)))


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32", "float64"])
def test_colour_is_weighted_and_alpha_left_out(dtype: str) -> None:
    full = 1.0 if dtype.startswith("float") else float(np.iinfo(dtype).max)
    colour: Picture = (np.random.default_rng(2).random((*SIZE, 4)) * full).astype(dtype)
    grey = colour[..., :3].astype(np.float64) @ [0.299, 0.587, 0.114] / full
    for picture in (colour, colour[..., :3], np.ascontiguousarray(colour[..., :3])):
        np.testing.assert_allclose(retina(picture), retina(grey), rtol=0, atol=5e-7)
    bgr = colour[..., 2::-1]
    assert not np.allclose(retina(bgr), retina(colour), atol=1e-3)
    assert np.array_equal(retina(colour[..., :1]), retina(colour[..., 0]))


def test_a_read_only_frame_is_read_and_no_frame_is_changed(grey: Picture) -> None:
    frame = grey.copy()
    frame.flags.writeable = False
    retina(frame)
    colour = np.stack([grey, grey, grey], axis=2)
    kept = colour.copy()
    retina(colour)
    assert np.array_equal(colour, kept)


@pytest.mark.parametrize("dtype", ["int64", "int8", "int32", "uint32", "float16", "complex64", "O", ">u2", ">f4"])
def test_other_types_are_refused_by_name(dtype: str) -> None:
    detector = apgstmd.Detector(SIZE, threads=1)
    frame = np.zeros(SIZE, dtype)
    with pytest.raises(TypeError) as error:
        detector.process(frame)
    message = str(error.value)
    assert str(frame.dtype) in message and "uint8, uint16, float32 or float64" in message and "astype" in message


def test_what_is_no_array_is_refused() -> None:
    detector = apgstmd.Detector(SIZE, threads=1)
    wrong: list[Any] = [[[0, 1], [2, 3]], None, 3, "frame.png", b"bytes", memoryview(b'xy')]
    for frame in wrong:
        with pytest.raises(TypeError, match=rf"NumPy array of uint8.*, not {type(frame).__name__}.*numpy.asarray"):
            detector.process(frame)


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (np.zeros((WIDTH, HEIGHT), np.uint8), "the frame is 96 x 64 (height x width), but this detector was made for 64 x 96"),
        (np.zeros((HEIGHT, WIDTH - 1), np.float32), "the frame is 64 x 95"),
        (np.zeros((0, 0), np.uint8), "the frame is 0 x 0"),
        (np.zeros((HEIGHT, WIDTH, 2), np.uint8), "the frame has 2 channels, but 1 (grey), 3 (RGB) or 4 (RGBA)"),
        (np.zeros(HEIGHT, np.uint8), "(height, width, 3 or 4), but this array has [64]"),
        (np.zeros((1, HEIGHT, WIDTH, 3), np.uint8), "but this array has [1, 64, 96, 3]"),
        (np.full(SIZE, 255.0), "is 255, outside [0, 1]: divide the frame by its full scale first"),
        (np.full(SIZE, -0.5, np.float32), "is -0.5, outside [0, 1]"),
        (np.full(SIZE, np.nan), "is NaN: every pixel must be a finite number"),
        (np.full(SIZE, np.inf, np.float32), "is inf: every pixel must be a finite number"),
    ],
)
def test_frames_that_cannot_be_used(frame: Picture, message: str) -> None:
    detector = apgstmd.Detector(SIZE, threads=1)
    with pytest.raises(ValueError, match=re.escape(message)):
        detector.process(frame)
    assert detector.frames == 0


def test_a_bad_pixel_is_named() -> None:
    frame = np.zeros(SIZE, np.float32)
    frame[7, 11] = np.nan
    with pytest.raises(ValueError, match="column 11, row 7"):
        retina(frame)


def test_a_bad_frame_leaves_the_detector_as_it_was() -> None:
    hurt, whole = (apgstmd.Detector(SIZE, speed=1.0, threads=1) for _ in range(2))
    for t, frame in enumerate(textured_square(20)):
        if t % 3 == 0:
            for bad in (np.full(SIZE, np.nan), frame[1:], frame.astype(np.int64)):
                with pytest.raises((ValueError, TypeError)):
                    hurt.process(bad)
        assert np.array_equal(hurt.process(frame).response, whole.process(frame).response)


def test_a_misaligned_frame_is_refused_with_the_way_out() -> None:
    record = np.zeros(SIZE, [("flag", "u1"), ("level", "f4")])
    with pytest.raises(ValueError, match=r"misaligned in memory: pass frame.copy\(\)"):
        retina(record["level"])
    assert not retina(record["level"].copy()).any()
    assert not retina(record["flag"]).any()


def test_bit_depth_is_checked() -> None:
    for bits in (0, 17, -1):
        with pytest.raises(ValueError, match="bit_depth is -?[0-9]+, but it must lie between 1 and 16"):
            apgstmd.Detector(SIZE, bit_depth=bits)
    with pytest.raises(TypeError, match="bit_depth must be a whole number"):
        apgstmd.Detector(SIZE, bit_depth=10.0)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="bit_depth is 12, but a uint8 frame holds 8 bits"):
        retina(np.zeros(SIZE, np.uint8), bit_depth=12)
