"""Runs a grid of impacts and labels what comes out: what the impact rigs have in common.

A rig is a base scenario and axes over it. One Diagram serves all cases of a and the
result of a case does not depend on the others, nor on how many processes share the work.
"""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
import multiprocessing
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from drake_racket.cases.case import changed, resolve
from drake_racket.cases.diagram import make_impact_diagram
from drake_racket.io.errors import InputError
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.impact import ImpactResult
from drake_racket.simulation import simulate

if TYPE_CHECKING:
    import xarray

T = TypeVar("T")

Progress = Callable[[int, int], None]
"""Called with the number of finished cases and of all cases."""

Axis = Sequence[Any] | Mapping[str, Mapping[str, Any]]
"""Values of a scenario's key; or labels, each with the changes to the scenario it stands for."""


@dataclass(frozen=True)
class Output:
    """One number of an impact. `read` is a module's function (it travels between processes)."""

    name: str
    units: str
    long_name: str
    read: Callable[[ImpactResult], float]


def _nan(value: float | None) -> float:
    return math.nan if value is None else value


def _restitution(result: ImpactResult) -> float:
    return result.apparent_restitution


def _rebound_speed(result: ImpactResult) -> float:
    return float(np.linalg.norm(result.rebound_velocity))


def _contact_time(result: ImpactResult) -> float:
    return _nan(result.contact_time)


def _peak_force(result: ImpactResult) -> float:
    return result.peak_normal_force


def _peak_deflection(result: ImpactResult) -> float:
    return result.peak_string_deflection


RESTITUTION = Output(
    "restitution", "1", "normal rebound speed over normal approach speed", _restitution
)
REBOUND_SPEED = Output("rebound_speed", "m/s", "rebound speed of the ball", _rebound_speed)
CONTACT_TIME = Output("contact_time", "s", "from first touch to last release", _contact_time)
PEAK_FORCE = Output("peak_normal_force", "N", "peak normal force on the ball", _peak_force)
PEAK_DEFLECTION = Output(
    "peak_string_deflection", "m", "largest deflection of a string mass", _peak_deflection
)
USUAL = (RESTITUTION, REBOUND_SPEED, CONTACT_TIME, PEAK_FORCE, PEAK_DEFLECTION)

_UNITS = {"speed": "m/s", "incidence_deg": "degrees", "offset_x": "m", "offset_y": "m"}


def run_grid(
    base: Scenario,
    axes: Mapping[str, Axis],
    outputs: Sequence[Output] = USUAL,
    *,
    history: bool = False,
    workers: int = 1,
    progress: Progress | None = None,
) -> xarray.Dataset:
    """Simulates every combination of `axes` and reads `outputs`.

    Args:
        base: what the axes leave alone.
        axes: dimension -> axis (see `Axis`); a sequence's dimension is a scenario's key.
        history: make the time histories that some outputs read (see `simulate`).
        workers: processes; 1 works in this one.

    Returns:
        A Dataset with one variable per output over all axes; attribute `warnings` lists what the
        runs had to say (JSON, each text once), `scenario` is the base.

    Raises:
        InputError: an axis is empty, or a case is not valid; before any case runs.
        SimulationError: a run could not be finished.

    """
    import xarray

    check_workers(workers)
    labels = {name: _labels(name, axis) for name, axis in axes.items()}
    cases = list(_cases(base, axes))
    rows = _run(cases, outputs, history, workers, progress)
    shape = [len(x) for x in labels.values()]
    table = np.array([values for values, _ in rows]).reshape(*shape, len(outputs))
    said = sorted({text for _, warnings in rows for text in warnings})
    coordinates = {
        name: (name, values, {"units": _UNITS[name]} if name in _UNITS else {})
        for name, values in labels.items()
    }
    return xarray.Dataset(
        {
            output.name: (
                tuple(labels),
                table[..., i],
                {"units": output.units, "long_name": output.long_name},
            )
            for i, output in enumerate(outputs)
        },
        coords=coordinates,
        attrs={
            "scenario": json.dumps(dataclasses.asdict(base)),
            "warnings": json.dumps(said),
        },
    )


