"""Lists the figures of one log (a time history), each with what it needs of the log."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from drake_racket.io.errors import InputError
from drake_racket.plots.log.contact_force import contact_force_figure
from drake_racket.plots.log.energy import energy_figure
from drake_racket.plots.log.loads import loads_figure
from drake_racket.plots.log.spin import spin_figure
from drake_racket.plots.log.string_map import string_map_figure
from drake_racket.plots.log.vibration import vibration_figure
from drake_racket.results.log_checks import check_history

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

_NEEDED = (
    "in_contact",
    "contact_point",
    "compression",
    "normal_force",
    "friction_x",
    "friction_y",
    "string_deflection",
    "string_tension",
    "handle_acceleration",
)


class LogFigure(NamedTuple):
    """Holds one figure: its file's name, how to draw it, and what a log lacks for it."""

    name: str
    draw: Callable[[xarray.Dataset], Figure]
    lacks: Callable[[xarray.Dataset], str]


def check_log(history: xarray.Dataset, where: str) -> None:
    """Refuses a Dataset that is not the history of an impact.

    Raises:
        InputError: a variable is missing, or as `log_checks.check_history`.

    """
    for name in _NEEDED:
        if name not in history.data_vars:
            raise InputError(f"{where}: {name}", "nothing", "the history of an impact, with it")
    check_history(history, where)


def _no_contact(history: xarray.Dataset) -> str:
    return "" if history["in_contact"].any() else "the ball did not touch the strings"


def _no_strings(history: xarray.Dataset) -> str:
    if "racket" not in history.attrs:
        return "the log does not hold the racket's geometry (a CSV has no place for it)"
    return _no_contact(history)


def _no_energy(history: xarray.Dataset) -> str:
    return "" if "energy" in history else "the log holds no energies (the run had no audit)"


def _no_acceleration(history: xarray.Dataset) -> str:
    acceleration = history["handle_acceleration"].to_numpy()
    if not np.isfinite(acceleration).all():
        return "the log holds no accelerations (a discrete plant has none)"
    return "" if acceleration.any() else "the handle does not move in this log"


def _no_loads(history: xarray.Dataset) -> str:
    if "hand_force" in history or "joint_position" in history:
        return ""
    return "no hand holds the racket, or it is welded to it, in this log"


def _no_spin(history: xarray.Dataset) -> str:
    if "ball_spin" not in history:
        return "the ball of this log is a point without spin (contact paper)"
    return _no_contact(history)


LOG_FIGURES = (
    LogFigure("contact_force", contact_force_figure, _no_contact),
    LogFigure("string_map", string_map_figure, _no_strings),
    LogFigure("energy", energy_figure, _no_energy),
    LogFigure("vibration", vibration_figure, _no_acceleration),
    LogFigure("spin", spin_figure, _no_spin),
    LogFigure("loads", loads_figure, _no_loads),
)
