"""The command line: `drake-racket impact`, `show` and `validate`.

Units: m/s, degrees, s. Bad input prints one line on standard error and exits with status 2.
"""

from __future__ import annotations

import dataclasses
import io
import json
import math
import sys
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from drake_racket.describe import RacketProperties, racket_properties
from drake_racket.errors import InputError, one_line
from drake_racket.files import check_directory, directory_error
from drake_racket.parameters import check_racket, load_ball, load_racket
from drake_racket.quantities import Assignment, Choice, Quantities, Quantity, sourced_fields
from drake_racket.result import ImpactResult
from drake_racket.scenario import Scenario, check_scenario, load_scenario
from drake_racket.simulate import SimulationError, simulate

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Tennis racket and ball impacts, after Glynn, King & Mitchell (2011).",
)


# click's class for wrong options and arguments; typer carries its own copy or imports click
_UsageError: Any = typer.BadParameter.__bases__[0]


def main() -> None:
    """Runs the command line; bad input ends with status 2 and one line on standard error."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal without ° or ² gets ? instead
    try:
        status = app(sys.argv[1:] or ["--help"], standalone_mode=False)
    except InputError as error:
        _stop(str(error), 2)
    except _UsageError as error:
        _stop(f"{error.format_message()} (see drake-racket --help)", 2)
    except SimulationError as error:
        _stop(str(error), 1)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(1)
    except typer.Abort:  # Ctrl-C in typer releases that do not give it a status themselves
        status = 130
    if status:
        sys.exit(status)


def _stop(message: str, status: int) -> NoReturn:
    print(f"drake-racket: {one_line(message)}", file=sys.stderr)
    sys.exit(status)


@app.command()
def impact(
    scenario_file: Annotated[
        Path | None, typer.Argument(metavar="[SCENARIO]", help="A scenario file (YAML).")
    ] = None,
    racket: Annotated[
        str | None, typer.Option(help="tour, recreational, or a parameter file (YAML).")
    ] = None,
    tension: Annotated[
        str | None, typer.Option(help="low, high, or a stringing tension in N.")
    ] = None,
    point: Annotated[
        str | None, typer.Option(help="String-bed point 1-9, or auto (nearest at touch).")
    ] = None,
    speed: Annotated[float | None, typer.Option(help="Speed of the ball (m/s).")] = None,
    incidence: Annotated[
        float | None, typer.Option(help="Incidence from the normal (degrees).")
    ] = None,
    azimuth: Annotated[
        float | None,
        typer.Option(help="Direction of the tangential part, from +x towards +y (degrees)."),
    ] = None,
    support: Annotated[
        str | None, typer.Option(help="free, clamped_head, clamped_handle, grip or limb.")
    ] = None,
    after: Annotated[float | None, typer.Option(help="Time simulated from touch on (s).")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory for the history (NetCDF, CSV) and the plot.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object (SI units) and nothing else.")
    ] = False,
) -> None:
    """Simulates one impact. Options override the scenario file."""
    given = {
        "racket": racket,
        "tension": tension,
        "point": point,
        "speed": speed,
        "incidence_deg": incidence,
        "azimuth_deg": azimuth,
        "support": support,
        "after": after,
    }
    scenario = Scenario() if scenario_file is None else load_scenario(scenario_file)
    changes: dict[str, Any] = {k: v for k, v in given.items() if v is not None}
    scenario = dataclasses.replace(scenario, **changes)
    check_scenario(scenario)
    if out is not None:
        check_directory(out, "--out")
    result = simulate(scenario)
    written = [] if out is None else _write(result, out)
    if as_json:
        print(json.dumps(result.to_json(), allow_nan=False))
    else:
        _print_summary(result, written)


def _write(result: ImpactResult, out: Path) -> list[Path]:
    from drake_racket.files import write_csv, write_figure, write_netcdf, write_text
    from drake_racket.plots import impact_figure

    history = result.history
    assert history is not None
    try:
        out.mkdir(parents=True, exist_ok=True)
        paths = [out / f"impact.{suffix}" for suffix in ("nc", "csv", "png", "json")]
        write_netcdf(history, paths[0])
        write_csv(history, paths[1])
        write_figure(impact_figure(history), paths[2])
        text = json.dumps(result.to_json(), indent=2, allow_nan=False) + "\n"
        write_text(text, paths[3])
    except OSError as error:
        raise directory_error(out, error, "--out") from None
    return paths


def _print_summary(result: ImpactResult, written: list[Path]) -> None:
    console = _console()
    scenario = result.scenario
    racket = scenario.load_racket()
    console.print(f"[bold]{escape(racket.title)}[/], {scenario.support.replace('_', ' ')}")
    aim = "auto" if scenario.point == "auto" else f"point {scenario.point}"
    centre = " (the string-bed centre)" if scenario.point == "5" else ""
    console.print(
        f"Ball at {scenario.speed:g} m/s, {scenario.incidence_deg:g}° from the normal,"
        f" aimed at {aim}{centre}"
    )
    table = Table(box=None, show_header=False, pad_edge=False)
    for name, value in _summary_rows(result):
        table.add_row(name, value)
    console.print(table)
    inferred = sum(1 for _, q in sourced_fields(racket) if q.status == "inferred")
    inferred += sum(1 for _, q in sourced_fields(scenario.load_ball()) if q.status == "inferred")
    console.print(
        f"[dim]{inferred} of the model's values are inferred, not published:"
        f" drake-racket show {escape(scenario.racket)}[/]"
    )
    for warning in result.warnings:
        console.print(f"[yellow]warning:[/] {escape(warning)}")
    for path in written:
        console.print(f"wrote {escape(str(path))}")


def _console() -> Console:
    """A terminal's own width; wide lines where the output is a file or a pipe."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else 160)


