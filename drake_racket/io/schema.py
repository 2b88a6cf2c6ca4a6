"""Plain data becomes frozen dataclasses here, once, or one line says what does not fit.

A schema is a frozen dataclass, derived from `Schema`, whose annotations carry rules:

    speed: Annotated[float, Number("m/s", 0.1, 100.0)] = 25.0
    support: Annotated[str, OneOf("free", "grip")] = "free"
    gravity: Annotated[Vector, Three("m/s^2", 100.0)] = (0.0, 0.0, 0.0)

pydantic walks the data and the dataclasses; the rules say what a single value may be, and this
module says it in the form `key: got value; allowed: what`. Fields without a default must be given.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import typing
import unicodedata
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic_core import core_schema

from drake_racket.io.errors import InputError, one_line
from drake_racket.io.numbers import as_number
from drake_racket.io.units import measure, units_shown

T = TypeVar("T")
Vector = tuple[float, ...]


@functools.cache
def _keywords(cls: type) -> tuple[str, ...]:
    return tuple(f.name for f in dataclasses.fields(typing.cast(Any, cls)) if f.init)


class _Named(type):
    """Refuses an unknown keyword as an unknown key of a file is refused."""

    def __call__(cls, *args: Any, **keywords: Any) -> Any:
        if dataclasses.is_dataclass(cls):
            names = _keywords(cls)
            for keyword in keywords:
                if keyword not in names:
                    raise _unknown(f"{cls.__name__}: {keyword}", keyword, ", ".join(names))
        return super().__call__(*args, **keywords)


class Schema(metaclass=_Named):
    """The Schema is the base of all: unknown keys are refused, objects are checked like data."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(
        extra="forbid", revalidate_instances="always"
    )


class Refusal(ValueError):
    """The error of a rule has the value, what is allowed, and where below the field it stands."""

    def __init__(self, value: object, allowed: str, below: str = "") -> None:
        super().__init__("not allowed")
        self.value, self.allowed, self.below = value, allowed, below


def refusal(value: object, allowed: str, below: str = "") -> Refusal:
    """Gives the error of a value that a rule does not allow."""
    return Refusal(value, allowed, below)


class Rule(ABC):
    """A rule says what one value that is no dataclass may be."""

    @abstractmethod
    def check(self, value: Any, *, written: bool = False) -> Any:
        """Returns the value as it is kept; raises `refusal`.

        Args:
            value: to be checked.
            written: it comes from a file, where a number may stand in quotes.

        """

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        def check(value: Any, info: Any) -> Any:
            return self.check(value, written=info.context is not None)

        return core_schema.with_info_plain_validator_function(check)


@dataclass(frozen=True)
class Number(Rule):
    """Allows a finite number in a unit, from `least` to `most`."""

    unit: str
    least: float = -math.inf
    most: float = math.inf

    def check(self, value: Any, *, written: bool = False) -> float:
        """Gives a Python float."""
        if type(value) is float and self.least <= value <= self.most and math.isfinite(value):
            return value
        number = as_number(value) if written or not isinstance(value, str) else None
        if number is None and written and isinstance(value, str):
            number = self._with_unit(value)
        if number is None:
            raise refusal(value, "a finite number")
        if not math.isfinite(number):
            raise refusal(value, "a finite number")
        if not self.least <= number <= self.most:
            unit = "" if self.unit == "1" else self.unit
            raise refusal(number, f"{self.least:g} to {self.most:g} {unit}".rstrip())
        return number

    def _with_unit(self, text: str) -> float | None:
        """The number of a text that has a unit behind it; None of a text that is no such thing."""
        if self.unit == "1":
            return None
        try:
            return measure("", text, self.unit)
        except InputError:
            raise refusal(text, f"a finite number ({units_shown(self.unit)})") from None


@dataclass(frozen=True)
class Whole(Rule):
    """Allows a whole number from `least` to `most`."""

    least: int
    most: int

    def check(self, value: Any, *, written: bool = False) -> int:
        """Gives a Python int."""
        number = Number("1").check(value, written=written)
        if number != int(number) or not self.least <= number <= self.most:
            raise refusal(value, f"a whole number from {self.least} to {self.most}")
        return int(number)


