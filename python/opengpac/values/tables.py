# SPDX-License-Identifier: Apache-2.0
"""Human-readable tables: aligned when printed, HTML in a notebook, coloured when printed by `rich`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from html import escape
from inspect import Signature
from typing import TYPE_CHECKING, Any

from ..errors import Error

if TYPE_CHECKING:
    from rich.console import RenderableType

_NUMBER = re.compile(r"[-+]?[\d.]+(e[-+]?\d+)?( ?[%a-zA-Zµ]{1,3})?|[-–]|")
_COLOURS = {"bad": "#b3261e", "warn": "#9a6700", "good": "#1a7f37", "soft": "#7d8590"}
"""Colours in HTML, readable on both a light and a dark background."""
_STYLES = {"bad": "bold red", "warn": "yellow", "good": "green", "soft": "bright_black"}


class Table:
    """Rows and columns with a title. `looks` contains for each row `bad`, `warn`, `good`, `soft` or an empty text.
    >>> print(Table("devices", ["name", "state"], [["elbow", "standstill"], ["wrist", "fault"]]))
    devices
    name   state
    elbow  standstill
    wrist  fault
    """

    def __init__(self, title: str, columns: Sequence[str], rows: Iterable[Sequence[Any]], looks: Iterable[str] = ()) -> None:
        self.title = title
        self.columns = [*columns]
        self.rows = [tuple(map(str, row)) for row in rows]
        given = [*looks]
        self.looks = given + [""] * (len(self.rows) - len(given))

    def numeric(self, column: int) -> bool:
        """Returns whether the column is right-aligned: it contains numbers, with or without units."""
        cells = [row[column] for row in self.rows]
        return any(cells) and all(_NUMBER.fullmatch(cell) for cell in cells)

    def lines(self, title: bool = True) -> list[str]:
        """Returns the lines of the table as text."""
        rows = [tuple(self.columns), *self.rows]
        wide = [max(len(row[column]) for row in rows) for column in range(len(self.columns))]
        right = [self.numeric(column) for column in range(len(self.columns))]
        placed = [[c.rjust(w) if r else c.ljust(w) for c, w, r in zip(row, wide, right, strict=True)] for row in rows]
        return ([self.title] if title and self.title else []) + ["  ".join(row).rstrip() for row in placed]

    def __repr__(self) -> str:
        return "\n".join(self.lines())

    def _repr_html_(self) -> str:
        right = [' style="text-align:right"' if self.numeric(column) else "" for column in range(len(self.columns))]
        head = "".join(f"<th{r}>{escape(name)}</th>" for name, r in zip(self.columns, right, strict=True))
        body = "".join(self._html_row(row, look, right) for row, look in zip(self.rows, self.looks, strict=True))
        caption = f'<caption style="text-align:left;font-weight:bold">{escape(self.title)}</caption>' if self.title else ""
        return f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"

    def _html_row(self, row: Sequence[str], look: str, right: Sequence[str]) -> str:
        colour = f' style="color:{_COLOURS[look]}"' if look else ""
        return f"<tr{colour}>{''.join(f'<td{r}>{escape(cell)}</td>' for cell, r in zip(row, right, strict=True))}</tr>"

    def __rich__(self) -> RenderableType:
        from rich import box
        from rich.console import Group
        from rich.table import Table as RichTable
        from rich.text import Text

        table = RichTable(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1))
        for column, name in enumerate(self.columns):
            # Columns of short text are never wrapped, only those with long text.
            longest = max((len(row[column]) for row in self.rows), default=0)
            table.add_column(Text(name), justify="right" if self.numeric(column) else "left", no_wrap=longest <= 28)
        for row, look in zip(self.rows, self.looks, strict=True):
            table.add_row(*map(Text, row), style=_STYLES.get(look))
        return Group(Text(self.title, style="bold"), table) if self.title else table


class Tables:
    """Several tables, one below the other."""

    def __init__(self, tables: Iterable[Table], head: str = "") -> None:
        self.head = head
        self.tables = [*tables]

    def __repr__(self) -> str:
        return "\n\n".join([*([self.head] if self.head else []), *map(repr, self.tables)])

    def _repr_html_(self) -> str:
        return (f"<p>{escape(self.head)}</p>" if self.head else "") + "".join(table._repr_html_() for table in self.tables)

    def __rich__(self) -> RenderableType:
        from rich.console import Group
        from rich.text import Text

        parts: list[RenderableType] = [Text(self.head)] if self.head else []
        for table in self.tables:
            parts += [Text(), table.__rich__()] if parts else [table.__rich__()]
        return Group(*parts)


class TableDisplay:
    """Object that is displayed as a table in a notebook and by `rich`. Its `repr` is unaffected."""

    def _table(self) -> Table | Tables | None:
        """Returns the object's table, or None if it currently has none."""
        raise NotImplementedError

    def _repr_html_(self) -> str | None:
        table = self._table_now()
        return None if table is None else table._repr_html_()

    def __rich__(self) -> Any:
        from rich.text import Text

        return self._table_now() or Text(repr(self))

    def _table_now(self) -> Table | Tables | None:
        # A deleted object, or one of a system that does not answer, has only its `repr`.
        try:
            return self._table()
        except Error:
            return None


def identifiers(names: Iterable[str]) -> list[str]:
    """Returns those names that are valid Python identifiers."""
    return [name for name in names if name.isidentifier()]


class CallSignature:
    """Descriptor for `__signature__` in a class whose objects have different call signatures, for completion in a call. The class itself
    keeps the signature of its constructor."""

    def __init__(self, of: Callable[[Any], Signature]) -> None:
        self._of = of

    def __get__(self, obj: object, owner: type) -> Signature:
        if obj is None:
            raise AttributeError("__signature__")
        return self._of(obj)
