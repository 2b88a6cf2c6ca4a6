"""Makes the labelled time history of a run: names, units, frames; see `formats`."""

from __future__ import annotations

import dataclasses
import functools
import json
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.cases.case import Case
from drake_racket.engines.trajectory import Mechanism, Trajectory
from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import PHASE, TOUCH
from drake_racket.laws.strings import bent_stretch, spring_law
from drake_racket.laws.surface import GRIPS
from drake_racket.plant.properties import frame_fundamentals
from drake_racket.plant.systems.ports import ContactState
from drake_racket.results import kinematics
from drake_racket.results.energy import STORES, Balances

if TYPE_CHECKING:
    import xarray

_XYZ = ("x", "y", "z")
_Row = tuple[str, str | None, str, str, str]


def make_history(
    case: Case,
    trajectory: Trajectory,
    energies: Balances | None,
    only: frozenset[str] | None = None,
) -> xarray.Dataset:
    """Labels a trajectory of which every sample's motion is known.

    Args:
        only: names of the variables to label, and no attributes of the whole; None: everything.

    Returns:
        A Dataset over `time` (s from touch, or from the start if the ball did not touch); every
        variable has `units`, `long_name` and, where it is a vector, `frame`. Its attributes hold
        what a reader needs without the parameter files: the scenario and the racket (JSON), and
        the fundamentals (Hz) of the bare, free frame.

    """
    import xarray

    mechanism = trajectory.mechanism
    touch = float(trajectory.record[-1, TOUCH])
    zero = touch if np.isfinite(touch) else 0.0
    columns = _impact_columns(trajectory) | _surface_columns(trajectory)
    columns |= _hand_columns(trajectory) | _limb_columns(trajectory)
    if only is not None:
        columns = {name: column for name, column in columns.items() if name in only}
    elif energies is not None:
        columns["energy"] = energies.energies
    in_world = mechanism.limb is not None
    variables: dict[str, Any] = {}
    for name in [*(n for n in _ALL if n in columns), *(n for n in columns if n not in _ALL)]:
        dimension = VARIABLE_DIMENSIONS.get(name)
        dimensions = ("time",) if dimension is None else ("time", dimension)
        attributes = variable_attributes(name, in_world=in_world)
        variables[name] = (dimensions, columns[name], attributes)
    time = {"time": ("time", trajectory.time - zero, dict(TIME_ATTRIBUTES))}
    if only is not None:
        return xarray.Dataset(variables, coords=time | {"axis": list(_XYZ)})
    return xarray.Dataset(
        variables,
        coords=time
        | _coordinates(mechanism)
        | ({} if energies is None else {"store": list(STORES)}),
        attrs=_attributes(case) | {"geometry": _geometry(case, mechanism)},
    )


def _coordinates(mechanism: Mechanism) -> dict[str, Any]:
    """The labels of the dimensions beside time."""
    found: dict[str, Any] = {
        "axis": list(_XYZ),
        "point": np.array(mechanism.strings.points),
        "spring": list(mechanism.strings.springs),
        "quaternion": ["w", "x", "y", "z"],
    }
    if mechanism.landmarks:
        found["landmark"] = list(mechanism.landmarks)
    if mechanism.limb is not None:
        # coordinates in m, not rad, are named in `prismatic` (JSON)
        sliding = list(mechanism.limb.prismatic)
        about = {"prismatic": json.dumps(sliding)} if sliding else {}
        found["joint"] = ("joint", list(mechanism.limb.coordinates), about)
    return found


def after_release(history: xarray.Dataset) -> xarray.Dataset:
    """Gives the part of a history from the last release to its end; all of it without contact."""
    inside = np.flatnonzero(history["in_contact"].to_numpy())
    first = int(inside[-1]) + 1 if len(inside) else 0
    return history.isel(time=slice(first, None))


_CONTACT = [
    place
    for place in ContactState
    if place not in (ContactState.PHASE, ContactState.COMPRESSION_RATE)
]

_R = "R, the racket's initial frame (butt, x to tip, z normal to strings)"
_W = "W, the world"
_B = "head"
_VARIABLES: tuple[_Row, ...] = (
    ("ball_position", "axis", "m", _R, "position of the ball's centre"),
    ("ball_velocity", "axis", "m/s", _R, "velocity of the ball's centre"),
    ("in_contact", None, "1", "", "1 in contact, else 0"),
    ("contact_point", None, "1", "", "string-bed point in contact, or to be hit"),
    ("compression", None, "m", "", "compression of the ball; negative: distance to the strings"),
    ("normal_force", None, "N", "", "normal force on the ball"),
    ("friction_x", None, "N", _B, "friction on the ball along the head's x"),
    ("friction_y", None, "N", _B, "friction on the ball along the head's y"),
    ("sliding_x", None, "m/s", _B, "ball's velocity over the strings along the head's x"),
    ("sliding_y", None, "m/s", _B, "ball's velocity over the strings along the head's y"),
    ("string_deflection", "point", "m", _B, "deflection of the string masses along the head's z"),
    ("string_tension", "spring", "N", "", "tension of the springs"),
    ("in_plane_angle", None, "rad", "", "throat joint, rotation about z"),
    ("out_of_plane_angle", None, "rad", "", "throat joint, rotation about y"),
    ("torsion_angle", None, "rad", "", "twist of the frame from butt to tip"),
    ("butt_position", "axis", "m", _R, "position of the butt"),
    ("gsc_position", "axis", "m", _R, "position of the geometric string-bed centre of the head"),
    ("gsc_velocity", "axis", "m/s", _R, "velocity of the geometric string-bed centre of the head"),
    ("tip_position", "axis", "m", _R, "position of the tip"),
    ("handle_acceleration", "axis", "m/s^2", "handle", "acceleration of the accelerometer frame"),
    ("handle_quaternion", "quaternion", "1", _R, "orientation of the handle's axes"),
)

