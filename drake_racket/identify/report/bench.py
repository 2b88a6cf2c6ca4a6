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
from drake_racket.identify.report.frame_figures import frame_fit_figure
from drake_racket.identify.report.outputs import estimates_table, markdown_table, warnings_section
from drake_racket.identify.report.parameter_file import (
    Provenance,
    fitted_ball,
    fitted_racket,
    hash_files,
    write_ball,
    write_racket,
)
from drake_racket.io.files import write_figure, write_netcdf, write_table, write_text
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
    out.mkdir(parents=True, exist_ok=True)
    write_ball(fitted_ball(ball, found, provenance, name=name), out / "ball.yaml")
    results = {f"{g.speed:.4g} m/s": g.result for g in fit.groups}
    _write_results(results, found, fit.warnings, provenance, out)
    dataset = fit.to_dataset()
    write_netcdf(dataset, out / "result.nc")
    write_table(dataset, out / "speeds.csv")
    write_table(_force_residuals(fit), out / "residuals.csv")
    write_figure(ball_fit_figure(fit, ball.title), out / "ball.png")
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
    texts = [
        f"# {ball.title}, fitted",
        _head(provenance),
        "## Estimates",
        estimates_table(found),
        *warnings_section(fit.warnings),
        "## By speed (± one standard error)",
        markdown_table(header, rows),
        "![ball](ball.png)",
    ]
    write_text("\n\n".join(texts) + "\n", out / "report.md")
    names = ("ball.yaml", "result.json", "result.nc", "speeds.csv", "residuals.csv", "ball.png")
    return [out / n for n in (*names, "report.md")]


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
    out.mkdir(parents=True, exist_ok=True)
    write_racket(fitted_racket(racket, found, provenance, name=name), out / "racket.yaml")
    _write_results({d: f.result for d, f in fits.items()}, found, warnings, provenance, out)
    paths = [out / "racket.yaml", out / "result.json"]
    datasets = {direction: fit.to_dataset() for direction, fit in fits.items()}
    for direction, dataset in datasets.items():
        paths += [out / f"{direction}.nc", out / f"residuals_{direction}.csv"]
        write_netcdf(dataset, paths[-2])
        write_table(_acceleration_residuals(dataset), paths[-1])
    write_figure(frame_fit_figure(datasets, racket.title), out / "frame.png")
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
    texts = [
        f"# {racket.title}, frame fitted",
        _head(provenance),
        "## Estimates",
        markdown_table(header, rows),
        *warnings_section(warnings),
        "![frame](frame.png)",
    ]
    write_text("\n\n".join(texts) + "\n", out / "report.md")
    return [*paths, out / "frame.png", out / "report.md"]


def _head(provenance: Provenance) -> str:
    return (
        f"Data: `{provenance.data}`, sha256 `{provenance.sha256}`. Fitted on {provenance.date} by "
        f"{provenance.method}. RMS difference {provenance.rms}."
    )


def _write_results(
    results: Mapping[str, FitResult],
    found: Mapping[str, Estimate],
    warnings: Sequence[str],
    provenance: Provenance,
    out: Path,
) -> None:
    """All fits of a run as one JSON file."""
    content: dict[str, Any] = {
        "data": vars(provenance),
        "estimates": {name: vars(e) for name, e in found.items()},
        "warnings": list(warnings),
        "fits": {key: json.loads(result.to_json()) for key, result in results.items()},
    }
    write_text(json.dumps(_finite(content), indent=1, allow_nan=False) + "\n", out / "result.json")


def _finite(value: Any) -> Any:
    """The same with None for numbers that are not finite, which JSON does not have."""
    if isinstance(value, Mapping):
        return {key: _finite(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value


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
