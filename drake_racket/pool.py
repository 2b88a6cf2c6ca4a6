"""Shares work among processes of this machine, and survives the death of any of them.

Sweeps, rigs, fits and studies all come here. Processes are spawned: a fork would share Drake's
state with threads of the parent. So a script needs `if __name__ == "__main__":` around what it
runs, as always where Python spawns processes; one without ends at once, and is told so.
"""

from __future__ import annotations

import contextlib
import itertools
import multiprocessing
import os
import signal
import sys
import threading
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.process import BaseProcess
from typing import Any, Generic, TypeVar

from drake_racket.io.errors import InputError, WorkStopped

T = TypeVar("T")
R = TypeVar("R")

MOST_WORKERS = 256

MOST_DEATHS = 3
"""A task that ran alone in a pool when a process died, this often, is given up."""

_SUSPECT = 2  # deaths that a task has met, alone or not, after which it runs alone
_MAIN_AGAIN = 86  # exit status of a process that was to run the whole script anew


class PoolError(WorkStopped):
    """The error says why processes cannot do their work, in one line."""


def check_workers(workers: int, key: str = "workers") -> None:
    """Raises InputError unless `workers` is 1 to MOST_WORKERS."""
    whole = isinstance(workers, int) and not isinstance(workers, bool)
    if not whole or not 1 <= workers <= MOST_WORKERS:
        raise InputError(key, workers, f"1 to {MOST_WORKERS} processes")


def leave_if_imported_again() -> None:
    """Ends a process of a pool in which a script without main guard does everything once more.

    Long work calls this first, before it reads, locks or writes anything.
    """
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        os._exit(_MAIN_AGAIN)


def run_in_processes(
    call: Callable[[T], R],
    tasks: Iterable[T],
    workers: int,
    *,
    died: Callable[[T, str], R] | None = None,
    split: Callable[[T], list[T]] | None = None,
    worn: Callable[[R], bool] | None = None,
    every: float | None = None,
) -> Generator[list[tuple[T, R]], None, None]:
    """Calls a function for each task in processes of this machine.

    A process that dies (the pool breaks with it) is replaced, and what was under way runs again. A
    task that has met two deaths runs alone, so that further ones are known to be its own. What a
    call raises is raised here and ends the rest, as closing the generator does.

    Args:
        call: of a module; it, the tasks and what it returns travel between processes.
        tasks: taken as there is room for them.
        workers: processes.
        died: gives the result of a task that cost MOST_DEATHS processes; PoolError if None.
        split: takes a task that has met two deaths apart: its parts run alone in its place, so that
            the others of them do not pay for one.
        worn: tells from a result that its process is to be replaced soon.
        every: seconds after which an empty batch is yielded if nothing has finished.

    Yields:
        Tasks with their results, in batches as they come, in any order.

    Raises:
        PoolError: processes die as they start, or again and again in one task.

    """
    leave_if_imported_again()
    pool = _Pool(call, tasks, workers, died, split, worn)
    try:
        while True:
            pool.fill()
            if not pool.running:
                return
            batch = pool.collect(every)
            if batch or every is not None:
                yield batch
    finally:
        pool.stop()


