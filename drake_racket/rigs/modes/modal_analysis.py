"""Computes the modes of a racket from Drake's linearisation of it at rest.

Drake linearises the Diagram of plant and string-bed (automatic differentiation, so exact). In the
plant's velocities v the small motion about the resting racket is

    M u'' + C u' + K u = 0,    K = -M (d vdot/dq) N,

with v = u', M from the plant and qdot = N v; K and M are symmetric. From them come

- the undamped modes: K phi = omega^2 M phi with real shapes, phi^T M phi = 1;
- the damped ones: eigenvalues lambda of Drake's state matrix, with complex shapes, each paired with
  the undamped mode that it overlaps most (M-weighted). Damping ratio -Re(lambda)/|lambda|.

A mode is named after where its strain energy is, not after its place in a list: `in_plane`,
`out_of_plane` (the frame's joints about z and y) or `torsion` (about x, of more than two segments),
`string_bed`, or `rigid` (the grip: the racket
moves in the hand without bending). Modes without strain energy are the motions of a free rigid
body; they are counted and left out.

To first order at the flat string-bed a string's tension does not change: the k of the springs and
their dampers (a rate c dL/dt, and dL is of second order) do not show; T0/L0 makes the stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import (
    Context,
    Diagram,
    DiagramBuilder,
    InputPortSelection,
    OutputPortSelection,
)
from pydrake.systems.primitives import Linearize
from scipy.optimize import linear_sum_assignment

from drake_racket.io.errors import InputError
from drake_racket.parameters.grip import GripStiffness, load_grip
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.compose import add_impact
from drake_racket.plant.grip import Grip
from drake_racket.plant.racket import Racket
from drake_racket.plant.supports import add_hand_held_racket, add_supported_racket

SUPPORTS = ("free", "clamped_handle", "clamped_head", "grip")
STRINGS, GRIP, RIGID = "string_bed", "grip", "rigid"
"""Elements beside the frame's joints; and the kind of a mode that strains the grip most."""

# An eigenvalue omega^2 this small beside the largest is round-off (that is near 1e-15 of it).
_ZERO = 1e-13

_NO_PAIR = complex(np.nan, np.nan)


@dataclass(frozen=True)
class ModalSystem:
    """Holds a racket on its support, ready to be linearised. Vary its Context and solve again."""

    diagram: Diagram
    context: Context
    plant: MultibodyPlant
    racket: Racket
    grip: Grip | None

    def plant_context(self) -> Context:
        """Gives the plant's Context; on it the frame's and the grip's bushings may be changed."""
        return self.plant.GetMyMutableContextFromRoot(self.context)


@dataclass(frozen=True)
class Modes:
    """Holds the n vibrations of a racket with nv velocities, by rising frequency.

    Attributes:
        frequencies: (n,) undamped, Hz.
        damped_frequencies: (n,) Hz; nan where the mode is overdamped.
        damping_ratios: (n,); nan where the mode is overdamped.
        shapes: (nv, n) undamped, in the plant's velocities, mass-normalised.
        complex_shapes: (nv, n) damped, of the same mass norm and in phase with `shapes`; nan where
            overdamped.
        elements: what stores strain energy: the frame's joints by their planes, the strings and
            the hand.
        kinds: of each mode, the element with the largest share; `rigid` if that is the hand.
        strain_shares: (n, elements) share of each in the strain energy.
        rigid_motions: number of motions without strain energy, which are left out.

    """

    system: ModalSystem
    frequencies: NDArray[np.float64]
    damped_frequencies: NDArray[np.float64]
    damping_ratios: NDArray[np.float64]
    shapes: NDArray[np.float64]
    complex_shapes: NDArray[np.complex128]
    elements: tuple[str, ...]
    kinds: tuple[str, ...]
    strain_shares: NDArray[np.float64]
    rigid_motions: int

    def bending(self, plane: str) -> int:
        """Gives the index of the lowest mode that bends (or twists) the frame in one plane.

        Of two segments that is the mode with the largest share of its strain energy in that joint.

        Raises:
            InputError: `plane` is none of the frame's: in_plane, out_of_plane, torsion.

        """
        planes = self.elements[:-2]
        if plane not in planes:
            raise InputError("Modes.bending: plane", plane, ", ".join(planes))
        shares = self.strain_shares[:, self.elements.index(plane)]
        if len(self.system.racket.segments) > 2 and plane in self.kinds:
            return self.kinds.index(plane)
        return int(np.argmax(shares))


