"""Sampled signals: read from CSV with one clear error, and pulses in them.

A CSV has the columns `time [s]` and, say, `force [N]` or `acceleration [m/s^2]`, in any form that
`tables` reads. Other columns are ignored.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.csv_text import MOST_LINES
from drake_racket.io.errors import InputError
from drake_racket.io.tables import CsvTable

MAX_BYTES = 20_000_000
"""A second at 65 kHz is about 3 MB; this stops a wrong file early."""

FEWEST_SAMPLES = 20
"""Fewer samples in a pulse do not show its shape: peak and impulse would be off by percents."""


@dataclass(frozen=True)
class Signal:
    """A signal is one quantity sampled over time.

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
            few = " (equal ones: printed with too few digits?)" if steps[i - 1] == 0.0 else ""
            raise InputError(f"{self.where}: time [s]", pair, f"times that increase{few}")

    def at(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gives the signal at another `time` (s), straight between samples and 0 outside them."""
        return np.interp(time, self.time, self.value, left=0.0, right=0.0)


def read_signal(
    path: str | Path,
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
        InputError: the file is missing, not readable, not text, empty or above 20 MB; a column is
            missing, double, or in a unit that is no multiple of this one; a cell is not a finite
            number (the message names the row by its line in the file); time does not increase; too
            few samples, or too far apart.

    """
    path = Path(path)
    table = CsvTable.read(path, MOST_LINES, MAX_BYTES)
    time, value = table.numbers("time", "s"), table.numbers(name, unit)
    if len(time) < fewest:
        raise InputError(f"{path}: rows", f"{len(time)} samples", f"at least {fewest}")
    signal = Signal(time, value, name, unit, str(path))
    longest = float(np.diff(signal.time).max())
    if longest > longest_step * (1.0 + 1e-6):  # times are often printed with six digits
        raise InputError(
            f"{path}: time [s]",
            f"steps up to {longest:.3g} s",
            f"steps up to {longest_step:.3g} s",
        )
    return signal


def pulse_extent(signal: Signal, share: float) -> tuple[int, int]:
    """Gives first and last sample of what stays above a share of the largest value around it.

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
