"""Draws where the energy of one log goes, over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.plots.log.impact import finish_time_axis, near_contact, title_of
from drake_racket.plots.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    new_figure,
)

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

# store -> label, colour, line; what moves on its own is shown as its change from the first sample
_STORES = {
    "ball": ("ball's motion", VERMILION, "-"),
    "contact": ("ball's compression", ORANGE, "-"),
    "strings": ("strings", GREEN, "-"),
    "rigid_motion": ("racket's rigid motion", BLUE, "-"),
    "bending": ("frame's vibration", PURPLE, "-"),
    "grip": ("gone into the hand", "black", "--"),
    "limb": ("limb (change)", SKY, "--"),
    "gravity": ("gravity (change)", GREY, ":"),
    "torque_work": ("work of joint torques", "black", "-."),
}
_LOST = {
    "lost_ball": ("in the ball", VERMILION, "-"),
    "lost_friction": ("by friction", ORANGE, "--"),
    "lost_joint": ("in the frame's dampers", PURPLE, "-."),
    "lost_strings": ("in the strings", GREEN, ":"),
    "lost_limb": ("in the limb", SKY, "--"),
    "couple": ("gained from the couple", "black", ":"),
}
_CHANGES = ("limb", "gravity")
_SMALL = 2e-3  # of the largest in the panel: not drawn


def energy_figure(history: xarray.Dataset) -> Figure:
    """Stores above, losses so far below; around the contact on the left, the whole log right."""
    energy = history["energy"]
    figure = new_figure(10.5, 7.0)
    panels = figure.subplots(2, 2, sharey="row")
    left_out = []
    for row, table in zip(panels, (_STORES, _LOST), strict=True):
        left_out += _draw_rows(row, history, energy, table)
    for axes in panels.flat:
        finish_time_axis(axes, history)
        axes.axhline(0.0, color="0.8", lw=0.8, zorder=0)
    panels[0, 0].set(ylabel="energy (J)", title="Around the contact")
    panels[0, 1].set_title("The whole log")
    panels[1, 0].set_ylabel("lost since the start (J)")
    figure.suptitle(f"{title_of(history)}: energy (shaded: in contact)")
    if left_out:
        figure.supxlabel("below 0.2 % and not drawn: " + ", ".join(left_out), fontsize=8)
    return figure


def _draw_rows(
    row: Any, history: xarray.Dataset, energy: xarray.DataArray, table: dict[str, Any]
) -> list[str]:
    """Draws one row; returns the labels of what is too small to show."""
    time, near = near_contact(history)
    curves, small = {}, []
    for store in table:
        if store in energy["store"].to_numpy():
            values = energy.sel(store=store).to_numpy()
            curves[store] = values - values[0] if store in _CHANGES else values
    largest = max((float(np.abs(v).max()) for v in curves.values()), default=0.0)
    for store, values in curves.items():
        label, colour, style = table[store]
        if float(np.abs(values).max()) <= _SMALL * largest:
            if np.any(values != 0.0):
                small.append(label)
            continue
        row[0].plot(time[near], values[near], color=colour, ls=style)
        row[1].plot(time, values, color=colour, ls=style, label=label)
    if row[1].lines:
        row[1].legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return small
