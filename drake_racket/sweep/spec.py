"""A sweep is data: a base scenario, axes over it, and what to keep of every case.

base: forehand.yaml          # a scenario file beside this one; or its keys, here
axes:                        # see `axes`; the first varies slowest
  point: [1, 5, 8]
  speed: {from: 18, to: 33, count: 6, unit: m/s}
outputs: [restitution, rebound_speed]          # see `outputs`
histories: {point: [5]}      # all, none, numbers of cases, or labels along axes
history_formats: [nc]
check: {share: 0.01, most: 5, tolerance: 0.01}      # cases that run in Drake once more
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from drake_racket.cases.case import check_scenario, load_scenario, resolve
from drake_racket.cases.keys import Key, Value, with_settings, with_values
from drake_racket.io.errors import InputError
from drake_racket.io.notebooks.tables import html_table
from drake_racket.io.schema import Number, Schema, Whole, read, shown
from drake_racket.io.yaml_files import parse_tree, read_text
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.formats import check_format
from drake_racket.results.outputs import OUTPUTS, USUAL_OUTPUTS, Output, find_outputs
from drake_racket.sweep.axes import MOST_CASES, SweepAxis, make_axis

MAX_BYTES = 20_000_000  # rows of a large design; this stops a wrong file early
_TAKEN = ("case", "status", "failure", "scenario_hash", "sweep")


@dataclass(frozen=True)
class SweepCheck(Schema):
    """Says how a sweep that runs compiled is compared with Drake; see `check`.

    Attributes:
        share: of the cases that run in Drake once more, at least one of them.
        most: of them; 0 for none.
        tolerance: of a difference, over the largest magnitude among all cases.

    """

    share: Annotated[float, Number("1", 0.0, 1.0)] = 0.01
    most: Annotated[int, Whole(0, 10_000)] = 5
    tolerance: Annotated[float, Number("1", 1e-12, 1.0)] = 1e-2

    def count(self, cases: int) -> int:
        """Gives the number of cases to compare, of a sweep of so many."""
        return min(self.most, max(1, math.ceil(self.share * cases)))


@dataclass(frozen=True, repr=False)
class Sweep:
    """A sweep is many impacts as checked data. Make one with `make_sweep` or `load_sweep`.

    Attributes:
        base: what the axes leave alone.
        axes: the first varies slowest.
        outputs: what is kept of every case.
        histories: numbers of the cases whose time history is written, in order.
        history_formats: suffixes of the files it is written to.
        check: how it is compared with Drake.

    """

    base: Scenario
    axes: tuple[SweepAxis, ...]
    outputs: tuple[Output, ...]
    histories: frozenset[int] = frozenset()
    history_formats: tuple[str, ...] = ("nc",)
    check: SweepCheck = SweepCheck()

    def __repr__(self) -> str:
        """Shows the axes with their lengths, and how many cases there are."""
        axes = " x ".join(f"{axis.name} ({len(axis)})" for axis in self.axes)
        return shown(self, f"{len(self)} cases: {axes}")

    def _repr_html_(self) -> str:
        """Shows a notebook the axes with their values, and what is kept of each case."""
        rows = [(axis.name, str(len(axis)), _first_and_last(axis)) for axis in self.axes]
        kept = ", ".join(output.name for output in self.outputs)
        title = f"Sweep of {len(self)} cases"
        return html_table(title, rows, head=("axis", "values", ""), below=f"outputs: {kept}")

    @property
    def shape(self) -> tuple[int, ...]:
        """Gives the number of places along each axis."""
        return tuple(len(axis) for axis in self.axes)

    def __len__(self) -> int:
        """How many cases it has."""
        return math.prod(self.shape)

    def places(self, case: int) -> tuple[int, ...]:
        """Tells where a case stands along each axis; cases are numbered row by row from 0."""
        found = []
        for count in reversed(self.shape):
            case, place = divmod(case, count)
            found.append(place)
        return tuple(reversed(found))

    def scenario(self, case: int) -> Scenario:
        """A case's scenario, not checked; raises InputError if it has no such key or number."""
        values: dict[Key, Value] = {}
        factors: dict[Key, float] = {}
        for axis, place in zip(self.axes, self.places(case), strict=True):
            for column in axis.columns:
                if column.relative:
                    factors[column.key] = float(column.values[place])
                else:
                    values[column.key] = column.values[place]
        return with_values(self.base, values, factors)


def _first_and_last(axis: SweepAxis) -> str:
    """A short text of an axis's labels."""
    labels = [f"{x:g}" if isinstance(x, float) else str(x) for x in axis.labels]
    return ", ".join(labels if len(labels) < 7 else [*labels[:3], "...", labels[-1]])


def load_sweep(path: str | Path, settings: Sequence[str] = ()) -> Sweep:
    """Reads and checks a sweep's file; `base` may name a scenario file beside it.

    Args:
        path: of the file.
        settings: keys of the base set otherwise, as `speed=30m/s`; see `keys.with_settings`.

    Raises:
        InputError: naming the key, the value and what is allowed.

    """
    path = Path(path)
    return parse_sweep(read_text(path, MAX_BYTES), str(path), path.parent, settings)


