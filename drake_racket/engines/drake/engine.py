"""Runs one case in Drake's Simulator and returns its trajectory."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import Context, EventStatus

from drake_racket.cases.case import Case
from drake_racket.cases.diagram import ImpactDiagram
from drake_racket.cases.effort import effort, unstable
from drake_racket.engines.drake.mechanism import Parts, mechanism_of
from drake_racket.engines.drake.observe import Observer
from drake_racket.engines.trajectory import Trajectory
from drake_racket.io.errors import InputError, SimulationError, one_line
from drake_racket.io.progress import Progress, Report
from drake_racket.laws.phases import PHASE
from drake_racket.limbs.striking import limits_are_ours
from drake_racket.parameters.scenario import IntegratorSettings, check_integrator

MOST_STEPS = 5_000_000
"""A run that takes more steps than this is stopped with an error."""

_REPORT_EVERY = 100  # steps


def run_drake(
    case: Case,
    system: ImpactDiagram,
    *,
    every_sample: bool = True,
    progress: Report | None = None,
) -> Trajectory:
    """Runs one case.

    Args:
        case: with the topology of `system`.
        system: the Diagram, as often as you like.
        every_sample: record the motion at every sample, or at the first and the last.
        progress: called as the run goes on; `done` and `total` are its milliseconds.

    Raises:
        InputError: the case needs another Diagram.
        SimulationError: the run could not be finished.

    """
    if system.limb is not None and system.limb.torques.source is None:
        raise InputError(
            "simulate: system",
            "a Diagram whose joint_torques are an input",
            "one built without export_torques (or your own Simulator)",
        )
    scenario = case.scenario
    simulator = Simulator(system.diagram, system.create_context(case))
    root = simulator.get_mutable_context()
    configure_integrator(simulator, scenario.integrator, discrete=scenario.time_step > 0.0)
    parts = Parts(system.impact, system.meter, system.grip, system.grip_load, system.limb)
    observer = Observer(parts, root)
    end = scenario.approach_time + scenario.after
    recorder = _Recorder(system, observer, every_sample, _reporter(progress, end))
    simulator.set_monitor(recorder)
    with limits_are_ours(system.limb):
        try:
            simulator.Initialize()
            simulator.AdvanceTo(end)
        except RuntimeError as error:
            reason = _why(case, error)
            stop = f"stopped at t = {root.get_time():.6g} s: {reason}"
            raise SimulationError(stop) from error
        finally:
            recorder.stop()
        steps = simulator.get_num_steps_taken()
        evaluations = simulator.get_integrator().get_num_derivative_evaluations()
        states, moving = recorder.rows()
    times, contact, plant, record, element, totals = observer.states(states)
    if not np.isfinite(plant).all():
        raise SimulationError(f"stopped at t = {times[-1]:.6g} s: {_why(case, None)}")
    samples = list(moving)
    return Trajectory(
        mechanism=mechanism_of(parts, root, (plant[0], plant[-1])),
        time=times,
        state=plant,
        record=record,
        contact=contact,
        totals=totals,
        motion=observer.motion(samples, list(moving.values()), plant[samples]),
        steps=steps,
        evaluations=evaluations,
        element=element,
    )


def _why(case: Case, error: RuntimeError | None) -> str:
    """Why a run stopped, in words: a step that grows beyond all bounds ends in odd places."""
    scenario = case.scenario
    if scenario.time_step > 0.0 or not scenario.integrator.error_control:
        return f"unstable: shorter step ({unstable(case) or 'the motion grows without bounds'})"
    reason = "" if error is None else one_line(str(error).splitlines()[0], 300)
    if "step size" in reason or "minimum" in reason:
        fastest = effort(case).fastest
        return (
            f"the error cannot be controlled: the fastest motion is {fastest.value:.2g} rad/s,"
            f" from {fastest.cause} ({reason})"
        )
    return reason or "a state that is not finite"


def _reporter(progress: Report | None, end: float) -> Callable[[float], None]:
    if progress is None:
        return lambda _: None
    began = time.monotonic()

    def report(now: float) -> None:
        seconds = time.monotonic() - began
        progress(Progress("simulating", 1e3 * now, 1e3 * end, seconds=seconds))

    return report


def configure_integrator(
    simulator: Any, settings: IntegratorSettings, *, discrete: bool = False
) -> None:
    """Gives a Simulator the settings, and events isolated well within its accuracy.

    Drake isolates a witness's zero to 0.01 x accuracy x 1 s with error control, and to 0.01 x
    accuracy x step without: touch and release are placed within a nanosecond or better.

    Args:
        simulator: of any Diagram.
        settings: of the integrator.
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
    """A Simulator monitor that keeps every step, and how the bodies move where the next begins."""

    def __init__(
        self,
        system: ImpactDiagram,
        observer: Observer,
        every_sample: bool,
        report: Callable[[float], None],
    ) -> None:
        self._report = report
        self._diagram, self._observer, self._every = system.diagram, observer, every_sample
        self._probe, self._discrete = system.probe, system.plant.time_step() > 0.0
        self._states: list[NDArray[np.float64]] = []
        self._moving: dict[int, NDArray[np.float64]] = {}

    def __call__(self, root: Context) -> EventStatus:
        sample = len(self._states)
        if sample > MOST_STEPS:
            return EventStatus.Failed(self._diagram, f"more than {MOST_STEPS} steps")
        self._states.append(self._observer.state(in_full=self._every))
        if sample % _REPORT_EVERY == 0:
            self._report(root.get_time())
        if self._every and not self._discrete and self._probe is not None:
            self._probe.wanted, self._probe.read = root.get_time(), self._see_last
        return EventStatus.Succeeded()

    def _see(self, sample: int) -> None:
        self._moving[sample] = self._observer.moving()

    def _see_last(self) -> None:
        self._see(len(self._states) - 1)

    def stop(self) -> None:
        """Ends the probe's work: the Diagram may be used again."""
        if self._probe is not None:
            self._probe.wanted, self._probe.read = math.nan, None

    def rows(self) -> tuple[NDArray[np.float64], dict[int, NDArray[np.float64]]]:
        """The samples, and the motion by the number of its sample.

        A monitor sees a step's end before the events of that instant: the record of the next sample
        is moved back to the time of its event (forces jump at touch), and what was seen there is
        seen again. A discrete plant's samples are brought to one instant each, and seen then.
        """
        table, last = np.array(self._states), len(self._states) - 1
        after = self._observer.ahead() if self._discrete else None
        record = self._observer.states(table)[3]
        moved = np.flatnonzero(record[:-1, PHASE] != record[1:, PHASE])
        wanted = set(range(last + 1)) if self._every else {0, last}
        record[moved] = record[moved + 1]
        for i in sorted({*moved.tolist()} | (wanted - set(self._moving))):
            self._observer.set_state(table[i])
            table[i] = self._observer.state()
            if i in wanted and after is None:
                self._see(i)
        if after is not None:
            self._observer.bring_to_time(table, after)
            for i in wanted:
                self._observer.set_state(table[i])
                self._see(i)
        return table, dict(sorted(self._moving.items()))
