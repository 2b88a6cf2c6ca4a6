"""The impact hammer strikes the bare racket, hung freely, in the middle of its handle.

A force pulse acts at a place on the handle, out of the plane (along z) or in it (along y), and an
accelerometer directly opposite reads the acceleration of that place along the same direction for
100 ms (Glynn et al. 2011, Methods). Both turn with the handle. The place is on the handle's axis:
its thickness, which the source does not print, would add only the square of the rate of rotation.
No gravity: the racket hangs from threads that hold its weight.

Once the pulse is over, the only motion that is not uniform is the bending. The plant is not linear,
but near it: the acceleration departs from the linear two-body racket by 2e-5 or less of the ringing
at the default 100 N and 2e-3 at 1 kN, growing with the cube of the force. For small angles it is
one mode, with frequency w = sqrt(kf / J) and damping ratio cf / (2 sqrt(kf J)); J is the
inertia that the joint angle sees. How strongly the place rings with the mode depends on its
distance from the mode's node on the handle: see `bending_mode`, which also reads the ringing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from drake_racket.engines.drake.engine import configure_integrator
from drake_racket.io.errors import InputError, SimulationError
from drake_racket.io.units import labelled
from drake_racket.laws.compilation import HAS_NUMBA
from drake_racket.parameters.frame import FrameJoint
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.scenario import ENGINES, IntegratorSettings
from drake_racket.parameters.segments import segment_at
from drake_racket.plant.racket import Racket, add_racket
from drake_racket.rigs.hammer.force import HammerForce, Pulse, half_sine

if TYPE_CHECKING:
    import xarray

DIRECTIONS = {"in_plane": (0.0, 1.0, 0.0), "out_of_plane": (0.0, 0.0, 1.0)}
"""The hammer hits in these directions, in the handle's axes R."""

DURATION = 0.1
"""A record of the hammer is so long (s): Glynn et al. 2011, Methods."""

HAMMER_SAMPLE_RATE = 20e3
"""A record has so many samples a second (Hz); inferred: over a hundred a period of the modes."""

STEP = IntegratorSettings("runge_kutta5", maximum_step=5e-5, error_control=False)
"""The bending turns by 1/20 rad per step: 1e-7 over 100 ms, where third order needs 5 us steps."""


