"""Finds the posture of a limb that puts a frame C of the racket where a user wants it.

Drake's InverseKinematics finds the posture nearest to a guess; Newton steps on the exact kinematics
then take it from the optimizer's tolerance (1e-6) to round-off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.tree import Frame, JacobianWrtVariable
from pydrake.solvers import SnoptSolver
from pydrake.systems.framework import Context

from drake_racket.limbs.files.joints import unknown_rates
from drake_racket.limbs.limb import Limb
from drake_racket.parameters.stroke import PoseTarget, Vector, face_angles

TOLERANCE = 1e-9
"""Largest error of an accepted pose, m and rad."""

STARTS = 64
"""Postures that the search starts from before a pose counts as out of reach; the first is the
guess, the others a fixed low-discrepancy sequence."""

NEWTON_STEPS = 30
_UNLIMITED = math.pi  # rad (or m): how far starts spread about the guess at a joint without limits


class HandKinematics:
    """Kinematics of a frame C that lies at a fixed pose in the hand frame of a limb.

    A racket in a compliant grip moves as if it were rigid in the hand, since that is how a stroke
    starts. The joints of the racket, if the limb carries them, must be at rest in `context`.

    Its coordinates q are those of the chain that follow no other joint; joints that are tied to one
    of them go with it.
    """

    def __init__(self, limb: Limb, context: Context, X_HC: RigidTransform) -> None:
        self.limb, self.plant, self.context, self.X_HC = limb, limb.plant, context, X_HC
        following = {tie.follower.index() for tie in limb.ties}
        self.joints = [joint for joint in limb.joints if joint.index() not in following]
        self.where = np.concatenate(
            [j.position_start() + np.arange(j.num_positions()) for j in self.joints]
        )
        self.rates = np.concatenate(
            [j.velocity_start() + np.arange(j.num_velocities()) for j in self.joints]
        )
        low, high = self.plant.GetPositionLowerLimits(), self.plant.GetPositionUpperLimits()
        self.lower, self.upper = self._bounds(low, high, "position_start")
        low, high = self.plant.GetVelocityLowerLimits(), self.plant.GetVelocityUpperLimits()
        for joint in limb.joints:
            if unknown_rates(joint):
                at = joint.velocity_start()
                low[at : at + joint.num_velocities()] = -np.inf
                high[at : at + joint.num_velocities()] = np.inf
        self.slowest, self.fastest = self._bounds(low, high, "velocity_start")
        self.evaluations = 0

    def _bounds(self, low: Vector, high: Vector, start: str) -> tuple[Vector, Vector]:
        """Bounds of q or its rates, within which the joints that follow keep theirs too."""
        where = self.where if start == "position_start" else self.rates
        lower, upper = low[where], high[where]
        for tie in self.limb.ties:
            at = list(where).index(getattr(tie.leader, start)())
            offset = tie.offset if start == "position_start" else 0.0
            if tie.ratio == 0.0:
                continue
            follower = getattr(tie.follower, start)()
            ends = sorted((bound[follower] - offset) / tie.ratio for bound in (low, high))
            lower[at], upper[at] = max(lower[at], ends[0]), min(upper[at], ends[1])
        return lower, upper

    def set_positions(self, q: Vector) -> None:
        """Sets the limb's joint positions."""
        everything = self.plant.GetPositions(self.context)
        everything[self.where] = q
        for tie in self.limb.ties:
            leader = everything[tie.leader.position_start()]
            everything[tie.follower.position_start()] = tie.ratio * leader + tie.offset
        self.plant.SetPositions(self.context, everything)

    def velocities(self, rates: Vector) -> Vector:
        """Gives the plant's v with the rates of q, all other joints but those tied at rest."""
        everything = np.zeros(self.plant.num_velocities())
        everything[self.rates] = rates
        for tie in self.limb.ties:
            leader = everything[tie.leader.velocity_start()]
            everything[tie.follower.velocity_start()] = tie.ratio * leader
        return everything

    def pose(self, q: Vector) -> RigidTransform:
        """Gives X_WC at limb positions q."""
        self.evaluations += 1
        self.set_positions(q)
        return self.limb.hand.CalcPoseInWorld(self.context) @ self.X_HC

    def jacobian(self, *, of_rates: bool) -> Vector:
        """Gives (6, n) V_WC in W per joint velocity, or per rate of position."""
        kind = JacobianWrtVariable.kQDot if of_rates else JacobianWrtVariable.kV
        world: Frame = self.plant.world_frame()
        whole = self.plant.CalcJacobianSpatialVelocity(
            self.context, kind, self.limb.hand, self.X_HC.translation(), world, world
        )
        columns = np.asarray(whole[:, self.where if of_rates else self.rates], dtype=float)
        start = "position_start" if of_rates else "velocity_start"
        for tie in self.limb.ties:
            at = list(self.where if of_rates else self.rates).index(getattr(tie.leader, start)())
            columns[:, at] += tie.ratio * whole[:, getattr(tie.follower, start)()]
        return columns


