"""Where the cases run: in this process, in processes of this machine, or on a Dask cluster.

Each is a generator: it takes tasks as it has room for them, and yields outcomes in batches as they
come, in any order. Closing it stops what is under way.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from drake_racket.sweep.worker import Outcome, SweepStopped, Task, failed, run_case

T = TypeVar("T")

MOST_DEATHS = 3
"""A case that ran alone in a pool when a process died, this often, is a failed case."""

_SUSPECT = 2  # deaths that a case has met, alone or not, after which it runs alone

MOST_BUILDS = 60
"""Diagrams after which a process is replaced: on Drake 1.51 they are not freed (0.5 MB each)."""


def run_here(tasks: Iterable[Task]) -> Generator[list[Outcome], None, None]:
    """Runs the cases in this process, one by one."""
    for task in tasks:
        yield [run_case(task)]


def run_in_processes(tasks: Iterable[Task], workers: int) -> Generator[list[Outcome], None, None]:
    """Runs the cases in `workers` processes of this machine.

    A process that dies (the pool breaks with it) is replaced, and what was under way runs again. A
    case that has met two deaths runs alone, so that further ones are known to be its own.
    """
    pool = _Pool(tasks, workers)
    try:
        while True:
            pool.fill()
            if not pool.running:
                return
            batch = pool.collect()
            if batch:
                yield batch
    finally:
        pool.stop()


class _Pool:
    """A process pool that survives its processes."""

    def __init__(self, tasks: Iterable[Task], workers: int) -> None:
        self.running: dict[Future[Outcome], Task] = {}
        self._tasks = iter(tasks)
        self._workers = workers
        self._again: deque[Task] = deque()
        self._deaths: Counter[int] = Counter()
        self._bad_starts = 0
        self._worn = False
        self._start()

    def _start(self) -> None:
        # spawned: a fork would share Drake's state with threads of the parent
        context = multiprocessing.get_context("spawn")
        self._processes: set[BaseProcess] = set()
        self._executor = ProcessPoolExecutor(self._workers, context, initializer=_end_with_parent)
        self._up = self._submit(os.getpid)  # tells a death in a case from one at the start

    def _submit(self, call: Callable[..., T], *arguments: Any) -> Future[T]:
        others = set(multiprocessing.active_children()) - self._processes
        # a Ctrl-C is the parent's to handle: processes started here never see it
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return self._executor.submit(call, *arguments)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            self._processes = set(multiprocessing.active_children()) - others

    def fill(self) -> None:
        """Hands out cases: two for each process, or one that must be alone."""
        if self._worn and not self.running:
            self._executor.shutdown()
            self._worn = False
            self._start()
        while not self._worn and len(self.running) < 2 * self._workers:
            if self._alone(self.running.values()):
                return
            task = self._again.popleft() if self._again else next(self._tasks, None)
            if task is None:
                return
            if self.running and self._alone([task]):
                self._again.appendleft(task)
                return
            try:
                self.running[self._submit(run_case, task)] = task
            except BrokenProcessPool:
                self._again.appendleft(task)
                if not self.running:
                    self._replace()
                return

    def _alone(self, tasks: Iterable[Task]) -> bool:
        return any(self._deaths[task.case] >= _SUSPECT for task in tasks)

    def collect(self) -> list[Outcome]:
        """Waits for outcomes; after a death, for all that is under way."""
        done, _ = wait(self.running, return_when=FIRST_COMPLETED)
        if any(isinstance(future.exception(), BrokenProcessPool) for future in done):
            done, _ = wait(self.running)
        batch, met = [], []
        for future in done:
            task = self.running.pop(future)
            if isinstance(future.exception(), BrokenProcessPool):
                met.append(task)
            else:
                batch.append(future.result())
        self._worn |= any(outcome.builds >= MOST_BUILDS for outcome in batch)
        if met:
            batch += self._blame(met) if self._is_up() else self._take_back(met)
            self._replace()
        return batch

    def _is_up(self) -> bool:
        return self._up.done() and self._up.exception() is None

    def _take_back(self, tasks: Iterable[Task]) -> list[Outcome]:
        self._again.extend(tasks)
        return []

    def _blame(self, tasks: Iterable[Task]) -> list[Outcome]:
        """Cases during which a process died: one that was alone too often has failed."""
        reason = f"its process died {MOST_DEATHS} times (killed, or out of memory)"
        batch = []
        for task in tasks:
            self._deaths[task.case] += 1
            if self._deaths[task.case] >= _SUSPECT + MOST_DEATHS:  # the later ones were alone
                batch.append(failed(task.case, task.settings.outputs, reason))
            else:
                self._again.append(task)
        return batch

    def _replace(self) -> None:
        """A new pool for a broken one."""
        self._bad_starts = 0 if self._is_up() else self._bad_starts + 1
        if self._bad_starts >= MOST_DEATHS:
            raise SweepStopped(
                "processes die as they start (a script needs `if __name__ == '__main__':`)"
            )
        self._executor.shutdown()
        self._start()

    def stop(self) -> None:
        """Ends the processes, whatever they are at."""
        self._executor.shutdown(wait=False, cancel_futures=True)
        if self.running:
            for process in self._processes:
                process.terminate()


def _end_with_parent() -> None:
    """A process of a parent that was killed would wait for ever: it ends with the parent."""

    def watch() -> None:
        parent = multiprocessing.parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
