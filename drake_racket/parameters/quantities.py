"""Numbers here carry their unit, their source and how they are known."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

from drake_racket.io.errors import InputError, one_line
from drake_racket.io.numbers import plain_numbers
from drake_racket.io.schema import After, Number, OneOf, Schema, Text, refusal

STATUSES = ("printed", "calculated", "measured", "fitted", "inferred")
"""How a value is known: printed in the source, calculated from printed numbers, measured or fitted
by the user, or inferred (the best reading of something that no source says)."""

_Value = Annotated[float, Number("1")]
_Status = Annotated[str, OneOf(*STATUSES)]


def _source(text: str) -> str:
    if not text.strip():
        raise refusal(text, "where the value comes from")
    return text


_Source = Annotated[Text, After(_source)]


def _with_unit(number: str, unit: str, status: str) -> str:
    return one_line(f"{number} ({status})" if unit == "1" else f"{number} {unit} ({status})", 120)


@dataclass(frozen=True, repr=False)
class Quantity(Schema):
    """A quantity is one number with its unit and its provenance.

    Attributes:
        value: in `unit`.
        unit: as parameter files spell it, `kg*m^2`; `1` for a pure number.
        status: one of STATUSES: how the number is known.
        source: where it comes from, or why it was inferred.

    """

    value: _Value
    unit: Text
    status: _Status
    source: _Source

    def __post_init__(self) -> None:
        """NumPy's numbers become Python's: SDF and YAML are written from them."""
        plain_numbers(self)

    def __repr__(self) -> str:
        """Shows the number, its unit and how it is known."""
        return _with_unit(f"{self.value!r}", self.unit, self.status)


@dataclass(frozen=True, repr=False)
class Quantities(Schema):
    """The quantities are a list of numbers of one kind, with their unit and provenance."""

    value: tuple[_Value, ...]
    unit: Text
    status: _Status
    source: _Source

    def __post_init__(self) -> None:
        """NumPy's numbers become Python's, as those of a Quantity."""
        plain_numbers(self)

    def __repr__(self) -> str:
        """Shows the numbers, their unit and how they are known."""
        numbers = one_line(", ".join(map(repr, self.value)), 80)
        return _with_unit(f"[{numbers}]", self.unit, self.status)


@dataclass(frozen=True)
class Spread(Schema):
    """A spread number is one that racket makers print, or a regression gives, with its spread.

    `sd` is its standard deviation, in the same unit.
    """

    value: _Value
    unit: Text
    status: _Status
    source: _Source
    sd: Annotated[float, Number("1", 0.0)] = 0.0

    def __post_init__(self) -> None:
        """NumPy's numbers become Python's, as those of a Quantity."""
        plain_numbers(self)


@dataclass(frozen=True)
class Choice(Schema):
    """A choice is a named reading or convention with its provenance."""

    value: Text
    status: _Status
    source: _Source


@dataclass(frozen=True)
class Assignment(Schema):
    """An assignment maps parts of the model to names of parameters, with provenance."""

    value: dict[Text, Text]
    status: _Status
    source: _Source

    def __post_init__(self) -> None:
        """The assignment cannot be changed."""
        plain_numbers(self)


Sourced = Quantity | Quantities | Choice | Assignment


class Of(After):
    """Holds the rule of a Quantity or of Quantities: its unit and sign, and how many at least.

    Args:
        unit: as the file must write it.
        sign: positive, non-negative or any.
        least: of Quantities, how many numbers there are at least.

    """

    def __init__(self, unit: str, *, sign: str = "positive", least: int = 1) -> None:
        super().__init__(self._check)
        self.unit, self.sign, self.least = unit, sign, least

    def _check(self, found: Quantity | Quantities) -> Quantity | Quantities:
        if found.unit != self.unit:
            raise refusal(found.unit, repr(self.unit), ".unit")
        numbers = found.value if isinstance(found, Quantities) else (found.value,)
        if len(numbers) < self.least:
            raise refusal(list(numbers), f"at least {self.least} numbers", ".value")
        for number in numbers:
            if self.sign == "positive" and not number > 0:
                raise refusal(number, "more than 0", ".value")
            if self.sign == "non-negative" and not number >= 0:
                raise refusal(number, "0 or more", ".value")
        return found


class Named(After):
    """Holds the rule of a Choice: one of some names."""

    def __init__(self, *names: str) -> None:
        super().__init__(self._check)
        self.names = names

    def _check(self, found: Choice) -> Choice:
        if found.value not in self.names:
            raise refusal(found.value, ", ".join(self.names), ".value")
        return found


def sourced_fields(
    parameters: object, path: str = "", *, idle: bool = False
) -> Iterator[tuple[str, Sourced]]:
    """Gives all sourced values below a parameter dataclass, depth first, with their dotted keys.

    Args:
        idle: also those of a part that says by its `idle` that they decide nothing.

    """
    for item in dataclasses.fields(typing.cast(Any, parameters)):
        value = getattr(parameters, item.name)
        key = f"{path}.{item.name}" if path else item.name
        if isinstance(value, (Quantity, Quantities, Choice, Assignment)):
            yield key, value
        elif dataclasses.is_dataclass(value) and (idle or not getattr(value, "idle", False)):
            yield from sourced_fields(value, key, idle=idle)


def sourced_rows(parameters: object) -> list[tuple[str, ...]]:
    """Tells of every sourced value its key, value, unit, status and source, as texts."""
    rows: list[tuple[str, ...]] = []
    for key, found in sourced_fields(parameters):
        if isinstance(found, Assignment):
            value = ", ".join(f"{part}: {name}" for part, name in found.value.items())
        elif isinstance(found, Quantities):
            value = ", ".join(f"{number:g}" for number in found.value)
        else:
            value = f"{found.value:g}" if isinstance(found, Quantity) else found.value
        unit = getattr(found, "unit", "1")
        rows.append((key, value, "" if unit == "1" else unit, found.status, found.source))
    return rows


def check_name(name: str, where: str) -> None:
    """Raises InputError unless `name` can name a model: letters, digits and _."""
    if not (name.isascii() and name.isidentifier()):
        raise InputError(f"{where}: name", name, "letters, digits and _ (not first a digit)")
