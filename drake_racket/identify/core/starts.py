"""Runs the starts of a search: where they begin, how they share processes, what each leaves."""

from __future__ import annotations

import contextlib
import inspect
import pickle
import tempfile
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from scipy.stats import qmc

from drake_racket.identify.core.assemble import StartOutcome, make_result
from drake_racket.identify.core.checkpoint import (
    Checkpoint,
    checkpoint_header,
    prepare_directory,
)
from drake_racket.identify.core.evaluator import Evaluator
from drake_racket.identify.core.problem import (
    Array,
    Problem,
    Scale,
    check_count,
    check_problem,
)
from drake_racket.identify.core.result import FitResult, StartRecord
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Progress, Report
from drake_racket.pool import leave_if_imported_again, run_in_processes

Tell: TypeAlias = Callable[[float, float], None]
"""What a start calls with the part of it that is done (0 to 1) and the lowest RMS so far."""

_SHOW_INTERVAL = 0.1  # s between looks at what the workers have done


@dataclass(frozen=True, kw_only=True)
class Start(ABC):
    """One start of a search: u = `point` (n,) in `Scale`'s numbers, and where its checkpoint is."""

    problem: Problem
    number: int
    point: Array
    checkpoint: Path | None

    @abstractmethod
    def settings(self) -> Mapping[str, Any]:
        """What its checkpoint must agree on besides the problem."""

    @abstractmethod
    def run(self, report: Tell) -> StartOutcome:
        """The search from here; its checkpoint is read first and then continued."""

    def open_checkpoint(self) -> Checkpoint:
        """Its checkpoint.

        Raises:
            InputError: it is another search's, is in use, or cannot be written.

        """
        point = [float(u).hex() for u in self.point]
        header = checkpoint_header(self.problem, {**self.settings(), "start": point})
        return Checkpoint(self.checkpoint, header)

    def ended(self, evaluator: Evaluator, status: str, *, converged: bool) -> StartOutcome:
        """Gives the outcome: the best point seen.

        Raises:
            FloatingPointError: its derivatives are not finite.

        """
        x, residuals, jacobian = evaluator.best()
        best = x, evaluator.best_cost, evaluator.best_rms
        return StartOutcome(self._record(evaluator, best, status, converged), residuals, jacobian)

    def failed(self, evaluator: Evaluator, status: str) -> StartOutcome:
        """Gives the outcome of a start that led nowhere."""
        nowhere = np.full(len(self.point), np.nan), np.inf, np.nan
        record = self._record(evaluator, nowhere, status, False)
        return StartOutcome(record, np.empty(0), np.empty((0, len(self.point))))

    def _record(
        self, evaluator: Evaluator, end: tuple[Array, float, float], status: str, converged: bool
    ) -> StartRecord:
        x, cost, rms = end
        return StartRecord(
            number=self.number,
            start=evaluator.scale.from_unit(self.point),
            estimates=x,
            cost=cost,
            rms=rms,
            evaluations=evaluator.evaluations,
            converged=converged,
            status=status,
            history=np.array(evaluator.history).reshape(-1, 2),
        )


@dataclass(frozen=True)
class Starts:
    """Says how many starts a search has, where they begin, and who runs them; see `fit`."""

    count: int
    seed: int
    workers: int
    checkpoint: Path | None
    progress: Report | None
    rescale_sigma: bool

    def run(
        self, problem: Problem, kind: Callable[..., Start], method: str, file: str
    ) -> FitResult:
        """Runs all starts; the result is that of the best.

        Args:
            kind: makes a start of problem, number, point and checkpoint.
            method: in words.
            file: how the names of the starts' checkpoints begin.

        Raises:
            InputError: a problem that cannot be fitted, bad options, or another run's checkpoint.

        """
        began, place = time.monotonic(), self.checkpoint
        check_problem(problem)
        check_count("starts", self.count, 1)
        check_count("seed", self.seed, 0)
        check_count("workers", self.workers, 1)
        prepare_directory(place)
        tasks = [
            kind(
                problem=problem,
                number=number,
                point=point,
                checkpoint=None if place is None else place / f"{file}_{number:02d}.sqlite",
            )
            for number, point in enumerate(start_points(problem, self.count, self.seed))
        ]
        outcomes = run_starts(tasks, self.workers, self.progress)
        seconds = time.monotonic() - began
        return make_result(
            problem,
            outcomes,
            method=method,
            seed=self.seed,
            seconds=seconds,
            rescale=self.rescale_sigma,
        )


