"""A string-bed of 5 x 4 points from a file, whose springs are derived here from places alone."""

from __future__ import annotations

import math
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from drake_racket import InputError, IntegratorSettings, Scenario, make_impact_diagram, simulate
from drake_racket.engines.clamped.batch import bed_parameters, make_bed, make_impacts, run
from drake_racket.io.shipped import data_directory
from drake_racket.laws.bed import grid_topology, named_topology
from drake_racket.laws.strings import generalized_forces, stored_energy, tensions
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.racket import RacketParameters, load_racket
from drake_racket.plant.racket import find_racket
from drake_racket.plant.string_bed import string_bed_model
from drake_racket.plant.systems.string_bed import spring_constants
from tests.conftest import kb_cb
from tests.oracles.clamped_impact import ClampedImpact
from tests.oracles.clamped_impact import simulate as oracle

COLUMNS, ROWS, SPACING = 5, 4, 0.04
RIM = 0.164, 0.123
T0 = 648.2
BALL = load_ball()
TIGHT = IntegratorSettings(accuracy=1e-7, maximum_step=2e-5)
POINT = 12  # second column from the left of the third row from the tip


def places() -> np.ndarray:
    """(20, 2) x, y from the centre: rows from the tip, each from the left."""
    return SPACING * np.array(
        [(1.5 - row, 2.0 - column) for row in range(4) for column in range(5)]
    )


@dataclass
class Springs:
    """Of the bed, found by looking along x and y from every point; -1 is the rim."""

    names: list[str]
    first: np.ndarray
    second: np.ndarray
    k: np.ndarray
    length: np.ndarray


def formula(name: str) -> str:
    """Any assignment that uses all parameters and tells neighbours apart."""
    number = sum(map(ord, name))
    if not name[0].isdigit():
        return f"p{1 + number % 6}*k{1 + number % 4}"
    return f"k{1 + number % 4}"


def springs(k: list[float], p: list[float]) -> Springs:
    at, a, b = places(), *RIM
    found = {}
    for i, (x, y) in enumerate(at):
        ways = {"tip": (1, 0), "throat": (-1, 0), "left": (0, 1), "right": (0, -1)}
        for side, way in ways.items():
            there = at[i] + SPACING * np.array(way)
            near = np.flatnonzero(np.hypot(*(at - there).T) < 1e-9)
            if len(near) and side in ("throat", "right"):
                found[f"{i + 1}-{near[0] + 1}"] = i, near[0], SPACING
            elif not len(near):
                # the ellipse from the point on, along the line
                if way[0]:
                    length = a * math.sqrt(1.0 - (y / b) ** 2) - way[0] * x
                else:
                    length = b * math.sqrt(1.0 - (x / a) ** 2) - way[1] * y
                found[f"{side}-{i + 1}"] = i, -1, length
    stiffness = []
    for name in found:
        *factor, own = formula(name).split("*")
        stiffness.append(k[int(own[1:]) - 1] * (p[int(factor[0][1:]) - 1] if factor else 1.0))
    first, second, length = map(np.array, zip(*found.values(), strict=True))
    return Springs(list(found), first, second, np.array(stiffness), length)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bed") / "fine.yaml"
    shutil.copy(data_directory() / "tour_low.yaml", path)
    tree = yaml.safe_load(path.read_text(encoding="utf-8"))
    bed = tree["string_bed"]
    bed |= {"columns": COLUMNS, "rows": ROWS}
    bed["spacing"]["value"] = SPACING
    bed["rim_semi_axis_x"]["value"], bed["rim_semi_axis_y"]["value"] = RIM
    bed["springs"]["value"] = {name: formula(name) for name in springs([1.0] * 4, [1.0] * 6).names}
    tree["friction"]["points"]["value"] = {str(i): f"mu{1 + i % 3}" for i in range(1, 21)}
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def racket(file: Path) -> RacketParameters:
    return load_racket(str(file))


@pytest.fixture(scope="module")
def by_hand(racket: RacketParameters) -> Springs:
    bed = racket.string_bed
    return springs(list(bed.stiffness.value), list(bed.rim_factors.value))


def potential(s: Springs, z: np.ndarray) -> complex:
    """Energy above the flat bed, J; z may be complex."""
    height = np.append(z, 0.0)
    length = np.sqrt(s.length**2 + (height[s.first] - height[s.second]) ** 2)
    stretch = length - s.length
    return complex(np.sum(T0 * stretch + 0.5 * s.k * stretch**2))


def deflections(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, 0.01, COLUMNS * ROWS)


def forces(s: Springs, z: np.ndarray) -> np.ndarray:
    """-dU/dz by complex steps, exact to rounding."""
    step = 1e-30
    return np.array([-potential(s, z + 1j * step * e).imag / step for e in np.eye(len(z))])