def _summary_rows(result: ImpactResult) -> list[tuple[str, str]]:
    speed = float((result.rebound_velocity @ result.rebound_velocity) ** 0.5)
    x, y, z = (round(float(v), 2) + 0.0 for v in result.rebound_velocity)  # no -0.00
    rows = [
        ("Rebound speed", f"{speed:.2f} m/s  (x {x:+.2f}, y {y:+.2f}, normal {z:+.2f})"),
        ("Apparent restitution", f"{result.apparent_restitution:.3f}"),
        ("Rebound angle", f"{math.degrees(result.rebound_angle):.2f}° from the normal"),
    ]
    if result.contact_time is not None:
        rows.append(("Contact time", f"{1e3 * result.contact_time:.2f} ms"))
    rows += [
        ("Peak normal force", f"{result.peak_normal_force:.0f} N"),
        ("Peak string deflection", f"{1e3 * result.peak_string_deflection:.1f} mm"),
        (
            "Racket after",
            f"centre of mass {_norm(result.racket_velocity):.2f} m/s,"
            f" turning {_norm(result.racket_angular_velocity):.1f} rad/s",
        ),
        (
            "Peak throat bending",
            f"{math.degrees(result.peak_out_of_plane_angle):.2f}° out of plane",
        ),
    ]
    if result.peak_handle_acceleration is not None:
        rows.append(("Peak mid-handle acc.", f"{result.peak_handle_acceleration:.0f} m/s²"))
    if result.kb is not None and result.cb is not None:
        rows.append(("Ball", f"kb {result.kb / 1e3:.1f} kN/m, cb {result.cb:.1f} N s/m"))
    if result.balance is not None:
        b = result.balance
        lost = b.lost_ball + b.lost_friction + b.lost_joint + b.lost_strings
        rows.append(
            (
                "Energy at the end",
                f"ball {b.ball:.2f}, racket {b.rigid_motion:.2f}, bending {b.bending:.2f},"
                f" strings {b.strings:.2f}, lost {lost:.2f} J",
            )
        )
    if result.energy_error is not None:
        momentum = result.momentum_error
        shown = "" if momentum is None else f", momentum {momentum:.1e}"
        rows.append(("Balance closes to", f"energy {result.energy_error:.1e}{shown}"))
    rows.append(("Integrator", f"{result.steps} steps, {result.evaluations} evaluations"))
    return rows


def _norm(vector: Any) -> float:
    return float((vector @ vector) ** 0.5)


@app.command()
def show(
    racket: Annotated[str, typer.Argument(help="tour, recreational, or a parameter file.")],
    tension: Annotated[str, typer.Option(help="low, high, or a stringing tension in N.")] = "low",
    joint_reading: Annotated[
        str | None, typer.Option(help="by_axis or as_printed (default: the file's).")
    ] = None,
) -> None:
    """Prints a racket's parameters with their sources, and what follows from them."""
    parameters = load_racket(racket, tension, joint_reading=joint_reading)
    check_racket(parameters, racket)
    console = _console()
    console.print(f"[bold]{escape(parameters.title)}[/]")
    console.print(_properties_table(racket_properties(parameters)))
    console.print(_parameter_table(parameters))
    console.print("[bold]Ball[/]")
    ball = load_ball()
    console.print(_parameter_table(ball))
    for note in parameters.notes:
        console.print(f"note: {escape(note)}")
    values = [*sourced_fields(parameters), *sourced_fields(ball, "ball")]
    inferred = [key for key, value in values if value.status == "inferred"]
    console.print(f"[bold]Inferred[/] ({len(inferred)}): " + ", ".join(inferred))


@app.command()
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
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from drake_racket.rigs.cases import check_workers
    from drake_racket.validation import SECTIONS
    from drake_racket.validation import validate as run_validation
    from drake_racket.validation.outcome import Plan

    for name in only or []:
        if name not in SECTIONS:
            raise InputError("--only", name, ", ".join(SECTIONS))
    check_workers(workers)
    check_directory(out, "--out")
    plan = Plan.coarse(workers) if coarse else Plan(workers=workers)
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as bars:
        tasks: dict[str, Any] = {}

        def step(title: str, done: int, total: int) -> None:
            if title not in tasks:
                tasks[title] = bars.add_task(title)
            bars.update(tasks[title], completed=done, total=total)

        rows = run_validation(out, only=only or [], plan=plan, fresh=fresh, progress=step)
    _print_verdicts(rows, out)


def _print_verdicts(rows: list[Any], out: Path) -> None:
    console = _console()
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
    if isinstance(value, Quantity):
        return f"{value.value:g}"
    if isinstance(value, Quantities):
        return ", ".join(f"{x:g}" for x in value.value)
    if isinstance(value, Choice):
        return value.value
    return ", ".join(f"{name} {parameter}" for name, parameter in value.value.items())


if __name__ == "__main__":
    main()
