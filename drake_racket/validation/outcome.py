"""Says what a section of the validation is asked for, and what it gives."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from drake_racket.io.progress import Report
from drake_racket.laws.bed import POINT_NUMBERS
from drake_racket.rigs.head_clamped import CANNON_SPEEDS

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class Plan:
    """Says how fine the grids are. The default is the whole report; `coarse` is a first look."""

    points: tuple[int, ...] = POINT_NUMBERS
    speeds: tuple[float, ...] = CANNON_SPEEDS
    axis_step: float = 0.01  # m, along the racket's axis
    forces: tuple[float, ...] = (1.0, *(float(f) for f in range(50, 1201, 50)))
    workers: int = 1

    @staticmethod
    def coarse(workers: int = 1) -> Plan:
        """Makes a plan of five points and two speeds: some tens of seconds."""
        return Plan((2, 4, 5, 7, 8), (18.0, 33.0), 0.07, (1.0, 400.0, 800.0, 1200.0), workers)

    def settings(self) -> dict[str, Any]:
        """Tells what decides the numbers: all but the number of processes."""
        values = dataclasses.asdict(self)
        del values["workers"]
        return values


@dataclass(frozen=True)
class SectionResult:
    """Holds what a section computes.

    Attributes:
        values: key of the published entry -> the model's value.
        text: paragraphs (Markdown) for the report.
        datasets: name -> data, written as NetCDF.
        figures: name -> (caption, matplotlib Figure).

    """

    values: dict[str, float]
    text: list[str]
    datasets: dict[str, xarray.Dataset] = field(default_factory=dict)
    figures: dict[str, tuple[str, Any]] = field(default_factory=dict)


Section = Callable[[Plan, Report], SectionResult]
