"""`drake-racket new` makes a racket's file of what a shop prints."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from drake_racket.cli.console import new_console, working
from drake_racket.cli.rackets.files import check_paths, is_file, write_rackets
from drake_racket.cli.rackets.specs_table import specs_table
from drake_racket.io.errors import InputError

_BY = "drake-racket new"


def new(
    name: Annotated[
        str | None, typer.Argument(help="Of the racket: letters, digits and _.")
    ] = None,
    mass: Annotated[str | None, typer.Option(help="Strung, with its unit: 320g, 11.3oz.")] = None,
    balance: Annotated[
        str | None, typer.Option(help="Strung, from the butt, with its unit: 33cm, 12.9in.")
    ] = None,
    swingweight: Annotated[
        str | None, typer.Option(help="Strung, about 4 inches from the butt (kg cm²): 320.")
    ] = None,
    twistweight: Annotated[
        str | None, typer.Option(help="Strung (kg cm²): 14.2. Guessed if left out.")
    ] = None,
    head: Annotated[str | None, typer.Option(help="Area, with its unit: 98in2, 632cm2.")] = None,
    ra: Annotated[str | None, typer.Option(help="Flex on the RA scale: 65.")] = None,
    frequency: Annotated[
        str | None, typer.Option(help="Measured out-of-plane fundamental (Hz): 148.")
    ] = None,
    length: Annotated[str | None, typer.Option(help="With its unit (27in if left out).")] = None,
    tension: Annotated[
        str | None, typer.Option(help="Of stringing: 24kg, 53lb, 235 (N), low or high.")
    ] = None,
    pattern: Annotated[str | None, typer.Option(help="Mains x crosses: 16x19.")] = None,
    title: Annotated[str, typer.Option(help="What pictures and tables call it.")] = "",
    bed: Annotated[
        str, typer.Option(help="Whose strings: tour (if left out) or recreational.")
    ] = "",
    table: Annotated[
        Path | None, typer.Option(help="A CSV of many rackets, one a row, instead of a NAME.")
    ] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(help="Of the CSV, by its own name: --column 'mass=Static weight'."),
    ] = None,
    out: Annotated[
        Path, typer.Option(help="The file (.yaml) or the directory that it is written to.")
    ] = Path(),
) -> None:
    """Makes a racket of what a shop prints of it, strung. Says what is safe to ask of it.

    Example: drake-racket new mine --mass 320g --balance 33cm --swingweight 320 --twistweight 14.2
    --head 98in2 --ra 65
    """
    from drake_racket.parameters.specs.build import racket_from_specs
    from drake_racket.plant.properties import racket_properties

    given = {
        "mass": mass,
        "balance": balance,
        "swingweight": swingweight,
        "twistweight": twistweight,
        "head": head,
        "ra": ra,
        "frequency": frequency,
        "length": length,
    }
    if table is not None:
        numbers = [key for key, value in given.items() if value is not None]
        if name is not None or numbers or title:
            got = name or title or f"--{numbers[0]}"
            raise InputError("--table", got, "neither a NAME nor numbers beside a table")
        _many(table, column or [], bed, out)
        return
    if name is None:
        raise InputError("NAME", "nothing", "a racket's name, or --table FILE.csv")
    if column:
        raise InputError("--column", column[0], "together with --table")
    with working("solving"):
        racket = racket_from_specs(
            name, **given, tension=tension, pattern=pattern, title=title, bed=bed
        )
    path = out if is_file(out) else out / f"{name}.yaml"
    check_paths([path], _BY)
    write_rackets([racket], [path], _BY)
    console = new_console()
    console.print(f"[bold]{escape(racket.title)}[/]")
    with working("reading"):
        made_of = specs_table(racket, racket_properties(racket))
    console.print(made_of)
    for note in racket.notes:
        console.print(escape(note))
    shown = escape(str(path))
    console.print(f"wrote {shown}")
    console.print(f"[dim]next: drake-racket compare {shown} tour; drake-racket show {shown}[/]")


def _many(table: Path, column: list[str], bed: str, out: Path) -> None:
    from drake_racket.parameters.specs.table import rackets_from_table

    if is_file(out):
        raise InputError("--out", str(out), "a directory, for a table of rackets")
    columns = {}
    for text in column:
        key, sign, header = text.partition("=")
        if not sign or not header.strip():
            raise InputError("--column", text, "a key and a column of the table: mass=Weight")
        columns[key.strip()] = header.strip()
    with working("reading"):
        rackets = rackets_from_table(table, columns, bed)
    paths = [out / f"{racket.name}.yaml" for racket in rackets]
    check_paths(paths, _BY)
    with working("writing"):
        write_rackets(rackets, paths, _BY)
    console = new_console()
    for path in paths:
        console.print(f"wrote {escape(str(path))}")
    first = rackets[0]
    for note in first.notes[:2]:
        console.print(f"[dim]{escape(note)}[/]")
