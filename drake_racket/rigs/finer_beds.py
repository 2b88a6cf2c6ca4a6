"""Calibrates beds of more masses to the static stiffness of the bed of nine, and shoots at them.

Criterion: the mean over the nine points of secant stiffness is that of the given bed under 1 N
(which the tension decides) and under 800 N (which the springs decide as well). Its two factors are
`parameters.finer_bed`'s tau and sigma. A point force on a net finds it the softer the finer its
meshes are, so that tau is above 1 and grows slowly with the number of lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from drake_racket.engines.clamped.batch import make_bed
from drake_racket.engines.clamped.spinning import run_spinning, spinning_impacts
from drake_racket.io.units import labelled
from drake_racket.parameters.ball import BallParameters, load_ball
from drake_racket.parameters.finer_bed import finer_bed
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.contacts import surface_model
from drake_racket.rigs.static_stiffness import place_deflection

if TYPE_CHECKING:
    import xarray

FORCES = (1.0, 800.0)
"""N, of the criterion: the bed at rest, and near the peak of an impact at 25 m/s."""


@dataclass(frozen=True)
class FinerBed:
    """Holds a calibrated bed.

    Attributes:
        racket: with the bed.
        tension, stiffness: the factors tau and sigma on the lines' shares of T0 and springs.

    """

    racket: RacketParameters
    tension: float
    stiffness: float


def mean_stiffness(racket: RacketParameters, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gives the mean secant stiffness (N/m) over places (n, 2), under each of FORCES."""
    return np.array(
        [np.mean([f / place_deflection(racket, x, y, f) for x, y in places]) for f in FORCES]
    )


def calibrated_bed(racket: RacketParameters, lines: int) -> FinerBed:
    """Gives the racket with lines x lines masses whose static stiffness is the given bed's.

    Args:
        racket: with a bed of 3 x 3.  lines: odd, as of `finer_bed`.

    Raises:
        InputError: as `finer_bed`.
        ArithmeticError: no factors were found.

    """
    places = racket.string_bed.spacing.value * racket.bed_topology().places
    if lines == 3:
        return FinerBed(finer_bed(racket, 3), 1.0, 1.0)
    finer_bed(racket, lines)  # refuses before anything is computed
    wanted = mean_stiffness(racket, places)

    def gap(logarithms: NDArray[np.float64]) -> NDArray[np.float64]:
        tau, sigma = np.exp(logarithms)
        made = finer_bed(racket, lines, tension=float(tau), stiffness=float(sigma))
        return mean_stiffness(made, places) / wanted - 1.0

    answer = root(gap, np.log([1.3, 1.3]), options={"xtol": 1e-8})
    if not np.max(np.abs(answer.fun)) < 1e-6:
        raise ArithmeticError(f"no factors found for {lines} lines: {answer.message}")
    tau, sigma = (float(x) for x in np.exp(answer.x))
    return FinerBed(finer_bed(racket, lines, tension=tau, stiffness=sigma), tau, sigma)


def convergence(
    racket: RacketParameters,
    ball: BallParameters | None = None,
    *,
    lines: Sequence[int] = (3, 5, 7),
    speed: float = 25.0,
    reach: float = 0.0685,
    step: float = 0.01,
) -> xarray.Dataset:
    """Shoots along the normal at calibrated beds, head clamped, along both of their axes.

    Args:
        racket: with a bed of 3 x 3.  ball: the shipped one if None.
        lines: of the beds.  speed: m/s.
        reach, step: m, of the places from the centre.

    Returns:
        `restitution`, `contact_time` (s) and static `deflection` under the larger force (m) over
        (lines, axis, place), `tension` and `stiffness` (tau, sigma) over lines.

    """
    import xarray

    ball = ball or load_ball()
    away = np.arange(0.0, reach + 1e-9, step)
    rows, factors = [], []
    for count in lines:
        bed = calibrated_bed(racket, count)
        factors.append((bed.tension, bed.stiffness))
        for axis in range(2):
            places = np.zeros((len(away), 2))
            places[:, axis] = away
            velocities = np.tile([0.0, 0.0, -speed], (len(away), 1))
            impacts = spinning_impacts(bed.racket, ball, places, velocities)
            model = surface_model(bed.racket, ball)
            found = run_spinning(make_bed(bed.racket), model, ball.mass.value, impacts)
            pressed = [place_deflection(bed.racket, x, y, FORCES[1]) for x, y in places]
            rows.append((found.velocities[:, 2] / speed, found.contact_time, pressed))
    table = np.array(rows).reshape(len(lines), 2, 3, len(away))
    dimensions = ("lines", "axis", "place")
    tau, sigma = np.array(factors).T
    return xarray.Dataset(
        {
            "restitution": labelled(dimensions, table[:, :, 0], "1", "normal restitution"),
            "contact_time": labelled(dimensions, table[:, :, 1], "s", "time in contact"),
            "deflection": labelled(dimensions, table[:, :, 2], "m", "deflection, pressed slowly"),
            "tension": labelled("lines", tau, "1", "factor of the tension"),
            "stiffness": labelled("lines", sigma, "1", "factor of the springs"),
        },
        coords={
            "lines": list(lines),
            "axis": ["x", "y"],
            "place": ("place", away, {"units": "m"}),
        },
        attrs={"title": f"{racket.title}, head clamped, {speed:g} m/s, contact surface"},
    )
