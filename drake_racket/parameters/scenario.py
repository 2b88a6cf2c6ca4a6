"""One impact as data: the typed scenario that describes a run.

Drake's typed YAML reads the annotations of these classes as types: they are not postponed here.
"""

import dataclasses
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.io.numbers import number_between, plain_numbers
from drake_racket.io.yaml_files import load_file, load_text
from drake_racket.laws.contact import FRICTION_READINGS, REACTION_POINTS
from drake_racket.parameters.ball import BallParameters, load_ball
from drake_racket.parameters.grip import GRIP_KINDS, GripStiffness, load_grip
from drake_racket.parameters.limb_settings import LimbSettings, check_limb_settings
from drake_racket.parameters.overrides import apply_overrides, check_known, parameter_keys
from drake_racket.parameters.racket import RacketParameters, load_racket

SUPPORTS = ("free", "clamped_head", "clamped_handle", "grip", "limb")
SCHEMES = ("runge_kutta2", "runge_kutta3", "runge_kutta5")
MAXIMUM_STEP = 2e-4
"""s, of a run with an impact: the default, and the longest measured (docs/performance.md)."""


@dataclass
class IntegratorSettings:
    """How a continuous plant is integrated; the defaults come from docs/performance.md."""

    scheme: str = "runge_kutta3"
    accuracy: float = 2e-4  # target of the error control, relative
    maximum_step: float = 2e-4  # s; the fixed step without error control
    error_control: bool = True

    def __post_init__(self) -> None:
        """Numbers become Python floats."""
        plain_numbers(self)


@dataclass
class Scenario:
    """One impact. SI units; angles in degrees, as their names say.

    Attributes:
        racket, tension, ball: names of shipped parameter files, paths of the user's own, or for
            the tension a number in N; see `parameters.load_racket` and `load_ball`.
        joint_reading: `by_axis`, `as_printed`, or empty for what the racket's file says.
        friction_reading, reaction_point: see `diagram.add_impact`.
        support: `free`, `clamped_head` (head welded to the world), `clamped_handle`, `grip`
            (a hand fixed in the world; see `grip`), or `limb` (a hand at the end of a limb).
        grip, grip_kind: of the hand, by name or file: `loose`, `normal`, `tight`; and `compliant`,
            `torsional` or `weld` (see `grip`).
        limb: with support `limb`, which one, and its stroke: `limbs.settings`.
        overrides: single numbers of racket, ball and grip in place of their files', by dotted key:
            `racket.head.mass`, `ball.stiffness_low`, `grip.force_stiffness.x`; see `overrides`.
        point: a number (`1` to `9` on a bed of nine), or `auto` for the point nearest to the ball
            at touch.
        offset_x, offset_y: where the ball is aimed, from the point (with `auto`, the centre).
        speed: of the ball, in the world.  incidence_deg: from the normal of the strings.
            azimuth_deg: direction of the tangential part in the string plane, from +x towards +y.
        approach_time: flight before touch.  after: time simulated from touch on.
        gravity: in the world; that is the racket's initial frame R but where a limb holds it.
        time_step: 0 for a continuous plant, else the step of a discrete one.
        audit: integrate losses and impulse beside the motion (`energy`).

    """

    racket: str = "tour"
    tension: str = "low"
    ball: str = "penn_titanium"
    joint_reading: str = ""
    friction_reading: str = "velocity"
    reaction_point: str = "ball"
    support: str = "free"
    grip: str = "normal"
    grip_kind: str = "compliant"
    limb: LimbSettings = field(default_factory=LimbSettings)
    overrides: dict[str, float] = field(default_factory=dict)
    point: str = "5"
    offset_x: float = 0.0
    offset_y: float = 0.0
    speed: float = 25.0
    incidence_deg: float = 0.0
    azimuth_deg: float = 90.0
    approach_time: float = 0.001
    after: float = 0.05
    gravity: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    time_step: float = 0.0
    audit: bool = True
    integrator: IntegratorSettings = field(default_factory=IntegratorSettings)

    def __post_init__(self) -> None:
        """Point and tension may be written as numbers; all other numbers become Python floats."""
        self.point, self.tension = str(self.point), str(self.tension)
        plain_numbers(self)

    def point_number(self) -> int:
        """1 to the number of points, or 0 for `auto`."""
        return 0 if self.point == "auto" else int(self.point)

    def load_racket(self) -> RacketParameters:
        """The racket's parameters, with the overrides; raises InputError."""
        racket = load_racket(self.racket, self.tension, joint_reading=self.joint_reading or None)
        return apply_overrides(racket, self.overrides)

    def load_ball(self) -> BallParameters:
        """The ball's parameters, with the overrides; raises InputError."""
        return apply_overrides(load_ball(self.ball), self.overrides)

    def load_grip(self) -> GripStiffness:
        """The hand's grip, with the overrides; raises InputError."""
        return apply_overrides(load_grip(self.grip), self.overrides)

    def aim(self, racket: RacketParameters) -> NDArray[np.float64]:
        """Where the ball is aimed, p_RoA_R (m)."""
        number = self.point_number()
        x, y, z = racket.point(number) if number else racket.centre()
        return np.array([x + self.offset_x, y + self.offset_y, z])

    def ball_velocity(self) -> NDArray[np.float64]:
        """Initial velocity of the ball in R (m/s)."""
        incidence, azimuth = math.radians(self.incidence_deg), math.radians(self.azimuth_deg)
        tangential = self.speed * math.sin(incidence)
        return np.array(
            [
                tangential * math.cos(azimuth),
                tangential * math.sin(azimuth),
                -self.speed * math.cos(incidence),
            ]
        )


