"""What one impact gives: numbers, balance, warnings."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import ContactRecord, contact_record
from drake_racket.limbs.striking import limits_are_ours
from drake_racket.parameters.ball import BallParameters
from drake_racket.results.energy import Balance, balance, rigid_motion
from drake_racket.results.history import make_history

if TYPE_CHECKING:
    import xarray

    from drake_racket.parameters.scenario import Scenario
    from drake_racket.simulation import Run

COUPLE_WARNING = 1e-3  # of the initial kinetic energy
ENERGY_WARNING = 1e-3


@dataclass(frozen=True)
class ImpactResult:
    """One impact. Vectors are in the racket's initial frame R; SI units, angles in radians.

    R is the world's frame but where a limb holds the racket: velocities are then of the world,
    expressed in R.

    Attributes:
        approach_velocity, rebound_velocity: (3,) of the ball, at the start and at its last release
            (at the end of the run if there is none).
        apparent_restitution: normal rebound speed over normal approach speed, relative to the
            initial velocity of the racket where the ball is aimed (0 but in a stroke).
        aim_velocity: (3,) that velocity.
        rebound_angle: between rebound velocity and the initial normal of the strings.
        contact_time: from first touch to last release.
        touch_time, point, touches: when, where (1-9) and how often the ball touched.
        peak_normal_force, peak_string_deflection: parabola through the highest sample and its
            neighbours.
        impulse: (3,) change of the ball's momentum from start to rebound.
        kb, cb: as latched at the normal approach speed `normal_approach_speed`.
        racket_velocity, racket_angular_velocity: (3,) of the racket's rigid motion at the end:
            velocity of its centre of mass, and its rotation.
        peak_handle_acceleration: largest magnitude at the frame `accelerometer`; None without the
            history, and from a discrete plant, which has no acceleration of an instant.
        peak_in_plane_angle, peak_out_of_plane_angle: largest magnitudes at the throat joint.
        energy_error: largest |E(t) - E(0)| over the initial kinetic energy; without the history it
            and the next two are those at the end of the run.
        momentum_error: free racket: largest change of total linear momentum over the initial
            momentum; held racket: the ball's momentum against the impulse of the contact force.
        angular_momentum_error: free racket only; about the butt, relative to the initial value.
        balance: energies and momenta at the end of the run.
        warnings: what the user should know about this run.
        steps, evaluations: of the integrator.
        history: labelled time history; None if not asked for.

    """

    scenario: Scenario
    approach_velocity: NDArray[np.float64]
    rebound_velocity: NDArray[np.float64]
    apparent_restitution: float
    aim_velocity: NDArray[np.float64]
    rebound_angle: float
    contact_time: float | None
    touch_time: float | None
    point: int | None
    touches: int
    peak_normal_force: float
    peak_string_deflection: float
    impulse: NDArray[np.float64]
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

    def to_json(self) -> dict[str, Any]:
        """Everything but the history, as JSON's own types."""
        skipped = ("history", "scenario")
        values = {
            f.name: _plain(getattr(self, f.name))
            for f in dataclasses.fields(self)
            if f.name not in skipped
        }
        return values | {"scenario": dataclasses.asdict(self.scenario)}


