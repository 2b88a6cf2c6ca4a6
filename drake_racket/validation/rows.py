"""A row sets one published number beside the model's: the difference, and what follows."""

from __future__ import annotations

import math
from dataclasses import dataclass

from drake_racket.validation.published import PublishedValue

AGREES, DIFFERS, NOT_COMPARABLE = "agrees", "differs", "not comparable"


@dataclass(frozen=True)
class Comparison:
    """A comparison is a line of the report.

    Attributes:
        model: the model's value; None where there is nothing to compare with.
        difference: in the quantity's unit, model less published value, or less the nearer end of a
            range (0 inside it).
        tolerance: on the difference, in the unit of the quantity; None if not comparable.
        verdict: `agrees` if |difference| <= tolerance, else `differs`; or `not comparable`.

    """

    published: PublishedValue
    model: float | None
    difference: float | None
    tolerance: float | None
    verdict: str

    def reason(self) -> str:
        """Says in one line why this verdict."""
        entry = self.published
        if self.verdict == NOT_COMPARABLE:
            return f"{entry.not_comparable}; {entry.note}"
        return entry.note


def compare(entry: PublishedValue, model: float | None) -> Comparison:
    """Gives the verdict on one number of a `model`, in the unit of the entry.

    A model value that is not finite differs from everything.
    """
    if entry.not_comparable:
        return Comparison(entry, model, None, None, NOT_COMPARABLE)
    if model is None:
        raise KeyError(f"no model value for {entry.key}")
    difference = _difference(entry, model)
    relative = entry.tolerance_kind == "relative"
    tolerance = entry.tolerance * (published_size(entry, model) if relative else 1.0)
    # a comparison of decimal numbers should not hang on their last bit
    agrees = math.isfinite(difference) and abs(difference) <= tolerance * (1.0 + 1e-12)
    return Comparison(entry, model, difference, tolerance, AGREES if agrees else DIFFERS)


def published_size(entry: PublishedValue, model: float) -> float:
    """Gives what shares are of: the published value, or of a range the end nearer to the model."""
    known = (entry.low, entry.high) if entry.value is None else (entry.value,)
    ends = [x for x in known if x is not None]
    return min((abs(model - end), abs(end)) for end in ends)[1]


def _difference(entry: PublishedValue, model: float) -> float:
    if entry.value is not None:
        return model - entry.value
    if entry.low is not None and model < entry.low:
        return model - entry.low
    if entry.high is not None and model > entry.high:
        return model - entry.high
    return 0.0 if math.isfinite(model) else math.nan
