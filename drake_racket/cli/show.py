"""`drake-racket show` prints a racket's parameters and where they come from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from drake_racket.cli.console import new_console, working
from drake_racket.cli.rackets.specs_table import specs_table

if TYPE_CHECKING:
    from drake_racket.parameters.quantities import Assignment, Choice, Quantities, Quantity
    from drake_racket.parameters.racket import RacketParameters
    from drake_racket.plant.properties import RacketProperties


def show(
    racket: Annotated[str, typer.Argument(help="tour, recreational, or a parameter file.")],
    tension: Annotated[str, typer.Option(help="low, high, or a stringing tension in N.")] = "low",
    joint_reading: Annotated[
        str | None, typer.Option(help="by_axis or as_printed (default: the file's).")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object (SI units) and nothing else.")
    ] = False,
) -> None:
    """Prints a racket's parameters with their sources, and what follows from them."""
    import json

    with working("reading"):
        from drake_racket.parameters.ball import load_ball
        from drake_racket.parameters.quantities import sourced_fields
        from drake_racket.parameters.racket import load_racket
        from drake_racket.plant.properties import racket_properties

        parameters = load_racket(racket, tension, joint_reading=joint_reading)
        properties = racket_properties(parameters)
    if as_json:
        print(json.dumps(_object(parameters, properties), allow_nan=False))
        return
    console = new_console()
    console.print(f"[bold]{escape(parameters.title)}[/]")
    console.print(_properties_table(properties))
    if parameters.specs:
        console.print("[bold]Made of[/]")
        console.print(specs_table(parameters, properties))
    for added in parameters.added:
        console.print(f"added: {1e3 * added.mass:.4g} g at {escape(added.at)}")
    console.print(_parameter_table(parameters))
    console.print("[bold]Ball[/]")
    ball = load_ball()
    console.print(_parameter_table(ball))
    for note in parameters.notes:
        console.print(f"note: {escape(note)}")
    values = [*sourced_fields(parameters), *sourced_fields(ball, "ball")]
    inferred = [key for key, value in values if value.status == "inferred"]
    console.print(f"[bold]Inferred[/] ({len(inferred)}): " + ", ".join(inferred))


_UNITS = {
    "mass": "kg",
    "balance": "m",
    "swingweight": "kg*m^2",
    "twistweight": "kg*m^2",
    "spinweight": "kg*m^2",
    "frequency_out_of_plane": "Hz",
    "frequency_in_plane": "Hz",
}


def _object(racket: RacketParameters, properties: RacketProperties) -> dict[str, Any]:
    """The whole racket's numbers with their units, and the status of every number."""
    import dataclasses

    from drake_racket.parameters.quantities import sourced_fields

    p = properties
    frequencies = p.out_of_plane_frequency, p.in_plane_frequency
    values = (p.mass, p.balance, p.swingweight, p.twistweight, p.spinweight, *frequencies)
    statuses = dict.fromkeys(_UNITS, "calculated")
    for key, spec in (("out_of_plane", "frequency"), ("in_plane", "in_over_out")):
        if spec in racket.specs:
            statuses[f"frequency_{key}"] = racket.specs[spec].status
    for key in ("mass", "balance", "swingweight", "twistweight"):
        if key in racket.specs and (not racket.added or racket.specs[key].status == "inferred"):
            statuses[key] = racket.specs[key].status
    return {
        "name": racket.name,
        "title": racket.title,
        **dict(zip(_UNITS, values, strict=True)),
        "units": _UNITS,
        "statuses": statuses | {key: found.status for key, found in sourced_fields(racket)},
        "specs": {key: dataclasses.asdict(spec) for key, spec in racket.specs.items()},
        "added": [dataclasses.asdict(added) for added in racket.added],
        "notes": list(racket.notes),
    }


def _properties_table(properties: RacketProperties) -> Table:
    table = Table(box=None, show_header=False, pad_edge=False)
    p = properties
    table.add_row("total mass", f"{1e3 * p.mass:.1f} g (strung)")
    table.add_row("balance", f"{1e3 * p.balance:.1f} mm from the butt")
    table.add_row("swingweight", f"{1e4 * p.swingweight:.1f} kg cm² about 4 inches from the butt")
    table.add_row("twistweight", f"{1e4 * p.twistweight:.1f} kg cm²")
    table.add_row(
        "fundamentals",
        f"{p.in_plane_frequency:.1f} Hz in plane, {p.out_of_plane_frequency:.1f} Hz out of plane"
        " (bare frame, free)",
    )
    return table


def _parameter_table(parameters: object) -> Table:
    from drake_racket.parameters.quantities import sourced_fields

    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("parameter", "value", "unit", "status", "source"):
        table.add_column(column, no_wrap=column in ("parameter", "unit", "status"), overflow="fold")
    for key, value in sourced_fields(parameters):
        unit = getattr(value, "unit", "")
        mark = "yellow" if value.status == "inferred" else ""
        table.add_row(
            key,
            _shown(value),
            unit,
            f"[{mark}]{value.status}[/]" if mark else value.status,
            escape(value.source),
        )
    return table


def _shown(value: Quantity | Quantities | Choice | Assignment) -> str:
    from drake_racket.parameters.quantities import Choice, Quantities, Quantity

    if isinstance(value, Quantity):
        return f"{value.value:g}"
    if isinstance(value, Quantities):
        return ", ".join(f"{x:g}" for x in value.value)
    if isinstance(value, Choice):
        return value.value
    return ", ".join(f"{name} {parameter}" for name, parameter in value.value.items())
