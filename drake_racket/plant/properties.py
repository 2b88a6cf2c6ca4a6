"""Derives a racket's numbers from the plant: total mass, balance, swingweight, frequencies."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, InputPortSelection, OutputPortSelection
from pydrake.systems.primitives import Linearize

from drake_racket.parameters.frame import BENDING_AXES, FrameJoint
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.racket import Racket, add_racket

SWINGWEIGHT_AXIS = 0.1016
"""The axis of the swingweight is so far from the butt (m): 4 inches, as racket makers have it."""


@dataclass(frozen=True)
class RacketProperties:
    """The properties are those of the strung racket's mass, and the bare frame's fundamentals.

    Attributes:
        mass: kg.
        balance: m, of the centre of mass from the butt.
        swingweight: kg m^2, about the transverse axis 4 inches from the butt.
        twistweight: kg m^2, about the long axis.
        spinweight: kg m^2, about the normal of the strings 4 inches from the butt.
        in_plane_frequency: Hz, of the bare frame, free.
        out_of_plane_frequency: Hz, likewise.

    """

    mass: float  # kg
    balance: float  # m, centre of mass from the butt
    swingweight: float  # kg m^2, about the transverse axis 4 inches from the butt
    twistweight: float  # kg m^2, about the longitudinal axis
    spinweight: float  # kg m^2, about the normal of the strings 4 inches from the butt
    in_plane_frequency: float  # Hz
    out_of_plane_frequency: float  # Hz


def racket_properties(parameters: RacketParameters) -> RacketProperties:
    """Computes the properties from the parsed model, not from the parameter file."""
    in_plane, out_of_plane = frame_fundamentals(parameters)
    return RacketProperties(
        **mass_properties(parameters),
        in_plane_frequency=in_plane,
        out_of_plane_frequency=out_of_plane,
    )


def mass_properties(parameters: RacketParameters) -> dict[str, float]:
    """Computes those of the properties that are the strung racket's mass alone, by name."""
    plant = MultibodyPlant(0.0)
    racket = add_racket(plant, parameters)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    instances = [racket.model_instance]
    inertia = plant.CalcSpatialInertia(
        context, racket.frame("butt"), plant.GetBodyIndices(racket.model_instance)
    )
    at_axis = inertia.Shift([SWINGWEIGHT_AXIS, 0.0, 0.0]).CalcRotationalInertia()
    moments = at_axis.CopyToFullMatrix3()
    com = plant.CalcCenterOfMassPositionInWorld(context, instances)
    return {
        "mass": plant.CalcTotalMass(context, instances),
        "balance": float(com[0]),
        "swingweight": float(moments[1, 1]),
        "twistweight": float(moments[0, 0]),
        "spinweight": float(moments[2, 2]),
    }


def frame_fundamentals(parameters: RacketParameters, *, strung: bool = False) -> tuple[float, ...]:
    """Computes the free racket's undamped bending frequencies (Hz) in plane and out of plane.

    Drake linearises the plant at rest, the joint's damping left out; the frequency of each mode is
    |eigenvalue| / 2 pi, and the joint rate that its eigenvector holds most of tells the plane. Of
    more than two segments it is the lowest mode with most strain energy in that plane's joints.
    `strung` adds the string masses, but not the strings' stiffness.
    """
    plant = MultibodyPlant(0.0)
    racket = add_racket(plant, parameters, strung=strung)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    plant.Finalize()
    context = plant.CreateDefaultContext()
    undamped = [
        dataclasses.replace(joint, damping=0.0) for joint in racket.joint_constants(context)
    ]
    racket.set_joint_constants(context, undamped)
    matrix = _state_matrix(plant, context)
    values, vectors = np.linalg.eig(matrix)
    if len(racket.segments) > 2:
        return _lowest(racket, undamped, values, vectors)
    frequencies = []
    for joint in racket.frame_joints:
        row = np.abs(vectors[plant.num_positions() + joint.velocity_start()])
        row = np.where(np.abs(values.imag) > 1.0, row, 0.0)
        frequencies.append(float(np.abs(values[int(np.argmax(row))])) / (2.0 * np.pi))
    return tuple(frequencies)


def _lowest(
    racket: Racket,
    joints: Sequence[FrameJoint],
    values: NDArray[np.complex128],
    vectors: NDArray[np.complex128],
) -> tuple[float, ...]:
    """The lowest frequency of the modes that bend most in each plane."""
    at = [joint.position_start() for joint in racket.frame_joints]
    stored = np.array([joint.stiffness for joint in joints])[:, None] * np.abs(vectors[at]) ** 2
    planes = np.array([joint.plane for joint in joints])
    rates = np.abs(values)
    vibrates = np.abs(values.imag) > 1e-3 * np.max(rates)
    found = []
    for plane in BENDING_AXES:
        own = np.sum(stored[planes == plane], axis=0) > 0.5 * np.sum(stored, axis=0)
        found.append(float(np.min(rates[own & vibrates])) / (2.0 * np.pi))
    return tuple(found)


def _state_matrix(plant: MultibodyPlant, context: Context) -> NDArray[np.float64]:
    """d(xdot)/dx at a resting state without inputs."""
    system = Linearize(plant, context, InputPortSelection.kNoInput, OutputPortSelection.kNoOutput)
    return system.A()  # type: ignore[no-any-return]
