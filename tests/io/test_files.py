"""Files are written whole or not at all."""

from __future__ import annotations

import gc
import multiprocessing
import resource
from pathlib import Path

import numpy as np
import pytest
import xarray

from drake_racket.io.files import meant_for, write_netcdf


def write_on_a_full_disk(path: Path) -> None:
    """In a process of its own: the limit is the process's, and HDF5 may bring it down."""
    data = xarray.Dataset({"a": ("x", np.arange(4000.0))})
    resource.setrlimit(resource.RLIMIT_FSIZE, (5000, resource.RLIM_INFINITY))
    with pytest.raises(OSError, match="File too large"):
        write_netcdf(data, path)
    gc.collect()


def test_a_file_that_finds_no_room_is_an_error_and_no_crash(tmp_path):
    process = multiprocessing.get_context("fork").Process(
        target=write_on_a_full_disk, args=(tmp_path / "a.nc",)
    )
    process.start()
    process.join(60.0)
    assert process.exitcode == 0
    assert not list(tmp_path.iterdir())


def test_netcdf_keeps_names_units_and_texts(tmp_path):
    data = xarray.Dataset(
        {
            "force": ("time", np.array([0.0, 1.5]), {"units": "N"}),
            "why": ("case", np.array(["", "häufig"], dtype=object)),
            "sweep": ((), "{}"),
        },
        coords={"time": ("time", [0.0, 0.1], {"units": "s"}), "label": ("case", ["a", "b"])},
        attrs={"title": "t", "speeds": [18.0, 33.0]},
    )
    write_netcdf(data, tmp_path / "a.nc")
    found = xarray.load_dataset(tmp_path / "a.nc", engine="h5netcdf")
    xarray.testing.assert_equal(found, data)
    assert found["force"].attrs == {"units": "N"}
    assert found["time"].attrs == {"units": "s"}
    assert list(found.attrs["speeds"]) == [18.0, 33.0]


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        (".case_000001.123.tmp.nc", "case_000001.nc"),
        (".sweep.9.tmp.json", "sweep.json"),
        (".a.b.77.tmp.csv", "a.b.csv"),
        (".a.77.tmp", "a"),
        ("a.77.tmp.csv", "a.77.tmp.csv"),
        (".a.x7.tmp.csv", ".a.x7.tmp.csv"),
        (".hidden", ".hidden"),
    ],
)
def test_temporary_names_are_known(name, meant):
    assert meant_for(Path("d") / name) == Path("d") / meant
