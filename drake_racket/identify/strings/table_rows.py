"""Columns that tables of normal and of oblique impacts share, and what is refused of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.io.tables import CsvTable
from drake_racket.parameters.ball import BallParameters

Array: TypeAlias = NDArray[np.float64]
Select: TypeAlias = Mapping[str, str]

SPEEDS = 1.0, 100.0  # m/s
MOST_ROWS = 20_000
BEYOND = 1.5  # m/s outside the ball's range that need no warning

_OF_SEVERAL = ("racket", "tension", "friction_reading", "angle_reading")


def selected(table: CsvTable, select: Select) -> CsvTable:
    """Gives the rows asked for, which must be of one bed and one reading."""
    for name, text in select.items():
        table = table.where_text(name, text)
    for name in _OF_SEVERAL:
        if table.has(name) and len(found := sorted(set(table.texts(name)))) > 1:
            allowed = f"one {name} (select {name}={found[0]}, say)"
            raise InputError(f"{table.where}: {name}", ", ".join(found), allowed)
    return table


def read_points(table: CsvTable) -> NDArray[np.int64]:
    """Gives the column `point`; raises InputError for what is not 1-9."""
    points = table.numbers("point", "1")
    for i, point in enumerate(points):
        if point not in range(1, 10):
            raise InputError(table.at(i, "point"), float(point), "1 to 9")
    return points.astype(np.int64)


def read_speeds(table: CsvTable) -> Array:
    """Gives the column `approach_speed` or `speed`, m/s; raises InputError outside SPEEDS."""
    name = "approach_speed" if table.has("approach_speed") else "speed"
    if not table.has(name):
        name = "approach_speed"  # the name that the message asks for
    speeds = table.numbers(name, "m/s")
    table.check_range(name, speeds, *SPEEDS, f"{SPEEDS[0]:g} to {SPEEDS[1]:g} m/s")
    return speeds


def read_sigma(table: CsvTable, unit: str, most: float) -> Array | None:
    """Gives the column `standard_deviation`, if there is one.

    Raises InputError unless 0 < it <= most.
    """
    if not table.has("standard_deviation"):
        return None
    sigma = table.numbers("standard_deviation", unit)
    for i, value in enumerate(sigma):
        if not 0.0 < value <= most:
            raise InputError(
                table.at(i, "standard_deviation"), float(value), f"above 0, up to {most:g}"
            )
    return sigma


def check_duplicates(table: CsvTable, key: Array, names: str) -> None:
    """Refuses a row twice; with a column `repeat`, one shot twice."""
    if table.has("repeat"):
        key = np.column_stack([key, table.numbers("repeat", "1")])
        names += " and repeat"
    seen: dict[tuple[float, ...], int] = {}
    for i, row in enumerate(map(tuple, key.tolist())):
        if row in seen:
            allowed = f"each {names} once"
            if not table.has("repeat"):
                allowed += " (number repeated shots in a column repeat)"
            text = f"the {names} of row {table.lines[seen[row]]}"
            raise InputError(f"{table.where}: row {table.lines[i]}", text, allowed)
        seen[row] = i


def beyond(normal_speeds: Array, ball: BallParameters) -> list[str]:
    """Gives the speeds (m/s) outside those for which the ball has kb and cb, in words."""
    low, high = ball.speed_low.value, ball.speed_high.value
    outside = (normal_speeds < low - BEYOND) | (normal_speeds > high + BEYOND)
    if not outside.any():
        return []
    span = f"{normal_speeds[outside].min():.3g} to {normal_speeds[outside].max():.3g} m/s"
    return [
        f"{int(outside.sum())} of {len(outside)} rows at normal speeds of {span}, outside the "
        f"ball's {low:g} to {high:g} m/s: kb and cb hold their end values there"
    ]
