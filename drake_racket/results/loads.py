"""Computes what the racket does to any joint of the arm that holds it, from a history alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError

if TYPE_CHECKING:
    import xarray


def racket_load(history: xarray.Dataset, joint: str = "hand") -> xarray.Dataset:
    """Gives the racket's force and its torque about a joint of the arm (wrist, elbow, shoulder).

    The load on the hand, carried to the joint's place J as if the arm between were rigid and had no
    mass: F, and M_J = M_H + (p_H - p_J) x F. Of any arm, however it came into the plant; the masses
    of the arm itself are not in it (`joint_torque`, `joint_reaction_force` have what they are part
    of).

    Args:
        history: of an impact with support grip or limb.
        joint: name of a joint of the limb, or of another landmark of the history; `hand`.

    Returns:
        `force` (N) and `torque` (N m) over time and axis, in the axes of the history's poses: R, or
        the world with a limb.

    Raises:
        InputError: the history holds no load on a hand, or has no such joint.

    """
    import xarray

    if "hand_force" not in history or "landmark" not in history.coords:
        raise InputError("racket_load: history", "no load on a hand", "one with a grip or a limb")
    name = _landmark(history, joint)
    hand = "hand_frame" if "hand_frame" in history.landmark else "hand"
    R_RH = _hand_axes(history)
    force, torque = (
        np.einsum("nij,nj->ni", R_RH, history[f"hand_{key}"].to_numpy())
        for key in ("force", "torque")
    )
    arm = _place(history, hand) - _place(history, name)
    axes = ("time", "axis")
    about = {"frame": str(history["ball_position"].attrs.get("frame", "R"))}
    return xarray.Dataset(
        {
            "force": (axes, force, {"units": "N", "long_name": "force of the racket"} | about),
            "torque": (
                axes,
                torque + np.cross(arm, force),
                {"units": "N m", "long_name": f"torque of the racket about {name}"} | about,
            ),
        },
        coords={"time": history["time"], "axis": list("xyz")},
    )


def _landmark(history: xarray.Dataset, joint: str) -> str:
    """The landmark where a joint is: its own, or that of the joints before it in the same place."""
    landmarks = [str(name) for name in history["landmark"].to_numpy()]
    if joint in landmarks:
        return joint
    joints = [str(name) for name in history["joint"].to_numpy()] if "joint" in history.dims else []
    if joint not in joints:
        raise InputError("racket_load: joint", joint, ", ".join(dict.fromkeys(landmarks + joints)))
    before = [name for name in joints[: joints.index(joint)] if name in landmarks]
    return before[-1]


def _place(history: xarray.Dataset, landmark: str) -> NDArray[np.float64]:
    """Place (n, 3) of a landmark in the history's axes (m)."""
    parts = [history[f"landmark_{axis}"].sel(landmark=landmark).to_numpy() for axis in "xyz"]
    return np.stack(parts, axis=1)


def _hand_axes(history: xarray.Dataset) -> NDArray[np.float64]:
    """R_RH (n, 3, 3): the handle's axes, turned back by how the racket has turned in the hand."""
    from scipy.spatial.transform import Rotation

    handle = Rotation.from_quat(history["handle_quaternion"].to_numpy()[:, [1, 2, 3, 0]])
    in_hand = Rotation.from_euler("xyz", history["grip_angle"].to_numpy())
    return np.asarray((handle * in_hand.inv()).as_matrix())
