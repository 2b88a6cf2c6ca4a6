"""Histories as files: what comes back, what other readers see, and what is refused."""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_racket import InputError, Scenario, cli, simulate, simulation
from drake_racket.results.formats import FORMATS, racket_of, read_history, write_history
from drake_racket.results.history import VARIABLE_DIMENSIONS

CASE = Scenario(
    support="grip", racket="recreational", tension="300", point="4", incidence_deg=25.0, after=0.005
)


@pytest.fixture(scope="module")
def result():
    """One oblique impact on a racket in a hand."""
    return simulate(CASE)


@pytest.fixture(scope="module")
def history(result):
    return result.history


@pytest.fixture
def small():
    """Three samples with joints, one of them sliding; the second time is repeated."""
    values = np.array([[0.1, -0.2, 0.3], [math.pi, 2.0, 1e-300], [0.4, 3.0, -1.5], [0.5, 4.0, 2.0]])
    angle = {"units": "rad", "long_name": "angle of the limb's joints"}
    joints = ["elbow flexion", "rail", "elbow_flexion"]
    return xarray.Dataset(
        {
            "joint_position": (("time", "joint"), values, angle),
            "normal_force": ("time", values[:, 2], {"units": "N", "long_name": "a = b"}),
        },
        {
            "time": ("time", [-1e-3, 0.0, 0.0, 4.2e-3], {"units": "s", "long_name": "time"}),
            "joint": ("joint", joints, {"prismatic": '["rail"]'}),
        },
        {"title": "A title = with\na line break", "frame_in_plane_hz": 154.6},
    )


def parse_storage(path):
    """OpenSim's documented layout, read without the package: header, labels, table."""
    lines = path.read_text(encoding="utf-8").split("\n")
    end = lines.index("endheader")
    header = dict(line.split("=", 1) for line in lines[1:end] if "=" in line)
    labels = lines[end + 1].split("\t")
    rows = [[float(cell) for cell in line.split("\t")] for line in lines[end + 2 : -1]]
    assert lines[-1] == ""
    return header, labels, np.array(rows)


# --- round trips ----------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", ["nc", "parquet", "sto"])
def test_everything_comes_back(history, tmp_path, suffix):
    if suffix == "parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"log.{suffix}"
    write_history(history, path)
    back = read_history(path)
    xarray.testing.assert_identical(back, history)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    # and what was read can be written again, in another format
    write_history(back, tmp_path / "again.sto")
    xarray.testing.assert_identical(read_history(tmp_path / "again.sto"), history)


def test_csv_keeps_twelve_digits_names_and_units(history, tmp_path):
    path = tmp_path / "log.csv"
    write_history(history, path)
    back = read_history(path)
    assert back.attrs == {}
    assert list(back.data_vars) == list(history.data_vars)
    for name, variable in history.variables.items():
        assert back[name].dims == variable.dims, name
        if name in VARIABLE_DIMENSIONS or name == "time":
            assert back[name].attrs == variable.attrs, name
            np.testing.assert_allclose(back[name], variable, rtol=1e-11, atol=0.0)
        else:
            assert back[name].to_numpy().tolist() == variable.to_numpy().tolist()


def test_the_racket_is_that_of_the_scenario(history, tmp_path):
    path = tmp_path / "log.sto"
    write_history(history, path)
    assert racket_of(read_history(path)) == CASE.load_racket()
    with pytest.raises(InputError, match="racket"):
        racket_of(history.assign_attrs(racket='{"name": "x"}'))


def test_the_racket_of_a_diagram_that_was_built_for_another_tension():
    from drake_racket import make_impact_diagram

    low = Scenario(after=5e-4, audit=False)
    high = dataclasses.replace(low, tension="high")
    log = simulate(high, make_impact_diagram(low)).history
    assert racket_of(log) == high.load_racket()
    assert "311 N" in log.attrs["title"]
    assert log["string_tension"][0].to_numpy() == pytest.approx(772.9)


