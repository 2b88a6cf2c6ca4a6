"""Modes of the racket against closed forms, hand-written matrices and the published numbers."""

from __future__ import annotations

import contextlib
import copy
import dataclasses
import subprocess
import sys

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import InputPortSelection, OutputPortSelection
from pydrake.systems.primitives import Linearize

from drake_racket.io.errors import InputError
from drake_racket.io.files import write_figure, write_netcdf
from drake_racket.parameters.grip import GripStiffness, load_grip
from drake_racket.parameters.racket import RacketParameters, load_racket
from drake_racket.plant.grip import add_grip
from drake_racket.plant.racket import add_racket, find_racket
from drake_racket.plots.rigs.modes import frame_modes_figure, grip_figure, string_modes_figure
from drake_racket.rigs.modes import comparisons as mode_comparisons
from drake_racket.rigs.modes import frame_modes
from drake_racket.rigs.modes import shapes as mode_shapes
from drake_racket.rigs.modes.modal_analysis import (
    SUPPORTS,
    linearise,
    modal_system,
    solve_modes,
)
from tests.conftest import ROOT
from tests.oracles import modes as oracle
from tests.oracles.two_body import (
    free_free_frequency,
    handle_clamped_frequency,
    reduced_inertia,
)

STUDY = ROOT / "studies" / "frame_modes.py"
RACKETS = ("tour", "recreational")
PLANES = mode_shapes.PLANES
PUBLISHED = {"tour": (158.0, 132.0), "recreational": (178.0, 150.0)}  # Hz, in and out of plane


def frame_of(parameters: RacketParameters, plane: str) -> tuple[float, ...]:
    """m1, l1, c1, I1, m2, c2, I2, k, c of one plane, as the oracles take them."""
    handle, head = parameters.handle, parameters.head
    moment = "moi_frontal" if plane == "in_plane" else "moi_transverse"
    k, c = getattr(parameters.throat_joint, plane)()
    return (
        handle.mass.value,
        handle.length.value,
        handle.com.value,
        getattr(handle, moment).value,
        head.mass.value,
        head.com.value,
        getattr(head, moment).value,
        k,
        c,
    )


def bed_of(parameters: RacketParameters) -> dict[str, float]:
    bed = parameters.string_bed
    return {
        "spacing": bed.spacing.value,
        "a": bed.rim_semi_axis_x.value,
        "b": bed.rim_semi_axis_y.value,
        "t0": bed.initial_tension.value,
        "mass": bed.mass.value,
    }


def solve(parameters: RacketParameters, **where):
    return solve_modes(modal_system(parameters, **where))


# --- frame ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("racket", RACKETS)
@pytest.mark.parametrize("plane", PLANES)
def test_bare_frame_has_the_closed_form_modes(racket, plane):
    parameters = load_racket(racket)
    *bodies, k, c = frame_of(parameters, plane)
    m1, l1, c1, i1, m2, c2, i2 = bodies
    inertia = {
        "free": reduced_inertia(*bodies),
        "clamped_handle": i2 + m2 * c2**2,
        "clamped_head": i1 + m1 * (l1 - c1) ** 2,
    }
    assert handle_clamped_frequency(m2, c2, i2, k) == pytest.approx(
        np.sqrt(k / inertia["clamped_handle"]) / (2 * np.pi)
    )
    for support, j in inertia.items():
        modes = solve(parameters, strung=False, support=support)
        assert sorted(modes.kinds) == ["in_plane", "out_of_plane"]
        assert modes.rigid_motions == (6 if support == "free" else 0)
        i = modes.bending(plane)
        frequency = np.sqrt(k / j) / (2 * np.pi)
        zeta = c / (2.0 * np.sqrt(k * j))
        assert modes.frequencies[i] == pytest.approx(frequency, rel=1e-9)
        assert modes.damping_ratios[i] == pytest.approx(zeta, rel=1e-7)
        assert modes.damped_frequencies[i] == pytest.approx(
            frequency * np.sqrt(1.0 - zeta**2), rel=1e-8
        )


