"""Reads an OpenSim model's bodies, joints and coordinates, as plain data.

A joint places its child's frame M in its parent's frame F. A CustomJoint's SpatialTransform gives
X_FM: a displacement in F's axes, each component along its own axis, then three body-fixed rotations
(OpenSim API documentation, SpatialTransform). Other joints are cases of it.
"""

from __future__ import annotations

import importlib
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform, RotationMatrix

from drake_racket.io.errors import InputError, one_line

Array = NDArray[np.float64]
_LINEAR = 1e-12  # by which a function may differ from a line of slope 1 or -1


@dataclass(frozen=True, eq=False)
class Step:
    """Holds one turn about, or slide along, a fixed axis.

    Attributes:
        kind: turn or slide.
        axis: (3,) unit vector.
        coordinate: the one that moves it; "" for a fixed step.
        sign, at: the angle (rad) or way (m) is sign coordinate + at.

    """

    kind: str
    axis: Array
    coordinate: str
    sign: float
    at: float

    def pose(self, value: float = 0.0) -> RigidTransform:
        """Gives the displacement at a value of the coordinate."""
        moved = self.sign * value + self.at
        if self.kind == "slide":
            return RigidTransform(moved * self.axis)
        from pydrake.common.eigen_geometry import AngleAxis

        return RigidTransform(RotationMatrix(AngleAxis(moved, self.axis)), np.zeros(3))


@dataclass(frozen=True)
class Coordinate:
    """Holds a coordinate: where it starts, its range (rad or m), and why it cannot move, if so."""

    name: str
    value: float
    limits: tuple[float, float]
    fixed: str


@dataclass(frozen=True)
class OpenSimJoint:
    """Holds a joint: from frame F on the parent body to frame M on the child, step by step.

    `steps` is None where Drake cannot move the joint as OpenSim does; `X_FM` is where it starts.
    """

    name: str
    kind: str
    parent: str
    child: str
    X_PF: RigidTransform
    X_BM: RigidTransform
    X_FM: RigidTransform
    coordinates: tuple[Coordinate, ...]
    steps: tuple[Step, ...] | None


@dataclass(frozen=True)
class OpenSimBody:
    """Holds a body: mass (kg), centre of mass (m), moments about it (kg m^2), in its axes."""

    name: str
    mass: float
    com: Array
    moments: Array  # xx yy zz xy xz yz


@dataclass(frozen=True)
class OpenSimTree:
    """Holds a model's skeleton; joints stand after those that carry them.

    Attributes:
        bodies: by name.
        joints: parents before children.
        points: name -> body and pose in it, of frames and markers.
        gravity: (3,) in the model's ground (m/s^2).
        model: OpenSim's own.

    """

    bodies: dict[str, OpenSimBody]
    joints: tuple[OpenSimJoint, ...]
    points: dict[str, tuple[str, RigidTransform]]
    gravity: Array
    model: Any


def opensim_package() -> Any:
    """Gives the `opensim` package.

    Raises:
        InputError: it is not installed.

    """
    try:
        return importlib.import_module("opensim")
    except ImportError:
        raise InputError(
            "opensim", "not installed", "pip install 'drake-racket[opensim]' for this import"
        ) from None


def read_model(path: str | Path) -> OpenSimTree:
    """Reads an .osim file.

    Raises:
        InputError: the package is missing, or it does not read the file.

    """
    osim = opensim_package()
    path = Path(path)
    if not path.is_file():
        raise InputError("import_opensim: model", path, "a file that exists")
    osim.Logger.setLevelString("Off")
    try:
        model = osim.Model(str(path))
        state = model.initSystem()
    except RuntimeError as error:
        reason = one_line(str(error), 200)
        raise InputError(
            "import_opensim: model", path, f"a model that OpenSim reads ({reason})"
        ) from None
    tied = _tied(osim, model)
    bodies = {}
    for i in range(model.getBodySet().getSize()):
        bodies[model.getBodySet().get(i).getName()] = _body(model.getBodySet().get(i))
    joints = [
        _joint(osim, model.getJointSet().get(i), state, tied)
        for i in range(model.getJointSet().getSize())
    ]
    return OpenSimTree(
        bodies=bodies,
        joints=tuple(_in_order(joints)),
        points=_points(osim, model, bodies),
        gravity=_vector(model.getGravity()),
        model=model,
    )