def check_workers(workers: int) -> None:
    """Raises InputError unless `workers` is 1 to 256."""
    if isinstance(workers, bool) or not isinstance(workers, int) or not 1 <= workers <= 256:
        raise InputError("workers", workers, "1 to 256 processes")


def call_in_processes(
    function: Callable[..., T],
    calls: Sequence[tuple[Any, ...]],
    workers: int,
    finish: Callable[[int, T], None],
) -> None:
    """Shares calls among processes of this machine; what one raises ends the rest.

    Args:
        function: of a module; it, the arguments and what it returns travel between processes.
        calls: the arguments of each call, at least one.
        workers: processes at most.
        finish: called here with a call's number and what it returned, in any order.

    """
    # spawned: a fork would share Drake's state with threads of the parent
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(workers, len(calls)), mp_context=context) as pool:
        numbers = {pool.submit(function, *call): n for n, call in enumerate(calls)}
        try:
            for future in as_completed(numbers):
                finish(numbers[future], future.result())
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _labels(name: str, axis: Axis) -> list[Any]:
    values = list(axis)
    if not values:
        raise InputError(name, "an empty axis", "at least one value")
    if len(set(map(str, values))) < len(values):
        raise InputError(name, values, "each value once")
    return values


def _cases(base: Scenario, axes: Mapping[str, Axis]) -> Iterator[Scenario]:
    """The scenarios in row-major order of the axes; each is checked."""
    choices = [
        [dict(changes) for changes in axis.values()]
        if isinstance(axis, Mapping)
        else [{name: value} for value in axis]
        for name, axis in axes.items()
    ]
    for combination in itertools.product(*choices):
        changes: dict[str, Any] = {}
        for part in combination:
            changes |= part
        for key in ("point", "tension"):  # Python users may write numbers for these
            if key in changes:
                changes[key] = str(changes[key])
        yield changed(base, **changes)


Row = tuple[NDArray[np.float64], list[str]]


def _run(
    cases: Sequence[Scenario],
    outputs: Sequence[Output],
    history: bool,
    workers: int,
    progress: Progress | None,
) -> list[Row]:
    """The rows in the order of `cases`; each chunk has one topology and goes to one process."""
    groups: dict[tuple[Any, ...], list[int]] = {}
    for i, case in enumerate(cases):
        groups.setdefault(resolve(case).topology, []).append(i)
    rows: dict[int, Row] = {}

    def finish(indices: Sequence[int], chunk: Sequence[Row]) -> None:
        rows.update(zip(indices, chunk, strict=True))
        if progress is not None:
            progress(len(rows), len(cases))

    if workers == 1:
        for indices in groups.values():
            system = make_impact_diagram(cases[indices[0]])
            for i in indices:
                finish([i], [_read(simulate(cases[i], system, history=history), outputs)])
    else:
        parts = [part for indices in groups.values() for part in _parts(indices, workers)]
        calls = [([cases[i] for i in part], outputs, history) for part in parts]
        call_in_processes(_run_chunk, calls, workers, lambda n, rows: finish(parts[n], rows))
    return [rows[i] for i in range(len(cases))]


def _parts(indices: list[int], workers: int) -> list[list[int]]:
    """Chunks small enough that the processes end together, and large enough to share a Diagram."""
    size = max(1, min(18, math.ceil(len(indices) / workers)))
    return [indices[i : i + size] for i in range(0, len(indices), size)]


def _run_chunk(cases: Sequence[Scenario], outputs: Sequence[Output], history: bool) -> list[Row]:
    system = make_impact_diagram(cases[0])
    return [_read(simulate(case, system, history=history), outputs) for case in cases]


def _read(result: ImpactResult, outputs: Sequence[Output]) -> Row:
    return np.array([output.read(result) for output in outputs]), result.warnings
