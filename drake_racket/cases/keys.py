"""An axis of a sweep can vary keys of the scenario, and parameters by their dotted names.

A scenario's key is written as in its file, nested ones with dots (`integrator.accuracy`,
`limb.stroke.speed`); a component of a vector by its letter (`gravity.z`, `limb.place.x`); a joint
of `limb.stroke.guess_deg` or `limb.initial_deg` by its name. A parameter is written as in
`overrides` (`racket.head.mass`). Every key holds one number, text or switch.
"""

from __future__ import annotations

import dataclasses
import difflib
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drake_racket.io.errors import InputError
from drake_racket.io.units import measure
from drake_racket.parameters.overrides import (
    SPRING,
    ParameterKey,
    overridden_numbers,
    parameter_keys,
)
from drake_racket.parameters.scenario import Scenario

Value = float | str | bool

NUMBER, TEXT, SWITCH = "number", "text", "switch"
_XYZ = "xyz"
_BY_JOINT = ("limb.stroke.guess_deg.", "limb.initial_deg.")

# units of the scenario's numbers; keys that end in _deg are in degrees
_UNITS = {
    "offset_x": "m",
    "offset_y": "m",
    "speed": "m/s",
    "spin_rpm": "rpm",
    "spin": "rad/s",
    "approach_time": "s",
    "after": "s",
    "time_step": "s",
    "gravity": "m/s^2",
    "integrator.accuracy": "1",
    "integrator.maximum_step": "s",
    "limb.mass": "kg",
    "limb.height": "m",
    "limb.activation": "1",
    "limb.place": "m",
    "limb.stroke.position": "m",
    "limb.stroke.speed": "m/s",
    "limb.stroke.angular_velocity": "rad/s",
}


@dataclass(frozen=True)
class Key:
    """Holds one thing that can be varied.

    Attributes:
        name: as written in a sweep.
        kind: NUMBER, TEXT or SWITCH (true or false).
        unit: of a number.
        parameter: an override of a parameter, and no key of the scenario's own.

    """

    name: str
    kind: str
    unit: str = ""
    parameter: bool = False


def scenario_keys() -> dict[str, Key]:
    """Gives the scenario's own keys by name, but those of single joints."""
    return {key.name: key for key in _walk(Scenario, "")}


def _walk(schema: type, prefix: str) -> list[Key]:
    found: list[Key] = []
    for name, hint in typing.get_type_hints(schema).items():
        path = prefix + name
        kinds = {hint, *typing.get_args(hint)}
        if dataclasses.is_dataclass(hint):
            found += _walk(typing.cast(type, hint), path + ".")
        elif typing.get_origin(hint) is tuple and str in typing.get_args(hint):
            continue  # a list of names is no value
        elif typing.get_origin(hint) is tuple:
            found += [Key(f"{path}.{letter}", NUMBER, _unit(path)) for letter in _XYZ]
        elif typing.get_origin(hint) is dict:
            continue  # guess_deg, overrides: their keys are the model's
        elif bool in kinds:
            found.append(Key(path, SWITCH))
        elif float in kinds:
            found.append(Key(path, NUMBER, _unit(path)))
        else:
            found.append(Key(path, TEXT))
    return found


def _unit(path: str) -> str:
    return "degrees" if path.endswith("_deg") else _UNITS[path]


def find_key(name: str, base: Scenario, where: str) -> Key:
    """Gives the key of that name.

    Raises:
        InputError: there is none.

    """
    own = scenario_keys()
    if name in own:
        return own[name]
    if any(name.startswith(start) and len(name) > len(start) for start in _BY_JOINT):
        return Key(name, NUMBER, "degrees")
    parameters = _parameters(base)
    if name in parameters:
        return Key(name, NUMBER, parameters[name].unit, parameter=True)
    near = difflib.get_close_matches(name, [*own, *parameters], n=3, cutoff=0.5)
    shown = ", ".join(near) if near else "speed, point, ..., racket.head.mass, ball.mass, ..."
    raise InputError(where, name, f"a key of the scenario or a parameter ({shown})")


def with_settings(base: Scenario, settings: Sequence[str], where: str = "--set") -> Scenario:
    """Gives a scenario with keys set as a command line writes them, `speed=56mph`. Not checked.

    Raises:
        InputError: no such key, a key that stands twice, or a value that is not of its kind.

    """
    values: dict[Key, Value] = {}
    for text in settings:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not sign or not name:
            raise InputError(where, text, "KEY=VALUE: speed=30m/s, racket.head.mass=170g")
        key = find_key(name, base, where)
        if key in values:
            raise InputError(f"{where} {name}", value, "each key once")
        values[key] = _written(key, value, f"{where} {name}")
    return with_values(base, values, {})


