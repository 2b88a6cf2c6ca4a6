"""What an assessment asks of its impacts, what it makes of them, and what is drawn and written."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import drake_racket as dr
from drake_racket.compare import Swing, assess, assessment, report, spread
from drake_racket.compare.assessment import COARSE, Bench, aims, usual_scenario
from drake_racket.compare.figures import axis_figure, hand_figure, maps_figure
from drake_racket.compare.numbers import NINE, NUMBERS
from drake_racket.io.progress import Progress
from tests.compare.test_compare import MINE, TOUR, made
from tests.plots.drawn import drawn
from tests.recorded import check_record

RECORDS = Path(__file__).parent / "records"


def rackets(count: int) -> list[Any]:
    """Assessments of formulas, the first without spread."""
    found = []
    for i in range(count):
        values = {name: 0.2 + 0.031 * k + 0.011 * i for k, name in enumerate(NINE)}
        values |= {"peak_handle_acceleration": 1500.0 + 100.0 * i, "handle_ringing": 200.0 + 9 * i}
        values |= {"swing_speed_centre": 31.0 - i, "peak_hand_force": 90.0 + i, "mass": 0.3}
        values |= {"peak_hand_torque": 9.0, "swing_best_place": -0.02 * i, "swingweight": 0.032}
        parts = {
            "frequency": {"restitution_5": 0.02, "handle_ringing": 20.0, "restitution_1": 0.0051},
            "string_bed": {"restitution_5": 0.01 * i, "swing_speed_centre": 0.3, "mass": 0.001},
            "twistweight": {"restitution_2": 0.0049},
        }
        one = made(f"racket {i} | of two", parts if i else {}, **values)
        racket = dataclasses.replace(one.nominal.racket, notes=("a note | of it",))
        if i == 1:
            racket = dataclasses.replace(
                MINE, title="Mine", added=dr.add_mass(MINE, "5g", 3).added, notes=("one",)
            )
        nominal = dataclasses.replace(one.nominal, racket=racket)
        found.append(dataclasses.replace(one, nominal=nominal))
    return found


@pytest.mark.parametrize("draw", [maps_figure, axis_figure, hand_figure])
@pytest.mark.parametrize("count", [2, 5])
def test_figures(draw, count):
    check_record(drawn(draw(rackets(count))), RECORDS / f"{draw.__name__}_{count}.json")


@pytest.mark.parametrize("count", [2, 3])
def test_the_page_and_the_tables(count):
    many = rackets(count)
    if count == 3:  # static numbers alone
        for one in many:
            for name in [*NINE, "peak_hand_force"]:
                one.nominal.values.pop(name)
    rows = report.comparison_table(many)
    page = report.markdown(many, dr.Scenario(speed=20.0), Swing(28.0, 0.15, 12.0))
    table = report._as_csv(rows, [one.racket.name for one in many])
    check_record(
        {"page": page.splitlines(), "rows": rows, "table": table.splitlines()},
        RECORDS / f"page_{count}.json",
    )


def test_numbers_as_they_are_shown():
    check_record(
        {n.name: [n.format(0.123456), n.format(-1e-9, 0.6543), n.unit] for n in NUMBERS},
        RECORDS / "numbers.json",
    )
    mass = NUMBERS[0]
    assert mass.format(0.3, 0.049e-3) == "300.0"
    assert mass.format(0.3, 0.05e-3) == "300.0 ± 0.1"


class StandIn:
    """Stands for a bench: impacts follow from where and how fast the ball comes."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.asked: list[Any] = []
        patch.setattr(Bench, "run", lambda bench, racket, **how: self.run(racket, **how))
        outputs = {
            name: SimpleNamespace(read=lambda result, k=k: 100.0 * k + result.apparent_restitution)
            for k, name in enumerate(
                (
                    "peak_handle_acceleration",
                    "handle_ringing",
                    "peak_hand_force",
                    "peak_hand_torque",
                )
            )
        }
        patch.setattr(assessment, "OUTPUTS", outputs)

    def run(self, racket: Any, **how: Any) -> SimpleNamespace:
        """Restitution: 0.05 a point, or a hill 30 mm from the centre."""
        self.asked.append(how)
        if how["point"] != "auto":
            value = 0.05 * int(how["point"]) + (how["support"] == "grip")
        else:
            value = 0.4 - 20.0 * (how["offset_x"] - 0.03) ** 2
        return SimpleNamespace(apparent_restitution=value)


