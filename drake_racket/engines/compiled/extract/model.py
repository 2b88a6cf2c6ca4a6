"""Reads a model of flat arrays from a finalized plant, its Context and the systems beside it.

Values come from the Context. Bodies that are welded together become one node; the racket's string
masses become point masses on prismatic joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    ForceElementIndex,
    Joint,
    LinearBushingRollPitchYaw,
    PrismaticSpring,
    RevoluteSpring,
    UniformGravityFieldElement,
)
from pydrake.systems.framework import Context

from drake_racket.engines.compiled.extract.numbers import Numbers
from drake_racket.engines.compiled.extract.tree import Tree
from drake_racket.io.errors import InputError
from drake_racket.laws.phases import nearest_point
from drake_racket.laws.surface import SurfaceModel

Array = NDArray[np.float64]
_Rows = list[tuple[int, ...]]


@dataclass(frozen=True)
class Model:
    """A model is what the kernel runs on; `layout` says where each number stands.

    Attributes:
        ints: structure.  floats: numbers of one case.
        tree: where the bodies are.  numbers: reads the floats of other Contexts.

    """

    ints: NDArray[np.int64]
    floats: Array
    tree: Tree
    numbers: Numbers


@dataclass(frozen=True)
class Strike:
    """A strike is a force of `laws.pulse` on a body.

    Attributes:
        body: its index.  place (m), direction: in its axes, (3,) each.
        sampled: of the pulse.  numbers: of the pulse.

    """

    body: int
    place: Array
    direction: Array
    sampled: bool
    numbers: Array


@dataclass(frozen=True)
class Wiring:
    """The wiring says what acts on a plant beside its own elements.

    Attributes:
        impacts: rackets with their string-beds and contacts.
        limits: JointLimits systems.
        torques: constant force on each velocity (nv,), N m or N.
        frame_losses, limb_losses: places in v and dampings of the joints whose losses are summed.
        grip, wrist: index of the bushing of the grip, and of a hand's wrist, among the plant's
            force elements; None without one.
        kept_welds: joints whose load is asked for.
        strike: of a hammer; None without one.

    """

    impacts: Sequence[Any] = ()
    limits: Sequence[Any] = ()
    torques: Array | None = None
    frame_losses: Sequence[tuple[int, float]] = ()
    limb_losses: Sequence[tuple[int, float]] = ()
    grip: int | None = None
    wrist: int | None = None
    kept_welds: Sequence[Joint] = ()
    strike: Strike | None = None


def extract(plant: MultibodyPlant, root: Context, wiring: Wiring) -> Model:
    """Reads a model from a plant and a Context of the Diagram that holds it.

    Raises:
        InputError: what the compiled engine cannot honour, by name.

    """
    context = plant.GetMyContextFromRoot(root)
    _check_plant(plant)
    leaves = [j for impact in wiring.impacts for j in impact.racket.string_joints]
    tree = Tree(plant, context, leaves, wiring.kept_welds)
    bushings, springs = _elements(plant)
    rows = {int(bushing.index()): row for row, bushing in enumerate(bushings)}
    hand = [-1 if i is None else rows[i] for i in (wiring.grip, wiring.wrist)]
    ints: list[Any] = [
        _node_ints(tree),
        [
            (leaf.parent, leaf.joint.position_start(), leaf.joint.velocity_start())
            for leaf in tree.leaves
        ],
        [
            (
                tree.place[int(b.frameA().body().index())][0],
                tree.place[int(b.frameC().body().index())][0],
            )
            for b in bushings
        ],
    ]
    leaf_of = {int(leaf.joint.index()): row for row, leaf in enumerate(tree.leaves)}
    ends, contacts, points, springs_before, elements = [], [], 0, 0, 0
    rims: _Rows = []
    folds: _Rows = []
    for impact in wiring.impacts:
        for rows_of, own in zip((rims, folds), _rim(impact, springs_before), strict=True):
            rows_of += own
        springs_before += len(impact.string_bed.model.topology.names)
        masses = np.array([leaf_of[int(j.index())] for j in impact.racket.string_joints])
        own = impact.string_bed.model.topology.ends
        ends.append(np.where(own >= 0, masses[own], -1))
        if impact.contact is not None:
            middle = nearest_point(impact.contact.model.grid, 0.0, 0.0)
            ball, _ = tree.place[int(impact.ball.body.index())]
            element = -1
            if isinstance(impact.contact.model, SurfaceModel):
                element = plant.num_multibody_states() + elements
                elements += impact.contact.ELEMENT
            contacts.append((masses[0], len(masses), ball, middle, points, element))
            points += len(masses)
    limits = [
        (q, v - plant.num_positions())
        for system in wiring.limits
        for q, v in zip(
            system.at.positions, system.at.num_positions + system.at.velocities, strict=True
        )
    ]
    strike = wiring.strike
    ints += [
        np.concatenate(ends, axis=1) if ends else np.zeros((2, 0), dtype=np.int64),
        contacts,
        limits,
        [v for v, _ in wiring.frame_losses],
        [v for v, _ in wiring.limb_losses],
        rims,
        folds,
        [] if strike is None else [(tree.place[strike.body][0], int(strike.sampled))],
    ]
    header = [
        len(tree.nodes),
        len(tree.leaves),
        len(bushings),
        int(np.asarray(ints[3]).shape[1]),
        len(contacts),
        points,
        len(limits),
        len(wiring.frame_losses),
        len(wiring.limb_losses),
        plant.num_positions(),
        plant.num_velocities(),
        *hand,
        len(rims),
        len(folds),
        elements,
        int(strike is not None),
        0 if strike is None else len(strike.numbers),
    ]
    flat = [np.asarray(part, dtype=np.int64).ravel() for part in (header, *ints)]
    numbers = Numbers(tree, wiring, bushings, springs)
    return Model(np.concatenate(flat), numbers.read(root, wiring), tree, numbers)


def _rim(impact: Any, first: int) -> tuple[_Rows, _Rows]:
    """The rows of a bed's rim, by springs: its arms and its folds; see `layout`."""
    bed = impact.string_bed
    count = len(bed.model.topology.points)
    at_joint = list(
        zip(bed.at.positions[count:].tolist(), bed.at.velocities[count:].tolist(), strict=True)
    )
    arms: _Rows = [(first + s, *at_joint[j]) for s, j in np.argwhere(bed.model.arms).tolist()]
    folds: _Rows = [
        (first + s, *at_joint[i], *at_joint[j]) for s, i, j in np.argwhere(bed.model.folds).tolist()
    ]
    return arms, folds


