"""Columns that behave like a table."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import apgstmd


@pytest.fixture
def found() -> apgstmd.Detections:
    return apgstmd.Detections(
        x=np.array([10.5, 20, 30], np.float32),
        y=np.array([1, 2, 3], np.float32),
        score=np.array([0.3, 0.2, 0.1], np.float32),
        direction=np.array([0, 1, -1], np.float32),
        trace=np.array([7, 8, 9], np.int64),
    )


def test_rows(found: apgstmd.Detections) -> None:
    assert len(found) == 3
    assert found[0] == apgstmd.Detection(10.5, 1.0, found.score[0].item(), 0.0, 7)
    assert found[-1].trace == 9 and type(found[-1].trace) is int and type(found[0].x) is float
    assert [row.trace for row in found] == [7, 8, 9]
    assert found[np.int64(1)].x == 20
    x, y, *_ = found[1]
    assert (x, y) == (20, 2)
    for index in (3, -4):
        with pytest.raises(IndexError):
            found[index]
    with pytest.raises(IndexError):
        found["x"]  # type: ignore[call-overload]


def test_parts(found: apgstmd.Detections) -> None:
    assert found[1:].x.tolist() == [20, 30]
    assert found[::-1].trace.tolist() == [9, 8, 7]
    assert found[found.score > 0.15].y.tolist() == [1, 2]
    assert found[[2, 0]].trace.tolist() == [9, 7]
    assert len(found[:0]) == 0 and list(found[:0]) == []
    assert isinstance(found[1:], apgstmd.Detections)


def test_columns(found: apgstmd.Detections) -> None:
    assert list(found.columns) == ["x", "y", "score", "direction", "trace"]
    assert found.columns["x"] is found.x


def test_repr(found: apgstmd.Detections) -> None:
    lines = repr(found).splitlines()
    assert lines[0] == "Detections: 3"
    assert lines[1].split() == ["x", "y", "score", "direction", "trace"]
    assert lines[2].split() == ["10.5", "1", "0.3", "0", "7"]
    assert repr(found[:0]) == "Detections: 0"
    many = found[np.zeros(30, np.int64)]
    assert repr(many).splitlines()[-1] == "... 20 more"


def test_columns_must_fit() -> None:
    columns: dict[str, Any] = {name: np.zeros(2, np.float32) for name in ("x", "y", "score", "direction", "trace")}
    with pytest.raises(TypeError, match="takes the columns x, y, score, direction, trace"):
        apgstmd.Detections(x=columns["x"])
    with pytest.raises(ValueError, match="one length"):
        apgstmd.Detections(**{**columns, "x": np.zeros(3)})
