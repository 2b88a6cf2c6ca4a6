"""Typed YAML files: Drake's loader, with errors that name the key, the value and what is allowed.

Drake's `yaml_load_typed` turns a document into dataclasses. Its messages name only the innermost
key, it keeps the last of two equal keys, and it leaves signs, units and ranges to the caller. This
module checks the raw tree against the dataclasses first, then lets Drake build them.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import math
import os
import types
import typing
import unicodedata
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydrake.common.yaml import yaml_dump, yaml_load_typed

from drake_racket.io.errors import InputError

T = TypeVar("T")

MAX_BYTES = 100_000  # a parameter file is a few kB; this stops a wrong file early


def name_or_path(given: str | os.PathLike[str], key: str) -> str:
    """A shipped file's name or a path, as text; raises InputError where it is neither."""
    text: object = None
    if isinstance(given, str | os.PathLike):
        text = os.fspath(given)
    if not isinstance(text, str):
        raise InputError(key, given, "a name or a path")
    return text


def load_file(path: Path, schema: type[T], *, complete: bool) -> T:
    """Reads `path` into the dataclass `schema`.

    Args:
        complete: every field must be present (parameter files) whose metadata do not call it
            `optional`; otherwise missing fields keep the dataclass's defaults (scenarios).

    Raises:
        InputError: the file cannot be read, is not YAML, or does not fit the schema.

    """
    return load_text(_read(path), schema, where=str(path), complete=complete)


def _read(path: Path) -> str:
    try:
        with path.open("rb") as file:  # not stat: /dev/zero and pipes have no size
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a name with NUL or a lone surrogate
        reason = getattr(error, "strerror", None) or "not a file's name"
        raise InputError("file", path, f"a readable YAML file ({reason})") from None
    if len(data) > MAX_BYTES:
        raise InputError(str(path), "a larger file", f"at most {MAX_BYTES} bytes")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError("file", path, "a readable YAML file (not UTF-8 text)") from None


def load_text(text: str, schema: type[T], *, where: str, complete: bool) -> T:
    """Reads YAML `text` into the dataclass `schema`; see `load_file`."""
    return typing.cast(T, copy.deepcopy(_load(text, typing.cast(Any, schema), where, complete)))


@functools.lru_cache(maxsize=64)
def _load(text: str, schema: Any, where: str, complete: bool) -> Any:
    """Kept by text, since a study loads the same few files thousands of times."""
    tree = parse_tree(text, where)
    if not isinstance(tree, dict):
        raise InputError(where, tree, f"a mapping with the keys {_names(schema)}")
    checked = _check(tree, schema, where + ": ", "", complete)
    return yaml_load_typed(
        schema=schema, data=yaml_dump(checked), allow_schema_with_no_yaml=not complete
    )


def parse_tree(text: str, where: str) -> Any:
    """YAML text as mappings, lists and scalars, repeated keys refused; raises InputError."""
    loader = None
    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        _check_nodes(node, where, set())
        return loader.construct_document(node)
    except InputError:
        raise
    # PyYAML raises the first, or whatever int(), float(), a table or a date raise on their text
    except (
        yaml.YAMLError,
        ValueError,
        LookupError,
        AttributeError,
        ArithmeticError,
        RecursionError,
    ) as error:
        mark = getattr(error, "problem_mark", None)
        line = f"line {mark.line + 1}" if mark is not None else "the document"
        problem = getattr(error, "problem", None) or str(error) or type(error).__name__
        raise InputError(where, line, f"YAML ({problem})") from None
    finally:
        if loader is not None:
            loader.dispose()


