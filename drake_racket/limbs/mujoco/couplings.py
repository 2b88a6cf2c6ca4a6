"""Finds where a MuJoCo model's joints are, and which of them a coupling or the caller holds.

A joint coupling (an `mjEQ_JOINT` equality) ties joint y to joint x by a quartic:
y - y0 = a0 + a1 (x - x0) + ... + a4 (x - x0)^4, with x0 and y0 from qpos0; without an x,
y - y0 = a0 (MuJoCo documentation, XML reference, "equality/joint").
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_racket.io.errors import InputError
from drake_racket.limbs.left_out import short_list
from drake_racket.limbs.mujoco.model import enabled, joint_name, mujoco_package

COUPLINGS = ("lock", "keep")


@dataclass(frozen=True)
class Coupling:
    """Holds an active joint coupling: the joint it ties, the one it follows (or None), a0 to a4."""

    tied: str
    leader: str | None
    coefficients: tuple[float, ...]


def joint_couplings(model: Any) -> tuple[Coupling, ...]:
    """Gives the active joint couplings, in the model's order; several may tie one joint."""
    mujoco = mujoco_package()
    found: list[Coupling] = []
    if not enabled(model, "equality"):
        return ()
    for i in range(model.neq):
        if model.eq_type[i] != int(mujoco.mjtEq.mjEQ_JOINT) or not model.eq_active0[i]:
            continue
        tied, leader = joint_name(model, int(model.eq_obj1id[i])), int(model.eq_obj2id[i])
        follows = joint_name(model, leader) if leader >= 0 else None
        found.append(Coupling(tied, follows, tuple(float(a) for a in model.eq_data[i, :5])))
    return tuple(found)


def joint_values(
    model: Any,
    found: Iterable[Coupling],
    couplings: str,
    locked: Mapping[str, float],
    reference: Mapping[str, float],
) -> tuple[dict[str, float], frozenset[str]]:
    """Gives the positions of all hinges and slides, rad or m, by name.

    And the names of those without a dof.

    Args:
        model: compiled.
        found: its `joint_couplings`.
        couplings, locked, reference: as `import_mujoco` takes them.

    Raises:
        InputError: unknown names, values that are not finite, or couplings that no value meets.

    """
    mujoco = mujoco_package()
    if couplings not in COUPLINGS:
        raise InputError("import_mujoco: couplings", couplings, ", ".join(COUPLINGS))
    scalar = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    at = {
        joint_name(model, i): int(model.jnt_qposadr[i])
        for i in range(model.njnt)
        if model.jnt_type[i] in scalar
    }
    rest = {name: float(model.qpos0[address]) for name, address in at.items()}
    _check(locked, "locked", rest)
    _check(reference, "reference", rest)
    values = {**rest, **reference, **locked}
    if couplings == "keep":
        return values, frozenset(locked)
    ties: dict[str, Coupling] = {}
    for coupling in found:
        if coupling.tied in ties:
            allowed = "one active coupling per tied joint, or couplings='keep'"
            raise InputError("import_mujoco: model", coupling.tied, allowed)
        ties[coupling.tied] = coupling
    for keyword, given in (("locked", locked), ("reference", reference)):
        if tied := [name for name in given if name in ties]:
            raise InputError(
                f"import_mujoco: {keyword}",
                tied[0],
                "a joint no coupling ties, or couplings='keep'",
            )
    for name in ties:
        _follow(name, ties, values, rest, ())
    return values, frozenset(locked) | frozenset(ties)


def _follow(
    name: str,
    ties: Mapping[str, Coupling],
    values: dict[str, float],
    rest: Mapping[str, float],
    above: tuple[str, ...],
) -> float:
    """The value of a joint, after those that it follows; kept in `values`."""
    if name in above:
        raise InputError("import_mujoco: model", name, "couplings that do not go in a circle")
    if name not in ties:
        return values[name]
    leader, coefficients = ties[name].leader, ties[name].coefficients
    moved = 0.0
    if leader is not None:
        moved = _follow(leader, ties, values, rest, (*above, name)) - rest[leader]
    values[name] = rest[name] + float(np.polynomial.polynomial.polyval(moved, coefficients))
    return values[name]


def _check(given: Mapping[str, float], keyword: str, allowed: Mapping[str, float]) -> None:
    for name, value in given.items():
        if name not in allowed:
            raise InputError(
                f"import_mujoco: {keyword}", name, f"hinges and slides: {short_list(allowed)}"
            )
        if not (isinstance(value, int | float) and math.isfinite(value)):
            raise InputError(f"import_mujoco: {keyword}[{name!r}]", value, "a finite number")
