"""Tells what the hammer's ringing should show of the frame's bending, and what it shows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from drake_racket.io.signals import Signal
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.racket import add_racket
from drake_racket.rigs.hammer.ringing import analyse_ringing
from drake_racket.rigs.modes.frame_modes import published_fundamentals

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
    """
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


def ringing_dataset(
    strikes: Mapping[str, xarray.Dataset], racket: RacketParameters
) -> xarray.Dataset:
    """Reads frequency and damping from strikes, by direction, beside the model's and the published.

    Args:
        strikes: by direction, as `hammer_dataset` returns them.
        racket: whose strikes they are.

    Returns:
        A dataset over `direction`; what the source does not print is NaN.

    Raises:
        InputError: as `analyse_ringing`.

    """
    import xarray as xr

    rows = []
    for direction, strike in strikes.items():
        place, end = strike.attrs["place_m"], strike.attrs["pulse_end_s"]
        ringing = analyse_ringing(acceleration_signal(strike), start=end)
        mode = bending_mode(racket, direction)
        in_plane, out_of_plane = published_fundamentals(racket.name.split("_")[0])
        rows.append(
            (
                ringing.frequency,
                ringing.spectrum_frequency,
                ringing.logarithmic_decrement,
                ringing.damping_ratio,
                ringing.fit_frequency,
                ringing.fit_damping_ratio,
                ringing.amplitude,
                mode.damped_frequency,
                mode.damping_ratio,
                mode.node,
                mode.node - place,
                in_plane if direction == "in_plane" else out_of_plane,
            )
        )
    names = (
        ("frequency", "Hz", "frequency, from the extrema"),
        ("spectrum_frequency", "Hz", "frequency, from the spectrum"),
        ("logarithmic_decrement", "1", "logarithmic decrement, from the extrema"),
        ("damping_ratio", "1", "damping ratio, from the decrement"),
        ("fit_frequency", "Hz", "frequency, from the fit"),
        ("fit_damping_ratio", "1", "damping ratio, from the fit"),
        ("amplitude", "m/s^2", "amplitude at the pulse's end, from the fit"),
        ("mode_frequency", "Hz", "damped frequency of the linear model"),
        ("mode_damping_ratio", "1", "damping ratio of the linear model"),
        ("node", "m", "node of the mode on the handle, from the butt"),
        ("distance_to_node", "m", "node less place of the hit"),
        ("published_frequency", "Hz", "published frequency (Glynn et al. 2011)"),
    )
    return xr.Dataset(
        {
            name: ("direction", column, {"units": units, "long_name": text})
            for (name, units, text), column in zip(names, np.transpose(rows), strict=True)
        },
        coords={"direction": ("direction", list(strikes), {"units": "", "long_name": "hit"})},
    )


def acceleration_signal(strike: xarray.Dataset) -> Signal:
    """Gives the acceleration of a strike as a Signal."""
    time, value = strike["time"].to_numpy(), strike["acceleration"].to_numpy()
    return Signal(time, value, "acceleration", "m/s^2", strike.attrs["title"])
