"""What handles and parameters show of themselves: one short line with their name."""

from __future__ import annotations

import dataclasses
import sys
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest
from pydrake.multibody.plant import MultibodyPlant

import drake_racket as dr
from drake_racket.cases.case import SCENARIOS
from drake_racket.io.notebooks import bars
from drake_racket.io.progress import part_of
from drake_racket.plots import new_figure
from drake_racket.sweep import make_sweep

HELD = dr.make_impact_diagram(dr.Scenario(support="grip", grip_kind="torsional", speed=30.0))
IN_LIMB = dr.make_impact_diagram(dr.load_scenario(SCENARIOS[0]))
RACKET = dr.load_racket("tour", "low")
LONG = dr.Scenario(overrides={f"racket.string_bed.stiffness.k{i}": 1e5 for i in range(1, 5)})

SHOWN = [
    (RACKET, "RacketParameters(tour_low: Head LM Prestige (tour), strung at 254 N)"),
    (dr.load_ball(), "BallParameters(penn_titanium: Pro Penn Titanium)"),
    (dr.load_grip("loose"), "GripStiffness(loose: "),
    (dr.load_upper_limb(), "UpperLimbParameters(upper_limb: "),
    (RACKET.handle.mass, f"{RACKET.handle.mass.value} kg (printed)"),
    (dr.load_ball().stiffness_growth, "0.52 (printed)"),
    (dr.load_grip().force_stiffness, "[30000.0, 30000.0, 30000.0] N/m (inferred)"),
    (dr.Scenario(), "Scenario()"),
    (dr.Scenario(support="grip", speed=30.0), "Scenario(support='grip', speed=30.0)"),
    (
        dr.Scenario(integrator=dr.IntegratorSettings(accuracy=0.01)),
        "Scenario(integrator=IntegratorSettings(accuracy=0.01))",
    ),
    (LONG, "Scenario(overrides={'racket.string_bed.stiffness.k1': 100000.0, "),
    (
        dr.Scenario(limb=dr.LimbSettings(stroke=dr.Stroke(speed=12.0))),
        "Scenario(limb=LimbSettings(stroke=Stroke(speed=12.0)))",
    ),
    (HELD.impact.racket, "Racket(racket: tour_low, 9 string masses)"),
    (HELD.impact.ball, "Ball(ball: penn_titanium)"),
    (HELD.grip, "Grip(torsional: "),
    (
        HELD.impact,
        "Impact(Racket(racket: tour_low, 9 string masses), Ball(ball: penn_titanium))",
    ),
    (
        HELD,
        "ImpactDiagram(Scenario(support='grip', grip_kind='torsional', speed=30.0))",
    ),
    (IN_LIMB, "ImpactDiagram(Scenario("),
    (IN_LIMB.limb, "StrikingLimb(Limb(upper_limb: 7 joints, hand frame "),
    (
        make_sweep(dr.Scenario(), {"point": [2, 5, 8], "speed": {"values": [20], "unit": "m/s"}}),
        "Sweep(3 cases: point (3) x speed (1))",
    ),
]


@pytest.mark.parametrize(("thing", "text"), SHOWN, ids=lambda x: type(x).__name__)
def test_one_short_line_with_the_name(thing: object, text: str) -> None:
    line = repr(thing)
    assert line == text if text[-1] in ")" else line.startswith(text)
    assert len(line) <= 120
    assert len(line.splitlines()) == 1
    assert type(thing).__name__ in line or isinstance(thing, dr.Quantity) or line[0] == "["


def test_a_bare_frame_says_so() -> None:
    racket = dr.add_racket(MultibodyPlant(0.0), RACKET, name="mine", strung=False)
    assert repr(racket) == "Racket(mine: tour_low, not strung)"


def test_what_is_too_long_is_cut() -> None:
    long = dataclasses.replace(RACKET, title="x" * 500)
    assert repr(long).endswith("xxx...)")
    assert len(repr(long)) == 120
    many = dataclasses.replace(RACKET.string_bed.stiffness, value=(1e5,) * 100)
    assert repr(many).endswith("...] N/m (printed)")


