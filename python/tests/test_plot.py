"""Pictures by matplotlib: what is drawn, not how it looks."""

from __future__ import annotations

from collections.abc import Iterator

import matplotlib
import numpy as np
import pytest

import apgstmd

matplotlib.use("agg")
from matplotlib import pyplot as plt  # noqa: E402


@pytest.fixture(autouse=True)
def close() -> Iterator[None]:
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def seen() -> tuple[apgstmd.Detector, np.ndarray, apgstmd.Output]:
    scene = apgstmd.synth("demo")
    detector = apgstmd.Detector(scene.shape, speed=1.0)
    for t in range(50):
        out = detector.process(scene[t])
    return detector, scene[49], out


def test_overlay(seen: tuple[apgstmd.Detector, np.ndarray, apgstmd.Output]) -> None:
    _, frame, out = seen
    ax = apgstmd.plot.overlay(frame, out.detections)
    rings, ticks = ax.collections
    np.testing.assert_array_equal(rings.get_offsets(), np.column_stack([out.detections.x, out.detections.y]))
    # A tick begins on the ring, towards where the target is heading; up is up although rows count downward.
    start, end = ticks.get_segments()[0]  # type: ignore[attr-defined]
    first = out.detections[0]
    step = np.array([np.cos(first.direction), -np.sin(first.direction)])
    np.testing.assert_allclose(start, np.array([first.x, first.y]) + 8 * step, atol=1e-4)
    np.testing.assert_allclose(end - start, 4.8 * step, atol=1e-4)
    tracks = apgstmd.run(apgstmd.synth("demo"), speed=1.0, stop=50).tracks
    drawn = apgstmd.plot.overlay(np.zeros((*frame.shape, 3)), None, tracks, ax=plt.subplots()[1])
    assert len(drawn.lines) == len(np.unique(tracks.track)) and not drawn.collections
    assert drawn.get_ylim() == (frame.shape[0] - 0.5, -0.5)


def test_maps(seen: tuple[apgstmd.Detector, np.ndarray, apgstmd.Output]) -> None:
    detector, _, out = seen
    for draw, values in ((apgstmd.plot.response, out.response), (apgstmd.plot.direction, out.direction)):
        np.testing.assert_array_equal(np.ma.filled(np.ma.asarray(draw(out).images[0].get_array()), np.nan), values)
    figure = apgstmd.plot.stages(detector)
    titles = [ax.get_title() for ax in figure.axes if ax.images and ax.get_title()]
    assert [title.split(",")[0] for title in titles] == list(detector.stages)
    one = apgstmd.plot.stages(detector, ["E"]).axes[0]
    np.testing.assert_array_equal(one.images[0].get_array(), detector.stage("E").max(axis=0))
    with pytest.raises(ValueError, match="names is empty"):
        apgstmd.plot.stages(detector, [])


def test_roc() -> None:
    scene = apgstmd.synth("demo")
    result = apgstmd.evaluate(apgstmd.run(scene, speed=1.0, stop=80), scene)
    ax = apgstmd.plot.roc({"speed 1": result, "again": result})
    for line in ax.lines:
        x, y = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
        # The area under the drawn steps is the one that is said.
        assert x[0] == 0 and x[-1] == 1 and float(np.sum(np.diff(x) * y[:-1])) == pytest.approx(result.area, abs=1e-12)
    assert ax.get_legend_handles_labels()[1] == [f"speed 1 {result.area:.2f}", f"again {result.area:.2f}"]
    assert len(apgstmd.plot.roc(result).lines) == 1


def test_tuning() -> None:
    ax = apgstmd.plot.tuning("speed", [0.25, 1, 4])
    slow, right, fast = map(float, np.asarray(ax.lines[0].get_ydata()))
    assert right == 1 and slow < 0.3 and fast < 0.3
    ax = apgstmd.plot.tuning("contrast", [0.5, 1], speed=2.0)
    # The response is cubic in contrast.
    assert float(np.asarray(ax.lines[0].get_ydata())[0]) == pytest.approx(1 / 8, rel=0.15)
    with pytest.raises(ValueError, match="parameter is 'colour', but it must be one of speed, size, contrast"):
        apgstmd.plot.tuning("colour")


def test_kernels() -> None:
    params = apgstmd.Params("paper", speed=1.0)
    figure = apgstmd.plot.kernels(params)
    maps = {ax.get_title(): ax for ax in figure.axes if ax.images}
    assert list(maps) == ["lateral inhibition", "attention, 2 px, 45°", *(f"prediction, {45 * k}°" for k in range(8))]
    for k in range(8):
        # A target that moves up is expected above, where the axis is drawn upward.
        image = maps[f"prediction, {45 * k}°"].images[0]
        values = np.asarray(image.get_array())
        left, right, bottom, top = image.get_extent()
        assert values.sum() == pytest.approx(1) and image.origin == "upper" and top > bottom
        row, column = np.unravel_index(values.argmax(), values.shape)
        x, y = left + 0.5 + column, top - 0.5 - row
        reach = params.prediction.v_opt * params.prediction.horizon
        assert x == pytest.approx(reach * np.cos(k * np.pi / 4), abs=1) and y == pytest.approx(reach * np.sin(k * np.pi / 4), abs=1)
    curves = {line.get_label(): np.asarray(line.get_ydata(), float) for line in figure.axes[0].lines}
    assert list(curves)[1:] == ["lamina fast", "lamina slow", "Mi1", "Tm1_4", "Tm1_5"]
    for name, curve in curves.items():
        assert curve.sum() == pytest.approx(0 if name == "lamina, fast - slow" else 1, abs=1e-8)
    # tau is where a gamma kernel peaks; at speed 1 it is a quarter of the paper's.
    assert abs(int(curves["Tm1_5"].argmax()) - params.medulla.tm1_5_tau) <= 1 and params.medulla.tm1_5_tau == 10
    titles = {ax.get_title() for ax in apgstmd.plot.kernels().axes}
    assert f"attention, {apgstmd.Params().attention.scales[0]:g} px, 45°" in titles


def test_false_alarms() -> None:
    scene = apgstmd.synth("demo")
    result = apgstmd.evaluate(apgstmd.run(scene, speed=1.0, rejection="off", stop=80), scene)
    ax = apgstmd.plot.false_alarms({"speed 1": result})
    x, y = (np.asarray(values, float) for values in (ax.lines[0].get_xdata(), ax.lines[0].get_ydata()))
    assert ax.get_xscale() == "log" and x.min() > 0 and (np.diff(x) >= 0).all() and (np.diff(y) >= 0).all()
    assert y[x <= 1].max() == pytest.approx(result.rate_at(1.0))
    assert len(apgstmd.plot.false_alarms(result).lines) == 1
