"""Computes mass, centre of mass and moments of racket parts, and of what they make together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from drake_racket.io.errors import InputError
from drake_racket.parameters.frame import Part
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.properties import SWINGWEIGHT_AXIS
from drake_racket.rigs.input_checks import (
    check_finite,
    check_not_negative,
    check_positive,
    check_result,
)

SPECIMENS = ("handle", "head", "frame", "strung")


@dataclass(frozen=True)
class Inertia:
    """Holds a rigid body whose centre of mass lies on the racket's long axis.

    Attributes:
        mass: kg.  com: m, from the butt.
        longitudinal, transverse, frontal: kg m^2, principal moments about the centre of mass: about
            x, about y, and about z, the normal of the string plane.

    """

    mass: float
    com: float
    longitudinal: float
    transverse: float
    frontal: float


def combine(parts: Sequence[Inertia]) -> Inertia:
    """Combines mass, centre of mass and moments of rigidly joined parts (parallel axes).

    Args:
        parts: each with its own centre of mass measured from the racket's butt.

    Raises:
        InputError: no part, a mass that is not positive, or a moment that is negative; a thin or
            point-like part may have moments of 0.

    """
    if not parts:
        raise InputError("parts", parts, "at least one part")
    for part in parts:
        check_positive(mass=part.mass)
        check_finite("com", part.com)
        check_not_negative(
            longitudinal=part.longitudinal, transverse=part.transverse, frontal=part.frontal
        )
    mass = sum(p.mass for p in parts)
    com = sum(p.mass * p.com for p in parts) / mass
    spread = sum(p.mass * (p.com - com) * (p.com - com) for p in parts)
    total = Inertia(
        mass=mass,
        com=com,
        longitudinal=sum(p.longitudinal for p in parts),
        transverse=sum(p.transverse for p in parts) + spread,
        frontal=sum(p.frontal for p in parts) + spread,
    )
    check_result("parts", mass, com, total.longitudinal, total.transverse, total.frontal)
    return total


def swingweight(
    mass: float, balance: float, moment: float, *, axis: float = SWINGWEIGHT_AXIS
) -> float:
    """Gives the moment of inertia (kg m^2) about a parallel axis `axis` from the butt.

    4 inches by custom.

        I_axis = I_com + m (balance - axis)^2

    Args:
        mass: kg.  balance: m, centre of mass from the butt.
        moment: kg m^2, about the centre of mass: transverse for swingweight, frontal for
            spinweight.
        axis: m from the butt.

    Raises:
        InputError: a value is not finite or out of range.

    """
    check_positive(mass=mass, moment=moment)
    check_finite("balance", balance)
    check_finite("axis", axis)
    total = moment + mass * (balance - axis) * (balance - axis)
    check_result("mass, balance, moment", total)
    return total


def specimen_pieces(parameters: RacketParameters, specimen: str) -> list[Inertia]:
    """Gives the rigid pieces of what is measured, places from its end nearest the butt.

    `handle` and `head` are the two parts of the frame, with the moments of the parameter file
    (Table 1 of Glynn et al. 2011 for the shipped rackets); `frame` is both; `strung` adds the
    strings as equal point masses in the string plane.

    Raises:
        InputError: `specimen` is not one of SPECIMENS.

    """
    handle, head = _inertia(parameters.handle), _inertia(parameters.head)
    in_racket = replace(head, com=parameters.handle.length.value + head.com)
    mass = parameters.string_mass()
    points = [parameters.point(i) for i in parameters.bed_topology().points]
    strings = combine([Inertia(mass, x, mass * y * y, 0.0, mass * y * y) for x, y, _ in points])
    pieces = {
        "handle": [handle],
        "head": [head],
        "frame": [handle, in_racket],
        "strung": [handle, in_racket, strings],
    }
    if specimen not in pieces:
        raise InputError("specimen", specimen, ", ".join(SPECIMENS))
    return pieces[specimen]


def specimen_length(parameters: RacketParameters, specimen: str) -> float:
    """Gives the length (m) of what is measured."""
    if specimen == "handle":
        return parameters.handle.length.value
    if specimen == "head":
        return parameters.head.length.value
    return parameters.handle.length.value + parameters.head.length.value


def _inertia(part: Part) -> Inertia:
    if part.centre()[1] or part.product():
        allowed = "a racket that is alike on both sides of its long axis (these sums know no other)"
        raise InputError("racket: com_y", part.centre()[1], allowed)
    return Inertia(
        mass=part.mass.value,
        com=part.com.value,
        longitudinal=part.moi_longitudinal.value,
        transverse=part.moi_transverse.value,
        frontal=part.moi_frontal.value,
    )
