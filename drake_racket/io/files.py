"""Writes data and figures, each file whole or not at all."""

from __future__ import annotations

import csv
import importlib
import io
import os
import re
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError

if TYPE_CHECKING:
    import xarray


def check_directory(path: str | Path, key: str) -> None:
    """Refuses a directory that cannot be made or written, before any work is done for it.

    Raises:
        InputError: naming `key`, the option or argument that gave the path.

    """
    path = Path(path)
    try:
        parent = path
        while not parent.exists() and parent != parent.parent:
            parent = parent.parent
        with tempfile.TemporaryDirectory(dir=parent):  # permissions alone do not tell, as root
            pass
    except OSError as error:
        raise directory_error(path, error, key) from None


def directory_error(path: Path, error: OSError, key: str) -> InputError:
    """Tells what to raise when writing below `path` failed."""
    reason = error.strerror or type(error).__name__
    return InputError(key, str(path), f"a directory that can be written ({reason})")


def replace_file(path: str | Path, write: Callable[[Path], Any]) -> None:
    """Calls `write` with a temporary name beside `path` (same suffix), then renames."""
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    try:
        write(temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def meant_for(path: Path) -> Path:
    """Tells what a file under a temporary name of `replace_file` was to become.

    Other paths as they are.

    A process that is killed leaves such a file.
    """
    found = _TEMPORARY.fullmatch(path.name)
    return path.with_name(found["stem"] + found["suffix"]) if found else path


_TEMPORARY = re.compile(r"\.(?P<stem>.+)\.[0-9]+\.tmp(?P<suffix>\.[^.]+|)")


def write_text(text: str, path: str | Path) -> None:
    """Writes text as UTF-8, whole or not at all; raises OSError."""
    path = Path(path)
    replace_file(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def write_netcdf(dataset: xarray.Dataset, path: str | Path) -> None:
    """Writes a dataset as NetCDF 4."""
    path = Path(path)
    content = netcdf_bytes(dataset)
    replace_file(path, lambda temporary: temporary.write_bytes(content))


def netcdf_bytes(dataset: xarray.Dataset) -> bytes:
    """Gives a dataset as the bytes of a NetCDF 4 file."""
    from xarray.backends import H5NetCDFStore

    h5netcdf: Any = importlib.import_module("h5netcdf")  # it comes without hints
    # made in memory: HDF5 crashes the process later if the disk fills up under it
    content = io.BytesIO()
    with h5netcdf.File(content, "w") as file:
        dataset.dump_to_store(H5NetCDFStore(file))
    return content.getvalue()


def read_netcdf(content: bytes) -> xarray.Dataset:
    """Gives the dataset of such bytes."""
    import xarray

    return xarray.load_dataset(io.BytesIO(content), engine="h5netcdf")


def write_csv(dataset: xarray.Dataset, path: str | Path) -> None:
    """Writes a time history as CSV; columns `name [unit]` or `name_part [unit]`."""
    path = Path(path)
    columns: dict[str, NDArray[np.float64]] = {"time [s]": dataset["time"].to_numpy()}
    for name, variable in dataset.data_vars.items():
        units = variable.attrs["units"]
        if variable.ndim == 1:
            columns[f"{name} [{units}]"] = variable.to_numpy()
            continue
        for label in dataset[variable.dims[1]].to_numpy():
            part = variable.sel({variable.dims[1]: label})
            columns[f"{name}_{label} [{units}]"] = part.to_numpy()
    header = io.StringIO()
    csv.writer(header, lineterminator="\n").writerow(columns)  # quotes a name with a comma
    table = np.column_stack(list(columns.values()))

    def write(temporary: Path) -> None:
        with temporary.open("w", encoding="utf-8", newline="\n") as file:
            file.write(header.getvalue())
            np.savetxt(file, table, delimiter=",", fmt="%.12g")

    replace_file(path, write)


def write_table(dataset: xarray.Dataset, path: str | Path) -> None:
    """Writes a dataset of cases as CSV, one row per case; columns `name [unit]`.

    Every variable must have the same dimensions; the coordinates come first.
    """
    path = Path(path)
    units = {str(n): str(v.attrs.get("units", "")) for n, v in dataset.variables.items()}
    frame = dataset.to_dataframe().reset_index()
    frame.columns = [f"{n} [{units[n]}]" if units.get(n) else n for n in map(str, frame.columns)]
    replace_file(path, lambda temporary: frame.to_csv(temporary, index=False))


def write_figure(figure: Any, path: str | Path) -> None:
    """Writes a figure; the suffix of `path` gives the format."""
    path = Path(path)
    content = figure_bytes(figure, path.suffix)
    replace_file(path, lambda temporary: temporary.write_bytes(content))


def figure_bytes(figure: Any, suffix: str) -> bytes:
    """Gives a figure as the bytes of a file with that suffix.

    A letter that the font lacks (of another script, in a name) is drawn as a box, without a word.
    """
    content = io.BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        figure.savefig(content, format=suffix.removeprefix("."), dpi=150)
    return content.getvalue()
