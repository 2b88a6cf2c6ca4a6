"""Groups cases that travel together: a process's or cluster's overhead is then shared by many."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from drake_racket.sweep.worker import CaseOutcome, CaseTask

MOST = 2000
"""Cases in one chunk."""

_GROWTH = 4


class Chunks:
    """The chunks are a sweep's tasks in groups that take about as long as is asked for.

    The first ones are single cases: how long a case takes is learnt as they come back. A task whose
    data are wanted ends its chunk, so that few histories are in memory at a time.
    """

    def __init__(self, tasks: Iterable[CaseTask], seconds: float) -> None:
        """Groups `tasks` to chunks of so many seconds, or of one case that takes longer."""
        self._tasks = iter(tasks)
        self._seconds = seconds
        self._size = 1

    def __iter__(self) -> Iterator[list[CaseTask]]:
        """Gives the chunks that are left."""
        return self

    def __next__(self) -> list[CaseTask]:
        """Gives the next chunk."""
        chunk: list[CaseTask] = []
        for task in self._tasks:
            chunk.append(task)
            if len(chunk) >= self._size or task.data:
                break
        if not chunk:
            raise StopIteration
        return chunk

    def learn(self, outcomes: Sequence[CaseOutcome]) -> None:
        """Takes the time that cases took into account."""
        if not outcomes:
            return
        mean = sum(outcome.seconds for outcome in outcomes) / len(outcomes)
        wanted = int(self._seconds / mean) if mean > 0.0 else MOST
        self._size = max(1, min(wanted, _GROWTH * self._size, MOST))