def make_result(run: Run, *, history: bool) -> ImpactResult:
    """Reads the result from a run; see `simulate.simulate`."""
    system, scenario = run.system, run.scenario
    record = contact_record(run.contact_state[-1])
    ball_velocity = _ball_velocities(run)
    last = _release_index(run, record)
    R_WR, aim_velocity = _initial_motion(run)
    approach, rebound = ball_velocity[0] @ R_WR, ball_velocity[last] @ R_WR
    touched = record.touches > 0
    released = touched and record.phase != CONTACT
    forces, deflections = _contact_forces(run), _deflections(run)
    root = run.context_at(len(run.time) - 1)
    racket = system.impact.racket
    motion = rigid_motion(system.impact, system.plant.GetMyContextFromRoot(root))
    held = scenario.support.startswith("clamped")  # a hand lets the racket move
    audited = system.meter is not None
    balances = _balances(run, held, history) if audited else []
    ball = scenario.load_ball()
    with limits_are_ours(system.limb):
        dataset = make_history(run, balances) if history else None
    angle_z, angle_y = (
        float(np.max(np.abs(run.plant_state[:, joint.position_start()])))
        for joint in (racket.in_plane, racket.out_of_plane)
    )
    errors = _errors(balances, scenario)
    return ImpactResult(
        scenario=scenario,
        approach_velocity=approach,
        rebound_velocity=rebound,
        apparent_restitution=float(
            (rebound[2] - aim_velocity[2]) / (aim_velocity[2] - approach[2])
        ),
        aim_velocity=aim_velocity,
        rebound_angle=math.atan2(float(np.hypot(rebound[0], rebound[1])), float(rebound[2])),
        contact_time=record.release_time - record.touch_time if released else None,
        touch_time=record.touch_time if touched else None,
        point=record.point if touched else None,
        touches=record.touches,
        peak_normal_force=_peak(run.time, forces),
        peak_string_deflection=max(_peak(run.time, column) for column in deflections.T),
        impulse=ball.mass.value * (rebound - approach),
        normal_approach_speed=record.approach_speed if touched else None,
        kb=record.kb if touched else None,
        cb=record.cb if touched else None,
        racket_velocity=motion.velocity @ R_WR,
        racket_angular_velocity=motion.angular_velocity @ R_WR,
        peak_in_plane_angle=angle_z,
        peak_out_of_plane_angle=angle_y,
        peak_handle_acceleration=_peak_acceleration(dataset),
        energy_error=errors[0],
        momentum_error=errors[1],
        angular_momentum_error=errors[2],
        balance=balances[-1] if balances else None,
        warnings=_warnings(ball, record, balances, errors[0]),
        steps=run.steps,
        evaluations=run.evaluations,
        history=dataset,
    )


def _initial_motion(run: Run) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """R_WR, and the velocity in R of the racket where the ball is aimed, at the start."""
    if run.scenario.support != "limb":
        return np.eye(3), np.zeros(3)
    racket = run.system.impact.racket
    context = run.system.plant.GetMyContextFromRoot(run.context_at(0))
    R_WR = racket.handle.EvalPoseInWorld(context).rotation()
    aim = R_WR @ run.scenario.aim(run.scenario.load_racket())
    velocity = racket.handle.EvalSpatialVelocityInWorld(context).Shift(aim).translational()
    return R_WR.matrix(), velocity @ R_WR.matrix()


def _ball_velocities(run: Run) -> NDArray[np.float64]:
    ball = run.system.impact.ball
    assert ball is not None
    start = run.system.plant.num_positions() + ball.body.floating_velocities_start_in_v()
    return run.plant_state[:, start + 3 : start + 6]


def _release_index(run: Run, record: ContactRecord) -> int:
    """The sample of the last release; the last sample if there was none."""
    if record.touches == 0 or record.phase == CONTACT:
        return len(run.time) - 1
    return int(np.argmin(np.abs(run.time - record.release_time)))


def _contact_forces(run: Run) -> NDArray[np.float64]:
    """Normal force (N) at every sample."""
    contact = run.system.impact.contact
    assert contact is not None
    port = contact.GetOutputPort("contact_state")
    forces = np.zeros(len(run.time))
    for i in np.flatnonzero(run.contact_state[:, 0] == CONTACT):
        root = run.context_at(int(i))
        forces[i] = port.Eval(contact.GetMyContextFromRoot(root))[4]
    return forces


def _deflections(run: Run) -> NDArray[np.float64]:
    """Magnitude of the nine masses' deflections (m) at every sample, (n, 9)."""
    positions = [j.position_start() for j in run.system.impact.racket.string_joints]
    return np.abs(run.plant_state[:, positions])


