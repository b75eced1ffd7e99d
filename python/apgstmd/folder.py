"""Whole folders, videos, streams and arrays: the command line's `run`, in this process."""

from __future__ import annotations

import hashlib
import inspect
import json
import os
import tempfile
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias, Unpack

import numpy as np
from numpy.typing import NDArray

from . import _core
from .options import Localise, Model, ParamFile, Parameters, Preset, Rejection, is_toml, resolve, whole
from .results import Camera, RunDetections, RunFrame, Tracks
from .rows import read_camera, read_detections, read_tracks, seen_frame
from .run_options import RunOptions
from .scene import Scene
from .sources import Frames, Grey, arrays
from .stream import Rectangle, rois

_OPTIONS = (
    *("out", "start", "stop", "step", "fps", "live", "grey", "bit_depth", "largest_frame", "on_error", "threads"),
    *("force", "checkpoint", "resume", "overlay", "formats"),
    *("speeds", "sizes", "contrast", "false_alarms", "roi", "mask"),
    *("dump", "dump_frames", "dump_dir", "progress", "tracks", "mot", "coco", "box_size"),
    *("video", "video_response", "report"),
)


Input: TypeAlias = str | os.PathLike[str] | Scene | Frames


@dataclass(frozen=True, slots=True)
class Run:
    """What a folder showed.

    detections: all of them, with the columns frame, name and time. tracks: what links them from frame to frame, empty where
    none were asked for. camera: how the background moved, a row a frame. frames: how many were processed. out: the folder with the results, None where none was asked for.
    summary: the content of run.json (parameters, timing, what was skipped).
    """

    detections: RunDetections
    tracks: Tracks
    camera: Camera
    frames: int
    out: Path | None
    summary: dict[str, Any]

    def __repr__(self) -> str:
        where = "" if self.out is None else f", out={str(self.out)!r}"
        tracks = len(np.unique(self.tracks.track))
        linked = f"{tracks} track{'' if tracks == 1 else 's'}"
        return f"Run({self.frames} frames, {len(self.detections)} detections, {linked}{where})"