@dataclass(frozen=True)
class Three(Rule):
    """Allows three numbers, each within `most` of 0; with `free`, None leaves one open."""

    unit: str
    most: float = math.inf
    free: bool = False

    def check(self, value: Any, *, written: bool = False) -> tuple[float | None, ...]:
        """Gives a tuple of three."""
        if not isinstance(value, (list, tuple)) or len(value) != 3:
            text = "3 numbers" + (" (None: free)" if self.free else f" ({self.unit})")
            raise refusal(value, text)
        rule = Number(self.unit, -self.most, self.most)
        found: list[float | None] = []
        for i, item in enumerate(value):
            if item is None and self.free:
                found.append(None)
                continue
            try:
                found.append(rule.check(item, written=written))
            except Refusal as error:
                raise refusal(error.value, error.allowed, f"[{i}]") from None
        return tuple(found)


@dataclass(frozen=True)
class _Text(Rule):
    def check(self, value: Any, *, written: bool = False) -> str:
        """Text; a number that stands where text is wanted is taken as it is written."""
        if type(value) is str and value.isprintable():
            return value
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise refusal(value, "a text")
        try:
            text = str(value)
        except ValueError:  # an int beyond sys.get_int_max_str_digits()
            raise refusal(value, "a text") from None
        if not text.isprintable() and any(
            unicodedata.category(c) in ("Cc", "Cs") and c not in "\n\t" for c in text
        ):
            raise refusal(value, "a text without control characters")
        return text


_TEXT = _Text()


@dataclass(frozen=True)
class _Flag(Rule):
    def check(self, value: Any, *, written: bool = False) -> bool:
        """True or false, and nothing that only looks like it."""
        if not isinstance(value, bool):
            raise refusal(value, "true or false")
        return value


class OneOf(Rule):
    """Allows one of some names. An empty name may be left out of the message."""

    def __init__(self, *names: str) -> None:
        self.names = names

    def check(self, value: Any, *, written: bool = False) -> str:
        """Gives the name."""
        text = _TEXT.check(value)
        if text not in self.names:
            raise refusal(value, ", ".join(name for name in self.names if name))
        return text


class After:
    """Checks a dataclass, or whatever pydantic knows, once it has its type."""

    def __init__(self, check: Callable[[Any], Any]) -> None:
        self.after = check

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        return core_schema.no_info_after_validator_function(self.after, handler(source))


Text = Annotated[str, _TEXT]
Flag = Annotated[bool, _Flag()]


@functools.cache
def _adapter(schema: Any) -> TypeAdapter[Any]:
    return TypeAdapter(schema)


def read(tree: Any, schema: type[T], where: str) -> T:
    """Makes a schema's object from plain data, or from an object that nobody has checked.

    Args:
        tree: mappings, lists and scalars; or an object of the schema, which is checked anew.
        where: what the data are: a file, `scenario`.

    Raises:
        InputError: naming the key, the value and what is allowed.

    """
    if not isinstance(tree, (dict, schema)):
        raise InputError(where, tree, f"a mapping with the keys {_names(schema)}")
    try:
        written = {"written": True} if isinstance(tree, dict) else None
        made: T = _adapter(typing.cast(Any, schema)).validate_python(tree, context=written)
        return made
    except ValidationError as error:
        raise _translated(error, schema, where) from None
    except RecursionError:
        raise InputError(where, "data nested too deeply", "plain data") from None


def read_like(made: T, before: tuple[T, T], where: str) -> T:
    """Reads an object of which most is as in another one, for less: only what differs is checked.

    Args:
        made: a frozen object whose fields cannot be changed either.
        before: another one, and what `read` gave for it.

    Raises:
        InputError: as `read`.

    """
    given, checked = before
    hints, new = _hints(typing.cast(Any, type(made))), {}
    for name, hint in hints.items():
        value = getattr(made, name)
        if value is not getattr(given, name):
            try:
                new[name] = _adapter(hint).validate_python(value)
            except ValidationError as error:
                raise _translated(error, type(made), where, (name,)) from None
    return dataclasses.replace(typing.cast(Any, checked), **new) if new else checked


