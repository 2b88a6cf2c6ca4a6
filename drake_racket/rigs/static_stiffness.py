"""Presses the string-bed slowly: deflection and stiffness by point, with the head held.

A force on one string mass along the head's normal is balanced by the springs (the law of
`strings`, no contact and no dynamics):

    F e_p + f(z) = 0,       f = -A^T (T dz / L).

The secant stiffness F / |z_p| grows with the force: at small deflection the bed is as stiff as its
tension makes it, K = A^T diag(T0 / L0) A; at large deflection as its springs do.

Between the points the force is shared by the nearest masses, and the deflection is their weighted
mean, with the weights of contact surface (`laws.places`): both are continuous over the bed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from drake_racket.io.errors import InputError
from drake_racket.io.units import labelled
from drake_racket.laws.bed import POINT_NUMBERS
from drake_racket.laws.places import bed_weights
from drake_racket.laws.strings import generalized_forces
from drake_racket.parameters.racket import RACKETS, TENSIONS, RacketParameters, load_racket
from drake_racket.plant.string_bed import string_bed_model
from drake_racket.plant.systems.string_bed import spring_constants

if TYPE_CHECKING:
    import xarray

FORCES = (1.0, 50.0, 100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 800.0, 1000.0, 1200.0)
"""The bed is pressed with these forces (N); impacts at 18-33 m/s peak at 0.6 to 1.3 kN."""

MOST_FORCE = 20e3
"""N, up to which a string-bed can be pressed."""


def tangent_stiffness(
    z: NDArray[np.float64], constants: NDArray[np.float64], incidence: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Computes -df/dz (N/m), (n, n): A^T diag(T L0^2 / L^3 + k dz^2 / L^2) A.

    Args:
        z: (n,) deflections (m).  constants: (4, m), see `strings.tensions`.
        incidence: (m, n) of -1, 0 and 1, no unit.

    """
    k, slack, length0_squared, _ = constants
    dz = incidence @ z
    length_squared = dz * dz + length0_squared
    length = np.sqrt(length_squared)
    tension = slack + k * length
    slope = tension * length0_squared / (length_squared * length) + k * dz * dz / length_squared
    stiffness: NDArray[np.float64] = (incidence.T * slope) @ incidence
    return stiffness


def static_deflection(racket: RacketParameters, point: int, force: float) -> NDArray[np.float64]:
    """Gives the deflections (m) along the head's z, (n,), under `force` (N) along -z at `point`.

    Raises:
        InputError: unknown point, or a force that is not 0 to 20 kN.

    """
    bed = racket.bed_topology()
    if point not in bed.points:
        raise InputError("point", point, f"1 to {len(bed.points)}")
    if not 0.0 <= force <= MOST_FORCE:
        raise InputError("force", force, f"0 to {MOST_FORCE:g} N")
    load = np.zeros(len(bed.points))
    load[point - 1] = -force
    return _pressed(racket, load, f"point {point}")


def place_weights(racket: RacketParameters, x: float, y: float) -> NDArray[np.float64]:
    """Gives the weights (n,) of the masses at a place in the bed, from its centre (m).

    Raises:
        InputError: a place that is not within the rim.

    """
    bed = racket.string_bed
    rim = bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    if not (x / rim[0]) ** 2 + (y / rim[1]) ** 2 < 1.0:
        raise InputError("place", (x, y), f"within the rim (semi-axes {rim[0]:g} x {rim[1]:g} m)")
    grid = bed.spacing.value * racket.bed_topology().places
    points, weights, _ = bed_weights(grid, rim, x, y)
    found = np.zeros(len(grid))
    np.add.at(found, list(points), weights)
    return found


def place_deflection(racket: RacketParameters, x: float, y: float, force: float) -> float:
    """Gives how far (m) the bed gives way at any place under `force` (N) along -z there.

    Args:
        x, y: place from the bed's centre, towards the tip and to the left (m).

    Raises:
        InputError: a place that is not within the rim, or a force that is not 0 to 20 kN.

    """
    if not 0.0 <= force <= MOST_FORCE:
        raise InputError("force", force, f"0 to {MOST_FORCE:g} N")
    weights = place_weights(racket, x, y)
    return -float(weights @ _pressed(racket, -force * weights, f"({x:g}, {y:g})"))


