"""Turns cells into numbers: which decimal mark they have, and why a cell is none."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from drake_racket.io.units import is_unit

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?", re.ASCII)
"""With a decimal point; Fortran writes D for E."""

_EXPONENT = r"(?:[eEdD][+-]?[0-9]+)?"
_COMMA = re.compile(rf"[+-]?(?:[0-9]+,[0-9]*|,[0-9]+){_EXPONENT}")
_POINT = re.compile(rf"[+-]?(?:[0-9]+\.[0-9]*|\.[0-9]+){_EXPONENT}")
_ANY = re.compile(rf"[+-]?[0-9]*[.,]?[0-9]+[.,]?{_EXPONENT}")
_MAYBE_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")
_THOUSANDS = re.compile(
    r"[+-]?[0-9]{1,3}(?:([.,' \u00a0\u202f\u2019])[0-9]{3})(?:\1[0-9]{3})*([.,][0-9]*)?"
)


def to_number(cell: str, decimal: str) -> float:
    """Gives the number in a cell, rounded correctly; nan if it is not one of this decimal mark.

    float() alone also takes nan, inf, 1_000, digits of other scripts.
    """
    text = plain(cell)
    if decimal == ",":
        text = text.replace(".", "?").replace(",", ".")
    if not NUMBER.fullmatch(text):
        return math.nan
    return float(text.replace("D", "e").replace("d", "e"))


def plain(cell: str) -> str:
    """Writes a typewriter's minus sign."""
    return cell.replace("\u2212", "-")


def decimal_mark(columns: Sequence[Sequence[str]]) -> tuple[str, tuple[int, int] | None]:
    """Gives the decimal mark of a table in which commas do not separate cells.

    Columns that begin with a number count.

    Returns:
        "," or ".", and the (column, row) of a number that does not go with it: of the other mark,
        or a whole table of `1,234`, in which the comma may stand before thousands. None if all do.

    """
    commas, points = [], []
    for c, cells in enumerate(columns):
        first = next((cell for cell in cells if cell), "")
        if not _ANY.fullmatch(plain(first)):
            continue
        commas += [(c, r) for r, cell in enumerate(cells) if _COMMA.fullmatch(plain(cell))]
        points += [(c, r) for r, cell in enumerate(cells) if _POINT.fullmatch(plain(cell))]
    if not commas:
        return ".", None
    if points:
        return ",", points[0]
    if all(_MAYBE_THOUSANDS.fullmatch(plain(columns[c][r])) for c, r in commas):
        return ",", commas[0]
    return ",", None


def why_no_number(cell: str, decimal: str) -> str:
    """Tells the cause, and what to do."""
    text = plain(cell)
    if not text:
        return "the cell is empty; leave out the row, or begin it with #"
    if NUMBER.fullmatch(text) and decimal == ",":
        return "a decimal point in a file with decimal commas: write one of them"
    if _THOUSANDS.fullmatch(text) and not _COMMA.fullmatch(text):
        return "thousands separators: write 1234.5"
    if _THOUSANDS.fullmatch(text):
        return "a decimal comma, or a comma before thousands: write 1234.5"
    if _COMMA.fullmatch(text):
        return "a decimal comma where commas separate cells: write 0.5, or separate by semicolons"
    if is_unit(text):
        return "a unit: write it in the header, as in time [s]"
    if re.match(r"ov(er|l|f|r|ld)", text, re.IGNORECASE):
        return "an overload: what the instrument did not measure cannot be used"
    if re.match(r"[+-]?\d+(\.\d*)?\s*[^\d.,\s]", text) and not re.search(r"\d[-:_/]\d", text):
        return "text after a number: write the unit in the header, as in time [s]"
    return "text in a column of numbers; remove the row, or begin it with #"
