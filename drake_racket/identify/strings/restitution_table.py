"""Reads tables of measured normal impacts on the clamped head: restitution.

A CSV with one header line, columns named `name [unit]` (`[1]` may be left out) and lines of comment
that begin with `#`; other columns are ignored:

    point                  1-9
    approach_speed [m/s]   or speed [m/s]
    restitution            and/or rebound_speed [m/s]
    repeat                 optional: number of the shot at this point and setting
    standard_deviation     optional: of the row's restitution

A table of several rackets or beds, as the study of `rigs.head_clamped` writes it, needs `select`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_racket.identify.strings.impact_table import SETTING_WIDTH, Array, ImpactTable
from drake_racket.identify.strings.table_rows import (
    MOST_ROWS,
    Select,
    check_duplicates,
    read_points,
    read_sigma,
    read_speeds,
    selected,
)
from drake_racket.io.errors import InputError
from drake_racket.io.tables import CsvTable

TOLERANCE = 0.02
"""Restitution and rebound over approach speed of one row may differ by this."""


@dataclass(frozen=True, kw_only=True)
class RestitutionTable(ImpactTable):
    """The table holds normal impacts (`impact_table.ImpactTable`).

    Attributes:
        restitution: (m,).

    """

    restitution: Array

    def averaged(self, width: float = SETTING_WIDTH) -> RestitutionTable:
        """Shots at one point and setting as one row: the mean, with its standard error.

        The error of a shot is taken to be one of speed, s, the same for all: s / v in restitution
        (v the approach speed). s is estimated from all settings together. Where the file gives
        standard deviations, a mean's comes from these. Without repeats the table stays as it is.

        Args:
            width: m/s; see `impact_table.SETTING_WIDTH`.

        """
        return self._means(self.points, "restitution", self.speeds, width)

    def with_speed_sigma(self, sigma: float) -> RestitutionTable:
        """Gives the same with each restitution's error from that of its two speeds.

        e = w / v with independent errors of w and v of this standard deviation:
        sigma / v sqrt((1 + e^2) / shots). That the model is evaluated at the measured v, and e
        falls with it, takes about 3 % off this, which is neglected.

        Args:
            sigma: m/s, of one measured speed.

        Raises:
            InputError: not positive, or above 5 m/s.

        """
        if not 0.0 < sigma <= 5.0:
            raise InputError("speed_sigma", sigma, "above 0, up to 5 m/s")
        error = sigma / self.speeds * np.sqrt((1.0 + self.restitution**2) / self.repeats)
        return replace(self, sigma=error)


def read_restitution(path: str | Path, *, select: Select | None = None) -> RestitutionTable:
    """Reads a table of normal impacts.

    Args:
        select: column -> text: the rows to take.

    Raises:
        InputError: a file that is not a readable CSV; a column missing, double or in another unit;
            a cell that is no number or out of range; restitution not above 0 and up to 1, or not
            the ratio of the speeds beside it; two rows of one point, speed and repeat; no rows;
            several rackets, tensions or readings.

    """
    path = Path(path)
    table = CsvTable.read(path, MOST_ROWS)
    table = selected(table, select or {})
    points = read_points(table)
    speeds = read_speeds(table)
    given = table.numbers("restitution", "1") if table.has("restitution") else None
    back = table.numbers("rebound_speed", "m/s") if table.has("rebound_speed") else None
    if given is None and back is None:
        raise InputError(f"{table.where}: header", table.header_text(), "a column restitution")
    restitution = given
    if restitution is None:
        assert back is not None
        restitution = back / speeds
    for i, e in enumerate(restitution):
        if not 0.0 < e <= 1.0:
            raise InputError(table.at(i, "restitution"), float(e), "above 0, up to 1")
    if given is not None and back is not None:
        off = np.abs(given - back / speeds)
        if off.max() > TOLERANCE:
            i = int(np.argmax(off))
            allowed = f"rebound over approach speed, {back[i] / speeds[i]:.4g}"
            raise InputError(table.at(i, "restitution"), float(given[i]), allowed)
    sigma = read_sigma(table, "1", 0.5)
    check_duplicates(table, np.stack([points, speeds], axis=1), "point and approach_speed")
    return RestitutionTable(
        points=points,
        speeds=speeds,
        restitution=restitution,
        sigma=sigma,
        repeats=np.ones(len(points), dtype=np.int64),
        where=table.where,
        sha256=table.sha256,
        warnings=tuple(_gaps(points, speeds)),
    )


def _gaps(points: NDArray[np.int64], speeds: Array) -> list[str]:
    """What a table of normal impacts lacks."""
    found = []
    missing = sorted(set(range(1, 10)) - set(points.tolist()))
    if missing:
        text = "point" if len(missing) == 1 else "points"
        found.append(f"no impacts at {text} {', '.join(map(str, missing))}")
    if np.ptp(speeds) < SETTING_WIDTH:
        found.append(
            f"one speed only ({speeds.mean():.4g} m/s): tension and stiffness of the springs, "
            "which their different growth with deflection tells apart, trade off"
        )
    return found
