"""Contact surface in a plant of one's own: AutoDiff, the compiled engine, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator, Simulator_
from pydrake.systems.framework import DiagramBuilder

import drake_racket as dr
from drake_racket import (
    InputError,
    Scenario,
    SurfaceContact,
    add_ball,
    add_impact,
    add_racket,
    load_ball,
    load_racket,
    make_impact_diagram,
    resolve,
)
from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import CB, KB, MU, PHASE
from drake_racket.laws.places import bed_weights
from drake_racket.laws.surface import CT, FLATTENING, GRIPS, KT, RADIUS, WEIGHT_0
from drake_racket.plant.compose import connect_forces
from drake_racket.plant.contacts import surface_model

SCENARIO = Scenario(
    contact="surface",
    incidence_deg=45.0,
    azimuth_deg=60.0,
    speed=31.0,
    spin_rpm=-1500.0,
    offset_x=0.03,
    offset_y=-0.02,
    approach_time=0.0,
    audit=False,
)
STEP = 5e-5
NAMES = ("kb", "mu", "flattening", "kt", "ct")
PLACES = {"kb": (0, 2), "flattening": (2, 1), "kt": (2, 2), "ct": (2, 3)}


def outcome(system, diagram, simulator_type, values, scalar):
    """Rebound velocity and R times spin, with the five parameters set."""
    root = diagram.CreateDefaultContext()
    root.SetTimeStateAndParametersFrom(system.create_context(SCENARIO))
    contact = diagram.GetSubsystemByName(system.impact.contact.get_name())
    own = contact.GetMyMutableContextFromRoot(root)
    for name, value in zip(NAMES, values, strict=True):
        if name == "mu":
            count = own.get_numeric_parameter(SurfaceContact.FRICTION).size()
            group = own.get_mutable_numeric_parameter(SurfaceContact.FRICTION)
            group.SetFromVector(np.array([value] * count))
        else:
            group, place = PLACES[name]
            own.get_mutable_numeric_parameter(group)[place] = scalar(value)
    simulator = simulator_type(diagram, root)
    root = simulator.get_mutable_context()
    root.SetAccuracy(1e-6)
    integrator = simulator.get_mutable_integrator()
    integrator.set_maximum_step_size(STEP)
    integrator.request_initial_step_size_target(STEP)
    integrator.set_fixed_step_mode(True)
    simulator.AdvanceTo(0.006)
    plant = diagram.GetSubsystemByName("plant")
    ball = plant.GetBodyByName("ball")
    v = ball.EvalSpatialVelocityInWorld(plant.GetMyContextFromRoot(root))
    return np.concatenate([v.translational(), 0.03 * v.rotational()])


@pytest.fixture(scope="module")
def exact():
    """The Diagram, its parameters, and derivatives by AutoDiff through the whole impact."""
    system = make_impact_diagram(SCENARIO)
    model = surface_model(load_racket(), load_ball())
    values = [model.ball[2], 0.4, *model.surface[1:4]]
    unit = np.eye(len(values))
    seeded = [AutoDiffXd(v, row) for v, row in zip(values, unit, strict=True)]
    diagram = system.diagram.ToAutoDiffXd()
    found = outcome(system, diagram, Simulator_[AutoDiffXd], seeded, lambda x: x)
    return system, values, np.array([v.derivatives() for v in found])


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", NAMES)
def test_derivatives_equal_central_differences(exact, name):
    system, values, derivatives = exact
    i = NAMES.index(name)
    h = 1e-4 * values[i]
    ends = []
    for sign in (1.0, -1.0):
        moved = [v + sign * h * (j == i) for j, v in enumerate(values)]
        ends.append(outcome(system, system.diagram, Simulator, moved, float))
    difference = (ends[0] - ends[1]) / (2.0 * h)
    scale = float(np.max(np.abs(difference)))
    assert scale * values[i] > 1e-3  # the case is sensitive to it
    np.testing.assert_allclose(derivatives[:, i], difference, rtol=0, atol=2e-3 * scale)


@pytest.mark.parametrize("grips", [0.0, 1.0])
def test_derivatives_of_the_rates_at_one_state(grips):
    """What is latched, and the element, seeded one by one: against central differences."""
    system = make_impact_diagram(SCENARIO)
    simulator = Simulator(system.diagram, system.create_context(SCENARIO))
    simulator.AdvanceTo(0.001)
    root = simulator.get_context()
    own = system.impact.contact.GetMyContextFromRoot(root)
    record = own.get_discrete_state_vector().CopyToVector()
    assert record[PHASE] == CONTACT
    record[GRIPS] = grips
    u = own.get_continuous_state_vector().CopyToVector() + np.array([1e-4, 2e-4])
    seeds = [KB, CB, MU, RADIUS, FLATTENING, KT, CT, WEIGHT_0]
    diagram = system.diagram.ToAutoDiffXd()
    seeded = diagram.CreateDefaultContext()
    seeded.SetTimeStateAndParametersFrom(root)
    count = len(seeds) + 2
    numbers = [AutoDiffXd(x, np.zeros(count)) for x in record]
    for i, place in enumerate(seeds):
        numbers[place] = AutoDiffXd(record[place], np.eye(count)[i])
    contact = diagram.GetSubsystemByName(system.impact.contact.get_name())
    context = contact.GetMyMutableContextFromRoot(seeded)
    context.SetDiscreteState(np.array(numbers))
    context.SetContinuousState(
        np.array([AutoDiffXd(x, row) for x, row in zip(u, np.eye(count)[-2:], strict=True)])
    )
    found = diagram.EvalTimeDerivatives(seeded).CopyToVector()
    exact = np.array([np.resize(x.derivatives(), count) for x in found])

    def rates(place, value):
        changed, shear = record.copy(), u.copy()
        (shear if place < 0 else changed)[place] = value
        own = system.impact.contact.GetMyMutableContextFromRoot(root_again)
        own.SetDiscreteState(changed)
        own.SetContinuousState(shear)
        return system.diagram.EvalTimeDerivatives(root_again).CopyToVector()

    root_again = root.Clone()
    for i, place in enumerate([*seeds, -2, -1]):
        value = u[place] if place < 0 else record[place]
        h = 1e-5 * abs(value)
        difference = (rates(place, value + h) - rates(place, value - h)) / (2.0 * h)
        scale = float(np.max(np.abs(difference)))
        np.testing.assert_allclose(exact[:, i], difference, rtol=0, atol=1e-6 * scale + 1e-9)


# --- in a Diagram of one's own --------------------------------------------------------------------


def composed(paper: bool):
    """Two rackets and a spinning ball on the first; on the second one of the paper's, if asked."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    contacts = ["surface", "paper" if paper else "surface"]
    rackets = [add_racket(plant, load_racket("tour"), name=f"racket_{i}") for i in range(2)]
    balls = [
        add_ball(plant, load_ball(), name=f"ball_{i}", contact=contact)
        for i, contact in enumerate(contacts)
    ]
    impacts = [
        add_impact(builder, plant, racket, ball, contact=contact, connect=False)
        for racket, ball, contact in zip(rackets, balls, contacts, strict=True)
    ]
    connect_forces(builder, plant, impacts)
    return plant, impacts, builder.Build()


