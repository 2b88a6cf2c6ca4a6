"""The commands of `drake-racket identify` share what is here: progress, interruption, printing."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from drake_racket.cli.console import ending_on_signals, showing
from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory
from drake_racket.io.progress import Progress, Report
from drake_racket.store import OtherComputation

if TYPE_CHECKING:
    from drake_racket.identify.core.estimate import Estimate


def today() -> str:
    """Gives the date for the sources of a parameter file."""
    return date.today().isoformat()


def pairs(texts: Sequence[str] | None, key: str) -> dict[str, str]:
    """Gives NAME=TEXT options as a mapping.

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
    """Gives NAME=NUMBER options as a mapping; raises InputError as `pairs`, or for no number."""
    found = {}
    for name, text in pairs(texts, key).items():
        try:
            found[name] = float(text)
        except ValueError:
            raise InputError(f"{key} {name}", text, "a number") from None
    return found


def names(text: str | None) -> list[str] | None:
    """Gives names separated by commas; None stays None."""
    return None if text is None else [name.strip() for name in text.split(",")]


def prepare(out: Path, fresh: bool) -> Path:
    """Checks the directory and returns that of its checkpoint, emptied if `fresh`.

    Raises:
        InputError: it cannot be written.

    """
    from drake_racket.identify.report.outputs import CHECKPOINT

    check_directory(out, "--out")
    checkpoint = out / CHECKPOINT
    if fresh and checkpoint.is_dir():
        shutil.rmtree(checkpoint)
    return checkpoint


@contextmanager
def running(out: Path, unit: str, scale: float = 1.0, *, kept: bool = True) -> Iterator[Report]:
    """Shows part done and current RMS; an interruption ends with one line that says how to go on.

    Args:
        unit, scale: of the RMS as it is shown.
        kept: the fit keeps a checkpoint in `out`.

    """

    def text(progress: Progress) -> str:
        done = 100.0 * progress.done / progress.total
        rms = math.inf if progress.rms is None else scale * progress.rms
        return f"{done:.0f} % done, RMS {rms:.4g} {unit}"

    go_on = f"what is done is in {out}: the same command goes on from there"
    if not kept:
        go_on = "nothing is kept: the same command begins anew"
    try:
        with ending_on_signals(go_on), showing(text) as report:
            yield report
    except InputError as error:
        if error.key != "checkpoint" and not isinstance(error, OtherComputation):
            raise
        raise InputError(error.key, error.value, f"{error.allowed}; or --fresh") from None


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