def test_impacts_of_an_assessment(monkeypatch):
    stand, steps = StandIn(monkeypatch), []
    found = assess(MINE, swing=Swing(20.0, 0.1, 5.0), progress=steps.append)
    check_record(
        {
            "asked": stand.asked,
            "values": found.values,
            "offsets": found.offsets,
            "restitution": found.restitution,
            "ball_speed": found.ball_speed,
            "steps": [[now.task, now.done, now.total] for now in steps[-3:]],
        },
        RECORDS / "assessment.json",
    )


def test_impacts_of_a_lopsided_racket_in_no_swing(monkeypatch):
    stand = StandIn(monkeypatch)
    odd = dr.add_mass(TOUR, "5g", 3)
    found = assess(odd, swing=Swing(0.0, 0.0, 0.0), hand=False)
    assert [how["point"] for how in stand.asked[:9]] == [str(n) for n in range(1, 10)]
    assert {how["speed"] for how in stand.asked[9:]} == {0.1}  # the slowest that is run
    assert len(stand.asked) == 9 + len(found.offsets)
    assert found.ball_speed == pytest.approx(0.1 * found.restitution)
    assert "handle_ringing" not in found.values


def test_aims_lie_within_three_quarters_of_the_rim():
    assert aims(TOUR) == pytest.approx(0.02 * np.arange(-6, 7))  # 0.75 of 164 mm


@pytest.mark.parametrize("engine", ["auto", "drake"])
@pytest.mark.parametrize("own", [True, False])
def test_what_impacts_share(engine, own, monkeypatch):
    monkeypatch.setattr(assessment, "may_run_compiled", lambda base: base.engine == "auto")
    accurate = dr.IntegratorSettings(accuracy=1e-5)
    base = dr.Scenario(engine=engine, speed=30.0, **({"integrator": accurate} if own else {}))
    usual = usual_scenario(base)
    assert (usual.approach_time, usual.after, usual.audit) == (1e-4, 0.008, False)
    assert usual.speed == 30.0
    coarse = engine == "drake" and not own
    assert usual.integrator == (COARSE if coarse else base.integrator)
    assert COARSE.accuracy == 0.02
    assert usual_scenario().speed == 25.0


def test_a_case_of_a_racket_that_is_no_file():
    own = {"racket.head.mass": 0.17, "ball.mass": 0.058}
    scenario = dr.Scenario(offset_x=0.13, offset_y=0.01, point="auto", overrides=own)
    case = assessment.resolved(MINE, scenario)
    assert case.racket is MINE
    assert (case.scenario.offset_x, case.scenario.offset_y) == (0.13, 0.01)
    assert case.scenario.overrides == {"ball.mass": 0.058}
    assert case.ball.mass.value == 0.058


@pytest.mark.parametrize(("key", "most"), [("rate", 100.0), ("pivot", 2.0), ("ball_speed", 60.0)])
def test_swings_that_are_allowed(key, most):
    for value in (0.0, most):
        Swing(**{key: value})
    for value in (-0.001, 1.001 * most):
        with pytest.raises(dr.InputError, match=f"swing: {key}"):
            Swing(**{key: value})
    assert (Swing().rate, Swing().pivot, Swing().ball_speed) == (27.0, 0.2, 10.0)


