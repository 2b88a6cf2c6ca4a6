"""Reads the grip file: a hand's spring-dampers and its mass. `plant.grip` puts them on a plant.

No source at hand prints the numbers: the shipped ones are inferred. The default, `normal`, is the
stiffness that the soft tissue of a palm has over the breadth of a hand (data/grip_normal.yaml);
every use should show what another grip does (`loose`, `tight`, `GripStiffness.scaled`).

Springs to a place at rest can only raise a racket's frequencies, where players' hands lower them:
the grips `hand_light`, `hand_medium` and `hand_tight` have a hand with mass, fitted to frequencies
and dampings of rackets in players' hands (data/grip_hand_medium.yaml).
"""

import dataclasses
import math
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from drake_racket.io.errors import InputError
from drake_racket.io.files import write_text
from drake_racket.io.schema import Schema, Text, check_fields, read, shown
from drake_racket.io.yaml_files import dump_text, load_file, shipped_or_path
from drake_racket.parameters.quantities import Of, Quantities, Quantity

GRIPS = ("loose", "normal", "tight")
"""Names of the shipped grips, for `load_grip`; all three are inferred."""

HANDS = ("hand_light", "hand_medium", "hand_tight")
"""Shipped grips whose hand has mass."""

GRIP_KINDS = ("compliant", "torsional", "weld", "hand")
"""Six spring-dampers; three torsional ones about a point that the hand holds; rigid; or a hand that
has mass between the racket and what carries it."""


@dataclass(frozen=True)
class HandBody(Schema):
    """A hand that has mass: between the palm's springs and six more, of the wrist's side.

    Lists are about, or along, x, y and z of the hand frame, as the palm's.

    Attributes:
        place: of the palm's centre, m from the butt; hand and springs are there.
        mass: kg.  moments: about the palm's centre (kg m^2).
        wrist_*: spring-dampers between hand and what carries it.

    """

    place: Annotated[Quantity, Of("m", sign="non-negative")]
    mass: Annotated[Quantity, Of("kg")]
    moments: Annotated[Quantities, Of("kg*m^2", least=3)]
    wrist_force_stiffness: Annotated[Quantities, Of("N/m", sign="non-negative", least=3)]
    wrist_force_damping: Annotated[Quantities, Of("N*s/m", sign="non-negative", least=3)]
    wrist_torque_stiffness: Annotated[Quantities, Of("N*m/rad", sign="non-negative", least=3)]
    wrist_torque_damping: Annotated[Quantities, Of("N*m*s/rad", sign="non-negative", least=3)]


@dataclass(frozen=True, repr=False)
class GripStiffness(Schema):
    """The grip is six spring-dampers: lists of three, about or along x, y and z of the hand.

    With grip kind `hand` they are the palm's, and `hand` has what lies beyond it.
    """

    name: Text
    title: Text
    force_stiffness: Annotated[Quantities, Of("N/m", sign="non-negative", least=3)]
    force_damping: Annotated[Quantities, Of("N*s/m", sign="non-negative", least=3)]
    torque_stiffness: Annotated[Quantities, Of("N*m/rad", sign="non-negative", least=3)]
    torque_damping: Annotated[Quantities, Of("N*m*s/rad", sign="non-negative", least=3)]
    notes: tuple[Text, ...]
    hand: HandBody | None = None

    def __repr__(self) -> str:
        """Shows name and title."""
        return shown(self, f"{self.name}: {self.title}")

    def scaled(self, factor: float, damping_factor: float | None = None) -> "GripStiffness":
        """Multiplies all six stiffnesses by the factor `factor`, the dampings by `damping_factor`.

        A hand's mass and its wrist stay as they are.

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
    path = shipped_or_path(grip, "grip", (*GRIPS, *HANDS), "grip_")
    return load_file(path, GripStiffness, _check_whole)


def write_grip(grip: GripStiffness, path: str | Path) -> None:
    """Writes a grip's file, for `load_grip` and scenarios.

    Raises:
        InputError: the grip is not valid.

    """
    path = Path(path)
    check_grip(grip)
    tree = dataclasses.asdict(grip)
    text = dump_text({key: value for key, value in tree.items() if value is not None})
    write_text(text, path)


def check_grip(
    grip: GripStiffness, where: str = "grip", changed: Iterable[tuple[str, ...]] | None = None
) -> None:
    """Checks units, signs, counts and provenance; raises InputError.

    Args:
        changed: paths of what alone may differ from what has been checked; None: all.

    """
    if changed is None:
        read(grip, GripStiffness, where)
    else:
        check_fields(grip, changed, where)
    _check_whole(grip, where)


def _check_whole(grip: GripStiffness, where: str) -> None:
    """What no single value shows."""
    _check_threes(grip, where)
    if grip.hand is None:
        return
    _check_threes(grip.hand, f"{where}: hand")
    low, middle, high = sorted(grip.hand.moments.value)
    if high > (low + middle) * (1.0 + 1e-12):
        value = list(grip.hand.moments.value)
        raise InputError(f"{where}: hand.moments.value", value, "no moment above the others' sum")


def _check_threes(group: GripStiffness | HandBody, where: str) -> None:
    for item in dataclasses.fields(group):
        values = getattr(group, item.name)
        if isinstance(values, Quantities) and len(values.value) != 3:
            key = f"{where}.{item.name}" if isinstance(group, HandBody) else f"{where}: {item.name}"
            raise InputError(f"{key}.value", values.value, "3 numbers: x, y, z")
