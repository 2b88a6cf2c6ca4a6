"""An estimate is a fitted number as reports and parameter files want it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Estimate:
    """An estimate is a value, its standard error and its 95 % interval."""

    value: float
    standard_error: float
    interval: tuple[float, float]
    unit: str
