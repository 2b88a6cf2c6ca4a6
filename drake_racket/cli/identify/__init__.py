"""`drake-racket identify` fits the model's parameters to measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drake_racket.cli.case_options import in_unit
from drake_racket.cli.identify import bench, distribution, impacts, spin
from drake_racket.cli.identify.options import (
    Ball,
    Begin,
    Evaluations,
    Fresh,
    KeepRepeats,
    Method,
    Name,
    Out,
    Polish,
    Profiles,
    Racket,
    Rescale,
    Seed,
    Select,
    SpeedSigma,
    Starts,
    Table,
    Temperature,
    Tension,
    Workers,
)
from drake_racket.cli.identify.run import names, numbers, pairs, prepare, running, show, today
from drake_racket.io.errors import InputError

if TYPE_CHECKING:
    from drake_racket.identify.core.search import Search
    from drake_racket.identify.strings.angle_table import AngleTable
    from drake_racket.identify.strings.restitution_table import RestitutionTable

app = typer.Typer(
    help="Fits parameters of racket and ball to measurements (CSV) and writes a parameter file.",
    no_args_is_help=True,
)
for command in (bench.ball, bench.frame, distribution.distribution, impacts.impacts, spin.spin):
    app.command()(command)


@app.command()
def strings(
    file: Table,
    out: Out,
    racket: Racket = "tour",
    tension: Tension = "low",
    ball: Ball = "penn_titanium",
    free: Annotated[
        str | None, typer.Option(help="Parameters to fit: T0,k1,... (default: all).")
    ] = None,
    begin: Begin = None,
    span: Annotated[
        float | None,
        typer.Option(help="Bounds: the start divided and multiplied by this (10; annealing 3)."),
    ] = None,
    select: Select = None,
    keep_repeats: KeepRepeats = False,
    speed_sigma: SpeedSigma = None,
    rescale: Rescale = False,
    profiles: Profiles = False,
    method: Method = "least-squares",
    starts: Starts = 4,
    seed: Seed = 0,
    workers: Workers = 1,
    evaluations: Evaluations = 20_000,
    temperature: Temperature = 500.0,
    polish: Polish = False,
    name: Name = None,
    fresh: Fresh = False,
) -> None:
    """Fits tension, stiffnesses and rim factors of the strings to restitution, head clamped.

    An interrupted fit goes on where it stopped when the command is given again.
    """
    from drake_racket.identify.report.outputs import write_string_bed
    from drake_racket.identify.strings.string_bed import fit_string_bed
    from drake_racket.parameters.ball import load_ball
    from drake_racket.parameters.racket import load_racket

    options = _options(
        method=method,
        starts=starts,
        seed=seed,
        workers=workers,
        evaluations=evaluations,
        temperature=temperature,
        polish=polish,
        rescale=rescale,
    )
    table = _restitution(file, select, keep_repeats, speed_sigma)
    known = load_racket(racket, tension), load_ball(ball)
    wanted, first = names(free), numbers(begin, "--start")
    checkpoint = prepare(out, fresh)
    with running(out, "%", 100.0) as report:
        fit = fit_string_bed(
            table,
            *known,
            free=wanted,
            start=first,
            span=span,
            options=options,
            profiles=profiles,
            checkpoint=checkpoint,
            progress=report,
        )
    paths = write_string_bed(fit, out, today(), name=name)
    show(fit.estimates, f"{100.0 * fit.rms:.4g} % of restitution", fit.warnings, paths)


@app.command()
def tension(
    file: Table,
    out: Out,
    racket: Racket = "tour",
    tension: Tension = "low",
    ball: Ball = "penn_titanium",
    strung_at: Annotated[
        float | None,
        typer.Option(help="Stringing tension of the racket measured, N.", parser=in_unit("N")),
    ] = None,
    start: Annotated[
        float | None, typer.Option(help="T0 to begin at, N.", parser=in_unit("N"))
    ] = None,
    select: Select = None,
    keep_repeats: KeepRepeats = False,
    speed_sigma: SpeedSigma = None,
    rescale: Rescale = False,
    starts: Starts = 4,
    seed: Seed = 0,
    workers: Workers = 1,
    name: Name = None,
    fresh: Fresh = False,
) -> None:
    """Fits T0 alone, for a racket whose strings are known, strung at another tension."""
    from drake_racket.identify.report.outputs import write_string_bed
    from drake_racket.identify.strings.string_bed import fit_tension
    from drake_racket.parameters.ball import load_ball
    from drake_racket.parameters.racket import load_racket

    if strung_at is not None and not 50.0 <= strung_at <= 600.0:
        raise InputError("--strung-at", strung_at, "50 to 600 N")
    options = _options(starts=starts, seed=seed, workers=workers, rescale=rescale)
    table = _restitution(file, select, keep_repeats, speed_sigma)
    known = load_racket(racket, tension), load_ball(ball)
    checkpoint = prepare(out, fresh)
    with running(out, "%", 100.0) as report:
        fit = fit_tension(
            table, *known, start=start, options=options, checkpoint=checkpoint, progress=report
        )
    paths = write_string_bed(fit, out, today(), name=name, stringing_tension=strung_at)
    show(fit.estimates, f"{100.0 * fit.rms:.4g} % of restitution", fit.warnings, paths)


@app.command()
def friction(
    file: Table,
    out: Out,
    racket: Racket = "tour",
    tension: Tension = "low",
    ball: Ball = "penn_titanium",
    reading: Annotated[
        str, typer.Option("--friction-reading", help="velocity or displacement.")
    ] = "velocity",
    begin: Begin = None,
    select: Select = None,
    keep_repeats: KeepRepeats = False,
    rescale: Rescale = False,
    method: Method = "least-squares",
    starts: Starts = 4,
    seed: Seed = 0,
    workers: Workers = 1,
    evaluations: Evaluations = 2000,
    temperature: Temperature = 500.0,
    polish: Polish = False,
    name: Name = None,
    fresh: Fresh = False,
) -> None:
    """Fits friction coefficients to rebound angles of oblique impacts, head clamped."""
    from drake_racket.identify.report.outputs import write_friction
    from drake_racket.identify.strings.friction import fit_friction
    from drake_racket.parameters.ball import load_ball
    from drake_racket.parameters.racket import load_racket

    options = _options(
        method=method,
        starts=starts,
        seed=seed,
        workers=workers,
        evaluations=evaluations,
        temperature=temperature,
        polish=polish,
        rescale=rescale,
    )
    table = _angles(file, select, keep_repeats)
    known = load_racket(racket, tension), load_ball(ball)
    first = numbers(begin, "--start")
    checkpoint = prepare(out, fresh)
    with running(out, "deg") as report:
        fit = fit_friction(
            table,
            *known,
            start=first,
            reading=reading,
            options=options,
            checkpoint=checkpoint,
            progress=report,
        )
    paths = write_friction(fit, out, today(), name=name)
    show(fit.estimates, f"{fit.rms:.4g} deg", fit.warnings, paths)


def _options(**options: Any) -> Search:
    """The options of a search, checked under the names that they have on the command line."""
    from drake_racket.identify.core.annealing import check_temperature
    from drake_racket.identify.core.problem import check_count
    from drake_racket.identify.core.search import Search

    for key, least in (("starts", 1), ("seed", 0), ("workers", 1), ("evaluations", 1)):
        if key in options:
            check_count(f"--{key}", options[key], least)
    if "temperature" in options:
        check_temperature("--temperature", options["temperature"])
    return Search(**options)


def _restitution(
    file: Path, select: list[str] | None, keep_repeats: bool, speed_sigma: float | None
) -> RestitutionTable:
    from drake_racket.identify.strings.restitution_table import read_restitution

    table = read_restitution(file, select=pairs(select, "--select"))
    if not keep_repeats:
        table = table.averaged()
    return table if speed_sigma is None else table.with_speed_sigma(speed_sigma)


def _angles(file: Path, select: list[str] | None, keep_repeats: bool) -> AngleTable:
    from drake_racket.identify.strings.angle_table import read_angles

    table = read_angles(file, select=pairs(select, "--select"))
    return table if keep_repeats else table.averaged()