def parse_sweep(
    text: str,
    where: str = "sweep",
    directory: str | Path = Path(),
    settings: Sequence[str] = (),
) -> Sweep:
    """Reads and checks a sweep from YAML text, as `load_sweep` does; raises InputError."""
    directory = Path(directory)
    tree = parse_tree(text, where)
    names = ("base", "axes", "outputs", "histories", "history_formats", "check")
    if not isinstance(tree, dict):
        raise InputError(where, tree, f"a mapping with the keys {', '.join(names)}")
    for name in tree:
        if name not in names:
            raise InputError(f"{where}: {name}", "an unknown key", ", ".join(names))
    base = tree.pop("base", {})
    if isinstance(base, str):
        scenario = load_scenario(directory / base)
    elif isinstance(base, dict):
        scenario = resolve(read(base, Scenario, f"{where}: base"), f"{where}: base").scenario
    else:
        raise InputError(f"{where}: base", base, "a scenario file, or a scenario's keys")
    if settings:
        scenario = resolve(with_settings(scenario, settings), "--set").scenario
    axes = tree.pop("axes", None)
    return make_sweep(scenario, axes, **tree, where=where)


def make_sweep(
    base: Scenario,
    axes: Any,
    outputs: Sequence[str | Output] = USUAL_OUTPUTS,
    histories: Any = "none",
    history_formats: Sequence[str] = ("nc",),
    check: Any = None,
    *,
    where: str = "sweep",
) -> Sweep:
    """Checks a sweep given as plain data, as in its file.

    Args:
        base: what the axes leave alone.
        axes: dimension -> axis; see `axes`.
        outputs: names of what is kept of every case; in Python also an `Output` of your own.
        histories: `all`, `none`, numbers of cases, or dimension -> labels.
        history_formats: suffixes of the files they are written to.
        check: of `SweepCheck`; its defaults if None.

    Raises:
        InputError: naming the key, the value and what is allowed.

    """
    check_scenario(base, f"{where}: base")
    if not isinstance(axes, Mapping) or not axes:
        raise InputError(f"{where}: axes", axes, "at least one axis: a name and its values")
    made = tuple(make_axis(str(n), a, base, f"{where}: axes.{n}") for n, a in axes.items())
    chosen = find_outputs(_outputs(outputs, f"{where}: outputs"), f"{where}: outputs")
    _check_axes(made, {output.name for output in chosen}, where)
    formats = tuple(_texts(history_formats, f"{where}: history_formats"))
    for suffix in formats:
        check_format(suffix, f"{where}: history_formats")
    compared = read({} if check is None else check, SweepCheck, f"{where}: check")
    sweep = Sweep(base, made, chosen, frozenset(), formats, compared)
    selected = _select(histories, sweep, f"{where}: histories")
    return dataclasses.replace(sweep, histories=frozenset(selected))


def _check_axes(axes: Sequence[SweepAxis], outputs: set[str], where: str) -> None:
    """Refuses names and keys that stand twice, and sweeps beyond all time."""
    names: set[str] = set()
    keys: set[str] = set()
    for axis in axes:
        at = f"{where}: axes.{axis.name}"
        for column in axis.columns:
            if column.key.name in keys:
                raise InputError(at, column.key.name, "each key on one axis")
            keys.add(column.key.name)
        own = {axis.name} | ({c.key.name for c in axis.columns} if axis.joint else set())
        for name in own:
            if name in names or (axis.joint and axis.name in keys):
                raise InputError(at, name, "a name that no other axis or key has")
            taken = name in OUTPUTS or name in outputs or name in _TAKEN
            if taken or not name.isprintable() or "/" in name:
                raise InputError(at, name, "a name that no output has, without /")
        names |= own
    count = math.prod(len(axis) for axis in axes)
    if count > MOST_CASES:
        raise InputError(f"{where}: axes", f"{count} cases", f"at most {MOST_CASES} cases")


def _outputs(values: Any, where: str) -> list[str | Output]:
    if not isinstance(values, (list, tuple)) or not all(
        isinstance(x, (str, Output)) for x in values
    ):
        raise InputError(where, values, "a list of names")
    return list(values)


def _texts(values: Any, where: str) -> list[str]:
    if not isinstance(values, (list, tuple)) or not all(isinstance(x, str) for x in values):
        raise InputError(where, values, "a list of names")
    return list(values)


def _select(chosen: Any, sweep: Sweep, where: str) -> list[int]:
    """The numbers of the cases whose histories are wanted."""
    if chosen in ("none", "all", None):
        return list(range(len(sweep))) if chosen == "all" else []
    if isinstance(chosen, Mapping):
        return _labelled(chosen, sweep, where)
    if not isinstance(chosen, (list, tuple)):
        raise InputError(where, chosen, "all, none, numbers of cases, or labels along axes")
    for number in chosen:
        if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < len(sweep):
            raise InputError(where, number, f"numbers of cases from 0 to {len(sweep) - 1}")
    return list(chosen)


def _labelled(chosen: Mapping[Any, Any], sweep: Sweep, where: str) -> list[int]:
    axes = {axis.name: axis for axis in sweep.axes}
    wanted: dict[str, set[int]] = {}
    for name, labels in chosen.items():
        if name not in axes:
            raise InputError(f"{where}.{name}", "an unknown axis", ", ".join(axes))
        known = list(axes[name].labels)
        if not isinstance(labels, (list, tuple)) or not labels:
            raise InputError(f"{where}.{name}", labels, "a list of labels")
        for label in labels:
            if label not in known:
                raise InputError(f"{where}.{name}", label, ", ".join(map(str, known)))
        wanted[name] = {known.index(label) for label in labels}
    return [
        case
        for case in range(len(sweep))
        if all(
            axis.name not in wanted or place in wanted[axis.name]
            for axis, place in zip(sweep.axes, sweep.places(case), strict=True)
        )
    ]
