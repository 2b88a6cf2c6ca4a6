"""A missing optional library is named with its install line, before any work."""

from __future__ import annotations

from importlib.util import find_spec

from drake_racket.io.errors import InputError


def has_library(module: str) -> bool:
    """Tells whether an optional library can be imported."""
    return find_spec(module) is not None


def need_library(module: str, extra: str, key: str, value: object) -> None:
    """Refuses an input that asks for a library which is not installed.

    Args:
        module: as it is imported.
        extra: of this package, with which pip installs it.
        key, value: the input.

    Raises:
        InputError: with the install line.

    """
    if not has_library(module):
        allowed = f"only with {module} installed: pip install 'drake-racket[{extra}]'"
        raise InputError(key, value, allowed)
