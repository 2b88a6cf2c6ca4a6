"""How mid-handle rings after a sweep's impacts, read from the histories that the sweep wrote."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from drake_racket.errors import InputError
from drake_racket.histories import read_history
from drake_racket.history import after_release
from drake_racket.sweep.run import history_paths
from drake_racket.sweep.spec import Sweep

if TYPE_CHECKING:
    import xarray

RINGING = "handle_ringing"


def handle_ringing(history: xarray.Dataset) -> float:
    """Root mean square (m/s^2) over time of mid-handle's acceleration along z after release.

    With the racket in a hand it holds the racket's motion in the hand, too. NaN if the history ends
    in contact.
    """
    rest = after_release(history)
    time = rest["time"].to_numpy()
    if len(time) < 2 or not time[-1] > time[0]:
        return float("nan")
    squared = rest["handle_acceleration"].sel(axis="z").to_numpy() ** 2
    return float(np.sqrt(np.trapezoid(squared, time) / (time[-1] - time[0])))


def add_ringing(dataset: xarray.Dataset, sweep: Sweep, directory: Path) -> xarray.Dataset:
    """A sweep's dataset with `handle_ringing` of the cases whose histories it wrote; else NaN.

    Args:
        dataset: what `run_sweep(sweep, directory)` returned.

    Raises:
        InputError: the sweep writes no history as NetCDF, or a file cannot be read.

    """
    if not sweep.histories or sweep.history_formats[0] != "nc":
        raise InputError("sweep: histories", "none as nc", "histories of the cases, nc first")
    values = np.full(len(sweep), np.nan)
    done = dataset["status"].to_numpy().ravel() == 0
    for case in sorted(sweep.histories):
        if done[case]:
            values[case] = handle_ringing(read_history(history_paths(case, sweep, directory)[0]))
    attributes = {
        "units": "m/s^2",
        "long_name": "root mean square of mid-handle's acceleration along z after release",
    }
    return dataset.assign(
        {RINGING: (dataset["status"].dims, values.reshape(sweep.shape), attributes)}
    )