# key: (least, most, unit); the bounds keep a typing error from running for hours
_RANGES: dict[str, tuple[float, float, str]] = {
    "offset_x": (-0.2, 0.2, "m"),
    "offset_y": (-0.2, 0.2, "m"),
    "speed": (0.1, 100.0, "m/s"),
    "incidence_deg": (0.0, 80.0, "degrees"),
    "azimuth_deg": (-360.0, 360.0, "degrees"),
    "approach_time": (0.0, 0.1, "s"),
    "after": (1e-4, 2.0, "s"),
    "time_step": (0.0, 1e-3, "s"),
}
_CHOICES: dict[str, tuple[str, ...]] = {
    "joint_reading": ("", "by_axis", "as_printed"),
    "friction_reading": FRICTION_READINGS,
    "reaction_point": REACTION_POINTS,
    "support": SUPPORTS,
    "grip_kind": GRIP_KINDS,
}


def load_scenario(path: Path) -> Scenario:
    """Reads and checks a scenario file; keys that it leaves out keep their defaults.

    Raises:
        InputError: naming the key, the value and what is allowed.

    """
    scenario = load_file(path, Scenario, complete=False)
    check_scenario(scenario, str(path))
    return scenario


def parse_scenario(text: str, where: str = "scenario") -> Scenario:
    """Reads and checks a scenario from YAML text; see `load_scenario`."""
    scenario = load_text(text, Scenario, where=where, complete=False)
    check_scenario(scenario, where)
    return scenario


def check_scenario(scenario: Scenario, where: str = "scenario") -> None:
    """Checks every value, the parameter files it names, and where the ball is aimed.

    Numbers that were set after the scenario was made become Python floats.

    Raises:
        InputError: naming the key, the value and what is allowed.

    """
    plain_numbers(scenario)
    _check_types(scenario, where)
    for key, choices in _CHOICES.items():
        value = getattr(scenario, key)
        if value not in choices:
            raise InputError(f"{where}: {key}", value, ", ".join(c for c in choices if c))
    for key, (least, most, unit) in _RANGES.items():
        number_between(f"{where}: {key}", getattr(scenario, key), least, most, unit)
    if len(scenario.gravity) != 3:
        raise InputError(f"{where}: gravity", scenario.gravity, "three numbers (m/s^2)")
    for number in scenario.gravity:
        number_between(f"{where}: gravity", number, -100.0, 100.0, "m/s^2")
    if 0.0 < scenario.time_step < 1e-7:
        raise InputError(f"{where}: time_step", scenario.time_step, "0, or 1e-7 to 1e-3 s")
    check_integrator(scenario.integrator, f"{where}: integrator")
    racket, ball, grip = scenario.load_racket(), scenario.load_ball(), scenario.load_grip()
    if scenario.overrides:
        stray = [k for k in scenario.overrides if not k.startswith(("racket.", "ball.", "grip."))]
        check_known(stray, parameter_keys(racket, ball, grip))
        _check_grip_overrides(scenario, where)
    check_limb_settings(scenario.limb, f"{where}: limb")
    points = [*map(str, racket.bed_topology().points), "auto"]
    if scenario.point not in points:
        raise InputError(f"{where}: point", scenario.point, ", ".join(points))
    _check_aim(scenario, racket, where)