@pytest.mark.parametrize("racket", RACKETS)
def test_published_fundamentals_decide_the_joint_reading(racket):
    table = frame_modes.fundamentals_table(rackets=[racket], supports=["free"], strung=[False])
    table = table.sel(racket=racket, support="free", strung=False)
    assert table["published_frequency"].values == pytest.approx(PUBLISHED[racket])
    assert np.all(np.abs(table["difference"].sel(joint_reading="by_axis")) < 0.03)
    assert np.all(np.abs(table["difference"].sel(joint_reading="as_printed")) > 0.2)


@given(
    st.floats(1.0, 1e5),
    st.floats(1.0, 1e5),
    st.sampled_from(RACKETS),
)
@settings(max_examples=25, deadline=None)
def test_a_mode_is_named_by_its_strain_whatever_its_place(k_in, k_out, racket):
    parameters = copy.deepcopy(load_racket(racket, joint_reading="as_printed"))
    joint = parameters.throat_joint
    numbers = {"stiffness_in": k_in, "stiffness_out": k_out, "damping_in": 0.0, "damping_out": 0.0}
    changes = {k: dataclasses.replace(getattr(joint, k), value=v) for k, v in numbers.items()}
    parameters = dataclasses.replace(parameters, throat_joint=dataclasses.replace(joint, **changes))
    modes = solve(parameters, strung=False)
    for plane in PLANES:
        *frame, _ = frame_of(parameters, plane)
        i = modes.bending(plane)
        assert modes.kinds[i] == plane
        assert modes.frequencies[i] == pytest.approx(free_free_frequency(*frame), rel=1e-8)
        assert modes.strain_shares[i] == pytest.approx(
            np.eye(4)[modes.elements.index(plane)], abs=1e-9
        )


# --- strings --------------------------------------------------------------------------------------


def test_clamped_bed_has_the_nine_frequencies_of_the_hand_written_problem(bed):
    parameters = load_racket(*bed)
    modes = solve(parameters, support="clamped_head")
    strings = [i for i, kind in enumerate(modes.kinds) if kind == "string_bed"]
    expected = oracle.string_bed_frequencies(**bed_of(parameters))
    assert modes.frequencies[strings] == pytest.approx(expected, rel=1e-8)
    assert np.allclose(modes.damping_ratios[strings], 0.0, atol=1e-12)
    # an undamped string keeps its damper out of sight: dL/dt is of second order
    damping = dataclasses.replace(parameters.string_bed.damping, value=5.0)
    bed = dataclasses.replace(parameters.string_bed, damping=damping)
    damped = dataclasses.replace(parameters, string_bed=bed)
    again = solve(damped, support="clamped_head")
    assert np.allclose(again.damping_ratios[strings], 0.0, atol=1e-12)


def test_clamped_string_shapes_are_symmetric_or_antisymmetric(bed):
    coupling = mode_comparisons.string_bed_coupling(*bed)
    for name in ("lateral", "axial"):
        symmetry = coupling[f"{name}_symmetry"].to_numpy()
        assert np.abs(symmetry) == pytest.approx(np.ones(9), abs=1e-8)
    # of 3 x 3 points: 4 shapes even both ways, 2 + 2 odd one way, 1 odd both ways
    signs = np.sign([coupling["lateral_symmetry"], coupling["axial_symmetry"]]).astype(int)
    found = sorted(map(tuple, signs.T.tolist()))
    assert found == [(-1, -1)] + [(-1, 1)] * 2 + [(1, -1)] * 2 + [(1, 1)] * 4


