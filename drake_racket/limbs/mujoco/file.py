"""Adds the limb of a MuJoCo file as a scenario names it: model, hand, base, keyframe."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant

from drake_racket.limbs.left_out import short_list
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.mujoco.importer import import_mujoco
from drake_racket.limbs.mujoco.model import load_model
from drake_racket.limbs.mujoco.tree import read_tree


def add_mujoco_limb(
    plant: MultibodyPlant,
    path: Path,
    hand: str,
    *,
    base: str = "",
    X_WB: RigidTransform | None = None,
    keyframe: str = "",
) -> Limb:
    """Adds the limb of a model file as a scenario names it: `limbs.models.add_limb_model`."""
    compiled = load_model(path)
    X_PF = None
    if base and X_WB is not None:
        tree = read_tree(compiled, root=base, couplings="keep", locked={}, reference={})
        X_PF = X_WB @ tree.bodies[0].X_PB.inverse()  # the base itself lies there
    imported = import_mujoco(
        plant,
        compiled,
        root=base or None,
        hand=hand,
        keyframe=keyframe or None,
        X_PF=X_PF,
    )
    absent = [item for item in imported.left_out.items if item.kind in _WORTH_A_NOTE]
    notes = tuple(f"{item.kind}, {item.fate}: {short_list(item.names, 4)}" for item in absent)
    return replace(imported.limb, notes=notes)


_WORTH_A_NOTE = (
    "gravity compensation",
    "joint couplings",
    "free joints",
    "dry friction of joints",
    "ball joints' stiffness",
    "switched off by the model",
)
"""What of an import may change an impact."""
