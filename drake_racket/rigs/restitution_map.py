"""Impacts on a racket that may move: apparent restitution and vibration over the string-bed.

The racket is free, as between two threads, in a hand-like grip, or clamped at the handle. Beside
restitution the rig reads what is left shaking: how far the frame bends after the ball has left, and
the acceleration of the middle of the handle while and after the ball is on the strings.

`along_axis` moves the aim along the racket's long axis. Where the ball meets the node of the
bending mode, it does no work on that mode: there bending is excited least.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from drake_racket.io.errors import InputError
from drake_racket.laws.bed import POINT_NUMBERS
from drake_racket.parameters.racket import RACKETS
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.history import after_release
from drake_racket.results.impact import ImpactResult
from drake_racket.rigs.cases import USUAL, Axis, Output, Progress, run_grid

if TYPE_CHECKING:
    import xarray

SPEED = 25.0
"""m/s, relative speed of ball and racket: the middle of the source's 18-33 m/s."""


def _peak_acceleration(result: ImpactResult) -> float:
    found = result.peak_handle_acceleration
    return float("nan") if found is None else found


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


def bending_after_release(history: xarray.Dataset) -> float:
    """Largest out-of-plane angle (rad) after release; NaN if the history ends in contact."""
    angle = after_release(history)["out_of_plane_angle"]
    return float(np.abs(angle).max()) if angle.size else float("nan")


def _ringing(result: ImpactResult) -> float:
    assert result.history is not None
    return handle_ringing(result.history)


def _bending_angle(result: ImpactResult) -> float:
    assert result.history is not None
    return bending_after_release(result.history)


VIBRATION = (
    Output(
        "peak_handle_acceleration",
        "m/s^2",
        "largest magnitude of the acceleration of mid-handle",
        _peak_acceleration,
    ),
    Output(
        "handle_ringing",
        "m/s^2",
        "root mean square of mid-handle's acceleration along z after release",
        _ringing,
    ),
    Output(
        "bending_angle",
        "rad",
        "largest out-of-plane angle at the throat joint after release",
        _bending_angle,
    ),
)


def moving_racket_scenario() -> Scenario:
    """The base case: 25 m/s, and three periods of bending after the ball has left."""
    return Scenario(speed=SPEED, approach_time=1e-4, after=0.03, audit=False)


AXIS_REACH = 0.14
"""m from the string-bed centre: 0.8 of the longer of the two shipped rims' semi-axes."""


def axis_offsets(step: float) -> tuple[float, ...]:
    """Aims for `along_axis` (m), `step` apart and symmetric about the centre, to AXIS_REACH.

    Raises:
        InputError: a step that is not 1 mm to AXIS_REACH.

    """
    if not 1e-3 <= step <= AXIS_REACH:
        raise InputError("step", step, f"0.001 to {AXIS_REACH} m")
    count = int(AXIS_REACH / step * (1.0 + 1e-12))
    return tuple(round(i * step, 9) for i in range(-count, count + 1))


def restitution_map(
    *,
    rackets: Sequence[str] = RACKETS,
    supports: Sequence[str] = ("free", "clamped_handle"),
    points: Sequence[int] = POINT_NUMBERS,
    base: Scenario | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> xarray.Dataset:
    """Restitution, contact and vibration at the string-bed's points.

    Returns:
        A Dataset over (racket, support, point).

    Raises:
        InputError: a case is not valid.

    """
    axes: dict[str, Axis] = {"racket": rackets, "support": supports, "point": points}
    dataset = run_grid(
        base or moving_racket_scenario(),
        axes,
        (*USUAL, *VIBRATION),
        history=True,
        workers=workers,
        progress=progress,
    )
    dataset.attrs["title"] = "Impacts on a racket that may move"
    return dataset


def along_axis(
    offsets: Sequence[float],
    *,
    rackets: Sequence[str] = RACKETS,
    base: Scenario | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> xarray.Dataset:
    """The same on the free racket, aimed along its long axis.

    Args:
        offsets: from the string-bed centre towards the tip (m). The ball meets the nearest string
            mass; the contact force acts where the ball is.

    Returns:
        A Dataset over (racket, offset_x).

    Raises:
        InputError: a case is not valid.

    """
    base = dataclasses.replace(base or moving_racket_scenario(), point="auto", support="free")
    axes: dict[str, Axis] = {"racket": rackets, "offset_x": offsets}
    dataset = run_grid(
        base, axes, (*USUAL, *VIBRATION), history=True, workers=workers, progress=progress
    )
    dataset.attrs["title"] = "Free racket, impacts along its axis"
    return dataset
