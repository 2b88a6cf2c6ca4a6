"""One impact, from its history alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

from drake_racket.plots.style import BLUE, GREEN, VERMILION


def impact_figure(history: xarray.Dataset) -> Figure:
    """One impact in four panels: force, ball and strings, throat joint, mid-handle acceleration."""
    from matplotlib.figure import Figure

    time = history["time"].to_numpy() * 1e3
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    force, motion, joint, handle = figure.subplots(2, 2).flat
    contact = _contact_window(history)
    # the first row is about the contact, the second about the ringing after it
    near = (time >= contact[0] - 1.0) & (time <= contact[1] + 3.0)

    force.plot(time[near], history["normal_force"][near], color=BLUE, label="normal")
    for part, colour in (("x", VERMILION), ("y", GREEN)):
        friction = history[f"friction_{part}"]
        if float(np.abs(friction).max()) > 0.01 * float(history["normal_force"].max()):
            force.plot(time[near], friction[near], color=colour, ls="--", label=f"friction, {part}")
    force.set(ylabel="force on the ball (N)", title="Contact force")
    force.legend(frameon=False)

    height = _height_over_head(history)
    point = int(history["contact_point"].to_numpy()[_middle(history)])
    string = history["string_deflection"].sel(point=point).to_numpy()
    motion.plot(time[near], 1e3 * height[near], color=VERMILION, label="ball")
    motion.plot(time[near], 1e3 * string[near], color=BLUE, label=f"string mass at point {point}")
    lowest = 1e3 * float(min(height[near].min(), string[near].min()))
    motion.set(
        ylabel="height over the string plane (mm)",
        title="Ball and strings, seen from the head",
        ylim=(1.25 * lowest, -1.5 * lowest),
    )
    motion.legend(frameon=False)

    for name, colour, style in (("out_of_plane", BLUE, "-"), ("in_plane", VERMILION, "--")):
        angle = np.degrees(history[f"{name}_angle"].to_numpy())
        joint.plot(time, angle, color=colour, ls=style, label=name.replace("_", " "))
    joint.set(ylabel="angle (deg)", title="Bending at the throat joint")
    joint.legend(frameon=False)

    acceleration = history["handle_acceleration"]
    styles = (("x", GREEN, ":"), ("y", VERMILION, "--"), ("z", BLUE, "-"))
    for axis, colour, style in styles:
        handle.plot(time, acceleration.sel(axis=axis), color=colour, ls=style, label=axis)
    handle.set(ylabel="acceleration (m/s²)", title="Mid-handle acceleration, handle axes")
    handle.legend(frameon=False)

    for axes in (force, motion, joint, handle):
        axes.axvspan(*contact, color="0.92", lw=0, zorder=0)
        axes.set_xlabel("time from touch (ms)")
        axes.spines[["top", "right"]].set_visible(False)
    figure.suptitle(history.attrs["title"] + " (shaded: in contact)")
    return figure


def _contact_window(history: xarray.Dataset) -> tuple[float, float]:
    """First touch and last release (ms); (0, 0) if the ball did not touch."""
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
