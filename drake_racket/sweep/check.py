"""Compares a sweep with Drake: some of its cases, chosen at random, run there once more.

Sweeps take the compiled engine where it can. That it computes what Drake does is tested; a sweep
says beside its results how far the two were apart in its own cases.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drake_racket.cases.case import changed
from drake_racket.io.errors import SimulationError
from drake_racket.laws.compilation import HAS_NUMBA
from drake_racket.sweep.spec import Sweep
from drake_racket.sweep.store import CaseRow
from drake_racket.sweep.worker import may_run_compiled

_NOTHING = 1e-9
"""Magnitude (SI) below which an output is rounding, as an angle that symmetry forbids."""

SEED = 20110615
"""Of the choice; the same sweep has the same sample."""


class ChecksFailed(SimulationError):
    """A sweep differs from Drake by more than its tolerance; its results are written."""


@dataclass(frozen=True)
class Comparison:
    """A comparison says how far a sweep's sample is from Drake.

    Attributes:
        cases: of the sample.
        differences: output -> largest difference over its largest magnitude among the sweep's
            cases; NaN where one engine has a number and the other has none.
        failures: case -> why it did not finish in Drake.
        tolerance: of the differences.

    """

    cases: tuple[int, ...]
    differences: Mapping[str, float]
    failures: Mapping[int, str]
    tolerance: float

    def worst(self) -> tuple[str, float]:
        """Gives the output that differs most, and by how much; NaN is most."""
        if not self.differences:
            return "", 0.0
        name = max(self.differences, key=lambda n: _rank(self.differences[n]))
        return name, self.differences[name]

    def passes(self) -> bool:
        """Tells whether no difference is beyond the tolerance."""
        return not self.failures and _rank(self.worst()[1]) <= self.tolerance

    def plain(self) -> dict[str, object]:
        """Gives it as JSON's own types: NaN is null."""
        return {
            "cases": list(self.cases),
            "differences": {
                name: None if math.isnan(x) else x for name, x in self.differences.items()
            },
            "failures": {str(case): reason for case, reason in self.failures.items()},
            "tolerance": self.tolerance,
            "text": self.text(),
        }

    def text(self) -> str:
        """Says it on one line."""
        name, value = self.worst()
        ran = f"{len(self.cases)} cases chosen at random ran in Drake, too"
        if self.failures:
            case, reason = next(iter(self.failures.items()))
            return f"{ran}: case {case} fails there ({reason})"
        return f"{ran}: largest difference {value:.1e} ({name}), tolerance {self.tolerance:g}"


def _rank(value: float) -> float:
    return math.inf if math.isnan(value) else value


def sample(sweep: Sweep, finished: Sequence[int]) -> list[int]:
    """Chooses the cases to compare among the finished ones that may have run compiled; sorted."""
    wanted = sweep.check.count(len(sweep))
    if not HAS_NUMBA or not wanted:
        return []
    chosen: list[int] = []
    for case in np.random.default_rng(SEED).permutation(np.sort(np.asarray(finished, dtype=int))):
        if may_run_compiled(sweep.scenario(int(case))):
            chosen.append(int(case))
            if len(chosen) == wanted:
                break
    return sorted(chosen)


def in_drake(sweep: Sweep) -> Sweep:
    """Gives the same sweep with Drake as its engine, and without histories."""
    return dataclasses.replace(
        sweep, base=changed(sweep.base, engine="drake"), histories=frozenset()
    )


def compare(sweep: Sweep, rows: Sequence[CaseRow], checks: Sequence[CaseRow]) -> Comparison | None:
    """Compares the cases of a sweep that ran in Drake once more; None if there are none."""
    if not checks:
        return None
    table = {row.case: row.values for row in rows if not row.failure}
    magnitudes = np.abs(np.nan_to_num(np.array(list(table.values()))))
    scale = np.max(magnitudes, axis=0, initial=0.0)
    differences: dict[str, float] = {}
    failures = {row.case: row.failure for row in checks if row.failure}
    for i, output in enumerate(sweep.outputs):
        if output.of_engine or scale[i] < _NOTHING:
            continue
        found = 0.0
        for row in checks:
            if row.failure or row.case not in table:
                continue
            ours, theirs = table[row.case][i], row.values[i]
            if math.isnan(ours) and math.isnan(theirs):
                continue
            found = max(found, abs(ours - theirs) / scale[i], key=_rank)
        differences[output.name] = found
    return Comparison(
        tuple(row.case for row in checks), differences, failures, sweep.check.tolerance
    )
