"""Computes what a stopwatch, a rule and scales tell about a racket's inertia.

Glynn et al. (2011) take the moments about the frontal (z) and transverse (y) axes from pendulum
periods (Brody 1985), the moment about the longitudinal axis (x) from a torsional pendulum, and the
centre of mass from two knife-edges, one of them on scales. These are the same sums as pure
functions: floats in, floats out, SI units and radians. Places are measured along the racket from
its butt end (or from the near end of a part). The simulated bench that feeds them is
`rigs.inertia.simulation`.

Standard deviations are propagated to first order, sd(f)^2 = sum (df/dx_i)^2 sd(x_i)^2, for errors
that are independent of each other; a standard deviation that is not given counts as zero. Mass and
balance from the same two measurements of the scales are not independent: `Weighing` has their
covariance, and `pendulum_moments` takes it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.special import ellipk

from drake_racket.io.errors import InputError
from drake_racket.rigs.input_checks import (
    check_finite,
    check_not_negative,
    check_positive,
    check_result,
)

STANDARD_GRAVITY = 9.80665
"""m/s^2, the standard value (3rd CGPM, 1901); pass the local one, it varies by 0.5 %."""


@dataclass(frozen=True)
class Measured:
    """Holds a number and its standard deviation, in the same unit."""

    value: float
    sd: float = 0.0


@dataclass(frozen=True)
class PendulumMoments:
    """Holds moments of inertia (kg m^2) about a pendulum's pivot and the central axis."""

    about_pivot: Measured
    about_com: Measured


def pendulum_moments(
    period: float,
    mass: float,
    distance: float,
    *,
    amplitude: float = 0.0,
    gravity: float = STANDARD_GRAVITY,
    period_sd: float = 0.0,
    mass_sd: float = 0.0,
    distance_sd: float = 0.0,
    mass_distance_covariance: float = 0.0,
) -> PendulumMoments:
    """Gives moments of inertia from the period of a body that swings about a fixed horizontal axis.

        I_pivot = m g d (T / 4 K(k))^2,   k = sin(amplitude / 2),   I_com = I_pivot - m d^2

    with the complete elliptic integral K, exact for every amplitude: K(0) = pi/2 gives the usual
    (T / 2 pi)^2. A 10 degree amplitude taken for a small one overstates I_pivot by 0.38 %.

    Args:
        period: s, of one full swing (there and back).
        mass: kg.  distance: m, from the pivot's axis to the centre of mass.
        amplitude: rad, greatest angle from the vertical, below pi; 0 takes the small-angle limit.
        gravity: m/s^2.
        period_sd, mass_sd, distance_sd: standard deviations.
        mass_distance_covariance: kg m, at most the product of both deviations.

    Raises:
        InputError: a value is not finite or out of range, or the period is below that of a point
            mass at this distance, which no body can have.

    """
    check_positive(period=period, mass=mass, distance=distance, gravity=gravity)
    check_not_negative(amplitude=amplitude)
    if not amplitude < math.pi:
        raise InputError("amplitude", amplitude, "0 to below pi, radians")
    check_not_negative(period_sd=period_sd, mass_sd=mass_sd, distance_sd=distance_sd)
    common = _correlation(mass_distance_covariance, mass_sd, distance_sd)
    quarter = float(ellipk(math.sin(0.5 * amplitude) ** 2))
    time = period / (4.0 * quarter)
    about_pivot = mass * gravity * distance * time * time
    about_com = about_pivot - mass * distance * distance
    if not about_com > 0.0:
        least = 4.0 * quarter * math.sqrt(distance / gravity)
        raise InputError("period", period, f"more than {least:.6g} s, a point mass's at this place")
    by_period = 2.0 * about_pivot / period * period_sd
    by_mass, by_distance = mass_sd / mass, about_pivot / distance * distance_sd
    # both terms of I_com depend on the distance, and partly cancel
    central = (about_pivot / distance - 2.0 * mass * distance) * distance_sd
    return PendulumMoments(
        about_pivot=_measured(
            about_pivot, by_period, *_correlated(about_pivot * by_mass, by_distance, common)
        ),
        about_com=_measured(
            about_com, by_period, *_correlated(about_com * by_mass, central, common)
        ),
    )


def torsional_moment(
    period: float,
    torsion_constant: float,
    *,
    empty_period: float = 0.0,
    period_sd: float = 0.0,
    torsion_constant_sd: float = 0.0,
    empty_period_sd: float = 0.0,
) -> Measured:
    """Gives the moment of inertia (kg m^2) about the axis of a torsional pendulum.

        I = kappa (T^2 - T_empty^2) / 4 pi^2

    Exact for every amplitude at which the spring is linear. Without `empty_period` the platform
    counts as massless. Twistweight is this moment about the racket's long axis.

    Args:
        period, empty_period: s, with the body and with the platform and its clamps alone.
        torsion_constant: kappa, N m/rad; see `torsion_constant`.

    Raises:
        InputError: a value is not finite or out of range, or the empty period is not the shorter.

    """
    check_positive(period=period, torsion_constant=torsion_constant)
    _check_periods(period, empty_period)
    check_not_negative(
        period_sd=period_sd,
        torsion_constant_sd=torsion_constant_sd,
        empty_period_sd=empty_period_sd,
    )
    scale = torsion_constant / (4.0 * math.pi**2)
    moment = scale * (period - empty_period) * (period + empty_period)
    return _measured(
        moment,
        2.0 * scale * period * period_sd,
        moment / torsion_constant * torsion_constant_sd,
        2.0 * scale * empty_period * empty_period_sd,
    )


