"""Has the options that every command with impacts takes: `--set`, `--ball`, numbers with units."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drake_racket.io.errors import InputError
from drake_racket.io.units import measure

if TYPE_CHECKING:
    from drake_racket.parameters.scenario import Scenario

Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="A key of the scenario or a parameter: speed=56mph, racket.head.mass=170g.",
    ),
]
BallFile = Annotated[
    str | None, typer.Option(help="penn_titanium, penn_titanium_slow (7-18 m/s), or a file (YAML).")
]


def in_unit(unit: str) -> Callable[[Any], float]:
    """Gives typer the parser of an option's number, which is in `unit` where it names none."""

    def number(text: Any) -> float:
        """Reads `30`, `30 m/s` or `67mph`; what is not finite its key's own check refuses."""
        if not isinstance(text, str):
            return float(text)
        try:
            return float(text)
        except ValueError:
            pass
        try:
            return measure("", text, unit, bare="")
        except InputError as error:
            raise typer.BadParameter(f"got {text!r}; allowed: {error.allowed}") from None

    number.__name__ = "NUMBER"  # what the help calls it
    return number


def with_options(
    scenario: Scenario, settings: Sequence[str] | None, ball: str | None = None
) -> Scenario:
    """Gives a scenario with `--ball` and `--set`, not checked; raises InputError."""
    from drake_racket.cases.keys import with_settings

    if ball is not None:
        scenario = dataclasses.replace(scenario, ball=ball)
    return with_settings(scenario, settings) if settings else scenario
