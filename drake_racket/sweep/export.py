"""Gives a sweep's results as labelled data and as files that need nothing of this package.

    results.nc       NetCDF 4: one dimension per axis, outputs over all of them
    results.parquet  one row per case (extra `parquet`); units in the fields' metadata
    results.csv      the same rows; columns `name [unit]`
    sweep.json       what was run: base scenario, files with their content, axes, outputs, versions

NetCDF and Parquet carry what is in sweep.json, too: as the variable `sweep`, and as metadata.
"""

from __future__ import annotations

import importlib
import json
from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.io.errors import InputError
from drake_racket.io.extras import has_library
from drake_racket.io.files import replace_file, write_netcdf, write_table, write_text
from drake_racket.io.fingerprint import as_text, difference, digest
from drake_racket.io.units import labelled
from drake_racket.store import StoreReader
from drake_racket.sweep.axes import AxisColumn, SweepAxis
from drake_racket.sweep.check import compare
from drake_racket.sweep.identity import fingerprint
from drake_racket.sweep.spec import Sweep
from drake_racket.sweep.store import case_rows, check_rows, read_sweep

if TYPE_CHECKING:
    import xarray

STATUSES = ("done", "failed", "missing")

OWN_VARIABLES = ("status", "failure", "scenario_hash", "sweep")
"""What a sweep's results have beside outputs and axes."""


def make_dataset(sweep: Sweep, store: StoreReader) -> xarray.Dataset:
    """Labels what the store has, over the axes of the sweep.

    Returns:
        A Dataset with the outputs (NaN where a case failed or has not run), `status` (0 done,
        1 failed, 2 missing), `failure` and `scenario_hash` over all axes, and the scalar `sweep`
        (JSON). Keys that vary together are coordinates along their dimension.

    """
    import xarray

    table = np.full((len(sweep), len(sweep.outputs)), np.nan)
    status = np.full(len(sweep), STATUSES.index("missing"), dtype=np.int8)
    failure = np.full(len(sweep), "", dtype=object)
    said: Counter[str] = Counter()
    for row in case_rows(store):
        table[row.case] = row.values
        status[row.case] = STATUSES.index("failed" if row.failure else "done")
        failure[row.case] = row.failure
        said.update(set(row.warnings))
    identity = dict(store.header)
    hashes = identity.pop("scenario_hashes")
    dimensions = tuple(axis.name for axis in sweep.axes)
    variables: dict[str, Any] = {
        output.name: labelled(
            dimensions, table[:, i].reshape(sweep.shape), output.units, output.long_name
        )
        for i, output in enumerate(sweep.outputs)
    }
    for name, values, units, text in (
        ("status", status, "1", "0 done, 1 failed, 2 missing"),
        ("failure", failure, "", "why a case failed"),
        ("scenario_hash", np.array(hashes, dtype=object), "", "hash of the case's scenario"),
    ):
        attributes = {"units": units, "long_name": text}
        variables[name] = (dimensions, values.reshape(sweep.shape), attributes)
    variables["sweep"] = labelled((), as_text(identity), "", "what was run (JSON)")
    coordinates: dict[str, Any] = {}
    for axis in sweep.axes:
        coordinates |= _coordinates(axis)
    versions = identity["computation"]
    comparison = compare(sweep, list(case_rows(store)), list(check_rows(store)))
    compared = {} if comparison is None else {"comparison": json.dumps(comparison.plain())}
    return xarray.Dataset(
        variables,
        coords=coordinates,
        attrs={
            "title": "Sweep of tennis racket and ball impacts",
            "content_hash": digest(as_text([identity, hashes]).encode()),
            "scenario": as_text(identity["base"]),
            "warnings": json.dumps(dict(sorted(said.items()))),
            "drake_racket_version": versions["drake-racket"],
            "drake_version": versions["drake"],
            "python_version": versions["python"],
            "source": "Glynn, King & Mitchell (2011), doi:10.1007/s12283-010-0056-x",
            **compared,
        },
    )


