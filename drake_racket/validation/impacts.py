"""These sections are about the string-bed: head clamped, oblique, moving, pressed slowly."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from drake_racket.cases.case import changed
from drake_racket.io.progress import Progress, Report, part_of
from drake_racket.parameters.racket import RACKETS, TENSIONS, load_racket
from drake_racket.plots.rigs.restitution import (
    along_axis_figure,
    bed_maps,
    oblique_figure,
    restitution_over_speed,
)
from drake_racket.plots.rigs.static_stiffness import stiffness_figure
from drake_racket.results.outputs import RESTITUTION
from drake_racket.rigs.head_clamped import (
    ANGLE_READINGS,
    STROKES,
    head_clamped_scenario,
    normal_impacts,
    oblique_impacts,
)
from drake_racket.rigs.restitution_map import along_axis, axis_offsets, restitution_map
from drake_racket.rigs.static_stiffness import mean_difference, stiffness_dataset
from drake_racket.simulation import simulate
from drake_racket.sweep.run import run_grid
from drake_racket.sweep.spec import make_sweep
from drake_racket.validation.outcome import Plan, SectionResult

if TYPE_CHECKING:
    import xarray

DROP_HEIGHT = 2.54  # m, 100 inches: ITF's rebound test
STANDARD_GRAVITY = 9.80665  # m/s^2


def drop_speed() -> float:
    """Gives the speed (m/s) after the ITF's drop, without air."""
    return math.sqrt(2.0 * STANDARD_GRAVITY * DROP_HEIGHT)


