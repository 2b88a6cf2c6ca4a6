"""Reads the numbers of a model from a Context: masses, places, constants, in `layout`'s order."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex, RevoluteSpring
from pydrake.systems.framework import Context

from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.extract.tree import Tree
from drake_racket.laws.surface import SurfaceModel

Array = NDArray[np.float64]


class Numbers:
    """Reads the numbers of one model from any Context of its plant.

    What no Context can change (which body is where, axes, rims) is put together once.
    """

    def __init__(self, tree: Tree, wiring: Any, bushings: list[Any], springs: list[Any]) -> None:
        """Prepares to read a model; `wiring` as of `extract.Wiring`."""
        self._tree, self._bushings, self._springs = tree, bushings, springs
        self._by_v = {n.v: i for i, n in enumerate(tree.nodes) if n.kind != at.WELD}
        self._nodes, self._leaves = _node_places(tree), _leaf_places(tree)
        self._bodies = _massive(tree)
        self._runs = _Runs(tree, wiring, bushings)
        self._contacts = [
            _contact_places(tree, impact) for impact in wiring.impacts if impact.contact is not None
        ]
        self._rims = [_of_rims(wiring.impacts, name) for name in ("arms", "folds")]

    def read(self, root: Context, wiring: Any) -> Array:
        """Gives the floats of a model; the wiring's structure is that of the first one."""
        tree = self._tree
        plant = tree.plant
        context = plant.GetMyContextFromRoot(root)
        gravity = np.array(plant.gravity_field().gravity_vector())
        strings, contacts, points = [np.zeros((4, 0))], [], []
        places = iter(self._contacts)
        for impact in wiring.impacts:
            bed = impact.string_bed
            strings.append(bed.spring_constants(bed.GetMyContextFromRoot(root)))
            if impact.contact is not None:
                own = impact.contact.GetMyContextFromRoot(root)
                contacts.append(_contact(impact, own, next(places)))
                friction = own.get_numeric_parameter(1).CopyToVector()
                points.append(np.column_stack([impact.contact.model.grid, friction]))
        limits = []
        for system in wiring.limits:
            own = system.GetMyContextFromRoot(root)
            limits.append(
                np.stack([own.get_numeric_parameter(i).CopyToVector() for i in range(4)], axis=1)
            )
        torques = np.zeros(plant.num_velocities()) if wiring.torques is None else wiring.torques
        parts = [
            [*gravity, 0.0],
            self._node_floats(context),
            self._leaf_floats(context),
            [_bushing(tree, b, context) for b in self._bushings],
            np.concatenate(strings, axis=1),
            contacts,
            np.concatenate(points) if points else [],
            np.concatenate(limits) if limits else [],
            [d for _, d in wiring.frame_losses],
            [d for _, d in wiring.limb_losses],
            *self._rims,
            *_strike(tree, wiring.strike),
            torques,
        ]
        return np.concatenate([np.asarray(part, dtype=float).ravel() for part in parts])

    def _node_floats(self, context: Context) -> Array:
        tree, plant, by_v = self._tree, self._tree.plant, self._by_v
        rows = self._nodes.copy()
        for row, node in zip(rows, tree.nodes, strict=True):
            if node.kind != at.WELD:
                damping = node.joint.GetDampingVector(context)  # type: ignore[union-attr]
                if node.kind >= at.FREE_QUATERNION:
                    row[at.DAMPING : at.DAMPING + 6] = damping
                else:
                    row[at.DAMPING] = damping[node.v - node.joint.velocity_start()]  # type: ignore[union-attr]
        for index in plant.GetJointActuatorIndices():
            actuator = plant.get_joint_actuator(index)
            rotor = actuator.calc_reflected_inertia(context)
            rows[by_v[actuator.joint().velocity_start()], at.ROTOR] += rotor
        for spring in self._springs:
            if isinstance(spring, RevoluteSpring):
                k, nominal = spring.GetStiffness(context), spring.GetNominalAngle(context)
            else:
                k, nominal = spring.stiffness(), spring.nominal_position()
            row = rows[by_v[spring.joint().velocity_start()]]
            total = row[at.SPRING] + k
            if total > 0.0:
                row[at.NOMINAL] = (row[at.SPRING] * row[at.NOMINAL] + k * nominal) / total
            row[at.SPRING] = total
        for body in self._bodies:
            body.add_to(rows, context)
        massive = rows[:, at.MASS] > 0.0
        rows[massive, at.COM : at.COM + 3] /= rows[massive, at.MASS, None]
        rows[:, at.RUN] = self._runs.column(massive)
        return rows

    def _leaf_floats(self, context: Context) -> Array:
        rows = self._leaves.copy()
        for row, leaf in zip(rows, self._tree.leaves, strict=True):
            mass = leaf.body.get_mass(context)
            row[at.LEAF_MASS] = mass
            row[at.LEAF_WEIGHT] *= mass
            row[at.LEAF_DAMPING] = leaf.joint.GetDampingVector(context)[0]
        return rows


