"""The ranking of all spring assignments, and how firm it is when what is not printed is varied."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from drake_racket import InputError, Report, load_racket
from studies.spring_assignment.assignments import (
    GROUPINGS,
    INTERIOR,
    RIM,
    SpringAssignment,
    all_assignments,
    assignment_of,
)
from studies.spring_assignment.scores import (
    BEDS,
    DEFAULT,
    SETTINGS,
    SIX_POINTS,
    SPEED,
    SPEEDS,
    Setting,
    geometry_misfit,
    other_criteria,
    restitutions,
    score,
    spread,
)

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

PRINTED_RMS = {
    ("tour", "low"): 0.008,
    ("tour", "high"): 0.015,
    ("recreational", "low"): 0.021,
    ("recreational", "high"): 0.014,
}
"""RMS difference of restitution, relative, that the source's fits leave (Glynn et al. 2011)."""


def rank_all(
    assignments: Sequence[SpringAssignment] | None = None,
    *,
    store: Path | None = None,
    progress: Report | None = None,
) -> xarray.Dataset:
    """Every assignment, with the shipped ball and rim at SPEED, best first.

    Args:
        assignments: those, with the shipped one among them; None: all of GROUPINGS.
        store: file for unfinished work (`restitutions`).
        progress: called with the assignments done; `task` is the setting's name.

    Returns:
        A Dataset over (assignment, bed, point, line, rim): `grouping`, `k`, `p`, `restitution`,
        `spread` (standard deviation over the nine points, mean over beds), `range` (mean over
        beds), `within_printed` (spread in every bed, relative, at most PRINTED_RMS),
        `geometry_misfit` and `shipped` (the assignment of the shipped rackets).

    Raises:
        InputError: the shipped assignment is missing.

    """
    import xarray as xr

    if assignments is None:
        assignments = [a for name in GROUPINGS for a in all_assignments(name)]
    shipped = assignment_of(load_racket()).first_of_pair()
    if shipped not in assignments:
        raise InputError("assignments", f"{len(assignments)} without the shipped", shipped.label())
    values = restitutions(assignments, store=store, progress=progress)[..., 0]
    one_speed = values[..., None]
    deviation, extent = (x[..., 0] for x in spread(one_speed))
    order = np.argsort(deviation.mean(axis=1), kind="stable")
    printed = np.array([PRINTED_RMS[bed] for bed in BEDS])
    within = (deviation / values.mean(axis=2) <= printed).all(axis=1)
    columns = {
        "spread": (deviation.mean(axis=1), "standard deviation of restitution over the bed"),
        "range": (extent.mean(axis=1), "range of restitution over the bed"),
        "geometry_misfit": (geometry_misfit(assignments), "RMS of ln(p / p by geometry)"),
        "within_printed": (within, "spread in every bed within the source's RMS difference"),
        "shipped": (np.array([a == shipped for a in assignments]), "of the shipped rackets"),
        "grouping": (np.array([a.grouping for a in assignments]), "which tip and throat share a p"),
    }
    data: dict[str, Any] = {
        name: ("assignment", column[order], {"units": "1", "long_name": text})
        for name, (column, text) in columns.items()
    }
    for name, dimension, text in (
        ("k", "line", "number of the k"),
        ("p", "rim", "number of the p"),
    ):
        numbers = np.array([getattr(a, name) for a in assignments])[order]
        data[name] = (("assignment", dimension), numbers, {"units": "1", "long_name": text})
    about = {"units": "1", "long_name": f"restitution at {SPEED:g} m/s"}
    data["restitution"] = (("assignment", "bed", "point"), values[order], about)
    rank = {"units": "1", "long_name": "rank by spread"}
    return xr.Dataset(
        data,
        coords={
            "assignment": ("assignment", np.arange(1, len(order) + 1), rank),
            "bed": ("bed", [f"{r} {t}" for r, t in BEDS], {"long_name": "racket and tension"}),
            "point": ("point", list(SIX_POINTS), {"long_name": "point; 3 6 9 are as 1 4 7"}),
            "line": ("line", list(INTERIOR), {"long_name": "interior springs of"}),
            "rim": ("rim", list(RIM), {"long_name": "rim springs of"}),
        },
        attrs={
            "title": "Spring assignments by the spread of restitution over the bed",
            "speed_m_per_s": SPEED,
        },
    )


def assignment_at(ranking: xarray.Dataset, position: int) -> SpringAssignment:
    """The assignment at a 0-based position of the ranking."""
    row = ranking.isel(assignment=position)
    k, p = (tuple(int(i) for i in row[name].to_numpy()) for name in "kp")
    return SpringAssignment(str(row["grouping"].to_numpy()), k, p)


def shortlist(ranking: xarray.Dataset, best: int, others: int, seed: int = 0) -> Array:
    """Positions in the ranking to look at closely, increasing: (n,) integers.

    The best, the shipped one, the one nearest the rim's geometry, and a random sample of the rest.

    Raises:
        InputError: a number of best or others out of range.

    """
    count = ranking.sizes["assignment"]
    if not 2 <= best <= count:
        raise InputError("best", best, f"2 to {count}")
    if not 0 <= others <= count - best:
        raise InputError("others", others, f"0 to {count - best}")
    rest = best + np.random.default_rng(seed).choice(count - best, others, replace=False)
    named = np.flatnonzero(ranking["shipped"].to_numpy())
    geometric = int(np.argmin(ranking["geometry_misfit"].to_numpy()))
    return np.unique(np.concatenate([np.arange(best), rest, named, [geometric]]))


