"""Writes what a fit to impacts on the clamped head leaves.

racket.yaml                 the racket with the fitted values (`parameter_file`)
result.json, result.nc      estimates, covariance, intervals, residuals, convergence
residuals.csv               one row per measured value
report.md, *.png            the report and its figures
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drake_racket.identify.core.result import FitResult
from drake_racket.identify.report.directory import (
    estimates_table,
    markdown_table,
    warnings_section,
    write_fit,
)
from drake_racket.identify.report.figures import correlation_figure, residual_figure, starts_figure
from drake_racket.identify.report.parameter_file import Provenance, fitted_racket
from drake_racket.identify.report.string_figures import (
    angle_fit_figure,
    estimates_figure,
    restitution_fit_figure,
)
from drake_racket.identify.strings.friction import FrictionFit
from drake_racket.identify.strings.string_bed import StringBedFit
from drake_racket.parameters.racket import RacketParameters

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
    racket: RacketParameters,
    provenance: Provenance,
    out: Path,
    figures: dict[str, Figure],
    extra: Sequence[str],
    *,
    scale: float,
    unit: str,
) -> list[Path]:
    result, start = fit.result, {p.name: p.start for p in fit.result.parameters}
    figures["estimates"] = estimates_figure(fit.estimates, start, title=result.title)
    if len(start) > 1:
        figures["correlation"] = correlation_figure(result)
    figures["convergence"] = starts_figure(result, scale=scale, unit=unit)
    dataset = fit.to_dataset()
    columns = [n for n, v in dataset.data_vars.items() if v.dims == ("measurement",)]
    rows = dataset[columns].drop_dims(
        [d for d in dataset.dims if d != "measurement"], errors="ignore"
    )
    files = {
        "racket.yaml": racket,
        "result.json": result.to_json(),
        "result.nc": dataset,
        "residuals.csv": rows,
        **{f"{name}.png": figure for name, figure in figures.items()},
    }
    sections = [
        estimates_table(fit.estimates, result),
        *warnings_section(fit.warnings),
        *extra,
        *convergence_section(result, scale, unit),
    ]
    kind = "likelihood profile" if fit.profiled else "linearised"
    said = f" over {len(result.residuals)} measured values. Intervals: 95 %, {kind}"
    title = f"{fit.problem.racket.title}: {', '.join(fit.estimates)}"
    return write_fit(out, title, provenance, files, sections, said)


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