def _check_nodes(node: yaml.Node, where: str, seen: set[int]) -> None:
    """Refuses repeated keys and aliases, and makes every key the text that is written.

    A parameter or scenario has no use for aliases, and they may recurse. Keys as text leave no
    second way to write one (1 and 0x1, or a merge key).
    """
    if id(node) in seen:
        raise InputError(where, f"an alias in line {node.start_mark.line + 1}", "no YAML aliases")
    seen.add(id(node))
    if isinstance(node, yaml.SequenceNode):
        for item in node.value:
            _check_nodes(item, where, seen)
    elif isinstance(node, yaml.MappingNode):
        keys: set[str] = set()
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode):
                line = f"a list or mapping as a key in line {key.start_mark.line + 1}"
                raise InputError(where, line, "keys that are text")
            if key.value in keys:
                raise InputError(f"{where}: {key.value}", "a repeated key", "each key once")
            keys.add(key.value)
            key.tag = "tag:yaml.org,2002:str"
            _check_nodes(value, where, seen)


def _names(schema: type) -> str:
    return ", ".join(f.name for f in dataclasses.fields(schema))


def _check(tree: Any, schema: Any, where: str, path: str, complete: bool) -> Any:
    """Returns `tree` made ready for Drake's loader, or raises an InputError naming `path`."""
    key = where + (path or "document")
    origin, args = typing.get_origin(schema), typing.get_args(schema)
    if origin in (typing.Union, types.UnionType):
        if tree is None:
            return None
        return _check(tree, args[0], where, path, complete)
    if dataclasses.is_dataclass(schema):
        return _check_mapping(tree, typing.cast(type, schema), where, path, complete)
    if origin is list:
        if not isinstance(tree, list):
            raise InputError(key, tree, "a list")
        return [_check(x, args[0], where, f"{path}[{i}]", complete) for i, x in enumerate(tree)]
    if origin is dict:
        if not isinstance(tree, dict):
            raise InputError(key, tree, "a mapping")
        return {k: _check(v, args[1], where, f"{path}.{k}", complete) for k, v in tree.items()}
    if schema is str:
        if isinstance(tree, bool) or not isinstance(tree, (str, int, float)):
            raise InputError(key, tree, "a text")
        return _text(tree, key)
    if schema is bool:
        if not isinstance(tree, bool):
            raise InputError(key, tree, "true or false")
        return tree
    if schema is float:
        return _number(tree, key)
    if schema is int:
        return _whole_number(tree, key)
    raise TypeError(f"{schema!r} is not supported in a typed YAML file")


def _check_mapping(tree: Any, schema: type, where: str, path: str, complete: bool) -> Any:
    if not isinstance(tree, dict):
        raise InputError(where + (path or "document"), tree, f"a mapping with {_names(schema)}")
    hints = typing.get_type_hints(schema)
    prefix = path + "." if path else ""
    for key in tree:
        if key not in hints:
            raise InputError(where + prefix + key, "an unknown key", _names(schema))
    optional = {
        f.name: f.default for f in dataclasses.fields(schema) if f.metadata.get("optional", False)
    }
    for name in hints:
        if complete and name not in tree and name not in optional:
            raise InputError(where + prefix + name, "nothing", "this key must be given")
    return {
        name: _check(value, hints[name], where, prefix + name, complete)
        for name, value in (optional | tree).items()
    }


def _number(value: Any, key: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise InputError(key, value, "a number")
    try:
        number = float(value)  # YAML 1.1 reads 1e-3 (no dot) as text
    except (ValueError, OverflowError):
        raise InputError(key, value, "a number") from None
    if not math.isfinite(number):
        raise InputError(key, value, "a finite number")
    return number


def _whole_number(value: Any, key: str) -> int:
    number = _number(value, key)
    if number != int(number):
        raise InputError(key, value, "a whole number")
    return int(number)


def _text(value: str | int | float, key: str) -> str:
    try:
        text = str(value)
    except ValueError:  # an int beyond sys.get_int_max_str_digits()
        raise InputError(key, value, "a text") from None
    if any(unicodedata.category(c) in ("Cc", "Cs") and c not in "\n\t" for c in text):
        raise InputError(key, value, "a text without control characters")
    return text
