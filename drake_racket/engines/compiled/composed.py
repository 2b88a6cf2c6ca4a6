"""Runs a Diagram of the user's own in the compiled engine: any arm, several rackets and balls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import ExternallyAppliedSpatialForceMultiplexer, MultibodyPlant
from pydrake.systems.framework import Context, Diagram, InputPort, System
from pydrake.systems.primitives import Adder, ConstantVectorSource, MatrixGain

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.engine import (
    SHARE_OF_ACCURACY,
    more_room,
    velocity_of_each_position,
    weights_of,
)
from drake_racket.engines.compiled.extract.model import Wiring, extract
from drake_racket.engines.compiled.integrate import FINISHED, FULL
from drake_racket.engines.compiled.kernel import run_case
from drake_racket.io.errors import InputError, SimulationError
from drake_racket.laws.phases import RELEASE, SIZE, TOUCH
from drake_racket.laws.surface import SURFACE_SIZE
from drake_racket.limbs.limits import JointLimits
from drake_racket.parameters.scenario import IntegratorSettings, check_integrator
from drake_racket.plant.compose import Impact

Array = NDArray[np.float64]

_RATE = 1e3  # 1/s; see `engine`


@dataclass(frozen=True)
class ComposedRun:
    """A composed run is what `advance` gives (n samples: the start, and each step's end).

    Attributes:
        time: (n,) s.
        state: (n, nq + nv) positions and velocities of the plant, SI units and radians.
        records: (n, contacts, 17) what each contact has latched, see `laws.phases`; (n, contacts,
            32) with a contact surface, see `laws.surface`; SI units.
        steps, evaluations: of the integrator.

    """

    time: Array
    state: Array
    records: Array
    steps: int
    evaluations: int


class CompiledDiagram:
    """A CompiledDiagram runs a Diagram with rackets, balls and whatever carries them.

    Forces on the plant may come from the impacts' string-beds and contacts, from JointLimits, and
    from constant sources, added up by Drake's Adder, Multiplexer or MatrixGain.

    Args:
        diagram: built, with the plant in it.
        impacts: all that the Diagram has, as `add_impact` returned them.

    Raises:
        InputError: what the compiled engine cannot honour, by name: a system that it does not know
            on a port of the plant, a constraint, a joint or force element; see docs/engines.md.

    """

    def __init__(self, diagram: Diagram, plant: MultibodyPlant, impacts: Sequence[Impact]) -> None:
        self.diagram, self.plant, self.impacts = diagram, plant, tuple(impacts)
        self._limits: list[Any] = []
        self._constant: list[tuple[System, InputPort]] = []
        known = [x for impact in impacts for x in (impact.string_bed, impact.contact) if x]
        for port in _force_ports(plant):
            for source in _sources(diagram, plant, port):
                if isinstance(source, JointLimits):
                    self._limits.append(source)
                elif isinstance(source, ConstantVectorSource):
                    self._constant.append((source, port))
                elif not any(source is system for system in known):
                    raise InputError(
                        f"compiled engine: {source.get_name()} on {port.get_name()}",
                        type(source).__name__,
                        "the given impacts, JointLimits and constant sources (else Drake's"
                        " Simulator)",
                    )

    def advance(
        self, root: Context, end: float, settings: IntegratorSettings | None = None
    ) -> ComposedRun:
        """Simulates from the time and state of `root` to `end` (s), and leaves `root` there.

        Args:
            root: the Diagram's Context. Positions, velocities, time and the contacts' records are
                written back; totals of an EnergyMeter and other states are not.
            settings: accuracy, longest step and error control; their defaults if None.

        Raises:
            InputError: a locked joint, settings out of range, or an end that is not ahead.
            SimulationError: the run could not be finished.

        """
        settings = settings or IntegratorSettings()
        check_integrator(settings, longest=1.0)
        begin = root.get_time()
        if not end > begin:
            raise InputError("end", end, f"after the time of the Context, {begin:g} s")
        context = self.plant.GetMyMutableContextFromRoot(root)
        model = extract(self.plant, root, self._wiring(root))
        bodies = self.plant.num_multibody_states()
        state = np.concatenate(
            [self.plant.GetPositionsAndVelocities(context), *self._elements(root).values()]
        )
        scale = self._scale(context, root, velocity_of_each_position(model))
        room = 1024
        while True:
            y, records = state.copy(), self._records(root, begin)
            samples, kept = np.empty((room, 1 + len(y))), np.empty((room, *records.shape))
            count, steps, evaluations, how = run_case(
                at.open_model(model.ints, model.floats),
                y,
                records,
                end - begin,
                SHARE_OF_ACCURACY * settings.accuracy,
                settings.maximum_step,
                settings.error_control,
                scale,
                samples,
                kept,
            )
            if how != FULL:
                break
            room = more_room(room, begin + samples[-1, 0])
        if how != FINISHED:
            raise SimulationError(f"stopped at t = {begin + samples[count - 1, 0]:.6g} s")
        kept[:count, :, [TOUCH, RELEASE]] += begin
        root.SetTime(end)
        self.plant.SetPositionsAndVelocities(context, y[:bodies])
        place = bodies
        for contact, record in zip(self._contacts(), kept[count - 1], strict=True):
            own = contact.GetMyMutableContextFromRoot(root)
            own.SetDiscreteState(record[: own.get_discrete_state_vector().size()])
            if own.num_continuous_states():
                own.SetContinuousState(y[place : place + contact.ELEMENT])
                place += contact.ELEMENT
        return ComposedRun(
            begin + samples[:count, 0],
            samples[:count, 1 : 1 + bodies].copy(),
            kept[:count].copy(),
            steps,
            evaluations,
        )

    def _contacts(self) -> list[Any]:
        return [impact.contact for impact in self.impacts if impact.contact is not None]

    def _records(self, root: Context, begin: float) -> Array:
        """What the contacts have latched, with times from the start of the run."""
        size = SURFACE_SIZE if self._elements(root) else SIZE
        records = np.zeros((len(self._contacts()), size))
        for row, contact in zip(records, self._contacts(), strict=True):
            own = contact.GetMyContextFromRoot(root).get_discrete_state_vector().CopyToVector()
            row[: len(own)] = own
        records[:, [TOUCH, RELEASE]] -= begin
        return records

    def _elements(self, root: Context) -> dict[int, Array]:
        """The elements of the contacts that have one, by the contact's number."""
        contexts = [c.GetMyContextFromRoot(root) for c in self._contacts()]
        return {
            i: own.get_continuous_state_vector().CopyToVector()
            for i, own in enumerate(contexts)
            if own.num_continuous_states()
        }

    def _wiring(self, root: Context) -> Wiring:
        return Wiring(self.impacts, self._limits, self._constant_forces(root))

    def _constant_forces(self, root: Context) -> Array:
        """What constant sources put on all velocities, through whatever adds them up."""
        forces = np.zeros(self.plant.num_velocities())
        for source, port in self._constant:
            value = source.get_output_port().Eval(source.GetMyContextFromRoot(root))
            for gain in _gains(self.diagram, self.plant, port, source):
                value = gain @ value
            if port.get_name() == "applied_generalized_force":
                forces += value
            else:
                for index in self.plant.GetJointActuatorIndices():
                    actuator = self.plant.get_joint_actuator(index)
                    joint = actuator.joint()
                    forces[joint.velocity_start()] += value[actuator.input_start()]
        return forces

    def _scale(self, context: Context, root: Context, v_of_q: NDArray[np.int64]) -> Array:
        """Weights of errors, as of `engine`: by the energy of the fastest ball."""
        energy = 0.0
        for impact in self.impacts:
            if impact.ball is not None:
                body = impact.ball.body
                speed = body.EvalSpatialVelocityInWorld(context).translational()
                energy = max(energy, float(body.get_mass(context) * (speed @ speed)))
        own = self.plant.CalcKineticEnergy(context)
        twice = max(energy, 1e-3 * float(own), 1e-6)
        v = weights_of(self.plant, context, twice)
        elements = []
        for i in self._elements(root):
            contact = self._contacts()[i]
            surface = contact.GetMyContextFromRoot(root).get_numeric_parameter(contact.SURFACE)
            elements.append(np.full(contact.ELEMENT, np.sqrt(surface[2] / twice)))
        return np.concatenate([_RATE * np.max(v[v_of_q], axis=1), v, *elements])


def _force_ports(plant: MultibodyPlant) -> list[InputPort]:
    ports = [
        plant.get_applied_generalized_force_input_port(),
        plant.get_applied_spatial_force_input_port(),
    ]
    return [*ports, plant.get_actuation_input_port()] if plant.num_actuators() else ports


def _upstream(diagram: Diagram, system: System, index: int) -> System | None:
    """The system whose output is connected to an input port of `system`; None if nothing is."""
    for (to, port), (source, _) in diagram.connection_map().items():
        if to is system and int(port) == index:
            return source
    return None


def _sources(diagram: Diagram, system: System, port: InputPort) -> Iterator[System]:
    """What feeds a port, behind all that adds up."""
    source = _upstream(diagram, system, int(port.get_index()))
    if source is None:
        return
    if isinstance(source, (Adder, ExternallyAppliedSpatialForceMultiplexer, MatrixGain)):
        for index in range(source.num_input_ports()):
            yield from _sources(diagram, source, source.get_input_port(index))
    else:
        yield source


def _gains(diagram: Diagram, system: System, port: InputPort, wanted: System) -> list[Array]:
    """The matrices between a source and a port, from the source on."""
    source = _upstream(diagram, system, int(port.get_index()))
    if source is None or source is wanted:
        return []
    for index in range(source.num_input_ports()):
        inner = source.get_input_port(index)
        if any(found is wanted for found in _sources(diagram, source, inner)):
            own = [source.D()] if isinstance(source, MatrixGain) else []
            return [*_gains(diagram, source, inner, wanted), *own]
    return []
