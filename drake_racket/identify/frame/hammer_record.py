"""A hammer record is a strike as measured: force in, acceleration out, and its pulse."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_racket.identify.ball.impacts import resting_offset
from drake_racket.io.errors import InputError
from drake_racket.io.signals import Signal, read_signal
from drake_racket.rigs.hammer.force import MOST_FORCE
from drake_racket.rigs.hammer.impact_hammer import DURATION

SHARE = 0.05  # of its peak: where the pulse begins and ends; noise of 1 % stays below
WIDENED = 0.5  # of its length, by which the pulse is widened on either side: its foot
FEWEST_IN_PULSE = 5  # samples; the shape of a short pulse does not matter to the ringing
MOST_JITTER = 0.05  # of a step: times rounded in the file
FEWEST_AFTER = 40  # samples after the pulse
MOST_PULSE = 0.05  # s, as rigs.hammer_force

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HammerRecord:
    """Holds one strike, cut to what is fitted.

    Make one with `hammer_record` or `read_hammer_record`.

    Attributes:
        start: s, of the first sample, in the file's own time: the pulse's foot.
        step: s, between samples.
        force: (n,) N, zero from the end of the pulse on.
        acceleration: (n,) m/s^2.
        after: first sample after the pulse: from there on the racket rings freely.
        pulse: s, length of the pulse.
        offset: m/s^2, mean acceleration before the pulse (`identify.ball.impacts.resting_offset`).
        where: the file, for messages.

    """

    start: float
    step: float
    force: Array
    acceleration: Array
    after: int
    pulse: float
    offset: float
    where: str

    @property
    def time(self) -> Array:
        """Gives (n,) s from the first sample."""
        return np.asarray(np.arange(len(self.force)) * self.step, dtype=float)

    def ringing(self) -> Signal:
        """Gives the acceleration after the pulse."""
        inside = slice(self.after, None)
        value = self.acceleration[inside]
        return Signal(self.time[inside], value, "acceleration", "m/s^2", self.where)


def hammer_record(
    force: Signal, acceleration: Signal, *, duration: float = DURATION
) -> HammerRecord:
    """Gives a record from two signals over the same times.

    Args:
        force: N, positive in the direction of the hit.
        acceleration: m/s^2, positive in the same direction.
        duration: s from the pulse's foot that are used; shorter records are used whole.

    Raises:
        InputError: times that differ or are not an even step apart, no positive force or above
            5 kN, a pulse that the record cuts off, of fewer than 5 samples or longer than 50 ms,
            fewer than 40 samples after it, or an acceleration against the force.

    """
    where, time = force.where, force.time
    if not np.array_equal(time, acceleration.time):
        raise InputError(f"{where}: time [s]", "two sets of times", "the same for both signals")
    if not 0.005 <= duration <= 1.0:
        raise InputError("duration", duration, "0.005 to 1 s")
    step = float((time[-1] - time[0]) / (len(time) - 1))
    jitter = float(np.abs(time - np.linspace(time[0], time[-1], len(time))).max()) / step
    if jitter > MOST_JITTER:
        got = f"samples off an even step by {100.0 * jitter:.3g} % of it"
        raise InputError(f"{where}: time [s]", got, f"at most {100.0 * MOST_JITTER:g} %")
    first, last = _pulse(force, step)
    foot = max(2, math.ceil(WIDENED * (last - first + 1)))
    begin, after = max(first - foot, 0), last + foot + 1
    end = min(len(time), begin + round(duration / step) + 1)
    if end - after < FEWEST_AFTER:
        got = f"{max(end - after, 0)} samples after the pulse"
        raise InputError(f"{where}: time [s]", got, f"at least {FEWEST_AFTER}")
    inside = slice(begin, end)
    hit = np.array(force.value[inside])
    hit[after - begin :] = 0.0
    measured = acceleration.value[inside]
    if float(hit @ measured) <= 0.0:
        got = "an acceleration against the force during the pulse"
        raise InputError(f"{where}: acceleration [m/s^2]", got, "both positive the same way")
    quiet = acceleration.value[:begin]
    return HammerRecord(
        start=float(time[begin]),
        step=step,
        force=hit,
        acceleration=np.array(measured),
        after=after - begin,
        pulse=(last - first) * step,
        offset=resting_offset(quiet),
        where=where,
    )


def _pulse(force: Signal, step: float) -> tuple[int, int]:
    """First and last sample of the pulse."""
    value, where = force.value, f"{force.where}: force [N]"
    top = int(np.argmax(value))
    peak = float(value[top])
    if not 0.0 < peak <= MOST_FORCE:
        raise InputError(
            where, f"a largest value of {peak:.4g} N", f"above 0, up to {MOST_FORCE:g}"
        )
    below = np.flatnonzero(value < SHARE * peak)
    before, behind = below[below < top], below[below > top]
    if not len(behind) or (not len(before) and value[0] > 2.0 * SHARE * peak):
        raise InputError(where, "a pulse that begins or ends outside the record", "the whole pulse")
    first, last = int(before.max(initial=-1)) + 1, int(behind.min()) - 1
    if last - first + 1 < FEWEST_IN_PULSE:
        got = f"{last - first + 1} samples in the pulse"
        raise InputError(where, got, f"at least {FEWEST_IN_PULSE}")
    if (last - first) * step > MOST_PULSE:
        got = f"a pulse of {(last - first) * step:.3g} s"
        raise InputError(where, got, f"up to {MOST_PULSE:g} s")
    return first, last


def read_hammer_record(path: str | Path, *, duration: float = DURATION) -> HammerRecord:
    """Reads `time [s]`, `force [N]` and `acceleration [m/s^2]` of a CSV.

    Raises:
        InputError: as `signals.read_signal` and `hammer_record`.

    """
    path = Path(path)
    force = read_signal(path, "force", "N")
    acceleration = read_signal(path, "acceleration", "m/s^2")
    return hammer_record(force, acceleration, duration=duration)
