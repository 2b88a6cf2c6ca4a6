"""Rackets side by side: the swing, the spread, the difference, and what is written."""

from __future__ import annotations

import csv
import dataclasses
import json

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

import drake_racket as dr
from drake_racket.compare import Assessed, Assessment, Swing, assess_with_spread, write_comparison
from drake_racket.compare import assess as assess_racket
from drake_racket.compare.assessment import Bench, alike_on_both_sides, percussion, usual_scenario
from drake_racket.compare.numbers import NINE, NUMBERS
from drake_racket.compare.report import comparison_table, difference, findings
from drake_racket.compare.spread import variants

TOUR = dr.load_racket("tour")
SHOP = {
    "mass": "320g",
    "balance": "33cm",
    "swingweight": "320",
    "twistweight": "14.2",
    "head": "98in2",
    "ra": "65",
}
MINE = dr.racket_from_specs("mine", **SHOP, title="My | racket")


def swung(rate: float, pivot: float, ball_speed: float, offset: float) -> float:
    """Ball speed (m/s) off the tour racket that turns about an axis behind its butt."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    racket, ball = dr.add_racket(plant, TOUR), dr.add_ball(plant, dr.load_ball())
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    dr.add_impact(builder, plant, racket, ball)
    simulator = Simulator(builder.Build())
    dr.configure_integrator(simulator, dr.IntegratorSettings(accuracy=2e-3))
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    place = TOUR.centre()[0] + offset
    plant.SetFreeBodyPose(context, ball.body, RigidTransform([place, 0.0, 0.001]))
    still = [0.0, 0.0, 0.0]
    incoming = SpatialVelocity(still, [0.0, 0.0, -ball_speed])
    plant.SetFreeBodySpatialVelocity(context, ball.body, incoming)
    turning = SpatialVelocity([0.0, -rate, 0.0], [0.0, 0.0, rate * pivot])
    plant.SetFreeBodySpatialVelocity(context, racket.handle, turning)
    simulator.AdvanceTo(0.008)
    return float(ball.body.EvalSpatialVelocityInWorld(context).translational()[2])


@pytest.mark.parametrize("offset", [-0.06, 0.06])
def test_the_swings_ball_speed_is_that_of_a_racket_that_turns(offset):
    swing, bench = Swing(27.0, 0.2, 10.0), Bench(usual_scenario())
    speed = swing.racket_speed(TOUR.centre()[0] + offset)
    found = bench.run(TOUR, point="auto", offset_x=offset, speed=speed + 10.0, support="free")
    formula = found.apparent_restitution * (speed + 10.0) + speed
    assert formula == pytest.approx(swung(27.0, 0.2, 10.0, offset), rel=0.006)


@pytest.fixture(scope="module")
def assessed():
    """Both rackets, with few aims and without hand."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("drake_racket.compare.assessment.AXIS_STEP", 0.1)
        patch.setattr("drake_racket.compare.spread.variants", lambda racket: variants(racket)[3:4])
        done = []
        mine = assess_with_spread(MINE, hand=False, progress=done.append)
        assert done[-1].done == done[-1].total
        return [assess_with_spread(TOUR, hand=False), mine]


def test_an_assessment_is_the_impacts_it_says(assessed):
    tour, mine = assessed
    for found, racket in ((tour, TOUR), (mine, MINE)):
        case = dr.resolve(dr.Scenario(speed=25.0, point="8", after=0.008, audit=False))
        result = dr.simulate(dataclasses.replace(case, racket=racket), history=False)
        assert found.nominal.values["restitution_8"] == pytest.approx(
            result.apparent_restitution, abs=1e-4
        )
    values = mine.nominal.values
    assert values["swingweight"] == pytest.approx(0.0320)
    assert values["restitution_9"] == values["restitution_7"]
    at = int(np.argmax(mine.nominal.ball_speed))
    assert values["swing_speed_best"] == mine.nominal.ball_speed[at]
    assert values["swing_best_place"] == mine.nominal.offsets[at]
    assert tour.sd["restitution_5"] == 0.0  # nothing of it is from a shop
    assert mine.sd["twistweight"] == pytest.approx(0.3e-5, rel=1e-3)
    json.dumps(comparison_table(assessed), allow_nan=False)


def test_what_is_moved_by_what():
    names = [name for name, _, _ in variants(MINE)]
    assert names == [
        "mass",
        "balance",
        "swingweight",
        "twistweight",
        "frequency",
        "in_over_out",
        "split",
        "string_bed",
    ]
    felt = {name for name, _, dynamic in variants(MINE) if dynamic}
    assert felt == {"frequency", "split", "string_bed"}
    guessed = dr.racket_from_specs("mine", **{**SHOP, "twistweight": None})
    assert "twistweight" in {name for name, _, dynamic in variants(guessed) if dynamic}
    split = next(racket for name, racket, _ in variants(MINE) if name == "split")
    assert dr.racket_properties(split).swingweight == pytest.approx(0.0320)
    assert split.head.mass.value != pytest.approx(MINE.head.mass.value, rel=1e-3)
    assert variants(TOUR) == []


def test_added_masses_stay_in_variants():
    heavy = dr.add_mass(MINE, "10g", "butt")
    other = next(racket for name, racket, _ in variants(heavy) if name == "frequency")
    assert dr.racket_properties(other).mass == pytest.approx(0.330)


