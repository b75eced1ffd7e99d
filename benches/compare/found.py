"""What is found: one detector of apgstmd, OpenCV's background subtractors and frame differences, on the same scenes.

    .venv-compare/bin/python benches/compare/found.py         after `make compare`; a table, and every area as CSV with --csv FILE

Three dark targets of 5 x 5 px at 1 px/frame before clutter of contrast 0.15, noise 0.004, 8 bits, 160 x 120, 200 frames, the first 100 for
learning and not judged. Of a mask every blob of 2 to 150 px is a detection, at its centre, its score the largest difference from the
learnt background; so the subtractors' own threshold is theirs (varThreshold 16, dist2Threshold 400, no shadows), and no
filter or tracker stands behind them. Frame differences: the 20 largest changes, one to a neighbourhood.
"""

import argparse
import csv
import statistics

import apgstmd
import cv2
import numpy as np

FRAMES, FROM, SEEDS = 200, 100, (1, 2, 3)
CONTRASTS, PANS = (0.15, 0.3), (0.0, 0.3, 1.0)
STARTS = (([30, 25], 0.0), ([15, 60], 0.2), ([100, 100], 3.3))


def scene(contrast, pan, seed):
    """Targets that begin when the subtractors have learnt."""
    paths = [{"kind": "straight", "start": start, "speed": 30, "direction": angle} for start, angle in STARTS]
    clutter = {"kind": "natural", "mean": 0.5, "contrast": 0.15, "velocity": [-30 * pan, 0]}
    targets = [{"shade": {"dark": contrast}, "path": path, "start": FROM - 20} for path in paths]
    look = {"width": 160, "height": 120, "rate": 30, "frames": FRAMES, "seed": seed, "noise": 0.004}
    return apgstmd.synth(look | {"background": clutter, "target": targets})


def table(rows):
    """Rows of frame, x, y, score as columns."""
    return dict(zip(("frame", "x", "y", "score"), np.array(rows, float).reshape(-1, 4).T, strict=True))


def subtracted(frames, subtractor):
    """Blobs of what differs from the learnt background."""
    rows = []
    for t, frame in enumerate(frames):
        mask = subtractor.apply(frame)
        difference = cv2.absdiff(frame, subtractor.getBackgroundImage())
        count, labels, facts, centers = cv2.connectedComponentsWithStats(mask)
        for blob in range(1, count):
            if 2 <= facts[blob, cv2.CC_STAT_AREA] <= 150:
                rows.append((t, *centers[blob], difference[labels == blob].max()))
    return table(rows)


def differences(frames, peaks=20, radius=5):
    """Peaks of the change from frame to frame."""
    rows = []
    for t in range(1, len(frames)):
        change = cv2.absdiff(frames[t], frames[t - 1])
        for _ in range(peaks):
            y, x = np.unravel_index(change.argmax(), change.shape)
            rows.append((t, x, y, change[y, x]))
            change[max(y - radius, 0) : y + radius + 1, max(x - radius, 0) : x + radius + 1] = 0
    return table(rows)


CONTENDERS = {
    "apgstmd, one detector": lambda clip, frames: apgstmd.run(clip, speed=1.0, tracks=False),
    "OpenCV MOG2": lambda clip, frames: subtracted(frames, cv2.createBackgroundSubtractorMOG2(detectShadows=False)),
    "OpenCV KNN": lambda clip, frames: subtracted(frames, cv2.createBackgroundSubtractorKNN(detectShadows=False)),
    "frame differences": lambda clip, frames: differences(frames),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--csv", help="write every area there")
    args = parser.parse_args()
    rows = []
    for pan in PANS:
        for contrast in CONTRASTS:
            for seed in SEEDS:
                clip = scene(contrast, pan, seed)
                frames = np.rint(255 * clip[:]).astype(np.uint8)
                for name, find in CONTENDERS.items():
                    found = find(clip, frames)
                    counted = {} if isinstance(found, apgstmd.Run) else {"frames": FRAMES}
                    area = apgstmd.evaluate(found, clip, start=FROM, **counted).area
                    rows.append((name, pan, contrast, seed, round(area, 4)))
    if args.csv:
        with open(args.csv, "w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([("contender", "pan", "contrast", "seed", "area"), *rows])
    print("area under the detection rate over 0..1 false alarms a frame, mean over seeds")
    print(f"{'pan, px/frame; contrast':24}" + "".join(f"{f'{pan}; {contrast}':>12}" for pan in PANS for contrast in CONTRASTS))
    for name in CONTENDERS:
        cells = (
            statistics.mean(area for who, p, c, _, area in rows if (who, p, c) == (name, pan, contrast))
            for pan in PANS
            for contrast in CONTRASTS
        )
        print(f"{name:24}" + "".join(f"{cell:12.2f}" for cell in cells))


if __name__ == "__main__":
    main()
