"""`drake-racket sweep`: many impacts, with durable results."""

from __future__ import annotations

import importlib
import json
import logging
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from drake_racket.sweep.run import Progress

Report = Callable[["Progress"], None]

LINE_EVERY = 5.0
"""Seconds between lines of progress where there is no terminal."""


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
    quiet: Annotated[bool, typer.Option("--quiet", help="Print errors only.")] = False,
) -> None:
    """Runs a sweep of impacts. An interrupted one goes on with the same command."""
    from drake_racket.sweep import load_sweep, run_sweep

    if scheduler is not None:
        _silence_dask()
    wanted = load_sweep(file)
    try:
        with _progress(quiet) as report:
            dataset = run_sweep(
                wanted,
                out,
                workers=workers,
                scheduler=scheduler,
                fresh=fresh,
                progress=report,
            )
    except KeyboardInterrupt:
        text = f"interrupted; what is finished is in {out}: the same command goes on from there"
        print(f"drake-racket: {text}", file=sys.stderr)
        raise typer.Exit(130) from None
    if not quiet:
        _print_summary(dataset, out)


def _silence_dask() -> None:
    """What Dask logs of a lost cluster, in many lines, this command says in one."""
    if find_spec("distributed") is not None:
        importlib.import_module("distributed")  # which gives its loggers their levels
        for name in list(logging.root.manager.loggerDict):
            if name.startswith("distributed"):
                logging.getLogger(name).setLevel(logging.CRITICAL)


@contextmanager
def _progress(quiet: bool) -> Iterator[Report]:
    """A bar on a terminal, lines elsewhere, on standard error."""
    if quiet:
        yield lambda progress: None
    elif sys.stderr.isatty():
        with _bar() as report:
            yield report
    else:
        yield _Lines()


@contextmanager
def _bar() -> Iterator[Report]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[text]}"),
    )
    with Bar(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("checking", total=None, text="")

        def report(progress: Progress) -> None:
            bar.update(
                task,
                description=progress.phase,
                completed=progress.done,
                total=progress.total,
                text=_rate(progress),
            )

        yield report


class _Lines:
    """Prints a line every few seconds, and at the start and the end of the run."""

    def __init__(self) -> None:
        self._last = time.monotonic()
        self._phase = "checking"

    def __call__(self, progress: Progress) -> None:
        now = time.monotonic()
        ended = progress.phase == "running" and progress.done == progress.total
        if now - self._last < LINE_EVERY and progress.phase == self._phase and not ended:
            return
        self._last, self._phase = now, progress.phase
        text = f"{progress.phase}: {progress.done} of {progress.total} cases{_rate(progress)}"
        print(f"drake-racket: {text}", file=sys.stderr, flush=True)


def _rate(progress: Progress) -> str:
    left = progress.time_left()
    if progress.phase != "running":
        return ""
    failed = f", {progress.failed} failed" if progress.failed else ""
    if left is None:
        return failed
    return f"{failed}, {progress.rate():.3g} cases/s, {_duration(left)} left"


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02d} min"
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"


def _print_summary(dataset: Any, out: Path) -> None:
    from collections import Counter

    from rich.markup import escape

    from drake_racket.cli.console import new_console
    from drake_racket.sweep.export import result_paths

    console = new_console()
    status = dataset["status"].to_numpy()
    failed = int((status == 1).sum())
    console.print(f"{status.size} cases, {failed} failed")
    reasons = Counter(x for x in dataset["failure"].to_numpy().reshape(-1) if x)
    for reason, count in reasons.most_common(10):
        console.print(f"[yellow]failed:[/] {count} x {escape(reason)}")
    for text, count in json.loads(dataset.attrs["warnings"]).items():
        console.print(f"[yellow]warning:[/] {count} x {escape(text)}")
    for path in result_paths(out):
        console.print(f"wrote {escape(str(path))}")