def test_frequencies_are_the_frames():
    # docs/model.md: closed form of two hinged bodies, tour racket, labels read by axis
    log = simulate(Scenario(after=2e-4, audit=False)).history
    assert log.attrs["frame_in_plane_hz"] == pytest.approx(154.6, abs=0.05)
    assert log.attrs["frame_out_of_plane_hz"] == pytest.approx(128.5, abs=0.05)


# --- OpenSim --------------------------------------------------------------------------------------


@pytest.mark.parametrize("in_degrees", [False, True])
def test_storage_layout(small, tmp_path, in_degrees):
    path = tmp_path / "log.sto"
    write_history(small, path, in_degrees=in_degrees)
    header, labels, table = parse_storage(path)
    assert header["version"] == "1"
    assert header["inDegrees"] == ("yes" if in_degrees else "no")
    # of the two samples at the same time the last is kept
    assert (
        (header["nRows"], header["nColumns"]) == ("3", "5") == (str(len(table)), str(len(labels)))
    )
    # no blanks, and no name twice
    start = "joint_position_"
    assert labels[:3] == ["time", f"{start}elbow_flexion", f"{start}rail"]
    assert labels[3:] == [f"{start}elbow_flexion_2", "normal_force"]
    assert table[:, 0].tolist() == [-1e-3, 0.0, 4.2e-3]
    turn = 180.0 / math.pi if in_degrees else 1.0
    assert table[:, 1] == pytest.approx([0.1 * turn, 0.4 * turn, 0.5 * turn])
    assert table[:, 2].tolist() == [-0.2, 3.0, 4.0]  # m: a rail does not turn
    assert table[:, 4].tolist() == [0.3, -1.5, 2.0]
    # OpenSim takes what is before the last = as a key
    metadata = next(k for k in header if k.startswith("drake_racket_history"))
    assert metadata == "drake_racket_history"
    assert "=" not in header[metadata]


@pytest.mark.parametrize("in_degrees", [False, True])
def test_storage_comes_back_in_radians(small, tmp_path, in_degrees):
    path = tmp_path / "log.sto"
    write_history(small, path, in_degrees=in_degrees)
    back = read_history(path)
    expected = small.isel(time=[0, 2, 3])
    xarray.testing.assert_allclose(back, expected, rtol=1e-15, atol=0.0)
    assert back.attrs == small.attrs
    assert back["joint"].to_numpy().tolist() == small["joint"].to_numpy().tolist()


def test_a_discrete_plants_accelerations_are_left_out_of_storage(history, tmp_path):
    without = history.copy()
    without["handle_acceleration"] = history["handle_acceleration"] * np.nan
    without["handle_acceleration"].attrs = history["handle_acceleration"].attrs
    path = tmp_path / "log.sto"
    write_history(without, path)
    _, labels, table = parse_storage(path)
    assert not [label for label in labels if label.startswith("handle_acceleration")]
    assert np.isfinite(table).all()  # OpenSim's Storage stops at a nan, without a word
    xarray.testing.assert_identical(read_history(path), without)


@pytest.mark.parametrize("in_degrees", [False, True])
def test_opensim_reads_it(history, tmp_path, monkeypatch, in_degrees):
    monkeypatch.chdir(tmp_path)  # OpenSim writes opensim.log where it is imported
    opensim = pytest.importorskip("opensim")
    path = tmp_path / "log.sto"
    write_history(history, path, in_degrees=in_degrees)
    _, labels, numbers = parse_storage(path)
    turn = 180.0 / math.pi if in_degrees else 1.0

    table = opensim.TimeSeriesTable(str(path))  # by way of STOFileAdapter
    assert table.getTableMetaDataString("inDegrees") == ("yes" if in_degrees else "no")
    assert list(table.getColumnLabels()) == labels[1:]
    assert list(table.getIndependentColumn()) == history["time"].to_numpy().tolist()
    angle = table.getDependentColumn("grip_angle_y").to_numpy()
    assert angle == pytest.approx(turn * history["grip_angle"].sel(axis="y").to_numpy(), rel=1e-14)
    force = table.getDependentColumn("normal_force").to_numpy()
    assert force.tolist() == history["normal_force"].to_numpy().tolist()

    storage = opensim.Storage(str(path))  # the older reader, of the GUI and the tools
    assert storage.isInDegrees() == in_degrees
    assert storage.getSize() == len(numbers)
    names = storage.getColumnLabels()
    assert [names.get(i) for i in range(names.getSize())] == labels
    last = storage.getStateVector(len(numbers) - 1)
    assert last.getTime() == numbers[-1, 0]
    data = last.getData()
    assert [data.get(i) for i in range(data.getSize())] == numbers[-1, 1:].tolist()

    # what OpenSim writes itself is still a history
    opensim.STOFileAdapter.write(table, str(tmp_path / "theirs.sto"))
    theirs = read_history(tmp_path / "theirs.sto")
    xarray.testing.assert_allclose(theirs, history, rtol=1e-12, atol=1e-12)
    assert theirs.attrs == history.attrs


