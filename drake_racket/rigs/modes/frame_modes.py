"""Computes frequencies, damping and mode shapes of a racket, and its fundamentals.

The source excited each racket, measured extreme displacements along it, and found nodes,
antinodes and the fundamentals in and out of plane (Glynn et al. 2011, Methods and Results). Here
Drake's linearisation takes the place of the exciter (`modal_analysis`), and nodes and antinodes
come exactly and by the source's regression (`mode_shapes`, which says what two rigid bodies can
give).

The source says neither whether its rackets were strung in the modal test (its impact-hammer test
took the frames unstrung) nor how they were held; the free bare frame is compared here, and the
strung racket is shown beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError
from drake_racket.io.units import labelled
from drake_racket.laws.bed import BedTopology
from drake_racket.parameters.frame import JOINT_READINGS
from drake_racket.parameters.grip import GripStiffness
from drake_racket.parameters.racket import (
    RACKETS,
    RacketParameters,
    load_racket,
)
from drake_racket.rigs.modes.modal_analysis import (
    SUPPORTS,
    Modes,
    modal_system,
    solve_modes,
)
from drake_racket.rigs.modes.shapes import (
    NO_LANDMARKS,
    PLANES,
    SAMPLES,
    ModeLandmarks,
    Shapes,
    exact_landmarks,
    mode_shapes,
    quadratic_fit,
    regression_landmarks,
    sample_points,
)

if TYPE_CHECKING:
    import xarray


def published_fundamentals(racket: str) -> tuple[float, float]:
    """Gives published frequencies (Hz) in and out of plane; nan for other rackets."""
    return {"tour": (158.0, 132.0), "recreational": (178.0, 150.0)}.get(racket, (np.nan, np.nan))


def published_antinodes(racket: str) -> tuple[float, float]:
    """Antinodes (m from the butt), as `published_fundamentals`."""
    return {"tour": (0.366, 0.349), "recreational": (0.375, 0.350)}.get(racket, (np.nan, np.nan))


def modes_dataset(
    racket: str | RacketParameters = "tour",
    tension: str = "low",
    joint_reading: str | None = None,
    *,
    strung: bool = True,
    support: str = "free",
    grip: GripStiffness | None = None,
    samples: int = SAMPLES,
) -> xarray.Dataset:
    """Computes all modes of one racket that vibrate.

    Args:
        racket, tension, joint_reading: as `load_racket`; or a racket's parameters, whose frame
            may have any number of segments.
        strung, support, grip: as `modal_system`.
        samples: points along the axis that the regression takes.

    Returns:
        A Dataset over `mode`, by rising frequency, with `kind` and `plane` as labels; shapes over
        `direction` and `x`, string deflections over `point` (strung only), nodes over `part`.

    Raises:
        InputError: an argument is not valid.

    """
    import xarray

    if isinstance(racket, RacketParameters):
        parameters, racket = racket, racket.name
    else:
        parameters = load_racket(racket, tension, joint_reading=joint_reading)
    places = sample_points(parameters, samples)
    modes = solve_modes(modal_system(parameters, strung=strung, support=support, grip=grip))
    shapes = mode_shapes(modes)
    x = np.unique(np.append(np.linspace(0.0, shapes.tip, 101), shapes.places[1:-1]))
    variables = {
        **_frequency_variables(modes),
        **_shape_variables(shapes, x),
        **_landmark_variables(shapes, places, x),
        **_published_variables(modes, racket),
    }
    if strung:
        variables |= string_variables(shapes.strings, parameters.bed_topology())
    planes = [shapes.plane(i) or "none" for i in range(len(modes.kinds))]
    return xarray.Dataset(
        variables,
        coords={
            "mode": ("mode", np.arange(1, len(planes) + 1), {"long_name": "by rising frequency"}),
            "kind": ("mode", list(modes.kinds), {"long_name": "where most strain energy is"}),
            "plane": ("mode", planes, {"long_name": "plane in which the axis moves"}),
            "element": list(modes.elements),
            "direction": list(PLANES),
            "part": _node_names(parameters, variables["node_exact"][1].shape[1]),
            "x": labelled("x", x, "m", "from the butt along the axis"),
        },
        attrs={
            "title": f"Modes, {parameters.title}",
            "racket": racket,
            "tension": tension,
            "joint_reading": parameters.throat_joint.reading.value,
            "strung": int(strung),
            "support": support,
            "grip": modes_grip(support, grip),
            "rigid_motions": modes.rigid_motions,
            "samples": samples,
            "segments": len(parameters.frame_segments()),
            **_note(parameters),
        },
    )


def modes_grip(support: str, grip: GripStiffness | None) -> str:
    """Gives the name of the grip for a Dataset's attributes."""
    return "none" if support != "grip" else "normal" if grip is None else grip.name


