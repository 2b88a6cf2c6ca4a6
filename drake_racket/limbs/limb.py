"""A limb in a plant is its handles, which the rest of the package needs, whoever built it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, ModelInstanceIndex

from drake_racket.io.schema import shown


@dataclass(frozen=True)
class Tie:
    """A Tie makes one joint follow another: q_follower = ratio q_leader + offset (rad or m).

    A mimic joint of a file, say, which Drake's coupler constraint holds on a discrete plant.

    Attributes:
        ratio: (1); m/rad or rad/m between a hinge and a slide.
        offset: rad, of a slide m.

    """

    follower: Joint
    leader: Joint
    ratio: float
    offset: float


@dataclass(frozen=True, repr=False)
class Limb:
    """The Limb holds handles to a limb in a plant.

    Attributes:
        plant: the plant that holds it.
        model_instances: of its bodies.
        hand: the frame H on which the racket's grip frame lies (x along the racket from butt to
            tip, z normal to the strings on the side the ball comes from).
        joints: the chain: those with degrees of freedom, from the trunk to the hand. All other
            joints of its models (`others`) are not the limb's to move: no torque acts on them.
        ties: between joints of its models; the leader is on the chain if one of the two is.
        notes: what a user should know about how it was read.

    """

    plant: MultibodyPlant
    model_instances: tuple[ModelInstanceIndex, ...]
    hand: Frame
    joints: tuple[Joint, ...]
    ties: tuple[Tie, ...] = ()
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Shows the model, the number of joints and the hand's frame."""
        models = ", ".join(self.plant.GetModelInstanceName(i) for i in self.model_instances)
        return shown(self, f"{models}: {len(self.joints)} joints, hand frame {self.hand.name()}")

    def joint_names(self) -> list[str]:
        """Lists the names of the joints, in order."""
        return [joint.name() for joint in self.joints]

    def others(self) -> tuple[Joint, ...]:
        """Gives the joints of its models that are not on the chain to the hand.

        The other arm, a head, fingers. A floating base is not among them.
        """
        ours, on_chain = set(self.model_instances), {joint.index() for joint in self.joints}
        joints = [self.plant.get_joint(i) for i in self.plant.GetJointIndices()]
        return tuple(
            joint
            for joint in joints
            if joint.child_body().model_instance() in ours
            and joint.index() not in on_chain
            and 0 < joint.num_velocities() < 6
        )

    def position_indices(self) -> NDArray[np.int64]:
        """Tells where the joints' positions sit in the finalized plant's q, in order."""
        return np.concatenate(
            [j.position_start() + np.arange(j.num_positions()) for j in self.joints]
        )

    def velocity_indices(self) -> NDArray[np.int64]:
        """Tells where the joints' velocities sit in the finalized plant's v, in order."""
        return np.concatenate(
            [j.velocity_start() + np.arange(j.num_velocities()) for j in self.joints]
        )
