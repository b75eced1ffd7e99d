"""Arrays as they come: whatever its memory looks like, a frame gives the numbers of its contiguous copy, or a clear error."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import apgstmd

TAKEN = ("u1", "u2", "f4", "f8", "?")
# Every kind that NumPy has, in either byte order.
KINDS = ("?", "i1", "u1", "i2", "u2", "<u2", ">u2", "i4", "u4", "i8", "f2", "f4", "<f4", ">f4", "f8", ">f8", "g", "c8", "O", "U1", "V3", "m8[s]")

# `make arrays`: so many, and others each time.
EXAMPLES = os.environ.get("EXAMPLES")


def tried(quick: int) -> settings:
    return settings(
        max_examples=int(EXAMPLES or quick),
        derandomize=EXAMPLES is None,
        database=None,
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow],
    )


@st.composite
def steps(draw: st.DrawFn, length: int) -> slice:
    """Cuts `length` out of something longer, forwards or backwards, with gaps."""
    stride = draw(st.sampled_from((1, 1, 2, 3, -1, -2)))
    before = draw(st.integers(0, 3))
    last = before + (length - 1) * abs(stride)
    if stride > 0:
        return slice(before, last + 1, stride)
    return slice(last, before - 1 if before else None, stride)


@st.composite
def frames(draw: st.DrawFn) -> tuple[NDArray[Any], bytes]:
    """A view of some memory, and that memory as it was."""
    height, width = draw(st.integers(14, 24)), draw(st.integers(14, 40))
    channels = draw(st.sampled_from((None, None, None, 1, 2, 3, 4, 5)))
    kind = draw(st.sampled_from((*TAKEN, *KINDS)))
    shape = (height, width) if channels is None else (height, width, channels)
    cuts = tuple(draw(steps(length)) for length in shape)
    whole = tuple(1 + max(cut.start, -1 if cut.stop is None else cut.stop) + 3 for cut in cuts)
    order = draw(st.permutations(range(len(shape))))
    rng = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    # Axes lie in memory in any order: C, Fortran, and others.
    lying = tuple(whole[axis] for axis in order)
    values = rng.random(lying)
    if np.dtype(kind).kind in "ui":
        values = values * min(np.iinfo(kind).max, 65535)
    base = values.astype(kind) if kind not in ("U1", "V3", "m8[s]") else np.zeros(lying, kind)
    view = base.transpose(np.argsort(order))[cuts]
    form = draw(st.sampled_from(("plain", "plain", "read-only", "broadcast", "record", "bytes")))
    if form == "read-only":
        view.flags.writeable = False
    elif form == "broadcast":
        view = np.broadcast_to(view[:1], view.shape)
    elif form == "record" and kind not in ("O", "U1", "V3"):
        packed = np.zeros(view.shape, [("flag", "u1"), ("value", kind)])
        packed["value"] = view
        view = packed["value"]
    elif form == "bytes" and kind not in ("O", "U1", "V3"):
        # One byte off its natural place in memory.
        memory = np.zeros(view.size * view.itemsize + 1, np.uint8)
        view, off = memory[1:].view(kind).reshape(view.shape), view
        view[...] = off
    return view, view.tobytes()


@tried(150)
@given(frames())
def test_a_frame_is_read_as_its_copy_or_refused(made: tuple[NDArray[Any], bytes]) -> None:
    frame, memory = made
    size = (max(16, frame.shape[0]), max(16, frame.shape[1]))
    detector, other = (apgstmd.Detector(size, speed=8.0, rejection="off", threads=1) for _ in range(2))
    try:
        out = detector.process(frame)
    except (TypeError, ValueError) as error:
        assert len(str(error)) > 20 and detector.frames == 0
        channels = frame.shape[2] if frame.ndim == 3 else 1
        native = frame.dtype.isnative and frame.dtype.kind + str(frame.dtype.itemsize) in ("b1", "u1", "u2", "f4", "f8")
        aligned = frame.flags.aligned and all(stride % frame.itemsize == 0 for stride in frame.strides)
        # Nothing is refused that can be read.
        assert not native or not aligned or frame.shape[:2] != size or channels not in (1, 3, 4), error
    else:
        wanted = other.process(np.array(frame, order="C"))
        assert out.response.tobytes() == wanted.response.tobytes()
        assert np.array_equal(detector.stage("P"), other.stage("P"))
    assert frame.tobytes() == memory


@tried(100)
@given(st.integers(0, 40), st.integers(0, 40), st.integers(0, 40), st.booleans(), st.sampled_from(("f4", "u1", "?")))
def test_maps_and_frames_in_one_memory(first: int, second: int, third: int, stack: bool, kind: str) -> None:
    # Three pictures somewhere in one piece of memory: they are written, or refused, but never each other's.
    height, width = 16, 20
    memory = np.zeros(80 * width if not stack else 3 * 41 * width, np.float32)

    def at(row: int) -> NDArray[np.float32]:
        return memory[row * width : (row + height) * width].reshape(height, width)

    wanted_rows = (first, 41 + second, 82 + third) if stack else (first, second, third)
    rows = [min(row, len(memory) // width - height) for row in wanted_rows]
    whole = at(rows[0])
    frame = whole if kind == "f4" else whole.view(kind)[:, :width]
    frame[...] = np.random.default_rng(first).random((height, width)) < 0.5
    kept = frame.copy()
    detector, other = (apgstmd.Detector((height, width), speed=8.0, threads=1) for _ in range(2))
    maps = at(rows[1]), at(rows[2])
    apart = all(not np.shares_memory(a, b) for a, b in ((frame, maps[0]), (frame, maps[1]), maps))
    try:
        out = detector.process(frame, out=maps)
    except ValueError as error:
        assert "overlaps" in str(error) and not apart and detector.frames == 0
    else:
        assert apart
        wanted = other.process(kept)
        assert np.array_equal(out.response, wanted.response) and out.response is maps[0]
        assert np.array_equal(out.direction, wanted.direction, equal_nan=True)
    assert np.array_equal(frame, kept)
