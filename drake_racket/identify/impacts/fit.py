"""Fits keys of scenarios to measured impacts, and says what the data determine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_racket.cases.keys import NUMBER, Key, find_key, number_of, with_values
from drake_racket.derivatives import NOT_BY
from drake_racket.identify.core.estimate import Estimate
from drake_racket.identify.core.intervals import profile_interval
from drake_racket.identify.core.problem import Parameter
from drake_racket.identify.core.result import FitResult
from drake_racket.identify.core.search import Search, estimates, loose, search
from drake_racket.identify.impacts.problem import ImpactsProblem
from drake_racket.identify.impacts.table import MeasuredImpacts
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Report
from drake_racket.parameters.scenario import Scenario

SPAN = 5.0
"""Bounds of a positive number by default: its start divided and multiplied by this."""


@dataclass(frozen=True, eq=False)
class ImpactsFit:
    """An ImpactsFit is what a fit to measured impacts found.

    Attributes:
        data: the measurements.  result: of the search.
        estimates: by key, with 95 % intervals.
        scenario: the base with the fitted values.
        modelled: (r, k) the outputs as the fitted model has them, in their units.
        warnings: in words.

    """

    data: MeasuredImpacts
    result: FitResult
    estimates: dict[str, Estimate]
    scenario: Scenario
    modelled: NDArray[np.float64]
    warnings: tuple[str, ...]


def fit_impacts(
    data: MeasuredImpacts,
    base: Scenario,
    free: Mapping[str, tuple[float, float] | None] | Sequence[str],
    *,
    options: Search | None = None,
    profiles: bool = False,
    checkpoint: str | Path | None = None,
    progress: Report | None = None,
) -> ImpactsFit:
    """Fits keys to measured impacts by least squares.

    Args:
        base: the scenario that the data were read with; fits begin at its values.
        free: keys to fit, with bounds in their units where the default does not do.
        profiles: intervals from likelihood profiles, which runs many more impacts.
        checkpoint: directory of the checkpoint; a killed run goes on from it.

    Raises:
        InputError: no key, one that is no number or that the table sets, or bounds that do not
            hold the start.

    """
    checkpoint = None if checkpoint is None else Path(checkpoint)
    if not free:
        raise InputError("free", "no key", "one key or more")
    bounds = free if isinstance(free, Mapping) else dict.fromkeys(free)
    keys = [_key(name, base, data) for name in bounds]
    parameters = [_parameter(key, base, bounds[key.name]) for key in keys]
    title = f"{', '.join(bounds)} from {len(data.lines)} impacts"
    problem = ImpactsProblem(data, keys, parameters, title)
    problem.check()
    result = search(problem, options or Search(starts=1), checkpoint, progress)
    intervals = None
    if profiles:
        intervals = [profile_interval(problem, result, name) for name in result.names]
    found = estimates(result, intervals)
    fitted = with_values(base, dict(zip(keys, map(float, result.estimates), strict=True)), {})
    return ImpactsFit(
        data=data,
        result=result,
        estimates=found,
        scenario=fitted,
        modelled=problem.modelled(result.estimates),
        warnings=tuple(dict.fromkeys([*result.warnings, *_loose(found, parameters)])),
    )


def _loose(found: Mapping[str, Estimate], parameters: Sequence[Parameter]) -> list[str]:
    positive = {p.name for p in parameters if p.lower >= 0.0}
    return loose({name: estimate for name, estimate in found.items() if name in positive})


def _key(name: str, base: Scenario, data: MeasuredImpacts) -> Key:
    key = find_key(name, base, "free")
    if key.kind != NUMBER or name.startswith(NOT_BY):
        raise InputError(f"free: {name}", key.kind, "keys that are numbers of the impact")
    if name in data.conditions:
        raise InputError(f"free: {name}", "a column of the table", "keys that it leaves open")
    return key


def _parameter(key: Key, base: Scenario, bounds: tuple[float, float] | None) -> Parameter:
    start = number_of(base, key)
    if bounds is None:
        if not start > 0.0:
            allowed = f"bounds (its start is {start:g}: only positive numbers have some by default)"
            raise InputError(f"free: {key.name}", "no bounds", allowed)
        bounds = (start / SPAN, start * SPAN)
    return Parameter(key.name, key.unit, bounds[0], bounds[1], start)
