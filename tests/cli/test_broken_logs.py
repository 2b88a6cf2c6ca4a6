"""Logs as a full disk, another program or a careless hand leaves them: one line, nothing written.

Whatever the format, `plot` and `animate` say what is wrong before they write anything.
"""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray

from drake_racket import IntegratorSettings, Scenario, cli, simulate
from drake_racket.results.formats import FORMATS, read_history, write_history

COMMANDS = {"plot": "figures", "animate": "page.html"}


@pytest.fixture(scope="module")
def history():
    coarse = IntegratorSettings(accuracy=1e-3)
    return simulate(Scenario(support="grip", after=1e-3, integrator=coarse)).history


@pytest.fixture(scope="module")
def files(history, tmp_path_factory) -> dict[str, bytes]:
    """The log in each format."""
    place = tmp_path_factory.mktemp("whole")
    found = {}
    for suffix in FORMATS:
        if suffix == "parquet":
            pytest.importorskip("pyarrow")
        write_history(history, place / f"log.{suffix}")
        found[suffix] = (place / f"log.{suffix}").read_bytes()
    return found


@pytest.fixture
def refused(monkeypatch, capfd, tmp_path) -> Callable[..., str]:
    """Calls both commands, or some, on a log; returns a line for each, as the process prints it."""

    def call(log: Path, *commands: str) -> list[str]:
        return [one(log, command) for command in commands or COMMANDS]

    def one(log: Path, command: str) -> str:
        out = tmp_path / "new" / COMMANDS[command]
        monkeypatch.setattr(sys, "argv", ["drake-racket", command, str(log), "--out", str(out)])
        warnings.simplefilter("error")  # pytest puts the filters back
        with pytest.raises(SystemExit) as stop:
            cli.main()
        text, error = capfd.readouterr()
        assert (stop.value.code, text, error.count("\n")) == (2, "", 1), error
        assert not out.parent.exists()
        return error

    return call


def changed(history: xarray.Dataset, name: str, change: Callable[[np.ndarray], None]):
    new = history.copy(deep=True)
    change(new[name].values)
    return new


def put(value: float, at: object = ...) -> Callable[[np.ndarray], None]:
    def change(values: np.ndarray) -> None:
        values[at] = value

    return change


def times(history: xarray.Dataset, change: Callable[[np.ndarray], None]) -> xarray.Dataset:
    values = history["time"].to_numpy().copy()
    change(values)
    return history.assign_coords(time=("time", values, history["time"].attrs))


def as_text(history: xarray.Dataset, name: str) -> xarray.Dataset:
    texts = ["x"] * history.sizes["time"]
    return history.assign({name: ("time", texts, history[name].attrs)})


def with_scenario(history: xarray.Dataset, **changes: object) -> xarray.Dataset:
    scenario = json.loads(history.attrs["scenario"]) | changes
    return history.assign_attrs(scenario=json.dumps(scenario))


