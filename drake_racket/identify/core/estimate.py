"""An estimate is a fitted number as reports and parameter files want it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Estimate:
    """An estimate is a value, its standard error and its 95 % interval.

    Attributes:
        value: in `unit`.
        standard_error: in `unit`.
        interval: lower and upper end, in `unit`; not finite where the data set no bound.
        unit: of all three.

    """

    value: float
    standard_error: float
    interval: tuple[float, float]
    unit: str
