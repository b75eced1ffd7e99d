"""Pictures of what was found, with matplotlib: the extra `plot`.

Each function draws into `ax`, or into axes of its own, and returns what it drew into. Positions are in px, y downward.

    out = detector.process(frame)
    apgstmd.plot.overlay(frame, out.detections)
    apgstmd.plot.stages(detector).savefig("inside.png")
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._optional import need
from .detector import Detector
from .evaluation import Evaluation
from .options import ParamFile
from .results import Detections, Output, Tracks
from .settings import Params

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_RING = 8.0


def _plt() -> Any:
    return need("matplotlib.pyplot", "plot", "apgstmd.plot")


def _axes(ax: Axes | None) -> Axes:
    if ax is not None:
        return ax
    made: Axes = _plt().subplots(layout="constrained")[1]
    return made


def _map(ax: Axes, values: NDArray[Any], title: str, **how: Any) -> Any:
    ax.set_title(title)
    ax.set(xlabel="x, px", ylabel="y, px")
    return ax.imshow(values, interpolation="nearest", **how)


def overlay(
    frame: NDArray[Any], found: Detections | None = None, tracks: Tracks | None = None, *, ax: Axes | None = None
) -> Axes:
    """The frame with a ring around each detection, a tick where it is heading, and the paths of tracks.

    frame : (H, W) grey or (H, W, 3) RGB. found : detections of this frame, colour by score. tracks : points to join up,
    for example `tracks[tracks.frame <= t]`.
    """
    ax = _axes(ax)
    grey = {"cmap": "gray"} if frame.ndim == 2 else {}
    _map(ax, frame, "", **grey)
    ax.set(xlim=(-0.5, frame.shape[1] - 0.5), ylim=(frame.shape[0] - 0.5, -0.5))
    if tracks is not None:
        for number in np.unique(tracks.track):
            of = tracks[tracks.track == number]
            ax.plot(of.x, of.y, linewidth=1, label=f"track {number}")
    if found is not None and len(found):
        # Rings of one size in px, wide enough to leave the target visible.
        collections = need("matplotlib.collections", "plot", "apgstmd.plot")
        size = np.full(len(found), 2 * _RING)
        rings = collections.EllipseCollection(
            size,
            size,
            np.zeros(len(found)),
            units="xy",
            offsets=np.column_stack([found.x, found.y]),
            transOffset=ax.transData,
            facecolors="none",
            linewidths=1.2,
            cmap="autumn",
        )
        rings.set_array(found.score)
        ax.add_collection(rings)
        ax.get_figure().colorbar(rings, ax=ax, label="score")  # type: ignore[union-attr]
        heading = np.isfinite(found.direction)
        x, y, angle = found.x[heading], found.y[heading], found.direction[heading]
        across, down = np.cos(angle), -np.sin(angle)
        ends = [np.stack([x + r * across, y + r * down], axis=1) for r in (_RING, 1.6 * _RING)]
        ax.add_collection(collections.LineCollection(list(np.stack(ends, axis=1)), colors="yellow", linewidths=1.2))
    return ax


def response(out: Output, *, ax: Axes | None = None) -> Axes:
    """The response map: max over directions of Q; of a bank, equivalent contrast."""
    ax = _axes(ax)
    drawn = _map(ax, out.response, "response", cmap="inferno", vmin=0)
    ax.get_figure().colorbar(drawn, ax=ax)  # type: ignore[union-attr]
    return ax


def direction(out: Output, *, ax: Axes | None = None) -> Axes:
    """The direction map, as colour: radians counter-clockwise on the screen; nothing where there is no response."""
    ax = _axes(ax)
    ax.set_facecolor("black")
    drawn = _map(ax, out.direction, "direction", cmap="hsv", vmin=-np.pi, vmax=np.pi)
    bar = ax.get_figure().colorbar(drawn, ax=ax, ticks=[-np.pi, -np.pi / 2, 0, np.pi / 2, np.pi])  # type: ignore[union-attr]
    bar.ax.set_yticklabels(["left", "down", "right", "up", "left"])
    return ax


def stages(detector: Detector, names: Sequence[str] | None = None) -> Figure:
    """The inner stages of the last frame beside each other; of those with several directions, the largest value.

    names : which, all that the model has by default (`Detector.stages`).
    """
    names = detector.stages if names is None else tuple(names)
    if not names:
        raise ValueError(f"names is empty, but one of {', '.join(detector.stages)} is needed")
    across = min(4, len(names))
    down = -(-len(names) // across)
    height, width = detector.shape
    size = (3.2 * across, 3.2 * down * (0.25 + height / width))
    figure: Figure = _plt().figure(figsize=size, layout="constrained")
    for index, name in enumerate(names):
        values = detector.stage(name)
        ax = figure.add_subplot(down, across, index + 1)
        flat = values if values.ndim == 2 else values.max(axis=0)
        limit = float(np.abs(flat).max()) or 1.0
        signed = float(flat.min()) < -0.1 * limit
        how: dict[str, Any] = {"cmap": "RdBu_r", "vmin": -limit} if signed else {"cmap": "viridis", "vmin": 0.0}
        drawn = _map(ax, flat, name if values.ndim == 2 else f"{name}, largest of {len(values)}", vmax=limit, **how)
        ax.set(xlabel="", ylabel="", xticks=[], yticks=[])
        figure.colorbar(drawn, ax=ax)
    return figure


def roc(results: Evaluation | Mapping[str, Evaluation], *, ax: Axes | None = None) -> Axes:
    """Detection rate over false alarms a frame, both 0 to 1, with the area under each curve.

    results : one evaluation, or several by name.
    """
    ax = _axes(ax)
    named = results if isinstance(results, Mapping) else {"": results}
    for name, result in named.items():
        false_alarms = np.append(np.insert(result.curve.false_alarms, 0, 0.0), 1.0)
        rate = np.insert(result.curve.detection_rate, 0, 0.0)
        within = false_alarms[:-1] <= 1
        rate = np.append(rate[within], rate[within][-1])
        false_alarms = np.append(false_alarms[:-1][within], 1.0)
        ax.step(false_alarms, rate, where="post", label=f"{name} {result.area:.2f}".strip())
    ax.set(xlabel="false alarms a frame", ylabel="detection rate", xlim=(0, 1), ylim=(0, 1.02))
    ax.legend(title="area", loc="lower right")
    return ax


def kernels(params: ParamFile | None = None) -> Figure:
    """The kernels that parameters stand for: over time, lateral inhibition, attention, prediction in each direction.

    params : `Params` or whatever else `Detector` takes as `params=`; the preset "practical" by default.

    The gamma kernels of lamina and medulla are weights of the frames before this one; maps are as they lie in the picture, px
    to the right and upward. Of attention the first scale at 45 degrees is drawn, of prediction where a target that is in the
    middle now is expected, by its direction.
    """
    file = Params().to_toml() if params is None else Params(params=params).to_toml()
    attention, prediction, lateral, temporal = _core.kernels(file)
    figure: Figure = _plt().figure(figsize=(13, 10), layout="constrained")
    grid = figure.add_gridspec(3, 4)
    ax = figure.add_subplot(grid[0, :2])
    taps = dict(temporal)
    fast, slow = taps["lamina fast"], taps["lamina slow"]
    difference = np.zeros(max(len(fast), len(slow)))
    difference[: len(fast)] += fast
    difference[: len(slow)] -= slow
    ax.plot(difference, color="black", label="lamina, fast - slow")
    for name, curve in temporal:
        ax.plot(curve, label=name, linestyle="--" if name.startswith("lamina") else "-")
    longest = max(int(np.flatnonzero(curve > 1e-3 * curve.max())[-1]) for curve in taps.values())
    ax.set(title="over time", xlabel="frames ago", ylabel="weight", xlim=(0, longest))
    ax.legend()
    scale, _, spot = next(kernel for kernel in attention if np.isclose(kernel[1], np.pi / 4))
    for place, kernel, title in (
        (grid[0, 2], lateral, "lateral inhibition"),
        (grid[0, 3], spot, f"attention, {scale:g} px, 45°"),
    ):
        _kernel(figure, place, kernel, title, signed=True)
    for index, (angle, kernel) in enumerate(prediction):
        _kernel(figure, grid[1 + index // 4, index % 4], kernel, f"prediction, {np.degrees(angle):.0f}°", signed=False)
    return figure


def _kernel(figure: Figure, place: Any, kernel: NDArray[Any], title: str, *, signed: bool) -> None:
    ax = figure.add_subplot(place)
    reach = kernel.shape[0] // 2
    limit = float(np.abs(kernel).max())
    how: dict[str, Any] = {"cmap": "RdBu_r", "vmin": -limit} if signed else {"cmap": "viridis", "vmin": 0.0}
    edges = (-reach - 0.5, reach + 0.5, -reach - 0.5, reach + 0.5)
    drawn = ax.imshow(kernel, interpolation="nearest", vmax=limit, extent=edges, **how)
    ax.plot(0, 0, "+", color="black" if signed else "white")
    ax.set(title=title, xlabel="right, px", ylabel="up, px")
    figure.colorbar(drawn, ax=ax)


def false_alarms(results: Evaluation | Mapping[str, Evaluation], *, ax: Axes | None = None) -> Axes:
    """Detection rate over false alarms a frame, these on a logarithmic axis: few false alarms are what matters in use.

    results : one evaluation, or several by name.
    """
    ax = _axes(ax)
    named = results if isinstance(results, Mapping) else {"": results}
    for name, result in named.items():
        seen = np.isfinite(result.curve.false_alarms) & (result.curve.false_alarms > 0)
        x, y = result.curve.false_alarms[seen], result.curve.detection_rate[seen]
        # What is reached without any false alarm lies to the left of everything.
        free = result.curve.detection_rate[~seen & np.isfinite(result.curve.false_alarms)]
        least = float(free.max()) if len(free) else 0.0
        ax.step(x, y, where="post", label=f"{name} {least:.2f} without any".strip())
    ax.set(xscale="log", xlabel="false alarms a frame", ylabel="detection rate", ylim=(0, 1.02))
    ax.legend(title="detection rate", loc="lower right")
    return ax


def tuning(
    parameter: str = "speed",
    values: Sequence[float] | None = None,
    *,
    speed: float = 1.0,
    ax: Axes | None = None,
    **model: Any,
) -> Axes:
    """How strongly a detector responds to a dark target before white, over the target's speed, size or contrast.

    parameter : "speed" (px/frame), "size" (px) or "contrast" (0 to 1). values : which, some of a sensible range by default.
    speed, **model : the detector, as `Detector` takes it. The target has 5 x 5 px, contrast 1 and the detector's speed but
    for what is varied. Responses are the largest Q with everything kept, relative to the largest.
    """
    ranges = {"speed": np.geomspace(0.125, 8, 13), "size": np.arange(1, 16), "contrast": np.linspace(0.1, 1, 10)}
    if parameter not in ranges:
        raise ValueError(f"parameter is {parameter!r}, but it must be one of {', '.join(ranges)}")
    values = list(map(float, ranges[parameter] if values is None else values))
    model = {"speed": speed, "rejection": "off", "threads": 1} | model
    ideal = {"speed": speed, "size": 5.0, "contrast": 1.0}
    largest = [_response(ideal | {parameter: value}, model) for value in values]
    ax = _axes(ax)
    peak = max(largest) or 1.0
    ax.plot(values, [value / peak for value in largest], marker="o")
    unit = {"speed": "px/frame", "size": "px", "contrast": "Weber"}[parameter]
    ax.set(xlabel=f"{parameter}, {unit}", ylabel="response, largest = 1", ylim=(0, 1.05))
    if parameter == "speed":
        ax.set_xscale("log", base=2)
    return ax


def _response(target: Mapping[str, float], model: Mapping[str, Any]) -> float:
    """The largest Q of a square that crosses a white frame."""
    speed, side = target["speed"], target["size"]
    height, width = 64, 160
    detector = Detector((height, width), **model)
    pixels = np.arange(width)
    rows = np.clip(1 - np.abs(np.arange(height) - height / 2) + (side - 1) / 2, 0, 1)
    largest = 0.0
    for t in range(round((width - 40) / speed)):
        center = 20 + speed * t
        # Edges cover part of a pixel, so that slow targets move in every frame.
        columns = np.clip(np.minimum(pixels + 0.5, center + side / 2) - np.maximum(pixels - 0.5, center - side / 2), 0, 1)
        frame = 1 - target["contrast"] * rows[:, None] * columns[None, :]
        largest = max(largest, float(detector.process(frame.astype(np.float32)).response.max()))
    return largest
