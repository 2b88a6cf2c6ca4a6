"""Solves a ball on a rigid plate without Drake, in closed form, and analyses force signals.

Started at touch with speed v, the contact law N = kb x + cb x' and the ball's mass m make x a
damped oscillator that is let go when N returns to 0. With w = sqrt(kb / m), z = cb / (2 sqrt(kb m))
and s = sqrt(1 - z^2):

    N(t) = m v w exp(-z w t) (2 z cos(s w t) + (1 - 2 z^2) sin(s w t) / s),

    contact time    2 acos(z) / (s w)
    restitution     exp(-z w x contact time)
    peak            at (3 acos(z) - pi) / (s w) if z < 1/2, and m v w exp(-z w x that time) high;
                    else at touch, cb v high

For z > 1 the same with s imaginary, acos(z) / s = acosh(z) / |s|; at z = 1, acos(z) / s = 1.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import trapezoid

from drake_racket.io.errors import InputError
from drake_racket.io.signals import Signal, pulse_extent

PLATE_SAMPLE_RATE = 65e3
"""The plate was sampled at so many Hz (Glynn et al. 2011, Methods)."""

BEFORE = 1e-3
"""A sampled history begins so long before touch (s), as Fig. 4 of Glynn et al. 2011 does."""
AFTER = 5e-3
"""A sampled history goes on so long after touch (s), as Fig. 4 of Glynn et al. 2011 does."""


@dataclass(frozen=True)
class ClosedForm:
    """Holds a damped oscillator: mass (kg), stiffness (N/m), damping (N s/m), speed (m/s)."""

    mass: float
    stiffness: float
    damping: float
    speed: float
    contact_time: float  # s
    restitution: float
    peak_force: float  # N
    peak_time: float  # s from touch

    @property
    def rebound_speed(self) -> float:
        """Gives the rebound speed, m/s."""
        return self.restitution * self.speed

    @property
    def impulse(self) -> float:
        """Gives the impulse, N s: m v (1 + restitution)."""
        return self.mass * (self.speed + self.rebound_speed)

    def force(self, time: Any) -> NDArray[np.float64]:
        """Gives N at times from touch (s); 0 before touch and from release on."""
        w = math.sqrt(self.stiffness / self.mass)
        z = self.damping / (2.0 * math.sqrt(self.stiffness * self.mass))
        inside = (np.asarray(time) >= 0.0) & (np.asarray(time) < self.contact_time)
        t = np.where(inside, time, 0.0)
        angle = cmath.sqrt((1.0 - z) * (1.0 + z)) * w * t
        # sin(s w t) / s as w t sinc: also for imaginary s, and for s = 0
        swing = 2.0 * z * np.cos(angle) + (1.0 - 2.0 * z * z) * w * t * np.sinc(angle / np.pi)
        force = self.mass * self.speed * w * np.exp(-z * w * t) * swing.real
        return np.asarray(np.where(inside, force, 0.0))


def closed_form(*, mass: float, stiffness: float, damping: float, speed: float) -> ClosedForm:
    """Computes what the law gives on a rigid plate (module docstring); any damping ratio.

    Args:
        mass: kg.  stiffness: N/m.  damping: N s/m.  speed: m/s, of approach.

    Raises:
        InputError: a number that is not finite, or not positive (damping may be 0).

    """
    given = {"mass": mass, "stiffness": stiffness, "damping": damping, "speed": speed}
    for key, number in given.items():
        if not (math.isfinite(number) and (number > 0.0 or (key == "damping" and number == 0.0))):
            raise InputError(key, number, "a finite positive number (damping: or 0)")
    w, z = math.sqrt(stiffness / mass), damping / (2.0 * math.sqrt(stiffness * mass))
    s = cmath.sqrt((1.0 - z) * (1.0 + z))
    ratio = 1.0 if s == 0.0 else abs(cmath.acos(z) / s)  # acos(z) / s
    contact_time = 2.0 * ratio / w
    at_touch = z >= 0.5
    peak_time = 0.0 if at_touch else (3.0 * ratio - math.pi / s.real) / w
    return ClosedForm(
        **given,
        contact_time=contact_time,
        restitution=math.exp(-z * w * contact_time),
        peak_force=damping * speed if at_touch else mass * speed * w * math.exp(-z * w * peak_time),
        peak_time=peak_time,
    )


def sample_times(rate: float, before: float, after: float) -> NDArray[np.float64]:
    """Gives the times (s) of a record sampled at `rate` (Hz), with a sample at 0.

    It lasts from `before` (s) before 0 to `after` (s) after it.

    Raises:
        InputError: a rate that is not 1 kHz to 10 MHz, or times that are not 0 to 0.1 s.

    """
    if not 1e3 <= rate <= 1e7:
        raise InputError("rate", rate, "1e3 to 1e7 Hz")
    for key, value in (("before", before), ("after", after)):
        if not 0.0 <= value <= 0.1:
            raise InputError(key, value, "0 to 0.1 s")
    return np.arange(-round(before * rate), round(after * rate) + 1) / rate


@dataclass(frozen=True)
class ForceAnalysis:
    """Says what a sampled force tells of one impact.

    Attributes:
        start, end: s, where the force passes the threshold, in the signal's own time.
        contact_time, peak_time: s, from `start`.
        peak_force: N, of the parabola through the highest sample and its neighbours.
        impulse: N s, by the trapezoidal rule from `start` to `end`.
        rebound_speed: m/s, impulse / mass - approach speed.
        restitution: rebound over approach speed.
        samples: in contact.

    """

    start: float
    end: float
    contact_time: float
    peak_force: float
    peak_time: float
    impulse: float
    rebound_speed: float
    restitution: float
    samples: int


def analyse_force(
    signal: Signal, *, mass: float, approach_speed: float, threshold: float = 0.01
) -> ForceAnalysis:
    """Reads contact time, peak force, impulse and restitution from a force signal.

    In contact is the unbroken stretch around the highest sample where the force is at least
    `threshold` times that sample; its ends are placed by a straight line between the samples on
    either side. At touch the force jumps (cb v), so the start is known to one sample, and so are
    the contact time and, in proportion, impulse and restitution. Only a force that starts at zero
    gives a true impulse: take an offset away first.

    Args:
        signal: force (N), positive in compression.
        mass: of the ball, kg.  approach_speed: m/s.
        threshold: share of the highest sample, 0.001 to 0.5. Raise it above the noise.

    Raises:
        InputError: a number out of range, no positive force, fewer than 20 samples in contact, or
            a record that ends before the contact does.

    """
    for key, value in (("mass", mass), ("approach_speed", approach_speed)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(key, value, "a finite positive number")
    if not 0.001 <= threshold <= 0.5:
        raise InputError("threshold", threshold, "0.001 to 0.5 (share of the peak)")
    first, last = pulse_extent(signal, threshold)
    time, force = signal.time, signal.value
    top = int(np.argmax(force))
    if last == len(force) - 1:
        raise InputError(
            f"{signal.where}: {signal.name} [{signal.unit}]",
            f"{force[last]:.4g} N at the last sample",
            f"a record of the whole contact, to below {threshold * force[top]:.4g} N",
        )
    level = threshold * float(force[top])
    end = float(np.interp(-level, -force[last : last + 2], time[last : last + 2]))
    start = float(time[0])
    if first > 0:
        start = float(np.interp(level, force[first - 1 : first + 1], time[first - 1 : first + 1]))
    inside = slice(first, last + 1)
    t = np.concatenate([[start], time[inside], [end]])
    f = np.concatenate([[level if first > 0 else force[0]], force[inside], [level]])
    impulse = float(trapezoid(f, t))
    peak_force, peak_time = _peak(time, force, top)
    rebound = impulse / mass - approach_speed
    return ForceAnalysis(
        start=start,
        end=end,
        contact_time=end - start,
        peak_force=peak_force,
        peak_time=peak_time - start,
        impulse=impulse,
        rebound_speed=rebound,
        restitution=rebound / approach_speed,
        samples=last - first + 1,
    )


def _peak(time: NDArray[np.float64], force: NDArray[np.float64], top: int) -> tuple[float, float]:
    """Height and time of the parabola's top through three samples; the sample itself at an end."""
    if 0 < top < len(force) - 1:
        near = slice(top - 1, top + 2)
        curve, slope, level = np.polyfit(time[near] - time[top], force[near], 2)
        if curve < 0.0:
            offset = -0.5 * slope / curve
            return float(level + 0.5 * slope * offset), float(time[top] + offset)
    return float(force[top]), float(time[top])
