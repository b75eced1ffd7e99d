"""How fast many videos go on this machine: `apgstmd batch` with 1 and 2 jobs, Dask with 1 and 2 workers, and what a video
costs besides its frames.

    .venv/bin/python benches/many_videos.py > benches/record/many-videos-DATE.json

Videos are made with `apgstmd synth` and ffmpeg, in a folder that goes away. Every process has one thread.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import distributed

import apgstmd

CLIPS, FRAMES = 4, 150
# Frames of two clips of one scene: the difference tells what a frame costs, what is left the start and the end.
SHORT, LONG = 30, 150


def video(place: Path, name: str, frames: int, size: tuple[int, int]) -> Path:
    """H.264 of the demo scene at another size."""
    pictures, file = place / f"{name}-pictures", place / f"{name}.mp4"
    synth = ["synth", "--demo", f"--frames={frames}", "--quiet", f"--out={pictures}"]
    subprocess.run([sys.executable, "-m", "apgstmd", *synth], check=True)
    scaled = ["-vf", f"scale={size[0]}:{size[1]}", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18"]
    source = ["-framerate", "30", "-pattern_type", "glob", "-i", str(pictures / "*.png")]
    subprocess.run(["ffmpeg", "-nostdin", "-loglevel", "error", *source, *scaled, str(file)], check=True)
    return file


def measured(name: str, clips: list[apgstmd.Clip], seconds: float) -> dict[str, Any]:
    assert all(clip.done for clip in clips)
    frames = sum(clip.frames or 0 for clip in clips)
    return {
        "what": name,
        "clips": len(clips),
        "frames": frames,
        "wall_seconds": round(seconds, 3),
        "frames_per_second": round(frames / seconds, 2),
        "processor_seconds": round(sum(clip.record["processor_seconds"] for clip in clips), 3),
        "load": round(os.getloadavg()[0], 1),
    }


def main() -> None:
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(scratch)
        first = video(place, "clip0", FRAMES, (320, 240))
        clips = [first]
        for n in range(1, CLIPS):
            clips.append(place / f"clip{n}.mp4")
            clips[-1].write_bytes(first.read_bytes())

        # In turn, so that what others do on this machine meets all alike.
        for again in range(3):
            for jobs in (1, 2):
                begin = time.perf_counter()
                done = apgstmd.batch(clips, place / f"jobs{jobs}-{again}", jobs=jobs, threads=1, speed=1.0)
                rows.append(measured(f"batch, jobs={jobs}", done, time.perf_counter() - begin))
            for workers in (1, 2):
                with (
                    distributed.LocalCluster(
                        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None
                    ) as cluster,
                    distributed.Client(cluster) as client,
                ):
                    out = place / f"workers{workers}-{again}"
                    begin = time.perf_counter()
                    done = apgstmd.batch(clips, out, client=client, threads=1, speed=1.0)
                    rows.append(measured(f"Dask, workers={workers}", done, time.perf_counter() - begin))

        costs = []
        for size, options in (((320, 240), {"speed": 1.0}), ((640, 480), {"speed": 1.0}), ((320, 240), {})):
            spent = {}
            for frames in (SHORT, LONG):
                name = f"cost{size[0]}-{len(options)}-{frames}"
                # The quickest of two: what others do on this machine only adds.
                clip = video(place, name, frames, size)
                records = []
                for again in range(2):
                    out = place / f"{name}-{again}"
                    records.append(apgstmd.batch(clip, out, jobs=1, threads=1, **options)[0].record)
                spent[frames] = min(record["processor_seconds"] for record in records)
            each = (spent[LONG] - spent[SHORT]) / (LONG - SHORT)
            written = sum(file["bytes"] for file in records[0]["files"].values())
            costs.append(
                {
                    "size": size,
                    "options": options,
                    "processor_seconds": spent,
                    "milliseconds_a_frame": round(1e3 * each, 3),
                    "start_seconds": round(spent[SHORT] - SHORT * each, 3),
                    "input_bytes_a_frame": round(records[0]["input"]["bytes"] / LONG),
                    "output_bytes_a_frame": round(written / LONG),
                    "record_bytes": len(json.dumps(records[0], indent=2)),
                }
            )
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        cpu = next((line.split(":")[1].strip() for line in file if line.startswith("model name")), "")
    about = {"cpu": cpu, "cores": os.cpu_count(), "version": apgstmd.__version__, "date": time.strftime("%Y-%m-%d")}
    json.dump({**about, "throughput": rows, "costs": costs}, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
