"""Adds any limb: from the user's own plant, from SDF or URDF, or from Drake model directives."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from pydrake.math import RigidTransform
from pydrake.multibody.parsing import LoadModelDirectives, Parser, ProcessModelDirectives
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, ModelInstanceIndex, ScopedName

from drake_racket.io.errors import InputError
from drake_racket.io.shipped import add_to_package_map
from drake_racket.limbs.limb import Limb

LimbBuilder = Callable[[MultibodyPlant], Limb | Frame]
"""Adds a limb to the plant (before `Finalize`) and returns it, or its hand frame."""

_SUFFIXES = (".sdf", ".urdf", ".dmd.yaml", ".dmd.yml")


def find_limb(plant: MultibodyPlant, hand: Frame) -> Limb:
    """Gives limb that carries `hand`: every joint with degrees of freedom between it and the world.

    Before or after `Finalize`.

    Raises:
        InputError: no joint leads from the hand to the world's side, or several do.

    """
    by_child: dict[int, list[Joint]] = {}
    for joint in _joints(plant):
        by_child.setdefault(int(joint.child_body().index()), []).append(joint)
    chain: list[Joint] = []
    body = hand.body()
    while found := by_child.get(int(body.index())):
        if len(found) > 1:
            names = ", ".join(joint.name() for joint in found)
            allowed = f"a tree, with one joint towards the world from each body, not {names}"
            raise InputError("find_limb: body", body.name(), allowed)
        chain.append(found[0])
        body = found[0].parent_body()
    # six: the joint that Finalize gives to a limb whose base floats; it is no joint of the limb
    joints = tuple(joint for joint in reversed(chain) if 0 < joint.num_velocities() < 6)
    if not joints:
        raise InputError("find_limb: hand", hand.name(), "a frame on a body that joints carry")
    instances = dict.fromkeys(int(j.child_body().model_instance()) for j in chain)
    return Limb(plant, tuple(ModelInstanceIndex(i) for i in instances), hand, joints)


def add_limb_model(
    plant: MultibodyPlant,
    path: Path,
    hand: str,
    *,
    base: str = "",
    X_WB: RigidTransform | None = None,
) -> Limb:
    """Adds a limb from a file, before `Finalize`.

    Args:
        path: an SDF or URDF model, or model directives (`.dmd.yaml`); `package://drake_racket/` is
            known.
        hand: name of the frame on which the racket's grip frame lies; `model::frame` where several
            models have one of that name.
        base: name of a frame to weld to the world at `X_WB` (identity if None); "" where the file
            does that.

    Raises:
        InputError: the plant is finalized, the file cannot be read or parsed, or a frame is
            unknown.

    """
    if plant.is_finalized():
        raise InputError("add_limb_model: plant", "finalized", "a plant before Finalize()")
    if not path.name.endswith(_SUFFIXES):
        raise InputError("limb: model", path, f"upper_limb, or a path ending in {_SUFFIXES}")
    if not path.is_file():
        raise InputError("limb: model", path, "a file that can be read")
    before = plant.num_model_instances()
    parser = Parser(plant)
    add_to_package_map(parser.package_map())
    try:
        if path.name.endswith((".sdf", ".urdf")):
            parser.AddModels(str(path))
        else:
            ProcessModelDirectives(LoadModelDirectives(str(path)), parser)
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[0]
        raise InputError("limb: model", path, f"a model that Drake can parse ({reason})") from None
    if base:
        frame = find_frame(plant, base, "limb: base", first=before)
        if any(j.child_body().index() == frame.body().index() for j in _joints(plant)):
            allowed = 'a frame on a body that no joint of the file holds, or ""'
            raise InputError("limb: base", base, allowed)
        plant.WeldFrames(plant.world_frame(), frame, X_WB or RigidTransform())
    return find_limb(plant, find_frame(plant, hand, "limb: hand", first=before))


def find_frame(plant: MultibodyPlant, name: str, key: str, *, first: int = 0) -> Frame:
    """Gives a frame by its name or scoped name, among model instances from index `first` on.

    Raises:
        InputError: no frame of that name, or several; naming some that there are.

    """
    scoped = ScopedName.Parse(name)
    instances = [ModelInstanceIndex(i) for i in range(first, plant.num_model_instances())]
    namespace = scoped.get_namespace()
    found = [
        plant.GetFrameByName(scoped.get_element(), i)
        for i in instances
        if plant.HasFrameNamed(scoped.get_element(), i)
        and (not namespace or plant.GetModelInstanceName(i) == namespace)
    ]
    if len(found) == 1:
        return found[0]
    if found:
        models = [plant.GetModelInstanceName(f.model_instance()) for f in found]
        raise InputError(key, name, "one of " + ", ".join(f"{m}::{name}" for m in models))
    names = sorted(
        {
            frame.name()
            for i in instances
            for frame in (plant.get_frame(j) for j in plant.GetFrameIndices(i))
        }
    )
    raise InputError(key, name, ", ".join(names[:20]) + (", ..." if len(names) > 20 else ""))


def _joints(plant: MultibodyPlant) -> list[Joint]:
    return [plant.get_joint(index) for index in plant.GetJointIndices()]
