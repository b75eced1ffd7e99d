"""Detections against ground truth."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .folder import Run
from .options import whole
from .results import RunDetections, Tracks
from .scene import Scene, Truth
from .table import Table


class _Columns(Protocol):
    """What has columns by name: a dict of arrays, a data frame, a structured array."""

    def __getitem__(self, name: str, /) -> Any: ...


Found: TypeAlias = str | os.PathLike[str] | Run | RunDetections | Tracks | Mapping[str, ArrayLike] | _Columns
Expected: TypeAlias = str | os.PathLike[str] | Scene | Truth | Mapping[str, ArrayLike] | _Columns


class CurvePoint(NamedTuple):
    """What the detections with at least one score are worth; fields as in `Curve`."""

    threshold: float
    true_detections: int
    false_detections: int
    detection_rate: float
    false_alarms: float
    precision: float
    f1: float


class Curve(Table):
    """One point for each distinct score, highest first, as NumPy columns of one length.

    threshold: the least score that is reported; true_detections, false_detections: int64; detection_rate: true
    detections / visible targets, which is also the recall; false_alarms: false detections / frames; precision; f1.
    """

    __slots__ = CurvePoint._fields
    names: ClassVar[tuple[str, ...]] = CurvePoint._fields
    row: ClassVar[Any] = CurvePoint

    threshold: NDArray[np.float64]
    true_detections: NDArray[np.int64]
    false_detections: NDArray[np.int64]
    detection_rate: NDArray[np.float64]
    false_alarms: NDArray[np.float64]
    precision: NDArray[np.float64]
    f1: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class OperatingPoint:
    """A threshold someone may choose, and what it gives.

    limit: most false alarms a frame that were allowed, None where that was not the choice. point: the best point within
    it, None when even the highest threshold gives more. localisation_error (px) and direction_error (radians): medians
    over its true detections, None where there are none or nothing tells the direction.
    """

    limit: float | None
    point: CurvePoint | None
    detection_rate: float
    localisation_error: float | None
    direction_error: float | None


class HotaPoint(NamedTuple):
    """HOTA at one threshold; fields as in `HotaCurve`."""

    similarity: float
    hota: float
    det_a: float
    ass_a: float


class HotaCurve(Table):
    """HOTA at each of 19 thresholds, as NumPy columns of one length.

    similarity: the least of a match, 0.05 to 0.95: distances up to 1 - this of how far a true detection may lie; hota; det_a,
    ass_a: its parts, detection and association accuracy.
    """

    __slots__ = HotaPoint._fields
    names: ClassVar[tuple[str, ...]] = HotaPoint._fields
    row: ClassVar[Any] = HotaPoint

    similarity: NDArray[np.float64]
    hota: NDArray[np.float64]
    det_a: NDArray[np.float64]
    ass_a: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TrackEvaluation:
    """How good tracks are, by the distance of centres.

    A point may match a target where a detection would be true. tracks, points: those that count; neutral_points: those on
    what is hidden or ignored; identities: different targets.

    CLEAR MOT (Bernardin & Stiefelhagen 2008): mota: 1 - (misses + false_positives + id_switches) / targets; motp: mean
    distance of matched points, px, None where nothing is matched; id_switches: how often a target is matched with another
    track than when it was last matched; fragmentations: how often it is matched again after frames in which it was not;
    mostly_tracked, partly_tracked, mostly_lost: targets matched in more than 80 %, some, less than 20 % of their frames.

    IDF1 (Ristani et al. 2016): each target has one track for good; id_true, id_false, id_missed: points that match it, points
    that do not, targets that are not matched; idf1, id_precision, id_recall.

    HOTA (Luiten et al. 2021): hota, det_a, ass_a: means over the thresholds of similarity in hota_at, similarity being
    1 - distance / limit, and limit how far a true detection may lie in that direction: 5 px for small targets.
    """

    tracks: int
    points: int
    neutral_points: int
    identities: int
    mota: float
    motp: float | None
    matched: int
    misses: int
    false_positives: int
    id_switches: int
    fragmentations: int
    mostly_tracked: int
    partly_tracked: int
    mostly_lost: int
    idf1: float
    id_precision: float
    id_recall: float
    id_true: int
    id_false: int
    id_missed: int
    hota: float
    det_a: float
    ass_a: float
    hota_at: HotaCurve

    def __repr__(self) -> str:
        return (
            f"TrackEvaluation({self.tracks} tracks, {self.identities} targets, mota={self.mota:.3f}, idf1={self.idf1:.3f}, "
            f"hota={self.hota:.3f}, id_switches={self.id_switches})"
        )


@dataclass(frozen=True, slots=True)
class Evaluation:
    """How good detections are.

    area: under the detection rate over 0..1 false alarms a frame, a step curve, exact. average_precision: sum over
    thresholds of precision times the recall that it adds. at: operating points at 0.1, 0.5, 1, 5 and 10 false alarms a
    frame. best_f1: where F1 is greatest; everything: with every detection. targets: visible ones over all frames;
    neutral_detections: those on what is hidden or ignored. frames, first_frame, last_frame: what was judged;
    tracks: of the tracks, None where there are none or the truth does not tell its targets apart (a note then says so).
    frames_from: "run.json", "given", or "named" when nothing told how many frames there were. notes: remarks.
    """

    area: float
    average_precision: float
    best_f1: OperatingPoint
    everything: OperatingPoint
    at: tuple[OperatingPoint, ...]
    curve: Curve
    targets: int
    true_detections: int
    false_detections: int
    neutral_detections: int
    frames: int
    first_frame: int
    last_frame: int
    frames_from: str
    notes: tuple[str, ...]
    tracks: TrackEvaluation | None

    def rate_at(self, false_alarms: float) -> float:
        """Detection rate at the lowest threshold that gives at most so many false alarms a frame."""
        count = int(np.searchsorted(self.curve.false_alarms, false_alarms, side="right"))
        return float(self.curve.detection_rate[count - 1]) if count else 0.0

    def __repr__(self) -> str:
        best = 0.0 if self.best_f1.point is None else self.best_f1.point.f1
        return (
            f"Evaluation({self.frames} frames, {self.targets} targets, area={self.area:.3f}, "
            f"rate_at(1)={self.rate_at(1):.3f}, average_precision={self.average_precision:.3f}, best_f1={best:.3f})"
        )


def evaluate(
    detections: Found,
    truth: Expected,
    *,
    frames: int | None = None,
    start: int = 0,
    stop: int | None = None,
    radius: float = 5.0,
    margin: float = 2.0,
    html: str | os.PathLike[str] | None = None,
) -> Evaluation:
    """Judges detections against ground truth over all thresholds, as `apgstmd eval` does.

    A detection is true when it lies within `radius` px of the centre of a visible target or inside its box grown by
    `margin` px, one to one, best score first. Targets that are not visible and boxes to ignore neither reward nor punish.

    Tracks are judged besides, where there are some and the truth tells its targets apart: see `TrackEvaluation`.

    detections : what `apgstmd.run` returned, or its `detections` or `tracks`; a path to a results folder, detections.csv,
        detections.jsonl, tracks.csv or MOTChallenge text; or columns (a dict of arrays, a data frame, a structured array)
        frame, x, y, score and perhaps direction in radians (NaN: unknown) and track.
    truth : what `apgstmd.synth` returned, or its `truth`; a path to its folder, truth.csv, another box CSV, MOTChallenge
        text or a scene file; or columns frame, x, y, w, h and perhaps visible, id, ignore. x, y is the upper left edge.
    frames : how many frames the detector saw, counted from 0. Without it the run tells; without that they reach to the
        last frame that is named. Frames without truth count their false alarms, so this number matters.
    start, stop : judge only these, `stop` not included.
    html : write a page with the table and both curves to this file.

    Raises FileNotFoundError for a missing file, TypeError for columns that are not there, ValueError for numbers that are
    not finite, columns of different lengths and frames that are none, RuntimeError for files that cannot be read.

    >>> import apgstmd
    >>> found = {"frame": [0, 1], "x": [11.5, 60], "y": [21.5, 7], "score": [0.9, 0.4]}
    >>> boxes = {"frame": [0, 1], "x": [10, 11], "y": [20, 20], "w": [4, 4], "h": [4, 4]}
    >>> result = apgstmd.evaluate(found, boxes, frames=2)
    >>> result.area, result.rate_at(0.1), result.curve.false_alarms
    (0.5, 0.5, array([0. , 0.5]))
    """
    text = _core.evaluate(
        _found(detections),
        _tracks(detections),
        _expected(truth),
        whole("frames", frames, 1, 2**63 - 1),
        whole("start", start, 0, 2**63 - 1) or 0,
        whole("stop", stop, 0, 2**63 - 1),
        radius,
        margin,
        None if html is None else os.fspath(html),
    )
    record = json.loads(text)
    points = record["curve"]
    columns = {name: [point[name] for point in points] for name in Curve.names}
    kinds = {name: np.int64 if name.endswith("detections") else np.float64 for name in Curve.names}
    return Evaluation(
        curve=Curve(**{name: np.array(column, kinds[name]) for name, column in columns.items()}),
        at=tuple(_operating(point) for point in record["at"]),
        best_f1=_operating(record["best_f1"]),
        everything=_operating(record["all"]),
        notes=tuple(record["notes"]),
        tracks=None if record["tracks"] is None else _track_evaluation(record["tracks"]),
        **{name: record[name] for name in ("area", "average_precision", "frames", "first_frame", "last_frame")},
        **{name: record[name] for name in ("targets", "true_detections", "false_detections", "neutral_detections")},
        frames_from=record["frames_from"],
    )


def _operating(record: dict[str, Any]) -> OperatingPoint:
    point = record["point"]
    return OperatingPoint(**(record | {"point": None if point is None else CurvePoint(**point)}))


def _track_evaluation(record: dict[str, Any]) -> TrackEvaluation:
    points = record["hota_at"]
    curve = HotaCurve(**{name: np.array([point[name] for point in points]) for name in HotaCurve.names})
    return TrackEvaluation(**(record | {"hota_at": curve}))


def _tracks(detections: Found) -> Any:
    if isinstance(detections, (str, os.PathLike)):
        return None  # The core reads them.
    if isinstance(detections, Run) and not len(detections.tracks):
        return None
    read = _Reader("tracks", detections.tracks if isinstance(detections, Run) else detections)
    if "track" not in read.names:
        return None
    return read.checked(read.frames(), read.column("track", np.int64), read.real("x"), read.real("y"))


def _found(detections: Found) -> Any:
    if isinstance(detections, (str, os.PathLike)):
        return _existing(detections)
    run = json.dumps(detections.summary) if isinstance(detections, Run) else None
    table: Any = detections.detections if isinstance(detections, Run) else detections
    read = _Reader("detections", table)
    frame, x, y, score = read.frames(), read.real("x"), read.real("y"), read.real("score")
    direction = read.real("direction") if "direction" in read.names else np.full(len(frame), np.nan)
    return read.checked(frame, x, y, score, direction) + (run,)


def _expected(truth: Expected) -> Any:
    if isinstance(truth, (str, os.PathLike)):
        return _existing(truth)
    read = _Reader("truth", truth.truth if isinstance(truth, Scene) else truth)
    frame = read.frames()
    ids = read.column("id", np.int64) if "id" in read.names else None
    sides = [read.real(name) for name in ("x", "y", "w", "h")]
    flags = [
        read.column(name, np.bool_) if name in read.names else np.full(len(frame), missing)
        for name, missing in (("visible", True), ("ignore", False))
    ]
    frame, *rest = read.checked(frame, *sides, *flags, *([] if ids is None else [ids]))
    return (frame, ids, *rest[:6])


def _existing(path: str | os.PathLike[str]) -> str:
    text = os.fspath(path)
    if not os.path.exists(text):
        raise FileNotFoundError(f"there is no file or folder {text!r}")
    return text


class _Reader:
    """Columns by name, whatever holds them."""

    def __init__(self, what: str, table: Any) -> None:
        self.what = what
        self.table = table.columns if isinstance(table, Table) else table
        dtype = getattr(table, "dtype", None)
        names = getattr(dtype, "names", None)
        if names is None and hasattr(self.table, "keys"):
            names = list(self.table.keys())
        if names is None:
            raise TypeError(f"{what} must be a path or columns by name, not {type(table).__name__}")
        self.names = tuple(names)

    def column(self, name: str, dtype: Any) -> NDArray[Any]:
        if name not in self.names:
            raise TypeError(f"{self.what} have no column {name!r}: they have {', '.join(map(str, self.names))}")
        column = np.asarray(self.table[name])
        if column.ndim != 1:
            raise ValueError(f"the column {name!r} of {self.what} must have one dimension, not the shape {column.shape}")
        if dtype is np.int64 and column.size and not np.array_equal(column, column.astype(np.int64)):
            raise ValueError(f"the column {name!r} of {self.what} must hold whole numbers")
        return column.astype(dtype)

    def real(self, name: str) -> NDArray[np.float64]:
        return self.column(name, np.float64)

    def frames(self) -> NDArray[np.int64]:
        frames = self.column("frame", np.int64)
        if frames.size and frames.min() < 0:
            raise ValueError(f"the column 'frame' of {self.what} holds {frames.min()}, but frames count from 0")
        return frames

    def checked(self, *columns: NDArray[Any]) -> tuple[NDArray[Any], ...]:
        if len({column.shape for column in columns}) > 1:
            raise ValueError(f"the columns of {self.what} must be of one length")
        return columns
