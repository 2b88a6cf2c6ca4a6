"""`drake-racket identify impacts` fits any parameters to numbers measured on whole impacts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from drake_racket.cli.identify.options import (
    Fresh,
    Out,
    Profiles,
    Rescale,
    Seed,
    Starts,
    Table,
    Workers,
)
from drake_racket.cli.identify.run import prepare, running, show, today
from drake_racket.io.errors import InputError


def impacts(
    file: Table,
    out: Out,
    free: Annotated[
        list[str],
        typer.Option(
            "--free", help="KEY or KEY=LOW:HIGH to fit, in the key's unit (again and again)."
        ),
    ],
    scenario: Annotated[
        str | None,
        typer.Option(help="A scenario file (YAML), or backhand: what the table does not say."),
    ] = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE of the scenario (again and again).")
    ] = None,
    profiles: Profiles = False,
    rescale: Rescale = False,
    starts: Starts = 1,
    seed: Seed = 0,
    workers: Workers = 1,
    fresh: Fresh = False,
) -> None:
    """Fits parameters to rebound speeds, angles, times and accelerations of any impacts.

    The table has a column for each key that its impacts differ in (speed, offset_x, support), and
    one for each output that was measured, with its standard deviation (rebound_speed_sd).
    """
    from drake_racket.cases.case import load_scenario, resolve
    from drake_racket.cases.keys import with_settings
    from drake_racket.identify.core.search import Search
    from drake_racket.identify.impacts.fit import fit_impacts
    from drake_racket.identify.impacts.table import read_measured_impacts
    from drake_racket.identify.report.impacts import write_impacts
    from drake_racket.parameters.scenario import Scenario

    base = Scenario() if scenario is None else load_scenario(scenario)
    base = resolve(with_settings(base, set_ or [])).scenario
    data = read_measured_impacts(file, base)
    bounds = _bounds(free)
    options = Search(starts=starts, seed=seed, workers=workers, rescale=rescale)
    checkpoint = prepare(out, fresh)
    unit = "sd" if data.sigma is not None else data.outputs[0].units
    with running(out, unit) as report:
        fit = fit_impacts(
            data,
            base,
            bounds,
            options=options,
            profiles=profiles,
            checkpoint=checkpoint,
            progress=report,
        )
    paths = write_impacts(fit, out, today())
    rms = f"{fit.result.rms:.4g} {fit.result.residual_unit}"
    show(fit.estimates, rms, fit.warnings, paths)


def _bounds(texts: Sequence[str]) -> dict[str, tuple[float, float] | None]:
    """KEY or KEY=LOW:HIGH options as a mapping."""
    found: dict[str, tuple[float, float] | None] = {}
    for text in texts:
        name, equals, span = (part.strip() for part in text.partition("="))
        if not name or name in found:
            raise InputError("--free", text, "KEY or KEY=LOW:HIGH, each key once")
        found[name] = None
        if equals:
            low, _, high = span.partition(":")
            try:
                found[name] = (float(low), float(high))
            except ValueError:
                raise InputError(f"--free {name}", span, "LOW:HIGH, two numbers") from None
    return found
