"""Lets quick functions stand for long ones, and writes down what is asked of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import drake_racket as dr


class Stand:
    """Stands for functions of a module until the test ends.

    Attributes:
        asked: each call as its function's name, its arguments and its options.

    """

    def __init__(self, patch: pytest.MonkeyPatch, module: Any = None) -> None:
        self.patch, self.module = patch, module
        self.asked: list[list[Any]] = []

    def let(self, name: str, result: Callable[..., Any]) -> None:
        """A function of the module, or of a dotted path, gives what `result` makes."""

        def call(*arguments: Any, **options: Any) -> Any:
            told = {key: plain(one) for key, one in options.items() if key != "progress"}
            self.asked.append([name.rpartition(".")[2], *map(plain, arguments), told])
            return result(*arguments, **options)

        if self.module is None:
            self.patch.setattr(name, call)
        else:
            self.patch.setattr(self.module, name, call)


def plain(value: Any) -> Any:
    """What a value says of itself, as plain data; of settings what is not their default."""
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, (str, int, float, bool)) or value is None:
        return value
    if isinstance(value, (list, tuple, range, np.ndarray)):
        return [plain(one) for one in value]
    if isinstance(value, (dr.Scenario, dr.IntegratorSettings)):
        usual = vars(type(value)())
        return {k: plain(v) for k, v in vars(value).items() if v != usual[k]}
    name = getattr(value, "name", None)
    if name is None and dataclasses.is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    return str(name or "?")