@pytest.mark.parametrize("racket", RACKETS)
def test_strung_free_racket_has_the_modes_of_the_hand_written_matrices(racket):
    parameters = load_racket(racket)
    bed, gsc = bed_of(parameters), parameters.string_bed.gsc.value
    roll = parameters.handle.moi_longitudinal.value + parameters.head.moi_longitudinal.value
    out = oracle.strung_out_of_plane(frame_of(parameters, "out_of_plane"), roll, gsc, **bed)
    inside = oracle.strung_in_plane(
        frame_of(parameters, "in_plane"), gsc, bed["spacing"], bed["mass"]
    )
    expected = np.sort([*out.frequencies()[3:], *inside.frequencies()[2:]])
    modes = solve(parameters)
    assert modes.frequencies == pytest.approx(expected, rel=1e-8)
    eigenvalues = np.array([*out.eigenvalues()[-10:], *inside.eigenvalues()[-1:]])
    eigenvalues = eigenvalues[np.argsort(np.abs(eigenvalues))]
    assert modes.damped_frequencies == pytest.approx(eigenvalues.imag / (2 * np.pi), rel=1e-8)
    zeta = -eigenvalues.real / np.abs(eigenvalues)
    assert modes.damping_ratios == pytest.approx(zeta, rel=1e-5, abs=1e-9)
    assert modes.kinds.count("string_bed") == 9


@pytest.mark.parametrize("racket", RACKETS)
def test_strings_and_frame_couple_only_where_symmetry_lets_them(racket):
    coupling = mode_comparisons.string_bed_coupling(racket)
    even = coupling["lateral_symmetry"] > 0
    joint = coupling["joint_strain_share"]
    assert np.all(joint.where(even, drop=True) > 1e-9)
    assert np.all(joint.where(~even, drop=True) < 1e-20)
    # freeing a mass that was held raises the frequency; odd both ways moves nothing
    shift = coupling["shift"].to_numpy()
    still = ((coupling["lateral_symmetry"] < 0) & (coupling["axial_symmetry"] < 0)).to_numpy()
    assert np.all(shift[~still] > 1e-6)
    assert shift[still] == pytest.approx([0.0], abs=1e-10)
    assert 0.03 < shift[0] < 0.05
    assert np.all(coupling["overlap"] > 0.99)


# --- linearisation --------------------------------------------------------------------------------


@pytest.mark.parametrize("support", SUPPORTS)
@pytest.mark.parametrize("strung", [False, True])
def test_modes_diagonalise_what_drake_linearises(support, strung):
    system = modal_system(load_racket(), strung=strung, support=support)
    linear, modes = linearise(system), solve_modes(system)
    m, k, n = linear.mass, linear.stiffness, len(modes.kinds)
    assert modes.shapes.T @ m @ modes.shapes == pytest.approx(np.eye(n), abs=1e-9)
    squares = (2 * np.pi * modes.frequencies) ** 2
    assert modes.shapes.T @ k @ modes.shapes == pytest.approx(np.diag(squares), abs=1e-9 * k.max())
    assert modes.strain_shares.sum(axis=1) == pytest.approx(np.ones(n), abs=1e-9)
    # every damped pair is an eigenvalue of Drake's own state matrix, each once
    drake = Linearize(
        system.diagram, system.context, InputPortSelection.kNoInput, OutputPortSelection.kNoOutput
    ).A()
    values = np.linalg.eigvals(drake)
    values = np.sort(values.imag[values.imag > 1.0]) / (2 * np.pi)
    assert np.sort(modes.damped_frequencies) == pytest.approx(values, rel=1e-9)
    # light damping leaves the shapes nearly real, and in phase with the undamped ones
    light = modes.damping_ratios < 0.02
    difference = modes.complex_shapes[:, light] - modes.shapes[:, light]
    norms = np.sqrt(np.einsum("ij,ik,kj->j", difference.conj(), m, difference).real)
    assert np.all(norms < 0.05)