@dataclass(frozen=True)
class HammerRig:
    """Holds the rig for one racket, direction and kind of pulse; built by `make_hammer_rig`."""

    diagram: Diagram
    plant: MultibodyPlant
    racket: Racket
    hammer: Any
    sensor: Frame
    direction: str
    pulse: Pulse
    place: float

    def run(
        self,
        pulse: Pulse | None = None,
        *,
        joint: tuple[float, float] | None = None,
        duration: float = DURATION,
        rate: float = HAMMER_SAMPLE_RATE,
        settings: IntegratorSettings | None = None,
        engine: str = "auto",
    ) -> xarray.Dataset:
        """Strikes the racket at rest.

        Args:
            pulse: another pulse of the same kind (and number of samples) than the rig's.
            joint: kf (N m/rad) and cf (N m s/rad) of the throat joint in the direction of the
                hit, in place of the racket's; of more than two segments all joints of that plane
                change with them.
            duration: s from the start of the pulse, which it must be longer than; up to 1 s.
            rate: Hz of the samples, 1 kHz to 200 kHz.
            settings: of the integration in Drake; None: fixed steps, short enough for the frame.
            engine: `drake`; `compiled`, which takes such fixed steps; or `auto`, compiled where
                numba is installed and there are no settings.

        Returns:
            A dataset over `time` (s, in the pulse's own time): `force` (N), `acceleration`
            (m/s^2), `joint_angle` (rad, the sum over the frame's joints in the plane of the hit)
            and `momentum` (N s, the racket's, along the direction of the hit at rest).

        Raises:
            InputError: a number out of range, or a pulse of another kind.
            SimulationError: the run could not be finished.

        """
        pulse = pulse or self.pulse
        if pulse.sampled != self.pulse.sampled or len(pulse.numbers) != len(self.pulse.numbers):
            raise InputError("pulse", pulse.title, f"a pulse of the kind of {self.pulse.title}")
        if not pulse.end - pulse.start < duration <= 1.0:
            allowed = f"longer than the pulse's {pulse.end - pulse.start:g} s, up to 1 s"
            raise InputError("duration", duration, allowed)
        if not 1e3 <= rate <= 2e5:
            raise InputError("rate", rate, "1e3 to 2e5 Hz")
        if engine not in ENGINES:
            raise InputError("engine", engine, ", ".join(ENGINES))
        if engine == "compiled" and settings is not None:
            raise InputError("engine", engine, "drake, with settings of its integration")
        root = self._context(pulse, joint)
        time = pulse.start + np.arange(round(duration * rate) + 1) / rate
        # a step ends at each sample, and where the pulse is not smooth, so that no order is lost
        stops = np.union1d(time, _between(pulse.breaks(), time))
        stops = stops[stops <= time[-1]]
        if engine == "compiled" or (engine == "auto" and HAS_NUMBA and settings is None):
            samples = self._compiled(root, time, stops)
        else:
            samples = self._in_drake(root, time, stops, settings)
        return self._dataset(time, samples, pulse)

    def _compiled(
        self, root: Context, time: NDArray[np.float64], stops: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        from drake_racket.rigs.hammer.compiled import StruckPlant

        struck = StruckPlant(self.plant, self.hammer, self.sensor, root)
        states = struck.states(stops, self._settings(root).maximum_step)
        states = states[np.searchsorted(stops, time)]
        along = np.array(DIRECTIONS[self.direction])
        context = self.plant.CreateDefaultContext()
        context.SetTimeStateAndParametersFrom(self.plant.GetMyContextFromRoot(root))
        scratch = self.hammer.CreateDefaultContext()
        own = self.hammer.GetMyContextFromRoot(root)
        samples = np.empty((len(time), 4))
        samples[:, 1] = struck.sensed(time, states) @ along
        joints = [joint.position_start() for joint in self.racket.joints_of(self.direction)]
        samples[:, 2] = np.sum(states[:, joints], axis=1)
        scratch.SetTimeStateAndParametersFrom(own)
        force = self.hammer.GetOutputPort("force")
        for row, (t, state) in enumerate(zip(time, states, strict=True)):
            scratch.SetTime(float(t))
            samples[row, 0] = force.Eval(scratch)[0]
            self.plant.SetPositionsAndVelocities(context, state)
            momentum = self.plant.CalcSpatialMomentumInWorldAboutPoint(context, np.zeros(3))
            samples[row, 3] = along @ momentum.translational()
        return samples

    def _in_drake(
        self,
        root: Context,
        time: NDArray[np.float64],
        stops: NDArray[np.float64],
        settings: IntegratorSettings | None,
    ) -> NDArray[np.float64]:
        simulator = Simulator(self.diagram, root)
        configure_integrator(simulator, settings or self._settings(root))
        root = simulator.get_mutable_context()
        samples = np.empty((len(time), 4))
        try:
            simulator.Initialize()
            for stop in stops:
                simulator.AdvanceTo(float(stop))
                row = int(np.searchsorted(time, stop))
                if time[row] == stop:
                    samples[row] = self._read(root)
        except RuntimeError as error:
            reason = str(error).splitlines()[0]
            raise SimulationError(f"stopped at t = {root.get_time():.6g} s: {reason}") from error
        return samples

    def _context(self, pulse: Pulse, joint: tuple[float, float] | None) -> Context:
        root = self.diagram.CreateDefaultContext()
        root.SetTime(pulse.start)
        hammer = self.hammer.GetMyMutableContextFromRoot(root)
        hammer.get_mutable_numeric_parameter(self.hammer.PULSE).SetFromVector(pulse.numbers)
        if joint is not None:
            for key, number in zip(("kf", "cf"), joint, strict=True):
                if not (math.isfinite(number) and number >= 0.0):
                    raise InputError(f"joint: {key}", number, "a finite number, 0 or more")
            context = self.plant.GetMyMutableContextFromRoot(root)
            joints = [
                self._scaled(own, *joint) if own.plane == self.direction else own
                for own in self.racket.joint_constants(context)
            ]
            self.racket.set_joint_constants(context, joints)
        return root

    def _scaled(self, own: FrameJoint, kf: float, cf: float) -> FrameJoint:
        """A joint of the plane of the hit with other kf and cf of the throat joint."""
        if len(self.racket.segments) == 2:
            return replace(own, stiffness=kf, damping=cf)
        stiffness, damping = self.racket.parameters.throat_joint.constants(self.direction)
        return replace(
            own,
            stiffness=own.stiffness * kf / stiffness,
            damping=own.damping * cf / damping if damping else own.stiffness * cf / stiffness,
        )

    def _settings(self, root: Context) -> IntegratorSettings:
        """Fixed steps of at most a quarter of a radian of the frame's fastest vibration."""
        if len(self.racket.segments) == 2:
            return STEP
        context = self.plant.GetMyContextFromRoot(root)
        mass = self.plant.CalcMassMatrix(context)
        stiffness = np.zeros_like(mass)
        for joint, own in zip(
            self.racket.frame_joints, self.racket.joint_constants(context), strict=True
        ):
            at = joint.velocity_start()
            stiffness[at, at] = own.stiffness
        fastest = math.sqrt(float(np.max(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)))
        return replace(STEP, maximum_step=min(STEP.maximum_step, 0.25 / fastest))

    def _read(self, root: Context) -> tuple[float, float, float, float]:
        context = self.plant.GetMyContextFromRoot(root)
        hammer = self.hammer.GetMyContextFromRoot(root)
        along = np.array(DIRECTIONS[self.direction])
        # what an accelerometer on the handle reads, in its own axes
        R_WS = self.sensor.CalcPoseInWorld(context).rotation().matrix()
        a_WS_W = self.sensor.CalcSpatialAccelerationInWorld(context).translational()
        momentum = self.plant.CalcSpatialMomentumInWorldAboutPoint(context, np.zeros(3))
        angles = [joint.get_angle(context) for joint in self.racket.joints_of(self.direction)]
        return (
            float(self.hammer.GetOutputPort("force").Eval(hammer)[0]),
            float(along @ R_WS.T @ a_WS_W),
            float(sum(angles)),
            float(along @ momentum.translational()),
        )

    def _dataset(
        self, time: NDArray[np.float64], samples: NDArray[np.float64], pulse: Pulse
    ) -> xarray.Dataset:
        import xarray as xr

        variables = (
            ("force", "N", "force of the hammer"),
            ("acceleration", "m/s^2", "acceleration opposite the hammer, along the hit"),
            ("joint_angle", "rad", "angle of the throat joint in the plane of the hit"),
            ("momentum", "N*s", "momentum of the racket along the hit"),
        )
        parameters = self.racket.parameters
        frame = parameters.title.split(",")[0]  # without its stringing
        return xr.Dataset(
            {
                name: labelled("time", column, units, text)
                for (name, units, text), column in zip(variables, samples.T, strict=True)
            },
            coords={"time": labelled("time", time, "s", "time")},
            attrs={
                "title": f"{frame}, bare frame, impact hammer, {self.direction.replace('_', ' ')}",
                "racket": parameters.name,
                "joint_reading": parameters.throat_joint.reading.value,
                "direction": self.direction,
                "place_m": self.place,
                "pulse": pulse.title,
                "pulse_start_s": pulse.start,
                "pulse_end_s": pulse.end,
                "pulse_impulse_N_s": pulse.impulse,
            },
        )


def _between(breaks: NDArray[np.float64], time: NDArray[np.float64]) -> NDArray[np.float64]:
    """The breaks that are not at a sample already, give or take rounding."""
    away: NDArray[np.bool_] = np.abs(breaks[:, np.newaxis] - time).min(axis=1) > 1e-9
    return np.asarray(breaks[away])


def make_hammer_rig(
    parameters: RacketParameters,
    direction: str,
    pulse: Pulse | None = None,
    *,
    place: float | None = None,
) -> HammerRig:
    """Builds the rig.

    Args:
        direction: `in_plane` or `out_of_plane`.
        pulse: a half sine of inferred size if None.
        place: of hammer and accelerometer, m from the butt; the racket's `accelerometer` landmark
            (inferred: half the grip) if None.

    Raises:
        InputError: unknown direction, or a place off the handle.

    """
    if direction not in DIRECTIONS:
        raise InputError("direction", direction, ", ".join(DIRECTIONS))
    length = parameters.handle.length.value
    place = parameters.landmarks.accelerometer.value if place is None else place
    if not 0.0 <= place <= length:
        raise InputError("place", place, f"0 to {length} m from the butt, on the handle")
    pulse = pulse or half_sine()
    p_RoH_R = np.array([place, 0.0, 0.0])
    builder = DiagramBuilder()
    plant = builder.AddNamedSystem("plant", MultibodyPlant(0.0))
    racket = add_racket(plant, parameters, strung=False)
    segments = parameters.frame_segments()
    hit = segment_at(segments, place)
    body, p_BoH_B = racket.segments[hit], p_RoH_R - [segments[hit].origin, 0.0, 0.0]
    sensor = plant.AddFrame(FixedOffsetFrame("hammer", body.body_frame(), RigidTransform(p_BoH_B)))
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    plant.Finalize()
    along = np.array(DIRECTIONS[direction])
    hammer = builder.AddNamedSystem(
        "hammer", HammerForce(pulse, int(body.index()), p_BoH_B, along, plant)
    )
    builder.Connect(plant.get_state_output_port(), hammer.GetInputPort("state"))
    builder.Connect(
        hammer.GetOutputPort("spatial_forces"), plant.get_applied_spatial_force_input_port()
    )
    return HammerRig(builder.Build(), plant, racket, hammer, sensor, direction, pulse, place)


def hammer_dataset(
    parameters: RacketParameters,
    direction: str,
    pulse: Pulse | None = None,
    *,
    place: float | None = None,
    duration: float = DURATION,
    rate: float = HAMMER_SAMPLE_RATE,
) -> xarray.Dataset:
    """Runs one strike; errors as `make_hammer_rig` and `HammerRig.run`, which have the arguments.

    Args:
        place: m from the butt.  duration: s.  rate: Hz.

    """
    rig = make_hammer_rig(parameters, direction, pulse, place=place)
    return rig.run(duration=duration, rate=rate)
