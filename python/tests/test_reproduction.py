"""Experiments of the paper from Python."""

from __future__ import annotations

from pathlib import Path

import pytest

import apgstmd


def test_numbers_and_files(tmp_path: Path) -> None:
    out = tmp_path / "out"
    seen = apgstmd.reproduce("kernels", "contrast-tuning", out=out, quick=True)
    assert seen.holds
    assert seen.out == out
    assert repr(seen) == f"Reproduction({len(seen.checks)} of {len(seen.checks)} hold, out={str(out)!r})"
    assert {check.experiment for check in seen.checks} == {"kernels", "contrast-tuning"}
    ratio = next(check for check in seen.checks if check.what == "E at contrast 0.5 over E at 1")
    assert ratio.measured == pytest.approx(0.125, rel=0.01)
    assert ratio.wanted == {"between": [0.12375, 0.12625]}
    assert (out / "index.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert {"kernels.svg", "kernels.png", "contrast-tuning.csv"} <= {path.name for path in out.iterdir()}
    with pytest.raises(RuntimeError, match="earlier run"):
        apgstmd.reproduce("kernels", out=out, quick=True)
    assert apgstmd.reproduce("kernels", out=out, quick=True, force=True).summary["quick"] is True
    assert not (out / "contrast-tuning.csv").exists()


def test_without_a_folder_only_the_numbers_come() -> None:
    seen = apgstmd.reproduce("kernels", threads=1)
    assert seen.out is None
    assert seen.summary["threads"] == 1
    assert all(check.holds for check in seen.checks)


def test_what_cannot_be_run() -> None:
    with pytest.raises(ValueError, match="there is no experiment `kernel`"):
        apgstmd.reproduce("kernel")
    with pytest.raises(ValueError, match="threads is 0"):
        apgstmd.reproduce("kernels", threads=0)
