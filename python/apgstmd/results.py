"""What a detector hands back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Self, overload

import numpy as np
from numpy.typing import NDArray


class Detection(NamedTuple):
    """One small moving target in one frame.

    x, y are its column and row in px (row downward, pixel centres at integers); score is the facilitated response Q at
    the peak; direction is in radians in (-pi, pi], counter-clockwise on the screen (0 = right, pi/2 = up), NaN in a model
    without directions; trace is the number that links this target from frame to frame.
    """

    x: float
    y: float
    score: float
    direction: float
    trace: int


class Table:
    """Named NumPy columns of one length.

    `len(t)`, iteration and `t[i]` give rows; `t[slice]`, `t[mask]` and `t[indices]` give a table of the same kind.
    """

    __slots__ = ()
    names: ClassVar[tuple[str, ...]] = ()
    row: ClassVar[Any] = tuple

    def __init__(self, **columns: NDArray[Any]) -> None:
        if set(columns) != set(self.names):
            raise TypeError(f"{type(self).__name__}() takes the columns {', '.join(self.names)}")
        if len({column.shape for column in columns.values()}) != 1 or columns[self.names[0]].ndim != 1:
            raise ValueError("the columns must be one-dimensional and of one length")
        for name, column in columns.items():
            setattr(self, name, column)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The columns by name, ready for a data frame or `numpy.savez`."""
        return {name: getattr(self, name) for name in self.names}

    def __len__(self) -> int:
        return len(getattr(self, self.names[0]))

    def __iter__(self) -> Iterator[Any]:
        rows = zip(*(column.tolist() for column in self.columns.values()), strict=True)
        return map(self.row._make, rows)

    @overload
    def __getitem__(self, index: int | np.integer[Any]) -> Any: ...
    @overload
    def __getitem__(self, index: slice | NDArray[Any] | list[int] | list[bool]) -> Self: ...
    def __getitem__(self, index: Any) -> Any:
        picked = {name: column[index] for name, column in self.columns.items()}
        if picked[self.names[0]].ndim == 0:
            return self.row(*(value.item() for value in picked.values()))
        return type(self)(**picked)

    def __repr__(self) -> str:
        lines = [f"{type(self).__name__}: {len(self)}"]
        if len(self):
            lines.append(" ".join(f"{name:>10}" for name in self.names))
        for row in self[:10]:
            lines.append(" ".join(f"{value:>10.4g}" if type(value) is float else f"{value!s:>10}" for value in row))
        if len(self) > 10:
            lines.append(f"... {len(self) - 10} more")
        return "\n".join(lines)


class Detections(Table):
    """Detections as NumPy columns of one length, strongest first.

    x, y, score, direction: float32; trace: int64; meanings and units as in `Detection`. `len(d)`, iteration and `d[i]`
    give `Detection` rows; `d[slice]`, `d[mask]` and `d[indices]` give `Detections`.

    >>> import apgstmd, numpy as np
    >>> found = apgstmd.Detections(
    ...     x=np.float32([10, 20]), y=np.float32([5, 6]), score=np.float32([3, 1]),
    ...     direction=np.float32([0, 1.5]), trace=np.array([0, 1]))
    >>> len(found), found[0].x, found[found.score < 2].trace
    (2, 10.0, array([1]))
    """

    __slots__ = ("x", "y", "score", "direction", "trace")
    names: ClassVar[tuple[str, ...]] = ("x", "y", "score", "direction", "trace")
    row: ClassVar[Any] = Detection

    x: NDArray[np.float32]
    y: NDArray[np.float32]
    score: NDArray[np.float32]
    direction: NDArray[np.float32]
    trace: NDArray[np.int64]


class BankDetection(NamedTuple):
    """One small moving target in one frame, as a bank sees it.

    As `Detection`, but score lies between 0 and 1 and is comparable between members, clips and settings: contrast x
    straightness^2 x sqrt(points / 60, at most 1), by what its trace has shown so far. speed in px/frame and size in px are
    those that the best member is tuned to; contrast is that of a black 5 x 5 target on white that looks and responds as
    strongly.
    """

    x: float
    y: float
    score: float
    direction: float
    trace: int
    speed: float
    size: float
    contrast: float


