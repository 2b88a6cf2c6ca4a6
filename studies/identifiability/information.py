"""Which of a string-bed's parameters measurements determine, and which only together.

The measurements' derivatives by the logarithms of the parameters, over their standard deviations,
are the scaled Jacobian J. Its singular values s_i and right singular vectors v_i say how well the
combination v_i . ln(parameters) is known: to 1/s_i. (J^T J)^-1 is the least covariance that any
unbiased estimate can have (Cramer-Rao); the square roots of its diagonal are the relative standard
errors. Where they are not small the estimate is no more linear in the data: an error of 300 % means
"not determined", not a number (`identifiability_refits` has the profiles and real refits).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from drake_racket import (
    RACKETS,
    TENSIONS,
    BallParameters,
    InputError,
    RacketParameters,
    load_ball,
    load_racket,
    string_bed_model,
)
from drake_racket.engines import Array
from studies.identifiability.cases import Case
from studies.identifiability.measurements import (
    BALL_NAMES,
    Block,
    Design,
    Errors,
    all_names,
    measure,
)

if TYPE_CHECKING:
    import xarray

LEVELS = (0.1, 1.0)
"""Relative standard errors up to which a parameter counts as determined."""

_RESOLVED = 1e-10  # relative singular value below which a direction is lost in rounding


@dataclass(frozen=True)
class Information:
    """What a case tells of n parameters.

    Attributes:
        names: of the parameters; standard errors and directions are in their logarithms.
        singular_values: (n,) of the scaled Jacobian, largest first; 0 for missing rows.
        directions: (n, n) a right singular vector in each row.
        standard_errors: (n,) relative; inf where not determined at all.
        alone: (n,) the same with all other parameters known.
        covariance: (n, n) of the logarithms over the resolved directions.

    """

    names: tuple[str, ...]
    singular_values: Array
    directions: Array
    standard_errors: Array
    alone: Array
    covariance: Array

    @property
    def correlation(self) -> Array:
        """(n, n)."""
        size = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(size, size))

    def error_of(self, weights: dict[str, float]) -> float:
        """Standard error of a product of powers: name -> exponent. inf where not determined."""
        direction = np.array([weights.get(name, 0.0) for name in self.names])
        lost = ~_resolved(self.singular_values)
        if np.any(np.abs(self.directions[lost] @ direction) > 1e-6):
            return float(np.inf)
        return float(np.sqrt(direction @ self.covariance @ direction))


def _resolved(values: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return np.asarray(values > _RESOLVED * values.max(initial=0.0))


def information(names: Sequence[str], scaled: Array) -> Information:
    """Analyses a scaled Jacobian.

    Args:
        names: n of them.
        scaled: (m, n) derivatives by the logarithms of the parameters over standard deviations.

    """
    count = len(names)
    short = max(count - len(scaled), 0)
    rows = np.vstack([scaled, np.zeros((short, count))])  # so that V comes whole
    _, values, directions = np.linalg.svd(rows, full_matrices=False)
    kept = _resolved(values)
    part = directions[kept] / values[kept, None]
    covariance = part.T @ part
    lost = np.max(np.abs(directions[~kept]), axis=0, initial=0.0) > 1e-6
    length = np.linalg.norm(scaled, axis=0)
    with np.errstate(divide="ignore"):
        alone = 1.0 / length
    errors = np.where(lost, np.inf, np.sqrt(np.diag(covariance)))
    return Information(tuple(names), values, directions, errors, alone, covariance)


def analyse(
    racket: RacketParameters,
    ball: BallParameters,
    case: Case,
    blocks: dict[str, Block] | None = None,
) -> Information:
    """What a case tells of a racket's bed, and of the ball where that is not held.

    Args:
        blocks: the predictions, where they are at hand (`measure`, same design and errors).

    """
    if blocks is None:
        blocks = measure(racket, ball, case.quantities, design=case.design, errors=case.errors)
    names = all_names(racket)
    scaled = np.vstack([blocks[q].scaled for q in case.quantities])
    if case.ball == "held":
        names = names[: -len(BALL_NAMES)]
        scaled = scaled[:, : len(names)]
    if case.ball == "prior":
        known = np.eye(len(names))[-len(BALL_NAMES) :] / case.errors.ball
        scaled = np.vstack([scaled, known])
    return information(names, scaled)


def rim_pairs(racket: RacketParameters) -> list[tuple[str, str]]:
    """(p, k) of each group of rim springs, by p."""
    model = string_bed_model(racket)
    pairs = zip(model.rim_factor_index.tolist(), model.stiffness_index.tolist(), strict=True)
    return [(f"p{p + 1}", f"k{k + 1}") for p, k in sorted(set(pairs)) if p >= 0]


def identifiability_dataset(
    cases: Sequence[Case],
    *,
    rackets: Sequence[str] = RACKETS,
    tensions: Sequence[str] = TENSIONS,
    progress: Callable[[str], None] | None = None,
) -> xarray.Dataset:
    """Analyses cases for published beds.

    Args:
        progress: called with a bed's name before it is computed.

    Returns:
        A Dataset over bed, case, parameter (and `other`, `direction`, `rim_group`, `level`):
        standard_error, error_alone, correlation; singular_value, vector; of each rim spring
        product_error (of p k) and rim_correlation (of p with k); parameters_determined and
        directions_determined up to each level. The ball's entries are nan where it is held;
        counts are of the bed's parameters, and of the directions of all that are fitted.

    Raises:
        InputError: no case, or two with one name; unknown racket or tension.

    """
    import xarray

    labels = [case.name for case in cases]
    if not labels or len(set(labels)) < len(labels):
        raise InputError("cases", labels, "at least one, each name once")
    ball = load_ball()
    beds, names, groups = [], [""], [("", "")]
    tables: list[list[dict[str, Array]]] = []
    for name in rackets:
        for tension in tensions:
            racket = load_racket(name, tension)
            beds.append(f"{name} {tension}")
            if progress is not None:
                progress(beds[-1])
            names, groups = list(all_names(racket)), rim_pairs(racket)
            found = _informations(racket, ball, cases)
            tables.append([_table(i, len(names), groups) for i in found])
    dimensions = {
        "standard_error": ("parameter",),
        "error_alone": ("parameter",),
        "correlation": ("parameter", "other"),
        "singular_value": ("direction",),
        "vector": ("direction", "parameter"),
        "product_error": ("rim_group",),
        "rim_correlation": ("rim_group",),
        "parameters_determined": ("level",),
        "directions_determined": ("level",),
    }
    texts = {
        "standard_error": "relative standard error (Cramer-Rao)",
        "error_alone": "relative standard error with all other parameters known",
        "correlation": "correlation of the logarithms",
        "singular_value": "singular value of the scaled Jacobian",
        "vector": "right singular vector, in the logarithms of the parameters",
        "product_error": "relative standard error of p k of a rim spring",
        "rim_correlation": "correlation of p and k of a rim spring",
        "parameters_determined": "parameters of the bed with at most this error",
        "directions_determined": "singular directions with at most this error",
    }
    coordinates = {
        "bed": (beds, "string-bed"),
        "case": (labels, "measurements"),
        "parameter": (names, "parameter"),
        "other": (names, "other parameter"),
        "direction": (list(range(1, len(names) + 1)), "number of the singular direction"),
        "rim_group": ([f"{p}*{k}" for p, k in groups], "rim springs"),
        "level": (list(LEVELS), "largest relative standard error"),
    }
    return xarray.Dataset(
        {
            key: (
                ("bed", "case", *over),
                np.array([[table[key] for table in row] for row in tables]),
                {"units": "1", "long_name": texts[key]},
            )
            for key, over in dimensions.items()
        },
        coords={
            key: (key, values, {"units": "1", "long_name": text})
            for key, (values, text) in coordinates.items()
        },
        attrs={"title": "Identifiability of the string-bed's parameters"},
    )


def _informations(
    racket: RacketParameters, ball: BallParameters, cases: Sequence[Case]
) -> list[Information]:
    """All cases of one bed; what several cases measure is computed once."""
    wanted: dict[tuple[Design, Errors], set[str]] = {}
    for case in cases:
        wanted.setdefault((case.design, case.errors), set()).update(case.quantities)
    blocks = {
        key: measure(racket, ball, sorted(quantities), design=key[0], errors=key[1])
        for key, quantities in wanted.items()
    }
    return [analyse(racket, ball, case, blocks[case.design, case.errors]) for case in cases]


def _table(found: Information, size: int, groups: Sequence[tuple[str, str]]) -> dict[str, Array]:
    """The numbers of one case, filled up with nan to `size` parameters."""
    count = len(found.names)

    def filled(array: Array) -> Array:
        whole = np.full((size,) * array.ndim, np.nan)
        whole[(slice(count),) * array.ndim] = array
        return whole

    at = {name: i for i, name in enumerate(found.names)}
    correlation = found.correlation
    of_bed = found.standard_errors[: size - len(BALL_NAMES)]
    return {
        "standard_error": filled(found.standard_errors),
        "error_alone": filled(found.alone),
        "correlation": filled(correlation),
        "singular_value": filled(found.singular_values),
        "vector": filled(found.directions),
        "product_error": np.array([found.error_of({p: 1.0, k: 1.0}) for p, k in groups]),
        "rim_correlation": np.array([correlation[at[p], at[k]] for p, k in groups]),
        "parameters_determined": np.array([(of_bed <= level).sum() for level in LEVELS]),
        "directions_determined": np.array(
            [(found.singular_values >= 1.0 / level).sum() for level in LEVELS]
        ),
    }
