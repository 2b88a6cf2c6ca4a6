"""What `grip_and_location` says beside the published statements about one-handed backhands.

Forced flexion of the wrist is read in two ways: against the same stroke without impact, and against
the centre impact (in the difference of two impacts the stroke without one cancels). The published
numbers are differences from a centre impact, or changes with the place of impact.

In this model the torques applied on the joints are constant. What stands for King, Kentel &
Mitchell's wrist extension torque is the load of the racket about the wrist's flexion axis, which an
extensor torque of that size would have to balance; their muscles' torques also depend on how fast
they are stretched.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from drake_racket import load_grip

if TYPE_CHECKING:
    import xarray

AGREES, DIFFERS, NOT_COMPARABLE = "agrees", "differs", "not comparable"
DEGREES = 180.0 / math.pi
"""deg per rad."""
ON_AXIS = 1e-3
"""m: points less than this over or under the long axis lie on it."""
WINDOW = 0.03
"""s, of King, Hau & Blenkinsop (2016): wrist angles within 30 ms of touch."""
_KING_2012 = "King, Kentel & Mitchell (2012), J. Biomech. 45:1048, abstract"
_KING_2016 = "King, Hau & Blenkinsop (2016), J. Sports Sci. 35:1231, abstract"
_GRABINER = "Grabiner, Groppel & Campbell (1983), Med. Sci. Sports Exerc. 15:542, abstract"


@dataclass(frozen=True)
class Finding:
    """A published statement and the model's number; `low` and `high` bound what agrees."""

    key: str
    quantity: str
    unit: str
    source: str
    published: str
    low: float
    high: float
    reason: str
    model: float | None

    def verdict(self) -> str:
        """Agrees if low <= model <= high; not comparable without a number."""
        if self.model is None or not math.isfinite(self.model):
            return NOT_COMPARABLE
        return AGREES if self.low <= self.model <= self.high else DIFFERS


def heights(dataset: xarray.Dataset) -> xarray.DataArray:
    """Height (m) of the points over the long axis; the stroke decides it, not the grip."""
    return dataset["height"].isel(grip=0)


def points_below(dataset: xarray.Dataset) -> list[int]:
    """Points below the racket's long axis, as gravity sees it."""
    at = heights(dataset)
    return [int(p) for p in at["point"] if float(at.sel(point=p)) < -ON_AXIS]


def centre_point(dataset: xarray.Dataset) -> int | None:
    """Point 5, if it was run."""
    return 5 if 5 in dataset["point"].to_numpy() else None


def side_points(dataset: xarray.Dataset) -> tuple[int | None, int | None]:
    """The points below and above the long axis that are nearest to the string-bed's centre."""
    at, along = heights(dataset), dataset["along"].isel(grip=0)
    found = []
    for sign in (-1.0, 1.0):
        side = [p for p in at["point"].to_numpy() if sign * float(at.sel(point=p)) > ON_AXIS]
        nearest = min(side, key=lambda p: abs(float(along.sel(point=p))), default=None)
        found.append(None if nearest is None else int(nearest))
    return found[0], found[1]


def wrist_flexion(dataset: xarray.Dataset) -> xarray.DataArray:
    """Angle of the wrist (rad); flexion is positive."""
    return dataset["joint_position"].sel(joint="wrist_flexion")


def flexion_by_impact(dataset: xarray.Dataset, until: float | None = None) -> xarray.DataArray:
    """Largest flexion (rad) over the stroke's without impact, within `until` s; (grip, point)."""
    swing = dataset["swing_joint_position"].sel(joint="wrist_flexion")
    return (wrist_flexion(dataset) - swing).sel(time=slice(0.0, _end(until))).max("time")


def flexion_more_than_centre(
    dataset: xarray.Dataset, until: float | None = None
) -> xarray.DataArray:
    """Largest flexion (rad) over that of the centre impact at the same time; (grip, point)."""
    angle = wrist_flexion(dataset)
    return (angle - angle.sel(point=5)).sel(time=slice(0.0, _end(until))).max("time")


def mean_load(dataset: xarray.Dataset, until: float = WINDOW) -> xarray.DataArray:
    """Mean load (N m) of the racket about the wrist's flexion axis within `until` s.

    After a centre impact it is near zero, so that no ratio to it is stable.
    """
    load = dataset["racket_load"].sel(joint="wrist_flexion", time=slice(0.0, _end(until)))
    return load.mean("time")


def _end(until: float | None) -> float | None:
    return None if until is None else until + 1e-9


def spread(values: xarray.DataArray) -> xarray.DataArray:
    """(largest - least) / mean over the grips."""
    return (values.max("grip") - values.min("grip")) / values.mean("grip")


