"""Synthetic measurements: the model's own results with the errors of a laboratory.

A fit is shown to recover a parameter set from the files made here, whose form a user's own files
take. Errors, with what Glynn et al. 2011 (Methods) print of them:

    approach speed   set to within 0.5 m/s of the nominal: here uniform, this wide either side
    rebound speed    to within 0.1 m/s: read as a standard deviation, or as a limit (`READINGS`);
                     that the approach speed is measured as well as this is inferred
    repeats          5 at each place and speed; they keep rows of their own here
    place            to within 1 mm. It has no effect on a normal impact in this model: the ball
                     meets the mass of its point wherever it comes down; no error is made up for it
    angle            not printed. By default that of the velocity's two components in the plane of
                     impact, each measured as well as a speed
    force, acceleration, size of the hammer's pulses   not printed; inferred

The true parameters are those of the racket and the ball that are given.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket import BallParameters, InputError, RacketParameters, replace_file
from drake_racket.engines import make_bed, make_impacts, run
from drake_racket.laws import POINT_NUMBERS
from drake_racket.rigs import CANNON_SPEEDS, STROKES, stroke_axis

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

READINGS = ("standard_deviation", "limit")
"""Of "to within 0.1 m/s": normal with this standard deviation, or uniform between its limits."""

REPEATS = 5
OBLIQUE_STEP = 4e-6
"""s; the friction is stiff where the ball has stopped sliding."""

RESTITUTION_COLUMNS = {
    "point": "point",
    "approach_speed [m/s]": "approach_speed",
    "restitution": "restitution",
    "rebound_speed [m/s]": "rebound_speed",
    "repeat": "repeat",
}
"""Column of the CSV that restitution is fitted to -> variable of `restitution_table`."""

OBLIQUE_COLUMNS = {
    "point": "point",
    "approach_speed [m/s]": "approach_speed",
    "incidence [deg]": "incidence",
    "azimuth [deg]": "azimuth",
    "rebound_angle [deg]": "rebound_angle",
    "rebound_speed [m/s]": "rebound_speed",
    "repeat": "repeat",
}
"""Column of the CSV that friction is fitted to -> variable of `oblique_table`."""

MOST = {
    "speed": (2.0, " m/s"),
    "scatter": (5.0, " m/s"),
    "angle": (0.2, " rad"),
    "force": (0.04, ""),
    "acceleration": (0.04, ""),
    "strikes": (0.9, ""),
}


@dataclass(frozen=True)
class Noise:
    """The laboratory's errors; all 0 gives the model's results.

    Attributes:
        speed: m/s, of each measured speed.
        reading: one of READINGS: what `speed` says of the error.
        scatter: m/s, of the true approach speed about the nominal: uniform, this wide either side.
        angle: rad, standard deviation of a rebound angle; None: that which `speed` implies.
        force: standard deviation of a sensor's force, as a share of the record's peak.
        acceleration: the same of the acceleration.
        strikes: by how much the hammer's peaks differ: uniform, this share either side.

    Raises:
        InputError: a number out of range, or an unknown reading.

    """

    speed: float = 0.1
    reading: str = "standard_deviation"
    scatter: float = 0.5
    angle: float | None = None
    force: float = 0.005
    acceleration: float = 0.002
    strikes: float = 0.2

    def __post_init__(self) -> None:
        """Checks the numbers."""
        if self.reading not in READINGS:
            raise InputError("reading", self.reading, ", ".join(READINGS))
        for key, (limit, unit) in MOST.items():
            value = getattr(self, key)
            if value is not None and not 0.0 <= value <= limit:
                raise InputError(key, value, f"0 to {limit:g}{unit}")

    @classmethod
    def none(cls) -> Noise:
        """No errors at all."""
        return cls(speed=0.0, scatter=0.0, angle=0.0, force=0.0, acceleration=0.0, strikes=0.0)

    @property
    def speed_sigma(self) -> float:
        """m/s, standard deviation of a measured speed."""
        return self.speed if self.reading == "standard_deviation" else self.speed / math.sqrt(3.0)

    def speed_errors(self, rng: np.random.Generator, size: Any) -> Array:
        """m/s, errors of measured speeds."""
        if self.reading == "standard_deviation":
            return np.asarray(self.speed * rng.standard_normal(size))
        return np.asarray(rng.uniform(-self.speed, self.speed, size))


def restitution_table(
    racket: RacketParameters,
    ball: BallParameters,
    rng: np.random.Generator,
    *,
    points: Sequence[int] = POINT_NUMBERS,
    speeds: Sequence[float] = CANNON_SPEEDS,
    repeats: int = REPEATS,
    noise: Noise | None = None,
) -> xarray.Dataset:
    """Normal impacts on the clamped head.

    Args:
        speeds: nominal, m/s.  repeats: at each point and speed.

    Returns:
        A Dataset over `impact`: `point`, `repeat`, the measured `approach_speed`, `rebound_speed`
        (m/s) and their ratio `restitution`, `nominal_speed`, and the true speeds.

    Raises:
        InputError: a point, speed or number of repeats out of range.

    """
    noise = noise or Noise()
    check_request(points, speeds, repeats)
    rows = [(p, v, n + 1) for p in points for v in speeds for n in range(repeats)]
    point, nominal, repeat = (np.array(column) for column in zip(*rows, strict=True))
    approach = nominal + rng.uniform(-noise.scatter, noise.scatter, len(rows))
    impacts = make_impacts(racket, ball, point, approach)
    outcome = run([make_bed(racket)], impacts)
    _check_ended(outcome.ended)
    rebound = outcome.column("v_z")[0]
    measured = approach + noise.speed_errors(rng, len(rows))
    back = rebound + noise.speed_errors(rng, len(rows))
    return _dataset(
        racket,
        "normal impacts on the clamped head, synthetic",
        point=("1", "point of the string-bed", point),
        repeat=("1", "number of the repeat", repeat),
        nominal_speed=("m/s", "speed that the cannon is set to", nominal),
        approach_speed=("m/s", "measured approach speed", measured),
        rebound_speed=("m/s", "measured rebound speed", back),
        restitution=("1", "measured rebound over measured approach speed", back / measured),
        true_approach_speed=("m/s", "true approach speed", approach),
        true_rebound_speed=("m/s", "true rebound speed", rebound),
    )


def oblique_table(
    racket: RacketParameters,
    ball: BallParameters,
    rng: np.random.Generator,
    *,
    points: Sequence[int] = POINT_NUMBERS,
    strokes: Sequence[str] = tuple(STROKES),
    angle_readings: Sequence[str] = ("from_plane",),
    repeats: int = REPEATS,
    friction_reading: str = "velocity",
    noise: Noise | None = None,
) -> xarray.Dataset:
    """Oblique impacts on the clamped head.

    Args:
        angle_readings: of the source's angles (`rigs.head_clamped`); rows for each. By default the
            grazing one: steeper, the ball stops sliding and its angle does not tell the friction.

    Returns:
        A Dataset over `impact`: `point`, `repeat`, the measured `approach_speed` (m/s), the set
        `incidence` (from the normal) and `azimuth` (deg), the measured `rebound_angle` (deg, from
        the normal, positive where the ball goes on) and `rebound_speed` (m/s), and the true
        `true_approach_speed`, `true_rebound_angle` and `true_rebound_speed`.

    Raises:
        InputError: a stroke, reading, point or number of repeats that there is not.

    """
    noise = noise or Noise()
    axes = [stroke_axis(s, reading) for reading in angle_readings for s in strokes]
    check_request(points, [axis["speed"] for axis in axes], repeats)
    rows = [
        (p, axis["speed"], axis["incidence_deg"], axis["azimuth_deg"], n + 1)
        for axis in axes
        for p in points
        for n in range(repeats)
    ]
    point, nominal, incidence, azimuth, repeat = (np.array(c) for c in zip(*rows, strict=True))
    speed = nominal + rng.uniform(-noise.scatter, noise.scatter, len(rows))
    slant, around = np.radians(incidence), np.radians(azimuth)
    direction = np.stack(
        [np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), -np.cos(slant)], axis=1
    )
    impacts = make_impacts(
        racket, ball, point, speed[:, None] * direction, friction_reading=friction_reading
    )
    outcome = run([make_bed(racket)], impacts, step=OBLIQUE_STEP)
    _check_ended(outcome.ended)
    angle = outcome.rebound_angle(impacts)[0]
    rebound = np.linalg.norm(outcome.values[:, :3], axis=1)
    in_plane = rebound[:, None] * np.stack([np.sin(angle), np.cos(angle)], axis=1)
    seen = in_plane + noise.speed_errors(rng, in_plane.shape)
    seen_angle = np.arctan2(seen[:, 0], seen[:, 1])
    if noise.angle is not None:
        seen_angle = angle + noise.angle * rng.standard_normal(len(rows))
    approach = speed + noise.speed_errors(rng, len(rows))
    return _dataset(
        racket,
        f"oblique impacts on the clamped head, synthetic, friction by {friction_reading}",
        point=("1", "point of the string-bed", point),
        repeat=("1", "number of the repeat", repeat),
        approach_speed=("m/s", "measured approach speed", approach),
        incidence=("deg", "angle of approach from the normal, as set", incidence),
        azimuth=("deg", "direction of approach in the string plane, from x, as set", azimuth),
        rebound_angle=("deg", "measured rebound angle from the normal", np.degrees(seen_angle)),
        rebound_speed=("m/s", "measured rebound speed", np.linalg.norm(seen, axis=1)),
        true_approach_speed=("m/s", "true approach speed", speed),
        true_rebound_angle=("deg", "true rebound angle from the normal", np.degrees(angle)),
        true_rebound_speed=("m/s", "true rebound speed", rebound),
    )


def write_measurements(table: xarray.Dataset, columns: dict[str, str], path: Path) -> None:
    """Writes a CSV, one row per impact, without the true values.

    Args:
        columns: RESTITUTION_COLUMNS or OBLIQUE_COLUMNS.

    """
    write_columns(path, {column: table[name] for column, name in columns.items()})


def check_request(points: Sequence[int], speeds: Sequence[float], repeats: int) -> None:
    """Refuses points, speeds (m/s) and numbers of repeats out of range; raises InputError."""
    if not points or not set(points) <= set(POINT_NUMBERS):
        raise InputError("points", list(points), "some of 1 to 9")
    if not speeds or not all(6.0 <= v <= 100.0 for v in speeds):
        raise InputError("speeds", list(speeds), "6 to 100 m/s, one or more")
    if not 1 <= repeats <= 1000:
        raise InputError("repeats", repeats, "1 to 1000")


def _check_ended(ended: NDArray[np.bool_]) -> None:
    if not ended.all():
        got = f"{int((~ended).sum())} impacts in which the ball does not come away"
        raise InputError("racket and ball", got, "parameters with which it leaves the strings")


def _dataset(
    racket: RacketParameters, title: str, **columns: tuple[str, str, Array]
) -> xarray.Dataset:
    import xarray as xr

    number = np.arange(1, len(next(iter(columns.values()))[2]) + 1)
    text = {"units": "1", "long_name": "number of the impact"}
    return xr.Dataset(
        {
            name: ("impact", values, {"units": unit, "long_name": long_name})
            for name, (unit, long_name, values) in columns.items()
        },
        coords={"impact": ("impact", number, text)},
        attrs={"title": f"{racket.title}: {title}", "racket": racket.name},
    )


def write_columns(path: Path, columns: dict[str, Any]) -> None:
    """Writes a CSV that reads back to the last bit."""
    rows = zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True)

    def write(temporary: Path) -> None:
        with temporary.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(columns)
            writer.writerows(rows)

    replace_file(path, write)
