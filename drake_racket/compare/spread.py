"""Computes how sure an assessment is: what inferred numbers of a racket move it by.

A racket made of a shop's numbers keeps them in `specs`, each with its standard deviation. One at a
time is changed by that, the frame is solved anew, and what moves is taken as one standard
deviation; all of them are independent and add in squares. So are two choices: the strings, those of
one published racket, are exchanged for the other's once, and so are the proportions of handle and
head (`recipe.Proportions`).
Published and fitted rackets have no such numbers and come without spread.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drake_racket.compare.assessment import (
    Assessment,
    Bench,
    Swing,
    assess,
    static_numbers,
    usual_scenario,
)
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Progress, Report
from drake_racket.parameters.added_mass import readded
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.parameters.racket import RACKETS, RacketParameters, load_racket
from drake_racket.parameters.scenario import Scenario
from drake_racket.parameters.specs.build import with_specs
from drake_racket.parameters.specs.recipe import RECREATIONAL

SMALL = 5e-3
"""Of a value: a spread below it (a shop's rounding) moves whole-racket numbers alone."""


@dataclass(frozen=True)
class Assessed:
    """An assessment with the standard deviation of its numbers, and what it is made of.

    Attributes:
        sd: by name, in the numbers' units; 0 where nothing inferred moves a number.
        parts: name of what was changed -> by how much each number moved, in the same units.

    """

    nominal: Assessment
    sd: Mapping[str, float]
    parts: Mapping[str, Mapping[str, float]]

    @property
    def racket(self) -> RacketParameters:
        """Gives the racket."""
        return self.nominal.racket


def assess_with_spread(
    racket: RacketParameters,
    *,
    base: Scenario | None = None,
    swing: Swing | None = None,
    hand: bool = True,
    progress: Report | None = None,
) -> Assessed:
    """Computes an assessment and its spread; arguments as `assessment.assess`."""
    bench = Bench(usual_scenario(base))
    others = variants(racket)
    total, done = 1 + sum(dynamic for _, _, dynamic in others), 0

    def assessed(one: RacketParameters) -> Assessment:
        nonlocal done
        part = _part_of(progress, f"impacts on {racket.name}", done, total)
        done += 1
        return assess(one, swing=swing, bench=bench, progress=part, hand=hand)

    def overridden(one: RacketParameters) -> RacketParameters:
        return apply_overrides(one, bench.base.overrides)

    nominal = assessed(racket)
    parts: dict[str, dict[str, float]] = {}
    for name, other, dynamic in others:
        found = assessed(other).values if dynamic else static_numbers(overridden(other))
        parts[name] = {key: found[key] - nominal.values[key] for key in found}
    sd = {
        key: float(np.sqrt(sum(part.get(key, 0.0) ** 2 for part in parts.values())))
        for key in nominal.values
    }
    return Assessed(nominal, sd, parts)


def _part_of(report: Report | None, task: str, done: int, total: int) -> Report:
    """Reports one assessment of several as part of one task."""

    def part(now: Progress) -> None:
        if report is not None:
            count = now.total
            report(replace(now, task=task, done=done * count + now.done, total=total * count))

    return part


def variants(racket: RacketParameters) -> list[tuple[str, RacketParameters, bool]]:
    """Lists the racket with one inferred number moved at a time: its name, racket, and whether
    impacts feel it.
    """
    if not racket.specs:
        return []
    found = []
    for key, spec in racket.specs.items():
        if not spec.sd:
            continue
        # in-plane bending takes no part in a normal impact
        dynamic = spec.sd > SMALL * abs(spec.value) and key != "in_over_out"
        for sign in (1.0, -1.0):
            try:
                moved = readded(with_specs(racket, {key: spec.value + sign * spec.sd}))
            except InputError:  # on the edge of what is possible: the other side is taken
                continue
            found.append((key, moved, dynamic))
            break
    return [*found, *_other_split(racket), ("string_bed", _with_other_strings(racket), True)]


def _other_split(racket: RacketParameters) -> list[tuple[str, RacketParameters, bool]]:
    """The racket split into handle and head as one of the published ones is, not as their mean."""
    try:
        return [("split", readded(with_specs(racket, {}, "", RECREATIONAL)), True)]
    except InputError:  # no such racket is split that way
        return []


def _with_other_strings(racket: RacketParameters) -> RacketParameters:
    """The racket with the springs and friction of the other published bed, at its tension."""
    tension = racket.string_bed.stringing_tension.value
    first, other = (load_racket(name, f"{tension:.10g}") for name in RACKETS)
    if racket.string_bed.stiffness.value != first.string_bed.stiffness.value:
        other = first
    springs = {
        key: getattr(other.string_bed, key)
        for key in ("initial_tension", "stiffness", "rim_factors", "springs")
    }
    return replace(
        racket,
        string_bed=replace(racket.string_bed, **springs),
        friction=other.friction,
    )
