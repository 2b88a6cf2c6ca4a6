"""Numbers from outside, Python's and NumPy's alike, become Python floats."""

from __future__ import annotations

import dataclasses
import json
import math
import numbers
import re
from collections.abc import Mapping
from typing import Any, NoReturn

import numpy as np

from drake_racket.io.errors import InputError


def finite_number(key: str, value: object, allowed: str = "a finite number") -> float:
    """Gives `value` as a Python float.

    Raises:
        InputError: it is no real number (true and false are none), or not finite as a float.

    """
    number = _as_float(value)
    if number is None or not math.isfinite(number):
        raise InputError(key, value, allowed)
    return number


def number_between(key: str, value: object, least: float, most: float, unit: str = "") -> float:
    """Gives `finite_number` that is not below `least` nor above `most`; raises InputError."""
    number = finite_number(key, value)
    if not least <= number <= most:
        raise InputError(key, value, f"{least:g} to {most:g} {unit}".rstrip())
    return number


class FrozenDict(dict[Any, Any]):
    """A FrozenDict cannot be changed: frozen settings are shared."""

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("frozen settings cannot be changed; dataclasses.replace makes a copy")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled and copied as a whole, not key by key."""
        return FrozenDict, (dict(self),)


def plain_numbers(settings: Any) -> None:
    """Makes Python floats of a frozen dataclass's numbers, tuples of its lists, frozen dicts.

    Equal settings then have one YAML and JSON text, whoever computed their numbers. What is no
    number is left as it is, for the checks to refuse.
    """
    for name, value in vars(settings).items():
        if type(value) not in _PLAIN:
            object.__setattr__(settings, name, _plain(value))


_PLAIN = frozenset({float, str, bool, type(None)})  # most are


def _plain(value: Any) -> Any:
    if type(value) in _PLAIN:
        return value
    if isinstance(value, np.ndarray) and value.ndim:
        value = value.tolist()
    if type(value) is FrozenDict or (type(value) is tuple and _PLAIN.issuperset(map(type, value))):
        return value
    if isinstance(value, (list, tuple)):
        return tuple(_plain(x) for x in value)
    if isinstance(value, dict):
        return FrozenDict((key, _plain(x)) for key, x in value.items())
    number = _as_float(value)
    return value if number is None else number


def json_data(value: Any) -> Any:
    """Gives data as JSON's own types: a dataclass by its fields, null for what is not finite."""
    if isinstance(value, np.ndarray | np.generic):
        return json_data(value.tolist())
    if dataclasses.is_dataclass(value):
        value = vars(value)
    if isinstance(value, Mapping):
        return {str(key): json_data(x) for key, x in value.items()}
    if isinstance(value, list | tuple):
        return [json_data(x) for x in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def json_text(value: Any, indent: int = 1) -> str:
    """Writes `json_data` as text."""
    return json.dumps(json_data(value), indent=indent, allow_nan=False) + "\n"


def as_number(value: object) -> float | None:
    """Gives a real number, or text that is one, as a Python float; None for what is neither.

    Text counts as YAML 1.2 writes numbers: without underscores and without blanks.
    """
    if isinstance(value, str):
        return float(value) if _NUMBER.fullmatch(value) else None
    return _as_float(value)


_NUMBER = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", re.ASCII)


def _as_float(value: object) -> float | None:
    if type(value) is float:
        return value
    # to Python a NumPy duration is an integer, in whatever unit it has
    if not isinstance(value, numbers.Real) or isinstance(value, bool | np.timedelta64):
        return None
    try:
        return float(value)
    except OverflowError:  # an int beyond the floats
        return None