# --- grip -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("racket", RACKETS)
@pytest.mark.parametrize("factor", [1e-2, 1.0, 30.0])
def test_gripped_frame_has_the_modes_of_the_hand_written_matrices(racket, factor):
    parameters, grip = load_racket(racket), load_grip().scaled(factor, 0.3)
    modes = solve(parameters, strung=False, support="grip", grip=grip)
    shapes = mode_shapes.mode_shapes(modes)
    for plane, force, torque in (("out_of_plane", 2, 1), ("in_plane", 1, 2)):
        frame = frame_of(parameters, plane)
        expected = oracle.bending_plane(*frame)
        oracle.add_grip(
            expected,
            frame[1],
            parameters.landmarks.grip.value,
            (grip.force_stiffness.value[force], grip.force_damping.value[force]),
            (grip.torque_stiffness.value[torque], grip.torque_damping.value[torque]),
        )
        at = [i for i in range(len(modes.kinds)) if shapes.plane(i) == plane]
        assert modes.frequencies[at] == pytest.approx(expected.frequencies(), rel=1e-8)
        found = np.sort(modes.damped_frequencies[at])
        found = found[np.isfinite(found)]
        eigenvalues = np.sort(expected.eigenvalues().imag) / (2 * np.pi)
        assert found == pytest.approx(eigenvalues, rel=1e-7)


def test_each_axis_of_the_grip_is_its_own():
    """Roll and axial motion see one spring each: sqrt(k / I) in closed form."""
    parameters, grip = load_racket(), load_grip()
    modes = solve(parameters, strung=False, support="grip")
    shapes = mode_shapes.mode_shapes(modes)
    alone = [i for i in range(8) if shapes.plane(i) is None]
    mass = parameters.handle.mass.value + parameters.head.mass.value
    roll = parameters.handle.moi_longitudinal.value + parameters.head.moi_longitudinal.value
    expected = [grip.torque_stiffness.value[0] / roll, grip.force_stiffness.value[0] / mass]
    assert modes.frequencies[alone] == pytest.approx(np.sqrt(expected) / (2 * np.pi), rel=1e-9)
    assert [modes.kinds[i] for i in alone] == ["rigid", "rigid"]


@pytest.mark.parametrize("strung", [False, True])
def test_frequencies_rise_from_the_free_to_the_clamped_racket(strung):
    sweep = mode_comparisons.grip_sweep(
        strung=strung, factors=[1e-6, 1e-2, 1.0, 10.0, 1e2, 1e3, 1e7]
    )
    frequency = sweep["frequency"].to_numpy()
    assert np.all(np.diff(frequency, axis=0) > 0.0)
    free, clamped = sweep["free_frequency"].to_numpy(), sweep["clamped_frequency"].to_numpy()
    assert np.all(free[:, :2] == 0.0)
    assert np.all(frequency[0, :, :2] < 0.1)
    assert frequency[0, :, 2] == pytest.approx(free[:, 2], rel=1e-5)
    limited = np.isfinite(clamped)
    assert limited.sum(axis=1).tolist() == ([1, 3] if strung else [1, 1])
    assert frequency[-1][limited] == pytest.approx(clamped[limited], rel=1e-3)
    assert np.all(frequency <= clamped * (1 + 1e-9))
    assert np.all(frequency[-1][~limited] > 1e4)
    # the free limit is the free bending mode, the clamped one the head on the throat joint
    for j, plane in enumerate(PLANES):
        for values, support, order in ((free, "free", 2), (clamped, "clamped_handle", 0)):
            modes = solve(load_racket(), strung=strung, support=support)
            assert values[j, order] == modes.frequencies[modes.bending(plane)]
        kinds = sweep["kind"].sel(plane=plane).to_numpy()
        assert kinds[0].tolist() == ["rigid", "rigid", plane]
        assert kinds[-1, 0] == plane


def test_an_overdamped_mode_has_no_damped_frequency():
    grip = load_grip().scaled(1.0, 20.0)
    modes = solve(load_racket(), strung=False, support="grip", grip=grip)
    assert np.all(np.isfinite(modes.frequencies))
    gone = np.isnan(modes.damped_frequencies)
    assert 0 < np.count_nonzero(gone) < len(gone)
    assert np.array_equal(gone, np.isnan(modes.damping_ratios))


