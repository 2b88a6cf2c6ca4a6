"""A frame of N segments on a plant: totals, accelerations, energy, names, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from drake_racket import (
    InputError,
    IntegratorSettings,
    Scenario,
    add_impact,
    add_racket,
    frame_fundamentals,
    load_racket,
    make_impact_diagram,
    racket_properties,
    run_drake,
    simulate,
)
from drake_racket.cases.case import resolve
from drake_racket.cases.keys import with_settings
from drake_racket.laws.strings import add_bent_forces, bent_forces
from drake_racket.parameters.added_mass import add_mass
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.plant.racket import find_racket
from drake_racket.plant.string_bed import rim_bending, string_bed_model
from drake_racket.plant.systems.string_bed import spring_constants
from drake_racket.results.energy import balances, stored_in_strings
from tests.oracles import segment_chain

COUNTS = (3, 4, 6, 12)


def segmented(count: int, density: float = 0.0, name: str = "tour", **numbers: float):
    keys = {"segments": count, "density": density, **numbers}
    return apply_overrides(load_racket(name), {f"racket.frame.{k}": v for k, v in keys.items()})


def lopsided():
    return add_mass(load_racket(), "10g", at=3)


@pytest.mark.parametrize("racket", [load_racket("recreational"), lopsided()], ids=["even", "tape"])
@pytest.mark.parametrize("count", COUNTS)
def test_any_number_of_segments_has_the_parts_mass(count, racket):
    """Mass, centre and all moments of the published parts, to 1e-12."""
    cut = apply_overrides(racket, {"racket.frame.segments": count})

    def inertia(parameters):
        plant = MultibodyPlant(0.0)
        added = add_racket(plant, parameters)
        plant.Finalize()
        context = plant.CreateDefaultContext()
        bodies = plant.GetBodyIndices(added.model_instance)
        whole = plant.CalcSpatialInertia(context, added.frame("butt"), bodies)
        return whole.CopyToFullMatrix6()

    found, expected = inertia(cut), inertia(racket)
    scale = np.max(np.abs(expected))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * scale)
    assert len(cut.frame_segments()) == count


def test_the_other_family_keeps_mass_and_centre():
    plain, other = racket_properties(load_racket()), racket_properties(segmented(6, 1.0))
    assert other.mass == pytest.approx(plain.mass, rel=1e-13)
    assert other.balance == pytest.approx(plain.balance, rel=1e-13)
    assert other.twistweight == pytest.approx(plain.twistweight, rel=1e-12)
    assert 0.85 < other.swingweight / plain.swingweight < 0.95  # its parts' moments are smaller
    half = racket_properties(segmented(6, 0.5))
    mean = 0.5 * (plain.swingweight + other.swingweight)
    assert half.swingweight == pytest.approx(mean, rel=1e-12)


@pytest.mark.parametrize("density", [0.0, 1.0])
@pytest.mark.parametrize("count", COUNTS)
def test_the_fundamentals_are_those_of_two_parts(count, density):
    found = frame_fundamentals(segmented(count, density))
    assert found == pytest.approx(frame_fundamentals(load_racket()), rel=1e-9)


def test_a_measured_frequency_and_a_taper():
    found = frame_fundamentals(segmented(5, taper_out_of_plane=2.0))
    assert found == pytest.approx(frame_fundamentals(load_racket()), rel=1e-9)
    stiffness = [j.stiffness for j in segmented(5, taper_out_of_plane=2.0).frame_joints()]
    assert stiffness != [j.stiffness for j in segmented(5).frame_joints()]
    for count in (2, 5):
        racket = segmented(count)
        measured = dataclasses.replace(racket.frame.segments, value=140.0, unit="Hz")
        frame = dataclasses.replace(racket.frame, frequency_out_of_plane=measured)
        found = frame_fundamentals(dataclasses.replace(racket, frame=frame))
        assert found[1] == pytest.approx(140.0, rel=1e-9)
        assert found[0] == pytest.approx(frame_fundamentals(load_racket())[0], rel=1e-9)


def moving(parameters, seed: int):
    """A strung racket in a random state, and the oracle's segments, hinges and sliders of it."""
    rng = np.random.default_rng(seed)
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    racket = add_racket(plant, parameters)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    plant.Finalize()
    impact = add_impact(builder, plant, racket)
    root = builder.Build().CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    pose = RigidTransform(RollPitchYaw(rng.normal(size=3)), rng.normal(size=3))
    plant.SetFreeBodyPose(context, racket.handle, pose)
    speed = SpatialVelocity(rng.normal(size=3), rng.normal(size=3))
    plant.SetFreeBodySpatialVelocity(context, racket.handle, speed)
    for joint in racket.frame_joints:
        joint.set_angle(context, 0.05 * rng.normal())
        joint.set_angular_rate(context, rng.normal())
    for joint in racket.string_joints:
        joint.set_translation(context, 0.003 * rng.normal())
        joint.set_translation_rate(context, rng.normal())
    return plant, racket, impact, root


