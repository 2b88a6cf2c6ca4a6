"""Numbers that carry their unit, their source and how they are known.

Drake's typed YAML sets the fields of these classes one by one and reads their annotations as types:
they are not frozen, and this module does not postpone annotations.
"""

import dataclasses
import typing
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from drake_racket.io.errors import InputError
from drake_racket.io.numbers import finite_number, plain_numbers

STATUSES = ("printed", "calculated", "measured", "fitted", "inferred")
"""How a value is known: printed in the source, calculated from printed numbers, measured or fitted
by the user, or inferred (the best reading of something that no source says)."""


@dataclass
class Quantity:
    """One number with its unit and its provenance."""

    value: float = 0.0
    unit: str = ""
    status: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        """NumPy's numbers become Python's: SDF and YAML are written from them."""
        plain_numbers(self)


@dataclass
class Quantities:
    """A list of numbers of one kind with their unit and provenance."""

    value: list[float] = field(default_factory=list)
    unit: str = ""
    status: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        """As a Quantity's."""
        plain_numbers(self)


@dataclass
class Choice:
    """A named reading or convention with its provenance."""

    value: str = ""
    status: str = ""
    source: str = ""


@dataclass
class Assignment:
    """Names of parts of the model -> names of parameters, with provenance."""

    value: dict[str, str] = field(default_factory=dict)
    status: str = ""
    source: str = ""


Sourced = Quantity | Quantities | Choice | Assignment


def one(unit: str, *, sign: str = "positive") -> Any:
    """A dataclass field that holds a Quantity in `unit`; sign: positive, non-negative or any."""
    return field(default_factory=Quantity, metadata={"unit": unit, "sign": sign})


def many(unit: str, *, sign: str = "positive", least: int = 1) -> Any:
    """A dataclass field that holds Quantities in `unit`, at least `least` of them."""
    return field(default_factory=Quantities, metadata={"unit": unit, "sign": sign, "least": least})


def choice(*allowed: str) -> Any:
    """A dataclass field that holds one of the named readings."""
    return field(default_factory=Choice, metadata={"allowed": allowed})


def sourced_fields(parameters: object, path: str = "") -> Iterator[tuple[str, Sourced]]:
    """All sourced values below a parameter dataclass, depth first, with their dotted keys."""
    for item in dataclasses.fields(typing.cast(Any, parameters)):
        value = getattr(parameters, item.name)
        key = f"{path}.{item.name}" if path else item.name
        if isinstance(value, (Quantity, Quantities, Choice, Assignment)):
            yield key, value
        elif dataclasses.is_dataclass(value):
            yield from sourced_fields(value, key)


def check_fields(parameters: object, where: str, path: str = "") -> None:
    """Checks unit, sign, count, status and source of every value below `parameters`.

    Raises:
        InputError: naming the first key that does not fit.

    """
    for item in dataclasses.fields(typing.cast(Any, parameters)):
        value = getattr(parameters, item.name)
        key = f"{path}.{item.name}" if path else item.name
        if isinstance(value, (Quantity, Quantities, Choice, Assignment)):
            _check_one(value, dict(item.metadata), f"{where}: {key}")
        elif dataclasses.is_dataclass(value):
            check_fields(value, where, key)


def _check_one(value: Sourced, rule: dict[str, Any], key: str) -> None:
    if value.status not in STATUSES:
        raise InputError(f"{key}.status", value.status, ", ".join(STATUSES))
    if not value.source.strip():
        raise InputError(f"{key}.source", value.source, "where the value comes from")
    if isinstance(value, Choice) and value.value not in rule["allowed"]:
        raise InputError(f"{key}.value", value.value, ", ".join(rule["allowed"]))
    if isinstance(value, (Choice, Assignment)):
        return
    if value.unit != rule["unit"]:
        raise InputError(f"{key}.unit", value.unit, repr(rule["unit"]))
    plain_numbers(value)
    numbers = value.value if isinstance(value, Quantities) else [value.value]
    if isinstance(value, Quantities) and len(numbers) < rule["least"]:
        raise InputError(f"{key}.value", numbers, f"at least {rule['least']} numbers")
    for number in numbers:
        finite_number(f"{key}.value", number)
        if rule["sign"] == "positive" and not number > 0:
            raise InputError(f"{key}.value", number, "more than 0")
        if rule["sign"] == "non-negative" and not number >= 0:
            raise InputError(f"{key}.value", number, "0 or more")


def check_name(name: str, where: str) -> None:
    """Raises InputError unless `name` can name a model: letters, digits and _."""
    if not (name.isascii() and name.isidentifier()):
        raise InputError(f"{where}: name", name, "letters, digits and _ (not first a digit)")