def _vector(v: Any) -> Array:
    return np.array([v.get(i) for i in range(3)])


def _transform(X: Any) -> RigidTransform:
    R = np.array([[X.R().asMat33().get(i, j) for j in range(3)] for i in range(3)])
    return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), _vector(X.p()))


def _body(body: Any) -> OpenSimBody:
    I = body.getInertia()
    moments, products = I.getMoments(), I.getProducts()
    numbers = [moments.get(i) for i in range(3)] + [products.get(i) for i in range(3)]
    return OpenSimBody(
        body.getName(), body.getMass(), _vector(body.getMassCenter()), np.array(numbers)
    )


def _tied(osim: Any, model: Any) -> dict[str, str]:
    """Coordinates that a coupler makes follow others."""
    found = {}
    for i in range(model.getConstraintSet().getSize()):
        constraint = model.getConstraintSet().get(i)
        coupler = osim.CoordinateCouplerConstraint.safeDownCast(constraint)
        if coupler is not None and coupler.get_isEnforced():
            found[coupler.getDependentCoordinateName()] = constraint.getName()
    return found


def _joint(osim: Any, joint: Any, state: Any, tied: dict[str, str]) -> OpenSimJoint:
    F, M = joint.getParentFrame(), joint.getChildFrame()
    coordinates = tuple(
        _coordinate(joint.get_coordinates(i), state, tied) for i in range(joint.numCoordinates())
    )
    return OpenSimJoint(
        name=joint.getName(),
        kind=joint.getConcreteClassName(),
        parent=F.findBaseFrame().getName(),
        child=M.findBaseFrame().getName(),
        X_PF=_transform(F.findTransformInBaseFrame()),
        X_BM=_transform(M.findTransformInBaseFrame()),
        X_FM=_transform(M.findTransformBetween(state, F)),
        coordinates=coordinates,
        steps=_steps(osim, joint, coordinates),
    )


def _coordinate(coordinate: Any, state: Any, tied: dict[str, str]) -> Coordinate:
    name = coordinate.getName()
    fixed = f"follows by {tied[name]}" if name in tied else ""
    if coordinate.getDefaultLocked():
        fixed = fixed or "locked in the model"
    if coordinate.getDefaultIsPrescribed():
        fixed = fixed or "prescribed in the model"
    limits = float(coordinate.getRangeMin()), float(coordinate.getRangeMax())
    return Coordinate(name, float(coordinate.getValue(state)), limits, fixed)


_TURN, _SLIDE = "turn", "slide"
_KNOWN = {
    "WeldJoint": (),
    "PinJoint": ((_TURN, 2),),
    "SliderJoint": ((_SLIDE, 0),),
    "UniversalJoint": ((_TURN, 0), (_TURN, 1)),
    "GimbalJoint": ((_TURN, 0), (_TURN, 1), (_TURN, 2)),
}
"""Joint -> what its coordinates do in turn: turn about, or slide along, x (0), y (1), z (2)."""


def _steps(osim: Any, joint: Any, coordinates: tuple[Coordinate, ...]) -> tuple[Step, ...] | None:
    kind = joint.getConcreteClassName()
    names = [coordinate.name for coordinate in coordinates]
    if kind in _KNOWN:
        moves = zip(_KNOWN[kind], names, strict=True)
        return tuple(Step(what, np.eye(3)[axis], name, 1.0, 0.0) for (what, axis), name in moves)
    if kind == "PlanarJoint":  # slides in F, then turns about z
        turn, x, y = names
        slides = [Step(_SLIDE, np.eye(3)[i], name, 1.0, 0.0) for i, name in enumerate((x, y))]
        return (*slides, Step(_TURN, np.eye(3)[2], turn, 1.0, 0.0))
    if kind != "CustomJoint":
        return None
    transform = osim.CustomJoint.safeDownCast(joint).getSpatialTransform()
    steps: list[Step] = []
    for i in (3, 4, 5, 0, 1, 2):
        step = _axis(osim, transform.getTransformAxis(i), _TURN if i < 3 else _SLIDE, coordinates)
        if step is None:
            return None
        steps.append(step)
    used = [step.coordinate for step in steps if step.coordinate]
    return tuple(steps) if len(used) == len(set(used)) else None


