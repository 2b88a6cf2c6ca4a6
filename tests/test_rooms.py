"""The rooms of the package: imports go one way, no room is crowded, studies use the public face."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.conftest import ROOT

PACKAGE = ROOT / "drake_racket"
MOST_FILES = 15  # beside __init__.py

# each room may import what stands before it, and itself; docs/development.md has the same order
ORDER = re.findall(
    r"\w+", (ROOT / "docs" / "development.md").read_text().split("```order\n")[1].split("```")[0]
)


def modules() -> dict[str, Path]:
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


KNOWN = modules()


def imported(path: Path) -> Iterator[str]:
    """Modules that a file imports, also within functions and for types."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name if name in KNOWN else node.module for name in inner)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def room(module: str) -> str:
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else ""


@cache
def neighbours(name: str) -> frozenset[str]:
    """What a module of the package imports of the package."""
    ours = {m for m in imported(KNOWN[name]) if m in KNOWN}
    return frozenset(ours - {name, "drake_racket"})


def test_every_room_has_its_place() -> None:
    assert {room(name) for name in KNOWN} - {""} == set(ORDER)


@pytest.mark.parametrize("name", sorted(KNOWN))
def test_imports_go_one_way(name: str) -> None:
    if not room(name):
        return
    place = ORDER.index(room(name))
    for other in neighbours(name):
        assert ORDER.index(room(other)) <= place, f"{name} imports {other}"


def test_no_module_imports_itself_by_a_detour() -> None:
    state: dict[str, int] = {}
    stack: list[str] = []

    def visit(name: str) -> None:
        state[name] = 1
        stack.append(name)
        for other in sorted(neighbours(name)):
            if state.get(other) == 1:
                pytest.fail(" -> ".join([*stack[stack.index(other) :], other]))
            if other not in state:
                visit(other)
        stack.pop()
        state[name] = 2

    for name in sorted(KNOWN):
        if name not in state:
            visit(name)


def test_no_room_is_crowded() -> None:
    for directory in {path.parent for path in PACKAGE.rglob("*.py")}:
        files = [path.name for path in directory.glob("*.py") if path.name != "__init__.py"]
        assert len(files) <= MOST_FILES, f"{directory.relative_to(ROOT)}: {len(files)} files"


SCRIPTS = [p for p in sorted((ROOT / "studies").rglob("*.py")) if not p.name.startswith("test_")]


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda p: str(p.relative_to(ROOT / "studies")))
def test_studies_use_the_public_face(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith(
            "drake_racket"
        ):
            continue
        assert str(node.module).count(".") <= 1, f"{node.module} is not part of the public face"
        face = importlib.import_module(str(node.module))
        for alias in node.names:
            assert alias.name in face.__all__, f"{node.module}: {alias.name}"


@pytest.mark.parametrize("subject", ["", ".sweep", ".rigs", ".identify", ".limbs", ".laws"])
def test_every_public_name_is_there_and_says_what_it_is(subject: str) -> None:
    face = importlib.import_module(f"drake_racket{subject}")
    for name in face.__all__:
        value = getattr(face, name)
        if inspect.isclass(value) or inspect.isfunction(value):
            assert value.__doc__, f"{face.__name__}.{name}"
