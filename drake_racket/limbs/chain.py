"""Finds the chain of joints that leads from the trunk to a hand, in any plant."""

from __future__ import annotations

from collections import deque

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, JointIndex, ModelInstanceIndex, RigidBody

from drake_racket.io.errors import InputError
from drake_racket.limbs.limb import Limb

_WORLD = 0


class Graph:
    """The Graph says which joints (welds too) connect the bodies of a plant.

    Before `Finalize` a body that floats hangs on nothing; afterwards on a joint of six freedoms.
    A joint may be drawn from either of its bodies: the parent need not be the one on the inside.
    """

    def __init__(self, plant: MultibodyPlant) -> None:
        self.plant = plant
        self.joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
        self.at: dict[int, list[Joint]] = {}
        for joint in self.joints:
            for body in ends(joint):
                self.at.setdefault(int(body.index()), []).append(joint)

    def path(self, start: RigidBody, end: int | None = None) -> list[Joint]:
        """Gives the joints between a body and the body `end` (or the trunk's root); see `way`."""
        return [joint for _, joint in self.way(start, end)]

    def way(self, start: RigidBody, end: int | None = None) -> list[tuple[RigidBody, Joint]]:
        """Gives the joints that lead to a body from the body `end`, each with its inner body.

        From the trunk's root if `end` is None or cannot be reached: the world, or else the body
        that no joint holds as its child.

        Raises:
            InputError: the joints on the way are part of a loop.

        """
        inward: dict[int, Joint | None] = {int(start.index()): None}
        queue = deque([start])
        while queue:
            body = queue.popleft()
            if int(body.index()) == _WORLD:
                continue  # what else stands on the world is another limb's
            for joint in self.at.get(int(body.index()), []):
                if joint is inward[int(body.index())]:
                    continue
                other = _other(joint, body)
                if int(other.index()) not in inward:
                    inward[int(other.index())] = joint
                    queue.append(other)
        self._refuse_loops(list(inward))
        root = end if end is not None and end in inward else self._root(list(inward))
        chain: list[tuple[RigidBody, Joint]] = []
        at = root
        while (joint := inward[at]) is not None:
            chain.append((self._body(at), joint))
            at = int(_other(joint, self._body(at)).index())
        return chain

    def _root(self, bodies: list[int]) -> int:
        if _WORLD in bodies:
            return _WORLD
        held = {int(joint.child_body().index()) for joint in self.joints}
        return min((i for i in bodies if i not in held), default=min(bodies))

    def _body(self, index: int) -> RigidBody:
        joint = self.at[index][0]
        return next(body for body in ends(joint) if int(body.index()) == index)

    def _refuse_loops(self, bodies: list[int]) -> None:
        """Refuses bodies that more joints hold together than a tree needs."""
        free = [i for i in bodies if i != _WORLD]
        joints = {joint.index() for i in free for joint in self.at.get(i, [])}
        if len(joints) <= len(free) - (_WORLD not in bodies):
            return
        for body in free:
            held = [j for j in self.at[body] if int(j.child_body().index()) == body]
            if len(held) > 1:
                names = ", ".join(joint.name() for joint in held)
                allowed = f"a tree, with one joint towards the world from each body, not {names}"
                raise InputError("find_limb: body", self._body(body).name(), allowed)
        raise InputError("find_limb: body", self._body(free[0]).name(), "a tree, not a ring")

    def models(self, chain: list[Joint], hand: Frame) -> tuple[ModelInstanceIndex, ...]:
        """Gives the models that the chain belongs to, and all that hang on it but by the hand."""
        start = [body for joint in chain for body in ends(joint)]
        order: dict[int, ModelInstanceIndex] = {}
        for joint in chain:
            instance = joint.child_body().model_instance()
            order.setdefault(int(instance), instance)
        seen: set[int] = {int(body.index()) for body in start} - {_WORLD}
        queue = deque(body for body in start if int(body.index()) != _WORLD)
        while queue:
            body = queue.popleft()
            order.setdefault(int(body.model_instance()), body.model_instance())
            for joint in self.at.get(int(body.index()), []):
                other = _other(joint, body)
                beyond = joint.frame_on_parent().index() == hand.index()
                if beyond or int(other.index()) in seen or int(other.index()) == _WORLD:
                    continue
                seen.add(int(other.index()))
                queue.append(other)
        return tuple(order.values())


def chain_shares(limb: Limb) -> dict[str, float]:
    """Gives, by chain joint, the mass that it moves over what of that moves with the chain alone.

    1 where nothing else hangs beyond the joint. Parts that joints of their own carry (another arm,
    fingers) count in the first mass only; what lies beyond the hand frame in neither.
    """
    graph = Graph(limb.plant)
    off = {joint.index() for joint in limb.others()}
    ours = {joint.index() for joint in limb.joints}
    shares = {}
    for inner, joint in graph.way(limb.hand.body()):
        if joint.index() in ours:
            whole, chain = _mass_beyond(graph, limb, joint, inner, off)
            shares[joint.name()] = whole / chain if whole > chain > 0.0 else 1.0
    return shares


def _mass_beyond(
    graph: Graph, limb: Limb, joint: Joint, inner: RigidBody, off: set[JointIndex]
) -> tuple[float, float]:
    start = _other(joint, inner)
    whole = chain = 0.0
    seen, queue = {int(inner.index()), int(start.index())}, deque([(start, True)])
    while queue:
        body, on_chain = queue.popleft()
        whole += body.default_mass()
        chain += body.default_mass() if on_chain else 0.0
        for edge in graph.at.get(int(body.index()), []):
            other = _other(edge, body)
            beyond = edge.frame_on_parent().index() == limb.hand.index()
            if int(other.index()) not in seen and int(other.index()) != _WORLD and not beyond:
                seen.add(int(other.index()))
                queue.append((other, on_chain and edge.index() not in off))
    return whole, chain


def ends(joint: Joint) -> tuple[RigidBody, RigidBody]:
    """Gives the two bodies that a joint connects."""
    return joint.parent_body(), joint.child_body()


def _other(joint: Joint, body: RigidBody) -> RigidBody:
    parent, child = ends(joint)
    return child if parent.index() == body.index() else parent