def vary(
    ranking: xarray.Dataset,
    positions: Array,
    *,
    settings: Sequence[Setting] = SETTINGS,
    store: Path | None = None,
    progress: Report | None = None,
) -> xarray.Dataset:
    """The assignments at `positions` under other choices of what is not printed, at SPEEDS.

    Returns:
        A Dataset over (setting, assignment, bed, point, speed): `restitution`; `spread` (mean over
        beds and speeds) and the `other_criteria`.

    """
    import xarray as xr

    assignments = [assignment_at(ranking, int(i)) for i in positions]
    found = []
    for setting in settings:
        kept = restitutions(assignments, setting, SPEEDS, store=store, progress=progress)
        found.append(kept)
    values = np.array(found)
    text = {
        "lowest_rebound": ("m/s", f"lowest rebound speed at {SPEEDS[0]:g} m/s"),
        "highest_rebound": ("m/s", f"highest rebound speed at {SPEEDS[-1]:g} m/s"),
        "tension_effect": ("1", "change of mean restitution from low to high tension"),
        "faster_when_tight": ("1", "share of points and speeds with more restitution at high"),
        "matched": ("1", "restitution of tour low less that of recreational high, mean"),
    }
    criteria = [other_criteria(restitution) for restitution in values]
    data: dict[str, Any] = {
        name: (
            ("setting", "assignment"),
            np.array([c[name] for c in criteria]),
            {"units": unit, "long_name": long_name},
        )
        for name, (unit, long_name) in text.items()
    }
    long_name = "standard deviation of restitution over the bed, mean over beds and speeds"
    data["spread"] = (
        ("setting", "assignment"),
        np.array([score(restitution) for restitution in values]),
        {"units": "1", "long_name": long_name},
    )
    dimensions = ("setting", "assignment", "bed", "point", "speed")
    data["restitution"] = (dimensions, values, {"units": "1", "long_name": "restitution"})
    few = ranking.isel(assignment=positions)
    kept = few[["grouping", "k", "p", "shipped", "geometry_misfit"]]
    speeds = ("speed", list(SPEEDS), {"units": "m/s", "long_name": "approach speed"})
    names = ("setting", [s.name for s in settings], {"long_name": "what was chosen"})
    coords = {"setting": names, "speed": speeds}
    return xr.Dataset(data, coords=coords).merge(
        kept.assign_coords(bed=few["bed"], point=few["point"])
    )


def firmness(varied: xarray.Dataset, best: int) -> xarray.Dataset:
    """How much a setting changes the ranking.

    Args:
        varied: of `vary`, as shipped among its settings.
        best: how many of the assignments are the ranking's best; the others are a sample.

    Returns:
        A Dataset over `setting`: Spearman's rank correlation with the shipped choice among the
        `correlation_best` and among the others (`correlation_others`), the shipped assignment's
        `shipped_rank` and `shipped_spread`, the `least_spread`, and how many of the ten best
        `kept_of_ten` are those of the shipped choice.

    """
    import xarray as xr

    spreads = varied["spread"]
    reference = spreads.sel(setting=DEFAULT.name).to_numpy()
    shipped = int(np.flatnonzero(varied["shipped"].to_numpy())[0])
    of_best = varied["assignment"].to_numpy() <= best
    rows = []
    for values in spreads.to_numpy():
        correlations = [
            float(spearmanr(reference[some], values[some]).statistic) if some.sum() > 2 else np.nan
            for some in (of_best, ~of_best)
        ]
        ten = set(np.argsort(values)[:10]) & set(np.argsort(reference)[:10])
        rank = int((values < values[shipped]).sum()) + 1
        rows.append((*correlations, rank, values[shipped], values.min(), len(ten)))
    names = {
        "correlation_best": f"Spearman's rank correlation among the best {best}",
        "correlation_others": "Spearman's rank correlation among a sample of the others",
        "shipped_rank": "rank of the shipped assignment",
        "shipped_spread": "spread of the shipped assignment",
        "least_spread": "spread of the best assignment",
        "kept_of_ten": "of the ten best, also among the ten best as shipped",
    }
    data = {
        name: ("setting", np.array(column, dtype=float), {"units": "1", "long_name": text})
        for (name, text), column in zip(names.items(), zip(*rows, strict=True), strict=True)
    }
    return xr.Dataset(data, coords={"setting": varied["setting"]})


def shares(ranking: xarray.Dataset, best: int) -> tuple[Array, Array]:
    """Among the best: how often a line has a k, (4, 4), and a group of rim springs a p, (7, 6)."""
    top = ranking.isel(assignment=slice(best))
    found = []
    for name, count in (("k", 4), ("p", 6)):
        numbers = top[name].to_numpy()
        found.append(np.stack([(numbers == i + 1).mean(axis=0) for i in range(count)], axis=1))
    return found[0], found[1]
