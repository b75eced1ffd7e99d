"""What a detector hands back."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ._optional import need
from .table import Table

if TYPE_CHECKING:
    import supervision


Maps: TypeAlias = tuple[NDArray[np.float32] | None, NDArray[np.float32] | None]


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

    _path: ClassVar[tuple[str, str, str | None] | None] = ("x", "y", None)

    def to_supervision(self, box_size: float | None = None) -> supervision.Detections:
        """As `supervision.Detections`: boxes around the positions, confidence = score, tracker_id = trace, direction and
        what else there is as data. Needs the extra `supervision`.

        box_size : side of the boxes, px; by default 5, or the size of the best member where the detections are a bank's.

        There a box ends at the lower right edge, and pixel i lies between i and i + 1.
        """
        boxes = need("supervision", "supervision", "to_supervision()").Detections
        sizes = self.columns.get("size")
        half = (np.full(len(self), 5.0, np.float32) if sizes is None else sizes) / 2 if box_size is None else box_size / 2
        x, y = self.x + np.float32(0.5), self.y + np.float32(0.5)
        data = {name: column for name, column in self.columns.items() if name not in ("x", "y", "score", "trace")}
        found: supervision.Detections = boxes(
            xyxy=np.stack([x - half, y - half, x + half, y + half], axis=1).astype(np.float32),
            confidence=self.score,
            tracker_id=self.trace,
            class_id=np.zeros(len(self), np.int64),
            data=data,
        )
        return found


class BankDetection(NamedTuple):
    """One small moving target in one frame, as a bank sees it.

    As `Detection`, but score lies between 0 and 1 and is comparable between members, clips and settings: contrast,
    weighed by how straight and how far its trace has come, how long it has been seen, and how often others were found in its
    place. speed in px/frame and size in px are those that the best member is tuned to; contrast is that of a black 5 x 5
    target on white that looks and responds as strongly.
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
    names: ClassVar[tuple[str, ...]] = (*Detections.names, "speed", "size", "contrast")
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
    names: ClassVar[tuple[str, ...]] = ("frame", "name", "time", *BankDetections.names)
    row: ClassVar[Any] = RunDetection

    frame: NDArray[np.int64]
    name: NDArray[np.str_]
    time: NDArray[np.float64]

    _path: ClassVar[tuple[str, str, str | None] | None] = ("x", "y", "trace")

    def to_mot(self, path: str | os.PathLike[str] | None = None, box_size: float = 5.0) -> str:
        """As MOTChallenge detections, id -1; see `Tracks.to_mot`."""
        return _mot(self.frame, np.full(len(self), -1), self.x, self.y, self.score, box_size, path)


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
    names: ClassVar[tuple[str, ...]] = TrackPoint._fields
    row: ClassVar[Any] = TrackPoint

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

    _path: ClassVar[tuple[str, str, str | None] | None] = ("x", "y", "track")

    def to_mot(self, path: str | os.PathLike[str] | None = None, box_size: float = 5.0) -> str:
        """As MOTChallenge text, `frame,id,left,top,width,height,conf,-1,-1,-1` a line; frames, ids and pixels count from 1.

        path : a file to write it to as well.
        box_size : side of the box that stands for a point, px.

        >>> import apgstmd
        >>> tracks = apgstmd.run(apgstmd.synth("demo"), speed=1.0, stop=40).tracks
        >>> tracks[:1].to_mot().split(",")[7:]
        ['-1', '-1', '-1\\n']
        """
        return _mot(self.frame, self.track + 1, self.x, self.y, self.score, box_size, path)


class CameraMotion(NamedTuple):
    """How the background moved from the frame before to this one, which tells how the camera moved.

    frame: its number; time: seconds, NaN where nothing tells; detections: how many are listed in it; background_x,
    background_y: shift in the middle of the picture, px, y downward; rotation, zoom, residual, unexplained: as in
    `EgoMotion`; cut: the scene was cut before this frame. Unless rejection is "motion", nothing moves.
    """

    frame: int
    time: float
    detections: int
    background_x: float
    background_y: float
    rotation: float
    zoom: float
    residual: float
    unexplained: bool
    cut: bool


class Camera(Table):
    """The camera's motion as NumPy columns of one length, a row a frame.

    frame, detections: int64; time, background_x, background_y, rotation, zoom, residual: float64; unexplained, cut: bool;
    meanings as in `CameraMotion`.

    >>> import apgstmd, numpy as np
    >>> camera = apgstmd.run(apgstmd.synth("demo"), speed=1.0, stop=40).camera
    >>> len(camera), float(np.hypot(camera.background_x, camera.background_y)[1:].min()) > 0.1, camera.cut.any()
    (40, True, np.False_)
    """

    __slots__ = CameraMotion._fields
    names: ClassVar[tuple[str, ...]] = CameraMotion._fields
    row: ClassVar[Any] = CameraMotion

    frame: NDArray[np.int64]
    time: NDArray[np.float64]
    detections: NDArray[np.int64]
    background_x: NDArray[np.float64]
    background_y: NDArray[np.float64]
    rotation: NDArray[np.float64]
    zoom: NDArray[np.float64]
    residual: NDArray[np.float64]
    unexplained: NDArray[np.bool_]
    cut: NDArray[np.bool_]


def _mot(
    frame: NDArray[np.int64],
    identity: NDArray[np.int64],
    x: NDArray[np.floating[Any]],
    y: NDArray[np.floating[Any]],
    score: NDArray[np.float32],
    side: float,
    path: str | os.PathLike[str] | None,
) -> str:
    if not side > 0:
        raise ValueError(f"box_size is {side}, but it must be more than 0 px")
    # Pixel i lies between edge i and edge i + 1; the first pixel is pixel 1.
    rows = zip(frame + 1, identity, x + 1.5 - side / 2, y + 1.5 - side / 2, score, strict=True)
    text = "".join(
        f"{frame},{identity},{left:.3f},{top:.3f},{side:g},{side:g},{np.format_float_positional(conf, trim='-')},-1,-1,-1\n"
        for frame, identity, left, top, conf in rows
    )
    if path is not None:
        with open(path, "w", encoding="utf-8", newline="") as file:
            file.write(text)
    return text


class EgoMotion(NamedTuple):
    """How the background moved from the last frame to this one, besides `Output.background_shift`.

    It turned about the middle of the picture by rotation, radians, counter-clockwise on the screen, and grew by the
    factor zoom; residual is what the motion leaves of the change from frame to frame: 1.5 times the median absolute
    residual, luminance, steep places counting more. unexplained: the picture tells of no motion, and none is assumed.
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


@dataclass(frozen=True, slots=True)
class RunFrame:
    """What one frame of a run showed, as `watch` gives it.

    frame: its number; name: as in the tables; time: seconds, NaN where nothing tells. detections: those of this frame.
    tracks: points of tracks that became certain with this frame: its own and, where a track was just confirmed or seen
    again, earlier ones; what was given is never taken back. background_shift, ego_motion, cut: as in `Output`.
    """

    frame: int
    name: str
    time: float
    detections: RunDetections
    tracks: Tracks
    background_shift: tuple[float, float]
    ego_motion: EgoMotion
    cut: bool

    def __repr__(self) -> str:
        return f"RunFrame({self.name}, {len(self.detections)} detections, {len(self.tracks)} points of tracks)"