def start(plant, impacts, root):
    """Both balls come towards their rackets, which stand one beside the other."""
    context = plant.GetMyMutableContextFromRoot(root)
    for i, impact in enumerate(impacts):
        pose = RigidTransform([0.0, float(i), 0.0])
        plant.SetFreeBodyPose(context, impact.racket.handle, pose)
        pose = RigidTransform([0.5, i + 0.02, 0.04])
        plant.SetFreeBodyPose(context, impact.ball.body, pose)
        velocity = SpatialVelocity([200.0, 50.0, -30.0], [1.0, 6.0, -25.0])
        plant.SetFreeBodySpatialVelocity(context, impact.ball.body, velocity)


@pytest.mark.parametrize("paper", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_the_compiled_engine_runs_it_as_drake_does(paper):
    plant, impacts, diagram = composed(paper)
    compiled = dr.CompiledDiagram(diagram, plant, impacts)
    root = diagram.CreateDefaultContext()
    start(plant, impacts, root)
    compiled.advance(root, 0.002)  # in contact: the element goes over to the next run
    compiled.advance(root, 0.008)
    simulator = Simulator(diagram)
    expected = simulator.get_mutable_context()
    start(plant, impacts, expected)
    dr.configure_integrator(simulator, dr.IntegratorSettings(accuracy=1e-6))
    simulator.AdvanceTo(0.008)
    ours, theirs = (
        plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(c)) for c in (root, expected)
    )
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-3)
    assert [i.record(root).touches for i in impacts] == [1, 1]


