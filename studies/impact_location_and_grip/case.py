"""One run of the experiment in `grip_and_location`: from a simulated impact to labelled data.

The load of the racket on the joints is tau = J_H^T F_H, with the wrench F_H of the racket on the
hand and the Jacobian J_H of the hand's spatial velocity: the torque about each joint's axis that
would have to be balanced there for the hand to be unaffected (inertia of the limb left aside).
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RollPitchYaw
from pydrake.multibody.tree import JacobianWrtVariable

from drake_racket import ImpactDiagram, ImpactResult, Scenario, SimulationError
from drake_racket.laws import limit_torques
from drake_racket.limbs import limit_law

if TYPE_CHECKING:
    import xarray

STEP = 1e-4
"""s, between the samples of the time histories; peaks are read from all steps of a run."""
MARGIN = 1e-3
"""s that a run goes on beyond its histories, since touch is not exactly at approach_time."""
LATE = 0.02
"""s after the end of the histories at which the ball of a stroke without impact comes."""


def has_impact(scenario: Scenario) -> bool:
    """Whether a run goes on after touch; the stroke without impact ends before."""
    return scenario.after > MARGIN


HISTORIES: Mapping[str, tuple[tuple[str, ...], str, str]] = MappingProxyType(
    {
        "joint_position": (("joint",), "rad", "angle of the joint"),
        "racket_load": (("joint",), "N m", "torque of the racket about the joint's axis"),
        "limit_torque": (("joint",), "N m", "passive torque at the end of the joint's range"),
        "reaction_force": (("joint",), "N", "magnitude of the joint's reaction force"),
        "grip_angle": (("axis",), "rad", "roll, pitch and yaw of the racket in the hand"),
        "grip_rotation": ((), "rad", "angle of the racket's rotation in the hand"),
        "ball_velocity": (("axis",), "m/s", "velocity of the ball in the world"),
    }
)
"""Histories: name -> (dimensions after time, units, text)."""

NUMBERS: Mapping[str, tuple[tuple[str, ...], str, str]] = MappingProxyType(
    {
        "peak_flexing_load": (("joint",), "N m", "largest racket_load from touch on"),
        "peak_extending_load": (("joint",), "N m", "least racket_load from touch on"),
        "peak_reaction_force": (("joint",), "N", "largest reaction_force from touch on"),
        "peak_grip_rotation": ((), "rad", "largest grip_rotation from touch on"),
        "applied_torque": (("joint",), "N m", "constant torque applied on the joint"),
        "rebound_velocity": (("axis",), "m/s", "velocity of the ball at release, in R"),
        "rebound_speed": ((), "m/s", "speed of the ball at release"),
        "restitution": ((), "1", "apparent restitution"),
        "contact_time": ((), "s", "from first touch to last release"),
        "peak_normal_force": ((), "N", "peak normal force on the ball"),
        "touch_time": ((), "s", "first touch, from the start of the run"),
        "height": ((), "m", "height of the point over the racket's long axis, along gravity"),
        "along": ((), "m", "place of the point along the long axis, from the string-bed's centre"),
        "energy_error": ((), "1", "largest error of the energy balance"),
    }
)
"""Numbers of an impact: name -> (dimensions, units, text)."""


def read_run(result: ImpactResult, system: ImpactDiagram) -> xarray.Dataset:
    """Histories on a fixed grid from touch (from the start, without impact), and numbers."""
    import xarray

    assert result.history is not None
    full = _full_histories(result, system)
    time = result.history["time"].to_numpy()
    scenario = result.scenario
    hit = has_impact(scenario)
    end = scenario.after - MARGIN
    if not hit:
        time = time - time[0]
        end = scenario.approach_time - LATE
    grid = STEP * np.arange(int(end / STEP * (1.0 + 1e-12)) + 1)
    touched = bool(result.history["in_contact"].to_numpy()[time <= end].any())
    if touched != hit or grid[-1] > time[-1]:
        when = f"at {result.touch_time} s, with {scenario.approach_time} s asked for"
        raise SimulationError(
            f"grip {scenario.grip}, point {scenario.point}: the ball touched {when}"
        )
    variables: dict[str, Any] = {}
    for name, (dimensions, units, text) in HISTORIES.items():
        values = full[name].reshape(len(time), -1)
        sampled = np.column_stack([np.interp(grid, time, column) for column in values.T])
        shape = (len(grid), *full[name].shape[1:])
        attributes = {"units": units, "long_name": text}
        variables[name] = (("time", *dimensions), sampled.reshape(shape), attributes)
    if hit:
        window = (time >= 0.0) & (time <= grid[-1])
        numbers = _numbers(result, system, {k: v[window] for k, v in full.items()})
        for name, (dimensions, units, text) in NUMBERS.items():
            variables[name] = (dimensions, numbers[name], {"units": units, "long_name": text})
    coordinates = {
        "time": ("time", grid, {"units": "s", "long_name": "time from touch"}),
        "joint": result.history["joint"].to_numpy().astype(str),
        "axis": ["x", "y", "z"],
    }
    return xarray.Dataset(variables, coordinates)


def _full_histories(result: ImpactResult, system: ImpactDiagram) -> dict[str, NDArray[np.float64]]:
    history = result.history
    assert history is not None
    assert system.limb is not None
    law = limit_law(system.limb.limb)
    q, v = history["joint_position"].to_numpy(), history["joint_velocity"].to_numpy()
    limits = limit_torques(q, v, law.lower, law.upper, law.stiffness, law.damping)
    angles = history["grip_angle"].to_numpy()
    turns = [RollPitchYaw(rpy).ToQuaternion() for rpy in angles]
    sines = [np.linalg.norm(turn.xyz()) for turn in turns]  # of half the angle
    return {
        "joint_position": q,
        "racket_load": racket_loads(system, q, history),
        "limit_torque": limits if result.scenario.limb.limits else np.zeros_like(q),
        "reaction_force": history["joint_reaction_force"].to_numpy(),
        "grip_angle": angles,
        "grip_rotation": 2.0 * np.arctan2(sines, [abs(turn.w()) for turn in turns]),
        "ball_velocity": history["ball_velocity"].to_numpy(),
    }


def racket_loads(
    system: ImpactDiagram, q: NDArray[np.float64], history: xarray.Dataset
) -> NDArray[np.float64]:
    """Torques J_H^T F_H (N m) of the racket on the limb's joints, (n, joints).

    Positive in the joint's positive direction: at the wrist a positive load forces flexion.

    Args:
        q: (n, joints) angles (rad).  history: with the wrench on the hand at the same samples.

    """
    assert system.limb is not None
    limb, plant = system.limb.limb, system.plant
    context = plant.CreateDefaultContext()
    positions = plant.GetPositions(context)
    where, columns = limb.position_indices(), limb.velocity_indices()
    wrench = np.hstack([history["hand_torque"].to_numpy(), history["hand_force"].to_numpy()])
    loads = np.empty_like(q)
    for i, angles in enumerate(q):
        positions[where] = angles
        plant.SetPositions(context, positions)
        J = plant.CalcJacobianSpatialVelocity(
            context, JacobianWrtVariable.kV, limb.hand, np.zeros(3), plant.world_frame(), limb.hand
        )
        loads[i] = J[:, columns].T @ wrench[i]
    return loads


def _numbers(
    result: ImpactResult,
    system: ImpactDiagram,
    full: dict[str, NDArray[np.float64]],
) -> dict[str, Any]:
    assert result.history is not None
    racket = system.impact.racket
    context = system.plant.GetMyContextFromRoot(system.create_context(result.scenario))
    R_WR = racket.handle.EvalPoseInWorld(context).rotation().matrix()
    x, y, _ = racket.parameters.point(int(result.scenario.point))
    nan = float("nan")
    return {
        "peak_flexing_load": full["racket_load"].max(axis=0),
        "peak_extending_load": full["racket_load"].min(axis=0),
        "peak_reaction_force": full["reaction_force"].max(axis=0),
        "peak_grip_rotation": full["grip_rotation"].max(),
        "applied_torque": result.history["joint_torque"].to_numpy()[0],
        "rebound_velocity": result.rebound_velocity,
        "rebound_speed": float(np.linalg.norm(result.rebound_velocity)),
        "restitution": result.apparent_restitution,
        "contact_time": nan if result.contact_time is None else result.contact_time,
        "peak_normal_force": result.peak_normal_force,
        "touch_time": result.touch_time,
        "height": float(R_WR[2, 1] * y),
        "along": x - racket.parameters.point(5)[0],
        "energy_error": nan if result.energy_error is None else result.energy_error,
    }
