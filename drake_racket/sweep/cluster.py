"""Runs the cases of a sweep on a Dask cluster (extra `dask`)."""

from __future__ import annotations

import contextlib
import queue
import time
from collections.abc import Generator, Iterable
from typing import TYPE_CHECKING, Any

from drake_racket.io.errors import InputError, one_line
from drake_racket.sweep.worker import DifferentWorker, Outcome, SweepStopped, Task, failed, run_case

if TYPE_CHECKING:
    import distributed

WAIT = 60.0
"""Seconds within which a cluster must have a worker, and be reached."""

_LOOK = 1.0  # seconds between looks at the cluster while no case finishes


def run_on_cluster(
    tasks: Iterable[Task], scheduler: str | distributed.Client
) -> Generator[list[Outcome], None, None]:
    """Runs the cases on a Dask cluster; Dask runs again what a lost worker had.

    Args:
        tasks: the cases.
        scheduler: its address, or a client of the caller's, which stays open.

    Raises:
        InputError: no scheduler there, no workers within `WAIT`, or workers with other code.
        SweepStopped: the scheduler went away.

    """
    own = isinstance(scheduler, str)
    client: Any = _connect(scheduler) if isinstance(scheduler, str) else scheduler
    cases = _Cases(client, tasks)
    try:
        while True:
            cases.fill()
            if not cases.running:
                return
            batch = cases.collect()
            if batch:
                yield batch
    finally:
        cases.stop()
        if own:
            with contextlib.suppress(TimeoutError):  # a lost scheduler answers no goodbye
                client.close(timeout=10 if client.status == "running" else 0.5)


def _connect(address: str) -> Any:  # distributed has hints for a part of it only
    try:
        from distributed import Client
    except ImportError:
        allowed = "nothing without Dask: pip install 'drake-racket[dask]'"
        raise InputError("--scheduler", address, allowed) from None
    connect: Any = Client
    try:
        return connect(address, timeout=10, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        allowed = f"the address of a running Dask scheduler ({one_line(str(error), 120)})"
        raise InputError("--scheduler", address, allowed) from None


class _Cases:
    """The cases that are on the cluster."""

    def __init__(self, client: Any, tasks: Iterable[Task]) -> None:
        self.running: dict[Any, tuple[Any, Task]] = {}  # future and case by the future's key
        self._client = client
        self._tasks = iter(tasks)
        self._done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._room, self._looked = 0, -_LOOK
        self._staffed, self._started = False, time.monotonic()

    def fill(self) -> None:
        """Hands out cases: three for each thread of the cluster, so that none waits for work.

        Some before there is a worker: an adaptive cluster starts workers when there is work.
        """
        if time.monotonic() - self._looked > _LOOK:
            self._check()
            threads = self._threads()
            self._staffed |= threads > 0
            if not self._staffed and time.monotonic() - self._started > WAIT:
                allowed = f"a scheduler that has a worker within {WAIT:g} s"
                raise InputError("--scheduler", self._address(), allowed)
            self._room = 3 * max(1, threads)
            self._looked = time.monotonic()
        while len(self.running) < self._room:
            task = next(self._tasks, None)
            if task is None:
                return
            future = self._client.submit(run_case, task, pure=False)
            self.running[future.key] = future, task
            future.add_done_callback(self._done.put)

    def collect(self) -> list[Outcome]:
        """Waits a moment for an outcome, and takes all that are there."""
        futures = []
        try:
            futures.append(self._done.get(timeout=_LOOK))
            while True:
                futures.append(self._done.get_nowait())
        except queue.Empty:
            pass
        if not futures:
            self._check()
        batch = []
        for i, future in enumerate(futures):
            try:
                batch += self._outcome(future)
            except SweepStopped:
                if not batch:
                    raise
                for rest in futures[i:]:  # what came before counts; then it is met again
                    self._done.put(rest)
                break
        return batch

    def _outcome(self, future: Any) -> list[Outcome]:
        """What a future has; nothing if Dask has to compute it again."""
        from distributed import CancelledError, KilledWorker

        _, task = self.running[future.key]
        try:
            outcome: Outcome = future.result(timeout=WAIT)
        except KilledWorker:  # by Dask's setting distributed.scheduler.allowed-failures
            outcome = failed(task.case, task.settings.outputs, "workers died in it again and again")
        except (CancelledError, OSError, TimeoutError) as error:
            if isinstance(error, CancelledError) or self._client.status != "running":
                raise self._lost() from None
            future.add_done_callback(self._done.put)  # its worker was lost after it was done
            return []
        except DifferentWorker:
            raise
        except Exception as error:
            reason = one_line(f"{type(error).__name__}: {error}", 200)
            allowed = f"workers that can run the package ({reason})"
            raise InputError("--scheduler", self._address(), allowed) from None
        del self.running[future.key]
        future.release()
        return [outcome]

    def _threads(self) -> int:
        try:
            return int(sum(self._client.nthreads().values()))
        except (OSError, TimeoutError):
            raise self._lost() from None

    def _check(self) -> None:
        if self._client.status != "running":
            raise self._lost()

    def _address(self) -> str:
        scheduler = self._client.scheduler
        return "the scheduler" if scheduler is None else str(scheduler.address)

    def _lost(self) -> SweepStopped:
        return SweepStopped(f"the Dask scheduler at {self._address()} was lost")

    def stop(self) -> None:
        """Takes back what is not finished."""
        if self.running and self._client.status == "running":
            self._client.cancel([future for future, _ in self.running.values()])
