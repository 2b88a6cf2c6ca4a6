"""Tells which parameters decide an output: Sobol indices from a sweep, with intervals.

    design = sobol_design({"tension": Span(200, 320, "N"), "ball.mass": Span(0.9, 1.1, "1", True)},
                          samples=64, seed=1)
    sweep = make_sweep(base, {"row": design.axis()}, ["restitution"])
    indices = sobol_indices(design, run_sweep(sweep, directory), ["restitution"])

Every parameter is independent and uniform over its span. The first-order index is the share of an
output's variance that a parameter explains alone; the total index is the share that is lost with it
held, what it does together with others included. Design and estimators are SALib's (extra
`sensitivity`): Saltelli's rows (2002, doi:10.1016/S0010-4655(02)00280-1) from a scrambled Sobol
sequence, N (D + 2) of them for D parameters, and the estimators of Saltelli et al. (2010,
doi:10.1016/j.cpc.2009.09.018).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.io.units import labelled

if TYPE_CHECKING:
    import xarray

RESAMPLES = 1000
"""Of the bootstrap behind the confidence intervals."""

CONSTANT = 1e-9
"""An output that varies by less than this share of its size has nothing to be shared out."""


@dataclass(frozen=True)
class Span:
    """A span says where a parameter may lie: uniformly between two numbers.

    Attributes:
        low, high: the ends, in this unit.
        unit: as an axis of a sweep wants it for this key.
        relative: factors of what the base has; the unit is then 1.

    """

    low: float
    high: float
    unit: str = "1"
    relative: bool = False


@dataclass(frozen=True)
class SobolDesign:
    """The design holds Saltelli's rows. Make one with `sobol_design`.

    Attributes:
        parameters: name -> span, in the order of the columns.
        samples: N, of the base sequence; there are N (D + 2) rows.
        seed: of its scrambling.
        rows: (N (D + 2), D) values of the parameters.

    """

    parameters: Mapping[str, Span]
    samples: int
    seed: int
    rows: NDArray[np.float64]

    def column(self, name: str) -> NDArray[np.float64]:
        """Gives the values of one parameter, row by row; raises InputError for an unknown name."""
        if name not in self.parameters:
            raise InputError("SobolDesign.column: name", name, ", ".join(self.parameters))
        values: NDArray[np.float64] = self.rows[:, list(self.parameters).index(name)]
        return values

    def axis(self) -> dict[str, Any]:
        """The rows as an axis for `make_sweep`, if the parameters' names are keys."""
        keys = {n: {"unit": s.unit, "relative": s.relative} for n, s in self.parameters.items()}
        return {"keys": keys, "rows": self.rows.tolist()}


def sobol_design(parameters: Mapping[str, Span], samples: int, seed: int) -> SobolDesign:
    """Makes rows from which `sobol_indices` can tell the parameters' shares.

    The names may be keys of a sweep, or others that the caller turns into keys (one number that
    moves two of them, say).

    Args:
        samples: N, a power of 2; the confidence intervals shrink with its root.

    Raises:
        InputError: SALib is missing, there are fewer than two parameters, a span is empty, or
            `samples` or `seed` does not fit.

    """
    _need_salib()
    from SALib.sample import sobol

    if len(parameters) < 2:
        raise InputError("sobol_design: parameters", list(parameters), "two or more")
    for name, span in parameters.items():
        if not (math.isfinite(span.low) and math.isfinite(span.high) and span.low < span.high):
            raise InputError(name, (span.low, span.high), "two finite numbers, low below high")
    if isinstance(samples, bool) or not isinstance(samples, int):
        raise InputError("samples", samples, "a power of 2, at least 4")
    if samples < 4 or samples & (samples - 1):
        raise InputError("samples", samples, "a power of 2, at least 4")
    _check_seed(seed)
    generator = np.random.default_rng(seed)
    rows = sobol.sample(_problem(parameters), samples, calc_second_order=False, seed=generator)
    return SobolDesign(dict(parameters), samples, seed, np.asarray(rows, dtype=float))


