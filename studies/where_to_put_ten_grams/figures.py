"""The figure: what the mass changes, place by place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.plots import BLUE, GREY, VERMILION, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PANELS = (  # columns, factor, what the axis says
    (("swingweight [kg*m^2]",), 1e4, "swingweight (kg cm²)"),
    (("twistweight [kg*m^2]",), 1e4, "twistweight (kg cm²)"),
    (
        ("same rate, centre [m/s]", "same effort, centre [m/s]"),
        1.0,
        "ball speed, centre (m/s)",
    ),
    (("restitution side [1]",), 1.0, "restitution at the side"),
    (("peak force on hand [N]",), 1.0, "peak force on hand (N)"),
)


def places_figure(rows: Sequence[Mapping[str, Any]], mass: float) -> Figure:
    """Changes from the racket as it is, a panel a number, a line a place."""
    before, after = rows[0], rows[1:]
    names = [str(row["place"]) for row in after]
    place = np.arange(len(names))[::-1]
    figure = new_figure(12.0, 1.9 + 0.34 * len(names))
    panels = figure.subplots(1, len(_PANELS), sharey=True)
    for axes, (columns, factor, label) in zip(panels, _PANELS, strict=True):
        for column, colour, mark in zip(columns, (BLUE, VERMILION), ("o", "D"), strict=False):
            change = [factor * (float(row[column]) - float(before[column])) for row in after]
            text = column.split(",")[0] if len(columns) > 1 else None
            axes.plot(change, place, mark, color=colour, ms=6, label=text)
        axes.axvline(0.0, color=GREY, lw=0.8, zorder=0)
        axes.margins(x=0.15, y=0.08)
        axes.set_xlabel(f"change of\n{label}", fontsize=9)
        axes.grid(axis="y", color="0.92")
        tidy(axes)
        if len(columns) > 1:
            axes.legend(
                frameon=False, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=1
            )
    panels[0].set_yticks(place, names)
    figure.suptitle(f"{1e3 * mass:g} g at one place: what changes")
    return figure
