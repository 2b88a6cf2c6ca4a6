"""Maps over incidence and spin before: what comes back, and what friction changes of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from drake_racket.plots import new_figure

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

SHOWN = (
    ("rebound_speed", 1.0, "rebound speed (m/s)"),
    ("rebound_angle_y", 180.0 / np.pi, "rebound angle (°)"),
    ("spin_after_rpm", 1.0, "spin after (rpm)"),
)


def maps_figure(dataset: xarray.Dataset, speed: float) -> Figure:
    """Speed, angle and spin after of a free racket (above), and what friction moves (below).

    Args:
        dataset: over (support, friction, spin_rpm, incidence_deg).  speed: m/s.

    """
    figure = new_figure(12.0, 7.4)
    panels = figure.subplots(2, 3, sharex=True, sharey=True)
    free = dataset.sel(support="free").transpose("friction", "spin_rpm", "incidence_deg")
    frictions = free["friction"].to_numpy()
    middle = frictions[len(frictions) // 2 - 1]
    x, y = free["incidence_deg"].to_numpy(), free["spin_rpm"].to_numpy()
    for column, (name, scale, label) in enumerate(SHOWN):
        values = scale * free[name].sel(friction=middle).to_numpy()
        change = scale * (free[name][-1] - free[name][0]).to_numpy()
        most = float(np.max(np.abs(change)))
        levels = np.linspace(-most, most, 13)
        for axes, data, colours, steps, text in (
            (panels[0, column], values, "viridis", 12, label),
            (panels[1, column], change, "PuOr", levels, f"change of {label}"),
        ):
            drawn = axes.contourf(x, y, data, steps, cmap=colours)
            lines = axes.contour(x, y, data, 6, colors="0.2", linewidths=0.5)
            axes.clabel(lines, fontsize=7)
            figure.colorbar(drawn, ax=axes)
            axes.set_title(text, fontsize=10)
    for axes in panels[1]:
        axes.set_xlabel("incidence from the normal (°)")
    for axes, text in zip(
        panels[:, 0],
        (f"mu {middle:g}", f"mu {frictions[-1]:g} less mu {frictions[0]:g}"),
        strict=True,
    ):
        axes.set_ylabel(f"{text}\nspin before (rpm)")
    figure.suptitle(f"Free tour racket, centre, {speed:g} m/s; spin positive as friction turns it")
    return figure
