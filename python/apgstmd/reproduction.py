"""The experiments of the paper, computed, drawn and judged."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from . import _core
from .options import whole


class Check(NamedTuple):
    """A measured number and its rule.

    measured: None where there was nothing to measure; unit: of both; wanted: {"below": x}, {"above": x},
    {"at_least": x}, {"between": [x, y]} or {"exactly": x}.
    """

    experiment: str
    what: str
    measured: float | None
    unit: str
    wanted: Mapping[str, Any]
    holds: bool


@dataclass(frozen=True, slots=True)
class Reproduction:
    """What the experiments showed.

    checks: every number with its rule. out: the folder with index.html, figures and tables, None where none was asked
    for. summary: the content of summary.json.
    """

    checks: tuple[Check, ...]
    out: Path | None
    summary: dict[str, Any]

    @property
    def holds(self) -> bool:
        """Whether everything is as it must be."""
        return all(check.holds for check in self.checks)

    def __repr__(self) -> str:
        holding = sum(check.holds for check in self.checks)
        where = "" if self.out is None else f", out={str(self.out)!r}"
        return f"Reproduction({holding} of {len(self.checks)} hold{where})"


def reproduce(
    *names: str,
    out: str | os.PathLike[str] | None = None,
    quick: bool = False,
    threads: int | None = None,
    force: bool = False,
    progress: bool = False,
) -> Reproduction:
    """Runs experiments of the paper as `apgstmd reproduce` does.

    Parameters
    ----------
    names : which, as `apgstmd reproduce --list` names them; all without any.
    out : folder for index.html (figures beside what the paper says), SVG, PNG, CSV and summary.json; without it only the
        numbers come back.
    quick : the same with fewer points and smaller scenes.
    threads : 1 to 256, all cores by default. The numbers do not depend on it.
    force : replace results that `out` already holds.
    progress : show a progress bar on a terminal and the table.

    A number that is not as it must be is no error: see `holds` of what comes back. Raises ValueError for an unknown name,
    RuntimeError for a folder that cannot be written or holds earlier results.

        apgstmd.reproduce("velocity-tuning", quick=True).checks
    """
    options = {"threads": whole("threads", threads, 1, 256)}
    flags = [name for name, wanted in (("quick", quick), ("force", force), ("quiet", not progress)) if wanted]
    with tempfile.TemporaryDirectory(prefix="apgstmd-") as scratch:
        results = Path(scratch, "out") if out is None else Path(out)
        given = [f"--{name}={value}" for name, value in options.items() if value is not None]
        before = _changed(results / "summary.json")
        try:
            argv = ["apgstmd", "reproduce", f"--out={results}", *given, *(f"--{flag}" for flag in flags), "--", *names]
            _core.run(argv)
        except RuntimeError:
            # The command line calls it a failure when a number is not as it must be; then there is a new summary.
            if _changed(results / "summary.json") in (None, before):
                raise
        summary = json.loads((results / "summary.json").read_text(encoding="utf-8"))
    checks = tuple(
        Check(experiment["name"], **check) for experiment in summary["experiments"] for check in experiment["checks"]
    )
    return Reproduction(checks, None if out is None else results, summary)


def _changed(path: Path) -> int | None:
    return path.stat().st_mtime_ns if path.exists() else None
