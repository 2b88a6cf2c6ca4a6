"""Sampled signals: read from CSV with one clear error, written back, and pulses in them.

A CSV has one header line. Columns are named `name [unit]`, as the package writes them: `time [s]`
and, say, `force [N]` or `acceleration [m/s^2]`. Other columns are ignored. Numbers have a decimal
point, cells are separated by commas.
"""

from __future__ import annotations

import csv
import io
import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.io.files import replace_file

MAX_BYTES = 20_000_000
"""A second at 65 kHz is about 3 MB; this stops a wrong file early."""

FEWEST_SAMPLES = 20
"""Fewer samples in a pulse do not show its shape: peak and impulse would be off by percents."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


@dataclass(frozen=True)
class Signal:
    """One quantity sampled over time.

    Attributes:
        time: (n,) s, increasing; the steps need not be equal.
        value: (n,) in `unit`.
        name, unit: as in the CSV's column `name [unit]`.

    Raises:
        InputError: shapes that differ, fewer than two samples, numbers that are not finite, or a
            time that does not increase.

    """

    time: NDArray[np.float64]
    value: NDArray[np.float64]
    name: str
    unit: str
    where: str = field(default="signal", compare=False)  # for messages: the file it comes from

    def __post_init__(self) -> None:
        """Takes own, read-only arrays and checks them."""
        for key in ("time", "value"):
            numbers = np.array(getattr(self, key), dtype=float)
            numbers.setflags(write=False)
            object.__setattr__(self, key, numbers)
            if numbers.ndim != 1 or len(numbers) != len(self.time) or len(numbers) < 2:
                shape = f"an array of shape {numbers.shape}"
                raise InputError(f"{self.where}: {key}", shape, "two or more times, a value each")
            if not np.isfinite(numbers).all():
                bad = float(numbers[~np.isfinite(numbers)][0])
                raise InputError(f"{self.where}: {key}", bad, "finite numbers")
        steps = np.diff(self.time)
        if not (steps > 0.0).all():
            i = int(np.argmax(steps <= 0.0)) + 1
            pair = f"{self.time[i]:.9g} after {self.time[i - 1]:.9g} (sample {i + 1})"
            raise InputError(f"{self.where}: time [s]", pair, "times that increase")

    def at(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """The signal at other times (s), straight between its samples and 0 outside them."""
        return np.interp(time, self.time, self.value, left=0.0, right=0.0)


def read_signal(
    path: Path,
    name: str,
    unit: str,
    *,
    longest_step: float = math.inf,
    fewest: int = FEWEST_SAMPLES,
) -> Signal:
    """Reads the columns `time [s]` and `name [unit]` of a CSV.

    Args:
        longest_step: the longest step allowed between two samples (s).
        fewest: samples, at least.

    Raises:
        InputError: the file is missing, not readable, not UTF-8, empty or above 20 MB; a column is
            missing, double, or has another unit; a cell is not a finite number (the message names
            the row, the header being row 1); time does not increase; too few samples, or too far
            apart.

    """
    where = str(path)
    rows = _rows(_text(path), where)
    if not rows:
        raise InputError(
            where, "an empty file", f"a CSV with the columns time [s], {name} [{unit}]"
        )
    header = [cell.strip() for cell in rows[0][1]]
    columns = [_column(header, n, u, where) for n, u in (("time", "s"), (name, unit))]
    if len(rows) - 1 < fewest:
        raise InputError(f"{where}: rows", f"{len(rows) - 1} samples", f"at least {fewest}")
    table = np.empty((len(rows) - 1, 2))
    for sample, (row, cells) in enumerate(rows[1:]):
        if len(cells) != len(header):
            raise InputError(f"{where}: row {row}", f"{len(cells)} cells", f"{len(header)} cells")
        for k, column in enumerate(columns):
            table[sample, k] = _number(cells[column], f"{where}: row {row}, {header[column]}")
    signal = Signal(table[:, 0], table[:, 1], name, unit, where)
    longest = float(np.diff(signal.time).max())
    if longest > longest_step * (1.0 + 1e-6):  # times are often printed with six digits
        raise InputError(
            f"{where}: time [s]",
            f"steps up to {longest:.3g} s",
            f"steps up to {longest_step:.3g} s",
        )
    return signal


def write_signal(signal: Signal, path: Path) -> None:
    """Writes a CSV that `read_signal` reads back to the last bit."""

    def write(temporary: Path) -> None:
        with temporary.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["time [s]", f"{signal.name} [{signal.unit}]"])
            writer.writerows(zip(signal.time.tolist(), signal.value.tolist(), strict=True))

    replace_file(path, write)


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:  # not stat: pipes and devices have no size
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a name with NUL or a lone surrogate
        reason = getattr(error, "strerror", None) or "not a file's name"
        raise InputError("file", path, f"a readable CSV file ({reason})") from None
    if len(data) > MAX_BYTES:
        raise InputError(str(path), "a larger file", f"at most {MAX_BYTES} bytes")
    try:
        return data.decode("utf-8-sig")  # spreadsheets put a byte order mark first
    except UnicodeDecodeError:
        raise InputError("file", path, "a readable CSV file (not UTF-8 text)") from None


def _rows(text: str, where: str) -> list[tuple[int, list[str]]]:
    """The rows that hold something, each with its line number in the file."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        return [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise InputError(where, f"line {reader.line_num}", f"CSV ({error})") from None


def _column(header: list[str], name: str, unit: str, where: str) -> int:
    wanted = f"{name} [{unit}]"
    if header.count(wanted) == 1:
        return header.index(wanted)
    if wanted in header:
        raise InputError(f"{where}: header", f"{wanted} twice", "each column once")
    # the same quantity in another unit, or without one, is worth naming
    other = [cell for cell in header if cell.split("[")[0].strip().lower() == name]
    found = other[0] if other else ", ".join(header)
    raise InputError(f"{where}: header", found, f"a column {wanted}")


def _number(cell: str, where: str) -> float:
    text = cell.strip()
    # float() also takes nan, inf, 1_000 and digits of other scripts
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise InputError(where, cell, "a finite number")
    return value


def pulse_extent(signal: Signal, share: float) -> tuple[int, int]:
    """First and last sample of the stretch around the largest value that stays above a share of it.

    Args:
        share: of the largest value, between 0 and 1.

    Raises:
        InputError: no positive value, fewer than 20 samples in the pulse, or a share out of range.

    """
    if not 0.0 < share < 1.0:
        raise InputError("share", share, "between 0 and 1")
    top = int(np.argmax(signal.value))
    peak = float(signal.value[top])
    where = f"{signal.where}: {signal.name} [{signal.unit}]"
    if peak <= 0.0:
        raise InputError(where, f"a largest value of {peak:g}", "a pulse with positive values")
    below = np.flatnonzero(signal.value < share * peak)
    first = int(below[below < top].max(initial=-1)) + 1
    last = int(below[below > top].min(initial=len(signal.value))) - 1
    if last - first + 1 < FEWEST_SAMPLES:
        raise InputError(
            where, f"{last - first + 1} samples in the pulse", f"at least {FEWEST_SAMPLES}"
        )
    return first, last
