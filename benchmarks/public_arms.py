"""Tries every robot model of some folders as the arm that holds the racket, and says what works.

    python benchmarks/public_arms.py FOLDER ... [--out table.md] [--only WORD]

For each URDF, SDF, MuJoCo (.xml) or OpenSim (.osim) file: does it load; which chain leads to its
hand (the frame farthest out by joints; one called hand, tool, ... of several); is there a posture
and rates of a slow stroke; a 5 ms impact in each of the three grips, and how its energy closes; the
moving mass against the source's own (the file's <mass> elements, or MuJoCo's or OpenSim's sum).
Joints off the chain are free unless the model has no inertia there: then those are locked, which is
noted.

A package of arms on the registry: pip install 'drake-racket[arms]' installs example-robot-data and
openarm-mujoco; `--installed` tries those.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import logging
import re
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from pydrake.multibody.plant import MultibodyPlant

import drake_racket as dr
from drake_racket.io.errors import InputError, SimulationError
from drake_racket.limbs.chain import Graph
from drake_racket.limbs.files.parse import load_files
from drake_racket.limbs.mujoco.model import body_name, load_model, quiet_mujoco

GRIPS = ("weld", "torsional", "compliant")
SPEED, AFTER = 0.1, 0.005  # of the string-bed (m/s); s from touch
HANDS = re.compile(r"hand|palm|tool|tcp|ee|gripper|wrist|flange|fist|end", re.IGNORECASE)
PACKAGES = ("example-robot-data", "openarm-mujoco")


@dataclass
class Tried:
    """Holds what was found of one model; `stopped` says at which step, and why."""

    name: str
    hand: str = ""
    chain: list[str] = field(default_factory=list)
    others: int = 0
    errors: dict[str, float] = field(default_factory=dict)
    mass: float = 0.0
    source_mass: float = 0.0
    notes: list[str] = field(default_factory=list)
    stopped: str = ""

    @property
    def closes(self) -> float:
        """Gives the largest energy error of the three grips."""
        return max(self.errors.values()) if len(self.errors) == len(GRIPS) else float("inf")


def models(folders: list[Path]) -> Iterator[Path]:
    """Files that may hold an arm, in order, each once."""
    seen: set[Path] = set()
    for folder in folders:
        for path in sorted(folder.rglob("*")):
            if path.resolve() in seen:
                continue
            seen.add(path.resolve())
            suffix = path.suffix.lower()
            if suffix in (".urdf", ".sdf", ".osim"):
                yield path
            elif suffix == ".xml":
                text = path.read_text(errors="ignore")
                if "<mujoco" in text and ("<worldbody" in text or "<include" in text):
                    yield path


def installed() -> list[Path]:
    """Folders of the packages of the extra `arms` that are installed."""
    found = []
    for package in PACKAGES:
        try:
            files = importlib.metadata.files(package) or []
        except importlib.metadata.PackageNotFoundError:
            continue
        roots = {Path(str(f.locate())).parent for f in files if f.suffix in (".urdf", ".xml")}
        found += sorted(roots)
    return found


def candidate(path: Path) -> tuple[str, str]:
    """The base and the hand of a model: the outermost body by joints, and its tree's root."""
    if path.suffix.lower() == ".xml":
        return "", _mujoco_hand(path)
    if path.suffix.lower() == ".osim":
        from drake_racket.limbs.opensim.model import read_model

        tree = read_model(path)
        return "", tree.joints[-1].child
    plant = MultibodyPlant(0.0)
    loaded = load_files(plant, path, {})
    graph = Graph(plant)
    best: tuple[int, int, int, str] | None = None
    base = ""
    for file in loaded:
        for instance in file.instances:
            for index in plant.GetBodyIndices(instance):
                body = plant.get_body(index)
                way = graph.path(body)
                moving = sum(0 < joint.num_velocities() < 6 for joint in way)
                named = bool(HANDS.search(body.name()))
                score = (named and moving >= 3, moving, -int(index), body.name())
                if best is None or score > best:
                    best = score
                    if way:
                        root = graph.way(body)[0][0]
                        base = "" if root.index() == plant.world_body().index() else root.name()
    assert best is not None
    return base, best[3]


def _mujoco_hand(path: Path) -> str:
    model = load_model(path)

    def joints(body: int) -> int:
        count = 0
        while body:
            count += int(model.body_jntnum[body])
            body = int(model.body_parentid[body])
        return count

    scores = [
        (bool(HANDS.search(body_name(model, i))) and joints(i) >= 3, joints(i), -i)
        for i in range(1, model.nbody)
    ]
    return body_name(model, -max(scores)[2])