DAMAGED: dict[str, tuple[Callable[[xarray.Dataset], xarray.Dataset], str]] = {
    "a time that is nan": (lambda h: times(h, put(np.nan, 3)), "finite times"),
    "times in reverse": (lambda h: h.isel(time=slice(None, None, -1)), "times in order"),
    "one time only": (lambda h: h.isel(time=[3, 3, 3]), "finite times"),
    "one sample": (lambda h: h.isel(time=[0]), "1 samples"),
    "no sample": (lambda h: h.isel(time=[]), "0 samples"),
    "no units": (lambda h: h.drop_attrs(), "seconds"),
    "no force": (lambda h: h.drop_vars("normal_force"), "normal_force"),
    "no deflections": (lambda h: h.drop_vars("string_deflection"), "string_deflection"),
    "no axes": (lambda h: h.drop_vars("axis"), "axis"),
    "two axes": (lambda h: h.isel(axis=[0, 1]), "axis"),
    "three parts of a quaternion": (lambda h: h.isel(quaternion=[0, 1, 2]), "quaternion"),
    "another dimension": (lambda h: h.rename(axis="direction"), "the dimensions"),
    "a force that is text": (lambda h: as_text(h, "normal_force"), "real numbers"),
    "point 12": (lambda h: changed(h, "contact_point", put(12.0)), "contact_point: got 12.0"),
    "point 0": (lambda h: changed(h, "contact_point", put(0.0, -1)), "1 to 9"),
    "point 3.5": (lambda h: changed(h, "contact_point", put(3.5, 2)), "1 to 9"),
    "twice in contact": (lambda h: changed(h, "in_contact", put(2.0, 1)), "0 or 1"),
    "no rotation": (lambda h: changed(h, "handle_quaternion", put(0.0)), "got 'length 0'"),
    "a long rotation": (lambda h: changed(h, "handle_quaternion", put(0.9, 4)), "length 1"),
    "an infinite force": (
        lambda h: changed(h, "normal_force", put(np.inf, 7)), "normal_force: got 'inf in sample 8'",
    ),
    "an infinite acceleration": (
        lambda h: changed(h, "handle_acceleration", put(-np.inf, (7, 1))), "inf in sample 8",
    ),
    **{
        f"nan in {name}": (
            lambda h, name=name: changed(h, name, put(np.nan, 5)), f"{name}: got 'nan in sample 6'"
        )
        for name in ("ball_position", "ball_velocity", "string_tension", "energy", "hand_force")
    },
    "a speed that is no number": (lambda h: with_scenario(h, speed="fast"), "scenario"),
    "an infinite speed": (lambda h: with_scenario(h, speed=np.inf), "scenario"),
    "a support that is no name": (lambda h: with_scenario(h, support=3), "scenario"),
    "a scenario that is a list": (lambda h: h.assign_attrs(scenario="[1]"), "scenario"),
    "a scenario that is a number": (lambda h: h.assign_attrs(scenario=3.0), "scenario"),
    "no frequency": (lambda h: h.assign_attrs(frame_in_plane_hz=-1.0), "frequency"),
    "a frequency in words": (lambda h: h.assign_attrs(frame_out_of_plane_hz="x"), "frequency"),
}  # fmt: skip


def one_of_two(names) -> list:
    """Each name with one of the two commands by default, in turns, and with the other if slow."""
    slow = pytest.mark.slow
    return [
        pytest.param(name, command, marks=[slow] if (i + j) % 2 else [])
        for i, name in enumerate(names)
        for j, command in enumerate(COMMANDS)
    ]


@pytest.mark.parametrize(("name", "command"), one_of_two(DAMAGED))
def test_a_damaged_log(history, tmp_path, refused, name, command):
    change, told = DAMAGED[name]
    change(history).to_netcdf(tmp_path / "log.nc", engine="h5netcdf")
    (line,) = refused(tmp_path / "log.nc", command)
    assert told in line


GEOMETRY = {
    "gsc": 0.0,
    "ball_radius": -1.0,
    "spacing": 1e6,
    "rim_semi_axis_x": float("nan"),
    "segments": [["elbow", "wrist"]],
}


@pytest.mark.parametrize("key", GEOMETRY)
def test_lengths_that_no_racket_has(history, tmp_path, refused, key):
    geometry = json.loads(history.attrs["geometry"]) | {key: GEOMETRY[key]}
    log = history.assign_attrs(geometry=json.dumps(geometry))
    write_history(log, tmp_path / "log.nc")
    (line,) = refused(tmp_path / "log.nc", "animate")
    assert f"geometry, {key}" in line


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_that_was_cut_off(files, tmp_path, refused, suffix):
    path, whole = tmp_path / f"log.{suffix}", files[suffix]
    for share in (0.0, 0.02, 0.3, 0.7, 0.97):
        path.write_bytes(whole[: int(share * len(whole))])
        if suffix == "csv" and share:  # not at the end of a line, where it is a shorter log
            path.write_bytes(whole[: whole.index(b"\n", int(share * len(whole))) - 30])
        assert all(path.name in line for line in refused(path))


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_of_another_format(files, tmp_path, refused, suffix):
    path = tmp_path / f"log.{suffix}"
    for other in FORMATS:
        if other != suffix:
            path.write_bytes(files[other])
            assert all(path.name in line for line in refused(path))