def _check_types(scenario: Scenario, where: str) -> None:
    """YAML is typed as it is read; this is for scenarios that Python code has built."""
    kinds = (
        (str, "a text", ("racket", "ball", "grip", "point", *_CHOICES)),
        (list, "a list", ("gravity",)),
        (bool, "true or false", ("audit",)),
        (IntegratorSettings, "IntegratorSettings", ("integrator",)),
        (LimbSettings, "LimbSettings", ("limb",)),
        (dict, "keys and numbers", ("overrides",)),
    )
    for kind, text, keys in kinds:
        for key in keys:
            if not isinstance(getattr(scenario, key), kind):
                raise InputError(f"{where}: {key}", getattr(scenario, key), text)
    for key in scenario.overrides:
        if not isinstance(key, str):
            raise InputError(f"{where}: overrides", key, "keys that are texts")


def _check_grip_overrides(scenario: Scenario, where: str) -> None:
    """Refuses numbers of a grip that this support or kind of grip does not look at."""
    for key, value in scenario.overrides.items():
        if not key.startswith("grip."):
            continue
        name = f"{where}: overrides.{key}"
        if scenario.support not in ("grip", "limb"):
            raise InputError(name, value, f"no grip's numbers with support {scenario.support}")
        if scenario.grip_kind == "weld":
            raise InputError(name, value, "no grip's numbers with grip_kind weld")
        if scenario.grip_kind == "torsional" and key.startswith("grip.force_"):
            raise InputError(name, value, "torques alone with grip_kind torsional")


def check_integrator(
    settings: IntegratorSettings, where: str = "integrator", longest: float = MAXIMUM_STEP
) -> None:
    """Checks the settings' ranges, steps up to `longest` (s); raises InputError."""
    if settings.scheme not in SCHEMES:
        raise InputError(f"{where}.scheme", settings.scheme, ", ".join(SCHEMES))
    number_between(f"{where}.accuracy", settings.accuracy, 1e-12, 0.1, "1")
    number_between(f"{where}.maximum_step", settings.maximum_step, 1e-7, longest, "s")
    if not isinstance(settings.error_control, bool):
        raise InputError(f"{where}.error_control", settings.error_control, "true or false")
    if settings.scheme == "runge_kutta2" and settings.error_control:
        raise InputError(
            f"{where}.error_control", True, "false with runge_kutta2, which estimates no error"
        )


def _check_aim(scenario: Scenario, racket: RacketParameters, where: str) -> None:
    centre = np.array(racket.centre())
    x, y, _ = scenario.aim(racket) - centre
    bed = racket.string_bed
    a, b = bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    if math.hypot(x / a, y / b) >= 1.0:
        raise InputError(
            f"{where}: offset_x, offset_y",
            (scenario.offset_x, scenario.offset_y),
            f"an aim within the rim (semi-axes {a:g} x {b:g} m about the centre)",
        )


def changed(scenario: Scenario, **changes: object) -> Scenario:
    """A checked copy of `scenario` with some values changed; raises InputError."""
    names = {f.name for f in dataclasses.fields(scenario)}
    for key in changes:
        if key not in names:
            raise InputError(f"scenario: {key}", "an unknown key", ", ".join(sorted(names)))
    new = dataclasses.replace(scenario, **changes)  # type: ignore[arg-type]
    check_scenario(new)
    return new
