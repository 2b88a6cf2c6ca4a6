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
    """Draws stores above and losses so far below, over one time axis.

    The contact takes half of the axis, and what is left of the log the other half.
    """
    energy = history["energy"]
    figure = new_figure(9.6, 7.0)
    panels = figure.subplots(2, 1)
    left_out = []
    for axes, table in zip(panels, (_STORES, _LOST), strict=True):
        left_out += _draw(axes, history, energy, table)
        finish_time_axis(axes, history)
        axes.axhline(0.0, color="0.8", lw=0.8, zorder=0)
        _stretch_contact(axes, history)
    panels[0].set(ylabel="energy (J)", title="Where it is")
    panels[1].set(ylabel="lost since the start (J)", title="Where it went")
    figure.suptitle(f"{title_of(history)}: energy (shaded: in contact)")
    if left_out:
        figure.supxlabel("below 0.2 % and not drawn: " + ", ".join(left_out), fontsize=8)
    return figure


def _draw(
    axes: Any, history: xarray.Dataset, energy: xarray.DataArray, table: dict[str, Any]
) -> list[str]:
    """Draws one panel; returns the labels of what is too small to show."""
    time = 1e3 * history["time"].to_numpy()
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
        axes.plot(time, values, color=colour, ls=style, label=label)
    if axes.lines:
        axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return small


def _stretch_contact(axes: Any, history: xarray.Dataset) -> None:
    """Gives the contact and 3 ms after it half of the time axis, where the log is longer."""
    time, near = near_contact(history)
    first, turn, last = float(time[0]), float(time[near][-1]), float(time[-1])
    axes.set_xlim(first, last)
    if not near.any() or last - turn <= turn - first:
        return
    rate = (turn - first) / (last - turn)

    def forward(t: Any) -> Any:
        return np.where(t <= turn, t, turn + rate * (t - turn))

    def back(u: Any) -> Any:
        return np.where(u <= turn, u, turn + (u - turn) / rate)

    from matplotlib.ticker import MaxNLocator

    axes.set_xscale("function", functions=(forward, back))
    early = MaxNLocator(5, steps=[1, 2, 5, 10]).tick_values(first, turn)
    late = MaxNLocator(4, steps=[1, 2, 5, 10]).tick_values(turn, last)
    room = 0.12 * (last - turn)
    ticks = [t for t in early if first <= t <= turn]
    ticks += [t for t in late if turn + room <= t <= last]
    axes.set_xticks(ticks)
    axes.axvline(turn, color="0.6", lw=1.0, ls=(0, (2, 2)), zorder=0)
    axes.set_xlabel("time from touch (ms; narrower beyond the dashed line)")
