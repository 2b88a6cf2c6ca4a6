"""`drake-racket plot` draws the figures of one log, or several logs over each other."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from drake_racket.cli.console import new_console, working
from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory, directory_error

if TYPE_CHECKING:
    import xarray

_FORMATS = ("png", "pdf", "svg")


def plot(
    logs: Annotated[
        list[Path],
        typer.Argument(
            metavar="LOG [LOG...]",
            help="Time histories: .nc, .csv, .parquet or .sto, as impact writes them.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="Directory for the figures.")],
    picture: Annotated[str, typer.Option("--format", help="png, pdf or svg.")] = "png",
) -> None:
    """Draws a log: contact force, string-bed, energy, vibration, loads on hand and joints, spin.

    Several logs are drawn over each other, on common scales. Needs the logs alone, not the
    parameter files of their runs.
    """
    from drake_racket.plots.log.figures import check_log
    from drake_racket.results.formats import racket_of, read_history

    if picture not in _FORMATS:
        raise InputError("--format", picture, ", ".join(_FORMATS))
    histories: dict[str, xarray.Dataset] = {}
    for path, label in zip(logs, labels(logs), strict=True):
        with working(f"reading {path.name}"):
            history = read_history(path)
        check_log(history, str(path))
        if "racket" in history.attrs:
            racket_of(history, str(path))  # refused now, before anything is written
        histories[label] = history
    check_directory(out, "--out")
    if len(logs) == 1:
        _draw_one(next(iter(histories.values())), out, picture)
    else:
        _draw_over_each_other(histories, out, picture)


def labels(paths: list[Path]) -> list[str]:
    """Tells how logs are called: by file, by directory where the files' names are one.

    Raises:
        InputError: a log twice, or more than fit one figure.

    """
    from drake_racket.plots.log.overlay import MOST

    if len(paths) > MOST:
        raise InputError("LOG", f"{len(paths)} logs", f"at most {MOST} over each other")
    resolved = [path.resolve() for path in paths]
    for i, path in enumerate(resolved):
        if path in resolved[:i]:
            raise InputError("LOG", paths[i], "each log once")
    stems = [path.stem for path in resolved]
    if len(set(stems)) == len(stems):
        return stems
    folders = [path.parent.name for path in resolved]
    return folders if len(set(folders)) == len(folders) else [str(path) for path in paths]


def _draw_one(history: xarray.Dataset, out: Path, picture: str) -> None:
    from drake_racket.io.files import figure_bytes, replace_file
    from drake_racket.plots.log.figures import LOG_FIGURES

    missing = {figure.name: figure.lacks(history) for figure in LOG_FIGURES}
    drawn: dict[str, bytes] = {}
    for figure in LOG_FIGURES:  # all of them before any is written
        if not missing[figure.name]:
            with working(f"drawing {figure.name}"):
                drawn[figure.name] = figure_bytes(figure.draw(history), picture)
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


def _draw_over_each_other(histories: dict[str, xarray.Dataset], out: Path, picture: str) -> None:
    from drake_racket.io.files import write_figure
    from drake_racket.plots.log.overlay import overlay_figure

    path = out / f"overlay.{picture}"
    try:
        with working("drawing"):
            out.mkdir(parents=True, exist_ok=True)
            write_figure(overlay_figure(histories), path)
    except OSError as error:
        raise directory_error(out, error, "--out") from None
    new_console().print(f"wrote {escape(str(path))}")
