"""A limb in a plant is its handles, which the rest of the package needs, whoever built it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, ModelInstanceIndex

from drake_racket.io.schema import shown


@dataclass(frozen=True, repr=False)
class Limb:
    """The Limb holds handles to a limb in a plant.

    Attributes:
        plant: the plant that holds it.
        model_instances: of its bodies.
        hand: the frame H on which the racket's grip frame lies (x along the racket from butt to
            tip, z normal to the strings on the side the ball comes from).
        joints: those with degrees of freedom, from the trunk to the hand.

    """

    plant: MultibodyPlant
    model_instances: tuple[ModelInstanceIndex, ...]
    hand: Frame
    joints: tuple[Joint, ...]

    def __repr__(self) -> str:
        """Shows the model, the number of joints and the hand's frame."""
        models = ", ".join(self.plant.GetModelInstanceName(i) for i in self.model_instances)
        return shown(self, f"{models}: {len(self.joints)} joints, hand frame {self.hand.name()}")

    def joint_names(self) -> list[str]:
        """Lists the names of the joints, in order."""
        return [joint.name() for joint in self.joints]

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
