"""What the benchmarks share: interleaved timing, tables, and a line that says what was measured."""

from __future__ import annotations

import gc
import os
import platform
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from drake_racket.laws import compilation as compiled

VARIED = {
    "speed": (18.0, 33.0, "m/s"),
    "offset_x": (-0.06, 0.06, "m"),
    "offset_y": (-0.04, 0.04, "m"),
    "racket.head.mass": (0.150, 0.170, "kg"),
    "racket.throat_joint.out_of_plane_stiffness": (800.0, 1000.0, "N*m/rad"),
    "racket.string_bed.initial_tension": (600.0, 700.0, "N"),
}
"""What users vary: keys, from, to, and units."""

Samples = dict[str, NDArray[np.float64]]


def interleaved(calls: Mapping[str, Callable[[], object]], repeats: int) -> Samples:
    """Seconds that each call took, (repeats,) by name, after one unmeasured round.

    The calls take turns and the order turns by one each round, so that all of them meet the same
    machine. Garbage is collected between rounds, not within. A call that returns a float has timed
    itself.
    """
    names = list(calls)
    seconds: dict[str, list[float]] = {name: [] for name in names}
    for call in calls.values():
        call()
    gc.disable()
    try:
        for turn in range(repeats):
            first = turn % len(names)
            for name in names[first:] + names[:first]:
                call = calls[name]
                start = perf_counter()
                own = call()
                whole = perf_counter() - start
                seconds[name].append(own if isinstance(own, float) else whole)
            gc.collect()
    finally:
        gc.enable()
    return {name: np.array(taken) for name, taken in seconds.items()}


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table, first column to the left and the others to the right."""
    cells = [list(header), *[list(row) for row in rows]]
    widths = [max(len(row[i]) for row in cells) for i in range(len(header))]
    lines = [
        "| "
        + " | ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        + " |"
        for row in cells
    ]
    rule = ["-" * widths[0], *["-" * (width - 1) + ":" for width in widths[1:]]]
    return "\n".join([lines[0], "| " + " | ".join(rule) + " |", *lines[1:]])


def versions(*packages: str) -> str:
    """Python, Drake and what else is named, whether laws are compiled, and the number of cores."""
    found = [f"Python {platform.python_version()}"]
    for package in ("drake", "numpy", *packages):
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            found.append(f"{package} absent")
    found.append("laws plain Python" if compiled.numba is None else "laws compiled by numba")
    return f"{', '.join(found)}; {os.cpu_count()} cores"
