"""The starts of a search: where they begin, how they share processes, and what each leaves."""

from __future__ import annotations

import inspect
import multiprocessing
import os
import pickle
import signal
import tempfile
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from multiprocessing.connection import wait as wait_for
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from scipy.stats import qmc

from drake_racket.identify.core.assemble import Outcome
from drake_racket.identify.core.evaluator import Evaluator
from drake_racket.identify.core.journal import Journal, journal_header
from drake_racket.identify.core.problem import Array, Problem, Scale
from drake_racket.identify.core.result import StartRecord
from drake_racket.io.errors import InputError

Report: TypeAlias = Callable[[float, float], None]
"""Called with the part done (0 to 1) and the lowest RMS so far."""

Progress: TypeAlias = Report | None

_SHOW_INTERVAL = 0.1  # s between looks at what the workers have done


@dataclass(frozen=True, kw_only=True)
class Start(ABC):
    """One start of a search: u = `point` (n,) in `Scale`'s numbers, and where its journal is."""

    problem: Problem
    number: int
    point: Array
    journal: Path | None

    @abstractmethod
    def settings(self) -> Mapping[str, Any]:
        """What its journal must agree on besides the problem."""

    @abstractmethod
    def run(self, report: Report) -> Outcome:
        """The search from here; its journal is read first and then continued."""

    def open_journal(self) -> Journal:
        """Its journal.

        Raises:
            InputError: it is another search's, is in use, or cannot be written.

        """
        point = [float(u).hex() for u in self.point]
        header = journal_header(self.problem, {**self.settings(), "start": point})
        return Journal(self.journal, header)

    def ended(self, evaluator: Evaluator, status: str, *, converged: bool) -> Outcome:
        """The outcome: the best point seen.

        Raises:
            FloatingPointError: its derivatives are not finite.

        """
        x, residuals, jacobian = evaluator.best()
        record = StartRecord(
            number=self.number,
            start=evaluator.scale.from_unit(self.point),
            estimates=x,
            cost=evaluator.best_cost,
            rms=evaluator.best_rms,
            evaluations=evaluator.evaluations,
            converged=converged,
            status=status,
            history=np.array(evaluator.history),
        )
        return Outcome(record, residuals, jacobian)

    def failed(self, evaluator: Evaluator, status: str) -> Outcome:
        """The outcome of a start that led nowhere."""
        record = StartRecord(
            number=self.number,
            start=evaluator.scale.from_unit(self.point),
            estimates=np.full(len(self.point), np.nan),
            cost=np.inf,
            rms=np.nan,
            evaluations=evaluator.evaluations,
            converged=False,
            status=status,
            history=np.array(evaluator.history).reshape(-1, 2),
        )
        return Outcome(record, np.empty(0), np.empty((0, len(self.point))))


def start_points(problem: Problem, starts: int, seed: int) -> list[Array]:
    """(n,) each: the problem's own start, and a Latin hypercube between the bounds."""
    own = np.array([p.start for p in problem.parameters], float)
    points = [Scale(problem.parameters).to_unit(own)]
    if starts > 1:
        random = {random_keyword(qmc.LatinHypercube): np.random.default_rng(seed)}
        points += list(qmc.LatinHypercube(len(own), **random).random(starts - 1))
    return points


def run_starts(tasks: Sequence[Start], workers: int, progress: Progress) -> list[Outcome]:
    """Runs them all, in this process or shared by several; the same outcomes either way.

    Raises:
        InputError: another search's journal (before any work), or a problem that does not pickle
            with several workers.

    """
    for task in tasks:
        task.open_journal().close()
    workers = min(workers, len(tasks))
    return _in_turn(tasks, progress) if workers == 1 else _shared(tasks, workers, progress)


def random_keyword(function: Callable[..., Any]) -> str:
    """How this scipy calls the generator: `rng` from 1.15 on, `seed` before."""
    return "rng" if "rng" in inspect.signature(function).parameters else "seed"


def _in_turn(tasks: Sequence[Start], progress: Progress) -> list[Outcome]:
    """The starts one after the other in this process."""
    board = _empty_board(len(tasks))

    def run(task: Start) -> Outcome:
        def report(done: float, rms: float) -> None:
            board[task.number] = done, rms
            _show(board, progress)

        outcome = task.run(report)
        board[task.number, 0] = 1.0
        _show(board, progress)
        return outcome

    return [run(task) for task in tasks]


def _shared(tasks: Sequence[Start], workers: int, progress: Progress) -> list[Outcome]:
    """The starts in worker processes, which report on a board in a mapped file."""
    try:
        pickle.dumps(tasks[0].problem)
    except (pickle.PicklingError, TypeError, AttributeError) as error:
        raise InputError(
            "workers", workers, f"1 for a problem that does not pickle ({error})"
        ) from None
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "board"
        board = np.memmap(path, np.float64, "w+", shape=(len(tasks) + 1, 2))
        board[:] = [*_empty_board(len(tasks)), [0.0, 0.0]]  # the last row stops the workers
        executor = ProcessPoolExecutor(
            workers, multiprocessing.get_context("spawn"), initializer=_prepare_worker
        )
        try:
            futures = [executor.submit(_work, task, path, len(tasks)) for task in tasks]
            waiting: set[Future[Outcome]] = set(futures)
            while waiting:
                finished, waiting = wait(waiting, _SHOW_INTERVAL, FIRST_COMPLETED)
                _show(board[:-1], progress)
                for future in finished:
                    future.result()  # a worker's error ends the fit
        finally:
            board[-1] = 1.0
            executor.shutdown(cancel_futures=True)
    return [future.result() for future in futures]


def _work(task: Start, path: Path, starts: int) -> Outcome:
    """One start in a worker."""
    board = np.memmap(path, np.float64, "r+", shape=(starts + 1, 2))

    def report(done: float, rms: float) -> None:
        board[task.number] = done, rms
        if board[-1, 0]:
            raise InterruptedError("the fit was stopped")

    outcome = task.run(report)
    board[task.number, 0] = 1.0
    return outcome


def _prepare_worker() -> None:
    """A worker ends with its parent, however that ends, and leaves Ctrl-C to it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        wait_for([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _empty_board(starts: int) -> Array:
    """(starts, 2) part done and lowest RMS."""
    return np.tile([0.0, np.inf], (starts, 1))


def _show(board: Array, progress: Progress) -> None:
    if progress is not None:
        progress(float(board[:, 0].mean()), float(board[:, 1].min()))
