"""Which kb and cb at 18 m/s agree with what is published of the ball and the clamped beds.

The source's Fig. 5 with the ball's constants is missing; the defaults are inferred. Here kb(18) and
cb(18) run over a grid, each growing with speed as printed, and every published bound is judged at
every place of it. On the clamped beds with `clamped`, on a rigid plate by the closed form
(`rigs.plate_force`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from drake_racket import RACKETS, TENSIONS, BallParameters, InputError, load_ball, load_racket
from drake_racket.engines import Array, contact_constants, make_bed, make_impacts, run
from drake_racket.laws import POINT_NUMBERS
from drake_racket.rigs import closed_form

if TYPE_CHECKING:
    import xarray

STIFFNESSES = tuple(np.arange(20e3, 80.1e3, 2.5e3).tolist())
"""N/m."""
DAMPINGS = tuple(np.arange(0.0, 40.1, 2.0).tolist())
"""N s/m."""

OTHERS = ("restitution falls with speed", "peak force on the plate", "contact time on the plate")
"""The source's bounds but for the two ends of the rebound range."""

GRAVITY = 9.80665  # m/s^2


@dataclass(frozen=True)
class Bounds:
    """What is published, and how it is read.

    Attributes:
        lowest, highest: m/s, rebound over four beds, nine points and 18-33 m/s (Glynn et al. 2011,
            Abstract).
        tolerance: relative, on both; 3 % of the source's fit and 0.5 m/s of rounding (inferred).
        peak_force: N, end of the force axis (Fig. 4); contact_time: s, of its time axis. Both bound
            from above only.
        drop_height, drop_low, drop_high: m, of the ITF's rebound test, without air.

    """

    lowest: float = 16.0
    highest: float = 27.0
    tolerance: float = 0.05
    peak_force: float = 2000.0
    contact_time: float = 0.005
    drop_height: float = 2.54
    drop_low: float = 1.35
    drop_high: float = 1.47

    def __post_init__(self) -> None:
        for key, value in vars(self).items():
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(key, value, "a finite positive number")
        if not self.lowest < self.highest:
            raise InputError("lowest", self.lowest, f"below the highest, {self.highest:g} m/s")
        if not self.drop_low < self.drop_high < self.drop_height:
            raise InputError("drop_high", self.drop_high, "between drop_low and drop_height")

    @property
    def drop_restitution(self) -> tuple[float, float]:
        """The ITF's limits as restitution."""
        low, high = (math.sqrt(h / self.drop_height) for h in (self.drop_low, self.drop_high))
        return low, high

    @property
    def drop_speed(self) -> float:
        """m/s at the floor."""
        return math.sqrt(2.0 * GRAVITY * self.drop_height)


def calibration_dataset(
    *,
    stiffnesses: Sequence[float] = STIFFNESSES,
    dampings: Sequence[float] = DAMPINGS,
    rackets: Sequence[str] = RACKETS,
    tensions: Sequence[str] = TENSIONS,
    points: Sequence[int] = POINT_NUMBERS,
    bounds: Bounds | None = None,
    progress: Callable[[float], None] | None = None,
) -> xarray.Dataset:
    """The map.

    Args:
        stiffnesses: kb(18), N/m, ascending.  dampings: cb(18), N s/m, ascending.
        progress: called with the part done.

    Returns:
        A Dataset over (kb, cb) and bed: rebound_low, rebound_high (m/s, of all points at the lowest
        and the highest speed), falls (share of points where restitution falls with speed); on the
        plate peak_force (N), contact_time (s), restitution at the highest speed and in the drop;
        agrees over (bound, kb, cb), 1 or 0. The default ball is in the attributes `kb_default`,
        `cb_default`. Where a ball does not come off a bed its numbers are nan.

    Raises:
        InputError: a grid that is not ascending or out of range, unknown beds or points.

    """
    import xarray

    _check_axis("stiffnesses", stiffnesses, 1e3, 1e6, "N/m")
    _check_axis("dampings", dampings, 0.0, 200.0, "N s/m")
    bounds = bounds or Bounds()
    ball = load_ball()
    names = [f"{r} {t}" for r in rackets for t in tensions]
    shape = len(names), len(stiffnesses), len(dampings)
    low, high, falls = np.empty(shape), np.empty(shape), np.empty(shape)
    for i, (racket, tension) in enumerate((r, t) for r in rackets for t in tensions):
        for j, kb in enumerate(stiffnesses):
            rebound, speeds = _rebounds(racket, tension, ball, points, kb, dampings)
            low[i, j] = rebound.min(axis=(1, 2))
            high[i, j] = rebound.max(axis=(1, 2))
            restitution = rebound / speeds
            falls[i, j] = (restitution[..., 1] < restitution[..., 0]).mean(axis=1)
            if progress is not None:
                progress((i * len(stiffnesses) + j + 1) / (len(names) * len(stiffnesses)))
    over, grid = ("bed", "kb", "cb"), ("kb", "cb")
    plate = _plate(ball, stiffnesses, dampings, bounds)
    agrees = _judge(low, high, falls, plate, bounds)
    return xarray.Dataset(
        {
            "rebound_low": (over, low, _text("m/s", "lowest rebound speed")),
            "rebound_high": (over, high, _text("m/s", "highest rebound speed")),
            "falls": (over, falls, _text("1", "share of points where restitution falls")),
            "peak_force": (grid, plate[0], _text("N", "peak force on a plate")),
            "contact_time": (grid, plate[1], _text("s", "longest contact on a plate")),
            "restitution": (grid, plate[2], _text("1", "restitution on a plate")),
            "drop_restitution": (grid, plate[3], _text("1", "restitution of the drop")),
            "agrees": (
                ("bound", *grid),
                np.stack(list(agrees.values())).astype(np.int8),
                _text("1", "whether the bound is kept"),
            ),
        },
        coords={
            "bed": ("bed", names, _text("1", "string-bed")),
            "kb": ("kb", list(stiffnesses), _text("N/m", "kb at the lowest speed")),
            "cb": ("cb", list(dampings), _text("N*s/m", "cb at the lowest speed")),
            "bound": ("bound", list(agrees), _text("1", "published bound")),
        },
        attrs={
            "title": "kb and cb against what is published",
            "kb_default": ball.stiffness_low.value,
            "cb_default": ball.damping_low.value,
            **vars(bounds),
        },
    )


