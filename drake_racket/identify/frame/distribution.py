"""Calibrates a frame's distribution from what can be measured of a whole racket.

A racket is weighed, balanced and swung (mass, balance, swingweight, twistweight), hung on threads
and struck (fundamentals, second frequency, nodes, antinodes), or clamped. None of these says by
itself how mass and stiffness lie along the frame. Here all of them together move the numbers that
describe it: masses and centres of the two parts, the breadth of the head, the mixture of the two
density families, the taper of the bending stiffness, and the fundamentals. Each number starts from
a racket's own with a stated spread, and comes out with one; a number whose spread the measurements
do not lower is open, and said to be.

The fit is one of least squares, ((model - measured) / sd)^2 and ((x - x0) / spread)^2 added up, and
its covariance the inverse of the same terms' curvature at the solution.

The model is that of `whole_racket`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from drake_racket.identify.core.estimate import Estimate
from drake_racket.identify.frame.whole_racket import MEASURED, predictions
from drake_racket.io.errors import InputError
from drake_racket.io.units import measure
from drake_racket.parameters.frame import Part
from drake_racket.parameters.quantities import Quantity
from drake_racket.parameters.racket import RacketParameters, check_racket

Array = NDArray[np.float64]

UNKNOWN: Mapping[str, tuple[str, float]] = {
    "handle_mass": ("kg", 0.15),
    "head_mass": ("kg", 0.15),
    "handle_com": ("m", 0.03),
    "head_com": ("m", 0.015),
    "head_breadth": ("1", 0.10),
    "density": ("1", 0.5),
    "taper_in_plane": ("1", 0.5),
    "taper_out_of_plane": ("1", 0.5),
    "frequency_in_plane": ("Hz", 0.15),
    "frequency_out_of_plane": ("Hz", 0.15),
}
"""Name -> unit, and the spread about the racket's own number: of masses and frequencies relative,
of centres in m, of the density absolute about 1/2, of breadth and tapers of their logarithm."""

_LOGARITHMIC: tuple[str, ...] = ("handle_mass", "head_mass", "head_breadth")
_LOGARITHMIC += ("taper_in_plane", "taper_out_of_plane")
_LOGARITHMIC += ("frequency_in_plane", "frequency_out_of_plane")
_OF_FRAME: tuple[str, ...] = ("density", "taper_in_plane", "taper_out_of_plane")
_OF_FRAME += ("frequency_in_plane", "frequency_out_of_plane")
DETERMINED = 0.75
"""Share of a number's variance that the measurements take away, from which it counts as known."""


@dataclass(frozen=True)
class Number:
    """Holds one calibrated number.

    Attributes:
        value, sd: with the measurements.  before: its spread without them.
        share: of its variance that they take away, 0 to 1.
        leans_on: measurement -> by how much its variance would grow without that one, relative.

    """

    unit: str
    value: float
    sd: float
    before: float
    share: float
    leans_on: Mapping[str, float]

    def known(self) -> bool:
        """Tells whether the measurements determine it."""
        return self.share >= DETERMINED


@dataclass(frozen=True)
class DistributionFit:
    """Holds a calibrated frame.

    Attributes:
        racket: with the calibrated parts and `frame`, in six segments unless it had more than two.
        numbers: by the names of UNKNOWN, in SI units.
        measured: name -> (measured, standard deviation, model's).
        families: misfit without unit, the sum of ((model - measured) / sd)^2, of the best fits
            of family A and of family B alone.

    """

    racket: RacketParameters
    numbers: Mapping[str, Number]
    measured: Mapping[str, tuple[float, float, float]]
    families: Mapping[str, float]

    def open(self) -> tuple[str, ...]:
        """Lists the numbers that the measurements leave open."""
        return tuple(name for name, number in self.numbers.items() if not number.known())

    def fields(self) -> dict[str, Estimate]:
        """Gives the numbers as estimates with their 95 % intervals."""
        found = {}
        for name, number in self.numbers.items():
            reach = 1.96 * number.sd
            interval = number.value - reach, number.value + reach
            if name in _LOGARITHMIC:
                factor = math.exp(reach / number.value)
                interval = number.value / factor, number.value * factor
            elif name == "density":
                interval = max(interval[0], 0.0), min(interval[1], 1.0)
            found[name] = Estimate(number.value, number.sd, interval, number.unit)
        return found


