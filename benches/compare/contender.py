"""One contender over one clip, in a process of its own: milliseconds of each frame and peak memory, as JSON on stdout."""

from __future__ import annotations

import argparse
import json
import resource
import sys
import time
import tomllib
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np

Step = Callable[[np.ndarray], object]


def ours(size: tuple[int, int], speed: float, threads: int) -> Step:
    import apgstmd

    return apgstmd.Detector(size, speed=speed, threads=threads).process


def numpy_model(size: tuple[int, int], speed: float, *, separable: bool) -> Step:
    import apgstmd
    from model import ApgStmd

    return ApgStmd(*size, tomllib.loads(apgstmd.params(speed=speed)), separable=separable).process


def subtractor(size: tuple[int, int], speed: float, name: str) -> Step:
    import cv2

    return getattr(cv2, f"createBackgroundSubtractor{name}")().apply


# What it imports, and how it is made.
CONTENDERS: dict[str, tuple[list[str], Callable[..., Step]]] = {
    "apgstmd-1": (["apgstmd"], partial(ours, threads=1)),
    "apgstmd-2": (["apgstmd"], partial(ours, threads=2)),
    "numpy-filter2d": (["apgstmd", "cv2"], partial(numpy_model, separable=False)),
    "numpy-separable": (["apgstmd", "cv2"], partial(numpy_model, separable=True)),
    "mog2": (["cv2"], partial(subtractor, name="MOG2")),
    "knn": (["cv2"], partial(subtractor, name="KNN")),
}


def rss_now() -> float:
    """MiB; the peak so far where the system does not say."""
    statm = Path("/proc/self/statm")
    return int(statm.read_text().split()[1]) * resource.getpagesize() / 2**20 if statm.exists() else peak_rss()


def peak_rss() -> float:
    """MiB."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**20


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", choices=CONTENDERS)
    parser.add_argument(
        "clip", type=Path, help="uint8 frames (T, H, W) as .npy: read one by one, so that its size does not count"
    )
    parser.add_argument("--speed", type=float, required=True)
    parser.add_argument("--warm-up", type=int, required=True)
    args = parser.parse_args()
    spent: list[float] = []
    cpu = 0.0
    with args.clip.open("rb") as file:
        np.lib.format.read_magic(file)
        (count, height, width), _, _ = np.lib.format.read_array_header_1_0(file)
        imports, make = CONTENDERS[args.name]
        for name in imports:
            import_module(name)
        before = rss_now()
        step = make((height, width), args.speed)
        for t in range(count):
            if t == args.warm_up:
                cpu = time.process_time()
            frame = np.frombuffer(file.read(height * width), np.uint8).reshape(height, width)
            begin = time.perf_counter()
            step(frame)
            spent.append(1e3 * (time.perf_counter() - begin))
    cpu_ms = 1e3 * (time.process_time() - cpu) / (count - args.warm_up)
    print(
        json.dumps(
            {
                "cpu_ms": cpu_ms,
                "ms": spent[args.warm_up :],
                "peak_rss_mib": peak_rss(),
                "own_mib": peak_rss() - before,
            }
        )
    )


if __name__ == "__main__":
    main()
