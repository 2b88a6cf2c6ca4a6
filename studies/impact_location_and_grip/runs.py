"""Where the ball hits and how tight the grip is: what arm, racket and ball do.

The experiment of King, Kentel & Mitchell (2012), J. Biomech. 45:1048-1052, with this package's arm:
a one-handed backhand, the nine points of the string-bed, three grips, 50 ms from touch. Beside each
grip's impacts the same stroke is run without one (the ball comes too late): the difference is what
the impact does, and not the swing. The joint torques are constant during a run.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from drake_racket.rigs.cases import Progress, call_in_processes, check_workers

from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.io.errors import InputError
from drake_racket.io.files import write_netcdf
from drake_racket.io.fingerprint import digest, environment
from drake_racket.io.shipped import data_directory
from drake_racket.laws.strings import POINT_NUMBERS
from drake_racket.parameters.grip import GRIPS
from drake_racket.parameters.limb import load_upper_limb
from drake_racket.parameters.scenario import Scenario, changed, load_scenario
from drake_racket.simulation import simulate
from studies.impact_location_and_grip.case import HISTORIES, LATE, MARGIN, STEP, Case, read_case

if TYPE_CHECKING:
    import xarray

LONGEST = 0.07
"""s, largest `after`: the ball of the stroke without impact starts at most 0.1 s away."""


def backhand_scenario() -> Scenario:
    """The shipped one-handed backhand, data/backhand.yaml."""
    return load_scenario(data_directory() / "backhand.yaml")


def grip_and_location(
    *,
    base: Scenario | None = None,
    grips: Sequence[str] = GRIPS,
    points: Sequence[int] = POINT_NUMBERS,
    store: Path | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> xarray.Dataset:
    """Runs every grip with every point, and once without impact.

    Args:
        base: the stroke; `backhand_scenario()` if None. Its `after` is the length of the histories.
        store: a directory where each finished run is kept, and taken from if it was made with the
            same scenario, parameters, package sources and versions; None keeps nothing.
        workers: processes; the result does not depend on them.

    Returns:
        A Dataset over (grip, point), with histories over (grip, point, time), `time` from touch,
        and `swing_*` without impact over (grip, time) from the same instant of the stroke (of
        point 5, or of the first point: touch differs by microseconds). SI units, rad.

    Raises:
        InputError: the base is not a stroke of the shipped limb on a continuous plant, or an axis
            or a value does not fit; before any case runs.
        SimulationError: a run could not be finished, or did not hit, or hit where it should not.

    """
    check_workers(workers)
    base = base or backhand_scenario()
    cases = make_cases(base, grips, points)
    marks = [_fingerprint(case.scenario) for case in cases]
    if store is not None:
        store.mkdir(parents=True, exist_ok=True)
    found = [_kept(store, mark) for mark in marks]
    left = [i for i, data in enumerate(found) if data is None]

    def finish(i: int, data: xarray.Dataset) -> None:
        found[i] = data
        if progress is not None:
            progress(sum(x is not None for x in found), len(cases))

    if workers == 1:
        systems: list[ImpactDiagram] = []
        for i in left:
            systems = systems or [make_impact_diagram(cases[i].scenario)]
            finish(i, run_case(cases[i], store, marks[i], systems[0]))
    elif left:
        calls = [(cases[i], store, marks[i]) for i in left]
        call_in_processes(run_case, calls, workers, lambda n, data: finish(left[n], data))
    data = {(c.grip, c.point): d for c, d in zip(cases, found, strict=True) if d is not None}
    return _combine(base, list(grips), list(points), data)


def make_cases(base: Scenario, grips: Sequence[str], points: Sequence[int]) -> list[Case]:
    """The runs, each checked; one Diagram serves all. Raises InputError."""
    if base.support != "limb" or base.limb.model != "upper_limb" or base.time_step > 0.0:
        raise InputError(
            "grip_and_location: base",
            f"{base.support}, {base.limb.model}, time step {base.time_step:g} s",
            "a stroke of the shipped upper limb on a continuous plant",
        )
    if base.grip_kind == "weld":
        raise InputError("grip_and_location: grip_kind", "weld", "compliant, torsional")
    if not STEP <= base.after <= LONGEST:
        raise InputError("grip_and_location: after", base.after, f"{STEP:g} to {LONGEST:g} s")
    for key, values, allowed in (("grips", grips, None), ("points", points, POINT_NUMBERS)):
        if not values or len(set(values)) < len(values):
            raise InputError(key, list(values), "at least one value, and each once")
        if allowed and not set(values) <= set(allowed):
            raise InputError(key, list(values), "1 to 9")
    end = base.approach_time + base.after + MARGIN
    cases = []
    for grip in grips:
        late = changed(base, grip=grip, point="5", approach_time=end + LATE, after=1e-4)
        cases.append(Case(grip, None, late))
        for point in points:
            hit = changed(base, grip=grip, point=str(point), after=base.after + MARGIN)
            cases.append(Case(grip, point, hit))
    return cases


def run_case(
    case: Case, store: Path | None, mark: str, system: ImpactDiagram | None = None
) -> xarray.Dataset:
    """Runs one case and keeps it in `store`; a function of the module, for other processes."""
    system = system or make_impact_diagram(case.scenario)
    result = simulate(case.scenario, system, history=True)
    data = read_case(case, result, system)
    if store is not None:
        write_netcdf(data, _path(store, mark))
    return data


def _path(store: Path, mark: str) -> Path:
    return store / f"case_{mark[:24]}.nc"


def _kept(store: Path | None, mark: str) -> xarray.Dataset | None:
    """A run that is there whole (files are renamed into place when they are)."""
    import xarray

    if store is None or not _path(store, mark).is_file():
        return None
    try:
        return xarray.load_dataset(_path(store, mark), engine="h5netcdf")
    except (OSError, ValueError):
        return None


def _fingerprint(scenario: Scenario) -> str:
    """Stands for all that decides a run's numbers."""
    loaded = (scenario.load_racket(), scenario.load_ball(), scenario.load_grip())
    values = [dataclasses.asdict(x) for x in (scenario, *loaded, load_upper_limb())]
    return digest(json.dumps([*values, environment()], sort_keys=True).encode())


