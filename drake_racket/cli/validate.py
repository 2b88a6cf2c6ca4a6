"""`drake-racket validate` sets the model against every published number."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from drake_racket.cli.console import ending_on_signals, new_console, showing
from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory
from drake_racket.io.progress import Progress


def validate(
    out: Annotated[Path, typer.Option(help="Directory for the report, its figures and data.")],
    only: Annotated[
        list[str] | None, typer.Option(help="A section to compute (again and again for several).")
    ] = None,
    coarse: Annotated[
        bool, typer.Option("--coarse", help="Few points and speeds, for a first look.")
    ] = False,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Compute sections anew that are finished in OUT.")
    ] = False,
    workers: Annotated[int, typer.Option(help="Processes to share the impacts.")] = 2,
) -> None:
    """Compares the model with every published number and writes a report. Takes a few minutes.

    An interrupted run goes on where it stopped when it is started again with the same options.
    """
    from drake_racket.pool import check_workers
    from drake_racket.validation import SECTIONS
    from drake_racket.validation import validate as run_validation
    from drake_racket.validation.outcome import Plan

    for name in only or []:
        if name not in SECTIONS:
            raise InputError("--only", name, ", ".join(SECTIONS))
    check_workers(workers)
    check_directory(out, "--out")
    plan = Plan.coarse(workers) if coarse else Plan(workers=workers)
    kept = f"finished sections are in {out}: the same command goes on from there"
    with ending_on_signals(kept), showing(_text) as report:
        rows = run_validation(out, only=only or [], plan=plan, fresh=fresh, progress=report)
    _print_verdicts(rows, out)


def _text(progress: Progress) -> str:
    return f"{progress.done:g} of {progress.total:g}"


def _print_verdicts(rows: list[Any], out: Path) -> None:
    console = new_console()
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("quantity", "model", "verdict"):
        table.add_column(column, no_wrap=column != "quantity", overflow="fold")
    for row in rows:
        if row.verdict == "not comparable":
            continue
        unit = "" if row.published.unit == "1" else f" {row.published.unit}"
        mark = "yellow" if row.verdict == "differs" else "green"
        table.add_row(
            escape(row.published.quantity), f"{row.model:.4g}{unit}", f"[{mark}]{row.verdict}[/]"
        )
    console.print(table)
    for verdict in ("agrees", "differs", "not comparable"):
        console.print(f"{sum(row.verdict == verdict for row in rows)} {verdict}")
    for name in ("report.md", "report.html", "rows.csv", "rows.json"):
        console.print(f"wrote {escape(str(out / name))}")