def test_a_spread_is_what_moves_when_one_number_moves(monkeypatch):
    """Impacts of variants that are felt; static numbers of the others; squares add up."""
    many = [("felt", "a", True), ("still", "b", False), ("also", "c", True)]
    values = {
        "nominal": {"mass": 1.0, "restitution_5": 0.4},
        "a": {"mass": 1.0, "restitution_5": 0.43},
        "b": {"mass": 1.2},
        "c": {"mass": 0.9, "restitution_5": 0.36},
    }
    asked, told = [], []
    monkeypatch.setattr(spread, "variants", lambda racket: many)
    monkeypatch.setattr(spread, "apply_overrides", lambda one, overrides: (one, overrides))
    monkeypatch.setattr(spread, "static_numbers", lambda one: values[one[0]])

    def assess(one, *, swing, bench, progress, hand):
        asked.append((swing, hand, bench.base.speed))
        progress(Progress("of one", 2, 4))
        name = one if isinstance(one, str) else "nominal"
        return SimpleNamespace(values=values[name], racket=one)

    monkeypatch.setattr(spread, "assess", assess)
    racket = SimpleNamespace(name="mine")
    base = dr.Scenario(speed=22.0)
    found = spread.assess_with_spread(
        racket, base=base, swing="swing", hand=False, progress=told.append
    )
    assert asked == [("swing", False, 22.0)] * 3
    assert [(now.task, now.done, now.total) for now in told] == [
        ("impacts on mine", 4 * k + 2, 12) for k in range(3)
    ]
    assert found.parts["felt"] == pytest.approx({"mass": 0.0, "restitution_5": 0.03})
    assert found.parts["still"] == pytest.approx({"mass": 0.2})
    assert found.sd == pytest.approx({"mass": (0.2**2 + 0.1**2) ** 0.5, "restitution_5": 0.05})
    assert found.racket is racket


def test_variants_move_a_number_by_its_deviation(monkeypatch):
    """Up where that can be, else down; a spread of half a per cent is not felt by the ball."""
    asked = []

    def with_specs(racket, changes, *how):
        asked.append(changes)
        if changes.get("balance", 0.0) > 0.33 or (how and racket.name == "no split"):
            raise dr.InputError("specs", 1, "2")
        return racket

    monkeypatch.setattr(spread, "with_specs", with_specs)
    monkeypatch.setattr(spread, "readded", lambda racket: racket)
    specs = {
        "mass": SimpleNamespace(value=0.32, sd=0.005 * 0.32),
        "balance": SimpleNamespace(value=0.33, sd=0.0017),
        "length": SimpleNamespace(value=0.686, sd=0.0),
        "in_over_out": SimpleNamespace(value=1.2, sd=0.1),
    }
    racket = dataclasses.replace(TOUR, name="no split")
    object.__setattr__(racket, "specs", specs)
    found = spread.variants(racket)
    assert [(name, dynamic) for name, _, dynamic in found] == [
        ("mass", False),
        ("balance", True),
        ("in_over_out", False),
        ("string_bed", True),
    ]
    assert asked[:4] == [
        {"mass": 0.32 + 0.005 * 0.32},
        {"balance": pytest.approx(0.3317)},
        {"balance": pytest.approx(0.3283)},
        {"in_over_out": pytest.approx(1.3)},
    ]


@pytest.mark.parametrize("name", ["tour", "recreational"])
def test_the_other_strings_at_the_same_tension(name):
    racket = dr.load_racket(name, 280.0)
    other = dr.load_racket({"tour": "recreational", "recreational": "tour"}[name], 280.0)
    found = spread._with_other_strings(racket)
    for key in ("initial_tension", "stiffness", "rim_factors", "springs"):
        assert getattr(found.string_bed, key) == getattr(other.string_bed, key)
    assert found.friction == other.friction
    assert found.string_bed.mass == racket.string_bed.mass
    assert found.head == racket.head


def test_one_diagram_for_all_of_one_topology(monkeypatch):
    """In the compiled engine where it may, else in Drake's."""
    built, ran = [], []
    monkeypatch.setattr(assessment, "make_impact_diagram", lambda case: built.append(case) or "d")

    class Compiled:
        def run(self, case, every_sample):
            ran.append(("compiled", every_sample))

    monkeypatch.setattr(assessment, "_compiled", lambda system: Compiled())
    monkeypatch.setattr(assessment, "make_result", lambda case, run, history: history)
    monkeypatch.setattr(
        assessment, "simulate", lambda case, system, history: ran.append((system, history))
    )
    monkeypatch.setattr(assessment, "may_run_compiled", lambda s: s.engine == "auto")
    bench = Bench(dr.Scenario())
    for speed in (20.0, 30.0):
        bench.run(TOUR, speed=speed)
    assert bench.run(TOUR, history=True) is True
    assert len(built) == 1
    bench.run(TOUR, support="grip")
    assert len(built) == 2
    drakes = Bench(dr.Scenario(engine="drake"))
    drakes.run(TOUR, history=True)
    assert ran == [("compiled", False)] * 2 + [("compiled", True), ("compiled", False), ("d", True)]
