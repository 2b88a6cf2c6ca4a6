"""Reads tables of measured oblique impacts on the clamped head: angle of rebound.

A CSV as in `tables`, with the columns

    point                  1-9
    approach_speed [m/s]   or speed [m/s]
    incidence [deg]        from the normal
    azimuth [deg]          optional (90): of the tangential part, from the racket's x axis
    rebound_angle [deg]    or [rad]; from the normal, positive where the ball goes on
    repeat                 optional: number of the shot at this point and setting
    standard_deviation [deg]   optional: of the row's rebound angle

or `stroke` and `angle_reading` in place of speed, incidence and azimuth, as the study of
`rigs.head_clamped` writes them; its table of several beds and readings needs `select`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

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
from drake_racket.rigs.head_clamped import ANGLE_READINGS, STROKES, stroke_axis


@dataclass(frozen=True, kw_only=True)
class AngleTable(ImpactTable):
    """The table holds oblique impacts (`impact_table.ImpactTable`).

    Attributes:
        incidence, azimuth: (m,) degrees.
        angle: (m,) degrees, of rebound from the normal.

    """

    incidence: Array
    azimuth: Array
    angle: Array

    @property
    def velocities(self) -> Array:
        """Gives the ball's velocities (m, 3) in the head, m/s."""
        slant, around = np.radians(self.incidence), np.radians(self.azimuth)
        across = self.speeds * np.sin(slant)
        z = -self.speeds * np.cos(slant)
        return np.stack([across * np.cos(around), across * np.sin(around), z], axis=1)

    def averaged(self, width: float = SETTING_WIDTH) -> AngleTable:
        """Gives the shots of one point, direction and setting as one row, with the mean's error.

        Settings are `width` (degrees) wide.
        The error is a standard one. The standard deviation of a shot is estimated from all settings
        together, as one angle.
        """
        place = np.stack([self.points, self.incidence, self.azimuth], axis=1)
        kind = np.unique(place, axis=0, return_inverse=True)[1].ravel()
        return self._means(kind, "angle", np.ones(len(kind)), width)


def read_angles(path: str | Path, *, select: Select | None = None) -> AngleTable:
    """Reads a table of oblique impacts.

    Raises:
        InputError: as `tables.read_restitution`; an incidence that is not 0.1 to 89 degrees, or a
            rebound angle beyond 90.

    """
    path = Path(path)
    table = selected(CsvTable.read(path, MOST_ROWS), select or {})
    points = read_points(table)
    if table.has("stroke") and not table.has("incidence"):
        speeds, incidence, azimuth = _stroke_columns(table)
    else:
        speeds, incidence = read_speeds(table), table.numbers("incidence", "deg")
        azimuth = np.full(len(points), 90.0)
        if table.has("azimuth"):
            azimuth = table.numbers("azimuth", "deg")
    table.check_range("incidence", incidence, 0.1, 89.0, "0.1 to 89 degrees from the normal")
    table.check_range("azimuth", azimuth, -360.0, 360.0, "-360 to 360 degrees")
    angle = table.numbers("rebound_angle", "deg")
    table.check_range("rebound_angle", angle, -90.0, 90.0, "-90 to 90 degrees from the normal")
    sigma = read_sigma(table, "deg", 45.0)
    key = np.stack([points, speeds, incidence, azimuth], axis=1)
    check_duplicates(table, key, "point, approach_speed, incidence and azimuth")
    return AngleTable(
        points=points,
        speeds=speeds,
        incidence=incidence,
        azimuth=azimuth,
        angle=angle,
        sigma=sigma,
        repeats=np.ones(len(points), dtype=np.int64),
        where=table.where,
        sha256=table.sha256,
    )


def _stroke_columns(table: CsvTable) -> tuple[Array, Array, Array]:
    """Speed (m/s), incidence and azimuth (deg) of the named strokes."""
    rows = []
    strokes, readings = table.texts("stroke"), table.texts("angle_reading")
    for i, (stroke, reading) in enumerate(zip(strokes, readings, strict=True)):
        if stroke not in STROKES:
            raise InputError(table.at(i, "stroke"), stroke, ", ".join(STROKES))
        if reading not in ANGLE_READINGS:
            raise InputError(table.at(i, "angle_reading"), reading, ", ".join(ANGLE_READINGS))
        axis = stroke_axis(stroke, reading)
        rows.append((axis["speed"], axis["incidence_deg"], axis["azimuth_deg"]))
    speeds, incidence, azimuth = np.array(rows).T
    return speeds, incidence, azimuth
