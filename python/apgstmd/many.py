"""Many videos: a process each, on this machine or wherever a Dask cluster has workers."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Unpack

from . import _core
from ._optional import need
from .options import Localise, Model, ParamFile, Parameters, Preset, Rejection, resolve, whole
from .stream import Rectangle, rois


class ClipOptions(Parameters, total=False):
    """What `batch` takes for each video: keywords of `run`, and every parameter of the model."""

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
    bit_depth: int | None
    largest_frame: int | None
    on_error: Literal["stop", "skip"]
    formats: Sequence[Literal["csv", "jsonl"]]
    overlay: bool
    dump: Sequence[str]
    dump_frames: str | Iterable[int] | None
    tracks: bool
    mot: bool
    coco: bool
    box_size: float | None
    video: bool
    video_response: bool
    report: bool


@dataclass(frozen=True, slots=True)
class Clip:
    """What became of one video.

    name: of its folder. input: its full path. done: its folder is whole; if not, error says why. folder: where its results
    are; None where it left nothing. frames, detections, tracks: how many, None where that is not known. record: its entry in
    manifest.json, with flags, times and checksums.
    """

    name: str
    input: str
    done: bool
    error: str | None
    folder: Path | None
    frames: int | None
    detections: int | None
    tracks: int | None
    record: dict[str, Any]


def batch(
    paths: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    *,
    client: Any = None,
    jobs: int | None = None,
    threads: int | None = None,
    resume: bool = False,
    progress: bool = False,
    **options: Unpack[ClipOptions],
) -> list[Clip]:
    """Runs over many videos, a process each, as `apgstmd batch` does.

    Parameters
    ----------
    paths : videos, folders of pictures, scene files; patterns ("clips/*.mp4"); lists ("@list.txt"); one or many of them.
    out : folder for all results: clips/NAME with what `run` writes, manifest.json, index.html.
    client : a `distributed.Client` (the extra `batch`): its workers do the videos. They must see `paths` and `out` under the
        same names, and have this package. Without it this machine does.
    jobs : videos at a time on this machine, one per core by default. With a client, its workers' threads say that.
    threads : threads that compute each video; cores divided by `jobs` by default, with a client 1.
    resume : go on in an `out` that was used before: what is done there, of the same input (by its checksum) and with the same
        options, is left as it is.
    progress : print a line a video. Without effect with a client, which has a dashboard.
    **options : for each video, as in `run`; but mot, coco, report and video are True or False: the files are tracks.txt,
        tracks.json, report.html and found.mp4 in the folder of the clip.

    Returns what became of each input, in the order given, each once. A video that fails raises nothing: `done` is False and
    `error` says why. A worker that dies loses nothing: its video is done by another one, and what was done is not done twice.

    Raises ValueError and TypeError for wrong options, RuntimeError for an `out` that was used before (without `resume`), or
    where another batch is at work, or that cannot be written. Ctrl-C: what was done is whole, and `resume` goes on.

        clips = apgstmd.batch("clips/*.mp4", "all", speed=1.0)
        [clip.error for clip in clips if not clip.done]
    """
    words = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
    flags = {"out": os.fspath(out), "jobs": whole("jobs", jobs, 1, 256), "threads": whole("threads", threads, 1, 256)}
    if client is not None:
        if jobs is not None:
            raise TypeError("jobs is for this machine: the client's workers say how many videos they do at a time")
        flags["threads"] = threads or 1
    given = [f"--{name}={value}" for name, value in flags.items() if value is not None]
    switches = [f"--{name}" for name, wanted in {"resume": resume, "quiet": not progress}.items() if wanted]
    described = _flags(dict(options), Path(out))
    argv = ["apgstmd", "batch", *given, *switches, *described, "--", *[os.fspath(word) for word in words]]
    texts = _core.batch(argv) if client is None else _distribute(argv, client)
    return [_clip(json.loads(text), Path(out)) for text in texts]


def _distribute(argv: list[str], client: Any) -> list[str]:
    distributed = need("distributed", "batch", "batch with a client")
    if not isinstance(client, distributed.Client) or client.asynchronous:
        raise TypeError(f"client must be a synchronous distributed.Client, not {type(client).__name__}")
    todo = _core.Batch(argv)
    interrupted = True
    # Impure: whether something is to be done says the folder, not what was asked for before.
    futures = client.map(_core.clip, todo.jobs, pure=False, key="apgstmd-clip")
    names = {future.key: job[0] for future, job in zip(futures, todo.jobs, strict=True)}
    try:
        for future in distributed.as_completed(futures):
            error = future.exception()
            if error is None:
                todo.add(future.result())
            else:
                # Workers died with it again and again, or cannot write.
                todo.lost(names[future.key], f"no worker could do it: {error}")
            # The scheduler need not remember it.
            future.release()
        interrupted = False
    finally:
        if interrupted:
            client.cancel(futures)
        texts = todo.finish(interrupted)
    return texts


def _clip(record: dict[str, Any], out: Path) -> Clip:
    folder = out / record["folder"]
    counts = {name: record[name] for name in ("frames", "detections", "tracks")}
    done = record["status"] == "done"
    there = folder if folder.is_dir() else None
    return Clip(record["name"], record["input"]["path"], done, record["error"], there, **counts, record=record)


_SWITCHES = ("overlay", "mot", "coco", "video", "video_response", "report")
_LISTS = ("speeds", "sizes", "dump", "dump_frames", "formats")
_MODEL = ("model", "preset", "speed", "rejection", "localise", "threshold", "params")
_VALUES = ("contrast", "false_alarms", "start", "stop", "step", "fps", "bit_depth", "largest_frame", "on_error", "box_size")
_REGION = ("roi", "mask")


def _flags(options: dict[str, Any], out: Path) -> list[str]:
    """The options as flags of the command line. Parameters that have none go into a file in `out`."""
    known = (*_SWITCHES, *_LISTS, *_MODEL, *_VALUES, *_REGION, "tracks")
    model = {name: options.get(name) for name in _MODEL}
    parameters = {name: value for name, value in options.items() if name not in known}
    speed, params = model["speed"], model["params"]
    told = None if isinstance(speed, str) else speed
    text = resolve(
        model["model"],
        model["preset"],
        told,
        model["rejection"],
        model["localise"],
        model["threshold"],
        params,
        dict(parameters),
        tuple(name for name in known if name not in _MODEL),
    )
    flags = {name: options.get(name) for name in _VALUES}
    if parameters or not (params is None or isinstance(params, os.PathLike)):
        # Named after what it holds: another batch's file is never replaced.
        file = out / f"params-{hashlib.sha256(text.encode()).hexdigest()[:8]}.toml"
        out.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        flags |= {"params": str(file), "speed": speed if told is None else None}
    else:
        flags |= model
    for name in _LISTS:
        value = options.get(name)
        flags[name] = value if value is None or isinstance(value, str) else ",".join(map(str, value)) or None
    if flags["formats"] is not None:
        flags["formats"] = ",".join(dict.fromkeys(("csv", *flags["formats"].split(","))))
    flags["format"] = flags.pop("formats")
    words = [f"--{name.replace('_', '-')}={value}" for name, value in flags.items() if value is not None]
    words += rois(options.get("roi", ()))
    words += [] if options.get("mask") is None else [f"--mask={os.fspath(options['mask'])}"]
    words += [f"--{name.replace('_', '-')}" for name in _SWITCHES if options.get(name)]
    return words if options.get("tracks", True) else [*words, "--no-tracks"]
