"""`drake-racket impact`: one impact, summed up, logged and drawn."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from drake_racket.cases.case import check_scenario, load_scenario
from drake_racket.cli.console import new_console
from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory, directory_error
from drake_racket.parameters.quantities import sourced_fields
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.impact import ImpactResult
from drake_racket.simulation import simulate


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
    if out is None and formats is not None:
        raise InputError("--format", formats, "together with --out")
    suffixes = _history_formats(formats)
    if out is not None:
        check_directory(out, "--out")
    result = simulate(scenario)
    written = [] if out is None else _write(result, out, suffixes)
    if as_json:
        print(json.dumps(result.to_json(), allow_nan=False))
    else:
        _print_summary(result, written)


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
    from drake_racket.io.files import write_figure, write_text
    from drake_racket.plots import impact_figure
    from drake_racket.results.formats import write_history

    history = result.history
    assert history is not None
    try:
        out.mkdir(parents=True, exist_ok=True)
        paths = [out / f"impact.{suffix}" for suffix in (*suffixes, "png", "json")]
        for path in paths[:-2]:
            write_history(history, path)
        write_figure(impact_figure(history), paths[-2])
        text = json.dumps(result.to_json(), indent=2, allow_nan=False) + "\n"
        write_text(text, paths[-1])
    except OSError as error:
        raise directory_error(out, error, "--out") from None
    return paths


def _print_summary(result: ImpactResult, written: list[Path]) -> None:
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
    for name, value in _summary_rows(result):
        table.add_row(name, value)
    console.print(table)
    parts: list[Any] = [racket, scenario.load_ball()]
    if scenario.support in ("grip", "limb") and scenario.grip_kind != "weld":
        parts.append(scenario.load_grip())
    inferred = sum(q.status == "inferred" for part in parts for _, q in sourced_fields(part))
    console.print(
        f"[dim]{inferred} of the model's values are inferred, not published:"
        f" drake-racket show {escape(scenario.racket)} --tension {escape(scenario.tension)}"
        f"{' (and every value of the hand)' if len(parts) == 3 else ''}[/]"
    )
    for warning in result.warnings:
        console.print(f"[yellow]warning:[/] {escape(warning)}")
    for path in written:
        console.print(f"wrote {escape(str(path))}")


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
        lost = b.lost_ball + b.lost_friction + b.lost_joint + b.lost_strings + b.lost_limb
        held = "".join(f" {n} {e:.2f}," for n, e in (("grip", b.grip), ("limb", b.limb)) if e)
        rows.append(
            (
                "Energy at the end",
                f"ball {b.ball:.2f}, racket {b.rigid_motion:.2f}, bending {b.bending:.2f},"
                f" strings {b.strings:.2f},{held} lost {lost:.2f} J",
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
