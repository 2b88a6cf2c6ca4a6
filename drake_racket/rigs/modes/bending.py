"""Tells what the hammer's ringing should show of the frame's bending, and what it shows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from drake_racket.io.signals import Signal
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.segments import need_two
from drake_racket.plant.racket import add_racket

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class BendingMode:
    """Holds the small bending in one plane: J q'' + cf q' + kf q = 0 for the joint angle q.

    Attributes:
        frequency: undamped, Hz.  damping_ratio: cf / (2 sqrt(kf J)).
        inertia: J, kg m^2.
        node: on the handle, m from the butt, where the mode does not move: a hit there does not
            excite it, and an accelerometer there does not see it.
        motion: displacement per joint angle (m/rad) at the butt; it falls straight to 0 at the
            node, so that at x it is motion (1 - x / node).

    """

    frequency: float
    damping_ratio: float
    inertia: float
    node: float
    motion: float

    @property
    def damped_frequency(self) -> float:
        """Gives Hz; NaN where the damping is critical or more, and nothing rings."""
        if self.damping_ratio >= 1.0:
            return math.nan
        return self.frequency * math.sqrt(1.0 - self.damping_ratio**2)

    def ringing_per_impulse(self, place: float) -> float:
        """Gives the acceleration's amplitude at `place` after a short hit there, m/s^2 per N s.

        An impulse I gives the mode the rate q' = u I / J, and the place the acceleration u w q',
        with u the motion of the place per joint angle.
        """
        u = self.motion * (1.0 - place / self.node)
        return u * u * 2.0 * math.pi * self.frequency / self.inertia


def bending_mode(parameters: RacketParameters, direction: str) -> BendingMode:
    """Gives the mode `in_plane` or `out_of_plane`, from the plant's mass matrix at rest.

    With both momenta zero, the handle's velocity V follows from the joint's rate q':
    M_VV V + M_Vq q' = 0, and the kinetic energy is J q'^2 / 2, J = M_qq - M_qV M_VV^-1 M_Vq.

    Raises:
        InputError: a frame of more than two segments, which has several modes in a plane.

    """
    need_two(parameters, "bending_mode: parameters")
    plant = MultibodyPlant(0.0)
    racket = add_racket(plant, parameters, strung=False)
    plant.Finalize()
    q = racket.frame_joint(direction).velocity_start()
    joints = [joint.velocity_start() for joint in racket.frame_joints]
    base = [i for i in range(plant.num_velocities()) if i not in joints]
    context = plant.CreateDefaultContext()
    mass = plant.CalcMassMatrix(context)
    velocity = np.zeros(plant.num_velocities())
    velocity[q] = 1.0
    velocity[base] = -np.linalg.solve(mass[np.ix_(base, base)], mass[base, q])
    inertia = float(velocity @ mass @ velocity)
    plant.SetVelocities(context, velocity)
    motion = racket.handle.EvalSpatialVelocityInWorld(context)
    along = [0.0, 1.0, 0.0] if direction == "in_plane" else [0.0, 0.0, 1.0]
    at_butt = float(np.dot(motion.translational(), along))
    per_metre = float(np.dot(np.cross(motion.rotational(), [1.0, 0.0, 0.0]), along))
    stiffness, damping = parameters.throat_joint.constants(direction)
    return BendingMode(
        frequency=math.sqrt(stiffness / inertia) / (2.0 * math.pi),
        damping_ratio=damping / (2.0 * math.sqrt(stiffness * inertia)),
        inertia=inertia,
        node=-at_butt / per_metre,
        motion=at_butt,
    )


def acceleration_signal(strike: xarray.Dataset) -> Signal:
    """Gives the acceleration of a strike as a Signal."""
    time, value = strike["time"].to_numpy(), strike["acceleration"].to_numpy()
    return Signal(time, value, "acceleration", "m/s^2", strike.attrs["title"])
