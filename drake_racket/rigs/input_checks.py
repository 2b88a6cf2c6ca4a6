"""Checks of single numbers from outside; each raises InputError naming the key."""

from __future__ import annotations

import math

from drake_racket.io.errors import InputError
from drake_racket.io.numbers import finite_number


def check_finite(key: str, value: object) -> None:
    """Refuses what is no real number that is finite as a float; true and false are none."""
    finite_number(key, value)


def check_positive(**values: float) -> None:
    """Refuses what is not finite and more than 0."""
    for key, value in values.items():
        check_finite(key, value)
        if not value > 0.0:
            raise InputError(key, value, "more than 0")


def check_not_negative(**values: float) -> None:
    """Refuses what is not finite and 0 or more."""
    for key, value in values.items():
        check_finite(key, value)
        if value < 0.0:
            raise InputError(key, value, "0 or more")


def check_result(keys: str, *results: float) -> None:
    """Numbers may each be sensible and overflow or vanish together: the first result is > 0."""
    if not all(math.isfinite(r) for r in results) or not results[0] > 0.0:
        raise InputError(keys, results, "numbers whose results are finite and more than 0")
