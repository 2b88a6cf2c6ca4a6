"""`drake-racket identify spin` fits friction and shear to rebound angles and spins."""

from __future__ import annotations

from typing import Annotated

import typer

from drake_racket.cli.identify.options import (
    Ball,
    Begin,
    Fresh,
    Name,
    Out,
    Racket,
    Rescale,
    Seed,
    Starts,
    Table,
    Tension,
    Workers,
)
from drake_racket.cli.identify.run import names, numbers, prepare, running, show, today


def spin(
    file: Table,
    out: Out,
    racket: Racket = "tour",
    tension: Tension = "low",
    ball: Ball = "penn_titanium",
    free: Annotated[
        str | None, typer.Option(help="mu,kt,ct (default), chi; mu1,mu2.. for groups of points.")
    ] = None,
    begin: Begin = None,
    rescale: Rescale = False,
    starts: Starts = 4,
    seed: Seed = 0,
    workers: Workers = 1,
    name: Name = None,
    fresh: Fresh = False,
) -> None:
    """Fits friction, shear stiffness and damping to rebound angles and spins, head clamped."""
    from drake_racket.identify.ball.spins import read_spins
    from drake_racket.identify.ball.surface import FREE, fit_surface
    from drake_racket.identify.core.problem import check_count
    from drake_racket.identify.core.search import Search
    from drake_racket.identify.report.spin import write_surface_fit
    from drake_racket.parameters.ball import load_ball
    from drake_racket.parameters.racket import load_racket

    for key, value, least in (("starts", starts, 1), ("seed", seed, 0), ("workers", workers, 1)):
        check_count(f"--{key}", value, least)
    table = read_spins(file)
    known = load_racket(racket, tension), load_ball(ball)
    first = numbers(begin, "--start")
    checkpoint = prepare(out, fresh)
    with running(out, "(degrees and rpm)") as report:
        fit = fit_surface(
            table,
            *known,
            free=names(free) or FREE,
            start=first,
            options=Search(starts=starts, seed=seed, workers=workers, rescale=rescale),
            checkpoint=checkpoint,
            progress=report,
        )
    paths = write_surface_fit(fit, out, today(), name=name)
    rms = f"{fit.result.residual_sigma:.3g} standard deviations"
    show(fit.estimates, rms, fit.warnings, paths)
