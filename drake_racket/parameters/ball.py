"""Reads and checks the ball file; its numbers carry unit, status and source (`quantities`)."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from drake_racket.io.errors import InputError
from drake_racket.io.schema import Schema, Text, read, shown
from drake_racket.io.yaml_files import load_file, shipped_or_path
from drake_racket.parameters.quantities import Of, Quantity, check_name

BALLS = ("penn_titanium",)


@dataclass(frozen=True, repr=False)
class BallParameters(Schema):
    """The ball is a point mass; kb and cb are linear in its approach speed (`laws.contact`)."""

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

    def __repr__(self) -> str:
        """Shows name and title."""
        return shown(self, f"{self.name}: {self.title}")


def load_ball(ball: str | os.PathLike[str] = "penn_titanium") -> BallParameters:
    """Loads the shipped ball by name, or any ball from its YAML file.

    Raises:
        InputError: unknown name, unreadable file, or content that does not fit.

    """
    return read_ball(shipped_or_path(ball, "ball", BALLS, "ball_"))


def read_ball(path: str | Path) -> BallParameters:
    """Reads and checks one ball file; raises InputError."""
    path = Path(path)
    ball = load_file(path, BallParameters)
    _check_whole(ball, str(path))
    return ball


def check_ball(ball: BallParameters, where: str = "ball") -> None:
    """Checks units, signs and ranges; raises InputError."""
    _check_whole(read(ball, BallParameters, where), where)


def _check_whole(ball: BallParameters, where: str) -> None:
    """What no single value shows."""
    check_name(ball.name, where)
    if ball.speed_high.value <= ball.speed_low.value:
        raise InputError(
            f"{where}: speed_high.value", ball.speed_high.value, f"above {ball.speed_low.value}"
        )
    for key in ("stiffness_growth", "damping_growth"):
        growth: Quantity = getattr(ball, key)
        if growth.value <= -1.0:  # kb or cb would turn negative inside the identified range
            raise InputError(f"{where}: {key}.value", growth.value, "more than -1")