def run(input: Input, **options: Unpack[RunOptions]) -> Run:
    """Detects targets in pictures, a video, a camera, a stream, a scene or arrays, as `apgstmd run` does.

    Parameters
    ----------
    input : a folder, or a pattern such as "frames/*.png", of PNG, JPEG, TIFF, BMP, PGM or PPM, in natural order; a video
        file, "/dev/video0", an "rtsp://" or "http://" address, through the program ffmpeg; or a scene, as a file
        "scene.toml" or as `apgstmd.synth` returns it, drawn on the way. Or frames as `Detector.process` takes them: an array
        (frames, rows, columns), any iterable of arrays (rows, columns), what `av.open` of PyAV returns, or a
        `cv2.VideoCapture`. They are fetched in the calling thread and copied, so that an iterator may use its array again.
    out : folder for detections.csv, tracks.csv, run.json and what else is asked for; without it nothing is kept on disk.
    speed : px/frame; or as text "40px/s", or "auto": a bank of detectors, the default where nothing else of the model is said.
    speeds, sizes : those of the bank, px/frame and px: 0.25 to 8 and 5, 10, 20 by default.
    contrast : the least of the bank's detections, 0 to 1, 0.003 by default.
    false_alarms : list so many a frame, 0.001 to 10: the least score is set by the clip itself, as it passes; "off" lists all
        that is found. 2 by default of a bank, "off" of a single detector. `tune` sets it by a clip without targets instead.
    model, preset, rejection, localise, threshold, params, **parameters : the model, as in `Detector`.
    roi : (x, y, width, height) in px, or several: targets are looked for there only; mask : a picture of the size of the frames,
        and only where it is not black. What is far outside is not computed.
    start, stop, step : which frames, counted from 0, `stop` not included; or seconds as text: "2.5s".
    fps : frames a second of pictures and arrays, or in place of the wrong rate of a video. PyAV and OpenCV tell times.
    grey : "rgb" or "bgr": frames in colour, with channels in this order (OpenCV's is "bgr"), become
        0.299 R + 0.587 G + 0.114 B. Without it arrays in colour are refused. Files and videos by path need it not.
    live : take the newest frame always and drop what comes meanwhile; by default so for cameras and rtsp.
    bit_depth : significant bits of 16-bit samples, 9 to 16, of arrays 1 to 16.
    largest_frame : most pixels of a frame that is read from a file, a video or a scene, in millions, 1 to 268, 64 by default: what
        claims to be larger is refused before it takes memory.
    on_error : "stop" at a picture that cannot be used, or "skip" it; `summary["skipped"]` then names it.
    threads : 1 to 256, all cores by default. The numbers do not depend on it.
    force : replace results that `out` already holds.
    checkpoint : keep all that is needed to go on in `out`, every so many frames at least and when interrupted; for tables,
        not for overlay, video, report, coco and dump. resume : go on where the same run left off, from its checkpoint or from
        the beginning where there is none; what is through already is only read. Frames that are given must be the same ones,
        from the first on.
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
    cannot be read or used and folders that cannot be written, and what an iterable raises. Ctrl-C ends it after the frame in
    work. The files in `out` are complete up to there each time.

        found = apgstmd.run("frames/")
        found.detections[found.detections.frame == 100].x

    >>> import apgstmd
    >>> frames = list(apgstmd.synth("demo"))[:40]
    >>> apgstmd.run(frames, speed=1.0, fps=100).frames
    40
    """
    plan = _plan(input, **options)
    with tempfile.TemporaryDirectory(prefix="apgstmd-") as place:
        scratch = Path(place)
        _core.run(plan.command(scratch), plan.frames, plan.bits)
        results = scratch / "out" if plan.out is None else plan.out
        summary = json.loads((results / "run.json").read_text(encoding="utf-8"))
        detections = read_detections(results / "detections.csv")
        found = read_tracks(results / "tracks.csv" if plan.tracks else None)
        camera = read_camera(results / "camera.csv")
    return Run(detections, found, camera, summary["frames"], plan.out, summary)


def watch(input: Input, **options: Unpack[RunOptions]) -> Generator[RunFrame, None, None]:
    """As `run`, but what each frame shows comes as soon as it is known: a generator of `RunFrame`.

    `close()`, or leaving it alone, ends the run after the frame in work. Without `out` nothing is kept, however long it goes on;
    with it the files are complete up to there, and with `resume` only frames come that were not through. Frames are read some way ahead of what has been taken; of a bank with false
    alarms limited the first 30 come together, unless `live`. Raises what `run` raises: for wrong arguments here, for the rest
    when the first frame is asked for.

    >>> import apgstmd
    >>> for seen in apgstmd.watch(apgstmd.synth("demo"), speed=1.0):
    ...     if len(seen.detections):
    ...         break
    >>> seen.frame < 40, seen
    (True, RunFrame(scene_000006, 1 detections, 0 points of tracks))
    """
    return _watched(_plan(input, **options))


def _watched(plan: _Plan) -> Generator[RunFrame, None, None]:
    with tempfile.TemporaryDirectory(prefix="apgstmd-") as place:
        running = _core.Running(plan.command(Path(place)), plan.frames, plan.bits, plan.out is not None)
        try:
            while (seen := running.next()) is not None:
                yield seen_frame(*seen)
        finally:
            running.close()


@dataclass(frozen=True, slots=True)
class _Plan:
    """What is to be run: the command, given a folder for what it needs on the way, and what Python keeps of it."""

    command: Callable[[Path], list[str]]
    frames: Iterator[tuple[NDArray[Any], float | None]] | None
    bits: int | None
    out: Path | None
    tracks: bool


