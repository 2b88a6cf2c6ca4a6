"""The string law against closed forms, energy and Drake's own spring elements."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.autodiffutils import InitializeAutoDiff
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import LinearSpringDamper

from drake_racket import Scenario, load_racket, make_impact_diagram
from drake_racket.laws.strings import (
    dissipated_power,
    generalized_forces,
    stored_energy,
    tensions,
)
from drake_racket.plant.racket import add_racket
from drake_racket.plant.systems.string_bed import StringBed
from tests.conftest import BED, SPRINGS, springs
from tests.oracles.clamped_impact import spring_energy, spring_forces


def constants(racket="tour", tension="low", damping=0.0):
    p = load_racket(racket, tension)
    s = springs(p)
    k, length = s["spring_k"], s["spring_L0"]
    slack = p.string_bed.initial_tension.value - k * length
    return np.stack([k, slack, length**2, np.full(24, damping)]), p, s


deflections = st.lists(st.floats(-0.03, 0.03), min_size=9, max_size=9).map(np.array)
rates = st.lists(st.floats(-30.0, 30.0), min_size=9, max_size=9).map(np.array)


@settings(max_examples=100, deadline=None)
@given(z=deflections, zdot=rates, damping=st.sampled_from([0.0, 2.0]))
def test_forces_and_energy_equal_the_oracle(z, zdot, damping):
    c, p, s = constants(damping=damping)
    args = (s["spring_i"], s["spring_j"], s["spring_k"], s["spring_L0"])
    t0 = p.string_bed.initial_tension.value
    expected = spring_forces(z, zdot, *args, t0, damping)
    assert np.allclose(
        generalized_forces(z, zdot, c, BED.incidence), expected, rtol=1e-10, atol=1e-8
    )
    assert stored_energy(z, c, BED.incidence) == pytest.approx(
        spring_energy(z, *args, t0), rel=1e-8, abs=1e-12
    )


@settings(max_examples=50, deadline=None)
@given(z=deflections)
def test_force_is_minus_the_gradient_of_the_energy(z):
    c, *_ = constants("recreational", "high")
    energy = stored_energy(InitializeAutoDiff(z).ravel(), c, BED.incidence)
    force = generalized_forces(z, np.zeros(9), c, BED.incidence)
    gradient = energy.derivatives() if energy.derivatives().size else np.zeros(9)
    assert np.allclose(force, -gradient, rtol=1e-9, atol=1e-8)


def test_damping_takes_what_its_force_gives():
    """The work rate of the damping forces is the dissipated power."""
    rng = np.random.default_rng(1)
    z, zdot = rng.normal(0.0, 0.01, 9), rng.normal(0.0, 10.0, 9)
    damped, *_ = constants(damping=3.0)
    bare, *_ = constants()
    extra = generalized_forces(z, zdot, damped, BED.incidence) - generalized_forces(
        z, zdot, bare, BED.incidence
    )
    power = dissipated_power(z, zdot, damped, BED.incidence)
    assert -extra @ zdot == pytest.approx(power, rel=1e-12)
    assert power > 0.0


def test_flat_bed_is_in_equilibrium_at_t0(bed):
    c, p, _ = constants(*bed)
    flat = np.zeros(9)
    assert np.allclose(
        tensions(flat, flat, c, BED.incidence), p.string_bed.initial_tension.value, rtol=1e-12
    )
    assert np.all(generalized_forces(flat, flat, c, BED.incidence) == 0.0)


def test_small_deflection_stiffness_is_the_sum_of_tension_over_length():
    """dF/dz at the flat bed is T0/L0 of the four springs at a point, whatever k is."""
    c, p, s = constants()
    t0 = p.string_bed.initial_tension.value
    z = np.zeros(9)
    z[4] = 1e-7
    at_centre = [i for i, pair in enumerate(SPRINGS.values()) if 5 in pair]
    expected = t0 * np.sum(1.0 / s["spring_L0"][at_centre])
    assert -generalized_forces(z, np.zeros(9), c, BED.incidence)[4] / 1e-7 == pytest.approx(
        expected, rel=1e-6
    )


def test_drakes_own_spring_elements_give_the_same_accelerations(bed):
    """24 LinearSpringDampers of free length L0 - T0/k are the same bed, force by force."""
    p = load_racket(*bed)
    _, _, s = constants(*bed)
    plant = MultibodyPlant(0.0)
    racket = add_racket(plant, p, parent=plant.world_frame(), held_at="gsc")
    t0, k, length = p.string_bed.initial_tension.value, s["spring_k"], s["spring_L0"]
    for row, (name, (i, j)) in enumerate(SPRINGS.items()):
        origin = np.zeros(3)
        if j:
            other, place = racket.string_masses[j - 1], origin
        else:
            other, place = racket.head, np.array([*_rim_place(p, name, i, length[row]), 0.0])
        plant.AddForceElement(
            LinearSpringDamper(
                racket.string_masses[i - 1],
                origin,
                other,
                place,
                length[row] - t0 / k[row],
                k[row],
                0.0,
            )
        )
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    plant.Finalize()
    context = plant.CreateDefaultContext()
    z = np.random.default_rng(3).normal(0.0, 0.01, 9)
    for joint, value in zip(racket.string_joints, z, strict=True):
        joint.set_translation(context, value)
    drake = plant.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector()
    c, *_ = constants(*bed)
    ours = generalized_forces(z, np.zeros(9), c, BED.incidence) / (p.string_bed.mass.value / 9.0)
    rows = [joint.velocity_start() for joint in racket.string_joints]
    assert np.allclose(drake[rows], ours, rtol=1e-9)


def _rim_place(p, name, point, length):
    x, y = p.point_in_head(point)
    step = {"tip": (1, 0), "throat": (-1, 0), "left": (0, 1), "right": (0, -1)}
    dx, dy = step[name.split("-")[0]]
    return x + dx * length, y + dy * length


def test_system_ports_give_the_laws():
    system = make_impact_diagram(Scenario(audit=False))
    root = system.create_context()
    bed, plant = system.impact.string_bed, system.plant
    context = plant.GetMyMutableContextFromRoot(root)
    z = np.random.default_rng(4).normal(0.0, 0.01, 9)
    for joint, value in zip(system.impact.racket.string_joints, z, strict=True):
        joint.set_translation(context, value)
    own = bed.GetMyContextFromRoot(root)
    c, *_ = constants()
    force = bed.GetOutputPort("generalized_force").Eval(own)
    rows = [j.velocity_start() for j in system.impact.racket.string_joints]
    assert np.allclose(
        force[rows], generalized_forces(z, np.zeros(9), c, BED.incidence), rtol=1e-12
    )
    assert np.count_nonzero(force) == 9
    assert np.allclose(
        bed.GetOutputPort("string_tension").Eval(own),
        tensions(z, z * 0, c, BED.incidence),
        rtol=1e-12,
    )
    assert np.array_equal(bed.GetOutputPort("string_deflection").Eval(own), z)
    energy = bed.GetOutputPort("string_energy").Eval(own)
    assert energy[0] == pytest.approx(stored_energy(z, c, BED.incidence), rel=1e-12)
    # a parameter in the Context changes the force at once
    mutable = bed.GetMyMutableContextFromRoot(root)
    mutable.get_mutable_numeric_parameter(StringBed.INITIAL_TENSION).SetFromVector([0.0])
    changed = bed.GetOutputPort("string_tension").Eval(own)
    assert np.allclose(changed, tensions(z, z * 0, c, BED.incidence) - 648.2, rtol=1e-9, atol=1e-9)


def test_points_are_numbered_from_the_tip_and_the_left():
    assert BED.places[0].tolist() == [1.0, 1.0]
    assert BED.places[4].tolist() == [0.0, 0.0]
    assert BED.places[5].tolist() == [0.0, -1.0]
    assert BED.places[8].tolist() == [-1.0, -1.0]
