"""A CSV of named columns with units, read whole, with errors that name row and column."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError

MAX_BYTES = 5_000_000


@dataclass(frozen=True)
class CsvTable:
    """Cells as text.

    Attributes:
        where: the file.  sha256: of its bytes.
        header: (name, unit) of each column; "1" where it has none.
        lines: line number of each row in the file.
        rows: the cells.

    """

    where: str
    sha256: str
    header: tuple[tuple[str, str], ...]
    lines: tuple[int, ...]
    rows: tuple[tuple[str, ...], ...]

    @classmethod
    def read(cls, path: Path, most_rows: int) -> CsvTable:
        """Reads a file; lines that begin with # are comments.

        Raises:
            InputError: not readable, not UTF-8, above 5 MB, not CSV, without rows or with too
                many, a column twice, or a row with more or fewer cells than the header.

        """
        where = str(path)
        try:
            with path.open("rb") as file:  # not stat: pipes and devices have no size
                data = file.read(MAX_BYTES + 1)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or "not a file's name"
            raise InputError("file", path, f"a readable CSV file ({reason})") from None
        if len(data) > MAX_BYTES:
            raise InputError(where, "a larger file", f"at most {MAX_BYTES} bytes")
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            raise InputError("file", path, "a readable CSV file (not UTF-8 text)") from None
        lines = _without_comments(text)
        reader = csv.reader(io.StringIO(lines, newline=""), strict=True)
        try:
            found = [
                (reader.line_num, [cell.strip() for cell in row])
                for row in reader
                if any(cell.strip() for cell in row)
            ]
        except csv.Error as error:
            raise InputError(where, f"line {reader.line_num}", f"CSV ({error})") from None
        if len(found) < 2:
            raise InputError(where, "no rows", "a header and at least one row")
        if len(found) - 1 > most_rows:
            raise InputError(f"{where}: rows", len(found) - 1, f"at most {most_rows}")
        header = tuple(_name_and_unit(cell) for cell in found[0][1])
        for line, cells in found[1:]:
            if len(cells) != len(header):
                key = f"{where}: row {line}"
                raise InputError(key, f"{len(cells)} cells", f"{len(header)} cells")
        return cls(
            where=where,
            sha256=hashlib.sha256(data).hexdigest(),
            header=header,
            lines=tuple(line for line, _ in found[1:]),
            rows=tuple(tuple(cells) for _, cells in found[1:]),
        )

    def has(self, name: str) -> bool:
        """Whether there is a column of this name, in whatever unit."""
        return any(n == name for n, _ in self.header)

    def has_unit(self, name: str, unit: str) -> bool:
        """Whether there is a column of this name in this unit."""
        return (name, unit) in self.header

    def header_text(self) -> str:
        """The columns as they are written."""
        return ", ".join(n if u == "1" else f"{n} [{u}]" for n, u in self.header)

    def at(self, row: int, name: str) -> str:
        """Where a cell is, for messages."""
        return f"{self.where}: row {self.lines[row]}, {name}"

    def texts(self, name: str) -> list[str]:
        """A column as text.

        Raises:
            InputError: no such column, or twice.

        """
        return self._column(name, None)

    def numbers(self, name: str, unit: str) -> NDArray[np.float64]:
        """A column in this unit.

        Raises:
            InputError: no such column, twice, in another unit, or a cell that is no finite number.

        """
        cells = self._column(name, unit)
        found = np.empty(len(cells))
        for i, cell in enumerate(cells):
            try:  # float() also takes 1_000 and digits of other scripts
                found[i] = float(cell) if cell.isascii() and "_" not in cell else math.nan
            except ValueError:
                found[i] = math.nan
            if not math.isfinite(found[i]):
                raise InputError(self.at(i, name), cell, "a finite number")
        return found

    def check_range(
        self, name: str, values: NDArray[np.float64], low: float, high: float, allowed: str
    ) -> None:
        """Raises InputError for the first value outside the range."""
        for i, value in enumerate(values):
            if not low <= value <= high:
                raise InputError(self.at(i, name), float(value), allowed)

    def where_text(self, name: str, text: str) -> CsvTable:
        """The rows that have this text in a column.

        Raises:
            InputError: no such column, or no such row.

        """
        cells = self.texts(name)
        keep = [i for i, cell in enumerate(cells) if cell == text]
        if not keep:
            raise InputError(f"{self.where}: {name}", text, ", ".join(sorted(set(cells))))
        lines, rows = tuple(self.lines[i] for i in keep), tuple(self.rows[i] for i in keep)
        return CsvTable(self.where, self.sha256, self.header, lines, rows)

    def _column(self, name: str, unit: str | None) -> list[str]:
        wanted = name if unit in (None, "1") else f"{name} [{unit}]"
        found = [i for i, (n, _) in enumerate(self.header) if n == name]
        if len(found) > 1:
            raise InputError(f"{self.where}: header", f"{name} twice", "each column once")
        if not found:
            raise InputError(f"{self.where}: header", self.header_text(), f"a column {wanted}")
        own = self.header[found[0]][1]
        if unit is not None and own != unit:
            got = name if own == "1" else f"{name} [{own}]"
            raise InputError(f"{self.where}: header", got, f"a column {wanted}")
        return [row[found[0]] for row in self.rows]


def _without_comments(text: str) -> str:
    """The text with lines of comment emptied, so that the others keep their numbers."""
    return "\n".join("" if s.lstrip().startswith("#") else s for s in text.splitlines())


def _name_and_unit(cell: str) -> tuple[str, str]:
    name, bracket, rest = cell.partition("[")
    return name.strip(), rest.rstrip("] ").strip() if bracket else "1"
