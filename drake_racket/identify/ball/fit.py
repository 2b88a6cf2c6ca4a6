"""Fits the ball's stiffness and damping over approach speed to impacts on a force plate.

One pair kb, cb per speed (`by_speed`), and a straight line through each over speed: the law that
the ball's parameter file holds, its values at a lowest speed and their growth up to a highest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.identify.ball.by_speed import SPEED_SIGMA, SpeedFit, fit_speed
from drake_racket.identify.ball.impacts import BallImpact, read_ball_impacts
from drake_racket.identify.ball.speed_line import WEIGHTS, SpeedLine, speed_line
from drake_racket.identify.core.estimate import Estimate
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Progress, Report
from drake_racket.io.units import labelled

if TYPE_CHECKING:
    import xarray

__all__ = ["BallFit", "BallImpact", "fit_ball", "group_by_speed", "read_ball_impacts"]

GROUP_WIDTH = 1.0
"""m/s: impacts closer than this to the slowest of their group are repeats of one speed."""

BEYOND = 0.5  # m/s outside the measured speeds that need no warning
UNLIKELY = 0.01  # probability of a scatter about the line below which it is not chance
ROUNDING = 1e-5  # of the value: data without noise scatter by less


@dataclass(frozen=True)
class BallFit:
    """Holds kb and cb over speed.

    Attributes:
        groups: one fit per speed, from the slowest.
        stiffness, damping: lines over speed; None with one speed only.
        speed_low, speed_high: m/s, the range that the law is stated for.
        warnings: one line each; the groups' first.

    """

    groups: tuple[SpeedFit, ...]
    stiffness: SpeedLine | None
    damping: SpeedLine | None
    speed_low: float
    speed_high: float
    warnings: tuple[str, ...]

    @property
    def rms(self) -> float:
        """Gives the root mean square in N, of the force over all fitted samples."""
        return float(np.sqrt(np.mean(np.concatenate([g.residuals for g in self.groups]) ** 2)))

    def fields(self) -> dict[str, Estimate]:
        """Gives the fields of a ball's parameter file, by name.

        `speed_low`, `speed_high`, `stiffness_low`, `stiffness_growth`, `damping_low` and
        `damping_growth`; without the growths, and of the one speed, if there is one only. The
        speeds are as stated: without error.
        """
        low, high = self.speed_low, self.speed_high
        found = {
            name: Estimate(value, 0.0, (value, value), "m/s")
            for name, value in (("speed_low", low), ("speed_high", high))
        }
        for i, name in enumerate(("stiffness", "damping")):
            line = (self.stiffness, self.damping)[i]
            if line is not None:
                found[f"{name}_low"] = line.at(low)
                found[f"{name}_growth"] = line.growth(low, high)
                continue
            only = self.groups[0]
            interval = only.result.confidence_intervals[i]
            error = math.sqrt(only.covariance[i, i])
            value, unit = ((only.kb, "N/m"), (only.cb, "N*s/m"))[i]
            bounds = float(interval[0]), float(interval[1])
            found[f"{name}_low"] = Estimate(value, error, bounds, unit)
        return found

    def to_dataset(self) -> xarray.Dataset:
        """Labels by speed: estimates, standard errors, restitution and RMS.

        Lines and intervals too.
        """
        import xarray as xr

        rows = np.array([_row(group) for group in self.groups]).T
        columns = {
            name: labelled("speed", row, unit, text)
            for (name, unit, text), row in zip(_COLUMNS, rows, strict=True)
        }
        fields = self.fields()
        attributes: dict[str, Any] = {"title": "ball on a rigid plate, fitted"}
        for name, estimate in fields.items():
            attributes[f"{name} [{estimate.unit}]"] = estimate.value
            attributes[f"{name}_standard_error [{estimate.unit}]"] = estimate.standard_error
        attributes["warnings"] = "\n".join(self.warnings)
        speeds = [group.speed for group in self.groups]
        text = {"units": "m/s", "long_name": "approach speed, mean of the estimates"}
        return xr.Dataset(columns, coords={"speed": ("speed", speeds, text)}, attrs=attributes)


_COLUMNS = (
    ("kb", "N/m", "stiffness of the ball"),
    ("kb_standard_error", "N/m", "standard error of the stiffness"),
    ("cb", "N*s/m", "damping of the ball"),
    ("cb_standard_error", "N*s/m", "standard error of the damping"),
    ("speed_standard_error", "m/s", "standard error of the speed"),
    ("measured_speed", "m/s", "approach speed, mean of the measured"),
    ("impacts", "1", "number of impacts"),
    ("rms", "N", "RMS difference of the force"),
    ("peak_force", "N", "largest force measured"),
    ("restitution", "1", "rebound over approach speed, of the fitted law"),
    ("contact_time", "s", "contact time, of the fitted law"),
)


def _row(group: SpeedFit) -> tuple[float, ...]:
    forms = group.closed_forms
    errors = np.sqrt(np.diag(group.covariance))
    return (
        group.kb,
        float(errors[0]),
        group.cb,
        float(errors[1]),
        float(errors[2]),
        float(np.mean([impact.speed for impact in group.impacts])),
        len(group.impacts),
        group.rms,
        group.peak,
        float(np.mean([form.restitution for form in forms])),
        float(np.mean([form.contact_time for form in forms])),
    )


def group_by_speed(
    impacts: Sequence[BallImpact], width: float = GROUP_WIDTH
) -> list[list[BallImpact]]:
    """Repeats of one speed together, from the slowest: none is `width` (m/s) above the first."""
    groups: list[list[BallImpact]] = []
    for impact in sorted(impacts, key=lambda i: i.speed):
        if groups and impact.speed < groups[-1][0].speed + width:
            groups[-1].append(impact)
        else:
            groups.append([impact])
    return groups


def fit_ball(
    records: Sequence[BallImpact],
    mass: float,
    *,
    speed_sigma: float = SPEED_SIGMA,
    group_width: float = GROUP_WIDTH,
    weights: str | None = None,
    speed_low: float | None = None,
    speed_high: float | None = None,
    starts: int = 1,
    seed: int = 0,
    progress: Report | None = None,
) -> BallFit:
    """Fits kb and cb at each speed, and their lines over speed.

    Args:
        records: impacts, as `read_ball_impacts` returns them.
        mass: kg, of the balls that were not weighed.
        speed_sigma: m/s, standard deviation of a measured speed; 0 takes the speeds as measured.
        group_width: m/s (`group_by_speed`). Impacts of one group share kb and cb: where a setting's
            speeds scatter, a small width fits every impact by itself.
        weights: of the lines (`speed_line`); None: `scatter` from three speeds on, else `fit`.
        speed_low, speed_high: m/s, of the law, which holds its end values outside; the slowest and
            fastest group if None.
        starts, seed: of the search at each speed. The law is smooth and its first guess near: one
            start finds the minimum (tests).
        progress: called with the speeds done; `rms` (N) at the one just fitted.

    Raises:
        InputError: a number out of range, or a record that `by_speed.fit_speed` refuses.

    """
    if weights is not None and weights not in WEIGHTS:
        raise InputError("weights", weights, ", ".join(WEIGHTS))
    if not 0.0 < group_width <= 20.0:
        raise InputError("group_width", group_width, "above 0, up to 20 m/s")
    if not records:
        raise InputError("records", 0, "one or more impacts")
    grouped = group_by_speed(records, group_width)
    weights = weights or ("scatter" if len(grouped) > 2 else "fit")
    if len(grouped) == 2 and weights == "scatter":
        raise InputError("weights", weights, "fit, with two speeds")
    groups: list[SpeedFit] = []
    for group in grouped:
        found = fit_speed(group, mass, speed_sigma=speed_sigma, starts=starts, seed=seed)
        groups.append(found)
        if progress is not None:
            progress(Progress("fitting", len(groups), len(grouped), rms=groups[-1].rms))
    low, high = _range(groups, speed_low, speed_high)
    lines = _lines(groups, weights, low, high) if len(groups) > 1 else (None, None)
    warnings = [text for group in groups for text in group.warnings]
    warnings += _warnings(groups, lines, low, high)
    return BallFit(
        groups=tuple(groups),
        stiffness=lines[0],
        damping=lines[1],
        speed_low=low,
        speed_high=high,
        warnings=tuple(warnings),
    )


def _range(
    groups: Sequence[SpeedFit], low: float | None, high: float | None
) -> tuple[float, float]:
    low = groups[0].speed if low is None else low
    high = groups[-1].speed if high is None else high
    if not 0.0 < low <= high <= 100.0 or (low == high and len(groups) > 1):
        raise InputError("speed_low, speed_high", (low, high), "0 < low < high <= 100 m/s")
    return low, high


def _lines(
    groups: Sequence[SpeedFit], weights: str, low: float, high: float
) -> tuple[SpeedLine, SpeedLine]:
    # outside low to high the law holds its end values: a value there belongs to that end
    speeds = np.clip([group.speed for group in groups], low, high)
    if len(np.unique(speeds)) < 2:
        allowed = "a range that holds two or more of the measured speeds"
        raise InputError("speed_low, speed_high", (low, high), allowed)
    covariances = np.array([group.covariance for group in groups])
    kb, cb = np.array([(group.kb, group.cb) for group in groups]).T
    with_kb, with_cb = np.ix_(range(len(groups)), [0, 2], [0, 2]), np.s_[:, 1:, 1:]
    return (
        speed_line("kb", "N/m", speeds, kb, covariances[with_kb], weights=weights),
        speed_line("cb", "N*s/m", speeds, cb, covariances[with_cb], weights=weights),
    )


def _warnings(
    groups: Sequence[SpeedFit],
    lines: tuple[SpeedLine | None, SpeedLine | None],
    low: float,
    high: float,
) -> list[str]:
    if len(groups) == 1:
        return [
            f"one speed only ({groups[0].speed:.4g} m/s): growth of kb and cb with speed, and so "
            "their values at any other, are not determined"
        ]
    found = []
    if len(groups) == 2:
        found.append("two speeds: whether kb and cb are linear in speed is not tested")
    if low < groups[0].speed - BEYOND or high > groups[-1].speed + BEYOND:
        found.append(
            f"the law from {low:.4g} to {high:.4g} m/s goes beyond the measured "
            f"{groups[0].speed:.4g} to {groups[-1].speed:.4g} m/s"
        )
    for line in lines:
        if line is None:
            continue
        if line.misfit < UNLIKELY and line.scatter > ROUNDING * abs(line.level):
            found.append(
                f"{line.name} is not linear in speed within what its fits allow "
                f"(probability {line.misfit:.1g})"
            )
        if min(line.at(low).value, line.at(high).value) <= 0.0:
            found.append(f"{line.name} is not positive over {low:.4g} to {high:.4g} m/s")
    return found
