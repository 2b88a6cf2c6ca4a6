"""Lists what an import from MuJoCo leaves out, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.limbs.left_out import LeftOut, LeftOutItem
from drake_racket.limbs.mujoco.model import (
    body_name,
    enabled,
    joint_name,
    mujoco_package,
)
from drake_racket.limbs.mujoco.tree import Tree


def left_out(tree: Tree, couplings: str) -> LeftOut:
    """Goes through the model.

    Bodies and joints are counted in the subtree, everything else in the whole model, since a tendon
    or a contact may reach out of any subtree.
    """
    rows = (*_bodies(tree), *_joints(tree, couplings), *_elements(tree.model))
    return LeftOut(tuple(LeftOutItem(k, fate, tuple(n)) for k, fate, n in rows if n))


LeftOutRow = tuple[str, str, list[str]]


def _bodies(tree: Tree) -> Iterator[LeftOutRow]:
    model = tree.model
    inside = {body.id for body in tree.bodies}
    names = [body_name(model, i) for i in range(model.nbody)]
    yield (
        "bodies outside the subtree",
        "absent",
        [names[i] for i in range(1, model.nbody) if i not in inside],
    )

    def of(values: NDArray[Any]) -> list[str]:
        return [names[i] for i in sorted(inside) if values[i]]

    yield "gravity compensation", "absent: full weight", of(model.body_gravcomp)
    yield "mocap bodies", "fixed where drawn", of(model.body_mocapid >= 0)
    massless = (model.body_mass == 0.0) & (model.body_inertia.max(axis=1) > 0.0)
    yield "inertias without mass", "absent", of(massless)


def _joints(tree: Tree, couplings: str) -> Iterator[LeftOutRow]:
    model, joints = tree.model, tree.joints()
    mujoco = mujoco_package()
    inside = {body.id for body in tree.bodies}
    free = [
        joint_name(model, i)
        for i in range(model.njnt)
        if model.jnt_type[i] == int(mujoco.mjtJoint.mjJNT_FREE) and model.jnt_bodyid[i] in inside
    ]
    yield "free joints", "body fixed at qpos0", free
    fate = "tied joint is locked" if couplings == "lock" else "tied joint is free"
    yield "joint couplings", fate, [joint.name for joint in joints if joint.name in tree.tied]
    given = [joint.name for joint in joints if joint.locked and joint.name not in tree.tied]
    yield "joints locked by the caller", "locked", given
    moving = [joint for joint in joints if not joint.locked]

    def of(values: NDArray[Any]) -> list[str]:
        return [joint.name for joint in moving if np.any(values[joint.id])]

    dofs = [int(model.jnt_dofadr[i]) for i in range(model.njnt)]
    ball = model.jnt_type == int(mujoco.mjtJoint.mjJNT_BALL)
    yield "dry friction of joints", "absent", of(model.dof_frictionloss[dofs])
    yield "ball joints' armature", "absent", of(ball * model.dof_armature[dofs])
    yield "ball joints' stiffness", "absent", of(ball * model.jnt_stiffness)
    yield "ball joints' ranges", "absent", of(ball * model.jnt_limited)
    if hasattr(model, "jnt_stiffnesspoly"):  # newer versions have it
        yield "joint stiffness, higher powers", "absent", of(model.jnt_stiffnesspoly)
        yield "joint damping, higher powers", "absent", of(model.dof_dampingpoly[dofs])


def _elements(model: Any) -> Iterator[LeftOutRow]:
    mujoco = mujoco_package()

    def named(count: int, get: Callable[[int], Any], kind: str) -> list[str]:
        return [str(get(i).name) or f"{kind}_{i}" for i in range(count)]

    actuators = named(model.nu, model.actuator, "actuator")
    muscle = model.actuator_gaintype == int(mujoco.mjtGain.mjGAIN_MUSCLE)
    yield "muscles", "absent", [n for n, m in zip(actuators, muscle, strict=True) if m]
    yield "other actuators", "absent", [n for n, m in zip(actuators, muscle, strict=True) if not m]
    yield "tendons", "absent", named(model.ntendon, model.tendon, "tendon")
    equalities = named(model.neq, model.eq, "equality")
    joints = model.eq_type == int(mujoco.mjtEq.mjEQ_JOINT)
    other = [n for n, j in zip(equalities, joints, strict=True) if not j]
    yield "other equality constraints", "absent", other
    inactive = [
        n for n, j, a in zip(equalities, joints, model.eq_active0, strict=True) if j and not a
    ]
    yield "inactive joint couplings", "absent", inactive
    geoms = named(model.ngeom, model.geom, "geom")
    touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    yield "geoms that can touch", "absent", [n for n, t in zip(geoms, touching, strict=True) if t]
    rest = [n for n, t in zip(geoms, touching, strict=True) if not t]
    yield "other geoms", "absent (mass is the body's)", rest
    yield "contact pairs", "absent", named(model.npair, model.pair, "pair")
    yield "contact exclusions", "absent", named(model.nexclude, model.exclude, "exclude")
    yield "sites", "absent but the hand", named(model.nsite, model.site, "site")
    yield "flexible bodies", "absent", [f"flex_{i}" for i in range(model.nflex)]
    yield "sensors", "absent", named(model.nsensor, model.sensor, "sensor")
    yield "keyframes", "absent", named(model.nkey, model.key, "key")
    yield "cameras", "absent", named(model.ncam, model.cam, "camera")
    yield "lights", "absent", named(model.nlight, model.light, "light")
    fluid = [n for n in ("density", "viscosity") if getattr(model.opt, n) != 0.0]
    yield "fluid forces", "absent", fluid
    gravity = ", ".join(f"{g:g}" for g in gravity_of(model))
    yield "gravity", "the plant's own acts", [f"({gravity}) m/s^2"]
    flags = [name for name in FLAGS if not enabled(model, name)]
    yield "switched off by the model", "as there", flags


FLAGS = ("gravity", "limit", "spring", "damper", "equality")
"""The option flags of a model that the import follows."""


def gravity_of(model: Any) -> NDArray[np.float64]:
    """Gives the gravity (3,) that acts in a model, in its world (m/s^2)."""
    return np.array(model.opt.gravity) * float(enabled(model, "gravity"))
