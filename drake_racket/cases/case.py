"""A case is one impact, resolved: everything that decides it, loaded and checked once.

Behind a `Case` nothing is parsed, checked or converted again, and no parameter file is opened. (The
model file of a limb of the user's own, and what it includes, is Drake's to parse: the case has its
path and the hash of its content.)
"""

from __future__ import annotations

import dataclasses
import functools
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_racket.io.errors import InputError
from drake_racket.io.fingerprint import digest
from drake_racket.io.schema import read, read_like
from drake_racket.io.shipped import data_directory
from drake_racket.io.yaml_files import load_file, load_text
from drake_racket.limbs.models import need_reader
from drake_racket.parameters.ball import BallParameters, surface_of
from drake_racket.parameters.grip import HANDS, GripStiffness
from drake_racket.parameters.limb import UpperLimbParameters, load_upper_limb
from drake_racket.parameters.overrides import check_known, parameter_keys, plain_overrides
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.scenario import IntegratorSettings, Scenario, check_integrator
from drake_racket.parameters.stroke import check_tip

SCENARIOS = ("backhand",)
"""Names of the shipped scenarios."""


@dataclass(frozen=True)
class Case:
    """A case is one impact, complete: what the scenario says, and the numbers that it names.

    Attributes:
        scenario: checked; numbers in the units of its keys.
        racket, ball, grip: with the scenario's overrides. SI units.
        limb: the shipped limb's, scaled to its subject; None with another support or limb.
        limb_hash: hash of the file of a limb of the user's own; empty without one.

    """

    scenario: Scenario
    racket: RacketParameters
    ball: BallParameters
    grip: GripStiffness
    limb: UpperLimbParameters | None = None
    limb_hash: str = ""

    @functools.cached_property
    def digest(self) -> str:
        """The digest stands for the whole content: equal digests, equal impacts (on equal code)."""
        return digest(json.dumps(dataclasses.asdict(self), sort_keys=True).encode())

    @functools.cached_property
    def topology(self) -> tuple[Any, ...]:
        """The topology is what a Context cannot change; equal ones share a Diagram.

        Of racket and ball: places and lengths, which are the Diagram's frames and what pictures are
        drawn from, and which spring takes which constant. All else of racket, ball and grip is in
        the Context (`ImpactDiagram.create_context`).
        """
        scenario, racket, bed = self.scenario, self.racket, self.racket.string_bed
        lengths = (
            racket.handle.length,  # the throat joint
            racket.head.length,  # the frame `tip`
            racket.landmarks.grip,
            racket.landmarks.accelerometer,
            bed.gsc,
            bed.spacing,
            bed.rim_semi_axis_x,  # within which the contact looks for a touch
            bed.rim_semi_axis_y,
            self.ball.radius,
            *([self.grip.hand.place] if self.grip.hand is not None else []),
        )
        held = scenario.support in ("grip", "limb")
        return (
            scenario.contact,
            scenario.has_element(),
            scenario.support,
            scenario.grip_kind if held else "",
            scenario.limb.topology() if scenario.support == "limb" else (),
            self.limb_hash,
            scenario.time_step,
            tuple(scenario.gravity),
            scenario.audit,
            tuple(quantity.value for quantity in lengths),
            tuple((joint.name, joint.place) for joint in racket.frame_joints()),
            tuple(sorted(bed.springs.value.items())),
            (len(bed.stiffness.value), len(bed.rim_factors.value), bed.columns, bed.rows),
        )

    def __repr__(self) -> str:
        """Which racket, how held, and the digest."""
        s = self.scenario
        return f"Case({self.racket.name}, {s.support}, {s.speed:g} m/s, {self.digest[:8]})"


def resolve(scenario: Scenario | Case, where: str = "scenario") -> Case:
    """Loads what a scenario names and checks the whole; a Case is returned as it is.

    Raises:
        InputError: naming the key, the value and what is allowed.

    """
    if isinstance(scenario, Case):
        return scenario
    scenario = _read(scenario, where)
    check_integrator(scenario.integrator, f"{where}: integrator")
    if scenario.engine == "compiled":
        _check_compiled(scenario, where)
    _check_contact(scenario, where)
    check_tip(scenario.limb.stroke, f"{where}: limb.stroke")
    if any(isinstance(value, str) for value in scenario.overrides.values()):
        scenario = _with_plain_overrides(scenario)
    racket, ball, grip = scenario.load_racket(), scenario.load_ball(), scenario.load_grip()
    if scenario.overrides:
        stray = [k for k in scenario.overrides if not k.startswith(("racket.", "ball.", "grip."))]
        if stray:
            check_known(stray, parameter_keys(racket, ball, grip))
        _check_ball_overrides(scenario, ball, where)
        _check_grip_overrides(scenario, where)
    if scenario.has_element():
        surface_of(ball)
    _check_hand(scenario, grip, where)
    points = [*map(str, racket.bed_topology().points), "auto"]
    if scenario.point not in points:
        raise InputError(f"{where}: point", scenario.point, ", ".join(points))
    _check_aim(scenario, racket, where)
    limb, limb_hash = None, ""
    if scenario.support == "limb":
        settings = scenario.limb
        if settings.activation > 0.0 and settings.model != "upper_limb":
            raise InputError(
                f"{where}: limb.activation",
                settings.activation,
                "0 with another limb than upper_limb, whose muscles are not known",
            )
        if settings.model == "upper_limb":
            limb = load_upper_limb(mass=settings.mass or None, height=settings.height or None)
        elif Path(settings.model).is_file():
            need_reader(settings.model, f"{where}: limb.model")
            limb_hash = digest(Path(settings.model).read_bytes())
    return Case(scenario, racket, ball, grip, limb, limb_hash)


