"""An output is a number of an impact that a sweep or a rig can keep; each is defined once, here."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from drake_racket.io.errors import InputError
from drake_racket.parameters.scenario import RPM, Scenario
from drake_racket.results.history import after_release
from drake_racket.results.impact import ImpactResult

if TYPE_CHECKING:
    import xarray

AUDIT, HAND, LIMB, SURFACE, SHEAR = "audit", "hand", "limb", "surface", "element"


@dataclass(frozen=True)
class Output:
    """An output is one number of an impact.

    Attributes:
        name: in sweeps and their results.
        units: of the number.
        long_name: what it is, in words.
        read: a module's function (it travels between processes); NaN where there is no number.
        needs_history: it is read from the time history, which makes a run slower.
        variables: of the history that it is read from (`in_contact` beside them, for what comes
            after release): a sweep labels no others then. None: all.
        needs: what a scenario must have for it: AUDIT (`audit: true`), HAND (support grip or limb),
            LIMB (support limb), SURFACE (contact surface) or SHEAR (that, or friction reading
            element); without it the number is NaN.
        of_engine: it tells how an engine worked, not what happened: engines need not agree.

    """

    name: str
    units: str
    long_name: str
    read: Callable[[ImpactResult], float]
    needs_history: bool = False
    needs: str = ""
    of_engine: bool = False
    variables: tuple[str, ...] | None = None

    def available(self, scenario: Scenario) -> bool:
        """Tells whether such a scenario can have it."""
        if self.needs == HAND:
            return scenario.support in ("grip", "limb")
        if self.needs == SURFACE:
            return scenario.contact == "surface"
        if self.needs == SHEAR:
            return scenario.has_element()
        if self.needs == LIMB:
            return scenario.support == "limb" and scenario.audit
        return scenario.audit or self.needs != AUDIT


def _attribute(result: ImpactResult, *, name: str) -> float:
    value = getattr(result, name)
    return math.nan if value is None else float(value)


def _component(result: ImpactResult, *, name: str, index: int) -> float:
    return float(getattr(result, name)[index])


def _maybe_component(result: ImpactResult, *, name: str, index: int) -> float:
    value = getattr(result, name)
    return math.nan if value is None else float(value[index])


def _spin_rpm(result: ImpactResult) -> float:
    return float(result.spin_after @ result.scenario.spin_axis()) / RPM


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
    name: str,
    units: str,
    text: str,
    *,
    needs_history: bool = False,
    needs: str = "",
    of_engine: bool = False,
) -> Output:
    read = functools.partial(_attribute, name=name)
    # what a result holds itself needs the whole run, but none of the history's variables
    return Output(name, units, text, read, needs_history, needs, of_engine, variables=())


def _vector(name: str, units: str, text: str) -> list[Output]:
    return [
        Output(
            f"{name}_{letter}",
            units,
            f"{text}, {letter}",
            functools.partial(_component, name=name, index=i),
        )
        for i, letter in enumerate("xyz")
    ]


def _pair(name: str, key: str, units: str, text: str, needs: str = "") -> list[Output]:
    return [
        Output(
            f"{name}_{letter}",
            units,
            f"{text}, {letter}",
            functools.partial(_maybe_component, name=key, index=i),
            needs=needs,
        )
        for i, letter in enumerate("xy")
    ]


def _energies() -> list[Output]:
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
        Output(
            f"energy_{name}",
            "J",
            f"{text} at the end of the run",
            functools.partial(_energy, name=name),
            needs=needs,
        )
        for name, (text, needs) in texts.items()
    ]


def _rebound_speed(result: ImpactResult) -> float:
    return float(np.linalg.norm(result.rebound_velocity))


def handle_ringing(history: xarray.Dataset) -> float:
    """Gives root mean square (m/s^2) over time of mid-handle's acceleration along z after release.

    With the racket in a hand it holds the racket's motion in the hand, too. NaN if the history ends
    in contact.
    """
    rest = after_release(history)
    time = rest["time"].to_numpy()
    if len(time) < 2 or not time[-1] > time[0]:
        return float("nan")
    squared = rest["handle_acceleration"].sel(axis="z").to_numpy() ** 2
    return float(np.sqrt(np.trapezoid(squared, time) / (time[-1] - time[0])))


def bending_after_release(history: xarray.Dataset) -> float:
    """Gives largest out-of-plane angle (rad) after release; NaN if the history ends in contact."""
    angle = after_release(history)["out_of_plane_angle"]
    return float(np.abs(angle).max()) if angle.size else float("nan")


def _of_history(result: ImpactResult, *, read: Callable[[xarray.Dataset], float]) -> float:
    assert result.history is not None
    return read(result.history)


RESTITUTION = Output(
    "restitution",
    "1",
    "normal rebound speed over normal approach speed",
    functools.partial(_attribute, name="apparent_restitution"),
)
REBOUND_SPEED = Output("rebound_speed", "m/s", "rebound speed of the ball", _rebound_speed)
CONTACT_TIME = _single("contact_time", "s", "from first touch to last release")
PEAK_FORCE = _single("peak_normal_force", "N", "peak normal force on the ball")
PEAK_DEFLECTION = _single("peak_string_deflection", "m", "largest deflection of a string mass")
USUAL = (RESTITUTION, REBOUND_SPEED, CONTACT_TIME, PEAK_FORCE, PEAK_DEFLECTION)

VIBRATION = (
    _single(
        "peak_handle_acceleration",
        "m/s^2",
        "largest magnitude of the acceleration of mid-handle",
        needs_history=True,
    ),
    Output(
        "handle_ringing",
        "m/s^2",
        "root mean square of mid-handle's acceleration along z after release",
        functools.partial(_of_history, read=handle_ringing),
        needs_history=True,
        variables=("in_contact", "handle_acceleration"),
    ),
    Output(
        "bending_angle",
        "rad",
        "largest out-of-plane angle at the throat joint after release",
        functools.partial(_of_history, read=bending_after_release),
        needs_history=True,
        variables=("in_contact", "out_of_plane_angle"),
    ),
)


def _all() -> list[Output]:
    # without the history the three errors would be those at the end, not the largest of the run
    return [
        *USUAL,
        *_vector("rebound_velocity", "m/s", "rebound velocity of the ball"),
        _single("rebound_angle", "rad", "between rebound velocity and the strings' normal"),
        Output(
            "spin_after_rpm",
            "rpm",
            "spin after, about the axis of spin_rpm",
            _spin_rpm,
        ),
        *_vector("spin_before", "rad/s", "initial angular velocity of the ball"),
        *_vector("spin_after", "rad/s", "angular velocity of the ball at its last release"),
        *_pair("rebound_angle", "rebound_angles", "rad", "rebound angle in the plane with z"),
        *_pair("impulse_place", "impulse_place", "m", "place of the impulse in the strings' plane"),
        *_pair("touch_place", "touch_place", "m", "place of the first touch in the bed", SHEAR),
        *(
            _single(name, units, text, needs=needs)
            for name, units, text, needs in (
                (
                    "tangential_restitution",
                    "1",
                    "tangential restitution of the ball's surface",
                    SURFACE,
                ),
                ("sliding_fraction", "1", "share of the contact spent sliding", SHEAR),
                ("grip_time", "s", "time in contact spent gripping", SHEAR),
                (
                    "overspin_time",
                    "s",
                    "time in contact with the ball's surface going backwards",
                    SHEAR,
                ),
            )
        ),
        *_vector("angular_impulse", "N*m*s", "angular impulse on the racket about the butt"),
        *_vector("approach_velocity", "m/s", "initial velocity of the ball"),
        _single("normal_approach_speed", "m/s", "normal approach speed at first touch"),
        _single("touch_time", "s", "time of first touch, from the start"),
        _single("touches", "1", "how often the ball touched"),
        Output(
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
        *VIBRATION,
        *_energies(),
        _single(
            "energy_error",
            "1",
            "largest gap of the energy balance over the initial kinetic energy",
            needs_history=True,
            needs=AUDIT,
            of_engine=True,
        ),
        _single(
            "momentum_error",
            "1",
            "largest gap of momentum",
            needs_history=True,
            needs=AUDIT,
            of_engine=True,
        ),
        _single(
            "angular_momentum_error",
            "1",
            "largest gap of angular momentum (free racket)",
            needs_history=True,
            needs=AUDIT,
            of_engine=True,
        ),
        *(
            Output(
                f"peak_{name}",
                units,
                f"largest magnitude of the {text} on the hand",
                functools.partial(_hand_peak, name=name),
                needs_history=True,
                variables=(name,),
                needs=HAND,
            )
            for name, units, text in (
                ("hand_force", "N", "force"),
                ("hand_torque", "N*m", "torque"),
            )
        ),
        _single("steps", "1", "steps of the integrator", of_engine=True),
        _single("evaluations", "1", "evaluations of the derivatives", of_engine=True),
        Output("warning_count", "1", "number of warnings", _warning_count, of_engine=True),
    ]


OUTPUTS: Mapping[str, Output] = MappingProxyType({output.name: output for output in _all()})
"""Every number of an impact that a sweep can keep has a name here."""

USUAL_OUTPUTS = tuple(output.name for output in USUAL)


def find_outputs(chosen: Sequence[str | Output], where: str) -> tuple[Output, ...]:
    """Gives the outputs of these names, with any of the caller's own among them.

    Raises:
        InputError: an unknown name, or one that stands twice.

    """
    found: list[Output] = []
    for output in chosen:
        if isinstance(output, str):
            if output not in OUTPUTS:
                raise InputError(where, output, ", ".join(OUTPUTS))
            output = OUTPUTS[output]
        if output.name in {other.name for other in found}:
            raise InputError(where, output.name, "each output once")
        found.append(output)
    if not found:
        raise InputError(where, "no output", "at least one of " + ", ".join(OUTPUTS))
    return tuple(found)


def history_variables(outputs: Sequence[Output]) -> frozenset[str] | None:
    """Gives the variables of the history that outputs are read from; None: all."""
    found: set[str] = set()
    for output in outputs:
        if output.needs_history:
            if output.variables is None:
                return None
            found.update(output.variables)
    return frozenset(found)


def read_outputs(result: ImpactResult, outputs: Sequence[Output]) -> list[float]:
    """Gives the numbers of one impact, in the order of `outputs`."""
    return [float(output.read(result)) for output in outputs]