def _plan(
    input: Input,
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
    grey: Grey | None = None,
    bit_depth: int | None = None,
    largest_frame: int | None = None,
    on_error: Literal["stop", "skip"] = "stop",
    threads: int | None = None,
    force: bool = False,
    checkpoint: int | None = None,
    resume: bool = False,
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
) -> _Plan:
    """The arguments of `run`, checked."""
    told = speed if not isinstance(speed, str) else None
    text = resolve(model, preset, told, rejection, localise, threshold, params, dict(parameters), _OPTIONS)
    given = None if isinstance(input, (str, os.PathLike, Scene)) else arrays(input, grey)
    path = os.fspath(input) if isinstance(input, (str, os.PathLike)) else None
    if grey is not None and given is None:
        raise ValueError("grey is for arrays: pictures and videos by path say themselves what their colours are")
    elsewhere = path is not None and ("://" in path or path == "-" or any(mark in path for mark in "*?[%{"))
    if path is not None and not elsewhere and not os.path.exists(path):
        raise FileNotFoundError(f"there is no file or folder {path!r}")
    if out is None and (overlay or (dump and dump_dir is None)):
        raise ValueError("overlay and dump write files: name a folder for them with out=")
    kept = Path(out) if out is not None and (checkpoint is not None or resume) else None
    if kept is None and (checkpoint is not None or resume):
        raise ValueError("checkpoint and resume need a folder in which results stay: name one with out=")
    bits = whole("bit_depth", bit_depth, 1, 16)
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
        # Of arrays the binding knows what fewer bits mean.
        "bit-depth": None if given is not None and bits is not None and bits < 9 else bits,
        "largest-frame": whole("largest_frame", largest_frame, 1, 268),
        "on-error": on_error,
        "threads": whole("threads", threads, 1, 256),
        "checkpoint": whole("checkpoint", checkpoint, 1, 2**63 - 1),
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
    switches = {"force": force, "resume": resume, "overlay": overlay, "quiet": not progress, "no-tracks": not tracks}
    switches["video-response"] = video_response
    flags = [name for name, wanted in switches.items() if wanted]
    regions = rois(roi)

    def command(scratch: Path) -> list[str]:
        source = "the frames given" if path is None else path
        if isinstance(input, Scene):
            # What is resumed is known by its name, and this one by what it holds.
            folder = kept / f"scene-{hashlib.sha256(input.toml.encode()).hexdigest()[:8]}" if kept else scratch
            folder.mkdir(parents=True, exist_ok=True)
            source = str(folder / "scene.toml")
            Path(source).write_text(input.toml, encoding="utf-8")
        path_of = None if params is None or isinstance(params, Mapping) or is_toml(params) else os.fspath(params)
        if parameters or (params is not None and path_of is None):
            # The command line has no flag for each parameter, but it takes a file with all of them.
            file = scratch / "params.toml"
            file.write_text(text, encoding="utf-8")
            said: dict[str, object] = {"params": str(file), "speed": speed if told is None else None}
        else:
            # Said as on the command line, so that run.json tells what was asked for.
            said = {"model": model, "preset": preset, "speed": speed, "rejection": rejection, "localise": localise}
            said |= {"threshold": threshold, "params": path_of}
        said["out"] = scratch / "out" if out is None else os.fspath(out)
        flagged = [f"--{name}={value}" for name, value in (options | said).items() if value is not None]
        flagged += regions
        return ["apgstmd", "run", *flagged, *(f"--{flag}" for flag in flags), "--", source]

    return _Plan(command, given, bits, None if out is None else Path(out), tracks)


# For help() and the manual: the keywords by name.
for _public in (run, watch):
    _signature = inspect.signature(_plan)
    setattr(_public, "__signature__", _signature.replace(return_annotation=_public.__annotations__["return"]))


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


def _place(name: str, place: int | str | None, least: int) -> int | str | None:
    return place if isinstance(place, str) else whole(name, place, least, 2**63 - 1)


def _frames(frames: str | Iterable[int] | None) -> str | None:
    return frames if frames is None or isinstance(frames, str) else ",".join(map(str, frames))
