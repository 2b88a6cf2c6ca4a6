"""The first impact, composed by hand: a racket, a ball and their contact on your own plant.

    python studies/first_impact.py --out first_impact

The same as `drake-racket impact`, in the open: what a script of your own would do, with a robot,
an arm or a second racket in the same plant. The plant has a SceneGraph, and so the racket has
shapes: `--page` writes the impact as a web page that moves, by Drake's own Meshcat, with no window
and no server to look at it. Leave out the SceneGraph (`builder.AddSystem(MultibodyPlant(0.0))`) and
nothing is drawn, and the numbers are the same.
"""

import argparse
from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat, MeshcatAnimation, MeshcatParams, MeshcatVisualizer
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

import drake_racket as dr

parser = argparse.ArgumentParser(description="A tennis impact composed by hand.")
parser.add_argument("--out", type=Path, default=Path("first_impact"), help="output directory")
parser.add_argument("--speed", type=float, default=25.0, help="speed of the ball (m/s)")
parser.add_argument("--page", action="store_true", help="write the impact as a page (Meshcat)")
arguments = parser.parse_args()

builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
racket = dr.add_racket(plant, dr.load_racket("tour", "low"))  # parent=... welds it to your arm
ball = dr.add_ball(plant, dr.load_ball())
plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
plant.Finalize()
impact = dr.add_impact(builder, plant, racket, ball)  # meets the nearest string-bed point
log = LogVectorOutput(impact.contact.GetOutputPort("contact_state"), builder)
meshcat = None
if arguments.page:
    meshcat = Meshcat(MeshcatParams(host="localhost", port=0))
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
diagram = builder.Build()

simulator = Simulator(diagram)
dr.configure_integrator(simulator, dr.IntegratorSettings())
root = simulator.get_mutable_context()
context = plant.GetMyMutableContextFromRoot(root)
above_centre = np.add(racket.parameters.point(5), [0.0, 0.0, 0.02])
plant.SetFreeBodyPose(context, ball.body, RigidTransform(above_centre))
velocity = SpatialVelocity([0.0, 0.0, 0.0], [0.0, 0.0, -arguments.speed])
plant.SetFreeBodySpatialVelocity(context, ball.body, velocity)
if meshcat is None:
    simulator.AdvanceTo(0.02)
else:  # 600 pictures, shown at 30 a second: 1 s of the page is 1 ms
    diagram.ForcedPublish(root)
    animation = MeshcatAnimation(frames_per_second=30.0)
    for picture in range(600):
        simulator.AdvanceTo(picture / 30_000.0)
        for body in (*racket.bodies(), ball.body):
            path = body.scoped_name().get_full().replace("::", "/")
            pose = plant.EvalBodyPoseInWorld(context, body)
            animation.SetTransform(picture, f"/drake/visualizer/{path}", pose)
    animation.set_autoplay(True)
    meshcat.SetAnimation(animation)

record = impact.record(root)
rebound = ball.body.EvalSpatialVelocityInWorld(context).translational()
print(f"touched point {record.point} at {record.approach_speed:.2f} m/s")
print(f"contact {1e3 * (record.release_time - record.touch_time):.2f} ms")
print(f"rebound {rebound[2]:.2f} m/s, apparent restitution {rebound[2] / arguments.speed:.3f}")
arguments.out.mkdir(parents=True, exist_ok=True)
history = log.FindLog(root)
shown = [dr.ContactState.COMPRESSION, dr.ContactState.NORMAL_FORCE]
columns = np.column_stack([history.sample_times(), history.data()[shown].T])
header = "time [s],compression [m],normal_force [N]"
path = arguments.out / "contact.csv"
np.savetxt(path, columns, delimiter=",", header=header, comments="")
print(f"wrote {path}")
if meshcat is not None:
    page = arguments.out / "impact.html"
    page.write_text(meshcat.StaticHtml())
    print(f"wrote {page}")
