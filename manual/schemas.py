"""Makes the tables of a file's keys from the frozen dataclass that it is read into."""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing
from typing import Annotated, Any

from drake_racket.io import schema as rules
from drake_racket.io.schema import Number, OneOf, Three, Whole
from drake_racket.parameters.quantities import (
    Assignment,
    Choice,
    Named,
    Of,
    Quantities,
    Quantity,
)
from manual.shared_names import one_name_a_line
from manual.tables import code, table, unit


def schema_table(schema: type, *, prefix: str = "", linked: tuple[str, ...] | None = None) -> str:
    """Makes a table of the keys: unit, what is allowed, default, and what the source says.

    Args:
        schema: a frozen dataclass.
        prefix: of its keys.
        linked: keys with tables of their own elsewhere; None if no key has one on this page.

    """
    rows = []
    inner = {name for name, _, _ in _inner(schema)} if linked is not None else set()
    for field in dataclasses.fields(schema):
        if not field.init:
            continue
        hint = typing.get_type_hints(schema, include_extras=True)[field.name]
        allowed, measured_in = _allowed(hint)
        if field.name in inner and field.name not in (linked or ()):
            allowed = f"[these keys](#{_anchor(prefix + field.name)})"
        rows.append(
            (
                code(prefix + field.name),
                unit(measured_in),
                allowed,
                _default(field),
                descriptions(schema).get(field.name, ""),
            )
        )
    return table(("key", "unit", "allowed", "default", "what"), rows)


def schema_sections(schema: type, *, prefix: str = "", leave_out: tuple[str, ...] = ()) -> str:
    """Makes the table of a schema, and a section with a table for every schema inside it.

    Args:
        schema: a frozen dataclass.
        prefix: of its keys.
        leave_out: keys whose own tables stand on another page.

    """
    parts = [schema_table(schema, prefix=prefix, linked=leave_out)]
    done: dict[type, str] = {}
    for name, inner, listed in _inner(schema):
        key = f"{prefix}{name}"
        if name in leave_out:
            continue
        if inner in done:
            same = f"[`{done[inner]}`](#{_anchor(done[inner])})"
            parts.append(f"## `{key}`\n\nThe same keys as {same}.\n")
            continue
        done[inner] = key
        below = schema_sections(inner, prefix=f"{key}[]." if listed else f"{key}.")
        parts.append(f"## `{key}`\n\n{first_words(inner)}\n\n{below}")
    return "\n".join(parts)


def _anchor(key: str) -> str:
    return re.sub(r"[^\w-]", "", key.lower())


def _inner(schema: type) -> list[tuple[str, type, bool]]:
    """Lists the fields that are schemas themselves: name, schema, whether it is a list of them."""
    found = []
    hints = typing.get_type_hints(schema)
    for field in dataclasses.fields(schema):
        hint = hints[field.name]
        candidates = (hint, *typing.get_args(hint))
        for kind in candidates:
            if isinstance(kind, type) and dataclasses.is_dataclass(kind) and kind not in _NAMES:
                found.append((field.name, kind, typing.get_origin(hint) is tuple))
    return found


def first_words(schema: type) -> str:
    """Gives what a schema's docstring says before its attributes."""
    text = (inspect.getdoc(schema) or "").split("Attributes:")[0].strip()
    return text.replace("`laws.", "`drake_racket.laws.")


def _default(field: dataclasses.Field[Any]) -> str:
    if field.default is not dataclasses.MISSING:
        value = field.default
    elif field.default_factory is not dataclasses.MISSING:
        value = field.default_factory()
    else:
        return "must be given"
    if value is None:
        return "none"
    if dataclasses.is_dataclass(value) or isinstance(value, dict):
        return "its own defaults" if dataclasses.is_dataclass(value) else "`{}`"
    if isinstance(value, tuple):
        return code(list(value))
    if isinstance(value, bool):
        return code(str(value).lower())
    return code(value) if value != "" else "empty"


def _allowed(hint: Any) -> tuple[str, str]:
    """Tells in words what a field takes, and its unit."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is Annotated:
        base, *marks = arguments
        for mark in marks:
            found = _by_rule(mark, base)
            if found is not None:
                return found
        return _allowed(base)
    if origin is dict:
        value, measured_in = _allowed(arguments[1])
        return f"a mapping of names to {value or 'values'}", measured_in
    if origin is tuple:
        value, measured_in = _allowed(arguments[0])
        return f"a list of: {value}", measured_in
    if arguments and type(None) in arguments:
        (inner,) = (a for a in arguments if a is not type(None))
        return _allowed(inner)
    if dataclasses.is_dataclass(hint):
        kind = typing.cast(type, hint)
        return _NAMES.get(kind, f"the keys of {kind.__name__}"), ""
    return {str: "text", bool: "true or false", float: "a number", int: "a whole number"}.get(
        hint, getattr(hint, "__name__", str(hint))
    ), ""


_NAMES: dict[type, str] = {
    Quantity: "a quantity",
    Quantities: "a list with one unit",
    Choice: "a choice",
    Assignment: "names to names",
}


def _by_rule(mark: Any, base: Any) -> tuple[str, str] | None:
    if isinstance(mark, Number):
        return _range(mark.least, mark.most), mark.unit
    if isinstance(mark, Whole):
        return f"a whole number, {mark.least} to {mark.most}", ""
    if isinstance(mark, Three):
        inside = "" if mark.most == float("inf") else f", each within ±{mark.most:g}"
        return f"three numbers{inside}" + (
            " (null leaves one open)" if mark.free else ""
        ), mark.unit
    if isinstance(mark, OneOf):
        return ", ".join(code(name) if name else "empty" for name in mark.names), ""
    if isinstance(mark, Of):
        what = "list of numbers" if base is Quantities else "number"
        sign = {"positive": "above 0", "non-negative": "0 or more", "any": "any sign"}[mark.sign]
        return f"{what}, {sign}", mark.unit
    if isinstance(mark, Named):
        return ", ".join(code(name) for name in mark.names), ""
    if mark is typing.get_args(rules.Text)[1]:
        return "text", ""
    if mark is typing.get_args(rules.Flag)[1]:
        return "`true`, `false`", ""
    return None


def _range(least: float, most: float) -> str:
    if least == -float("inf") and most == float("inf"):
        return "a number"
    if most == float("inf"):
        return f"{least:g} or more"
    return f"{least:g} to {most:g}"


def descriptions(schema: type) -> dict[str, str]:
    """Gives what is said of each field: in the docstring's `Attributes:`, or behind the field."""
    found: dict[str, str] = {}
    document = inspect.getdoc(schema) or ""
    names = [field.name for field in dataclasses.fields(schema)]
    if "Attributes:" in document:
        block = one_name_a_line(document).split("Attributes:", 1)[1].split("\n\n")[0]
        text = re.sub(r"\n {5,}", " ", block)
        for name, said in re.findall(r"^    (\w+): (.*)$", text, re.MULTILINE):
            if name in names:
                found[name] = said.strip().rstrip(".")
    for line in inspect.getsource(schema).splitlines():
        comment = re.match(r"\s+(\w+): .*?  # (.+)$", line)
        if comment and comment[1] in names:
            found.setdefault(comment[1], comment[2])
    return found
