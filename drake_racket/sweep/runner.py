"""Runs cases in this process, in processes of this machine, or on a Dask cluster.

Sweeps, rigs and studies all run here. A case is computed from its scenario and the Diagram of its
topology, which is built from the first case of that topology: results depend on nothing else.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import time
from collections.abc import Generator, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from drake_racket.io.fingerprint import as_text, computation
from drake_racket.laws.compilation import HAS_NUMBA
from drake_racket.pool import run_in_processes
from drake_racket.sweep.cases import CasePlan
from drake_racket.sweep.chunks import Chunks
from drake_racket.sweep.cluster import run_on_cluster
from drake_racket.sweep.spec import Sweep
from drake_racket.sweep.worker import (
    CaseOutcome,
    CaseSettings,
    CaseTask,
    DataReader,
    each_case,
    failed,
    run_chunk,
)

if TYPE_CHECKING:
    import distributed

MOST_BUILDS = 60
"""Diagrams after which a process is replaced: on Drake 1.51 they are not freed (0.5 MB each)."""

TOGETHER = 0.5
"""Seconds of work whose outcomes come together: each batch is written to the disk before the next,
and what a killed process had not handed over runs again."""

MOST_THREADS = 8
"""For machine code beside the thread that reads cases, which keeps no more than a few busy."""

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
    """Runs cases in this process: what is finished comes after each `TOGETHER` seconds."""
    finished: list[CaseOutcome] = []
    since = time.monotonic()
    with contextlib.closing(each_case(tasks, _threads())) as outcomes:
        try:
            for outcome in outcomes:
                finished.append(outcome)
                if time.monotonic() - since > TOGETHER:
                    yield finished
                    finished, since = [], time.monotonic()
        except (Exception, KeyboardInterrupt):
            if finished:  # what is finished is kept, whatever ends the rest
                yield finished
            raise
    if finished:
        yield finished


def _threads() -> int:
    """Threads for machine code; one processor is left to what reads the cases."""
    if not HAS_NUMBA:
        return 0
    ours = hasattr(os, "sched_getaffinity")  # on Linux; others do not bind processes
    processors = len(os.sched_getaffinity(0)) if ours else os.cpu_count() or 1
    return max(1, min(MOST_THREADS, processors - 1))


def _run_in_pool(tasks: Iterable[CaseTask], workers: int, strict: bool) -> Outcomes:
    chunks = Chunks(tasks, TOGETHER)
    batches = run_in_processes(
        run_chunk, chunks, workers, died=None if strict else _died, split=_singles, worn=_is_worn
    )
    try:
        for batch in batches:
            outcomes = [outcome for _, found in batch for outcome in found]
            chunks.learn(outcomes)
            yield outcomes
    finally:
        batches.close()


def _singles(chunk: list[CaseTask]) -> list[list[CaseTask]]:
    return [[task] for task in chunk]


def _died(chunk: list[CaseTask], reason: str) -> list[CaseOutcome]:
    return [failed(task.case, len(task.settings.outputs), reason) for task in chunk]


def _is_worn(outcomes: list[CaseOutcome]) -> bool:
    return any(outcome.builds >= MOST_BUILDS for outcome in outcomes)
