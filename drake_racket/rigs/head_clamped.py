"""The ball cannon shoots at a racket whose head is held rigidly.

Normal impacts: nine points, six speeds, restitution (Glynn et al. 2011 fit T0, k1-k4 and p1-p6 to
these). Oblique impacts: two stroke conditions at nine points, rebound angle (they fit mu1-mu3).

The source gives the obliquity as an angle of the racket face from the vertical, seen from the side
("17 degrees in front of the vertical"), at the relative velocity of ball and racket. Two readings:

    from_normal   the ball comes 17 degrees (16) from the normal of the strings
    from_plane    the ball comes 17 degrees (16) from the string plane: a grazing impact

Under `from_normal` a point-mass ball with mu near 0.35 stops sliding before it leaves; under
`from_plane` it slides throughout. The tangential part is along y, across the racket's long axis:
towards +y for the topspin drive and towards -y for the slice, which comes with the other side up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from drake_racket.io.errors import InputError
from drake_racket.io.progress import Report, part_of
from drake_racket.laws.bed import POINT_NUMBERS
from drake_racket.parameters.racket import RACKETS, TENSIONS
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.impact import ImpactResult
from drake_racket.results.outputs import CONTACT_TIME, REBOUND_SPEED, RESTITUTION, Output
from drake_racket.sweep.run import run_grid
from drake_racket.sweep.spec import make_sweep

if TYPE_CHECKING:
    import xarray

CANNON_SPEEDS = (18.0, 21.0, 24.0, 27.0, 30.0, 33.0)
"""The cannon's speeds (m/s) are 18 to 33 in steps of about 3 (Glynn et al. 2011, Methods)."""

STROKES = {"topspin_drive": (31.0, 17.0, 90.0), "slice": (25.0, 16.0, -90.0)}
"""A stroke has a relative speed (m/s), an angle (degrees; Methods), an inferred azimuth (deg)."""

ANGLE_READINGS = ("from_normal", "from_plane")
"""How the paper's angles of incidence can be read: from the strings' normal, or their plane."""


def head_clamped_scenario() -> Scenario:
    """Gives the base case of the rig: started just before touch, ended after every release."""
    return Scenario(support="clamped_head", audit=False, approach_time=1e-4, after=0.0095)


def normal_impacts(
    *,
    rackets: Sequence[str] = RACKETS,
    tensions: Sequence[str] = TENSIONS,
    points: Sequence[int] = POINT_NUMBERS,
    speeds: Sequence[float] = CANNON_SPEEDS,
    base: Scenario | None = None,
    workers: int = 1,
    progress: Report | None = None,
) -> xarray.Dataset:
    """Runs normal impacts: restitution, rebound speed, contact time, peak force and deflection.

    Args:
        speeds: m/s, of approach.

    Returns:
        A Dataset over (racket, tension, point, speed).

    Raises:
        InputError: a case is not valid.

    """
    axes = {
        "racket": list(rackets),
        "tension": list(map(str, tensions)),
        "point": list(points),
        "speed": {"values": list(speeds), "unit": "m/s"},
    }
    sweep = make_sweep(base or head_clamped_scenario(), axes)
    title = "Head clamped, normal impacts"
    return run_grid(sweep, title=title, workers=workers, progress=progress)


def stroke_axis(stroke: str, reading: str) -> dict[str, float]:
    """Gives the scenario's speed, incidence (from the normal) and azimuth of a stroke condition.

    Raises:
        InputError: unknown stroke or reading.

    """
    if stroke not in STROKES:
        raise InputError("stroke", stroke, ", ".join(STROKES))
    if reading not in ANGLE_READINGS:
        raise InputError("angle_reading", reading, ", ".join(ANGLE_READINGS))
    speed, angle, azimuth = STROKES[stroke]
    incidence = angle if reading == "from_normal" else 90.0 - angle
    return {"speed": speed, "incidence_deg": incidence, "azimuth_deg": azimuth}


def _tangential_velocity(result: ImpactResult) -> float:
    """Along the tangential direction of approach, so that going on is positive."""
    vx, vy = result.approach_velocity[:2]
    size = math.hypot(vx, vy)
    wx, wy = result.rebound_velocity[:2]
    return float((vx * wx + vy * wy) / size)


def _rebound_angle(result: ImpactResult) -> float:
    return math.atan2(_tangential_velocity(result), float(result.rebound_velocity[2]))


OBLIQUE_OUTPUTS = (
    Output(
        "rebound_angle",
        "rad",
        "from the normal; positive: the ball goes on in the direction it came from",
        _rebound_angle,
    ),
    REBOUND_SPEED,
    Output(
        "tangential_velocity",
        "m/s",
        "rebound velocity along the string plane; near 0 the ball has stopped sliding",
        _tangential_velocity,
    ),
    RESTITUTION,
    CONTACT_TIME,
)


def oblique_impacts(
    *,
    rackets: Sequence[str] = RACKETS,
    tensions: Sequence[str] = TENSIONS,
    strokes: Sequence[str] = tuple(STROKES),
    angle_readings: Sequence[str] = ANGLE_READINGS,
    friction_readings: Sequence[str] = ("velocity", "displacement"),
    points: Sequence[int] = POINT_NUMBERS,
    base: Scenario | None = None,
    workers: int = 1,
    progress: Report | None = None,
) -> xarray.Dataset:
    """Runs oblique impacts: rebound angle and speed, in both readings of friction and angle.

    Returns:
        A Dataset over (racket, tension, friction_reading, angle_reading, stroke, point).

    Raises:
        InputError: a case is not valid.

    """
    import xarray

    parts = []
    for n, reading in enumerate(angle_readings):
        axes = {
            "racket": list(rackets),
            "tension": list(map(str, tensions)),
            "friction_reading": list(friction_readings),
            "stroke": _stroke_rows(strokes, reading),
            "point": list(points),
        }
        sweep = make_sweep(base or head_clamped_scenario(), axes, OBLIQUE_OUTPUTS)
        report = part_of(progress, n * len(sweep), len(angle_readings) * len(sweep))
        title = "Head clamped, oblique impacts"
        part = run_grid(sweep, title=title, workers=workers, progress=report)
        parts.append(part.drop_vars(_STROKE_UNITS))  # they differ between the readings
    index = xarray.Variable("angle_reading", list(angle_readings))
    dataset = xarray.concat(parts, index, combine_attrs="override")
    return dataset.transpose(
        "racket", "tension", "friction_reading", "angle_reading", "stroke", "point"
    )


_STROKE_UNITS = {"speed": "m/s", "incidence_deg": "degrees", "azimuth_deg": "degrees"}


def _stroke_rows(strokes: Sequence[str], reading: str) -> dict[str, Any]:
    """The strokes as an axis of a sweep."""
    values = [stroke_axis(stroke, reading) for stroke in strokes]
    return {
        "keys": {key: {"unit": unit} for key, unit in _STROKE_UNITS.items()},
        "rows": [[row[key] for key in _STROKE_UNITS] for row in values],
        "labels": list(strokes),
    }
