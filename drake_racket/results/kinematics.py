"""Computes places and velocities of bodies and frames over time, from arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_racket.engines.trajectory import Motion, Place, cross

Array = NDArray[np.float64]


def rotations(motion: Motion, body: int) -> Array:
    """Gives R_WB (m, 3, 3)."""
    return motion.poses[:, body, :, :3]


def frame_rotations(motion: Motion, place: Place) -> Array:
    """Gives R_WF (m, 3, 3)."""
    return rotations(motion, place.body) @ place.rotation


def arms(motion: Motion, place: Place) -> Array:
    """Gives p_BoFo_W (m, 3), from the body's origin to the frame's (m)."""
    return rotations(motion, place.body) @ place.translation


def positions(motion: Motion, place: Place) -> Array:
    """Gives p_WoFo_W (m, 3) of a frame's origin (m)."""
    return motion.poses[:, place.body, :, 3] + arms(motion, place)


def velocities(motion: Motion, place: Place) -> Array:
    """Gives v_WFo_W (m, 3) of a frame's origin (m/s): v + w x r."""
    spatial = motion.velocities[:, place.body]
    return spatial[:, 3:] + cross(spatial[:, :3], arms(motion, place))


def sensor_accelerations(motion: Motion, place: Place) -> Array:
    """Gives the acceleration (m, 3) of the accelerometer, in its segment's axes (m/s^2).

    a + alpha x r + w x (w x r): the rate of its velocity in the world; an accelerometer would read
    it less gravity.
    """
    r, w = arms(motion, place), motion.velocities[:, place.body, :3]
    alpha, a = motion.sensor_acceleration[:, :3], motion.sensor_acceleration[:, 3:]
    total: Array = a + cross(alpha, r) + cross(w, cross(w, r))
    return in_axes(rotations(motion, place.body), total)


def in_axes(rotation: Array, vectors: Array) -> Array:
    """Vectors (m, 3) of the world in the axes of R_WF (m, 3, 3): R^T v."""
    found: Array = np.einsum("mji,mj->mi", rotation, vectors)
    return found


def quaternions(rotation: Array) -> Array:
    """Gives unit quaternions (m, 4), w first and not negative, of R (m, 3, 3)."""
    from scipy.spatial.transform import Rotation

    xyzw = Rotation.from_matrix(rotation).as_quat(canonical=True)
    return np.asarray(xyzw[:, [3, 0, 1, 2]])


def roll_pitch_yaw(rotation: Array) -> Array:
    """Gives roll, pitch, yaw (m, 3) (rad) of R (m, 3, 3) = Rz(yaw) Ry(pitch) Rx(roll)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(rotation).as_euler("xyz"))
