"""Tells what is known of a value in a law: whether it has derivatives, and of what rank it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Kind = Any
"""What is known of a value: None, it has no derivative; NUMBER; ("array", n) of rank n; or
("tuple", kinds)."""

NUMBER = "number"


def array(rank: int) -> Kind:
    """Gives the kind of an array whose numbers have derivatives."""
    return ("array", rank)


class NotDifferentiable(Exception):
    """A law holds something that `forward` does not know."""


@dataclass(frozen=True)
class Twin:
    """A twin is the tangent of one function for one set of arguments' kinds."""

    name: str
    function: Callable[..., Any]
    gives: Kind


def join(a: Kind, b: Kind) -> Kind:
    """Gives the kind of a value that is of one kind or the other."""
    if a == b or b is None:
        return a
    if a is None:
        return b
    if a[0] == b[0] == "tuple" and len(a[1]) == len(b[1]):
        return ("tuple", tuple(join(x, y) for x, y in zip(a[1], b[1], strict=True)))
    raise NotDifferentiable(f"one name for {a} and {b}")
