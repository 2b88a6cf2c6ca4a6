"""Says what a user should know about a run: what is open, and where the model does not hold."""

from __future__ import annotations

import math

import numpy as np

from drake_racket.cases.case import Case
from drake_racket.cases.effort import effort, unstable
from drake_racket.engines.trajectory import Trajectory
from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import PHASE, ContactRecord
from drake_racket.parameters.racket import RacketParameters
from drake_racket.results.energy import Balances

COUPLE_WARNING = 1e-3  # of the initial kinetic energy
ENERGY_WARNING = 1e-3
_FLAT = 0.8  # compression over the ball's radius, near which a ball is a disc
_SMALL_ANGLE = 0.2  # rad; sin x = x to 0.7 %
_COMPRESSION = 2  # column of a trajectory's contact


def run_warnings(
    case: Case,
    trajectory: Trajectory,
    record: ContactRecord,
    energies: Balances | None,
    energy_error: float | None,
) -> list[str]:
    """Lists the warnings of one run, the limb's notes first."""
    limb = trajectory.mechanism.limb
    return [
        *(() if limb is None else limb.notes),
        *_contact(case, record),
        *_beyond(case, trajectory, record),
        *_balance(case, energies, energy_error),
        *(text for text in (effort(case).slow(), unstable(case)) if text),
    ]


def _contact(case: Case, record: ContactRecord) -> list[str]:
    found = []
    low, high = case.ball.speed_low.value, case.ball.speed_high.value
    if record.touches == 0:
        found.append("the ball did not touch the strings")
    elif case.ball.normal == "linear" and not low - 1e-6 <= record.approach_speed <= high + 1e-6:
        found.append(
            f"normal approach speed {record.approach_speed:.4g} m/s is outside the identified"
            f" {low:g}-{high:g} m/s: kb and cb are held at their end values"
        )
    if record.touches > 1:
        found.append(f"the ball touched {record.touches} times; kb and cb are those of the first")
    if record.phase == CONTACT:
        found.append("the run ended in contact: lengthen `after`; rebound is the state at the end")
    return found


def _beyond(case: Case, trajectory: Trajectory, record: ContactRecord) -> list[str]:
    """Where the run leaves what the model's laws hold for."""
    found = []
    radius = case.ball.radius.value
    deepest = float(np.max(trajectory.contact[:, _COMPRESSION]))
    if record.touches and deepest > _FLAT * radius:
        found.append(
            f"the ball is compressed by {1e3 * deepest:.0f} mm of its radius of"
            f" {1e3 * radius:.0f} mm: more than its law holds for"
        )
    found += _along_the_strings(case, trajectory, record)
    bed, racket = case.racket.string_bed, case.racket
    x, y, _ = case.scenario.aim(racket) - np.array(racket.centre())
    a, b = bed.rim_semi_axis_x.value - radius, bed.rim_semi_axis_y.value - radius
    if min(a, b) <= 0.0 or math.hypot(x / a, y / b) > 1.0:
        found.append(
            "the ball's surface reaches over the rim: a real ball hits the frame there, this one"
            " meets strings alone"
        )
    bent = trajectory.state[:, trajectory.mechanism.frame.position]
    angle = float(np.max(np.abs(bent))) if bent.size else 0.0
    if angle > _SMALL_ANGLE:
        found.append(
            f"the frame bends by {math.degrees(angle):.0f} degrees at the throat: its linear spring"
            " and the model's frame shape hold for small angles"
        )
    return found + _moments(racket)


def _along_the_strings(case: Case, trajectory: Trajectory, record: ContactRecord) -> list[str]:
    """Contact surface keeps the string masses that it met first: says if the ball has left them."""
    if case.scenario.contact == "paper" or record.touches == 0:
        return []
    place, half = trajectory.mechanism.ball_position, 0.5 * case.racket.string_bed.spacing.value
    touching = np.flatnonzero(trajectory.record[:, PHASE] == CONTACT)
    ends = trajectory.state[[touching[0], touching[-1]], place : place + 3]
    pose = trajectory.motion.poses[0, trajectory.mechanism.handle]
    across = ((ends[1] - ends[0]) @ pose[:, :3])[:2]
    moved = float(np.linalg.norm(across))
    if moved <= half:
        return []
    return [
        f"the ball moved {1e3 * moved:.0f} mm along the strings in contact, and stayed on the"
        " string masses that it met first: its weights are frozen at touch"
    ]


def _moments(racket: RacketParameters) -> list[str]:
    """Moments that no body of that mass and length can have: its mass would lie outside it.

    Of all bodies of length L and half-width b, two masses at the far corners have the largest
    moments: about the axis along it m b^2, across it m (L^2 / 4 + b^2) or m L^2 / 4.
    """
    found = []
    rim = racket.string_bed.rim_semi_axis_y.value
    for name, part, wide in (("handle", racket.handle, 0.5 * rim), ("head", racket.head, rim)):
        half, mass = 0.5 * part.length.value, part.mass.value
        for key, quantity, most in (
            ("moi_longitudinal", part.moi_longitudinal, wide**2),
            ("moi_transverse", part.moi_transverse, half**2 + wide**2),
            ("moi_frontal", part.moi_frontal, half**2 + wide**2),
        ):
            if quantity.value > mass * most:
                found.append(
                    f"racket.{name}.{key} {quantity.value:g} kg m^2 is more than a body of"
                    f" {mass:g} kg and that size can have, {mass * most:.2g}"
                )
    return found


def _balance(case: Case, energies: Balances | None, error: float | None) -> list[str]:
    found = []
    if error is not None and error > ENERGY_WARNING:
        text = f"the energy balance is open by {error:.2g} of the initial energy"
        found.append(text + _closed_by(case, error))
    if energies is not None:
        initial = energies.store("ball")[0] + energies.store("rigid_motion")[0]
        share = abs(energies.store("couple")[-1]) / initial
        if share > COUPLE_WARNING:
            found.append(
                f"the reaction at the string mass adds {share:.2g} of the initial energy by its"
                " couple (reaction_point: ball does not)"
            )
    return found


def _closed_by(case: Case, error: float) -> str:
    """What would close a balance."""
    scenario = case.scenario
    if scenario.time_step > 0.0 or not scenario.integrator.error_control:
        key = "time_step" if scenario.time_step > 0.0 else "integrator.maximum_step"
        if error > 0.3:
            return f" (unstable: a shorter {key})"
        if scenario.time_step > 0.0:
            bound = SECOND_ORDER * scenario.time_step**2
            order = f"of second order in its step: up to {bound:.1g} at {scenario.time_step:g} s"
            return f" (a discrete plant's balance is {order}, where the ball touches)"
        return f" (a shorter {key} closes it)"
    tighter = 0.1 * scenario.integrator.accuracy
    return f" (integrator.accuracy of {tighter:.0e} or less closes it)"


SECOND_ORDER = 6e6
"""Of the initial energy per second squared of a discrete plant's step: the most that it is open.

Measured on all supports, at 10 to 60 m/s, wherever in a step the touch falls: 1.2e6 to 5.1e6 at
the sample that sees the touch, where the ball's damper sets a string mass of 1.7 g moving within
one step; at the end of a run a quarter of it or less.
"""
