"""Runs cases in this process, in processes of this machine, or on a Dask cluster.

Sweeps, rigs and studies all run here. A case is computed from its scenario and the Diagram of its
topology, which is built from the first case of that topology: results depend on nothing else.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Generator, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from drake_racket.io.fingerprint import as_text, computation
from drake_racket.pool import run_in_processes
from drake_racket.sweep.cases import CasePlan
from drake_racket.sweep.cluster import run_on_cluster
from drake_racket.sweep.spec import Sweep
from drake_racket.sweep.worker import (
    CaseOutcome,
    CaseSettings,
    CaseTask,
    DataReader,
    failed,
    run_case,
)

if TYPE_CHECKING:
    import distributed

MOST_BUILDS = 60
"""Diagrams after which a process is replaced: on Drake 1.51 they are not freed (0.5 MB each)."""

Outcomes = Generator[list[CaseOutcome], None, None]


def run_cases(
    sweep: Sweep,
    plan: CasePlan,
    cases: Sequence[int],
    *,
    workers: int = 1,
    client: distributed.Client | None = None,
    strict: bool = False,
    reader: DataReader | None = None,
) -> Outcomes:
    """Runs cases of a sweep and yields their outcomes as they come, in any order.

    Args:
        plan: of the sweep; see `make_plan`.
        cases: numbers of valid cases, best in the plan's order.
        workers: processes of this machine; 1 works in this one, unless the sweep needs more than
            MOST_BUILDS Diagrams: then in one spawned process at a time.
        client: of a Dask cluster, instead of own processes; it stays open.
        strict: an exception in a case is raised here and ends all.
        reader: gives the data of the cases in `sweep.histories`; their time histories if None.

    Yields:
        Outcomes in batches.

    Raises:
        PoolError: processes cannot be started; in a strict run also when they die in a case.
        ClusterLost: the Dask scheduler went away.

    """
    settings = CaseSettings(sweep.outputs, computation(), plan.files, strict, reader)
    tasks = _tasks(sweep, plan, cases, settings)
    if client is not None:
        return run_on_cluster(tasks, client)
    if workers == 1 and len(plan.builders) <= MOST_BUILDS:
        return _run_here(tasks)
    return _run_in_pool(tasks, workers, strict)


def _tasks(
    sweep: Sweep, plan: CasePlan, cases: Sequence[int], settings: CaseSettings
) -> Iterator[CaseTask]:
    builders = [as_text(dataclasses.asdict(builder)) for builder in plan.builders]
    for case in cases:
        builder = builders[plan.group[case]]
        yield CaseTask(case, sweep.scenario(case), builder, settings, case in sweep.histories)


def _run_here(tasks: Iterable[CaseTask]) -> Outcomes:
    for task in tasks:
        yield [run_case(task)]


def _run_in_pool(tasks: Iterable[CaseTask], workers: int, strict: bool) -> Outcomes:
    batches = run_in_processes(
        run_case, tasks, workers, died=None if strict else _died, worn=_is_worn
    )
    try:
        for batch in batches:
            yield [outcome for _, outcome in batch]
    finally:
        batches.close()


def _died(task: CaseTask, reason: str) -> CaseOutcome:
    return failed(task.case, len(task.settings.outputs), reason)


def _is_worn(outcome: CaseOutcome) -> bool:
    return outcome.builds >= MOST_BUILDS
