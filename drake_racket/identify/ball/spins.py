"""Reads tables of oblique impacts with spin on the clamped head: angle of rebound and spin after.

A CSV as in `tables`, with the columns

    approach_speed [m/s]      or speed [m/s]
    incidence [deg]           from the normal
    spin [rpm]                before, positive in friction's sense; 0 if there is no such column
    rebound_angle [deg]       from the normal, positive where the ball goes on
    spin_after [rpm]          as spin
    x [m], y [m]              optional: place of the touch from the bed's centre
    angle_sd [deg], spin_sd [rpm]   optional: standard deviations of the two measured columns
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.io.tables import CsvTable

Array: TypeAlias = NDArray[np.float64]

MOST_ROWS = 5000
MOST_SPIN = 20000.0
"""rpm: twice what anybody has measured."""
ANGLE_SD, SPIN_SD = 0.5, 50.0
"""degrees and rpm, where a table has none: of video at thousands of pictures a second; inferred."""


@dataclass(frozen=True, eq=False)
class SpinTable:
    """The table holds m impacts.

    Attributes:
        speeds: m/s, of approach.  incidence: degrees.  spin: rpm, before.
        places: (m, 2) of the touch, from the bed's centre (m).
        angle, spin_after: degrees and rpm, measured.  angle_sd, spin_sd: degrees and rpm, of these.
        where, sha256: the file, and the hash of its bytes.

    """

    speeds: Array
    incidence: Array
    spin: Array
    places: Array
    angle: Array
    spin_after: Array
    angle_sd: Array
    spin_sd: Array
    where: str = "table"
    sha256: str = ""

    def __len__(self) -> int:
        """How many impacts there are."""
        return len(self.speeds)


def read_spins(path: str | Path) -> SpinTable:
    """Reads a table of impacts with spin.

    Raises:
        InputError: as `tables.CsvTable.read`; numbers out of range.

    """
    table = CsvTable.read(Path(path), MOST_ROWS)
    name = "speed" if table.has("speed") else "approach_speed"
    speeds, incidence = table.numbers(name, "m/s"), table.numbers("incidence", "deg")
    table.check_range(name, speeds, 1.0, 100.0, "1 to 100 m/s")
    table.check_range("incidence", incidence, 0.1, 85.0, "0.1 to 85 degrees from the normal")
    m = len(speeds)
    spin = table.numbers("spin", "rpm") if table.has("spin") else np.zeros(m)
    after = table.numbers("spin_after", "rpm")
    for column, values in (("spin", spin), ("spin_after", after)):
        table.check_range(column, values, -MOST_SPIN, MOST_SPIN, "-20000 to 20000 rpm")
    angle = table.numbers("rebound_angle", "deg")
    table.check_range("rebound_angle", angle, -90.0, 90.0, "-90 to 90 degrees from the normal")
    places = np.zeros((m, 2))
    for i, letter in enumerate("xy"):
        if table.has(letter):
            places[:, i] = table.numbers(letter, "m")
    return SpinTable(
        speeds,
        incidence,
        spin,
        places,
        angle,
        after,
        _deviation(table, "angle_sd", "deg", ANGLE_SD, m),
        _deviation(table, "spin_sd", "rpm", SPIN_SD, m),
        table.where,
        table.sha256,
    )


def _deviation(table: CsvTable, name: str, unit: str, usual: float, count: int) -> Array:
    if not table.has(name):
        return np.full(count, usual)
    found = table.numbers(name, unit)
    for i, value in enumerate(found):
        if not value > 0.0:
            raise InputError(table.at(i, name), float(value), "more than 0")
    return found