def findings(dataset: xarray.Dataset) -> list[Finding]:
    """The published statements and the model's numbers, with the normal grip where one is meant.

    A statement that the points, grips or times of `dataset` do not cover is not comparable.
    """
    grips = [str(g) for g in dataset["grip"].to_numpy()]
    grip = "normal" if "normal" in grips else grips[0]
    below = points_below(dataset)
    others = [int(p) for p in dataset["point"].to_numpy() if p not in below]
    centre, (under, _) = centre_point(dataset), side_points(dataset)
    whole = float(dataset["time"][-1]) >= WINDOW - 1e-9
    sided = bool(below) and centre is not None
    loosest_first = sorted(grips, key=lambda g: load_grip(g).torque_stiffness.value[0])
    values: dict[str, float] = {}
    if sided:
        more = DEGREES * flexion_more_than_centre(dataset)
        least = more.sel(point=below).min("point")
        values["order"] = float((least - more.sel(point=others).max("point")).min())
        values["flexion"] = float(more.sel(grip=grip, point=below).max())
        load = dataset["peak_flexing_load"].sel(joint="wrist_flexion", grip=grip)
        values["peak"] = float(load.sel(point=below).max() / load.sel(point=centre))
    if sided and whole:
        early = DEGREES * flexion_more_than_centre(dataset, WINDOW)
        values["early"] = float(early.sel(grip=grip, point=under))
    if len(grips) > 1:
        speeds = 100.0 * spread(dataset["rebound_speed"])
        values["anywhere"] = float(speeds.max())
        if centre is not None:
            values["ball"] = float(speeds.sel(point=centre))
        if below:
            turns = dataset["peak_grip_rotation"].sel(grip=loosest_first, point=below)
            values["hand"] = DEGREES * float((-turns.diff("grip")).min())
    return [
        Finding(model=values.get(key), key=key, **text)  # type: ignore[arg-type]
        for key, text in _statements(grip).items()
    ]


def _statements(grip: str) -> dict[str, dict[str, str | float]]:
    inf, half = math.inf, "half of it: stroke, arm and torques are not the study's"
    return {
        "order": {
            "quantity": "least flexion below the axis less the most elsewhere, worst grip",
            "unit": "deg",
            "source": _KING_2012,
            "published": "below the axis the wrist flexes more",
            "low": 0.0,
            "high": inf,
            "reason": "the order alone",
        },
        "flexion": {
            "quantity": f"most flexion below the axis beyond the centre impact's, {grip} grip",
            "unit": "deg",
            "source": _KING_2012,
            "published": "up to 16",
            "low": 8.0,
            "high": 24.0,
            "reason": half,
        },
        "peak": {
            "quantity": f"peak flexing load on the wrist below the axis over centre, {grip} grip",
            "unit": "1",
            "source": _KING_2012,
            "published": "up to 6 (wrist extension torque)",
            "low": 3.0,
            "high": 9.0,
            "reason": half,
        },
        "ball": {
            "quantity": "rebound speed at the centre: spread over the grips",
            "unit": "%",
            "source": _KING_2012,
            "published": "no substantial effect",
            "low": 0.0,
            "high": 1.0,
            "reason": "1 %: 0.3 m/s",
        },
        "anywhere": {
            "quantity": "rebound speed at any point: largest spread over the grips",
            "unit": "%",
            "source": _GRABINER,
            "published": "no significant difference",
            "low": 0.0,
            "high": 3.0,
            "reason": "3 %, inferred: less than trials of an experiment scatter",
        },
        "hand": {
            "quantity": "rotation in the hand below the axis: least fall from grip to tighter grip",
            "unit": "deg",
            "source": _KING_2012,
            "published": "substantially less with a tight grip",
            "low": 0.0,
            "high": inf,
            "reason": "the order alone, at every point below the axis",
        },
        "early": {
            "quantity": f"flexion beyond the centre's in 30 ms, one point below, {grip} grip",
            "unit": "deg",
            "source": _KING_2016,
            "published": "11 to 32, one ball diameter below the axis",
            "low": 11.0,
            "high": 32.0,
            "reason": "fourteen players' range; the point is 1.04 ball diameters below",
        },
    }


def summary(dataset: xarray.Dataset) -> xarray.Dataset:
    """Numbers over (grip, point) for a table, with angles in degrees."""
    import xarray

    columns: dict[str, tuple[xarray.DataArray, str]] = {
        "height": (dataset["height"], "m"),
        "along": (dataset["along"], "m"),
        "flexion_by_impact_30ms": (DEGREES * flexion_by_impact(dataset, WINDOW), "deg"),
        "flexion_by_impact": (DEGREES * flexion_by_impact(dataset), "deg"),
        "peak_grip_rotation": (DEGREES * dataset["peak_grip_rotation"], "deg"),
        "rebound_speed": (dataset["rebound_speed"], "m/s"),
        "restitution": (dataset["restitution"], "1"),
        "contact_time": (dataset["contact_time"], "s"),
    }
    if centre_point(dataset) is not None:
        more = DEGREES * flexion_more_than_centre(dataset)
        columns["flexion_more_than_centre"] = (more, "deg")
    for joint in dataset["joint"].to_numpy():
        angle = dataset["joint_position"].sel(joint=joint)
        change = DEGREES * (angle.isel(time=-1) - angle.isel(time=0))
        columns[f"{joint}_change"] = (change, "deg")
        for name in ("peak_flexing_load", "peak_extending_load", "peak_reaction_force"):
            values = dataset[name].sel(joint=joint)
            columns[f"{joint}_{name}"] = (values, values.attrs["units"])
    return xarray.Dataset(
        {
            name: (("grip", "point"), values.transpose("grip", "point").data, {"units": units})
            for name, (values, units) in columns.items()
        },
        {"grip": dataset["grip"], "point": dataset["point"]},
    )