SWEEP = make_sweep(dr.Scenario(), {"point": [2, 5, 8], "speed": {"values": [20], "unit": "m/s"}})


@pytest.mark.parametrize(
    ("thing", "cells"),
    [
        (RACKET, ["string_bed.initial_tension", "kg*m^2", "Glynn et al. 2011, Table 1", "by_axis"]),
        (dr.Scenario(speed=31.0), ["<td", "speed", "31.0", "changed"]),
        (SWEEP, ["Sweep of 3 cases", "2, 5, 8", "outputs: restitution"]),
        (
            dr.simulate(dr.Scenario(after=0.002), history=False),
            ["Rebound speed", "ended in contact"],
        ),
    ],
    ids=lambda x: type(x).__name__,
)
def test_a_notebook_shows_a_table(thing: object, cells: list[str]) -> None:
    text = thing._repr_html_()  # type: ignore[attr-defined]
    for cell in cells:
        assert cell in text
    parsed = ElementTree.fromstring(text)  # well-formed: nothing of a user's text is markup
    rows = parsed.findall(".//tbody/tr")
    assert len({len(row) for row in rows}) == 1
    assert len(rows) > 1


def test_texts_are_escaped() -> None:
    named = dataclasses.replace(RACKET, title="<b>mine</b> & yours")
    text = named._repr_html_()
    assert text.startswith("<details><summary>")
    assert "&lt;b&gt;mine" in text
    assert "<b>" not in text


def test_a_figure_is_shown_and_not_kept() -> None:
    figure = new_figure(2.0, 1.0)
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_the_rate_is_that_of_this_run() -> None:
    now = dr.Progress("running", 6, 10, before=2, seconds=2.0)
    assert (now.rate(), now.time_left()) == (2.0, 2.0)
    assert dr.Progress("running", 2, 10, before=2, seconds=2.0).time_left() is None
    told: list[dr.Progress] = []
    part_of(told.append, 3, 8)(dr.Progress("section", 1, 2))
    assert (told[0].done, told[0].total) == (4, 8)


def test_a_bar_of_progress(capsys: pytest.CaptureFixture[str]) -> None:
    bar = dr.ProgressBar()
    bar(dr.Progress("running", 1, 4, failed=1, seconds=2.0))
    bar(dr.Progress("running", 4, 4, seconds=8.0))
    shown = capsys.readouterr().err
    assert shown == "\rrunning: 1 of 4, 1 failed, 6 s left\rrunning: 4 of 4\n"


@pytest.mark.parametrize(("config", "moves"), [({"IPKernelApp": {}}, True), ({}, False)])
def test_only_a_notebook_has_bars(
    monkeypatch: pytest.MonkeyPatch, config: dict[str, object], moves: bool
) -> None:
    shell = SimpleNamespace(config=config)
    display = SimpleNamespace(display="display")
    stub = SimpleNamespace(get_ipython=lambda: shell, display=display)
    monkeypatch.setitem(sys.modules, "IPython", stub)
    assert bars._notebook_display() == ("display" if moves else None)


def test_bars_in_a_notebook_move(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []

    class Handle:
        def update(self, bar: object) -> None:
            shown.append("again " + bar._repr_html_())  # type: ignore[attr-defined]

    def display(bar: object, display_id: bool) -> Handle:
        shown.append("first " + bar._repr_html_())  # type: ignore[attr-defined]
        return Handle()

    monkeypatch.setattr(bars, "_notebook_display", lambda: display)
    bar = dr.ProgressBar()
    for task, done in (("checking", 4), ("running", 1), ("running", 2)):
        bar(dr.Progress(task, done, 4))
    assert [text[:6] for text in shown] == ["first ", "first ", "again "]
    assert 'value="2" max="4"' in shown[-1]
