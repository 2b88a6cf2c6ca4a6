"""Fits tension, stiffnesses and rim factors of a string-bed to restitution, head clamped.

Glynn et al. 2011 fit T0, k1-k4 and p1-p6 to normal impacts at nine points and six speeds, and for
another tension T0 alone. The residuals are modelled less measured restitution; the model is the
batch kernel (`clamped`) with its exact derivatives. All parameters are positive and searched on a
logarithmic scale, by default from a tenth to ten times the start.

In this model the ball meets the mass of its point wherever in its cell it comes down: an error of
aim of a millimetre has no effect on a normal impact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from drake_racket.engines.clamped.batch import (
    STEP,
    Impacts,
    bed_parameters,
    make_bed,
    make_impacts,
    run,
)
from drake_racket.identify.core.intervals import profile_interval
from drake_racket.identify.core.problem import Parameter
from drake_racket.identify.core.search import (
    Search,
    estimates,
    fingerprint,
    loose,
    search,
    short_title,
)
from drake_racket.identify.strings.restitution_table import RestitutionTable
from drake_racket.identify.strings.table_fit import TableFit
from drake_racket.identify.strings.table_rows import beyond
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Report
from drake_racket.laws.compilation import HAS_NUMBA
from drake_racket.parameters.ball import BallParameters
from drake_racket.parameters.racket import RacketParameters

if TYPE_CHECKING:
    import xarray

Array: TypeAlias = NDArray[np.float64]

SPAN = 10.0
"""Bounds: the start divided and multiplied by this."""

ANNEALING_SPAN = 3.0
"""The same for annealing, whose chains are caught in other valleys within wide bounds."""

_UNITS = {"T": "N", "k": "N/m", "p": "1"}


@dataclass(frozen=True, eq=False)
class StringBedProblem:
    """Holds the restitution of one string-bed (`problem.Problem`).

    Attributes:
        table: the measurements.
        racket: gives what is not fitted.
        ball: with kb and cb over speed.
        parameters: the free ones, named as in `bed_parameters`.
        step: s, of the kernel.

    """

    table: RestitutionTable
    racket: RacketParameters
    ball: BallParameters
    parameters: tuple[Parameter, ...]
    title: str
    step: float = STEP
    residual_unit: str = "1"

    @property
    def sigma(self) -> Array | None:
        """Gives the table's standard deviations, (m,)."""
        return self.table.sigma

    @property
    def measured(self) -> Array:
        """Gives (m,) restitution."""
        return self.table.restitution

    @cached_property
    def _impacts(self) -> tuple[Impacts, Impacts]:
        """Without and with room for derivatives."""
        points, speeds = self.table.points, self.table.speeds
        plain = make_impacts(self.racket, self.ball, points, speeds)
        return plain, make_impacts(
            self.racket, self.ball, points, speeds, free=len(self.parameters)
        )

    @cached_property
    def _index(self) -> list[int]:
        names, _ = bed_parameters(self.racket)
        return [names.index(p.name) for p in self.parameters]

    def bed_values(self, x: Array) -> Array:
        """Gives all parameters of the bed, the free ones replaced by x (n,)."""
        values = bed_parameters(self.racket)[1]
        values[self._index] = x
        return values

    def residuals(self, x: Array) -> Array:
        """Gives (m,) modelled less measured restitution; nan where the ball does not come away."""
        impacts = self._impacts[0]
        outcome = run([make_bed(self.racket, self.bed_values(x))], impacts, step=self.step)
        modelled = np.where(outcome.ended, outcome.restitution(impacts)[0], np.nan)
        return np.asarray(modelled - self.measured)

    def jacobian(self, x: Array) -> Array:
        """Gives the derivatives of the residuals, (m, n)."""
        free = [p.name for p in self.parameters]
        impacts = self._impacts[1]
        bed = make_bed(self.racket, self.bed_values(x), free)
        return run([bed], impacts, step=self.step).restitution(impacts)[1]

    def fingerprint(self) -> str:
        """Gives the hash of the data, the racket, the ball and the kernel's settings."""
        return fingerprint(
            self.racket,
            self.ball,
            [self.table.points, self.table.speeds, self.table.restitution, self.table.sigma],
            f"restitution {self.step!r} {HAS_NUMBA}",
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class StringBedFit(TableFit[StringBedProblem]):
    """The fit holds a fitted string-bed; its RMS of 0.01 is the paper's 1 %."""

    def to_dataset(self) -> xarray.Dataset:
        """Gives the result with measured and modelled restitution over `measurement`."""
        return self._dataset("restitution", "restitution")


def free_parameters(
    racket: RacketParameters,
    free: Sequence[str] | None = None,
    start: Mapping[str, float] | None = None,
    span: float = SPAN,
) -> tuple[Parameter, ...]:
    """Gives the parameters to fit, with bounds about their start.

    Args:
        free: names; all of the bed's if None.
        start: values to begin at; the racket's where none is given.
        span: lower bound = start / span, upper = start * span.

    Raises:
        InputError: an unknown name or one twice, a start that is not positive, a start for a
            parameter that is not free, or a span that is not above 1 and up to 1000.

    """
    names, own = bed_parameters(racket)
    wanted = list(names if free is None else free)
    for name in wanted:
        if name not in names or wanted.count(name) > 1:
            raise InputError("free", name, f"each once, of {', '.join(names)}")
    if not wanted:
        raise InputError("free", "no parameter", f"one or more of {', '.join(names)}")
    begin = dict(start or {})
    for name, value in begin.items():
        if name not in wanted:
            raise InputError("start", name, f"a parameter that is fitted: {', '.join(wanted)}")
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"start: {name}", value, "a positive number")
    if not 1.0 < span <= 1000.0:
        raise InputError("span", span, "above 1, up to 1000")
    values = {n: begin.get(n, float(own[names.index(n)])) for n in wanted}
    return tuple(Parameter(n, _UNITS[n[0]], v / span, v * span, v) for n, v in values.items())