def test_a_grip_is_set_in_the_context_as_if_built_anew():
    parameters, other = load_racket(), load_grip().scaled(7.0, 0.1)
    system = modal_system(parameters, support="grip")
    before = solve_modes(system)
    system.grip.set_stiffness(system.context, other)
    anew = solve(parameters, support="grip", grip=other)
    changed = solve_modes(system)
    assert changed.frequencies == pytest.approx(anew.frequencies, rel=1e-12)
    assert changed.damping_ratios == pytest.approx(anew.damping_ratios, rel=1e-9, abs=1e-12)
    np.testing.assert_allclose(changed.strain_shares, anew.strain_shares, rtol=1e-9, atol=1e-12)
    assert not np.allclose(before.frequencies, anew.frequencies, rtol=1e-3)


def test_a_grip_in_a_users_plant():
    plant = MultibodyPlant(0.0)
    racket = add_racket(plant, load_racket())
    grip = add_grip(plant, racket, plant.world_frame(), load_grip(), held_at="butt")
    assert grip.racket_frame is racket.frame("butt")
    # the racket's own bushing is still found: the grip is another one
    assert find_racket(plant, racket.model_instance, racket.parameters).bushing is racket.bushing
    plant.Finalize()
    context = plant.CreateDefaultContext()
    stiffness = grip.bushing.GetForceStiffnessConstants(context)
    assert tuple(stiffness) == load_grip().force_stiffness.value
    with pytest.raises(InputError, match=r"^add_grip: plant: got 'finalized'"):
        add_grip(plant, racket, plant.world_frame(), load_grip())


def test_scaled_grip():
    grip = load_grip()
    twice = grip.scaled(4.0)
    assert twice.torque_stiffness.value == tuple(4.0 * x for x in grip.torque_stiffness.value)
    assert twice.force_damping.value == pytest.approx([2.0 * x for x in grip.force_damping.value])
    assert twice.force_stiffness.status == "inferred"
    assert grip.scaled(1.0) == grip


# --- nodes and antinodes --------------------------------------------------------------------------


@pytest.mark.parametrize("racket", RACKETS)
@pytest.mark.parametrize("plane", PLANES)
def test_nodes_are_where_momentum_puts_them(racket, plane):
    dataset = frame_modes.modes_dataset(racket, strung=False)
    mode = dataset.isel(mode=int(np.flatnonzero(dataset["kind"] == plane)[0]))
    *bodies, _, _ = frame_of(load_racket(racket), plane)
    expected = oracle.free_free_nodes(*bodies)
    assert mode["node_exact"].to_numpy() == pytest.approx(expected, abs=1e-9)
    assert float(mode["antinode_exact"]) == load_racket(racket).handle.length.value
    # the shape itself vanishes there
    shape = mode["shape"].sel(direction=plane)
    assert np.abs(shape.interp(x=list(expected))).max() < 0.01
    other = {"in_plane": "out_of_plane", "out_of_plane": "in_plane"}[plane]
    assert np.abs(mode["shape"].sel(direction=other)).max() < 1e-9


@pytest.mark.parametrize("racket", RACKETS)
def test_head_node_is_the_strung_rackets(racket):
    parameters = load_racket(racket)
    node = mode_shapes.head_node(parameters)
    # strings at 450 Hz move nearly with the head: their mass put on it gives nearly the node
    m1, l1, c1, i1, m2, c2, i2, _, _ = frame_of(parameters, "out_of_plane")
    bed, gsc = bed_of(parameters), parameters.string_bed.gsc.value
    m = bed["mass"]
    com = (m2 * c2 + m * gsc) / (m2 + m)
    inertia = i2 + m2 * (c2 - com) ** 2 + m * ((gsc - com) ** 2 + 2 / 3 * bed["spacing"] ** 2)
    _, expected = oracle.free_free_nodes(m1, l1, c1, i1, m2 + m, com, inertia)
    assert node == pytest.approx(expected, abs=1e-3)
    _, bare = oracle.free_free_nodes(m1, l1, c1, i1, m2, c2, i2)
    assert abs(node - bare) > 1.3e-3


