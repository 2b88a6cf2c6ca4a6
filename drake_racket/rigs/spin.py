"""Shoots balls that spin at a clamped bed, over incidence and friction: what comes back.

Impacts run in the clamped engine, the law of contact `surface`. Friction is one mu at all points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from drake_racket.engines.clamped.batch import make_bed
from drake_racket.engines.clamped.spinning import run_spinning, spinning_impacts
from drake_racket.io.units import labelled
from drake_racket.parameters.ball import BallParameters, load_ball
from drake_racket.parameters.racket import RacketParameters, load_racket
from drake_racket.parameters.scenario import RPM
from drake_racket.plant.contacts import surface_model

if TYPE_CHECKING:
    import xarray

INCIDENCES = tuple(range(0, 71, 2))
FRICTIONS = (0.25, 0.30, 0.35, 0.40, 0.45, 0.50)


def spin_over_incidence(
    racket: RacketParameters | None = None,
    ball: BallParameters | None = None,
    *,
    speed: float = 25.0,
    spin_rpm: float = 0.0,
    incidences: Sequence[float] = INCIDENCES,
    frictions: Sequence[float] = FRICTIONS,
) -> xarray.Dataset:
    """Gives spin and angle after impacts at the centre, over (friction, incidence).

    Args:
        racket, ball: the tour racket's bed and the shipped ball if None.
        speed: m/s.  spin_rpm: before, positive in friction's sense.
        incidences: degrees from the normal.  frictions: mu (1).

    Returns:
        `spin` (rpm, as `spin_rpm`), `angle` (degrees from the normal, positive onwards),
        `speed` (m/s), `restitution`, `sliding` (share of the contact), and `surface_speed` (m/s):
        of the ball's surface over the strings after, positive onwards.

    """
    import xarray

    racket, ball = racket or load_racket(), ball or load_ball()
    angle = np.radians(np.asarray(incidences, dtype=float))
    zero = np.zeros_like(angle)
    velocities = speed * np.stack([zero, np.sin(angle), -np.cos(angle)], axis=1)
    spins = np.stack([zero - spin_rpm * RPM, zero, zero], axis=1)
    bed, model = make_bed(racket), surface_model(racket, ball)
    places = np.zeros((len(angle), 2))
    rows = []
    for mu in frictions:
        impacts = spinning_impacts(racket, ball, places, velocities, spins, friction=mu)
        found = run_spinning(bed, model, ball.mass.value, impacts)
        v = found.velocities
        surface_speed = v[:, 1] + ball.radius.value * found.spins[:, 0]
        rows.append(
            (
                -found.spins[:, 0] / RPM,
                np.degrees(np.arctan2(v[:, 1], v[:, 2])),
                np.linalg.norm(v, axis=1),
                -v[:, 2] / velocities[:, 2],
                found.sliding_time / found.contact_time,
                surface_speed,
            )
        )
    names = {
        "spin": ("rpm", "spin after, positive in friction's sense"),
        "angle": ("degrees", "rebound angle from the normal"),
        "speed": ("m/s", "rebound speed"),
        "restitution": ("1", "normal rebound over normal approach speed"),
        "sliding": ("1", "share of the contact spent sliding"),
        "surface_speed": ("m/s", "speed of the ball's surface over the strings, after"),
    }
    table = np.array(rows)
    return xarray.Dataset(
        {
            name: labelled(("friction", "incidence"), table[:, i], units, text)
            for i, (name, (units, text)) in enumerate(names.items())
        },
        coords={
            "friction": ("friction", list(frictions)),
            "incidence": ("incidence", [float(x) for x in incidences], {"units": "degrees"}),
        },
    )


def slip_limit(
    friction: float,
    racket: RacketParameters | None = None,
    ball: BallParameters | None = None,
    *,
    speed: float = 25.0,
    within: float = 0.05,
) -> float:
    """Gives the incidence (degrees) from which a ball without spin slides throughout.

    Args:
        friction: mu (1).  speed: m/s.  within: degrees.

    """
    return _limit(
        lambda data: data["sliding"].to_numpy()[0] > 1.0 - 1e-9,
        friction,
        racket,
        ball,
        speed,
        within,
    )


def rolling_limit(
    friction: float,
    racket: RacketParameters | None = None,
    ball: BallParameters | None = None,
    *,
    speed: float = 25.0,
    within: float = 0.05,
) -> float:
    """Gives the incidence (degrees) from which a ball without spin leaves before it rolls.

    Its surface then still goes onwards over the strings: what `rigid_slip_limit` is about. Below,
    a sheared element may still unwind, and by its force slide, after the ball has come to roll.

    Args:
        friction: mu (1).  speed: m/s.  within: degrees.

    """
    # far below the limit an element that gives little back leaves a ball short of rolling too
    return _limit(
        lambda data: (
            (data["surface_speed"].to_numpy()[0] > 0.0)
            & (data["sliding"].to_numpy()[0] > 1.0 - 1e-9)
        ),
        friction,
        racket,
        ball,
        speed,
        within,
    )


def _limit(
    beyond: Callable[[xarray.Dataset], NDArray[np.bool_]],
    friction: float,
    racket: RacketParameters | None,
    ball: BallParameters | None,
    speed: float,
    within: float,
) -> float:
    """The incidence (degrees) from which impacts are `beyond` a limit."""
    low, high = 30.0, 80.0
    while high - low > within:
        angles = np.linspace(low, high, 12)
        data = spin_over_incidence(
            racket, ball, speed=speed, incidences=angles.tolist(), frictions=[friction]
        )
        slides = beyond(data)
        if not slides.any():
            return high
        first = int(np.argmax(slides))
        if first == 0:
            return low
        low, high = float(angles[first - 1]), float(angles[first])
    return 0.5 * (low + high)


def rigid_slip_limit(friction: float, restitution: float, inertia_factor: float) -> float:
    """Gives the same limit (degrees) for a ball on a rigid, heavy surface without compliance.

    Friction takes the ball to rolling if mu (1 + e) v_n >= v_t / (1 + 1 / a), for a moment of
    inertia a m R^2. Source: Cross (2002), American Journal of Physics 70:1093-1102.

    Args:
        friction: mu (1).  restitution: e (1).  inertia_factor: a (1).

    """
    return math.degrees(math.atan(friction * (1.0 + restitution) * (1.0 + 1.0 / inertia_factor)))
