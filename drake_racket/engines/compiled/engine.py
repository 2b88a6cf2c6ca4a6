"""Runs one case in the compiled engine and returns its trajectory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context

from drake_racket.cases.case import Case
from drake_racket.cases.diagram import ImpactDiagram
from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.dynamics.observe import NODE_ROW
from drake_racket.engines.compiled.extract.model import Model, Wiring, extract
from drake_racket.engines.compiled.extract.tree import Tree
from drake_racket.engines.compiled.integrate import FULL, NOT_FINITE, STUCK
from drake_racket.engines.compiled.kernel import run_case, see_contact, see_motion
from drake_racket.engines.drake.mechanism import Parts, mechanism_of, with_numbers_of
from drake_racket.engines.trajectory import Mechanism, Motion, Trajectory, cross
from drake_racket.io.errors import InputError, SimulationError
from drake_racket.laws.phases import RELEASE, SIZE, TOUCH
from drake_racket.laws.surface import SURFACE_SIZE
from drake_racket.laws.totals import IMPULSE, TOTALS

Array = NDArray[np.float64]

SHARE_OF_ACCURACY = 2e-3
"""Error allowed per step in units of the integrator's accuracy, so that at equal settings a result
is at least as close as Drake's (docs/performance.md)."""

MOST_SAMPLES = 2**20
"""A run that takes more steps than this is stopped with an error."""

_RATE = 1e3
"""1/s, by which errors of positions count as errors of velocities: impacts last milliseconds."""

_SHARE_OF_TOTALS = 0.02
"""Weight of errors of lost energies: nothing depends on them."""


@dataclass(frozen=True)
class Samples:
    """Samples are what a run kept, at its start and after each step (n).

    Attributes:
        values: (n, 1 + size) time, and state [q; v; totals].
        records: (n, contacts, 17) of `laws.phases`.
        steps, evaluations: of the integrator.

    """

    values: Array
    records: Array
    steps: int
    evaluations: int


@dataclass(frozen=True)
class Start:
    """A start is one case, ready to run.

    Attributes:
        root: Context with the case's parameters and initial state.
        floats: numbers of the model.  y: [q; v; elements; totals].  scale: weights of errors.
        tables: of `layout.open_model`.

    """

    root: Context
    floats: Array
    y: Array
    scale: Array
    tables: tuple[Any, ...]