@pytest.mark.parametrize("racket", RACKETS)
@pytest.mark.parametrize("plane", PLANES)
def test_regression_tends_to_the_nearest_quadratic(racket, plane):
    dataset = frame_modes.modes_dataset(racket, strung=False, samples=10_000)
    mode = dataset.isel(mode=int(np.flatnonzero(dataset["kind"] == plane)[0]))
    parameters = load_racket(racket)
    throat = parameters.handle.length.value
    tip = throat + parameters.head.length.value
    corners = mode["shape"].sel(direction=plane).sel(x=[0.0, throat, tip]).to_numpy()
    nodes, antinode = oracle.quadratic_landmarks(corners, throat, tip)
    assert mode["node_regression"].to_numpy() == pytest.approx(nodes, abs=2e-5)
    assert float(mode["antinode_regression"]) == pytest.approx(antinode, abs=2e-5)


@given(st.floats(0.02, 0.30), st.floats(0.35, 0.66), st.floats(-5.0, 5.0), st.integers(4, 60))
@settings(max_examples=40, deadline=None)
def test_regression_of_a_parabola_is_the_parabola(first, second, height, samples):
    if abs(height) < 1e-3:
        height = 1.0
    curve = height * Polynomial.fromroots([first, second])
    x = mode_shapes.sample_points(load_racket(), samples)
    marks = mode_shapes.regression_landmarks(mode_shapes.quadratic_fit(x, curve(x)), x[-1])
    assert marks.nodes == pytest.approx((first, second), abs=1e-7)
    assert marks.antinode == pytest.approx(0.5 * (first + second), abs=1e-7)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
@settings(max_examples=60, deadline=None)
def test_exact_nodes_are_zeros_of_the_straight_pieces(butt, throat, tip):
    marks = mode_shapes.exact_landmarks(np.array([butt, throat, tip]), (0.0, 0.4, 0.7))
    for node, changes in zip(marks.nodes, (butt * throat < 0, throat * tip < 0), strict=True):
        if not np.isnan(node):
            assert changes
            scale = max(map(abs, (butt, throat, tip)))
            assert np.interp(node, [0.0, 0.4, 0.7], [butt, throat, tip]) == pytest.approx(
                0.0, abs=1e-9 * scale
            )
    assert np.isnan(marks.antinode) == bool(np.any(np.isnan(marks.nodes)))


def test_a_clamped_body_has_no_node():
    for support, still in (("clamped_handle", 0), ("clamped_head", 1)):
        dataset = frame_modes.modes_dataset(strung=False, support=support)
        assert np.all(np.isnan(dataset["node_exact"][:, still]))
        assert np.all(np.isnan(dataset["antinode_exact"]))


# --- datasets, figures, study ---------------------------------------------------------------------


@pytest.mark.parametrize("support", SUPPORTS)
def test_dataset_is_labelled_normalised_and_survives_netcdf(tmp_path, support):
    dataset = frame_modes.modes_dataset("recreational", support=support)
    for name, variable in dataset.data_vars.items():
        assert variable.attrs["units"], name
        assert variable.attrs["long_name"], name
    assert np.abs(dataset["shape"]).max() <= 1.0 + 1e-9
    sizes = np.maximum(
        np.abs(dataset["shape"]).max(("direction", "x")),
        np.abs(dataset["string_shape"]).max("point"),
    )
    bends = dataset["kind"].isin(["in_plane", "out_of_plane", "string_bed"])
    assert np.all(sizes.where(bends, drop=True) > 0.99)
    assert np.all(dataset["frequency"].diff("mode") > 0.0)
    write_netcdf(dataset, tmp_path / "modes.nc")
    with xarray.open_dataset(tmp_path / "modes.nc", engine="h5netcdf") as back:
        xarray.testing.assert_equal(back.load(), dataset)
        assert back.attrs["support"] == support


