"""An axis of a sweep is a grid, a list, rows of several keys, or a sampled design.

    speed: {values: [18, 25, 33], unit: m/s}                       a list
    speed: {values: [40mph, 65 km/h]}                              in any unit, behind the number
    speed: {from: 18, to: 33, count: 6, unit: m/s}                 a grid (spacing: log as well)
    head_mass: {key: racket.head.mass, from: 0.9, to: 1.1, count: 5, relative: true}
    stroke:                                                        keys that vary together
      keys: {speed: {unit: m/s}, incidence_deg: {unit: degrees}}
      rows: [[31, 17], [25, 16]]
      labels: [drive, slice]
    sample:                                                        Sobol or latin_hypercube
      design: sobol
      samples: 64
      seed: 1
      keys: {speed: {from: 18, to: 33, unit: m/s}, ball.mass: {from: 0.9, to: 1.1, relative: true}}

A design made elsewhere (Saltelli's, say) is rows. `relative` values are factors of what the case
has without them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.cases.keys import NUMBER, SWITCH, Key, Value, find_key
from drake_racket.io.errors import InputError
from drake_racket.io.numbers import as_number
from drake_racket.io.units import measure
from drake_racket.parameters.scenario import Scenario

MOST_CASES = 2**22
DESIGNS = ("sobol", "latin_hypercube")
_NUMBERS_AS_TEXT = {"tension": "N", "point": ""}  # a text that may be a number, and its unit


@dataclass(frozen=True)
class AxisColumn:
    """The values of one key along an axis; with `relative` they are factors."""

    key: Key
    values: tuple[Value, ...]
    unit: str
    relative: bool = False


@dataclass(frozen=True)
class SweepAxis:
    """Holds one dimension of a sweep.

    Attributes:
        name: of the dimension.
        columns: what varies along it, all of one length.
        labels: of the places along it: the values of an axis of one key.
        joint: whether several keys vary together; the labels are then no values of a key.

    """

    name: str
    columns: tuple[AxisColumn, ...]
    labels: tuple[Value, ...]
    joint: bool

    def __len__(self) -> int:
        """How many places it has."""
        return len(self.labels)


def make_axis(name: str, tree: Any, base: Scenario, where: str) -> SweepAxis:
    """Reads one axis from plain data (see the module) and checks it against `base`.

    Raises:
        InputError: naming the key, the value and what is allowed.

    """
    if isinstance(tree, (list, tuple)):
        tree = {"values": tree}
    if not isinstance(tree, Mapping):
        raise InputError(where, tree, "values, from/to/count, rows or a design")
    if "rows" in tree:
        return _rows_axis(name, tree, base, where)
    if "design" in tree:
        return _sampled_axis(name, tree, base, where)
    _check_names(
        tree, ("key", "values", "from", "to", "count", "spacing", "unit", "relative"), where
    )
    key = find_key(_text(tree.get("key", name), f"{where}.key"), base, where)
    tree = _plain(tree, key)
    if "values" in tree:
        if set(tree) & {"from", "to", "count", "spacing"}:
            raise InputError(where, sorted(tree), "either values, or from, to and count")
        values: Sequence[Any] = _sequence(tree["values"], f"{where}.values")
    else:
        count = _count(tree.get("count"), f"{where}.count")
        values = _between(tree, np.linspace(0.0, 1.0, count), where).tolist()
    column = _column(key, tree, values, where)
    _check_once(column.values, where)
    labels = column.values
    if key.name == "point" and all(str(x).isdigit() for x in labels):
        labels = tuple(int(x) for x in labels)
    return SweepAxis(name, (column,), labels, joint=False)


def _rows_axis(name: str, tree: Mapping[str, Any], base: Scenario, where: str) -> SweepAxis:
    _check_names(tree, ("keys", "rows", "labels"), where)
    keys = _keys(tree, where)
    rows = _sequence(tree["rows"], f"{where}.rows")
    for i, row in enumerate(rows):
        if len(_sequence(row, f"{where}.rows[{i}]")) != len(keys):
            raise InputError(f"{where}.rows[{i}]", row, f"one value each for {', '.join(keys)}")
    columns = []
    for i, (key_name, settings) in enumerate(keys.items()):
        at = f"{where}.keys.{key_name}"
        _check_names(settings, ("unit", "relative"), at)
        key = find_key(key_name, base, at)
        values = _plain({**settings, "values": [row[i] for row in rows]}, key)
        columns.append(_column(key, values, values["values"], at))
    labels: tuple[Value, ...] = tuple(range(len(rows)))
    if "labels" in tree:
        labels = tuple(
            _text(x, f"{where}.labels") for x in _sequence(tree["labels"], f"{where}.labels")
        )
        if len(labels) != len(rows):
            raise InputError(f"{where}.labels", list(labels), f"one for each of {len(rows)} rows")
        _check_once(labels, f"{where}.labels")
    return SweepAxis(name, tuple(columns), labels, joint=True)


def _sampled_axis(name: str, tree: Mapping[str, Any], base: Scenario, where: str) -> SweepAxis:
    _check_names(tree, ("design", "samples", "seed", "keys"), where)
    keys = _keys(tree, where)
    count = _count(tree.get("samples"), f"{where}.samples")
    unit_cube = _samples(tree.get("design"), len(keys), count, tree.get("seed"), where)
    columns = []
    for i, (key_name, settings) in enumerate(keys.items()):
        at = f"{where}.keys.{key_name}"
        _check_names(settings, ("from", "to", "spacing", "unit", "relative"), at)
        key = find_key(key_name, base, at)
        settings = _plain(settings, key)
        columns.append(_column(key, settings, _between(settings, unit_cube[:, i], at).tolist(), at))
    return SweepAxis(name, tuple(columns), tuple(range(count)), joint=True)


def _samples(design: Any, keys: int, count: int, seed: Any, where: str) -> NDArray[np.float64]:
    """Points of the unit cube (count, keys)."""
    from scipy.stats import qmc

    if design not in DESIGNS:
        raise InputError(f"{where}.design", design, ", ".join(DESIGNS))
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise InputError(f"{where}.seed", seed, "a whole number, 0 or more")
    if design == "sobol" and count & (count - 1):
        raise InputError(f"{where}.samples", count, "a power of 2 (Sobol's balance needs it)")
    kind = qmc.Sobol if design == "sobol" else qmc.LatinHypercube
    points: NDArray[np.float64] = kind(keys, seed=np.random.default_rng(seed)).random(count)
    return points


def _between(
    settings: Mapping[str, Any], shares: NDArray[np.float64], where: str
) -> NDArray[np.float64]:
    """Numbers from `from` (share 0) to `to` (share 1), evenly or by equal ratios."""
    low, high = (_number(settings.get(name), f"{where}.{name}") for name in ("from", "to"))
    spacing = settings.get("spacing", "linear")
    if spacing not in ("linear", "log"):
        raise InputError(f"{where}.spacing", spacing, "linear, log")
    if not low < high:
        raise InputError(f"{where}.to", high, f"more than from ({low:g})")
    if spacing == "linear":
        between = low + (high - low) * shares
    elif low > 0.0:
        between = low * (high / low) ** shares
    else:
        raise InputError(f"{where}.from", low, "more than 0 with spacing log")
    ends = np.where(shares == 1.0, high, np.where(shares == 0.0, low, between))  # no rounding there
    return np.asarray(ends, dtype=float)


def _column(key: Key, settings: Mapping[str, Any], values: Sequence[Any], where: str) -> AxisColumn:
    """Values of one key, checked for their type and unit."""
    relative = settings.get("relative", False)
    if not isinstance(relative, bool):
        raise InputError(f"{where}.relative", relative, "true or false")
    if not values:
        raise InputError(where, "an empty axis", "at least one value")
    if relative and key.kind != NUMBER:
        raise InputError(f"{where}.relative", True, f"false: {key.name} is no number")
    unit = _needed_unit(key, values, relative)
    given = settings.get("unit", "1" if unit == "1" else "")
    if given != unit:
        allowed = f"{unit} for {key.name}" + (" relative to the base" if relative else "")
        raise InputError(f"{where}.unit", given, allowed if unit else f"no unit for {key.name}")
    checked = tuple(_value(x, key, unit, f"{where}.values[{i}]") for i, x in enumerate(values))
    return AxisColumn(key, checked, unit, relative)


def _plain(settings: Mapping[str, Any], key: Key) -> dict[str, Any]:
    """The settings with numbers in place of texts that have a unit: `from: 40mph`.

    Where all have one, `unit` need not be said again.
    """
    plain = dict(settings)
    names = [name for name in ("from", "to") if name in settings]
    given = [settings[name] for name in names]
    if isinstance(settings.get("values"), (list, tuple)):
        given += settings["values"]
    numbers = [_number_of(value, key) for value in given]
    if given and all(number is not None for number in numbers):
        plain.setdefault("unit", key.unit)
    read = [value if n is None else n for value, n in zip(given, numbers, strict=True)]
    plain.update(zip(names, read, strict=False))
    if len(read) > len(names):
        plain["values"] = read[len(names) :]
    return plain


def _number_of(value: Any, key: Key) -> float | None:
    """The number of a text with a unit that the key's number can have; None of anything else."""
    if key.kind != NUMBER or not isinstance(value, str) or as_number(value) is not None:
        return None
    try:
        return measure("", value, key.unit)
    except InputError:
        return None


