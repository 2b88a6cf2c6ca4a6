"""Draws what each stroke does at each place on the strings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from drake_racket.plots import BLUE, GREY, VERMILION, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLES = ((GREY, "s"), (BLUE, "o"), (VERMILION, "D"))


def strokes_figure(rows: Sequence[Mapping[str, float | str]]) -> Figure:
    """Ball speed and rise by place, a mark for each stroke."""
    figure = new_figure(9.0, 3.8)
    panels = figure.subplots(1, 2)
    places = list(dict.fromkeys(str(r["place"]) for r in rows))
    strokes = list(dict.fromkeys(str(r["stroke"]) for r in rows))
    for axes, column, label in zip(
        panels,
        ("ball speed [m/s]", "rise [degrees]"),
        ("ball speed (m/s)", "rise above the horizontal (degrees)"),
        strict=True,
    ):
        for stroke, (colour, mark) in zip(strokes, _STYLES, strict=False):
            own = {str(r["place"]): float(r[column]) for r in rows if r["stroke"] == stroke}
            axes.plot(places, [own[p] for p in places], mark, color=colour, ms=6, label=stroke)
        axes.set_ylabel(label)
        axes.set_xlabel("where the ball meets the strings")
        axes.grid(axis="y", color="0.92")
        axes.margins(x=0.1, y=0.12)
        tidy(axes)
    panels[0].legend(frameon=False, fontsize="small", title="stroke", loc="best")
    return figure
