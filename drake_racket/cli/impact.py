"""`drake-racket impact` simulates one impact, sums it up, logs it and draws it."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drake_racket.cli.case_options import BallFile, Settings, in_unit, with_options
from drake_racket.cli.console import ending_on_signals, new_console, showing, working
from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory, directory_error

if TYPE_CHECKING:
    from drake_racket.cases.case import Case
    from drake_racket.derivatives import Derivatives
    from drake_racket.results.impact import ImpactResult


def impact(
    scenario_file: Annotated[
        Path | None,
        typer.Argument(metavar="[SCENARIO]", help="A scenario file (YAML), or backhand."),
    ] = None,
    racket: Annotated[
        str | None, typer.Option(help="tour, recreational, or a parameter file (YAML).")
    ] = None,
    tension: Annotated[
        str | None, typer.Option(help="low, high, or of stringing: 280 (N), 25kg, 55lb.")
    ] = None,
    point: Annotated[
        str | None, typer.Option(help="String-bed point 1-9, or auto (nearest at touch).")
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(help="Speed of the ball: 30 (m/s), 67mph, 108km/h.", parser=in_unit("m/s")),
    ] = None,
    incidence: Annotated[
        float | None,
        typer.Option(
            help="Incidence from the normal: 17 (degrees), 0.3rad.", parser=in_unit("degrees")
        ),
    ] = None,
    azimuth: Annotated[
        float | None,
        typer.Option(
            help="Direction of the tangential part, from +x towards +y (degrees).",
            parser=in_unit("degrees"),
        ),
    ] = None,
    contact: Annotated[
        str | None,
        typer.Option(help="paper (a point without spin), or surface (radius, spin, anywhere)."),
    ] = None,
    spin: Annotated[
        float | None,
        typer.Option(
            help="Spin before, with contact surface: -3820 (rpm), positive as friction turns it.",
            parser=in_unit("rpm"),
        ),
    ] = None,
    support: Annotated[
        str | None, typer.Option(help="free, clamped_head, clamped_handle, grip or limb.")
    ] = None,
    after: Annotated[
        float | None,
        typer.Option(help="Time simulated from touch on: 0.02 (s), 20ms.", parser=in_unit("s")),
    ] = None,
    ball: BallFile = None,
    settings: Settings = None,
    engine: Annotated[
        str | None, typer.Option(help="drake (which one impact runs on), or compiled.")
    ] = None,
    derivatives: Annotated[
        list[str] | None,
        typer.Option(
            "--derivatives", metavar="KEY", help="Also derivatives by this key (again and again)."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory for the history (NetCDF, CSV) and the plot.")
    ] = None,
    formats: Annotated[
        str | None,
        typer.Option(
            "--format", help="Of the history: nc,csv (default), parquet, sto; or several."
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object (SI units) and nothing else.")
    ] = False,
) -> None:
    """Simulates one impact. Options override the scenario file."""
    with working("loading"):
        from drake_racket.cases.case import load_scenario, resolve
        from drake_racket.parameters.scenario import Scenario

    given = {
        "racket": racket,
        "tension": tension,
        "point": point,
        "speed": speed,
        "incidence_deg": incidence,
        "azimuth_deg": azimuth,
        "contact": contact,
        "spin_rpm": spin,
        "support": support,
        "after": after,
        "engine": engine,
    }
    scenario = Scenario() if scenario_file is None else load_scenario(scenario_file)
    changes: dict[str, Any] = {k: v for k, v in given.items() if v is not None}
    case = resolve(with_options(dataclasses.replace(scenario, **changes), settings, ball))
    if out is None and formats is not None:
        raise InputError("--format", formats, "together with --out")
    suffixes = _history_formats(formats)
    if out is not None:
        check_directory(out, "--out")
    result = _simulated(case, derivatives)
    with working("writing"):
        written = [] if out is None else _write(result, out, suffixes)
    if as_json:
        print(json.dumps(result.to_json(), allow_nan=False))
    else:
        _print_summary(result, written)


def _simulated(case: Case, derivatives: list[str] | None) -> ImpactResult:
    """Runs the case; a slow or unstable one says so first, and then how far it is."""
    from drake_racket.cases.effort import effort, unstable
    from drake_racket.simulation import simulate

    if derivatives is not None:
        with working("simulating: the first derivatives of an installation compile for a minute"):
            return simulate(case, derivatives=derivatives)
    slow = effort(case).slow()
    for text in (slow, unstable(case)):
        if text:
            print(f"drake-racket: {text}", file=sys.stderr, flush=True)
    if not slow:
        first = ": the first compiled run of an installation takes half a minute"
        with working("simulating" + (first if case.scenario.engine == "compiled" else "")):
            return simulate(case)
    with (
        ending_on_signals("nothing is written"),
        showing(lambda p: f"{p.done:.1f} of {p.total:g} ms") as report,
    ):
        return simulate(case, progress=report)


def _history_formats(text: str | None) -> list[str]:
    """The suffixes that `--format` names, each once; refused here, before the simulation."""
    from drake_racket.results.formats import check_format

    suffixes = list(
        dict.fromkeys(part.strip() for part in ("nc,csv" if text is None else text).split(","))
    )
    for suffix in suffixes:
        check_format(suffix, "--format")
    return suffixes


def _write(result: ImpactResult, out: Path, suffixes: list[str]) -> list[Path]:
    from drake_racket.io.files import figure_bytes, replace_file, write_text
    from drake_racket.io.numbers import json_text
    from drake_racket.plots import impact_figure
    from drake_racket.results.formats import write_history

    history = result.history
    assert history is not None
    try:
        out.mkdir(parents=True, exist_ok=True)
        paths = [out / f"impact.{suffix}" for suffix in (*suffixes, "png", "json")]
        picture = figure_bytes(impact_figure(history), ".png")  # before anything is written
        for path in paths[:-2]:
            write_history(history, path)
        replace_file(paths[-2], lambda temporary: temporary.write_bytes(picture))
        write_text(json_text(result.to_json(), indent=2), paths[-1])
    except OSError as error:
        raise directory_error(out, error, "--out") from None
    return paths


_TOLD = (
    "rebound_speed",
    "restitution",
    "rebound_angle",
    "contact_time",
    "peak_normal_force",
    "peak_handle_acceleration",
    "peak_hand_force",
    "peak_hand_torque",
)
"""Numbers whose derivatives are printed; all are in the JSON."""


def _derivatives_table(found: Derivatives) -> Any:
    from rich.table import Table

    from drake_racket.results.outputs import OUTPUTS

    table = Table(box=None, pad_edge=False, header_style="bold", title_justify="left")
    table.add_column("changes by")
    for key, unit in zip(found.keys, found.units, strict=True):
        table.add_column(f"{key} (per {unit})" if unit != "1" else key, justify="right")
    for name in _TOLD:
        if name in found.outputs:
            units = OUTPUTS[name].units
            cells = [f"{found.of(name, key):.4g}" for key in found.keys]
            title = name.replace("_", " ")
            table.add_row(title if units == "1" else f"{title} ({units})", *cells)
    return table


def _print_summary(result: ImpactResult, written: list[Path]) -> None:
    from rich.markup import escape
    from rich.table import Table

    from drake_racket.parameters.quantities import sourced_fields
    from drake_racket.results.summary import summary_rows

    console = new_console()
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
    for name, value in summary_rows(result):
        table.add_row(name, value)
    console.print(table)
    if result.derivatives is not None:
        console.print(_derivatives_table(result.derivatives))
    ball = scenario.load_ball()
    parts: list[Any] = [racket, ball]
    if scenario.support in ("grip", "limb") and scenario.grip_kind != "weld":
        parts.append(scenario.load_grip())
    idle = tuple(scenario.idle_of_ball(ball))  # numbers of other laws
    inferred = sum(
        q.status == "inferred" and not (part is ball and key.startswith(idle))
        for part in parts
        for key, q in sourced_fields(part)
    )
    console.print(
        f"[dim]{inferred} of the model's values are inferred, not published:"
        f" drake-racket show {escape(scenario.racket)} --tension {escape(scenario.tension)}"
        f"{' (and every value of the hand)' if len(parts) == 3 else ''}[/]"
    )
    for warning in result.warnings:
        console.print(f"[yellow]warning:[/] {escape(warning)}")
    for path in written:
        console.print(f"wrote {escape(str(path))}")