def _needed_unit(key: Key, values: Sequence[Any], relative: bool) -> str:
    if relative:
        return "1"
    if key.name in _NUMBERS_AS_TEXT:
        numbers = all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in values)
        return _NUMBERS_AS_TEXT[key.name] if numbers else ""
    return key.unit


def _value(value: Any, key: Key, unit: str, where: str) -> Value:
    if isinstance(value, np.generic):
        value = value.item()
    if key.kind == NUMBER:
        return _number(value, where)
    if key.kind == SWITCH:
        if not isinstance(value, bool):
            raise InputError(where, value, "true or false")
        return value
    if key.name in _NUMBERS_AS_TEXT and unit:
        return _number(value, where)
    return _text(value, where)


def _number(value: Any, where: str) -> float:
    if isinstance(value, np.generic):
        value = value.item()
    try:
        # YAML 1.1 reads 1e-3 (no dot) as text
        number = float(value) if not isinstance(value, bool) else math.nan
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise InputError(where, value, "a finite number")
    return number


def _text(value: Any, where: str) -> str:
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise InputError(where, value, "a text")
    return str(value)


def _count(value: Any, where: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 2 <= value <= MOST_CASES:
        raise InputError(where, value, f"a whole number from 2 to {MOST_CASES}")
    return value


def _sequence(value: Any, where: str) -> Sequence[Any]:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, (list, tuple)):
        raise InputError(where, value, "a list")
    if not value:
        raise InputError(where, "an empty axis", "at least one value")
    return value


def _keys(tree: Mapping[str, Any], where: str) -> dict[str, Mapping[str, Any]]:
    keys = tree.get("keys")
    if not isinstance(keys, Mapping) or not keys:
        raise InputError(f"{where}.keys", keys, "a mapping of keys to their units")
    found = {str(name): {} if settings is None else settings for name, settings in keys.items()}
    for name, settings in found.items():
        if not isinstance(settings, Mapping):
            raise InputError(f"{where}.keys.{name}", settings, "a mapping, as {unit: m/s}")
    return found


def _check_names(tree: Mapping[str, Any], allowed: Sequence[str], where: str) -> None:
    for name in tree:
        if name not in allowed:
            raise InputError(f"{where}.{name}", "an unknown key", ", ".join(allowed))


def _check_once(values: Sequence[Value], where: str) -> None:
    seen = set()
    for value in values:
        if value in seen:
            raise InputError(where, value, "each value once")
        seen.add(value)
