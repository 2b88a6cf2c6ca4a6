"""Tells whether this is the same computation, so that a kept result is still good.

A result hangs on its input (a scenario, data, settings, the content of files) and on what computes
it (`computation`). Stores keep both as plain data; `difference` names what differs.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import json
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from drake_racket.io.shipped import sdf_directory

ABOVE = ("identify", "validation")
"""Rooms above the simulation: they decide the numbers of fits and of the report, of no case."""

_NEVER = ("animation", "cli", "plots", "__pycache__")  # they decide no number
_SUFFIXES = (".py", ".yaml")
_PACKAGES = ("drake", "drake-racket", "numpy", "scipy", "numba")  # numba compiles the force laws
_ROOT = Path(__file__).resolve().parent.parent


def digest(data: bytes) -> str:
    """Hashes bytes: SHA-256 in hex, shortened to 128 bits."""
    return hashlib.sha256(data).hexdigest()[:32]


def as_text(tree: Any) -> str:
    """Gives one text for equal data: JSON, keys in order."""
    return json.dumps(tree, sort_keys=True)


@functools.cache
def versions() -> dict[str, str]:
    """Versions of the packages that numbers depend on; `absent` where one is not installed."""
    return {package: _version(package) for package in _PACKAGES}


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "absent"


@functools.cache
def computation(*more: str | Path) -> dict[str, str]:
    """Describes what computes a result; results are bit-equal where all of it is equal.

    Whatever the package's version says, `source` is a hash of every file of the package that
    decides numbers: code, data and SDF, but for what prints and draws.

    Args:
        more: rooms of ABOVE that take part as well, and files or directories with code of the
            caller's own.

    Returns:
        The versions of Python and packages, the kind of machine, and `source`; plain data.

    """
    files: dict[str, Path] = {f"sdf/{path.name}": path for path in sdf_directory().glob("*.sdf")}
    left_out = set(_NEVER) | (set(ABOVE) - {str(room) for room in more})
    for path in _files(_ROOT):
        name = path.relative_to(_ROOT)
        if not left_out & set(name.parts):
            files[str(name)] = path
    for own in (Path(x) for x in more if x not in ABOVE):
        files |= {f"{own.name}/{path.relative_to(own)}": path for path in _files(own)}
    lines = [f"{name} {digest(path.read_bytes())}" for name, path in sorted(files.items())]
    return {
        "python": platform.python_version(),
        "machine": platform.machine(),
        **versions(),
        "source": digest("\n".join(lines).encode()),
    }


def _files(place: Path) -> list[Path]:
    found = [place] if place.is_file() else place.rglob("*")
    return [path for path in found if path.suffix in _SUFFIXES and "__pycache__" not in path.parts]


def code_of(thing: Any) -> tuple[Path, ...]:
    """Gives the file of a class or function of the caller's own, for `computation`.

    Nothing for the package's own, and for what was typed in.
    """
    thing = getattr(thing, "func", thing)  # of a functools.partial
    try:
        path = Path(inspect.getsourcefile(thing) or "").resolve()
    except (TypeError, OSError):
        return ()
    return () if path.is_relative_to(_ROOT) or not path.is_file() else (path,)


def difference(old: Any, new: Any, key: str = "") -> tuple[str, Any, Any] | None:
    """Gives the first key (dotted) in which two trees of plain data differ, with both values."""
    if isinstance(old, dict) and isinstance(new, dict):
        for name in [*old, *(name for name in new if name not in old)]:
            if name not in old or name not in new:
                there = "nothing"
                return f"{key}{name}", old.get(name, there), new.get(name, there)
            found = difference(old[name], new[name], f"{key}{name}.")
            if found is not None:
                return found
        return None
    return None if old == new else (key.rstrip("."), old, new)