def _strike(tree: Tree, strike: Any) -> list[Any]:
    """Place and direction of a strike in the node's axes, and the numbers of its pulse."""
    if strike is None:
        return [[], []]
    _, X = tree.place[strike.body]
    return [[*(X @ strike.place), *(X.rotation() @ strike.direction)], strike.numbers]


def _of_rims(impacts: Any, name: str) -> list[float]:
    """What the rims do to their springs, as `extract.model` lists it."""
    tables = [getattr(impact.string_bed.model, name) for impact in impacts]
    return [float(x) for table in tables for x in table[np.nonzero(table)]]


def _node_places(tree: Tree) -> Array:
    rows = np.zeros((len(tree.nodes), at.NODE_FLOATS))
    for row, node in zip(rows, tree.nodes, strict=True):
        row[at.R_PF : at.R_PF + 9] = node.X_PF.rotation().matrix().ravel()
        row[at.P_PF : at.P_PF + 3] = node.X_PF.translation()
        row[at.PITCH] = node.pitch
    return rows


class _Runs:
    """Finds the runs among a tree's nodes.

    Axes of revolute joints that follow on each other through one point are one run, where nothing
    is between them: no mass, and nothing that another body, a bushing or a ball holds on to.
    """

    def __init__(self, tree: Tree, wiring: Any, bushings: list[Any]) -> None:
        held = [leaf.parent for leaf in tree.leaves]
        for bushing in bushings:
            for frame in (bushing.frameA(), bushing.frameC()):
                held.append(tree.place[int(frame.body().index())][0])
        for impact in wiring.impacts:
            if impact.contact is not None:
                held.append(tree.place[int(impact.ball.body.index())][0])
        if wiring.strike is not None:
            held.append(tree.place[int(wiring.strike.body)][0])
        inboard = [node.parent for node in tree.nodes]
        self._goes_on = [
            node.kind == at.REVOLUTE
            and node.parent == i - 1 >= 0
            and tree.nodes[node.parent].kind == at.REVOLUTE
            and not np.any(node.X_PF.translation())
            and inboard.count(node.parent) == 1
            and node.parent not in held
            for i, node in enumerate(tree.nodes)
        ]

    def column(self, massive: NDArray[np.bool_]) -> Array:
        """The column RUN of the nodes, of which some have mass."""
        runs = np.ones(len(massive))
        first = 0
        for i, goes_on in enumerate(self._goes_on):
            if goes_on and not massive[i - 1]:
                runs[first] += 1.0
                runs[i] = 0.0
            else:
                first = i
        return runs


