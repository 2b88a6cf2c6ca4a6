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
    """Holds a mimic joint as written: names, and q_follower = ratio q_leader + offset."""

    follower: str
    leader: str
    ratio: float
    offset: float


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
        for mimic in joint.iter():
            if mimic.tag == "mimic" and mimic.get("joint"):
                found.append(_mimic(joint, mimic, path))
    return found


def without_idle_mimics(text: str) -> tuple[str, list[str]]:
    """Takes mimic elements that tie nothing out of a URDF's text, which Drake would stop at.

    Of a joint that is fixed, or of a leader that is fixed or not there.

    Returns:
        The text, and the names of their joints.

    """
    moving = {
        found[1]
        for found in re.finditer(r"<joint\b[^>]*?\bname=\"([^\"]+)\"[^>]*>", text)
        if not re.search(r"type=\"(fixed|floating)\"", found[0]) and "type=" in found[0]
    }
    idle: list[str] = []

    def one(found: re.Match[str]) -> str:
        joint = re.search(r"\bname=\"([^\"]+)\"", found[0])
        leader = re.search(r"<mimic\b[^>]*?\bjoint=\"([^\"]+)\"", found[0])
        if joint is None or leader is None or {joint[1], leader[1]} <= moving:
            return found[0]
        idle.append(joint[1])
        return _MIMIC.sub("", found[0])

    return re.sub(r"<joint\b.*?</joint>", one, text, flags=re.DOTALL), idle


_MIMIC = re.compile(r"<mimic\b[^>]*/>|<mimic\b.*?</mimic>", re.DOTALL)


def read_loops(path: Path) -> list[Loop]:
    """Gives the constraints of a file that tie two bodies: ball, distance, weld."""
    found = []
    for kind in _LOOPS:
        for element in _elements(path, kind):
            bodies = [_text(child) for child in element if "body" in str(child.tag)]
            found.append(Loop(kind, tuple(body for body in bodies if body)))
    return found


def _mimic(joint: ElementTree.Element, mimic: ElementTree.Element, path: Path) -> Mimic:
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
    return Mimic(str(joint.get("name")), leader, numbers["multiplier"], offset)


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
