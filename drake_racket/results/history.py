"""The labelled time history of a run: names, units, frames; no visualizer; see `histories`."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RollPitchYaw

from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import TOUCH
from drake_racket.limbs.stroke import coordinate_names
from drake_racket.plant.properties import frame_fundamentals
from drake_racket.results.geometry import (
    LoggedGeometry,
    handle_rows,
    landmark_rows,
)

if TYPE_CHECKING:
    import xarray
    from pydrake.systems.framework import Context

    from drake_racket.limbs.limb import Limb
    from drake_racket.results.energy import Balance
    from drake_racket.simulation import Run

_XYZ = ("x", "y", "z")
_ENERGIES = (
    "ball",
    "contact",
    "rigid_motion",
    "bending",
    "strings",
    "gravity",
    "grip",
    "limb",
    "torque_work",
    "lost_limb",
    "lost_ball",
    "lost_friction",
    "lost_joint",
    "lost_strings",
    "couple",
)


def make_history(run: Run, balances: Sequence[Balance]) -> xarray.Dataset:
    """Evaluates the outputs of a run at its samples.

    Returns:
        A Dataset over `time` (s from touch, or from the start if the ball did not touch); every
        variable has `units`, `long_name` and, where it is a vector, `frame`. Its attributes hold
        what a reader needs without the parameter files: the scenario and the racket (JSON), and
        the fundamentals (Hz) of the bare, free frame.

    """
    import xarray

    geometry = LoggedGeometry(run)
    rows = [_sample(run, i, geometry) for i in range(len(run.time))]
    touch = float(run.contact_state[-1, TOUCH])
    zero = touch if np.isfinite(touch) else 0.0

    def column(name: str) -> NDArray[np.float64]:
        return np.array([row[name] for row in rows])

    variables: dict[str, Any] = {}
    limb = run.system.limb
    tables = [_VARIABLES]
    if run.system.grip_load is not None:
        tables.append(_HAND_VARIABLES)
    if limb is not None:
        tables.append(_LIMB_VARIABLES)
    if geometry.landmarks:
        tables.append(_LANDMARK_VARIABLES)
    for name, dimension, *_ in (row for table in tables for row in table):
        dimensions = ("time",) if dimension is None else ("time", dimension)
        attributes = variable_attributes(name, in_world=limb is not None)
        variables[name] = (dimensions, column(name), attributes)
    if balances:
        energies = np.array([[getattr(b, e) for e in _ENERGIES] for b in balances])
        variables["energy"] = (("time", "store"), energies, variable_attributes("energy"))
    dataset = xarray.Dataset(
        variables,
        coords={
            "time": ("time", run.time - zero, dict(TIME_ATTRIBUTES)),
            "axis": list(_XYZ),
            "point": list(run.system.impact.racket.parameters.bed_topology().points),
            "spring": list(run.system.impact.racket.parameters.bed_topology().names),
        }
        | geometry.coordinates()
        | ({} if limb is None else {"joint": _joint_coordinate(limb.limb)})
        | ({"store": list(_ENERGIES)} if balances else {}),
        attrs=_attributes(run) | {"geometry": geometry.attribute()},
    )
    return dataset


def _joint_coordinate(limb: Limb) -> tuple[str, list[str], dict[str, str]]:
    """Names of the limb's coordinates; those in m, not rad, are named in `prismatic` (JSON)."""
    names = list(coordinate_names(limb))
    sliding = [j.position_start() for j in limb.joints if j.type_name() == "prismatic"]
    places = limb.position_indices()
    lengths = [n for n, place in zip(names, places, strict=True) if place in sliding]
    return "joint", names, {"prismatic": json.dumps(lengths)} if lengths else {}


def after_release(history: xarray.Dataset) -> xarray.Dataset:
    """The part of a history from the last release to its end; all of it without contact."""
    inside = np.flatnonzero(history["in_contact"].to_numpy())
    first = int(inside[-1]) + 1 if len(inside) else 0
    return history.isel(time=slice(first, None))