# --- Parquet --------------------------------------------------------------------------------------


def test_parquet_opens_with_units_elsewhere(history, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "log.parquet"
    write_history(history, path)
    table = parquet.read_table(path)
    assert table.column_names[0] == "time [s]"
    field = table.schema.field("hand_force_z [N]")
    assert field.metadata[b"units"] == b"N"
    assert field.metadata[b"frame"] == b"hand"
    scenario = json.loads(table.schema.metadata[b"scenario"])
    assert scenario["incidence_deg"] == 25.0
    for key in (b"title", b"drake_version", b"drake_racket_version", b"source"):
        assert table.schema.metadata[key], key
    frame = table.to_pandas()
    assert frame["string_tension_tip-1 [N]"].to_numpy().tolist() == (
        history["string_tension"].sel(spring="tip-1").to_numpy().tolist()
    )


def test_without_pyarrow(history, small, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    path = tmp_path / "log.parquet"
    for call in (lambda: write_history(small, path), lambda: read_history(path)):
        with pytest.raises(InputError, match=r"drake-racket\[parquet\]"):
            call()
    assert not list(tmp_path.iterdir())


# --- any labels and numbers -----------------------------------------------------------------------

names = st.text(st.characters(codec="utf-8", exclude_characters="\x00"), min_size=1, max_size=8)
finite = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e300, max_value=1e300)


@settings(max_examples=25, deadline=None)
@given(
    labels=st.lists(names, min_size=1, max_size=4, unique=True),
    title=names,
    numbers=st.lists(finite, min_size=2, max_size=5),
)
def test_odd_names_come_back(tmp_path_factory, labels, title, numbers):
    pytest.importorskip("pyarrow")
    values = np.outer(numbers, np.linspace(-1.0, 1.0, len(labels)))
    log = xarray.Dataset(
        {"joint_torque": (("time", "joint"), values, {"units": "N m", "long_name": title})},
        {"time": ("time", np.arange(len(numbers)) * 1e-3, {"units": "s"}), "joint": labels},
        {"title": title},
    )
    out = tmp_path_factory.mktemp("odd")
    for suffix in ("parquet", "sto"):
        path = out / f"log.{suffix}"
        write_history(log, path)
        xarray.testing.assert_identical(read_history(path), log)
    _, columns, table = parse_storage(out / "log.sto")
    assert len(set(columns)) == len(columns) == table.shape[1]
    assert not any(c.isspace() for column in columns for c in column)


# --- what is refused ------------------------------------------------------------------------------


def refused(call):
    """The message of the InputError that `call` raises: one line."""
    with pytest.raises(InputError) as caught:
        call()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_what_a_format_cannot_hold(history, small, tmp_path):
    assert "allowed: nc, csv" in refused(lambda: write_history(small, tmp_path / "log.txt"))
    assert "in_degrees" in refused(lambda: write_history(small, tmp_path / "a.nc", in_degrees=True))
    back = small.isel(time=[1, 0])
    assert "times out of order" in refused(lambda: write_history(back, tmp_path / "log.sto"))
    hole = small.copy(deep=True)
    hole["normal_force"][1] = np.nan
    assert "normal_force" in refused(lambda: write_history(hole, tmp_path / "log.sto"))
    broken = small.assign_coords(joint=["a\nb", "c", "d"])
    assert "no line break" in refused(lambda: write_history(broken, tmp_path / "log.csv"))
    table = history.isel(time=0)
    assert "time" in refused(lambda: write_history(table, tmp_path / "log.sto"))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("content", [b"", b"a,b\n1,2\n", b"\x00\xff\xfe" * 9, b"endheader\n"])
def test_files_that_are_no_history(tmp_path, suffix, content):
    if suffix == "parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"log.{suffix}"
    assert "readable file" in refused(lambda: read_history(path))
    path.write_bytes(content)
    assert f"log.{suffix}" in refused(lambda: read_history(path))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("normal_force [N]", "normal_force [kN]", "allowed: 'N'|allowed: N"),
        ("normal_force [N]", "normal_force", "with its unit"),
        ("normal_force [N]", "my_force [N]", "my_force"),
        ("normal_force [N]", "compression [m]", "different names"),
        ("time [s]", "time [ms]", "time \\[s\\]"),
        ("hand_force_z [N]", "hand_force_w [N]", "one column per axis"),
        ("hand_force_z [N]", "hand_force_z [kN]", "as hand_force has"),
    ],
)
def test_csv_with_a_wrong_column(history, tmp_path, old, new, told):
    path = tmp_path / "log.csv"
    write_history(history.isel(time=slice(0, 4)), path)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=told):
        read_history(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("nRows=3", "nRows=4"),
        ("nColumns=5", "nColumns=6"),
        ("normal_force", "force"),
        ("drake_racket_history=", "other="),
        ('"variables"', '"vraiables"'),
        ("endheader", "enheader"),
        ("\ntime\t", "\nseconds\t"),
        ("drake_racket_left_out=[]", "drake_racket_left_out=7"),
    ],
)
def test_a_damaged_storage_file(small, tmp_path, old, new):
    path = tmp_path / "log.sto"
    write_history(small, path)
    text = path.read_text(encoding="utf-8")
    head, tail = text.split("endheader", 1)
    if old == "normal_force":  # in the line of names only
        text = head + "endheader" + tail.replace(old, new)
    else:
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    refused(lambda: read_history(path))