def check_fields(made: Any, paths: Iterable[tuple[str, ...]], where: str) -> None:
    """Checks some numbers or groups below a schema's object as `read` does; raises InputError.

    Args:
        paths: names of fields, from the object to what may have changed below it. Where a field on
            the way has a rule of its own, it is checked as a whole.

    """
    whole = {_checkable(typing.cast(Any, type(made)), path) for path in paths}
    for path in sorted(whole, key=functools.partial(_order, typing.cast(Any, type(made)))):
        schema: Any = type(made)
        value = made
        for name in path:
            schema, value = _hints(schema)[name], getattr(value, name)
        try:
            _adapter(schema).validate_python(value)
        except ValidationError as error:
            raise _translated(error, type(made), where, path) from None


@functools.cache
def _checkable(schema: Any, path: tuple[str, ...]) -> tuple[str, ...]:
    """The beginning of a path up to a field with a rule of its own, which sees all below it."""
    for i, name in enumerate(path):
        schema = _hints(schema)[name]
        if not dataclasses.is_dataclass(schema):
            return path[: i + 1]
    return path


@functools.cache
def _order(schema: Any, path: tuple[str, ...]) -> tuple[int, ...]:
    """Places of a path's fields among their neighbours: the first finding is in that order."""
    places = []
    for name in path:
        places.append(list(_hints(schema)).index(name))
        schema = _hints(schema)[name]
    return tuple(places)


@functools.cache
def _hints(schema: Any) -> dict[str, Any]:
    return typing.get_type_hints(schema, include_extras=True)


def _translated(
    error: ValidationError, schema: Any, where: str, below: tuple[str, ...] = ()
) -> InputError:
    """The first finding as an InputError; an unknown key first: it explains a missing one."""
    found = error.errors(include_url=False)
    unknown = [e for e in found if e["type"] == "unexpected_keyword_argument"]
    first = (unknown or found)[0]
    kind, place, value = first["type"], below + first["loc"], first["input"]
    key = f"{where}: {_dotted(place)}"
    if kind == "value_error":
        refused = first["ctx"]["error"]
        return InputError(key + refused.below, refused.value, refused.allowed)
    if kind == "unexpected_keyword_argument":
        return _unknown(key, str(place[-1]), _names(_at(schema, place[:-1])))
    if kind == "missing":
        return InputError(key, "nothing", "this key must be given")
    if kind == "dataclass_type":
        return InputError(key, value, f"a mapping with {_names(_at(schema, place))}")
    if kind in ("tuple_type", "list_type"):
        return InputError(key, value, "a list")
    if kind in ("dict_type", "mapping_type"):
        return InputError(key, value, "a mapping")
    return InputError(key, value, first["msg"])


def _unknown(key: str, name: str, names: str) -> InputError:
    """The error of a name that is none of `names`; it says which one is near."""
    near = difflib.get_close_matches(name, names.split(", "), n=1)
    allowed = f"{near[0]} (of {names})" if near else names
    return InputError(key, "an unknown key", allowed)


def _dotted(place: tuple[int | str, ...]) -> str:
    text = ""
    for part in place:
        if isinstance(part, int):
            text += f"[{part}]"
        elif part != "[key]":
            text += f".{part}" if text else part
    return text or "document"


def _at(schema: Any, place: tuple[int | str, ...]) -> Any:
    """The dataclass at a place below a schema."""
    for part in place:
        if isinstance(part, int):
            continue  # of a list whose items are the schema
        schema = typing.get_type_hints(schema).get(str(part), schema)
        inner = [a for a in typing.get_args(schema) if dataclasses.is_dataclass(a)]
        if inner and not dataclasses.is_dataclass(schema):
            schema = inner[0]
    return schema


def shown_changes(made: Any) -> str:
    """Shows a schema's object on one line: the fields that differ from their defaults."""
    changes = []
    for item in dataclasses.fields(made):
        default = item.default
        if item.default_factory is not dataclasses.MISSING:
            default = item.default_factory()
        value = getattr(made, item.name)
        if item.init and value != default:
            changes.append(f"{item.name}={value!r}")
    return shown(made, ", ".join(changes))


def shown(made: object, text: str) -> str:
    """Shows an object on one line of at most 120 characters: its class, and what `text` says."""
    return f"{type(made).__name__}({one_line(text, 118 - len(type(made).__name__))})"


def _names(schema: Any) -> str:
    if not dataclasses.is_dataclass(schema):
        return "its keys"
    return ", ".join(f.name for f in dataclasses.fields(schema))