_R = "R, the racket's initial frame (butt, x to tip, z normal to strings)"
_W = "W, the world"
_B = "head"
_VARIABLES: tuple[tuple[str, str | None, str, str, str], ...] = (
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
    ("butt_position", "axis", "m", _R, "position of the butt"),
    ("gsc_position", "axis", "m", _R, "position of the geometric string-bed centre of the head"),
    ("gsc_velocity", "axis", "m/s", _R, "velocity of the geometric string-bed centre of the head"),
    ("tip_position", "axis", "m", _R, "position of the tip"),
    ("handle_acceleration", "axis", "m/s^2", "handle", "acceleration of the accelerometer frame"),
    *handle_rows(_R),
)

_HAND_VARIABLES: tuple[tuple[str, str | None, str, str, str], ...] = (
    ("hand_torque", "axis", "N m", "hand", "torque of the racket on the hand about its frame"),
    ("hand_force", "axis", "N", "hand", "force of the racket on the hand"),
    ("grip_angle", "axis", "rad", "hand", "roll, pitch and yaw of the racket in the hand"),
)
_LIMB_VARIABLES: tuple[tuple[str, str | None, str, str, str], ...] = (
    ("joint_position", "joint", "rad", "", "angle of the limb's joints"),
    ("joint_velocity", "joint", "rad/s", "", "rate of the limb's joints"),
    ("joint_torque", "joint", "N m", "", "applied torque on the limb's joints"),
    ("joint_reaction_force", "joint", "N", "", "magnitude of the joint's reaction force"),
)
_LANDMARK_VARIABLES = landmark_rows(_R)
_ENERGY = ("energy", "store", "J", "", "energy in each store, or lost so far")
_ALL = {
    row[0]: row
    for row in (*_VARIABLES, *_HAND_VARIABLES, *_LIMB_VARIABLES, *_LANDMARK_VARIABLES, _ENERGY)
}

TIME_ATTRIBUTES = {"units": "s", "long_name": "time from first touch"}
VARIABLE_DIMENSIONS = {name: row[1] for name, row in _ALL.items()}
"""Every variable that a history may hold -> its dimension beside time, or None."""


def variable_attributes(name: str, *, in_world: bool = False) -> dict[str, str]:
    """`units`, `long_name` and, of a vector, `frame` of one of VARIABLE_DIMENSIONS.

    Args:
        in_world: a limb holds the racket, so that R is somewhere in the world.

    """
    _, _, units, frame, text = _ALL[name]
    attributes = {"units": units, "long_name": text}
    if frame:
        attributes["frame"] = _W if frame == _R and in_world else frame
    return attributes


