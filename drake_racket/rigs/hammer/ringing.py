"""Reads frequency and damping from a sampled free decay, the model's or a measured one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import rfft, rfftfreq
from scipy.optimize import least_squares
from scipy.signal import find_peaks
from scipy.signal.windows import hann
from scipy.stats import linregress

from drake_racket.io.errors import InputError
from drake_racket.io.signals import FEWEST_SAMPLES, Signal

FEWEST_PER_PERIOD = 8  # samples
FEWEST_EXTREMA = 4  # two periods
NOISE_MARGIN = 3.0  # extrema below this many times the fit's residual say nothing of the decay
MOST_RESIDUAL = 0.8  # of the root mean square; more is noise
FIRST_DECREMENTS = (0.02, 0.2, 1.0)  # where the fit starts


@dataclass(frozen=True)
class Ringing:
    """Holds a decaying oscillation, read in three ways that agree when there is one mode.

    Attributes:
        frequency: damped, Hz, from the times of the extrema.
        logarithmic_decrement: of the amplitude per period (1), from the sizes of the extrema.
        damping_ratio: delta / sqrt(4 pi^2 + delta^2), with delta the decrement.
        fit_frequency, fit_damping_ratio: from a damped sinusoid fitted to all samples.
        residual: root mean square the fit leaves, as a share of the signal's: near 0 for one mode.
        spectrum_frequency: Hz, the peak of the spectrum between its lines.
        amplitude: of the fit at the first sample, in the signal's unit.
        lines, spectrum: Hz, and the amplitude at each in the signal's unit (Hann window).

    """

    frequency: float
    logarithmic_decrement: float
    damping_ratio: float
    fit_frequency: float
    fit_damping_ratio: float
    residual: float
    spectrum_frequency: float
    amplitude: float
    lines: NDArray[np.float64]
    spectrum: NDArray[np.float64]


def analyse_ringing(
    signal: Signal, *, start: float = -math.inf, least_share: float = 0.05
) -> Ringing:
    """Reads frequency and damping of the strongest mode in a free decay.

    The extrema of A exp(-s t) cos(w t + a) are pi / w apart and shrink by exp(-s pi / w): straight
    lines through their times and logarithms over their number give both, once offset and drift
    (a straight line, fitted together with the oscillation) are taken away.

    Args:
        signal: of any quantity that decays; unequal steps are made equal.
        start: time (s) from which the decay is free, such as the end of the hammer's pulse.
        least_share: extrema smaller than this share of the largest one are left out (noise).

    Raises:
        InputError: fewer than 20 samples after `start`, no oscillation, or too few samples or
            periods to measure it.

    """
    time, raw = _even(signal, start)
    step = time[1] - time[0]
    where = f"{signal.where}: {signal.name} [{signal.unit}] from {time[0]:.4g} s"
    drift = np.polyval(np.polyfit(time - time[0], raw, 1), time - time[0])
    if not np.abs(raw - drift).max() > 1e-12 * np.abs(signal.value).max():
        raise InputError(where, "no oscillation", "a free decay")
    lines, spectrum, guess = _spectrum(raw - drift, step)
    if guess * step > 1.0 / FEWEST_PER_PERIOD:
        samples = f"{1.0 / (guess * step):.1f} samples per period"
        raise InputError(where, samples, f"at least {FEWEST_PER_PERIOD}")
    fit = _fit(raw, step, guess)
    if fit.residual > MOST_RESIDUAL:
        left = f"a fit that leaves {100.0 * fit.residual:.0f} % of it"
        raise InputError(where, left, f"a decay that leaves at most {100.0 * MOST_RESIDUAL:.0f} %")
    oscillation = raw - fit.drift  # the fit tells drift from decay; a line through a decay does not
    noise = NOISE_MARGIN * fit.residual * float(np.sqrt(np.mean(oscillation**2)))
    least = max(least_share * float(np.abs(oscillation).max()), noise)
    frequency, decrement = _extrema(oscillation, step, fit.frequency, least, where)
    return Ringing(
        frequency=frequency,
        logarithmic_decrement=decrement,
        damping_ratio=decrement / math.hypot(2.0 * math.pi, decrement),
        fit_frequency=fit.frequency,
        fit_damping_ratio=fit.damping_ratio,
        residual=fit.residual,
        spectrum_frequency=guess,
        amplitude=fit.amplitude,
        lines=lines,
        spectrum=spectrum,
    )


def _even(signal: Signal, start: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    inside = signal.time >= start
    count = int(inside.sum())
    if count < FEWEST_SAMPLES:
        raise InputError(
            f"{signal.where}: time [s] from {start:g} s",
            f"{count} samples",
            f"at least {FEWEST_SAMPLES}",
        )
    time, value = signal.time[inside], signal.value[inside]
    even = np.linspace(time[0], time[-1], count)
    # times rounded in the file are an even grid still; moving the samples would add noise
    if np.abs(time - even).max() < 0.1 * (even[1] - even[0]):
        return even, value
    return even, np.interp(even, time, value)


def _spectrum(
    value: NDArray[np.float64], step: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Lines (Hz), amplitudes, and the frequency of the highest peak (parabola through its log)."""
    window = hann(len(value), sym=False)
    length = 8 * len(value)  # zero padding: lines close enough for the parabola
    spectrum = 2.0 * np.abs(rfft(value * window, length)) / window.sum()
    lines = rfftfreq(length, step)
    top = int(np.argmax(spectrum[1:-1])) + 1
    curve, slope, _ = np.polyfit([-1, 0, 1], np.log(spectrum[top - 1 : top + 2]), 2)
    return lines, spectrum, float(lines[top] - 0.5 * slope / curve * lines[1])


