"""Masses for a target: the equations by hand, the least mass, and what cannot be reached."""

from __future__ import annotations

import pytest

import drake_racket as dr
from drake_racket.plant.customise import PLACES, customised, solve_targets

TOUR = dr.load_racket("tour")
HAS = dr.racket_properties(TOUR)


def test_swingweight_alone_is_cheapest_at_the_tip():
    new = solve_targets(TOUR, {"swingweight": HAS.swingweight + 1e-3})
    (added,) = new.added
    assert added.at == "12"
    reach = 0.511 + 0.164 - 0.1016
    assert added.mass == pytest.approx(1e-3 / reach**2, rel=1e-9)
    assert dr.racket_properties(new).swingweight == pytest.approx(HAS.swingweight + 1e-3, rel=1e-12)


def test_balance_alone_by_hand():
    target = HAS.balance - 0.005
    (added,) = solve_targets(TOUR, {"balance": target}).added
    assert added.at == "butt"
    assert added.mass == pytest.approx(HAS.mass * 0.005 / target, rel=1e-9)


def test_several_targets_at_once():
    targets = {"swingweight": 0.0350, "balance": 0.335, "twistweight": 0.00152}
    new = solve_targets(TOUR, targets)
    has = dr.racket_properties(new)
    for key, value in targets.items():
        assert getattr(has, key) == pytest.approx(value, rel=1e-10)
    assert {one.at for one in new.added} <= {h for place in PLACES for h in place.split("+")}
    assert new.head.com_y is None  # pairs share evenly
    # no other places do it with less: every single place left out needs as much or more
    least = sum(one.mass for one in new.added)
    for left_out in PLACES:
        rest = [place for place in PLACES if place != left_out]
        try:
            other = solve_targets(TOUR, targets, rest)
        except dr.InputError:
            continue
        assert sum(one.mass for one in other.added) >= least - 1e-12


def test_the_total_mass_can_be_a_target():
    new = solve_targets(TOUR, {"mass": 0.320, "balance": HAS.balance})
    has = dr.racket_properties(new)
    assert has.mass == pytest.approx(0.320, rel=1e-12)
    assert has.balance == pytest.approx(HAS.balance, rel=1e-12)


def test_masses_first_and_then_the_target():
    new = customised(TOUR, [("5g", 3), ("5g", 9)], {"swingweight": 0.0360}, name="mine")
    assert [one.at for one in new.added] == ["3", "9", "12"]
    assert new.name == "mine"
    assert dr.racket_properties(new).swingweight == pytest.approx(0.0360, rel=1e-12)


def test_what_is_there_already_needs_nothing():
    assert solve_targets(TOUR, {"balance": HAS.balance}).added == ()


@pytest.mark.parametrize(
    ("targets", "text"),
    [
        ({"swingweight": 0.030}, "swingweight is 338.8 kg cm², with 50 g at one of these places"),
        ({"mass": 0.3}, "mass is 308.9 g"),
        ({"power": 1.0}, "mass, balance, swingweight, twistweight"),
    ],
)
def test_what_cannot_be_reached(targets, text):
    with pytest.raises(dr.InputError) as caught:
        solve_targets(TOUR, targets)
    assert text in str(caught.value)
