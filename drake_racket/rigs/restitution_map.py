"""Shoots at a racket that may move: apparent restitution and vibration over the string-bed.

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

from drake_racket.io.errors import InputError
from drake_racket.io.progress import Report
from drake_racket.laws.bed import POINT_NUMBERS
from drake_racket.parameters.racket import RACKETS
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.outputs import USUAL, VIBRATION
from drake_racket.sweep.run import run_grid
from drake_racket.sweep.spec import make_sweep

if TYPE_CHECKING:
    import xarray

SPEED = 25.0
"""m/s, relative speed of ball and racket: the middle of the source's 18-33 m/s."""


def moving_racket_scenario() -> Scenario:
    """Gives the base case: 25 m/s, and three periods of bending after the ball has left."""
    return Scenario(speed=SPEED, approach_time=1e-4, after=0.03, audit=False)


AXIS_REACH = 0.14
"""m from the string-bed centre: 0.8 of the longer of the two shipped rims' semi-axes."""


def axis_offsets(step: float) -> tuple[float, ...]:
    """Gives aims for `along_axis` (m), a `step` (m) apart and symmetric about the centre.

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
    progress: Report | None = None,
) -> xarray.Dataset:
    """Runs impacts on the string-bed's points: restitution, contact and vibration.

    Returns:
        A Dataset over (racket, support, point).

    Raises:
        InputError: a case is not valid.

    """
    axes = {"racket": list(rackets), "support": list(supports), "point": list(points)}
    sweep = make_sweep(base or moving_racket_scenario(), axes, (*USUAL, *VIBRATION))
    title = "Impacts on a racket that may move"
    return run_grid(sweep, title=title, workers=workers, progress=progress)


def along_axis(
    offsets: Sequence[float],
    *,
    rackets: Sequence[str] = RACKETS,
    base: Scenario | None = None,
    workers: int = 1,
    progress: Report | None = None,
) -> xarray.Dataset:
    """Runs impacts on the free racket, aimed along its long axis.

    Args:
        offsets: from the string-bed centre towards the tip (m). The ball meets the nearest string
            mass; the contact force acts where the ball is.

    Returns:
        A Dataset over (racket, offset_x).

    Raises:
        InputError: a case is not valid.

    """
    base = dataclasses.replace(base or moving_racket_scenario(), point="auto", support="free")
    axes = {
        "racket": list(rackets),
        "offset_x": {"values": list(offsets), "unit": "m"},
    }
    sweep = make_sweep(base, axes, (*USUAL, *VIBRATION))
    title = "Free racket, impacts along its axis"
    return run_grid(sweep, title=title, workers=workers, progress=progress)
