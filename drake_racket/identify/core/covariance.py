"""Tells how well data determine the parameters, by linearising at the minimum.

With the Jacobian J of the residuals over their sigma the covariance is (J^T J)^-1; where sigma is
unknown it is estimated as s^2 = sum of squares / (m - parameters determined). Directions that J
does not resolve have no finite variance: parameters with a part in them get infinite intervals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from drake_racket.identify.core.problem import Array, Parameter, Scale

CONFIDENCE = 0.95
"""A confidence level where none is given."""
RANK_TOLERANCE = 1e-6
"""Relative singular value, the columns of J of unit length, below which: undetermined."""
_NO_EFFECT = 1e-12  # relative length of a column (bounds' width times derivative) likewise
_PARTICIPATION = 1e-3  # a parameter's part in an undetermined direction that makes it undetermined
_ROUNDING = 1e-9
"""Of the way between the bounds: a step as short as this is none. Nor is any where the residuals
are this small beside what the parameters change between their bounds: data without noise."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Holds what the Jacobian at the minimum says.

    Attributes:
        covariance: (n, n); inf on the diagonal and nan beside it where not determined.
        intervals: (n, 2); infinite where not determined.
        residual_sigma: sqrt(sum of squares / degrees of freedom); nan without any.
        degrees_of_freedom: m minus the free parameters that are determined.
        directions: undetermined directions in words.
        undetermined: (n,) whether a parameter has a part in one.
        steps_away: (n,) standard errors from here to the minimum of the linearised problem.

    """

    covariance: Array
    intervals: Array
    residual_sigma: float
    degrees_of_freedom: int
    directions: tuple[str, ...]
    undetermined: np.ndarray[tuple[int], np.dtype[np.bool_]]
    steps_away: Array


def uncertainty(
    parameters: Sequence[Parameter],
    x: Array,
    residuals: Array,
    jacobian: Array,
    sigma: Array | None,
    at_bounds: np.ndarray[tuple[int], np.dtype[np.bool_]],
    *,
    rescale: bool = False,
) -> Uncertainty:
    """Gives the covariance and 95 % intervals from the Jacobian at the minimum.

    A parameter at a bound gets an infinite interval. The others' intervals are those with that
    parameter free, which are the wider ones.

    Args:
        x: (n,) estimates.
        residuals: (m,) in the measured unit, as are the rows of `jacobian`, (m, n).
        sigma: (m,) or None: unknown.
        at_bounds: (n,) which parameters are at a bound.
        rescale: take sigma as relative only, and scale it by the residuals.

    """
    slope = Scale(parameters).slope(x)
    weight = np.ones_like(residuals) if sigma is None else 1.0 / sigma
    scaled, weighted = jacobian * slope * weight[:, None], residuals * weight
    covariance, null = _inverse(scaled)
    free = ~at_bounds
    free_covariance, free_null = _inverse(scaled[:, free])
    freedom = len(residuals) - (int(free.sum()) - free_null.shape[1])
    square = float(weighted @ weighted) / freedom if freedom > 0 else np.nan
    estimated = sigma is None or rescale
    factor = square if estimated else 1.0

    involved = np.sqrt(np.sum(_unit_columns(scaled, null) ** 2, axis=1)) > _PARTICIPATION
    open_ended = involved | at_bounds | ~np.isfinite(factor)
    covariance = covariance * np.outer(slope, slope) * factor
    covariance[open_ended, :] = covariance[:, open_ended] = np.nan
    covariance[open_ended, open_ended] = np.inf
    half = quantile(CONFIDENCE, freedom if estimated else None) * np.sqrt(np.diag(covariance))

    steps = np.zeros(len(x))
    gradient = scaled[:, free].T @ weighted
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.abs(free_covariance @ gradient)
        away = step / np.sqrt(np.diag(free_covariance) * factor)
    if np.linalg.norm(weighted) > _ROUNDING * np.linalg.norm(scaled):
        steps[free] = np.where(np.isfinite(away) & (step > _ROUNDING), away, 0.0)
    return Uncertainty(
        covariance=covariance,
        intervals=np.stack([x - half, x + half], axis=1),
        residual_sigma=float(np.sqrt(square)),
        degrees_of_freedom=freedom,
        directions=tuple(_in_words(parameters, slope * v) for v in null.T),
        undetermined=involved,
        steps_away=steps,
    )


def quantile(confidence: float, freedom: int | None) -> float:
    """Gives the two-sided quantile: normal, or Student's t where the noise is estimated."""
    tail = 0.5 * (1.0 + confidence)
    if freedom is None:
        return float(stats.norm.ppf(tail))
    return float(stats.t.ppf(tail, freedom)) if freedom > 0 else np.inf


def _lengths(scaled: Array) -> Array:
    """(n,) lengths of the columns; 0 where a column has no effect."""
    lengths = np.linalg.norm(scaled, axis=0)
    longest = lengths.max(initial=0.0)
    return np.where(lengths > _NO_EFFECT * longest, lengths, 0.0)


def _unit_columns(scaled: Array, directions: Array) -> Array:
    """`directions` (n, k) of u, in units that make every column of `scaled` of length one."""
    lengths = _lengths(scaled)
    return directions * np.where(lengths > 0.0, lengths, 1.0)[:, None]


def _inverse(scaled: Array) -> tuple[Array, Array]:
    """(J^T J)^+ over the resolved directions, (n, n), and the others as columns, (n, k).

    The columns are brought to unit length first, so that neither units nor the width of the
    bounds decide what is resolved.
    """
    count = scaled.shape[1]
    lengths = _lengths(scaled)
    divisor = np.where(lengths > 0.0, lengths, 1.0)
    unit = np.where(lengths > 0.0, scaled / divisor, 0.0)
    short = max(count - len(unit), 0)  # rows of zeros, so that V comes whole
    _, values, rows = np.linalg.svd(np.vstack([unit, np.zeros((short, count))]), False)
    kept = values > RANK_TOLERANCE * values.max(initial=0.0)
    part = rows[kept] / values[kept][:, None] / divisor
    return part.T @ part, rows[~kept].T / divisor[:, None]


def _in_words(parameters: Sequence[Parameter], direction: Array) -> str:
    """An undetermined direction (n,), in the parameters' units, as a sentence."""
    widths = np.array([p.upper - p.lower for p in parameters])
    share = np.abs(direction) / widths
    chosen = [i for i in np.argsort(-share, kind="stable") if share[i] > 0.01 * share.max()]
    if len(chosen) == 1:
        return f"the data do not determine {parameters[chosen[0]].name}"
    first = chosen[0]
    # a tenth of the bounds' width of the first, and what goes with it
    step = direction * 0.1 * widths[first] / direction[first]
    moves = ", ".join(
        f"{parameters[i].name} by {step[i]:+.3g} {parameters[i].unit}".rstrip() for i in chosen
    )
    return f"the data do not tell apart (together, to first order): {moves}"