def string_forces(parameters, racket, context):
    """Forces on the masses and torques on the frame's joints, spring by spring."""
    model, bending = string_bed_model(parameters), rim_bending(parameters)
    topology, (k, _, length2, _) = model.topology, spring_constants(model)
    z = np.array([j.get_translation(context) for j in racket.string_joints])
    q = np.array([racket.frame_joints[i].get_angle(context) for i in bending.joints])
    on_mass, on_joint = np.zeros(len(z)), np.zeros(len(racket.frame_joints))
    for s in range(len(topology.names)):
        i, j = topology.first[s], topology.second[s]
        dz = z[i] - (z[j] if j >= 0 else 0.0) + bending.arms[s] @ q
        rest = np.sqrt(length2[s])
        length = np.sqrt(length2[s] + dz * dz - q @ bending.folds[s] @ q)
        pull = (parameters.string_bed.initial_tension.value + k[s] * (length - rest)) / length
        on_mass[i] -= pull * dz
        if j >= 0:
            on_mass[j] += pull * dz
        own = -pull * (dz * bending.arms[s] - bending.folds[s] @ q)
        on_joint[bending.joints] += own
    return on_mass, on_joint


def body_of(segment, body, context):
    """The oracle's segment of a plant's body."""
    pose, speed = body.EvalPoseInWorld(context), body.EvalSpatialVelocityInWorld(context)
    arm = pose.rotation() @ [segment.com, segment.com_y, 0.0]
    xx, yy, zz = segment.moments
    inertia = np.diag([xx, yy, zz])
    inertia[0, 1] = inertia[1, 0] = segment.product
    return segment_chain.Segment(
        segment.mass,
        inertia,
        pose.rotation().matrix(),
        pose.translation() + arm,
        speed.rotational(),
        speed.Shift(arm).translational(),
    )


@pytest.mark.parametrize("count", [3, 6, 12])
@pytest.mark.parametrize("tape", [False, True], ids=["even", "tape"])
def test_accelerations_are_those_of_constrained_bodies(count, tape):
    """Against Newton, Euler and Lagrange's multipliers, to 1e-9 of the largest."""
    base = lopsided() if tape else load_racket("recreational")
    parameters = apply_overrides(
        base, {"racket.frame.segments": count, "racket.frame.density": 0.4}
    )
    plant, racket, _, root = moving(parameters, count)
    context = plant.GetMyContextFromRoot(root)
    on_mass, on_joint = string_forces(parameters, racket, context)
    segments = [
        body_of(segment, body, context)
        for segment, body in zip(parameters.frame_segments(), racket.segments, strict=True)
    ]
    hinges = []
    for inner in range(count - 1):
        own = [i for i, j in enumerate(parameters.frame_joints()) if j.inner == inner]
        joints = [racket.frame_joints[i] for i in own]
        constants = [parameters.frame_joints()[i] for i in own]
        angles = np.array([j.get_angle(context) for j in joints])
        rates = np.array([j.get_angular_rate(context) for j in joints])
        torques = on_joint[own] - [c.stiffness for c in constants] * angles
        torques -= [c.damping for c in constants] * rates
        place = joints[0].frame_on_parent().CalcPoseInWorld(context).translation()
        hinges.append(segment_chain.Hinge(inner, place, angles, torques))
    head = [s.name for s in parameters.frame_segments()].index("head")
    sliders = [
        segment_chain.Slider(
            parameters.string_mass(),
            head,
            body.EvalPoseInWorld(context).translation(),
            joint.get_translation_rate(context),
            force,
        )
        for body, joint, force in zip(
            racket.string_masses, racket.string_joints, on_mass, strict=True
        )
    ]
    turning, moving_, of_masses = segment_chain.accelerations(segments, hinges, sliders)
    scale = max(np.max(np.abs(turning)), np.max(np.abs(moving_)), np.max(np.abs(of_masses)))
    pairs = []
    for i, (body, segment) in enumerate(zip(racket.segments, segments, strict=True)):
        found = body.EvalSpatialAccelerationInWorld(context)
        arm = segment.centre - body.EvalPoseInWorld(context).translation()
        shifted = found.Shift(arm, segment.omega)
        pairs += [(shifted.rotational(), turning[i]), (shifted.translational(), moving_[i])]
    for body, expected in zip(racket.string_masses, of_masses, strict=True):
        pairs.append((body.EvalSpatialAccelerationInWorld(context).translational(), expected))
    for found, expected in pairs:
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * scale)