def source_mass(path: Path) -> float:
    """The mass of all bodies, as the source's own engine or file has it."""
    if path.suffix.lower() == ".xml":
        return float(load_model(path).body_mass.sum())
    if path.suffix.lower() == ".osim":
        from drake_racket.limbs.opensim.model import read_model

        return float(sum(body.mass for body in read_model(path).bodies.values()))
    text = re.sub(r"(</?|\s)\w+:(?=\w)", r"\1", path.read_text(errors="replace"))
    total = 0.0
    for link in ElementTree.fromstring(text).iter("link"):
        mass = link.find("inertial/mass")
        if mass is not None:
            total += float(mass.get("value") or mass.text or 0.0)
    return total


def attempt(path: Path, name: str) -> Tried:
    """Tries one model; never raises."""
    tried = Tried(name)
    step = "loading"
    try:
        base, tried.hand = candidate(path)
        tried.source_mass = source_mass(path)
        locked: tuple[str, ...] = ()
        for _ in range(3):
            try:
                step = "impact"
                _impacts(path, base, locked, tried)
                break
            except InputError as error:
                names = re.search(r"locked: \[([^\]]+)\]", str(error))
                if names is None:
                    raise
                locked = (*locked, *names[1].split(", "))
                tried.notes.append(f"locked: [{names[1]}]")
    except (InputError, SimulationError) as error:
        tried.stopped = f"{step}: {error}".replace(f"{path.parent}/", "")
    except Exception as error:
        tried.stopped = f"{step}: {type(error).__name__}: {str(error).splitlines()[0]}"
    return tried


def _impacts(path: Path, base: str, locked: tuple[str, ...], tried: Tried) -> None:
    limb = dr.LimbSettings(
        model=str(path),
        base=base,
        hand=tried.hand,
        locked=locked,
        joint_torques="zero",
        stroke=dr.Stroke(speed=SPEED, velocity_azimuth_deg=0.0),
    )
    for grip in GRIPS:
        case = dr.Scenario(support="limb", limb=limb, grip_kind=grip, speed=20.0, after=AFTER)
        system = dr.make_impact_diagram(case)
        assert system.limb is not None
        made = system.limb.limb
        tried.chain, tried.others = made.joint_names(), len(made.others())
        bodies = [system.plant.get_body(i) for m in made.model_instances
                  for i in system.plant.GetBodyIndices(m)]  # fmt: skip
        tried.mass = sum(body.default_mass() for body in bodies)
        try:
            system.create_context()
        except InputError as error:
            if "speed" not in str(error):
                raise
            tried.notes.append("at rest: no velocity along x in its first posture")
            case = replace(case, limb=replace(limb, stroke=dr.Stroke()))
            system = dr.make_impact_diagram(case)
        result = dr.simulate(case, system)
        assert result.energy_error is not None
        tried.errors[grip] = result.energy_error
        tried.notes = list(dict.fromkeys([*tried.notes, *made.notes]))


def markdown(rows: list[Tried]) -> str:
    """The table of docs/your_arm.md."""
    lines = [
        "| model | hand | joints to it, beside it | energy closes to (three grips) "
        "| mass (kg), off its source's by | notes |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        if row.stopped:
            lines.append(f"| {row.name} | {row.hand} | | | | {_cell(row.stopped)} |")
            continue
        off = abs(row.mass - row.source_mass) / max(row.source_mass, 1e-12)
        joints = f"{len(row.chain)}, {row.others}"
        mass = f"{row.mass:.4g}, {off:.0e}"
        notes = "; ".join(row.notes)
        lines.append(
            f"| {row.name} | {row.hand} | {joints} | {row.closes:.1e} | {mass} | {_cell(notes)} |"
        )
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    short = text if len(text) <= 90 else text[:87] + "..."
    return short.replace("|", "/").replace("\n", " ")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folders", nargs="*", type=Path)
    parser.add_argument("--installed", action="store_true")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--only", default="")
    given = parser.parse_args()
    logging.getLogger("drake").setLevel(logging.CRITICAL)
    folders = [*given.folders, *(installed() if given.installed else [])]
    rows = []
    for path in models(folders):
        name = path.name
        if given.only and not re.search(given.only, name):
            continue
        try:
            with quiet_mujoco():
                rows.append(attempt(path, name))
        except InputError:
            rows.append(attempt(path, name))
        row = rows[-1]
        print(name, row.stopped or f"{len(row.chain)} joints, {row.closes:.1e}", file=sys.stderr)
    text = markdown(rows)
    good = sum(row.closes < 1e-4 for row in rows)
    text += f"\n{good} of {len(rows)} close energy to 1e-4 in all three grips.\n"
    if given.out:
        dr.write_text(text, given.out)
    print(text)


if __name__ == "__main__":
    main()
