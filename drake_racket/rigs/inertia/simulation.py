"""Simulates the bench in Drake: pendulum, torsional pendulum, and knife-edges with scales.

A specimen is rigid: its pieces (`rigid.specimen_pieces`) are welded. The racket's own
throat joint would bend with the swing, which changes the moment found by the order of
(f_pendulum / f_bending)^2, 4e-6 of it; `swing_flexible_frame` hangs that racket up to measure it.

Specimen frame S: origin at the end nearest the butt, x towards the tip, z normal to the strings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    LinearSpringDamper,
    RevoluteJoint,
    RevoluteSpring,
    RigidBody,
    RotationalInertia,
    SpatialInertia,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput
from scipy.interpolate import CubicHermiteSpline

from drake_racket.engines.drake.engine import configure_integrator
from drake_racket.io.errors import InputError, SimulationError
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.scenario import IntegratorSettings
from drake_racket.plant.racket import add_racket
from drake_racket.rigs.inertia.bench import STANDARD_GRAVITY
from drake_racket.rigs.inertia.rigid import Inertia, combine
from drake_racket.rigs.input_checks import check_finite, check_positive

AXES = {"longitudinal": (1.0, 0.0, 0.0), "transverse": (0.0, 1.0, 0.0), "frontal": (0.0, 0.0, 1.0)}

# The source names its torsional pendulum (Inertia Dynamics 005-104) and prints no number of it, nor
# of its scales. All of these are inferred, as plausible; none of them shows in what is recovered.
TORSION_CONSTANT = 0.02  # N m/rad: periods of 0.5 to 2 s
PLATFORM = Inertia(mass=1.0, com=0.0, longitudinal=1e-4, transverse=5e-5, frontal=5e-5)
SCALE_STIFFNESS = 1e5  # N/m: a load cell that yields 0.02 mm under 2 N
SCALE_DAMPING = 100.0  # N s/m: what it shows rests within 0.2 s

STEP = 1e-3
"""s; RK3's relative error of a period of 0.5 to 2 s is then below 1e-8 at 10 degrees, 2e-8 at 90
degrees, and 2e-6 at 170 degrees, where the swing is sharp."""
FAST_STEP = 2e-4  # s, where something vibrates at 100-200 Hz: the scales, the bending frame
EDGE_INSET = 0.02  # m, of either knife-edge from the ends of the specimen
SETTLING_TIME = 0.4  # s, of the scales
LONGEST = 300.0  # s; a run ends here


@dataclass(frozen=True)
class Oscillation:
    """Holds a swing as an angle sensor and a gate at the rest position see it.

    Attributes:
        time, angle: (n,) s and rad, at the integrator's steps.
        crossings: (m,) s, when the specimen passes its rest position, in either direction.
        period: s, mean of the whole swings after the first.

    """

    time: NDArray[np.float64]
    angle: NDArray[np.float64]
    crossings: NDArray[np.float64]
    period: float


def swing(
    pieces: Sequence[Inertia],
    axis: str,
    *,
    pivot: float,
    amplitude: float,
    oscillations: int = 3,
    gravity: float = STANDARD_GRAVITY,
    step: float = STEP,
) -> Oscillation:
    """Hangs a specimen from a horizontal axis, tip down, and lets it go from rest.

    Args:
        axis: `transverse` (y) or `frontal` (z).
        pivot: m, place of the axis on the specimen, from its end nearest the butt.
        amplitude: rad, where it is let go.
        oscillations: whole swings that are timed, after a first one that is not.

    Raises:
        InputError: an argument is out of range.
        SimulationError: it swings too slowly to be timed.

    """
    _check_swing(axis, pivot, gravity)
    com = combine(pieces).com
    if not com > pivot:
        raise InputError("pivot", pivot, f"a place before the centre of mass, {com:.6g} m")
    plant = _plant([gravity, 0.0, 0.0])
    specimen = _add_specimen(plant, pieces)
    joint = _add_hinge(plant, specimen.body_frame(), pivot, axis)
    return _oscillation(plant, joint, amplitude, oscillations, step)


def twist(
    pieces: Sequence[Inertia],
    *,
    amplitude: float,
    oscillations: int = 3,
    torsion_constant: float = TORSION_CONSTANT,
    step: float = STEP,
) -> Oscillation:
    """Turns a specimen about its long axis on a torsion spring; include the platform's piece.

    Raises:
        InputError: an argument is out of range.

    """
    check_positive(torsion_constant=torsion_constant)
    plant = _plant([STANDARD_GRAVITY, 0.0, 0.0])  # along the axis: it does no work
    specimen = _add_specimen(plant, pieces)
    joint = _add_hinge(plant, specimen.body_frame(), 0.0, "longitudinal")
    plant.AddForceElement(
        RevoluteSpring(joint=joint, nominal_angle=0.0, stiffness=torsion_constant)
    )
    return _oscillation(plant, joint, amplitude, oscillations, step)


def scale_mass(
    pieces: Sequence[Inertia],
    *,
    fixed_edge: float,
    scale_edge: float,
    gravity: float = STANDARD_GRAVITY,
) -> float:
    """Tells what the scales show (kg) once a specimen has come to rest on two knife-edges.

    The fixed edge is a hinge about y, the scales are a stiff damped spring under the other edge.

    Args:
        fixed_edge, scale_edge: m, places of the edges from the specimen's end nearest the butt.

    Raises:
        InputError: an argument is out of range.
        SimulationError: the scales have not come to rest.

    """
    check_positive(gravity=gravity)
    check_finite("fixed_edge", fixed_edge)
    check_finite("scale_edge", scale_edge)
    if scale_edge == fixed_edge:
        raise InputError("scale_edge", scale_edge, "another place than the fixed edge")
    plant = _plant([0.0, 0.0, -gravity])
    specimen = _add_specimen(plant, pieces)
    joint = _add_hinge(plant, specimen.body_frame(), fixed_edge, "transverse")
    height = 0.1  # m, of the scales; it keeps the spring upright
    scales = plant.AddForceElement(
        LinearSpringDamper(
            bodyA=plant.world_body(),
            p_AP=[scale_edge - fixed_edge, 0.0, -height],
            bodyB=specimen,
            p_BQ=[scale_edge, 0.0, 0.0],
            free_length=height,
            stiffness=SCALE_STIFFNESS,
            damping=SCALE_DAMPING,
        )
    )
    plant.Finalize()
    simulator = Simulator(plant)
    settings = IntegratorSettings(maximum_step=FAST_STEP, error_control=False)
    configure_integrator(simulator, settings)
    simulator.AdvanceTo(SETTLING_TIME)
    context = simulator.get_context()
    if abs(joint.get_angular_rate(context)) > 1e-9:
        raise SimulationError(f"the scales have not come to rest within {SETTLING_TIME} s")
    edge = specimen.EvalPoseInWorld(context).multiply(scales.p_BQ())
    length = float(np.linalg.norm(edge - scales.p_AP()))
    return float(scales.stiffness() * (scales.free_length() - length) / gravity)


def swing_flexible_frame(
    parameters: RacketParameters,
    axis: str,
    *,
    pivot: float,
    amplitude: float,
    oscillations: int = 3,
    gravity: float = STANDARD_GRAVITY,
) -> Oscillation:
    """Swings as `swing` does, with the bare frame of the impact model, which bends.

    It is let go unbent; the ringing that this starts is gone when the timing begins.

    Raises:
        InputError, SimulationError: as `swing`.

    """
    _check_swing(axis, pivot, gravity)
    plant = _plant([gravity, 0.0, 0.0])
    racket = add_racket(plant, parameters, strung=False)
    joint = _add_hinge(plant, racket.frame("butt"), pivot, axis)
    return _oscillation(plant, joint, amplitude, oscillations, FAST_STEP)


def _check_swing(axis: str, pivot: float, gravity: float) -> None:
    if axis not in ("transverse", "frontal"):
        raise InputError("axis", axis, "transverse, frontal")
    check_finite("pivot", pivot)
    check_positive(gravity=gravity)


def _plant(gravity: Sequence[float]) -> MultibodyPlant:
    plant = MultibodyPlant(0.0)
    plant.mutable_gravity_field().set_gravity_vector(gravity)
    return plant


def _add_specimen(plant: MultibodyPlant, pieces: Sequence[Inertia]) -> RigidBody:
    """Adds the pieces, welded to each other; the frame of the body returned is S."""
    combine(pieces)  # raises InputError where Drake would abort
    bodies = [
        plant.AddRigidBody(f"piece_{i}", _spatial_inertia(piece)) for i, piece in enumerate(pieces)
    ]
    for body in bodies[1:]:
        plant.WeldFrames(bodies[0].body_frame(), body.body_frame())
    return bodies[0]


def _spatial_inertia(piece: Inertia) -> SpatialInertia:
    return SpatialInertia.MakeFromCentralInertia(
        piece.mass,
        [piece.com, 0.0, 0.0],
        RotationalInertia(piece.longitudinal, piece.transverse, piece.frontal),
    )


def _add_hinge(plant: MultibodyPlant, frame: Frame, place: float, axis: str) -> RevoluteJoint:
    """A frictionless hinge to the world about an axis through (place, 0, 0) in `frame`."""
    hinge = plant.AddFrame(FixedOffsetFrame("hinge", frame, RigidTransform([place, 0.0, 0.0])))
    return plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), hinge, AXES[axis], 0.0))


def _oscillation(
    plant: MultibodyPlant, joint: RevoluteJoint, amplitude: float, oscillations: int, step: float
) -> Oscillation:
    """Lets the hinge go at `amplitude` and times its swings."""
    check_positive(amplitude=amplitude, step=step)
    if not amplitude < np.pi:
        raise InputError("amplitude", amplitude, "above 0 to below pi, radians")
    if isinstance(oscillations, bool) or not isinstance(oscillations, int):
        raise InputError("oscillations", oscillations, "an integer")
    if not 1 <= oscillations <= 100:
        raise InputError("oscillations", oscillations, "1 to 100 swings")
    plant.Finalize()
    builder = DiagramBuilder()
    builder.AddSystem(plant)
    log = LogVectorOutput(plant.get_state_output_port(), builder)
    simulator = Simulator(builder.Build())
    configure_integrator(simulator, IntegratorSettings(maximum_step=step, error_control=False))
    joint.set_angle(plant.GetMyMutableContextFromRoot(simulator.get_mutable_context()), amplitude)
    columns = joint.position_start(), plant.num_positions() + joint.velocity_start()
    simulator.Initialize()
    # the first swing's two crossings, then both ends of every timed swing
    needed = 2 + 2 * oscillations + 1
    while (crossed := _count(log, simulator, columns[0])) < needed:
        now = simulator.get_context().get_time()
        if now > LONGEST:
            raise SimulationError(
                f"{crossed} passes through rest in {now:g} s: too slow to be timed"
            )
        simulator.AdvanceTo(now + 1.0)
    return _timed(log, simulator, columns, needed)


def _count(log: Any, simulator: Any, column: int) -> int:
    """Passes through the rest position so far."""
    angle = log.FindLog(simulator.get_context()).data()[column]
    return int(np.count_nonzero(np.diff(np.signbit(angle))))


def _timed(log: Any, simulator: Any, columns: tuple[int, int], needed: int) -> Oscillation:
    """The crossings as roots of the Hermite cubic through angles and rates, one order above RK3."""
    found = log.FindLog(simulator.get_context())
    time, (angle, rate) = found.sample_times().copy(), found.data()[list(columns)].copy()
    roots = CubicHermiteSpline(time, angle, rate).roots(extrapolate=False)
    crossings = np.sort(roots)[:needed]
    swings = (needed - 3) // 2
    end = int(np.searchsorted(time, crossings[-1])) + 1
    return Oscillation(
        time=time[:end],
        angle=angle[:end],
        crossings=crossings,
        period=float(crossings[-1] - crossings[2]) / swings,
    )
