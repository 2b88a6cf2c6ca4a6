"""Draws several logs over each other: contact, strings, handle, and the hand if all have one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.plots.log.impact import contact_window
from drake_racket.plots.style import CYCLE, as_written, new_figure, tidy

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

MOST = len(CYCLE)
"""Logs in one figure."""

_STYLES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)))


def overlay_figure(logs: Mapping[str, xarray.Dataset]) -> Figure:
    """Draws the same four curves of every log on common axes.

    Args:
        logs: label -> history.

    """
    figure = new_figure(10.0, 7.4)
    panels = figure.subplots(2, 2)
    held = all("hand_force" in log for log in logs.values())
    last = _hand if held else _bending
    release = max(contact_window(log)[1] for log in logs.values())
    curves: tuple[tuple[str, str, Callable[[Any], Any], bool], ...] = (
        ("Contact force", "normal force (N)", lambda log: log["normal_force"].to_numpy(), True),
        ("String-bed, deepest point", "deflection (mm)", _deepest, True),
        ("Mid-handle, along the strings' normal", "acceleration (m/s²)", _handle, False),
        (*_LAST[last], last, False),
    )
    for axes, (title, label, read, near) in zip(panels.flat, curves, strict=True):
        for (name, log), colour, style in zip(logs.items(), CYCLE, _STYLES, strict=False):
            time, values = 1e3 * log["time"].to_numpy(), read(log)
            shown = time <= release + 3.0 if near else np.ones(len(time), dtype=bool)
            axes.plot(
                time[shown], values[shown], color=colour, ls=style, lw=1.4, label=as_written(name)
            )
        axes.set(title=title, xlabel="time from touch (ms)", ylabel=label)
        tidy(axes)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=9)
    figure.suptitle(f"{len(logs)} impacts on common scales")
    return figure


def _deepest(log: xarray.Dataset) -> NDArray[np.float64]:
    return np.asarray(1e3 * np.abs(log["string_deflection"].to_numpy()).max(axis=1))


def _handle(log: xarray.Dataset) -> NDArray[np.float64]:
    return np.asarray(log["handle_acceleration"].sel(axis="z").to_numpy())


def _hand(log: xarray.Dataset) -> NDArray[np.float64]:
    return np.asarray(np.linalg.norm(log["hand_force"].to_numpy(), axis=1))


def _bending(log: xarray.Dataset) -> NDArray[np.float64]:
    return np.asarray(np.degrees(log["out_of_plane_angle"].to_numpy()))


_LAST = {
    _hand: ("Force on the hand", "magnitude (N)"),
    _bending: ("Bending at the throat, out of plane", "angle (deg)"),
}
