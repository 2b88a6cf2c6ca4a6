"""Compiles laws with numba where numba is installed (the extra `fast`); else leaves them as Python.

The laws are plain functions: the same source runs on floats, on AutoDiffXd and as machine code.
"""

from __future__ import annotations

import contextlib
import gc
import hashlib
import types
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

try:
    import numba
    from numba.extending import register_jitable
except ImportError:
    numba = None


def compiled(law: Callable[..., Any], **options: Any) -> Callable[..., Any]:
    """Gives `law` as machine code for float arguments, cached on disk.

    `options` are `numba.njit`'s. Where nothing can be written, it is compiled in each process.

    The cache knows of changes in the law's own file only: keep what it calls beside it, or let
    the law be a closure over `sources_stamp` of the files with what it calls.
    """
    if numba is None:
        return law
    machine_code: Callable[..., Any]
    try:
        machine_code = numba.njit(cache=True, error_model="numpy", **options)(law)
    except RuntimeError:  # no directory that the cache may be written to
        machine_code = numba.njit(error_model="numpy", **options)(law)
    cache = getattr(machine_code, "_cache", None)
    if cache is not None:
        _cache_if_there_is_room(cache)
    return machine_code


@contextlib.contextmanager
def without_collecting() -> Iterator[None]:
    """Keeps Python's collector of garbage away while numba compiles.

    numba makes millions of small objects that stay: to look through them takes a tenth of the time.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


def _cache_if_there_is_room(cache: Any) -> None:
    """Lets a full disk cost numba's cache its file, and not the user the run."""
    save = cache.save_overload

    def saved(signature: Any, data: Any) -> None:
        with contextlib.suppress(OSError):
            save(signature, data)

    cache.save_overload = saved


def sources_stamp(*modules: types.ModuleType) -> int:
    """Gives a number that changes with the source of `modules`.

    numba's cache tells closures apart by what they close over: a compiled closure over this number
    is compiled anew when one of these sources has changed.
    """
    digest = hashlib.sha256()
    for module in modules:
        digest.update(Path(str(module.__file__)).read_bytes())
    return int.from_bytes(digest.digest()[:6], "big")


def stamped(law: Callable[..., Any], stamp: int, **options: Any) -> Callable[..., Any]:
    """Gives `compiled` of a copy of `law` that has the stamp among what it closes over."""
    code = law.__code__.replace(co_freevars=(*law.__code__.co_freevars, "stamp"))
    cell = types.CellType(stamp)
    copy = types.FunctionType(
        code, law.__globals__, law.__name__, law.__defaults__, (*(law.__closure__ or ()), cell)
    )
    copy.__qualname__ = law.__qualname__
    return compiled(copy, **options)


parallel_range: Any = range if numba is None else numba.prange
"""The range of a loop whose passes are independent, in a function compiled with parallel=True."""

HAS_NUMBA = numba is not None

_INNER = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Called by compiled code only: doors from Python and C would be compiled for nobody."""


def finds_root(law: Callable[..., Any]) -> Callable[..., Any]:
    """Marks a function that solves an equation by Newton's method.

    Who differentiates it leaves it out, and differentiates the one step more that follows on it:
    at the root that step has the root's own derivative.
    """
    law.is_root = True  # type: ignore[attr-defined]
    return law


def compilable(law: Callable[..., Any]) -> Callable[..., Any]:
    """Marks a function that a compiled law calls; it stays a plain function for Python.

    Compiled, a division by zero gives inf or NaN, as NumPy has it. Who else holds the arrays it is
    given is not counted there, which takes a third of the time off: it must neither make an array
    nor return one (`makes_arrays` marks a function that does).
    """
    return law if numba is None else register_jitable(_nrt=False, **_INNER)(law)


def makes_arrays(law: Callable[..., Any]) -> Callable[..., Any]:
    """Marks a function as `compilable` does, that makes arrays."""
    return law if numba is None else register_jitable(**_INNER)(law)
