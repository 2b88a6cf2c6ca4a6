"""Draws one impact from its history alone: an overview, and panels that other figures share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

from drake_racket.plots.style import BLUE, GREEN, VERMILION, as_written

AXIS_STYLES = (("x", GREEN, ":"), ("y", VERMILION, "--"), ("z", BLUE, "-"))
"""Component, colour and line of a vector's three curves."""


def impact_figure(history: xarray.Dataset) -> Figure:
    """Draws one impact in four panels: force, ball and strings, throat joint, acceleration."""
    from drake_racket.plots.notebook_figure import NotebookFigure

    figure = NotebookFigure(figsize=(9.0, 7.0))
    # margins by hand: to find them matplotlib would draw everything twice
    margins = {"left": 0.08, "right": 0.985, "bottom": 0.075, "top": 0.9}
    grid = margins | {"wspace": 0.26, "hspace": 0.36}
    force, motion, joint, handle = figure.subplots(2, 2, gridspec_kw=grid).flat
    # the first row is about the contact, the second about the ringing after it
    draw_contact_force(force, history)
    draw_ball_and_strings(motion, history)
    _draw_bending(joint, history)
    draw_vector(handle, history["handle_acceleration"])
    handle.set(ylabel="acceleration (m/s²)", title="Mid-handle acceleration, handle axes")
    for axes in (force, motion, joint, handle):
        finish_time_axis(axes, history)
    figure.suptitle(title_of(history) + " (shaded: in contact)")
    return figure


def title_of(history: xarray.Dataset) -> str:
    """Gives the history's title; a CSV does not keep it."""
    return as_written(history.attrs.get("title", "Impact"))


def finish_time_axis(axes: Any, history: xarray.Dataset) -> None:
    """Shades the contact, names the time, and takes the frame's top and right side away."""
    axes.axvspan(*contact_window(history), color="0.92", lw=0, zorder=0)
    axes.set_xlabel("time from touch (ms)")
    axes.spines[["top", "right"]].set_visible(False)


def draw_contact_force(axes: Any, history: xarray.Dataset) -> None:
    """Draws the normal force and, where there is some, friction, around the contact."""
    time, near = near_contact(history)
    axes.plot(time[near], history["normal_force"][near], color=BLUE, label="normal")
    for part, colour in (("x", VERMILION), ("y", GREEN)):
        friction = history[f"friction_{part}"]
        if float(np.abs(friction).max()) > 0.01 * float(history["normal_force"].max()):
            axes.plot(time[near], friction[near], color=colour, label=f"friction, {part}")
    axes.set(ylabel="force on the ball (N)", title="Contact force")
    _note_step(axes, history)
    legend_above(axes)


def _note_step(axes: Any, history: xarray.Dataset) -> None:
    """Says what the force jumps to at touch: the ball's damper acts at once."""
    force, inside = history["normal_force"].to_numpy(), history["in_contact"].to_numpy() > 0.5
    if not inside.any():
        return
    first = float(force[inside][0])
    if first > 0.03 * float(force.max()):
        axes.text(
            0.99,
            0.6,
            f"step to {first:.0f} N at touch:\nthe ball's damper\nacts at once",
            transform=axes.transAxes,
            ha="right",
            va="center",
            fontsize=7.5,
            color="0.35",
        )


def draw_ball_and_strings(axes: Any, history: xarray.Dataset) -> None:
    """Heights over the string plane of the ball and of the string mass that it meets."""
    time, near = near_contact(history)
    height = _height_over_head(history)
    point = int(history["contact_point"].to_numpy()[_middle(history)])
    string = history["string_deflection"].sel(point=point).to_numpy()
    axes.plot(time[near], 1e3 * height[near], color=VERMILION, label="ball centre")
    axes.plot(time[near], 1e3 * string[near], color=BLUE, label=f"string mass at point {point}")
    lowest = 1e3 * float(min(height[near].min(), string[near].min()))
    axes.set(
        ylabel="height over the string plane (mm)",
        title="Ball and strings, seen from the head",
        ylim=(1.25 * lowest, -2.0 * lowest),
    )
    axes.legend(frameon=False, loc="upper center", ncols=2, fontsize=9)


def _draw_bending(axes: Any, history: xarray.Dataset) -> None:
    time = history["time"].to_numpy() * 1e3
    for name, colour, style in (("out_of_plane", BLUE, "-"), ("in_plane", VERMILION, "--")):
        angle = np.degrees(history[f"{name}_angle"].to_numpy())
        axes.plot(time, angle, color=colour, ls=style, label=name.replace("_", " "))
    axes.set(ylabel="angle (deg)", title="Bending at the throat joint")
    legend_above(axes)


def draw_vector(axes: Any, vector: xarray.DataArray, scale: float = 1.0) -> None:
    """Draws the three components of a vector over the whole time; `scale` multiplies them."""
    time = vector["time"].to_numpy() * 1e3
    for axis, colour, style in AXIS_STYLES:
        axes.plot(time, scale * vector.sel(axis=axis), color=colour, ls=style, label=axis)
    legend_above(axes)


def legend_above(axes: Any) -> None:
    """Puts the legend in a strip above the curves."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.18 * (high - low))
    axes.legend(frameon=False, loc="upper right", ncols=3, fontsize=9)


def near_contact(history: xarray.Dataset) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Gives all times (ms), and which are from 1 ms before the contact to 3 ms after it."""
    time = history["time"].to_numpy() * 1e3
    contact = contact_window(history)
    return time, (time >= contact[0] - 1.0) & (time <= contact[1] + 3.0)


def contact_window(history: xarray.Dataset) -> tuple[float, float]:
    """Gives the first touch and last release (ms); (0, 0) if the ball did not touch."""
    inside = np.flatnonzero(history["in_contact"].to_numpy())
    if len(inside) == 0:
        return 0.0, 0.0
    time = history["time"].to_numpy() * 1e3
    return float(time[inside[0]]), float(time[min(inside[-1] + 1, len(time) - 1)])


def _middle(history: xarray.Dataset) -> int:
    inside = np.flatnonzero(history["in_contact"].to_numpy())
    return int(inside[len(inside) // 2]) if len(inside) else 0


def _height_over_head(history: xarray.Dataset) -> Any:
    """Height (m) of the ball over the string plane: its point's deflection less compression."""
    points = history["contact_point"].to_numpy().astype(int)
    deflection = history["string_deflection"].to_numpy()
    at_point = deflection[np.arange(len(points)), points - 1]
    return at_point - history["compression"].to_numpy()
