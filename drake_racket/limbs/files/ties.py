"""Reads the ties of an SDF or URDF file: mimic joints, and constraints that close a loop.

Drake makes constraints of them and does not show what they tie, so they are read here:
q_follower = multiplier (q_leader - reference) + offset (URDF has no reference).
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from drake_racket.io.errors import InputError

_PREFIX = re.compile(r"(</?|\s)\w+:(?=\w+[\s=>/])|\sxmlns(?::\w+)?=\"[^\"]*\"|<\?xml[^>]*\?>")
"""Prefixes of names, which files use without saying what they stand for."""


@dataclass(frozen=True)
class Mimic:
    """Holds a mimic joint as written: names, and q_follower = ratio q_leader + offset.

    `passed_over`: Drake makes no constraint of it, as of SDFormat's own, which stands in an axis.
    """

    follower: str
    leader: str
    ratio: float
    offset: float
    passed_over: bool


@dataclass(frozen=True)
class Loop:
    """Holds a constraint between two bodies: its element's name, and theirs."""

    kind: str
    bodies: tuple[str, ...]


_LOOPS = ("ball_constraint", "distance_constraint", "weld_constraint", "tendon_constraint")


def read_mimics(path: Path) -> list[Mimic]:
    """Gives the mimic joints of a file; none of one that is not XML (directives)."""
    found = []
    for joint in _elements(path, "joint"):
        in_axis = [mimic for axis in joint.iter("axis") for mimic in axis.iter("mimic")]
        for mimic in joint.iter("mimic"):
            if mimic.get("joint"):
                found.append(_mimic(joint, mimic, path, passed_over=mimic in in_axis))
    return found


def without_idle(text: str) -> tuple[str, list[str]]:
    """Takes out of a URDF's text what acts on nothing, which Drake would stop at.

    Mimic elements of a joint that is fixed, or of a leader that is fixed or not there, and
    transmissions of joints that are not there.

    Returns:
        The text, and the names of their joints.

    """
    parts = _TRANSMISSION.split(text)
    heads = [head for part in parts[::2] for head in re.findall(r"<joint\b[^>]*>", part)]
    there = {name[1] for head in heads if (name := _NAME.search(head))}
    still = {name[1] for head in heads if _STILL.search(head) and (name := _NAME.search(head))}
    idle: list[str] = []

    def joint(found: re.Match[str]) -> str:
        name, leader = _NAME.search(found[0]), _LEADER.search(found[0])
        if name is None or leader is None or {name[1], leader[1]} <= there - still:
            return found[0]
        idle.append(name[1])
        return _MIMIC.sub("", found[0])

    for i, part in enumerate(parts):
        if i % 2 == 0:
            parts[i] = re.sub(r"<joint\b.*?</joint>", joint, part, flags=re.DOTALL)
        elif lost := [name for name in _JOINTS.findall(part) if name not in there]:
            idle += lost
            parts[i] = ""
    return "".join(parts), idle


_NAME = re.compile(r"\bname\s*=\s*\"([^\"]+)\"")
_STILL = re.compile(r"\btype\s*=\s*\"(?:fixed|floating)\"")
_LEADER = re.compile(r"<mimic\b[^>]*?\bjoint\s*=\s*\"([^\"]+)\"")
_MIMIC = re.compile(r"<mimic\b[^>]*/>|<mimic\b.*?</mimic>", re.DOTALL)
_JOINTS = re.compile(r"<joint\b[^>]*?\bname\s*=\s*\"([^\"]+)\"")
_TRANSMISSION = re.compile(r"(<transmission\b.*?</transmission>)", re.DOTALL)


def read_loops(path: Path) -> list[Loop]:
    """Gives the constraints of a file that tie two bodies: ball, distance, weld."""
    found = []
    for kind in _LOOPS:
        for element in _elements(path, kind):
            bodies = [_text(child) for child in element if "body" in str(child.tag)]
            found.append(Loop(kind, tuple(body for body in bodies if body)))
    return found


def _mimic(
    joint: ElementTree.Element, mimic: ElementTree.Element, path: Path, *, passed_over: bool
) -> Mimic:
    numbers = {}
    for key, default in (("multiplier", 1.0), ("offset", 0.0), ("reference", 0.0)):
        child = next((c for c in mimic if c.tag == key), None)
        text = mimic.get(key) if child is None else child.text
        try:
            numbers[key] = default if text is None else float(text)
        except ValueError:
            where = f"{path}: mimic of {joint.get('name')}: {key}"
            raise InputError(where, text, "a number") from None
    offset = numbers["offset"] - numbers["multiplier"] * numbers["reference"]
    leader = str(mimic.get("joint")).rpartition("::")[2]
    return Mimic(str(joint.get("name")), leader, numbers["multiplier"], offset, passed_over)


def _elements(path: Path, name: str) -> Iterator[ElementTree.Element]:
    if path.suffix.lower() not in (".sdf", ".urdf"):
        return
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
        root = ElementTree.fromstring(_PREFIX.sub(lambda found: found[1] or "", text))
    except (OSError, ElementTree.ParseError):
        return  # Drake has said what is wrong with it
    yield from (element for element in root.iter() if element.tag == name)


def _text(element: ElementTree.Element) -> str:
    text = element.get("name") or element.get("value") or element.text or ""
    return text.strip().rpartition("::")[2]
