"""The detector as a user meets it: frames in, targets out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import apgstmd
from scenes import HEIGHT, WIDTH, moving_square, textured_square

SIZE = (HEIGHT, WIDTH)


def test_a_moving_square_is_found_where_it_is() -> None:
    detector = apgstmd.Detector(SIZE, speed=1.0)
    for frame in moving_square(40):
        out = detector.process(frame)
    best = out.detections[0]
    assert abs(best.x - 59) < 2 and abs(best.y - 32) < 1
    assert abs(best.direction) < 0.1
    assert best.score > 0
    assert len(out.detections) == 1


@pytest.mark.parametrize(
    ("start", "step", "angle"),
    [
        ((20, 32), (1, 0), 0),
        ((76, 32), (-1, 0), math.pi),
        ((48, 52), (0, -1), math.pi / 2),
        ((48, 12), (0, 1), -math.pi / 2),
        ((30, 52), (1, -1), math.pi / 4),
    ],
)
def test_direction_is_counter_clockwise_on_the_screen(
    start: tuple[int, int], step: tuple[int, int], angle: float
) -> None:
    detector = apgstmd.Detector(SIZE, speed=math.hypot(*step), rejection="off", localise="response")
    for frame in moving_square(36, start=start, step=step):
        out = detector.process(frame)
    turn = out.detections[0].direction - angle
    assert abs(math.remainder(turn, 2 * math.pi)) < 0.2
    y, x = np.unravel_index(out.response.argmax(), SIZE)
    assert abs(math.remainder(float(out.direction[y, x]) - angle, 2 * math.pi)) < 0.2


def test_a_static_scene_shows_nothing() -> None:
    detector = apgstmd.Detector(SIZE, rejection="off")
    frame = next(textured_square(1))
    for _ in range(10):
        out = detector.process(frame)
    assert not out.response.any()
    assert len(out.detections) == 0
    assert np.isnan(out.direction).all()


def test_the_output_is_typed_and_shaped() -> None:
    detector = apgstmd.Detector(SIZE, speed=1.0)
    for frame in moving_square(20):
        out = detector.process(frame)
    assert out.response.shape == out.direction.shape == SIZE
    assert out.response.dtype == out.direction.dtype == np.float32
    assert {name: column.dtype.name for name, column in out.detections.columns.items()} == {
        "x": "float32",
        "y": "float32",
        "score": "float32",
        "direction": "float32",
        "trace": "int64",
    }
    assert np.array_equal(np.isnan(out.direction), out.response == 0)
    assert "Output(64 x 96, 1 detections" in repr(out)


def test_outputs_are_the_callers_own() -> None:
    detector = apgstmd.Detector(SIZE, speed=1.0, rejection="off")
    frames = list(moving_square(20))
    first = [detector.process(frame) for frame in frames]
    kept = first[-2].response.copy()
    first[-1].response[:] = -1
    detector.process(frames[-1])
    assert np.array_equal(first[-2].response, kept)


def test_reset_forgets_everything() -> None:
    detector = apgstmd.Detector(SIZE, speed=1.0)
    frames = list(textured_square(30))
    once = [detector.process(frame) for frame in frames]
    assert detector.frames == 30
    detector.reset()
    assert detector.frames == 0
    again = [detector.process(frame) for frame in frames]
    for a, b in zip(once, again, strict=True):
        assert_same(a, b)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_numbers_do_not_depend_on_threads(threads: int) -> None:
    one = apgstmd.Detector(SIZE, speed=1.0, threads=1)
    many = apgstmd.Detector(SIZE, speed=1.0, threads=threads)
    assert many.threads == threads
    for frame in textured_square(25):
        assert_same(one.process(frame), many.process(frame))


def test_properties() -> None:
    detector = apgstmd.Detector((48, 64), speed=1.0, threads=1)
    assert detector.shape == (48, 64)
    assert detector.latency > 0
    assert detector.lag > 0
    assert detector.frames == 0
    assert repr(detector) == "Detector((48, 64), model='apg-stmd', v_opt=1.04167 px/frame, rejection='motion', threads=1)"


def test_size() -> None:
    assert apgstmd.Detector(np.zeros((20, 30)).shape).shape == (20, 30)
    assert apgstmd.Detector((16, 16)).process(np.zeros((16, 16), np.uint8)).response.shape == (16, 16)
    for size in [(15, 64), (64, 15), (0, 0), (-20, 30), (1 << 40, 20), (1 << 20, 1 << 20)]:
        with pytest.raises(ValueError, match="height"):
            apgstmd.Detector(size)
    wrong: list[Any] = [64, (64,), (64, 64, 3), (64.0, 64.0), ("64", "64"), None]
    for size in wrong:
        with pytest.raises(TypeError, match=r"size must be \(height, width\)"):
            apgstmd.Detector(size)


def assert_same(a: apgstmd.Output, b: apgstmd.Output) -> None:
    assert np.array_equal(a.response, b.response)
    assert np.array_equal(a.direction, b.direction, equal_nan=True)
    assert list(a.detections) == list(b.detections)
    assert a.background_shift == b.background_shift
    assert (a.ego_motion, a.cut) == (b.ego_motion, b.cut)


def test_the_camera_turns_and_the_scene_is_cut() -> None:
    y, x = np.mgrid[:120, :160].astype(np.float64)
    y, x = y - 59.5, x - 79.5

    def picture(angle: float, seed: int) -> Any:
        # Turned counter-clockwise on the screen, y downward.
        u, v = np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y
        random = np.random.default_rng(seed)
        waves = [np.sin(random.normal(0, 0.1) * u + random.normal(0, 0.1) * v + random.uniform(0, 6)) for _ in range(20)]
        return np.clip(0.5 + 0.05 * np.sum(waves, axis=0), 0, 1)

    detector = apgstmd.Detector((120, 160), speed=1.0)
    outputs = [detector.process(picture(0.02 * t, int(t >= 6))) for t in range(10)]
    assert [out.cut for out in outputs] == [t == 6 for t in range(10)]
    for t, out in enumerate(outputs):
        turned = 0.0 if t in (0, 6) else 0.02
        assert abs(out.ego_motion.rotation - turned) < 1e-3 and abs(out.ego_motion.zoom - 1) < 1e-3
        assert not out.ego_motion.unexplained