class _Massive:
    """Adds the inertia of one body to the node that carries it."""

    def __init__(self, tree: Tree, index: int) -> None:
        self._body = tree.plant.get_body(BodyIndex(index))
        self._node, X = tree.place[index]
        self._there = None
        if not X.IsExactlyIdentity():
            self._there = X.rotation().matrix(), X.translation()
        instance = ModelInstanceIndex(int(self._body.model_instance()))
        self._falls = tree.plant.gravity_field().is_enabled(instance)

    def add_to(self, rows: Array, context: Context) -> None:
        mass = self._body.get_mass(context)
        if mass == 0.0:
            return
        inertia = self._body.CalcSpatialInertiaInBodyFrame(context)
        com, moments = inertia.get_com(), inertia.CalcRotationalInertia().CopyToFullMatrix3()
        if self._there is not None:
            R, p = self._there
            moments = R @ (moments - mass * _square(com)) @ R.T
            com = R @ com + p
            moments = moments + mass * _square(com)
        row = rows[self._node]
        row[at.MASS] += mass
        row[at.COM : at.COM + 3] += mass * com
        row[at.MOMENTS : at.MOMENTS + 6] += moments[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        if self._falls:
            row[at.WEIGHT] += mass
            row[at.WEIGHT + 1 : at.WEIGHT + 4] += mass * com


def _massive(tree: Tree) -> list[_Massive]:
    """The bodies on nodes; the point masses are leaves."""
    leaves = {int(leaf.body.index()) for leaf in tree.leaves}
    return [
        _Massive(tree, index)
        for index in range(1, tree.plant.num_bodies())
        if tree.place[index][0] >= 0 and index not in leaves
    ]


def _square(r: Array) -> Array:
    """|r|^2 1 - r r^T."""
    square: Array = np.dot(r, r) * np.eye(3) - np.outer(r, r)
    return square


def _leaf_places(tree: Tree) -> Array:
    """Places and axes of the point masses, and 1 where gravity pulls."""
    field_ = tree.plant.gravity_field()
    rows = np.zeros((len(tree.leaves), at.LEAF_FLOATS))
    for row, leaf in zip(rows, tree.leaves, strict=True):
        row[at.LEAF_PLACE : at.LEAF_PLACE + 3] = leaf.X_PF.translation()
        row[at.LEAF_AXIS : at.LEAF_AXIS + 3] = leaf.axis
        row[at.LEAF_WEIGHT] = field_.is_enabled(leaf.body.model_instance())
    return rows


def _bushing(tree: Tree, bushing: Any, context: Context) -> list[float]:
    row: list[float] = []
    for frame in (bushing.frameA(), bushing.frameC()):
        _, X_NB = tree.place[int(frame.body().index())]
        X = X_NB @ frame.CalcPoseInBodyFrame(context)
        row += [*X.rotation().matrix().ravel(), *X.translation()]
    return [
        *row,
        *bushing.GetTorqueStiffnessConstants(context),
        *bushing.GetTorqueDampingConstants(context),
        *bushing.GetForceStiffnessConstants(context),
        *bushing.GetForceDampingConstants(context),
    ]


def _contact_places(tree: Tree, impact: Any) -> list[float]:
    """Rim, axes of the strings in the head's node, and the ball's centre in its own."""
    first = impact.racket.string_joints[0].index()
    string = next(leaf for leaf in tree.leaves if leaf.joint.index() == first)
    _, X_NS = tree.place[int(string.body.index())]
    _, X_NQ = tree.place[int(impact.ball.body.index())]
    return [*impact.contact.model.rim, *X_NS.rotation().matrix().ravel(), *X_NQ.translation()]


def _contact(impact: Any, context: Context, places: list[float]) -> list[float]:
    ball = context.get_numeric_parameter(0).CopyToVector()
    third = context.get_numeric_parameter(2).CopyToVector()
    if isinstance(impact.contact.model, SurfaceModel):
        scales, choices, surface = np.zeros(2), np.zeros(3), third
    else:
        scales, choices = third, context.get_numeric_parameter(3).CopyToVector()
        surface = np.zeros(5)
    return [*ball, *scales, *choices, *places, *surface]
