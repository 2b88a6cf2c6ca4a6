"""Reads a CSV of named columns with units whole, with errors that name row and column.

One reader for signals and tables of measurements. It takes what spreadsheets, pandas and
laboratory programs write: UTF-8, UTF-16 with its mark, else Windows-1252; any line ends; lines of
comment that begin with #; cells separated by commas, semicolons or tabs (`sep=;` above the header
says which), quoted or not; columns named `name [unit]` or `name (unit)`, in any case, or names with
a row of units below them; decimal points, or decimal commas where commas do not separate cells.
Units that are multiples of the one asked for are converted (`units`). What could be read in two
ways is refused.
"""

from __future__ import annotations

import io
import math
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.csv_numbers import decimal_mark, to_number, why_no_number
from drake_racket.io.csv_text import CsvText, read_csv_text
from drake_racket.io.errors import InputError
from drake_racket.io.units import (
    allowed_units,
    bracketed,
    can_convert,
    convert,
    is_same,
    is_unit,
    unit_of,
)

MAX_BYTES = 5_000_000

_NAME_AND_UNIT = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))\s*", re.DOTALL)


@dataclass(frozen=True)
class Heading:
    """Says what is above a column: its name, its unit ("1" where it has none), as written.

    Names are compared in small letters, with `_` for blanks.
    """

    name: str
    unit: str
    text: str


@dataclass(frozen=True)
class CsvTable:
    """Cells as text.

    Attributes:
        where: the file.  sha256: of its bytes.
        headings: of each column.
        lines: line number of each row in the file.
        columns: the cells of each column.
        decimal: "." or ",", the mark of its numbers.

    """

    where: str
    sha256: str
    headings: tuple[Heading, ...]
    lines: tuple[int, ...]
    columns: tuple[tuple[str, ...], ...]
    decimal: str

    @classmethod
    def read(cls, path: str | Path, most_rows: int, most_bytes: int = MAX_BYTES) -> CsvTable:
        """Reads a file.

        Raises:
            InputError: not readable, not text, too large, not CSV, without rows or with too many, a
                row with more or fewer cells than the header, or numbers with decimal commas and
                decimal points.

        """
        path = Path(path)
        text = read_csv_text(path, most_bytes)
        names = text.header()
        lines, rows = _rows(text, len(names))
        headings = tuple(_heading(cell) for cell in names)
        if rows and _is_units_row(headings, rows[0]):
            headings = _with_units(headings, rows[0], f"{text.where}: row {lines[0]}")
            lines, rows = lines[1:], rows[1:]
        if not rows:
            raise InputError(text.where, "no rows", "a header and at least one row")
        if len(rows) > most_rows:
            raise InputError(f"{text.where}: rows", len(rows), f"at most {most_rows}")
        columns = tuple(zip(*rows, strict=True))
        table = cls(text.where, text.sha256, headings, tuple(lines), columns, ".")
        if text.separator == ",":
            return table
        decimal, odd = decimal_mark(columns)
        if odd is not None:
            c, r = odd
            key = table.at(r, headings[c].text)
            allowed = f"one decimal mark in the file ({why_no_number(columns[c][r], decimal)})"
            raise InputError(key, columns[c][r], allowed)
        return replace(table, decimal=decimal)

    def has(self, name: str) -> bool:
        """Tells whether there is a column of this name, in whatever unit."""
        return any(h.name == _plain(name) for h in self.headings)

    def header_text(self) -> str:
        """Gives the columns as they are written."""
        return ", ".join(h.text for h in self.headings)

    def at(self, row: int, name: str) -> str:
        """Tells where a cell is, for messages."""
        return f"{self.where}: row {self.lines[row]}, {name}"

    def texts(self, name: str) -> list[str]:
        """Gives a column as text.

        Raises:
            InputError: no such column, or twice.

        """
        return list(self.columns[self._index(name, None)])

    def numbers(self, name: str, unit: str) -> NDArray[np.float64]:
        """Gives a column in this unit.

        Raises:
            InputError: no such column, twice, in a unit that is no multiple of this one, or a cell
                that is no finite number.

        """
        column = self._index(name, unit)
        heading, cells = self.headings[column], self.columns[column]
        found = np.array([to_number(cell, self.decimal) for cell in cells])
        for i in np.flatnonzero(~np.isfinite(found))[:1]:
            allowed = "a finite number"
            if math.isnan(found[i]):
                allowed += f" ({why_no_number(cells[i], self.decimal)})"
            raise InputError(self.at(int(i), heading.text), cells[i], allowed)
        return convert(found, heading.unit, unit)

    def check_range(
        self, name: str, values: NDArray[np.float64], low: float, high: float, allowed: str
    ) -> None:
        """Raises InputError for the first value outside the range."""
        for i, value in enumerate(values):
            if not low <= value <= high:
                raise InputError(self.at(i, name), float(value), allowed)

    def where_text(self, name: str, text: str) -> CsvTable:
        """Gives the rows that have this text in a column.

        Raises:
            InputError: no such column, or no such row.

        """
        cells = self.texts(name)
        keep = [i for i, cell in enumerate(cells) if cell == text]
        if not keep:
            raise InputError(f"{self.where}: {name}", text, ", ".join(sorted(set(cells))))
        columns = tuple(tuple(column[i] for i in keep) for column in self.columns)
        return replace(self, lines=tuple(self.lines[i] for i in keep), columns=columns)

    def _index(self, name: str, unit: str | None) -> int:
        wanted = name if unit in (None, "1") else f"{name} [{unit}]"
        found = [i for i, h in enumerate(self.headings) if h.name == _plain(name)]
        if len(found) > 1 and unit is not None:  # the same quantity in two units: the one asked for
            found = [i for i in found if is_same(self.headings[i].unit, unit)] or found
        if len(found) > 1:
            text = f"{self.headings[found[0]].text} twice"
            raise InputError(f"{self.where}: header", text, "each column once")
        if not found:
            hint = self._hint(name)
            raise InputError(
                f"{self.where}: header", self.header_text(), f"a column {wanted}{hint}"
            )
        heading = self.headings[found[0]]
        if unit is not None and not can_convert(heading.unit, unit):
            allowed = f"a column {name} [{unit}]{allowed_units(unit)}"
            raise InputError(f"{self.where}: header", heading.text, allowed)
        return found[0]

    def _hint(self, name: str) -> str:
        """What to do about a missing column, where the file shows it."""
        if all(math.isfinite(to_number(h.text, ".")) for h in self.headings):
            return " (the first row that is no comment is the header)"
        for line, row in zip(self.lines, zip(*self.columns, strict=True), strict=True):
            if any(_heading(cell).name == _plain(name) for cell in row):
                return f" (row {line} seems to be the header: remove the rows above it)"
        return ""


