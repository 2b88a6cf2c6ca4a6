"""Finds the masses that bring a racket to a wanted balance, swingweight, twistweight or mass.

Every target is linear in the masses mu_i at places p_i. With the racket's m, b, S (about a) and T,

    sum mu_i                  = m* - m             (mass)
    sum mu_i (x_i - b*)       = m (b* - b)         (balance)
    sum mu_i (x_i - a)^2      = S* - S             (swingweight)
    sum mu_i y_i^2            = T* - T             (twistweight)

and the least added mass under them, mu_i >= 0, is a linear programme (scipy's HiGHS). Places on the
rim are taken in pairs, 3 and 9 o'clock, so that the racket stays even.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.parameters.added_mass import add_mass, place_of
from drake_racket.parameters.racket import AddedMass, RacketParameters, check_racket
from drake_racket.plant.properties import SWINGWEIGHT_AXIS, RacketProperties, racket_properties

PLACES = ("butt", "10cm", "12", "11+1", "10+2", "3+9", "8+4")
"""Where masses may go if nothing else is said: handle, tip, and pairs on the rim."""

LEAST = 1e-5  # kg; less is not added

TARGETS = {
    "mass": ("kg", 1e3, "g"),
    "balance": ("m", 1e2, "cm"),
    "swingweight": ("kg*m^2", 1e4, "kg cm²"),
    "twistweight": ("kg*m^2", 1e4, "kg cm²"),
}
"""Target -> unit, and factor and unit that it is shown in."""


@dataclass(frozen=True)
class _Place:
    """Where a mass goes: its points share it evenly."""

    text: str
    points: tuple[AddedMass, ...]

    def mean(self, values: Sequence[float]) -> float:
        return float(np.mean(values))


def solve_targets(
    racket: RacketParameters,
    targets: Mapping[str, float],
    places: Sequence[str] = PLACES,
) -> RacketParameters:
    """Gives the racket with the least mass added that has the targets.

    Args:
        targets: by name of `TARGETS`, SI.
        places: as `add_mass` takes them; a pair is written `3+9`.

    Raises:
        InputError: no masses at these places do; the message says how far each place reaches.

    """
    for key in targets:
        if key not in TARGETS:
            raise InputError(f"target {key}", targets[key], ", ".join(TARGETS))
    if not targets:
        return racket
    candidates = [_candidate(racket, text) for text in places]
    has = racket_properties(racket)
    left, right = _equations(candidates, has, targets)
    masses = _least(left, right)
    if masses is None:
        raise _unreachable(racket, targets, candidates, has)
    new = racket
    for place, mass in zip(candidates, masses, strict=True):
        if mass >= LEAST:
            for point in place.points:
                new = add_mass(new, float(mass) / len(place.points), point.at)
    return new


def _candidate(racket: RacketParameters, text: str) -> _Place:
    points = tuple(place_of(racket, part.strip()) for part in text.split("+"))
    return _Place(text, points)


def _equations(
    places: Sequence[_Place], has: RacketProperties, targets: Mapping[str, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rows of the module's equations, each scaled to be of the order of a mass."""
    a, rows, sums = SWINGWEIGHT_AXIS, [], []
    for key, target in targets.items():
        if key == "mass":
            row = [1.0 for _ in places]
            total, scale = target - has.mass, 1.0
        elif key == "balance":
            row = [p.mean([q.x - target for q in p.points]) for p in places]
            total, scale = has.mass * (target - has.balance), 0.3
        elif key == "swingweight":
            row = [p.mean([(q.x - a) ** 2 for q in p.points]) for p in places]
            total, scale = target - has.swingweight, 0.1
        else:
            row = [p.mean([q.y**2 for q in p.points]) for p in places]
            total, scale = target - has.twistweight, 0.01
        rows.append([value / scale for value in row])
        sums.append(total / scale)
    return np.array(rows), np.array(sums)


def _least(left: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64] | None:
    from scipy.optimize import linprog

    found = linprog(np.ones(left.shape[1]), A_eq=left, b_eq=right, method="highs")
    if found.status != 0:
        return None
    # the few places that have mass, to the last digits
    used = np.flatnonzero(found.x > LEAST)
    masses = np.zeros(left.shape[1])
    if len(used):
        masses[used] = np.linalg.lstsq(left[:, used], right, rcond=None)[0]
    return masses


def _unreachable(
    racket: RacketParameters,
    targets: Mapping[str, float],
    places: Sequence[_Place],
    has: RacketProperties,
) -> InputError:
    """Says what the racket has, and what 50 g at each place would make of it."""
    keys = [key for key in targets if key != "mass"] or ["mass"]
    told = []
    for key in keys:
        _, factor, unit = TARGETS[key]
        reach = [_with(racket, place, 0.05, key) for place in places]
        low, high = factor * min(reach), factor * max(reach)
        told.append(
            f"{key} is {factor * getattr(has, key):.4g} {unit},"
            f" with 50 g at one of these places {low:.4g} to {high:.4g}"
        )
    wanted = ", ".join(
        f"{key} {TARGETS[key][1] * value:.4g} {TARGETS[key][2]}" for key, value in targets.items()
    )
    where = ", ".join(place.text for place in places)
    allowed = f"what masses at {where} can do together: {'; '.join(told)}"
    return InputError("target", wanted, allowed)


def _with(racket: RacketParameters, place: _Place, mass: float, key: str) -> float:
    new = racket
    for point in place.points:
        new = add_mass(new, mass / len(place.points), point.at)
    return float(getattr(racket_properties(new), key))


def customised(
    racket: RacketParameters,
    added: Sequence[tuple[str | float, str | float]] = (),
    targets: Mapping[str, float] | None = None,
    *,
    places: Sequence[str] = PLACES,
    name: str | None = None,
    title: str | None = None,
) -> RacketParameters:
    """Gives a racket with masses added, and then the least mass that brings it to the targets.

    Args:
        added: pairs of a mass (kg, or a text with its unit) and a place (m from the butt, or a
            name), as `add_mass` takes them.
        targets: name -> number in SI units, as `solve_targets` takes them.
        places: as `solve_targets`.
        name, title: of the new racket.

    Raises:
        InputError: as `add_mass` and `solve_targets`.

    """
    new = racket
    for mass, at in added:
        new = add_mass(new, mass, at)
    new = solve_targets(new, targets or {}, places)
    new = dataclasses.replace(
        new,
        name=name or f"{racket.name}_customised",
        title=title or f"{racket.title}, customised",
    )
    check_racket(new, "customised")
    return new
