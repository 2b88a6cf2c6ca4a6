"""`drake-racket identify ball` and `identify frame` are the fits on the bench."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drake_racket.cli.case_options import in_unit
from drake_racket.cli.identify.options import Ball, Name, Out, Racket, Seed, Starts, Tension
from drake_racket.cli.identify.run import running, show, today
from drake_racket.io.errors import InputError


def ball(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Table of force records and speeds (CSV).")
    ],
    out: Out,
    ball: Ball = "penn_titanium",
    mass: Annotated[
        float | None,
        typer.Option(help="Of the balls, kg, where the table has none.", parser=in_unit("kg")),
    ] = None,
    speed_sigma: Annotated[
        float,
        typer.Option(help="Standard deviation of a measured speed, m/s.", parser=in_unit("m/s")),
    ] = 0.1,
    group_width: Annotated[
        float,
        typer.Option(
            help="Impacts closer than this share one kb and cb, m/s.", parser=in_unit("m/s")
        ),
    ] = 1.0,
    speed_low: Annotated[
        float | None, typer.Option(help="Lowest speed of the law, m/s.", parser=in_unit("m/s"))
    ] = None,
    speed_high: Annotated[
        float | None, typer.Option(help="Highest speed, m/s.", parser=in_unit("m/s"))
    ] = None,
    starts: Starts = 1,
    seed: Seed = 0,
    name: Name = None,
) -> None:
    """Fits the ball's stiffness and damping over speed to force histories on a force plate."""
    from drake_racket.identify.ball.fit import fit_ball, read_ball_impacts
    from drake_racket.identify.report.bench import write_ball_fit
    from drake_racket.io.files import check_directory
    from drake_racket.parameters.ball import load_ball

    known = load_ball(ball)
    records = read_ball_impacts(file)
    check_directory(out, "--out")
    with running(out, "N", kept=False) as report:
        fit = fit_ball(
            records,
            known.mass.value if mass is None else mass,
            speed_sigma=speed_sigma,
            group_width=group_width,
            speed_low=speed_low,
            speed_high=speed_high,
            starts=starts,
            seed=seed,
            progress=report,
        )
    paths = write_ball_fit(fit, known, file, out, today(), name=name)
    show(fit.fields(), f"{fit.rms:.4g} N", fit.warnings, paths)


def frame(
    out: Out,
    in_plane: Annotated[
        list[Path] | None, typer.Option(help="A strike in the plane (CSV; again and again).")
    ] = None,
    out_of_plane: Annotated[
        list[Path] | None, typer.Option(help="A strike out of the plane (CSV; again and again).")
    ] = None,
    racket: Racket = "tour",
    tension: Tension = "low",
    place: Annotated[
        float | None,
        typer.Option(help="Of hammer and accelerometer, m from the butt.", parser=in_unit("m")),
    ] = None,
    drake_passes: Annotated[
        int, typer.Option(help="Corrections by Drake's racket; 0: linear model only.")
    ] = 2,
    starts: Starts = 1,
    seed: Seed = 0,
    name: Name = None,
) -> None:
    """Fits the frame joint's stiffness and damping to hammer force and acceleration."""
    from drake_racket.identify.frame.fit import fit_frame, read_hammer_record
    from drake_racket.identify.report.bench import write_frame_fit
    from drake_racket.io.files import check_directory
    from drake_racket.parameters.racket import load_racket

    files = {"in_plane": in_plane or [], "out_of_plane": out_of_plane or []}
    if not any(files.values()):
        raise InputError("--in-plane, --out-of-plane", "no file", "one strike or more")
    known = load_racket(racket, tension)
    strikes = {d: [read_hammer_record(p) for p in paths] for d, paths in files.items() if paths}
    check_directory(out, "--out")
    fits = {}
    with running(out, "m/s^2", kept=False) as report:
        for direction, records in strikes.items():
            fits[direction] = fit_frame(
                records,
                known,
                direction,
                place,
                drake_passes=drake_passes,
                starts=starts,
                seed=seed,
                progress=report,
            )
    given = [path for paths in files.values() for path in paths]
    paths = write_frame_fit(fits, known, given, out, today(), name=name)
    found = {
        f"{n} ({d.replace('_', ' ')})": e for d, f in fits.items() for n, e in f.fields().items()
    }
    rms = ", ".join(f"{f.record_rms:.4g} m/s^2 {d.replace('_', ' ')}" for d, f in fits.items())
    show(found, rms, [text for f in fits.values() for text in f.warnings], paths)
