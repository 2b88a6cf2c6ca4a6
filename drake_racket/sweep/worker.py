"""Does in a process, wherever it is, what the cases of a sweep need."""

from __future__ import annotations

import contextlib
import functools
import json
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from drake_racket.cases.case import Case, parse_scenario, resolve
from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.io.errors import InputError, one_line
from drake_racket.io.fingerprint import as_text, computation, difference
from drake_racket.laws.compilation import HAS_NUMBA
from drake_racket.parameters.scenario import IntegratorSettings, Scenario
from drake_racket.results.impact import ImpactResult, make_result
from drake_racket.results.outputs import Output, history_variables, read_outputs
from drake_racket.simulation import simulate
from drake_racket.sweep.identity import file_hashes

if TYPE_CHECKING:
    import xarray
    from pydrake.systems.framework import Context

    from drake_racket.engines.compiled.engine import CompiledImpact, Samples, Start

MOST_DIAGRAMS = 8
"""Diagrams that a process keeps."""

# a Diagram's systems have scratch memory of their own: the threads of a Dask worker take turns
_one_at_a_time = threading.Lock()

DataReader = Callable[[ImpactResult, ImpactDiagram], "xarray.Dataset"]
"""Makes labelled data of a run with its time history; a module's function, or one that pickles."""


class DifferentWorker(InputError):
    """The process would not compute what the sweep's own process computes."""


@dataclass(frozen=True)
class CaseSettings:
    """Holds what all cases of a sweep share.

    Attributes:
        outputs: what to read.
        computation: of the sweep's own process; see `io.fingerprint`.
        files: name -> hash of the files that cases name.
        strict: an exception in a case ends all, and is not the case's outcome.
        reader: gives the data of a case whose data are wanted; its time history if None.

    """

    outputs: tuple[Output, ...]
    computation: dict[str, str]
    files: dict[str, str]
    strict: bool = False
    reader: DataReader | None = None


@dataclass(frozen=True)
class CaseTask:
    """Holds one case to run.

    Attributes:
        case: its number.
        scenario: the case.
        builder: what the Diagram is built from, as JSON: the first case of the topology.
        data: whether the case's data are to be returned.

    """

    case: int
    scenario: Scenario
    builder: str
    settings: CaseSettings
    data: bool = False


@dataclass(frozen=True)
class CaseOutcome:
    """Holds what one case gave.

    Attributes:
        case: its number.
        values: of the outputs, in order; all NaN if it failed.
        failure: why it failed, one line; empty if it did not.
        warnings: of the run.
        seconds: that it took.
        builds: Diagrams that the process has built so far.
        data: if they were wanted, and the case did not fail.
        engine: that ran it.

    """

    case: int
    values: list[float]
    failure: str = ""
    warnings: list[str] = field(default_factory=list)
    seconds: float = 0.0
    builds: int = 0
    data: xarray.Dataset | None = None
    engine: str = ""


def failed(case: int, outputs: int, reason: str, seconds: float = 0.0) -> CaseOutcome:
    """Gives the outcome of a case that did not finish, with as many outputs."""
    return CaseOutcome(case, [math.nan] * outputs, one_line(reason), seconds=seconds)


def run_chunk(tasks: Sequence[CaseTask]) -> list[CaseOutcome]:
    """Runs some cases, in a process of a pool or of a cluster; see `each_case`."""
    return list(each_case(tasks))


def each_case(tasks: Iterable[CaseTask], threads: int = 0) -> Generator[CaseOutcome, None, None]:
    """Runs cases and yields their outcomes in order; what goes wrong in one becomes its outcome.

    Args:
        tasks: taken as there is room for them.
        threads: in which machine code runs beside this one, which reads the next cases meanwhile;
            0 for none. No outcome depends on it.

    Raises:
        DifferentWorker: this process has other code, or other files, than the sweep's own.
        Exception: any of a case's, if the settings are strict.

    """
    waiting: deque[_Running] = deque()
    contexts: dict[CompiledImpact, list[Context]] = {}
    with contextlib.ExitStack() as stack:
        pool = None
        if threads:
            pool = ThreadPoolExecutor(threads)
            stack.callback(pool.shutdown, cancel_futures=True)
        for task in tasks:
            waiting.append(_begin(task, pool, contexts))
            if len(waiting) > threads:
                yield _end(waiting.popleft(), contexts)
        while waiting:
            yield _end(waiting.popleft(), contexts)


@dataclass(frozen=True)
class _Integration:
    """A case that runs compiled: its samples are there, or will be, with the seconds they took."""

    case: Case
    model: CompiledImpact
    start: Start
    samples: Future[tuple[Samples, float]]


@dataclass
class _Running:
    """A case that has begun.

    Attributes:
        compiled: of one that runs compiled.  drake: of one that has run in Drake.
        error: what went wrong so far.
        seconds: of work so far, but for those of the samples.

    """

    task: CaseTask
    history: bool
    compiled: _Integration | None = None
    drake: ImpactResult | None = None
    error: Exception | None = None
    seconds: float = 0.0


