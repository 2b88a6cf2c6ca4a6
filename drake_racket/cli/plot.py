"""`drake-racket plot` draws the figures of one log."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from drake_racket.cli.console import new_console
from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory, directory_error

_FORMATS = ("png", "pdf", "svg")


def plot(
    log: Annotated[
        Path,
        typer.Argument(
            metavar="LOG", help="A time history: .nc, .csv, .parquet or .sto, as impact writes it."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Directory for the figures.")],
    picture: Annotated[str, typer.Option("--format", help="png, pdf or svg.")] = "png",
) -> None:
    """Draws a log: contact force, string-bed, energy, vibration, loads on hand and joints.

    Needs the log alone, not the parameter files of its run.
    """
    from drake_racket.io.files import figure_bytes, replace_file
    from drake_racket.plots.log.figures import LOG_FIGURES, check_log
    from drake_racket.results.formats import racket_of, read_history

    if picture not in _FORMATS:
        raise InputError("--format", picture, ", ".join(_FORMATS))
    history = read_history(log)
    check_log(history, str(log))
    if "racket" in history.attrs:
        racket_of(history, str(log))  # refused now, before anything is written
    check_directory(out, "--out")
    missing = {figure.name: figure.lacks(history) for figure in LOG_FIGURES}
    drawn = {  # all of them before any is written
        figure.name: figure_bytes(figure.draw(history), picture)
        for figure in LOG_FIGURES
        if not missing[figure.name]
    }
    console = new_console()
    for name, reason in missing.items():
        if reason:
            console.print(f"no {name}: {escape(reason)}")
            continue
        path = out / f"{name}.{picture}"
        try:
            out.mkdir(parents=True, exist_ok=True)
            replace_file(path, partial(Path.write_bytes, data=drawn[name]))
        except OSError as error:
            raise directory_error(out, error, "--out") from None
        console.print(f"wrote {escape(str(path))}")