def _frequency_variables(modes: Modes) -> dict[str, Any]:
    return {
        "frequency": labelled("mode", modes.frequencies, "Hz", "undamped frequency"),
        "damped_frequency": labelled(
            "mode", modes.damped_frequencies, "Hz", "damped frequency (nan if overdamped)"
        ),
        "damping_ratio": labelled(
            "mode", modes.damping_ratios, "1", "damping ratio (nan if overdamped)"
        ),
        "complexity": labelled(
            "mode", _complexity(modes), "1", "1 - MAC of damped (complex) and undamped shape"
        ),
        "strain_share": labelled(
            ("mode", "element"), modes.strain_shares, "1", "share in the strain energy"
        ),
    }


def _complexity(modes: Modes) -> NDArray[np.float64]:
    """What the complex shape has beyond the real one, as a share of its norm squared."""
    context = modes.system.plant_context()
    mass = modes.system.plant.CalcMassMatrix(context)
    overlap = np.einsum("ij,ik,kj->j", modes.shapes, mass, modes.complex_shapes)
    share: NDArray[np.float64] = np.clip(1.0 - np.abs(overlap) ** 2, 0.0, 1.0)
    return share


def _shape_variables(shapes: Shapes, x: NDArray[np.float64]) -> dict[str, Any]:
    return {
        "shape": labelled(
            ("mode", "direction", "x"),
            shapes.along_axis(x),
            "1",
            "displacement of the axis, over the mode's largest",
        ),
        "roll": labelled(
            "mode", shapes.rolls, "rad/m", "rotation about the axis, over the largest displacement"
        ),
    }


def _landmark_variables(
    shapes: Shapes, places: NDArray[np.float64], x: NDArray[np.float64]
) -> dict[str, Any]:
    """Nodes and antinodes in the plane of each mode, both ways, and the fitted quadratics."""
    displacements = shapes.along_axis(places)
    exact: list[ModeLandmarks] = []
    fitted: list[ModeLandmarks] = []
    fits = np.full((len(displacements), len(x)), np.nan)
    for i in range(len(displacements)):
        plane = shapes.plane(i)
        if plane is None:
            exact.append(NO_LANDMARKS)
            fitted.append(NO_LANDMARKS)
            continue
        direction = PLANES.index(plane)
        exact.append(exact_landmarks(shapes.corners[i, direction], shapes.places))
        fit = quadratic_fit(places, displacements[i, direction])
        fitted.append(regression_landmarks(fit, shapes.tip))
        fits[i] = fit(x)
    variables = {"fit": labelled(("mode", "x"), fits, "1", "quadratic fit to the displacements")}
    count = max(len(marks.nodes) for marks in (*exact, *fitted))
    for name, found in (("exact", exact), ("regression", fitted)):
        variables[f"node_{name}"] = labelled(
            ("mode", "part"),
            _nodes(found, count),
            "m",
            f"node from the butt, {name}",
        )
        variables[f"antinode_{name}"] = labelled(
            "mode",
            np.array([marks.antinode for marks in found]),
            "m",
            f"antinode from the butt, {name}",
        )
    return variables


def _note(parameters: RacketParameters) -> dict[str, str]:
    if len(parameters.frame_segments()) > 2:
        return {}
    return {"note": "two rigid bodies: the exact antinode is the hinge by construction"}


def _nodes(found: Sequence[ModeLandmarks], count: int) -> NDArray[np.float64]:
    """Nodes (modes, count), nan where a mode has fewer."""
    rows = [[*marks.nodes, *[np.nan] * (count - len(marks.nodes))] for marks in found]
    return np.array(rows)


def _node_names(parameters: RacketParameters, count: int) -> list[str]:
    """Names of the nodes: of two segments the body that has it."""
    if len(parameters.frame_segments()) == 2:
        return ["handle", "head"]
    return [f"node_{i + 1}" for i in range(count)]