def test_points_across_the_axis_are_one_where_both_sides_are():
    assert alike_on_both_sides(TOUR)
    assert not alike_on_both_sides(dr.add_mass(TOUR, "5g", 3))
    springs = TOUR.string_bed.springs
    odd = dataclasses.replace(springs, value={**springs.value, "1-4": "k1"})
    bed = dataclasses.replace(TOUR.string_bed, springs=odd)
    assert not alike_on_both_sides(dataclasses.replace(TOUR, string_bed=bed))


def test_a_ball_at_the_centre_of_percussion_leaves_the_hand_in_place():
    p = dr.racket_properties(TOUR)
    place = percussion(p, 0.1016)
    about_com = p.swingweight - p.mass * (p.balance - 0.1016) ** 2
    # an impulse of 1 N s at `place`: velocity of the point at 0.1016 m
    after = 1.0 / p.mass + (place - p.balance) / about_com * (0.1016 - p.balance)
    assert after == pytest.approx(0.0, abs=1e-12)


def made(name: str, parts: dict[str, dict[str, float]], **values: float) -> Assessed:
    racket = dataclasses.replace(TOUR, name=name, title=name)
    whole = {number.name: 1.0 for number in NUMBERS} | values
    sd = {key: sum(p.get(key, 0.0) ** 2 for p in parts.values()) ** 0.5 for key in whole}
    offsets = np.array([-0.02, 0.0, 0.02])
    return Assessed(Assessment(racket, whole, offsets, 0.4 + offsets, 30.0 + offsets), sd, parts)


def test_what_is_unknown_of_both_alike_cancels():
    one = made("one", {"string_bed": {"mass": 3.0}, "frequency": {"mass": 0.3}}, mass=10.0)
    two = made("two", {"string_bed": {"mass": 3.1}, "frequency": {"mass": 0.4}}, mass=12.0)
    change, sd = difference(one, two, "mass")
    assert change == 2.0
    assert sd == pytest.approx((0.1**2 + 0.3**2 + 0.4**2) ** 0.5)
    published = made("published", {}, mass=10.0)
    assert difference(published, two, "mass")[1] == pytest.approx((3.1**2 + 0.4**2) ** 0.5)


def test_findings_say_what_is_sure_and_what_is_not():
    one = made("one", {}, swing_speed_centre=30.0, handle_ringing=200.0)
    parts = {"frequency": {"swing_speed_centre": 0.1, "handle_ringing": 30.0}}
    two = made("two", parts, swing_speed_centre=31.0, handle_ringing=210.0)
    lines = findings([one, two])
    assert lines[0] == "At its centre two returns this swing's ball faster by 1.00 ± 0.10 m/s."
    assert "No sure difference between two and one" in lines[1]
    assert "(10 ± 30 m/s²)" in lines[1]


def test_what_is_written(tmp_path, assessed):
    for found in assessed:  # the hand's numbers, which these were made without
        for name in ("peak_handle_acceleration", "handle_ringing", "peak_hand_force"):
            found.nominal.values[name], found.sd[name] = 100.0, 0.0
        found.nominal.values["peak_hand_torque"], found.sd["peak_hand_torque"] = 10.0, 0.0
    out = tmp_path / "new" / "compare"
    paths = write_comparison(assessed, out, dr.Scenario(), Swing())
    assert sorted(path.name for path in paths) == sorted(path.name for path in out.iterdir())
    page = (out / "compare.md").read_text()
    assert "My / racket" in page  # a title does not break the table
    widths = {line.count("|") for line in page.splitlines() if line.startswith("| mass")}
    assert widths == {5}
    for figure in ("restitution_maps.png", "along_the_axis.png", "vibration_and_hand.png"):
        assert f"({figure})" in page
        assert (out / figure).stat().st_size > 10_000
    assert (out / "compare.html").read_text().count('src="data:image/png;base64,') == 3
    rows = list(csv.DictReader((out / "compare.csv").read_text().splitlines()))
    assert rows[0]["name"] == "mass"
    assert float(rows[0]["mine: value"]) == pytest.approx(0.320)
    assert float(rows[0]["mine: difference"]) == pytest.approx(0.320 - 0.3089)


def test_every_number_is_shown_in_its_unit():
    number = next(n for n in NUMBERS if n.name == "swingweight")
    assert number.format(0.0320, 0.00003) == "320.0 ± 0.3"
    assert number.format(0.0320, 1e-9) == "320.0"
    assert {f"restitution_{i}" for i in range(1, 10)} == set(NINE)


def test_swings_that_are_none():
    with pytest.raises(dr.InputError, match="swing: rate"):
        Swing(rate=200.0)


def test_assess_counts_its_impacts(monkeypatch):
    monkeypatch.setattr("drake_racket.compare.assessment.AXIS_STEP", 0.1)
    monkeypatch.setattr(Bench, "run", lambda *_, **__: type("R", (), {"apparent_restitution": 0.4}))
    steps = []
    found = assess_racket(TOUR, hand=False, progress=steps.append)
    assert [s.done for s in steps] == list(range(1, 13))
    assert found.ball_speed == pytest.approx(
        [0.4 * (27 * (0.711 + x) + 10) + 27 * (0.711 + x) for x in (-0.1, 0.0, 0.1)]
    )
