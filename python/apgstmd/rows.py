"""Rows of a run as tables: from its files, and frame by frame."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .results import Camera, EgoMotion, RunDetections, RunFrame, Tracks


def seen_frame(
    number: int,
    name: str,
    seconds: float | None,
    detections: tuple[list[NDArray[np.float32]], NDArray[np.int64]],
    tracks: tuple[list[NDArray[np.int64]], list[NDArray[np.float64]], NDArray[np.float32], list[str]],
    shift: tuple[float, float],
    ego: tuple[float, float, float, bool],
    cut: bool,
) -> RunFrame:
    """What `_core.Running.next` gave."""
    columns, trace = detections
    real = ("x", "y", "score", "direction", "speed", "size", "contrast")
    time = np.nan if seconds is None else seconds
    found = RunDetections(
        frame=np.full(len(trace), number, np.int64),
        name=np.full(len(trace), name),
        time=np.full(len(trace), time, np.float64),
        trace=trace,
        **dict(zip(real, columns, strict=True)),
    )
    whole_numbers, numbers, score, state = tracks
    points = Tracks(
        score=score,
        state=np.array(state, np.str_),
        **dict(zip(("frame", "track", "age"), whole_numbers, strict=True)),
        **dict(zip(("time", "x", "y", "vx", "vy"), numbers, strict=True)),
    )
    return RunFrame(number, name, time, found, points, shift, EgoMotion(*ego), cut)


class _Cells:
    """Cells of a CSV file by column."""

    def __init__(self, path: Path | None) -> None:
        self.rows: list[dict[str, str]] = []
        if path is not None:
            with path.open(encoding="utf-8", newline="") as file:
                self.rows = list(csv.DictReader(file))

    def __call__(self, name: str, dtype: Any) -> Any:
        # Empty where there is no value: the direction of a model that has none, an unknown time.
        return np.array([row[name] or "nan" for row in self.rows], dtype=np.str_).astype(dtype)


def read_tracks(path: Path | None) -> Tracks:
    """tracks.csv, by frame and track; none without a path."""
    column = _Cells(path)
    whole = {name: column(name, np.int64) for name in ("frame", "track", "age")}
    real = {name: column(name, np.float64) for name in ("x", "y", "vx", "vy")}
    time, score, state = column("time_s", np.float64), column("score", np.float32), column("state", np.str_)
    table = Tracks(time=time, score=score, state=state, **whole, **real)
    # Rows were written as they became certain.
    return table[np.lexsort((table.track, table.frame))]


def read_camera(path: Path) -> Camera:
    """camera.csv."""
    column = _Cells(path)
    whole = {name: column(name, np.int64) for name in ("frame", "detections")}
    real = {name: column(name, np.float64) for name in ("background_x", "background_y", "zoom", "residual")}
    said = {name: column(name, np.int64) != 0 for name in ("unexplained", "cut")}
    time, rotation = column("time_s", np.float64), column("rotation_rad", np.float64)
    return Camera(time=time, rotation=rotation, **whole, **real, **said)


def read_detections(path: Path) -> RunDetections:
    """detections.csv."""
    column = _Cells(path)
    return RunDetections(
        frame=column("frame", np.int64),
        name=column("name", np.str_),
        time=column("time_s", np.float64),
        x=column("x", np.float32),
        y=column("y", np.float32),
        score=column("score", np.float32),
        direction=column("direction_rad", np.float32),
        trace=column("trace", np.int64),
        speed=column("speed", np.float32),
        size=column("size", np.float32),
        contrast=np.nan_to_num(column("contrast", np.float32)),
    )