def test_a_strings_force_is_the_slope_of_its_energy():
    parameters = segmented(6)
    plant, _, impact, root = moving(parameters, 8)
    bed, context = impact.string_bed, plant.GetMyMutableContextFromRoot(root)
    own = bed.GetMyContextFromRoot(root)
    q = plant.GetPositions(context).copy()
    force = bed.GetOutputPort("generalized_force").Eval(own)
    for place, at in zip(bed.at.positions, bed.at.velocities, strict=True):
        energies = []
        for step in (1e-6, -1e-6):
            moved = q.copy()
            moved[place] += step
            plant.SetPositions(context, moved)
            energies.append(bed.GetOutputPort("string_energy").Eval(own)[0])
        slope = (energies[0] - energies[1]) / 2e-6
        assert -slope == pytest.approx(force[at], abs=1e-5 * np.max(np.abs(force)))


@pytest.mark.parametrize("count", [3, 6, 12])
def test_the_rim_moves_with_its_segments(count):
    """Heights and distances of the rim from the masses, as the plant's own bodies turn."""
    parameters = segmented(count)
    plant = MultibodyPlant(0.0)
    racket = add_racket(plant, parameters)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    bending, topology = rim_bending(parameters), parameters.bed_topology()
    lengths, spacing = string_bed_model(parameters).lengths, parameters.string_bed.spacing.value
    segments = parameters.frame_segments()
    assert bending.joints
    for row in np.flatnonzero(topology.second < 0):
        mass = np.array([*parameters.point_in_head(int(topology.first[row]) + 1), 0.0])
        along = np.array([*topology.directions[row], 0.0])
        end = parameters.handle.length.value * np.eye(3)[0] + mass + lengths[row] * along
        own = max(i for i, segment in enumerate(segments) if segment.start <= end[0])
        body = racket.segments[own]

        def seen(q, body=body, segment=segments[own], end=end):
            for i, joint in enumerate(bending.joints):
                racket.frame_joints[joint].set_angle(context, q[i])
            X = body.body_frame().CalcPose(context, racket.head.body_frame())
            return X @ (end - [segment.origin, 0.0, 0.0])

        rng = np.random.default_rng(row)
        q = 1e-4 * rng.normal(size=len(bending.joints))
        rest, turned, back = seen(0.0 * q), seen(q), seen(-q)
        rise = 0.5 * (turned - back)[2]
        assert rise == pytest.approx(-bending.arms[row] @ q, abs=1e-10)
        nearer = -along @ (0.5 * (turned + back) - rest) * 2.0 * lengths[row]
        assert nearer == pytest.approx(q @ bending.folds[row] @ q, abs=1e-13)
    assert spacing > 0.0


def test_torsion_joints_have_the_parts_stiffness():
    """GJ over the distance of the middles, on the handle and on the head."""
    racket = segmented(12, torsion_handle=50.0, torsion_head=200.0)
    twist = [j for j in racket.frame_joints() if j.plane == "torsion"]
    step = (0.686 - 0.1) / 11.0
    assert twist[1].stiffness == pytest.approx(50.0 / step, rel=1e-9)
    assert twist[-1].stiffness == pytest.approx(200.0 / step, rel=1e-9)
    assert twist[1].damping == pytest.approx(3.3e-5 * twist[1].stiffness, rel=1e-12)


def test_a_historys_tensions_are_the_ports():
    scenario = Scenario(overrides={"racket.frame.segments": 6}, after=0.003, audit=True)
    system = make_impact_diagram(scenario)
    trajectory = run_drake(resolve(scenario), system)
    history = simulate(scenario, system).history
    assert trajectory.state.shape[0] == history.sizes["time"]
    bed, middle = system.impact.string_bed, len(trajectory) // 2
    root = system.create_context()
    context = system.plant.GetMyMutableContextFromRoot(root)
    system.plant.SetPositionsAndVelocities(context, trajectory.state[middle])
    own = bed.GetMyContextFromRoot(root)
    expected = bed.GetOutputPort("string_tension").Eval(own)
    found = history["string_tension"].to_numpy()[middle]
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    energies = balances(trajectory, held=False)
    stored = stored_in_strings(trajectory.mechanism, trajectory.state[[middle]])
    assert stored[0] == pytest.approx(bed.GetOutputPort("string_energy").Eval(own)[0], rel=1e-10)
    assert len(energies.totals()) == len(trajectory)