def _rows(text: CsvText, count: int) -> tuple[list[int], list[list[str]]]:
    """Line numbers and stripped cells of the rows below the header that hold something."""
    import pandas

    def shortened(cells: list[str]) -> list[str]:
        """Of a row with too many cells: those of the header, and what is over in one."""
        return [*cells[:count], "\0".join(cells[count:])]

    frame = pandas.read_csv(
        io.StringIO("\n".join(text.lines[text.first :]) + "\n"),
        sep=text.separator,
        header=None,
        names=range(count + 1),
        index_col=False,
        dtype=object,
        keep_default_na=False,
        skip_blank_lines=False,
        skipinitialspace=True,
        engine="python",  # the one that tells a missing cell from an empty one
        on_bad_lines=shortened,
    )
    lines, rows = [], []
    line = text.first + 1
    for found in frame.itertuples(index=False, name=None):
        own, line = line, line + 1 + sum(cell.count("\n") for cell in found if cell)
        cells = [cell.strip() if cell else "" for cell in found]
        if not any(cell.strip("\0 ") for cell in cells):
            continue
        over = cells[count].split("\0")
        if any(cell.strip() for cell in over):
            raise text.wrong_count(own, count + len(over), count)
        if found[count - 1] is None:
            raise text.wrong_count(own, sum(cell is not None for cell in found), count)
        lines.append(own)
        rows.append(cells[:count])
    return lines[1:], rows[1:]  # the first is the header


def _plain(name: str) -> str:
    return "_".join(name.casefold().split())


def _heading(cell: str) -> Heading:
    text = " ".join(cell.split())
    found = _NAME_AND_UNIT.fullmatch(cell)
    if found is None:
        return Heading(_plain(cell), "1", text)
    unit = found[2] if found[2] is not None else found[3]
    return Heading(_plain(found[1]), unit_of(unit), text)


def _is_units_row(headings: tuple[Heading, ...], cells: list[str]) -> bool:
    """Whether the row below the header holds units: nothing else, and at least one of a column."""
    given = [cell for cell in cells if cell]
    return any(unit_of(cell) != "1" for cell in given) and all(
        is_unit(cell) and math.isnan(to_number(cell, ".")) for cell in given
    )


def _with_units(headings: tuple[Heading, ...], cells: list[str], where: str) -> tuple[Heading, ...]:
    """The headings with the units of the row below them."""
    both = []
    for heading, cell in zip(headings, cells, strict=True):
        bare = bracketed(cell)
        unit = unit_of(cell if bare is None else bare)
        if heading.unit != "1" and unit not in ("1", heading.unit):
            raise InputError(f"{where}, {heading.text}", cell, "the unit that the header has")
        if heading.unit == "1" and unit != "1":
            heading = Heading(heading.name, unit, f"{heading.text} [{unit}]")
        both.append(heading)
    return tuple(both)
