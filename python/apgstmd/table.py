"""Columns that behave like a table."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Self, overload

import numpy as np
from numpy.typing import NDArray

from ._optional import need
from ._picture import page

if TYPE_CHECKING:
    import pandas
    import polars
    import pyarrow


class Table:
    """Named NumPy columns of one length.

    `len(t)`, iteration and `t[i]` give rows; `t[slice]`, `t[mask]` and `t[indices]` give a table of the same kind.
    """

    __slots__ = ()
    names: ClassVar[tuple[str, ...]] = ()
    row: ClassVar[Any] = tuple
    # What a picture of it shows: x, y and what numbers the paths, if anything does.
    _path: ClassVar[tuple[str, str, str | None] | None] = None

    def __init__(self, **columns: NDArray[Any]) -> None:
        if set(columns) != set(self.names):
            raise TypeError(f"{type(self).__name__}() takes the columns {', '.join(self.names)}")
        if len({column.shape for column in columns.values()}) != 1 or columns[self.names[0]].ndim != 1:
            raise ValueError("the columns must be one-dimensional and of one length")
        for name, column in columns.items():
            setattr(self, name, column)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The columns by name, ready for a data frame or `numpy.savez`."""
        return {name: getattr(self, name) for name in self.names}

    def __len__(self) -> int:
        return len(getattr(self, self.names[0]))

    def __iter__(self) -> Iterator[Any]:
        rows = zip(*(column.tolist() for column in self.columns.values()), strict=True)
        return map(self.row._make, rows)

    @overload
    def __getitem__(self, index: int | np.integer[Any]) -> Any: ...
    @overload
    def __getitem__(self, index: slice | NDArray[Any] | list[int] | list[bool]) -> Self: ...
    def __getitem__(self, index: Any) -> Any:
        picked = {name: column[index] for name, column in self.columns.items()}
        if picked[self.names[0]].ndim == 0:
            return self.row(*(value.item() for value in picked.values()))
        return type(self)(**picked)

    def __repr__(self) -> str:
        lines = [f"{type(self).__name__}: {len(self)}"]
        if len(self):
            lines.append(" ".join(f"{name:>10}" for name in self.names))
        for row in self[:10]:
            lines.append(" ".join(f"{value:>10.4g}" if type(value) is float else f"{value!s:>10}" for value in row))
        if len(self) > 10:
            lines.append(f"... {len(self) - 10} more")
        return "\n".join(lines)

    def to_pandas(self) -> pandas.DataFrame:
        """As a pandas data frame. Needs the extra `pandas`."""
        frame: pandas.DataFrame = need("pandas", "pandas", "to_pandas()").DataFrame(self.columns)
        return frame

    def to_polars(self) -> polars.DataFrame:
        """As a polars data frame. Needs the extra `polars`."""
        frame: polars.DataFrame = need("polars", "polars", "to_polars()").DataFrame(self._plain())
        return frame

    def to_arrow(self) -> pyarrow.Table:
        """As an Arrow table. Needs the extra `arrow`."""
        table: pyarrow.Table = need("pyarrow", "arrow", "to_arrow()").table(self._plain())
        return table

    def _plain(self) -> dict[str, Any]:
        """Columns of which text is a list: NumPy's fixed-width text is nobody else's."""
        return {name: column.tolist() if column.dtype.kind == "U" else column for name, column in self.columns.items()}

    def _repr_html_(self) -> str:
        """The first rows and a small picture of the paths, for notebooks."""
        return page(self, self._path)
