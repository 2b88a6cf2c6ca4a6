"""`drake-racket identify distribution` calibrates how mass and stiffness lie along a frame."""

from __future__ import annotations

from typing import Annotated

import typer

from drake_racket.cli.identify.options import Name, Out, Racket, Tension
from drake_racket.cli.identify.run import pairs, show
from drake_racket.io.errors import InputError


def distribution(
    out: Out,
    measured: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=VALUE[+-SD]: mass=320g, second_frequency=420Hz+-5Hz (again and again)."
        ),
    ] = None,
    racket: Racket = "tour",
    tension: Tension = "low",
    name: Name = None,
) -> None:
    """Calibrates a frame of several segments from a whole racket's numbers."""
    import dataclasses

    from drake_racket.identify.frame.distribution import fit_distribution
    from drake_racket.identify.frame.whole_racket import MEASURED
    from drake_racket.identify.report.distribution import write_distribution_fit
    from drake_racket.io.files import check_directory
    from drake_racket.io.units import measure
    from drake_racket.parameters.racket import load_racket

    given: dict[str, tuple[float, float]] = {}
    for key, text in pairs(measured, "--measured").items():
        value, plus_minus, sd = text.partition("+-")
        if key not in MEASURED:
            raise InputError("--measured", key, ", ".join(MEASURED))
        unit, usual, _ = MEASURED[key]
        number = measure(f"--measured {key}", value.strip(), unit, bare="")
        if plus_minus:
            usual = measure(f"--measured {key}", sd.strip(), unit, bare="")
        given[key] = number, usual
    known = load_racket(racket, tension)
    check_directory(out, "--out")
    fit = fit_distribution(known, given)
    made = dataclasses.replace(fit.racket, name=name) if name else fit.racket
    paths = write_distribution_fit(dataclasses.replace(fit, racket=made), out)
    warnings = [f"not determined by what was measured: {', '.join(fit.open())}"] * bool(fit.open())
    a, b = fit.families["A"], fit.families["B"]
    misfit = sum(((m - v) / sd) ** 2 for v, sd, m in fit.measured.values())
    show(
        fit.fields(),
        f"{misfit:.3g} variances over all measurements (family A alone {a:.3g}, B alone {b:.3g})",
        warnings,
        paths,
    )
