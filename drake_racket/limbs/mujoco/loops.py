"""Finds what ties bodies of a MuJoCo model to each other, and where a keyframe has its joints."""

from __future__ import annotations

from typing import Any

from drake_racket.io.errors import InputError
from drake_racket.limbs.left_out import short_list
from drake_racket.limbs.mujoco.couplings import joint_couplings
from drake_racket.limbs.mujoco.model import (
    body_name,
    enabled,
    joint_name,
    mujoco_package,
)
from drake_racket.limbs.mujoco.tree import Tree


def keyframe_positions(model: Any, keyframe: str | int) -> dict[str, float]:
    """Gives where the hinges and slides are in a keyframe, but tied ones; by its name or number."""
    mujoco = mujoco_package()
    names = [str(model.key(i).name) for i in range(model.nkey)]
    text = str(keyframe)
    number = names.index(text) if text in names else int(text) if text.isdecimal() else -1
    if not 0 <= number < model.nkey:
        allowed = short_list([name or str(i) for i, name in enumerate(names)])
        raise InputError("import_mujoco: keyframe", keyframe, allowed)
    scalar = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    tied = {coupling.tied for coupling in joint_couplings(model)}
    return {
        joint_name(model, i): float(model.key_qpos[number, model.jnt_qposadr[i]])
        for i in range(model.njnt)
        if model.jnt_type[i] in scalar and joint_name(model, i) not in tied
    }


def check_loops(tree: Tree) -> None:
    """Refuses an active equality between bodies, or along tendons, that joints can move."""
    mujoco, model = mujoco_package(), tree.model
    if not enabled(model, "equality"):
        return
    carried = _carried(tree)
    body_to_body = (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD))
    for i in range(model.neq):
        ends = [int(model.eq_obj1id[i]), int(model.eq_obj2id[i])]
        if not model.eq_active0[i]:
            continue
        if model.eq_type[i] in body_to_body:
            if int(model.eq_objtype[i]) == int(mujoco.mjtObj.mjOBJ_SITE):
                ends = [int(model.site_bodyid[site]) for site in ends]
            between = carried.get(ends[0], frozenset()) ^ carried.get(ends[1], frozenset())
            names = " and ".join(body_name(model, body) for body in ends)
        elif model.eq_type[i] == int(mujoco.mjtEq.mjEQ_TENDON):
            tendons = [tendon for tendon in ends if tendon >= 0]
            between = frozenset().union(*(_moving(tree, carried, t) for t in tendons))
            names = " and ".join(f"tendon {model.tendon(t).name or t}" for t in tendons)
        else:
            continue
        if between:
            raise InputError(
                f"import_mujoco: equality {str(model.eq(i).name) or i}",
                f"it ties {names}",
                f"no tie between bodies that move: lock the joints between them"
                f" (locked: {short_list(sorted(between), 6)}), or couplings='keep' leaves it out",
            )


def _moving(tree: Tree, carried: dict[int, frozenset[str]], tendon: int) -> frozenset[str]:
    """Names of the moving joints on which a tendon's length hangs."""
    mujoco, model = mujoco_package(), tree.model
    first = int(model.tendon_adr[tendon])
    wraps = range(first, first + int(model.tendon_num[tendon]))
    fixed = [w for w in wraps if model.wrap_type[w] == int(mujoco.mjtWrap.mjWRAP_JOINT)]
    joints = frozenset(joint_name(model, int(model.wrap_objid[w])) for w in fixed)
    sites = [w for w in wraps if model.wrap_type[w] == int(mujoco.mjtWrap.mjWRAP_SITE)]
    bodies = [int(model.site_bodyid[model.wrap_objid[w]]) for w in sites]
    ways = [carried.get(body, frozenset()) for body in bodies]
    every = frozenset().union(*carried.values())
    shared = frozenset.intersection(*ways) if ways else frozenset()
    return (joints & every) | (frozenset().union(*ways) - shared)


def _carried(tree: Tree) -> dict[int, frozenset[str]]:
    """By body, the names of the moving joints that carry it."""
    carried: dict[int, frozenset[str]] = {}
    for body in tree.bodies:
        own = {joint.name for joint in body.joints if not joint.locked}
        carried[body.id] = carried.get(body.parent, frozenset()) | own
    return carried
