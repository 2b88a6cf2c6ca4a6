"""Computes what is measured of a whole racket from its frame's distribution.

The frame's chain (`laws.flexure`) in MOST_SEGMENTS segments, in numpy alone.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from drake_racket.laws.flexure import Slice, chain_mass
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.segments import MOST_SEGMENTS, bending_stiffness, frame_slices

Array = NDArray[np.float64]

SWING_AXIS = 0.1016  # m from the butt

MEASURED: Mapping[str, tuple[str, float, str]] = {
    "mass": ("kg", 0.001, "of the strung racket"),
    "balance": ("m", 0.001, "centre of mass of the strung racket, from the butt"),
    "swingweight": ("kg*m^2", 5e-5, "of the strung racket, about 4 inches from the butt"),
    "twistweight": ("kg*m^2", 1e-5, "of the strung racket, about its long axis"),
    "frequency_in_plane": ("Hz", 1.0, "fundamental of the bare, free frame"),
    "frequency_out_of_plane": ("Hz", 1.0, "fundamental of the bare, free frame"),
    "second_frequency": ("Hz", 4.0, "second out of plane, bare and free"),
    "clamped_frequency": ("Hz", 1.0, "first out of plane, bare, the grip clamped to its middle"),
    "node_handle": ("m", 0.003, "of the fundamental out of plane, from the butt"),
    "node_head": ("m", 0.003, "of the fundamental out of plane, from the butt"),
    "antinode_in_plane": ("m", 0.005, "of the fundamental in plane, from the butt"),
    "antinode_out_of_plane": ("m", 0.005, "of the fundamental out of plane, from the butt"),
}
"""Name -> unit, usual standard deviation, and what it is."""


def predictions(racket: RacketParameters) -> dict[str, float]:
    """Gives the model's value of everything in MEASURED."""
    frame = dataclasses.replace(
        racket.frame, segments=dataclasses.replace(racket.frame.segments, value=MOST_SEGMENTS)
    )
    racket = dataclasses.replace(racket, frame=frame)
    slices = frame_slices(racket)
    stiffness = {
        plane: bending_stiffness(racket, slices, plane) for plane in ("in_plane", "out_of_plane")
    }
    values = _whole(racket, slices)
    for plane in stiffness:
        frequencies, shape = _bending(slices, plane, stiffness[plane])
        values[f"frequency_{plane}"] = float(frequencies[0])
        nodes, antinode = _landmarks(slices, shape)
        values[f"antinode_{plane}"] = antinode
        if plane == "out_of_plane":
            values["second_frequency"] = float(frequencies[1])
            values["node_handle"], values["node_head"] = nodes
    clamped = chain_mass(slices, "out_of_plane")[2:, 2:]
    squares = scipy.linalg.eigvalsh(np.diag(stiffness["out_of_plane"]), clamped)
    values["clamped_frequency"] = float(np.sqrt(squares[0])) / (2.0 * math.pi)
    return {name: values[name] for name in MEASURED}


def _whole(racket: RacketParameters, slices: list[Slice]) -> dict[str, float]:
    """Mass, balance, swingweight and twistweight of the strung racket."""
    points = np.array([racket.point(i) for i in racket.bed_topology().points])
    each = racket.string_mass()
    mass = sum(s.mass for s in slices) + each * len(points)
    first = sum(s.mass * s.com for s in slices) + each * float(np.sum(points[:, 0]))
    swing = sum(s.moments()[1] + s.mass * (s.com - SWING_AXIS) ** 2 for s in slices)
    twist = sum(s.moments()[0] + s.mass * s.com_y**2 for s in slices)
    return {
        "mass": mass,
        "balance": first / mass,
        "swingweight": swing + each * float(np.sum((points[:, 0] - SWING_AXIS) ** 2)),
        "twistweight": twist + each * float(np.sum(points[:, 1] ** 2)),
    }


def _bending(slices: list[Slice], plane: str, stiffness: Array) -> tuple[Array, Array]:
    """Frequencies (Hz) of the free frame, and the fundamental's displacement at segment ends."""
    whole = chain_mass(slices, plane)
    rigid = np.linalg.solve(whole[:2, :2], whole[:2, 2:])
    squares, shapes = scipy.linalg.eigh(np.diag(stiffness), whole[2:, 2:] - whole[2:, :2] @ rigid)
    angles = shapes[:, 0]
    start, slope = -rigid @ angles
    x = np.array([slices[0].start, *(s.end for s in slices)])
    bent = sum(q * np.maximum(x - s.end, 0.0) for q, s in zip(angles, slices, strict=False))
    return np.sqrt(squares) / (2.0 * math.pi), start + slope * x + bent


def _landmarks(slices: list[Slice], shape: Array) -> tuple[tuple[float, float], float]:
    """Outer zeros of the straight pieces, and the vertex of a parabola about the largest middle."""
    x = np.array([slices[0].start, *(s.end for s in slices)])
    at = np.flatnonzero(shape[1:] * shape[:-1] < 0.0)
    zeros = x[at] + (x[at + 1] - x[at]) * shape[at] / (shape[at] - shape[at + 1])
    if len(zeros) < 2:
        return (math.nan, math.nan), math.nan
    middle, moved = 0.5 * (x[1:] + x[:-1]), 0.5 * (shape[1:] + shape[:-1])
    inside = (middle > zeros[0]) & (middle < zeros[-1])
    top = int(np.argmax(np.where(inside, np.abs(moved), -1.0)))
    near = slice(max(top - 2, 0), top + 3)
    curve, slope, _ = np.polyfit(middle[near] - middle[top], moved[near], 2)
    return (float(zeros[0]), float(zeros[-1])), float(middle[top] - 0.5 * slope / curve)
