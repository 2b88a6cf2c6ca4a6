"""Sets of measurements whose worth `identifiability` judges."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from drake_racket import InputError
from studies.identifiability.measurements import QUANTITIES, Design, Errors

BALL_CHOICES = ("held", "prior", "fitted")
"""kb and cb exactly known; known to `Errors.ball`; or fitted with the bed."""


@dataclass(frozen=True)
class Case:
    """A set of measurements to judge.

    Attributes:
        quantities: some of `QUANTITIES`.
        ball: one of BALL_CHOICES.

    """

    name: str
    quantities: tuple[str, ...] = ("restitution",)
    ball: str = "held"
    design: Design = field(default_factory=Design)
    errors: Errors = field(default_factory=Errors)

    def __post_init__(self) -> None:
        if not self.quantities or not set(self.quantities) <= set(QUANTITIES):
            raise InputError("quantities", list(self.quantities), ", ".join(QUANTITIES))
        if self.ball not in BALL_CHOICES:
            raise InputError("ball", self.ball, ", ".join(BALL_CHOICES))


def measurement_cases(
    design: Design | None = None, errors: Errors | None = None
) -> tuple[Case, ...]:
    """Restitution alone, with each other measurement, without it; the ball known or fitted."""
    design, errors = design or Design(), errors or Errors()
    first = "restitution"
    kinds = [
        ("restitution (published)", (first,), "held"),
        ("+ contact time", (first, "contact_time"), "held"),
        ("+ peak deflection", (first, "deflection"), "held"),
        ("+ static stiffness", (first, "static"), "held"),
        ("+ these three", (first, "contact_time", "deflection", "static"), "held"),
        ("+ static shape", (first, "static_shape"), "held"),
        ("static stiffness alone", ("static",), "held"),
        ("static shape alone", ("static_shape",), "held"),
        (f"restitution, ball to {100 * errors.ball:g} %", (first,), "prior"),
        ("restitution, ball fitted", (first,), "fitted"),
        ("+ contact time, ball fitted", (first, "contact_time"), "fitted"),
        ("+ static stiffness, ball fitted", (first, "static"), "fitted"),
        ("+ static shape, ball fitted", (first, "static_shape"), "fitted"),
    ]
    return tuple(Case(name, q, ball, design, errors) for name, q, ball in kinds)


def design_cases(errors: Errors | None = None) -> tuple[Case, ...]:
    """Restitution alone by other designs, with as many impacts as the published one (but one)."""
    errors = errors or Errors()
    published = Design()
    impacts = errors.repeats * len(published.points) * len(published.speeds)
    speeds: dict[str, tuple[float, ...]] = {
        "24 speeds, 18-33 m/s": tuple(np.linspace(18.0, 33.0, 24).tolist()),
        "6-18 m/s": tuple(np.linspace(6.0, 18.0, 6).tolist()),
        "6-33 m/s": tuple(np.linspace(6.0, 33.0, 6).tolist()),
        "18-50 m/s": tuple(np.linspace(18.0, 50.0, 6).tolist()),
        "33-50 m/s": tuple(np.linspace(33.0, 50.0, 6).tolist()),
    }
    designs = {"published: 6 speeds, 18-33 m/s": published}
    designs |= {name: replace(published, speeds=v) for name, v in speeds.items()}
    designs["left half and centre line"] = replace(published, points=(1, 2, 4, 5, 7, 8))
    designs["centre lines only"] = replace(published, points=(2, 4, 5, 6, 8))
    designs["corners and centre"] = replace(published, points=(1, 3, 5, 7, 9))
    cases = [
        Case(
            name,
            design=design,
            errors=replace(errors, repeats=impacts / len(design.points) / len(design.speeds)),
        )
        for name, design in designs.items()
    ]
    four = replace(errors, repeats=4.0 * errors.repeats)
    return (cases[0], Case("four times the impacts", errors=four), *cases[1:])
