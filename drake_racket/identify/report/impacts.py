"""Writes what a fit to measured impacts leaves.

scenario.yaml           the base scenario with the fitted values
result.json, result.nc  estimates, covariance, intervals, residuals, convergence
impacts.csv             one row per measured value: measured, modelled, residual
report.md, *.png        the report and its figures
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.identify.impacts.fit import ImpactsFit
from drake_racket.identify.report.directory import (
    estimates_table,
    markdown_table,
    warnings_section,
    write_fit,
)
from drake_racket.identify.report.figures import correlation_figure, residual_figure, starts_figure
from drake_racket.identify.report.outputs import convergence_section
from drake_racket.identify.report.parameter_file import Provenance, interval_text
from drake_racket.identify.report.string_figures import estimates_figure
from drake_racket.io.units import labelled
from drake_racket.io.yaml_files import dump_text
from drake_racket.parameters.scenario import Scenario
from drake_racket.plots.style import BLUE, GREY, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


def write_impacts(fit: ImpactsFit, out: str | Path, date: str) -> list[Path]:
    """Writes a fit to impacts; returns the paths."""
    out = Path(out)
    result, unit = fit.result, fit.result.residual_unit
    rms = f"{result.rms:.3g} {unit}".rstrip()
    data = Path(fit.data.where).name
    provenance = Provenance(data, fit.data.sha256, date, result.method, rms)
    rows = impacts_dataset(fit)
    figures = {
        "impacts": impacts_figure(fit),
        "residuals": residual_figure(result, rows["output"].values.tolist()),
    }
    start = {p.name: p.start for p in result.parameters}
    figures["estimates"] = estimates_figure(fit.estimates, start, title=result.title)
    if len(start) > 1:
        figures["correlation"] = correlation_figure(result)
    figures["convergence"] = starts_figure(result)
    labels: Any = {"row": (rows["row"].values, ""), "output": (rows["output"].values, "")}
    files = {
        "scenario.yaml": scenario_text(fit, provenance),
        "result.json": result.to_json(),
        "result.nc": result.to_dataset(labels),
        "impacts.csv": rows,
        **{f"{name}.png": figure for name, figure in figures.items()},
    }
    sections = [
        estimates_table(fit.estimates, result),
        *warnings_section(fit.warnings),
        "## By output",
        markdown_table(("output", "unit", "values", "RMS difference"), _by_output(fit)),
        *convergence_section(result, 1.0, unit),
    ]
    said = f" over {len(result.residuals)} measured values of {len(fit.data.lines)} impacts"
    return write_fit(out, result.title, provenance, files, sections, said)


def scenario_text(fit: ImpactsFit, provenance: Provenance) -> str:
    """Gives the fitted scenario as YAML, with where its fitted values come from."""
    lines = [f"# {provenance.text()}"]
    lines += [f"# {name}: {interval_text(e)}" for name, e in fit.estimates.items()]
    tree = _changes(fit.scenario, Scenario())
    return "\n".join(lines) + "\n" + (dump_text(tree) if tree else "{}\n")


def _changes(value: Any, default: Any) -> dict[str, Any]:
    """The fields of a schema that differ from its defaults, as plain data."""
    found: dict[str, Any] = {}
    for field in dataclasses.fields(value):
        own, other = getattr(value, field.name), getattr(default, field.name)
        if own == other:
            continue
        if dataclasses.is_dataclass(own):
            found[field.name] = _changes(own, other)
        else:
            found[field.name] = list(own) if isinstance(own, tuple) else own
    return found


def impacts_dataset(fit: ImpactsFit) -> xarray.Dataset:
    """Gives the measured values one after the other: row, output, measured, modelled, residual."""
    import xarray

    rows, columns = np.nonzero(np.isfinite(fit.data.values))
    outputs = [fit.data.outputs[k] for k in columns]
    at = ("measurement",)
    variables = {
        "row": labelled(at, np.array(fit.data.lines)[rows], "", "line of the table"),
        "output": labelled(at, [o.name for o in outputs], "", "what was measured"),
        "unit": labelled(at, [o.units for o in outputs], "", "its unit"),
        "measured": labelled(at, fit.data.values[rows, columns], "", "measured"),
        "modelled": labelled(at, fit.modelled[rows, columns], "", "as the fitted model has it"),
        "residual": labelled(
            at, fit.result.residuals, fit.result.residual_unit, "model - measured"
        ),
    }
    return xarray.Dataset(variables)


def impacts_figure(fit: ImpactsFit) -> Figure:
    """Draws modelled over measured values, a panel for each output."""
    count = len(fit.data.outputs)
    figure: Figure = new_figure(3.4 * count + 0.6, 3.6)
    panels = np.atleast_1d(figure.subplots(1, count))
    for k, (axes, output) in enumerate(zip(panels, fit.data.outputs, strict=True)):
        measured, modelled = fit.data.values[:, k], fit.modelled[:, k]
        both = np.concatenate([measured, modelled])
        ends = np.nanmin(both), np.nanmax(both)
        axes.plot(ends, ends, color=GREY, lw=0.8)
        spread = None if fit.data.sigma is None else fit.data.sigma[:, k]
        axes.errorbar(measured, modelled, xerr=spread, fmt="o", color=BLUE, ms=4, elinewidth=0.8)
        axes.set(xlabel=f"measured ({output.units})", ylabel=f"modelled ({output.units})")
        axes.set_title(output.name.replace("_", " "), fontsize="medium")
        tidy(axes)
    return figure


def _by_output(fit: ImpactsFit) -> list[tuple[str, str, str, str]]:
    found = []
    for k, output in enumerate(fit.data.outputs):
        away = fit.modelled[:, k] - fit.data.values[:, k]
        away = away[np.isfinite(away)]
        rms = float(np.sqrt(np.mean(away**2))) if len(away) else np.nan
        found.append((output.name, output.units, str(len(away)), f"{rms:.3g}"))
    return found
