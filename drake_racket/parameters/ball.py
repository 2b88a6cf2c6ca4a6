"""The ball file and its checks. Every number carries unit, status and source (see `quantities`)."""

import os
from dataclasses import dataclass, field
from pathlib import Path

from drake_racket.io.errors import InputError
from drake_racket.io.shipped import data_directory
from drake_racket.io.yaml_files import load_file, name_or_path
from drake_racket.parameters.quantities import Quantity, check_fields, check_name, one

BALLS = ("penn_titanium",)


@dataclass
class BallParameters:
    """A point-mass ball; kb and cb are linear in the normal approach speed; see `contact`."""

    name: str = ""
    title: str = ""
    mass: Quantity = one("kg")
    radius: Quantity = one("m")
    speed_low: Quantity = one("m/s")
    speed_high: Quantity = one("m/s")
    stiffness_low: Quantity = one("N/m")  # kb at speed_low
    damping_low: Quantity = one("N*s/m", sign="non-negative")  # cb at speed_low
    stiffness_growth: Quantity = one("1", sign="any")  # kb(high)/kb(low) - 1
    damping_growth: Quantity = one("1", sign="any")
    sliding_speed_scale: Quantity = one("m/s")
    sliding_distance_scale: Quantity = one("m")
    notes: list[str] = field(default_factory=list)


def load_ball(ball: str | os.PathLike[str] = "penn_titanium") -> BallParameters:
    """Loads the shipped ball by name, or any ball from its YAML file.

    Raises:
        InputError: unknown name, unreadable file, or content that does not fit.

    """
    ball = name_or_path(ball, "ball")
    if ball.endswith((".yaml", ".yml")):
        return read_ball(Path(ball))
    if ball not in BALLS:
        raise InputError("ball", ball, f"{', '.join(BALLS)} or a path ending in .yaml")
    return read_ball(data_directory() / f"ball_{ball}.yaml")


def read_ball(path: Path) -> BallParameters:
    """Reads and checks one ball file; raises InputError."""
    ball = load_file(path, BallParameters, complete=True)
    check_ball(ball, str(path))
    return ball


def check_ball(ball: BallParameters, where: str = "ball") -> None:
    """Checks units, signs and ranges; raises InputError."""
    check_name(ball.name, where)
    check_fields(ball, where)
    if ball.speed_high.value <= ball.speed_low.value:
        raise InputError(
            f"{where}: speed_high.value", ball.speed_high.value, f"above {ball.speed_low.value}"
        )
    for key in ("stiffness_growth", "damping_growth"):
        growth: Quantity = getattr(ball, key)
        if growth.value <= -1.0:  # kb or cb would turn negative inside the identified range
            raise InputError(f"{where}: {key}.value", growth.value, "more than -1")
