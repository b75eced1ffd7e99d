"""What everything that holds the state of one stream has in common."""

from __future__ import annotations

import operator
import tomllib
from typing import Any

from . import _core


class Stream:
    """The state of one stream of frames of one size."""

    __slots__ = ("_core", "_shape", "__weakref__")

    _core: _core.Detector | _core.Bank
    _shape: tuple[int, int]

    def reset(self) -> None:
        """Forgets everything seen: the next frame is a first frame."""
        self._core.reset()

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) of the frames it takes."""
        return self._shape

    @property
    def params(self) -> dict[str, Any]:
        """`model` and every parameter, of a bank those that its members have in common, section by section: a copy, to be
        given as `params=` to another one.
        """
        return tomllib.loads(self._core.params)

    @property
    def threads(self) -> int:
        """Number of threads it computes with."""
        return self._core.threads

    @property
    def latency(self) -> int:
        """Frames from the onset of a matched target to its complete response, of a bank the longest of a member.
        Detections come earlier.
        """
        return self._core.latency

    @property
    def frames(self) -> int:
        """Frames processed since construction or the last reset."""
        return self._core.frames()


def check_size(size: tuple[int, int]) -> tuple[int, int]:
    try:
        height, width = map(operator.index, size)
    except (TypeError, ValueError):
        raise TypeError(f"size must be (height, width), two whole numbers, not {size!r}") from None
    if min(height, width) < 0 or max(height, width) >= 1 << 31:
        raise ValueError(f"size must be (height, width) in pixels, not {size!r}")
    return height, width
