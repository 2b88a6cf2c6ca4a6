"""One impact gives what is here: numbers, balance, warnings."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.cases.case import Case
from drake_racket.engines.trajectory import Trajectory, cross
from drake_racket.io.notebooks.tables import html_table
from drake_racket.io.numbers import json_data
from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import ContactRecord, contact_record
from drake_racket.parameters.scenario import Scenario
from drake_racket.plant.systems.ports import ContactState
from drake_racket.results.energy import (
    Balance,
    Balances,
    Momenta,
    RigidMotion,
    balances,
    rigid_motion,
)
from drake_racket.results.history import make_history
from drake_racket.results.kinematics import sensor_accelerations
from drake_racket.results.spin import (
    angular_impulse,
    ball_spins,
    impulse_place,
    sliding,
    tangential_restitution,
)
from drake_racket.results.summary import summary_rows, summary_text
from drake_racket.results.warnings import run_warnings

if TYPE_CHECKING:
    import xarray


KINK = 0.25
"""Share of the bend at a peak that one of its neighbours has at most where the peak is a kink."""

RESULT_UNITS = {
    "approach_velocity": "m/s",
    "rebound_velocity": "m/s",
    "apparent_restitution": "1",
    "aim_velocity": "m/s",
    "rebound_angle": "rad",
    "rebound_angles": "rad",
    "spin_before": "rad/s",
    "spin_after": "rad/s",
    "tangential_restitution": "1",
    "sliding_fraction": "1",
    "grip_time": "s",
    "overspin_time": "s",
    "touch_place": "m",
    "angular_impulse": "N*m*s",
    "impulse_place": "m",
    "contact_time": "s",
    "touch_time": "s",
    "peak_normal_force": "N",
    "peak_string_deflection": "m",
    "impulse": "N*s",
    "normal_approach_speed": "m/s",
    "kb": "N/m",
    "cb": "N*s/m",
    "racket_velocity": "m/s",
    "racket_angular_velocity": "rad/s",
    "peak_in_plane_angle": "rad",
    "peak_out_of_plane_angle": "rad",
    "peak_handle_acceleration": "m/s^2",
    "energy_error": "1",
    "momentum_error": "1",
    "angular_momentum_error": "1",
    "balance": "J",
}
"""Unit of what a result holds; the scenario's are in its own keys' units."""


@dataclass(frozen=True, repr=False)
class ImpactResult:
    """The result is one impact in numbers, in the racket's initial frame R; SI units, radians.

    R is the world's frame but where a limb holds the racket: velocities are then of the world,
    expressed in R.

    Attributes:
        scenario: that was run.
        approach_velocity: (3,) of the ball at the start.
        rebound_velocity: (3,) of the ball at its last release (at the end of the run if there is
            none).
        apparent_restitution: normal rebound speed over normal approach speed, relative to the
            initial velocity of the racket where the ball is aimed (0 but in a stroke).
        aim_velocity: (3,) that velocity.
        rebound_angle: between rebound velocity and the initial normal of the strings.
        rebound_angles: (2,) of the rebound velocity from the normal in the planes x z and y z.
        spin_before: (3,) angular velocity of the ball at the start.
        spin_after: (3,) angular velocity of the ball at its last release.
        tangential_restitution: of the ball's surface over the strings (`results.spin`); None with
            contact paper, and where that does not move before touch.
        sliding_fraction: share of the contact spent sliding; None with contact paper.
        grip_time: the rest of the contact; None likewise.
        overspin_time: how long the ball's surface goes backwards in contact; None likewise.
        touch_place: (2,) x, y of the first touch in the head, from the bed's centre; None likewise.
        contact_time: from first touch to last release.
        touch_time: of the first touch, from the start.
        point: number of the string-bed point that the ball touched.
        touches: how often the ball touched.
        peak_normal_force: on the ball, from a parabola through the highest sample and its
            neighbours.
        peak_string_deflection: of a string mass, in the same way.
        impulse: (3,) change of the ball's momentum from start to rebound.
        angular_impulse: (3,) of the contact on the racket about R's origin, the butt; the first is
            the moment about the racket's long axis over time.
        impulse_place: (2,) x, y in R where the impulse would have to meet the strings' plane.
        normal_approach_speed: of the ball relative to the strings, at first touch.
        kb: stiffness of the ball, as latched at that speed.
        cb: damping of the ball, as latched at that speed.
        racket_velocity: (3,) of the racket's centre of mass at the end.
        racket_angular_velocity: (3,) of the racket's rigid motion at the end.
        peak_handle_acceleration: largest magnitude at the frame `accelerometer`; None without the
            history, and from a discrete plant, which has no acceleration of an instant.
        peak_in_plane_angle: largest magnitude of the frame's bending in the plane of the strings:
            the sum of its joints' angles from butt to tip.
        peak_out_of_plane_angle: largest magnitude of the bending out of that plane.
        energy_error: largest |E(t) - E(0)| over the initial kinetic energy; without the history it
            and the next two are those at the end of the run.
        momentum_error: free racket: largest change of total linear momentum over the initial
            momentum; held racket: the ball's momentum against the impulse of the contact force.
        angular_momentum_error: free racket only; about the butt, relative to the initial value.
        balance: energies and momenta at the end of the run.
        warnings: what the user should know about this run.
        steps: of the integrator.
        evaluations: of the derivatives.
        history: labelled time history; None if not asked for.
        derivatives: of its numbers by keys (`drake_racket.derivatives`); None if not asked for.

    """

    scenario: Scenario
    approach_velocity: NDArray[np.float64]
    rebound_velocity: NDArray[np.float64]
    apparent_restitution: float
    aim_velocity: NDArray[np.float64]
    rebound_angle: float
    rebound_angles: NDArray[np.float64]
    spin_before: NDArray[np.float64]
    spin_after: NDArray[np.float64]
    tangential_restitution: float | None
    sliding_fraction: float | None
    grip_time: float | None
    overspin_time: float | None
    touch_place: NDArray[np.float64] | None
    contact_time: float | None
    touch_time: float | None
    point: int | None
    touches: int
    peak_normal_force: float
    peak_string_deflection: float
    impulse: NDArray[np.float64]
    angular_impulse: NDArray[np.float64]
    impulse_place: NDArray[np.float64] | None
    normal_approach_speed: float | None
    kb: float | None
    cb: float | None
    racket_velocity: NDArray[np.float64]
    racket_angular_velocity: NDArray[np.float64]
    peak_in_plane_angle: float
    peak_out_of_plane_angle: float
    peak_handle_acceleration: float | None
    energy_error: float | None
    momentum_error: float | None
    angular_momentum_error: float | None
    balance: Balance | None
    warnings: list[str]
    steps: int
    evaluations: int
    history: xarray.Dataset | None = dataclasses.field(repr=False)
    derivatives: Any = None

    def summary(self) -> str:
        """Gives the result in words, as the command line prints it."""
        return summary_text(self)

    def __repr__(self) -> str:
        """What was hit, and how fast the ball left."""
        speed = float(np.linalg.norm(self.rebound_velocity))
        return f"ImpactResult(point {self.point}, rebound {speed:.2f} m/s)"

    def _repr_html_(self) -> str:
        """Shows a notebook what the command line prints, as a table."""
        title = f"{self.scenario.racket} racket, {self.scenario.support}"
        return html_table(title, summary_rows(self), below=" ".join(self.warnings))

    def to_json(self) -> dict[str, Any]:
        """Gives everything but the history, as JSON's own types, with the units (`units`)."""
        kept = {k: x for k, x in vars(self).items() if k not in ("history", "derivatives")}
        values = {name: json_data(x) for name, x in kept.items()}
        if self.derivatives is not None:
            values["derivatives"] = self.derivatives.to_json()
        units = {name: unit for name, unit in RESULT_UNITS.items() if name in values}
        return values | {"scenario": dataclasses.asdict(self.scenario), "units": units}


