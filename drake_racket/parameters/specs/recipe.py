"""Splits a whole racket's numbers into the model's handle, head and throat joint.

Mass m, balance b and swingweight S (about a = 0.1016 m) are three numbers, and the two parts have
more unknowns. The recipe takes from the two published rackets (Glynn et al. 2011, Table 1) what
they have in common, as means:

- the throat joint at 0.519 of the length;
- the head's centre of mass at 0.505 of the head's length from the joint;
- transverse radii of gyration k of 0.350 (handle) and 0.444 (head) of the part's length;
- the handle's longitudinal radius of gyration, 0.024 m.

The strings' masses leave m, m b and S first. With d = x_head - a and s = m (b - a) of the frame,
the head's mass M is the root of the swingweight equation

    M^2 (kh^2 - kH^2) + M [m (kH^2 + d^2 - 2 kh^2) - 2 s d + S] + m^2 kh^2 + s^2 - S m = 0

for which both masses are positive; the balance gives the handle's centre of mass, the twistweight
the head's longitudinal moment, and a flat head the moment about the normal. The joint's stiffness
is k = J (2 pi f)^2, J the inertia that two free bodies on a hinge have in bending,

    1/J = e^T M^-1 e

over the hinge's displacement and the two angles, e = (0, -1, 1). f is taken as the bare frame's:
the strung racket's is lower by about 0.6 %, less than the numbers' spread.

The split is one of many that have the same m, b and S: what the ball and the whole racket do is
safe, the load in the hinge is not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.parameters.specs import regressions

AXIS = 0.1016  # m from the butt, of the swingweight
HANDLE_ROLL_RADIUS = 0.024  # m
FITS = 4.0  # standard deviations, within which numbers fit together


@dataclass(frozen=True)
class Proportions:
    """The proportions are what two parts have in common that a shop does not print.

    Attributes:
        joint: its place, of the racket's length.
        head_com: of the head's length from the joint.
        handle_radius, head_radius: transverse radii of gyration, of the part's length.

    """

    joint: float = 0.519
    head_com: float = 0.505
    handle_radius: float = 0.350
    head_radius: float = 0.444


USUAL = Proportions()
RECREATIONAL = Proportions(joint=0.519, head_com=0.555, handle_radius=0.382, head_radius=0.453)
"""Of one of the two published rackets (the joint's place kept): the mean is a spread away from it,
and from the other (0.456, 0.319, 0.435)."""


@dataclass(frozen=True)
class Whole:
    """The whole is what the strung racket has: kg, m, kg m^2, Hz."""

    mass: float
    balance: float
    swingweight: float
    twistweight: float
    length: float
    out_of_plane: float
    in_plane: float


@dataclass(frozen=True)
class Strings:
    """The strings are equal point masses: kg of all, and their places (n, 2) (m) from the butt."""

    mass: float
    places: NDArray[np.float64]

    def about(self, place: float) -> float:
        """Gives the moment (kg m^2) about the transverse axis at `place`."""
        return self.mass * float(np.mean((self.places[:, 0] - place) ** 2))


@dataclass(frozen=True)
class Rigid:
    """A rigid part: mass, length, com from its end nearest the butt; moments about its com."""

    mass: float
    length: float
    com: float
    longitudinal: float
    transverse: float
    frontal: float


@dataclass(frozen=True)
class Split:
    """The split is the two parts, and the joint's stiffness (N m/rad) in each plane."""

    handle: Rigid
    head: Rigid
    out_of_plane: float
    in_plane: float


def split(
    whole: Whole,
    strings: Strings,
    half_width: float,
    where: str = "",
    proportions: Proportions = USUAL,
) -> Split:
    """Solves the recipe.

    Args:
        whole: of the strung racket.  strings: leave it first.
        half_width: m, the rim's, which bounds the twistweight.

    Raises:
        InputError: no two parts have these numbers; the message says which fit the others.

    """
    p = proportions
    joint = p.joint * whole.length
    head_length = whole.length - joint
    frame = whole.mass - strings.mass
    first = whole.mass * whole.balance - strings.mass * float(strings.places[:, 0].mean())
    swing = whole.swingweight - strings.about(AXIS)
    masses = _masses(whole, frame, first, swing, strings.about(AXIS), where, p)
    handle_mass, head_mass, handle_com = masses
    roll = handle_mass * HANDLE_ROLL_RADIUS**2
    transverse = handle_mass * (p.handle_radius * joint) ** 2
    handle = Rigid(handle_mass, joint, handle_com, roll, transverse, transverse)
    along = whole.twistweight - roll - strings.mass * float(np.mean(strings.places[:, 1] ** 2))
    _check_twist(whole, along, head_mass, half_width, where)
    across = head_mass * (p.head_radius * head_length) ** 2
    com = p.head_com * head_length
    head = Rigid(head_mass, head_length, com, along, across, along + across)
    return Split(
        handle=handle,
        head=head,
        out_of_plane=_stiffness(handle, head, "transverse", whole.out_of_plane),
        in_plane=_stiffness(handle, head, "frontal", whole.in_plane),
    )


def _masses(
    whole: Whole,
    frame: float,
    first: float,
    swing: float,
    strings: float,
    where: str,
    p: Proportions,
) -> tuple[float, float, float]:
    """Masses of handle and head, and the handle's centre of mass, of the swingweight equation."""
    joint = p.joint * whole.length
    lever = joint + p.head_com * (whole.length - joint) - AXIS
    handle2 = (p.handle_radius * joint) ** 2
    head2 = (p.head_radius * (whole.length - joint)) ** 2
    moment = first - frame * AXIS
    roots = np.roots(
        [
            handle2 - head2,
            frame * (head2 + lever**2 - 2.0 * handle2) - 2.0 * moment * lever + swing,
            frame**2 * handle2 + moment**2 - swing * frame,
        ]
    )
    for head in roots[np.isreal(roots)].real:
        if 0.0 < head < frame:
            com = AXIS + (moment - head * lever) / (frame - head)
            if 0.0 < com < joint:
                return float(frame - head), float(head), float(com)
    # what the others allow: every head mass that leaves a handle with its balance inside it
    head = np.linspace(0.0, frame, 2001)[1:-1]
    arm = (moment - head * lever) / (frame - head)
    inside = (arm + AXIS > 0.0) & (arm + AXIS < joint)
    said = f"{1e3 * whole.mass:.4g} g balanced at {1e2 * whole.balance:.4g} cm"
    key = f"{where}mass, balance, swingweight"
    got = f"{said} with swingweight {1e4 * whole.swingweight:.4g} kg cm²"
    if not inside.any():
        raise InputError(key, got, f"numbers that fit together ({said} leave no handle and head)")
    swings = strings + (frame - head) * (handle2 + arm**2) + head * (head2 + lever**2)
    low, high = 1e4 * swings[inside].min(), 1e4 * swings[inside].max()
    allowed = f"numbers that fit together ({said} has {low:.0f} to {high:.0f} kg cm²)"
    raise InputError(key, got, allowed)


def _check_twist(
    whole: Whole, along: float, head_mass: float, half_width: float, where: str
) -> None:
    """The head's mass lies between its axis and just outside the rim."""
    rest = whole.twistweight - along
    low, high = rest + head_mass * (0.4 * half_width) ** 2, rest + head_mass * half_width**2
    if not low <= whole.twistweight <= high:
        got = f"{1e4 * whole.twistweight:.4g} kg cm²"
        allowed = (
            f"{1e4 * low:.3g} to {1e4 * high:.3g} kg cm², which fits a head of"
            f" {1e3 * head_mass:.0f} g that is {2e2 * half_width:.3g} cm wide"
        )
        raise InputError(f"{where}twistweight", got, allowed)


def bending_inertia(handle: Rigid, head: Rigid, moment: str) -> float:
    """Gives the inertia J (kg m^2) of a free racket in bending; see the module.

    Args:
        handle, head: on a hinge at the handle's upper end.
        moment: `transverse` out of plane, `frontal` in plane.

    """
    back, front = handle.length - handle.com, head.com
    mass = np.array(
        [
            [handle.mass + head.mass, -handle.mass * back, head.mass * front],
            [-handle.mass * back, getattr(handle, moment) + handle.mass * back**2, 0.0],
            [head.mass * front, 0.0, getattr(head, moment) + head.mass * front**2],
        ]
    )
    bend = np.array([0.0, -1.0, 1.0])
    return 1.0 / float(bend @ np.linalg.solve(mass, bend))


def _stiffness(handle: Rigid, head: Rigid, moment: str, frequency: float) -> float:
    return bending_inertia(handle, head, moment) * (2.0 * math.pi * frequency) ** 2


@dataclass(frozen=True)
class Fundamental:
    """The fundamental is the out-of-plane frequency, its status, and where it comes from."""

    value: float
    sd: float
    status: str
    source: str


def fundamental(
    mass: float, ra: float | None, frequency: float | None, where: str = ""
) -> Fundamental:
    """Gives the out-of-plane fundamental (Hz) of what is known of it.

    Args:
        mass: strung, kg.  ra: flex.  frequency: Hz, measured.

    Raises:
        InputError: flex and frequency do not fit together.

    """
    of_ra = regressions.frequency_of_ra(ra, mass) if ra is not None else None
    if frequency is not None:
        if of_ra and abs(frequency - of_ra.value) > FITS * of_ra.sd:
            text = f"RA {ra:g} at {1e3 * mass:.4g} g is {of_ra.value:.0f} Hz, sd {of_ra.sd:.1f} Hz"
            allowed = f"numbers that fit together ({text})"
            raise InputError(f"{where}ra, frequency", f"RA {ra:g} and {frequency:g} Hz", allowed)
        return Fundamental(frequency, 0.5, "measured", "printed by the shop, strung")
    if of_ra is not None:
        source = f"1.702 RA m^-0.24 for RA {ra:g}, sd 3.4 %: {regressions.SOURCE}"
        return Fundamental(of_ra.value, of_ra.sd, "inferred", source)
    source = f"no flex and no frequency given: the median, sd 11.9 Hz, of {regressions.SOURCE[11:]}"
    median, sd = regressions.MEDIAN_FREQUENCY, regressions.MEDIAN_FREQUENCY_SPREAD
    return Fundamental(median, sd, "inferred", source)