_SURFACE_VARIABLES: tuple[_Row, ...] = (
    ("ball_spin", "axis", "rad/s", _R, "angular velocity of the ball"),
    ("ball_quaternion", "quaternion", "1", _R, "orientation of the ball's axes"),
    ("gripping", None, "1", "", "1 where ball and strings grip, 0 where they slide or are apart"),
    ("shear_x", None, "m", _B, "shear between ball and strings along the head's x"),
    ("shear_y", None, "m", _B, "shear between ball and strings along the head's y"),
)
_HAND_VARIABLES: tuple[_Row, ...] = (
    ("hand_torque", "axis", "N m", "hand", "torque of the racket on the hand about its frame"),
    ("hand_force", "axis", "N", "hand", "force of the racket on the hand"),
    ("grip_angle", "axis", "rad", "hand", "roll, pitch and yaw of the racket in the hand"),
)
_LIMB_VARIABLES: tuple[_Row, ...] = (
    ("joint_position", "joint", "rad", "", "angle of the limb's joints"),
    ("joint_velocity", "joint", "rad/s", "", "rate of the limb's joints"),
    ("joint_torque", "joint", "N m", "", "applied torque on the limb's joints"),
    ("joint_reaction_force", "joint", "N", "", "magnitude of the joint's reaction force"),
)
_LANDMARK_VARIABLES: tuple[_Row, ...] = tuple(
    (
        f"landmark_{a}",
        "landmark",
        "m",
        _R,
        f"place of the hand's and the limb's landmarks along {a}",
    )
    for a in "xyz"
)
_ENERGY = ("energy", "store", "J", "", "energy in each store, or lost so far")
_ALL = {
    row[0]: row
    for row in (
        *_VARIABLES,
        *_SURFACE_VARIABLES,
        *_HAND_VARIABLES,
        *_LIMB_VARIABLES,
        *_LANDMARK_VARIABLES,
        _ENERGY,
    )
}

TIME_ATTRIBUTES = {"units": "s", "long_name": "time from first touch"}
VARIABLE_DIMENSIONS = {name: row[1] for name, row in _ALL.items()}
"""Every variable that a history may hold -> its dimension beside time, or None."""


def variable_attributes(name: str, *, in_world: bool = False) -> dict[str, str]:
    """Gives `units`, `long_name` and, of a vector, `frame` of a variable; others are frame joints.

    Args:
        in_world: a limb holds the racket, so that R is somewhere in the world.

    """
    joint = (name, None, "rad", "", f"joint {name.removesuffix('_angle')} of the frame")
    _, _, units, frame, text = _ALL.get(name, joint)
    attributes = {"units": units, "long_name": text}
    if frame:
        attributes["frame"] = _W if frame == _R and in_world else frame
    return attributes


def _impact_columns(trajectory: Trajectory) -> dict[str, NDArray[np.float64]]:
    """Ball, contact, strings and frame."""
    mechanism, motion = trajectory.mechanism, trajectory.motion
    places, strings, frame = mechanism.places, mechanism.strings, mechanism.frame
    q = trajectory.state[:, : mechanism.num_positions]
    v = trajectory.state[:, mechanism.num_positions :]
    contact = trajectory.contact
    return {
        "ball_position": motion.poses[:, mechanism.ball, :, 3],
        "ball_velocity": motion.velocities[:, mechanism.ball, 3:],
        "in_contact": (contact[:, ContactState.PHASE] == CONTACT).astype(float),
        **{place.name.lower(): contact[:, place] for place in _CONTACT},
        "string_deflection": q[:, strings.position],
        "string_tension": _tensions(mechanism, q, v),
        **{f"{plane}_angle": frame.angle(plane, q) for plane in dict.fromkeys(frame.planes)},
        "butt_position": kinematics.positions(motion, places["butt"]),
        "gsc_position": kinematics.positions(motion, places["gsc"]),
        "gsc_velocity": kinematics.velocities(motion, places["gsc"]),
        "tip_position": kinematics.positions(motion, places["tip"]),
        "handle_acceleration": kinematics.sensor_accelerations(motion, places["accelerometer"]),
        "handle_quaternion": kinematics.quaternions(kinematics.rotations(motion, mechanism.handle)),
    }