def _extrema(
    value: NDArray[np.float64], step: float, guess: float, least: float, where: str
) -> tuple[float, float]:
    """Frequency (Hz) and logarithmic decrement from lines through times and sizes of extrema.

    A parabola through the tenth of a period on either side of an extremum averages noise; what it
    errs is the same share of every extremum, and so changes neither slope.
    """
    period = 1.0 / (guess * step)  # samples
    size, reach = np.abs(value), max(1, round(0.1 * period))
    places, _ = find_peaks(size, distance=max(1, round(0.4 * period)), height=least)
    places = places[(places >= reach) & (places < len(size) - reach)]
    around = np.arange(-reach, reach + 1)
    curve, slope, level = np.polyfit(around, size[places + around[:, np.newaxis]], 2)
    round_top = np.abs(slope) < -2.0 * reach * curve  # its top lies within the samples it is from
    curve, slope, level, places = (x[round_top] for x in (curve, slope, level, places))
    if len(places) < FEWEST_EXTREMA:
        raise InputError(where, f"{len(places)} extrema above noise", f"{FEWEST_EXTREMA} or more")
    times = (places - 0.5 * slope / curve) * step
    heights = level - 0.25 * slope**2 / curve
    # noise may hide an extremum or make one: number them from the largest, at half a period each
    counted = (times - times[int(np.argmax(heights))]) * 2.0 * guess
    number = np.rint(counted)
    kept = (np.abs(counted - number) < 0.2) & (heights > 0.0)
    if kept.sum() < FEWEST_EXTREMA or len(np.unique(number[kept])) < kept.sum():
        raise InputError(where, "extrema at no regular distance", "one clear oscillation")
    half_period = float(linregress(number[kept], times[kept]).slope)
    return 0.5 / half_period, -2.0 * float(linregress(number[kept], np.log(heights[kept])).slope)


@dataclass(frozen=True)
class _Fit:
    frequency: float
    damping_ratio: float
    amplitude: float
    residual: float
    drift: NDArray[np.float64]


def _fit(value: NDArray[np.float64], step: float, guess: float) -> _Fit:
    """Least squares of (A cos w t + B sin w t) exp(-s t) + C + D t to all samples."""
    time = np.arange(len(value)) * step

    def solve(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """A, B, C, D are linear: solved for, not sought."""
        decay, angle = np.exp(-x[1] * time), 2.0 * np.pi * x[0] * time
        line = (np.ones_like(time), time / time[-1])
        basis = np.stack([decay * np.cos(angle), decay * np.sin(angle), *line], axis=1)
        return basis, np.linalg.lstsq(basis, value, rcond=None)[0]

    def left(x: NDArray[np.float64]) -> NDArray[np.float64]:
        basis, coefficients = solve(x)
        return np.asarray(basis @ coefficients - value) / scale

    scale = float(np.abs(value).max())
    tries = [
        least_squares(left, [guess, d * guess], x_scale=[guess, guess], xtol=1e-13, ftol=1e-13)
        for d in FIRST_DECREMENTS  # the nearest of them leads to the least residual
    ]
    found = min(tries, key=lambda result: float(result.cost))
    damped, rate = (float(x) for x in found.x)
    basis, coefficients = solve(found.x)
    drift = basis[:, 2:] @ coefficients[2:]
    return _Fit(
        frequency=damped,
        damping_ratio=rate / math.hypot(2.0 * math.pi * damped, rate),
        amplitude=float(np.hypot(*coefficients[:2])),
        residual=float(np.linalg.norm(found.fun) * scale / np.linalg.norm(value - drift)),
        drift=drift,
    )
