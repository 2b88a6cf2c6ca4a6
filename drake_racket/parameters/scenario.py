"""A scenario is one impact as data, frozen; it describes a run.

`cases.resolve` loads what a scenario names and checks the whole.
"""

from __future__ import annotations

import dataclasses
import math
import re
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.io.notebooks.tables import html_table
from drake_racket.io.numbers import number_between, plain_numbers
from drake_racket.io.schema import (
    After,
    Flag,
    Number,
    OneOf,
    Rule,
    Schema,
    Text,
    Three,
    Vector,
    read,
    refusal,
    shown_changes,
)
from drake_racket.laws.contact import FRICTION_READINGS, NORMAL_LAWS, REACTION_POINTS
from drake_racket.laws.surface import CONTACTS
from drake_racket.parameters.ball import BallParameters, load_ball
from drake_racket.parameters.frame import JOINT_READINGS
from drake_racket.parameters.grip import GRIP_KINDS, GripStiffness, load_grip
from drake_racket.parameters.limb_settings import LimbSettings
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.parameters.racket import RacketParameters, load_racket

SUPPORTS = ("free", "clamped_head", "clamped_handle", "grip", "limb")
SCHEMES = ("runge_kutta2", "runge_kutta3", "runge_kutta5")
ENGINES = ("auto", "drake", "compiled")
"""Of a scenario. `auto`: one impact runs on Drake, sweeps take the compiled engine where it can."""
RPM = math.pi / 30.0
"""rad/s in a turn per minute."""
MAXIMUM_STEP = 2e-4
"""s, of a run with an impact: the default, and the longest measured (docs/performance.md)."""


@dataclass(frozen=True, repr=False)
class IntegratorSettings(Schema):
    """The settings say how a continuous plant is integrated; docs/performance.md has the reasons.

    Attributes:
        scheme: of Drake's integrators.
        accuracy: target of the error control, relative.
        maximum_step: s; the fixed step without error control.
        error_control: steps by the estimated error.

    """

    scheme: Annotated[str, OneOf(*SCHEMES)] = "runge_kutta3"
    accuracy: Annotated[float, Number("1", 1e-12, 0.1)] = 2e-4
    maximum_step: Annotated[float, Number("s", 1e-7, 1.0)] = 2e-4
    error_control: Flag = True

    def __post_init__(self) -> None:
        """Numbers become Python floats."""
        plain_numbers(self)

    def __repr__(self) -> str:
        """Shows what differs from the defaults."""
        return shown_changes(self)


def check_integrator(
    settings: IntegratorSettings, where: str = "integrator", longest: float = MAXIMUM_STEP
) -> None:
    """Checks the settings' ranges, steps up to `longest` (s); raises InputError."""
    settings = read(settings, IntegratorSettings, where)
    number_between(f"{where}.maximum_step", settings.maximum_step, 1e-7, longest, "s")
    if settings.scheme == "runge_kutta2" and settings.error_control:
        raise InputError(
            f"{where}.error_control", True, "false with runge_kutta2, which estimates no error"
        )


class _Overrides(Rule):
    """Keys and numbers; which keys there are, and what their numbers may be, `overrides` knows."""

    def check(self, value: Any, *, written: bool = False) -> dict[str, float]:
        """The mapping as it is."""
        if not isinstance(value, dict):
            raise refusal(value, "keys and numbers")
        for key in value:
            if not isinstance(key, str):
                raise refusal(key, "keys that are texts")
        return value


def _point(text: str) -> str:
    if text != "auto" and not re.fullmatch(r"[1-9][0-9]*", text, re.ASCII):
        raise refusal(text, "the number of a string-bed point (1 to 9), or auto")
    return text


def _time_step(step: float) -> float:
    if 0.0 < step < 1e-7:
        raise refusal(step, "0, or 1e-7 to 1e-3 s")
    return step


