"""Pictures of the fits on the clamped head: restitution, rebound angle, estimates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.identify.core.estimate import Estimate
from drake_racket.plots.style import BLUE, GREY, VERMILION, as_written, new_figure, tidy

WIDEST = 1.0 / 15.0, 15.0
"""What `estimates_figure` shows at most, over the reference."""

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


def restitution_fit_figure(fit: xarray.Dataset, title: str = "") -> Figure:
    """Draws measured and fitted restitution over speed, a panel per point, as they lie on the bed.

    Args:
        fit: as `StringBedFit.to_dataset` gives it. Bars are two standard deviations.

    """
    figure = new_figure(8.0, 7.0)
    panels = figure.subplots(3, 3, sharex=True, sharey=True)
    for point, axes in enumerate(panels.flat, start=1):
        rows = fit.isel(measurement=np.flatnonzero(fit["point"].to_numpy() == point))
        rows = rows.sortby("approach_speed")
        speed = rows["approach_speed"].to_numpy()
        bars = 2.0 * rows["sigma"].to_numpy() if "sigma" in rows else None
        style: dict[str, Any] = {"color": BLUE, "marker": "o", "ms": 4, "ls": "none"}
        axes.errorbar(
            speed, rows["restitution_measured"], yerr=bars, capsize=2, label="measured", **style
        )
        axes.plot(speed, rows["restitution_modelled"], color=VERMILION, lw=1.4, label="fitted")
        if not len(speed):
            axes.text(0.5, 0.5, "no impacts", transform=axes.transAxes, ha="center", color=GREY)
        axes.set_title(f"point {point}", fontsize="medium")
        tidy(axes)
    for axes in panels[-1]:
        axes.set_xlabel("approach speed (m/s)")
    for axes in panels[:, 0]:
        axes.set_ylabel("restitution")
    handles, labels = panels.flat[int(fit["point"][0]) - 1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper", frameon=False)
    figure.suptitle(title or as_written(fit.attrs["title"]), fontsize="large")
    return figure


def angle_fit_figure(fit: xarray.Dataset, title: str = "") -> Figure:
    """Draws the measured and fitted rebound angles by point, a panel per direction of approach.

    Args:
        fit: as `FrictionFit.to_dataset` gives it. Bars are two standard deviations.

    """
    directions = np.stack([fit["incidence"].to_numpy(), fit["azimuth"].to_numpy()], axis=1)
    kinds = np.unique(directions, axis=0)
    columns = min(len(kinds), 3)
    lines = -(-len(kinds) // columns)
    figure = new_figure(4.2 * columns + 1.6, 3.4 * lines + 0.4)
    panels = figure.subplots(lines, columns, squeeze=False)
    for kind, axes in zip(kinds, panels.flat, strict=False):
        rows = fit.isel(measurement=np.flatnonzero((directions == kind).all(axis=1)))
        point, slides = rows["point"].to_numpy(), rows["sliding"].to_numpy() > 0
        bars = 2.0 * rows["sigma"].to_numpy() if "sigma" in rows else None
        style: dict[str, Any] = {"color": BLUE, "marker": "o", "ms": 4, "ls": "none"}
        measured = rows["rebound_angle_measured"]
        axes.errorbar(point - 0.08, measured, yerr=bars, capsize=2, label="measured", **style)
        fitted = rows["rebound_angle_modelled"].to_numpy()
        for chosen, marker, label in (
            (slides, "D", "fitted, sliding"),
            (~slides, "x", "fitted, sliding has stopped"),
        ):
            if chosen.any():
                look = {"color": VERMILION, "marker": marker, "ms": 5, "ls": "none"}
                axes.plot(point[chosen] + 0.08, fitted[chosen], label=label, **look)
        axes.set_title(f"{kind[0]:g}° from the normal, azimuth {kind[1]:g}°", fontsize="medium")
        axes.set_xticks(range(1, 10))
        axes.set_xlabel("string-bed point")
        tidy(axes)
    for axes in list(panels.flat)[len(kinds) :]:
        axes.set_visible(False)
    for axes in panels[:, 0]:
        axes.set_ylabel("rebound angle from the normal (°)")
    entries: dict[str, Any] = {}
    for axes in list(panels.flat)[: len(kinds)]:
        handles, labels = axes.get_legend_handles_labels()
        entries |= dict(zip(labels, handles, strict=True))
    figure.legend(entries.values(), entries.keys(), loc="outside right upper", frameon=False)
    figure.suptitle(title or as_written(fit.attrs["title"]), fontsize="large")
    return figure


def estimates_figure(
    found: Mapping[str, Estimate],
    reference: Mapping[str, float],
    label: str = "value the fit began at",
    title: str = "",
) -> Figure:
    """Draws the estimates with their 95 % intervals, over reference values.

    An arrow is an interval that goes on beyond the picture, or has no end.

    Args:
        reference: by name: the start, or the true value.
        label: what the reference is, for the axis.

    """
    spans = np.array([[*e.interval, e.value] for e in found.values()])
    spans = spans / np.array([[reference[name]] for name in found])
    low = 0.95 * float(np.clip(np.nanmin(spans), *WIDEST))
    high = 1.05 * float(np.clip(np.nanmax(spans), *WIDEST))
    figure = new_figure(6.4, 0.34 * len(found) + 1.3)
    axes = figure.subplots()
    for row, (name, estimate) in enumerate(found.items()):
        base = reference[name]
        ends = spans[row, :2]
        shown = np.clip(np.nan_to_num(ends, nan=high, posinf=1e9, neginf=-1e9), low, high)
        axes.plot(shown, [row, row], color=BLUE, lw=1.8, solid_capstyle="butt")
        for end, at, marker in ((ends[0], low, "<"), (ends[1], high, ">")):
            if not low <= end <= high:
                axes.plot(at, row, marker, color=BLUE, ms=6, clip_on=False)
        axes.plot(estimate.value / base, row, "o", color=VERMILION, ms=6)
    axes.axvline(1.0, color=GREY, lw=0.9, ls="--", zorder=0)
    if high > 3.0 * low:
        axes.set_xscale("log")
        ticks = [t for t in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0) if low <= t <= high]
        axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
        axes.minorticks_off()
    axes.set_xlim(low, high)
    axes.set_yticks(range(len(found)), list(found))
    axes.invert_yaxis()
    axes.set_xlabel(f"estimate and 95 % interval, over the {label}")
    axes.set_title(title, fontsize="medium")
    tidy(axes)
    return figure
