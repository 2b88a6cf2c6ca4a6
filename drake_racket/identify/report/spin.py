"""Writes what a fit of friction and shear leaves: parameter files, result, report and figure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.identify.ball.surface import SurfaceFit
from drake_racket.identify.report.directory import (
    estimates_table,
    markdown_table,
    warnings_section,
    write_fit,
)
from drake_racket.identify.report.outputs import convergence_section
from drake_racket.identify.report.parameter_file import (
    Provenance,
    fitted_quantities,
    fitted_quantity,
)
from drake_racket.io.units import labelled
from drake_racket.parameters.ball import BallParameters, surface_of
from drake_racket.parameters.quantities import Quantities
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plots.style import BLUE, GREY, VERMILION, as_written, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

_FIELDS = {"kt": "tangential_stiffness", "ct": "tangential_damping", "chi": "flattening"}


def fitted_pair(
    fit: SurfaceFit, provenance: Provenance, name: str | None = None
) -> tuple[RacketParameters, BallParameters]:
    """Gives racket and ball with the fitted numbers: mu of all points or groups, kt, ct, chi.

    Args:
        name: of the ball; its own with `_fitted` if None. The racket's likewise.

    """
    racket, ball, found = fit.problem.racket, fit.problem.ball, fit.estimates
    changes: dict[str, Any] = {
        field: fitted_quantity(found[key], provenance)
        for key, field in _FIELDS.items()
        if key in found
    }
    surface = replace(surface_of(ball), **changes)
    ball = replace(ball, name=name or f"{ball.name}_fitted", surface=surface)
    old = racket.friction.coefficients
    if fit.problem.points_of:
        values = fitted_quantities(old, "mu", found, provenance)
        if "mu" in found:
            mu = fitted_quantity(found["mu"], provenance)
            source = f"one mu everywhere: {mu.source}"
            values = Quantities((mu.value,) * len(old.value), "1", "fitted", source)
        friction = replace(racket.friction, coefficients=values)
        racket = replace(racket, name=f"{racket.name}_fitted", friction=friction)
    return racket, ball


def write_surface_fit(
    fit: SurfaceFit, out: str | Path, date: str, *, name: str | None = None
) -> list[Path]:
    """Writes ball.yaml, racket.yaml, result.json, impacts.csv, report.md and its figure.

    Args:
        date: of the fit, for the sources.  name: of the ball written.

    Returns:
        The paths.

    """
    table, result = fit.problem.table, fit.result
    rms = f"{result.residual_sigma:.3g} standard deviations"
    data = Path(table.where).name
    provenance = Provenance(data, table.sha256, date, result.method, rms)
    racket, ball = fitted_pair(fit, provenance, name)
    dataset = impacts_dataset(fit)
    files = {
        "ball.yaml": ball,
        "racket.yaml": racket,
        "result.json": result.to_json(),
        "impacts.csv": dataset,
        "spins.png": spin_fit_figure(dataset, racket.title),
    }
    slide = int(np.sum(fit.sliding > 1.0 - 1e-9))
    sections = [
        estimates_table(fit.estimates, result),
        *warnings_section(fit.warnings),
        f"In {slide} of {len(table)} impacts the ball slides until it leaves.",
        "## Impacts",
        markdown_table(
            ("incidence (deg)", "spin (rpm)", "angle, fitted (deg)", "spin after, fitted (rpm)"),
            [
                (
                    f"{table.incidence[i]:g}",
                    f"{table.spin[i]:g}",
                    f"{table.angle[i]:.4g}, {float(dataset['angle_modelled'][i]):.4g}",
                    f"{table.spin_after[i]:.4g}, {float(dataset['spin_modelled'][i]):.4g}",
                )
                for i in range(len(table))
            ],
        ),
        *convergence_section(result, 1.0, "degrees and rpm"),
    ]
    title = f"{racket.title}: {', '.join(fit.estimates)}"
    said = f" over {2 * len(table)} measured values. Intervals: 95 %, linearised"
    return write_fit(Path(out), title, provenance, files, sections, said)


def impacts_dataset(fit: SurfaceFit) -> xarray.Dataset:
    """Gives measured and fitted angles and spins over `measurement`."""
    import xarray

    table, m = fit.problem.table, len(fit.problem.table)
    angle, spin = (fit.result.residuals[part] for part in (slice(0, m), slice(m, 2 * m)))
    columns = {
        "speed": (table.speeds, "m/s", "speed of approach"),
        "incidence": (table.incidence, "degrees", "incidence from the normal"),
        "spin_before": (table.spin, "rpm", "spin before"),
        "angle_measured": (table.angle, "degrees", "measured rebound angle"),
        "angle_modelled": (table.angle + angle, "degrees", "fitted rebound angle"),
        "angle_sd": (table.angle_sd, "degrees", "standard deviation of the angle"),
        "spin_measured": (table.spin_after, "rpm", "measured spin after"),
        "spin_modelled": (table.spin_after + spin, "rpm", "fitted spin after"),
        "spin_sd": (table.spin_sd, "rpm", "standard deviation of the spin"),
        "sliding": (fit.sliding, "1", "share of the contact spent sliding"),
    }
    return xarray.Dataset(
        {
            name: labelled(("measurement",), values, unit, text)
            for name, (values, unit, text) in columns.items()
        },
        coords={"measurement": np.arange(m)},
    )


def spin_fit_figure(dataset: xarray.Dataset, title: str = "") -> Figure:
    """Draws fitted over measured angles and spins; bars are two standard deviations."""
    figure = new_figure(9.0, 4.2)
    for axes, (name, unit) in zip(
        figure.subplots(1, 2), (("angle", "°"), ("spin", "rpm")), strict=True
    ):
        measured, modelled = dataset[f"{name}_measured"], dataset[f"{name}_modelled"]
        ends = [float(f(xs)) for f, xs in ((np.min, measured), (np.max, measured))]
        axes.plot(ends, ends, color=GREY, lw=0.8)
        grips = dataset["sliding"].to_numpy() < 1.0 - 1e-9
        for mask, colour, text in ((grips, BLUE, "grips"), (~grips, VERMILION, "only slides")):
            axes.errorbar(
                measured[mask],
                modelled[mask],
                xerr=2.0 * dataset[f"{name}_sd"][mask],
                fmt="o",
                ms=4,
                capsize=2,
                color=colour,
                label=text,
            )
        axes.set(xlabel=f"measured {name} ({unit})", ylabel=f"fitted {name} ({unit})")
        tidy(axes)
    axes.legend(frameon=False)
    figure.suptitle(as_written(title))
    return figure