def foreign_netcdf(path: Path) -> None:
    times = ("time", [0.0, 1.0, 2.0], {"units": "s"})
    xarray.Dataset({"u": (("time", "x", "y"), np.ones((3, 2, 2)))}, {"time": times}).to_netcdf(
        path, engine="h5netcdf"
    )


def foreign_hdf5(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file["scope/channel_1"] = np.ones(3)
        file["settings"] = np.array([(1, 2.0)], dtype=[("gain", "i4"), ("rate", "f8")])


def foreign_parquet(path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    pandas.DataFrame({"time [s]": [0.0, 1.0], "force [N]": [0.0, 1.0]}).to_parquet(path)


FOREIGN: dict[str, tuple[str, Callable[[Path], object]]] = {
    "a map": ("log.nc", foreign_netcdf),
    "an oscilloscope's HDF5": ("log.nc", foreign_hdf5),
    "a data frame": ("log.parquet", foreign_parquet),
    "a signal": ("log.csv", lambda p: p.write_text("time [s],force [N]\n0,1\n1,2\n")),
    "names without units": ("log.csv", lambda p: p.write_text("time,normal_force\n0,1\n1,2\n")),
    "a header": ("log.csv", lambda p: p.write_text("time [s],normal_force [N]\n")),
    "UTF-16": ("log.csv", lambda p: p.write_text("time [s],normal_force [N]\n0,1\n", "utf-16")),
    "motion of OpenSim": (
        "log.sto", lambda p: p.write_text("Coordinates\nnRows=1\nendheader\ntime\tx\n0\t1\n")
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FOREIGN)
def test_a_file_of_another_program(tmp_path, refused, name):
    file, make = FOREIGN[name]
    make(tmp_path / file)
    assert all(file in line for line in refused(tmp_path / file))


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ("nan", "finite times"),
        ("OVL", "could not convert string 'OVL'"),
        ("1,2", "columns"),
        ("", "could not convert string ''"),
    ],
)
def test_a_csv_with_another_time(files, tmp_path, refused, row, told):
    lines = files["csv"].decode().splitlines()
    lines[4] = row + lines[4][lines[4].index(",") :]
    (tmp_path / "log.csv").write_text("\n".join(lines))
    assert all(told in line for line in refused(tmp_path / "log.csv"))


def parquet_changes() -> dict[str, Callable[..., object]]:
    def replaced(table, values):
        import pyarrow

        return table.set_column(2, table.column_names[2], pyarrow.array(values))

    return {
        "a column dropped": lambda t: t.drop_columns([t.column_names[3]]),
        "text": lambda t: replaced(t, ["x"] * t.num_rows),
        "lists": lambda t: replaced(t, [[1.0, 2.0]] * t.num_rows),
        "missing values": lambda t: replaced(t, [None] * (t.num_rows - 1) + [1.0]),
        "a column twice": lambda t: t.append_column(t.column_names[2], t.column(2)),
    }


@pytest.mark.parametrize("name", parquet_changes())
def test_a_parquet_file_with_other_columns(files, tmp_path, refused, name):
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "log.parquet"
    path.write_bytes(files["parquet"])
    table = parquet.read_table(path)
    metadata = table.schema.metadata
    table = parquet_changes()[name](table).replace_schema_metadata(metadata)
    parquet.write_table(table, path)
    assert all(path.name in line for line in refused(path))


def test_labels_that_the_metadata_does_not_have(history, tmp_path, refused):
    for suffix in ("parquet", "sto"):
        path = tmp_path / f"log.{suffix}"
        write_history(history.drop_vars("spring"), path)
        assert all("spring" in line for line in refused(path))


def test_what_a_discrete_plant_does_not_have_is_read(history, tmp_path):
    without = history.copy(deep=True)
    without["handle_acceleration"].values[:] = np.nan
    for suffix in ("nc", "csv", "parquet"):
        write_history(without, tmp_path / f"log.{suffix}")
        back = read_history(tmp_path / f"log.{suffix}")
        assert np.isnan(back["handle_acceleration"].to_numpy()).all()
