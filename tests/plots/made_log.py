"""A log of formulas: what figures draw of it is known without a simulation."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import numpy as np
import xarray

import drake_racket as dr
from drake_racket.results.history import variable_attributes

TOUCH, RELEASE = 0.0, 0.005
SPEED = 20.0

GEOMETRY = {
    "handle_length": 0.356,
    "head_length": 0.33,
    "gsc": 0.155,
    "spacing": 0.0685,
    "rim_semi_axis_x": 0.164,
    "rim_semi_axis_y": 0.123,
    "ball_radius": 0.033,
    "segments": [["shoulder", "elbow"], ["elbow", "hand"]],
}
STORES = {
    "ball": 9.0,
    "contact": 4.0,
    "strings": 5.0,
    "rigid_motion": 2.0,
    "bending": 1.0,
    "grip": 0.7,
    "limb": 3.0,
    "gravity": 6.0,
    "torque_work": 0.001,
    "lost_ball": 2.5,
    "lost_friction": 0.4,
    "lost_joint": 0.3,
    "lost_strings": 0.0,
    "lost_limb": 0.001,
    "couple": 0.2,
}
"""Name -> size (J)."""


def made_log(*, point: int = 6, end: float = 0.06, **attributes: str) -> xarray.Dataset:
    """A ball on a point of the tour racket in a hand on a limb, spinning.

    Args:
        point: that it meets.  end: of the log (s).  attributes: in place of its own.

    """
    racket = dr.load_racket("tour")
    time = np.concatenate(
        [
            np.linspace(-0.004, TOUCH, 21)[:-1],
            np.linspace(TOUCH, RELEASE, 51),
            [RELEASE],  # the state after the event
            np.linspace(RELEASE, 0.012, 29)[1:],
            np.linspace(0.012, 0.06, 201)[1:],
        ]
    )
    time = time[time <= end]
    inside = ((time >= TOUCH) & (time < RELEASE)).astype(float)
    phase = np.clip((time - TOUCH) / (RELEASE - TOUCH), 0.0, 1.0)
    push = inside * (np.sin(np.pi * phase) + 0.1)
    after = np.clip(time - RELEASE, 0.0, None)
    ringing = np.exp(-20.0 * after) * (after > 0.0)
    springs = [*racket.string_bed.springs.value]
    number = np.arange(1, 10)
    share = 1.0 / (1.0 + np.abs(number - point))
    deflection = -0.008 * (np.sin(np.pi * phase) * inside)[:, None] * share
    deflection += 0.001 * (ringing * np.sin(2800.0 * after))[:, None] * np.cos(number)
    compression = np.where(inside > 0, 0.009 * push, -SPEED * np.maximum(-time, 0.4 * after))
    xyz = np.array([1.0, -0.5, 2.0])
    series = {
        "in_contact": inside,
        "contact_point": np.full(len(time), float(point)),
        "compression": compression,
        "normal_force": 900.0 * push,
        "friction_x": 60.0 * push * np.cos(2.0 * phase),
        "friction_y": -4.0 * push,
        "sliding_x": 3.0 - 4.0 * phase,
        "sliding_y": 0.5 * phase,
        "gripping": ((phase > 0.3) & (phase < 0.7)).astype(float),
        "in_plane_angle": 0.01 * np.sin(900.0 * after),
        "out_of_plane_angle": 0.03 * np.sin(1.5 * phase) + 0.02 * ringing * np.cos(830.0 * after),
    }
    sine = np.sin(2.0 * np.pi * 131.0 * after) * ringing + 0.3 * push
    vectors = {
        "handle_acceleration": 400.0 * sine[:, None] * np.array([0.1, 0.3, 1.0]),
        "hand_force": 90.0 * sine[:, None] * xyz,
        "hand_torque": 5.0 * push[:, None] * xyz[::-1],
        "grip_angle": 0.02 * sine[:, None] * xyz,
        "ball_spin": np.outer(300.0 * phase, [0.1, 1.0, -0.2]) + 20.0,
    }
    joints = ["shoulder_turn", "elbow$1", "slide"]
    turns = np.outer(1.0 - 20.0 * time, [0.5, -1.0, 0.3])
    by_joint = {
        "joint_position": turns,
        "joint_torque": 30.0 * np.outer(phase, [1.0, 2.0, 4.0]),
        "joint_reaction_force": 10.0 * np.outer(push, [3.0, 2.0, 1.0]),
    }
    level = {
        store: size * (0.5 + 0.5 * np.cos(np.pi * phase + i)) for i, (store, size) in
        enumerate(STORES.items())
    }  # fmt: skip
    rest = racket.string_bed.initial_tension.value
    tension = rest + 4.0e5 * np.abs(deflection[:, [(i % 9) for i in range(len(springs))]]) ** 1.5
    data: dict[str, Any] = {name: ("time", values) for name, values in series.items()}
    data |= {name: (("time", "axis"), values) for name, values in vectors.items()}
    data |= {name: (("time", "joint"), values) for name, values in by_joint.items()}
    data["string_deflection"] = ("time", "point"), deflection
    data["string_tension"] = ("time", "spring"), tension
    data["energy"] = ("time", "store"), np.column_stack(list(level.values()))
    data |= _places(time, phase, deflection[:, point - 1], compression, racket, point)
    coordinates = {
        "time": ("time", time, {"units": "s"}),
        "axis": list("xyz"),
        "point": number,
        "spring": springs,
        "joint": ("joint", joints, {"prismatic": json.dumps(["slide"])}),
        "landmark": ["shoulder", "elbow", "hand"],
        "store": list(STORES),
        "quaternion": list("wxyz"),
    }
    scenario = {
        "support": "grip",
        "point": str(point),
        "speed": SPEED,
        "incidence_deg": 15.0,
        "racket": "tour",
    }
    about = {
        "title": "A log of $5",
        "scenario": json.dumps(scenario),
        "racket": json.dumps(dataclasses.asdict(racket)),
        "geometry": json.dumps(GEOMETRY),
        "frame_in_plane_hz": 155.0,
        "frame_out_of_plane_hz": 128.0,
    }
    made = xarray.Dataset(data, coordinates, about | attributes)
    for name, variable in made.data_vars.items():
        variable.attrs |= variable_attributes(str(name))
    return made


def _places(
    time: Any, phase: Any, deflection: Any, compression: Any, racket: Any, point: int
) -> dict[str, Any]:
    """Where racket, ball and limb are: the racket turns about its x and moves."""
    half = 0.2 * phase
    handle = np.column_stack([np.cos(half), np.sin(half), 0.0 * half, 0.0 * half])
    butt = np.column_stack([0.1 * time, 0.5 * time, 1.0 + 0.0 * time])
    x, y, _ = racket.point(point)
    height = deflection - compression + GEOMETRY["ball_radius"]
    across = np.column_stack([x + 0.0 * time, y - height * np.sin(2.0 * half),
                              height * np.cos(2.0 * half)])  # fmt: skip
    turn = 2.0 * phase
    spun = np.column_stack([np.cos(turn), 0.0 * turn, np.sin(turn), 0.0 * turn])
    landmarks = np.array([[-0.4, 0.3, 1.5], [-0.3, 0.1, 1.2], [0.05, 0.0, 1.0]])
    moved = landmarks[None] + np.outer(phase, [0.0, 0.02, 0.05])[:, None, :]
    quaternion = ("time", "quaternion")
    return {
        "handle_quaternion": (quaternion, handle),
        "ball_quaternion": (quaternion, spun),
        "butt_position": (("time", "axis"), butt),
        "ball_position": (("time", "axis"), butt + across),
        **{f"landmark_{a}": (("time", "landmark"), moved[:, :, i]) for i, a in enumerate("xyz")},
    }
