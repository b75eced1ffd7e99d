"""The pictures of choosing.md and camera.md, drawn by the program itself when the site is made; see conf.py.

Each function draws one, as `NAME.png` in the folder that it is given. What a picture shows is checked before it is saved: a build
ends where the text beside it would no longer be true.
"""

from pathlib import Path

import apgstmd
import matplotlib
import numpy as np

matplotlib.use("agg")
import matplotlib.pyplot as plt  # noqa: E402: after the choice of a backend that needs no screen

DPI = 110
# Readable before light and dark pages.
STYLE = {"figure.facecolor": "white", "savefig.facecolor": "white", "font.size": 9}


def clip(targets, **changes):
    """A scene of 200 x 120 px before slow clutter, 30 frames a second."""
    clutter = {"kind": "natural", "mean": 0.6, "contrast": 0.1, "velocity": [-6, 1]}
    scene = {"width": 200, "height": 120, "rate": 30, "frames": 120, "seed": 4, "noise": 0.005, "background": clutter}
    return apgstmd.synth(scene | {"target": targets} | changes)


def straight(start, speed, side=5, contrast=0.4, **more):
    """A dark target to the right at `speed` px/frame."""
    path = {"kind": "straight", "start": start, "speed": 30 * speed, "direction": 0.0}
    return {"width": side, "height": side, "shade": {"dark": contrast}, "path": path} | more


def speed():
    """How a detector of 1 px/frame responds to targets of other speeds, and the bank over it."""
    figure, (single, bank) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained", sharey=True)
    speeds = np.geomspace(0.125, 16, 15)
    apgstmd.plot.tuning("speed", speeds, speed=1.0, attention_enabled=False, ax=single)
    single.axvspan(0.5, 2, color="tab:green", alpha=0.15)
    single.set_title("one detector, speed = 1: half to twice of it")
    for member in (0.25, 0.5, 1, 2, 4, 8):
        apgstmd.plot.tuning("speed", speeds, speed=member, attention_enabled=False, ax=bank)
        bank.lines[-1].set(label=f"{member:g}", marker="")
    bank.legend(title="px/frame", fontsize=7, loc="center left", bbox_to_anchor=(1, 0.5))
    bank.set(title="the six speeds of a bank", ylabel="")
    values = single.lines[0].get_ydata()
    outside = (speeds < 0.25) | (speeds > 4)
    assert values[outside].max() < 0.1, "far from its speed a detector is almost blind"
    assert 0.5 < speeds[values.argmax()] < 2
    return figure


def size():
    """Response over the side of the target, and what reduced frames make of large ones."""
    figure, (response, picture) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained", width_ratios=[1, 1.4])
    sides = np.array([1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 20])
    apgstmd.plot.tuning("size", sides, attention_enabled=False, ax=response)
    response.axvspan(3, 6, color="tab:green", alpha=0.15)
    response.set_title("one detector: 3 to 6 px")
    values = response.lines[0].get_ydata()
    assert values[sides >= 15].max() < 0.1 and 3 <= sides[values.argmax()] <= 8

    sides = (4, 10, 18)
    scene = clip([straight([15, 20 + 40 * k], 1.2, side) for k, side in enumerate(sides)])
    bank = apgstmd.Bank(scene.shape, speeds=[1], sizes=[5, 10, 20])
    for frame in scene[:100]:
        out = bank.process(frame)
    apgstmd.plot.overlay(frame, ax=picture)
    seen = []
    for k, side in enumerate(sides):
        near = out.detections[np.abs(out.detections.y - 20 - 40 * k) < 10]
        best = near[0]
        seen.append(best.size)
        text = f"{side} px, seen by the one of {best.size:g} px"
        label = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.5}
        picture.annotate(text, (best.x - side / 2 - 4, best.y), va="center", ha="right", bbox=label)
    picture.set_title("a bank with sizes 5, 10, 20")
    picture.set_xlim(-0.5, 199.5)
    assert seen[0] == 5 and seen[-1] > 5, seen
    return figure


def threshold():
    """One clip, three thresholds."""
    scene = clip([straight([15, 30], 1.0, 5, 0.35), straight([60, 85], 1.0, 4, 0.3)], noise=0.01)
    figure, axes = plt.subplots(1, 3, figsize=(10, 2.6), layout="constrained")
    listed = []
    for ax, rate in zip(axes, ("off", 2, 0.1)):
        found = apgstmd.run(scene, speeds=[0.5, 1, 2], false_alarms=rate, tracks=False).detections
        now = found[found.frame == 90]
        listed.append(len(now))
        apgstmd.plot.overlay(scene[90], ax=ax)
        ax.scatter(now.x, now.y, s=60, facecolors="none", edgecolors="red")
        ax.set(title=f"false_alarms = {rate}: {len(now)} in this frame", xticks=[], yticks=[], xlabel="", ylabel="")
    assert listed[0] > listed[1] >= listed[2] >= 2, listed
    return figure


def step():
    """The same slow target with every frame and with every fourth."""
    scene = clip([straight([40, 60], 0.12, 5, 0.5)], frames=400, rate=30)
    figure, axes = plt.subplots(1, 2, figsize=(8, 2.8), layout="constrained")
    largest = []
    for ax, every in zip(axes, (1, 8)):
        detector = apgstmd.Detector(scene.shape, speed=1.0)
        for frame in scene[::every]:
            out = detector.process(frame)
        apgstmd.plot.response(out, ax=ax)
        largest.append(float(out.response.max()))
        ax.set_title(f"every frame: {0.12:.2f} px/frame" if every == 1 else f"every {every}th: {0.12 * every:.2f} px/frame")
    assert largest[1] > 100 * largest[0], largest
    return figure


PICTURES = (speed, size, threshold, step)


def draw(folder):
    """All of them into `folder`."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context(STYLE):
        for picture in PICTURES:
            figure = picture()
            figure.savefig(folder / f"{picture.__name__}.png", dpi=DPI)
            plt.close(figure)


if __name__ == "__main__":
    import sys

    draw(sys.argv[1])