@pytest.mark.parametrize(("axis", "beyond", "inside"), [(0, 0.17, 0.16), (1, 0.127, 0.118)])
def test_a_ball_beyond_the_rim_passes_by(axis, beyond, inside):
    case = resolve(Scenario(contact="surface", audit=False))
    system = make_impact_diagram(case)
    for away, touches in ((beyond, 0), (inside, 1)):
        simulator = Simulator(system.diagram, system.create_context(case))
        dr.configure_integrator(simulator, dr.IntegratorSettings())
        root = simulator.get_mutable_context()
        context = system.plant.GetMyMutableContextFromRoot(root)
        place = np.add(system.impact.racket.parameters.centre(), [0.0, 0.0, 0.05])
        place[axis] += away
        system.plant.SetFreeBodyPose(context, system.impact.ball.body, RigidTransform(place))
        simulator.AdvanceTo(2.5e-3)
        assert system.impact.record(root).touches == touches


def test_the_stored_energy_is_that_of_both_springs():
    """The port, in the middle of a contact: kb x^2 / 2 and kt u^2 / 2."""
    case = resolve(SCENARIO)
    system = make_impact_diagram(case)
    simulator = Simulator(system.diagram, system.create_context(case))
    simulator.AdvanceTo(1e-3)
    contact = system.impact.contact
    own = contact.GetMyContextFromRoot(simulator.get_context())
    record = own.get_discrete_state_vector().CopyToVector()
    x = contact.GetOutputPort("contact_state").Eval(own)[2]
    u = own.get_continuous_state_vector().CopyToVector()
    assert x > 1e-3
    assert np.linalg.norm(u) > 1e-4
    expected = 0.5 * record[KB] * x * x + 0.5 * record[KT] * (u @ u)
    assert contact.GetOutputPort("stored_energy").Eval(own)[0] == pytest.approx(expected)


