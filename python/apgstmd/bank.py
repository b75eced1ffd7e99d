"""Detectors of several speeds and sizes on one stream."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Unpack

from numpy.typing import NDArray

from . import _core
from .options import Model, ParamFile, Parameters, Preset, Rejection, _read, resolve, whole
from .results import BankDetections, EgoMotion, Maps, Output
from .stream import Stream, check_size


class Bank(Stream):
    """Finds small moving targets of unknown speed and size in a stream of frames of one size.

    Parameters
    ----------
    size : (height, width), at least 16 x 16.
    speeds : px/frame that the members are tuned to; 0.25, 0.5, 1, 2, 4, 8 by default.
    sizes : px; a member of 5 sees targets of 3 to 6 px, one of 10 or 20 as many times more in a reduced frame. By default 5,
        10 and 20, with `speeds` 5.
    contrast : least contrast of a detection, 0 to 1, 0.003 by default.
    threads : 1 to 256, all cores by default: members run beside each other. The numbers do not depend on it.
    bit_depth : significant bits of integer frames, 1 to 16, when they are fewer than the type holds (10, 12, 14).
    model, preset, rejection, threshold, params, **parameters : what the members have in common, as in `Detector`. A
        parameter file that `tune` wrote also names the members, and `detection_least_score`, below which nothing is listed.

    Raises what `Detector` raises. `process` returns the `contrast` of the response as its map, and `BankDetections`, of
    which scores lie between 0 and 1 and compare between clips.

    >>> import apgstmd, numpy as np
    >>> bank = apgstmd.Bank((48, 96))
    >>> for t in range(48):
    ...     frame = np.full((48, 96), 255, np.uint8)
    ...     frame[22:27, 10 + t : 15 + t] = 0  # a dark square of 5 x 5 px, one pixel to the right each frame
    ...     out = bank.process(frame)
    >>> target = out.detections[0]
    >>> abs(target.x - 59) < 1, abs(target.y - 24) < 1, target.score > 0.5
    (True, True, True)
    """

    __slots__ = ()

    _core: _core.Bank

    def __init__(
        self,
        size: tuple[int, int],
        *,
        speeds: Sequence[float] | None = None,
        sizes: Sequence[float] | None = None,
        contrast: float | None = None,
        model: Model | None = None,
        preset: Preset | None = None,
        rejection: Rejection | None = None,
        threshold: float | None = None,
        threads: int | None = None,
        bit_depth: int | None = None,
        params: ParamFile | None = None,
        **parameters: Unpack[Parameters],
    ) -> None:
        self._shape = check_size(size)
        self._region = None
        for single, instead in (("speed", "speeds"), ("localise", "a Detector")):
            if single in parameters:
                raise TypeError(f"there is no parameter {single!r}: did you mean {instead!r}?")
        known = ("speeds", "sizes", "contrast", "threads", "bit_depth")
        text = resolve(model, preset, None, rejection, None, threshold, params, dict(parameters), known)
        self._core = _core.Bank(
            *self._shape,
            text,
            _read(params)[0],
            None if speeds is None else [float(speed) for speed in speeds],
            None if sizes is None else [float(size) for size in sizes],
            contrast,
            whole("threads", threads, 1, 256),
            whole("bit_depth", bit_depth, 1, 16),
        )

    def process(self, frame: NDArray[Any], *, out: Maps | None = None) -> Output:
        """Takes the next frame, as `Detector.process` does, and returns what it shows; nothing is delayed."""
        response, direction, (columns, trace), shift, ego, cut = self._core.process(frame, out)
        x, y, score, angle, speed, size, contrast = columns
        found = BankDetections(
            x=x, y=y, score=score, direction=angle, trace=trace, speed=speed, size=size, contrast=contrast
        )
        return Output(found, response, direction, shift, EgoMotion(*ego), cut)

    @property
    def members(self) -> list[tuple[float, float]]:
        """Speed in px/frame and size in px of each member that the frames are large enough for."""
        return self._core.members

    def _arguments(self) -> tuple[Any, ...]:
        return self._core.params, self._core.file, None, None, None, self._core.threads, self._core.bit_depth

    def __repr__(self) -> str:
        height, width = self._shape
        return f"Bank(({height}, {width}), {len(self.members)} members, threads={self.threads})"
