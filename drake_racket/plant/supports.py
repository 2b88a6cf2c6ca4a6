"""Holds a racket: not at all, by the head, by the handle, or by a hand."""

from __future__ import annotations

from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame

from drake_racket.io.errors import InputError
from drake_racket.parameters.grip import GripStiffness
from drake_racket.parameters.racket import RacketParameters
from drake_racket.plant.grip import Grip, add_grip
from drake_racket.plant.racket import Racket, add_racket

_HELD_AT = {"clamped_head": "gsc", "clamped_handle": "butt"}


def add_supported_racket(
    plant: MultibodyPlant,
    parameters: RacketParameters,
    support: str,
    *,
    name: str = "racket",
    strung: bool = True,
) -> Racket:
    """Adds a racket whose R frame is the world's, free or welded there. Before `Finalize`.

    For a hand see `add_hand_held_racket`.

    Args:
        support: `free`; `clamped_head` welds the head body, and leaves the handle free to vibrate
            about it; `clamped_handle` welds the handle body.
        strung: as in `add_racket`.

    Raises:
        InputError: unknown support, or as `add_racket`.

    """
    if support == "free":
        return add_racket(plant, parameters, name=name, strung=strung)
    if support not in _HELD_AT:
        raise InputError("support", support, ", ".join(("free", *_HELD_AT)))
    place = parameters.point(5) if support == "clamped_head" else (0.0, 0.0, 0.0)
    return add_racket(
        plant,
        parameters,
        name=name,
        strung=strung,
        parent=plant.world_frame(),
        held_at=_HELD_AT[support],
        X_PF=RigidTransform(list(place)),
    )


def add_hand_held_racket(
    plant: MultibodyPlant,
    parameters: RacketParameters,
    grip: GripStiffness,
    *,
    kind: str = "compliant",
    name: str = "racket",
    strung: bool = True,
) -> tuple[Racket, Grip]:
    """Adds a racket held at its grip frame by a hand at rest in the world. Before `Finalize`.

    At rest R is the world's frame; with a compliant grip the racket is a free body: start it there,
    and a hand that has mass where its carrier is (`Grip.rest`).

    Args:
        kind: of the grip: compliant, torsional, weld, or hand (at its own place on the handle).

    Raises:
        InputError: the grip is not valid, or as `add_racket`.

    """
    racket = add_racket(plant, parameters, name=name, strung=strung)
    at = parameters.landmarks.grip.value
    if kind == "hand" and grip.hand is not None:
        at = grip.hand.place.value
    place = RigidTransform([at, 0.0, 0.0])
    hand = plant.AddFrame(FixedOffsetFrame(f"{name}_hand", plant.world_frame(), place))
    return racket, add_grip(plant, racket, hand, grip, kind=kind)