def test_the_compiled_loop_is_the_law():
    """The spring-by-spring loop against the arrays, with damped strings."""
    parameters = apply_overrides(segmented(6), {"racket.string_bed.damping": 3.0})
    plant, _, impact, root = moving(parameters, 4)
    bed = impact.string_bed
    own = bed.GetMyContextFromRoot(root)
    state = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(root))
    at, model = bed.at, bed.model
    velocities = at.num_positions + at.velocities
    heights, rates = state[at.positions], state[velocities]
    springs = spring_constants(model)
    expected = bent_forces(heights, rates, springs, model.incidence, model.folds)
    found = np.zeros(at.num_velocities)
    add_bent_forces(
        state,
        at.positions,
        velocities,
        springs,
        model.topology.ends,
        model.arms,
        model.folds,
        found,
        at.velocities,
    )
    np.testing.assert_allclose(found[at.velocities], expected, rtol=1e-12)
    assert np.array_equal(bed.GetOutputPort("generalized_force").Eval(own), found)
    lost = bed.GetOutputPort("string_energy").Eval(own)[1]
    undamped = springs.copy()
    undamped[3] = 0.0
    drag = expected - bent_forces(heights, rates, undamped, model.incidence, model.folds)
    assert lost == pytest.approx(-drag @ rates, rel=1e-10)


@pytest.mark.parametrize("engine", [pytest.param("drake", marks=pytest.mark.slow), "compiled"])
def test_energy_and_momentum_at_tight_settings(engine):
    tight = IntegratorSettings(accuracy=1e-8)
    result = simulate(
        Scenario(
            overrides={"racket.frame.segments": 6, "racket.string_bed.damping": 2.0},
            engine=engine,
            after=0.006 if engine == "compiled" else 0.001,
            integrator=tight,
            offset_y=0.03,
            incidence_deg=20.0,
        ),
        history=False,
    )
    assert result.energy_error < 1e-6
    assert result.momentum_error < 1e-10


def test_both_engines_tell_the_same():
    base = Scenario(
        overrides={"racket.frame.segments": 4, "racket.frame.density": 1.0},
        after=0.006,
        offset_y=0.03,
        integrator=IntegratorSettings(accuracy=1e-6),
    )
    one, two = (simulate(base, engine=engine) for engine in ("drake", "compiled"))
    assert two.rebound_velocity == pytest.approx(one.rebound_velocity, abs=1e-5)
    for name in ("in_plane_angle", "out_of_plane_angle", "torsion_angle", "string_tension"):
        first, second = (r.history[name].interp(time=0.003).to_numpy() for r in (one, two))
        assert second == pytest.approx(first, rel=2e-3, abs=1e-6), name
    assert two.peak_handle_acceleration == pytest.approx(one.peak_handle_acceleration, rel=2e-3)


def test_derivatives_go_through_frame_and_strings():
    """AutoDiff through plant and string-bed, against differences."""
    system = make_impact_diagram(Scenario(overrides={"racket.frame.segments": 4}, audit=False))
    root = system.create_context()
    plant, racket = system.plant, system.impact.racket
    context = plant.GetMyMutableContextFromRoot(root)
    for i, joint in enumerate((*racket.frame_joints, *racket.string_joints)):
        q = plant.GetPositions(context).copy()
        q[joint.position_start()] = 0.004 * np.sin(1.0 + i)
        plant.SetPositions(context, q)
    at = racket.frame_joints[-2].position_start()  # about y: strings end beyond it
    typed = system.diagram.ToAutoDiffXd()
    own = typed.CreateDefaultContext()
    own.SetTimeStateAndParametersFrom(root)
    x = root.get_continuous_state_vector().CopyToVector()
    seeded = np.array([AutoDiffXd(v, np.array([float(i == at)])) for i, v in enumerate(x)])
    own.SetContinuousState(seeded)
    rates = typed.EvalTimeDerivatives(own).CopyToVector()
    exact = np.array([r.derivatives()[0] if r.derivatives().size else 0.0 for r in rates])

    def rates_at(step):
        y = x.copy()
        y[at] += step
        root.SetContinuousState(y)
        return system.diagram.EvalTimeDerivatives(root).CopyToVector()

    expected = (rates_at(1e-6) - rates_at(-1e-6)) / 2e-6
    np.testing.assert_allclose(exact, expected, rtol=0, atol=1e-6 * np.max(np.abs(exact)))
    assert np.count_nonzero(exact[plant.num_positions() :]) > 20