def fit_distribution(
    racket: RacketParameters,
    measured: Mapping[str, float | str | tuple[float, float]],
) -> DistributionFit:
    """Calibrates a frame's distribution.

    Args:
        racket: what the numbers start from: a published racket, or one of a shop's numbers.
        measured: names of MEASURED -> number, text with its unit (`129 Hz`), or number and standard
            deviation.

    Raises:
        InputError: a name or number that does not fit, or frequencies that no frame has.

    """
    found = _checked(measured)
    start = _Start(racket)
    names = list(found)
    target = np.array([value for value, _ in found.values()])
    sd = np.array([s for _, s in found.values()])

    def residuals(x: Array) -> Array:
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                model = predictions(start.racket_at(x))
        except (np.linalg.LinAlgError, ValueError):  # no mass within the parts has these moments
            return np.concatenate([np.full(len(names), 1e3), x])
        misfit = (np.array([model[name] for name in names]) - target) / sd
        return np.concatenate([np.where(np.isfinite(misfit), misfit, 1e3), x])

    def solve(low: float, high: float) -> tuple[Array, Array, float]:
        bounds = start.bounds(low, high)
        begin = np.clip(np.zeros(len(UNKNOWN)), bounds[0] + 1e-9, bounds[1] - 1e-9)
        result = least_squares(
            residuals, begin, bounds=bounds, x_scale=1.0, diff_step=1e-5, ftol=1e-5, xtol=1e-5
        )
        misfit = float(np.sum(result.fun[: len(names)] ** 2))
        return result.x, result.jac, misfit

    x, jacobian, _ = solve(0.0, 1.0)
    made = start.racket_at(x)
    check_racket(made)
    model = predictions(made)
    rows = jacobian[: len(names)]
    return DistributionFit(
        racket=_cut(made),
        numbers=start.numbers(x, rows, names),
        measured={n: (*found[n], model[n]) for n in names},
        families={"A": solve(0.0, 1e-3)[2], "B": solve(1.0 - 1e-3, 1.0)[2]},
    )


def _checked(
    measured: Mapping[str, float | str | tuple[float, float]],
) -> dict[str, tuple[float, float]]:
    found: dict[str, tuple[float, float]] = {}
    for name, given in measured.items():
        if name not in MEASURED:
            raise InputError(f"measured.{name}", "an unknown measurement", ", ".join(MEASURED))
        unit, usual, _ = MEASURED[name]
        number, sd = given if isinstance(given, tuple) else (given, usual)
        value = measure(f"measured.{name}", number, unit)
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"measured.{name}", number, f"more than 0 {unit}")
        if not (math.isfinite(sd) and sd > 0.0):
            raise InputError(f"measured.{name}", sd, f"a standard deviation above 0 {unit}")
        found[name] = value, float(sd)
    if not found:
        raise InputError("measured", "nothing", f"one or more of {', '.join(MEASURED)}")
    first, second = (found.get(n) for n in ("frequency_out_of_plane", "second_frequency"))
    if second is not None and first is not None and second[0] <= first[0]:
        allowed = f"more than the fundamental, {first[0]:g} Hz"
        raise InputError("measured.second_frequency", second[0], allowed)
    return found


def _cut(racket: RacketParameters) -> RacketParameters:
    """The racket in six segments, unless it has more than two already."""
    if racket.frame.count() > 2:
        return racket
    six = Quantity(6.0, "1", "inferred", "enough for loads on the hand")
    return dataclasses.replace(racket, frame=dataclasses.replace(racket.frame, segments=six))


