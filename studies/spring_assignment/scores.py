"""Restitution of the published beds under assignments of their springs, and what it says.

Normal impacts on the clamped head at the points right of and on the long axis (1 2 4 5 7 8; 3 6 9
mirror 1 4 7), through the batch kernel. Results are kept in parts in a store, each named by a
hash of all that decides it: an interrupted run goes on where it was.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket import (
    RACKETS,
    TENSIONS,
    BallParameters,
    KeptResults,
    Progress,
    Quantity,
    RacketParameters,
    Report,
    StringBedModel,
    as_text,
    computation,
    digest,
    load_ball,
    load_racket,
    spring_constants,
    string_bed_model,
)
from drake_racket.engines import Bed, Impacts, make_impacts, run
from studies.spring_assignment.assignments import (
    RIM,
    SpringAssignment,
    geometric_factors,
    indices,
)

Array = NDArray[np.float64]

BEDS = tuple((racket, tension) for racket in RACKETS for tension in TENSIONS)
SIX_POINTS = (1, 2, 4, 5, 7, 8)
WEIGHTS = np.array([2.0, 1.0, 2.0, 1.0, 2.0, 1.0]) / 9.0
"""How many of the nine points each of SIX_POINTS stands for, over 9."""

SPEED = 25.0  # m/s
SPEEDS = (18.0, 25.0, 33.0)
STEP = 6e-5
"""s; leaves an error of up to 1.5e-5 in restitution and 1e-6 in its spread over a bed."""

PART = 360  # assignments per part: some 9000 impacts at one speed


@dataclass(frozen=True)
class Setting:
    """What the source does not print, chosen one way.

    Attributes:
        stiffness, damping: kb (N/m) and cb (N s/m) at 18 m/s in place of the ball's; None: those.
        rim_x, rim_y: m, added to the rim's semi-axes.
        shift: m, of the nine points towards the tip within the rim.

    """

    name: str
    stiffness: float | None = None
    damping: float | None = None
    rim_x: float = 0.0
    rim_y: float = 0.0
    shift: float = 0.0

    def ball(self) -> BallParameters:
        """The shipped ball, with this stiffness and damping."""
        ball = load_ball()
        for key, value in (("stiffness_low", self.stiffness), ("damping_low", self.damping)):
            if value is not None:
                unit = getattr(ball, key).unit
                given = Quantity(value, unit, "inferred", "chosen by the study")
                changes: dict[str, Any] = {key: given}
                ball = dataclasses.replace(ball, **changes)
        return ball

    def lengths(self, racket: RacketParameters) -> Array:
        """(24,) rest lengths, m."""
        bed = racket.string_bed
        a, b = bed.rim_semi_axis_x.value + self.rim_x, bed.rim_semi_axis_y.value + self.rim_y
        topology = racket.bed_topology()
        found = np.full(len(topology.names), bed.spacing.value)
        for row in np.flatnonzero(topology.second < 0):
            x, y = bed.spacing.value * topology.places[topology.first[row]]
            x += self.shift
            along = topology.directions[row, 0]  # +1 towards the tip, -1 towards the throat
            if along:
                found[row] = a * np.sqrt(1.0 - (y / b) ** 2) - along * x
            else:
                found[row] = b * np.sqrt(1.0 - (x / a) ** 2) - abs(y)
        return found


DEFAULT = Setting("as shipped")
SETTINGS = (
    DEFAULT,
    Setting("ball: kb 35 kN/m", stiffness=35e3),
    Setting("ball: kb 55 kN/m", stiffness=55e3),
    Setting("ball: cb 10 N s/m", damping=10.0),
    Setting("ball: cb 18 N s/m", damping=18.0),
    Setting("rim: 5 mm longer", rim_x=5e-3),
    Setting("rim: 5 mm shorter", rim_x=-5e-3),
    Setting("rim: 5 mm wider each side", rim_y=5e-3),
    Setting("rim: 5 mm narrower each side", rim_y=-5e-3),
    Setting("points 5 mm towards the tip", shift=5e-3),
    Setting("points 5 mm towards the throat", shift=-5e-3),
)
"""Off-centre points tell tip from throat: of a pair of mirror images, one is under either shift."""


def restitutions(
    assignments: Sequence[SpringAssignment],
    setting: Setting = DEFAULT,
    speeds: Sequence[float] = (SPEED,),
    *,
    store: Path | None = None,
    progress: Report | None = None,
) -> Array:
    """Restitution of every assignment.

    Args:
        speeds: m/s.
        store: file for the parts; None keeps nothing.
        progress: called with the assignments done; `task` is the setting's name.

    Returns:
        (n, 4, 6, speeds): over assignments, BEDS, SIX_POINTS and speeds.

    """
    model = _Model(setting, speeds)
    found = np.empty((len(assignments), len(BEDS), len(SIX_POINTS), len(speeds)))
    with closing(KeptResults(store, key="store", what="study")) as kept:
        for first in range(0, len(assignments), PART):
            some = assignments[first : first + PART]
            found[first : first + len(some)] = _part(model, some, kept)
            if progress is not None:
                progress(Progress(setting.name, first + len(some), len(assignments)))
    return found


class _Model:
    """The four beds and the impacts on one of them, for a setting and speeds."""

    def __init__(self, setting: Setting, speeds: Sequence[float]) -> None:
        self.rackets = [load_racket(racket, tension) for racket, tension in BEDS]
        self.models = [
            dataclasses.replace(string_bed_model(r), lengths=setting.lengths(r))
            for r in self.rackets
        ]
        points = np.repeat(SIX_POINTS, len(speeds))
        approach = np.tile(np.asarray(speeds, dtype=float), len(SIX_POINTS))
        self.impacts = make_impacts(self.rackets[0], setting.ball(), points, approach)
        self.shape = len(BEDS), len(SIX_POINTS), len(speeds)

    def bed(self, number: int, assignment: SpringAssignment) -> Bed:
        """One of BEDS under an assignment."""
        k, p = indices(assignment)
        model: StringBedModel = self.models[number]
        model = dataclasses.replace(model, stiffness_index=k, rim_factor_index=p)
        mass = self.rackets[number].string_mass()
        return Bed(spring_constants(model), mass, np.zeros((4, 24, 0)), model.topology)

    def run(self, beds: Sequence[Bed]) -> Array:
        """(n, 4, 6, speeds) restitution of the beds of n assignments."""
        count, one = len(beds), self.impacts
        many = Impacts(
            points=np.tile(one.points, count),
            velocities=np.tile(one.velocities, (count, 1)),
            balls=np.tile(one.balls, (count, 1)),
            ball_mass=one.ball_mass,
            sensitivity=np.zeros((count * len(one.points), 3, 0)),
            bed=np.repeat(np.arange(count), len(one.points)),
        )
        outcome = run(beds, many, step=STEP)
        values = np.where(outcome.ended, outcome.restitution(many)[0], np.nan)
        return np.asarray(values.reshape(-1, *self.shape))


def _part(model: _Model, some: Sequence[SpringAssignment], store: KeptResults) -> Array:
    beds = [model.bed(number, a) for a in some for number in range(len(BEDS))]
    name = hashlib.sha256(np.stack([bed.constants for bed in beds]).tobytes())
    for array in (
        model.impacts.points,
        model.impacts.velocities,
        model.impacts.balls,
        np.array([model.impacts.ball_mass, STEP, *(bed.mass for bed in beds[: len(BEDS)])]),
    ):
        name.update(array.tobytes())
    mark = digest(as_text(computation(Path(__file__).parent)).encode())
    kept = store.kept(name.hexdigest(), mark)
    if kept is not None:
        return np.frombuffer(kept).reshape(-1, *model.shape)
    found = model.run(beds)
    store.keep(name.hexdigest(), mark, found.tobytes())
    return found


def spread(restitution: Array) -> tuple[Array, Array]:
    """Standard deviation and range over the nine points, (n, 4, speeds) each."""
    weights = WEIGHTS[None, None, :, None]
    mean = (weights * restitution).sum(axis=2, keepdims=True)
    deviation = np.sqrt((weights * (restitution - mean) ** 2).sum(axis=2))
    return np.asarray(deviation), np.asarray(np.ptp(restitution, axis=2))


def score(restitution: Array) -> Array:
    """(n,) standard deviation over the nine points, mean over beds and speeds: the criterion."""
    return np.asarray(spread(restitution)[0].mean(axis=(1, 2)))


def geometry_misfit(assignments: Sequence[SpringAssignment]) -> Array:
    """(n,) RMS of ln(p / p by geometry) over the twelve rim springs of both rackets."""
    counts = np.array([len(group) for group in RIM.values()])
    total = np.zeros(len(assignments))
    for racket in (load_racket(name) for name in RACKETS):
        p, expected = np.array(racket.string_bed.rim_factors.value), geometric_factors(racket)
        given = p[np.array([a.p for a in assignments]) - 1]
        total += (np.log(given / expected) ** 2 @ counts) / counts.sum()
    return np.asarray(np.sqrt(total / len(RACKETS)))


def other_criteria(restitution: Array) -> dict[str, Array]:
    """Further statements of the source, for restitutions at SPEEDS; (n,) each.

    `lowest_rebound`, `highest_rebound`: m/s, over beds and points at the lowest and highest speed.
    `tension_effect`: mean restitution at high less that at low tension, the larger of the two
    rackets': below 0 where tension slows the ball. `faster_when_tight`: at how large a share of
    points and speeds it does not.
    `matched`: mean restitution of the tour racket at low tension less that of the recreational
    one at high: the source strung them to be equally stiff.
    """
    at = {bed: i for i, bed in enumerate(BEDS)}
    by_tension = [
        restitution[:, at[racket, "high"]] - restitution[:, at[racket, "low"]] for racket in RACKETS
    ]
    return {
        "lowest_rebound": SPEEDS[0] * restitution[..., 0].min(axis=(1, 2)),
        "highest_rebound": SPEEDS[-1] * restitution[..., -1].max(axis=(1, 2)),
        "tension_effect": np.max([_mean(change) for change in by_tension], axis=0),
        "faster_when_tight": np.mean([_mean(change > 0.0) for change in by_tension], axis=0),
        "matched": _mean(
            restitution[:, at["tour", "low"]] - restitution[:, at["recreational", "high"]]
        ),
    }


def _mean(values: NDArray[Any]) -> Array:
    """(n, 6, speeds) -> (n,): over the nine points and the speeds."""
    return np.asarray(np.einsum("nps,p->n", values, WEIGHTS) / values.shape[2])
