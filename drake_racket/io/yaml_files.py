"""YAML text becomes plain data here, by the rules of YAML 1.2, and plain data becomes text.

PyYAML reads YAML 1.1, in which `025` is octal, `0:25` counts in sixties, `1e-3` is text and `no` is
false. The tables below are the core schema of YAML 1.2 (yaml.org/spec/1.2.2, section 10.3.2).
"""

from __future__ import annotations

import functools
import os
import re
import typing
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import yaml

from drake_racket.io.errors import InputError
from drake_racket.io.numbers import FrozenDict
from drake_racket.io.schema import read
from drake_racket.io.shipped import data_directory

T = TypeVar("T")

MAX_BYTES = 100_000  # a parameter file is a few kB; this stops a wrong file early

_CORE = (
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    ("int", r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", list("-+0123456789")),
    (
        "float",
        r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
        r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)",
        list("-+0123456789."),
    ),
)


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader with the scalars of YAML 1.2."""

    yaml_implicit_resolvers: ClassVar[dict[str, list[Any]]] = {}


class _FastLoader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """The same with libyaml's parser, ten times as fast, where PyYAML has it."""

    yaml_implicit_resolvers: ClassVar[dict[str, list[Any]]] = {}


class _Dumper(yaml.SafeDumper):
    """PyYAML's safe dumper, which quotes what `_Loader` would take for a number."""

    yaml_implicit_resolvers: ClassVar[dict[str, list[Any]]] = {}


for _tag, _pattern, _first in _CORE:
    for _kind in (_Loader, _FastLoader, _Dumper):
        _kind.add_implicit_resolver(
            f"tag:yaml.org,2002:{_tag}", re.compile(f"(?:{_pattern})\\Z"), _first
        )


yaml.SafeDumper.add_representer(FrozenDict, yaml.SafeDumper.represent_dict)
_Dumper.add_representer(FrozenDict, yaml.SafeDumper.represent_dict)


