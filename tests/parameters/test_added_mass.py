"""Point masses on the frame, against hand algebra, and against bodies welded to a user's plant."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia, UnitInertia

import drake_racket as dr
from drake_racket.parameters.added_mass import with_mass
from drake_racket.parameters.racket import AddedMass

TOUR = dr.load_racket("tour")
PLACES = {  # at -> x, y (m) in the racket, written by hand from the parameter file
    "3": (0.356 + 0.155, -0.123),
    "9": (0.356 + 0.155, 0.123),
    "12": (0.356 + 0.155 + 0.164, 0.0),
    "6": (0.356 + 0.155 - 0.164, 0.0),
    "butt": (0.0, 0.0),
    "tip": (0.686, 0.0),
    "20cm": (0.2, 0.0),
    "16 in": (0.4064, 0.0),
}


def inertia(racket: dr.RacketParameters, welded: list[tuple[float, float, float]]) -> np.ndarray:
    """Spatial inertia (6 x 6) of a racket about its butt, with masses welded on where wanted."""
    plant = MultibodyPlant(0.0)
    added = dr.add_racket(plant, racket)
    bodies = plant.GetBodyIndices(added.model_instance)
    for i, (mass, x, y) in enumerate(welded):
        point = SpatialInertia(mass, np.zeros(3), UnitInertia(0.0, 0.0, 0.0))
        lump = plant.AddRigidBody(f"lump_{i}", added.model_instance, point)
        frame, at = added.handle.body_frame(), [x, y, 0.0]
        if x >= racket.handle.length.value:
            frame, at = added.head.body_frame(), [x - racket.handle.length.value, y, 0.0]
        plant.WeldFrames(frame, lump.body_frame(), RigidTransform(at))
    plant.Finalize()
    bodies = plant.GetBodyIndices(added.model_instance)
    context = plant.CreateDefaultContext()
    found = plant.CalcSpatialInertia(context, added.frame("butt"), bodies)
    return np.asarray(found.CopyToFullMatrix6())


@pytest.mark.parametrize("at", PLACES)
def test_places(at):
    (added,) = dr.add_mass(TOUR, "10g", at).added
    assert (added.x, added.y) == pytest.approx(PLACES[at], abs=1e-15)
    assert added.mass == 0.010


def test_ten_grams_at_three_and_nine_by_hand():
    new = dr.add_mass(dr.add_mass(TOUR, "10g", 3), "10g", 9)
    before, after = dr.racket_properties(TOUR), dr.racket_properties(new)
    m, x, y = 0.020, 0.511, 0.123
    assert after.mass == pytest.approx(before.mass + m, rel=1e-12)
    moment = before.mass * before.balance + m * x
    assert after.balance == pytest.approx(moment / (before.mass + m), rel=1e-12)
    swing = before.swingweight + m * (x - 0.1016) ** 2
    assert after.swingweight == pytest.approx(swing, rel=1e-12)
    assert after.twistweight == pytest.approx(before.twistweight + m * y**2, rel=1e-12)
    spin = before.spinweight + m * ((x - 0.1016) ** 2 + y**2)
    assert after.spinweight == pytest.approx(spin, rel=1e-12)
    assert new.head.com_y is None  # they balance
    assert new.head.product_xy is None


@pytest.mark.parametrize(
    "masses",
    [[("10g", "3"), ("10g", "9")], [("7g", "2")], [("5g", "11"), ("12g", "butt"), ("3g", "20cm")]],
    ids=lambda masses: "+".join(at for _, at in masses),
)
def test_as_bodies_welded_to_a_plant(masses):
    new, welded = TOUR, []
    for mass, at in masses:
        new = dr.add_mass(new, mass, at)
        welded.append((new.added[-1].mass, new.added[-1].x, new.added[-1].y))
    expected = inertia(TOUR, welded)
    np.testing.assert_allclose(inertia(new, []), expected, rtol=0.0, atol=1e-14)


def test_one_side_heavier_moves_as_welded_bodies_do():
    """An impact on a racket with 10 g at 3 o'clock: its head's products of inertia are used."""

    new = dr.add_mass(TOUR, "10g", 3)
    assert new.head.com_y.value == pytest.approx(-0.010 * 0.123 / (0.1605 + 0.010), rel=1e-12)
    case = dr.resolve(dr.Scenario(speed=25.0, after=0.006, audit=False))
    even = dr.simulate(case, history=False)
    uneven = dr.simulate(dataclasses.replace(case, racket=new), history=False)
    assert abs(even.racket_angular_velocity[0]) < 1e-6
    assert abs(uneven.racket_angular_velocity[0]) > 0.1  # it rolls
    # and the same Diagram with the numbers of another racket in its Context gives the same
    again = dr.simulate(
        dataclasses.replace(case, racket=new), dr.make_impact_diagram(case), history=False
    )
    np.testing.assert_array_equal(uneven.rebound_velocity, again.rebound_velocity)


def test_the_file_keeps_what_was_added(tmp_path):
    new = dr.add_mass(TOUR, "10g", 3, name="heavier", title="With lead")
    dr.write_racket(new, tmp_path / "heavier.yaml")
    read = dr.load_racket(tmp_path / "heavier.yaml")
    assert read == new
    assert read.head.mass.status == "calculated"
    assert "10 g at 511 mm, -123 mm aside" in read.head.mass.source


@pytest.mark.parametrize(
    ("mass", "at", "text"),
    [
        ("0g", 3, "more than 0, up to 200 g"),
        ("10", 3, "a number with its unit (g, kg, oz, lb)"),
        ("1kg", 3, "up to 200 g"),
        ("5g", 13, "an hour from 1 to 12"),
        ("5g", "side", "an hour from 1 to 12, butt, tip"),
        ("5g", "80cm", "0 to the racket's length, 68.6 cm"),
    ],
)
def test_refused(mass, at, text):
    with pytest.raises(dr.InputError) as caught:
        dr.add_mass(TOUR, mass, at)
    assert text in str(caught.value)


def test_a_mass_on_the_throat_itself_is_the_heads():
    racket = dr.load_racket()
    throat = racket.handle.length.value
    for x, head in ((throat, True), (throat - 1e-6, False)):
        heavier = with_mass(racket, AddedMass(0.01, x, 0.0))
        assert (heavier.head.mass.value > racket.head.mass.value) == head
        assert (heavier.handle.mass.value > racket.handle.mass.value) != head
