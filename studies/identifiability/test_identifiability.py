"""Derivatives by scaling laws, the linear algebra, a degeneracy in closed form, and real refits."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_racket.engines.clamped.batch import bed_parameters, make_bed
from drake_racket.io.errors import InputError
from drake_racket.laws.bed import grid_topology
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.racket import load_racket
from drake_racket.rigs.static_stiffness import static_deflection
from studies.identifiability.cases import Case, design_cases, measurement_cases
from studies.identifiability.figures import (
    directions_figure,
    errors_figure,
    per_cent,
    profiles_figure,
    refits_figure,
)
from studies.identifiability.information import (
    analyse,
    identifiability_dataset,
    information,
    rim_pairs,
)
from studies.identifiability.measurements import (
    QUANTITIES,
    Design,
    Errors,
    all_names,
    measure,
    pressed,
)
from studies.identifiability.refits import (
    BedProblem,
    profiles_dataset,
    refits_dataset,
)
from tests.conftest import BEDS

BALL = load_ball()
TOUR = load_racket("tour", "low")
NAMES = all_names(TOUR)
ELASTIC = [NAMES.index(n) for n in ("T0", "k1", "k2", "k3", "k4")]
KB, CB = NAMES.index("kb"), NAMES.index("cb")
SHAPE = Case("shape", ("static_shape",))
EXACT = replace(SHAPE, errors=Errors(static_deflection=1e-6))  # so that all is nearly linear
STUDY = "studies.identifiability"


def test_impacts_scale_with_stiffness_and_speed():
    # all stiffnesses times s, cb and the speed times sqrt(s): the same path, sqrt(s) times as fast
    speed, h = 14.0, 1e-3  # below 18 m/s: kb and cb do not change with speed
    kinds = ("restitution", "contact_time", "deflection")
    at = {
        v: measure(TOUR, BALL, kinds, design=Design(points=(1, 5), speeds=(v,)))
        for v in (speed, speed * np.exp(h), speed * np.exp(-h))
    }
    middle, up, down = at.values()
    for kind, power in zip(kinds, (0.0, -0.5, 0.0), strict=True):
        by_speed = (up[kind].values - down[kind].values) / (2.0 * h)
        j = middle[kind].jacobian
        total = j[:, ELASTIC].sum(1) + j[:, KB] + 0.5 * j[:, CB] + 0.5 * by_speed
        assert total == pytest.approx(
            power * middle[kind].values, rel=2e-6, abs=1e-6 * abs(j).max()
        )


@pytest.mark.parametrize("bed", BEDS, ids="_".join)
def test_static_deflection_scales_with_stiffness_and_force(bed):
    racket, h = load_racket(*bed), 1e-4
    at = [
        measure(racket, BALL, ["static_shape"], design=Design(points=(2, 9), forces=(f,)))
        for f in (400.0, 400.0 * np.exp(h), 400.0 * np.exp(-h))
    ]
    middle, up, down = (blocks["static_shape"] for blocks in at)
    by_force = (up.values - down.values) / (2.0 * h)
    total = middle.jacobian[:, ELASTIC].sum(1) + by_force
    assert total == pytest.approx(0.0 * total, abs=1e-7 * by_force.max())


def test_static_derivatives_one_by_one():
    design, h = Design(points=(1, 5), forces=(700.0,)), 1e-4
    x = bed_parameters(TOUR)[1]
    middle = measure(TOUR, BALL, ["static_shape"], design=design)["static_shape"]
    for i in range(len(x)):
        ends = []
        for sign in (1.0, -1.0):
            y = x.copy()
            y[i] *= np.exp(sign * h)
            ends.append(measure(TOUR, BALL, ["static_shape"], design=design, values=y))
        slope = (ends[0]["static_shape"].values - ends[1]["static_shape"].values) / (2.0 * h)
        assert middle.jacobian[:, i] == pytest.approx(slope, abs=1e-6 * abs(middle.jacobian).max())
    assert not middle.jacobian[:, [KB, CB]].any()


def test_pressed_is_the_rig():
    constants = make_bed(TOUR).constants
    for point, force in ((1, 10.0), (5, 1200.0)):
        expected = static_deflection(TOUR, point, force)
        assert pressed(constants, grid_topology().incidence, point, force) == pytest.approx(
            expected, abs=1e-12
        )


def test_noise_of_restitution():
    errors = Errors(speed=0.3, repeats=5.0)
    design = Design(points=(5,), speeds=(18.0,))
    block = measure(TOUR, BALL, ["restitution"], design=design, errors=errors)["restitution"]
    e, rng = block.values[0], np.random.default_rng(3)
    noise = 0.3 * rng.standard_normal((2, 40000, 5))
    mean = ((18.0 * e + noise[0]) / (18.0 + noise[1])).mean(axis=1)
    assert mean.std() == pytest.approx(block.sigma[0], rel=0.02)


def test_corner_rim_springs_trade_off():
    # both rim springs of a corner hold one mass: of k each feels k z^3/(2 L0^2) + ..; so only
    # the sum of k/L0^2 matters while z is small, and p2 k2, p5 k2 against p4 k1 is what no shape of
    # the bed shows
    bed = TOUR.string_bed
    (k1, k2), spacing = bed.stiffness.value[:2], 0.0685
    a, b = bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value
    main = a * np.sqrt(1.0 - (spacing / b) ** 2) - spacing
    cross = b * np.sqrt(1.0 - (spacing / a) ** 2) - spacing
    p = dict(zip(("p1", "p2", "p3", "p4", "p5", "p6"), bed.rim_factors.value, strict=True))
    expected = np.zeros(11)
    expected[NAMES.index("p2")] = main**2 / (p["p2"] * k2)
    expected[NAMES.index("p5")] = main**2 / (p["p5"] * k2)
    expected[NAMES.index("p4")] = -(cross**2) / (p["p4"] * k1)
    gentle = replace(SHAPE, design=Design(forces=(100.0,)))
    found = analyse(TOUR, BALL, gentle)
    cosine = abs(expected @ found.directions[-1]) / np.linalg.norm(expected)
    assert cosine == pytest.approx(1.0, abs=1e-5)
    assert found.singular_values[-1] < 1e-2 * found.singular_values[-2]


def test_left_and_right_tell_the_same():
    block = measure(TOUR, BALL, ["restitution"], design=Design(speeds=(25.0,)))["restitution"]
    rows = block.scaled
    for left, right in ((1, 3), (4, 6), (7, 9)):
        assert rows[left - 1] == pytest.approx(rows[right - 1], rel=1e-9)


def test_information_is_the_inverse():
    rows = np.random.default_rng(1).normal(size=(20, 4)) * [1.0, 10.0, 0.1, 3.0]
    found = information("abcd", rows)
    expected = np.linalg.inv(rows.T @ rows)
    assert found.covariance == pytest.approx(expected, rel=1e-9)
    assert found.standard_errors == pytest.approx(np.sqrt(np.diag(expected)), rel=1e-9)
    by_regression = 1.0 / np.sqrt(np.sum(rows**2, axis=0))
    assert found.alone == pytest.approx(by_regression)
    weights = np.array([1.0, 0.0, -2.0, 0.0])
    variance = weights @ expected @ weights
    assert found.error_of({"a": 1.0, "c": -2.0}) == pytest.approx(np.sqrt(variance))


def test_what_only_a_product_is_known_of():
    rng = np.random.default_rng(2)
    both = rng.normal(size=12)
    found = information(("a", "b", "c"), np.stack([both, both, rng.normal(size=12)], axis=1))
    assert np.isinf(found.standard_errors).tolist() == [True, True, False]
    assert found.error_of({"a": 1.0, "b": 1.0}) < 2.0
    assert np.isinf(found.error_of({"a": 1.0}))
    fewer = information(("a", "b", "c"), rng.normal(size=(2, 3)))
    assert np.isinf(fewer.standard_errors).all()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(4, 12), st.integers(1, 6))
def test_more_measurements_never_hurt(seed, count, more):
    rows = np.random.default_rng(seed).normal(size=(count + more, 4))
    before, after = information("abcd", rows[:count]), information("abcd", rows)
    assert (after.standard_errors <= before.standard_errors * (1.0 + 1e-9)).all()
    assert (after.standard_errors >= after.alone * (1.0 - 1e-9)).all()


@pytest.fixture(scope="module")
def dataset():
    return identifiability_dataset(measurement_cases(), rackets=["tour"], tensions=["low"])


def test_findings_of_the_document(dataset):
    bed = dataset.sel(bed="tour low")
    determined = bed["parameters_determined"]
    assert determined.sel(case="restitution (published)").values.tolist() == [1, 6]
    assert determined.sel(case="+ static shape").values.tolist() == [8, 9]
    errors = bed["standard_error"].sel(parameter="T0")
    assert float(errors.sel(case="restitution (published)")) < 0.05
    assert float(errors.sel(case="restitution, ball fitted")) > 1.0
    assert float(errors.sel(case="+ contact time, ball fitted")) < 0.02
    # the bound can only rise with more unknowns
    known = bed["standard_error"].isel(parameter=slice(11))
    for name in ("+ contact time", "+ static stiffness", "+ static shape"):
        assert (known.sel(case=f"{name}, ball fitted") >= known.sel(case=name) * (1 - 1e-9)).all()


def test_dataset_is_labelled(dataset):
    assert dataset["rim_group"].values.tolist() == [f"{p}*{k}" for p, k in rim_pairs(TOUR)]
    for variable in dataset.variables.values():
        assert {"units", "long_name"} <= set(variable.attrs)
    held = dataset["standard_error"].sel(case="restitution (published)", parameter=["kb", "cb"])
    assert held.isnull().all()
    one = dataset.sel(bed="tour low", case="restitution (published)")
    p, k = (one["standard_error"].sel(parameter=n) for n in ("p6", "k4"))
    r = one["rim_correlation"].sel(rim_group="p6*k4")
    both = np.sqrt(float(p**2 + k**2 + 2 * r * p * k))
    assert float(one["product_error"].sel(rim_group="p6*k4")) == pytest.approx(both)


def test_designs_have_the_same_number_of_impacts():
    counts = {
        case.name: case.errors.repeats * len(case.design.points) * len(case.design.speeds)
        for case in design_cases()
    }
    assert counts.pop("four times the impacts") == pytest.approx(1080.0)
    assert list(counts.values()) == pytest.approx([270.0] * len(counts))


def test_problem_differentiates_its_residuals():
    case = Case("both", ("restitution", "static"), design=Design((2, 7), (20.0,), (300.0,)))
    problem = BedProblem(TOUR, BALL, case, seed=4)
    x = problem.truth * np.linspace(0.8, 1.3, 11)
    j = problem.jacobian(x)
    for i, step in enumerate(1e-4 * x):
        ends = [problem.residuals(x + s * step * np.eye(11)[i]) for s in (1.0, -1.0)]
        slope = (ends[0] - ends[1]) / (2.0 * step)
        assert j[:, i] * x[i] == pytest.approx(slope * x[i], abs=1e-3)
    assert np.allclose(BedProblem(TOUR, BALL, case).residuals(problem.truth), 0.0)
    other = BedProblem(TOUR, BALL, case, seed=5)
    assert other.fingerprint() != problem.fingerprint()


@pytest.mark.slow
def test_profile_of_a_well_determined_parameter_is_the_parabola():
    found = profiles_dataset(TOUR, BALL, [EXACT], ["T0"], points=3)
    assert found["chi2_linear"].values[0, 0] == pytest.approx([6.25, 0.0, 6.25])
    assert found["chi2"].values[0, 0] == pytest.approx([6.25, 0.0, 6.25], rel=0.03, abs=1e-6)
    profiles_figure(found)


@pytest.fixture(scope="module")
def few_refits():
    return refits_dataset(TOUR, BALL, [SHAPE], repeats=3, seed=1, max_evaluations=3)


def test_refits_are_seeded(few_refits):
    again = refits_dataset(TOUR, BALL, [SHAPE], repeats=2, seed=2, max_evaluations=3)
    assert np.array_equal(again["log_ratio"].values[0], few_refits["log_ratio"].values[0, 1:])
    refits_figure(few_refits)


@pytest.mark.slow
def test_refits_scatter_as_the_linear_answer_says():
    case = replace(SHAPE, errors=Errors(static_deflection=1e-5))
    found = refits_dataset(TOUR, BALL, [case], repeats=16, max_evaluations=40).isel(case=0)
    good = found["standard_error"] < 0.1
    spread = found["log_ratio"].std("repeat", ddof=1)
    ratio = (spread / found["standard_error"])[good]
    assert good.sum() == 8
    # of 16, a standard deviation is within 0.55-1.5 of the true one in 99 of 100 cases
    assert ((ratio > 0.5) & (ratio < 1.55)).all()


def test_figures(dataset):
    errors_figure(dataset)
    directions_figure(dataset)
    assert [per_cent(e) for e in (np.nan, 0.0361, 3.984, 150.0, np.inf)] == [
        "",
        "3.6",
        "398",
        ">9999",
        ">9999",
    ]


@pytest.mark.parametrize(
    ("key", "call"),
    [
        ("speeds", lambda: Design(speeds=(2.0,))),
        ("points", lambda: Design(points=(10,))),
        ("forces", lambda: Design(forces=(0.0,))),
        ("contact_time", lambda: Errors(contact_time=0.0)),
        ("speed", lambda: Errors(speed=float("nan"))),
        ("quantities", lambda: Case("x", ("spin",))),
        ("ball", lambda: Case("x", ball="lost")),
        ("quantities", lambda: measure(TOUR, BALL, ["spin"])),
        ("cases", lambda: identifiability_dataset([])),
        ("cases", lambda: identifiability_dataset([SHAPE, replace(SHAPE, ball="fitted")])),
        ("parameter", lambda: profiles_dataset(TOUR, BALL, [SHAPE], ["kb"])),
        ("points", lambda: profiles_dataset(TOUR, BALL, [SHAPE], ["T0"], points=2)),
        ("repeats", lambda: refits_dataset(TOUR, BALL, [SHAPE], repeats=1)),
        ("ball", lambda: refits_dataset(TOUR, BALL, [replace(SHAPE, ball="fitted")], repeats=2)),
    ],
)
def test_refuses_in_one_line(key, call):
    with pytest.raises(InputError, match=f"^{key}: ") as caught:
        call()
    assert "\n" not in str(caught.value)


def test_every_quantity_has_its_unit():
    design = Design(points=(5,), speeds=(25.0,), forces=(400.0,))
    blocks = measure(TOUR, BALL, QUANTITIES, design=design, derivatives=False)
    assert 0.6 < blocks["restitution"].values[0] < 1.0
    assert 2e-3 < blocks["contact_time"].values[0] < 8e-3
    assert 5e-3 < blocks["deflection"].values[0] < 3e-2
    assert blocks["static"].values[0] == pytest.approx(blocks["static_shape"].values[4])
    assert blocks["static"].jacobian.shape == (1, 0)


@pytest.mark.slow
def test_study(tmp_path):
    out = tmp_path / "out"
    few = "--rackets tour --tensions low --points 1 2 4 5 7 8 --speeds 18 33 --forces 100 400"
    done = subprocess.run(
        [sys.executable, "-m", STUDY, "--out", str(out), *few.split()],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert {p.name for p in out.iterdir()} >= {"measurements.nc", "designs.csv"}
    bad = [sys.executable, "-m", STUDY, "--out", str(out), "--speeds", "1"]
    refused = subprocess.run(bad, capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert len(refused.stderr.strip().splitlines()) == 1