def start_points(problem: Problem, starts: int, seed: int) -> list[Array]:
    """Gives (n,) each: the problem's own start, and a Latin hypercube between the bounds."""
    own = np.array([p.start for p in problem.parameters], float)
    points = [Scale(problem.parameters).to_unit(own)]
    if starts > 1:
        random = {random_keyword(qmc.LatinHypercube): np.random.default_rng(seed)}
        points += list(qmc.LatinHypercube(len(own), **random).random(starts - 1))
    return points


def run_starts(tasks: Sequence[Start], workers: int, progress: Report | None) -> list[StartOutcome]:
    """Runs them all, in this process or shared by several; the same outcomes either way.

    Raises:
        InputError: another search's checkpoint (before any work), or a problem that does not pickle
            with several workers.
        PoolError: processes cannot be started, or die again and again in one start.

    """
    leave_if_imported_again()
    for task in tasks:
        task.open_checkpoint().close()
    workers = min(workers, len(tasks))
    board = _Board(np.tile([0.0, np.inf], (len(tasks), 1)), progress)
    return _in_turn(tasks, board) if workers == 1 else _shared(tasks, workers, board)


def random_keyword(function: Callable[..., Any]) -> str:
    """Tells how this scipy calls the generator: `rng` from 1.15 on, `seed` before."""
    return "rng" if "rng" in inspect.signature(function).parameters else "seed"


@dataclass
class _Board:
    """Part done and lowest RMS of each start, (starts, 2), and who is told of it."""

    rows: Array
    progress: Report | None

    def __post_init__(self) -> None:
        self._began = time.monotonic()

    def show(self) -> None:
        """Tells how far all of them are."""
        if self.progress is not None:
            done, rms = float(self.rows[:, 0].mean()), float(self.rows[:, 1].min())
            seconds = time.monotonic() - self._began
            self.progress(Progress("fitting", done, 1.0, seconds=seconds, rms=rms))


def _in_turn(tasks: Sequence[Start], board: _Board) -> list[StartOutcome]:
    """The starts one after the other in this process."""

    def run(task: Start) -> StartOutcome:
        def report(done: float, rms: float) -> None:
            board.rows[task.number] = done, rms
            board.show()

        outcome = task.run(report)
        board.rows[task.number, 0] = 1.0
        board.show()
        return outcome

    return [run(task) for task in tasks]


def _shared(tasks: Sequence[Start], workers: int, board: _Board) -> list[StartOutcome]:
    """The starts in worker processes, which report on a board in a mapped file."""
    try:
        pickle.dumps(tasks[0].problem)
    except (pickle.PicklingError, TypeError, AttributeError) as error:
        raise InputError(
            "workers", workers, f"1 for a problem that does not pickle ({error})"
        ) from None
    found: dict[int, StartOutcome] = {}
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "board"
        rows = np.memmap(path, np.float64, "w+", shape=board.rows.shape)
        rows[:] = board.rows
        board.rows = rows
        work = [_Work(task, path, len(tasks)) for task in tasks]
        batches = run_in_processes(_work, work, workers, every=_SHOW_INTERVAL)
        with contextlib.closing(batches):
            for batch in batches:
                found |= {one.task.number: outcome for one, outcome in batch}
                board.show()
    return [found[task.number] for task in tasks]


@dataclass(frozen=True)
class _Work:
    """One start for a worker, and where it reports."""

    task: Start
    board: Path
    starts: int


def _work(work: _Work) -> StartOutcome:
    """One start in a worker."""
    board = np.memmap(work.board, np.float64, "r+", shape=(work.starts, 2))
    number = work.task.number

    def report(done: float, rms: float) -> None:
        board[number] = done, rms

    outcome = work.task.run(report)
    board[number, 0] = 1.0
    return outcome
