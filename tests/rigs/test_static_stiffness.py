"""The string-bed pressed slowly, against the oracle's springs and the Drake plant."""

from __future__ import annotations

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from drake_racket import InputError, add_impact, add_supported_racket, load_racket
from drake_racket.rigs.static_stiffness import (
    mean_difference,
    place_deflection,
    static_deflection,
    stiffness_dataset,
    stiffness_map,
)
from tests.conftest import BEDS, springs
from tests.oracles.clamped_impact import spring_energy, spring_forces


def oracle_springs(bed):
    racket = load_racket(*bed)
    s = springs(racket)
    return {
        "i": s["spring_i"],
        "j": s["spring_j"],
        "k": s["spring_k"],
        "L0": s["spring_L0"],
        "T0": racket.string_bed.initial_tension.value,
    }


@given(st.sampled_from(BEDS), st.integers(1, 9), st.floats(1e-3, 5e3))
@settings(max_examples=60, deadline=None)
def test_the_oracles_springs_balance_the_force(bed, point, force):
    z = static_deflection(load_racket(*bed), point, force)
    total = spring_forces(z, np.zeros(9), **oracle_springs(bed))
    total[point - 1] -= force
    assert np.max(np.abs(total)) < 1e-8 * max(force, 1.0)
    assert np.all(z <= 1e-15)


@pytest.mark.parametrize("point", [1, 5, 8])
def test_work_of_the_force_is_the_energy_in_the_springs(bed, point):
    # W = integral of F dz along the curve, by Simpson's rule in the force: W = F z - integral z dF
    racket = load_racket(*bed)
    forces = np.linspace(0.0, 1000.0, 201)
    z = np.array([-static_deflection(racket, point, f)[point - 1] for f in forces])
    weights = np.ones(201)
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    complementary = float(weights @ z) * 5.0 / 3.0
    work = 1000.0 * z[-1] - complementary
    energy = spring_energy(static_deflection(racket, point, 1000.0), **oracle_springs(bed))
    assert work == pytest.approx(energy, rel=1e-7)


def test_small_deflections_see_tension_alone(bed):
    # one mass row of K = sum over its springs of T0 / L0, assembled by hand
    s = oracle_springs(bed)
    matrix = np.zeros((10, 10))
    for i, j, length in zip(s["i"], s["j"], s["L0"], strict=True):
        for a, b in ((i, i), (j, j)):
            matrix[a, b] += s["T0"] / length
        matrix[i, j] -= s["T0"] / length
        matrix[j, i] -= s["T0"] / length
    compliance = np.linalg.inv(matrix[:9, :9])
    dataset = stiffness_dataset(rackets=[bed[0]], tensions=[bed[1]], forces=[1e-3])
    expected = 1.0 / np.diag(compliance)
    for name in ("secant_stiffness", "tangent_stiffness"):
        np.testing.assert_allclose(dataset[name].to_numpy().squeeze(), expected, rtol=1e-6)


def test_tangent_stiffness_is_the_slope_of_the_curve():
    forces = [499.9, 500.0, 500.1]
    dataset = stiffness_dataset(rackets=["tour"], tensions=["low"], points=[3], forces=forces)
    deflection = dataset["deflection"].to_numpy().squeeze()
    slope = 0.2 / (deflection[2] - deflection[0])
    tangent = float(dataset["tangent_stiffness"].sel(force=500.0).squeeze())
    assert tangent == pytest.approx(slope, rel=1e-6)


def test_the_drake_plant_stays_at_the_answer():
    racket = load_racket("recreational", "high")
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    handles = add_supported_racket(plant, racket, "clamped_head")
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    plant.Finalize()
    add_impact(builder, plant, handles)
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    for joint, height in zip(
        handles.string_joints, static_deflection(racket, 6, 700.0), strict=True
    ):
        joint.set_translation(context, height)
    force = ExternallyAppliedSpatialForce()
    force.body_index = handles.string_masses[5].index()
    force.p_BoBq_B = np.zeros(3)
    force.F_Bq_W = SpatialForce([0.0, 0.0, 0.0], [0.0, 0.0, -700.0])
    plant.get_applied_spatial_force_input_port().FixValue(context, [force])
    acceleration = plant.get_generalized_acceleration_output_port().Eval(context)
    mass = racket.string_bed.mass.value / 9.0
    assert np.max(np.abs(mass * acceleration)) < 1e-6  # N


