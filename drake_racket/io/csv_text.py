"""Reads the text of a CSV file, whoever wrote it: encoding, line ends, comments, separator."""

from __future__ import annotations

import codecs
import csv
import hashlib
import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from drake_racket.io.errors import InputError

SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
MOST_LINES = 2_000_000
"""Of a file, blank ones included: this many are in no time, and a file of line ends stops here."""

_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff]")
_SEPARATOR_LINE = re.compile(r'\s*"?sep=(.)"?[,;\s]*', re.IGNORECASE | re.DOTALL)
_NUMBER_LIKE = re.compile(r"[+-]?[0-9.,]*[0-9][0-9.,]*([eEdD][+-]?[0-9]+)?")


@dataclass(frozen=True)
class CsvText:
    """Holds a file's lines.

    Attributes:
        where: the file.  sha256: of its bytes.
        lines: all of them, so that line i is number i + 1; comments are emptied.
        first: index of the header in `lines`.
        separator: one of SEPARATORS.

    """

    where: str
    sha256: str
    lines: tuple[str, ...]
    first: int
    separator: str

    def header(self) -> list[str]:
        """Gives the header's cells, those at its end without a name left out.

        Raises:
            InputError: no names, or quotes anywhere in the file that do not close.

        """
        rest = (line + "\n" for line in self.lines[self.first :])
        reader = csv.reader(rest, delimiter=self.separator, skipinitialspace=True, strict=True)
        line = self.first + 1
        try:
            cells = [cell.strip() for cell in next(reader)]
            while True:
                line = self.first + reader.line_num + 1
                if next(reader, None) is None:
                    break
        except csv.Error as error:
            key, got = f"{self.where}: row {line}", self.lines[line - 1]
            raise InputError(key, got, f"CSV, with quotes that close ({error})") from None
        while cells and not cells[-1]:
            cells.pop()
        if not cells:
            got = self.lines[self.first]
            raise InputError(f"{self.where}: row {self.first + 1}", got, "names of columns")
        return cells

    def wrong_count(self, line: int, count: int, expected: int) -> InputError:
        """Tells what to raise for a row with more or fewer cells than the header."""
        if (header := self._header_below()) is not None:
            got = self.lines[self.first]
            allowed = (
                f"the header as the first line; it seems to be row {header}: remove the lines"
                " above it, or begin them with #"
            )
            return InputError(f"{self.where}: row {self.first + 1}", got, allowed)
        text = self.lines[line - 1].strip()
        allowed = f"{expected} cells, as the header has{self._why(text, count, expected)}"
        return InputError(f"{self.where}: row {line}", f"{count} cells: {text}", allowed)

    def _why(self, text: str, count: int, expected: int) -> str:
        others = [s for s in SEPARATORS if s != self.separator and text.count(s) == expected - 1]
        if count == 1 and others and expected > 1:
            mine, header = SEPARATORS[others[0]], SEPARATORS[self.separator]
            return f" ({mine} separate this row, {header} the header)"
        if count < expected and not _NUMBER_LIKE.fullmatch(text.split(self.separator)[0].strip()):
            return " (remove text below the numbers, or begin it with #)"
        if count > expected and self.separator == "," and re.search(r"\d,\d", text):
            return " (with decimal commas or commas in thousands, separate by semicolons or tabs)"
        return ""

    def _header_below(self) -> int | None:
        """The number of a line further down that looks more like the header than the first."""
        filled = [i for i, s in enumerate(self.lines[: self.first + 80]) if not is_blank(s)]
        filled = [i for i in filled if i >= self.first]
        own = len(_cells(self.lines[self.first]))
        for here, below in itertools.pairwise(filled[1:]):
            names, numbers = _cells(self.lines[here]), _cells(self.lines[below])
            are_names = not any(_NUMBER_LIKE.fullmatch(cell) for cell in names)
            if len(names) > own and are_names and any(map(_NUMBER_LIKE.fullmatch, numbers)):
                return here + 1
        return None