def test_handles_frames_and_names():
    parameters = segmented(6)
    plant = MultibodyPlant(0.0)
    racket = add_racket(plant, parameters)
    names = [body.name() for body in racket.segments]
    assert names == ["handle", "segment_2", "segment_3", "segment_4", "head", "segment_6"]
    assert racket.head is racket.segments[4] or racket.head.name() == "head"
    bodies = {name: racket.frame(name).body().name() for name in ("grip", "gsc", "tip", "throat")}
    assert bodies == {
        "grip": "handle",  # a hand holds one segment
        "gsc": "head",
        "tip": "segment_6",
        "throat": "segment_4",
    }
    assert racket.frame("accelerometer").body().name() == "handle"
    assert [j.name() for j in racket.joints_of("torsion")] == [f"torsion_{i}" for i in range(1, 6)]
    plant.Finalize()
    context = plant.CreateDefaultContext()
    places = {
        name: racket.frame(name).CalcPoseInWorld(context).translation()[0]
        for name in ("grip", "accelerometer", "throat", "gsc", "tip")
    }
    assert places == pytest.approx(
        {"grip": 0.1016, "accelerometer": 0.1, "throat": 0.356, "gsc": 0.511, "tip": 0.686}
    )
    again = add_racket(MultibodyPlant(0.0), parameters)
    with pytest.raises(InputError, match="a frame of 2 segments"):
        find_racket(again.plant, again.model_instance, load_racket())


def test_one_diagram_serves_all_distributions():
    """Density, taper and torsion are a Context's; segments and boundary are a Diagram's."""
    base = Scenario(overrides={"racket.frame.segments": 6})
    system = make_impact_diagram(base)
    for numbers in ({"density": 0.7}, {"taper_in_plane": 1.5}, {"torsion_head": 100.0}):
        keys = {f"racket.frame.{k}": v for k, v in numbers.items()} | base.overrides
        here = dataclasses.replace(base, overrides=keys)
        fresh = make_impact_diagram(here)
        shared = system.create_context(here)
        for racket, root in (
            (system.impact.racket, shared),
            (fresh.impact.racket, fresh.create_context()),
        ):
            context = racket.plant.GetMyContextFromRoot(root)
            assert racket.joint_constants(context) == resolve(here).racket.frame_joints()
            mass = [body.get_mass(context) for body in racket.segments]
            assert mass == [s.mass for s in resolve(here).racket.frame_segments()]
    for numbers in ({"segments": 5}, {"grip_boundary": 0.12}):
        keys = base.overrides | {f"racket.frame.{k}": v for k, v in numbers.items()}
        changed = resolve(dataclasses.replace(base, overrides=keys))
        assert changed.topology != resolve(base).topology


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"segments": 1}, "got 1.0; allowed: a whole number from 2 to 12"),
        ({"segments": 40}, "got 40.0; allowed: a whole number from 2 to 12"),
        ({"segments": 2.5}, "got 2.5; allowed: a whole number from 2 to 12"),
        ({"density": -0.1}, "got -0.1; allowed: 0 or more"),
        ({"density": 1.5}, "got 1.5; allowed: 0 to 1"),
        ({"grip_boundary": 0.4}, "got 0.4; allowed: on the handle, which is 0.356 m long"),
        ({"torsion_head": 0.0}, "got 0.0; allowed: more than 0"),
    ],
)
def test_bad_distributions_are_refused_on_one_line(numbers, message):
    keys = {"racket.frame.segments": 6} | {f"racket.frame.{k}": v for k, v in numbers.items()}
    with pytest.raises(InputError, match=message) as caught:
        apply_overrides(load_racket(), keys)
    assert "\n" not in str(caught.value)


def test_moments_that_no_density_has_are_refused():
    keys = {"racket.frame.segments": 4, "racket.handle.moi_transverse": 0.006}
    keys["racket.handle.moi_frontal"] = 0.006
    with pytest.raises(InputError, match="mass within the part's length"):
        apply_overrides(load_racket(), keys)


def test_the_command_lines_keys():
    set_ = with_settings(Scenario(), ["racket.frame.segments=6", "racket.frame.density=0.5"])
    assert len(resolve(set_).racket.frame_segments()) == 6