def _sample(run: Run, index: int, geometry: LoggedGeometry) -> dict[str, Any]:
    """All variables at one sample."""
    root = run.context_at(index)
    system = run.system
    plant, impact = system.plant, system.impact
    context = plant.GetMyContextFromRoot(root)
    contact = impact.contact
    assert contact is not None
    assert impact.ball is not None
    phase, point, x, _, normal, fx, fy, vx, vy = contact.GetOutputPort("contact_state").Eval(
        contact.GetMyContextFromRoot(root)
    )
    racket, bed = impact.racket, impact.string_bed
    bed_context = bed.GetMyContextFromRoot(root)
    pose = {name: racket.frame(name).CalcPoseInWorld(context) for name in ("butt", "gsc", "tip")}
    gsc_velocity = racket.frame("gsc").CalcSpatialVelocityInWorld(context)
    sample = {
        "ball_position": impact.ball.body.EvalPoseInWorld(context).translation(),
        "ball_velocity": impact.ball.body.EvalSpatialVelocityInWorld(context).translational(),
        "in_contact": float(phase == CONTACT),
        "contact_point": point,
        "compression": x,
        "normal_force": normal,
        "friction_x": fx,
        "friction_y": fy,
        "sliding_x": vx,
        "sliding_y": vy,
        "string_deflection": bed.GetOutputPort("deflections").Eval(bed_context),
        "string_tension": bed.GetOutputPort("tensions").Eval(bed_context),
        "in_plane_angle": racket.in_plane.get_angle(context),
        "out_of_plane_angle": racket.out_of_plane.get_angle(context),
        "butt_position": pose["butt"].translation(),
        "gsc_position": pose["gsc"].translation(),
        "gsc_velocity": gsc_velocity.translational(),
        "tip_position": pose["tip"].translation(),
        "handle_acceleration": handle_acceleration(impact.racket, context),
    }
    sample |= geometry.sample(context)
    if system.grip_load is not None:
        load_context = system.grip_load.GetMyContextFromRoot(root)
        load = system.grip_load.GetOutputPort("hand_load").Eval(load_context).copy()
        sample |= {"hand_torque": load[:3], "hand_force": load[3:]}
        assert system.grip is not None
        grip = system.grip
        turned = grip.racket_frame.CalcPose(context, grip.hand_frame).rotation()
        sample["grip_angle"] = RollPitchYaw(turned).vector()
    if system.limb is not None:
        sample |= _limb_sample(run, root, context)
    return sample


def _limb_sample(run: Run, root: Context, context: Context) -> dict[str, Any]:
    striking = run.system.limb
    assert striking is not None
    limb, plant = striking.limb, run.system.plant
    selector = striking.torques.selector
    torques = selector.get_input_port().Eval(selector.GetMyContextFromRoot(root))
    places = [int(i) for i in plant.GetJointIndices()]
    if plant.time_step() > 0.0:  # a discrete plant has no reactions at an instant
        reactions = [math.nan] * len(limb.joints)
    else:
        forces = plant.get_reaction_forces_output_port().Eval(context)
        reactions = [
            float(np.linalg.norm(forces[places.index(int(j.index()))].translational()))
            for j in limb.joints
        ]
    per_coordinate = np.repeat(reactions, [j.num_velocities() for j in limb.joints])
    return {
        "joint_position": plant.GetPositions(context)[limb.position_indices()],
        "joint_velocity": plant.GetVelocities(context)[limb.velocity_indices()],
        "joint_torque": torques.copy(),
        "joint_reaction_force": per_coordinate,
    }


def handle_acceleration(racket: Any, context: Context) -> NDArray[np.float64]:
    """Acceleration (m/s^2) of the frame `accelerometer` in the handle's axes, (3,).

    The rate of its velocity in the world; an accelerometer would read it less gravity.
    """
    plant = racket.plant
    handle = racket.handle
    if plant.time_step() > 0.0:
        return np.full(3, np.nan)  # a discrete plant has no acceleration at an instant
    pose = handle.EvalPoseInWorld(context)
    place = racket.frame("accelerometer").GetFixedPoseInBodyFrame().translation()
    offset = pose.rotation().multiply(place)
    w = handle.EvalSpatialVelocityInWorld(context).rotational()
    acceleration = handle.EvalSpatialAccelerationInWorld(context).Shift(offset, w)
    return pose.rotation().matrix().T @ acceleration.translational()  # type: ignore[no-any-return]


def _attributes(run: Run) -> dict[str, Any]:
    racket = run.scenario.load_racket()  # the Diagram may have been built for another tension
    in_plane, out_of_plane = frame_fundamentals(racket)
    return {
        "title": f"Impact of {racket.title}",
        "scenario": json.dumps(dataclasses.asdict(run.scenario)),
        "racket": json.dumps(dataclasses.asdict(racket)),
        "frame_in_plane_hz": in_plane,
        "frame_out_of_plane_hz": out_of_plane,
        "drake_racket_version": version("drake-racket"),
        "drake_version": version("drake"),
        "source": "Glynn, King & Mitchell (2011), doi:10.1007/s12283-010-0056-x",
    }