def _begin(
    task: CaseTask, pool: Executor | None, contexts: dict[CompiledImpact, list[Context]]
) -> _Running:
    """Reads a case, and runs it, or hands its integration to the pool."""
    settings, began = task.settings, time.perf_counter()
    now = _Running(task, task.data or any(output.needs_history for output in settings.outputs))
    with _one_at_a_time:
        _check_computation(as_text(settings.computation))
        _check_files(settings.files)
        try:
            case = resolve(task.scenario)
            model = _model_for(case, task.builder)
            if model is None:
                now.drake = simulate(task.scenario, _diagram(task.builder), history=now.history)
            else:
                free = contexts.setdefault(model, [])
                start = model.start(case, free.pop() if free else model.system.create_context())
        except Exception as error:  # whatever a case does, the sweep goes on
            now.error, model = error, None
    now.seconds = time.perf_counter() - began
    if model is not None:
        now.compiled = _Integration(case, model, start, _submitted(pool, model, case, start))
    return now


def _submitted(
    pool: Executor | None, model: CompiledImpact, case: Case, start: Start
) -> Future[tuple[Samples, float]]:
    """The samples of a run and the seconds that it took, in the pool; at once if there is none."""

    def samples() -> tuple[Samples, float]:
        began = time.perf_counter()
        return model.samples(case, start), time.perf_counter() - began

    if pool is not None:
        return pool.submit(samples)
    done: Future[tuple[Samples, float]] = Future()
    try:
        done.set_result(samples())
    except Exception as error:
        done.set_exception(error)
    return done


def _end(now: _Running, contexts: dict[CompiledImpact, list[Context]]) -> CaseOutcome:
    """Gives the outcome of a case that has begun, once its samples are there."""
    task, settings, data = now.task, now.task.settings, None
    if now.compiled is not None:
        wait([now.compiled.samples])
    began = time.perf_counter()
    with _one_at_a_time:
        try:
            result = _result(now, contexts)
            values = read_outputs(result, settings.outputs)
            if task.data:
                system = _diagram(task.builder)
                data = settings.reader(result, system) if settings.reader else result.history
        except Exception as error:
            if settings.strict:
                raise
            reason = f"{type(error).__name__}: {error}"
            seconds = now.seconds + time.perf_counter() - began
            return failed(task.case, len(settings.outputs), reason, seconds)
    return CaseOutcome(
        case=task.case,
        values=values,
        warnings=result.warnings,
        seconds=now.seconds + time.perf_counter() - began,
        builds=_diagram.cache_info().misses,
        data=data,
        engine="drake" if now.compiled is None else "compiled",
    )


def _result(now: _Running, contexts: dict[CompiledImpact, list[Context]]) -> ImpactResult:
    if now.error is not None:
        raise now.error
    if now.compiled is None:
        assert now.drake is not None
        return now.drake
    case, model, start = now.compiled.case, now.compiled.model, now.compiled.start
    try:
        samples, seconds = now.compiled.samples.result()
        now.seconds += seconds
        trajectory = model.trajectory(start, samples, every_sample=now.history)
        only = None if now.task.data else history_variables(now.task.settings.outputs)
        return make_result(case, trajectory, history=now.history, only=only)
    finally:
        contexts[model].append(start.root)


def _model_for(case: Case, builder: str) -> CompiledImpact | None:
    """The compiled model for a case; None where Drake runs it."""
    scenario = case.scenario
    return _compiled(builder, scenario.engine != "auto") if may_run_compiled(scenario) else None


def may_run_compiled(scenario: Scenario) -> bool:
    """Tells whether a sweep's case runs compiled, if its plant has nothing that only Drake knows.

    Without numba the compiled engine is slower than Drake: `auto` leaves it then.
    """
    if scenario.engine == "auto":
        ours = scenario.integrator.scheme == IntegratorSettings().scheme
        return HAS_NUMBA and ours and scenario.time_step == 0.0
    return scenario.engine == "compiled"


@functools.lru_cache(maxsize=MOST_DIAGRAMS)
def _compiled(builder: str, must: bool) -> CompiledImpact | None:
    from drake_racket.engines.compiled.engine import CompiledImpact

    try:
        return CompiledImpact(_diagram(builder))
    except InputError:  # what only Drake can honour
        if must:
            raise
        return None


@functools.lru_cache(maxsize=MOST_DIAGRAMS)
def _diagram(builder: str) -> ImpactDiagram:
    return make_impact_diagram(parse_scenario(builder))


@functools.lru_cache(maxsize=8)
def _check_computation(expected: str) -> None:
    found = difference(json.loads(expected), computation())
    if found is not None:
        key, theirs, ours = found
        raise DifferentWorker(f"worker: {key}", ours, f"{theirs}, as where the sweep was started")


def _check_files(files: dict[str, str]) -> None:
    for name, expected in files.items():
        try:
            unchanged = file_hashes([name]) == {name: expected}
        except OSError as error:
            raise DifferentWorker("worker: file", Path(name), f"a file to read ({error})") from None
        if not unchanged:
            raise DifferentWorker("worker: file", Path(name), "the content it had at the start")
