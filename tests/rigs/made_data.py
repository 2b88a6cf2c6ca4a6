"""Datasets as the experiments give them, made of formulas: nothing is simulated."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray

from drake_racket.rigs.hammer.ringing import Ringing

RACKETS = ["tour", "recreational"]
TENSIONS = ["low", "high"]
POINTS = [2, 4, 5, 8]
SPEEDS = [18.0, 25.0, 33.0]
GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def spread(shape: tuple[int, ...], low: float, high: float) -> np.ndarray:
    """Numbers between two, all different, evenly."""
    return low + (high - low) * np.mod(GOLDEN * np.arange(1, 1 + int(np.prod(shape))), 1.0).reshape(
        shape
    )


def made(coordinates: dict[str, list[Any]], **variables: tuple[Any, ...]) -> xarray.Dataset:
    """A Dataset of variables over coordinates.

    Args:
        variables: name -> (its dimensions, parted by spaces, lowest and highest value).

    """
    data = {}
    for name, (dimensions, low, high) in variables.items():
        dims = dimensions.split()
        data[name] = dims, spread(tuple(len(coordinates[d]) for d in dims), low, high)
    return xarray.Dataset(data, coordinates)


def plate() -> xarray.Dataset:
    """As `rigs.plate_dataset`: force over time at three speeds, and its closed form."""
    time = np.linspace(-0.0004, 0.006, 33)
    found = made(
        {"speed": [15.0, 25.0, 33.0], "time": time},
        force=("speed time", 0.0, 900.0),
        kb=("speed", 20e3, 30e3),
        cb=("speed", 2.0, 4.0),
        **{
            f"{name}{form}": ("speed", low * off, high * off)
            for form, off in (("", 1.0), ("_closed_form", 1.01))
            for name, low, high in (
                ("contact_time", 0.003, 0.005),
                ("peak_force", 700.0, 1500.0),
                ("restitution", 0.4, 0.7),
                ("rebound_speed", 8.0, 19.0),
                ("impulse", 1.5, 3.0),
            )
        },
    )
    found["force_closed_form"] = 1.002 * found["force"]
    return found.assign_attrs(title="Plate $", identified_speeds_m_per_s=[18.0, 33.0])


def strike(start: float = 0.001) -> xarray.Dataset:
    """As `rigs.hammer_dataset`: a pulse, and what rings after it."""
    time = np.linspace(0.0, 0.1, 201)
    near = np.clip((time - start) / 0.004, 0.0, 1.0)
    after = np.clip(time - start - 0.004, 0.0, None)
    force = 100.0 * np.sin(np.pi * near)
    acceleration = 2.0 * force + 50.0 * np.exp(-20.0 * after) * np.sin(900.0 * after)
    about = {
        "title": "Strike, tour, in plane",
        "pulse_start_s": start,
        "pulse_end_s": start + 0.004,
        "place_m": 0.178,
    }
    data = {"force": ("time", force), "acceleration": ("time", acceleration)}
    return xarray.Dataset(data, {"time": time}, about)


def ringing(frequency: float = 150.0) -> Ringing:
    """As `analyse_ringing` gives it."""
    lines = np.linspace(0.0, 600.0, 61)
    peak = 40.0 / (1.0 + ((lines - frequency) / 20.0) ** 2)
    return Ringing(frequency, 0.2, 0.032, frequency, 0.032, 0.01, frequency, 45.0, lines, peak)


def bench(rackets: list[str] | None = None) -> xarray.Dataset:
    """As `inertia_dataset`, and as large errors as one can see."""
    over = "racket part axis"
    found = made(
        {
            "racket": rackets or RACKETS,
            "part": ["handle", "head", "strung"],
            "axis": ["longitudinal", "transverse", "frontal"],
        },
        moment_input=(over, 0.0005, 0.02),
        relative_error=(over, -1e-3, 2e-3),
        moment_sd=(over, 1e-6, 5e-5),
        mass=("racket part", 0.1, 0.35),
        com=("racket part", 0.1, 0.4),
        swingweight=("racket part", 0.01, 0.04),
        twistweight=("racket part", 0.001, 0.002),
    )
    found["com_input"] = found["com"] * (1.0 + 1e-3 * found["mass"])
    found["moment"] = found["moment_input"] * (1.0 + found["relative_error"])
    return found


def swing() -> xarray.Dataset:
    """As `swing_history`: a pendulum of 1.25 s."""
    time = np.linspace(0.0, 4.0, 81)
    data = {
        "angle": ("time", 0.08 * np.cos(2.0 * np.pi * time / 1.25)),
        "crossing": ("number", 0.3125 + 0.625 * np.arange(6)),
    }
    about = {"title": "Pendulum: tour, strung", "period_s": 1.25, "first_timed_crossing": 3}
    return xarray.Dataset(data, {"time": time, "number": range(1, 7)}, about)


def modes(*, segments: int = 2, support: str = "free", sign: float = 1.0) -> xarray.Dataset:
    """As `modes_dataset`: rigid motion, then a bending mode in each plane."""
    x = np.linspace(0.0, 0.686, 29)
    bent = np.abs(x - 0.356) - 0.12
    planes = ["in_plane", "out_of_plane"]
    kinds = ["rigid", *planes] + ["in_plane"] * (segments > 2)
    n = len(kinds)
    shape = sign * np.einsum("m,d,x->mdx", 1.0 + np.arange(n), [1.0, -0.7], bent)
    share = np.array([[0.0, 0.01], [0.9, 0.05], [0.1, 0.95], [0.95, 0.0]])[:n]
    index = np.arange(n)
    published = np.where(index > 1, np.nan, 0.35)
    data = {
        "shape": (("mode", "direction", "x"), shape),
        "fit": (("mode", "x"), sign * np.outer(1.0 + index, 0.3 - 2.0 * (x - 0.35) ** 2)),
        "strain_share": (("mode", "element"), share),
        "kind": ("mode", kinds),
        "node_exact": (("mode", "node"), 0.12 + 0.35 * np.array([[0.0, 1.0]] * n)),
        "node_regression": (("mode", "node"), 0.11 + 0.37 * np.array([[0.0, 1.0]] * n)),
        "antinode_exact": ("mode", 0.356 + 0.001 * index),
        "antinode_regression": ("mode", 0.34 + 0.001 * index),
        "frequency": ("mode", 100.0 + 30.0 * index),
        "damping_ratio": ("mode", 0.01 + 0.002 * index),
        "published_antinode": ("mode", published),
        "published_frequency": ("mode", 400.0 * published),
    }
    about = {"segments": segments, "strung": support != "free", "support": support}
    return xarray.Dataset(data, {"x": x, "direction": planes, "element": planes}, about)


def coupling() -> xarray.Dataset:
    """As `string_bed_coupling`: nine modes."""
    return made(
        {"mode": list(range(1, 10)), "point": list(range(1, 10))},
        string_shape=("mode point", -0.8, 0.5),
        frequency=("mode", 400.0, 900.0),
        frequency_free=("mode", 450.0, 950.0),
    )


def grip(racket: str) -> xarray.Dataset:
    """As `grip_sweep`: three modes in each plane over the stiffness of a grip."""
    found = made(
        {"plane": ["in_plane", "out_of_plane"], "order": [1, 2, 3], "factor": [0.1, 1.0, 10.0]},
        frequency=("plane order factor", 10.0, 300.0),
        free_frequency=("plane factor", 120.0, 160.0),
        clamped_frequency=("plane factor", 40.0, 60.0),
    )
    kinds = np.where(found["frequency"] > 130.0, "in_plane", "rigid")
    found["kind"] = ("plane", "order", "factor"), kinds
    return found.assign_attrs(racket=racket, strung=racket == "recreational")


def fundamentals() -> xarray.Dataset:
    """As `fundamentals_table`."""
    return made(
        {
            "racket": RACKETS,
            "support": ["free", "clamped_handle"],
            "plane": ["in_plane", "out_of_plane"],
            "joint_reading": ["by_axis", "as_printed"],
            "strung": [False, True],
        },
        frequency=("racket support plane joint_reading strung", 100.0, 200.0),
    )


def normal() -> xarray.Dataset:
    """As `normal_impacts`, restitution that mostly falls with speed."""
    found = made(
        {"racket": RACKETS, "tension": TENSIONS, "point": POINTS, "speed": SPEEDS},
        restitution=("racket tension point speed", 0.5, 0.6),
        rebound_speed=("racket tension point speed", 10.0, 25.0),
    )
    falls = found["restitution"] - 0.005 * found["speed"]
    falls.attrs["units"] = "1"
    return found.assign(restitution=falls).assign_attrs(title="Normal $")


def oblique() -> xarray.Dataset:
    """As `oblique_impacts`: some balls slide and some do not."""
    over = "racket tension stroke point angle_reading friction_reading"
    return made(
        {
            "racket": RACKETS,
            "tension": TENSIONS,
            "stroke": ["slice", "topspin_drive"],
            "point": POINTS,
            "angle_reading": ["from_normal", "from_plane"],
            "friction_reading": ["velocity", "displacement"],
        },
        rebound_angle=(over, -0.2, 0.7),
        tangential_velocity=(over, -1.0, 4.0),
        contact_time=(over, 0.004, 0.006),
    )


def supports() -> xarray.Dataset:
    """As `restitution_map`."""
    over = "racket support point"
    found = made(
        {"racket": RACKETS, "support": ["free", "grip", "clamped_handle"], "point": POINTS},
        restitution=(over, 0.2, 0.5),
        rebound_speed=(over, 5.0, 12.0),
        peak_handle_acceleration=(over, 900.0, 3000.0),
    )
    for name, unit in (
        ("restitution", "1"),
        ("rebound_speed", "m/s"),
        ("peak_handle_acceleration", "m/s^2"),
    ):
        found[name].attrs["units"] = unit
    return found.assign_attrs(title="Supports")


def axis() -> xarray.Dataset:
    """As `along_axis`."""
    over = "racket offset_x"
    return made(
        {"racket": RACKETS, "offset_x": np.linspace(-0.14, 0.14, 9).tolist()},
        restitution=(over, 0.1, 0.5),
        bending_angle=(over, 0.001, 0.03),
        handle_ringing=(over, 100.0, 500.0),
    )


def pressed() -> xarray.Dataset:
    """As `stiffness_dataset`: beds pressed slowly."""
    over = "racket tension point force"
    return made(
        {
            "racket": RACKETS,
            "tension": TENSIONS,
            "point": POINTS,
            "force": [1.0, 400.0, 800.0, 1200.0],
        },
        deflection=(over, 0.001, 0.02),
        secant_stiffness=(over, 20e3, 40e3),
    )


def matches() -> xarray.Dataset:
    """As `mean_difference` of `pressed`."""
    beds = [f"{racket} {tension}" for racket in RACKETS for tension in TENSIONS]
    return made(
        {"bed": beds, "other": beds, "force": [1.0, 400.0, 800.0, 1200.0]},
        difference=("bed other force", 0.01, 0.3),
    )


def spins() -> xarray.Dataset:
    """As `rigs.spin.spin_over_incidence`."""
    over = "friction incidence"
    return made(
        {"friction": [0.25, 0.4], "incidence": [0.0, 20.0, 40.0, 60.0]},
        spin=(over, 0.0, 4000.0),
        angle=(over, 0.0, 60.0),
        sliding=(over, 0.0, 1.0),
        restitution=(over, 0.5, 0.8),
    )
