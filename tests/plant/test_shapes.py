"""The racket that is seen: shapes on the bodies that move, and no collisions."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
    Role,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo

import drake_racket as dr
from drake_racket.laws.bed import rest_lengths
from drake_racket.plant.shapes import FELT_COLOUR, frame_lines, seam, string_pieces

TOUR = dr.load_racket("tour")
CENTRE = TOUR.centre()


class Scene:
    """A user's Diagram with a SceneGraph, a racket, a ball and a camera over the strings."""

    def __init__(self, **options):
        builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        self.racket = dr.add_racket(self.plant, TOUR, **options)
        self.ball = dr.add_ball(self.plant, dr.load_ball())
        white = RenderEngineVtkParams(default_clear_color=np.ones(3))
        self.scene_graph.AddRenderer("vtk", MakeRenderEngineVtk(white))
        self.plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
        dr.add_impact(builder, self.plant, self.racket, self.ball)
        self.diagram = builder.Build()

    def simulator(self, speed: float) -> Simulator:
        simulator = Simulator(self.diagram)
        dr.configure_integrator(simulator, dr.IntegratorSettings(accuracy=1e-3))
        context = self.plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        above = np.add(CENTRE, [0.0, 0.0, 1e-3])
        self.plant.SetFreeBodyPose(context, self.ball.body, RigidTransform(above))
        velocity = SpatialVelocity([0.0, 0.0, 0.0], [0.0, 0.0, -speed])
        self.plant.SetFreeBodySpatialVelocity(context, self.ball.body, velocity)
        return simulator

    def image(self, root, eye, target) -> np.ndarray:
        """What a camera at `eye` sees (height, width, 3), without a window."""
        z = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
        x = np.cross(z, [0.0, 0.0, 1.0])
        x /= np.linalg.norm(x)
        pose = RigidTransform(RotationMatrix(np.column_stack([x, np.cross(z, x), z])), eye)
        info = CameraInfo(240, 160, 0.8)
        core = RenderCameraCore("vtk", info, ClippingRange(0.01, 10.0), RigidTransform())
        query = self.scene_graph.get_query_output_port().Eval(
            self.scene_graph.GetMyContextFromRoot(root)
        )
        frame = self.scene_graph.world_frame_id()
        picture = query.RenderColorImage(ColorRenderCamera(core, False), frame, pose)
        return picture.data[:, :, :3].astype(int)


def felt(picture: np.ndarray) -> int:
    """How many pixels have the hue of the ball: as red as green, and hardly blue."""
    red, green, blue = np.moveaxis(picture, -1, 0)
    wanted = FELT_COLOUR[0] / FELT_COLOUR[1]
    return int(((np.abs(red / np.maximum(green, 1) - wanted) < 0.08) & (blue < 0.5 * green)).sum())


def test_shapes_are_for_the_eye_alone():
    scene = Scene()
    inspector = scene.scene_graph.model_inspector()
    assert inspector.NumGeometriesWithRole(Role.kProximity) == 0
    assert inspector.NumGeometriesWithRole(Role.kIllustration) > 100
    shown = {
        scene.plant.GetBodyFromFrameId(inspector.GetFrameId(g)).name()
        for g in inspector.GetAllGeometryIds(Role.kIllustration)
    }
    assert shown == {"handle", "head", "ball", *(f"string_{i}" for i in range(1, 10))}


def test_two_rackets_have_names_of_their_own():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    dr.add_racket(plant, TOUR, name="left")
    dr.add_racket(plant, dr.load_racket("recreational"), name="right", strung=False)
    plant.Finalize()
    assert scene_graph.model_inspector().num_geometries() > 120


def test_an_impact_is_seen_without_a_window():
    """The racket is in the picture, the ball is; in contact the strings are elsewhere."""
    scene = Scene()
    simulator = scene.simulator(30.0)
    root = simulator.get_mutable_context()
    eye, target = np.add(CENTRE, [-0.15, -0.4, 0.3]), CENTRE
    before = scene.image(root, eye, target)
    assert 200 < felt(before) < 4000
    dark = (before.sum(axis=2) < 250).mean()
    assert 0.02 < dark < 0.5  # the frame
    simulator.AdvanceTo(0.002)
    context = scene.plant.GetMyContextFromRoot(root)
    deflection = scene.racket.string_joints[4].get_translation(context)
    assert deflection < -0.01
    # a string mass and its strings, looked at from the side, lie deeper by that
    inspector = scene.scene_graph.model_inspector()
    query = scene.scene_graph.get_query_output_port().Eval(
        scene.scene_graph.GetMyContextFromRoot(root)
    )
    body = scene.racket.string_masses[4]
    frame = scene.plant.GetBodyFrameIdOrThrow(body.index())
    for geometry in inspector.GetGeometries(frame, Role.kIllustration):
        pose = query.GetPoseInWorld(geometry).translation()
        head = scene.racket.head.EvalPoseInWorld(context)
        in_head = head.inverse().multiply(pose)
        assert in_head[2] == pytest.approx(deflection, abs=1e-9)
    after = scene.image(root, eye, target)
    assert np.abs(after - before).sum(axis=2).astype(bool).mean() > 0.01


def test_motion_is_the_same_with_and_without_shapes():
    simulator = Scene().simulator(25.0)
    simulator.AdvanceTo(0.003)
    seen = simulator.get_context().get_continuous_state_vector().CopyToVector()
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    racket, ball = dr.add_racket(plant, TOUR), dr.add_ball(plant, dr.load_ball())
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    dr.add_impact(builder, plant, racket, ball)
    bare = Scene.__new__(Scene)
    bare.plant, bare.ball, bare.diagram = plant, ball, builder.Build()
    simulator = bare.simulator(25.0)
    simulator.AdvanceTo(0.003)
    unseen = simulator.get_context().get_continuous_state_vector().CopyToVector()
    np.testing.assert_array_equal(seen, unseen)


def test_the_seam_lies_on_the_ball_and_is_closed():
    line = seam(0.0335)
    np.testing.assert_allclose(np.linalg.norm(line, axis=1), 0.0335, rtol=1e-12)
    np.testing.assert_allclose(line[0], line[-1], atol=1e-15)
    assert np.ptp(line, axis=0).min() > 0.0335  # it goes round in all directions


def test_strings_reach_from_rim_to_rim():
    """A string's pieces are as long as its springs."""
    bed = TOUR.string_bed
    lengths = rest_lengths(
        TOUR.bed_topology(),
        bed.spacing.value,
        bed.rim_semi_axis_x.value,
        bed.rim_semi_axis_y.value,
    )
    drawn = sum(
        np.linalg.norm(piece[1] - piece[0])
        for number in TOUR.bed_topology().points
        for piece in string_pieces(TOUR, number)
    )
    assert drawn == pytest.approx(lengths.sum(), rel=1e-12)


def test_the_frames_lines_meet():
    lines = frame_lines(0.356, 0.155, 0.164, 0.123)
    for handle, head in zip(lines.handle_arms, lines.head_arms, strict=True):
        np.testing.assert_allclose(handle[1], head[0] + [0.356, 0.0, 0.0], atol=1e-15)
        x, y, _ = head[1] - [0.155, 0.0, 0.0]
        assert (x / 0.164) ** 2 + (y / 0.123) ** 2 == pytest.approx(1.0)
