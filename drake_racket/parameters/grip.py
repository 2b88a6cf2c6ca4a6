"""Reads the grip file: a hand's six spring-dampers. `plant.grip` puts them on a plant.

No source at hand prints the numbers: the shipped ones are inferred. The default, `normal`, is the
stiffness that the soft tissue of a palm has over the breadth of a hand (data/grip_normal.yaml);
every use should show what another grip does (`loose`, `tight`, `GripStiffness.scaled`).
"""

import dataclasses
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from drake_racket.io.errors import InputError
from drake_racket.io.files import write_text
from drake_racket.io.schema import Schema, Text, read, shown
from drake_racket.io.yaml_files import dump_text, load_file, shipped_or_path
from drake_racket.parameters.quantities import Of, Quantities

GRIPS = ("loose", "normal", "tight")
"""Names of the shipped grips, for `load_grip`; all three are inferred."""

GRIP_KINDS = ("compliant", "torsional", "weld")
"""Six spring-dampers; three torsional ones about a point that the hand holds; or rigid."""


@dataclass(frozen=True, repr=False)
class GripStiffness(Schema):
    """The grip is six spring-dampers: lists of three, about or along x, y and z of the hand."""

    name: Text
    title: Text
    force_stiffness: Annotated[Quantities, Of("N/m", sign="non-negative", least=3)]
    force_damping: Annotated[Quantities, Of("N*s/m", sign="non-negative", least=3)]
    torque_stiffness: Annotated[Quantities, Of("N*m/rad", sign="non-negative", least=3)]
    torque_damping: Annotated[Quantities, Of("N*m*s/rad", sign="non-negative", least=3)]
    notes: tuple[Text, ...]

    def __repr__(self) -> str:
        """Shows name and title."""
        return shown(self, f"{self.name}: {self.title}")

    def scaled(self, factor: float, damping_factor: float | None = None) -> "GripStiffness":
        """Multiplies all six stiffnesses by `factor`, and the dampings by `damping_factor`.

        By default the dampings grow with the root of the stiffness, which keeps the damping ratio
        of a racket that moves as a rigid body in the hand.

        Raises:
            InputError: a factor is not a finite number of 0 or more.

        """
        if not (math.isfinite(factor) and factor >= 0.0):
            raise InputError("GripStiffness.scaled: factor", factor, "a finite number, 0 or more")
        by = math.sqrt(factor) if damping_factor is None else damping_factor
        if not (math.isfinite(by) and by >= 0.0):
            raise InputError(
                "GripStiffness.scaled: damping_factor", by, "a finite number, 0 or more"
            )
        return dataclasses.replace(
            self,
            force_stiffness=_times(self.force_stiffness, factor),
            force_damping=_times(self.force_damping, by),
            torque_stiffness=_times(self.torque_stiffness, factor),
            torque_damping=_times(self.torque_damping, by),
        )


def _times(values: Quantities, factor: float) -> Quantities:
    if factor == 1.0:
        return values
    scaled = tuple(factor * x for x in values.value)
    return Quantities(scaled, values.unit, "inferred", f"{factor:g} times: {values.source}")


def load_grip(grip: str | os.PathLike[str] = "normal") -> GripStiffness:
    """Loads the shipped grip by name, or any grip from its YAML file.

    Raises:
        InputError: unknown name, unreadable file, or content that does not fit.

    """
    path = shipped_or_path(grip, "grip", GRIPS, "grip_")
    loaded = load_file(path, GripStiffness)
    _check_whole(loaded, str(path))
    return loaded


def write_grip(grip: GripStiffness, path: str | Path) -> None:
    """Writes a grip's file, for `load_grip` and scenarios.

    Raises:
        InputError: the grip is not valid.

    """
    path = Path(path)
    check_grip(grip)
    text = dump_text(dataclasses.asdict(grip))
    write_text(text, path)


def check_grip(grip: GripStiffness, where: str = "grip") -> None:
    """Checks units, signs, counts and provenance; raises InputError."""
    _check_whole(read(grip, GripStiffness, where), where)


def _check_whole(grip: GripStiffness, where: str) -> None:
    """What no single value shows."""
    for item in dataclasses.fields(grip):
        values = getattr(grip, item.name)
        if isinstance(values, Quantities) and len(values.value) != 3:
            raise InputError(f"{where}: {item.name}.value", values.value, "3 numbers: x, y, z")