def test_a_dataset_that_is_no_history(tmp_path):
    path = tmp_path / "map.nc"
    xarray.Dataset({"a": ("x", [1.0, 2.0])}).to_netcdf(path, engine="h5netcdf")
    assert "variables over time" in refused(lambda: read_history(path))
    log = xarray.Dataset({"a": ("time", [1.0, 2.0])}, {"time": [0.0, 1.0]})
    log.to_netcdf(path, engine="h5netcdf")
    assert "seconds" in refused(lambda: read_history(path))


# --- the command line -----------------------------------------------------------------------------


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs cli.main in this process; returns status and standard error."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["drake-racket", *arguments])
        status = 0
        try:
            cli.main()
        except SystemExit as stop:
            status = stop.code
        return status, capsys.readouterr().err

    return call


def test_impact_writes_the_formats_it_is_asked_for(run, tmp_path, monkeypatch, result):
    monkeypatch.setattr(simulation, "simulate", lambda scenario: result)
    out = tmp_path / "out"
    assert run("impact", "--out", str(out), "--format", "sto,nc, sto") == (0, "")
    written = {path.name for path in Path(out).iterdir()}
    assert written == {"impact.sto", "impact.nc", "impact.png", "impact.json"}
    for suffix in ("sto", "nc"):
        xarray.testing.assert_identical(read_history(out / f"impact.{suffix}"), result.history)


@pytest.mark.parametrize("formats", ["xls", "", "nc,,csv"])
def test_impact_refuses_other_formats_before_it_starts(run, tmp_path, monkeypatch, formats):
    monkeypatch.setattr(simulation, "simulate", None)
    out = tmp_path / "out"
    status, error = run("impact", "--out", str(out), "--format", formats)
    assert status == 2
    assert error.startswith("drake-racket: --format: got ")
    assert error.endswith("allowed: nc, csv, parquet, sto\n")
    assert not out.exists()
    status, error = run("impact", "--format", "nc")
    assert (status, error.count("\n")) == (2, 1)
    assert "together with --out" in error