def _peak(time: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """Vertex of the parabola through the highest sample and its neighbours.

    The highest sample itself where it is the first or last, beside a jump, or not a maximum.
    """
    i = int(np.argmax(values))
    if i in (0, len(values) - 1):
        return float(values[i])
    (t0, t1, t2), (y0, y1, y2) = time[i - 1 : i + 2], values[i - 1 : i + 2]
    if t0 == t1 or t1 == t2 or y0 == 0.0 or y2 == 0.0:
        return float(y1)
    slope0, slope1 = (y1 - y0) / (t1 - t0), (y2 - y1) / (t2 - t1)
    curvature = (slope1 - slope0) / (t2 - t0)
    if not curvature < 0.0:
        return float(y1)
    # y = y1 + b (t - t1) + curvature (t - t1)^2
    b = slope0 + curvature * (t1 - t0)
    return float(y1 - 0.25 * b * b / curvature)


def _peak_acceleration(dataset: xarray.Dataset | None) -> float | None:
    if dataset is None:
        return None
    magnitude = np.linalg.norm(dataset["handle_acceleration"].to_numpy(), axis=1)
    if not np.isfinite(magnitude).all():
        return None
    return _peak(dataset["time"].to_numpy(), magnitude)


def _balances(run: Run, held: bool, every_sample: bool) -> list[Balance]:
    indices = range(len(run.time)) if every_sample else (0, len(run.time) - 1)
    impact, meter = run.system.impact, run.system.meter
    limb = run.system.limb
    return [balance(impact, meter, run.context_at(i), held=held, limb=limb) for i in indices]


def _errors(
    balances: list[Balance], scenario: Scenario
) -> tuple[float | None, float | None, float | None]:
    """Energy, linear and angular momentum errors; see `ImpactResult`."""
    if not balances:
        return None, None, None
    first = balances[0]
    energy = max(abs(b.total() - first.total()) for b in balances)
    energy /= first.ball + first.rigid_motion
    if any(scenario.gravity):
        # gravity's own impulse is not metered; the energy balance has its potential
        return energy, None, None
    if scenario.support != "free":
        change = max(
            float(np.linalg.norm(b.ball_momentum - first.ball_momentum - b.impulse_on_ball))
            for b in balances
        )
        return energy, change / float(np.linalg.norm(first.ball_momentum)), None
    linear, angular = (
        max(float(np.linalg.norm(getattr(b, name) - getattr(first, name))) for b in balances)
        / float(np.linalg.norm(getattr(first, name)))
        for name in ("linear_momentum", "angular_momentum")
    )
    return energy, linear, angular


def _warnings(
    ball: BallParameters,
    record: ContactRecord,
    balances: list[Balance],
    energy_error: float | None,
) -> list[str]:
    found = []
    low, high = ball.speed_low.value, ball.speed_high.value
    if record.touches == 0:
        found.append("the ball did not touch the strings")
    elif not low - 1e-6 <= record.approach_speed <= high + 1e-6:
        found.append(
            f"normal approach speed {record.approach_speed:.4g} m/s is outside the identified"
            f" {low:g}-{high:g} m/s: kb and cb are held at their end values"
        )
    if record.touches > 1:
        found.append(f"the ball touched {record.touches} times; kb and cb are those of the first")
    if record.phase == CONTACT:
        found.append("the run ended in contact: lengthen `after`; rebound is the state at the end")
    if energy_error is not None and energy_error > ENERGY_WARNING:
        found.append(f"the energy balance is open by {energy_error:.2g} of the initial energy")
    if balances:
        initial = balances[0].ball + balances[0].rigid_motion
        share = abs(balances[-1].couple) / initial
        if share > COUPLE_WARNING:
            found.append(
                f"the reaction at the string mass adds {share:.2g} of the initial energy by its"
                " couple (reaction_point: ball does not)"
            )
    return found


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return [float(x) for x in value]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
