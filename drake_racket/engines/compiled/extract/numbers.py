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


def read_numbers(
    tree: Tree, root: Context, wiring: Any, bushings: list[Any], springs: list[Any]
) -> Array:
    """Gives the floats of a model; `wiring` as of `extract.Wiring`."""
    plant = tree.plant
    context = plant.GetMyContextFromRoot(root)
    gravity = np.array(plant.gravity_field().gravity_vector())
    strings, contacts, points = [np.zeros((4, 0))], [], []
    for impact in wiring.impacts:
        constants = impact.string_bed.spring_constants(impact.string_bed.GetMyContextFromRoot(root))
        strings.append(constants)
        if impact.contact is not None:
            contacts.append(_contact(tree, impact, root))
            friction = impact.contact.GetMyContextFromRoot(root).get_numeric_parameter(1)
            points.append(np.column_stack([impact.contact.model.grid, friction.CopyToVector()]))
    limits = []
    for system in wiring.limits:
        own = system.GetMyContextFromRoot(root)
        limits.append(
            np.stack([own.get_numeric_parameter(i).CopyToVector() for i in range(4)], axis=1)
        )
    torques = np.zeros(plant.num_velocities()) if wiring.torques is None else wiring.torques
    nodes = _node_floats(tree, context, springs)
    nodes[:, at.RUN] = _runs(tree, nodes, wiring, bushings)
    parts = [
        [*gravity, 0.0],
        nodes,
        _leaf_floats(tree, context),
        [_bushing(tree, b, context) for b in bushings],
        np.concatenate(strings, axis=1),
        contacts,
        np.concatenate(points) if points else [],
        np.concatenate(limits) if limits else [],
        [d for _, d in wiring.frame_losses],
        [d for _, d in wiring.limb_losses],
        _of_rims(wiring.impacts, "arms"),
        _of_rims(wiring.impacts, "folds"),
        *_strike(tree, wiring.strike),
        torques,
    ]
    return np.concatenate([np.asarray(part, dtype=float).ravel() for part in parts])


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


def _node_floats(tree: Tree, context: Context, springs: list[Any]) -> Array:
    plant = tree.plant
    rows = np.zeros((len(tree.nodes), at.NODE_FLOATS))
    by_v: dict[int, int] = {}
    for i, node in enumerate(tree.nodes):
        row = rows[i]
        row[at.R_PF : at.R_PF + 9] = node.X_PF.rotation().matrix().ravel()
        row[at.P_PF : at.P_PF + 3] = node.X_PF.translation()
        row[at.PITCH] = node.pitch
        if node.kind != at.WELD:
            by_v[node.v] = i
            damping = node.joint.GetDampingVector(context)  # type: ignore[union-attr]
            if node.kind >= at.FREE_QUATERNION:
                row[at.DAMPING : at.DAMPING + 6] = damping
            else:
                row[at.DAMPING] = damping[node.v - node.joint.velocity_start()]  # type: ignore[union-attr]
    for index in plant.GetJointActuatorIndices():
        actuator = plant.get_joint_actuator(index)
        rows[by_v[actuator.joint().velocity_start()], at.ROTOR] += actuator.calc_reflected_inertia(
            context
        )
    for spring in springs:
        if isinstance(spring, RevoluteSpring):
            k, nominal = spring.GetStiffness(context), spring.GetNominalAngle(context)
        else:
            k, nominal = spring.stiffness(), spring.nominal_position()
        row = rows[by_v[spring.joint().velocity_start()]]
        total = row[at.SPRING] + k
        if total > 0.0:
            row[at.NOMINAL] = (row[at.SPRING] * row[at.NOMINAL] + k * nominal) / total
        row[at.SPRING] = total
    _add_inertias(tree, context, rows)
    return rows


def _runs(tree: Tree, rows: Array, wiring: Any, bushings: list[Any]) -> Array:
    """The column RUN of the nodes.

    Axes of revolute joints that follow on each other through one point are one run, where nothing
    is between them: no mass, and nothing that another body, a bushing or a ball holds on to.
    """
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
    runs = np.ones(len(tree.nodes))
    first = 0
    for i, node in enumerate(tree.nodes):
        before = node.parent
        goes_on = (
            node.kind == at.REVOLUTE
            and before == i - 1 >= 0
            and tree.nodes[before].kind == at.REVOLUTE
            and not np.any(node.X_PF.translation())
            and rows[before, at.MASS] == 0.0
            and inboard.count(before) == 1
            and before not in held
        )
        if goes_on:
            runs[first] += 1.0
            runs[i] = 0.0
        else:
            first = i
    return runs


def _add_inertias(tree: Tree, context: Context, rows: Array) -> None:
    plant = tree.plant
    field_ = plant.gravity_field()
    leaves = {int(leaf.body.index()) for leaf in tree.leaves}
    for index in range(1, plant.num_bodies()):
        node, X = tree.place[index]
        body = plant.get_body(BodyIndex(index))
        mass = body.get_mass(context)
        if node < 0 or mass == 0.0 or index in leaves:
            continue
        inertia = body.CalcSpatialInertiaInBodyFrame(context)
        com, moments = inertia.get_com(), inertia.CalcRotationalInertia().CopyToFullMatrix3()
        if not X.IsExactlyIdentity():
            R, p = X.rotation().matrix(), X.translation()
            moments = R @ (moments - mass * _square(com)) @ R.T
            com = R @ com + p
            moments = moments + mass * _square(com)
        row = rows[node]
        row[at.MASS] += mass
        row[at.COM : at.COM + 3] += mass * com
        row[at.MOMENTS : at.MOMENTS + 6] += moments[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        if field_.is_enabled(ModelInstanceIndex(int(body.model_instance()))):
            row[at.WEIGHT] += mass
            row[at.WEIGHT + 1 : at.WEIGHT + 4] += mass * com
    massive = rows[:, at.MASS] > 0.0
    rows[massive, at.COM : at.COM + 3] /= rows[massive, at.MASS, None]


def _square(r: Array) -> Array:
    """|r|^2 1 - r r^T."""
    square: Array = np.dot(r, r) * np.eye(3) - np.outer(r, r)
    return square


def _leaf_floats(tree: Tree, context: Context) -> list[list[float]]:
    field_ = tree.plant.gravity_field()
    rows = []
    for leaf in tree.leaves:
        mass = leaf.body.get_mass(context)
        pulled = field_.is_enabled(leaf.body.model_instance())
        damping = float(leaf.joint.GetDampingVector(context)[0])
        rows.append([*leaf.X_PF.translation(), *leaf.axis, mass, mass * pulled, damping])
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


def _contact(tree: Tree, impact: Any, root: Context) -> list[float]:
    context = impact.contact.GetMyContextFromRoot(root)
    ball = context.get_numeric_parameter(0).CopyToVector()
    third = context.get_numeric_parameter(2).CopyToVector()
    if isinstance(impact.contact.model, SurfaceModel):
        scales, choices, surface = np.zeros(2), np.zeros(3), third
    else:
        scales, choices = third, context.get_numeric_parameter(3).CopyToVector()
        surface = np.zeros(5)
    first = next(
        leaf
        for leaf in tree.leaves
        if leaf.joint is impact.racket.string_joints[0]
        or leaf.joint.index() == impact.racket.string_joints[0].index()
    )
    _, X_NS = tree.place[int(first.body.index())]
    _, X_NQ = tree.place[int(impact.ball.body.index())]
    return [
        *ball,
        *scales,
        *choices,
        *impact.contact.model.rim,
        *X_NS.rotation().matrix().ravel(),
        *X_NQ.translation(),
        *surface,
    ]
