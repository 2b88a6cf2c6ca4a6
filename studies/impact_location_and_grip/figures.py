"""Impact location and grip tightness: maps of the string-bed, and histories of arm and racket."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket import load_racket
from drake_racket.plots import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILION,
    draw_outline,
    new_figure,
    tidy,
)
from studies.impact_location_and_grip.findings import (
    centre_point,
    flexion_more_than_centre,
    side_points,
)

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

_GRIP_COLOURS = {"loose": ORANGE, "normal": GREEN, "tight": PURPLE}
_SPARE = (BLUE, VERMILION, "0.2")


def location_maps(dataset: xarray.Dataset, racket: str) -> Figure:
    """Flexion beyond the centre impact's, flexing load and rotation in the hand at the points.

    A row per grip; the racket lies level, tip to the left, with the side towards the ground below.

    Args:
        dataset: of `rigs.grip_and_location`.  racket: name or file, for the outline.

    """
    load = dataset["peak_flexing_load"].sel(joint="wrist_flexion")
    shown: list[tuple[str, Any]] = [
        ("peak flexing load on the wrist (N m)", load),
        ("largest rotation in the hand (deg)", np.degrees(dataset["peak_grip_rotation"])),
        ("ball's rebound speed (m/s)", dataset["rebound_speed"]),
    ]
    if centre_point(dataset) is not None:
        more = np.degrees(flexion_more_than_centre(dataset))
        shown.insert(0, ("wrist flexion more than\nwith a centre impact (deg)", more))
    grips = list(dataset["grip"].to_numpy())
    figure = new_figure(3.4 * len(shown) + 0.3, 2.1 * len(grips) + 0.9)
    panels = figure.subplots(len(grips), len(shown), squeeze=False)
    for column, (title, values) in zip(panels.T, shown, strict=True):
        limits = float(values.min()), float(values.max())
        for axes, grip in zip(column, grips, strict=True):
            _draw_map(axes, racket, dataset.sel(grip=grip), values.sel(grip=grip), limits)
        column[0].set_title(title, fontsize=10)
    for axes, grip in zip(panels[:, 0], grips, strict=True):
        axes.text(-0.02, 0.5, f"{grip} grip", rotation=90, va="center", transform=axes.transAxes)
    figure.suptitle(
        "One-handed backhand as the player sees it: tip to the left, ground at the bottom"
    )
    return figure


def _draw_map(
    axes: Any, name: str, case: xarray.Dataset, values: xarray.DataArray, limits: Any
) -> None:
    racket = load_racket(name)
    draw_outline(axes, racket)
    length, centre = racket.handle.length.value, racket.point(5)[0]
    x = 1e3 * (centre + case["along"].to_numpy())
    y = 1e3 * case["height"].to_numpy()
    low, high = limits
    numbers = values.to_numpy()
    axes.scatter(x, y, c=numbers, s=420, cmap="cividis", vmin=low, vmax=high, zorder=2)
    for at_x, at_y, number in zip(x, y, numbers, strict=True):
        colour = "white" if number < low + 0.5 * (high - low) else "black"
        text = f"{number:.1f}" if abs(number) < 100.0 else f"{number:.0f}"
        text = text.replace("-", "\N{MINUS SIGN}")
        axes.text(at_x, at_y, text, ha="center", va="center", color=colour, fontsize=7, zorder=3)
    axes.set_xlim(1e3 * (length + racket.head.length.value) + 5.0, 1e3 * length - 25.0)
    axes.set_axis_off()


def _lines(dataset: xarray.Dataset) -> list[tuple[str, int | None, str]]:
    """Label, point (None: no impact) and colour of the histories that are drawn."""
    below, above = side_points(dataset)
    centre = centre_point(dataset)
    found = [
        (f"below the axis ({below})", below, VERMILION),
        (f"centre ({centre})", centre, BLUE),
        (f"above the axis ({above})", above, GREEN),
    ]
    return [line for line in found if line[1] is not None] + [("no impact", None, GREY)]


def _history(dataset: xarray.Dataset, name: str, point: int | None) -> xarray.DataArray:
    return dataset[f"swing_{name}"] if point is None else dataset[name].sel(point=point)


def joint_histories(dataset: xarray.Dataset, grip: str) -> Figure:
    """Change of every joint angle from touch on, with and without impact, for one grip."""
    case = dataset.sel(grip=grip)
    joints = list(dataset["joint"].to_numpy())
    figure = new_figure(11.0, 5.6)
    panels = figure.subplots(2, 4, sharex=True)
    for axes, joint in zip(panels.flat, joints, strict=False):
        for label, point, colour in _lines(dataset):
            angle = np.degrees(_history(case, "joint_position", point).sel(joint=joint))
            style = "--" if point is None else "-"
            axes.plot(1e3 * case["time"], angle - angle[0], color=colour, ls=style, label=label)
        axes.set_title(joint.replace("_", " "), fontsize=10)
        axes.axhline(0.0, color="0.8", lw=0.8, zorder=0)
        tidy(axes)
    for axes in panels.flat[len(joints) :]:
        axes.set_axis_off()
    for axes in (*panels[1, :], panels[0, -1]):
        axes.set_xlabel("time from touch (ms)")
        axes.tick_params(labelbottom=True)
    for axes in panels[:, 0]:
        axes.set_ylabel("change of angle (deg)")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    panels.flat[-1].legend(handles, labels, frameon=False, loc="center")
    figure.suptitle(f"Joint angles from touch, {grip} grip, constant joint torques")
    return figure


_LOADS = (("wrist_flexion", "wrist"), ("elbow_flexion", "elbow"), ("shoulder_flexion", "shoulder"))


def load_histories(dataset: xarray.Dataset, grip: str) -> Figure:
    """The racket's torque about three joints' axes, and those joints' reaction forces.

    A short spike about 1 ms after touch is friction: its direction turns along the racket and it
    falls as the ball stops sliding over the strings.
    """
    case = dataset.sel(grip=grip)
    figure = new_figure(11.0, 6.3)
    panels = figure.subplots(2, 3, sharex=True)
    for row, (name, quantity) in zip(
        panels,
        (
            ("racket_load", "load of the racket (N m)"),
            ("reaction_force", "reaction force (N)"),
        ),
        strict=True,
    ):
        for axes, (joint, text) in zip(row, _LOADS, strict=True):
            for label, point, colour in _lines(dataset):
                values = _history(case, name, point).sel(joint=joint)
                style = {"color": colour, "lw": 1.0, "ls": "--" if point is None else "-"}
                axes.plot(1e3 * case["time"], values, label=label, **style)
            about = f"about {joint.replace('_', ' ')}" if name == "racket_load" else text
            axes.set_title(about, fontsize=10)
            tidy(axes)
        row[0].set_ylabel(quantity)
    for axes in panels[1]:
        axes.set_xlabel("time from touch (ms)")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(f"Loads on the arm, {grip} grip")
    return figure


def grip_histories(dataset: xarray.Dataset) -> Figure:
    """What the grip changes: below the axis and in the centre; a line per grip."""
    below, above = side_points(dataset)
    points = [
        (text, point)
        for text, point in (
            ("below the axis", below),
            ("centre", centre_point(dataset)),
            ("above the axis", above),
        )
        if point is not None
    ]
    figure = new_figure(3.6 * len(points) + 0.6, 7.6)
    panels = figure.subplots(3, len(points), sharex=True, sharey="row", squeeze=False)
    time = 1e3 * dataset["time"]
    for n, grip in enumerate(dataset["grip"].to_numpy()):
        colour = _GRIP_COLOURS.get(str(grip), _SPARE[n % len(_SPARE)])
        for column, (_, point) in zip(panels.T, points, strict=True):
            case = dataset.sel(grip=grip, point=point)
            wrist = case.sel(joint="wrist_flexion")
            forced = wrist["joint_position"] - dataset["swing_joint_position"].sel(
                grip=grip, joint="wrist_flexion"
            )
            column[0].plot(time, np.degrees(case["grip_rotation"]), color=colour, label=str(grip))
            column[1].plot(time, np.degrees(forced), color=colour)
            column[2].plot(time, wrist["racket_load"], color=colour, lw=1.0)
    for column, (text, point) in zip(panels.T, points, strict=True):
        column[0].set_title(f"{text} ({point})", fontsize=10)
        column[2].set_xlabel("time from touch (ms)")
        for axes in column:
            axes.axhline(0.0, color="0.8", lw=0.8, zorder=0)
            tidy(axes)
    for axes, text in zip(
        panels[:, 0],
        (
            "rotation of the racket\nin the hand (deg)",
            "wrist flexion beyond\nthe stroke without impact (deg)",
            "load of the racket on\nwrist flexion (N m)",
        ),
        strict=True,
    ):
        axes.set_ylabel(text)
    panels[0, 0].legend(frameon=False, title="grip", fontsize=9)
    figure.suptitle("Grip tightness")
    return figure
