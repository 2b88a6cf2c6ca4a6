"""A result says what a fit found: estimates, their uncertainty, residuals and how it converged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.identify.core.problem import Array, Parameter
from drake_racket.io.errors import InputError
from drake_racket.io.numbers import json_text
from drake_racket.io.units import labelled

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False)
class StartRecord:
    """Says how one start of a fit, or an annealing run, went.

    Attributes:
        number: which start, from 0.
        start: (n,) where it began.
        estimates: (n,) where it ended; nan where the model had no solution at the start.
        cost: sum of squares there, each residual over its sigma where that is known; inf likewise.
        rms: root mean square residual there, in the measured unit.
        evaluations: of the residuals, those read back from a checkpoint included.
        converged: whether it stopped by its tolerance.
        status: in words.
        history: (k, 2) number of the evaluation and RMS, wherever the cost fell.

    """

    number: int
    start: Array
    estimates: Array
    cost: float
    rms: float
    evaluations: int
    converged: bool
    status: str
    history: Array


@dataclass(frozen=True, eq=False)
class FitResult:
    """Holds the estimates with their uncertainty.

    Attributes:
        title: the problem's.
        method: "least squares", "simulated annealing", ...
        parameters: n of them.
        estimates: (n,).
        covariance: (n, n); inf on the diagonal, nan beside it, where a parameter is undetermined
            or at a bound.
        confidence_intervals: (n, 2) at 95 %; infinite likewise.
        rms: sqrt(mean(residuals^2)), in the measured unit: the paper's measure.
        residuals: (m,) model minus measured, in the measured unit.
        residual_unit: that unit; empty where the problem does not say.
        sigma: (m,) as given; None where it was estimated from the residuals.
        residual_sigma: standard deviation of the residuals as estimated from them (sigma unknown),
            or the square root of the reduced chi squared (sigma known).
        degrees_of_freedom: measured values minus parameters that were determined.
        undetermined: the directions that the data do not determine, in words.
        undetermined_parameters: the names that occur in them.
        at_bounds: names of parameters at a bound.
        convergence: one record per start.
        evaluations: of the residuals, in all starts.
        seconds: wall-clock time of this run, without what an earlier run left in a checkpoint.
        warnings: in words, one line each.

    """

    title: str
    method: str
    parameters: tuple[Parameter, ...]
    estimates: Array
    covariance: Array
    confidence_intervals: Array
    rms: float
    residuals: Array
    residual_unit: str
    sigma: Array | None
    residual_sigma: float
    degrees_of_freedom: int
    undetermined: tuple[str, ...]
    undetermined_parameters: tuple[str, ...]
    at_bounds: tuple[str, ...]
    convergence: tuple[StartRecord, ...]
    evaluations: int
    seconds: float
    seed: int
    fingerprint: str
    versions: Mapping[str, str]
    warnings: tuple[str, ...]
    rescaled: bool

    @property
    def names(self) -> tuple[str, ...]:
        """Gives the parameters' names."""
        return tuple(p.name for p in self.parameters)

    @property
    def values(self) -> dict[str, float]:
        """Gives the estimates by name."""
        return dict(zip(self.names, map(float, self.estimates), strict=True))

    @property
    def standard_errors(self) -> Array:
        """Gives the standard errors (n,); inf where not determined."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Array:
        """Gives the correlations (n, n); nan where not determined."""
        errors = np.where(np.isfinite(self.standard_errors), self.standard_errors, np.nan)
        with np.errstate(invalid="ignore"):  # 0/0 where the data have no noise at all
            return np.asarray(self.covariance / np.outer(errors, errors))

    def index(self, name: str) -> int:
        """Gives the position of a parameter.

        Raises:
            InputError: no such parameter.

        """
        if name not in self.names:
            raise InputError("parameter", name, " | ".join(self.names))
        return self.names.index(name)

    def to_dataset(
        self, labels: Mapping[str, tuple[Sequence[Any] | Array, str]] | None = None
    ) -> xarray.Dataset:
        """Labels estimates, uncertainty, residuals and the starts as a Dataset.

        Args:
            labels: coordinates of the measured values: name to ((m,) values, unit), as
                {"speed": (speeds, "m/s"), "point": (points, "")}.

        """
        import xarray

        one, two = ("parameter",), ("parameter", "parameter_2")
        table: dict[str, tuple[Any, Any, str, str]] = {
            "estimate": (one, self.estimates, "parameter_unit", "estimate"),
            "standard_error": (one, self.standard_errors, "parameter_unit", "standard error"),
            "confidence_interval": (
                ("parameter", "end"),
                self.confidence_intervals,
                "parameter_unit",
                "95 % confidence interval",
            ),
            "covariance": (two, self.covariance, "product of parameter_units", "covariance"),
            "correlation": (two, self.correlation, "1", "correlation of the estimates"),
            "residual": (("measurement",), self.residuals, self.residual_unit, "model - measured"),
        }
        if self.sigma is not None:
            text = "standard deviation of the measured value"
            table["sigma"] = (("measurement",), self.sigma, self.residual_unit, text)
        records, start = self.convergence, ("start",)
        table |= {
            "start_point": (
                ("start", "parameter"),
                np.array([r.start for r in records]),
                "parameter_unit",
                "where a start began",
            ),
            "start_estimate": (
                ("start", "parameter"),
                np.array([r.estimates for r in records]),
                "parameter_unit",
                "where a start ended",
            ),
            "start_rms": (start, [r.rms for r in records], self.residual_unit, "RMS it ended at"),
            "start_evaluations": (start, [r.evaluations for r in records], "1", "evaluations"),
            "start_status": (start, [r.status for r in records], "", "how it stopped"),
        }
        coordinates = {
            "parameter": ("parameter", list(self.names), "", "parameter"),
            "parameter_2": ("parameter_2", list(self.names), "", "parameter"),
            "parameter_unit": ("parameter", [p.unit for p in self.parameters], "", "unit"),
            "end": ("end", ["lower", "upper"], "", "end of the interval"),
            "start": ("start", [r.number for r in records], "1", "number of the start"),
        }
        for name, (values, unit) in (labels or {}).items():
            coordinates[name] = ("measurement", list(values), unit, name)
        attributes = {"title": self.title, "method": self.method, "rms": self.rms}
        attributes |= {"degrees_of_freedom": self.degrees_of_freedom, "seed": self.seed}
        attributes |= {"evaluations": self.evaluations, "fingerprint": self.fingerprint}
        notes = {"undetermined": self.undetermined, "warnings": self.warnings}
        notes["at_bounds"] = self.at_bounds
        attributes |= {key: "; ".join(texts) for key, texts in notes.items()}
        return xarray.Dataset(
            {n: labelled(d, v, u, t) for n, (d, v, u, t) in table.items()},
            {n: labelled(d, v, u, t) for n, (d, v, u, t) in coordinates.items()},
            attributes,
        )

    def to_json(self) -> str:
        """Gives the result as JSON text; null stands for what is not finite."""
        apart = ("parameters", "estimates", "confidence_intervals", "rescaled")
        content = {name: value for name, value in vars(self).items() if name not in apart}
        content |= {"correlation": self.correlation, "sigma_rescaled": self.rescaled}
        content["parameters"] = [
            {
                "name": p.name,
                "unit": p.unit,
                "estimate": self.estimates[i],
                "standard_error": self.standard_errors[i],
                "confidence_interval_95": self.confidence_intervals[i],
                "bounds": (p.lower, p.upper),
                "start": p.start,
            }
            for i, p in enumerate(self.parameters)
        ]
        return json_text(content)
