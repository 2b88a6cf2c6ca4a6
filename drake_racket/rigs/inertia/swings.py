"""Runs single swings on the inertia bench: a history to look at, and what bending changes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from drake_racket.io.units import labelled
from drake_racket.parameters.racket import load_racket
from drake_racket.rigs.inertia.dataset import AMPLITUDE, PIVOTS
from drake_racket.rigs.inertia.rigid import specimen_pieces
from drake_racket.rigs.inertia.simulation import swing, swing_flexible_frame

if TYPE_CHECKING:
    import xarray


def swing_history(
    racket: str = "tour",
    part: str = "strung",
    axis: str = "transverse",
    *,
    amplitude: float = AMPLITUDE,
    oscillations: int = 3,
) -> xarray.Dataset:
    """Runs one pendulum: `angle` over `time`, and the `crossing` times of the rest position.

    The attribute `period_s` is the mean of the swings from the third crossing on. The pendulum
    begins at an `amplitude` in rad.

    Raises:
        InputError: a name is unknown or an argument is out of range.

    """
    import xarray

    pieces = specimen_pieces(load_racket(racket), part)
    run = swing(pieces, axis, pivot=PIVOTS[part], amplitude=amplitude, oscillations=oscillations)
    return xarray.Dataset(
        {
            "angle": labelled("time", run.angle, "rad", "angle from the vertical"),
            "crossing": labelled("number", run.crossings, "s", "time of passing the rest position"),
        },
        coords={
            "time": labelled("time", run.time, "s", "time from letting go"),
            "number": ("number", range(1, len(run.crossings) + 1), {"long_name": "crossing"}),
        },
        attrs={
            "title": f"Pendulum: {racket} racket, {part}, {axis} axis at {PIVOTS[part]:g} m",
            "period_s": run.period,
            "first_timed_crossing": 3,
        },
    )


def bending_error(
    racket_names: Sequence[str] = ("tour", "recreational"), *, amplitude: float = AMPLITUDE
) -> xarray.DataArray:
    """Tells how much the bare frame's bending changes the pendulum's moment about its pivot.

    Args:
        amplitude: rad, of the swing.

    Returns:
        (T_flexible / T_rigid)^2 - 1 over `racket` and `axis` (transverse, frontal), with both
        periods from the simulated bench at the swingweight axis.

    """
    import xarray

    axes = ("transverse", "frontal")
    rows = []
    for name in racket_names:
        parameters = load_racket(name)
        pieces = specimen_pieces(parameters, "frame")
        arguments: dict[str, Any] = {"pivot": PIVOTS["frame"], "amplitude": amplitude}
        rows.append(
            [
                (
                    swing_flexible_frame(parameters, axis, **arguments).period
                    / swing(pieces, axis, **arguments).period
                )
                ** 2
                - 1.0
                for axis in axes
            ]
        )
    return xarray.DataArray(
        rows,
        coords={"racket": list(racket_names), "axis": list(axes)},
        dims=("racket", "axis"),
        name="bending_error",
        attrs={"units": "1", "long_name": "relative error of the moment by bending of the frame"},
    )
