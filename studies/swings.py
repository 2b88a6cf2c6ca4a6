"""How fast a player swings what: shared by the studies on rackets."""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

from drake_racket import Progress
from drake_racket.compare import Assessment, Swing

EFFORT = 0.27
"""Swing speed goes with swingweight to the power -0.27 at maximum effort, where it is above
0.03 kg m^2: four students, six rods (Cross & Bower 2006, Journal of Sports Sciences 24:23-30)."""


def eased(swing: Swing, swingweight: float, reference: float, exponent: float = EFFORT) -> Swing:
    """Gives the swing of the same effort with another swingweight."""
    rate = swing.rate * (swingweight / reference) ** -exponent
    return Swing(rate, swing.pivot, swing.ball_speed)


def speeds(found: Assessment, swing: Swing) -> NDArray[np.float64]:
    """Ball speed (m/s) at the aims of an assessment, for a swing near the one it was made with.

    The restitution is that of the assessment: it changes by 0.0006 for 1 % of speed.
    """
    place = found.racket.centre()[0] + found.offsets
    racket = swing.rate * (place + swing.pivot)
    return np.asarray(found.restitution * (racket + swing.ball_speed) + racket)


def at_aim(found: Assessment, values: NDArray[np.float64], offset: float) -> float:
    """The value at the aim that is nearest to `offset` (m from the centre)."""
    return float(values[int(np.argmin(np.abs(found.offsets - offset)))])


def report(progress: Progress) -> None:
    """One line on a terminal, written over."""
    if sys.stderr.isatty():
        end = "\n" if progress.done == progress.total else ""
        text = f"\r{progress.task}: {progress.done:g} of {progress.total:g}"
        print(text, end=end, file=sys.stderr, flush=True)
