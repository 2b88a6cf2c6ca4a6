"""Draws what comes back of a ball that spins: over incidence, for several frictions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drake_racket.plots.style import CYCLE, GREY, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


def spin_figure(dataset: xarray.Dataset, *, title: str = "") -> Figure:
    """Draws spin, angle and sliding over incidence; data from `rigs.spin`."""
    figure = new_figure(11.0, 3.9)
    panels = figure.subplots(1, 3)
    for axes, (name, label, scale) in zip(
        panels,
        (
            ("spin", "spin after (rpm)", 1.0),
            ("angle", "rebound angle from the normal (°)", 1.0),
            ("sliding", "share of the contact spent sliding (%)", 100.0),
        ),
        strict=True,
    ):
        for i, mu in enumerate(dataset["friction"].to_numpy()):
            axes.plot(
                dataset["incidence"],
                scale * dataset[name].sel(friction=mu),
                color=CYCLE[i % len(CYCLE)],
                label=f"mu {mu:g}",
            )
        axes.axvline(17.0, color=GREY, lw=0.8, ls=":")
        axes.set_xlabel("incidence from the normal (°)")
        axes.set_ylabel(label)
        tidy(axes)
    panels[0].legend(frameon=False, fontsize=8)
    figure.suptitle(title)
    return figure
