"""Draws a straight line through fitted values over speed, with its intervals.

With values y_i at speeds v_i, weights w_i and the centre c = sum w v / sum w, the line
y = level + slope (v - c) has uncorrelated level and slope:

    level = sum w y / sum w,               var level = 1 / sum w,
    slope = sum w y (v - c) / S,           var slope = 1 / S,    S = sum w (v - c)^2.

`scatter` (ordinary least squares): equal weights, 1 / w the variance of the scatter about the line
with n - 2 degrees of freedom, so that it holds whatever a value's error is made of.
`fit`: 1 / w the variance of each value's own fit. It needs no scatter, so two speeds will do, and
takes the line as exactly true. A speed's own error counts as slope times it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm, t

from drake_racket.identify.core.estimate import Estimate
from drake_racket.io.errors import InputError

WEIGHTS = ("scatter", "fit")


@dataclass(frozen=True)
class SpeedLine:
    """Holds a regression on speed (module docstring).

    Attributes:
        name, unit: of the value.
        centre: m/s.  level: value there.  slope: per m/s.
        variances: of level and slope, which are uncorrelated.
        freedom: degrees, infinite for `fit`.
        weights: `scatter` or `fit`.
        scatter: root mean square distance of the values from the line.
        misfit: probability of as large a scatter about the line, were it true and the values'
            errors those of their fits; NaN with two speeds.

    """

    name: str
    unit: str
    centre: float
    level: float
    slope: float
    variances: tuple[float, float]
    freedom: float
    weights: str
    scatter: float
    misfit: float

    def at(self, speed: float) -> Estimate:
        """Gives the value at a speed (m/s)."""
        away = speed - self.centre
        variance = self.variances[0] + away * away * self.variances[1]
        return self._estimate(self.level + self.slope * away, variance, self.unit)

    def gradient(self) -> Estimate:
        """Gives the slope."""
        return self._estimate(self.slope, self.variances[1], f"{self.unit} per m/s")

    def growth(self, low: float, high: float) -> Estimate:
        """Gives the value at `high` over that at `low` (m/s) less 1, errors to first order."""
        a, b = low - self.centre, high - self.centre
        bottom, top = self.level + self.slope * a, self.level + self.slope * b
        by_level = (bottom - top) / bottom**2
        by_slope = (b * bottom - a * top) / bottom**2
        variance = by_level**2 * self.variances[0] + by_slope**2 * self.variances[1]
        return self._estimate(top / bottom - 1.0, variance, "1")

    def _estimate(self, value: float, variance: float, unit: str) -> Estimate:
        error = math.sqrt(variance)
        quantile = float(
            norm.ppf(0.975) if math.isinf(self.freedom) else t.ppf(0.975, self.freedom)
        )
        return Estimate(value, error, (value - quantile * error, value + quantile * error), unit)


def speed_line(
    name: str,
    unit: str,
    speeds: NDArray[np.float64],
    values: NDArray[np.float64],
    covariances: NDArray[np.float64],
    *,
    weights: str = "scatter",
) -> SpeedLine:
    """Fits the line.

    Args:
        speeds, values: (n,).
        covariances: (n, 2, 2) of each value and its speed.
        weights: `scatter` (three speeds or more) or `fit` (two or more).

    Raises:
        InputError: another `weights`, or too few speeds.

    """
    if weights not in WEIGHTS:
        raise InputError("weights", weights, ", ".join(WEIGHTS))
    fewest = 3 if weights == "scatter" else 2
    if len(speeds) < fewest:
        raise InputError(f"speeds of {name}", len(speeds), f"{fewest} or more for a line")
    centre, level, slope = _least_squares(speeds, values, np.ones(len(speeds)))
    freedom = len(speeds) - 2
    # a value's distance from the line, its speed's error included
    own = (
        covariances[:, 0, 0]
        - 2.0 * slope * covariances[:, 0, 1]
        + slope * slope * covariances[:, 1, 1]
    )
    own = np.where(np.isfinite(own), np.maximum(own, np.finfo(float).tiny), np.inf)
    exact = _least_squares(speeds, values, 1.0 / own)
    left = values - exact[1] - exact[2] * (speeds - exact[0])
    misfit = float(chi2.sf(float(np.sum(left**2 / own)), freedom)) if freedom else math.nan
    if weights == "fit":
        centre, level, slope = exact
        w = 1.0 / own
    around = values - level - slope * (speeds - centre)
    if weights == "scatter":
        w = np.full(len(speeds), freedom / max(float(around @ around), np.finfo(float).tiny))
    variances = 1.0 / float(w.sum()), 1.0 / float(w @ (speeds - centre) ** 2)
    return SpeedLine(
        name=name,
        unit=unit,
        centre=centre,
        level=level,
        slope=slope,
        variances=variances,
        freedom=math.inf if weights == "fit" else float(freedom),
        weights=weights,
        scatter=float(np.sqrt(np.mean(around**2))),
        misfit=misfit,
    )


def _least_squares(
    speeds: NDArray[np.float64], values: NDArray[np.float64], w: NDArray[np.float64]
) -> tuple[float, float, float]:
    centre = float(w @ speeds / w.sum())
    away = speeds - centre
    slope = float((w * away) @ values / ((w * away) @ away))
    return centre, float(w @ values / w.sum()), slope