def make_result(
    case: Case, trajectory: Trajectory, *, history: bool, only: frozenset[str] | None = None
) -> ImpactResult:
    """Reads the result from a trajectory; see `simulation.simulate`.

    Args:
        case: that was run.
        trajectory: of it; with the motion at every sample for a history.
        history: label the time history.
        only: of its variables; see `make_history`.

    """
    scenario = case.scenario
    record = contact_record(trajectory.record[-1])
    last = _release_index(trajectory, record)
    R_WR, aim_velocity = _initial_motion(case, trajectory)
    ball_velocity = _ball_velocities(trajectory)
    approach, rebound = ball_velocity[0] @ R_WR, ball_velocity[last] @ R_WR
    touched = record.touches > 0
    released = touched and record.phase != CONTACT
    held = scenario.support.startswith("clamped")  # a hand lets the racket move
    energies = balances(trajectory, held=held) if trajectory.audited() else None
    dataset = make_history(case, trajectory, energies, only) if history else None
    motion = _racket_motion(trajectory)
    spins = ball_spins(trajectory) @ R_WR
    slid = sliding(trajectory)
    impulse = case.ball.mass.value * (rebound - approach)
    first = int(np.argmin(np.abs(trajectory.time - record.touch_time))) if touched else 0
    angular = angular_impulse(case, trajectory, first, last, R_WR)
    errors = _errors(energies, scenario)
    frame = trajectory.mechanism.frame
    bending = {
        plane: np.max(np.abs(frame.angle(plane, trajectory.state)))
        for plane in dict.fromkeys(frame.planes)
    }
    return ImpactResult(
        scenario=scenario,
        approach_velocity=approach,
        rebound_velocity=rebound,
        apparent_restitution=float(
            (rebound[2] - aim_velocity[2]) / (aim_velocity[2] - approach[2])
        ),
        aim_velocity=aim_velocity,
        rebound_angle=math.atan2(float(np.hypot(rebound[0], rebound[1])), float(rebound[2])),
        rebound_angles=np.arctan2(rebound[:2], rebound[2]),
        spin_before=spins[0],
        spin_after=spins[last],
        tangential_restitution=tangential_restitution(
            case, (approach, rebound), (spins[0], spins[last]), aim_velocity
        ),
        sliding_fraction=None if slid is None else slid.fraction,
        grip_time=None if slid is None else slid.grip_time,
        overspin_time=None if slid is None else slid.overspin_time,
        touch_place=None if slid is None else slid.place,
        contact_time=record.release_time - record.touch_time if released else None,
        touch_time=record.touch_time if touched else None,
        point=record.point if touched else None,
        touches=record.touches,
        peak_normal_force=_peak(trajectory.time, trajectory.contact[:, ContactState.NORMAL_FORCE]),
        peak_string_deflection=_peak_deflection(trajectory),
        impulse=impulse,
        angular_impulse=angular,
        impulse_place=impulse_place(-impulse, angular),
        normal_approach_speed=record.approach_speed if touched else None,
        kb=record.kb if touched else None,
        cb=record.cb if touched else None,
        racket_velocity=motion.velocity[-1] @ R_WR,
        racket_angular_velocity=motion.angular_velocity[-1] @ R_WR,
        peak_in_plane_angle=float(bending.get("in_plane", 0.0)),
        peak_out_of_plane_angle=float(bending.get("out_of_plane", 0.0)),
        peak_handle_acceleration=_peak_acceleration(trajectory) if history else None,
        energy_error=errors[0],
        momentum_error=errors[1],
        angular_momentum_error=errors[2],
        balance=None if energies is None else energies.at(-1),
        warnings=run_warnings(case, trajectory, record, energies, errors[0]),
        steps=trajectory.steps,
        evaluations=trajectory.evaluations,
        history=dataset,
    )


