"""The first impact, composed by hand: a racket, a ball and their contact on your own plant.

    python studies/first_impact.py --out first_impact

The same as `drake-racket impact`, in the open: what a script of your own would do, with a robot,
an arm or a second racket in the same plant.
"""

import argparse
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

import drake_racket as dr

parser = argparse.ArgumentParser(description="A tennis impact composed by hand.")
parser.add_argument("--out", type=Path, default=Path("first_impact"), help="output directory")
parser.add_argument("--speed", type=float, default=25.0, help="speed of the ball (m/s)")
arguments = parser.parse_args()

builder = DiagramBuilder()
plant = builder.AddSystem(MultibodyPlant(time_step=0.0))
racket = dr.add_racket(plant, dr.load_racket("tour", "low"))  # parent=... welds it to your arm
ball = dr.add_ball(plant, dr.load_ball())
plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
plant.Finalize()
impact = dr.add_impact(builder, plant, racket, ball)  # meets the nearest string-bed point
log = LogVectorOutput(impact.contact.GetOutputPort("contact_state"), builder)
diagram = builder.Build()

simulator = Simulator(diagram)
dr.configure_integrator(simulator, dr.IntegratorSettings())
root = simulator.get_mutable_context()
context = plant.GetMyMutableContextFromRoot(root)
above_centre = np.add(racket.parameters.point(5), [0.0, 0.0, 0.02])
plant.SetFreeBodyPose(context, ball.body, RigidTransform(above_centre))
velocity = SpatialVelocity([0.0, 0.0, 0.0], [0.0, 0.0, -arguments.speed])
plant.SetFreeBodySpatialVelocity(context, ball.body, velocity)
simulator.AdvanceTo(0.02)

record = impact.record(root)
rebound = ball.body.EvalSpatialVelocityInWorld(context).translational()
print(f"touched point {record.point} at {record.approach_speed:.2f} m/s")
print(f"contact {1e3 * (record.release_time - record.touch_time):.2f} ms")
print(f"rebound {rebound[2]:.2f} m/s, apparent restitution {rebound[2] / arguments.speed:.3f}")
arguments.out.mkdir(parents=True, exist_ok=True)
history = log.FindLog(root)
columns = np.column_stack([history.sample_times(), history.data()[[2, 4]].T])
header = "time [s],compression [m],normal_force [N]"
path = arguments.out / "contact.csv"
np.savetxt(path, columns, delimiter=",", header=header, comments="")
print(f"wrote {path}")
