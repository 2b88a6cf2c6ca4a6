"""Writes the models under sdf/, rackets, ball and upper limb, from the shipped parameters.

`make sdf` writes them again; a test compares.
"""

from __future__ import annotations

from drake_racket.io.files import write_text
from drake_racket.io.shipped import sdf_directory
from drake_racket.limbs.upper_limb_sdf import shipped_limb_models
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.racket import RACKETS, load_racket
from drake_racket.plant.sdf import ball_sdf, racket_sdf


def shipped_models() -> dict[str, str]:
    """Gives the file name -> text of the models under sdf/.

    A racket has one frame and one grid whatever its tension, so it has one model. The upper limb
    has a right and a left one.
    """
    models = {f"racket_{r}.sdf": racket_sdf(load_racket(r), f"racket_{r}") for r in RACKETS}
    models["ball.sdf"] = ball_sdf(load_ball(), "ball")
    return models | shipped_limb_models()


def write_shipped_models() -> None:
    """Writes the shipped models."""
    for name, text in shipped_models().items():
        write_text(text, sdf_directory() / name)
