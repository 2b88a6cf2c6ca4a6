"""Reads a model of flat arrays from a finalized plant, its Context and the systems beside it.

Values come from the Context. Bodies that are welded together become one node; the racket's string
masses become point masses on prismatic joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    ForceElementIndex,
    Joint,
    LinearBushingRollPitchYaw,
    ModelInstanceIndex,
    PrismaticSpring,
    RevoluteSpring,
    RigidBody,
    UniformGravityFieldElement,
)
from pydrake.systems.framework import Context

from drake_racket.engines.compiled import layout as at
from drake_racket.io.errors import InputError

Array = NDArray[np.float64]
_AXES = {
    "revolute": at.REVOLUTE,
    "prismatic": at.PRISMATIC,
    "screw": at.SCREW,
}
_COVERED = (
    "weld", *_AXES, "universal", "planar", "ball_rpy", "quaternion_floating", "rpy_floating",
)


@dataclass
class Node:
    """A node is one axis of a joint, or a body free in the world; fields as in `layout`."""

    parent: int
    kind: int
    carrier: int
    axis: int = 2
    q: int = 0
    v: int = 0
    X_PF: RigidTransform = field(default_factory=RigidTransform)
    pitch: float = 0.0
    joint: Joint | None = None
    axes: int = 0  # of the joint before this one


@dataclass
class Leaf:
    """A leaf is a point mass on a prismatic joint."""

    parent: int
    joint: Joint
    body: RigidBody
    X_PF: RigidTransform
    axis: Array


class Tree:
    """The tree says which node each body of a plant is on, and where on it."""

    def __init__(
        self, plant: MultibodyPlant, context: Context, leaves: Sequence[Joint], kept: Sequence[Joint]
    ) -> None:
        self.plant, self.context = plant, context
        self.nodes: list[Node] = []
        self.leaves: list[Leaf] = []
        self.place: dict[int, tuple[int, RigidTransform]] = {0: (-1, RigidTransform())}
        self._as_leaf = {int(joint.index()) for joint in leaves}
        self._kept = {int(joint.index()) for joint in kept}
        self._grow()

    def _grow(self) -> None:
        plant = self.plant
        joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
        for joint in joints:
            _check_joint(joint, self.context)
        waiting = joints
        while waiting:
            later = []
            for joint in waiting:
                parent, child = int(joint.parent_body().index()), int(joint.child_body().index())
                if parent in self.place and child in self.place:
                    raise InputError(f"joint {joint.name()}", "a loop", "a tree of joints")
                if parent in self.place:
                    self._attach(joint, False)
                elif child in self.place:
                    self._attach(joint, True)
                else:
                    later.append(joint)
            if len(later) == len(waiting):
                raise InputError("plant", "bodies that no joint ties to the world", "a whole tree")
            waiting = later

    def _attach(self, joint: Joint, reverse: bool) -> None:
        inner, outer = joint.frame_on_parent(), joint.frame_on_child()
        if reverse:
            inner, outer = outer, inner
        node, X_NB = self.place[int(inner.body().index())]
        X_NF = X_NB @ inner.CalcPoseInBodyFrame(self.context)
        X_MB = outer.CalcPoseInBodyFrame(self.context).inverse()
        body = int(outer.body().index())
        kind = joint.type_name()
        if int(joint.index()) in self._as_leaf:
            axis = X_NF.rotation().matrix() @ _axis_of(joint)
            self.leaves.append(Leaf(node, joint, outer.body(), X_NF, axis))
            self.place[body] = (node, X_NF @ X_MB)
        elif kind == "weld":
            X = joint.X_FM()
            X_FM = X.inverse() if reverse else X
            if int(joint.index()) in self._kept:
                self.nodes.append(Node(node, at.WELD, node, X_PF=X_NF @ X_FM, joint=joint))
                self.place[body] = (len(self.nodes) - 1, X_MB)
            else:
                self.place[body] = (node, X_NF @ X_FM @ X_MB)
        else:
            turn = self._chain(joint, node, X_NF, reverse)
            self.place[body] = (len(self.nodes) - 1, RigidTransform(turn.inverse()) @ X_MB)

    def _add(self, **values: Any) -> int:
        self.nodes.append(Node(**values))
        return len(self.nodes) - 1

    def _chain(self, joint: Joint, parent: int, X: RigidTransform, reverse: bool) -> RotationMatrix:
        """The nodes of a joint; returns how the last one's axes are turned from the joint's."""
        q, v = joint.position_start(), joint.velocity_start()
        kind = joint.type_name()
        sign = -1.0 if reverse else 1.0
        turn = RotationMatrix()
        if kind in _AXES or kind in ("universal", "planar"):
            steps = _steps(joint)
            for k, (what, axis, pitch) in reversed(list(enumerate(steps))) if reverse else enumerate(
                steps
            ):
                to_axis = _rotation_to(sign * axis)
                turned = RotationMatrix(turn.inverse().matrix() @ to_axis.matrix())
                parent = self._add(
                    parent=parent, kind=what, carrier=parent, q=q + k, v=v + k,
                    X_PF=X @ RigidTransform(turned) if k == (len(steps) - 1 if reverse else 0)
                    else RigidTransform(turned),
                    pitch=pitch, joint=joint, axes=k,
                )
                turn = to_axis
            return turn
        if reverse:
            raise InputError(
                f"joint {joint.name()}", "reversed, of several coupled axes",
                "the parent nearer the world",
            )
        quaternion = kind == "quaternion_floating"
        if kind != "ball_rpy" and parent < 0:
            what = at.FREE_QUATERNION if quaternion else at.FREE_RPY
            self._add(parent=-1, kind=what, carrier=-1, q=q, v=v, X_PF=X, joint=joint)
            return turn
        at_v = v
        if kind != "ball_rpy":
            place = q + (4 if quaternion else 3)
            for k in range(3):
                parent = self._add(
                    parent=parent, kind=at.PRISMATIC, carrier=parent, axis=k, q=place + k,
                    v=v + 3 + k, X_PF=X if k == 0 else RigidTransform(), joint=joint, axes=3 + k,
                )
            X = RigidTransform()
        carrier = parent
        last = at.QUATERNION if quaternion else at.RPY
        for k in range(3):
            parent = self._add(
                parent=parent, kind=last if k == 2 else at.SPIN, carrier=carrier, axis=k, q=q,
                v=at_v + k, X_PF=X if k == 0 else RigidTransform(), joint=joint, axes=k,
            )
        return turn


def _axis_of(joint: Joint) -> Array:
    if joint.type_name() == "revolute":
        return np.array(joint.revolute_axis())
    if joint.type_name() == "prismatic":
        return np.array(joint.translation_axis())
    return np.array(joint.screw_axis())


def _steps(joint: Joint) -> list[tuple[int, Array, float]]:
    """Kind, axis and pitch of each axis of a joint, from the parent on."""
    kind = joint.type_name()
    if kind == "universal":
        return [(at.REVOLUTE, np.eye(3)[0], 0.0), (at.REVOLUTE, np.eye(3)[1], 0.0)]
    if kind == "planar":
        return [
            (at.PRISMATIC, np.eye(3)[0], 0.0),
            (at.PRISMATIC, np.eye(3)[1], 0.0),
            (at.REVOLUTE, np.eye(3)[2], 0.0),
        ]
    pitch = joint.screw_pitch() / (2.0 * np.pi) if kind == "screw" else 0.0
    return [(_AXES[kind], _axis_of(joint), pitch)]


def _rotation_to(axis: Array) -> RotationMatrix:
    """A rotation whose z is `axis`; the identity for z itself."""
    if axis[2] == 1.0:
        return RotationMatrix()
    z = axis / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return RotationMatrix(np.stack([x, np.cross(z, x), z], axis=1))


def _check_joint(joint: Joint, context: Context) -> None:
    if joint.type_name() not in _COVERED:
        raise InputError(
            f"compiled engine: joint {joint.name()}", joint.type_name(), ", ".join(_COVERED)
        )
    if joint.num_velocities() and joint.is_locked(context):
        raise InputError(
            f"compiled engine: joint {joint.name()}", "locked", "an unlocked joint (or a weld)"
        )


@dataclass(frozen=True)
class Model:
    """A model is what the kernel runs on; `layout` says where each number stands.

    Attributes:
        ints: structure.  floats: numbers of one case.
        tree: where the bodies are.

    """

    ints: NDArray[np.int64]
    floats: Array
    tree: Tree


@dataclass(frozen=True)
class Wiring:
    """The wiring says what acts on a plant beside its own elements.

    Attributes:
        impacts: rackets with their string-beds and contacts.
        limits: JointLimits systems.
        torques: constant force on each velocity (nv,), N m or N.
        frame_losses, limb_losses: places in v and dampings of the joints whose losses are summed.
        grip: index of the grip's bushing among the plant's force elements; None without one.
        kept_welds: joints whose load is asked for.

    """

    impacts: Sequence[Any] = ()
    limits: Sequence[Any] = ()
    torques: Array | None = None
    frame_losses: Sequence[tuple[int, float]] = ()
    limb_losses: Sequence[tuple[int, float]] = ()
    grip: int | None = None
    kept_welds: Sequence[Joint] = ()


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
    grip = -1
    for row, bushing in enumerate(bushings):
        if wiring.grip is not None and int(bushing.index()) == wiring.grip:
            grip = row
    ints: list[Any] = [
        _node_ints(tree),
        [(leaf.parent, leaf.joint.position_start(), leaf.joint.velocity_start())
         for leaf in tree.leaves],
        [(tree.place[int(b.frameA().body().index())][0],
          tree.place[int(b.frameC().body().index())][0]) for b in bushings],
    ]
    leaf_of = {int(leaf.joint.index()): row for row, leaf in enumerate(tree.leaves)}
    ends, contacts, points = [], [], 0
    for impact in wiring.impacts:
        rows = np.array([leaf_of[int(j.index())] for j in impact.racket.string_joints])
        own = impact.string_bed.model.topology.ends
        ends.append(np.where(own >= 0, rows[own], -1))
        if impact.contact is not None:
            middle = impact.contact._middle
            ball, _ = tree.place[int(impact.ball.body.index())]
            contacts.append((rows[0], len(rows), ball, middle, points))
            points += len(rows)
    limits = [
        (q, v - plant.num_positions())
        for system in wiring.limits
        for q, v in zip(system.at.positions, system.at.num_positions + system.at.velocities,
                        strict=True)
    ]
    ints += [
        np.concatenate(ends, axis=1) if ends else np.zeros((2, 0), dtype=np.int64),
        contacts,
        limits,
        [v for v, _ in wiring.frame_losses],
        [v for v, _ in wiring.limb_losses],
    ]
    header = [
        len(tree.nodes), len(tree.leaves), len(bushings), int(np.asarray(ints[3]).shape[1]),
        len(contacts), points, len(limits), len(wiring.frame_losses), len(wiring.limb_losses),
        plant.num_positions(), plant.num_velocities(), grip,
    ]
    flat = [np.asarray(part, dtype=np.int64).ravel() for part in (header, *ints)]
    return Model(np.concatenate(flat), _floats(tree, root, wiring, bushings, springs), tree)


def numbers_of(model: Model, root: Context, wiring: Wiring) -> Array:
    """Reads the floats of another Context into the same structure."""
    bushings, springs = _elements(model.tree.plant)
    return _floats(model.tree, root, wiring, bushings, springs)


def _check_plant(plant: MultibodyPlant) -> None:
    if plant.time_step() > 0.0:
        raise InputError("compiled engine: plant", f"a time step of {plant.time_step():g} s",
                         "a continuous plant (time_step: 0)")
    if plant.num_constraints():
        raise InputError("compiled engine: plant", f"{plant.num_constraints()} constraints",
                         "no constraints (engine: drake, time_step > 0)")


def _node_ints(tree: Tree) -> list[tuple[int, ...]]:
    return [(n.parent, n.carrier, n.kind, n.axis, n.q, n.v) for n in tree.nodes]


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
            raise InputError("compiled engine: force element", type(element).__name__,
                             "bushings, springs on joints and gravity (engine: drake)")
    return bushings, springs


def _floats(
    tree: Tree, root: Context, wiring: Wiring, bushings: list[Any], springs: list[Any]
) -> Array:
    plant = tree.plant
    context = plant.GetMyContextFromRoot(root)
    gravity = np.array(plant.gravity_field().gravity_vector())
    damped = 0.0
    strings, contacts, points = [np.zeros((4, 0))], [], []
    for impact in wiring.impacts:
        constants = impact.string_bed.spring_constants(
            impact.string_bed.GetMyContextFromRoot(root))
        damped = max(damped, float(constants[3].max()))
        strings.append(constants)
        if impact.contact is not None:
            contacts.append(_contact(tree, impact, root))
            friction = impact.contact.GetMyContextFromRoot(root).get_numeric_parameter(1)
            points.append(np.column_stack([impact.contact.model.grid, friction.CopyToVector()]))
    limits = []
    for system in wiring.limits:
        own = system.GetMyContextFromRoot(root)
        limits.append(np.stack(
            [own.get_numeric_parameter(i).CopyToVector() for i in range(4)], axis=1))
    torques = np.zeros(plant.num_velocities()) if wiring.torques is None else wiring.torques
    parts = [
        [*gravity, float(damped > 0.0)],
        _node_floats(tree, context, springs),
        _leaf_floats(tree, context),
        [_bushing(tree, b, context) for b in bushings],
        np.concatenate(strings, axis=1),
        contacts,
        np.concatenate(points) if points else [],
        np.concatenate(limits) if limits else [],
        [d for _, d in wiring.frame_losses],
        [d for _, d in wiring.limb_losses],
        torques,
    ]
    return np.concatenate([np.asarray(part, dtype=float).ravel() for part in parts])


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
        rows[by_v[actuator.joint().velocity_start()], at.ROTOR] += (
            actuator.calc_reflected_inertia(context))
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
    return np.dot(r, r) * np.eye(3) - np.outer(r, r)


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
    ball, scales, choices = (context.get_numeric_parameter(i).CopyToVector() for i in (0, 2, 3))
    first = next(leaf for leaf in tree.leaves if leaf.joint is impact.racket.string_joints[0]
                 or leaf.joint.index() == impact.racket.string_joints[0].index())
    _, X_NS = tree.place[int(first.body.index())]
    _, X_NQ = tree.place[int(impact.ball.body.index())]
    return [*ball, *scales, *choices, *impact.contact.model.rim,
            *X_NS.rotation().matrix().ravel(), *X_NQ.translation()]
