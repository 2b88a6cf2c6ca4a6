"""The figure: changes of every output in per cent, a line a change."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from drake_racket.plots import BLUE, GREY, VERMILION, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

_TITLES = {
    "restitution": "ball speed",
    "contact_time": "contact time",
    "peak_hand_force": "peak force\non the hand",
    "peak_hand_torque": "peak torque\non the hand",
    "handle_ringing": "ringing of\nthe handle",
}
_PLACES = {5: "ball at the centre", 2: "ball towards the tip"}


def changes_figure(dataset: xarray.Dataset, outputs: Sequence[str]) -> Figure:
    """Per cent from the racket as it is; data over (change, point)."""
    names = [str(name) for name in dataset["change"].to_numpy()][1:]
    place = np.arange(len(names))[::-1]
    figure = new_figure(12.0, 1.9 + 0.36 * len(names))
    panels = figure.subplots(1, len(outputs), sharey=True)
    styles = zip(dataset["point"].to_numpy(), (BLUE, VERMILION), ("o", "D"), strict=False)
    for point, colour, mark in styles:
        for axes, output in zip(panels, outputs, strict=True):
            values = dataset[output].sel(point=point).to_numpy()
            change = 100.0 * (values[1:] / values[0] - 1.0)
            axes.plot(change, place, mark, color=colour, ms=6, label=_PLACES[int(point)])
    for axes, output in zip(panels, outputs, strict=True):
        axes.axvline(0.0, color=GREY, lw=0.8, zorder=0)
        axes.margins(x=0.15, y=0.06)
        axes.set_title(_TITLES[output], fontsize=10)
        axes.set_xlabel("change (%)", fontsize=9)
        axes.grid(axis="y", color="0.92")
        tidy(axes)
    panels[0].set_yticks(place, names)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle("Racket in a hand: one thing changed at a time")
    return figure