class CompiledImpact:
    """A CompiledImpact is the model of one ImpactDiagram; it runs all cases of its topology.

    Raises:
        InputError: what the compiled engine cannot honour.

    """

    def __init__(self, system: ImpactDiagram) -> None:
        if system.limb is not None and system.limb.torques.source is None:
            raise InputError(
                "engine", "compiled, with joint torques from outside the Diagram", "engine: drake"
            )
        self.system = system
        root = system.create_context(system.case)
        self.model: Model = extract(system.plant, root, _wiring(system, root))
        self._v_of_q = velocity_of_each_position(self.model)
        self._places = _Places(self.model.tree)
        self._root = root
        self._mechanism: Mechanism | None = None

    def start(self, case: Case, root: Context | None = None) -> Start:
        """Reads a case's numbers and initial state from a Context.

        Args:
            case: of this model's topology.
            root: of the Diagram; it is written anew for the case, and is the case's until
                `trajectory` has been called. None: one of the model's own, for a case at a time.

        """
        system = self.system
        root = self._root if root is None else root
        system.write_context(root, case)
        floats = self.model.numbers.read(root, _wiring(system, root))
        context = system.plant.GetMyContextFromRoot(root)
        state = system.plant.GetPositionsAndVelocities(context)
        totals = 0 if system.meter is None else TOTALS
        if system.limb is not None and system.limb.energy is not None:
            totals += 3
        rest = np.zeros(self.model.ints[at.ELEMENTS] + totals)
        tables = at.open_model(self.model.ints, floats)
        y, scale = np.concatenate([state, rest]), self._scale(root, totals)
        return Start(root, floats, y, scale, tables)

    def _scale(self, root: Context, totals: int) -> Array:
        """Weights that make errors shares of the square root of the ball's energy of approach."""
        plant, ball = self.system.plant, self.system.impact.ball
        assert ball is not None
        context = plant.GetMyContextFromRoot(root)
        handle = self.system.impact.racket.handle
        place = ball.body.EvalPoseInWorld(context).translation()
        arm = place - handle.EvalPoseInWorld(context).translation()
        under = handle.EvalSpatialVelocityInWorld(context).Shift(arm).translational()
        speed = ball.body.EvalSpatialVelocityInWorld(context).translational() - under
        twice = float(ball.body.get_mass(context) * (speed @ speed))
        v = weights_of(plant, context, twice)
        lost = np.full(totals, _SHARE_OF_TOTALS * 2.0 / twice)
        if totals:
            lost[IMPULSE] = 0.0  # as exact as the momentum, whatever the step
        element = np.array([])
        contact = self.system.impact.contact
        if contact is not None and self.model.ints[at.ELEMENTS]:
            surface = contact.GetMyContextFromRoot(root).get_numeric_parameter(contact.SURFACE)
            element = np.full(contact.ELEMENT, np.sqrt(surface[2] / twice))
        return np.concatenate([_RATE * np.max(v[self._v_of_q], axis=1), v, element, lost])

    def run(self, case: Case, *, every_sample: bool = True) -> Trajectory:
        """Runs one case; see `engines.drake.engine.run_drake`."""
        return self.run_from(case, self.start(case), every_sample=every_sample)

    def run_from(self, case: Case, start: Start, *, every_sample: bool = True) -> Trajectory:
        """Runs one case from its start."""
        return self.trajectory(start, self.samples(case, start), every_sample=every_sample)

    def samples(self, case: Case, start: Start, longest: float | None = None) -> Samples:
        """Integrates one case from its start, with steps of at most `longest` (s).

        Raises:
            SimulationError: it could not be finished.

        """
        settings, scenario = case.scenario.integrator, case.scenario
        ints, size = self.model.ints, len(start.y)
        end, room = scenario.approach_time + scenario.after, 1024
        while True:
            y, records = start.y.copy(), blank_records(ints)
            samples, sampled = np.empty((room, 1 + size)), np.empty((room, *records.shape))
            count, steps, evaluations, how = run_case(
                start.tables,
                y,
                records,
                end,
                SHARE_OF_ACCURACY * settings.accuracy,
                settings.maximum_step if longest is None else longest,
                settings.error_control,
                start.scale,
                samples,
                sampled,
            )
            if how != FULL:
                break
            room = more_room(room, samples[-1, 0])
        if how in (STUCK, NOT_FINITE):
            reason = "steps too short" if how == STUCK else "the state is not finite"
            time = samples[count - 1, 0]
            raise SimulationError(f"stopped at t = {time:.6g} s: {reason}")
        return Samples(samples[:count].copy(), sampled[:count].copy(), steps, evaluations)

    def trajectory(self, start: Start, kept: Samples, *, every_sample: bool = True) -> Trajectory:
        """Gives the trajectory of a run; the start's Context must still be that of its case."""
        ints = self.model.ints
        samples, records = kept.values, kept.records
        states = samples[:, 1:]
        bodies = ints[at.POSITIONS] + ints[at.VELOCITIES]
        first = bodies + ints[at.ELEMENTS]
        plant = np.ascontiguousarray(states[:, :bodies])
        moving = np.ascontiguousarray(states[:, :first])
        contact = np.zeros((len(samples), 9))
        see_contact(start.tables, moving, records, contact)
        if states.shape[1] > first:
            totals = states[:, first:]
        else:
            totals = np.full((len(samples), TOTALS), np.nan)
        chosen = np.arange(len(samples)) if every_sample else np.array([0, len(samples) - 1])
        return Trajectory(
            mechanism=self._mechanism_at(start.root, (plant[0], plant[-1])),
            time=samples[:, 0],
            state=plant,
            record=records[:, 0],
            contact=contact,
            totals=totals,
            motion=self._motion(start, samples[chosen, 0], moving[chosen], records[chosen], chosen),
            steps=kept.steps,
            evaluations=kept.evaluations,
            engine="compiled",
            element=states[:, bodies:first],
        )

    def _mechanism_at(self, root: Context, ends: tuple[Array, Array]) -> Mechanism:
        """The mechanism of a run; all but its numbers is that of the last one, without a limb."""
        system = self.system
        parts = Parts(system.impact, system.meter, system.grip, system.grip_load, system.limb)
        if self._mechanism is None or system.limb is not None:
            self._mechanism = mechanism_of(parts, root, ends)
        else:
            self._mechanism = with_numbers_of(self._mechanism, parts, root)
        return self._mechanism

    def _motion(
        self,
        start: Start,
        times: Array,
        states: Array,
        records: Array,
        chosen: NDArray[np.int64],
    ) -> Motion:
        ints, tree, system = self.model.ints, self.model.tree, self.system
        m = len(states)
        nodes = np.zeros((m, ints[at.NODES], NODE_ROW))
        leaves = np.zeros((m, ints[at.LEAVES], 6))
        loads = np.zeros((m, 6))
        tables = at.one_by_one(start.tables)
        see_motion(tables, times, states, records, nodes, leaves, loads)
        poses, velocities = self._places.bodies(nodes, leaves)
        sensed = int(system.impact.racket.frame("accelerometer").body().index())
        hand_load = joint_torque = joint_reaction = None
        if system.grip is not None:
            hand_load = loads + self._joint_load(nodes)
        if system.limb is not None:
            limb = system.limb.limb
            own = start.floats[-ints[at.VELOCITIES] :][limb.velocity_indices()]
            joint_torque = np.repeat(own[None], m, axis=0)
            joint_reaction = self._reactions(nodes)
        return Motion(
            samples=chosen,
            poses=poses,
            velocities=velocities,
            sensor_acceleration=_acceleration(tree, nodes, sensed),
            hand_load=hand_load,
            joint_torque=joint_torque,
            joint_reaction=joint_reaction,
        )

    def _first_node(self, joint: Any) -> int:
        index = joint.index()
        found = [i for i, n in enumerate(self.model.tree.nodes) if n.joint.index() == index]  # type: ignore[union-attr]
        return found[0]

    def _joint_load(self, nodes: Array) -> Array:
        """What a grip's joint puts on the hand, in its axes, (m, 6)."""
        grip = self.system.grip
        assert grip is not None
        if grip.joint is None:
            return np.zeros((len(nodes), 6))
        row = nodes[:, self._first_node(grip.joint)]
        rotation = row[:, :9].reshape(-1, 3, 3)
        if grip.kind == "weld":  # the node has the axes of the racket's frame
            rotation = rotation @ grip.joint.X_FM().rotation().matrix().T
        torque = np.einsum("mji,mj->mi", rotation, row[:, 24:27])
        force = np.einsum("mji,mj->mi", rotation, row[:, 27:30])
        return -np.concatenate([torque, force], axis=1)

    def _reactions(self, nodes: Array) -> Array:
        """Magnitudes (N) of the forces in the limb's joints, (m, j)."""
        assert self.system.limb is not None
        columns = []
        for joint in self.system.limb.limb.joints:
            force = np.linalg.norm(nodes[:, self._first_node(joint), 27:30], axis=1)
            columns += [force] * joint.num_velocities()
        return np.stack(columns, axis=1)


