"""The numbers of an impact that a sweep can keep, by name."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from drake_racket.io.errors import InputError
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.impact import ImpactResult
from drake_racket.rigs.cases import USUAL, Output
from drake_racket.rigs.restitution_map import VIBRATION

AUDIT, HAND, LIMB = "audit", "hand", "limb"


@dataclass(frozen=True)
class SweepOutput(Output):
    """One number of an impact.

    Attributes:
        needs_history: it is read from the time history, which makes a run slower.
        needs: what a scenario must have for it: AUDIT (`audit: true`), HAND (support grip or limb)
            or LIMB (support limb); without it the number is NaN.

    """

    needs_history: bool = False
    needs: str = ""

    def available(self, scenario: Scenario) -> bool:
        """Whether such a scenario can have it."""
        if self.needs == HAND:
            return scenario.support in ("grip", "limb")
        if self.needs == LIMB:
            return scenario.support == "limb" and scenario.audit
        return scenario.audit or self.needs != AUDIT


def _attribute(result: ImpactResult, *, name: str) -> float:
    value = getattr(result, name)
    return math.nan if value is None else float(value)


def _component(result: ImpactResult, *, name: str, index: int) -> float:
    return float(getattr(result, name)[index])


def _energy(result: ImpactResult, *, name: str) -> float:
    return math.nan if result.balance is None else float(getattr(result.balance, name))


def _hand_peak(result: ImpactResult, *, name: str) -> float:
    history = result.history
    if history is None or name not in history:
        return math.nan
    return float(np.max(np.linalg.norm(history[name].to_numpy(), axis=1)))


def _warning_count(result: ImpactResult) -> float:
    return float(len(result.warnings))


def _single(
    name: str, units: str, text: str, *, needs_history: bool = False, needs: str = ""
) -> SweepOutput:
    read = functools.partial(_attribute, name=name)
    return SweepOutput(name, units, text, read, needs_history, needs)


def _vector(name: str, units: str, text: str) -> list[SweepOutput]:
    return [
        SweepOutput(
            f"{name}_{letter}",
            units,
            f"{text}, {letter}",
            functools.partial(_component, name=name, index=i),
        )
        for i, letter in enumerate("xyz")
    ]


def _energies() -> list[SweepOutput]:
    texts = {
        "ball": ("ball's kinetic energy", AUDIT),
        "contact": ("energy in the ball's spring", AUDIT),
        "rigid_motion": ("energy of the racket's rigid motion", AUDIT),
        "bending": ("energy of the frame's bending", AUDIT),
        "strings": ("energy of the string-bed", AUDIT),
        "gravity": ("potential energy in gravity", AUDIT),
        "lost_ball": ("energy lost in the ball", AUDIT),
        "lost_friction": ("energy lost to friction", AUDIT),
        "lost_joint": ("energy lost at the throat joint", AUDIT),
        "lost_strings": ("energy lost in the strings", AUDIT),
        "couple": ("energy added by the couple of the reaction", AUDIT),
        "grip": ("energy gone into the grip", AUDIT),
        "limb": ("energy of the limb", LIMB),
        "torque_work": ("work of the joint torques", LIMB),
        "lost_limb": ("energy lost in the limb", LIMB),
    }
    return [
        SweepOutput(
            f"energy_{name}",
            "J",
            f"{text} at the end of the run",
            functools.partial(_energy, name=name),
            needs=needs,
        )
        for name, (text, needs) in texts.items()
    ]


def _plain(output: Output, *, needs_history: bool = False) -> SweepOutput:
    return SweepOutput(output.name, output.units, output.long_name, output.read, needs_history)


def _all() -> list[SweepOutput]:
    # without the history the three errors would be those at the end, not the largest of the run
    return [
        *(_plain(output) for output in USUAL),
        *_vector("rebound_velocity", "m/s", "rebound velocity of the ball"),
        _single("rebound_angle", "rad", "between rebound velocity and the strings' normal"),
        *_vector("approach_velocity", "m/s", "initial velocity of the ball"),
        _single("normal_approach_speed", "m/s", "normal approach speed at first touch"),
        _single("touch_time", "s", "time of first touch, from the start"),
        _single("touches", "1", "how often the ball touched"),
        SweepOutput(
            "touched_point",
            "1",
            "string-bed point that the ball touched",
            functools.partial(_attribute, name="point"),
        ),
        *_vector("impulse", "N*s", "change of the ball's momentum"),
        _single("kb", "N/m", "stiffness of the ball at its approach speed"),
        _single("cb", "N*s/m", "damping of the ball at its approach speed"),
        *_vector("racket_velocity", "m/s", "velocity of the racket's centre of mass at the end"),
        *_vector("racket_angular_velocity", "rad/s", "angular velocity of the racket at the end"),
        _single("peak_in_plane_angle", "rad", "largest in-plane bending at the throat"),
        _single("peak_out_of_plane_angle", "rad", "largest out-of-plane bending at the throat"),
        *(_plain(output, needs_history=True) for output in VIBRATION),
        *_energies(),
        _single(
            "energy_error",
            "1",
            "largest gap of the energy balance over the initial kinetic energy",
            needs_history=True,
            needs=AUDIT,
        ),
        _single("momentum_error", "1", "largest gap of momentum", needs_history=True, needs=AUDIT),
        _single(
            "angular_momentum_error",
            "1",
            "largest gap of angular momentum (free racket)",
            needs_history=True,
            needs=AUDIT,
        ),
        *(
            SweepOutput(
                f"peak_{name}",
                units,
                f"largest magnitude of the {text} on the hand",
                functools.partial(_hand_peak, name=name),
                needs_history=True,
                needs=HAND,
            )
            for name, units, text in (
                ("hand_force", "N", "force"),
                ("hand_torque", "N*m", "torque"),
            )
        ),
        _single("steps", "1", "steps of the integrator"),
        _single("evaluations", "1", "evaluations of the derivatives"),
        SweepOutput("warning_count", "1", "number of warnings", _warning_count),
    ]


OUTPUTS: Mapping[str, SweepOutput] = MappingProxyType({output.name: output for output in _all()})

USUAL_OUTPUTS = tuple(output.name for output in USUAL)


def find_outputs(names: Sequence[str], where: str) -> tuple[SweepOutput, ...]:
    """The outputs of these names; raises InputError for an unknown or repeated one."""
    found: list[SweepOutput] = []
    for name in names:
        if name not in OUTPUTS:
            raise InputError(where, name, ", ".join(OUTPUTS))
        if OUTPUTS[name] in found:
            raise InputError(where, name, "each output once")
        found.append(OUTPUTS[name])
    if not found:
        raise InputError(where, "no output", "at least one of " + ", ".join(OUTPUTS))
    return tuple(found)


def read_outputs(result: ImpactResult, names: Sequence[str]) -> list[float]:
    """The numbers of one impact, in the order of `names`."""
    return [float(OUTPUTS[name].read(result)) for name in names]