def test_fundamentals_table_holds_every_case_once():
    grip = load_grip().scaled(2.0, 3.0)
    table = frame_modes.fundamentals_table(rackets=["tour"], joint_readings=["by_axis"], grip=grip)
    assert dict(table.sizes) == {
        "racket": 1, "joint_reading": 1, "strung": 2, "support": 4, "plane": 2,
    }  # fmt: skip
    assert np.all(np.isfinite(table["frequency"]))
    assert np.all(np.isfinite(table["difference"]) == (table["support"] == "free"))
    row = table.sel(racket="tour", joint_reading="by_axis", strung=True, support="grip")
    modes = solve(load_racket(), support="grip", grip=grip)
    at = [modes.bending(plane) for plane in PLANES]
    assert row["frequency"].to_numpy() == pytest.approx(modes.frequencies[at])
    assert row["damping_ratio"].to_numpy() == pytest.approx(modes.damping_ratios[at])


def test_a_users_racket_has_no_published_numbers(tmp_path):
    from drake_racket.io.shipped import data_directory

    path = tmp_path / "mine.yaml"
    path.write_text((data_directory() / "tour_low.yaml").read_text().replace("tour_low", "mine"))
    dataset = frame_modes.modes_dataset(str(path))
    assert np.all(np.isnan(dataset["published_frequency"]))
    figure = frame_modes_figure(dataset, load_racket(str(path)))
    write_figure(figure, tmp_path / "mine.png")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: frame_modes.modes_dataset("club"), "racket: got 'club'"),
        (lambda: frame_modes.modes_dataset(support="vice"), "support: got 'vice'; allowed: free"),
        (lambda: frame_modes.modes_dataset(samples=3), "samples: got 3; allowed: 4 to"),
        (lambda: frame_modes.modes_dataset(grip=load_grip()), "grip: got 'normal'; allowed: no"),
        (lambda: frame_modes.fundamentals_table(rackets=[]), "racket: got"),
        (lambda: frame_modes.fundamentals_table(supports="free"), "support: got 'free'"),
        (lambda: mode_comparisons.grip_sweep(factors=[]), "factors: got"),
        (lambda: mode_comparisons.grip_sweep(factors=[2.0, 1.0]), "factors: got"),
        (lambda: mode_comparisons.grip_sweep(factors=[0.0]), "factor: got 0.0"),
        (lambda: mode_comparisons.grip_sweep(factors=[1.0, 1e99]), "factors: got"),
        (lambda: load_grip("vice"), "grip: got 'vice'; allowed: loose, normal, tight"),
        (lambda: load_grip().scaled(-1.0), "GripStiffness.scaled: factor: got -1.0"),
        (lambda: load_grip().scaled(1.0, float("nan")), "GripStiffness.scaled: damping_factor"),
        (lambda: solve(load_racket()).bending("torsion"), "Modes.bending: plane: got 'torsion'"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(InputError) as caught:
        call()
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("force_stiffness", [1.0, 2.0], "at least 3 numbers"),
        ("force_damping", [1.0] * 4, "3 numbers: x, y, z"),
        ("torque_stiffness", [1.0, -2.0, 3.0], "0 or more"),
        ("torque_damping", [1.0, float("inf"), 3.0], "a finite number"),
    ],
)
def test_a_grip_that_does_not_fit_is_refused(field, value, message):
    grip = load_grip()
    values = dataclasses.replace(getattr(grip, field), value=value)
    bad = dataclasses.replace(grip, **{field: values})
    with pytest.raises(InputError, match=message) as caught:
        modal_system(load_racket(), support="grip", grip=bad)
    assert field in str(caught.value)


