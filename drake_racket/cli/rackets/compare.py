"""`drake-racket compare` sets rackets side by side: ball, swing, sweet spots, vibration, hand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape
from rich.table import Table

from drake_racket.cli.case_options import BallFile, Settings, in_unit, with_options
from drake_racket.cli.console import ending_on_signals, new_console, showing
from drake_racket.cli.rackets.files import stringing
from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory, directory_error
from drake_racket.io.progress import Progress

if TYPE_CHECKING:
    from drake_racket.compare.spread import Assessed
    from drake_racket.parameters.racket import RacketParameters


def compare(
    rackets: Annotated[
        list[str], typer.Argument(metavar="A B [C...]", help="tour, recreational, or files (YAML).")
    ],
    tension: Annotated[
        str, typer.Option(help="Of shipped rackets: low, high, 280 (N), 25kg, 55lb.")
    ] = "low",
    speed: Annotated[
        float,
        typer.Option(help="Of the ball at the nine points (m/s), 56mph.", parser=in_unit("m/s")),
    ] = 25.0,
    swing: Annotated[
        float,
        typer.Option(
            help="Rate that the racket turns with: 27 (rad/s), 260rpm.", parser=in_unit("rad/s")
        ),
    ] = 27.0,
    pivot: Annotated[
        float,
        typer.Option(help="From that axis to the butt: 0.2 (m), 20cm.", parser=in_unit("m")),
    ] = 0.2,
    ball_speed: Annotated[
        float, typer.Option(help="Of the ball that it meets (m/s), 22mph.", parser=in_unit("m/s"))
    ] = 10.0,
    ball: BallFile = None,
    settings: Settings = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory for the page (Markdown, HTML), table, figures.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the table as JSON (SI units) and nothing else.")
    ] = False,
) -> None:
    """Compares rackets: table, page and figures, with what inferred numbers leave open.

    Takes 2 s a racket with numba (the very first time half a minute), without it 20 s.
    """
    from drake_racket.cases.case import resolve
    from drake_racket.compare.assessment import Swing
    from drake_racket.compare.report import comparison_table, write_comparison
    from drake_racket.compare.spread import assess_with_spread
    from drake_racket.parameters.scenario import Scenario

    base = Scenario(speed=speed)
    base = resolve(with_options(base, settings, ball), "options").scenario
    wanted = Swing(swing, pivot, ball_speed)
    loaded = _load(rackets, tension)
    if out is not None:
        check_directory(out, "--out")
    with (
        ending_on_signals("nothing was written"),
        showing(_text, quiet=as_json, lines=False) as report,
    ):
        found = [
            assess_with_spread(racket, base=base, swing=wanted, progress=report)
            for racket in loaded
        ]
    written = []
    if out is not None:
        try:
            written = write_comparison(found, out, base, wanted)
        except OSError as error:
            raise directory_error(out, error, "--out") from None
    if as_json:
        print(json.dumps(comparison_table(found), allow_nan=False))
        return
    _print(found)
    console = new_console()
    for path in written:
        console.print(f"wrote {escape(str(path))}")


def _load(names: list[str], tension: str) -> list[RacketParameters]:
    """The rackets, each under a name of its own."""
    from drake_racket.compare.figures import MOST
    from drake_racket.parameters.racket import RACKETS, load_racket

    if not 2 <= len(names) <= MOST:
        raise InputError("rackets", f"{len(names)} rackets", f"2 to {MOST}")
    tension = stringing(tension)
    loaded: list[RacketParameters] = []
    for name in names:
        racket = load_racket(name, tension if name in RACKETS else "low")
        if racket.name in {other.name for other in loaded}:
            raise InputError("rackets", name, f"each racket once ({racket.name} is there already)")
        loaded.append(racket)
    return loaded


def _text(progress: Progress) -> str:
    return f"{progress.done:g} of {progress.total:g}"


def _print(rackets: list[Assessed]) -> None:
    from drake_racket.compare.report import difference, findings, known

    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("", overflow="fold")
    for found in rackets:
        table.add_column(found.racket.name, justify="right")
    for found in rackets[1:]:
        table.add_column(f"{found.racket.name} less first", justify="right")
    for number in known(rackets):
        cells = [number.format(a.nominal.values[number.name], a.sd[number.name]) for a in rackets]
        for found in rackets[1:]:
            change, sd = difference(rackets[0], found, number.name)
            cells.append(("+" if change > 0 else "") + number.format(change, sd))
        table.add_row(f"{number.text} {escape(number.shown)}".rstrip(), *cells)
    console = new_console()
    console.print(table)
    for line in findings(rackets):
        console.print(escape(line))
