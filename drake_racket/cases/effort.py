"""Estimates before a run how many steps a case takes, and which number makes it slow or unstable.

A step resolves the fastest motion: where it is excited (strings and ball) about 10 steps a radian,
where it is not about one step in 3 rad, the stability limit of explicit schemes. All rates here are
upper ones, from masses and stiffnesses of the parameters alone (rad/s):

- a string mass on its four springs, at a slope of 0.2, and on the ball: sqrt(k / m), c / m;
- a joint of the frame between two segments a and b: sqrt(k / I), d / I with 1/I = 1/I_a + 1/I_b;
- the racket on a hand's springs: sqrt(k / m), sqrt(k / I), and their dampers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drake_racket.cases.case import Case
from drake_racket.plant.ball import ball_law

SLOW = 40_000
"""Steps from which a run is called slow: about half a minute."""

_COMPILED = 20  # times faster, at least, is a step of the compiled engine
_SLOPE = 0.2  # dz/L of the springs at a point that is hit hard
_PER_RADIAN, _PER_STABLE, _PER_SECOND = 10.0, 1.0 / 3.0, 1e5  # steps
_LONGEST = 1.5  # rad in a fixed step, beyond which it is unstable or wrong


@dataclass(frozen=True)
class Rate:
    """Holds one fast motion: its rate (rad/s), whether an impact excites it, and what sets it."""

    value: float
    excited: bool
    cause: str

    def steps(self, seconds: float) -> float:
        """Gives the steps that it asks for."""
        return self.value * seconds * (_PER_RADIAN if self.excited else _PER_STABLE)


@dataclass(frozen=True)
class Effort:
    """Says what a run takes: steps, in how many seconds of motion, and the rate that decides."""

    steps: float
    seconds: float
    fastest: Rate
    compiled: bool = False

    def slow(self) -> str:
        """Says that a run is slow, and why; empty if it is not."""
        if self.steps < SLOW * (_COMPILED if self.compiled else 1):
            return ""
        about = float(f"{self.steps:.1g}")
        if self.fastest.steps(self.seconds) < self.steps:
            return f"about {about:,.0f} steps for {self.seconds:g} s: a shorter `after` is faster"
        return (
            f"about {about:,.0f} steps for {self.seconds:g} s: the fastest motion is"
            f" {self.fastest.value:.2g} rad/s, from {self.fastest.cause}"
        )


def effort(case: Case) -> Effort:
    """Estimates what a run of a case takes."""
    scenario = case.scenario
    seconds = scenario.approach_time + scenario.after
    fastest = max(rates(case), key=lambda rate: rate.steps(seconds))
    integrator = scenario.integrator
    if scenario.time_step > 0.0:
        steps = seconds / scenario.time_step
    elif not integrator.error_control:
        steps = seconds / integrator.maximum_step
    else:
        steps = max(_PER_SECOND * seconds, fastest.steps(seconds))
    return Effort(steps, seconds, fastest, scenario.engine == "compiled")


def unstable(case: Case) -> str:
    """Says that a fixed step is too long for the fastest motion, and which; empty if it is not."""
    scenario = case.scenario
    step, key = scenario.time_step, "time_step"
    if step == 0.0:
        if scenario.integrator.error_control:
            return ""
        step, key = scenario.integrator.maximum_step, "integrator.maximum_step"
    fastest = max(rates(case), key=lambda rate: rate.value)
    if step * fastest.value < _LONGEST:
        return ""
    return (
        f"{key} of {step:g} s is long for the fastest motion, {fastest.value:.2g} rad/s from"
        f" {fastest.cause}: unstable unless it is below {_LONGEST / fastest.value:.1g} s"
    )


def rates(case: Case) -> list[Rate]:
    """Lists the fast motions of a case, each with the number that sets it."""
    return [*_strings(case), *_frame(case), *_grip(case)]


def _strings(case: Case) -> list[Rate]:
    bed, ball = case.racket.string_bed, case.ball
    points = len(case.racket.bed_topology().points)
    mass = bed.mass.value / points
    k = max(bed.stiffness.value) * max(bed.rim_factors.value, default=1.0)
    springs = 4.0 * (bed.initial_tension.value / bed.spacing.value + k * _SLOPE**2)
    _, _, kb, kb_growth, cb, cb_growth, hb, db = ball_law(ball)
    kb = kb * max(1.0, 1.0 + kb_growth) + 2.0 * hb * ball.radius.value
    cb = cb * max(1.0, 1.0 + cb_growth) + db * ball.radius.value
    strung = f"racket.string_bed.mass {bed.mass.value:g} kg"
    return [
        Rate(
            math.sqrt(springs / mass),
            True,
            f"{strung} on strings of up to {k:.2g} N/m and {bed.initial_tension.value:.3g} N",
        ),
        Rate(math.sqrt(kb / mass), True, f"{strung} and the ball's stiffness {kb:.2g} N/m"),
        Rate(cb / mass, False, f"the ball's damping {cb:.3g} N s/m on {strung}"),
        Rate(
            4.0 * _SLOPE**2 * bed.damping.value / mass,
            False,
            f"racket.string_bed.damping {bed.damping.value:g} N s/m on {strung}",
        ),
    ]


def _frame(case: Case) -> list[Rate]:
    racket, found = case.racket, []
    segments = racket.frame_segments()
    for joint in racket.frame_joints():
        inertias = []
        for segment in segments[joint.inner : joint.inner + 2]:
            arm = segment.origin + segment.com - joint.place
            own = segment.moments[joint.axis_index]
            inertias.append(own + (joint.axis_index > 0) * segment.mass * arm**2)
        both = inertias[0] * inertias[1] / sum(inertias)
        name = joint.name.replace("_", " ")
        k, d = joint.stiffness, joint.damping
        where = "the throat's" if len(segments) == 2 else "the frame's"
        found += [
            Rate(math.sqrt(k / both), False, f"{where} {name} stiffness {k:.3g} N m/rad"),
            Rate(d / both, False, f"{where} {name} damping {d:.3g} N m s/rad"),
        ]
    return found


def _grip(case: Case) -> list[Rate]:
    kind = case.scenario.grip_kind
    if case.scenario.support not in ("grip", "limb") or kind == "weld":
        return []
    racket, grip = case.racket, case.grip
    mass = racket.handle.mass.value + racket.head.mass.value + racket.string_bed.mass.value
    along = racket.handle.moi_longitudinal.value + racket.head.moi_longitudinal.value
    arm = racket.handle.length.value
    across = mass * arm**2
    found = []
    torques = zip("xyz", grip.torque_stiffness.value, grip.torque_damping.value, strict=True)
    for letter, k, d in torques:
        inertia = along if letter == "x" else across
        found += [
            Rate(math.sqrt(k / inertia), False, f"grip.torque_stiffness.{letter} {k:.3g} N m/rad"),
            Rate(d / inertia, False, f"grip.torque_damping.{letter} {d:.3g} N m s/rad"),
        ]
    if kind in ("compliant", "hand"):
        k, d = float(np.max(grip.force_stiffness.value)), float(np.max(grip.force_damping.value))
        found += [
            Rate(math.sqrt(k / mass), False, f"grip.force_stiffness {k:.3g} N/m"),
            Rate(d / mass, False, f"grip.force_damping {d:.3g} N s/m"),
        ]
    return found