class _Pool(Generic[T, R]):
    """A process pool that survives its processes. Tasks have numbers here, in their order."""

    def __init__(
        self,
        call: Callable[[T], R],
        tasks: Iterable[T],
        workers: int,
        died: Callable[[T, str], R] | None,
        split: Callable[[T], list[T]] | None,
        worn: Callable[[R], bool] | None,
    ) -> None:
        self.running: dict[Future[R], tuple[int, T]] = {}
        self._call, self._died, self._split, self._wears = call, died, split, worn
        self._numbers = itertools.count()
        self._tasks = ((next(self._numbers), task) for task in tasks)
        self._workers = workers
        self._again: deque[tuple[int, T]] = deque()
        self._deaths: Counter[int] = Counter()
        self._bad_starts = 0
        self._worn = False
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._processes: set[BaseProcess] = set()
        self._executor = ProcessPoolExecutor(self._workers, context, initializer=_end_with_parent)
        self._up = self._submit(os.getpid)  # tells a death in a task from one at the start

    def _submit(self, call: Callable[..., Any], *arguments: Any) -> Future[Any]:
        others = set(multiprocessing.active_children()) - self._processes
        # a Ctrl-C is the parent's to handle: processes started here never see it
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            with _without_nameless_main():
                return self._executor.submit(call, *arguments)
        finally:
            self._processes |= set(multiprocessing.active_children()) - others
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def fill(self) -> None:
        """Hands out tasks: two for each process, or one that must be alone."""
        if self._worn and not self.running:
            self._executor.shutdown()
            self._worn = False
            self._start()
        while not self._worn and len(self.running) < 2 * self._workers:
            if any(self._alone(number) for number, _ in self.running.values()):
                return
            item = self._again.popleft() if self._again else next(self._tasks, None)
            if item is None:
                return
            if self.running and self._alone(item[0]):
                self._again.appendleft(item)
                return
            try:
                self.running[self._submit(self._call, item[1])] = item
            except BrokenProcessPool:
                self._again.appendleft(item)
                if not self.running:
                    self._replace()
                return

    def _alone(self, number: int) -> bool:
        return self._deaths[number] >= _SUSPECT

    def collect(self, seconds: float | None) -> list[tuple[T, R]]:
        """Waits for results (for so long, if given); after a death, for all that is under way."""
        done, _ = wait(self.running, seconds, FIRST_COMPLETED)
        if any(isinstance(future.exception(), BrokenProcessPool) for future in done):
            done, _ = wait(self.running)
        batch, met = [], []
        for future in done:
            item = self.running.pop(future)
            if isinstance(future.exception(), BrokenProcessPool):
                met.append(item)
            else:
                batch.append((item[1], future.result()))
        if self._wears is not None:
            self._worn |= any(self._wears(result) for _, result in batch)
        if met:
            if self._is_up():
                batch += self._blame(met)
            else:
                self._again.extend(met)
            self._replace()
        return batch

    def _is_up(self) -> bool:
        return self._up.done() and self._up.exception() is None

    def _blame(self, items: Iterable[tuple[int, T]]) -> list[tuple[T, R]]:
        """Tasks during which a process died: one that was alone too often is given up."""
        reason = f"its process died {MOST_DEATHS} times (killed, or out of memory)"
        batch = []
        for number, task in items:
            self._deaths[number] += 1
            parts = [task] if self._split is None else self._split(task)
            if len(parts) > 1 and self._deaths[number] >= _SUSPECT:
                for part in parts:
                    self._again.append((next(self._numbers), part))
                    self._deaths[self._again[-1][0]] = _SUSPECT
            elif self._deaths[number] < _SUSPECT + MOST_DEATHS:  # the later ones were alone
                self._again.append((number, task))
            elif self._died is None:
                raise PoolError(f"task {number + 1} cannot be done: {reason}")
            else:
                batch.append((task, self._died(task, reason)))
        return batch

    def _replace(self) -> None:
        """A new pool for a broken one."""
        for process in self._processes:  # one that was just starting Python may leave alive
            process.terminate()
        self._executor.shutdown()
        if any(process.exitcode == _MAIN_AGAIN for process in self._processes):
            raise PoolError(
                "processes cannot be started: the script needs `if __name__ == '__main__':`"
                " around what it runs"
            )
        self._bad_starts = 0 if self._is_up() else self._bad_starts + 1
        if self._bad_starts >= MOST_DEATHS:
            raise PoolError(
                "processes die as they start (killed, out of memory, or their libraries are gone)"
            )
        self._start()

    def stop(self) -> None:
        """Ends the processes, whatever they are at."""
        self._executor.shutdown(wait=False, cancel_futures=True)
        if self.running:
            for process in self._processes:
                process.terminate()


@contextlib.contextmanager
def _without_nameless_main() -> Iterator[None]:
    """A script that came through standard input has no file that processes could import."""
    main = sys.modules["__main__"]
    name = getattr(main, "__file__", None)
    if name is None or os.path.exists(name):
        yield
        return
    del main.__file__
    try:
        yield
    finally:
        main.__file__ = name


def _end_with_parent() -> None:
    """A process of a parent that was killed would wait for ever: it ends with the parent."""

    def watch() -> None:
        parent = multiprocessing.parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
