"""`drake-racket customise` adds masses to a racket and shows what they change."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from drake_racket.cli.case_options import BallFile, Settings, with_options
from drake_racket.cli.console import ending_on_signals, new_console, showing
from drake_racket.cli.rackets.files import check_paths, is_file, stringing, write_rackets
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Progress
from drake_racket.io.units import measure

if TYPE_CHECKING:
    from drake_racket.compare.assessment import Assessment
    from drake_racket.parameters.racket import AddedMass, RacketParameters
    from drake_racket.parameters.scenario import Scenario

_BY = "drake-racket customise"


def customise(
    racket: Annotated[str, typer.Argument(help="tour, recreational, or a racket's file (YAML).")],
    add: Annotated[
        list[str] | None,
        typer.Option(help="A mass at an hour of the rim, butt, tip or a distance: 5g@3, 10g@20cm."),
    ] = None,
    target_mass: Annotated[str | None, typer.Option(help="Wanted, with its unit: 330g.")] = None,
    target_balance: Annotated[str | None, typer.Option(help="Wanted: 32.5cm.")] = None,
    target_swingweight: Annotated[str | None, typer.Option(help="Wanted (kg cm²): 330.")] = None,
    target_twistweight: Annotated[str | None, typer.Option(help="Wanted (kg cm²): 15.")] = None,
    places: Annotated[
        str | None,
        typer.Option("--at", help="Where masses for targets may go: butt,12,3+9 (pairs with +)."),
    ] = None,
    tension: Annotated[
        str, typer.Option(help="Of a shipped racket: low, high, 280 (N), 25kg, 55lb.")
    ] = "low",
    name: Annotated[str | None, typer.Option(help="Of the new racket.")] = None,
    title: Annotated[str | None, typer.Option(help="Of the new racket.")] = None,
    ball: BallFile = None,
    settings: Settings = None,
    out: Annotated[
        Path, typer.Option(help="The new file (.yaml), or the directory that it goes to.")
    ] = Path(),
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object (SI units) and nothing else.")
    ] = False,
    static: Annotated[
        bool, typer.Option("--static", help="No impacts: mass, moments and frequencies alone.")
    ] = False,
) -> None:
    """Adds lead to a racket: what to stick where for a target, and what it changes.

    Masses for targets are the least that do.
    """
    from drake_racket.cases.case import resolve
    from drake_racket.parameters.racket import load_racket
    from drake_racket.parameters.scenario import Scenario
    from drake_racket.plant.customise import PLACES, customised

    base = resolve(with_options(Scenario(), settings, ball), "options").scenario
    before = load_racket(racket, stringing(tension))
    given = {
        "mass": target_mass,
        "balance": target_balance,
        "swingweight": target_swingweight,
        "twistweight": target_twistweight,
    }
    targets = {key: _target(key, text) for key, text in given.items() if text is not None}
    if not add and not targets:
        raise InputError("--add", "nothing", "a mass to add (5g@3), or a target")
    if places is not None and not targets:
        raise InputError("--at", places, "together with a target")
    where = [p.strip() for p in places.split(",")] if places else list(PLACES)
    pairs = [_pair(text) for text in add or []]
    after = customised(before, pairs, targets, places=where, name=name, title=title)
    path = out if is_file(out) else out / f"{after.name}.yaml"
    check_paths([path], _BY)
    added = after.added[len(before.added) :]
    if not as_json:
        _show_masses(added)
    both = [before, after]
    values = [_static(r) for r in both] if static else _assess(both, base, quiet=as_json)
    write_rackets([after], [path], _BY)
    if as_json:
        print(json.dumps(_object(added, values, path), allow_nan=False))
        return
    _print(values)
    new_console().print(f"wrote {escape(str(path))}")


def _target(key: str, text: str) -> float:
    unit, bare = {
        "mass": ("kg", None),
        "balance": ("m", None),
        "swingweight": ("kg*m^2", "kg cm^2"),
        "twistweight": ("kg*m^2", "kg cm^2"),
    }[key]
    number = measure(f"--target-{key}", text, unit, bare=bare)
    if not number > 0.0:
        raise InputError(f"--target-{key}", text, "more than 0")
    return number


def _pair(text: str) -> tuple[str, str]:
    mass, sign, at = text.partition("@")
    if not sign or not at.strip():
        raise InputError("--add", text, "a mass and a place: 5g@3, 10g@butt, 4g@20cm")
    return mass.strip(), at.strip()


def _object(
    added: tuple[AddedMass, ...], values: list[dict[str, float]], path: Path
) -> dict[str, Any]:
    """What was added, and the numbers before and after with their units, SI."""
    from drake_racket.compare.numbers import BY_NAME

    before, after = values
    return {
        "added": [dataclasses.asdict(one) for one in added],
        "before": before,
        "after": after,
        "units": {name: BY_NAME[name].unit for name in before},
        "file": str(path),
    }


def _show_masses(added: tuple[AddedMass, ...]) -> None:
    console = new_console()
    if not added:
        console.print("nothing to add: the racket has these numbers already")
    for one in added:
        mass, at = 1e3 * one.mass, escape(one.at)
        place = f"{at} o'clock" if at.isdigit() else at
        console.print(f"added {mass:.3g} g at {place}")


def _static(racket: RacketParameters) -> dict[str, float]:
    from drake_racket.compare.assessment import static_numbers

    return static_numbers(racket)


def _assess(
    rackets: list[RacketParameters], base: Scenario, *, quiet: bool
) -> list[dict[str, float]]:
    from drake_racket.compare.assessment import assess

    with (
        ending_on_signals("nothing was written"),
        showing(_text, quiet=quiet, lines=False) as report,
    ):
        found: list[Assessment] = [assess(r, base=base, progress=report) for r in rackets]
    return [dict(one.values) for one in found]


def _text(progress: Progress) -> str:
    return f"{progress.done:g} of {progress.total:g}"


def _print(values: list[dict[str, float]]) -> None:
    from drake_racket.compare.numbers import NUMBERS

    before, after = values
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("", "before", "after", "change"):
        table.add_column(heading, justify="right" if heading else "left")
    for number in NUMBERS:
        if number.name in before:
            old, new = before[number.name], after[number.name]
            change = number.format(new - old)
            table.add_row(
                f"{number.text} {escape(number.shown)}".rstrip(),
                number.format(old),
                number.format(new),
                ("+" if new > old else "") + change,
            )
    new_console().print(table)
