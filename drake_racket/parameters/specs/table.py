"""Reads a table (CSV) of many rackets, one a row, whose columns are known by name and unit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from drake_racket.io.csv_numbers import to_number
from drake_racket.io.errors import InputError
from drake_racket.io.tables import CsvTable, Heading
from drake_racket.io.units import converted_to
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.specs.build import build
from drake_racket.parameters.specs.given import PRINTED, read_specs

MOST_ROWS = 5000

COLUMNS: Mapping[str, tuple[str, ...]] = {
    "name": ("name", "racket", "racquet", "model"),
    "mass": ("mass", "weight", "strung_mass", "strung_weight"),
    "balance": ("balance", "balance_point", "strung_balance"),
    "swingweight": ("swingweight", "swing_weight", "sw"),
    "twistweight": ("twistweight", "twist_weight", "tw"),
    "head": ("head", "head_size", "head_area", "headsize"),
    "length": ("length",),
    "ra": ("ra", "stiffness", "flex", "flex_rating", "ra_(stiffness)"),
    "frequency": ("frequency", "vibration_frequency", "vibration"),
    "tension": ("tension", "string_tension"),
    "pattern": ("pattern", "string_pattern"),
}
"""What is read -> the names of its column, in small letters with _ for blanks."""


def rackets_from_table(
    path: str | Path, columns: Mapping[str, str] | None = None, bed: str = ""
) -> list[RacketParameters]:
    """Makes a racket of every row; all of them are checked before any is returned.

    Args:
        path: of the CSV, whose columns are named `mass [g]`, `Swing Weight`, ...
        columns: names of the file's own for some of `COLUMNS`.
        bed: as `racket_from_specs`.

    Raises:
        InputError: naming the row, the key, the value and what is allowed.

    """
    path = Path(path)
    table = CsvTable.read(path, MOST_ROWS)
    at = _find_columns(table, dict(columns or {}))
    rackets, seen = [], dict[str, int]()
    for row in range(len(table.lines)):
        where = f"{table.where}: row {table.lines[row]}, "
        cells = {key: table.columns[column][row] for key, column in at.items()}
        title = cells.pop("name")
        name = identifier(title)
        if name in seen:
            raise InputError(f"{where}name", title, f"another name than that of row {seen[name]}")
        seen[name] = table.lines[row]
        given = {key: _with_unit(table, cells[key], at[key]) for key in cells if key in PRINTED}
        tension = _with_unit(table, cells["tension"], at["tension"]) if "tension" in at else None
        specs = read_specs(
            name,
            given,
            title=title,
            tension=tension,
            pattern=cells.get("pattern"),
            bed=bed,
            where=where,
        )
        rackets.append(build(specs, where))
    return rackets


def identifier(title: str) -> str:
    """Makes a name (letters, digits and _) of a title: `Pure Drive 107` is `pure_drive_107`."""
    name = "_".join(re.findall(r"[a-z0-9]+", title.casefold()))
    return name if name[:1].isalpha() else f"racket_{name}".rstrip("_")


def _find_columns(table: CsvTable, columns: dict[str, str]) -> dict[str, int]:
    for key in columns:
        if key not in COLUMNS:
            raise InputError("column", key, ", ".join(COLUMNS))
    found: dict[str, int] = {}
    for key, names in COLUMNS.items():
        wanted = ["_".join(columns[key].casefold().split())] if key in columns else names
        matching = [i for i, heading in enumerate(table.headings) if heading.name in wanted]
        if len(matching) > 1:
            texts = ", ".join(table.headings[i].text for i in matching)
            raise InputError(f"{table.where}: header", texts, f"one column for the {key}")
        if matching:
            _check_unit(table, key, table.headings[matching[0]])
            found[key] = matching[0]
        elif key in ("name", "mass", "balance", "swingweight", "head") or key in columns:
            allowed = f"a column {columns.get(key, key)} (or --column {key}=...)"
            raise InputError(f"{table.where}: header", table.header_text(), allowed)
    return found


def _check_unit(table: CsvTable, key: str, heading: Heading) -> None:
    """Refuses a column in a unit that is no multiple of the number's."""
    unit = "N" if key == "tension" else PRINTED[key].unit if key in PRINTED else ""
    if heading.unit != "1" and unit and converted_to(1.0, heading.unit, unit) is None:
        raise InputError(f"{table.where}: header", heading.text, f"a multiple of {unit}")


def _with_unit(table: CsvTable, cell: str, column: int) -> str:
    """The cell with its column's unit behind it, unless it has one."""
    number, unit = to_number(cell, table.decimal), table.headings[column].unit
    if number != number:  # no number: it has its own unit, or is refused as it is
        return cell
    return f"{number!r} {unit}" if unit != "1" else f"{number!r}"