def sobol_indices(
    design: SobolDesign,
    dataset: xarray.Dataset,
    outputs: Sequence[str],
    *,
    seed: int = 1,
    confidence: float = 0.95,
) -> xarray.Dataset:
    """Computes first-order and total Sobol indices of each output.

    An estimate can be a little below 0 or above 1: it is given as it comes out. The half-widths are
    those of a normal distribution with the bootstrap's standard deviation; they say how well these
    rows tell the index, and nothing of the model or the spans.

    Args:
        design: what the rows were made from.
        dataset: with the outputs along one dimension, in the design's order: what `run_sweep`
            returns, or any other.
        outputs: names of variables.
        seed: of the bootstrap.
        confidence: of the intervals, a share: 0.95 for 95 %.

    Returns:
        A Dataset over (output, parameter): `first_order`, `first_order_half_width`, `total`,
        `total_half_width`; and along `parameter` the spans.

    Raises:
        InputError: SALib is missing, an output is unknown, constant, or of another length than the
            design, the dataset is of another design, or rows have no result (the design is of no
            use without them: no row is left away or made up).

    """
    _need_salib()
    import xarray
    from SALib.analyze import sobol

    _check_seed(seed)
    if not 0.0 < confidence < 1.0:
        raise InputError("confidence", confidence, "between 0 and 1")
    if not outputs:
        raise InputError("outputs", "none", "at least one name")
    _check_design(design, dataset)
    names = ("S1", "S1_conf", "ST", "ST_conf")
    table = np.zeros((len(names), len(outputs), len(design.parameters)))
    for i, output in enumerate(outputs):
        found = sobol.analyze(
            _problem(design.parameters),
            _values(design, dataset, output),
            calc_second_order=False,
            num_resamples=RESAMPLES,
            conf_level=confidence,
            seed=np.random.default_rng(seed),  # a bare 0 would be no seed to SALib
        )
        table[:, i] = [found[name] for name in names]
    interval = f"half-width of its {100.0 * confidence:g} % confidence interval"
    texts = {
        "first_order": "share of the variance by this parameter alone",
        "first_order_half_width": interval,
        "total": "share of the variance with what it does together with others",
        "total_half_width": interval,
    }
    spans = design.parameters.values()
    labels: dict[str, Any] = {
        "output": labelled("output", list(outputs), "", "output"),
        "parameter": labelled("parameter", list(design.parameters), "", "parameter"),
        "low": labelled("parameter", [s.low for s in spans], "see unit", "from"),
        "high": labelled("parameter", [s.high for s in spans], "see unit", "to"),
        "unit": labelled("parameter", [s.unit for s in spans], "", "unit"),
    }
    return xarray.Dataset(
        {
            name: labelled(("output", "parameter"), table[i], "1", text)
            for i, (name, text) in enumerate(texts.items())
        },
        coords=labels,
        attrs={
            "title": "Sobol indices",
            "samples": design.samples,
            "rows": len(design.rows),
            "design_seed": design.seed,
            "bootstrap_seed": seed,
            "bootstrap_resamples": RESAMPLES,
            "confidence": confidence,
            "source": "Saltelli et al. (2010), doi:10.1016/j.cpc.2009.09.018; computed by SALib",
        },
    )


def _problem(parameters: Mapping[str, Span]) -> dict[str, Any]:
    """The parameters as SALib wants them."""
    return {
        "num_vars": len(parameters),
        "names": list(parameters),
        "bounds": [[span.low, span.high] for span in parameters.values()],
    }


def _values(design: SobolDesign, dataset: xarray.Dataset, output: str) -> NDArray[np.float64]:
    """An output, row by row; refuses what SALib would make nonsense of."""
    if output not in dataset.data_vars:
        known = [str(n) for n, v in dataset.data_vars.items() if v.dtype.kind == "f"]
        raise InputError("outputs", output, ", ".join(known))
    values = dataset[output]
    if values.ndim != 1 or values.size != len(design.rows):
        allowed = f"one dimension with the design's {len(design.rows)} rows"
        raise InputError(f"outputs: {output}", dict(values.sizes), allowed)
    numbers = values.to_numpy().astype(float)
    missing = np.flatnonzero(~np.isfinite(numbers))
    if missing.size:
        raise InputError(
            f"outputs: {output}",
            f"no result in {missing.size} of {numbers.size} rows{_reason(dataset, missing)}",
            "a result in every row (Saltelli's design is of no use without: narrow the spans)",
        )
    if not np.ptp(numbers) > CONSTANT * np.abs(numbers).max():
        raise InputError(f"outputs: {output}", float(numbers[0]), "an output that varies")
    return numbers


def _reason(dataset: xarray.Dataset, rows: NDArray[np.intp]) -> str:
    """Why the first row has no result, if the sweep knows."""
    text = ""
    if "failure" in dataset:
        said = [str(x) for x in dataset["failure"].to_numpy()[rows] if x]
        text = f": {said[0]}" if said else ""
    return f", the first is {rows[0]}{text}"


def _check_design(design: SobolDesign, dataset: xarray.Dataset) -> None:
    """Refuses a dataset whose coordinates have other values than the design's rows."""
    for name in design.parameters:
        if name not in dataset.coords:
            continue
        there = dataset[name].to_numpy()
        here = design.column(name)
        if there.shape != here.shape or not np.array_equal(there.astype(float), here):
            raise InputError(f"dataset: {name}", "other values", "those of the design's rows")


def _check_seed(seed: int) -> None:
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise InputError("seed", seed, "a whole number, 0 or more")


def _need_salib() -> None:
    if find_spec("SALib") is None:
        allowed = 'installed, with: pip install "drake-racket[sensitivity]"'
        raise InputError("SALib", "not installed", allowed)