def modal_system(
    parameters: RacketParameters,
    *,
    strung: bool = True,
    support: str = "free",
    grip: GripStiffness | None = None,
) -> ModalSystem:
    """Builds a racket on its support, without gravity (which would let it fall or sag).

    Args:
        strung: with string masses and string-bed; False gives the bare frame.
        support: `free`; `clamped_handle` and `clamped_head` hold that body; `grip` holds the
            racket's grip frame by a hand fixed in the world.
        grip: of support `grip`; the shipped one if None. One whose hand has mass is of kind `hand`.

    Raises:
        InputError: unknown support, or a grip with a support that has none.

    """
    if support not in SUPPORTS:
        raise InputError("support", support, ", ".join(SUPPORTS))
    if grip is not None and support != "grip":
        raise InputError("grip", grip.name, f"no grip with support {support}")
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    hand = None
    if support == "grip":
        grip = grip or load_grip()
        kind = "compliant" if grip.hand is None else "hand"
        racket, hand = add_hand_held_racket(plant, parameters, grip, kind=kind, strung=strung)
    else:
        racket = add_supported_racket(plant, parameters, support, strung=strung)
    plant.Finalize()
    if strung:
        add_impact(builder, plant, racket)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    if hand is not None:
        hand.rest(context)
    return ModalSystem(diagram, context, plant, racket, hand)


@dataclass(frozen=True)
class LinearSystem:
    """Holds small motion about rest: Drake's state matrix (of [q; v]), and M, K in velocities."""

    state_matrix: NDArray[np.float64]
    mass: NDArray[np.float64]
    stiffness: NDArray[np.float64]


def linearise(system: ModalSystem) -> LinearSystem:
    """Linearises the racket at rest with the parameters of its Context."""
    plant, context = system.plant, system.plant_context()
    linear = Linearize(
        system.diagram,
        system.context,
        InputPortSelection.kNoInput,
        OutputPortSelection.kNoOutput,
    )
    matrix = np.asarray(linear.A())
    nq = plant.num_positions()
    mass = plant.CalcMassMatrix(context)
    q_dot = plant.MakeVelocityToQDotMap(context).toarray()
    stiffness = -mass @ matrix[nq:, :nq] @ q_dot
    return LinearSystem(
        state_matrix=matrix,
        mass=mass,
        stiffness=0.5 * (stiffness + stiffness.T),  # symmetric but for round-off
    )


def solve_modes(system: ModalSystem) -> Modes:
    """Gives the modes of the racket with the parameters of the system's Context."""
    linear = linearise(system)
    squares, shapes = scipy.linalg.eigh(linear.stiffness, linear.mass)
    vibrates = squares > _ZERO * squares[-1]
    squares, shapes = squares[vibrates], shapes[:, vibrates]
    values, complex_shapes = _damped(linear, shapes)
    elements = strain_elements(system.racket.parameters)
    shares = _strain_shares(system, linear, shapes)
    kinds = [elements[i] for i in np.argmax(shares, axis=1)]
    return Modes(
        system=system,
        frequencies=np.sqrt(squares) / (2.0 * np.pi),
        damped_frequencies=values.imag / (2.0 * np.pi),
        damping_ratios=-values.real / np.abs(values),
        shapes=shapes,
        complex_shapes=complex_shapes,
        elements=elements,
        kinds=tuple(RIGID if kind == GRIP else kind for kind in kinds),
        strain_shares=shares,
        rigid_motions=int(np.count_nonzero(~vibrates)),
    )


