"""Fits to a table of impacts on the clamped head share what is here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import numpy as np

from drake_racket.identify.core.estimate import Estimate
from drake_racket.identify.core.problem import Problem
from drake_racket.identify.core.result import FitResult
from drake_racket.identify.strings.impact_table import Array, ImpactTable

if TYPE_CHECKING:
    import xarray


class TableProblem(Problem, Protocol):
    """Holds a problem whose measured values are those of a table."""

    @property
    def table(self) -> ImpactTable: ...  # noqa: D102
    @property
    def measured(self) -> Array:
        """Gives (m,) in `residual_unit`."""
        ...

    @property
    def residual_unit(self) -> str: ...  # noqa: D102


ProblemT = TypeVar("ProblemT", bound=TableProblem)


@dataclass(frozen=True, eq=False, kw_only=True)
class TableFit(Generic[ProblemT]):
    """Holds a fit to a table.

    Attributes:
        problem: what was fitted.  result: how it went.
        estimates: value, standard error and 95 % interval by name.
        profiled: whether the intervals are those of the likelihood profile.
        warnings: one line each; the table's first.

    """

    problem: ProblemT
    result: FitResult
    estimates: dict[str, Estimate]
    profiled: bool
    warnings: tuple[str, ...]

    @property
    def rms(self) -> float:
        """Gives root mean square difference, the paper's measure, in the measured values' unit."""
        return self.result.rms

    @property
    def modelled(self) -> Array:
        """Gives (m,) the fitted model's values."""
        return self.problem.measured + self.result.residuals

    def rms_by(self, key: str) -> dict[float, float]:
        """Gives RMS of the rows of each `point`, or of each `speed` (m/s, rounded)."""
        table = self.problem.table
        keys = table.points if key == "point" else np.round(table.speeds)
        return {
            float(k): float(np.sqrt(np.mean(self.result.residuals[keys == k] ** 2)))
            for k in np.unique(keys)
        }

    def _dataset(
        self, name: str, text: str, labels: Mapping[str, tuple[Any, str]] | None = None
    ) -> xarray.Dataset:
        """Gives the result with measured and modelled values over `measurement`.

        Args:
            name, text: of the measured quantity, for variables and for people.
            labels: more coordinates, values and unit.

        """
        table, unit = self.problem.table, self.problem.residual_unit
        found = self.result.to_dataset(
            {
                "point": (table.points.tolist(), "1"),
                "approach_speed": (table.speeds, "m/s"),
                **(labels or {}),
                "repeats": (table.repeats.tolist(), "1"),
            }
        )
        for kind, values in (("measured", self.problem.measured), ("modelled", self.modelled)):
            attributes = {"units": unit, "long_name": f"{kind} {text}"}
            found[f"{name}_{kind}"] = ("measurement", values, attributes)
        found["confidence_interval"][:] = [e.interval for e in self.estimates.values()]
        return found
