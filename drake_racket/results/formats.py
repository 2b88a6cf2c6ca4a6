"""Writes time histories by suffix, and reads them back into the same labelled Dataset.

| suffix | what it keeps |
|---|---|
| .nc | everything (NetCDF 4) |
| .parquet | everything: metadata of the file, and of each column |
| .sto | everything (OpenSim's storage file): metadata in the header |
| .csv | numbers (12 digits), names and units; no attributes of the file |

A table (.csv, .parquet, .sto) has the column `time` and one column per component, `name` or
`name_label`: `ball_velocity_z`, `string_tension_tip-1`.
"""

from __future__ import annotations

import csv
import importlib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.io.files import replace_file, write_csv, write_netcdf
from drake_racket.io.yaml_files import load_text
from drake_racket.parameters.racket import RacketParameters, check_racket
from drake_racket.results.columns import Layout, dataset_of, layout_of, values_of
from drake_racket.results.history import TIME_ATTRIBUTES, VARIABLE_DIMENSIONS, variable_attributes
from drake_racket.results.log_checks import check_history
from drake_racket.results.sto import read_sto, write_sto

if TYPE_CHECKING:
    import xarray

_METADATA = b"drake_racket_history"  # key of the layout among a Parquet file's metadata


def write_history(dataset: xarray.Dataset, path: str | Path, *, in_degrees: bool = False) -> None:
    """Writes a time history, whole or not at all, in the format of the suffix of `path`.

    A .sto file needs times that increase: of samples at the same time it keeps the last, which is
    the state after the event (touch, release) of that time.

    Args:
        dataset: of `history.make_history`: variables over `time`, and at most one other dimension.
        in_degrees: .sto only: angles and angular velocities in degrees, `inDegrees=yes`.

    Raises:
        InputError: another suffix, pyarrow is missing, or something that the format cannot hold.
        OSError: the file cannot be written.

    """
    path = Path(path)
    check_format(path.suffix.removeprefix("."), str(path))
    if in_degrees and path.suffix != ".sto":
        raise InputError("in_degrees", in_degrees, f"a .sto file, not {path.suffix} (radians)")
    if path.suffix == ".nc":
        write_netcdf(dataset, path)
    elif path.suffix == ".csv":
        _check_csv(dataset)
        write_csv(dataset, path)
    elif path.suffix == ".parquet":
        _write_parquet(dataset, path)
    else:
        write_sto(dataset, path, in_degrees=in_degrees)


def read_history(path: str | Path) -> xarray.Dataset:
    """Reads a file of `write_history`; angles come back in radians.

    A CSV has no place for the attributes of the file (title, scenario, racket): they stay away.

    Raises:
        InputError: unknown suffix, a file that cannot be read, or that holds no history
            (`log_checks`).

    """
    path = Path(path)
    check_format(path.suffix.removeprefix("."), str(path))
    try:
        with path.open("rb") as file:
            file.read(1)
    except (OSError, ValueError) as error:  # ValueError: a name with NUL
        reason = getattr(error, "strerror", None) or "not a file's name"
        raise InputError("history file", path, f"a readable file ({reason})") from None
    dataset: xarray.Dataset = _READERS[path.suffix](path)
    check_history(dataset, str(path))
    return dataset


def racket_of(history: xarray.Dataset, where: str = "history") -> RacketParameters:
    """Gives the racket of a history, from its attribute `racket` (JSON).

    Raises:
        InputError: there is none (as in a CSV), or it is broken.

    """
    text = history.attrs.get("racket")
    if not isinstance(text, str):
        raise InputError(f"{where}: racket", "nothing", "a history with this attribute")
    racket = load_text(text, RacketParameters, where=f"{where}: racket")
    check_racket(racket, f"{where}: racket")
    return racket


def check_format(suffix: str, key: str) -> None:
    """Refuses a format (without the dot) that is unknown, or whose library is missing."""
    if suffix not in FORMATS:
        raise InputError(key, suffix, ", ".join(FORMATS))
    if suffix == "parquet":
        _parquet(key)


def _parquet(key: str = "format") -> Any:
    """pyarrow.parquet, which comes with the extra `parquet`."""
    try:
        return importlib.import_module("pyarrow.parquet")
    except ImportError:
        allowed = "this format with pyarrow installed: pip install 'drake-racket[parquet]'"
        raise InputError(key, "parquet", allowed) from None


# --- NetCDF ---------------------------------------------------------------------------------------


def _read_netcdf(path: Path) -> xarray.Dataset:
    import xarray

    try:
        with xarray.open_dataset(
            path,
            engine="h5netcdf",
            decode_times=False,
            phony_dims="access",  # another program's HDF5 has dimensions without names
        ) as dataset:
            return dataset.load()
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise _unreadable(path, "a NetCDF 4 file", error) from None


def _unreadable(path: Path, kind: str, error: Exception) -> InputError:
    reason = str(error).splitlines() or [type(error).__name__]
    return InputError("history file", path, f"{kind} ({reason[0]})")


# --- CSV ------------------------------------------------------------------------------------------


def _check_csv(dataset: xarray.Dataset) -> None:
    for column in layout_of(dataset).columns():
        if any(character in column.name for character in "\r\n"):
            raise InputError("csv: column", column.name, "no line break in a name")


