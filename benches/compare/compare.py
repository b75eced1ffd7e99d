"""apg-STMD as this program, as NumPy and OpenCV, and OpenCV's background subtractors, over one clip: `make compare`.

Each contender runs in a process of its own, frame by frame, and is timed from the frame in memory to its result.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
SCENE = ROOT / "benches/scenes/clutter_480x270.toml"
LABELS = {
    "apgstmd-2": "apgstmd, 2 threads",
    "apgstmd-1": "apgstmd, 1 thread",
    "numpy-filter2d": "the same model, NumPy + OpenCV, filter2D",
    "numpy-separable": "the same model, NumPy + OpenCV, separable",
    "mog2": "OpenCV MOG2 (a mask of what changed)",
    "knn": "OpenCV KNN (a mask of what changed)",
}
REFERENCE = "apgstmd-2"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--scene", type=Path, default=SCENE, help="what `apgstmd synth` draws [default: %(default)s]"
    )
    parser.add_argument("--frames", type=int, help="frames of it [default: all]")
    parser.add_argument("--speed", type=float, default=1.0, help="speed of its targets, px/frame")
    parser.add_argument("--warm-up", type=int, default=60, help="frames that are not counted")
    parser.add_argument("--repeat", type=int, default=3, help="runs of each, in turn; the quietest counts")
    parser.add_argument("--out", type=Path, default=ROOT / "target/compare.json", help="where the numbers go")
    parser.add_argument("--record", action="store_true", help="keep them under benches/record as well")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        clip, shape = draw(args.scene, args.frames, Path(folder))
        runs: dict[str, list[dict[str, Any]]] = {name: [] for name in LABELS}
        for _ in range(args.repeat):
            for name in LABELS:
                runs[name].append(run(name, clip, args.speed, args.warm_up))
    result = {
        "command": "make compare",
        "scene": os.path.relpath(args.scene, ROOT),
        "frames": shape[0],
        "width": shape[2],
        "height": shape[1],
        "warm_up": args.warm_up,
        "repeat": args.repeat,
        **machine(),
        "contenders": rows(runs),
    }
    text = json.dumps(result, indent=2) + "\n"
    paths = [args.out]
    if args.record:
        paths.append(
            ROOT / "benches/record" / slug(result["cpu"], result["cores"]) / f"{result['date']}-compare.json"
        )
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    print(table(result))
    print("wrote", ", ".join(os.path.relpath(path) for path in paths))


def draw(scene: Path, frames: int | None, folder: Path) -> tuple[Path, tuple[int, ...]]:
    program = Path(sys.executable).with_name("apgstmd")
    count = [] if frames is None else ["--frames", str(frames)]
    subprocess.run([program, "synth", scene, "--out", folder / "clip", "--quiet", *count], check=True)
    pictures = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted((folder / "clip").glob("*.png"))]
    clip = np.stack(pictures)
    np.save(folder / "clip.npy", clip)
    return folder / "clip.npy", clip.shape


def run(name: str, clip: Path, speed: float, warm_up: int) -> dict[str, Any]:
    argv = [sys.executable, HERE / "contender.py", name, clip, "--speed", str(speed), "--warm-up", str(warm_up)]
    # OpenBLAS threads spin beside OpenCV's own: on two cores they made the NumPy models three times slower.
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(argv, check=True, stdout=subprocess.PIPE, text=True, env=environment)
    return json.loads(done.stdout)


def rows(runs: dict[str, list[dict[str, Any]]]) -> list[dict[str, Any]]:
    medians = {name: min(statistics.median(run["ms"]) for run in of) for name, of in runs.items()}
    return [
        {
            "name": name,
            "label": label,
            "ms_per_frame": round(medians[name], 3),
            "frames_per_second": round(1e3 / medians[name], 1),
            "times_of_ours": round(medians[name] / medians[REFERENCE], 2),
            "cpu_ms_per_frame": round(min(run["cpu_ms"] for run in runs[name]), 3),
            "ms_p10": round(min(float(np.percentile(run["ms"], 10)) for run in runs[name]), 3),
            "peak_rss_mib": round(max(run["peak_rss_mib"] for run in runs[name]), 1),
            "own_mib": round(max(run["own_mib"] for run in runs[name]), 1),
        }
        for name, label in LABELS.items()
    ]


def machine() -> dict[str, Any]:
    git = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=ROOT, capture_output=True, text=True)
    return {
        "date": datetime.date.today().isoformat(),
        "commit": git.stdout.strip() or "unknown",
        "cpu": cpu_name(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "opencv": cv2.__version__,
        "opencv_threads": cv2.getNumThreads(),
    }


def cpu_name() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    named = re.search(r"^model name\s*:\s*(.+)$", cpuinfo.read_text(), re.MULTILINE) if cpuinfo.exists() else None
    return named.group(1).strip() if named else platform.processor() or platform.machine()


def slug(cpu: str, cores: int) -> str:
    return re.sub(r"[^a-z0-9]+", "-", cpu.lower()).strip("-") + f"-{cores}-cores"


def table(result: dict[str, Any]) -> str:
    width = max(map(len, LABELS.values()))
    lines = [
        f"{result['width']} x {result['height']}, {result['frames']} frames of {result['scene']}, streaming; "
        f"{result['cpu']}, {result['cores']} cores; OpenCV {result['opencv']}, {result['opencv_threads']} threads",
        "",
        f"{'':{width}}  ms/frame  frames/s  times ours  CPU ms  peak MiB  own MiB",
    ]
    for row in result["contenders"]:
        lines.append(
            f"{row['label']:{width}}  {row['ms_per_frame']:8.2f}  {row['frames_per_second']:8.1f}  "
            f"{row['times_of_ours']:9.2f}x  {row['cpu_ms_per_frame']:6.1f}  {row['peak_rss_mib']:8.0f} {row['own_mib']:8.0f}"
        )
    lines += [
        "",
        "Median over frames after warm-up, lowest of the runs; CPU is what all threads spent on a frame together.",
        "MOG2 and KNN are there for scale: they mark pixels that differ from a learnt background, know no targets,",
        "directions or camera motion, and do much less.",
        "Peak is the whole process with Python and its libraries; own is what was added once those were loaded.",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
