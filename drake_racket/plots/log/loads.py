"""Loads of one log: on the hand, and at the joints of the limb."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.plots.log.impact import draw_vector, finish_time_axis, title_of
from drake_racket.plots.style import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    as_written,
    new_figure,
)

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, "black")
_LINES = ("-", "--", ":", "-.")
_DEGREES = 180.0 / np.pi
_HAND = {
    "hand_force": (1.0, "force (N)", "Racket on the hand: force, hand axes"),
    "hand_torque": (1.0, "torque (N m)", "Racket on the hand: torque, hand axes"),
    "grip_angle": (_DEGREES, "angle (deg)", "Racket in the hand: roll (x), pitch (y), yaw (z)"),
}
_JOINTS = {
    "joint_position": (_DEGREES, "angle (deg)", "Joint angles, from those at the start"),
    "joint_torque": (1.0, "torque (N m)", "Torques applied at the joints"),
    "joint_reaction_force": (1.0, "force (N)", "Reaction forces of the joints (some coincide)"),
}


def loads_figure(history: xarray.Dataset) -> Figure:
    """Draws a column for the hand and one for the limb's joints, as far as the log has them."""
    hand = [n for n in _HAND if n in history and np.isfinite(history[n]).all()]
    joints = [n for n in _JOINTS if n in history and np.isfinite(history[n]).all()]
    columns = [names for names in (hand, joints) if names]
    rows = max(len(names) for names in columns)
    figure = new_figure(6.2 * len(columns), 0.8 + 2.7 * rows)
    panels = figure.subplots(rows, len(columns), squeeze=False)
    for names, column in zip(columns, panels.T, strict=True):
        for name, axes in zip(names, column, strict=False):
            _draw_panel(axes, history, name)
        for axes in column[len(names) :]:
            axes.set_axis_off()
    if joints:
        handles, labels = panels[0, -1].get_legend_handles_labels()
        figure.legend(
            handles, labels, loc="outside lower right", ncols=4, frameon=False, fontsize=8
        )
    gap = " " if len(columns) > 1 else "\n"
    figure.suptitle(f"{title_of(history)}: loads{gap}(shaded: in contact)")
    return figure


def _draw_panel(axes: Any, history: xarray.Dataset, name: str) -> None:
    if name in _HAND:
        scale, label, title = _HAND[name]
        draw_vector(axes, history[name], scale)
        axes.legend(frameon=False, fontsize=8, ncols=3)
    else:
        scale, label, title = _JOINTS[name]
        _draw_joints(axes, history, name, scale)
    axes.set_ylabel(label)
    axes.set_title(title, fontsize=10)
    finish_time_axis(axes, history)


def _draw_joints(axes: Any, history: xarray.Dataset, name: str, scale: float) -> None:
    """One line per joint; those that slide have other units and are left out."""
    time = history["time"].to_numpy() * 1e3
    sliding = json.loads(history["joint"].attrs.get("prismatic", "[]"))
    for i, joint in enumerate(history["joint"].to_numpy()):
        if joint in sliding and name != "joint_reaction_force":
            continue
        values = scale * history[name].sel(joint=joint).to_numpy()
        if name == "joint_position":
            values = values - values[0]
        colour, line = _COLOURS[i % len(_COLOURS)], _LINES[(i // len(_COLOURS)) % len(_LINES)]
        axes.plot(time, values, color=colour, ls=line, label=as_written(joint).replace("_", " "))
