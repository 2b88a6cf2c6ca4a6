"""Adds a ball to a plant."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, RigidBody
from pydrake.systems.framework import Context

from drake_racket.io.errors import InputError
from drake_racket.io.schema import shown
from drake_racket.laws.surface import CONTACTS
from drake_racket.parameters.ball import BallParameters
from drake_racket.plant.sdf import ball_inertia, ball_sdf
from drake_racket.plant.shapes import show_ball


@dataclass(frozen=True, repr=False)
class Ball:
    """The Ball holds handles to a ball in a plant, made for one law of contact.

    Attributes:
        plant: that it is on.
        parameters: of its file.
        model_instance: of the plant.
        body: free in the world.
        contact: the law, `paper` or `surface`.

    """

    plant: MultibodyPlant
    parameters: BallParameters
    model_instance: ModelInstanceIndex
    body: RigidBody
    contact: str = "paper"

    def __repr__(self) -> str:
        """Shows the model instance and the parameters' name."""
        instance = self.plant.GetModelInstanceName(self.model_instance)
        return shown(self, f"{instance}: {self.parameters.name}")


def add_ball(
    plant: MultibodyPlant,
    parameters: BallParameters,
    *,
    name: str = "ball",
    contact: str = "paper",
) -> Ball:
    """Adds a free ball to `plant`, before `Finalize`; with its shapes if there is a SceneGraph.

    The ball is a free body. With contact `paper` the force goes through its centre: it moves as a
    point mass and keeps whatever spin it is given. For contact `surface` say so here: that ball
    has the moment of inertia of its file.

    Raises:
        InputError: the plant is finalized, the name is taken or not a name, the contact is unknown,
            or the ball's file has no numbers for it.

    """
    if plant.is_finalized():
        raise InputError("add_ball: plant", "finalized", "a plant before Finalize()")
    if plant.HasModelInstanceNamed(name):
        raise InputError("add_ball: name", name, "a name that the plant does not have yet")
    if not (name.isascii() and name.isidentifier()):
        raise InputError("add_ball: name", name, "letters, digits and _ (not first a digit)")
    if contact not in CONTACTS:
        raise InputError("add_ball: contact", contact, ", ".join(CONTACTS))
    parser = Parser(plant)
    parser.SetStrictParsing()
    (instance,) = parser.AddModelsFromString(ball_sdf(parameters, name, contact), "sdf")
    body = plant.GetBodyByName("ball", instance)
    show_ball(plant, body, parameters.radius.value)
    return Ball(plant, parameters, instance, body, contact)


def set_ball_inertia(ball: Ball, root: Context, parameters: BallParameters) -> None:
    """Writes the ball's mass and moments into a Context; see `set_racket_inertia`."""
    context = ball.plant.GetMyMutableContextFromRoot(root)
    ball.body.SetSpatialInertiaInBodyFrame(
        context, ball_inertia(parameters, ball.contact).spatial()
    )


def ball_law(parameters: BallParameters) -> tuple[float, ...]:
    """Gives the eight numbers of the normal force, as `ContactModel.ball` has them."""
    own = parameters.hunt_crossley
    if parameters.normal == "hunt_crossley" and own is not None:
        return (
            parameters.speed_low.value,
            parameters.speed_high.value,
            own.stiffness.value,
            0.0,
            own.damping.value,
            0.0,
            own.stiffness_rise.value,
            own.damping_rise.value,
        )
    return (
        parameters.speed_low.value,
        parameters.speed_high.value,
        parameters.stiffness_low.value,
        parameters.stiffness_growth.value,
        parameters.damping_low.value,
        parameters.damping_growth.value,
        0.0,
        0.0,
    )
