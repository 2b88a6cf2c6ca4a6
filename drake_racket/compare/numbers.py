"""Names the numbers that rackets are compared by, with units, and how they are shown."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Number:
    """A number that rackets are compared by.

    Attributes:
        name: as a key.  unit: of the value, SI.
        text: what it is.
        factor, shown: to the unit that it is shown in.  digits: behind the point.
        group: heading that it stands under.

    """

    name: str
    unit: str
    text: str
    factor: float
    shown: str
    digits: int
    group: str

    def format(self, value: float, sd: float = 0.0) -> str:
        """Writes a `value` in SI units as it is shown, with its standard deviation `sd` if any."""
        text = f"{round(self.factor * value, self.digits) + 0.0:.{self.digits}f}"  # no -0.00
        if self.factor * sd >= 0.5 * 10.0**-self.digits:
            text += f" ± {self.factor * sd:.{self.digits}f}"
        return text


STATIC, BALL, SWEET, SHAKE = "Static", "Ball", "Sweet spots", "Vibration and hand"
_PLACES = (
    "tip, left",
    "tip",
    "tip, right",
    "left side",
    "centre",
    "right side",
    "throat, left",
    "throat",
    "throat, right",
)
NINE = tuple(f"restitution_{point}" for point in range(1, 10))

NUMBERS = (
    Number("mass", "kg", "mass", 1e3, "g", 1, STATIC),
    Number("balance", "m", "balance, from the butt", 1e2, "cm", 2, STATIC),
    Number("swingweight", "kg*m^2", "swingweight", 1e4, "kg cm²", 1, STATIC),
    Number("twistweight", "kg*m^2", "twistweight", 1e4, "kg cm²", 2, STATIC),
    Number("frequency_out_of_plane", "Hz", "fundamental, out of plane", 1.0, "Hz", 1, STATIC),
    Number("frequency_in_plane", "Hz", "fundamental, in plane", 1.0, "Hz", 1, STATIC),
    *(
        Number(name, "1", f"apparent restitution, point {i} ({place})", 1.0, "", 3, BALL)
        for i, (name, place) in enumerate(zip(NINE, _PLACES, strict=True), 1)
    ),
    Number("swing_speed_centre", "m/s", "ball speed of the swing, centre", 1.0, "m/s", 2, BALL),
    Number("swing_speed_best", "m/s", "ball speed of the swing, best aim", 1.0, "m/s", 2, BALL),
    Number("swing_best_place", "m", "that aim, from the string-bed centre", 1e3, "mm", 0, SWEET),
    Number(
        "restitution_best_place",
        "m",
        "most restitution on the axis, from the centre",
        1e3,
        "mm",
        0,
        SWEET,
    ),
    Number(
        "node_place", "m", "least vibration (node of bending), from the centre", 1e3, "mm", 0, SWEET
    ),
    Number(
        "percussion_place",
        "m",
        "centre of percussion for the hand's place, from the centre",
        1e3,
        "mm",
        0,
        SWEET,
    ),
    Number(
        "peak_handle_acceleration",
        "m/s^2",
        "peak acceleration, mid-handle",
        1.0,
        "m/s²",
        0,
        SHAKE,
    ),
    Number(
        "handle_ringing", "m/s^2", "ringing after release, mid-handle (RMS)", 1.0, "m/s²", 0, SHAKE
    ),
    Number("peak_hand_force", "N", "peak force on the hand", 1.0, "N", 1, SHAKE),
    Number("peak_hand_torque", "N*m", "peak torque on the hand", 1.0, "N m", 2, SHAKE),
)
"""What a comparison of rackets shows, in its order, with units and how each is printed."""
BY_NAME = {number.name: number for number in NUMBERS}
