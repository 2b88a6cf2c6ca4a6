"""Adds the limb of a MuJoCo file as a scenario names it: model, hand, base, keyframe."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant

from drake_racket.io.errors import InputError
from drake_racket.limbs.files.joints import OTHERS, find_joint
from drake_racket.limbs.left_out import short_list
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.mujoco.couplings import joint_couplings
from drake_racket.limbs.mujoco.importer import hand_of, import_mujoco
from drake_racket.limbs.mujoco.loops import keyframe_positions
from drake_racket.limbs.mujoco.model import load_model
from drake_racket.limbs.mujoco.tree import Tree, read_tree


def add_mujoco_limb(
    plant: MultibodyPlant,
    path: Path,
    hand: str,
    *,
    base: str = "",
    X_WB: RigidTransform | None = None,
    locked: Sequence[str] = (),
    initial_deg: Mapping[str, float] | None = None,
    keyframe: str = "",
) -> Limb:
    """Adds the limb of a model file as a scenario names it: `limbs.models.add_limb_model`.

    Joints are locked here, not in the plant, which cannot once it has joint springs.
    """
    compiled = load_model(path)
    tree = read_tree(compiled, root=base or None, couplings="keep", locked={}, reference={})
    X_PF = None
    if base and X_WB is not None:
        X_PF = X_WB @ tree.bodies[0].X_PB.inverse()  # the base itself lies there
    at = keyframe_positions(compiled, keyframe) if keyframe else {}
    joints = {joint.name: joint for joint in tree.joints() if joint.kind != "ball"}
    for given, value in (initial_deg or {}).items():
        where = f"limb: initial_deg.{given}"
        joint = joints[find_joint(given, joints, where)]
        one = 1.0 if joint.kind == "slide" else math.radians(1.0)
        low, high = joint.limits or (-math.inf, math.inf)
        if not (math.isfinite(value) and low <= one * value <= high):
            allowed = f"the joint's range, {low / one:.6g} to {high / one:.6g}"
            raise InputError(where, value, allowed)
        at[joint.name] = one * value
    names: list[str] = []
    for given in locked:
        if given == OTHERS:
            names += _off_chain(tree, hand)
        else:
            names.append(find_joint(given, [*joints, OTHERS], "limb: locked"))
    values = {joint.name: joint.value for joint in joints.values()} | at
    tied = {coupling.tied for coupling in joint_couplings(compiled)}
    imported = import_mujoco(
        plant,
        compiled,
        root=base or None,
        hand=hand,
        locked={name: values[name] for name in names if name not in tied},
        reference={name: value for name, value in at.items() if name not in tied},
        X_PF=X_PF,
    )
    absent = [item for item in imported.left_out.items if item.kind in _WORTH_A_NOTE]
    notes = tuple(f"{item.kind}, {item.fate}: {short_list(item.names, 4)}" for item in absent)
    return replace(imported.limb, notes=notes)


def _off_chain(tree: Tree, hand: str) -> list[str]:
    """The hinges and slides that do not carry the hand."""
    body: int | None = hand_of(tree, hand)[0]
    by_id = {body.id: body for body in tree.bodies}
    chain: set[str] = set()
    while body in by_id:
        chain |= {joint.name for joint in by_id[body].joints}
        body = by_id[body].parent
    return [j.name for j in tree.joints() if j.name not in chain and j.kind != "ball"]


_WORTH_A_NOTE = (
    "gravity compensation",
    "joint couplings",
    "free joints",
    "dry friction of joints",
    "ball joints' stiffness",
    "switched off by the model",
)
"""What of an import may change an impact."""