def weights_of(plant: MultibodyPlant, context: Context, twice: float) -> Array:
    """Gives the weights of errors of velocities (nv,): square roots of shares of an energy.

    An error in one velocity has at least the energy that it has when all others give way, half of
    its square over the diagonal of the inverse mass matrix. The mass matrix's own diagonal would
    let a joint near the butt of a chain move all that is beyond it.

    Args:
        twice: two times the energy (J).

    """
    inverse = np.linalg.inv(plant.CalcMassMatrix(context))
    return np.asarray(1.0 / np.sqrt(np.diag(inverse) * twice))


def more_room(room: int, time: float) -> int:
    """Gives the next number of samples to keep; raises SimulationError where it ends."""
    if room >= MOST_SAMPLES:
        raise SimulationError(f"stopped at t = {time:.6g} s: more than {MOST_SAMPLES} steps")
    return 4 * room


def blank_records(ints: NDArray[np.int64]) -> Array:
    """Gives the records of contacts before a run."""
    size = SURFACE_SIZE if ints[at.ELEMENTS] else SIZE
    records = np.zeros((ints[at.CONTACTS], size))
    records[:, [TOUCH, RELEASE]] = np.nan
    return records


def velocity_of_each_position(model: Model) -> NDArray[np.int64]:
    """(nq, 3): the velocities whose weights decide that of each position."""
    v_of_q = np.zeros((model.ints[at.POSITIONS], 3), dtype=np.int64)
    for leaf in model.tree.leaves:
        v_of_q[leaf.joint.position_start()] = leaf.joint.velocity_start()
    for node in model.tree.nodes:
        if node.kind in (at.REVOLUTE, at.PRISMATIC, at.SCREW):
            v_of_q[node.q] = node.v
        elif node.kind in (at.QUATERNION, at.RPY, at.FREE_QUATERNION, at.FREE_RPY):
            free = node.kind in (at.FREE_QUATERNION, at.FREE_RPY)
            first = node.v if free else node.v - 2
            turning = 4 if node.kind in (at.QUATERNION, at.FREE_QUATERNION) else 3
            v_of_q[node.q : node.q + turning] = first + np.arange(3)
            if free:
                for k in range(3):
                    v_of_q[node.q + turning + k] = first + 3 + k
    return v_of_q


