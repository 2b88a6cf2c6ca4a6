"""What figures draw, number by number, of logs and datasets that are made of formulas."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import drake_racket as dr
from drake_racket.io.signals import Signal
from drake_racket.plots import impact_figure
from drake_racket.plots.log.figures import LOG_FIGURES, check_log
from drake_racket.plots.log.overlay import overlay_figure
from drake_racket.plots.rigs import (
    force_plate,
    impact_hammer,
    inertia_bench,
    modes,
    restitution,
    spin,
    static_stiffness,
)
from tests.plots.drawn import drawn
from tests.plots.made_log import made_log
from tests.recorded import check_record
from tests.rigs import made_data

RECORDS = Path(__file__).parent / "records"
TOUR = dr.load_racket("tour")
DRAW = {name: draw for name, draw, _ in LOG_FIGURES} | {"impact": impact_figure}


@pytest.fixture(scope="module")
def log():
    return made_log()


@pytest.mark.parametrize("name", DRAW)
def test_figures_of_a_log(log, name):
    check_record(drawn(DRAW[name](log)), RECORDS / f"log_{name}.json")


def strings_alone(log):
    """The racket's strings ring louder than its frame, and are not damped."""
    louder = 3000.0 * np.sin(2.0 * np.pi * 445.0 * log["time"])
    return log.assign(handle_acceleration=log["handle_acceleration"] + louder)


def damped(log):
    racket = json.loads(log.attrs["racket"])
    racket["string_bed"]["damping"] |= {"value": 0.1, "unit": "N*s/m"}
    pulls_less = log["string_tension"] - 60.0 * (log["time"] > 0.004)
    return log.assign(string_tension=pulls_less).assign_attrs(racket=json.dumps(racket))


def clamped(log):
    return log.assign_attrs(scenario='{"support": "clamped_handle"}')


OTHERS = {
    "vibration of strings": ("vibration", strings_alone),
    "vibration of damped strings": ("vibration", lambda log: damped(strings_alone(log))),
    "vibration in a clamp": ("vibration", clamped),
    "vibration at rest": (
        "vibration",
        lambda log: log.assign(handle_acceleration=0.0 * log["handle_acceleration"]),
    ),
    "vibration of a short log": ("vibration", lambda log: log.sel(time=slice(None, 0.0249))),
    "vibration just long enough": ("vibration", lambda log: log.sel(time=slice(None, 0.0252))),
    "vibration ends in contact": ("vibration", lambda log: log.sel(time=slice(None, 0.003))),
    "loads of a hand": (
        "loads",
        lambda log: log.drop_vars(["joint_position", "joint_torque", "joint_reaction_force"]),
    ),
    "loads of joints": (
        "loads",
        lambda log: log.drop_vars(["hand_force", "hand_torque"]).assign(
            grip_angle=log["grip_angle"] * np.nan
        ),
    ),
    "loads without reactions": (
        "loads",
        lambda log: log.assign(joint_reaction_force=np.nan * log["joint_reaction_force"]),
    ),
    "map of damped strings": ("string_map", damped),
    "map in contact": ("string_map", lambda log: log.sel(time=slice(None, 0.0045))),
    "map at release": ("string_map", lambda log: log.isel(time=slice(None, 72))),
    "map that ends early": ("string_map", lambda log: log.sel(time=slice(None, 0.0061))),
    "map at rest": (
        "string_map",
        lambda log: log.assign(string_tension=0.0 * log["string_tension"] + 200.0),
    ),
    "energy near contact": ("energy", lambda log: log.sel(time=slice(None, 0.009))),
    "energy of a ball alone": ("energy", lambda log: log.sel(store=["ball", "couple"])),
    "force without friction": (
        "contact_force",
        lambda log: (
            log.assign(friction_x=0.005 * log["normal_force"], friction_y=0.0 * log["time"])
            .assign(normal_force=log["normal_force"] - 0.075 * 900.0 * log["in_contact"])
            .drop_attrs(deep=False)
        ),
    ),
    "force of no contact": (
        "contact_force",
        lambda log: log.assign(in_contact=0.0 * log["in_contact"]),
    ),
    "impact of no contact": ("impact", lambda log: log.assign(in_contact=0.0 * log["in_contact"])),
}


@pytest.mark.parametrize("name", OTHERS)
def test_figures_of_other_logs(log, name):
    figure, change = OTHERS[name]
    file = name.replace(" ", "_")
    check_record(drawn(DRAW[figure](change(log))), RECORDS / f"{file}.json")


@pytest.mark.parametrize("held", [True, False])
def test_logs_over_each_other(log, held):
    other = made_log(point=2, end=0.03)
    if not held:
        other = other.drop_vars("hand_force")
    figure = overlay_figure({"one $1": log, "two": other})
    check_record(drawn(figure), RECORDS / f"overlay_{held}.json")


