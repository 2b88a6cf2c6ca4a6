"""How the laboratory holds a racket: not at all, by the head, or by the handle."""

from __future__ import annotations

from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant

from drake_racket.errors import InputError
from drake_racket.parameters import RacketParameters
from drake_racket.racket import Racket, add_racket

_HELD_AT = {"clamped_head": "gsc", "clamped_handle": "butt"}


def add_supported_racket(
    plant: MultibodyPlant, parameters: RacketParameters, support: str, *, name: str = "racket"
) -> Racket:
    """Adds a racket whose R frame is the world's, free or welded there. Before `Finalize`.

    Args:
        support: `free`; `clamped_head` welds the head body, and leaves the handle free to vibrate
            about it; `clamped_handle` welds the handle body.

    Raises:
        InputError: unknown support, or as `add_racket`.

    """
    if support == "free":
        return add_racket(plant, parameters, name=name)
    if support not in _HELD_AT:
        raise InputError("support", support, ", ".join(("free", *_HELD_AT)))
    place = parameters.point(5) if support == "clamped_head" else (0.0, 0.0, 0.0)
    return add_racket(
        plant,
        parameters,
        name=name,
        parent=plant.world_frame(),
        held_at=_HELD_AT[support],
        X_PF=RigidTransform(list(place)),
    )
