"""Whole folders, videos and streams: the command line's `run`, in this process."""

from __future__ import annotations

import csv
import json
import os
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Unpack

import numpy as np

from . import _core
from .options import Localise, Model, ParamFile, Parameters, Preset, Rejection, resolve, whole
from .results import RunDetections, Tracks
from .scene import Scene
from .stream import Rectangle

_OPTIONS = (
    *("out", "start", "stop", "step", "fps", "live", "bit_depth", "on_error", "threads", "force", "overlay", "formats"),
    *("speeds", "sizes", "contrast", "false_alarms"),
    *("dump", "dump_frames", "dump_dir", "progress", "tracks", "mot", "coco", "box_size"),
    *("video", "video_response", "report"),
)


@dataclass(frozen=True, slots=True)
class Run:
    """What a folder showed.

    detections: all of them, with the columns frame, name and time. tracks: what links them from frame to frame, empty where
    none were asked for. frames: how many were processed. out: the folder with the results, None where none was asked for.
    summary: the content of run.json (parameters, timing, what was skipped).
    """

    detections: RunDetections
    tracks: Tracks
    frames: int
    out: Path | None
    summary: dict[str, Any]

    def __repr__(self) -> str:
        where = "" if self.out is None else f", out={str(self.out)!r}"
        tracks = len(np.unique(self.tracks.track))
        linked = f"{tracks} track{'' if tracks == 1 else 's'}"
        return f"Run({self.frames} frames, {len(self.detections)} detections, {linked}{where})"


