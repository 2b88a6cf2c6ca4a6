"""Adds any limb: from the user's own plant, or from a file of Drake's, MuJoCo's or OpenSim's."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, ModelInstanceIndex, RigidBody, ScopedName

from drake_racket.io.errors import InputError
from drake_racket.io.extras import need_library
from drake_racket.limbs.chain import Graph
from drake_racket.limbs.files.joints import settle_joints, with_ties
from drake_racket.limbs.files.parse import DIRECTIVES, Loaded, load_files
from drake_racket.limbs.files.ties import Loop, read_loops, read_mimics
from drake_racket.limbs.limb import Limb, Tie

LimbBuilder = Callable[[MultibodyPlant], Limb | Frame]
"""Adds a limb to the plant (before `Finalize`) and returns it, or its hand frame."""

MUJOCO, OPENSIM = (".xml", ".mjb"), (".osim",)
SUFFIXES = (".sdf", ".urdf", *DIRECTIVES, *MUJOCO, *OPENSIM)
"""Of the files that hold a limb; in capitals too."""


def need_reader(model: str, key: str) -> None:
    """Refuses a model whose format needs a library that is not installed; before any work."""
    for suffixes, library in ((MUJOCO, "mujoco"), (OPENSIM, "opensim")):
        if model.lower().endswith(suffixes):
            need_library(library, library, key, model)


def find_limb(plant: MultibodyPlant, hand: Frame, *, ties: Iterable[Tie] = ()) -> Limb:
    """Gives the limb that carries `hand`: the chain of joints from the trunk to it.

    Before or after `Finalize`. Whatever else the model has (another arm, a head, fingers) is not
    of the chain: `Limb.others`.

    Args:
        ties: of joints that follow others, which the plant holds by coupler constraints.

    Raises:
        InputError: no joint leads from the hand to the world's side, or several do.

    """
    graph = Graph(plant)
    chain = graph.path(hand.body())
    # six: the joint that Finalize gives to a limb whose base floats; it is no joint of the limb
    joints = tuple(joint for joint in chain if 0 < joint.num_velocities() < 6)
    if not joints:
        raise InputError("find_limb: hand", hand.name(), "a frame on a body that joints carry")
    return with_ties(Limb(plant, graph.models(chain, hand), hand, joints), ties)


def add_limb_model(
    plant: MultibodyPlant,
    path: str | Path,
    hand: str,
    *,
    base: str = "",
    X_WB: RigidTransform | None = None,
    locked: Sequence[str] = (),
    initial_deg: Mapping[str, float] | None = None,
    packages: Mapping[str, str | Path] | None = None,
    keyframe: str = "",
) -> Limb:
    """Adds a limb from a file, before `Finalize`.

    Args:
        path: an SDF or URDF model, or model directives (`.dmd.yaml`), in which a file without a
            scheme is relative to the directives; a MuJoCo model (`.xml`, `.mjb`; extra `mujoco`);
            or an OpenSim model (`.osim`; extra `opensim`).
        hand: name of the frame on which the racket's grip frame lies; `model::frame` where several
            models have one of that name. Of MuJoCo a body or site, of OpenSim a body or frame.
        base: name of a frame to weld to the world at `X_WB` (identity if None); "" where the file
            does that. Of MuJoCo and OpenSim the body from which on the model is taken; "" for the
            whole model, where it is drawn.
        locked: joints that do not move; `others` stands for all that are not on the chain to the
            hand.
        initial_deg: where joints start, or are locked (degrees; m at a prismatic joint).
        packages: name -> folder of `package://name/`, beside `drake_racket`, Drake's own, and those
            found above the file.
        keyframe: of MuJoCo, name (or number) of the posture that the joints start in.

    Raises:
        InputError: the plant is finalized, the file cannot be read or parsed, a name is unknown,
            or the plant cannot hold the file's constraints.

    """
    path = Path(path)
    if plant.is_finalized():
        raise InputError("add_limb_model: plant", "finalized", "a plant before Finalize()")
    kind = path.name.lower()
    if not kind.endswith(SUFFIXES):
        raise InputError("limb: model", path, f"upper_limb, or a path ending in {SUFFIXES}")
    if keyframe and not kind.endswith(MUJOCO):
        raise InputError("limb: keyframe", keyframe, "of a MuJoCo model only")
    if not path.is_file():
        raise InputError("limb: model", path, "a file that can be read")
    if kind.endswith(MUJOCO):
        from drake_racket.limbs.mujoco.file import add_mujoco_limb

        limb = add_mujoco_limb(
            plant,
            path,
            hand,
            base=base,
            X_WB=X_WB,
            locked=locked,
            initial_deg=initial_deg,
            keyframe=keyframe,
        )
        return settle_joints(plant, limb)
    if kind.endswith(OPENSIM):
        from drake_racket.limbs.opensim.importer import import_opensim

        limb = import_opensim(plant, path, hand=hand, base=base or None, X_WB=X_WB).limb
    else:
        limb = _add_drake(plant, path, hand, base, X_WB, packages or {})
    return settle_joints(plant, limb, locked=locked, initial_deg=initial_deg)


def _add_drake(
    plant: MultibodyPlant,
    path: Path,
    hand: str,
    base: str,
    X_WB: RigidTransform | None,
    packages: Mapping[str, str | Path],
) -> Limb:
    before, constraints = plant.num_model_instances(), plant.num_constraints()
    loaded = load_files(plant, path, packages)
    if base:
        frame = find_frame(plant, base, "limb: base", first=before)
        if any(j.child_body().index() == frame.body().index() for j in _joints(plant)):
            allowed = 'a frame on a body that no joint of the file holds, or ""'
            raise InputError("limb: base", base, allowed)
        plant.WeldFrames(plant.world_frame(), frame, X_WB or RigidTransform())
    ties = _ties(plant, loaded)
    limb = find_limb(plant, find_frame(plant, hand, "limb: hand", first=before), ties=ties)
    _check_loops(plant, limb, loaded, plant.num_constraints() - constraints - len(ties))
    notes = (note for file in loaded for note in file.notes)
    return replace(limb, notes=(*limb.notes, *notes))


def _ties(plant: MultibodyPlant, loaded: Sequence[Loaded]) -> list[Tie]:
    ties = []
    for file in loaded:
        joints = {
            joint.name(): joint
            for joint in _joints(plant)
            if joint.model_instance() in file.instances
        }
        for mimic in read_mimics(file.path):
            pair = [joints[n] for n in (mimic.follower, mimic.leader) if n in joints]
            if [joint.num_velocities() for joint in pair] == [1, 1]:
                ties.append(Tie(pair[0], pair[1], mimic.ratio, mimic.offset))
                if mimic.passed_over:
                    plant.AddCouplerConstraint(*pair, mimic.ratio, mimic.offset)
    return ties


def _check_loops(plant: MultibodyPlant, limb: Limb, loaded: Sequence[Loaded], untold: int) -> None:
    """Refuses a constraint that closes a loop, unless a discrete plant has it off the chain.

    `untold`: constraints of the plant beside ties; fewer than the files' if Drake passed one over.
    """
    loops: list[Loop] = [loop for file in loaded for loop in read_loops(file.path)]
    graph = Graph(plant)
    on_chain = {joint.index() for joint in limb.joints}
    for loop in loops or [Loop("constraint", ())] * bool(untold):
        between = ", ".join(loop.bodies) or "bodies that the file does not name"
        found = f"a {loop.kind.replace('_', ' ')} between {between}"
        if plant.time_step() == 0.0:
            allowed = "time_step above 0 (a continuous plant has no constraints), or no such loop"
            raise InputError("limb: model", found, allowed)
        bodies = [body for name in loop.bodies for body in _bodies_named(plant, loaded, name)]
        way = graph.path(bodies[0], int(bodies[1].index())) if len(bodies) == 2 else None
        if way is None or any(joint.index() in on_chain for joint in way):
            allowed = "no constraint that closes a loop with the chain to the hand"
            raise InputError("limb: model", found, allowed)
        if untold < len(loops):
            raise InputError("limb: model", found, "constraints that this version of Drake reads")


def _bodies_named(plant: MultibodyPlant, loaded: Sequence[Loaded], name: str) -> list[RigidBody]:
    instances = [instance for file in loaded for instance in file.instances]
    if name in ("world", "WorldBody"):
        return [plant.world_body()]
    return [plant.GetBodyByName(name, i) for i in instances if plant.HasBodyNamed(name, i)]


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