@dataclass(frozen=True)
class Posture:
    """Says what the search ends with: the limb's q, and how far C is from what was asked.

    Attributes:
        q: (n,) joint positions.
        residual: errors (m, rad) of what was asked for, position first.
        freedom: degrees of freedom that the pose leaves to the limb.

    """

    q: Vector
    residual: Vector
    freedom: int

    @property
    def error(self) -> float:
        """Gives the largest error; 0 if nothing was asked for."""
        return float(np.abs(self.residual).max(initial=0.0))


def find_posture(hand: HandKinematics, target: PoseTarget, guess: Vector) -> Posture:
    """Gives posture nearest to `guess` (sum of squares of joint differences) that meets the target.

    Nearest among the neighbours of the first start that leads to the target: the guess itself if
    it does. If no start does, the posture with the least error that a bounded least-squares search
    finds from the best one; its `error` is then larger than `TOLERANCE`.
    """
    best: Posture | None = None
    problem = _problem(hand, target, guess)
    for start in _starts(hand, guess):
        found = _polished(hand, target, _optimized(hand, problem, start))
        if found.error <= TOLERANCE:
            return found
        if best is None or np.linalg.norm(found.residual) < np.linalg.norm(best.residual):
            best = found
    assert best is not None
    return _nearest_miss(hand, target, best.q)


def _starts(hand: HandKinematics, guess: Vector) -> list[Vector]:
    lower = np.where(np.isfinite(hand.lower), hand.lower, guess - _UNLIMITED)
    upper = np.where(np.isfinite(hand.upper), hand.upper, guess + _UNLIMITED)
    from scipy.stats import qmc  # slow to import, and rarely needed

    spread = qmc.Halton(len(guess), scramble=False).random(STARTS)[1:]  # its first is the corner
    return [guess, *(lower + spread * (upper - lower))]


def _problem(hand: HandKinematics, target: PoseTarget, guess: Vector) -> InverseKinematics:
    """Least sum of squared differences from the guess, subject to the pose and the joint limits."""
    plant, H, W = hand.plant, hand.limb.hand, hand.plant.world_frame()
    problem = InverseKinematics(plant, hand.context, with_joint_limits=True)
    program, q = problem.prog(), problem.q()
    tied = [tie.follower.position_start() for tie in hand.limb.ties]
    others = np.setdiff1d(np.arange(plant.num_positions()), [*hand.where, *tied])
    if len(others):
        held = plant.GetPositions(hand.context)[others]
        program.AddBoundingBoxConstraint(held, held, q[others])
    for tie in hand.limb.ties:
        pair = q[[tie.follower.position_start(), tie.leader.position_start()]]
        program.AddLinearEqualityConstraint(np.array([[1.0, -tie.ratio]]), [tie.offset], pair)
    program.AddQuadraticErrorCost(np.eye(len(guess)), guess, q[hand.where])
    asked = ~np.isnan(target.position)
    if asked.any():
        low = np.where(asked, target.position, -np.inf)
        high = np.where(asked, target.position, np.inf)
        problem.AddPositionConstraint(H, hand.X_HC.translation(), W, low, high)
    R_HC = hand.X_HC.rotation().matrix()
    for in_world, in_C, least, most in _angles_between(target):
        problem.AddAngleBetweenVectorsConstraint(W, in_world, H, R_HC @ in_C, least, most)
    return problem


def _optimized(hand: HandKinematics, problem: InverseKinematics, start: Vector) -> Vector:
    """What SNOPT makes of the problem from `start`, whether it meets the constraints or not."""
    everything = hand.plant.GetPositions(hand.context)
    everything[hand.where] = start
    result = SnoptSolver().Solve(problem.prog(), everything, None)
    found = result.GetSolution(problem.q())[hand.where]
    return np.clip(found if np.isfinite(found).all() else start, hand.lower, hand.upper)


def _angles_between(target: PoseTarget) -> list[tuple[Vector, Vector, float, float]]:
    """The face as angles between fixed vectors of W and of C, none of them at 0 (a bad gradient).

    An orientation is three right angles, with two half-spaces to tell the mirror images apart.
    """
    right, x, z = math.pi / 2, np.eye(3)[0], np.eye(3)[2]
    R_WC = target.rotation()
    if R_WC is not None:
        return [
            (R_WC[:, 0], z, right, right),
            (R_WC[:, 1], z, right, right),
            (R_WC[:, 1], x, right, right),
            (R_WC[:, 2], z, 0.0, right),
            (R_WC[:, 0], x, 0.0, right),
        ]
    closed, azimuth, tip_elevation = target.angles
    rows = []
    if not math.isnan(closed):
        rows.append((z, z, right + closed, right + closed))
    if not math.isnan(azimuth):
        ahead = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
        rows += [(np.cross(z, ahead), z, right, right), (ahead, z, 0.0, right)]
    if not math.isnan(tip_elevation):
        rows.append((z, x, right - tip_elevation, right - tip_elevation))
    return rows