def string_variables(strings: NDArray[np.float64], bed: BedTopology) -> dict[str, Any]:
    """Gives string deflections (n, points) and how symmetric they are, over `mode`."""
    places = bed.places.tolist()
    across = [places.index([x, -y]) for x, y in places]
    along = [places.index([-x, y]) for x, y in places]
    size = np.sum(strings**2, axis=1)
    moved = size > 1e-12
    variables = {
        "string_shape": labelled(
            ("mode", "point"),
            strings,
            "1",
            "deflection of the strings from the head, over the mode's largest displacement",
        )
    }
    for name, mirror, text in (
        ("lateral", across, "left and right"),
        ("axial", along, "tip and throat"),
    ):
        symmetry = np.sum(strings * strings[:, mirror], axis=1) / np.where(moved, size, 1.0)
        variables[f"{name}_symmetry"] = labelled(
            "mode",
            np.where(moved, symmetry, np.nan),
            "1",
            f"strings with {text} changed: +1 symmetric, -1 antisymmetric",
        )
    variables["point"] = ("point", list(bed.points), {"long_name": "string-bed point"})
    return variables


def _published_variables(modes: Modes, racket: str) -> dict[str, Any]:
    """The published numbers at the bending modes, nan elsewhere."""
    frequency, antinode = np.full((2, len(modes.kinds)), np.nan)
    for i, plane in enumerate(PLANES):
        frequency[modes.bending(plane)] = published_fundamentals(racket)[i]
        antinode[modes.bending(plane)] = published_antinodes(racket)[i]
    return {
        "published_frequency": labelled("mode", frequency, "Hz", "Glynn et al. 2011, Results"),
        "published_antinode": labelled("mode", antinode, "m", "Glynn et al. 2011, Results"),
    }


def fundamentals_table(
    *,
    rackets: Sequence[str] = RACKETS,
    joint_readings: Sequence[str] = JOINT_READINGS,
    strung: Sequence[bool] = (False, True),
    supports: Sequence[str] = SUPPORTS,
    tension: str = "low",
    grip: GripStiffness | None = None,
) -> xarray.Dataset:
    """Gives the bending mode in each plane, of rackets on supports.

    The bending mode is the one with the largest share of its strain energy in that joint spring.

    Returns:
        A Dataset over (racket, joint_reading, strung, support, plane); `difference` from the
        published frequencies is given for the free racket only.

    Raises:
        InputError: an axis is empty or a case is not valid.

    """
    import xarray

    axes: dict[str, Sequence[Any]] = {
        "racket": rackets,
        "joint_reading": joint_readings,
        "strung": strung,
        "support": supports,
    }
    for name, values in axes.items():
        if isinstance(values, str) or not values or len(set(values)) < len(values):
            raise InputError(name, values, "a list of at least one value, each once")
    table = np.empty((*(len(values) for values in axes.values()), 2, 2))
    for index in np.ndindex(*table.shape[:-2]):
        racket, reading, with_strings, support = (
            values[i] for values, i in zip(axes.values(), index, strict=True)
        )
        parameters = load_racket(racket, tension, joint_reading=reading)
        system = modal_system(
            parameters,
            strung=with_strings,
            support=support,
            grip=grip if support == "grip" else None,
        )
        modes = solve_modes(system)
        at = [modes.bending(plane) for plane in PLANES]
        table[index] = modes.frequencies[at], modes.damping_ratios[at]
    dims = (*axes, "plane")
    published = np.array([published_fundamentals(racket) for racket in rackets])
    dataset = xarray.Dataset(
        {
            "frequency": labelled(dims, table[..., 0, :], "Hz", "undamped frequency"),
            "damping_ratio": labelled(dims, table[..., 1, :], "1", "damping ratio"),
            "published_frequency": labelled(
                ("racket", "plane"), published, "Hz", "Glynn et al. 2011, Results"
            ),
        },
        coords={**{name: list(values) for name, values in axes.items()}, "plane": list(PLANES)},
        attrs={
            "title": "Fundamental bending modes",
            "tension": tension,
            "grip": modes_grip("grip", grip),
        },
    )
    difference = dataset["frequency"] / dataset["published_frequency"] - 1.0
    dataset["difference"] = difference.where(dataset["support"] == "free")
    dataset["difference"].attrs = {
        "units": "1",
        "long_name": "frequency of the free racket over the published one, less 1",
    }
    return dataset
