"""Derivatives of an impact's numbers by keys, against differences and Drake's AutoDiff."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from drake_racket import (
    OUTPUTS,
    InputError,
    IntegratorSettings,
    Scenario,
    load_scenario,
    parameter_keys,
    simulate,
)
from drake_racket.cases.keys import find_key, number_of, with_settings, with_values
from drake_racket.laws.compilation import HAS_NUMBA
from drake_racket.results.outputs import read_outputs

# steps of one length, so that differences do not see another choice of steps
STEPS = IntegratorSettings(accuracy=1e-2, error_control=False, maximum_step=2e-5)
OBLIQUE = Scenario(
    support="grip",
    after=0.006,
    incidence_deg=30.0,
    azimuth_deg=20.0,
    offset_x=0.03,
    offset_y=0.02,
    engine="compiled",
    integrator=STEPS,
)
# read at one sample, or at a sum over samples: not at a highest sample that has no parabola
BY_SAMPLES = {"bending_angle", "peak_in_plane_angle", "peak_out_of_plane_angle"}


def differences(base, name, outputs, share=2e-4, history=True):
    """Derivatives of outputs by one key, of fourth order."""
    key = find_key(name, base, "test")
    value = number_of(base, key)
    h = share * (abs(value) or 0.01)
    found = [
        np.array(
            read_outputs(
                simulate(with_values(base, {key: value + k * h}, {}), history=history), outputs
            )
        )
        for k in (-2, -1, 1, 2)
    ]
    return (found[0] - 8.0 * found[1] + 8.0 * found[2] - found[3]) / (12.0 * h)


def agrees(base, names, rel, history=True, share=2e-4, left_out="-"):
    result = simulate(base, derivatives=names, history=history)
    made = result.derivatives
    rows = [
        i
        for i, name in enumerate(made.outputs)
        if name not in BY_SAMPLES and not name.startswith(left_out)
    ]
    outputs = [OUTPUTS[made.outputs[i]] for i in rows]
    for j, name in enumerate(names):
        expected = differences(base, name, outputs, share, history)
        value = number_of(base, find_key(name, base, "test"))
        floor = 1e-7 * np.maximum(np.abs(made.values[rows]), 0.01) / (abs(value) or 0.01)
        for output, found, other, least in zip(
            outputs, made.table[rows, j], expected, floor, strict=True
        ):
            assert found == pytest.approx(other, rel=rel, abs=least, nan_ok=True), (
                name,
                output.name,
            )
    return made


@pytest.mark.slow
def test_a_held_racket_hit_off_centre_against_differences():
    made = agrees(
        OBLIQUE,
        [
            "racket.head.mass",
            "racket.head.moi_longitudinal",
            "racket.throat_joint.out_of_plane_stiffness",
            "racket.string_bed.initial_tension",
            "racket.friction.coefficients.mu1",
            "ball.damping_low",
            "grip.torque_stiffness.y",
            "speed",
            "incidence_deg",
            "offset_x",
            "after",
            "racket.handle.length",  # of the Diagram itself
        ],
        2e-6,
        left_out="spin",  # a point has none
    )
    assert made.of("rebound_speed", "after") == 0.0
    assert made.of("handle_ringing", "after") != 0.0


@pytest.mark.exhaustive
@pytest.mark.parametrize("support", ["free", "grip", "clamped_head"])
def test_every_parameter_against_differences(support):
    base = dataclasses.replace(OBLIQUE, support=support)
    keys = parameter_keys(base.load_racket(), base.load_ball(), base.load_grip())
    held = ("racket.", "ball.") if support != "grip" else ("racket.", "ball.", "grip.")
    own = [name for name, key in keys.items() if name.startswith(held) and key.value]
    own = [name for name in own if not name.endswith(".segments")]
    singles = [name for name in own if ".spring." in name]
    # a spring of its own takes the place of the lines' k and p
    agrees(base, [name for name in own if name not in singles], 5e-6, left_out=("peak_", "spin"))
    agrees(base, singles[:3], 5e-6, left_out=("peak_", "spin"))


@pytest.mark.slow
def test_a_stroke_against_differences():
    base = dataclasses.replace(
        load_scenario("backhand"), engine="compiled", after=0.006, integrator=STEPS
    )
    agrees(
        base,
        ["limb.stroke.speed", "grip.torque_damping.y", "speed"],
        2e-5,
        left_out=("peak_", "spin"),
    )


def test_a_key_that_moves_the_arms_posture_is_refused():
    """The search for a posture stops near the best one: slopes of where it stops are noise."""
    key = "limb.stroke.face_closed_deg"
    base = with_settings(load_scenario("backhand"), [f"{key}=-1.57", "engine=compiled"])
    with pytest.raises(InputError, match="limb's posture"):
        simulate(dataclasses.replace(base, after=0.002), derivatives=[key], history=False)


@pytest.mark.slow
def test_steps_of_their_own_length_give_the_same():
    """What the error control chooses is as good as short steps of one length."""
    names = ["racket.head.mass", "offset_x", "ball.mass"]
    fixed = simulate(OBLIQUE, derivatives=names, history=False).derivatives
    free = dataclasses.replace(OBLIQUE, integrator=IntegratorSettings(accuracy=1e-8))
    chosen = simulate(free, derivatives=names, history=False).derivatives
    for output in ("rebound_speed", "rebound_angle", "contact_time", "peak_normal_force"):
        for name in names:
            assert chosen.of(output, name) == pytest.approx(fixed.of(output, name), rel=2e-4)


@pytest.mark.slow
def test_motion_that_the_impact_does_not_have_gets_steps_short_enough():
    """A ball that meets the centre squarely shakes no side to side; its derivative does."""
    base = Scenario(engine="compiled", after=0.004, integrator=IntegratorSettings(accuracy=1e-4))
    made = simulate(base, derivatives=["offset_y"], history=False).derivatives
    assert made.error <= 1e-4


@pytest.mark.parametrize(
    ("step", "share"),
    [
        pytest.param(2e-5, 5e-6, marks=pytest.mark.slow),
        pytest.param(1e-5, 1e-6, marks=pytest.mark.exhaustive),
    ],
)
def test_drakes_autodiff_gives_the_same(monkeypatch, step, share):
    from pydrake.autodiffutils import AutoDiffXd
    from pydrake.systems.analysis import Simulator_

    from drake_racket import make_impact_diagram
    from tests.plant import test_autodiff as drake

    base = dataclasses.replace(
        drake.SCENARIO,
        engine="compiled",
        after=0.0045,
        integrator=IntegratorSettings(accuracy=1e-9),
    )
    keys = {
        "ball.stiffness_low": "kb",
        "ball.damping_low": "cb",
        "racket.string_bed.initial_tension": "T0",
        "racket.string_bed.stiffness.k2": "k2",
        "racket.throat_joint.out_of_plane_stiffness": "kf_out_of_plane",
    }
    made = simulate(base, derivatives=list(keys), history=False).derivatives
    system = make_impact_diagram(drake.SCENARIO)
    values = drake.defaults(system)
    diagram = system.diagram.ToAutoDiffXd()
    unit = np.eye(len(values))

    def by_drake(step):
        monkeypatch.setattr(drake, "STEP", step)
        root = diagram.CreateDefaultContext()
        root.SetTimeStateAndParametersFrom(system.create_context(drake.SCENARIO))
        seeded = [AutoDiffXd(v, row) for v, row in zip(values, unit, strict=True)]
        velocity = drake.rebound(system, diagram, Simulator_[AutoDiffXd], root, seeded)
        columns = [drake.NAMES.index(name) for name in keys.values()]
        return np.array([v.derivatives() for v in velocity])[:, columns]

    coarse, fine = by_drake(step), by_drake(0.5 * step)
    theirs = (8.0 * fine - coarse) / 7.0  # Drake's scheme is of order 3
    ours = np.array([[made.of(f"rebound_velocity_{axis}", key) for key in keys] for axis in "xyz"])
    assert np.max(np.abs(ours - theirs) / np.max(np.abs(theirs), axis=0)) < share


@pytest.mark.slow
def test_a_value_at_the_end_of_its_range_is_looked_at_from_one_side():
    name = "racket.string_bed.damping"
    made = simulate(OBLIQUE, derivatives=[name], history=False).derivatives
    key = find_key(name, OBLIQUE, "test")
    h = 0.01
    zero, one, two = (
        simulate(with_values(OBLIQUE, {key: k * h}, {}), history=False).apparent_restitution
        for k in range(3)
    )
    expected = (-1.5 * zero + 2.0 * one - 0.5 * two) / h
    assert made.of("restitution", name) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    ("names", "engine", "told"),
    [
        (["racket.head.mas"], "compiled", "racket.head.mass"),
        (["support"], "compiled", "numbers of the impact"),
        (["integrator.accuracy"], "compiled", "numbers of the impact"),
        (["speed", "speed"], "compiled", "each key once"),
        ([], "compiled", "a list of keys"),
        ("speed", "compiled", "a list of keys"),
        (["speed"], "drake", "auto or compiled"),
    ],
)
def test_bad_requests_are_refused_before_a_run(names, engine, told):
    with pytest.raises(InputError, match=told):
        simulate(Scenario(engine=engine), derivatives=names)


@pytest.mark.slow
def test_a_result_has_its_derivatives_in_json():
    result = simulate(Scenario(after=0.004), derivatives=["speed"], history=False)
    data = json.loads(json.dumps(result.to_json()))["derivatives"]
    assert data["rebound_speed"]["speed"] == result.derivatives.of("rebound_speed", "speed")
    with pytest.raises(InputError, match="rebound_speed"):
        result.derivatives.of("rebound_sped", "speed")


@pytest.mark.skipif(not HAS_NUMBA, reason="compares machine code with Python")
@pytest.mark.slow
def test_python_without_numba_gives_the_same():
    import subprocess
    import sys

    names = ["ball.mass", "offset_x"]
    base = Scenario(after=0.0004, approach_time=1e-4, integrator=IntegratorSettings(accuracy=1e-2))
    ours = simulate(base, derivatives=names, history=False).derivatives.table
    code = (
        "import sys; sys.modules['numba'] = None\n"
        "import json\n"
        "from drake_racket import IntegratorSettings, Scenario, simulate\n"
        "s = Scenario(after=0.0004, approach_time=1e-4,"
        " integrator=IntegratorSettings(accuracy=1e-2))\n"
        f"d = simulate(s, derivatives={names!r}, history=False).derivatives\n"
        "print(json.dumps(d.table.tolist()))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    theirs = np.array(json.loads(done.stdout))
    assert np.allclose(ours, theirs, rtol=1e-7, atol=1e-9, equal_nan=True)


@pytest.mark.slow
def test_a_frame_of_four_segments_against_differences():
    base = dataclasses.replace(
        OBLIQUE, overrides={"racket.frame.segments": 4, "racket.frame.density": 0.5}
    )
    agrees(
        base, ["racket.frame.density", "racket.string_bed.initial_tension"], 2e-5, left_out="spin"
    )


@pytest.mark.slow
def test_a_ball_with_spin_against_differences():
    base = dataclasses.replace(OBLIQUE, contact="surface", spin_rpm=-1500.0, incidence_deg=55.0)
    names = ["spin_rpm", "racket.friction.coefficients.mu1", "ball.surface.tangential_stiffness"]
    agrees(base, [*names, "offset_x", "incidence_deg"], 2e-5, left_out="peak_")