def test_a_sweep_refuses_a_grip_that_leaves_a_motion_free():
    grip = load_grip()
    hinge = dataclasses.replace(
        grip, force_stiffness=dataclasses.replace(grip.force_stiffness, value=[0.0, 1.0, 1.0])
    )
    with pytest.raises(InputError, match="force_stiffness"):
        mode_comparisons.grip_sweep(grip=hinge)
    # the modes of such a grip are fine: what it leaves free is counted
    assert solve(load_racket(), support="grip", grip=hinge).rigid_motions == 1
    nothing = GripStiffness(**{**vars(grip.scaled(0.0, 0.0))})
    assert solve(load_racket(), support="grip", grip=nothing).rigid_motions == 6


@pytest.mark.parametrize(
    ("factors", "refused"),
    [
        ([1e-6, 1e8], ""),
        ([0.999e-6, 1.0], "factors from 1e-6 to 1e8"),
        ([1.0, 1.001e8], "factors from 1e-6 to 1e8"),
        ([1.0, 2.0, 1.001e8], "factors from 1e-6 to 1e8"),
        ([1.0, 1.0], "rising factors"),
        ([0.0, 1.0], "factor"),
        ([], "1 to 1000 factors"),
        (range(1, 1001), ""),
        (range(1, 1002), "1 to 1000 factors"),
    ],
)
def test_factors_of_a_sweep_have_borders(factors, refused):
    with pytest.raises(InputError, match=refused) if refused else contextlib.nullcontext():
        mode_comparisons._check_sweep(load_grip(), list(factors))


def test_figures_mark_what_the_data_hold(tmp_path):
    racket = load_racket()
    dataset = frame_modes.modes_dataset(strung=False)
    figure = frame_modes_figure(dataset, racket)
    for axes, plane in zip(figure.axes, ("out_of_plane", "in_plane"), strict=True):
        lines = {line.get_label(): line for line in axes.get_lines()}
        mode = dataset.isel(mode=int(np.flatnonzero(dataset["kind"] == plane)[0]))
        for how in ("exact", "regression"):
            drawn = lines[f"nodes, {how}"].get_xdata()
            assert drawn == pytest.approx(1e3 * mode[f"node_{how}"].to_numpy())
        published = lines["antinode, published"].get_xdata()[0]
        assert published == pytest.approx(1e3 * float(mode["published_antinode"]))
    string_figure = string_modes_figure(mode_comparisons.string_bed_coupling(), racket)
    assert len(string_figure.axes) == 10  # nine modes and the colour bar
    sweep = mode_comparisons.grip_sweep(factors=[0.1, 1.0])
    for name, drawing in (("a", figure), ("b", string_figure), ("c", grip_figure([sweep]))):
        write_figure(drawing, tmp_path / f"{name}.png")
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000


@pytest.mark.slow
def test_study(tmp_path):
    command = [sys.executable, str(STUDY), "--out", str(tmp_path / "out"), "--quick"]
    done = subprocess.run(
        [*command, "--racket", "tour"], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert "154.6 ( -2.1)" in done.stdout
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {
        "fundamentals.nc", "fundamentals.csv", "grip_tour.nc", "grip.png", "modes_tour_bare.nc",
        "modes_tour_bare.png", "modes_tour_strung.nc", "modes_tour_strung.png",
        "string_modes_tour.nc", "string_modes_tour.png",
    }  # fmt: skip
    with xarray.open_dataset(tmp_path / "out" / "fundamentals.nc", engine="h5netcdf") as back:
        free = back["frequency"].sel(racket="tour", joint_reading="by_axis", support="free")
        assert free.sel(strung=False).values == pytest.approx([154.622, 128.541], abs=1e-3)
    header = (tmp_path / "out" / "fundamentals.csv").read_text().splitlines()[0]
    assert "frequency [Hz]" in header
    bad = subprocess.run(
        [*command, "--racket", "club"], capture_output=True, text=True, timeout=120
    )
    assert bad.returncode == 2
    assert bad.stderr.startswith("studies/frame_modes.py: racket: got 'club'")
    assert bad.stderr.count("\n") == 1