def test_what_does_not_fit_is_refused():
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    racket = add_racket(plant, load_racket("tour"))
    with pytest.raises(InputError, match="add_ball: contact: got 'area'; allowed: paper, surface"):
        add_ball(plant, load_ball(), contact="area")
    ball = add_ball(plant, load_ball())
    with pytest.raises(InputError, match="add_impact: contact: got 'area'; allowed: paper"):
        add_impact(builder, plant, racket, ball, contact="area")
    with pytest.raises(InputError, match=r"got 'surface'; allowed: paper, as the ball was made"):
        add_impact(builder, plant, racket, ball, contact="surface")
    bare = dataclasses.replace(load_ball(), surface=None)
    with pytest.raises(InputError, match="ball penn_titanium: surface: got 'nothing'"):
        add_ball(plant, bare, name="bare", contact="surface")
    discrete = MultibodyPlant(1e-5)
    builder = DiagramBuilder()
    builder.AddSystem(discrete)
    racket = add_racket(discrete, load_racket("tour"))
    ball = add_ball(discrete, load_ball(), contact="surface")
    with pytest.raises(InputError, match="surface, on a discrete plant"):
        add_impact(builder, discrete, racket, ball, contact="surface")
    point = add_ball(discrete, load_ball(), name="point")
    with pytest.raises(InputError, match="friction reading element, on a discrete plant"):
        add_impact(builder, discrete, racket, point, friction_reading="element")


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"contact": "area"}, "contact: got 'area'; allowed: paper, surface"),
        ({"spin_rpm": 100.0}, "spin_rpm: got 100.0; allowed: 0 with contact paper"),
        ({"spin": (1.0, 0.0, 0.0)}, r"spin: got \(1.0, 0.0, 0.0\); allowed: 0 with contact paper"),
        ({"contact": "surface", "spin_rpm": 1e6}, "spin_rpm: got 1000000.0; allowed: -20000 to"),
        ({"contact": "surface", "spin": (1.0, 2.0)}, r"spin: got \(1.0, 2.0\); allowed: 3 numbers"),
        (
            {"contact": "surface", "time_step": 1e-5},
            "time_step: got 1e-05; allowed: 0 with",
        ),
        (
            {"contact": "surface", "friction_reading": "displacement"},
            "friction_reading: got 'displacement'; allowed: velocity with contact surface",
        ),
        (
            {"contact": "surface", "reaction_point": "string_mass"},
            "reaction_point: got 'string_mass'; allowed: ball with contact surface",
        ),
        (
            {"friction_reading": "element", "time_step": 1e-5},
            "time_step: got 1e-05; allowed: 0 with friction_reading element",
        ),
        (
            {"friction_reading": "element", "reaction_point": "string_mass"},
            "reaction_point: got 'string_mass'; allowed: ball with friction_reading element",
        ),
        ({"normal": "hertz"}, "normal: got 'hertz'; allowed: .*linear, hunt_crossley"),
        (
            {"normal": "hunt_crossley", "ball": "penn_titanium_slow"},
            "hunt_crossley: got 'nothing'; allowed: the numbers stiffness, stiffness_rise",
        ),
        (
            {"contact": "surface", "overrides": {"ball.surface.flattening": 1.5}},
            "overrides.ball.surface.flattening: got 1.5; allowed: at most 1",
        ),
    ],
    ids=str,
)
def test_bad_scenarios_in_one_line(changes, text):
    with pytest.raises(InputError, match=text) as error:
        resolve(Scenario(**changes))
    assert "\n" not in str(error.value)


# --- places in the bed ----------------------------------------------------------------------------


def test_weights_are_those_of_the_mass_at_its_own_place_and_fall_to_the_rim():
    model = surface_model(load_racket(), load_ball())
    for i, (x, y) in enumerate(model.grid):
        points, weights, shares = bed_weights(model.grid, model.rim, x, y)
        assert sum(w for p, w in zip(points, weights, strict=True) if p == i) == 1.0
        assert sum(weights) == sum(shares) == 1.0
    for angle in np.linspace(0.0, 6.28, 25):
        x, y = model.rim[0] * np.cos(angle), model.rim[1] * np.sin(angle)
        _, weights, shares = bed_weights(model.grid, model.rim, 0.999999 * x, 0.999999 * y)
        assert 0.0 <= sum(weights) < 1e-4
        assert sum(shares) == pytest.approx(1.0, abs=1e-15)
        _, weights, _ = bed_weights(model.grid, model.rim, 1.1 * x, 1.1 * y)
        assert sum(weights) == 0.0


def test_weights_are_continuous():
    """No step larger than the distance allows, along a fine path over the whole bed."""
    model = surface_model(load_racket("recreational", "high"), load_ball())
    t = np.linspace(0.0, 60.0, 20001)
    radius = 0.99 * t / t[-1]
    path = radius * model.rim[0] * np.cos(t), radius * model.rim[1] * np.sin(t)
    dense = np.zeros((len(t), 9))
    for row, x, y in zip(dense, *path, strict=True):
        points, weights, _ = bed_weights(model.grid, model.rim, x, y)
        for p, w in zip(points, weights, strict=True):
            row[p] += w
    jump = np.max(np.abs(np.diff(dense, axis=0)))
    assert jump < 0.012  # 0.5 mm a step; the steepest fall is from a line to a near rim