def _surface_columns(trajectory: Trajectory) -> dict[str, NDArray[np.float64]]:
    """What a ball with contact surface has beside: spin, and the element to the strings."""
    if not trajectory.element.size:
        return {}
    motion, ball = trajectory.motion, trajectory.mechanism.ball
    touching = trajectory.record[:, PHASE] == CONTACT
    shear = np.where(touching[:, None], trajectory.element, 0.0)
    return {
        "ball_spin": motion.velocities[:, ball, :3],
        "ball_quaternion": kinematics.quaternions(kinematics.rotations(motion, ball)),
        "gripping": (touching & (trajectory.record[:, GRIPS] > 0.5)).astype(float),
        "shear_x": shear[:, 0],
        "shear_y": shear[:, 1],
    }


def _tensions(
    mechanism: Mechanism, q: NDArray[np.float64], v: NDArray[np.float64]
) -> NDArray[np.float64]:
    strings = mechanism.strings
    dz = q[:, strings.position] @ strings.incidence.T
    rate = v[:, strings.velocity] @ strings.incidence.T
    if strings.arms.size:
        bent, bending = q[:, strings.arm_position], v[:, strings.arm_velocity]
        sag, flow = (
            np.einsum("sab,ma,mb->ms", strings.folds, bent, other) for other in (bent, bending)
        )
        dz, rate = dz + bent @ strings.arms.T, rate + bending @ strings.arms.T
        return np.asarray(bent_stretch(dz, rate, sag, flow, strings.constants)[1])
    return np.asarray(spring_law(dz, rate, *strings.constants)[1])


def _hand_columns(trajectory: Trajectory) -> dict[str, NDArray[np.float64]]:
    """The load on a hand, how the racket has turned in it, and the landmarks."""
    mechanism, motion = trajectory.mechanism, trajectory.motion
    found: dict[str, NDArray[np.float64]] = {}
    if motion.hand_load is not None:
        hand, racket = mechanism.places["hand"], mechanism.places["racket_grip"]
        R_WH = kinematics.frame_rotations(motion, hand)
        R_WG = kinematics.frame_rotations(motion, racket)
        found["hand_torque"] = motion.hand_load[:, :3]
        found["hand_force"] = motion.hand_load[:, 3:]
        found["grip_angle"] = kinematics.roll_pitch_yaw(np.swapaxes(R_WH, -1, -2) @ R_WG)
    if mechanism.landmarks:
        places = [mechanism.places[f"landmark {name}"] for name in mechanism.landmarks]
        at = np.stack([kinematics.positions(motion, place) for place in places], axis=1)
        found |= {f"landmark_{axis}": at[:, :, i] for i, axis in enumerate(_XYZ)}
    return found


def _limb_columns(trajectory: Trajectory) -> dict[str, NDArray[np.float64]]:
    """The limb's joints."""
    limb, motion = trajectory.mechanism.limb, trajectory.motion
    if limb is None:
        return {}
    assert motion.joint_torque is not None
    assert motion.joint_reaction is not None
    first = trajectory.mechanism.num_positions
    return {
        "joint_position": trajectory.state[:, limb.position],
        "joint_velocity": trajectory.state[:, first + limb.velocity],
        "joint_torque": motion.joint_torque,
        "joint_reaction_force": motion.joint_reaction,
    }


def _geometry(case: Case, mechanism: Mechanism) -> str:
    """Lengths (m) of racket and ball, and the limb's segments: what a drawing needs, as JSON."""
    racket, bed = case.racket, case.racket.string_bed
    lengths = {
        "handle_length": racket.handle.length.value,
        "head_length": racket.head.length.value,
        "gsc": bed.gsc.value,
        "spacing": bed.spacing.value,
        "rim_semi_axis_x": bed.rim_semi_axis_x.value,
        "rim_semi_axis_y": bed.rim_semi_axis_y.value,
        "ball_radius": case.ball.radius.value,
    }
    return json.dumps(lengths | {"segments": [list(pair) for pair in mechanism.segments]})


@functools.cache
def _version(package: str) -> str:
    return version(package)


def _attributes(case: Case) -> dict[str, Any]:
    in_plane, out_of_plane = frame_fundamentals(case.racket)
    return {
        "title": f"Impact of {case.racket.title}",
        "scenario": json.dumps(dataclasses.asdict(case.scenario)),
        "racket": json.dumps(dataclasses.asdict(case.racket)),
        "frame_in_plane_hz": in_plane,
        "frame_out_of_plane_hz": out_of_plane,
        "drake_racket_version": _version("drake-racket"),
        "drake_version": _version("drake"),
        "source": "Glynn, King & Mitchell (2011), doi:10.1007/s12283-010-0056-x",
    }
