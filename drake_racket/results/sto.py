"""Writes a time history as OpenSim's storage file (.sto), and reads it.

Header lines up to `endheader`, a line of tab-separated column names, `time` first, then the
numbers (17 digits: exact). OpenSim's readers take `nRows`, `nColumns` and `inDegrees`, keep other
`key=value` lines as metadata and pass over the rest. Angles are in radians (`inDegrees=no`) or in
degrees; everything else is in SI units, whatever the flag says.
"""

from __future__ import annotations

import itertools
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np

from drake_racket.io.errors import InputError, one_line
from drake_racket.io.files import replace_file
from drake_racket.results.columns import Column, Layout, dataset_of, layout_of, values_of

if TYPE_CHECKING:
    import xarray

_METADATA, _LEFT_OUT = "drake_racket_history", "drake_racket_left_out"
_MOST_HEADER_LINES = 10_000


def write_sto(dataset: xarray.Dataset, path: str | Path, *, in_degrees: bool) -> None:
    """Writes a history for OpenSim; see `formats.write_history`."""
    path = Path(path)
    layout = layout_of(dataset)
    time = dataset["time"].to_numpy()
    if not np.isfinite(time).all() or (np.diff(time) < 0.0).any():
        raise InputError(f"{path}: time", "times out of order", "finite times in order")
    columns, left_out = _split_columns(dataset, layout.columns(), path)
    names = _sto_names(columns)
    arrays = [time]
    for column in columns:
        values = values_of(dataset, column)
        arrays.append(np.degrees(values) if in_degrees and column.is_angle else values)
    # OpenSim refuses equal times: the last of them is the state after the event
    table = np.column_stack(arrays)[np.append(np.diff(time) > 0.0, True)]
    angle = "deg" if in_degrees else "rad"
    lines = [
        one_line(str(dataset.attrs.get("title", "Impact"))),
        "version=1",
        f"nRows={len(table)}",
        f"nColumns={len(names) + 1}",
        f"inDegrees={'yes' if in_degrees else 'no'}",
        f"Time in s from first touch. Angles are in {angle}, everything else in SI units.",
        *_variable_lines(layout, in_degrees),
        f"{_LEFT_OUT}={json.dumps(left_out)}",
        # OpenSim takes what is before the last = of a line as its key
        f"{_METADATA}={layout.to_json()}".replace("=", "\\u003d").replace("\\u003d", "=", 1),
        "endheader",
        "\t".join(["time", *names]),
    ]

    def write(temporary: Path) -> None:
        with temporary.open("w", encoding="utf-8", newline="\n") as file:
            file.write("\n".join(lines) + "\n")
            np.savetxt(file, table, delimiter="\t", fmt="%.17g")

    replace_file(path, write)


def _split_columns(
    dataset: xarray.Dataset, columns: list[Column], path: Path
) -> tuple[list[Column], list[str]]:
    """The columns to write, and the names of those without a number.

    OpenSim's older reader stops at the first nan without a word. What a discrete plant does not
    have (accelerations) is nan throughout, and left out.
    """
    kept, left_out = [], []
    for column in columns:
        finite = np.isfinite(values_of(dataset, column))
        if finite.all():
            kept.append(column)
        elif np.isnan(values_of(dataset, column)).all():
            left_out.append(column.name)
        else:
            raise InputError(f"{path}: {column.name}", "not all finite", "finite numbers")
    return kept, left_out


def _variable_lines(layout: Layout, in_degrees: bool) -> list[str]:
    """One line per variable: units, frame, what it is. No `=`, which would make it metadata."""
    lines = []
    for name, (_, attributes) in layout.variables.items():
        units = str(attributes.get("units", "1"))
        parts = [units.replace("rad", "deg") if in_degrees else units]
        if "frame" in attributes:
            parts.append(f"frame {attributes['frame']}")
        parts.append(str(attributes.get("long_name", "")))
        lines.append(one_line(f"{name}: {'; '.join(parts)}").replace("=", " is "))
    return lines


def _sto_names(columns: list[Column]) -> list[str]:
    """Column names without blanks; names that become equal get a number."""
    names: list[str] = []
    for column in columns:
        name = plain = re.sub(r"\s+", "_", column.name)
        n = 1
        while name in names or name == "time":
            n += 1
            name = f"{plain}_{n}"
        names.append(name)
    return names


def read_sto(path: str | Path) -> xarray.Dataset:
    """Reads a history from a .sto file of this package; raises InputError."""
    path = Path(path)
    try:
        with path.open(encoding="utf-8") as file:
            header = _header(file, path)
            names = file.readline().rstrip("\r\n").split("\t")
            table = np.loadtxt(file, delimiter="\t", ndmin=2, comments=None)
            left_out = set(json.loads(header[_LEFT_OUT]))
    except (OSError, ValueError, TypeError) as error:
        if isinstance(error, InputError):
            raise
        allowed = f"tab-separated numbers below endheader ({str(error).splitlines()[0]})"
        raise InputError("history file", path, allowed) from None
    expected = header["nRows"], header["nColumns"], str(len(names))
    if expected != (str(len(table)), str(table.shape[1]), str(table.shape[1])):
        found = f"{len(table)} rows of {table.shape[1]} numbers"
        allowed = f"{expected[0]} of {expected[1]}, and as many names"
        raise InputError(str(path), found, allowed)
    layout = Layout.from_json(header[_METADATA], str(path))
    stored = dict(zip(names, table.T, strict=True))
    columns = [c for c in layout.columns() if c.name not in left_out]
    numbers = {name: np.full(len(table), np.nan) for name in left_out}
    for column, name in zip(columns, _sto_names(columns), strict=True):
        if name not in stored:
            raise InputError(f"{path}: column {name}", "nothing", "the columns its metadata names")
        values = stored[name]
        turned = header["inDegrees"] == "yes" and column.is_angle
        numbers[column.name] = np.radians(values) if turned else values
    if "time" not in stored:
        raise InputError(f"{path}: column time", "nothing", "time as the first column")
    return dataset_of(layout, numbers | {"time": stored["time"]}, str(path))


def _header(file: TextIO, path: Path) -> dict[str, str]:
    """The key=value lines up to endheader."""
    header: dict[str, str] = {}
    for line in itertools.islice(file, _MOST_HEADER_LINES):
        if line.strip() == "endheader":
            break
        key, equals, value = line.rstrip("\r\n").partition("=")
        if equals:
            header[key] = value
    else:
        raise InputError("history file", path, "a .sto file with a header that ends in endheader")
    for key in ("nRows", "nColumns", "inDegrees", _LEFT_OUT, _METADATA):
        if key not in header:
            raise InputError(f"{path}: {key}", "nothing", "the header of a history, as written")
    return header