def read_csv_text(path: str | Path, most_bytes: int) -> CsvText:
    """Reads a file: UTF-8, UTF-16 with its mark, or else Windows-1252; lines that end in any way.

    Lines that begin with # are comments. NUL bytes and Ctrl-Z at the end are padding.

    Raises:
        InputError: not readable, too large, not text, nothing in it, or a separator that cannot be
            told.

    """
    path = Path(path)
    where = str(path)
    try:
        with path.open("rb") as file:  # not stat: pipes and devices have no size
            data = file.read(most_bytes + 1)
    except (OSError, ValueError) as error:  # ValueError: a name with NUL or a lone surrogate
        reason = getattr(error, "strerror", None) or "not a file's name"
        raise InputError("file", path, f"a readable CSV file ({reason})") from None
    if len(data) > most_bytes:
        raise InputError(where, "a larger file", f"at most {most_bytes} bytes")
    text = _decoded(data, path)
    if text.count("\n") >= MOST_LINES:
        raise InputError(where, f"{text.count(chr(10)) + 1} lines", f"at most {MOST_LINES}")
    lines = ["" if s.lstrip().startswith("#") else s for s in text.split("\n")]
    filled = (i for i, s in enumerate(lines) if not is_blank(s))
    first = next(filled, None)
    separator = None
    if first is not None and (said := _SEPARATOR_LINE.fullmatch(lines[first])):
        separator, lines[first] = said[1], ""
        if separator not in SEPARATORS:
            raise InputError(f"{where}: row {first + 1}", separator, "sep= , or ; or a tab")
        first = next(filled, None)
    if first is None:
        raise InputError(where, "an empty file", "a header and at least one row")
    if separator is None:
        separator = _separator(
            lines[first], lines[next(filled, first)], f"{where}: row {first + 1}"
        )
    return CsvText(where, hashlib.sha256(data).hexdigest(), tuple(lines), first, separator)


def is_blank(line: str) -> bool:
    """Tells whether a line has no cell with anything in it."""
    return not line.strip(' \t,;"')


def _decoded(data: bytes, path: Path) -> str:
    """The text with a line feed at the end of each line; without padding at its own end."""
    if data.startswith(b"PK\x03\x04"):
        raise InputError(
            "file", path, "a CSV file (this is a workbook, such as .xlsx: save as CSV)"
        )
    marked = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    encodings = ("utf-16",) if marked else ("utf-8-sig", "cp1252")
    for encoding in encodings:
        try:
            text = data.decode(encoding)
            break
        except UnicodeDecodeError:
            continue
    else:
        raise InputError("file", path, "a readable CSV file (not UTF-8 text, nor Windows-1252)")
    text = text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\0\x1a\n")
    if found := _CONTROL.search(text):
        line = text.count("\n", 0, found.start()) + 1
        allowed = "a readable CSV file (text, not a control character; UTF-16 has its mark first)"
        raise InputError(f"{path}: row {line}", found[0], allowed)
    return text


def _separator(header: str, below: str, where: str) -> str:
    """The separator that the header shows; the row below decides where it shows several."""
    bare = re.sub(r"\[[^\]]*\]|\([^)]*\)", "", _without_quoted(header))
    found = [s for s in SEPARATORS if s in bare]
    if len(found) > 1:
        row = _without_quoted(below)
        found = [s for s in found if row.count(s) == bare.count(s)]
        if len(found) != 1:
            names = ", ".join(SEPARATORS.values())
            raise InputError(where, header, f"cells separated by one of {names}")
    return found[0] if found else ","


def _without_quoted(line: str) -> str:
    return re.sub(r'"[^"]*"', '""', line)


def _cells(line: str) -> Sequence[str]:
    """What is between the separators that the line has most of, but nothing empty."""
    bare = _without_quoted(line)
    separator = max(SEPARATORS, key=lambda s: bare.count(s))
    return [cell.strip() for cell in bare.split(separator) if cell.strip()]
