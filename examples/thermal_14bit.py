"""A stack of 14-bit thermal pictures: warm targets a few counts above a scene of thousands.

    pip install apgstmd tifffile
    python thermal_14bit.py                    makes a stack, thermal.tif, and finds what is in it
    python thermal_14bit.py --stack mine.tif   your own, (frames, rows, columns) of uint16; --cold where targets are colder

Two things matter, and both are in `spread` below:
- A camera of 14 bits uses a few hundred counts of its 16384 for one scene. On the full scale a target of 60 counts has a
  contrast of 0.004, at the end of what a bank lists (0.003). So counts are spread: by one range for the whole clip, never by
  one a frame, which would flicker as an automatic gain does.
- The model answers best to dark targets. Where targets are warm and bright, the picture is turned into its negative.
"""

import argparse
from pathlib import Path

import apgstmd
import numpy as np
import tifffile

FRAMES, SIZE = 120, (120, 160)


def make_stack(path, seed=3):
    """A cloudy sky of some 300 counts around 7200, two warm birds 60 counts above it, noise of 3 counts. Returns the scene."""
    height, width = SIZE
    birds = [([10, 40], 0.0), ([150, 90], 2.9)]
    scene = apgstmd.synth(
        {
            "width": width,
            "height": height,
            "rate": 30,
            "frames": FRAMES,
            "seed": seed,
            "noise": 0.005,
            "background": {"kind": "natural", "mean": 0.5, "contrast": 0.1, "velocity": [3, 0]},
            "target": [
                {
                    "width": 4,
                    "height": 4,
                    "shade": {"light": 0.12},
                    "path": {"kind": "straight", "start": start, "speed": 30, "direction": direction},
                }
                for start, direction in birds
            ],
        }
    )
    counts = np.rint(7000 + 500 * scene[:]).astype(np.uint16)
    tifffile.imwrite(path, counts, photometric="minisblack")
    return scene


def spread(stack, cold=False):
    """Luminance in [0, 1]: the range of the first frames with as much again to each side; targets dark."""
    low, high = np.percentile(stack[:30], [0.1, 99.9])
    middle, half = (low + high) / 2, max(high - low, 1.0)
    luminance = np.clip((stack.astype(np.float32) - middle) / (2 * half) + 0.5, 0, 1)
    return luminance if cold else 1 - luminance


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stack", type=Path, help="a TIFF stack of your own")
    parser.add_argument("--cold", action="store_true", help="targets are colder than what is behind them")
    parser.add_argument("--speeds", type=float, nargs="+", default=[0.5, 1, 2], help="px/frame")
    args = parser.parse_args(argv)

    truth = None
    if args.stack is None:
        args.stack = Path("thermal.tif")
        truth = make_stack(args.stack).truth
    stack = tifffile.imread(args.stack)
    if stack.ndim != 3 or stack.dtype != np.uint16:
        parser.error(f"{args.stack} holds {stack.dtype} of shape {stack.shape}, but a stack is (frames, rows, columns) of uint16")

    bank = apgstmd.Bank(stack.shape[1:], speeds=args.speeds)
    rows = {name: [] for name in ("frame", "x", "y", "score", "direction")}
    for number, frame in enumerate(spread(stack, args.cold)):
        for target in bank.process(frame).detections:
            for name, value in zip(rows, (number, target.x, target.y, target.score, target.direction), strict=True):
                rows[name].append(value)
    print(f"{len(stack)} frames, counts {stack.min()} to {stack.max()}, {len(rows['frame'])} detections")
    if rows["score"]:
        best = int(np.argmax(rows["score"]))
        print("strongest: " + ", ".join(f"{name} {rows[name][best]:.3g}" for name in rows))
    if truth is not None:
        print(apgstmd.evaluate(rows, truth, frames=len(stack), start=30))
    return rows


if __name__ == "__main__":
    main()