def _integer(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> int:
    text = str(loader.construct_scalar(node))
    for prefix, base in (("0o", 8), ("0x", 16)):
        if text.startswith(prefix):
            return int(text[2:], base)
    return int(text)


def _float(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
    text = str(loader.construct_scalar(node)).lower()
    return float(text.replace(".inf", "inf").replace(".nan", "nan"))


for _kind in (_Loader, _FastLoader):
    _kind.add_constructor("tag:yaml.org,2002:int", _integer)
    _kind.add_constructor("tag:yaml.org,2002:float", _float)


def name_or_path(given: str | os.PathLike[str], key: str) -> str:
    """Gives a shipped file's name or a path, as text; raises InputError where it is neither."""
    text: object = None
    if isinstance(given, str | os.PathLike):
        text = os.fspath(given)
    if not isinstance(text, str):
        raise InputError(key, given, "a name or a path")
    return text


def shipped_or_path(
    given: str | os.PathLike[str], key: str, names: Sequence[str], prefix: str = ""
) -> Path:
    """The file of a shipped name (`prefix` and the name), or the path given; raises InputError."""
    text = name_or_path(given, key)
    if text.endswith((".yaml", ".yml")):
        return Path(text)
    if text not in names:
        raise InputError(key, text, f"{', '.join(names)} or a path ending in .yaml")
    return data_directory() / f"{prefix}{text}.yaml"


def load_file(
    path: str | Path, schema: type[T], check: Callable[[T, str], None] | None = None
) -> T:
    """Reads a YAML file into the frozen dataclass `schema`; see `schema.read`.

    Equal texts share one object: a study loads the same few files thousands of times.

    Args:
        check: of the whole, which no single value shows; it gets the object and the file's name.

    Raises:
        InputError: the file cannot be read, is not YAML, or does not fit the schema.

    """
    made: T = _load(read_text(path), typing.cast(Any, schema), os.fspath(path), check)
    return made


def load_text(text: str, schema: type[T], *, where: str) -> T:
    """Reads YAML `text` into the frozen dataclass `schema`; see `load_file`."""
    made: T = _load(text, typing.cast(Any, schema), where, None)
    return made


@functools.lru_cache(maxsize=64)
def _load(text: str, schema: Any, where: str, check: Any) -> Any:
    made = read(parse_tree(text, where), schema, where)
    if check is not None:
        check(made, where)
    return made


def read_text(path: str | Path, most: int = MAX_BYTES) -> str:
    """Reads the text of a YAML file of at most `most` bytes, in UTF-8.

    Raises:
        InputError: the file cannot be read, is large, or is no such text.

    """
    try:
        with open(path, "rb") as file:  # not stat: /dev/zero and pipes have no size
            data = file.read(most + 1)
    except (OSError, ValueError) as error:  # ValueError: a name with NUL or a lone surrogate
        reason = getattr(error, "strerror", None) or "not a file's name"
        raise InputError("file", Path(path), f"a readable YAML file ({reason})") from None
    if len(data) > most:
        raise InputError(str(path), "a larger file", f"at most {most} bytes")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError("file", Path(path), "a readable YAML file (not UTF-8 text)") from None


def dump_text(tree: Any) -> str:
    """Plain data as YAML text, keys in their order."""
    text: str = yaml.dump(tree, Dumper=_Dumper, sort_keys=False, allow_unicode=True)
    return text


def parse_tree(text: str, where: str) -> Any:
    """Gives YAML text as mappings, lists and scalars, repeated keys refused; raises InputError."""
    try:
        return _parse(_FastLoader, text, where)
    except InputError:
        raise
    except _BROKEN:
        pass  # the other parser says more of what is wrong
    try:
        return _parse(_Loader, text, where)
    except InputError:
        raise
    except _BROKEN as error:
        mark = getattr(error, "problem_mark", None)
        line = f"line {mark.line + 1}" if mark is not None else "the document"
        problem = getattr(error, "problem", None) or str(error) or type(error).__name__
        raise InputError(where, line, f"YAML ({problem})") from None


# PyYAML raises the first, or whatever int(), float(), a table or a date raise on their text
_BROKEN = (
    yaml.YAMLError,
    ValueError,
    LookupError,
    AttributeError,
    ArithmeticError,
    RecursionError,
)


def _parse(kind: Any, text: str, where: str) -> Any:
    loader = kind(text)
    try:
        node = loader.get_single_node()
        if node is None:
            return None
        _check_nodes(node, where, "", set())
        return loader.construct_document(node)
    finally:
        loader.dispose()


def _check_nodes(node: yaml.Node, where: str, path: str, seen: set[int]) -> None:
    """Refuses repeated keys and aliases, and makes every key the text that is written.

    A parameter or scenario has no use for aliases, and they may recurse. Keys as text leave no
    second way to write one (1 and 0x1, or a merge key).
    """
    if id(node) in seen:
        raise InputError(where, f"an alias in line {node.start_mark.line + 1}", "no YAML aliases")
    seen.add(id(node))
    if isinstance(node, yaml.ScalarNode):
        _check_characters(node.value, f"{where}: {path or 'document'}")
    elif isinstance(node, yaml.SequenceNode):
        for i, item in enumerate(node.value):
            _check_nodes(item, where, f"{path}[{i}]", seen)
    elif isinstance(node, yaml.MappingNode):
        keys: set[str] = set()
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode):
                line = f"a list or mapping as a key in line {key.start_mark.line + 1}"
                raise InputError(where, line, "keys that are text")
            if key.value in keys:
                raise InputError(f"{where}: {key.value}", "a repeated key", "each key once")
            _check_characters(key.value, where)
            keys.add(key.value)
            key.tag = "tag:yaml.org,2002:str"
            _check_nodes(value, where, f"{path}.{key.value}" if path else key.value, seen)


def _check_characters(text: str, key: str) -> None:
    """Half a character (a lone surrogate) is no text."""
    try:
        text.encode()
    except UnicodeEncodeError:
        raise InputError(key, text, "a text without control characters") from None
