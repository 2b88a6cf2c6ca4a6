"""Least squares by exact derivatives from several starts (scipy's trust region within bounds)."""

from __future__ import annotations

import inspect
import multiprocessing
import os
import pickle
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from multiprocessing.connection import wait as wait_for
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from scipy import optimize
from scipy.stats import qmc

from drake_racket.errors import InputError
from drake_racket.identify.assemble import Outcome, make_result
from drake_racket.identify.evaluator import Evaluator
from drake_racket.identify.journal import Journal, journal_header, prepare_directory
from drake_racket.identify.problem import Array, Problem, Scale, check_count, check_problem
from drake_racket.identify.result import FitResult, StartRecord

Progress: TypeAlias = Callable[[float, float], None] | None

_SHOW_INTERVAL = 0.1  # s between looks at what the workers have done


def fit(
    problem: Problem,
    *,
    starts: int = 8,
    seed: int = 0,
    workers: int = 1,
    journal: Path | None = None,
    progress: Progress = None,
    tolerance: float = 1e-12,
    max_evaluations: int = 200,
    rescale_sigma: bool = False,
) -> FitResult:
    """Estimates the parameters by least squares, each residual over its sigma where known.

    The search is in `Scale`'s numbers: the way between the bounds, logarithmic where the bounds
    are positive and more than a factor 10 apart. The first start is the problem's own, the others
    are a Latin hypercube between the bounds. The result is the same, bit for bit, for any number
    of workers, and for a run that was killed and started again with the same journal.

    Args:
        workers: processes that share the starts (started by spawn: a script needs the usual
            `if __name__ == "__main__":`).
        journal: directory that keeps the evaluations, one file per start.
        progress: called with the part done (0 to 1) and the lowest RMS so far.
        tolerance: relative change of the sum of squares, or of the parameters, at which a start
            stops.
        max_evaluations: of the residuals, per start.
        rescale_sigma: take the problem's sigma as relative, and scale it by the residuals.

    Raises:
        InputError: a problem that cannot be fitted, bad options, or another fit's journal.

    """
    began = time.monotonic()
    check_problem(problem)
    for key, value, least in (("starts", starts, 1), ("seed", seed, 0), ("workers", workers, 1)):
        check_count(key, value, least)
    check_count("max_evaluations", max_evaluations, 1)
    if not 1e-15 <= tolerance < 1.0:
        raise InputError("tolerance", tolerance, "from 1e-15 to below 1")
    prepare_directory(journal)
    tasks = [
        Start(
            problem=problem,
            number=number,
            point=point,
            tolerance=tolerance,
            max_evaluations=max_evaluations,
            journal=None if journal is None else journal / f"start_{number:02d}.journal",
        )
        for number, point in enumerate(_start_points(problem, starts, seed))
    ]
    for task in tasks:  # refuse another fit's journal before any work
        if task.journal is not None:
            Journal(task.journal, task.header()).close()
    if min(workers, starts) == 1:
        outcomes = _in_turn(tasks, progress)
    else:
        outcomes = _shared(tasks, min(workers, starts), progress)
    return make_result(
        problem,
        outcomes,
        method="least squares",
        seed=seed,
        seconds=time.monotonic() - began,
        rescale=rescale_sigma,
    )


@dataclass(frozen=True)
class Start:
    """One start: u = `point` (n,), and where its journal is."""

    problem: Problem
    number: int
    point: Array
    tolerance: float
    max_evaluations: int
    journal: Path | None

    def header(self) -> dict[str, Any]:
        """What its journal must say."""
        point = [float(u).hex() for u in self.point]
        settings = {"method": "least squares", "start": point, "tolerance": self.tolerance}
        return journal_header(self.problem, settings)


def run_start(start: Start, report: Callable[[int, float], None]) -> Outcome:
    """Least squares from one start; its journal is read first and then continued."""
    with Journal(start.journal, start.header()) as journal:
        evaluator = Evaluator(start.problem, journal, report)
        begin = evaluator.scale.from_unit(start.point)

        def checked(u: Array) -> Array:
            found = evaluator.residuals(u)
            if evaluator.evaluations == 1 and not np.isfinite(found).all():
                raise FloatingPointError("the model has no solution there")
            return found

        try:
            found = optimize.least_squares(
                checked,
                start.point,
                jac=evaluator.jacobian,
                bounds=(0.0, 1.0),
                method="trf",
                x_scale="jac",
                ftol=start.tolerance,
                xtol=start.tolerance,
                gtol=None,  # absolute, so a matter of units
                max_nfev=start.max_evaluations,
            )
            x, residuals, jacobian = evaluator.best()
        except FloatingPointError as error:
            return _failed(start, begin, evaluator, str(error))
    record = StartRecord(
        number=start.number,
        start=begin,
        estimates=x,
        cost=evaluator.best_cost,
        rms=evaluator.best_rms,
        evaluations=evaluator.evaluations,
        converged=found.status > 0,
        status=str(found.message),
        history=np.array(evaluator.history),
    )
    return Outcome(record, residuals, jacobian)


def _failed(start: Start, begin: Array, evaluator: Evaluator, status: str) -> Outcome:
    """The outcome of a start that led nowhere."""
    nothing = np.full(len(begin), np.nan)
    record = StartRecord(
        number=start.number,
        start=begin,
        estimates=nothing,
        cost=np.inf,
        rms=np.nan,
        evaluations=evaluator.evaluations,
        converged=False,
        status=status,
        history=np.array(evaluator.history).reshape(-1, 2),
    )
    return Outcome(record, np.empty(0), np.empty((0, len(begin))))


def _start_points(problem: Problem, starts: int, seed: int) -> list[Array]:
    """The starts as u, (n,) each."""
    own = np.array([p.start for p in problem.parameters], float)
    points = [Scale(problem.parameters).to_unit(own)]
    if starts > 1:
        random = {random_keyword(qmc.LatinHypercube): np.random.default_rng(seed)}
        points += list(qmc.LatinHypercube(len(own), **random).random(starts - 1))
    return points


def random_keyword(function: Callable[..., Any]) -> str:
    """How this scipy calls the generator: `rng` from 1.15 on, `seed` before."""
    return "rng" if "rng" in inspect.signature(function).parameters else "seed"


def _in_turn(tasks: Sequence[Start], progress: Progress) -> list[Outcome]:
    """The starts one after the other in this process."""
    board = _empty_board(len(tasks))

    def run(task: Start) -> Outcome:
        def report(count: int, rms: float) -> None:
            board[task.number] = count / task.max_evaluations, rms
            _show(board, progress)

        outcome = run_start(task, report)
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

    def report(count: int, rms: float) -> None:
        board[task.number] = count / task.max_evaluations, rms
        if board[-1, 0]:
            raise InterruptedError("the fit was stopped")

    outcome = run_start(task, report)
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