def run(
    input: str | os.PathLike[str] | Scene,
    *,
    out: str | os.PathLike[str] | None = None,
    model: Model | None = None,
    preset: Preset | None = None,
    speed: float | str | None = None,
    speeds: Sequence[float] = (),
    sizes: Sequence[float] = (),
    contrast: float | None = None,
    false_alarms: float | Literal["off"] | None = None,
    rejection: Rejection | None = None,
    localise: Localise | None = None,
    threshold: float | None = None,
    params: ParamFile | None = None,
    roi: Rectangle | Sequence[Rectangle] = (),
    mask: str | os.PathLike[str] | None = None,
    start: int | str | None = None,
    stop: int | str | None = None,
    step: int | str | None = None,
    fps: float | None = None,
    live: bool | None = None,
    bit_depth: int | None = None,
    on_error: Literal["stop", "skip"] = "stop",
    threads: int | None = None,
    force: bool = False,
    overlay: bool = False,
    formats: Sequence[Literal["csv", "jsonl"]] = ("csv",),
    dump: Sequence[str] = (),
    dump_frames: str | Iterable[int] | None = None,
    dump_dir: str | os.PathLike[str] | None = None,
    tracks: bool = True,
    mot: str | os.PathLike[str] | None = None,
    coco: str | os.PathLike[str] | None = None,
    box_size: float | None = None,
    video: str | os.PathLike[str] | None = None,
    video_response: bool = False,
    report: str | os.PathLike[str] | None = None,
    progress: bool = False,
    **parameters: Unpack[Parameters],
) -> Run:
    """Detects targets in pictures, a video, a camera, a stream or a scene, as `apgstmd run` does.

    Parameters
    ----------
    input : a folder, or a pattern such as "frames/*.png", of PNG, JPEG, TIFF, BMP, PGM or PPM, in natural order; a video
        file, "/dev/video0", an "rtsp://" or "http://" address, through the program ffmpeg; or a scene, as a file
        "scene.toml" or as `apgstmd.synth` returns it, drawn on the way.
    out : folder for detections.csv, tracks.csv, run.json and what else is asked for; without it nothing is kept on disk.
    speed : px/frame; or as text "40px/s", or "auto": a bank of detectors, the default where nothing else of the model is said.
    speeds, sizes : those of the bank, px/frame and px: 0.25 to 8 and 5, 10, 20 by default.
    contrast : the least of the bank's detections, 0 to 1, 0.01 by default.
    false_alarms : list so many a frame, 0.001 to 10: the least score is set by the clip itself, as it passes; "off" lists all
        that is found. 2 by default of a bank, "off" of a single detector. `tune` sets it by a clip without targets instead.
    model, preset, rejection, localise, threshold, params, **parameters : the model, as in `Detector`.
    roi : (x, y, width, height) in px, or several: targets are looked for there only; mask : a picture of the size of the frames,
        and only where it is not black. What is far outside is not computed.
    start, stop, step : which frames, counted from 0, `stop` not included; or seconds as text: "2.5s".
    fps : frames a second of pictures, or in place of the wrong rate of a video.
    live : take the newest frame always and drop what comes meanwhile; by default so for cameras and rtsp.
    bit_depth : significant bits of 16-bit samples, 9 to 16.
    on_error : "stop" at a picture that cannot be used, or "skip" it; `summary["skipped"]` then names it.
    threads : 1 to 256, all cores by default. The numbers do not depend on it.
    force : replace results that `out` already holds.
    overlay : write annotated pictures and a contact strip.
    formats : tables to write besides detections.csv: "jsonl".
    dump, dump_frames, dump_dir : stages to write as .npy, the frames ("60,120..130" or numbers), and where.
    tracks : link detections to tracks.
    mot, coco : files to write the tracks to, as MOTChallenge text (frames, ids and pixels count from 1) and as COCO JSON.
    box_size : side in px of the box that stands for a point in these; by default the size of target that the parameters
        prefer.
    video : file (.mp4, .mov, .mkv) for a video with every frame annotated, through the program ffmpeg; video_response : with
        the response map beside it.
    report : file (.html) for a page to look at what was found.
    progress : show a progress bar on a terminal and a summary.

    Raises FileNotFoundError for a missing folder, ValueError and TypeError as `Detector`, RuntimeError for pictures that
    cannot be read and folders that cannot be written. Ctrl-C ends it after the frame in work: the files in `out` are
    complete up to there.

        found = apgstmd.run("frames/")
        found.detections[found.detections.frame == 100].x
    """
    told = speed if not isinstance(speed, str) else None
    text = resolve(model, preset, told, rejection, localise, threshold, params, dict(parameters), _OPTIONS)
    path = None if isinstance(input, Scene) else os.fspath(input)
    elsewhere = path is not None and ("://" in path or path == "-" or any(mark in path for mark in "*?[%{"))
    if path is not None and not elsewhere and not os.path.exists(path):
        raise FileNotFoundError(f"there is no file or folder {path!r}")
    if out is None and (overlay or (dump and dump_dir is None)):
        raise ValueError("overlay and dump write files: name a folder for them with out=")
    options: dict[str, object] = {
        "speeds": ",".join(map(repr, map(float, speeds))) or None,
        "sizes": ",".join(map(repr, map(float, sizes))) or None,
        "contrast": contrast,
        "mask": None if mask is None else os.fspath(mask),
        "false-alarms": false_alarms,
        "start": _place("start", start, 0),
        "stop": _place("stop", stop, 0),
        "step": _place("step", step, 1),
        "fps": fps,
        "live": None if live is None else "yes" if live else "no",
        "bit-depth": whole("bit_depth", bit_depth, 1, 16),
        "on-error": on_error,
        "threads": whole("threads", threads, 1, 256),
        "format": ",".join(dict.fromkeys(("csv", *formats))),
        "dump": ",".join(dump) or None,
        "dump-frames": _frames(dump_frames),
        "dump-dir": None if dump_dir is None else os.fspath(dump_dir),
        "mot": None if mot is None else os.fspath(mot),
        "coco": None if coco is None else os.fspath(coco),
        "box-size": box_size,
        "video": None if video is None else os.fspath(video),
        "report": None if report is None else os.fspath(report),
    }
    switches = {"force": force, "overlay": overlay, "quiet": not progress, "no-tracks": not tracks}
    switches["video-response"] = video_response
    flags = [name for name, wanted in switches.items() if wanted]
    with tempfile.TemporaryDirectory(prefix="apgstmd-") as scratch:
        if isinstance(input, Scene):
            path = str(Path(scratch, "scene.toml"))
            Path(path).write_text(input.toml, encoding="utf-8")
        if parameters or not (params is None or isinstance(params, os.PathLike)):
            # The command line has no flag for each parameter, but it takes a file with all of them.
            file = Path(scratch, "params.toml")
            file.write_text(text, encoding="utf-8")
            options |= {"params": str(file), "speed": speed if told is None else None}
        else:
            # Said as on the command line, so that run.json tells what was asked for.
            options |= {"model": model, "preset": preset, "speed": speed, "rejection": rejection, "localise": localise}
            options |= {"threshold": threshold, "params": None if params is None else os.fspath(params)}
        results = Path(scratch, "out") if out is None else Path(out)
        options["out"] = str(results)
        given = [f"--{name}={value}" for name, value in options.items() if value is not None]
        given += _rois(roi)
        _core.run(["apgstmd", "run", *given, *(f"--{flag}" for flag in flags), "--", str(path)])
        summary = json.loads(Path(results, "run.json").read_text(encoding="utf-8"))
        detections = _read_table(Path(results, "detections.csv"))
        found = _read_tracks(Path(results, "tracks.csv") if tracks else None)
    return Run(detections, found, summary["frames"], None if out is None else results, summary)


