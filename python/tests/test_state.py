"""States: a detector or a bank that was copied, pickled or told a state goes on to the bit."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import apgstmd
import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import HEIGHT, WIDTH, textured_square

Stream = apgstmd.Detector | apgstmd.Bank
MAKERS: list[Callable[[], Stream]] = [
    lambda: apgstmd.Detector((HEIGHT, WIDTH), speed=1.0, threads=1, bit_depth=8, attention_alpha=0.7),
    lambda: apgstmd.Detector((HEIGHT, WIDTH), model="dstmd", speed=1.0, threads=2),
    lambda: apgstmd.Bank((HEIGHT, WIDTH), speeds=[0.5, 1.0], sizes=[5, 10], contrast=0.02, threads=2),
]
COPIES: list[Callable[[Stream], Stream]] = [
    lambda stream: pickle.loads(pickle.dumps(stream)),
    copy.copy,
    copy.deepcopy,
]


def used(make: Callable[[], Stream], frames: list[NDArray[np.uint8]]) -> Stream:
    stream = make()
    for frame in frames:
        stream.process(frame)
    return stream


def bits(out: apgstmd.Output) -> tuple[Any, ...]:
    columns = out.detections
    found = [getattr(columns, name).tobytes() for name in ("x", "y", "score", "direction", "trace")]
    return out.response.tobytes(), out.direction.tobytes(), *found, out.background_shift


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("duplicate", COPIES)
def test_a_copy_goes_on_to_the_bit(make: Callable[[], Stream], duplicate: Callable[[Stream], Stream]) -> None:
    frames = list(textured_square(44))
    stream = used(make, frames[:30])
    other = duplicate(stream)
    assert type(other) is type(stream) and repr(other) == repr(stream)
    assert (other.frames, other.threads, other.params) == (30, stream.threads, stream.params)
    found = 0
    for frame in frames[30:]:
        out = stream.process(frame)
        found += len(out.detections)
        assert bits(out) == bits(other.process(frame))
    assert found > 0
    # Each has a state of its own.
    stream.reset()
    assert other.frames == 44


@pytest.mark.parametrize("make", MAKERS)
def test_a_state_is_taken_up_and_is_plain_arrays(make: Callable[[], Stream]) -> None:
    frames = list(textured_square(30))
    stream = used(make, frames[:25])
    state = stream.state_dict()
    assert (state["height"], state["width"], state["version"]) == (HEIGHT, WIDTH, apgstmd.__version__)
    assert all(isinstance(array, np.ndarray) for array in state["arrays"].values()) and len(state["arrays"]) > 5
    other = used(make, frames[:3])
    other.load_state_dict(state)
    # What was taken up is not what is changed from then on.
    kept = copy.deepcopy(state)
    assert bits(other.process(frames[25])) == bits(stream.process(frames[25]))
    assert all(np.array_equal(kept["arrays"][name], array) for name, array in state["arrays"].items())


def test_what_is_no_state_is_refused_and_changes_nothing() -> None:
    frames = list(textured_square(24))
    detector, bank = (used(make, frames[:20]) for make in (MAKERS[0], MAKERS[2]))
    good = detector.state_dict()

    def refused(change: Callable[[dict[str, Any]], object], kind: type[Exception], text: str) -> None:
        state = copy.deepcopy(good)
        change(state)
        with pytest.raises(kind, match=text):
            detector.load_state_dict(state)

    refused(lambda s: s.update(version="0.0.1"), ValueError, "0.0.1")
    refused(lambda s: s.update(width=12), ValueError, "64 x 12")
    refused(lambda s: s.update(of="bank"), ValueError, "of a bank")
    other = good["parameters"].replace("alpha = 0.7", "alpha = 0.8")
    refused(lambda s: s.update(parameters=other), ValueError, "attention.alpha")
    refused(lambda s: s.pop("arrays"), ValueError, '"arrays"')
    refused(lambda s: s.update(height="64"), TypeError, '"height"')
    refused(lambda s: s["arrays"].pop("p.last"), ValueError, "`p.last`.*missing")
    refused(lambda s: s["arrays"].update({"p.last": s["arrays"]["p.last"][1:]}), ValueError, "shape")
    refused(lambda s: s["arrays"].update({"p.last": [1.0]}), TypeError, "NumPy array")
    refused(lambda s: s["arrays"]["p.last"].fill(np.nan), ValueError, "finite")
    with pytest.raises(ValueError, match="of a bank"):
        detector.load_state_dict(bank.state_dict())
    after = detector.state_dict()
    assert all(np.array_equal(array, after["arrays"][name]) for name, array in good["arrays"].items())
    with pytest.raises(TypeError):
        detector.load_state_dict(None)  # type: ignore[arg-type]