def _written(key: Key, text: str, where: str) -> Value:
    if key.kind == NUMBER:
        return measure(where, text, key.unit, bare="")
    if key.kind == SWITCH:
        if text not in ("true", "false"):
            raise InputError(where, text, "true or false")
        return text == "true"
    return text


def with_values(
    base: Scenario, values: Mapping[Key, Value], factors: Mapping[Key, float]
) -> Scenario:
    """Gives a copy of `base` with `values` set, then some numbers multiplied. It is not checked.

    A factor multiplies what the case has without it: with a racket as another axis, that racket's.

    Raises:
        InputError: a factor's key has no number to multiply, or the parameters are not valid.

    """
    scenario = _with_all(base, values)
    single = {key for key in factors if key.name.startswith(SPRING)}
    for group in (factors.keys() - single, single):  # a spring's own k follows its line's
        numbers = _numbers(scenario, [key for key in factors if key in group])
        scenario = _with_all(scenario, {key: factors[key] * x for key, x in numbers.items()})
    return scenario


def number_of(scenario: Scenario, key: Key) -> float:
    """Gives the number that a scenario has for a key.

    Raises:
        InputError: it has none.

    """
    return _numbers(scenario, [key])[key]


def _numbers(scenario: Scenario, keys: Sequence[Key]) -> dict[Key, float]:
    """What `scenario` has for keys that are all of single springs, or none of them."""
    numbers = {key: _own_number(scenario, key) for key in keys if not key.parameter}
    names = [key.name for key in keys if key.parameter]
    if not names:
        return numbers
    if names[0].startswith(SPRING):
        found = {name: key.value for name, key in _parameters(scenario).items()}
    else:
        # a racket with springs of their own has other k and no p
        kept = {k: v for k, v in scenario.overrides.items() if not k.startswith(SPRING)}
        bare = dataclasses.replace(scenario, overrides={})
        parts = bare.load_racket(), bare.load_ball(), bare.load_grip()
        found = overridden_numbers(names, parts, kept)
    for key in keys:
        if key.parameter:
            if key.name not in found:
                raise InputError(key.name, "relative", "a parameter that this case has")
            numbers[key] = found[key.name]
    return numbers


def _own_number(scenario: Scenario, key: Key) -> float:
    node: Any = scenario
    for part in key.name.split("."):
        if isinstance(node, (list, tuple)):
            node = node[_XYZ.index(part)]
        elif isinstance(node, dict):
            node = node.get(part)
        else:
            node = getattr(node, part)
    if isinstance(node, bool) or not isinstance(node, (int, float)):
        raise InputError(key.name, "relative", f"a number in the base (it has {node!r})")
    return float(node)


def _parameters(scenario: Scenario) -> dict[str, ParameterKey]:
    """All keys with what `scenario` has; k and p as the file names them.

    A spring of its own turns the bed into 24 stiffnesses: it is left out, and entered after.
    """
    own = {k: v for k, v in scenario.overrides.items() if k.startswith(SPRING)}
    others = {k: v for k, v in scenario.overrides.items() if k not in own}
    plain = dataclasses.replace(scenario, overrides=others)
    keys = parameter_keys(plain.load_racket(), plain.load_ball(), plain.load_grip())
    return keys | {key: dataclasses.replace(keys[key], value=value) for key, value in own.items()}


def _with_all(scenario: Scenario, values: Mapping[Key, Value]) -> Scenario:
    overrides = {key.name: float(value) for key, value in values.items() if key.parameter}
    if overrides:
        scenario = dataclasses.replace(scenario, overrides=scenario.overrides | overrides)
    for key, value in values.items():
        if not key.parameter:
            scenario = typing.cast(Scenario, _replaced(scenario, key.name.split("."), value))
    return scenario


def _replaced(node: Any, path: list[str], value: Value) -> Any:
    if isinstance(node, tuple):
        pairs = zip(_XYZ, node, strict=True)
        return tuple(value if letter == path[0] else x for letter, x in pairs)
    if isinstance(node, dict):
        return node | {".".join(path): value}
    if path[1:]:
        value = _replaced(getattr(node, path[0]), path[1:], value)
    return dataclasses.replace(node, **{path[0]: value})
