"""What everything that holds the state of one stream has in common."""

from __future__ import annotations

import operator
import tomllib
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _core

Rectangle: TypeAlias = tuple[int, int, int, int]
Region: TypeAlias = Rectangle | Sequence[Rectangle] | NDArray[Any]


class Stream:
    """The state of one stream of frames of one size."""

    __slots__ = ("_core", "_region", "_shape", "__weakref__")

    _core: _core.Detector | _core.Bank
    _region: NDArray[np.bool_] | None
    _shape: tuple[int, int]

    def state_dict(self) -> dict[str, Any]:
        """All that it remembers of the frames so far, copied.

        `arrays` has NumPy arrays by name (states of the temporal filters, predictions, traces, the last frame), `of`,
        `height`, `width`, `parameters`, `version` and `format` say what it is of. Inner maps of the last frame are no
        part of it. `numpy.savez(file, **state["arrays"])` or pickle keep it.
        """
        return self._core.state()

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Takes up what `state_dict` gave: it goes on to the bit as the one that gave it, whatever their threads.

        Raises ValueError for a state of another version, kind, frame size or of other parameters (the first that differs is
        named), or with values that cannot be, TypeError for what is no such dict. It is unchanged after each of them.

        >>> import apgstmd, numpy as np
        >>> frames = np.random.default_rng(1).random((20, 32, 48), np.float32)
        >>> one, other = (apgstmd.Detector((32, 48), speed=1.0, threads=1) for _ in range(2))
        >>> for frame in frames[:15]:
        ...     _ = one.process(frame)
        >>> other.load_state_dict(one.state_dict())
        >>> all(np.array_equal(one.process(f).response, other.process(f).response) for f in frames[15:])
        True
        """
        self._core.restore(state)

    def look_in(self, region: Region | None) -> None:
        """Looks for targets in a region only, from the next frame on; None: again everywhere.

        region : (x, y, width, height) in px, first column and row and how many, several of them, or a mask (H, W) that is not 0
            inside. Rectangles may reach beyond the picture.

        Nothing is reported outside, and what is far outside is not computed; the camera's motion is found from all of the picture.
        Raises ValueError for a mask of another size, a rectangle beside the picture, and where nothing is inside; TypeError for what is
        neither. A copy looks in the same region; a state knows of none.

        >>> import apgstmd
        >>> detector = apgstmd.Detector((480, 640), speed=2.0)
        >>> detector.look_in((0, 0, 640, 200))  # the upper 200 rows
        >>> detector.look_in([(0, 0, 640, 200), (300, 200, 40, 100)])
        >>> detector.look_in(None)
        """
        mask = None if region is None else _mask(region, self._shape)
        self._core.look_in(mask)
        self._region = mask

    def _arguments(self) -> tuple[Any, ...]:
        """What its core is made from, besides the size."""
        raise NotImplementedError

    def __reduce__(self) -> Any:
        made = (type(self), self._shape, type(self._core), self._arguments(), self._region)
        return _made, made, self.state_dict()

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.load_state_dict(state)

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


def _made(
    kind: type[Stream],
    shape: tuple[int, int],
    core: Any,
    arguments: tuple[Any, ...],
    region: NDArray[np.bool_] | None,
) -> Stream:
    """One that was pickled or is copied, before its state comes."""
    stream = kind.__new__(kind)
    stream._shape = shape
    stream._core = core(*shape, *arguments)
    stream.look_in(region)
    return stream


def _mask(region: Region, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Rectangles as a mask, a mask as it is."""
    given = np.asarray(region)
    if given.ndim == 2 and given.shape[1] != 4 or isinstance(region, np.ndarray) and given.shape == shape:
        if given.dtype.kind not in "bui":
            raise TypeError(f"a mask must be of bool or whole numbers, not {given.dtype}")
        return np.ascontiguousarray(given != 0)
    if given.dtype.kind not in "ui" or given.ndim not in (1, 2) or given.shape[-1] != 4:
        raise TypeError("a region is (x, y, width, height) in whole px, several of them, or a mask (height, width)")
    mask = np.zeros(shape, np.bool_)
    for x, y, width, height in np.atleast_2d(given):
        inside = mask[max(y, 0) : max(y + height, 0), max(x, 0) : max(x + width, 0)]
        if inside.size == 0:
            raise ValueError(
                f"the rectangle (x={x}, y={y}, width={width}, height={height}) has nothing of the picture, "
                f"{shape[0]} x {shape[1]} (height x width)"
            )
        inside[:] = True
    return mask


def rois(roi: Rectangle | Sequence[Rectangle]) -> list[str]:
    """Rectangles as flags of the command line."""
    rectangles = np.atleast_2d(np.asarray(roi, np.int64)) if len(roi) else np.zeros((0, 4), np.int64)
    if rectangles.ndim != 2 or rectangles.shape[1] != 4:
        raise TypeError(f"roi must be (x, y, width, height) in px, or several of them, not {roi!r}")
    return [f"--roi={width}x{height}+{x}+{y}" for x, y, width, height in rectangles]


def check_size(size: tuple[int, int]) -> tuple[int, int]:
    try:
        height, width = map(operator.index, size)
    except (TypeError, ValueError):
        raise TypeError(f"size must be (height, width), two whole numbers, not {size!r}") from None
    if min(height, width) < 0 or max(height, width) >= 1 << 31:
        raise ValueError(f"size must be (height, width) in pixels, not {size!r}")
    return height, width