def _coordinates(axis: SweepAxis) -> dict[str, Any]:
    labels = _array(axis.labels)
    if not axis.joint:
        return {axis.name: (axis.name, labels, _attributes(axis.columns[0]))}
    found = {axis.name: labelled(axis.name, labels, "", "rows of the design")}
    for column in axis.columns:
        attributes = _attributes(column)
        found[column.key.name] = (axis.name, _array(column.values), attributes)
    return found


def _attributes(column: AxisColumn) -> dict[str, str]:
    name = column.key.name
    text = f"factor of {name}" if column.relative else name
    return {"units": column.unit, "long_name": text, "key": name}


def _array(values: Sequence[Any]) -> Any:
    if all(isinstance(x, bool) for x in values):
        return np.array(values)
    if all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in values):
        return np.array(values)
    return np.array([str(x) for x in values])


def export_sweep(sweep: Sweep, directory: str | Path) -> xarray.Dataset:
    """Writes the results' files of what is finished, and returns them; it runs nothing.

    Another process may be running the sweep meanwhile. Whether the package or a parameter file has
    changed since does not matter: what was computed is what is exported.

    Raises:
        InputError: the directory has no sweep, or another one.
        StoreError, OSError: it cannot be read or written.

    """
    directory = Path(directory)
    with closing(read_sweep(directory)) as store:
        wanted = json.loads(as_text(fingerprint(sweep, {})))
        for key in ("axes", "base", "outputs"):
            found = difference(store.header[key], wanted[key], f"{key}.")
            if found is not None:
                name, old, new = found
                raise InputError(f"{directory}: {name}", new, f"{old!r}, as the sweep in there")
        dataset = make_dataset(sweep, store)
    write_results(dataset, directory)
    return dataset


def flat(dataset: xarray.Dataset) -> xarray.Dataset:
    """Gives the same data with one dimension, `case`; what varies becomes variables along it."""
    import xarray

    dimensions = list(dataset["status"].dims)
    shape = dataset["status"].shape
    variables: dict[str, Any] = {}
    for name, variable in [*dataset.coords.items(), *dataset.data_vars.items()]:
        if name == "sweep":
            continue
        axes = [dimensions.index(d) for d in variable.dims]
        spread = [variable.shape[axes.index(i)] if i in axes else 1 for i in range(len(shape))]
        values = np.broadcast_to(variable.to_numpy().reshape(spread), shape).reshape(-1)
        variables[str(name)] = ("case", values, variable.attrs)
    case = labelled("case", np.arange(dataset["status"].size), "", "number")
    return xarray.Dataset(variables, coords={"case": case}, attrs=dataset.attrs)


def result_paths(directory: str | Path) -> list[Path]:
    """Gives the files that `write_results` writes; Parquet if pyarrow is installed."""
    directory = Path(directory)
    names = ["results.nc", "results.csv", "sweep.json"]
    if has_library("pyarrow"):
        names.append("results.parquet")
    return [directory / name for name in names]


def write_results(dataset: xarray.Dataset, directory: str | Path) -> None:
    """Writes the results' files, each whole or not at all."""
    directory = Path(directory)
    cases, identity = flat(dataset), str(dataset["sweep"].item())
    netcdf, csv, described, *parquet = result_paths(directory)
    write_netcdf(dataset, netcdf)
    write_table(cases, csv)
    content = {"content_hash": dataset.attrs["content_hash"]} | json.loads(identity)
    write_text(json.dumps(content, indent=2) + "\n", described)
    for path in parquet:
        _write_parquet(cases, identity, path)


def _write_parquet(cases: xarray.Dataset, identity: str, path: Path) -> None:
    pyarrow: Any = importlib.import_module("pyarrow")  # it comes without hints
    parquet: Any = importlib.import_module("pyarrow.parquet")
    names = [str(name) for name in cases.variables]
    columns = [pyarrow.array(cases[name].to_numpy()) for name in names]
    fields = [
        pyarrow.field(name, column.type, metadata={k: str(v) for k, v in cases[name].attrs.items()})
        for name, column in zip(names, columns, strict=True)
    ]
    metadata = {k: str(v) for k, v in cases.attrs.items()} | {"sweep": identity}
    table = pyarrow.Table.from_arrays(columns, schema=pyarrow.schema(fields, metadata=metadata))
    replace_file(path, lambda temporary: parquet.write_table(table, temporary))
