"""Draws a ball's spin in one log, and how its surface goes over the strings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from drake_racket.parameters.scenario import RPM
from drake_racket.plots.log.impact import AXIS_STYLES, finish_time_axis, near_contact, title_of
from drake_racket.plots.style import BLUE, GREY, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


def spin_figure(history: xarray.Dataset) -> Figure:
    """Draws spin, shear and the surface's velocity around the contact, with where it grips."""
    figure = new_figure(11.0, 3.9)
    spin, velocity, force = figure.subplots(1, 3)
    time, near = near_contact(history)
    values = history["ball_spin"].to_numpy()[near] / RPM
    for column, (letter, colour, style) in zip(values.T, AXIS_STYLES, strict=True):
        spin.plot(time[near], column, color=colour, ls=style, label=letter)
    spin.set(ylabel="spin (rpm)", title="Spin of the ball")
    for axes, names, label, title in (
        (velocity, ("sliding_x", "sliding_y"), "m/s", "Surface over the strings"),
        (force, ("friction_x", "friction_y"), "N", "Friction on the ball"),
    ):
        for name, (letter, colour, style) in zip(names, AXIS_STYLES, strict=False):
            inside = history["in_contact"].to_numpy()[near] > 0.5
            drawn = np.where(inside, history[name].to_numpy()[near], np.nan)
            axes.plot(time[near], drawn, color=colour, ls=style, label=letter)
        axes.set(ylabel=label, title=title)
    for axes in (spin, velocity, force):
        finish_time_axis(axes, history)
        grips = history["gripping"].to_numpy()[near] > 0.5
        low, high = axes.get_ylim()
        axes.fill_between(time[near], low, high, where=grips, color=BLUE, alpha=0.12, lw=0)
        axes.set_ylim(low, high)
        axes.axhline(0.0, color=GREY, lw=0.6)
        axes.legend(frameon=False, fontsize=8)
        tidy(axes)
    figure.suptitle(f"{title_of(history)}: spin (shaded: in contact, blue: gripping)")
    return figure