_last: dict[str, tuple[Scenario, Scenario]] = {}
"""The last scenario that was read, and what came of it: a sweep's differ in a few fields."""


def _read(scenario: Scenario, where: str) -> Scenario:
    before = _last.get("scenario") if type(scenario) is Scenario else None
    if before is None:
        checked = read(scenario, Scenario, where)
    else:
        checked = read_like(scenario, before, where)
    if type(scenario) is Scenario:
        _last["scenario"] = scenario, checked
    return checked


def load_scenario(path: str | Path) -> Scenario:
    """Reads and checks a scenario file; keys that it leaves out keep their defaults.

    Args:
        path: of the file, or the name of a shipped scenario: `backhand`.

    Raises:
        InputError: naming the key, the value and what is allowed.

    """
    if str(path) in SCENARIOS:
        path = data_directory() / f"{path}.yaml"
    return resolve(load_file(Path(path), Scenario), str(path)).scenario


def parse_scenario(text: str, where: str = "scenario") -> Scenario:
    """Reads and checks a scenario from YAML text; see `load_scenario`."""
    return resolve(load_text(text, Scenario, where=where), where).scenario


def check_scenario(scenario: Scenario, where: str = "scenario") -> None:
    """Checks every value, the parameter files it names, and where the ball is aimed.

    Raises:
        InputError: naming the key, the value and what is allowed.

    """
    resolve(scenario, where)


def changed(scenario: Scenario, **changes: object) -> Scenario:
    """Makes a checked copy of `scenario` with some values changed; raises InputError."""
    names = {f.name for f in dataclasses.fields(scenario)}
    for key in changes:
        if key not in names:
            raise InputError(f"scenario: {key}", "an unknown key", ", ".join(sorted(names)))
    new = dataclasses.replace(scenario, **changes)  # type: ignore[arg-type]
    return resolve(new).scenario


def _with_plain_overrides(scenario: Scenario) -> Scenario:
    """Numbers in the parameters' units in place of texts such as `170g`."""
    bare = dataclasses.replace(scenario, overrides={})
    keys = parameter_keys(bare.load_racket(), bare.load_ball(), bare.load_grip())
    overrides = plain_overrides(scenario.overrides, keys)
    return dataclasses.replace(scenario, overrides=overrides)


def with_engine(case: Case, engine: str) -> Case:
    """Gives the same case for another engine; raises InputError."""
    scenario = read(dataclasses.replace(case.scenario, engine=engine), Scenario, "scenario")
    if engine == "compiled":
        _check_compiled(scenario, "scenario")
    return dataclasses.replace(case, scenario=scenario)


def _check_contact(scenario: Scenario, where: str) -> None:
    """Refuses what the contact law has no use for."""
    if scenario.contact == "paper":
        for key in ("spin_rpm", "spin"):
            if np.any(getattr(scenario, key)):
                raise InputError(
                    f"{where}: {key}",
                    getattr(scenario, key),
                    "0 with contact paper, whose ball is a point (contact: surface has spin)",
                )
    if not scenario.has_element():
        return
    whose, only = "contact surface", [("friction_reading", "velocity"), ("reaction_point", "ball")]
    if scenario.contact == "paper":
        whose, only = "friction_reading element", only[1:]
    if scenario.time_step > 0.0:
        raise InputError(
            f"{where}: time_step", scenario.time_step, f"0 with {whose}: a continuous plant"
        )
    for key, allowed in only:
        if getattr(scenario, key) != allowed:
            value = getattr(scenario, key)
            raise InputError(f"{where}: {key}", value, f"{allowed} with {whose}")


def _check_ball_overrides(scenario: Scenario, ball: BallParameters, where: str) -> None:
    """Refuses numbers of a ball that its laws of contact do not look at."""
    idle = scenario.idle_of_ball(ball)
    for key, value in scenario.overrides.items():
        if key.startswith(tuple(f"ball.{name}" for name in idle)):
            law = next(l for name, l in idle.items() if key.startswith(f"ball.{name}"))
            raise InputError(f"{where}: overrides.{key}", value, f"no such number with {law}")


def _check_compiled(scenario: Scenario, where: str) -> None:
    """Refuses what the compiled engine has no choice of."""
    if scenario.time_step > 0.0:
        raise InputError(
            f"{where}: engine", "compiled", "drake with a discrete plant (time_step above 0)"
        )
    if scenario.integrator.scheme != IntegratorSettings().scheme:
        raise InputError(
            f"{where}: integrator.scheme",
            scenario.integrator.scheme,
            "no scheme with engine compiled, which has its own",
        )


def _check_hand(scenario: Scenario, grip: GripStiffness, where: str) -> None:
    """Refuses grip kind `hand` with a grip whose hand has no mass."""
    held = scenario.support in ("grip", "limb") and scenario.grip_kind == "hand"
    if held and grip.hand is None:
        allowed = f"with grip_kind hand a grip whose hand has mass: {', '.join(HANDS)}"
        raise InputError(f"{where}: grip", scenario.grip, allowed)


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
        if key.startswith("grip.hand."):
            if scenario.grip_kind != "hand":
                raise InputError(name, value, "a hand's mass and wrist with grip_kind hand alone")
            if scenario.support == "limb":
                raise InputError(name, value, "the palm's numbers: a limb's own hand has mass")


def _check_aim(scenario: Scenario, racket: RacketParameters, where: str) -> None:
    """The aim lies on the string-bed."""
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