def _check_plant(plant: MultibodyPlant) -> None:
    if plant.time_step() > 0.0:
        raise InputError(
            "compiled engine: plant",
            f"a time step of {plant.time_step():g} s",
            "a continuous plant (time_step: 0)",
        )
    if plant.num_constraints():
        raise InputError(
            "compiled engine: plant",
            f"{plant.num_constraints()} constraints",
            "no constraints (engine: drake, time_step > 0)",
        )


def _node_ints(tree: Tree) -> list[tuple[int, ...]]:
    return [(n.parent, n.carrier, n.kind, n.axis, n.q, n.v, _is_turned(n.X_PF)) for n in tree.nodes]


def _is_turned(X: RigidTransform) -> int:
    return int(not np.array_equal(X.rotation().matrix(), np.eye(3)))


def _elements(plant: MultibodyPlant) -> tuple[list[Any], list[Any]]:
    """The plant's bushings, and the springs on its joints; any other element is refused."""
    bushings, springs = [], []
    for i in range(plant.num_force_elements()):
        element = plant.get_force_element(ForceElementIndex(i))
        if isinstance(element, LinearBushingRollPitchYaw):
            bushings.append(element)
        elif isinstance(element, (RevoluteSpring, PrismaticSpring)):
            springs.append(element)
        elif not isinstance(element, UniformGravityFieldElement):
            raise InputError(
                "compiled engine: force element",
                type(element).__name__,
                "bushings, springs on joints and gravity (engine: drake)",
            )
    return bushings, springs
