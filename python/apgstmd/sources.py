"""What `run` takes besides paths: arrays, iterables of frames, PyAV and OpenCV."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

Grey: TypeAlias = Literal["rgb", "bgr"]

_HOW = (
    "colour is not made grey unasked: say grey='rgb' or grey='bgr' (OpenCV's order) for 0.299 R + 0.587 G + 0.114 B, or give "
    "grey frames, for example frame @ [0.299, 0.587, 0.114] of luminance in [0, 1]"
)
_POSITION_MS = 0
_RATE = 5


class Capture(Protocol):
    """As `cv2.VideoCapture`."""

    def isOpened(self) -> bool:  # noqa: N802
        """Whether there is anything to read."""

    def read(self) -> tuple[bool, Any]:
        """Whether there was a frame, and the frame."""

    def get(self, propId: int, /) -> float:  # noqa: N803
        """A property by its number."""


class Container(Protocol):
    """As `av.open(...)` returns it."""

    def decode(self, *streams: Any, **kinds: Any) -> Iterator[Any]:
        """Frames of a stream."""


class Stream(Protocol):
    """As a video stream of PyAV: `container.streams.video[0]`."""

    @property
    def container(self) -> Any:
        """What it is a part of."""

    @property
    def codec_context(self) -> Any:
        """How it is coded."""


Frames: TypeAlias = NDArray[Any] | Capture | Container | Stream | Iterable[Any]


def arrays(frames: Any, grey: Grey | None) -> Iterator[tuple[NDArray[Any], float | None]]:
    """Each frame as (H, W), or (H, W, channels) with colour in the order RGB, and its seconds where they are known.

    TypeError for what has no frames, ValueError for what cannot be meant.
    """
    if grey not in (None, "rgb", "bgr"):
        raise ValueError(f"grey is {grey!r}, but it must be 'rgb' or 'bgr': the order of the channels")
    if isinstance(frames, np.ndarray):
        return _plain(_stack(frames, grey), grey)
    if hasattr(frames, "isOpened") and hasattr(frames, "read"):
        if not frames.isOpened():
            raise ValueError("the capture is not open: nothing can be read from it")
        return _captured(frames, grey)
    if hasattr(frames, "decode") and hasattr(frames, "streams"):
        return _plain(frames.decode(video=0), grey)
    if hasattr(frames, "codec_context") and hasattr(frames, "container"):
        return _plain(frames.container.decode(frames), grey)
    try:
        each = iter(frames)
    except TypeError:
        raise TypeError(
            "input must be a path, a scene, an array (frames, rows, columns), an iterable of frames, a PyAV container or an OpenCV "
            f"capture, not {type(frames).__name__}"
        ) from None
    return _plain(each, grey)


def _stack(frames: NDArray[Any], grey: Grey | None) -> NDArray[Any]:
    if frames.ndim not in (3, 4):
        raise ValueError(
            f"an array of frames has the shape (frames, rows, columns), or (frames, rows, columns, channels) for colour, but "
            f"this one has {frames.shape}: put a single frame into a list"
        )
    if frames.ndim == 3 and frames.shape[2] in (3, 4):
        raise ValueError(f"an array of shape {frames.shape} looks like one frame in colour: put it into a list")
    if frames.ndim == 4 and frames.shape[3] > 1 and grey is None:
        raise ValueError(f"the frames have {frames.shape[3]} channels, but {_HOW}")
    return frames


def _plain(frames: Iterable[Any], grey: Grey | None) -> Iterator[tuple[NDArray[Any], float | None]]:
    for frame in frames:
        if hasattr(frame, "to_ndarray"):
            time = frame.time
            yield _decoded(frame, grey), None if time is None else float(time)
        else:
            yield _ordered(frame, grey), None


def _ordered(frame: Any, grey: Grey | None) -> NDArray[Any]:
    """A frame whose colours, if it has any, are in the order RGB. What is no array is refused by who reads it."""
    if isinstance(frame, np.ndarray) and frame.ndim == 3 and frame.shape[2] > 1:
        if grey is None:
            raise ValueError(f"a frame has {frame.shape[2]} channels, but {_HOW}")
        if grey == "bgr":
            return frame[..., 2::-1]
    plain: NDArray[Any] = frame
    return plain


def _decoded(frame: Any, grey: Grey | None) -> NDArray[Any]:
    """A frame of PyAV: grey as it is, 8 bits or 16; colour as RGB where it was asked for."""
    name = frame.format.name
    deep = frame.format.components[0].bits > 8
    if name.startswith("gray"):
        wanted = "gray16le" if deep else "gray"
    elif grey is None:
        raise ValueError(f"the video has the pixels {name}, but {_HOW.partition(', or give')[0]}")
    else:
        wanted = "rgb48le" if deep else "rgb24"
    array: NDArray[Any] = frame.to_ndarray(format=wanted)
    return array


def _captured(capture: Any, grey: Grey | None) -> Iterator[tuple[NDArray[Any], float | None]]:
    timed = capture.get(_RATE) > 0
    first = True
    while True:
        there, frame = capture.read()
        if not there:
            return
        # Captures that know no times say 0, or less, all the time.
        time = capture.get(_POSITION_MS) / 1000
        yield _ordered(frame, grey), time if timed and (first or time > 0) else None
        first = False
