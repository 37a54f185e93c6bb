"""Rows of results as people read them: names in the place of numbers of links."""

from __future__ import annotations

import html
from typing import Any, Callable, Dict, Iterator, List, Mapping, Sequence, Tuple

import numpy as np

from ._arrays import StructuredArray

_SHOWN = 20


class Table:
    """Columns by their names. `print`, and a notebook, show the first 20 rows.

    `columns` has an array per column, all of the same length, so `pandas.DataFrame(table.columns)` takes it where no
    column holds vectors. `table["depth"]` is a column, and a loop gives rows as tuples.
    """

    __slots__ = ("columns",)

    columns: Dict[str, np.ndarray[Any, Any]]

    def __init__(self, columns: Mapping[str, np.ndarray[Any, Any]]) -> None:
        """For `Clip.table` and its like."""
        self.columns = dict(columns)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def __getitem__(self, column: str) -> np.ndarray[Any, Any]:
        return self.columns[column]

    def __iter__(self) -> Iterator[Tuple[Any, ...]]:
        return zip(*(array.tolist() for array in self.columns.values()))

    def _cells(self) -> List[List[str]]:
        rows = [[_text(value) for value in row] for row, _ in zip(self, range(_SHOWN))]
        return [list(self.columns), *rows]

    def _more(self) -> str:
        return f"... {len(self) - _SHOWN} more rows" if len(self) > _SHOWN else ""

    def __repr__(self) -> str:
        cells = self._cells()
        widths = [max(map(len, column)) for column in zip(*cells)]
        sides = ["<" if array.dtype.kind == "U" else ">" for array in self.columns.values()]
        lines = ["  ".join(f"{cell:{side}{width}}" for cell, side, width in zip(row, sides, widths)) for row in cells]
        return "\n".join(line.rstrip() for line in [*lines, self._more()] if line)

    def _repr_html_(self) -> str:
        head, *rows = [[html.escape(cell) for cell in row] for row in self._cells()]
        lines = ["<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows]
        titles = "".join(f"<th>{cell}</th>" for cell in head)
        return f"<table><tr>{titles}</tr>{''.join(lines)}</table><p>{self._more()}</p>"


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return f"({', '.join(map(_text, value))})"
    return str(value)


class LinkNames:
    """The names of the links of several bodies, looked up at once: of each row a body and a link."""

    __slots__ = ("_names", "_starts")

    def __init__(self, bodies: Sequence[Sequence[str]]) -> None:
        self._names = np.array([name for names in bodies for name in names], dtype=np.str_)
        self._starts = np.cumsum([0, *map(len, bodies)], dtype=np.int64)

    def __call__(self, bodies: Any, links: Any) -> np.ndarray[Any, Any]:
        names: np.ndarray[Any, Any] = self._names[self._starts[bodies] + links]
        return names


def table_of(rows: StructuredArray, named: Mapping[str, Callable[[], Any]], left_out: Sequence[str] = ()) -> Table:
    """All fields of rows but `left_out`; those that are in `named` as it has them."""
    fields = [field for field in rows.dtype.names or () if field not in left_out]
    return Table({field: np.asarray(named[field]()) if field in named else rows[field] for field in fields})
