"""The keywords of `run` and `watch`, for type checkers."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import Literal

from .options import Localise, Model, ParamFile, Parameters, Preset, Rejection
from .sources import Grey
from .stream import Rectangle


class RunOptions(Parameters, total=False):
    """What `run` and `watch` take besides their input; `run` says what each means."""

    out: str | os.PathLike[str] | None
    model: Model | None
    preset: Preset | None
    speed: float | str | None
    speeds: Sequence[float]
    sizes: Sequence[float]
    contrast: float | None
    false_alarms: float | Literal["off"] | None
    rejection: Rejection | None
    localise: Localise | None
    threshold: float | None
    params: ParamFile | None
    roi: Rectangle | Sequence[Rectangle]
    mask: str | os.PathLike[str] | None
    start: int | str | None
    stop: int | str | None
    step: int | str | None
    fps: float | None
    live: bool | None
    grey: Grey | None
    bit_depth: int | None
    largest_frame: int | None
    on_error: Literal["stop", "skip"]
    threads: int | None
    force: bool
    checkpoint: int | None
    resume: bool
    overlay: bool
    formats: Sequence[Literal["csv", "jsonl"]]
    dump: Sequence[str]
    dump_frames: str | Iterable[int] | None
    dump_dir: str | os.PathLike[str] | None
    tracks: bool
    mot: str | os.PathLike[str] | None
    coco: str | os.PathLike[str] | None
    box_size: float | None
    video: str | os.PathLike[str] | None
    video_response: bool
    report: str | os.PathLike[str] | None
    progress: bool
