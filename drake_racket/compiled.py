"""Compiles laws with numba where numba is installed (the extra `fast`); else leaves them as Python.

The laws are plain functions: the same source runs on floats, on AutoDiffXd and as machine code.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

try:
    import numba
    from numba.extending import register_jitable
except ImportError:
    numba = None


def compiled(law: Callable[..., Any]) -> Callable[..., Any]:
    """`law` as machine code for float arguments, cached on disk.

    The cache knows of changes in the law's own file only: keep what it calls beside it.
    """
    if numba is None:
        return law
    machine_code: Callable[..., Any]
    try:
        machine_code = numba.njit(cache=True)(law)
    except RuntimeError:  # no directory that the cache may be written to
        machine_code = numba.njit(law)
    return machine_code


def compilable(law: Callable[..., Any]) -> Callable[..., Any]:
    """Marks a function that a compiled law calls; it stays a plain function for Python."""
    return law if numba is None else register_jitable(law)
