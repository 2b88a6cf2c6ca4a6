"""Runs the cases of a sweep on a Dask cluster (extra `dask`)."""

from __future__ import annotations

import contextlib
import queue
import time
from collections import deque
from collections.abc import Generator, Iterable, Iterator
from typing import TYPE_CHECKING, Any

from drake_racket.io.errors import InputError, WorkStopped, one_line
from drake_racket.io.extras import need_library
from drake_racket.sweep.chunks import Chunks
from drake_racket.sweep.worker import (
    CaseOutcome,
    CaseTask,
    DifferentWorker,
    failed,
    run_chunk,
)

if TYPE_CHECKING:
    import distributed

WAIT = 60.0
"""Seconds within which a cluster must have a worker, and be reached."""

TOGETHER = 2.0
"""Seconds of work in one of Dask's tasks, each of which costs its scheduler about a millisecond."""

_LOOK = 1.0  # seconds between looks at the cluster while no case finishes


class ClusterLost(WorkStopped):
    """The Dask scheduler went away; the message is one line."""


@contextlib.contextmanager
def connected(scheduler: str | distributed.Client) -> Iterator[distributed.Client]:
    """Gives a client of a Dask scheduler, to be had before any work is done.

    Args:
        scheduler: its address, or a client of the caller's, which stays open.

    Raises:
        InputError: Dask is not installed, or no scheduler is there.

    """
    if not isinstance(scheduler, str):
        yield scheduler
        return
    need_library("distributed", "dask", "--scheduler", scheduler)
    client = _connect(scheduler)
    try:
        yield client
    finally:
        with contextlib.suppress(TimeoutError):  # a lost scheduler answers no goodbye
            client.close(timeout=10 if client.status == "running" else 0.5)


def _connect(address: str) -> Any:  # distributed has hints for a part of it only
    from distributed import Client

    connect: Any = Client
    try:
        return connect(address, timeout=10, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        allowed = f"the address of a running Dask scheduler ({one_line(str(error), 120)})"
        raise InputError("--scheduler", address, allowed) from None


def run_on_cluster(
    tasks: Iterable[CaseTask], client: distributed.Client
) -> Generator[list[CaseOutcome], None, None]:
    """Runs the cases on a Dask cluster; Dask runs again what a lost worker had.

    A task of Dask's is a chunk of cases that take about TOGETHER seconds.

    Raises:
        InputError: no workers within `WAIT`, or workers with other code.
        ClusterLost: the scheduler went away.

    """
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


def run_packed(chunk: bytes) -> list[CaseOutcome]:
    """Runs a chunk that was pickled; see `worker.run_chunk`.

    Dask's scheduler keeps its last thousand messages to each worker: as bytes, a case takes a fifth
    of what it takes as objects there.
    """
    from distributed.protocol.pickle import loads

    return run_chunk(loads(chunk))


class _Cases:
    """The cases that are on the cluster."""

    def __init__(self, client: Any, tasks: Iterable[CaseTask]) -> None:
        self.running: dict[Any, tuple[Any, list[CaseTask]]] = {}  # future, chunk by its key
        self._client = client
        self._chunks = Chunks(tasks, TOGETHER)
        self._singles: deque[list[CaseTask]] = deque()
        self._done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._room, self._looked = 0, -_LOOK
        self._staffed, self._started = False, time.monotonic()

    def fill(self) -> None:
        """Hands out chunks: three for each thread of the cluster, so that none waits for work.

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
            chunk = self._singles.popleft() if self._singles else next(self._chunks, None)
            if chunk is None:
                return
            future = self._client.submit(run_packed, self._packed(chunk), pure=False)
            self.running[future.key] = future, chunk
            future.add_done_callback(self._done.put)

    def _packed(self, chunk: list[CaseTask]) -> bytes:
        from distributed.protocol.pickle import dumps

        packed: bytes = dumps(chunk)
        return packed

    def collect(self) -> list[CaseOutcome]:
        """Waits a moment for outcomes, and takes all that are there."""
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
            except ClusterLost:
                if not batch:
                    raise
                for rest in futures[i:]:  # what came before counts; then it is met again
                    self._done.put(rest)
                break
        return batch

    def _outcome(self, future: Any) -> list[CaseOutcome]:
        """What a future has; nothing if Dask has to compute it again."""
        from distributed import CancelledError, KilledWorker

        _, chunk = self.running[future.key]
        task = chunk[0]
        try:
            outcomes: list[CaseOutcome] = future.result(timeout=WAIT)
        except KilledWorker:  # by Dask's setting distributed.scheduler.allowed-failures
            outcomes = []
            if len(chunk) > 1:  # in one of them
                self._singles.extend([task] for task in chunk)
            else:
                reason = "workers died in it again and again"
                outcomes = [failed(task.case, len(task.settings.outputs), reason)]
        except (CancelledError, OSError, TimeoutError) as error:
            if isinstance(error, CancelledError) or self._client.status != "running":
                raise self._lost() from None
            future.add_done_callback(self._done.put)  # its worker was lost after it was done
            return []
        except DifferentWorker:
            raise
        except Exception as error:
            if task.settings.strict:
                raise
            reason = one_line(f"{type(error).__name__}: {error}", 200)
            allowed = f"workers that can run the package ({reason})"
            raise InputError("--scheduler", self._address(), allowed) from None
        del self.running[future.key]
        future.release()
        self._chunks.learn(outcomes)
        return outcomes

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

    def _lost(self) -> ClusterLost:
        return ClusterLost(f"the Dask scheduler at {self._address()} was lost")

    def stop(self) -> None:
        """Takes back what is not finished."""
        if self.running and self._client.status == "running":
            self._client.cancel([future for future, _ in self.running.values()])
