"""Makes the reference of the command line from the functions that typer makes commands of."""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from manual.tables import code, table

_HEAD = """# Command line

`drake-racket COMMAND --help` prints the same. Numbers without a unit are in m/s, degrees and
seconds; [any other unit](units.md) is written behind the number: `69mph`, `280N`, `20mm`.
What a command ends with: [exit statuses](errors.md). `drake-racket --version` prints the versions
of the package and of Drake, `--install-completion` teaches your shell the options.

"""


@dataclass(frozen=True)
class Parameter:
    """A parameter is one argument or option of a command, as its function declares it."""

    name: str
    takes: str
    default: str
    text: str
    is_argument: bool


def command_line_page() -> str:
    """Makes the page: every command with its arguments, options, defaults and help."""
    from drake_racket.cli import app

    found = _commands(app, "drake-racket")
    rows = [
        (f"[`{path}`](#{path.replace(' ', '-')})", _help(function).split("\n\n")[0])
        for path, function in found
    ]
    sections = [_section(path, function) for path, function in found]
    return "\n".join([_HEAD, table(("command", "what it does"), rows), *sections])


def _commands(app: typer.Typer, path: str) -> list[tuple[str, Callable[..., Any]]]:
    found = []
    for command in app.registered_commands:
        assert command.callback is not None
        name = command.name or command.callback.__name__.replace("_", "-")
        found.append((f"{path} {name}", command.callback))
    for group in app.registered_groups:
        assert group.typer_instance is not None
        found += _commands(group.typer_instance, f"{path} {group.name}")
    return found


def _help(function: Callable[..., Any]) -> str:
    return inspect.getdoc(function) or ""


def _section(path: str, function: Callable[..., Any]) -> str:
    parameters = [*_parameters(function)]
    arguments = [p for p in parameters if p.is_argument]
    usage = " ".join([path, *(a.name for a in arguments), "[OPTIONS]"])
    lines = [f"## {path}", "", _help(function), "", f"```text\n{usage}\n```", ""]
    if arguments:
        lines += [table(("argument", "what"), [(code(a.name), a.text) for a in arguments]), ""]
    options = [(p.name, p.takes, p.default, p.text) for p in parameters if not p.is_argument]
    if options:
        lines += [table(("option", "takes", "default", "what"), options), ""]
    return "\n".join(lines)


def _parameters(function: Callable[..., Any]) -> list[Parameter]:
    hints = typing.get_type_hints(function, include_extras=True)
    found = []
    for name, parameter in inspect.signature(function).parameters.items():
        hint = hints[name]
        assert typing.get_origin(hint) is Annotated, f"{function.__name__}: {name}"
        kind, info = typing.get_args(hint)[:2]
        is_argument = isinstance(info, typer.models.ArgumentInfo)
        required = parameter.default is inspect.Parameter.empty
        if is_argument:
            shown = (info.metavar or name).upper() + ("..." if _is_list(kind) else "")
            shown = shown if required else f"[{shown.strip('[]')}]"
        else:
            shown = _names(name, info)
        default = "must be given" if required else _default(parameter.default)
        found.append(Parameter(shown, _takes(kind), default, info.help or "", is_argument))
    return found


def _names(name: str, info: Any) -> str:
    # in Annotated, the first name stands where the default would
    given = [t for t in (info.default, *(info.param_decls or ())) if str(t).startswith("-")]
    return ", ".join(code(text) for text in given or [f"--{name.replace('_', '-')}"])


def _default(value: Any) -> str:
    if value is None or isinstance(value, bool):
        return ""
    return code(value.value if isinstance(value, Enum) else value)


def _is_list(kind: Any) -> bool:
    return any(typing.get_origin(k) is list for k in (kind, *typing.get_args(kind)))


def _takes(kind: Any) -> str:
    """Tells in words what an option takes, from its annotation."""
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        (kind,) = (k for k in typing.get_args(kind) if k is not type(None))
    if typing.get_origin(kind) is list:
        return f"{_takes(typing.get_args(kind)[0])}, several times"
    if isinstance(kind, type) and issubclass(kind, Enum):
        return " or ".join(code(item.value) for item in kind)
    words = {str: "text", Path: "file or directory", int: "whole number", float: "number"}
    return words.get(kind, "")
