"""Tells whoever waits how far sweeps, rigs, fits and the validation are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Progress:
    """The Progress says how far one task is.

    Attributes:
        task: what is done: `checking` and `running` of a sweep, `fitting`, a section's title.
        done, total: numbers of steps, of whatever kind: cases, starts, or parts of 1.
        failed: of those done.
        before: number of those done that an earlier run has left.
        seconds: s, since the task began.
        rms: the lowest so far, in the fit's unit; None where nothing is fitted.

    """

    task: str
    done: float
    total: float
    failed: int = 0
    before: float = 0
    seconds: float = 0.0
    rms: float | None = None

    def rate(self) -> float:
        """Gives the steps per second of this run; 0 before the first."""
        return (self.done - self.before) / self.seconds if self.seconds > 0.0 else 0.0

    def time_left(self) -> float | None:
        """Seconds at this rate; None before the first step."""
        rate = self.rate()
        return (self.total - self.done) / rate if rate > 0.0 else None


Report = Callable[[Progress], None]
"""This is what long work calls as it goes on; what it raises ends the work."""


def part_of(report: Report | None, before: float, total: float) -> Report:
    """Gives a report for one part of a task of `total` steps, of which `before` come earlier."""
    if report is None:
        return lambda _: None
    return lambda part: report(replace(part, done=before + part.done, total=total))