def _read_csv(path: Path) -> xarray.Dataset:
    try:
        with path.open(encoding="utf-8", newline="") as file:
            header = next(csv.reader(file), [])
            names = [_name_and_unit(cell, path) for cell in header]
            if not names or names[0] != ("time", "s"):
                raise InputError(f"{path}: first column", header[:1], "time [s]")
            rows = [line for line in file if line.strip()]
            if not rows:
                raise InputError(str(path), "no rows", "two or more rows of numbers")
            table = np.loadtxt(rows, delimiter=",", ndmin=2, comments=None)
    except (OSError, ValueError, csv.Error) as error:
        if isinstance(error, InputError):
            raise
        raise _unreadable(path, "a CSV of numbers below one header line", error) from None
    if table.shape[1:] != (len(names),):
        shape = f"{table.shape[1]} numbers in a row"
        raise InputError(str(path), shape, f"{len(names)}, as the header has columns")
    columns = dict(zip((n for n, _ in names), table.T, strict=True))
    if len(columns) < len(names):
        raise InputError(f"{path}: header", f"{len(names)} columns", "columns of different names")
    layout = _layout_of_names(names[1:], path)
    return dataset_of(layout, columns, str(path))


def _name_and_unit(cell: str, path: Path) -> tuple[str, str]:
    name, bracket, unit = cell.rpartition(" [")
    if not bracket or not unit.endswith("]"):
        raise InputError(f"{path}: column", cell, "a name with its unit: normal_force [N]")
    return name, unit[:-1]


def _layout_of_names(names: Iterable[tuple[str, str]], path: Path) -> Layout:
    """Variables, labels and attributes from column names: those of `make_history` are known."""
    found: dict[str, list[str]] = {}
    units: dict[str, str] = {}
    for name, unit in names:
        variable, label = _split(name, path)
        found.setdefault(variable, []).extend([] if label is None else [label])
        if units.setdefault(variable, unit) != unit:
            raise InputError(f"{path}: {name}", unit, f"{units[variable]}, as {variable} has")
    in_world = any(name.startswith("joint_") for name in found)
    layout = Layout(attributes={}, variables={}, coordinates={})
    layout.coordinates["time"] = (None, dict(TIME_ATTRIBUTES))
    for variable, labels in found.items():
        attributes = variable_attributes(variable, in_world=in_world)
        if units[variable] != attributes["units"]:
            raise InputError(f"{path}: {variable}", units[variable], attributes["units"])
        dimension = VARIABLE_DIMENSIONS[variable]
        layout.variables[variable] = (dimension, attributes)
        if dimension is None:
            continue
        known: list[Any] = [int(x) for x in labels] if dimension == "point" else labels
        earlier = layout.coordinates.setdefault(dimension, (known, {}))[0]
        if earlier != known:
            raise InputError(f"{path}: {variable}", labels, f"one column per {dimension}")
    return layout


def _split(name: str, path: Path) -> tuple[str, str | None]:
    """`hand_force_x` -> hand_force, x; `friction_x` -> friction_x, None."""
    if name in VARIABLE_DIMENSIONS and VARIABLE_DIMENSIONS[name] is None:
        return name, None
    vectors = [v for v, d in VARIABLE_DIMENSIONS.items() if d and name.startswith(f"{v}_")]
    for variable in sorted(vectors, key=len, reverse=True):
        label = name[len(variable) + 1 :]
        if VARIABLE_DIMENSIONS[variable] != "point" or label.isdecimal():
            return variable, label
    raise InputError(f"{path}: column", name, "the columns of a history (docs/logs.md)")


# --- Parquet --------------------------------------------------------------------------------------


def _write_parquet(dataset: xarray.Dataset, path: Path) -> None:
    parquet = _parquet()
    arrow = importlib.import_module("pyarrow")
    layout = layout_of(dataset)
    arrays, fields = [], []

    def add(name: str, values: NDArray[np.float64], attributes: dict[str, Any]) -> None:
        arrays.append(arrow.array(np.asarray(values, dtype=float), from_pandas=False))
        about = {k: str(v) for k, v in attributes.items()}
        fields.append(arrow.field(name, arrow.float64(), metadata=about))

    add("time [s]", dataset["time"].to_numpy(), dict(dataset["time"].attrs))
    for column in layout.columns():
        attributes = layout.variables[column.variable][1]
        add(f"{column.name} [{column.units}]", values_of(dataset, column), attributes)
    metadata = {str(k): str(v) for k, v in dataset.attrs.items()}
    schema = arrow.schema(fields, metadata | {_METADATA: layout.to_json()})
    table = arrow.table(arrays, schema=schema)
    replace_file(path, lambda temporary: parquet.write_table(table, temporary))


def _read_parquet(path: Path) -> xarray.Dataset:
    parquet = _parquet()
    arrow = importlib.import_module("pyarrow")
    try:
        table = parquet.read_table(path)
    except (OSError, arrow.ArrowException) as error:
        raise _unreadable(path, "a Parquet file", error) from None
    text = (table.schema.metadata or {}).get(_METADATA)
    if text is None:
        raise InputError(str(path), "Parquet without its metadata", "a history of this package")
    layout = Layout.from_json(text.decode("utf-8"), str(path))
    columns = {n.rpartition(" [")[0]: table[n].to_numpy() for n in table.column_names}
    return dataset_of(layout, columns, str(path))


_READERS: Mapping[str, Callable[[Path], Any]] = {
    ".nc": _read_netcdf,
    ".csv": _read_csv,
    ".parquet": _read_parquet,
    ".sto": read_sto,
}
FORMATS = tuple(suffix.removeprefix(".") for suffix in _READERS)
