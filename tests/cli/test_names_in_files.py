"""Titles and names that mean something to a figure, a page or a table are shown as they stand."""

from __future__ import annotations

import html
import sys

import numpy as np
import pytest
import yaml

from drake_racket import (
    InputError,
    IntegratorSettings,
    LimbSettings,
    Scenario,
    Stroke,
    cli,
    impact_figure,
    simulate,
)
from drake_racket.io.shipped import data_directory
from drake_racket.plots.log.figures import LOG_FIGURES
from drake_racket.results.formats import read_history, write_history
from tests.limbs.arms import joint, link, robot

COARSE = IntegratorSettings(accuracy=1e-3)
TITLES = (
    r"<script>alert(1)</script> $\frac$ [bold]x[/] {{data}} {{case}} %s",
    "$a_1$ and $b^2$, 5 $ each",
    r"C:\new_{x}^\dollar $",
    "日本 & <b>Schläger</b>",
)


@pytest.fixture(scope="module")
def titled(tmp_path_factory):
    """A racket file with each title."""
    place = tmp_path_factory.mktemp("rackets")
    plain = yaml.safe_load((data_directory() / "tour_low.yaml").read_text())
    files = []
    for i, title in enumerate(TITLES):
        files.append(place / f"r{i}.yaml")
        files[-1].write_text(yaml.safe_dump(plain | {"title": title}, allow_unicode=True))
    return files


@pytest.mark.parametrize(
    "number", [0, *(pytest.param(i, marks=pytest.mark.slow) for i in (1, 2, 3))]
)
def test_titles_in_figures_pages_and_files(titled, tmp_path, monkeypatch, capsys, number):
    def call(*arguments: str) -> str:
        monkeypatch.setattr(sys, "argv", ["drake-racket", *arguments])
        cli.main()
        return str(capsys.readouterr().out)

    out = tmp_path / "Ausgabe für Jürgen"
    call("impact", "--racket", str(titled[number]), "--after", "0.001", "--out", str(out))
    log = str(out / "impact.nc")
    call("plot", log, "--out", str(out / "figures"), "--format", "svg")
    page = out / "page.html"
    call("animate", log, "--out", str(page))
    text = page.read_text(encoding="utf-8")
    title = read_history(log).attrs["title"]
    assert f"<h1>{html.escape(title)}</h1>" in text
    assert "<script>alert" not in text


def test_the_title_is_drawn_as_it_stands(titled):
    scenario = Scenario(racket=str(titled[1]), after=1e-3, integrator=COARSE)
    history = simulate(scenario).history
    figures = [
        impact_figure(history),
        *(f.draw(history) for f in LOG_FIGURES if not f.lacks(history)),
    ]
    for figure in figures:
        figure.canvas.draw()
        shown = figure._suptitle
        parts = shown._preprocess_math(shown.get_text())
        assert parts == (parts[0], False)
        assert parts[0].startswith("Impact of $a_1$ and $b^2$, 5 $ each")


def test_nothing_is_written_when_a_figure_cannot_be_drawn(titled, tmp_path, monkeypatch, capsys):
    import drake_racket.plots

    def stop(history):
        raise RuntimeError("no figure")

    monkeypatch.setattr(drake_racket.plots, "impact_figure", stop)
    out = tmp_path / "out"
    monkeypatch.setattr(
        sys, "argv", ["drake-racket", "impact", "--after", "0.001", "--out", str(out)]
    )
    with pytest.raises(RuntimeError):
        cli.main()
    assert not list(out.glob("*"))


NAMES = ("shoulder, left", "arm/el:bow", "$q_1$", "ellbögen", '"wrist"')


@pytest.fixture(scope="module")
def named(tmp_path_factory):
    """The log of an arm whose joints have such names."""
    path = tmp_path_factory.mktemp("arm") / "arm.urdf"
    parts = [link("base", 0.0)]
    before = "base"
    for i, name in enumerate(NAMES):
        escaped = name.replace('"', "&quot;")
        axis = ("0 1 0", "0 0 1", "1 0 0")[i % 3]
        parts += [link(f"l{i}", 1.0), joint(escaped, before, f"l{i}", axis=axis)]
        before = f"l{i}"
    path.write_text(robot(*parts), encoding="utf-8")
    limb = LimbSettings(
        model=str(path),
        base="base",
        hand=before,
        stroke=Stroke(speed=0.5, velocity_elevation_deg=90.0),
    )
    case = Scenario(support="limb", limb=limb, grip_kind="weld", after=1e-3, integrator=COARSE)
    return simulate(case).history


@pytest.mark.parametrize("suffix", ["nc", "csv", "sto", "parquet"])
def test_joint_names_come_back_from_every_format(named, tmp_path, suffix):
    if suffix == "parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"log.{suffix}"
    write_history(named, path)
    back = read_history(path)
    assert tuple(back.joint.values) == NAMES
    tolerance = 1e-11 if suffix == "csv" else 0.0
    rows = slice(None) if suffix != "sto" else back.sizes["time"] * [True]
    for name in ("joint_position", "joint_torque"):
        if suffix != "sto":
            np.testing.assert_allclose(
                back[name].to_numpy(), named[name].to_numpy()[rows], rtol=tolerance, atol=1e-14
            )


def test_a_spreadsheet_sees_as_many_columns_as_names(named, tmp_path):
    import csv

    write_history(named, tmp_path / "log.csv")
    with (tmp_path / "log.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    assert {len(row) for row in rows} == {len(rows[0])}
    assert f"joint_position_{NAMES[0]} [rad]" in rows[0]


def test_joint_names_in_a_figure(named):
    figure = LOG_FIGURES[-1].draw(named)
    figure.canvas.draw()
    (legend,) = figure.legends
    labels = [text.get_text() for text in legend.get_texts()]
    assert r"\$q 1\$" in labels


def test_a_line_break_in_a_name_is_refused(named, tmp_path):
    odd = named.assign_coords(joint=["a\nb", *NAMES[1:]])
    with pytest.raises(InputError, match="no line break"):
        write_history(odd, tmp_path / "log.csv")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", ["x", "{}", "[1]", 3])
def test_a_broken_list_of_sliding_joints_is_refused(named, tmp_path, text):
    odd = named.copy()
    odd["joint"].attrs["prismatic"] = text
    write_history(odd, tmp_path / "log.nc")
    with pytest.raises(InputError, match="prismatic"):
        read_history(tmp_path / "log.nc")