def _axis(osim: Any, axis: Any, kind: str, coordinates: tuple[Coordinate, ...]) -> Step | None:
    """One axis as a step; None where its function of free coordinates is no line of slope 1."""
    direction = _vector(axis.getAxis())
    size = float(np.linalg.norm(direction))
    written = axis.getCoordinateNamesInArray()
    names = [written.get(i) for i in range(written.getSize())]
    by_name = {coordinate.name: coordinate for coordinate in coordinates}
    known = [by_name[name] for name in names if name in by_name]
    if not axis.hasFunction():
        return Step(kind, np.eye(3)[0], "", 0.0, 0.0)

    def value(of: dict[str, float]) -> float:
        numbers = osim.Vector(len(names), 0.0)
        for i, name in enumerate(names):
            numbers.set(i, of.get(name, 0.0))
        return float(axis.getFunction().calcValue(numbers))

    start = {coordinate.name: coordinate.value for coordinate in known}
    at = value(start)
    moving = [
        c
        for c in known
        if not c.fixed and any(abs(value(start | {c.name: x}) - at) > _LINEAR for x in _samples(c))
    ]
    if not moving:
        return Step(kind, direction / size, "", 0.0, at)
    if len(moving) > 1:
        return None
    one = moving[0]
    low, high = _samples(one)[0], _samples(one)[-1]
    slope = (value(start | {one.name: high}) - value(start | {one.name: low})) / (high - low)
    offset = at - slope * one.value
    straight = all(
        abs(value(start | {one.name: x}) - slope * x - offset) <= _LINEAR * max(1.0, abs(x))
        for x in _samples(one)
    )
    if not straight or abs(abs(slope) - 1.0) > _LINEAR:
        return None
    return Step(kind, direction / size, one.name, math.copysign(1.0, slope), offset)


def _samples(coordinate: Coordinate) -> list[float]:
    low, high = coordinate.limits
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        low, high = coordinate.value - 1.0, coordinate.value + 1.0
    return [float(x) for x in np.linspace(low, high, 7)]


def _in_order(joints: list[OpenSimJoint]) -> list[OpenSimJoint]:
    waiting, done, known = list(joints), [], {"ground"}
    while waiting:
        ready = [joint for joint in waiting if joint.parent in known]
        if not ready:
            names = ", ".join(joint.name for joint in waiting)
            raise InputError("import_opensim: joints", names, "a tree from ground on")
        done += ready
        known |= {joint.child for joint in ready}
        waiting = [joint for joint in waiting if joint not in ready]
    return done


def _points(
    osim: Any, model: Any, bodies: dict[str, OpenSimBody]
) -> dict[str, tuple[str, RigidTransform]]:
    found = {name: (name, RigidTransform()) for name in bodies}
    for frame in model.getComponentsList():
        offset = osim.PhysicalOffsetFrame.safeDownCast(frame)
        if offset is not None:
            place = offset.findBaseFrame().getName(), _transform(offset.findTransformInBaseFrame())
            found.setdefault(offset.getName(), place)
    for i in range(model.getMarkerSet().getSize()):
        marker = model.getMarkerSet().get(i)
        base = marker.getParentFrame()
        X = _transform(base.findTransformInBaseFrame())
        location = RigidTransform(_vector(marker.get_location()))
        found.setdefault(marker.getName(), (base.findBaseFrame().getName(), X @ location))
    return found
