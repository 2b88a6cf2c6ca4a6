"""Accelerations of a chain of rigid segments with point masses, by constrained Newton and Euler.

Nothing is written in joint coordinates: every segment has its own centre's acceleration a_i and
angular acceleration al_i, every point mass its own acceleration, and the joints are constraints on
them with Lagrange's multipliers:

    m a = F + J^T lambda,   I al + w x I w = T + J^T lambda,   J x = -b.

- A joint holds a point together: a_i + al_i x r_i + w_i x (w_i x r_i) is the same on both sides.
- Its three angles turn about z of the inner segment, then y, then x. Their torques t_k = -k_k q_k
  - c_k q_k' + e_k (e_k: what strings do) belong to one torque T on the outer segment (-T on the
  inner) with T . axis_k = t_k for the three instantaneous axes.
- A point mass slides along z of its carrier: in the carrier's axes its x and y stay. A force f
  along z acts on it, and -f on the carrier at its place.

numpy only; SI; vectors in world axes.
"""

from dataclasses import dataclass

import numpy as np


def skew(v):
    """The matrix of v x."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@dataclass
class Segment:
    """Mass, inertia (3, 3) about the centre in the segment's axes; R_WS, centre, velocities."""

    mass: float
    inertia: np.ndarray
    rotation: np.ndarray
    centre: np.ndarray
    omega: np.ndarray
    velocity: np.ndarray


@dataclass
class Hinge:
    """Between segments inner and inner + 1: place, angles and torques about z, y and x."""

    inner: int
    place: np.ndarray
    angles: np.ndarray
    torques: np.ndarray


@dataclass
class Slider:
    """A point mass on a carrier: place, velocity along the carrier's z, force along it."""

    mass: float
    carrier: int
    place: np.ndarray
    rate: float
    force: float


def hinge_torque(hinge, rotation):
    """The torque vector on the outer segment, in the world."""
    c, s = np.cos(hinge.angles[0]), np.sin(hinge.angles[0])
    about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    c, s = np.cos(hinge.angles[1]), np.sin(hinge.angles[1])
    about_y = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    axes = [[0.0, 0.0, 1.0], about_z @ [0.0, 1.0, 0.0], about_z @ about_y @ [1.0, 0.0, 0.0]]
    return rotation @ np.linalg.solve(np.array(axes), hinge.torques)


def accelerations(segments, hinges, sliders):
    """Gives (n, 3) angular and (n, 3) centre accelerations, and (m, 3) of the point masses."""
    n, m = len(segments), len(sliders)
    size = 6 * n + 3 * m
    mass, force = np.zeros((size, size)), np.zeros(size)
    for i, s in enumerate(segments):
        inertia = s.rotation @ s.inertia @ s.rotation.T
        turn, move = slice(6 * i, 6 * i + 3), slice(6 * i + 3, 6 * i + 6)
        mass[turn, turn], mass[move, move] = inertia, s.mass * np.eye(3)
        force[turn] -= np.cross(s.omega, inertia @ s.omega)
    rows, right = [], []
    for hinge in hinges:
        torque = hinge_torque(hinge, segments[hinge.inner].rotation)
        force[6 * hinge.inner : 6 * hinge.inner + 3] -= torque
        force[6 * hinge.inner + 6 : 6 * hinge.inner + 9] += torque
        row, bias = np.zeros((3, size)), np.zeros(3)
        for i, sign in ((hinge.inner, 1.0), (hinge.inner + 1, -1.0)):
            s = segments[i]
            arm = hinge.place - s.centre
            row[:, 6 * i : 6 * i + 3] = -sign * skew(arm)
            row[:, 6 * i + 3 : 6 * i + 6] = sign * np.eye(3)
            bias += sign * np.cross(s.omega, np.cross(s.omega, arm))
        rows.append(row)
        right.append(-bias)
    for k, slider in enumerate(sliders):
        at, i = 6 * n + 3 * k, slider.carrier
        s = segments[i]
        mass[at : at + 3, at : at + 3] = slider.mass * np.eye(3)
        arm, along = slider.place - s.centre, s.rotation[:, 2]
        force[at : at + 3] += slider.force * along
        force[6 * i : 6 * i + 3] -= np.cross(arm, slider.force * along)
        force[6 * i + 3 : 6 * i + 6] -= slider.force * along
        # a - a_carrier(place) - 2 w x z' e_z is along e_z
        bias = np.cross(s.omega, np.cross(s.omega, arm))
        bias += 2.0 * slider.rate * np.cross(s.omega, along)
        row = np.zeros((3, size))
        row[:, at : at + 3] = np.eye(3)
        row[:, 6 * i : 6 * i + 3] = skew(arm)
        row[:, 6 * i + 3 : 6 * i + 6] = -np.eye(3)
        across = s.rotation[:, :2].T
        rows.append(across @ row)
        right.append(across @ bias)
    jacobian = np.concatenate(rows)
    count = len(jacobian)
    whole = np.block([[mass, jacobian.T], [jacobian, np.zeros((count, count))]])
    found = np.linalg.solve(whole, np.concatenate([force, *right]))
    bodies = found[: 6 * n].reshape(n, 2, 3)
    return bodies[:, 0], bodies[:, 1], found[6 * n : size].reshape(m, 3)
