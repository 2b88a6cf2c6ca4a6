"""These sections are about ball, frame and instruments: plate, modes, hammer, bench."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.io.progress import Progress, Report
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.racket import RACKETS, load_racket
from drake_racket.parameters.scenario import IntegratorSettings
from drake_racket.plots.rigs.force_plate import force_plate_figure
from drake_racket.plots.rigs.impact_hammer import hammer_figure
from drake_racket.plots.rigs.inertia_bench import inertia_bench_figure
from drake_racket.plots.rigs.modes import frame_modes_figure, grip_figure, string_modes_figure
from drake_racket.rigs.force_plate.plate import make_force_plate, plate_dataset
from drake_racket.rigs.hammer.force import half_sine
from drake_racket.rigs.hammer.impact_hammer import DIRECTIONS, hammer_dataset
from drake_racket.rigs.hammer.ringing import analyse_ringing
from drake_racket.rigs.inertia.dataset import inertia_dataset
from drake_racket.rigs.inertia.swings import swing_history
from drake_racket.rigs.modes.bending import acceleration_signal, bending_mode
from drake_racket.rigs.modes.comparisons import grip_sweep, string_bed_coupling
from drake_racket.rigs.modes.frame_modes import (
    fundamentals_table,
    modes_dataset,
    published_fundamentals,
)
from drake_racket.rigs.modes.shapes import PLANES
from drake_racket.validation.impacts import drop_speed
from drake_racket.validation.outcome import Plan, SectionResult

if TYPE_CHECKING:
    import xarray

PLATE_STEP = IntegratorSettings(maximum_step=2e-6, error_control=False)
"""For the comparison with the closed form; force histories elsewhere need no such steps."""


def force_plate(plan: Plan, progress: Report) -> SectionResult:
    """Compares the ball on a rigid plate, and a drop on a hard floor."""
    dataset = plate_dataset(plan.speeds, settings=PLATE_STEP)
    progress(Progress("", 1, 2))
    drop = make_force_plate().run(drop_speed())
    slow = make_force_plate().run(drop_speed(), load_ball("penn_titanium_slow"))
    grows = make_force_plate().run(drop_speed(), load_ball(normal="hunt_crossley"))
    names = ("contact_time", "peak_force", "restitution", "rebound_speed", "impulse")
    differences = [abs(dataset[n] / dataset[f"{n}_closed_form"] - 1.0).max() for n in names]
    history = abs(dataset["force"] - dataset["force_closed_form"]).max("time")
    differences.append((history / dataset["peak_force"]).max())
    low, high = (dataset.sel(speed=s) for s in (min(plan.speeds), max(plan.speeds)))
    values = {
        "plate.kb_growth": float(high["kb"] / low["kb"]) - 1.0,
        "plate.cb_growth": float(high["cb"] / low["cb"]) - 1.0,
        "plate.peak_force": float(dataset["peak_force"].max()),
        "plate.contact_time": float(dataset["contact_time"].max()),
        "plate.drop_restitution": drop.restitution,
        "plate.drop_restitution.slow": slow.restitution,
        "plate.drop_restitution.hunt_crossley": grows.restitution,
        "plate.closed_form": max(float(d) for d in differences),
    }
    text = [
        "The ball meets a body welded to the world through the same contact that meets a string"
        " mass. Restitution on the plate falls from"
        f" {float(low['restitution']):.3f} at {float(low['speed']):g} m/s to"
        f" {float(high['restitution']):.3f} at {float(high['speed']):g} m/s.",
    ]
    figure = force_plate_figure(dataset)
    return SectionResult(
        values, text, {"impacts": dataset}, {"force": ("Ball on a rigid plate.", figure)}
    )


def frame_modes(plan: Plan, progress: Report) -> SectionResult:
    """Fundamentals in every reading; antinodes; the labels' own contradictions."""
    table = fundamentals_table()
    values: dict[str, float] = {}
    datasets = {"fundamentals": table}
    figures = {}
    for n, racket in enumerate(RACKETS):
        modes = modes_dataset(racket, strung=False)
        for plane in PLANES:
            free = table["frequency"].sel(racket=racket, support="free", plane=plane)
            by_axis = free.sel(joint_reading="by_axis")
            key = f"modes.{racket}.{plane}"
            values[key] = float(by_axis.sel(strung=False))
            values[f"{key}.strung"] = float(by_axis.sel(strung=True))
            values[f"{key}.as_printed"] = float(free.sel(joint_reading="as_printed", strung=False))
            mode = modes.isel(mode=int(np.argmax(modes["strain_share"].sel(element=plane).data)))
            values[f"antinode.{racket}.{plane}"] = float(mode["antinode_exact"])
            values[f"antinode.{racket}.{plane}.regression"] = float(mode["antinode_regression"])
        parameters = load_racket(racket)
        coupling = string_bed_coupling(racket)
        datasets |= {f"shapes_{racket}": modes, f"string_bed_{racket}": coupling}
        figures[f"shapes_{racket}"] = (
            f"Bending modes of the bare {racket} frame: nodes and antinodes.",
            frame_modes_figure(modes, parameters),
        )
        figures[f"strings_{racket}"] = (
            f"Modes of the {racket} string-bed at low tension, head held.",
            string_modes_figure(coupling, parameters),
        )
        progress(Progress("", n + 1, 3))
    sweeps = [grip_sweep(racket) for racket in RACKETS]
    figures["grip"] = (
        "Frequencies of the bare frame over the stiffness of a hand-like grip.",
        grip_figure(sweeps),
    )
    joints = [load_racket(racket).throat_joint for racket in RACKETS]
    (ki, ci), (ko, co) = (
        np.array([getattr(j, plane)() for j in joints]).T for plane in ("in_plane", "out_of_plane")
    )
    values["joint.kf_ratio"] = float(np.mean(ko / ki))
    values["joint.cf_ratio"] = float(np.mean(co / ci))
    values["joint.recreational_stiffer"] = float(np.mean([ki[1] / ki[0], ko[1] / ko[0]]))
    text = [
        "From Drake's linearisation of the plant at rest. A frame of two rigid bodies has one"
        " bending mode in each plane. It can give that mode's frequency, damping and nodes, and"
        " how much an impact excites it. It cannot give where the antinode is: its shape has a"
        " kink at the hinge, which is the antinode in both planes, while the paper's two differ by"
        " up to 25 mm. Nor can it give a second bending mode, or torsion of the frame. The paper's"
        " own way, a parabola fitted to displacements along the frame, puts the antinode of a"
        " kinked shape elsewhere.",
    ]
    return SectionResult(values, text, datasets, figures)


