"""Writes what a fit leaves: parameter file, result, residuals, figures and a report.

racket.yaml or ball.yaml    the racket or ball with the fitted values (`parameter_file`)
result.json, result.nc      estimates, covariance, intervals, residuals, convergence
residuals.csv               one row per measured value
report.md, *.png            the report and its figures
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.identify.core.estimate import Estimate
from drake_racket.identify.core.result import FitResult
from drake_racket.identify.core.search import unit_text
from drake_racket.identify.report.figures import correlation_figure, residual_figure, starts_figure
from drake_racket.identify.report.parameter_file import (
    Provenance,
    fitted_racket,
    interval_text,
    write_racket,
)
from drake_racket.identify.report.string_figures import (
    angle_fit_figure,
    estimates_figure,
    restitution_fit_figure,
)
from drake_racket.identify.strings.friction import FrictionFit
from drake_racket.identify.strings.string_bed import StringBedFit
from drake_racket.io.files import write_figure, write_netcdf, write_table, write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CHECKPOINT = "checkpoint"
"""Directory, in that of the fit, of its checkpoint."""


def write_string_bed(
    fit: StringBedFit,
    out: str | Path,
    date: str,
    *,
    name: str | None = None,
    stringing_tension: float | None = None,
) -> list[Path]:
    """Writes a string-bed's fit; returns the paths.

    Args:
        date: of the fit, for the sources.  name, stringing_tension: of the racket written.

    """
    out = Path(out)
    table = fit.problem.table
    provenance = _provenance(fit, date, f"{100.0 * fit.rms:.3g} % of restitution")
    racket = fitted_racket(
        fit.problem.racket,
        fit.estimates,
        provenance,
        name=name,
        stringing_tension=stringing_tension,
    )
    figures = {
        "restitution": restitution_fit_figure(fit.to_dataset(), fit.problem.racket.title),
        "residuals": residual_figure(
            fit.result,
            [f"point {p}" for p in table.points],
            abscissa=table.speeds,
            abscissa_label="approach speed [m/s]",
            scale=100.0,
            unit="%",
        ),
    }
    by_point = [(f"{k:.0f}", f"{100.0 * v:.3g}") for k, v in fit.rms_by("point").items()]
    by_speed = [(f"{k:.0f}", f"{100.0 * v:.3g}") for k, v in fit.rms_by("speed").items()]
    extra = [
        "## RMS difference of restitution by point",
        markdown_table(("point", "RMS (%)"), by_point),
        "## By approach speed",
        markdown_table(("speed (m/s, rounded)", "RMS (%)"), by_speed),
    ]
    return _write(fit, racket, provenance, out, figures, extra, scale=100.0, unit="%")


def write_friction(
    fit: FrictionFit, out: str | Path, date: str, *, name: str | None = None
) -> list[Path]:
    """Writes a fit of friction; returns the paths."""
    out = Path(out)
    table = fit.problem.table
    provenance = _provenance(fit, date, f"{fit.rms:.3g} deg")
    racket = fitted_racket(fit.problem.racket, fit.estimates, provenance, name=name)
    figures = {
        "rebound_angles": angle_fit_figure(fit.to_dataset(), fit.problem.racket.title),
        "residuals": residual_figure(
            fit.result,
            [f"point {p}" for p in table.points],
            abscissa=table.incidence,
            abscissa_label="incidence from the normal [deg]",
        ),
    }
    by_point = [(f"{k:.0f}", f"{v:.3g}") for k, v in fit.rms_by("point").items()]
    by_name = [(n, f"{s:.3g}") for n, s in fit.sensitivity.items()]
    extra = [
        f"Friction is read by {fit.problem.reading}. In {int(fit.sliding.sum())} of "
        f"{len(fit.sliding)} impacts the ball slides until it leaves.",
        "## RMS difference of the rebound angle by point",
        markdown_table(("point", "RMS (deg)"), by_point),
        "## Rebound angle by friction",
        markdown_table(("coefficient", "deg per 0.01"), by_name),
    ]
    return _write(fit, racket, provenance, out, figures, extra, scale=1.0, unit="deg")


def _provenance(fit: StringBedFit | FrictionFit, date: str, rms: str) -> Provenance:
    table = fit.problem.table
    return Provenance(Path(table.where).name, table.sha256, date, fit.result.method, rms)


def _write(
    fit: StringBedFit | FrictionFit,
    racket: Any,
    provenance: Provenance,
    out: Path,
    figures: dict[str, Figure],
    extra: Sequence[str],
    *,
    scale: float,
    unit: str,
) -> list[Path]:
    """Everything in the directory; the report last, so that it stands for a whole set."""
    result, start = fit.result, {p.name: p.start for p in fit.result.parameters}
    figures["estimates"] = estimates_figure(fit.estimates, start, title=result.title)
    if len(start) > 1:
        figures["correlation"] = correlation_figure(result)
    figures["convergence"] = starts_figure(result, scale=scale, unit=unit)
    out.mkdir(parents=True, exist_ok=True)
    write_racket(racket, out / "racket.yaml")
    write_text(result.to_json(), out / "result.json")
    dataset = fit.to_dataset()
    write_netcdf(dataset, out / "result.nc")
    columns = [n for n, v in dataset.data_vars.items() if v.dims == ("measurement",)]
    rows = dataset[columns].drop_dims(
        [d for d in dataset.dims if d != "measurement"], errors="ignore"
    )
    write_table(rows, out / "residuals.csv")
    paths = [out / n for n in ("racket.yaml", "result.json", "result.nc", "residuals.csv")]
    for name, figure in figures.items():
        paths.append(out / f"{name}.png")
        write_figure(figure, paths[-1])
    kind = "likelihood profile" if fit.profiled else "linearised"
    texts = [
        f"# {fit.problem.racket.title}: {', '.join(fit.estimates)}",
        f"Data: `{provenance.data}`, sha256 `{provenance.sha256}`. Fitted on {provenance.date} by "
        f"{provenance.method}. RMS difference {provenance.rms} over {len(result.residuals)} "
        f"measured values. Intervals: 95 %, {kind}.",
        "## Estimates",
        estimates_table(fit.estimates, result),
        *warnings_section(fit.warnings),
        *extra,
        *convergence_section(result, scale, unit),
        *(f"![{name.replace('_', ' ')}]({name}.png)" for name in figures),
    ]
    write_text("\n\n".join(texts) + "\n", out / "report.md")
    return [*paths, out / "report.md"]


def estimates_table(found: Mapping[str, Estimate], result: FitResult | None = None) -> str:
    """Tabulates value, standard error, interval; start and bounds where the result is given."""
    header = ["parameter", "unit", "estimate", "standard error", "95 % interval"]
    rows = []
    parameters = {} if result is None else {p.name: p for p in result.parameters}
    for name, e in found.items():
        text = interval_text(e).replace("95 % interval ", "").removesuffix(unit_text(e.unit))
        error = f"{e.standard_error:.3g}" if np.isfinite(e.standard_error) else "none"
        row = [name, e.unit, f"{e.value:.6g}", error, text]
        if name in parameters:
            p = parameters[name]
            row += [f"{p.start:.6g}", f"{p.lower:.4g} to {p.upper:.4g}"]
        rows.append(row)
    if parameters:
        header += ["start", "bounds"]
    return markdown_table(header, rows)


def warnings_section(warnings: Iterable[str]) -> list[str]:
    """Gives the warnings as a list, or that there are none."""
    lines = "\n".join(f"- {text}" for text in warnings)
    return ["## Warnings", lines or "None."]


def convergence_section(result: FitResult, scale: float, unit: str) -> list[str]:
    """Tells how the search went."""
    rows = [
        (str(r.number), f"{scale * r.rms:.6g}", str(r.evaluations), r.status.replace("|", "/"))
        for r in result.convergence
    ]
    versions = ", ".join(f"{name} {text}" for name, text in result.versions.items())
    return [
        "## Convergence",
        markdown_table(("start", f"RMS ({unit})", "evaluations", "ended"), rows),
        f"{result.evaluations} evaluations, {result.seconds:.1f} s, seed {result.seed}. "
        f"{versions}.",
    ]


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Gives a table in Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)
