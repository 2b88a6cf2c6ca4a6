"""Writes what the fits of ball and frame leave in their directory; see `outputs`.

These fits take seconds: they keep no checkpoint, a run that was killed is run again.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.identify.ball.fit import BallFit
from drake_racket.identify.core.estimate import Estimate
from drake_racket.identify.core.result import FitResult
from drake_racket.identify.frame.fit import FrameFit
from drake_racket.identify.report.ball_figures import ball_fit_figure
from drake_racket.identify.report.directory import (
    estimates_table,
    markdown_table,
    warnings_section,
    write_fit,
)
from drake_racket.identify.report.frame_figures import frame_fit_figure
from drake_racket.identify.report.parameter_file import (
    Provenance,
    fitted_ball,
    fitted_racket,
    hash_files,
)
from drake_racket.io.numbers import json_text
from drake_racket.parameters.ball import BallParameters
from drake_racket.parameters.racket import RacketParameters

if TYPE_CHECKING:
    import xarray


def write_ball_fit(
    fit: BallFit,
    ball: BallParameters,
    table: str | Path,
    out: str | Path,
    date: str,
    *,
    name: str | None = None,
) -> list[Path]:
    """Writes a ball's fit: `ball.yaml`, the result, residuals of the force, report and figure.

    Args:
        ball: gives what is not fitted.
        table: the file that names the records; the hash is of it and of them, in its order.
        name: of the ball written.

    Returns:
        The paths.

    """
    table = Path(table)
    out = Path(out)
    records = [Path(impact.force.where) for group in fit.groups for impact in group.impacts]
    provenance = Provenance(
        data=f"{table.name} and its {len(records)} records",
        sha256=hash_files([table, *sorted(records)]),
        date=date,
        method="least squares at each speed and lines over speed",
        rms=f"{fit.rms:.3g} N",
    )
    found = fit.fields()
    results = {f"{g.speed:.4g} m/s": g.result for g in fit.groups}
    dataset = fit.to_dataset()
    files = {
        "ball.yaml": fitted_ball(ball, found, provenance, name=name),
        "result.json": _results(results, found, fit.warnings, provenance),
        "result.nc": dataset,
        "speeds.csv": dataset,
        "residuals.csv": _force_residuals(fit),
        "ball.png": ball_fit_figure(fit, ball.title),
    }
    rows = [
        (
            f"{g.speed:.4g}",
            str(len(g.impacts)),
            f"{g.kb:.6g} ± {np.sqrt(g.covariance[0, 0]):.2g}",
            f"{g.cb:.5g} ± {np.sqrt(g.covariance[1, 1]):.2g}",
            f"{g.rms:.3g}",
        )
        for g in fit.groups
    ]
    header = ("speed (m/s)", "impacts", "kb (N/m)", "cb (N s/m)", "RMS (N)")
    sections = [
        estimates_table(found),
        *warnings_section(fit.warnings),
        "## By speed (± one standard error)",
        markdown_table(header, rows),
    ]
    return write_fit(out, f"{ball.title}, fitted", provenance, files, sections)


def write_frame_fit(
    fits: Mapping[str, FrameFit],
    racket: RacketParameters,
    files: Sequence[Path],
    out: str | Path,
    date: str,
    *,
    name: str | None = None,
) -> list[Path]:
    """Writes a frame's fits: `racket.yaml`, the results, residuals, report and figure.

    Args:
        fits: by direction, one or both.
        racket: gives what is not fitted.
        files: the records, for the hash.
        name: of the racket written.

    Returns:
        The paths.

    """
    out = Path(out)
    rms = ", ".join(f"{f.record_rms:.3g} m/s^2 {d.replace('_', ' ')}" for d, f in fits.items())
    provenance = Provenance(
        data=", ".join(path.name for path in files),
        sha256=hash_files(files),
        date=date,
        method="least squares",
        rms=rms,
    )
    found = {name: e for fit in fits.values() for name, e in fit.fields().items()}
    warnings = [f"{d.replace('_', ' ')}: {text}" for d, f in fits.items() for text in f.warnings]
    results = {d: f.result for d, f in fits.items()}
    written: dict[str, Any] = {
        "racket.yaml": fitted_racket(racket, found, provenance, name=name),
        "result.json": _results(results, found, warnings, provenance),
    }
    datasets = {direction: fit.to_dataset() for direction, fit in fits.items()}
    for direction, dataset in datasets.items():
        written[f"{direction}.nc"] = dataset
        written[f"residuals_{direction}.csv"] = _acceleration_residuals(dataset)
    written["frame.png"] = frame_fit_figure(datasets, racket.title)
    rows = [
        (
            d.replace("_", " "),
            f"{f.kf.value:.6g} ({f.kf.interval[0]:.6g} to {f.kf.interval[1]:.6g})",
            f"{f.cf.value:.4g} ({f.cf.interval[0]:.4g} to {f.cf.interval[1]:.4g})",
            f"{f.frequency.value:.5g}",
            f"{f.record_rms:.3g}",
            f"{f.rms:.3g}",
        )
        for d, f in fits.items()
    ]
    header = (
        "direction",
        "kf (N m/rad), 95 %",
        "cf (N m s/rad), 95 %",
        "frequency (Hz)",
        "RMS, whole record (m/s²)",
        "RMS, ringing (m/s²)",
    )
    sections = [markdown_table(header, rows), *warnings_section(warnings)]
    return write_fit(out, f"{racket.title}, frame fitted", provenance, written, sections)


def _results(
    results: Mapping[str, FitResult],
    found: Mapping[str, Estimate],
    warnings: Sequence[str],
    provenance: Provenance,
) -> str:
    """All fits of a run as one JSON text."""
    content = {
        "data": provenance,
        "estimates": found,
        "warnings": warnings,
        "fits": {key: json.loads(result.to_json()) for key, result in results.items()},
    }
    return json_text(content)


def _force_residuals(fit: BallFit) -> xarray.Dataset:
    """Fitted less measured force, one row per sample that was fitted."""
    import xarray as xr

    columns: dict[str, list[Any]] = {"speed": [], "record": [], "time": [], "residual": []}
    for group in fit.groups:
        for impact, contact in zip(group.impacts, group.contacts, strict=True):
            time = impact.force.time[contact.samples]
            columns["time"] += time.tolist()
            columns["speed"] += [group.speed] * len(time)
            columns["record"] += [Path(impact.force.where).name] * len(time)
        columns["residual"] += group.residuals.tolist()
    units = {"speed": "m/s", "record": "", "time": "s", "residual": "N"}
    return xr.Dataset(
        {name: ("sample", values, {"units": units[name]}) for name, values in columns.items()}
    )


def _acceleration_residuals(dataset: xarray.Dataset) -> xarray.Dataset:
    """Fitted less measured acceleration over strike and time."""
    residual = dataset["model"] - dataset["acceleration"]
    residual.attrs = {"units": "m/s^2", "long_name": "fitted less measured acceleration"}
    return residual.to_dataset(name="residual")
