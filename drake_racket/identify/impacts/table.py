"""Reads measured impacts: how each was made, and what was measured of it.

One row an impact. A column named as a key of a scenario or a parameter (`speed [m/s]`, `offset_x`,
`support`, `racket.head.mass [g]`) says how it was made; one named as an output (`rebound_speed`,
`rebound_angle`, `contact_time`, `peak_handle_acceleration`) what was measured; one named as an
output with `_sd` its standard deviation in each row. An empty cell of an output: not measured.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_racket.cases.case import resolve
from drake_racket.cases.keys import NUMBER, SWITCH, Key, Value, find_key, with_values
from drake_racket.io.errors import InputError
from drake_racket.io.tables import CsvTable
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.outputs import OUTPUTS, Output

Array = NDArray[np.float64]

MOST_ROWS = 2000
_SD = "_sd"


@dataclass(frozen=True)
class MeasuredImpacts:
    """Measured impacts are scenarios with what was measured of each (r rows, k outputs).

    Attributes:
        where: the file.  sha256: of its bytes.
        scenarios: r of them, checked.  lines: of the file.
        conditions: names of the keys that the table sets.
        outputs: k of them.
        values: (r, k) measured, in the outputs' units; NaN where not measured.
        sigma: (r, k) standard deviations, in the same units; None where the table has none.

    """

    where: str
    sha256: str
    scenarios: tuple[Scenario, ...]
    lines: tuple[int, ...]
    conditions: tuple[str, ...]
    outputs: tuple[Output, ...]
    values: Array
    sigma: Array | None


def read_measured_impacts(path: str | Path, base: Scenario) -> MeasuredImpacts:
    """Reads a table of impacts.

    Args:
        base: what the table does not say.

    Raises:
        InputError: a table that cannot be read; a column that is no key and no output, that says a
            thing twice or is in another unit; a cell that is no number; an impact that is not
            valid; no output; standard deviations of some outputs only, or not above 0; or more
            than one output without standard deviations.

    """
    table = CsvTable.read(path, MOST_ROWS)
    names = [heading.name for heading in table.headings]
    measured = [name for name in names if name in OUTPUTS]
    deviations = [n for n in names if n not in OUTPUTS and n.removesuffix(_SD) in OUTPUTS]
    keys = [_key(table, name, base) for name in names if name not in (*measured, *deviations)]
    if not measured:
        raise InputError(f"{table.where}: header", table.header_text(), _allowed_outputs())
    outputs = tuple(OUTPUTS[name] for name in measured)
    scenarios = _scenarios(table, base, keys)
    for output in outputs:
        for i, scenario in enumerate(scenarios):
            if not output.available(scenario):
                allowed = f"outputs that this impact has (support {scenario.support})"
                raise InputError(table.at(i, output.name), output.name, allowed)
    return MeasuredImpacts(
        where=table.where,
        sha256=table.sha256,
        scenarios=scenarios,
        lines=table.lines,
        conditions=tuple(key.name for key in keys),
        outputs=outputs,
        values=np.stack([_measured(table, o) for o in outputs], axis=1),
        sigma=_deviations(table, outputs, deviations),
    )


def _allowed_outputs() -> str:
    return f"a column of an output: {', '.join(list(OUTPUTS)[:8])}, ..."


def _key(table: CsvTable, name: str, base: Scenario) -> Key:
    try:
        return find_key(name, base, f"{table.where}: header")
    except InputError as error:
        raise InputError(error.key, error.value, f"{error.allowed}, or an output") from None


def _scenarios(table: CsvTable, base: Scenario, keys: list[Key]) -> tuple[Scenario, ...]:
    columns: dict[Key, list[Value]] = {}
    for key in keys:
        if key.kind == NUMBER:
            said = key.name.endswith("_deg") and not _has_unit(table, key.name)  # by the name
            columns[key] = table.numbers(key.name, "1" if said else key.unit).tolist()
        elif key.kind == SWITCH:
            texts = table.texts(key.name)
            for i, text in enumerate(texts):
                if text not in ("true", "false"):
                    raise InputError(table.at(i, key.name), text, "true or false")
            columns[key] = [text == "true" for text in texts]
        else:
            columns[key] = list(table.texts(key.name))
    made = []
    for i, line in enumerate(table.lines):
        values = {key: column[i] for key, column in columns.items()}
        where = f"{table.where}: row {line}"
        made.append(resolve(with_values(base, values, {}), where).scenario)
    return tuple(made)


def _has_unit(table: CsvTable, name: str) -> bool:
    return any(h.name == name and h.unit != "1" for h in table.headings)


def _measured(table: CsvTable, output: Output) -> Array:
    """A column of an output; empty cells are NaN."""
    cells = table.texts(output.name)
    if all(cells):
        return table.numbers(output.name, output.units)
    filled = _filled(table, output.name)
    values = filled.numbers(output.name, output.units)
    values[[not cell for cell in cells]] = math.nan
    return values


def _filled(table: CsvTable, name: str) -> CsvTable:
    """The table with 1 in the empty cells of a column, which are looked at apart."""
    columns = tuple(
        tuple(cell or "1" for cell in column) if heading.name == name else column
        for heading, column in zip(table.headings, table.columns, strict=True)
    )
    return dataclasses.replace(table, columns=columns)


def _deviations(table: CsvTable, outputs: tuple[Output, ...], given: list[str]) -> Array | None:
    wanted = [output.name + _SD for output in outputs]
    missing = [name for name in wanted if name not in given]
    stray = [name for name in given if name not in wanted]
    if stray:
        raise InputError(f"{table.where}: header", stray[0], "the measured output beside it")
    if not given and len(outputs) == 1:
        return None
    if missing:
        allowed = f"a column {missing[0]} (how outputs of different units count beside each other)"
        raise InputError(f"{table.where}: header", table.header_text(), allowed)
    columns = []
    for output in outputs:
        name = output.name + _SD
        values = _filled(table, name).numbers(name, output.units)
        table.check_range(name, values, np.nextafter(0.0, 1.0), math.inf, "above 0")
        columns.append(values)
    return np.stack(columns, axis=1)
