"""The batch kernel against the Drake rig, an independent ODE, finite differences, and itself."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_racket import IntegratorSettings, Scenario, make_impact_diagram, simulate
from drake_racket.engines.clamped import batch as clamped
from drake_racket.engines.clamped import steps, surface
from drake_racket.engines.clamped.batch import OUTPUTS, bed_parameters, make_bed, make_impacts, run
from drake_racket.io.errors import InputError
from drake_racket.laws.bed import grid_topology
from drake_racket.laws.compilation import sources_stamp
from drake_racket.laws.strings import spring_law, spring_partials
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.racket import load_racket
from tests.conftest import BEDS, clamped_problem
from tests.oracles.clamped_impact import simulate as oracle

TIGHT = IntegratorSettings(accuracy=3e-6, maximum_step=5e-5)
FINE = 5e-6
BALL = load_ball()


def oblique(speed: float, incidence: float, azimuth: float) -> list[float]:
    """Velocity of the ball in the head; degrees."""
    angle, turn = math.radians(incidence), math.radians(azimuth)
    along = speed * math.sin(angle)
    return [along * math.cos(turn), along * math.sin(turn), -speed * math.cos(angle)]


def compare_with_oracle(bed, points, speeds) -> None:
    racket = load_racket(*bed)
    outcome = run([make_bed(racket)], make_impacts(racket, BALL, points, speeds), step=FINE)
    assert outcome.ended.all()
    assert (outcome.touches == 1).all()
    for i, (point, speed) in enumerate(zip(points, speeds, strict=True)):
        if point in (3, 6, 9):  # the mirror images of 1, 4, 7
            mirrored = outcome.values[i - 2]
            assert outcome.values[i] == pytest.approx(mirrored, rel=1e-12, abs=1e-12)
            continue
        expected = oracle(clamped_problem(*bed, int(point), float(speed)))
        row = dict(zip(OUTPUTS, outcome.values[i], strict=True))
        assert row["v_z"] == pytest.approx(expected.rebound_speed, abs=1e-7)
        assert row["contact_time"] == pytest.approx(expected.contact_time, abs=1e-9)
        assert row["peak_normal_force"] == pytest.approx(expected.peak_force, rel=1e-6)


def test_equals_the_oracle():
    compare_with_oracle(("tour", "high"), [1, 2, 3], [33.0, 18.0, 33.0])


@pytest.mark.slow
@pytest.mark.parametrize("bed", BEDS, ids="_".join)
def test_all_points_and_speeds_equal_the_oracle(bed):
    compare_with_oracle(bed, np.tile(np.arange(1, 10), 2), np.repeat([18.0, 33.0], 9))


SPEEDS = 18.0, 33.0
OBLIQUE = tuple(itertools.product(("velocity", "displacement"), (17.0, 73.0)))


def compare_with_drake(case, systems, normal: str = "linear") -> None:
    name, tension, point, speed, incidence, azimuth, reading = case
    scenario = Scenario(
        racket=name,
        tension=tension,
        support="clamped_head",
        point=point,
        speed=speed,
        incidence_deg=incidence,
        azimuth_deg=azimuth,
        friction_reading=reading,
        normal=normal,
        approach_time=1e-4,
        after=0.012 if incidence > 45.0 else 0.0085,
        audit=False,
        integrator=TIGHT,
    )
    key = name, tension
    if key not in systems:
        systems[key] = make_impact_diagram(scenario)
    result = simulate(scenario, systems[key], history=False)
    racket = load_racket(name, tension)
    velocity = np.array([oblique(speed, incidence, azimuth)])
    impacts = make_impacts(
        racket, load_ball(normal=normal), [point], velocity, friction_reading=reading
    )
    outcome = run([make_bed(racket)], impacts, step=2e-6)
    assert outcome.values[0, :3] == pytest.approx(result.rebound_velocity, abs=1e-6)
    assert outcome.values[0, 3] == pytest.approx(result.contact_time, abs=2e-8)
    assert outcome.values[0, 4] == pytest.approx(result.peak_normal_force, rel=1e-4)
    assert outcome.values[0, 5] == pytest.approx(result.peak_string_deflection, rel=1e-4)


def test_equals_the_drake_rig():
    compare_with_drake(("tour", "low", 1, 33.0, 0.0, 90.0, "velocity"), {})
    case = "recreational", "low", 5, 25.0, 16.0, 30.0, "displacement"
    compare_with_drake(case, {}, normal="hunt_crossley")


@pytest.mark.slow
@pytest.mark.parametrize("bed", BEDS[::3], ids="_".join)
def test_equals_the_drake_rig_everywhere(bed):
    systems: dict = {}
    for n, point in enumerate((1, 2, 4, 5, 7, 8)):  # the others are mirror images
        # the beds take turns: each point sees both speeds, both readings and both angles
        speed = SPEEDS[(n + BEDS.index(bed)) % 2]
        compare_with_drake((*bed, point, speed, 0.0, 90.0, "velocity"), systems)
        reading, angle = OBLIQUE[(n + BEDS.index(bed)) % 4]
        compare_with_drake((*bed, point, 31.0, angle, 60.0, reading), systems)


@pytest.mark.exhaustive
@pytest.mark.parametrize("bed", BEDS, ids="_".join)
@pytest.mark.parametrize("point", range(1, 10))
def test_equals_the_drake_rig_in_every_case(bed, point):
    systems: dict = {}
    for speed in SPEEDS:
        compare_with_drake((*bed, point, speed, 0.0, 90.0, "velocity"), systems)
    for reading, angle in OBLIQUE:
        compare_with_drake((*bed, point, 31.0, angle, 60.0, reading), systems)


def small_batch(free: int = 0) -> clamped.Impacts:
    racket = load_racket("recreational", "low")
    velocities = np.array(
        [[0.0, 0.0, -33.0], oblique(25.0, 74.0, -90.0), oblique(31.0, 40.0, 20.0)]
    )
    return make_impacts(racket, BALL, [5, 4, 1], velocities, free=free)


def test_sensitivities_to_the_bed_equal_central_differences():
    racket = load_racket("recreational", "low")
    names, x = bed_parameters(racket)
    impacts = small_batch(len(names))
    outcome = run([make_bed(racket, free=names)], impacts, step=2e-6)
    plain = small_batch()
    for a, name in enumerate(names):
        step = np.zeros_like(x)
        step[a] = 1e-4 * x[a]
        high, low = (run([make_bed(racket, x + s)], plain, step=2e-6).values for s in (step, -step))
        difference = (high - low) / (2.0 * step[a])
        scale = np.abs(outcome.values).max(axis=0) / x[a]
        assert np.abs(difference - outcome.jacobian[:, :, a]).max(axis=0) / scale == pytest.approx(
            np.zeros(6), abs=2e-6
        ), name


@pytest.mark.parametrize("rises", [(0.0, 0.0), (1e6, 600.0)], ids=["linear", "hunt_crossley"])
def test_sensitivities_to_ball_and_friction_equal_central_differences(rises):
    racket, plain = load_racket("recreational", "low"), small_batch()
    plain.balls[:, 7:] = rises
    sensitivity = np.zeros((3, 3, 3))
    sensitivity[:, [0, 1, 2], [0, 1, 2]] = 1.0
    impacts = dataclasses.replace(plain, sensitivity=sensitivity)
    bed = dataclasses.replace(make_bed(racket), sensitivity=np.zeros((4, 24, 3)))
    outcome = run([bed], impacts, step=2e-6)
    _, by_angle = outcome.rebound_angle(dataclasses.replace(impacts, velocities=tilted(plain)))
    for a in range(3):
        values, angles = [], []
        for sign in (1.0, -1.0):
            balls = plain.balls.copy()
            balls[:, a] *= 1.0 + sign * 1e-4
            moved = run([make_bed(racket)], dataclasses.replace(plain, balls=balls), step=2e-6)
            values.append(moved.values)
            angles.append(
                moved.rebound_angle(dataclasses.replace(plain, velocities=tilted(plain)))[0]
            )
        step = 2e-4 * plain.balls[:, a]
        difference = (values[0] - values[1]) / step[:, None]
        scale = np.abs(outcome.values).max(axis=0) / plain.balls[:, a].max()
        error = np.abs(difference - outcome.jacobian[:, :, a]).max(axis=0) / scale
        assert error == pytest.approx(np.zeros(6), abs=2e-6)
        assert (angles[0] - angles[1]) / step == pytest.approx(by_angle[:, a], rel=1e-4, abs=1e-9)


def tilted(impacts: clamped.Impacts) -> np.ndarray:
    """Velocities with some tangential part in all rows, so that each has a rebound angle."""
    velocities = impacts.velocities.copy()
    velocities[0, 1] = 1.0
    return velocities


def test_a_second_touch_is_seen_and_differentiated():
    # a heavy string mass on soft strings comes back and hits the ball again
    racket = load_racket("recreational", "low")
    _, x = bed_parameters(racket)
    x = x.copy()
    x[0] = 60.0

    def bed(values, free):
        return dataclasses.replace(make_bed(racket, values, free), mass=0.03)

    impacts = make_impacts(racket, BALL, [5], [18.0], free=1)
    outcome = run([bed(x, ["T0"])], impacts, step=1e-6)
    assert outcome.ended.all()
    assert outcome.touches[0] > 1
    step = 1e-4 * x[0]
    high, low = (
        run(
            [bed(x + s * np.eye(len(x))[0], [])],
            make_impacts(racket, BALL, [5], [18.0]),
            step=1e-6,
        ).values[0]
        for s in (step, -step)
    )
    assert (high[2] - low[2]) / (2 * step) == pytest.approx(outcome.jacobian[0, 2, 0], rel=1e-4)


def test_error_falls_with_the_fourth_power_of_the_step():
    racket = load_racket()
    impacts = make_impacts(racket, BALL, [1, 5, 8], [33.0] * 3)
    reference = run([make_bed(racket)], impacts, step=1e-6).values
    errors = [
        np.abs(run([make_bed(racket)], impacts, step=h).values - reference)[:, 2].max()
        for h in (4e-5, 2e-5, 1e-5)
    ]
    assert errors[1] < 1e-5
    assert 3.5 < math.log2(errors[0] / errors[1]) < 4.7
    assert 3.5 < math.log2(errors[1] / errors[2]) < 4.7


def test_an_impact_does_not_depend_on_the_others():
    racket = load_racket()
    points, speeds = np.arange(1, 10), np.linspace(18.0, 33.0, 9)
    together = run([make_bed(racket)], make_impacts(racket, BALL, points, speeds))
    for i in (0, 4, 8):
        alone = run([make_bed(racket)], make_impacts(racket, BALL, points[[i]], speeds[[i]]))
        assert np.array_equal(alone.values[0], together.values[i])


@settings(max_examples=60, deadline=None)
@given(
    dz=st.floats(-0.05, 0.05),
    rate=st.floats(-30, 30),
    k=st.floats(1e4, 2e6),
    tension=st.floats(10, 1500),
    length=st.floats(0.02, 0.12),
    c=st.floats(0, 5),
)
def test_spring_partials_are_the_derivatives_of_the_law(dz, rate, k, tension, length, c):
    x = np.array([dz, rate, k, tension - k * length, length**2, c])

    def force(*arguments):
        slope, pull = spring_law(*arguments)
        return slope * pull

    value, *partials = spring_partials(*x)
    assert value == pytest.approx(force(*x))
    # complex steps: exact to rounding, and no derivative code shared with the law's
    for a, partial in enumerate(partials):
        z = x.astype(complex)
        z[a] += 1e-30j
        assert partial == pytest.approx(force(*z).imag / 1e-30, rel=1e-9, abs=1e-12)


def test_bad_batches_are_refused_in_one_line():
    racket = load_racket()
    bed, impacts = make_bed(racket), make_impacts(racket, BALL, [5], [25.0])

    def refused(match: str, **changes: object) -> None:
        with pytest.raises(InputError, match=match) as caught:
            run([bed], dataclasses.replace(impacts, **changes))
        assert "\n" not in str(caught.value)

    refused("points", points=np.array([10]))
    refused("velocities", velocities=np.array([[0.0, 0.0, 1.0]]))
    refused("balls", balls=np.full((1, 7), np.nan))
    refused("bed", bed=np.array([1]))
    with pytest.raises(InputError, match="step"):
        run([bed], impacts, step=1.0)
    with pytest.raises(InputError, match="beds of one topology"):
        run([bed, dataclasses.replace(bed, topology=grid_topology(5, 4))], impacts)
    with pytest.raises(InputError, match="beds"):
        run([], impacts)
    with pytest.raises(InputError, match="free"):
        make_bed(racket, free=["k9"])
    with pytest.raises(InputError, match="values"):
        make_bed(racket, [1.0])


def test_the_stamp_of_the_sources_changes_with_them(tmp_path):
    module = type(pytest)("law")
    module.__file__ = str(tmp_path / "law.py")
    stamps = []
    for text in ("a = 1\n", "a = 2\n"):
        (tmp_path / "law.py").write_text(text)
        stamps.append(sources_stamp(module))
    assert stamps[0] != stamps[1]


def test_a_second_touch_latches_its_own_offset():
    """Friction by displacement counts from the last touch, and so do its derivatives."""
    racket = load_racket("recreational", "low")
    _, x = bed_parameters(racket)
    x = x.copy()
    x[0] = 60.0
    velocity = np.array([[0.6, 0.3, -18.0]])

    def rebound(values, free):
        bed = dataclasses.replace(make_bed(racket, values, free), mass=0.03)
        impacts = make_impacts(
            racket, BALL, [5], velocity, free=len(free), friction_reading="displacement"
        )
        # a long scale: the ball goes on sliding within it, and nothing is stiff
        impacts.balls[:, 5] = 0.002
        return run([bed], impacts, step=1e-6)

    outcome = rebound(x, ["T0"])
    assert outcome.ended.all()
    assert outcome.touches[0] > 1
    step = 1e-4 * x[0]
    high, low = (rebound(x + s * np.eye(len(x))[0], []).values[0] for s in (step, -step))
    difference = (high - low) / (2.0 * step)
    assert difference[:3] == pytest.approx(outcome.jacobian[0, :3, 0], rel=1e-4)


def test_how_far_a_mass_comes_out_at_most():
    """All energy of two masses between three springs, in the static stiffness of one."""
    k, tension, length, m = 1e5, 200.0, 0.05, 0.002
    ends = np.array([[0, 0, 1], [-1, 1, -1]])
    bed = np.array([[k] * 3, [tension - k * length] * 3, [length**2] * 3])
    z, v, stiffness = (0.003, -0.002), (4.0, 5.0), np.array([9e3, 7e3])
    y = np.array([*z, *v, *np.zeros(6)])
    energy = 0.5 * m * (16.0 + 25.0)
    for dz in (z[0], z[0] - z[1], z[1]):
        longer = math.hypot(dz, length) - length
        energy += tension * longer + 0.5 * k * longer**2
    mass = np.array([0.058, m])
    for p in (0, 1):
        expected = math.sqrt(2.0 * energy / stiffness[p])
        assert steps.reach(y, p, ends, bed, mass, stiffness) == pytest.approx(expected, rel=1e-12)
    more = np.concatenate([y, np.zeros(surface.MORE)])
    found = surface._reach(more, ends, bed, mass, stiffness)
    assert found == pytest.approx(math.sqrt(2.0 * energy / 7e3), rel=1e-12)


def test_impacts_are_made_of_the_balls_and_the_beds_numbers():
    racket = load_racket()
    at = {"velocity": BALL.sliding_speed_scale, "displacement": BALL.sliding_distance_scale}
    for reading, scale in at.items():
        made = make_impacts(racket, BALL, [5, 1], [18.0, 33.0], friction_reading=reading)
        assert made.velocities.tolist() == [[0.0, 0.0, -18.0], [0.0, 0.0, -33.0]]
        mu = racket.friction_coefficients()
        low, high = BALL.stiffness_low.value, 1.0 + BALL.stiffness_growth.value
        assert made.balls[:, 0] == pytest.approx([low, high * low])
        assert made.balls[:, 2].tolist() == [mu[4], mu[0]]
        assert made.balls[:, 5].tolist() == [scale.value] * 2
        assert made.balls[:, 6].tolist() == [float(reading == "displacement")] * 2


def test_peaks_are_found_inside_the_step():
    """Of force and deflection, in steps four times as long; the samples alone miss more."""
    racket = load_racket()
    impacts = make_impacts(racket, BALL, [5, 2], [25.0, 33.0])
    coarse, fine = (run([make_bed(racket)], impacts, step=h).values for h in (2e-5, FINE))
    for name in ("peak_normal_force", "peak_deflection", "contact_time", "v_z"):
        column = OUTPUTS.index(name)
        np.testing.assert_allclose(coarse[:, column], fine[:, column], rtol=1e-6)
