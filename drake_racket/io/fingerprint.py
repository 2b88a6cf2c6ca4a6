"""The code and the machine that compute a result: what tells that a kept one is still good."""

from __future__ import annotations

import functools
import hashlib
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_NOT_COUNTED = (
    "animation",
    "cli",
    "identify",
    "plots",
    "validation",
    "__pycache__",
)  # they compute no case


def digest(data: bytes) -> str:
    """SHA-256 in hex, shortened to 128 bits."""
    return hashlib.sha256(data).hexdigest()[:32]


@functools.lru_cache(maxsize=1)
def environment() -> dict[str, str]:
    """What computes the cases; results are bit-equal where all of it is equal.

    `source` is a hash of the package's code and data, but for what prints and draws.
    """
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for package in ("drake", "drake-racket", "numpy", "numba"):  # numba compiles the force laws
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "absent"
    root = Path(__file__).resolve().parent.parent
    hashes = [
        f"{path.relative_to(root)} {digest(path.read_bytes())}"
        for path in sorted(root.rglob("*"))
        if path.suffix in (".py", ".yaml")
        and not set(path.relative_to(root).parts) & set(_NOT_COUNTED)
    ]
    return found | {"source": digest("\n".join(hashes).encode())}