def _damped(
    linear: LinearSystem, shapes: NDArray[np.float64]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Eigenvalues (n,) and shapes (nv, n) of the damped modes, in the order of `shapes`.

    A state's lower half is lambda phi, a multiple of the shape. Overdamped modes do not oscillate
    and have no complex pair: their columns are nan.
    """
    values, vectors = np.linalg.eig(linear.state_matrix)
    # the zero eigenvalues of a free body split by the root of round-off, far below any vibration
    oscillates = values.imag > 1e-6 * np.max(np.abs(values))
    values, vectors = values[oscillates], vectors[-len(linear.mass) :, oscillates]
    overlap = shapes.T @ linear.mass @ vectors
    norms = np.sqrt(np.einsum("ij,ik,kj->j", vectors.conj(), linear.mass, vectors).real)
    rows, columns = linear_sum_assignment(np.abs(overlap / norms), maximize=True)
    found = np.full(shapes.shape[1], _NO_PAIR)
    aligned = np.full(shapes.shape, _NO_PAIR)
    found[rows] = values[columns]
    phases = overlap[rows, columns] / np.abs(overlap[rows, columns])
    aligned[:, rows] = vectors[:, columns] / (phases * norms[columns])
    return found, aligned


def strain_elements(parameters: RacketParameters) -> tuple[str, ...]:
    """Tells what stores strain energy: the frame's joints by plane, the strings, and the hand."""
    planes = dict.fromkeys(joint.plane for joint in parameters.frame_joints())
    return (*planes, STRINGS, GRIP)


def _strain_shares(
    system: ModalSystem, linear: LinearSystem, shapes: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Share (n, elements) of each of `strain_elements` in the strain energy v^T K v / 2."""
    racket = system.racket
    total = np.einsum("ij,ik,kj->j", shapes, linear.stiffness, shapes)
    constants = racket.joint_constants(system.plant_context())
    elements = strain_elements(racket.parameters)
    energies = np.zeros((shapes.shape[1], len(elements)))
    for joint, found in zip(racket.frame_joints, constants, strict=True):
        stored = found.stiffness * shapes[joint.velocity_start()] ** 2
        energies[:, elements.index(found.plane)] += stored
    if racket.string_joints and len(racket.segments) == 2:
        at = [joint.velocity_start() for joint in racket.string_joints]
        block = linear.stiffness[np.ix_(at, at)]
        energies[:, -2] = np.einsum("ij,ik,kj->j", shapes[at], block, shapes[at])
    if system.grip is not None:
        grips = [grip for grip in (system.grip, system.grip.wrist_side()) if grip is not None]
        energies[:, -1] = np.sum([_held(system, grip, shapes) for grip in grips], axis=0)
    if racket.string_joints and len(racket.segments) > 2:  # strings that end on other segments
        energies[:, -2] = total - np.sum(energies, axis=1)
    shares: NDArray[np.float64] = energies / total[:, np.newaxis]
    return shares


def _held(system: ModalSystem, grip: Grip, shapes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Twice the energy (n,) in a grip's springs."""
    context, bushing = system.plant_context(), grip.bushing
    assert bushing is not None  # the modal rig's grips are compliant
    jacobian = system.plant.CalcJacobianSpatialVelocity(
        context,
        JacobianWrtVariable.kV,
        grip.racket_frame,
        [0.0, 0.0, 0.0],
        grip.hand_frame,
        grip.hand_frame,
    )
    stiffness = np.append(
        bushing.GetTorqueStiffnessConstants(context),
        bushing.GetForceStiffnessConstants(context),
    )
    energy: NDArray[np.float64] = stiffness @ (jacobian @ shapes) ** 2
    return energy