def test_what_a_log_lacks_for_a_figure(log):
    lacks = {name: what for name, _, what in LOG_FIGURES}
    assert {name: what(log) for name, what in lacks.items()} == dict.fromkeys(lacks, "")
    apart = log.assign(in_contact=0.0 * log["in_contact"])
    missed = "the ball did not touch the strings"
    assert [name for name, what in lacks.items() if what(apart) == missed] == [
        "contact_force",
        "string_map",
        "spin",
    ]
    still = 0.0 * log["handle_acceleration"]
    for name, change, said in (
        ("string_map", log.drop_attrs(deep=False), "racket's geometry"),
        ("energy", log.drop_vars("energy"), "no audit"),
        ("vibration", log.assign(handle_acceleration=still), "does not move"),
        ("vibration", log.assign(handle_acceleration=np.nan * still), "a discrete plant"),
        ("loads", log.drop_vars(["hand_force", "joint_position"]), "no hand holds"),
        ("spin", log.drop_vars("ball_spin"), "a point without spin"),
    ):
        assert said in lacks[name](change), name
    for one in ("hand_force", "joint_position"):
        assert lacks["loads"](log.drop_vars(one)) == ""
    for name in ("in_contact", "string_tension", "handle_acceleration"):
        with pytest.raises(dr.InputError, match=name):
            check_log(log.drop_vars(name), "LOG")


def other_bench(names):
    return inertia_bench.inertia_bench_figure(made_data.bench(names), made_data.swing())


def frame_figure(**about):
    return modes.frame_modes_figure(made_data.modes(**about), TOUR)


def maps(name, scale=1.0, **about):
    return restitution.bed_maps(made_data.supports(), name, scale=scale, **about)


def hammer():
    strikes = {"in_plane": made_data.strike(), "out_of_plane": made_data.strike(0.002)}
    rings = {"in_plane": made_data.ringing(), "out_of_plane": made_data.ringing(128.0)}
    published = {"in_plane": 178.0, "out_of_plane": np.nan}
    return impact_hammer.hammer_figure(strikes, rings, published, "a note")


def measured():
    time = np.linspace(0.0, 0.004, 9)
    return Signal(time, 800.0 * np.sin(np.pi * time / 0.004), "force", "N", where="a/b/mine.csv")


RIGS = {
    "plate": lambda: force_plate.force_plate_figure(made_data.plate()),
    "plate_measured": lambda: force_plate.force_plate_figure(
        made_data.plate().assign_attrs(identified_speeds_m_per_s=[10.0, 33.0]), measured()
    ),
    "plate_fast": lambda: force_plate.force_plate_figure(
        made_data.plate().assign_attrs(identified_speeds_m_per_s=[15.0, 30.0])
    ),
    "hammer": hammer,
    "bench": lambda: other_bench(None),
    "bench_of_others": lambda: other_bench(["tour", "mine", "yours"]),
    "frame": frame_figure,
    "frame_turned": lambda: frame_figure(sign=-1.0, support="clamped_handle"),
    "frame_of_six": lambda: frame_figure(segments=6),
    "string_modes": lambda: modes.string_modes_figure(made_data.coupling(), TOUR),
    "grips": lambda: modes.grip_figure([made_data.grip("tour"), made_data.grip("mine")]),
    "grips_strung": lambda: modes.grip_figure([made_data.grip("recreational")]),
    "over_speed": lambda: restitution.restitution_over_speed(made_data.normal()),
    "over_speed_of_three": lambda: restitution.restitution_over_speed(
        made_data.normal().isel(racket=[0]).sel(tension=["low"], point=[2, 4, 5])
    ),
    "map_of_restitution": lambda: maps("restitution", title="of $"),
    "map_of_acceleration": lambda: maps("peak_handle_acceleration"),
    "map_of_speeds": lambda: maps("rebound_speed", 10.0),
    "oblique": lambda: restitution.oblique_figure(made_data.oblique(), "tour", "high"),
    "along_axis": lambda: restitution.along_axis_figure(made_data.axis()),
    "along_axis_nodes": lambda: restitution.along_axis_figure(
        made_data.axis(), {"tour": 0.5, "recreational": 0.52}
    ),
    "spins": lambda: spin.spin_figure(made_data.spins(), title="Spins"),
    "pressed": lambda: static_stiffness.stiffness_figure(made_data.pressed(), made_data.matches()),
    "pressed_aside": lambda: static_stiffness.stiffness_figure(
        made_data.pressed().sel(point=[2, 4]), made_data.matches()
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", RIGS)
def test_figures_of_experiments(name):
    check_record(drawn(RIGS[name]()), RECORDS / f"rig_{name}.json")


@pytest.mark.parametrize(
    ("units", "scale", "shown"),
    [("m", 1e3, "mm"), ("N/m", 1e-3, "kN/m"), ("m", 1.0, "m")],
)
def test_units_of_maps(units, scale, shown):
    found = made_data.supports()
    found["restitution"].attrs["units"] = units
    figure = restitution.bed_maps(found, "restitution", scale=scale)
    assert figure.axes[-1].get_ylabel() == f"restitution ({shown})"
    assert figure.get_suptitle() == "Supports"


def test_an_outline_that_stands_is_seen_from_the_balls_side():
    """The tip is up, and +y on the left."""
    from matplotlib.figure import Figure

    from drake_racket.plots.style import draw_outline

    lying, standing = Figure().subplots(), Figure().subplots()
    draw_outline(lying, TOUR)
    draw_outline(standing, TOUR, along_x=False)
    for one, other in zip(lying.lines, standing.lines, strict=True):
        assert np.array_equal(other.get_xdata(), -one.get_ydata())
        assert np.array_equal(other.get_ydata(), one.get_xdata())
