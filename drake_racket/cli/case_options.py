"""Has the options that every command with impacts takes: `--set`, `--ball`, numbers with units."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

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
BallFile = Annotated[str | None, typer.Option(help="penn_titanium, or a ball's file (YAML).")]


def number(key: str, text: str | None, unit: str) -> float | None:
    """Gives an option's number in `unit`, which it has where it names none; None stays None."""
    if text is None:
        return None
    try:
        return float(text)  # what is not finite the scenario refuses, by its key
    except ValueError:
        pass
    try:
        return measure(key, text, unit, bare="")
    except InputError as error:
        raise typer.BadParameter(
            f"got {text!r}; allowed: {error.allowed}", param_hint=key
        ) from None


def with_options(
    scenario: Scenario, settings: Sequence[str] | None, ball: str | None = None
) -> Scenario:
    """Gives a scenario with `--ball` and `--set`, not checked; raises InputError."""
    from drake_racket.sweep.keys import with_settings

    if ball is not None:
        scenario = dataclasses.replace(scenario, ball=ball)
    return with_settings(scenario, settings) if settings else scenario
