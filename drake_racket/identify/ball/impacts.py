"""Reads measured impacts of a ball on a force plate, and says what is fitted of each.

The table is a CSV with one row per impact and the columns `file`, `speed [m/s]` (measured, before
the impact) and, if the balls were weighed, `mass [kg]`. `file` is a path from the table's place to
a CSV with `time [s]` and `force [N]`, as `signals` reads them; the plate's compression is positive.
Other columns are ignored.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import trapezoid

from drake_racket.io.errors import InputError
from drake_racket.io.signals import Signal, pulse_extent, read_signal
from drake_racket.io.tables import CsvTable

LEAST_SHARE = 0.05
"""Of the largest sample: what is above, around it, is surely contact, 1 % of noise or not."""

MOST_SPEED = 100.0  # m/s, as rigs.force_plate
MOST_MASS = 1.0  # kg
MOST_ROWS = 1000


@dataclass(frozen=True)
class BallImpact:
    """A ball impact is the plate's force and the ball's approach speed (m/s), as measured.

    Attributes:
        speed: m/s, of approach.
        mass: of this ball, kg; None where it was not weighed.

    Raises:
        InputError: a speed that is not 0.1 to 100 m/s, or a mass above 1 kg or not positive.

    """

    force: Signal
    speed: float
    mass: float | None = None

    def __post_init__(self) -> None:
        """Checks the numbers."""
        where = self.force.where
        if not 0.1 <= self.speed <= MOST_SPEED:
            raise InputError(f"{where}: speed [m/s]", self.speed, f"0.1 to {MOST_SPEED:g}")
        if self.mass is not None:
            check_mass(self.mass, f"{where}: mass [kg]")


def check_mass(mass: float, key: str) -> None:
    """Refuses what is no ball's mass in kg."""
    if not 0.0 < mass <= MOST_MASS:
        raise InputError(key, mass, f"above 0, up to {MOST_MASS:g} kg")


@dataclass(frozen=True)
class Contact:
    """Holds the samples of a record that are surely in contact.

    Attributes:
        samples: of the record; the first of the pulse is left out, in which touch may fall.
        start: s, first sample of the pulse.  length: s, of the pulse.  step: s, longest.
        peak: N, largest sample.
        restitution: rebound over approach speed that the impulse implies.
        begun, cut_off: the record begins after touch; ends before release.
        offset: N, mean force before touch (`resting_offset`).

    """

    samples: slice
    start: float
    length: float
    step: float
    peak: float
    restitution: float
    begun: bool
    cut_off: bool
    offset: float


def find_contact(impact: BallImpact, mass: float) -> Contact:
    """Gives the contact in a record.

    Args:
        mass: kg, of the ball.

    Raises:
        InputError: no positive force, fewer than 20 samples in contact, or a pulse that is still
            rising at the end of the record.

    """
    signal = impact.force
    time, force = signal.time, signal.value
    first, last = pulse_extent(signal, LEAST_SHARE)
    top = int(np.argmax(force))
    peak = float(force[top])
    cut_off = last == len(force) - 1
    if cut_off and top > last - 3:
        got = f"the largest value, {peak:.4g} N, at the last sample"
        raise InputError(f"{signal.where}: force [N]", got, "a record at least past the peak")
    inside = slice(first, last + 1)
    impulse = float(trapezoid(force[inside], time[inside]))
    quiet = force[: max(first - 2, 0)]
    return Contact(
        samples=slice(first + 1, last + 1),
        start=float(time[first]),
        length=float(time[last] - time[first]),
        step=float(np.diff(time[inside]).max()),
        peak=peak,
        restitution=impulse / (mass * impact.speed) - 1.0,
        begun=first == 0 and force[0] > LEAST_SHARE * peak,
        cut_off=cut_off,
        offset=resting_offset(quiet),
    )


def resting_offset(quiet: NDArray[np.float64]) -> float:
    """Gives mean of the samples before anything happens; 0 where noise explains it, or below 20."""
    if len(quiet) < 20:
        return 0.0
    mean = float(quiet.mean())
    return mean if abs(mean) > 4.0 * float(quiet.std()) / math.sqrt(len(quiet)) else 0.0


def read_ball_impacts(path: str | Path) -> list[BallImpact]:
    """Reads a table of impacts and the records that it names.

    Raises:
        InputError: a table or record that is missing, not readable or not UTF-8; a column missing,
            double or in another unit; a cell that is not a number; a file named twice; a number
            out of range; or a record that `read_signal` refuses.

    """
    path = Path(path)
    table = CsvTable.read(path, MOST_ROWS)
    files, speeds = table.texts("file"), table.numbers("speed", "m/s")
    table.check_range("speed", speeds, 0.1, MOST_SPEED, f"0.1 to {MOST_SPEED:g} m/s")
    weighed = table.numbers("mass", "kg").tolist() if table.has("mass") else []
    for i, mass in enumerate(weighed):
        check_mass(mass, table.at(i, "mass"))
    seen: dict[Path, int] = {}
    for i, name in enumerate(files):
        if not name:
            raise InputError(table.at(i, "file"), name, "the path of a record")
        record = (path.parent / name).absolute()
        first = seen.setdefault(Path(os.path.normpath(record)), i)
        if first != i:
            allowed = f"each record once (it is in row {table.lines[first]})"
            raise InputError(table.at(i, "file"), name, allowed)
    return [
        BallImpact(read_signal(path.parent / name, "force", "N"), speed, mass)
        for name, speed, mass in zip(
            files, speeds.tolist(), weighed or [None] * len(files), strict=True
        )
    ]