def impact_hammer(plan: Plan, progress: Report) -> SectionResult:
    """Compares frequencies read from ringing, as a user would from a measured history."""
    values: dict[str, float] = {}
    datasets: dict[str, xarray.Dataset] = {}
    figures: dict[str, tuple[str, Any]] = {}
    lines = []
    pulse = half_sine()
    for n, racket in enumerate(RACKETS):
        parameters = load_racket(racket)
        strikes = {d: hammer_dataset(parameters, d, pulse) for d in DIRECTIONS}
        ringing = {
            d: analyse_ringing(acceleration_signal(s), start=s.attrs["pulse_end_s"])
            for d, s in strikes.items()
        }
        published = {}
        for direction, found in ringing.items():
            values[f"hammer.{racket}.{direction}"] = found.frequency
            stiffness, damping = getattr(parameters.throat_joint, direction)()
            omega = 2.0 * np.pi * found.frequency
            mode = bending_mode(parameters, direction)
            place = strikes[direction].attrs["place_m"]
            at_grip = mode.ringing_per_impulse(0.1) / mode.ringing_per_impulse(place)
            lines.append(
                f"- {racket}, {direction.replace('_', ' ')}: logarithmic decrement"
                f" {found.logarithmic_decrement:.4f}, damping ratio {found.damping_ratio:.4f}"
                f" (from Table 2: cf ω / 2 kf = {0.5 * damping * omega / stiffness:.4f});"
                f" {1e3 * abs(place - mode.node):.0f} mm from the node of bending"
                f" (100 mm from the butt it would ring {at_grip:.1f} times as strongly)"
            )
            published[direction] = published_fundamentals(racket)[PLANES.index(direction)]
        datasets |= {f"{racket}_{direction}": strike for direction, strike in strikes.items()}
        figures[racket] = (
            f"Hammer test of the {racket} frame; the pulse is inferred ({pulse.title}).",
            hammer_figure(strikes, ringing, published, pulse.title),
        )
        progress(Progress("", n + 1, len(RACKETS)))
    text = [
        "The bare racket hangs freely and is struck in the middle of its handle; the acceleration"
        " opposite is analysed for 100 ms. Half way up the handle is read as half the length of the"
        " handle part, which lies near the handle's node of bending: frequency and damping do not"
        " depend on the place, but how strongly it rings does. Half way up a grip of 200 mm is the"
        " other reading (`python studies/impact_hammer.py --place 0.1`).",
        "\n".join(lines),
    ]
    return SectionResult(values, text, datasets, figures)


def inertia_bench(plan: Plan, progress: Report) -> SectionResult:
    """Compares what the simulated bench returns with the inertia that is put in."""
    dataset = inertia_dataset()
    progress(Progress("", 1, 2))
    parts = dataset.sel(part=["handle", "head"])
    values = {
        "inertia.moi": float(abs(parts["relative_error"]).max()),
        "inertia.com": float(abs(parts["com"] / parts["com_input"] - 1.0).max()),
    }
    lines = []
    for racket in RACKETS:
        head = load_racket(racket).head
        flat = (head.moi_longitudinal.value + head.moi_transverse.value) / head.moi_frontal.value
        values[f"inertia.{racket}.perpendicular_axes"] = flat
        whole = dataset.sel(racket=racket, part="strung")
        lines.append(
            f"- {racket}, strung: {1e3 * float(whole['mass']):.1f} g, balance"
            f" {1e3 * float(whole['com']):.1f} mm, swingweight"
            f" {1e4 * float(whole['swingweight']):.1f} kg cm², twistweight"
            f" {1e4 * float(whole['twistweight']):.2f} kg cm²"
        )
    text = [
        "Pendulum, torsional pendulum and knife-edges are simulated, and their readings go through"
        " the sums that a laboratory would do.",
        "\n".join(lines),
    ]
    figure = inertia_bench_figure(dataset, swing_history(RACKETS[0]))
    return SectionResult(
        values, text, {"bench": dataset}, {"bench": ("The simulated bench.", figure)}
    )
