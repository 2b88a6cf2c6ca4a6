"""Tells how modes change: with the grip's firmness, and of the strings with the frame's freedom.

*Grip.* Between a hand of no stiffness and one of endless stiffness lie the free racket and the one
with its handle clamped. By Rayleigh's principle stiffer springs lower no frequency, so in each
plane every frequency, counted from below, rises from the free to the clamped racket:

    1st: 0 (turning as a rigid body)  ->  the head on the throat joint, handle clamped
    2nd: 0 (moving as a rigid body)   ->  without limit, the handle on the hand's springs
    3rd: bending of the free racket   ->  without limit, likewise

(without limit for the bare frame; with strings, to the next mode of the clamped racket). Bending is
thus the third mode of a soft grip and the first of a clamp: in between, the largest share of its
strain energy is in the throat joint for the third, then the second, then the first.

A hand that is springs to a place at rest cannot lower a frequency. Players' hands do lower the
first bending frequencies as they grip harder (Chadefaux, Rao, Le Carrou, Berton & Vigouroux, "The
effects of player grip on the dynamic behaviour of a tennis racket", abstract, HAL hal-01440222):
a hand needs mass for that (grip kind `hand`, presets `hand_light` to `hand_tight`; Savage 2006).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from drake_racket.io.errors import InputError
from drake_racket.io.units import labelled
from drake_racket.parameters.grip import GripStiffness, check_grip, load_grip
from drake_racket.parameters.racket import RacketParameters, load_racket
from drake_racket.rigs.input_checks import check_positive
from drake_racket.rigs.modes.frame_modes import string_variables
from drake_racket.rigs.modes.modal_analysis import Modes, modal_system, solve_modes, strain_elements
from drake_racket.rigs.modes.shapes import PLANES, mode_shapes

if TYPE_CHECKING:
    import xarray

GRIP_FACTORS = tuple(np.logspace(-4.0, 5.0, 55).tolist())
"""Factors on the stiffness of the normal grip, from nearly free to nearly clamped."""
ORDERS = 3  # modes in each plane of the bare frame on a grip


def grip_sweep(
    racket: str = "tour",
    tension: str = "low",
    joint_reading: str | None = None,
    *,
    strung: bool = False,
    grip: GripStiffness | None = None,
    factors: Sequence[float] = GRIP_FACTORS,
) -> xarray.Dataset:
    """Gives the lowest three modes in each plane, as all six stiffnesses of the grip are scaled.

    Args:
        racket, tension, joint_reading: as `load_racket`.
        grip: what is scaled (damping with the root); the shipped grip if None.
        factors: of the stiffness (1), rising.

    Returns:
        A Dataset over (factor, plane, order): frequency, damping ratio (nan if overdamped), kind
        and the shares of joint and grip in the strain energy; over (plane, order): the frequencies
        of the free racket and of the clamped one (inf where it has no such mode).

    Raises:
        InputError: an argument is not valid.

    """
    import xarray

    parameters = load_racket(racket, tension, joint_reading=joint_reading)
    grip = grip or load_grip()
    _check_sweep(grip, factors)
    system = modal_system(parameters, strung=strung, support="grip", grip=grip)
    assert system.grip is not None
    shape = (len(factors), len(PLANES), ORDERS)
    frequency, damping = np.empty(shape), np.empty(shape)
    elements = strain_elements(parameters)
    shares = np.empty((*shape, len(elements)))
    kinds = np.empty(shape, dtype=f"<U{max(map(len, elements))}")
    for i, factor in enumerate(factors):
        system.grip.set_stiffness(system.context, grip.scaled(factor))
        modes = solve_modes(system)
        for j, plane in enumerate(PLANES):
            at = _in_plane(modes, plane)[:ORDERS]
            frequency[i, j], damping[i, j] = modes.frequencies[at], modes.damping_ratios[at]
            shares[i, j] = modes.strain_shares[at]
            kinds[i, j] = [modes.kinds[n] for n in at]
    dims = ("factor", "plane", "order")
    about_limit = "undamped frequency of the racket with its handle"
    return xarray.Dataset(
        {
            "frequency": labelled(dims, frequency, "Hz", "undamped frequency"),
            "damping_ratio": labelled(dims, damping, "1", "damping ratio (nan if overdamped)"),
            "kind": labelled(dims, kinds, "", "where most strain energy is"),
            "strain_share": labelled((*dims, "element"), shares, "1", "share in strain energy"),
            "free_frequency": labelled(
                dims[1:], _limit(parameters, strung, "free"), "Hz", f"{about_limit} free"
            ),
            "clamped_frequency": labelled(
                dims[1:],
                _limit(parameters, strung, "clamped_handle"),
                "Hz",
                f"{about_limit} clamped",
            ),
        },
        coords={
            "factor": labelled(
                "factor", list(factors), "1", "stiffness of the grip over the default"
            ),
            "plane": list(PLANES),
            "order": ("order", np.arange(1, ORDERS + 1), {"long_name": "from below, in its plane"}),
            "element": list(elements),
        },
        attrs={
            "title": f"Frequencies and grip, {parameters.title}",
            "racket": racket,
            "joint_reading": parameters.throat_joint.reading.value,
            "strung": int(strung),
            "grip": grip.name,
            "grip_force_stiffness": grip.force_stiffness.value,
            "grip_torque_stiffness": grip.torque_stiffness.value,
            "grip_status": grip.force_stiffness.status,
        },
    )


def _check_sweep(grip: GripStiffness, factors: Sequence[float]) -> None:
    """Refuses a grip that leaves a motion free, and factors that do not rise."""
    check_grip(grip)
    for key, values in (
        ("force_stiffness", grip.force_stiffness),
        ("torque_stiffness", grip.torque_stiffness),
    ):
        if min(values.value) <= 0.0:
            raise InputError(f"grip: {key}.value", values.value, "stiffnesses of more than 0")
    if not 1 <= len(factors) <= 1000:
        raise InputError("factors", f"{len(factors)} factors", "1 to 1000 factors")
    for factor in factors:
        check_positive(factor=factor)
    if np.any(np.diff(factors) <= 0.0):
        raise InputError("factors", list(factors), "rising factors")
    if factors[0] < 1e-6 or factors[-1] > 1e8:  # beyond, some modes drown in round-off
        raise InputError("factors", [factors[0], factors[-1]], "factors from 1e-6 to 1e8")


def _in_plane(modes: Modes, plane: str) -> list[int]:
    """The modes whose axis moves in `plane`, by rising frequency."""
    shapes = mode_shapes(modes)
    return [i for i in range(len(modes.kinds)) if shapes.plane(i) == plane]


def _limit(parameters: RacketParameters, strung: bool, support: str) -> NDArray[np.float64]:
    """The lowest frequencies (2, ORDERS) in each plane; a free racket has two of 0 in each."""
    modes = solve_modes(modal_system(parameters, strung=strung, support=support))
    zeros = [0.0, 0.0] if support == "free" else []
    rows = []
    for plane in PLANES:
        found = [*zeros, *modes.frequencies[_in_plane(modes, plane)], *[np.inf] * ORDERS]
        rows.append(found[:ORDERS])
    return np.array(rows)


def string_bed_coupling(
    racket: str = "tour", tension: str = "low", joint_reading: str | None = None
) -> xarray.Dataset:
    """Gives the string-bed modes with the head clamped, and what the free frame makes of them.

    Clamped and free modes are paired by their string deflections (MAC, the squared cosine between
    them), not by their order.

    Returns:
        A Dataset over `mode` (by rising frequency with the head clamped): both frequencies and
        the relative shift, the overlap, the throat joint's share in the strain energy and the
        frame's motion of the free mode, the clamped shapes over `point`, and their symmetry.

    Raises:
        InputError: an argument is not valid.

    """
    import xarray

    parameters = load_racket(racket, tension, joint_reading=joint_reading)
    clamped, free = (
        solve_modes(modal_system(parameters, support=support))
        for support in ("clamped_head", "free")
    )
    rows, columns = (
        [i for i, kind in enumerate(modes.kinds) if kind == "string_bed"]
        for modes in (clamped, free)
    )
    shapes, free_shapes = mode_shapes(clamped), mode_shapes(free)
    overlaps = _overlaps(shapes.strings[rows], free_shapes.strings[columns])
    found, paired = linear_sum_assignment(overlaps, maximize=True)
    at = [columns[i] for i in paired]
    low, high = clamped.frequencies[rows], free.frequencies[at]
    joint = free.strain_shares[at, :-2].sum(axis=1)
    return xarray.Dataset(
        {
            "frequency": labelled("mode", low, "Hz", "frequency, head clamped"),
            "frequency_free": labelled("mode", high, "Hz", "frequency, racket free"),
            "shift": labelled("mode", high / low - 1.0, "1", "free over clamped, less 1"),
            "overlap": labelled(
                "mode", overlaps[found, paired], "1", "MAC of free and clamped deflections"
            ),
            "joint_strain_share": labelled(
                "mode", joint, "1", "throat joint's share in the strain energy, racket free"
            ),
            "frame_motion": labelled(
                "mode",
                free_shapes.frame_motion()[at],
                "1",
                "largest displacement of the axis over the largest of the strings, racket free",
            ),
            **string_variables(shapes.strings[rows], parameters.bed_topology()),
        },
        coords={"mode": ("mode", np.arange(1, len(rows) + 1), {"long_name": "string-bed mode"})},
        attrs={
            "title": f"String-bed modes, {parameters.title}",
            "racket": racket,
            "tension": tension,
        },
    )


def _overlaps(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Squared cosines (rows of a, rows of b)."""
    unit = [rows / np.linalg.norm(rows, axis=1, keepdims=True) for rows in (a, b)]
    overlaps: NDArray[np.float64] = (unit[0] @ unit[1].T) ** 2
    return overlaps
