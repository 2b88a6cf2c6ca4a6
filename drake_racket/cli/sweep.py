"""`drake-racket sweep` runs many impacts, with durable results."""

from __future__ import annotations

import importlib
import json
import logging
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drake_racket.cli.case_options import BallFile, Settings
from drake_racket.cli.console import ending_on_signals, showing
from drake_racket.io.errors import InputError
from drake_racket.io.extras import need_library
from drake_racket.io.progress import Progress

if TYPE_CHECKING:
    import xarray


def sweep(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A sweep (YAML).")],
    out: Annotated[Path, typer.Option(help="Directory for the results; a sweep in it goes on.")],
    workers: Annotated[int, typer.Option(help="Processes of this machine.")] = 1,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler, instead of own processes.")
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Delete the sweep that is in OUT and start anew.")
    ] = False,
    export: Annotated[
        bool,
        typer.Option("--export", help="Run nothing: write the results' files of what is finished."),
    ] = False,
    ball: BallFile = None,
    engine: Annotated[
        str | None, typer.Option(help="auto (compiled where it can), drake or compiled.")
    ] = None,
    settings: Settings = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print errors only.")] = False,
) -> None:
    """Runs a sweep of impacts. An interrupted one goes on with the same command."""
    from drake_racket.sweep import export_sweep, load_sweep, run_sweep

    if export and (fresh or scheduler is not None):
        raise InputError("--export", True, "neither --fresh nor --scheduler: it runs nothing")
    if scheduler is not None:
        need_library("distributed", "dask", "--scheduler", scheduler)
        _silence_dask()
    named = {"ball": ball, "engine": engine}
    given = [*(f"{k}={v}" for k, v in named.items() if v is not None), *(settings or [])]
    wanted = load_sweep(file, given)
    if export:
        dataset = export_sweep(wanted, out)
    else:
        kept = f"what is finished is in {out}: the same command goes on from there"
        with ending_on_signals(kept), showing(_text, quiet=quiet) as report:
            dataset = run_sweep(
                wanted,
                out,
                workers=workers,
                scheduler=scheduler,
                fresh=fresh,
                progress=report,
            )
    if not quiet:
        _print_summary(dataset, out)


def _silence_dask() -> None:
    """What Dask logs of a lost cluster, in many lines, this command says in one."""
    importlib.import_module("distributed")  # which gives its loggers their levels
    for name in list(logging.root.manager.loggerDict):
        if name.startswith("distributed"):
            logging.getLogger(name).setLevel(logging.CRITICAL)


def _text(progress: Progress) -> str:
    text = f"{progress.done} of {progress.total} cases"
    if progress.task != "running":
        return text
    if progress.failed:
        text += f", {progress.failed} failed"
    left = progress.time_left()
    return (
        text if left is None else f"{text}, {progress.rate():.3g} cases/s, {_duration(left)} left"
    )


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02d} min"
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"


def _print_summary(dataset: xarray.Dataset, out: Path) -> None:
    from collections import Counter

    from rich.markup import escape

    from drake_racket.cli.console import new_console
    from drake_racket.sweep.export import result_paths

    console = new_console()
    status = dataset["status"].to_numpy()
    failed = int((status == 1).sum())
    missing = int((status == 2).sum())
    left = f", {missing} missing" if missing else ""
    console.print(f"{status.size} cases, {failed} failed{left}")
    reasons = Counter(x for x in dataset["failure"].to_numpy().reshape(-1) if x)
    for reason, count in reasons.most_common(10):
        console.print(f"[yellow]failed:[/] {count} x {escape(reason)}")
    for text, count in json.loads(dataset.attrs["warnings"]).items():
        console.print(f"[yellow]warning:[/] {count} x {escape(text)}")
    if "comparison" in dataset.attrs:
        console.print(escape(json.loads(dataset.attrs["comparison"])["text"]))
    for path in result_paths(out):
        console.print(f"wrote {escape(str(path))}")