def _combine(
    base: Scenario,
    grips: list[str],
    points: list[int],
    data: dict[tuple[str, int | None], xarray.Dataset],
) -> xarray.Dataset:
    """The cases on one time axis; the stroke without impact is shifted to the time of touch."""
    import xarray

    first = data[grips[0], points[0]]
    time = first["time"].to_numpy()
    variables: dict[str, Any] = {}
    for name, variable in first.data_vars.items():
        values = np.array([[data[g, p][name].to_numpy() for p in points] for g in grips])
        variables[str(name)] = (("grip", "point", *variable.dims), values, variable.attrs)
    reference = 5 if 5 in points else points[0]
    for name, (dimensions, units, text) in HISTORIES.items():
        if name == "ball_velocity":
            continue
        swings = []
        for g in grips:
            swing = data[g, None]
            at = float(data[g, reference]["touch_time"]) + time
            swings.append(swing[name].interp(time=at).to_numpy())
        attributes = {"units": units, "long_name": f"{text}, without impact"}
        variables[f"swing_{name}"] = (("grip", "time", *dimensions), np.array(swings), attributes)
    coordinates: dict[str, Any] = {
        "grip": grips,
        "point": ("point", points, {"long_name": "string-bed point"}),
        **{name: first[name] for name in ("time", "joint", "axis")},
    }
    return xarray.Dataset(
        variables,
        coordinates,
        attrs={
            "title": "Impact location and grip tightness, one-handed backhand",
            "scenario": json.dumps(dataclasses.asdict(base)),
            "source": "King, Kentel & Mitchell (2012), J. Biomech. 45:1048-1052",
        },
    )