@dataclass(frozen=True, repr=False)
class Scenario(Schema):
    """A scenario is one impact as data. SI units; angles in degrees, as their names say.

    Attributes:
        racket: `tour`, `recreational`, or the path of a racket's file.
        tension: `low`, `high`, or a stringing tension in N (`280`, `63lb`) on the line through the
            two published ones; a racket's file has its own.
        ball: `penn_titanium`, or the path of a ball's file.
        joint_reading: `by_axis`, `as_printed`, or empty for what the racket's file says.
        friction_reading: where friction points: against the sliding `velocity`, or the
            `displacement` from the place of touch, as the paper has it; or by an `element`, a
            spring and a damper along the strings that slide at mu N (`laws.surface`).
        reaction_point: where the contact's reaction acts on the head: at the `ball`, or at the
            `string_mass`, as the paper has it.
        normal: law of the ball's normal force, `linear` or `hunt_crossley` (`laws.contact`), or
            empty for what the ball's file says.
        contact: `paper`, a ball that is a point without spin and meets one string mass, or
            `surface`, one with radius and spin that meets the strings anywhere (`laws.surface`);
            `point` then is but where its surface is aimed, and the two above have no say.
        support: `free`, `clamped_head` (head welded to the world), `clamped_handle`, `grip`
            (a hand fixed in the world; see `plant.grip`), or `limb` (a hand at the end of a limb).
        grip: of the hand: `loose`, `normal`, `tight`, or the path of a grip's file.
        grip_kind: six spring-dampers (`compliant`), three about a held point (`torsional`), or a
            rigid hand (`weld`); see `plant.grip`.
        limb: with support `limb`, which one, and its stroke: `LimbSettings`.
        overrides: single numbers of racket, ball and grip in place of their files', by dotted key:
            `racket.head.mass`, `ball.stiffness_low`, `grip.force_stiffness.x`; see `overrides`.
        point: a number (`1` to `9` on a bed of nine), or `auto` for the point nearest to the ball
            at touch.
        offset_x, offset_y: where the ball is aimed, from the point (with `auto`, the centre), along
            the racket and across it.
        speed: of the ball, in the world.
        incidence_deg: from the normal of the strings.
        azimuth_deg: direction of the tangential part in the string plane, from +x towards +y.
        spin_rpm: of the ball before touch, about the axis along which friction spins a ball of this
            incidence, and positive in friction's sense; with contact `surface` only.
        spin: more of it, as a vector in R (rad/s).
        approach_time: flight before touch.  after: time simulated from touch on.
        gravity: in the world; that is the racket's initial frame R but where a limb holds it.
        time_step: 0 for a continuous plant, else the step of a discrete one.
        audit: integrate losses and impulse beside the motion (`results.energy`).
        engine: what computes it: `drake`, `compiled`, or `auto`; see ENGINES.
        integrator: steps and accuracy; the compiled engine has a scheme of its own.

    """

    racket: Text = "tour"
    tension: Text = "low"
    ball: Text = "penn_titanium"
    joint_reading: Annotated[str, OneOf("", *JOINT_READINGS)] = ""
    friction_reading: Annotated[str, OneOf(*FRICTION_READINGS)] = "velocity"
    reaction_point: Annotated[str, OneOf(*REACTION_POINTS)] = "ball"
    normal: Annotated[str, OneOf("", *NORMAL_LAWS)] = ""
    contact: Annotated[str, OneOf(*CONTACTS)] = "paper"
    support: Annotated[str, OneOf(*SUPPORTS)] = "free"
    grip: Text = "normal"
    grip_kind: Annotated[str, OneOf(*GRIP_KINDS)] = "compliant"
    limb: LimbSettings = field(default_factory=LimbSettings)
    overrides: Annotated[dict[str, float], _Overrides()] = field(default_factory=dict)
    point: Annotated[Text, After(_point)] = "5"
    offset_x: Annotated[float, Number("m", -0.2, 0.2)] = 0.0
    offset_y: Annotated[float, Number("m", -0.2, 0.2)] = 0.0
    speed: Annotated[float, Number("m/s", 0.1, 100.0)] = 25.0
    incidence_deg: Annotated[float, Number("degrees", 0.0, 80.0)] = 0.0
    azimuth_deg: Annotated[float, Number("degrees", -360.0, 360.0)] = 90.0
    spin_rpm: Annotated[float, Number("rpm", -20000.0, 20000.0)] = 0.0
    spin: Annotated[Vector, Three("rad/s", 2100.0)] = (0.0, 0.0, 0.0)
    approach_time: Annotated[float, Number("s", 0.0, 0.1)] = 0.001
    after: Annotated[float, Number("s", 1e-4, 2.0)] = 0.05
    gravity: Annotated[Vector, Three("m/s^2", 100.0)] = (0.0, 0.0, 0.0)
    time_step: Annotated[float, Number("s", 0.0, 1e-3), After(_time_step)] = 0.0
    audit: Flag = True
    engine: Annotated[str, OneOf(*ENGINES)] = "auto"
    integrator: IntegratorSettings = field(default_factory=IntegratorSettings)

    def __post_init__(self) -> None:
        """Point and tension may be written as numbers; all other numbers become Python floats."""
        for name in ("point", "tension"):
            object.__setattr__(self, name, str(getattr(self, name)))
        plain_numbers(self)

    def __repr__(self) -> str:
        """Shows what differs from the defaults."""
        return shown_changes(self)

    def _repr_html_(self) -> str:
        """Shows a notebook every key, and which differ from their defaults."""
        usual = Scenario()
        rows = [
            (item.name, f"{value!r}", "" if value == getattr(usual, item.name) else "changed")
            for item in dataclasses.fields(self)
            for value in (getattr(self, item.name),)
        ]
        return html_table("Scenario", rows, head=("key", "value", ""))

    def point_number(self) -> int:
        """Gives the point's number from 1 on, or 0 for `auto`."""
        return 0 if self.point == "auto" else int(self.point)

    def load_racket(self) -> RacketParameters:
        """Loads the racket's parameters, with the overrides; raises InputError."""
        racket = load_racket(self.racket, self.tension, joint_reading=self.joint_reading or None)
        return apply_overrides(racket, self.overrides)

    def load_ball(self) -> BallParameters:
        """Loads the ball's parameters, with the overrides; raises InputError."""
        return apply_overrides(load_ball(self.ball, normal=self.normal or None), self.overrides)

    def has_element(self) -> bool:
        """Tells whether a sheared spring and damper make friction: `laws.surface`."""
        return self.contact == "surface" or self.friction_reading == "element"

    def idle_of_ball(self, ball: BallParameters) -> dict[str, str]:
        """Gives beginnings of a ball's keys whose numbers do nothing here, and the law's name."""
        idle = {}
        if self.contact == "surface":
            idle["sliding_"] = "contact surface"
        elif self.has_element():
            law = "friction_reading element"
            idle |= dict.fromkeys(("sliding_", "surface.inertia_", "surface.flattening"), law)
        else:
            idle["surface."] = "contact paper"
        if ball.normal == "linear":
            idle["hunt_crossley."] = "normal linear"
        else:
            law = f"normal {ball.normal}"
            idle |= dict.fromkeys(("stiffness_", "damping_"), law)
        return idle

    def load_grip(self) -> GripStiffness:
        """Loads the hand's grip, with the overrides; raises InputError."""
        return apply_overrides(load_grip(self.grip), self.overrides)

    def aim(self, racket: RacketParameters) -> NDArray[np.float64]:
        """Tells where the ball is aimed, p_RoA_R (m)."""
        number = self.point_number()
        x, y, z = racket.point(number) if number else racket.centre()
        return np.array([x + self.offset_x, y + self.offset_y, z])

    def ball_velocity(self) -> NDArray[np.float64]:
        """Gives the initial velocity of the ball in R (m/s)."""
        incidence, azimuth = math.radians(self.incidence_deg), math.radians(self.azimuth_deg)
        tangential = self.speed * math.sin(incidence)
        return np.array(
            [
                tangential * math.cos(azimuth),
                tangential * math.sin(azimuth),
                -self.speed * math.cos(incidence),
            ]
        )

    def spin_axis(self) -> NDArray[np.float64]:
        """Gives the unit vector in R about which friction spins a ball of this incidence."""
        azimuth = math.radians(self.azimuth_deg)
        return np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])

    def ball_spin(self) -> NDArray[np.float64]:
        """Gives the initial angular velocity of the ball in R (rad/s)."""
        found: NDArray[np.float64] = np.array(self.spin) + self.spin_rpm * RPM * self.spin_axis()
        return found