def fit_string_bed(
    table: RestitutionTable,
    racket: RacketParameters,
    ball: BallParameters,
    *,
    free: Sequence[str] | None = None,
    start: Mapping[str, float] | None = None,
    span: float | None = None,
    options: Search | None = None,
    profiles: bool = False,
    checkpoint: str | Path | None = None,
    progress: Report | None = None,
) -> StringBedFit:
    """Fits a string-bed to restitution.

    Args:
        table: as `tables.read_restitution` gives it, averaged or not.
        racket, ball: what is not fitted, and the first guess.
        free, start, span: see `free_parameters` (SI units; the span is a ratio); a span of None is
            SPAN, or ANNEALING_SPAN where the method is annealing.
        options: method, starts, seed ... (`search.Search`).
        profiles: intervals from likelihood profiles: slower, and right where parameters trade off.
        checkpoint: directory of the checkpoint; a killed run goes on from it.
        progress: called with how far it is; `total` is 1, `rms` the lowest so far.

    Raises:
        InputError: options or start values out of range, a table with fewer rows than free
            parameters and no standard deviations, or a checkpoint of another fit.

    """
    checkpoint = None if checkpoint is None else Path(checkpoint)
    options = options or Search()
    if span is None:
        span = ANNEALING_SPAN if options.method == "annealing" else SPAN
    parameters = free_parameters(racket, free, start, span)
    title = short_title(racket, [p.name for p in parameters])
    problem = StringBedProblem(table, racket, ball, parameters, title)
    if len(table.points) < len(parameters):
        raise InputError(
            f"{table.where}: rows",
            f"{len(table.points)} for {len(parameters)} free parameters",
            "at least as many rows as free parameters (see --free)",
        )
    result = search(problem, options, checkpoint, progress)
    intervals = None
    profiled = profiles and result.degrees_of_freedom > 0 and result.residual_sigma > 0.0
    if profiled:
        intervals = [profile_interval(problem, result, p.name) for p in parameters]
    found = estimates(result, intervals)
    warnings = [*table.warnings, *beyond(table.speeds, ball), *result.warnings]
    warnings += loose(found)
    return StringBedFit(
        problem=problem,
        result=result,
        estimates=found,
        profiled=profiled,
        warnings=tuple(dict.fromkeys(warnings)),
    )


def fit_tension(
    table: RestitutionTable,
    racket: RacketParameters,
    ball: BallParameters,
    *,
    start: float | None = None,
    options: Search | None = None,
    checkpoint: str | Path | None = None,
    progress: Report | None = None,
) -> StringBedFit:
    """Fits T0 alone, stiffnesses and rim factors as the racket has them.

    For the same racket strung at another tension (Glynn et al. 2011). The search begins at `start`
    (N). The interval is that of the likelihood profile.

    Raises:
        InputError: as `fit_string_bed`.

    """
    checkpoint = None if checkpoint is None else Path(checkpoint)
    return fit_string_bed(
        table,
        racket,
        ball,
        free=["T0"],
        start=None if start is None else {"T0": start},
        options=options,
        profiles=True,
        checkpoint=checkpoint,
        progress=progress,
    )