class BankDetections(Detections):
    """As `Detections`, with the columns speed, size and contrast (float32) behind the others."""

    __slots__ = ("speed", "size", "contrast")
    names = (*Detections.names, "speed", "size", "contrast")
    row: ClassVar[Any] = BankDetection

    speed: NDArray[np.float32]
    size: NDArray[np.float32]
    contrast: NDArray[np.float32]


class RunDetection(NamedTuple):
    """One target in one frame: `frame` is its number, `name` its file, `time` its seconds, NaN where nothing tells; the
    rest as in `BankDetection`. contrast is 0 where a single detector was run.
    """

    frame: int
    name: str
    time: float
    x: float
    y: float
    score: float
    direction: float
    trace: int
    speed: float
    size: float
    contrast: float


class RunDetections(BankDetections):
    """As `BankDetections` over all frames, with the columns frame (int64), name (str) and time (float64) before the others."""

    __slots__ = ("frame", "name", "time")
    names = ("frame", "name", "time", *BankDetections.names)
    row = RunDetection

    frame: NDArray[np.int64]
    name: NDArray[np.str_]
    time: NDArray[np.float64]


class TrackPoint(NamedTuple):
    """One track in one frame.

    track: its number; x, y: px, as in `Detection`, the filter's estimate; vx, vy: velocity relative to the background,
    px/frame, vy downward; score: of the detection, or of a coasting track the response that guided it; state: "confirmed"
    where there is a detection, "coasting" where there is none; age: frames since the track's first detection; time: in
    seconds, NaN where it is not known.
    """

    frame: int
    time: float
    track: int
    x: float
    y: float
    vx: float
    vy: float
    score: float
    state: str
    age: int


class Tracks(Table):
    """Tracks as NumPy columns of one length, by frame, then by track.

    frame, track, age: int64; time, x, y, vx, vy: float64; score: float32; state: str; meanings as in `TrackPoint`. Points
    of a track begin with its first detection and end with its last; where it was not detected in between, it coasts.

    >>> import apgstmd
    >>> found = apgstmd.run(apgstmd.synth("demo"), speed=1.0, stop=40).tracks
    >>> first = found[found.track == 0]
    >>> bool(len(first) == first.age[-1] + 1), set(first.state) <= {"confirmed", "coasting"}
    (True, True)
    """

    __slots__ = TrackPoint._fields
    names = TrackPoint._fields
    row = TrackPoint

    frame: NDArray[np.int64]
    time: NDArray[np.float64]
    track: NDArray[np.int64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    vx: NDArray[np.float64]
    vy: NDArray[np.float64]
    score: NDArray[np.float32]
    state: NDArray[np.str_]
    age: NDArray[np.int64]


class EgoMotion(NamedTuple):
    """How the background moved from the last frame to this one, besides `Output.background_shift`.

    It turned about the middle of the picture by rotation, radians, counter-clockwise on the screen, and grew by the
    factor zoom; residual is what the motion leaves of the change from frame to frame: 1.5 times the median absolute
    residual, luminance. unexplained: the picture tells of no motion, and none is assumed.
    """

    rotation: float
    zoom: float
    residual: float
    unexplained: bool


@dataclass(frozen=True, slots=True)
class Output:
    """What one frame showed.

    detections: the confirmed targets. response: (H, W) float32, max over directions of the facilitated output Q,
    comparable between frames. direction: (H, W) float32, angle of the vector sum of Q in radians, NaN where Q = 0.
    background_shift: movement of the background since the last frame in the middle of the picture, (x, y) px, (0, 0)
    unless rejection is "motion". ego_motion: its rotation and zoom. cut: the scene was cut before this frame, and
    everything began anew (with rejection_background "similarity" only).
    """

    detections: Detections
    response: NDArray[np.float32]
    direction: NDArray[np.float32]
    background_shift: tuple[float, float]
    ego_motion: EgoMotion
    cut: bool

    def __repr__(self) -> str:
        height, width = self.response.shape
        peak = self.response.max()
        return f"Output({height} x {width}, {len(self.detections)} detections, strongest response {peak:.4g})"
