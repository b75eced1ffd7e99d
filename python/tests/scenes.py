"""Pictures for the tests: made here, with nothing but NumPy and the standard library."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

HEIGHT, WIDTH = 64, 96


def moving_square(
    frames: int = 40, *, start: tuple[float, float] = (20, 32), step: tuple[float, float] = (1, 0), side: int = 5
) -> Iterator[NDArray[np.uint8]]:
    """A black square on white; its centre starts at (x, y) and moves by `step` each frame."""
    for t in range(frames):
        frame = np.full((HEIGHT, WIDTH), 255, np.uint8)
        x, y = (round(s + t * d) for s, d in zip(start, step, strict=True))
        frame[y - side // 2 : y + side // 2 + 1, x - side // 2 : x + side // 2 + 1] = 0
        yield frame


def textured_square(frames: int = 40) -> Iterator[NDArray[np.uint8]]:
    """The same on a still, seeded texture, so that every stage has something to do."""
    texture = np.random.default_rng(1).integers(150, 256, (HEIGHT, WIDTH), np.uint8)
    for square in moving_square(frames):
        yield np.minimum(texture, square)


def panned(frames: int, *, cut: int, blank: range) -> Iterator[NDArray[np.uint8]]:
    """The camera goes 2 px a frame to the left, over another texture from frame `cut` on, and sees nothing in frames `blank`."""
    for t in range(frames):
        if t in blank:
            yield np.full((HEIGHT, WIDTH), 200, np.uint8)
            continue
        coarse = np.random.default_rng(int(t >= cut)).integers(60, 250, (HEIGHT // 8, WIDTH), np.uint8)
        texture = np.kron(coarse, np.ones((8, 8), np.uint8))
        left = 2 * (frames - t)
        yield texture[:HEIGHT, left : left + WIDTH]


def write_png(path: Path, picture: NDArray[Any]) -> None:
    """Grey (H, W), RGB (H, W, 3) or RGBA (H, W, 4) of uint8 or uint16."""
    channels = 1 if picture.ndim == 2 else picture.shape[2]
    height, width = picture.shape[:2]
    rows = picture.astype(picture.dtype.newbyteorder(">")).reshape(height, -1)
    data = b"".join(b"\0" + row.tobytes() for row in rows)

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", width, height, 8 * picture.itemsize, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")
    )
