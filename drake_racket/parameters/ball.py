"""Reads and checks the ball file; its numbers carry unit, status and source (`quantities`)."""

import dataclasses
import os
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated

from drake_racket.io.errors import InputError
from drake_racket.io.schema import OneOf, Schema, Text, check_fields, read, shown
from drake_racket.io.yaml_files import load_file, shipped_or_path
from drake_racket.laws.contact import NORMAL_LAWS
from drake_racket.parameters.quantities import Of, Quantity, check_name

BALLS = ("penn_titanium", "penn_titanium_slow")


@dataclass(frozen=True)
class BallSurface(Schema):
    """The surface says what a ball that spins has beside mass and radius (`laws.surface`)."""

    inertia_factor: Annotated[Quantity, Of("1")]  # a of the moment of inertia a m R^2
    flattening: Annotated[Quantity, Of("1", sign="non-negative")]  # chi of r = R - chi x
    tangential_stiffness: Annotated[Quantity, Of("N/m")]  # kt
    tangential_damping: Annotated[Quantity, Of("N*s/m")]  # ct


@dataclass(frozen=True)
class BallHuntCrossley(Schema):
    """Has the constants of normal law `hunt_crossley`: N = (kb + hb x) x + (cb + db x) x'.

    Attributes:
        stiffness: kb, of a ball hardly compressed.
        stiffness_rise: hb, by which it grows with compression.
        damping: cb, of a ball hardly compressed.
        damping_rise: db, by which it grows with compression.

    """

    stiffness: Annotated[Quantity, Of("N/m")]
    stiffness_rise: Annotated[Quantity, Of("N/m^2", sign="non-negative")]
    damping: Annotated[Quantity, Of("N*s/m", sign="non-negative")]
    damping_rise: Annotated[Quantity, Of("N*s/m^2", sign="non-negative")]


@dataclass(frozen=True, repr=False)
class BallParameters(Schema):
    """The ball's normal force is by `normal` one of two laws (`laws.contact`).

    `linear`: kb and cb are linear in its approach speed. `hunt_crossley`: constants of its own,
    which grow with compression. With contact `paper` the ball is a point mass; with `surface` it
    has `radius` and `surface`.
    """

    name: Text
    title: Text
    mass: Annotated[Quantity, Of("kg")]
    radius: Annotated[Quantity, Of("m")]
    speed_low: Annotated[Quantity, Of("m/s")]
    speed_high: Annotated[Quantity, Of("m/s")]
    stiffness_low: Annotated[Quantity, Of("N/m")]  # kb at speed_low
    damping_low: Annotated[Quantity, Of("N*s/m", sign="non-negative")]  # cb at speed_low
    stiffness_growth: Annotated[Quantity, Of("1", sign="any")]  # kb(high)/kb(low) - 1
    damping_growth: Annotated[Quantity, Of("1", sign="any")]
    sliding_speed_scale: Annotated[Quantity, Of("m/s")]
    sliding_distance_scale: Annotated[Quantity, Of("m")]
    notes: tuple[Text, ...]
    surface: BallSurface | None = None
    normal: Annotated[str, OneOf(*NORMAL_LAWS)] = "linear"
    hunt_crossley: BallHuntCrossley | None = None

    def __repr__(self) -> str:
        """Shows name and title."""
        return shown(self, f"{self.name}: {self.title}")


def load_ball(
    ball: str | os.PathLike[str] = "penn_titanium", *, normal: str | None = None
) -> BallParameters:
    """Loads the shipped ball by name, or any ball from its YAML file.

    Args:
        normal: law of the normal force in place of the file's, `linear` or `hunt_crossley`.

    Raises:
        InputError: unknown name, unreadable file, or content that does not fit.

    """
    found = read_ball(shipped_or_path(ball, "ball", BALLS, "ball_"))
    if normal is None:
        return found
    found = dataclasses.replace(found, normal=normal)
    check_ball(found, f"ball {found.name}")
    return found


def read_ball(path: str | Path) -> BallParameters:
    """Reads and checks one ball file; raises InputError."""
    return load_file(path, BallParameters, _check_whole)


def check_ball(
    ball: BallParameters, where: str = "ball", changed: Iterable[tuple[str, ...]] | None = None
) -> None:
    """Checks units, signs and ranges; raises InputError.

    Args:
        changed: paths of what alone may differ from what has been checked; None: all.

    """
    if changed is None:
        read(ball, BallParameters, where)
    else:
        check_fields(ball, changed, where)
    _check_whole(ball, where)


def surface_of(ball: BallParameters) -> BallSurface:
    """Gives what contact `surface` needs of a ball; raises InputError if its file has none."""
    if ball.surface is None:
        raise InputError(
            f"ball {ball.name}: surface",
            "nothing",
            f"the numbers {', '.join(f.name for f in fields(BallSurface))} for contact surface",
        )
    return ball.surface


def _check_whole(ball: BallParameters, where: str) -> None:
    """What no single value shows."""
    check_name(ball.name, where)
    if ball.speed_high.value <= ball.speed_low.value:
        raise InputError(
            f"{where}: speed_high.value", ball.speed_high.value, f"above {ball.speed_low.value}"
        )
    if ball.normal == "hunt_crossley" and ball.hunt_crossley is None:
        names = ", ".join(f.name for f in fields(BallHuntCrossley))
        allowed = f"the numbers {names} for normal hunt_crossley"
        raise InputError(f"{where}: hunt_crossley", "nothing", allowed)
    if ball.surface is not None:
        for key, most in (("inertia_factor", 2.0 / 3.0), ("flattening", 1.0)):
            found: Quantity = getattr(ball.surface, key)
            if found.value > most:
                allowed = f"at most {most:.3g}"
                raise InputError(f"{where}: surface.{key}.value", found.value, allowed)
    for key in ("stiffness_growth", "damping_growth"):
        growth: Quantity = getattr(ball, key)
        if growth.value <= -1.0:  # kb or cb would turn negative inside the identified range
            raise InputError(f"{where}: {key}.value", growth.value, "more than -1")