@pytest.fixture(scope="module")
def dataset() -> xarray.Dataset:
    return stiffness_dataset(forces=[1.0, 800.0])


def test_tour_low_and_recreational_high_match_at_impact_forces(dataset):
    # the statement of Glynn et al. (2011), Methods; lightly pressed they do not match
    difference = mean_difference(dataset)["difference"]
    at = difference.sel(other="recreational high")
    assert float(at.sel(bed="tour low", force=800.0)) < 0.05
    assert float(at.sel(bed="tour low", force=1.0)) > 0.25
    across = difference.sel(
        bed=["tour low", "tour high"], other=["recreational low", "recreational high"], force=800.0
    )
    assert float(across.min()) == float(at.sel(bed="tour low", force=800.0))


def test_mean_difference_by_hand(dataset):
    difference = mean_difference(dataset)["difference"]
    k = dataset["secant_stiffness"].sel(force=800.0)
    a = k.sel(racket="tour", tension="high").to_numpy()
    b = k.sel(racket="recreational", tension="low").to_numpy()
    expected = np.mean(np.abs(a - b) / (0.5 * (a + b)))
    found = difference.sel(bed="tour high", other="recreational low", force=800.0)
    assert float(found) == pytest.approx(expected)
    assert float(difference.sel(bed="tour low", other="tour low").max()) == 0.0


@pytest.mark.parametrize(
    ("point", "force"), [(0, 1.0), (10, 1.0), (5, -1.0), (5, float("nan")), (5, 1e9)]
)
def test_bad_input_is_refused(point, force):
    with pytest.raises(InputError):
        static_deflection(load_racket(), point, force)


def test_forces_of_a_curve_are_above_zero():
    with pytest.raises(InputError, match="forces"):
        stiffness_dataset(forces=[0.0, 100.0])


def test_the_bed_pressed_anywhere_is_that_of_the_points_at_the_points():
    racket = load_racket("tour")
    grid = racket.string_bed.spacing.value * racket.bed_topology().places
    for point, (x, y) in enumerate(grid, 1):
        there = -static_deflection(racket, point, 800.0)[point - 1]
        assert place_deflection(racket, x, y, 800.0) == pytest.approx(there, rel=1e-12)


def test_the_bed_pressed_anywhere_has_no_jumps_and_is_stiffer_between_points():
    racket = load_racket("tour")
    for x, y in ((0.0685, 0.03), (0.02, 0.0685), (0.0, 0.0)):  # lines of the grid
        sides = [place_deflection(racket, x + s, y + s, 800.0) for s in (-1e-9, 1e-9)]
        assert abs(sides[0] - sides[1]) < 1e-6 * sides[0]
    between, at = (place_deflection(racket, x, 0.0, 800.0) for x in (0.03425, 0.0))
    assert between < 0.8 * at  # two masses share the force there
    assert place_deflection(racket, 0.1639, 0.0, 800.0) < 1e-4  # at the rim


def test_a_map_of_stiffness():
    found = stiffness_map(load_racket("tour"), force=400.0, step=0.04)
    middle = float(found["secant_stiffness"].sel(x=0.0, y=0.0))
    expected = 400.0 / -static_deflection(load_racket("tour"), 5, 400.0)[4]
    assert middle == pytest.approx(expected, rel=1e-12)
    assert np.isnan(found["deflection"].to_numpy()[0, 0])  # outside the rim
    values = found["deflection"]
    np.testing.assert_allclose(values, values[:, ::-1], rtol=1e-9)  # left as right


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda r: place_deflection(r, 0.2, 0.0, 1.0), r"place: got \(0.2, 0.0\); allowed: within"),
        (lambda r: place_deflection(r, 0.0, 0.0, -1.0), "force: got -1"),
        (lambda r: stiffness_map(r, force=0.0), "force: got 0"),
        (lambda r: stiffness_map(r, step=0.5), "step: got 0.5"),
    ],
)
def test_bad_places_in_one_line(call, said):
    with pytest.raises(InputError, match=said):
        call(load_racket("tour"))
