"""Joints that slide are in metres, in a history, in every format, and from one to the next."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray

from drake_racket import Stroke, simulate
from drake_racket.results.formats import read_history, write_history
from tests.limbs.arms import arm, joint, link, robot, striking

SLIDE = [
    link("pelvis", 0.0),
    link("chest", 5.0),
    joint("rail", "pelvis", "chest", kind="prismatic", axis="1 0 0", at="0 0 0"),
]


@pytest.fixture(scope="module")
def history(tmp_path_factory):
    path = tmp_path_factory.mktemp("arm") / "arm.urdf"
    path.write_text(robot(*SLIDE, *arm("right", 0.0)))
    stroke = Stroke(speed=2.0, velocity_elevation_deg=90.0, guess_deg={"rail": 0.25})
    return simulate(striking(path, "right_hand", stroke=stroke, after=1e-3)).history


def test_a_history_says_which_joints_slide(history):
    assert json.loads(history["joint"].attrs["prismatic"]) == ["rail"]
    assert float(history["joint_position"].sel(joint="rail")[0]) == pytest.approx(0.25)


def test_degrees_of_a_sto_are_of_angles_alone(history, tmp_path):
    write_history(history, tmp_path / "log.sto", in_degrees=True)
    lines = (tmp_path / "log.sto").read_text().split("endheader\n")[1].splitlines()
    row = dict(zip(lines[0].split("\t"), map(float, lines[1].split("\t")), strict=True))
    first = history.isel(time=0)
    assert row["joint_position_rail"] == float(first["joint_position"].sel(joint="rail"))
    angle = float(first["joint_position"].sel(joint="right_elbow"))
    assert row["joint_position_right_elbow"] == pytest.approx(np.degrees(angle), rel=1e-15)
    back = read_history(tmp_path / "log.sto")
    assert float(back["joint_position"].isel(time=0).sel(joint="right_elbow")) == pytest.approx(
        angle
    )


@pytest.mark.parametrize("suffix", ["nc", "parquet", "sto"])
def test_a_log_that_was_read_is_written_again(history, tmp_path, suffix):
    """From NetCDF to each format and back: what a file gives is a history like any other."""
    if suffix == "parquet":
        pytest.importorskip("pyarrow")
    write_history(history, tmp_path / "first.nc")
    read = read_history(tmp_path / "first.nc")
    write_history(read, tmp_path / f"second.{suffix}")
    again = read_history(tmp_path / f"second.{suffix}")
    assert json.loads(again["joint"].attrs["prismatic"]) == ["rail"]
    kept = read.isel(time=np.append(np.diff(read["time"]) > 0.0, True)) if suffix == "sto" else read
    xarray.testing.assert_equal(again[list(read.data_vars)], kept)
    assert json.loads(again.attrs["scenario"]) == json.loads(history.attrs["scenario"])
