"""Every figure that the studies write: with a title, no text over another, none cut off."""

from __future__ import annotations

import runpy

import pytest

import drake_racket
from drake_racket.io import files
from tests.conftest import ROOT
from tests.plots.bounds import faults

STUDIES = {
    "force_plate.py": ["--speeds", "18", "33"],
    "frame_modes.py": [],
    "static_stiffness.py": [],
    "inertia_bench.py": [],
    "impact_hammer.py": [],
    "head_clamped.py": ["--speeds", "18", "33"],
    "moving_racket.py": [],
    "upper_limb": [],
    "sweet_spots": ["--quick"],
    "tension_and_power": ["--quick"],
    "frame_stiffness_and_handle_vibration": ["--quick"],
    "what_decides_ball_speed": ["--quick"],
    "where_to_put_ten_grams": ["--quick"],
    "which_racket_for_my_swing": ["--quick"],
    "strings_or_frame_and_the_arm": ["--quick"],
    "how_many_segments": ["--quick"],
}


RUN_ELSEWHERE = ("inertia_bench.py", "moving_racket.py", "head_clamped.py")
"""Studies that other slow tests run, too: their figures are looked at with the exhaustive ones."""


@pytest.mark.parametrize(
    "study",
    [
        pytest.param(
            name, marks=pytest.mark.exhaustive if name in RUN_ELSEWHERE else pytest.mark.slow
        )
        for name in STUDIES
    ],
)
def test_figures_of_a_study(study, tmp_path, monkeypatch, capsys):
    drawn = {}

    def keep(figure, path):
        drawn[path.name] = figure

    monkeypatch.setattr(files, "write_figure", keep)
    monkeypatch.setattr(drake_racket, "write_figure", keep, raising=False)
    monkeypatch.setattr("sys.argv", [study, "--out", str(tmp_path), *STUDIES[study]])
    if study.endswith(".py"):
        runpy.run_path(str(ROOT / "studies" / study), run_name="__main__")
    else:
        runpy.run_module(f"studies.{study}", run_name="__main__")
    assert drawn
    for name, figure in drawn.items():
        assert figure.get_suptitle() or all(axes.get_title() for axes in figure.axes[:1]), name
        assert faults(figure, ignore_inside=True) == [], name
