"""Tables as HTML for notebooks: some rows, and where the points lie."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .table import Table

_ROWS = 10
_SIDE = 240
# More points or paths than these make a picture slow and not clearer.
_POINTS = 4000
_PATHS = 200
# Okabe & Ito: told apart by all eyes, before light and dark.
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")


def page(table: Table, path: tuple[str, str, str | None] | None) -> str:
    """The first rows; with `path`, the names of x, y and number, a picture besides."""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in table.names)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(_cell(value))}</td>" for value in row) + "</tr>" for row in table[:_ROWS]
    )
    more = f"<p>… {len(table) - _ROWS} more rows</p>" if len(table) > _ROWS else ""
    rows = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}" if len(table) else ""
    picture = _paths(table, *path) if path and len(table) else ""
    return f"<div><p><b>{type(table).__name__}</b>: {len(table)}</p>{picture}{rows}</div>"


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _paths(table: Table, x_name: str, y_name: str, number: str | None) -> str:
    columns = table.columns
    x, y = columns[x_name].astype(float), columns[y_name].astype(float)
    left, top = x.min() - 3, y.min() - 3
    width, height = x.max() + 3 - left, y.max() + 3 - top
    scale = _SIDE / max(width, height)
    numbers = columns[number] if number else np.arange(len(table))
    paths, first = np.unique(numbers, return_index=True)
    paths = paths[np.argsort(first)][:_PATHS]
    marks = []
    for index, path in enumerate(paths):
        of = np.flatnonzero(numbers == path)
        of = of[:: max(1, len(of) * len(paths) // _POINTS)]
        points = " ".join(f"{(x[i] - left) * scale:.1f},{(y[i] - top) * scale:.1f}" for i in of)
        colour = _COLOURS[index % len(_COLOURS)]
        end_x, end_y = points.rsplit(" ", 1)[-1].split(",")
        marks.append(
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
            f'<circle cx="{end_x}" cy="{end_y}" r="2.5" fill="{colour}"/>'
        )
    what = f"paths of {len(paths)} of {len(np.unique(numbers))}" if number else f"{len(table)} places"
    return (
        f'<svg role="img" aria-label="{what}" width="{width * scale:.0f}" height="{height * scale:.0f}" '
        f'style="border:1px solid #8888">{"".join(marks)}</svg>'
        f"<p>{what}, x {left + 3:.0f} to {left + width - 3:.0f} px, y {top + 3:.0f} to {top + height - 3:.0f} px</p>"
    )
