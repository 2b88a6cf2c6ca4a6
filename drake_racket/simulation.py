"""Runs one case: approach, contact, after-ringing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import Context, EventStatus

from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.io.errors import InputError
from drake_racket.parameters.scenario import (
    IntegratorSettings,
    Scenario,
    check_integrator,
    check_scenario,
)
from drake_racket.plant.systems.energy_meter import TOTALS
from drake_racket.results.impact import ImpactResult, make_result

MOST_STEPS = 5_000_000
"""A run that takes more steps than this is stopped with an error."""


class SimulationError(RuntimeError):
    """A run that could not be finished; the message says where it stopped and why."""


@dataclass(frozen=True)
class Run:
    """What a run leaves: states at the integrator's own steps, and how it went.

    Attributes:
        time: (n,) s, from the start of the run; touch and release are among the times.
        plant_state: (n, nq + nv) the plant's [q; v].
        contact_state: (n, 15), with a discrete plant (n, 29): the BallContact's discrete state,
            after any event at that time.
        totals: (n, 9) the EnergyMeter's totals, NaN without a meter; (n, 12) with a limb, whose
            work and losses follow.
        steps, evaluations: of the integrator.

    """

    system: ImpactDiagram
    scenario: Scenario
    root: Context
    time: NDArray[np.float64]
    plant_state: NDArray[np.float64]
    contact_state: NDArray[np.float64]
    totals: NDArray[np.float64]
    steps: int
    evaluations: int

    def context_at(self, index: int) -> Context:
        """The run's Context set to one of its samples, for evaluating any output port."""
        system, root = self.system, self.root
        root.SetTime(float(self.time[index]))
        context = system.plant.GetMyMutableContextFromRoot(root)
        system.plant.SetPositionsAndVelocities(context, self.plant_state[index])
        assert system.impact.contact is not None
        contact = system.impact.contact.GetMyMutableContextFromRoot(root)
        contact.SetDiscreteState(self.contact_state[index])
        if system.meter is not None:
            meter = system.meter.GetMyMutableContextFromRoot(root)
            meter.SetContinuousState(self.totals[index, :TOTALS])
        if system.limb is not None and system.limb.energy is not None:
            energy = system.limb.energy.GetMyMutableContextFromRoot(root)
            energy.SetContinuousState(self.totals[index, TOTALS:])
        return root


def simulate(
    scenario: Scenario | None = None,
    system: ImpactDiagram | None = None,
    *,
    history: bool = True,
) -> ImpactResult:
    """Simulates one impact.

    Args:
        scenario: the case (the default: tour racket, free, centre, 25 m/s).
        system: a Diagram from `make_impact_diagram` to use again; built if None. It must have the
            scenario's topology.
        history: evaluate accelerations and energies at every step; without it the run is faster
            `ImpactResult.history` and what is read from it are None, and the balance is that of
            the end alone.

    Raises:
        InputError: the scenario is not valid or needs another Diagram.
        SimulationError: the run could not be finished.

    """
    scenario = scenario or Scenario()
    check_scenario(scenario)
    system = system or make_impact_diagram(scenario)
    return make_result(run(scenario, system), history=history)


def run(scenario: Scenario, system: ImpactDiagram) -> Run:
    """Runs the simulation and keeps the state of every step. See `simulate`."""
    if system.limb is not None and system.limb.torques.source is None:
        raise InputError(
            "simulate: system",
            "a Diagram whose joint_torques are an input",
            "one built without export_torques (or your own Simulator)",
        )
    root = system.create_context(scenario)
    simulator = Simulator(system.diagram, root)
    root = simulator.get_mutable_context()
    configure_integrator(simulator, scenario.integrator, discrete=scenario.time_step > 0.0)
    recorder = _Recorder(system)
    simulator.set_monitor(recorder)
    try:
        simulator.Initialize()
        simulator.AdvanceTo(scenario.approach_time + scenario.after)
    except RuntimeError as error:
        reason = str(error).splitlines()[0]
        raise SimulationError(f"stopped at t = {root.get_time():.6g} s: {reason}") from error
    integrator = simulator.get_integrator()
    time, plant_state, contact_state, totals = recorder.arrays()
    return Run(
        system=system,
        scenario=scenario,
        root=root,
        time=time,
        plant_state=plant_state,
        contact_state=contact_state,
        totals=totals,
        steps=simulator.get_num_steps_taken(),
        evaluations=integrator.get_num_derivative_evaluations(),
    )


def configure_integrator(
    simulator: Any, settings: IntegratorSettings, *, discrete: bool = False
) -> None:
    """Gives a Simulator the settings, and events isolated well within its accuracy.

    Drake isolates a witness's zero to 0.01 x accuracy x 1 s with error control, and to 0.01 x
    accuracy x step without: touch and release are placed within a nanosecond or better.

    Args:
        discrete: the plant has a time step; accuracy and error control are then Drake's.

    Raises:
        InputError: settings out of range.

    """
    check_integrator(settings, longest=1.0)  # what has no impact may take longer steps
    ResetIntegratorFromFlags(simulator, settings.scheme, settings.maximum_step)
    integrator = simulator.get_mutable_integrator()
    context = simulator.get_mutable_context()
    if discrete:
        return
    if settings.error_control:
        integrator.set_target_accuracy(settings.accuracy)
        context.SetAccuracy(min(1e-7, 1e-2 * settings.accuracy))
    else:
        integrator.set_fixed_step_mode(True)
        context.SetAccuracy(min(1e-3, 1e-9 / settings.maximum_step * 100.0))


class _Recorder:
    """A Simulator monitor that keeps the state of every step."""

    def __init__(self, system: ImpactDiagram) -> None:
        self._diagram = system.diagram
        self._plant, self._contact = system.plant, system.impact.contact
        self._meter, self._limb = system.meter, system.limb
        self._rows: list[tuple[float, Any, Any, Any]] = []

    def __call__(self, root: Context) -> EventStatus:
        time = root.get_time()
        if len(self._rows) > MOST_STEPS:
            return EventStatus.Failed(self._diagram, f"more than {MOST_STEPS} steps")
        plant = self._plant.GetMyContextFromRoot(root)
        contact = self._contact.GetMyContextFromRoot(root)  # type: ignore[union-attr]
        totals: Any = np.full(TOTALS, math.nan)
        if self._meter is not None:
            meter = self._meter.GetMyContextFromRoot(root)
            totals = meter.get_continuous_state_vector().CopyToVector()
        if self._limb is not None and self._limb.energy is not None:
            energy = self._limb.energy.GetMyContextFromRoot(root)
            totals = np.append(totals, energy.get_continuous_state_vector().CopyToVector())
        self._rows.append(
            (
                time,
                self._plant.GetPositionsAndVelocities(plant).copy(),
                contact.get_discrete_state_vector().CopyToVector(),
                totals,
            )
        )
        return EventStatus.Succeeded()

    def arrays(self) -> tuple[NDArray[np.float64], ...]:
        """Time, plant state, contact state after events, totals.

        A monitor sees a step's end before the events of that instant: the contact state of the
        next sample is moved back to the time of its event (forces jump at touch).
        """
        time, plant, contact, totals = (
            np.array(column) for column in zip(*self._rows, strict=True)
        )
        for i in range(len(time) - 1):
            if contact[i, 0] != contact[i + 1, 0]:
                contact[i] = contact[i + 1]
        return time, plant, contact, totals