def torsion_constant(period: float, known_moment: float, *, empty_period: float = 0.0) -> float:
    """Gives torsion constant (N m/rad) of a pendulum, from a body of known moment of inertia on it.

        kappa = 4 pi^2 I_known / (T^2 - T_empty^2)

    Raises:
        InputError: a value is not finite or out of range, or the empty period is not the shorter.

    """
    check_positive(period=period, known_moment=known_moment)
    _check_periods(period, empty_period)
    squares = (period - empty_period) * (period + empty_period)
    if not squares > 0.0:
        raise InputError("period", period, "a period whose square is a number above 0")
    constant = 4.0 * math.pi**2 * known_moment / squares
    check_result("period, known_moment", constant)
    return constant


def balance_point(
    shown: float,
    mass: float,
    edge_distance: float,
    *,
    fixed_edge: float = 0.0,
    scale_sd: float = 0.0,
    mass_sd: float = 0.0,
    edge_distance_sd: float = 0.0,
) -> Measured:
    """Gives the centre of mass (m from the butt) of a body that lies level on two knife-edges.

        x = x_fixed + (shown / m) D

    by moments about the fixed edge; gravity cancels.

    Args:
        shown: kg, what the scales under the other edge show (tared with the edge on them).
        mass: kg, of the whole body.
        edge_distance: m, D, from the fixed edge to the edge on the scales, towards the tip;
            negative where the scales are on the butt's side.
        fixed_edge: m, place of the fixed edge from the butt.

    Raises:
        InputError: a value is not finite or out of range, or what they show is above the mass (then
            the body would lift off the fixed edge).

    """
    check_positive(shown=shown, mass=mass)
    check_finite("edge_distance", edge_distance)
    check_finite("fixed_edge", fixed_edge)
    check_not_negative(scale_sd=scale_sd, mass_sd=mass_sd, edge_distance_sd=edge_distance_sd)
    if edge_distance == 0.0:
        raise InputError("edge_distance", edge_distance, "a number other than 0 (m)")
    if shown > mass:
        raise InputError("shown", shown, f"at most the mass, {mass} kg")
    share = shown / mass
    place = fixed_edge + share * edge_distance
    shares = (
        edge_distance / mass * scale_sd,
        share * edge_distance / mass * mass_sd,
        share * edge_distance_sd,
    )
    deviation = math.hypot(*shares)
    if not (math.isfinite(place) and math.isfinite(deviation)):
        raise InputError("edge_distance, fixed_edge", place, "places whose result is finite")
    return Measured(place, deviation)


@dataclass(frozen=True)
class Weighing:
    """Holds mass (kg) and centre of mass (m) from two weighings, and their covariance (kg m)."""

    mass: Measured
    com: Measured
    covariance: float


def weigh_twice(
    shown: float,
    exchanged: float,
    edges: tuple[float, float],
    *,
    scale_sd: float = 0.0,
    place_sd: float = 0.0,
) -> Weighing:
    """Finds mass and centre of mass on two knife-edges, weighed again with them exchanged.

        m = r1 + r2,   x = a + s (b - a),   s = r1 / m
        sd(m)^2 = 2 sd(r)^2
        sd(x)^2 = (s^2 + (1 - s)^2) (((b - a) / m)^2 sd(r)^2 + sd(a)^2)
        cov(m, x) = (1 - 2 s) (b - a) / m sd(r)^2

    by moments about a with the scales under b (r1), and about b with the scales under a (r2).

    Args:
        shown, exchanged: kg, r1 and r2.
        edges: m, a and b, from the butt.
        scale_sd, place_sd: standard deviations of either weighing, and of either edge's place.

    Raises:
        InputError: a value is not finite or out of range, or the edges are in one place.

    """
    check_positive(shown=shown, exchanged=exchanged)
    check_not_negative(scale_sd=scale_sd, place_sd=place_sd)
    for edge in edges:
        check_finite("edges", edge)
    mass, distance = shown + exchanged, edges[1] - edges[0]
    place = balance_point(shown, mass, distance, fixed_edge=edges[0]).value
    share, lever = shown / mass, distance / mass * scale_sd
    both = math.hypot(share, 1.0 - share)
    deviation = both * math.hypot(lever, place_sd)
    covariance = (1.0 - 2.0 * share) * lever * scale_sd
    for result in (deviation, covariance):
        check_finite("edges, scale_sd, place_sd", result)
    return Weighing(_measured(mass, scale_sd, scale_sd), Measured(place, deviation), covariance)


def _check_periods(period: float, empty_period: float) -> None:
    check_not_negative(empty_period=empty_period)
    if not empty_period < period:
        raise InputError("empty_period", empty_period, f"less than the period, {period} s")


def _correlation(covariance: float, mass_sd: float, distance_sd: float) -> float:
    """Correlation of the mass and the distance, from their covariance."""
    check_finite("mass_distance_covariance", covariance)
    product = mass_sd * distance_sd
    if abs(covariance) > product:
        allowed = f"-{product:.6g} to {product:.6g} kg m, the deviations' product"
        raise InputError("mass_distance_covariance", covariance, allowed)
    return covariance / product if product > 0.0 else 0.0


def _correlated(first: float, second: float, correlation: float) -> tuple[float, float]:
    """Independent shares that have the variance of the sum of two correlated ones."""
    return first + correlation * second, math.sqrt(1.0 - correlation**2) * second


def _measured(value: float, *shares: float) -> Measured:
    """The number and its standard deviation from the shares (df/dx_i) sd(x_i)."""
    deviation = math.hypot(*shares)
    check_result("the measured numbers together", value, deviation)
    return Measured(value, deviation)