def test_topology_has_the_springs_found_by_looking(racket, by_hand):
    bed = racket.bed_topology()
    assert len(bed.names) == 2 * COLUMNS * ROWS + COLUMNS + ROWS == 49
    assert bed.points == tuple(range(1, 21))
    np.testing.assert_allclose(SPACING * bed.places, places(), atol=1e-15)
    ours = {n: (i, j) for n, i, j in zip(bed.names, bed.first, bed.second, strict=True)}
    theirs = zip(by_hand.first, by_hand.second, strict=True)
    assert ours == dict(zip(by_hand.names, theirs, strict=True))
    # mains from the tip before crosses from the left
    assert bed.names[:6] == ("tip-1", "1-6", "6-11", "11-16", "throat-16", "tip-2")
    assert bed.names[25:31] == ("left-1", "1-2", "2-3", "3-4", "4-5", "right-5")
    for i, (x, y) in enumerate(places()):
        gsc = racket.string_bed.gsc.value
        assert racket.point_in_head(i + 1) == pytest.approx((gsc + x, y), abs=1e-15)
    assert racket.string_mass() == pytest.approx(0.0149 / 20)
    lengths = dict(zip(bed.names, string_bed_model(racket).lengths, strict=True))
    assert lengths == pytest.approx(dict(zip(by_hand.names, by_hand.length, strict=True)))


def test_a_bed_is_known_by_the_names_of_its_springs():
    for bed in (grid_topology(), grid_topology(5, 4), grid_topology(2, 15)):
        assert named_topology(bed.names) is bed
    assert named_topology(("tip-1", "left-1")) is None
    assert named_topology(grid_topology(4, 5).names[::-1]) is None


@pytest.mark.parametrize("columns", [2, 3, 7])
@pytest.mark.parametrize("rows", [2, 5])
def test_incidence_is_the_difference_of_the_ends(columns, rows):
    bed = grid_topology(columns, rows)
    z = np.random.default_rng(2).normal(size=columns * rows)
    height = np.append(z, 0.0)
    np.testing.assert_array_equal(bed.incidence @ z, height[bed.first] - height[bed.second])
    steps = [bed.places[j] - bed.places[i] for i, j in bed.ends.T if j >= 0]
    np.testing.assert_array_equal(steps, bed.directions[bed.second >= 0])
    assert not bed.incidence.flags.writeable  # one object for all rackets


def test_force_and_energy_are_those_of_the_potential(racket, by_hand):
    constants = spring_constants(string_bed_model(racket))
    incidence = racket.bed_topology().incidence
    for seed in range(5):
        z = deflections(seed)
        energy = stored_energy(z, constants, incidence)
        assert energy == pytest.approx(potential(by_hand, z).real, rel=1e-9)
        force = generalized_forces(z, 0.0 * z, constants, incidence)
        np.testing.assert_allclose(force, forces(by_hand, z), rtol=1e-9, atol=1e-6)


def test_the_drake_system_gives_them(file, racket, by_hand):
    system = make_impact_diagram(Scenario(racket=str(file), point=str(POINT), audit=False))
    root = system.create_context()
    handles, bed = system.impact.racket, system.impact.string_bed
    z = deflections(7)
    context = system.plant.GetMyMutableContextFromRoot(root)
    for joint, height in zip(handles.string_joints, z, strict=True):
        joint.set_translation(context, height)
    own = bed.GetMyContextFromRoot(root)
    force = bed.GetOutputPort("generalized_force").Eval(own)
    rows = [joint.velocity_start() for joint in handles.string_joints]
    np.testing.assert_allclose(force[rows], forces(by_hand, z), rtol=1e-9, atol=1e-6)
    assert np.count_nonzero(force) == 20
    energy = bed.GetOutputPort("string_energy").Eval(own)[0]
    assert energy == pytest.approx(potential(by_hand, z).real, rel=1e-9)
    constants = spring_constants(string_bed_model(racket))
    expected = tensions(z, 0.0 * z, constants, racket.bed_topology().incidence)
    assert bed.GetOutputPort("string_tension").Eval(own) == pytest.approx(expected, rel=1e-12)
    assert bed.GetOutputPort("string_deflection").Eval(own) == pytest.approx(z)
    # the masses are the whole mass of the strings, at their places
    masses = [body.get_mass(context) for body in handles.string_masses]
    assert sum(masses) == pytest.approx(0.0149)


def rebound(racket, by_hand, speed=25.0):
    kb, cb = kb_cb(BALL, speed)
    problem = ClampedImpact(
        grid_xy=places(),
        spring_i=by_hand.first,
        spring_j=by_hand.second,
        spring_k=by_hand.k,
        spring_L0=by_hand.length,
        T0=T0,
        string_mass=0.0149 / 20,
        ball_mass=BALL.mass.value,
        kb=kb,
        cb=cb,
        point=POINT - 1,
        v0=speed,
    )
    return oracle(problem)