def stiffness_map(
    racket: RacketParameters, *, force: float = 800.0, step: float = 0.01
) -> xarray.Dataset:
    """Presses a bed all over: secant stiffness on a grid of places, NaN outside the rim.

    Args:
        force: N.  step: m, of the grid.

    Returns:
        `deflection` (m) and `secant_stiffness` (N/m) over (x, y).

    Raises:
        InputError: a force that is not above 0, or a step that is not 1 to 100 mm.

    """
    import xarray

    if not 0.0 < force <= MOST_FORCE:
        raise InputError("force", force, f"above 0, up to {MOST_FORCE:g} N")
    if not 1e-3 <= step <= 0.1:
        raise InputError("step", step, "0.001 to 0.1 m")
    bed = racket.string_bed
    rim = bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    x, y = (step * np.arange(-int(end / step), int(end / step) + 1) for end in rim)
    deflection = np.full((len(x), len(y)), np.nan)
    for i, along in enumerate(x):
        for j, across in enumerate(y):
            if (along / rim[0]) ** 2 + (across / rim[1]) ** 2 < 1.0:
                deflection[i, j] = place_deflection(racket, float(along), float(across), force)
    with np.errstate(divide="ignore"):
        secant = force / deflection
    return xarray.Dataset(
        {
            "deflection": labelled(("x", "y"), deflection, "m", "deflection under the force"),
            "secant_stiffness": labelled(("x", "y"), secant, "N/m", "force over deflection"),
        },
        coords={"x": ("x", x, {"units": "m"}), "y": ("y", y, {"units": "m"})},
        attrs={"title": f"{racket.title}, pressed with {force:g} N, head held"},
    )


def _pressed(
    racket: RacketParameters, load: NDArray[np.float64], where: str
) -> NDArray[np.float64]:
    """Deflections (m) of the masses under a load (n,) (N) along the head's z."""
    bed = racket.bed_topology()
    constants = spring_constants(string_bed_model(racket))
    still = np.zeros(len(bed.points))
    force = float(np.sum(np.abs(load)))

    # the springs only stiffen, so Newton from the linear answer overshoots and then comes back
    start = np.linalg.solve(tangent_stiffness(still, constants, bed.incidence), load)
    answer = root(
        lambda z: -generalized_forces(z, still, constants, bed.incidence) - load,
        start,
        jac=lambda z: tangent_stiffness(z, constants, bed.incidence),
        method="hybr",
        options={"xtol": 1e-13, "maxfev": 1000},
    )
    residual = float(np.max(np.abs(answer.fun)))
    if residual > 1e-9 * max(force, 1.0):
        raise ArithmeticError(f"no equilibrium found at {where}: residual {residual:g} N")
    z: NDArray[np.float64] = answer.x
    return z


def stiffness_dataset(
    *,
    rackets: Sequence[str] = RACKETS,
    tensions: Sequence[str] = TENSIONS,
    points: Sequence[int] = POINT_NUMBERS,
    forces: Sequence[float] = FORCES,
) -> xarray.Dataset:
    """Presses every bed at every point: force-deflection curves and stiffness.

    Args:
        forces: N.

    Returns:
        A Dataset over (racket, tension, point, force): deflection (m, at the loaded point), secant
        and tangent stiffness (N/m).

    Raises:
        InputError: unknown racket, tension or point, or forces that are not above 0.

    """
    import xarray

    if any(not force > 0.0 for force in forces):
        raise InputError("forces", list(forces), "forces above 0 N")
    shape = len(rackets), len(tensions), len(points), len(forces)
    deflection, tangent = np.empty(shape), np.empty(shape)
    for i, racket_name in enumerate(rackets):
        for j, tension in enumerate(tensions):
            racket = load_racket(racket_name, tension)
            constants = spring_constants(string_bed_model(racket))
            incidence = racket.bed_topology().incidence
            for k, point in enumerate(points):
                for n, force in enumerate(forces):
                    z = static_deflection(racket, point, force)
                    deflection[i, j, k, n] = -z[point - 1]
                    compliance = np.linalg.inv(tangent_stiffness(z, constants, incidence))
                    tangent[i, j, k, n] = 1.0 / compliance[point - 1, point - 1]
    dimensions = "racket", "tension", "point", "force"
    secant = np.asarray(forces) / deflection
    return xarray.Dataset(
        {
            name: labelled(dimensions, values, units, text)
            for name, values, units, text in (
                ("deflection", deflection, "m", "deflection of the loaded string mass"),
                ("secant_stiffness", secant, "N/m", "force over deflection"),
                ("tangent_stiffness", tangent, "N/m", "slope of force over deflection"),
            )
        },
        coords={
            "racket": list(rackets),
            "tension": list(tensions),
            "point": list(points),
            "force": ("force", list(forces), {"units": "N"}),
        },
        attrs={"title": "String-bed pressed slowly at one point, head held"},
    )


def mean_difference(dataset: xarray.Dataset) -> xarray.Dataset:
    """Tells how well two beds match: the relative difference of secant stiffness, over all pairs.

    For beds a and b at one force, the mean over points of |ka - kb| / ((ka + kb) / 2).

    Args:
        dataset: from `stiffness_dataset`.

    Returns:
        A Dataset over (bed, other, force); beds are named `tour low` and so on.

    """
    stacked: xarray.DataArray = dataset["secant_stiffness"].stack(bed=("racket", "tension"))
    names = [" ".join(pair) for pair in stacked["bed"].to_numpy()]
    beds = stacked.drop_vars(["bed", "racket", "tension"]).assign_coords(bed=names)
    others = beds.rename(bed="other")
    difference: xarray.DataArray = abs(beds - others) / (0.5 * (beds + others))
    difference = difference.mean(dim="point").transpose("bed", "other", "force")
    difference.attrs = {"units": "1", "long_name": "mean relative difference of secant stiffness"}
    return difference.to_dataset(name="difference")
