"""What the commands of `drake-racket identify` share: progress, interruption, printing."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory

if TYPE_CHECKING:
    from drake_racket.identify.core.estimate import Estimate

Report = Callable[[float, float], None]

LINE_EVERY = 5.0
"""Seconds between lines of progress where there is no terminal."""


def today() -> str:
    """The date for the sources of a parameter file."""
    return date.today().isoformat()


def pairs(texts: Sequence[str] | None, key: str) -> dict[str, str]:
    """NAME=TEXT options as a mapping.

    Raises:
        InputError: one without `=`, or a name twice.

    """
    found: dict[str, str] = {}
    for text in texts or []:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or name.strip() in found:
            raise InputError(key, text, "NAME=VALUE, each name once")
        found[name.strip()] = value.strip()
    return found


def numbers(texts: Sequence[str] | None, key: str) -> dict[str, float]:
    """NAME=NUMBER options as a mapping; raises InputError as `pairs`, or for no number."""
    found = {}
    for name, text in pairs(texts, key).items():
        try:
            found[name] = float(text)
        except ValueError:
            raise InputError(f"{key} {name}", text, "a number") from None
    return found


def names(text: str | None) -> list[str] | None:
    """Names separated by commas; None stays None."""
    return None if text is None else [name.strip() for name in text.split(",")]


def prepare(out: Path, fresh: bool) -> Path:
    """Checks the directory and returns that of its checkpoint, emptied if `fresh`.

    Raises:
        InputError: it cannot be written.

    """
    from drake_racket.identify.report.outputs import JOURNAL

    check_directory(out, "--out")
    journal = out / JOURNAL
    if fresh and journal.is_dir():
        shutil.rmtree(journal)
    return journal


@contextmanager
def running(out: Path, unit: str, scale: float = 1.0, *, kept: bool = True) -> Iterator[Report]:
    """Shows part done and current RMS; an interruption ends with status 130 and says how to go on.

    Args:
        unit, scale: of the RMS as it is shown.
        kept: the fit keeps a journal in `out`.

    """
    try:
        with _shown(unit, scale) as report:
            yield report
    except KeyboardInterrupt:
        text = f"what is done is in {out}: the same command goes on from there"
        if not kept:
            text = "nothing is kept: the same command begins anew"
        print(f"drake-racket: interrupted; {text}", file=sys.stderr)
        raise typer.Exit(130) from None
    except InputError as error:
        if "journal" not in error.key and "journal" not in error.allowed:
            raise
        raise InputError(error.key, error.value, f"{error.allowed}; or --fresh") from None


@contextmanager
def _shown(unit: str, scale: float) -> Iterator[Report]:
    if not sys.stderr.isatty():
        last = [time.monotonic()]

        def line(done: float, rms: float) -> None:
            if time.monotonic() - last[0] >= LINE_EVERY:
                last[0] = time.monotonic()
                text = f"{100.0 * done:.0f} % done, RMS {scale * rms:.4g} {unit}"
                print(f"drake-racket: {text}", file=sys.stderr, flush=True)

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("fitting"),
        BarColumn(),
        TextColumn("RMS {task.fields[rms]}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("fitting", total=1.0, rms="-")

        def report(done: float, rms: float) -> None:
            bar.update(task, completed=done, rms=f"{scale * rms:.4g} {unit}")

        yield report


def show(
    found: Mapping[str, Estimate],
    rms: str,
    warnings: Iterable[str],
    paths: Iterable[Path],
) -> None:
    """Prints estimates, RMS, warnings and what was written."""
    from rich.markup import escape
    from rich.table import Table

    from drake_racket.cli.console import new_console
    from drake_racket.identify.report.parameter_file import interval_text

    console = new_console()
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("parameter", "estimate", "unit", ""):
        table.add_column(column, no_wrap=True)
    for name, estimate in found.items():
        table.add_row(name, f"{estimate.value:.6g}", estimate.unit, interval_text(estimate))
    console.print(table)
    console.print(f"RMS difference: {rms}")
    for text in warnings:
        console.print(f"[yellow]warning:[/] {escape(text)}")
    for path in paths:
        console.print(f"wrote {escape(str(path))}")
