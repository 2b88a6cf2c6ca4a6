"""Numbers that a user gets who leaves an option out: the public functions' defaults, as kept.

They are an interface. Where one is changed on purpose, `python -m tests.test_public_defaults`
writes the kept ones anew.
"""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import json
import pkgutil
from pathlib import Path

import pytest

import drake_racket

KEPT = Path(__file__).with_suffix(".json")
ROOMS = ["", *sorted(f".{module.name}" for module in pkgutil.iter_modules(drake_racket.__path__))]


def is_number(value) -> bool:
    if isinstance(value, (tuple, list)):
        return len(value) > 0 and all(is_number(item) for item in value)
    return isinstance(value, (bool, int, float))


def defaults() -> dict[str, dict[str, str]]:
    """Numbers among the defaults of every public function and dataclass, by its name."""
    found = {}
    for room in ROOMS:
        module = importlib.import_module(f"drake_racket{room}")
        for name in getattr(module, "__all__", ()):
            thing = getattr(module, name)
            if dataclasses.is_dataclass(thing):
                given = {field.name: field.default for field in dataclasses.fields(thing)}
            elif inspect.isfunction(thing):
                parameters = inspect.signature(thing).parameters.values()
                given = {parameter.name: parameter.default for parameter in parameters}
            else:
                continue
            own = {key: repr(value) for key, value in given.items() if is_number(value)}
            if own:
                found[f"{thing.__module__}.{thing.__qualname__}"] = own
    return found


def test_defaults_of_public_functions_are_the_kept_ones() -> None:
    kept = json.loads(KEPT.read_text(encoding="utf-8"))
    found = defaults()
    assert sorted(found) == sorted(kept)
    for name, own in found.items():
        assert own == kept[name], name


@pytest.mark.parametrize("known", ["simulation.simulate", "identify.core.search.Search"])
def test_the_kept_ones_hold_what_is_used_most(known) -> None:
    assert f"drake_racket.{known}" in json.loads(KEPT.read_text(encoding="utf-8"))


if __name__ == "__main__":
    KEPT.write_text(json.dumps(defaults(), indent=1, sort_keys=True) + "\n", encoding="utf-8")