class _Start:
    """The racket that a fit starts from; unknowns x are in units of their spread about it."""

    def __init__(self, racket: RacketParameters) -> None:
        self.racket = racket
        frame = racket.frame
        own = predictions(racket)
        self.values = {
            "handle_mass": racket.handle.mass.value,
            "head_mass": racket.head.mass.value,
            "handle_com": racket.handle.com.value,
            "head_com": racket.head.com.value,
            "head_breadth": 1.0,
            "density": 0.5,
            "taper_in_plane": frame.taper_in_plane.value,
            "taper_out_of_plane": frame.taper_out_of_plane.value,
            "frequency_in_plane": own["frequency_in_plane"],
            "frequency_out_of_plane": own["frequency_out_of_plane"],
        }

    def value(self, name: str, x: float) -> float:
        """Gives an unknown's value."""
        spread = UNKNOWN[name][1]
        first = self.values[name]
        return first * math.exp(spread * x) if name in _LOGARITHMIC else first + spread * x

    def bounds(self, low: float, high: float) -> tuple[Array, Array]:
        """Bounds of x: three spreads, and the density between two values."""
        edges = np.full(len(UNKNOWN), 3.0)
        lower, upper = -edges, edges.copy()
        at, spread = list(UNKNOWN).index("density"), UNKNOWN["density"][1]
        lower[at], upper[at] = (low - 0.5) / spread, (high - 0.5) / spread
        return lower, upper

    def racket_at(self, x: Array) -> RacketParameters:
        """Gives the racket of some unknowns, its radii of gyration kept."""
        found = {name: self.value(name, float(v)) for name, v in zip(UNKNOWN, x, strict=True)}
        old = self.racket
        handle = _part(old.handle, found["handle_mass"], found["handle_com"], 1.0)
        head = _part(old.head, found["head_mass"], found["head_com"], found["head_breadth"])
        frame = dataclasses.replace(
            old.frame,
            **{n: Quantity(found[n], UNKNOWN[n][0], "fitted", _SOURCE) for n in _OF_FRAME},
        )
        return dataclasses.replace(old, handle=handle, head=head, frame=frame)

    def numbers(self, x: Array, rows: Array, names: list[str]) -> dict[str, Number]:
        """Gives values, spreads, and what each leans on."""
        count = len(UNKNOWN)
        covariance = np.linalg.inv(rows.T @ rows + np.eye(count))
        without = [
            np.diag(np.linalg.inv(rows.T @ rows - np.outer(row, row) + np.eye(count)))
            for row in rows
        ]
        found = {}
        for i, (name, (unit, spread)) in enumerate(UNKNOWN.items()):
            value = self.value(name, float(x[i]))
            per = spread * (value if name in _LOGARITHMIC else 1.0)
            variance = float(covariance[i, i])
            grows = {
                other: float(left[i] / variance - 1.0)
                for other, left in zip(names, without, strict=True)
            }
            found[name] = Number(
                unit=unit,
                value=value,
                sd=per * math.sqrt(variance),
                before=per,
                share=1.0 - variance,
                leans_on=dict(sorted(grows.items(), key=lambda item: -item[1])),
            )
        return found


_SOURCE = "calibrated: identify.frame.distribution"


def _part(part: Part, mass: float, com: float, breadth: float) -> Part:
    """A part of another mass, centre and breadth with the same radii of gyration along it."""
    along, across, normal = part.moments()
    yy = 0.5 * (along + normal - across)
    more = (breadth * breadth - 1.0) * yy
    factor = mass / part.mass.value
    values = {
        "mass": mass,
        "com": com,
        "moi_longitudinal": factor * (along + more),
        "moi_transverse": factor * across,
        "moi_frontal": factor * (normal + more),
    }
    return dataclasses.replace(
        part,
        **{
            key: dataclasses.replace(
                getattr(part, key), value=value, status="fitted", source=_SOURCE
            )
            for key, value in values.items()
        },
    )
