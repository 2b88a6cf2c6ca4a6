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
from contextlib import closing
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket import (
    GRIPS,
    InputError,
    KeptResults,
    Progress,
    Report,
    Scenario,
    as_text,
    check_workers,
    computation,
    data_directory,
    digest,
    leave_if_imported_again,
    load_scenario,
    netcdf_bytes,
    read_netcdf,
)
from drake_racket.laws import POINT_NUMBERS
from drake_racket.sweep import Sweep, make_plan, make_sweep, run_cases
from studies.impact_location_and_grip.case import (
    HISTORIES,
    LATE,
    MARGIN,
    STEP,
    read_run,
)

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
    progress: Report | None = None,
) -> xarray.Dataset:
    """Runs every grip with every point, and once without impact.

    Args:
        base: the stroke; `backhand_scenario()` if None. Its `after` is the length of the histories.
        store: a file where each finished run is kept, and taken from if it was made with the same
            scenario, parameters, sources and versions; None keeps nothing.
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
    leave_if_imported_again()
    check_workers(workers)
    base = base or backhand_scenario()
    sweep = make_runs(base, grips, points)
    plan = make_plan(sweep, strict=True)
    mark = digest(as_text(computation(Path(__file__).parent)).encode())
    found: dict[int, xarray.Dataset] = {}
    with closing(KeptResults(store, key="store", what="study")) as kept:
        for case in range(len(sweep)):
            content = kept.kept(plan.hashes[case], mark)
            if content is not None:
                found[case] = read_netcdf(content)
        missing = [case for case in plan.order() if case not in found]
        runs = run_cases(sweep, plan, missing, workers=workers, strict=True, reader=read_run)
        with closing(runs):
            for outcome in chain.from_iterable(runs):
                assert outcome.data is not None
                kept.keep(plan.hashes[outcome.case], mark, netcdf_bytes(outcome.data))
                found[outcome.case] = outcome.data
                if progress is not None:
                    progress(Progress("running", len(found), len(sweep)))
    return _combine(base, list(grips), list(points), found)


def make_runs(base: Scenario, grips: Sequence[str], points: Sequence[int]) -> Sweep:
    """The runs: grip by grip, first without impact, then every point. One Diagram serves all.

    Raises:
        InputError: see `grip_and_location`.

    """
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
    rows: list[list[Any]] = []
    for grip in grips:
        rows.append([grip, "5", end + LATE, 1e-4])
        rows += [[grip, str(p), base.approach_time, base.after + MARGIN] for p in points]
    keys = {"grip": {}, "point": {}, "approach_time": {"unit": "s"}, "after": {"unit": "s"}}
    return make_sweep(base, {"run": {"keys": keys, "rows": rows}}, ["steps"], histories="all")


def _combine(
    base: Scenario,
    grips: list[str],
    points: list[int],
    found: dict[int, xarray.Dataset],
) -> xarray.Dataset:
    """The cases on one time axis; the stroke without impact is shifted to the time of touch."""
    import xarray

    labels = [(grip, point) for grip in grips for point in [None, *points]]
    data = {label: found[case] for case, label in enumerate(labels)}
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
