"""Checks what a log holds: a file can be in the right format and damaged, or another program's."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.io.errors import InputError
from drake_racket.laws.bed import grid_topology, named_topology
from drake_racket.results.history import VARIABLE_DIMENSIONS, variable_attributes

if TYPE_CHECKING:
    import xarray

_MAY_BE_NAN = ("handle_acceleration", "joint_reaction_force")  # a discrete plant has none
_UNIT_LENGTH = 1e-3  # by which a quaternion's may be off


def check_history(history: xarray.Dataset, where: str) -> None:
    """Refuses what cannot be the log of an impact.

    Variables that a log may hold are checked where they are there; others are let be.

    Raises:
        InputError: times that are not finite, out of order or all the same; a variable with other
            dimensions, labels or units, or with numbers that it cannot have; attributes that are
            broken.

    """
    _check_time(history, where)
    for name, variable in history.data_vars.items():
        if variable.dims[:1] != ("time",) or variable.ndim > 2:
            raise InputError(f"{where}: {name}", variable.dims, "time, and at most one dimension")
        if name in VARIABLE_DIMENSIONS:
            _check_variable(variable, str(name), where)
    for dimension, labels in _labels(history).items():
        if dimension in history.dims and history[dimension].to_numpy().tolist() != labels:
            raise InputError(f"{where}: {dimension}", history[dimension].to_numpy(), str(labels))
    _check_sliding(history, where)
    _check_values(history, where)
    _check_attributes(history, where)


def _labels(history: xarray.Dataset) -> dict[str, list[Any]]:
    """What stands along the dimensions: points and springs are those of one string-bed."""
    names = history["spring"].to_numpy().astype(str).tolist() if "spring" in history.dims else []
    bed = named_topology(names) or grid_topology()
    return {
        "axis": list("xyz"),
        "point": list(bed.points),
        "spring": list(bed.names),
        "quaternion": list("wxyz"),
    }


def _check_sliding(history: xarray.Dataset, where: str) -> None:
    """Refuses a list of sliding joints that is none."""
    if "joint" not in history.coords:
        return
    text = history["joint"].attrs.get("prismatic", "[]")
    try:
        names = json.loads(text)
        whole = isinstance(names, list) and all(isinstance(name, str) for name in names)
    except (ValueError, TypeError):
        whole = False
    if not whole:
        raise InputError(f"{where}: joint: prismatic", text, "a list of joint names, as JSON")


def _check_time(history: xarray.Dataset, where: str) -> None:
    if "time" not in history.dims or "time" not in history.coords:
        found = ", ".join(map(str, history.dims)) or "no dimension"
        raise InputError(where, found, "a history: variables over time")
    time = history["time"]
    values = time.to_numpy()
    if not np.issubdtype(values.dtype, np.floating) or time.attrs.get("units") != "s":
        raise InputError(
            f"{where}: time", f"units {time.attrs.get('units')}", "floating-point seconds (s)"
        )
    ordered = np.isfinite(values).all() and not (np.diff(values) < 0.0).any()
    if not ordered or len(values) < 2 or values[0] == values[-1]:
        raise InputError(
            f"{where}: time", f"{len(values)} samples", "two or more finite times in order"
        )


def _check_variable(variable: xarray.DataArray, name: str, where: str) -> None:
    beside = VARIABLE_DIMENSIONS[name]
    dimensions = ("time",) if beside is None else ("time", beside)
    if variable.dims != dimensions:
        raise InputError(f"{where}: {name}", variable.dims, f"the dimensions {dimensions}")
    units = variable_attributes(name)["units"]
    if variable.attrs.get("units") != units:
        raise InputError(f"{where}: {name}", variable.attrs.get("units"), f"units {units}")
    values = variable.to_numpy()
    if not (np.issubdtype(values.dtype, np.floating) or np.issubdtype(values.dtype, np.integer)):
        raise InputError(f"{where}: {name}", f"values of type {values.dtype}", "real numbers")
    bad = np.isinf(values) if name in _MAY_BE_NAN else ~np.isfinite(values)
    if bad.any():
        sample = int(np.argwhere(bad)[0, 0])
        got = f"{values[bad][0]} in sample {sample + 1}"
        raise InputError(f"{where}: {name}", got, "finite numbers")


def _check_values(history: xarray.Dataset, where: str) -> None:
    """Numbers that name something, and rotations."""
    for name, allowed, text in (
        ("contact_point", range(1, 10), "1 to 9"),
        ("in_contact", (0, 1), "0 or 1"),
    ):
        if name in history:
            found = np.setdiff1d(history[name].to_numpy(), list(allowed))
            if found.size:
                raise InputError(f"{where}: {name}", float(found[0]), text)
    if "handle_quaternion" in history:
        length = np.linalg.norm(history["handle_quaternion"].to_numpy(), axis=1)
        worst = float(length[np.argmax(np.abs(length - 1.0))])
        if abs(worst - 1.0) > _UNIT_LENGTH:
            raise InputError(f"{where}: handle_quaternion", f"length {worst:.4g}", "length 1")


def _check_attributes(history: xarray.Dataset, where: str) -> None:
    """Those that readers take: the scenario and the frame's fundamentals (Hz)."""
    if "scenario" in history.attrs:
        try:
            scenario = json.loads(history.attrs["scenario"])
            numbers = float(scenario["speed"]), float(scenario["incidence_deg"])
            whole = isinstance(scenario["support"], str) and all(map(math.isfinite, numbers))
        except (ValueError, TypeError, KeyError):
            whole = False
        if not whole:
            text = history.attrs["scenario"]
            raise InputError(f"{where}: scenario", text, "the scenario of a history, as JSON")
    for name in ("frame_in_plane_hz", "frame_out_of_plane_hz"):
        value = history.attrs.get(name, 1.0)
        if not isinstance(value, float | np.floating) or not 0.0 < value < math.inf:
            raise InputError(f"{where}: {name}", value, "a frequency in Hz")
