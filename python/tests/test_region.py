"""Regions: rectangles and masks, of detectors, banks and runs."""

from __future__ import annotations

import pickle
from pathlib import Path

import apgstmd
import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import HEIGHT, WIDTH, write_png

Stream = apgstmd.Detector | apgstmd.Bank


def two_squares(frames: int = 40) -> list[NDArray[np.uint8]]:
    """One above and one below, a pixel to the right each frame."""
    pictures = []
    for t in range(frames):
        picture = np.full((HEIGHT, WIDTH), 230, np.uint8)
        for y in (14, 48):
            picture[y - 2 : y + 3, 18 + t : 23 + t] = 10
        pictures.append(picture)
    return pictures


def rows_of(stream: Stream) -> set[str]:
    found = set()
    for picture in two_squares():
        for target in stream.process(picture).detections:
            found.add("above" if target.y < 32 else "below")
    return found


@pytest.mark.parametrize("bank", [False, True])
def test_rectangles_and_masks(bank: bool) -> None:
    size = (HEIGHT, WIDTH)
    mask = np.zeros(size, np.uint8)
    mask[32:] = 3
    for region, expected in [
        (None, {"above", "below"}),
        ((0, 0, WIDTH, 30), {"above"}),
        ([(0, 32, 999, 999), (0, 0, 5, 5)], {"below"}),
        (mask, {"below"}),
        (mask == 0, {"above"}),
        (np.asfortranarray(mask == 0)[:, ::1], {"above"}),
    ]:
        stream: Stream = apgstmd.Bank(size, speeds=[1.0]) if bank else apgstmd.Detector(size, speed=1.0)
        stream.look_in(region)
        assert rows_of(stream) == expected
        # A copy looks there, too; taken away it is gone.
        again = pickle.loads(pickle.dumps(stream))
        again.reset()
        assert rows_of(again) == expected
        stream.reset()
        stream.look_in(None)
        assert rows_of(stream) == {"above", "below"}


def test_what_is_no_region_is_refused() -> None:
    detector = apgstmd.Detector((HEIGHT, WIDTH), speed=1.0)
    detector.look_in((0, 0, WIDTH, 30))
    for wrong, kind, text in [
        ((200, 0, 5, 5), ValueError, "nothing of the picture"),
        (np.zeros((HEIGHT, WIDTH), np.bool_), ValueError, "nothing of the picture"),
        (np.ones((HEIGHT, WIDTH + 1), np.bool_), ValueError, f"{HEIGHT} x {WIDTH + 1}"),
        (np.ones((HEIGHT, WIDTH)), TypeError, "whole numbers"),
        ((1, 2, 3), TypeError, "width, height"),
        ((1.5, 2, 3, 4), TypeError, "whole px"),
    ]:
        with pytest.raises(kind, match=text):
            detector.look_in(wrong)  # type: ignore[arg-type]
    assert rows_of(detector) == {"above"}, "it is unchanged"


def test_run(tmp_path: Path) -> None:
    frames = tmp_path / "frames"
    frames.mkdir()
    for t, picture in enumerate(two_squares()):
        write_png(frames / f"{t:03}.png", picture)
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    mask[:30] = 255
    write_png(tmp_path / "mask.png", mask)
    whole = apgstmd.run(frames, speed=1.0)
    assert {y < 32 for y in whole.detections.y} == {True, False}
    for found in (
        apgstmd.run(frames, speed=1.0, roi=(0, 0, WIDTH, 30)),
        apgstmd.run(frames, speed=1.0, roi=[(0, 0, WIDTH, 15), (0, 15, WIDTH, 15)]),
        apgstmd.run(frames, speed=1.0, mask=tmp_path / "mask.png"),
    ):
        assert len(found.detections) > 10 and max(found.detections.y) < 32
        assert found.summary["region"]["share"] == 30 / HEIGHT
    with pytest.raises(TypeError, match="roi must be"):
        apgstmd.run(frames, roi=(1, 2, 3))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="nothing of the picture"):
        apgstmd.run(frames, speed=1.0, roi=(WIDTH, 0, 3, 3))