def _rebounds(
    racket_name: str,
    tension: str,
    ball: BallParameters,
    points: Sequence[int],
    kb: float,
    dampings: Sequence[float],
) -> tuple[Array, Array]:
    """Rebound speeds (damping, point, speed), and the two speeds (m/s)."""
    racket = load_racket(racket_name, tension)
    speeds = np.array([ball.speed_low.value, ball.speed_high.value])
    shape = len(dampings), len(points), 2
    at, speed, cb = (
        a.ravel()
        for a in np.broadcast_arrays(
            np.array(points)[None, :, None], speeds, np.array(dampings)[:, None, None]
        )
    )
    impacts = make_impacts(racket, ball, at, speed)
    impacts.balls[:, 0] *= kb / ball.stiffness_low.value  # both grow with speed in proportion
    impacts.balls[:, 1] *= cb / ball.damping_low.value
    outcome = run([make_bed(racket)], impacts)
    rebound = np.where(outcome.ended, outcome.column("v_z")[0], np.nan)
    return rebound.reshape(shape), speeds


def _plate(
    ball: BallParameters, stiffnesses: Sequence[float], dampings: Sequence[float], bounds: Bounds
) -> Array:
    """Peak force, longest contact, restitution, restitution of the drop: (4, kb, cb)."""
    fast, slow = ball.speed_high.value, ball.speed_low.value
    found = np.empty((4, len(stiffnesses), len(dampings)))
    factors = {
        v: np.array(contact_constants(ball, v)) / (ball.stiffness_low.value, ball.damping_low.value)
        for v in (fast, slow, bounds.drop_speed)
    }
    for i, kb in enumerate(stiffnesses):
        for j, cb in enumerate(dampings):
            quick, gentle, drop = (
                closed_form(
                    mass=ball.mass.value,
                    stiffness=kb * float(grown[0]),
                    damping=cb * float(grown[1]),
                    speed=v,
                )
                for v, grown in factors.items()
            )
            longest = max(quick.contact_time, gentle.contact_time)
            found[:, i, j] = quick.peak_force, longest, quick.restitution, drop.restitution
    return found


def _judge(
    low: Array, high: Array, falls: Array, plate: Array, bounds: Bounds
) -> dict[str, NDArray[np.bool_]]:
    """Bound -> (kb, cb) whether it is kept; nan keeps none."""
    lowest, highest = low.min(axis=0), high.max(axis=0)
    weak, strong = bounds.drop_restitution
    kept = {
        "lowest rebound": np.abs(lowest / bounds.lowest - 1.0) <= bounds.tolerance,
        "highest rebound": np.abs(highest / bounds.highest - 1.0) <= bounds.tolerance,
    }
    others = (
        falls.min(axis=0) == 1.0,
        plate[0] <= bounds.peak_force,
        plate[1] <= bounds.contact_time,
    )
    kept |= dict(zip(OTHERS, others, strict=True))
    kept["all of the source"] = np.logical_and.reduce(list(kept.values()))
    kept["ITF drop"] = (plate[3] >= weak) & (plate[3] <= strong)
    return kept


def tolerance_needed(dataset: xarray.Dataset) -> xarray.DataArray:
    """By how much (relative) the rebound range over all beds misses the published one, (kb, cb).

    The larger of the two misses, of the lowest and of the highest rebound speed.
    """
    low = dataset["rebound_low"].min("bed", skipna=False) / dataset.attrs["lowest"] - 1.0
    high = dataset["rebound_high"].max("bed", skipna=False) / dataset.attrs["highest"] - 1.0
    needed: xarray.DataArray = np.maximum(abs(low), abs(high))
    needed.attrs = _text("1", "largest relative miss of the rebound range")
    return needed


def nearest(dataset: xarray.Dataset) -> xarray.Dataset:
    """The place of the grid with the least `tolerance_needed` among those that keep the others.

    The others: that restitution falls with speed, and the plate's force and time.

    Raises:
        InputError: no place of the grid keeps them.

    """
    others = dataset["agrees"].sel(bound=list(OTHERS)).min("bound") == 1
    needed = tolerance_needed(dataset).where(others)
    if not bool(needed.notnull().any()):
        raise InputError("grid", "no place keeps the other bounds", "a wider grid of kb and cb")
    i, j = np.unravel_index(int(np.nanargmin(needed.to_numpy())), needed.shape)
    return dataset.isel(kb=int(i), cb=int(j))


def _check_axis(key: str, values: Sequence[float], low: float, high: float, unit: str) -> None:
    numbers = np.asarray(values, dtype=float)
    inside = bool(np.all((numbers >= low) & (numbers <= high)))
    if not (numbers.size and inside and np.all(np.diff(numbers) > 0.0)):
        raise InputError(key, list(values), f"ascending, {low:g} to {high:g} {unit}")


def _text(unit: str, long_name: str) -> dict[str, str]:
    return {"units": unit, "long_name": long_name}