def test_the_clamped_engine_equals_an_independent_ode(racket, by_hand):
    expected = rebound(racket, by_hand)
    impacts = make_impacts(racket, BALL, [POINT], [25.0])
    outcome = run([make_bed(racket)], impacts, step=2e-6)
    assert outcome.ended.all()
    assert outcome.column("v_z")[0][0] == pytest.approx(expected.rebound_speed, abs=1e-7)
    assert outcome.column("contact_time")[0][0] == pytest.approx(expected.contact_time, abs=1e-9)
    assert outcome.column("peak_normal_force")[0][0] == pytest.approx(expected.peak_force, rel=1e-6)


@pytest.mark.slow
def test_the_drake_rig_equals_it_too(file, racket, by_hand):
    expected = rebound(racket, by_hand)
    scenario = Scenario(
        racket=str(file),
        support="clamped_head",
        point=str(POINT),
        approach_time=2e-4,
        after=0.008,
        audit=False,
        integrator=TIGHT,
    )
    result = simulate(scenario, history=False)
    assert result.point == POINT
    assert result.rebound_velocity[2] == pytest.approx(expected.rebound_speed, abs=1e-6)
    assert result.contact_time == pytest.approx(expected.contact_time, abs=1e-8)


def test_sensitivities_of_the_engine_equal_central_differences(racket):
    names, x = bed_parameters(racket)
    sliding = np.array([[6.0, 24.0, -12.0]])  # all the time: where it stops, friction is stiff
    impacts = make_impacts(racket, BALL, [POINT], sliding, free=len(names))
    plain = make_impacts(racket, BALL, [POINT], sliding)
    outcome = run([make_bed(racket, free=names)], impacts, step=2e-6)
    for a, step in enumerate(1e-4 * x):
        moved = [x + sign * step * np.eye(len(x))[a] for sign in (1.0, -1.0)]
        high, low = (run([make_bed(racket, v)], plain, step=2e-6).values for v in moved)
        scale = np.abs(outcome.values).max(axis=0) / x[a]
        error = ((high - low) / (2.0 * step) - outcome.jacobian[:, :, a]) / scale
        assert np.abs(error).max() < 2e-6, names[a]


@pytest.mark.slow
def test_a_free_impact_closes_energy_and_momentum(file):
    scenario = Scenario(
        racket=str(file),
        point="auto",
        offset_x=0.055,
        offset_y=-0.037,
        incidence_deg=30.0,
        after=0.006,
        integrator=TIGHT,
    )
    result = simulate(scenario)
    assert result.point == 4  # the nearest: in the row at the tip, fourth from the left
    assert result.energy_error < 1e-6
    assert result.momentum_error < 1e-10
    assert result.angular_momentum_error < 1e-9
    history = result.history
    assert history["string_deflection"].shape[1] == 20
    assert named_topology(history["spring"].to_numpy().tolist()) is grid_topology(5, 4)


def test_an_override_takes_one_spring_of_49(file):
    scenario = Scenario(
        racket=str(file), overrides={"racket.string_bed.spring.12-17": 3e5}, point=str(POINT)
    )
    new = scenario.load_racket()
    assert len(new.string_bed.stiffness.value) == 49
    row = new.bed_topology().names.index("12-17")
    before = spring_constants(string_bed_model(load_racket(str(file))))
    after = spring_constants(string_bed_model(new))
    assert after[0, row] == 3e5
    others = np.arange(49) != row
    np.testing.assert_allclose(after[:, others], before[:, others], rtol=1e-14)


def test_what_does_not_fit_the_bed_is_refused(file, tmp_path, racket):
    def refused(match: str, **changes: object) -> None:
        tree = yaml.safe_load(file.read_text(encoding="utf-8"))
        tree["string_bed"] |= changes
        path = tmp_path / "bad.yaml"
        path.write_text(yaml.safe_dump(tree), encoding="utf-8")
        with pytest.raises(InputError, match=match) as caught:
            load_racket(str(path))
        assert "\n" not in str(caught.value)

    refused("string_bed.columns: got 1; allowed: .* from 2 to 15", columns=1)
    refused("string_bed.rows: got 16; allowed: .* from 2 to 15", rows=16)
    refused("string_bed.rows: got 2.5; allowed: a whole number", rows=2.5)
    refused("string_bed.columns: got 'four'", columns="four")
    refused("string_bed.springs.value.1-6: got 'an unknown spring'", columns=4)
    refused("corner points .0.06 m from the centre along x, 0.28 m along y", columns=15)
    fewer = {"status": "inferred", "source": "test", "value": {"tip-1": "k1"}}
    refused("got 'nothing'; allowed: all 49 springs must be assigned", springs=fewer)
    with pytest.raises(InputError, match=r"point: got '21'; allowed: 1, 2, .*, 20, auto"):
        make_impact_diagram(Scenario(racket=str(file), point="21"))
    # a model of nine masses is no racket of twenty
    nine = make_impact_diagram(Scenario(audit=False)).impact.racket
    with pytest.raises(InputError, match="a model with 20 string masses"):
        find_racket(
            nine.plant, nine.model_instance, replace(nine.parameters, string_bed=racket.string_bed)
        )