class _Places:
    """Where all bodies are on the nodes, as arrays."""

    def __init__(self, tree: Tree) -> None:
        places = [tree.place[body] for body in range(tree.plant.num_bodies())]
        self.node = np.array([node for node, _ in places])
        self.rotation = np.array([X.rotation().matrix() for _, X in places])
        self.arm = np.array([X.translation() for _, X in places])
        self.fixed = self.node < 0
        self.leaves = np.array([int(leaf.body.index()) for leaf in tree.leaves], dtype=np.int64)

    def bodies(self, nodes: Array, leaves: Array) -> tuple[Array, Array]:
        """Poses (m, b, 3, 4) and velocities (m, b, 6) of all bodies, from nodes and leaves."""
        m, count = len(nodes), len(self.node)
        poses, velocities = np.zeros((m, count, 3, 4)), np.zeros((m, count, 6))
        own = nodes[:, self.node]  # of a body fixed in the world any row: written over below
        R = own[:, :, :9].reshape(m, count, 3, 3)
        arm = np.einsum("mbij,bj->mbi", R, self.arm)
        w = own[:, :, 12:15]
        poses[..., :3] = R @ self.rotation
        poses[..., 3] = own[:, :, 9:12] + arm
        velocities[..., :3] = w
        velocities[..., 3:] = own[:, :, 15:18] + cross(w, arm)
        places = poses[..., 3]
        poses[:, self.fixed, :, :3] = self.rotation[self.fixed]
        places[:, self.fixed] = self.arm[self.fixed]
        velocities[:, self.fixed] = 0.0
        places[:, self.leaves] = leaves[:, :, :3]
        velocities[:, self.leaves, 3:] = leaves[:, :, 3:]
        return poses, velocities


def _acceleration(tree: Any, nodes: Array, body: int) -> Array:
    """Spatial acceleration (m, 6) of a body's origin."""
    node, X_NB = tree.place[body]
    if node < 0:
        return np.zeros((len(nodes), 6))
    row = nodes[:, node]
    arm = row[:, :9].reshape(-1, 3, 3) @ X_NB.translation()
    w, alpha = row[:, 12:15], row[:, 18:21]
    a = row[:, 21:24] + cross(alpha, arm) + cross(w, cross(w, arm))
    return np.concatenate([alpha, a], axis=1)


def _wiring(system: ImpactDiagram, root: Context) -> Wiring:
    """What acts on the plant of an ImpactDiagram."""
    plant, impact, limb, grip = system.plant, system.impact, system.limb, system.grip
    context = plant.GetMyContextFromRoot(root)
    constants = impact.racket.joint_constants(context)
    frame = [
        (joint.velocity_start(), constant.damping)
        for joint, constant in zip(impact.racket.frame_joints, constants, strict=True)
    ]
    torques, losses, limits = None, [], []
    if limb is not None:
        places = limb.limb.velocity_indices()
        torques = np.zeros(plant.num_velocities())
        source = limb.torques.source
        assert source is not None
        torques[places] = source.get_output_port().Eval(source.GetMyContextFromRoot(root))
        damping = np.concatenate([joint.GetDampingVector(context) for joint in limb.limb.joints])
        losses = list(zip(places.tolist(), damping.tolist(), strict=True))
        limits = [] if limb.limits is None else [limb.limits]
    bushing = None if grip is None or grip.bushing is None else int(grip.bushing.index())
    welds = [grip.joint] if grip is not None and grip.kind == "weld" else []
    wrist = None if grip is None or grip.wrist is None else int(grip.wrist.index())
    return Wiring(
        [impact], limits, torques, frame, losses, grip=bushing, wrist=wrist, kept_welds=welds
    )


def run_compiled(case: Case, system: ImpactDiagram, *, every_sample: bool = True) -> Trajectory:
    """Runs one case in the compiled engine; arguments and errors of `run_drake`."""
    return CompiledImpact(system).run(case, every_sample=every_sample)
