"""What a process does with one case of a sweep, wherever the process is."""

from __future__ import annotations

import functools
import json
import math
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_racket.cases.case import parse_scenario
from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.engines.drake.engine import SimulationError
from drake_racket.io.errors import InputError, one_line
from drake_racket.io.fingerprint import environment
from drake_racket.parameters.scenario import Scenario
from drake_racket.simulation import simulate
from drake_racket.sweep.identity import as_text, difference, file_hashes
from drake_racket.sweep.outputs import OUTPUTS, read_outputs

if TYPE_CHECKING:
    import xarray

MOST_DIAGRAMS = 8
"""Diagrams that a process keeps."""

# a Diagram's systems have scratch memory of their own: the threads of a Dask worker take turns
_one_at_a_time = threading.Lock()


class SweepStopped(SimulationError):
    """A sweep that cannot go on, for a reason that lies in no case."""


class DifferentWorker(InputError):
    """A process that would not compute what the sweep's own process computes."""

    def __reduce__(self) -> Any:
        """It travels between processes."""
        return type(self), (self.key, self.value, self.allowed)


@dataclass(frozen=True)
class Settings:
    """What all cases of a sweep share.

    Attributes:
        outputs: names of what to read.
        environment: of the sweep's own process; see `environment`.
        files: name -> hash of the files that cases name.

    """

    outputs: tuple[str, ...]
    environment: dict[str, str]
    files: dict[str, str]


@dataclass(frozen=True)
class Task:
    """One case to run.

    Attributes:
        case: its number.
        scenario: the case.
        builder: what the Diagram is built from, as JSON: the first case of the topology.
        history: whether the time history is to be returned.

    """

    case: int
    scenario: Scenario
    builder: str
    settings: Settings
    history: bool = False


@dataclass(frozen=True)
class Outcome:
    """What one case gave.

    Attributes:
        case: its number.
        values: of the outputs, in order; all NaN if it failed.
        failure: why it failed, one line; empty if it did not.
        warnings: of the run.
        seconds: that it took.
        builds: Diagrams that the process has built so far.
        history: if it was wanted, and the case did not fail.

    """

    case: int
    values: list[float]
    failure: str = ""
    warnings: list[str] = field(default_factory=list)
    seconds: float = 0.0
    builds: int = 0
    history: xarray.Dataset | None = None


def failed(case: int, outputs: tuple[str, ...], reason: str, seconds: float = 0.0) -> Outcome:
    """The outcome of a case that did not finish."""
    return Outcome(case, [math.nan] * len(outputs), one_line(reason), seconds=seconds)


def run_case(task: Task) -> Outcome:
    """Runs one case; what goes wrong in it becomes its outcome.

    Raises:
        DifferentWorker: this process has other code, or other files, than the sweep's own.

    """
    with _one_at_a_time:
        _check_environment(as_text(task.settings.environment))
        _check_files(task.settings.files)
        start = time.perf_counter()
        names = task.settings.outputs
        history = task.history or any(OUTPUTS[name].needs_history for name in names)
        try:
            result = simulate(task.scenario, _diagram(task.builder), history=history)
            values = read_outputs(result, names)
        except Exception as error:  # whatever a case does, the sweep goes on
            reason = f"{type(error).__name__}: {error}"
            return failed(task.case, names, reason, time.perf_counter() - start)
        return Outcome(
            case=task.case,
            values=values,
            warnings=result.warnings,
            seconds=time.perf_counter() - start,
            builds=_diagram.cache_info().misses,
            history=result.history if task.history else None,
        )


@functools.lru_cache(maxsize=MOST_DIAGRAMS)
def _diagram(builder: str) -> ImpactDiagram:
    return make_impact_diagram(parse_scenario(builder))


@functools.lru_cache(maxsize=8)
def _check_environment(expected: str) -> None:
    found = difference(json.loads(expected), environment())
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