def head_clamped(plan: Plan, progress: Report) -> SectionResult:
    """Compares normal impacts: rebound range, restitution over speed and tension."""
    dataset = normal_impacts(
        points=plan.points, speeds=plan.speeds, workers=plan.workers, progress=progress
    )
    values: dict[str, float] = {}
    restitution = dataset["restitution"]
    for racket in RACKETS:
        for tension in TENSIONS:
            bed = dataset.sel(racket=racket, tension=tension)
            key = f"clamped.{racket}.{tension}"
            values[f"{key}.lowest"] = float(bed["rebound_speed"].min())
            values[f"{key}.highest"] = float(bed["rebound_speed"].max())
            steps = np.diff(bed["restitution"].transpose("point", "speed").to_numpy(), axis=1)
            values[f"{key}.falls"] = float(np.sum(np.any(steps >= 0.0, axis=1)))
        low, high = (restitution.sel(racket=racket, tension=t, point=5) for t in TENSIONS)
        values[f"clamped.{racket}.tension"] = float((high >= low).sum())
    dropped = changed(head_clamped_scenario(), speed=drop_speed(), after=0.012)
    drops = run_grid(make_sweep(dropped, {"racket": RACKETS}, [RESTITUTION]), title="ITF's drop")
    for racket in RACKETS:
        drop = float(drops["restitution"].sel(racket=racket))
        values[f"clamped.{racket}.drop"] = drop
    metre = math.sqrt(2.0 * STANDARD_GRAVITY)
    slow = changed(dropped, after=0.02, engine="compiled")
    grows = changed(slow, normal="hunt_crossley")
    for key, scenario in (
        ("drop.hunt_crossley", grows),
        ("drop_1m", changed(slow, speed=metre, ball="penn_titanium_slow")),
        ("drop_1m.hunt_crossley", changed(grows, speed=metre)),
    ):
        found = simulate(scenario, history=False).apparent_restitution
        values[f"clamped.tour.{key}"] = found
    middle = float(plan.speeds[len(plan.speeds) // 2])
    spread = (restitution.max("point") - restitution.min("point")) / restitution.mean("point")
    text = [
        "The head is held rigidly and the ball cannon aims at each point"
        f" ({len(plan.points)} points, {len(plan.speeds)} speeds, four beds). Over the points of"
        f" one bed at one speed restitution differs by {100 * float(spread.min()):.1f} to"
        f" {100 * float(spread.max()):.1f} % of its mean. The inferred spring assignment was chosen"
        " for a small spread, so that this number is not a test of it.",
    ]
    return SectionResult(
        values,
        text,
        {"normal_impacts": dataset},
        {
            "over_speed": ("Restitution over approach speed.", restitution_over_speed(dataset)),
            "map": (
                f"Restitution at the points, {middle:g} m/s.",
                bed_maps(dataset.sel(speed=middle), "restitution", title=f"{middle:g} m/s"),
            ),
        },
    )


def oblique(plan: Plan, progress: Report) -> SectionResult:
    """Compares both strokes, in both readings of friction and of the angle."""
    dataset = oblique_impacts(points=plan.points, workers=plan.workers, progress=progress)
    values: dict[str, float] = {}
    all_cases = 0
    for reading, suffix in (("from_normal", ""), ("from_plane", ".from_plane")):
        velocity = dataset["tangential_velocity"].sel(
            friction_reading="velocity", angle_reading=reading
        )
        # the regularised law creeps at the order of its scale, 0.02 m/s, where a ball sticks
        sliding = np.abs(velocity) > 0.5
        all_cases = int(sliding.size)
        # in 72 cases of the full grid; a coarser grid counts its share
        values[f"oblique.friction_decides{suffix}"] = 72.0 * float(sliding.mean())
    angle = dataset["rebound_angle"] * (180.0 / np.pi)

    def span(**where: str) -> str:
        part = angle.sel(where)
        return (
            " to ".join(f"{round(float(x), 1) + 0.0:.1f}" for x in (part.min(), part.max())) + "°"
        )

    slide = 1e3 * _slide(dataset.sel(angle_reading="from_plane", friction_reading="velocity"))
    text = [
        "Relative speeds and angles of the paper's two strokes at"
        f" {len(plan.points)} points of four beds ({all_cases} impacts for each reading)."
        " Rebound angles from the normal (negative: back to where the ball came from):",
        "\n".join(
            f"- angle read {reading.replace('_', ' ')}, friction by {friction}:"
            f" {span(angle_reading=reading, friction_reading=friction)}"
            for reading in ANGLE_READINGS
            for friction in dataset["friction_reading"].to_numpy()
        ),
        "With the angle read from the normal a point mass has no spin to take up: it stops sliding"
        " while it is in contact, and friction no longer decides its angle. Friction along the"
        " displacement, the paper's literal wording, goes on to pull the stopped ball back. With"
        " the angle read from the plane the ball slides throughout, by"
        f" {float(slide.min()):.0f} to {float(slide.max()):.0f} mm: past the next string mass"
        " (68.5 mm), which the model does not notice, and with a normal speed below the identified"
        " range.",
    ]
    figure = oblique_figure(dataset, "tour", "low")
    return SectionResult(
        values,
        text,
        {"oblique_impacts": dataset},
        {"angles": ("Rebound angle and tangential velocity, tour racket, low tension.", figure)},
    )


def _slide(dataset: xarray.Dataset) -> xarray.DataArray:
    """Distance (m) slid in contact: mean of the tangential velocities times the contact time.

    Exact for a friction that is proportional to a normal force symmetric in time; good enough to
    be compared with the distance of two string masses.
    """
    import xarray

    approach = xarray.DataArray(
        [
            STROKES[stroke][0] * math.cos(math.radians(STROKES[stroke][1]))
            for stroke in dataset["stroke"].to_numpy()
        ],
        dims="stroke",
    )
    return 0.5 * (approach + dataset["tangential_velocity"]) * dataset["contact_time"]


def moving_racket(plan: Plan, progress: Report) -> SectionResult:
    """Compares free, held and clamped racket: apparent restitution, vibration, and the grip."""
    from drake_racket.rigs.modes.shapes import head_node

    supports = ("free", "grip", "clamped_handle")
    offsets = axis_offsets(plan.axis_step)
    cases = 2 * len(supports) * len(plan.points)
    total = cases + 2 * len(offsets)
    points = restitution_map(
        supports=supports,
        points=plan.points,
        workers=plan.workers,
        progress=part_of(progress, 0, total),
    )
    axis = along_axis(offsets, workers=plan.workers, progress=part_of(progress, cases, total))
    values: dict[str, float] = {}
    nodes = {}
    for racket in RACKETS:
        line = axis.sel(racket=racket)
        semi_axis = load_racket(racket).string_bed.rim_semi_axis_x.value
        for place, share in (("throat", -0.8), ("tip", 0.8)):
            values[f"free.{racket}.{place}"] = float(
                line["restitution"].interp(offset_x=share * semi_axis)
            )
        at = points["restitution"].sel(racket=racket, point=5)
        values[f"free.{racket}.centre"] = float(at.sel(support="free"))
        nodes[racket] = head_node(load_racket(racket))
        least = float(line["offset_x"][int(np.argmin(line["bending_angle"].to_numpy()))])
        values[f"free.{racket}.node"] = load_racket(racket).point(5)[0] + least - nodes[racket]
        speed = points["rebound_speed"].sel(racket=racket, point=5)
        free = float(speed.sel(support="free"))
        values[f"grip.{racket}.centre"] = float(speed.sel(support="grip")) / free - 1.0
        values[f"grip.{racket}.clamped"] = float(speed.sel(support="clamped_handle")) / free - 1.0
    held = points["peak_handle_acceleration"].sel(support="free")
    text = [
        "The racket is free, in a hand-like grip (a bushing of inferred stiffness to the ground),"
        " or clamped at the handle; 25 m/s. Aims on the long axis between string masses meet the"
        " nearest one: the steps halfway between two masses are the nine-point bed's. Peak"
        f" mid-handle acceleration of the free racket is {float(held.min()):.0f} to"
        f" {float(held.max()):.0f} m/s² over the points.",
    ]
    free_only = points.sel(support=["free", "grip"])
    return SectionResult(
        values,
        text,
        {"points": points, "along_axis": axis},
        {
            "restitution": (
                "Apparent restitution at the points.",
                bed_maps(points, "restitution", title="Apparent restitution, 25 m/s"),
            ),
            "acceleration": (
                "Peak acceleration of mid-handle by point of impact.",
                bed_maps(free_only, "peak_handle_acceleration", title="Mid-handle, 25 m/s"),
            ),
            "along_axis": (
                "Along the long axis: bending is excited least where the ball meets the node.",
                along_axis_figure(axis, nodes),
            ),
        },
    )


def static_stiffness(plan: Plan, progress: Report) -> SectionResult:
    """Compares beds pressed slowly: which match."""
    dataset = stiffness_dataset(points=plan.points, forces=plan.forces)
    progress(Progress("", 1, 1))
    difference = mean_difference(dataset)
    at = difference["difference"]
    pairs = {
        (a, b): float(at.sel(bed=f"tour {a}", other=f"recreational {b}", force=800.0))
        for a in TENSIONS
        for b in TENSIONS
    }
    ranked = sorted(pairs, key=lambda pair: pairs[pair])
    matched = at.sel(bed="tour low", other="recreational high")
    values = {
        "static.pair": 1.0 + ranked.index(("low", "high")),
        "static.match": float(matched.sel(force=800.0)),
        "static.match_small": float(matched.sel(force=1.0)),
    }
    text = [
        "Tour at low and recreational at high tension differ least at"
        f" {float(matched.idxmin('force')):.0f} N, by {100 * float(matched.min()):.1f} % on"
        " average over the points: the recreational bed is stiffer when pressed lightly"
        " (tension), the tour bed"
        " when pressed hard (springs).",
    ]
    figure = stiffness_figure(dataset, difference)
    return SectionResult(
        values,
        text,
        {"stiffness": dataset, "difference": difference},
        {"curves": ("Force, deflection and stiffness; and how well beds match.", figure)},
    )