def _residual(hand: HandKinematics, target: PoseTarget, q: Vector) -> Vector:
    X_WC = hand.pose(q)
    p_asked, R_asked = ~np.isnan(target.position), target.rotation()
    off = (X_WC.translation() - target.position)[p_asked]
    if R_asked is not None:
        turn = X_WC.rotation() @ RotationMatrix(R_asked).transpose()
        from scipy.spatial.transform import Rotation

        return np.concatenate([off, Rotation.from_matrix(turn.matrix()).as_rotvec()])
    asked = ~np.isnan(target.angles)
    turn = (face_angles(X_WC.rotation().matrix()) - target.angles)[asked]
    return np.concatenate([off, np.remainder(turn + math.pi, 2.0 * math.pi) - math.pi])


def _residual_jacobian(hand: HandKinematics, target: PoseTarget, q: Vector) -> Vector:
    """Residual by q; exact where the residual is zero, so that Newton converges quadratically."""
    R_WC = hand.pose(q).rotation().matrix()
    J = hand.jacobian(of_rates=True)
    rows = [J[3:][~np.isnan(target.position)]]
    if target.rotation() is not None:
        return np.vstack([*rows, J[:3]])
    axis, normal = R_WC[:, 0], R_WC[:, 2]
    flat_n, flat_a = math.hypot(normal[0], normal[1]), math.hypot(axis[0], axis[1])
    up = np.array([0.0, 0.0, 1.0])
    # a unit vector e fixed in C turns at w x e, so that an angle f(e) changes by (e x grad f) . w;
    # only of the angles asked for, since one may have no slope (the heading of a level face)
    closed, azimuth, tip_elevation = ~np.isnan(target.angles)
    turns: list[Vector] = []
    if closed:
        turns.append(np.cross(normal, -up / flat_n))
    if azimuth:
        turns.append(np.cross(normal, np.array([-normal[1], normal[0], 0.0]) / flat_n**2))
    if tip_elevation:
        turns.append(np.cross(axis, up / flat_a))
    rows += [(turn @ J[:3])[np.newaxis] for turn in turns]
    return np.vstack(rows)


def _polished(hand: HandKinematics, target: PoseTarget, q: Vector) -> Posture:
    """Minimum-norm Newton steps from q as long as they help; joints at a limit stay there."""
    residual = _residual(hand, target, q)
    for _ in range(NEWTON_STEPS):
        if len(residual) == 0:
            break
        J = _residual_jacobian(hand, target, q)
        free = np.ones(len(q), dtype=bool)
        for _ in range(len(q)):
            step = np.zeros(len(q))
            step[free] = -np.linalg.lstsq(J[:, free], residual, rcond=1e-12)[0]
            outside = free & ((q + step < hand.lower) | (q + step > hand.upper))
            if not outside.any():
                break
            free &= ~outside
        new = np.clip(q + step, hand.lower, hand.upper)
        better = _residual(hand, target, new)
        if not np.linalg.norm(better) < np.linalg.norm(residual):
            break
        q, residual = new, better
    return Posture(q, residual, len(q) - _rank(hand, target, q))


def _nearest_miss(hand: HandKinematics, target: PoseTarget, q: Vector) -> Posture:
    """Least squares over metres and radians within the joint limits, from q."""
    free = hand.lower < hand.upper  # SciPy refuses a range without an inside
    lower, upper, nearest = hand.lower[free], hand.upper[free], q.copy()

    def residual(x: Vector) -> Vector:
        nearest[free] = x
        return _residual(hand, target, nearest)

    if free.any():
        inside = np.clip(q[free], np.nextafter(lower, np.inf), np.nextafter(upper, -np.inf))
        from scipy.optimize import least_squares  # slow to import

        nearest[free] = least_squares(residual, inside, bounds=(lower, upper)).x
    error = _residual(hand, target, nearest)
    return Posture(nearest, error, len(q) - _rank(hand, target, nearest))


def _rank(hand: HandKinematics, target: PoseTarget, q: Vector) -> int:
    J = _residual_jacobian(hand, target, q)
    return int(np.linalg.matrix_rank(J, tol=1e-8)) if J.size else 0