def _racket_motion(trajectory: Trajectory) -> RigidMotion:
    """The racket's rigid motion at the end."""
    motion = trajectory.motion
    last = dataclasses.replace(
        motion,
        samples=motion.samples[-1:],
        poses=motion.poses[-1:],
        velocities=motion.velocities[-1:],
    )
    return rigid_motion(Momenta.of(trajectory.mechanism, last), trajectory.mechanism.racket)


def _initial_motion(
    case: Case, trajectory: Trajectory
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """R_WR, and the velocity in R of the racket where the ball is aimed, at the start."""
    if case.scenario.support != "limb":
        return np.eye(3), np.zeros(3)
    handle = trajectory.mechanism.handle
    R_WR = trajectory.motion.poses[0, handle, :, :3]
    spatial = trajectory.motion.velocities[0, handle]
    aim = R_WR @ case.scenario.aim(case.racket)
    return R_WR, (spatial[3:] + cross(spatial[:3], aim)) @ R_WR


def _ball_velocities(trajectory: Trajectory) -> NDArray[np.float64]:
    """Velocity (n, 3) of the ball in the world, at every sample."""
    start = trajectory.mechanism.ball_velocity
    return trajectory.state[:, start : start + 3]


def _release_index(trajectory: Trajectory, record: ContactRecord) -> int:
    """The sample of the last release; the last sample if there was none."""
    if record.touches == 0 or record.phase == CONTACT:
        return len(trajectory) - 1
    return int(np.argmin(np.abs(trajectory.time - record.release_time)))


def _peak_deflection(trajectory: Trajectory) -> float:
    """Largest deflection (m) of a string mass."""
    deflections = np.abs(trajectory.state[:, trajectory.mechanism.strings.position])
    return max(_peaks(trajectory.time, deflections))


def _peak_acceleration(trajectory: Trajectory) -> float | None:
    """Largest acceleration (m/s^2) at the frame `accelerometer`; None from a discrete plant."""
    place = trajectory.mechanism.places["accelerometer"]
    magnitude = np.linalg.norm(sensor_accelerations(trajectory.motion, place), axis=1)
    return _peak(trajectory.time, magnitude) if np.isfinite(magnitude).all() else None


def _is_kink(t: list[float], y: list[float]) -> bool:
    """Tells whether five samples turn at the middle one alone: straight on both sides of it.

    A friction that turns round makes such a peak; a parabola through it would rise above it.
    """
    bends = []
    for j in (1, 2, 3):
        before, after = t[j] - t[j - 1], t[j + 1] - t[j]
        if not (before > 0.0 and after > 0.0):
            return False
        slopes = (y[j] - y[j - 1]) / before, (y[j + 1] - y[j]) / after
        bends.append(abs(slopes[1] - slopes[0]) / (t[j + 1] - t[j - 1]))
    return min(bends[0], bends[2]) < KINK * bends[1]


def _peak(time: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """The vertex at the highest sample; see `_peaks`."""
    return _peaks(time, values[:, None])[0]


def _peaks(time: NDArray[np.float64], columns: NDArray[np.float64]) -> list[float]:
    """Vertices, column by column, of the parabola through the highest sample and its neighbours.

    The highest sample itself where it is the first or last, beside a jump, at a kink, or not a
    maximum.
    """
    highest = np.argmax(columns, axis=0)
    near = np.clip(highest[:, None] + np.arange(-2, 3), 0, len(columns) - 1)
    values = columns[near, np.arange(columns.shape[1])[:, None]]
    rows = zip(highest.tolist(), time[near].tolist(), values.tolist(), strict=True)
    return [_vertex(t, y, i, len(columns) - 1) for i, t, y in rows]


def _vertex(t: list[float], y: list[float], i: int, last: int) -> float:
    """Of five samples about the highest, which is sample i of 0 to `last`."""
    if i in (0, last) or (2 <= i < last - 1 and _is_kink(t, y)):
        return y[2]
    (t0, t1, t2), (y0, y1, y2) = t[1:4], y[1:4]
    if t0 == t1 or t1 == t2 or y0 == 0.0 or y2 == 0.0:
        return y1
    slope0, slope1 = (y1 - y0) / (t1 - t0), (y2 - y1) / (t2 - t1)
    curvature = (slope1 - slope0) / (t2 - t0)
    if not curvature < 0.0:
        return y1
    # y = y1 + b (t - t1) + curvature (t - t1)^2
    b = slope0 + curvature * (t1 - t0)
    return y1 - 0.25 * b * b / curvature


def _errors(
    energies: Balances | None, scenario: Scenario
) -> tuple[float | None, float | None, float | None]:
    """Energy, linear and angular momentum errors; see `ImpactResult`."""
    if energies is None:
        return None, None, None
    total = energies.totals()
    initial = energies.store("ball")[0] + energies.store("rigid_motion")[0]
    energy = float(np.max(np.abs(total - total[0])) / initial)
    if any(scenario.gravity):
        # gravity's own impulse is not metered; the energy balance has its potential
        return energy, None, None
    if scenario.support != "free":
        ball = energies.ball_momentum
        return energy, _largest(ball - ball[0] - energies.impulse_on_ball) / _norm(ball[0]), None
    linear, angular = energies.linear_momentum, energies.angular_momentum
    return (
        energy,
        _largest(linear - linear[0]) / _norm(linear[0]),
        _largest(angular - angular[0]) / _norm(angular[0]),
    )


def _norm(vector: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(vector))


def _largest(vectors: NDArray[np.float64]) -> float:
    return float(np.max(np.linalg.norm(vectors, axis=1)))