def tune(
    input: str | os.PathLike[str] | Scene,
    out: str | os.PathLike[str],
    *,
    false_alarms: float = 0.1,
    speed: float | str | None = None,
    speeds: Sequence[float] = (),
    sizes: Sequence[float] = (),
    contrast: float | None = None,
    model: Model | None = None,
    preset: Preset | None = None,
    rejection: Rejection | None = None,
    localise: Localise | None = None,
    threshold: float | None = None,
    params: str | os.PathLike[str] | None = None,
    start: int | str | None = None,
    stop: int | str | None = None,
    step: int | str | None = None,
    threads: int | None = None,
    force: bool = False,
) -> str:
    """Finds the score that so many false alarms a frame have in a clip without targets, as `apgstmd tune` does.

    Writes the parameter file `out`, which `run(..., params=out)` and `Bank(..., params=out)` take, and returns its text. Its
    first lines say how well the score is known. RuntimeError where the clip is too short: three false alarms must be
    expected in it. The other arguments are those of `run`; `params` is the path of a file.
    """
    options: dict[str, object] = {
        "out": os.fspath(out),
        "false-alarms": float(false_alarms),
        "speed": speed,
        "speeds": ",".join(map(repr, map(float, speeds))) or None,
        "sizes": ",".join(map(repr, map(float, sizes))) or None,
        "contrast": contrast,
        "model": model,
        "preset": preset,
        "rejection": rejection,
        "localise": localise,
        "threshold": threshold,
        "params": None if params is None else os.fspath(params),
        "start": _place("start", start, 0),
        "stop": _place("stop", stop, 0),
        "step": _place("step", step, 1),
        "threads": whole("threads", threads, 1, 256),
    }
    given = [f"--{name}={value}" for name, value in options.items() if value is not None]
    with tempfile.TemporaryDirectory(prefix="apgstmd-") as scratch:
        path = str(Path(scratch, "scene.toml")) if isinstance(input, Scene) else os.fspath(input)
        if isinstance(input, Scene):
            Path(path).write_text(input.toml, encoding="utf-8")
        _core.run(["apgstmd", "tune", *given, "--quiet", *(["--force"] if force else []), "--", path])
    return Path(out).read_text(encoding="utf-8")


def _rois(roi: Rectangle | Sequence[Rectangle]) -> list[str]:
    rectangles = np.atleast_2d(np.asarray(roi, np.int64)) if len(roi) else np.zeros((0, 4), np.int64)
    if rectangles.ndim != 2 or rectangles.shape[1] != 4:
        raise TypeError(f"roi must be (x, y, width, height) in px, or several of them, not {roi!r}")
    return [f"--roi={width}x{height}+{x}+{y}" for x, y, width, height in rectangles]


def _place(name: str, place: int | str | None, least: int) -> int | str | None:
    return place if isinstance(place, str) else whole(name, place, least, 2**63 - 1)


def _frames(frames: str | Iterable[int] | None) -> str | None:
    return frames if frames is None or isinstance(frames, str) else ",".join(map(str, frames))


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


def _read_tracks(path: Path | None) -> Tracks:
    column = _Cells(path)
    whole = {name: column(name, np.int64) for name in ("frame", "track", "age")}
    real = {name: column(name, np.float64) for name in ("x", "y", "vx", "vy")}
    time, score, state = column("time_s", np.float64), column("score", np.float32), column("state", np.str_)
    table = Tracks(time=time, score=score, state=state, **whole, **real)
    # Rows were written as they became certain.
    return table[np.lexsort((table.track, table.frame))]


def _read_table(path: Path) -> RunDetections:
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
