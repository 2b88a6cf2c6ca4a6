"""The force plate rig shoots the ball at a rigid plate.

The plate takes the place of the string mass in the same `BallContact` that meets a racket: a body
welded to the world. `plate_force` has the closed form of such an impact, and the analysis of a
force signal, the rig's or a measured one.

The source (Glynn et al. 2011, Methods) fired balls at 18-33 m/s in steps of about 3 at a Kistler
plate sampled at 65 kHz, and fitted kb and cb at each speed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, EventStatus
from scipy.interpolate import CubicHermiteSpline

from drake_racket.engines.drake.engine import configure_integrator
from drake_racket.io.errors import InputError
from drake_racket.io.signals import Signal
from drake_racket.io.units import labelled
from drake_racket.laws.contact import CONTACT, normal_force, normal_slopes
from drake_racket.laws.phases import ContactBodies, ContactModel, contact_record
from drake_racket.parameters.ball import BallParameters, load_ball
from drake_racket.parameters.scenario import IntegratorSettings
from drake_racket.plant.ball import Ball, add_ball, ball_law, set_ball_inertia
from drake_racket.plant.systems.ball_contact import BallContact
from drake_racket.rigs.force_plate.force import (
    AFTER,
    BEFORE,
    PLATE_SAMPLE_RATE,
    closed_form,
    sample_times,
)
from drake_racket.rigs.head_clamped import CANNON_SPEEDS

if TYPE_CHECKING:
    import xarray

STEP = IntegratorSettings(maximum_step=1e-5, error_control=False)
"""Some 300 steps in a contact: times and forces to 1e-7 of the closed form."""


@dataclass(frozen=True)
class PlateImpact:
    """Holds one impact on the plate.

    Attributes:
        speed, rebound_speed: m/s.  kb, cb: N/m, N s/m, latched at touch.
        contact_time, peak_time: s from touch.  peak_force: N.  impulse: N s, integral of N.
        time, force: the solver's steps from touch to release, s and N.

    """

    speed: float
    kb: float
    cb: float
    contact_time: float
    rebound_speed: float
    peak_force: float
    peak_time: float
    impulse: float
    time: NDArray[np.float64]
    force: NDArray[np.float64]
    spline: CubicHermiteSpline  # force over the contact, from N and N' at the steps

    @property
    def restitution(self) -> float:
        """Gives the rebound over approach speed."""
        return self.rebound_speed / self.speed

    def sampled(
        self, rate: float = PLATE_SAMPLE_RATE, *, before: float = BEFORE, after: float = AFTER
    ) -> Signal:
        """Gives the force as a plate records it: zero before touch (t = 0) and after release.

        Args:
            rate: Hz.  before, after: s of the record before touch, and from touch on.

        """
        time = sample_times(rate, before, after)
        inside = (time >= 0.0) & (time <= self.contact_time)
        force = np.zeros_like(time)
        force[inside] = self.spline(time[inside])
        return Signal(time, force, "force", "N", f"model at {self.speed:g} m/s")


@dataclass(frozen=True)
class ForcePlate:
    """Holds the rig: built once by `make_force_plate`, run at any speed and with any ball."""

    diagram: Diagram
    plant: MultibodyPlant
    ball: Ball
    contact: Any

    def run(
        self,
        speed: float,
        ball: BallParameters | None = None,
        *,
        settings: IntegratorSettings = STEP,
    ) -> PlateImpact:
        """Shoots the ball at the plate, normal to it.

        Args:
            speed: m/s, 0.1 to 100.
            ball: another ball than the one the rig was built with.

        Raises:
            InputError: a speed outside the range.

        """
        if not 0.1 <= speed <= 100.0:
            raise InputError("speed", speed, "0.1 to 100 m/s")
        ball = ball or self.ball.parameters
        root = self.diagram.CreateDefaultContext()
        self._set(root, speed, ball)
        simulator = Simulator(self.diagram, root)
        root = simulator.get_mutable_context()
        configure_integrator(simulator, settings)
        rows: list[tuple[float, float, float]] = []  # time, compression, its rate; in contact only

        def record(at: Context) -> EventStatus:
            if self._latched(at).phase == CONTACT:
                state = self.contact.GetOutputPort("contact_state").Eval(
                    self.contact.GetMyContextFromRoot(at)
                )
                rows.append((at.get_time(), state[2], state[3]))
            return EventStatus.Succeeded()

        simulator.set_monitor(record)
        simulator.Initialize()
        latched = self._latched(root)
        # half a period: no contact of the law is longer, however damped
        simulator.AdvanceTo(1.05 * math.pi * math.sqrt(ball.mass.value / latched.kb))
        return _plate_impact(np.array(rows).T, self._latched(root), ball.mass.value)

    def _latched(self, root: Context) -> Any:
        context = self.contact.GetMyContextFromRoot(root)
        return contact_record(context.get_discrete_state_vector().CopyToVector())

    def _set(self, root: Context, speed: float, ball: BallParameters) -> None:
        plant, body = self.plant, self.ball.body
        context = plant.GetMyMutableContextFromRoot(root)
        set_ball_inertia(self.ball, root, ball)
        plant.SetFreeBodyPose(context, body, RigidTransform())
        plant.SetFreeBodySpatialVelocity(
            context, body, SpatialVelocity([0.0, 0.0, 0.0], [0.0, 0.0, -speed])
        )
        contact = self.contact.GetMyMutableContextFromRoot(root)
        contact.get_mutable_numeric_parameter(self.contact.BALL).SetFromVector(
            np.array(ball_law(ball))
        )


def make_force_plate(ball: BallParameters | None = None) -> ForcePlate:
    """Builds the rig: a plate welded to the world, its surface z = 0, and a ball above it."""
    ball = ball or load_ball()
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(0.0))
    plate = plant.AddRigidBody("plate", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))
    plant.WeldFrames(plant.world_frame(), plate.body_frame())
    added = add_ball(plant, ball)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    plant.Finalize()
    model = ContactModel(
        ball=ball_law(ball),
        friction=(0.0,),
        scales=(ball.sliding_speed_scale.value, ball.sliding_distance_scale.value),
        grid=np.zeros((1, 2)),
        rim=(math.inf, math.inf),  # a plate has no rim to pass
        point=1,
        by_displacement=False,
        reaction_at_ball=True,
    )
    bodies = ContactBodies(ball=int(added.body.index()), strings=(int(plate.index()),))
    contact = builder.AddNamedSystem("contact", BallContact(model, bodies, plant))
    builder.Connect(plant.get_state_output_port(), contact.GetInputPort("state"))
    builder.Connect(
        contact.GetOutputPort("spatial_forces"), plant.get_applied_spatial_force_input_port()
    )
    return ForcePlate(builder.Build(), plant, added, contact)


def _plate_impact(rows: NDArray[np.float64], latched: Any, mass: float) -> PlateImpact:
    time, x, rate = rows
    constants = latched.kb, latched.cb, latched.hb, latched.db
    raw = normal_force(x, rate, *constants)
    kx, cx = normal_slopes(x, rate, *constants)
    # the plate does not move: x'' = -N / m, so the rate of N is known at every step
    spline = CubicHermiteSpline(time, raw, kx * rate - cx * raw / mass)
    flat = spline.derivative().roots(extrapolate=False)
    candidates = np.concatenate([[0.0], flat[np.isfinite(flat)]])
    best = candidates[int(np.argmax(spline(candidates)))]
    return PlateImpact(
        speed=latched.approach_speed,
        kb=latched.kb,
        cb=latched.cb,
        contact_time=latched.release_time - latched.touch_time,
        rebound_speed=-float(rate[-1]),
        peak_force=float(spline(best)),
        peak_time=float(best),
        impulse=float(spline.integrate(time[0], time[-1])),
        time=time,
        force=raw,
        spline=spline,
    )


def plate_dataset(
    speeds: Sequence[float] = CANNON_SPEEDS,
    ball: BallParameters | None = None,
    *,
    rate: float = PLATE_SAMPLE_RATE,
    settings: IntegratorSettings = STEP,
) -> xarray.Dataset:
    """Runs impacts at several speeds, each beside its closed form.

    Args:
        speeds: m/s, each once.  rate: Hz of the sampled force.

    Returns:
        A dataset over `speed` (m/s), with the force over `time` (s from touch) too. Every variable
        has `units` and `long_name`. There is a closed form with normal law `linear` only.

    Raises:
        InputError: no speed, a speed twice or outside 0.1-100 m/s, or a rate out of range.

    """
    import xarray as xr

    if not len(speeds) or len(set(speeds)) < len(speeds):
        raise InputError("speeds", list(speeds), "one or more speeds, each once")
    plate = make_force_plate(ball)
    ball = plate.ball.parameters
    time = sample_times(rate, BEFORE, AFTER)
    runs = [plate.run(speed, settings=settings) for speed in speeds]
    columns: dict[str, Any] = {
        name: labelled("speed", [getattr(r, name) for r in runs], units, text)
        for name, units, text in _VARIABLES
    }
    forces = [r.sampled(rate).value for r in runs]
    columns["force"] = labelled(("speed", "time"), forces, "N", "force on the plate")
    if ball.normal == "linear":
        columns |= _closed_columns(runs, ball.mass.value, time)
    return xr.Dataset(
        columns,
        coords={
            "speed": labelled("speed", list(speeds), "m/s", "approach speed"),
            "time": labelled("time", time, "s", "time from touch"),
        },
        attrs={
            "title": f"{ball.title} on a force plate",
            "ball": ball.name,
            "ball_mass_kg": ball.mass.value,
            "identified_speeds_m_per_s": [ball.speed_low.value, ball.speed_high.value],
            "sample_rate_Hz": rate,
        },
    )


def _closed_columns(
    runs: Sequence[PlateImpact], mass: float, time: NDArray[np.float64]
) -> dict[str, Any]:
    """The closed forms of runs, as columns of `plate_dataset`."""
    forms = [closed_form(mass=mass, stiffness=r.kb, damping=r.cb, speed=r.speed) for r in runs]
    columns: dict[str, Any] = {
        f"{name}_closed_form": labelled(
            "speed", [getattr(f, name) for f in forms], units, f"{text}, closed form"
        )
        for name, units, text in _VARIABLES[2:]
    }
    forces = [f.force(time) for f in forms]
    text = "force on the plate, closed form"
    columns["force_closed_form"] = labelled(("speed", "time"), forces, "N", text)
    return columns


_VARIABLES = (
    ("kb", "N/m", "stiffness of the ball"),
    ("cb", "N*s/m", "damping of the ball"),
    ("contact_time", "s", "contact time"),
    ("peak_force", "N", "peak force"),
    ("peak_time", "s", "time of the peak force from touch"),
    ("restitution", "1", "rebound over approach speed"),
    ("rebound_speed", "m/s", "rebound speed"),
    ("impulse", "N*s", "impulse of the force"),
)
