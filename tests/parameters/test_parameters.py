"""The parameter files against the published tables, written out here once more by hand."""

from __future__ import annotations

import dataclasses
import math
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from drake_racket.io.errors import InputError
from drake_racket.io.shipped import data_directory
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.grip import load_grip
from drake_racket.parameters.limb import load_upper_limb
from drake_racket.parameters.limb_settings import LimbSettings
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.parameters.quantities import (
    STATUSES,
    Assignment,
    Choice,
    Quantities,
    Quantity,
    sourced_fields,
)
from drake_racket.parameters.racket import check_racket, load_racket
from drake_racket.plant.properties import frame_fundamentals, racket_properties
from drake_racket.plant.string_bed import string_bed_model
from drake_racket.rigs.modes.bending import bending_mode
from tests.conftest import BED, SPRINGS
from tests.oracles.two_body import free_free_frequency

# Glynn, King & Mitchell (2011), Tables 1-4. Table 1 by part: mass, length, centre of mass from the
# end nearest the butt, moments of inertia: longitudinal (x), frontal (z), transverse (y).
TABLE_1 = {
    ("tour", "handle"): (0.13350, 0.35600, 0.11365, 0.00004, 0.00173, 0.00172),
    ("tour", "head"): (0.16050, 0.33000, 0.15032, 0.00137, 0.00465, 0.00331),
    ("recreational", "handle"): (0.10690, 0.35800, 0.19543, 0.00010, 0.00203, 0.00200),
    ("recreational", "head"): (0.13360, 0.33700, 0.18702, 0.00151, 0.00392, 0.00311),
}
TABLE_1_COLUMNS = (
    "mass",
    "length",
    "com",
    "moi_longitudinal",
    "moi_frontal",
    "moi_transverse",
)
# stiffness in, stiffness out (N m/rad), damping in, damping out (N m s/rad), labels as printed
TABLE_2 = {"tour": (910.0, 1650.0, 0.03, 0.09), "recreational": (1075.0, 1800.0, 0.04, 0.10)}
TABLE_3_K = {
    "tour": (1.77e5, 2.00e5, 5.97e5, 7.91e5),
    "recreational": (1.02e5, 1.03e5, 1.20e5, 1.13e5),
}
TABLE_3_P = {
    "tour": (0.53, 0.77, 1.00, 0.83, 0.74, 1.40),
    "recreational": (0.44, 0.38, 0.95, 0.32, 0.40, 1.58),
}
# stringing tension (N), T0 (N), and Table 4: mu1, mu2, mu3
BY_TENSION = {
    ("tour", "low"): (254.0, 648.2, (0.35, 0.36, 0.37)),
    ("tour", "high"): (311.0, 772.9, (0.35, 0.36, 0.38)),
    ("recreational", "low"): (254.0, 735.8, (0.26, 0.29, 0.32)),
    ("recreational", "high"): (334.0, 967.7, (0.26, 0.30, 0.35)),
}
# gsc from the throat joint, and the rim's semi-axes along x and y (m): readings, not printed
RIM = {"tour": (0.155, 0.164, 0.123), "recreational": (0.151, 0.175, 0.132)}

LINES = (
    "tip-1 1-4 4-7 throat-7",
    "tip-2 2-5 5-8 throat-8",
    "tip-3 3-6 6-9 throat-9",
    "left-1 1-2 2-3 right-3",
    "left-4 4-5 5-6 right-6",
    "left-7 7-8 8-9 right-9",
)
# The reading of the missing Fig. 2, line by line in the order above.
ASSIGNMENT = (
    "p2*k2 k2 k2 p5*k2",
    "p6*k4 k4 k4 p3*k4",
    "p2*k2 k2 k2 p5*k2",
    "p4*k1 k1 k1 p4*k1",
    "p1*k3 k3 k3 p1*k3",
    "p4*k1 k1 k1 p4*k1",
)
INFERRED_RACKET = {
    "throat_joint.reading",
    "landmarks.grip",
    "landmarks.accelerometer",
    "string_bed.gsc",
    "string_bed.rim_semi_axis_x",
    "string_bed.rim_semi_axis_y",
    "string_bed.damping",
    "string_bed.springs",
    "friction.points",
}
INFERRED_BALL = {
    "stiffness_low",
    "damping_low",
    "sliding_speed_scale",
    "sliding_distance_scale",
    "surface.inertia_factor",
    "surface.flattening",
}


def values(parameters: object) -> dict[str, Quantity | Quantities | Choice | Assignment]:
    return dict(sourced_fields(parameters))


def edited(tmp_path: Path, changes: dict[str, object], source: str = "tour_low") -> Path:
    """A copy of a shipped file as a user would make one, with dotted keys replaced."""
    path = tmp_path / "mine.yaml"
    shutil.copy(data_directory() / f"{source}.yaml", path)
    tree = yaml.safe_load(path.read_text(encoding="utf-8"))
    for key, value in changes.items():
        *parents, last = key.split(".")
        target = tree
        for parent in parents:
            target = target[parent]
        target[last] = value
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    return path


def mirrored(name: str, swap: dict[str, str]) -> str:
    """The spring at the mirrored place; the two ends of an interior spring may swap."""
    parts = [swap.get(part, part) for part in name.split("-")]
    forward, backward = "-".join(parts), "-".join(reversed(parts))
    return forward if forward in SPRINGS else backward


LEFT_RIGHT = {
    **dict(zip("134679", "316497", strict=True)),
    "left": "right",
    "right": "left",
}
TIP_THROAT = {
    **dict(zip("123789", "789123", strict=True)),
    "tip": "throat",
    "throat": "tip",
}


# --- published numbers ----------------------------------------------------------------------------


@pytest.mark.parametrize("part", ["handle", "head"])
def test_table_1(bed, part):
    racket, tension = bed
    parameters = load_racket(racket, tension)
    for column, value in zip(TABLE_1_COLUMNS, TABLE_1[racket, part], strict=True):
        quantity = getattr(getattr(parameters, part), column)
        assert (quantity.value, quantity.status) == (value, "printed"), column


def test_table_2(bed):
    racket, tension = bed
    joint = load_racket(racket, tension).throat_joint
    shown = (joint.stiffness_in, joint.stiffness_out, joint.damping_in, joint.damping_out)
    assert tuple(q.value for q in shown) == TABLE_2[racket]
    assert {q.status for q in shown} == {"printed"}
    assert joint.reading.value == "by_axis"


def test_tables_3_and_4(bed):
    racket, tension = bed
    parameters = load_racket(racket, tension)
    strings, friction = parameters.string_bed, parameters.friction
    strung_at, initial, mu = BY_TENSION[bed]
    assert strings.stringing_tension.value == strung_at
    assert strings.initial_tension.value == initial
    assert tuple(strings.stiffness.value) == TABLE_3_K[racket]
    assert tuple(strings.rim_factors.value) == TABLE_3_P[racket]
    assert tuple(friction.coefficients.value) == mu
    for quantity in (
        strings.stringing_tension,
        strings.initial_tension,
        strings.stiffness,
        strings.rim_factors,
        friction.coefficients,
    ):
        assert quantity.status == "printed"
    assert strings.mass.value == 0.0149
    assert strings.spacing.value == 0.0685


def test_readings_of_what_the_paper_does_not_print(bed):
    racket, tension = bed
    parameters = load_racket(racket, tension)
    strings = parameters.string_bed
    shown = (strings.gsc, strings.rim_semi_axis_x, strings.rim_semi_axis_y)
    assert tuple(q.value for q in shown) == RIM[racket]
    assert strings.damping.value == 0.0  # the printed equation has none
    assert parameters.landmarks.grip.value == pytest.approx(4 * 0.0254, abs=1e-15)
    assert parameters.landmarks.accelerometer.value == 0.1
    expected = {
        name: formula
        for line, formulas in zip(LINES, ASSIGNMENT, strict=True)
        for name, formula in zip(line.split(), formulas.split(), strict=True)
    }
    assert strings.springs.value == expected
    # mu1 at the centre, mu2 at the edges, mu3 at the corners
    mu1, mu2, mu3 = BY_TENSION[bed][2]
    assert parameters.friction_coefficients() == [mu3, mu2, mu3, mu2, mu1, mu2, mu3, mu2, mu3]


def test_ball():
    ball = load_ball()
    expected = {
        "mass": 0.059,
        "radius": 0.0685 / 2.0,
        "speed_low": 18.0,
        "speed_high": 33.0,
        "stiffness_low": 45e3,
        "damping_low": 14.0,
        "stiffness_growth": 0.52,
        "damping_growth": 0.97,
        "sliding_speed_scale": 0.02,
        "sliding_distance_scale": 1e-4,
        "surface.inertia_factor": 0.55,
        "surface.flattening": 0.5,
        "surface.tangential_stiffness": 34700.0,
        "surface.tangential_damping": 63.5,
        "hunt_crossley.stiffness": 18820.0,
        "hunt_crossley.stiffness_rise": 2.2256e6,
        "hunt_crossley.damping": 1.216,
        "hunt_crossley.damping_rise": 1697.1,
    }
    assert {key: value.value for key, value in values(ball).items()} == expected
    assert {k for k, v in values(ball).items() if v.status == "inferred"} == INFERRED_BALL


def test_every_value_has_unit_status_and_source(bed):
    parameters = load_racket(*bed)
    for where in (parameters, load_ball()):
        for key, value in values(where).items():
            assert value.status in STATUSES, key
            assert value.source.strip(), key
            if isinstance(value, (Quantity, Quantities)):
                assert value.unit, key
            if value.status == "printed":
                assert "Glynn" in value.source, key  # a printed value says where it is printed


def test_what_is_inferred_is_exactly_this(bed):
    found = {k for k, v in values(load_racket(*bed)).items() if v.status == "inferred"}
    assert found == INFERRED_RACKET


# --- names, tensions and readings -----------------------------------------------------------------


@pytest.mark.parametrize("racket", ["tour", "recreational"])
@pytest.mark.parametrize("newton", [150.0, 254.0, 270.5, 300.0, 450.0])
def test_tension_by_number_is_a_line_through_the_published_two(racket, newton):
    low, high = BY_TENSION[racket, "low"], BY_TENSION[racket, "high"]
    share = (newton - low[0]) / (high[0] - low[0])
    parameters = load_racket(racket, str(newton))
    strings = parameters.string_bed
    assert strings.stringing_tension.value == newton
    expected = low[1] + share * (high[1] - low[1])
    assert strings.initial_tension.value == pytest.approx(expected, rel=1e-14)
    assert strings.initial_tension.status == "inferred"  # nobody measured it
    mu = [a + share * (b - a) for a, b in zip(low[2], high[2], strict=True)]
    assert parameters.friction.coefficients.value == pytest.approx(mu, rel=1e-14)
    assert parameters.friction.coefficients.status == "inferred"
    assert parameters.string_bed.stiffness == load_racket(racket).string_bed.stiffness
    check_racket(parameters)  # its name, too: 270.5 has a point


@pytest.mark.parametrize("tension", ["low", "high"])
@pytest.mark.parametrize("racket", ["tour", "recreational"])
def test_a_published_tension_by_number_gives_the_published_bed(racket, tension):
    newton, initial, mu = BY_TENSION[racket, tension]
    parameters = load_racket(racket, f"{newton:g}")
    assert parameters.string_bed.initial_tension.value == pytest.approx(initial, rel=1e-14)
    assert parameters.friction.coefficients.value == pytest.approx(list(mu), rel=1e-14)


@pytest.mark.parametrize("racket", ["tour", "recreational"])
def test_both_tensions_share_one_frame(racket):
    low, high = load_racket(racket, "low"), load_racket(racket, "high")
    for part in ("handle", "head", "throat_joint", "landmarks"):
        assert getattr(low, part) == getattr(high, part)
    differing = {"stringing_tension", "initial_tension"}
    for item in dataclasses.fields(low.string_bed):
        a, b = (getattr(r.string_bed, item.name) for r in (low, high))
        if item.name not in ("columns", "rows"):
            a, b = a.value, b.value
        assert (a != b) == (item.name in differing), item.name


@pytest.mark.parametrize("racket", ["tour", "recreational"])
def test_joint_readings(racket):
    stiffness_in, stiffness_out, damping_in, damping_out = TABLE_2[racket]
    by_axis = load_racket(racket).throat_joint
    as_printed = load_racket(racket, joint_reading="as_printed").throat_joint
    assert by_axis.in_plane() == (stiffness_out, damping_out)
    assert by_axis.out_of_plane() == (stiffness_in, damping_in)
    assert as_printed.in_plane() == (stiffness_in, damping_in)
    assert as_printed.out_of_plane() == (stiffness_out, damping_out)
    # the printed numbers stay as printed under either reading
    assert as_printed.stiffness_in == by_axis.stiffness_in
    assert load_racket(racket, joint_reading="by_axis").throat_joint.in_plane() == (
        stiffness_out,
        damping_out,
    )


def test_a_caller_cannot_spoil_the_shipped_values():
    # files are cached, and their objects shared: they are frozen
    first = load_racket("tour")
    with pytest.raises(dataclasses.FrozenInstanceError):
        first.handle.mass.value = 99.0
    with pytest.raises(TypeError, match="frozen"):
        first.string_bed.springs.value.clear()
    assert isinstance(first.string_bed.stiffness.value, tuple)


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        (("wooden",), "racket"),
        (("",), "racket"),
        (("tour", "medium"), "tension"),
        (("tour", ""), "tension"),
        (("tour", "149.9"), "tension"),
        (("tour", "450.1"), "tension"),
        (("tour", "nan"), "tension"),
        (("tour", "-inf"), "tension"),
        (("no_such_file.yaml",), "file"),
    ],
)
def test_names_that_do_not_exist(arguments, key):
    with pytest.raises(InputError) as caught:
        load_racket(*arguments)
    assert caught.value.key == key


def test_other_names_that_do_not_exist(tmp_path):
    with pytest.raises(InputError, match=r"^joint_reading: got 'both'; allowed: by_axis"):
        load_racket(joint_reading="both")
    with pytest.raises(InputError, match=r"^ball: got 'wilson'; allowed: penn_titanium"):
        load_ball("wilson")
    path = edited(tmp_path, {})
    with pytest.raises(InputError, match=r"^tension: got 'high'; allowed: no tension beside"):
        load_racket(str(path), "high")


# --- geometry and topology ------------------------------------------------------------------------


def test_points_are_numbered_row_by_row_with_plus_y_on_the_left(bed):
    racket, _ = bed
    parameters = load_racket(*bed)
    gsc, s = RIM[racket][0], 0.0685
    throat = TABLE_1[racket, "handle"][1]
    rows, columns = (s, 0.0, -s), (s, 0.0, -s)
    for number in range(1, 10):
        row, column = divmod(number - 1, 3)
        x, y = gsc + rows[row], columns[column]
        assert parameters.point_in_head(number) == pytest.approx((x, y), abs=1e-15)
        assert parameters.point(number) == pytest.approx((throat + x, y, 0.0), abs=1e-15)
    assert parameters.point(5) == pytest.approx((throat + gsc, 0.0, 0.0), abs=1e-15)


def test_springs_are_24_in_six_lines():
    expected = [name for line in LINES for name in line.split()]
    assert list(BED.names) == expected
    for name, (i, j) in SPRINGS.items():
        first, second = name.split("-")
        if first in ("tip", "throat", "left", "right"):
            assert (i, j) == (int(second), 0)
        else:
            assert (i, j) == (int(first), int(second))
    assert sum(j != 0 for _, j in SPRINGS.values()) == 12


def test_each_point_has_exactly_four_springs():
    counts = dict.fromkeys(BED.points, 0)
    for i, j in SPRINGS.values():
        counts[i] += 1
        if j:
            counts[j] += 1
    assert set(counts.values()) == {4}
    assert np.array_equal(np.abs(BED.incidence).sum(axis=0), np.full(9, 4.0))


def test_interior_springs_join_neighbours(bed):
    parameters = load_racket(*bed)
    lengths = string_bed_model(parameters).lengths
    for row, (i, j) in enumerate(SPRINGS.values()):
        if j:
            distance = np.hypot(
                *np.subtract(parameters.point_in_head(i), parameters.point_in_head(j))
            )
            assert distance == pytest.approx(0.0685, abs=1e-15)
            assert lengths[row] == 0.0685


def test_rim_springs_end_on_the_ellipse(bed):
    racket, _ = bed
    parameters = load_racket(*bed)
    gsc, a, b = RIM[racket]
    outward = {"tip": (1.0, 0.0), "throat": (-1.0, 0.0), "left": (0.0, 1.0), "right": (0.0, -1.0)}
    lengths = string_bed_model(parameters).lengths
    for row, (name, (i, j)) in enumerate(SPRINGS.items()):
        if j:
            continue
        assert lengths[row] > 0.0
        direction = np.array(outward[name.split("-")[0]])
        x, y = np.array(parameters.point_in_head(i)) + lengths[row] * direction
        assert ((x - gsc) / a) ** 2 + (y / b) ** 2 == pytest.approx(1.0, abs=1e-12), name


@pytest.mark.parametrize("swap", [LEFT_RIGHT, TIP_THROAT], ids=["left-right", "tip-throat"])
def test_rest_lengths_are_symmetric(bed, swap):
    lengths = dict(zip(BED.names, string_bed_model(load_racket(*bed)).lengths, strict=True))
    for name, length in lengths.items():
        assert lengths[mirrored(name, swap)] == pytest.approx(length, rel=1e-14), name


def test_stiffness_is_symmetric_left_to_right(bed):
    model = string_bed_model(load_racket(*bed))
    factors = np.append(model.rim_factors, 1.0)  # index -1: none
    k = model.stiffness[model.stiffness_index] * factors[model.rim_factor_index]
    by_name = dict(zip(BED.names, k, strict=True))
    for name, stiffness in by_name.items():
        assert by_name[mirrored(name, LEFT_RIGHT)] == stiffness, name
    racket = bed[0]
    assert by_name["tip-2"] == TABLE_3_P[racket][5] * TABLE_3_K[racket][3]
    assert by_name["4-5"] == TABLE_3_K[racket][2]


# --- a user's own racket --------------------------------------------------------------------------


def test_own_racket_from_an_edited_copy(tmp_path):
    changes = {
        "name": "mine",
        "title": "My racket",
        "head.mass.value": 0.2,
        "head.mass.status": "measured",
        "head.mass.source": "kitchen scale",
    }
    racket = load_racket(str(edited(tmp_path, changes)))
    assert racket.name == "mine"
    assert racket.head.mass == Quantity(0.2, "kg", "measured", "kitchen scale")
    head = dataclasses.replace(racket.head, mass=load_racket("tour").head.mass)
    title = "Head LM Prestige (tour), strung at 254 N"
    racket = dataclasses.replace(racket, head=head, name="tour_low", title=title)
    assert racket == load_racket("tour")  # and nothing else has changed
    printed = load_racket(str(tmp_path / "mine.yaml"), joint_reading="as_printed")
    assert printed.throat_joint.in_plane() == (910.0, 0.03)


def test_own_ball_from_an_edited_copy(tmp_path):
    text = (data_directory() / "ball_penn_titanium.yaml").read_text(encoding="utf-8")
    path = tmp_path / "ball.yml"
    path.write_text(text.replace("value: 0.059", "value: 0.057"), encoding="utf-8")
    ball = load_ball(str(path))
    assert ball.mass.value == 0.057
    assert dataclasses.replace(ball, mass=load_ball().mass) == load_ball()


class DirectoryEntry(os.PathLike):
    """A path that is no pathlib.Path, as os.DirEntry is."""

    def __init__(self, path):
        self.path = path

    def __fspath__(self):
        return str(self.path)


@pytest.mark.parametrize("kind", [str, Path, DirectoryEntry])
@pytest.mark.parametrize(
    ("load", "name"),
    [
        (load_racket, "tour_low"),
        (load_ball, "ball_penn_titanium"),
        (load_grip, "grip_normal"),
        (load_upper_limb, "upper_limb"),
    ],
)
def test_a_file_is_given_by_any_kind_of_path(tmp_path, load, name, kind):
    path = tmp_path / "mine.yaml"
    shutil.copyfile(data_directory() / f"{name}.yaml", path)
    assert load(kind(path)) == load()  # the defaults are those files
    with pytest.raises(InputError, match=r"^file: got '.*none\.yml'; allowed: a readable YAML"):
        load(kind(tmp_path / "none.yml"))
    with pytest.raises(InputError, match=r"; allowed: .* or a path ending in \.yaml") as caught:
        load(kind(tmp_path / "none"))
    assert caught.value.value == str(tmp_path / "none")  # the message shortens what is long


@pytest.mark.parametrize("load", [load_racket, load_ball, load_grip, load_upper_limb])
@pytest.mark.parametrize("given", [5, None, b"mine.yaml", ["tour"]])
def test_what_is_no_path_is_refused(load, given):
    with pytest.raises(InputError) as caught:
        load(given)
    assert caught.value.value == given
    assert caught.value.allowed == "a name or a path"


def test_numbers_as_people_write_them(tmp_path):
    # YAML 1.1 reads 1e-3 as text, and 1 as an integer
    changes = {"head.mass.value": "16e-2", "string_bed.initial_tension.value": 650}
    racket = load_racket(str(edited(tmp_path, changes)))
    assert racket.head.mass.value == 0.16
    assert isinstance(racket.string_bed.initial_tension.value, float)


def test_a_bed_with_24_own_stiffnesses(tmp_path):
    names = [name for line in LINES for name in line.split()]
    stiffness = [1e5 + 1e3 * i for i in range(24)]
    changes = {
        "string_bed.stiffness.value": stiffness,
        "string_bed.rim_factors.value": [],
        "string_bed.springs.value": {name: f"k{i + 1}" for i, name in enumerate(names)},
    }
    racket = load_racket(str(edited(tmp_path, changes)))
    model = string_bed_model(racket)
    assert list(model.stiffness[model.stiffness_index]) == stiffness
    assert set(model.rim_factor_index) == {-1}
    assert len(model.rim_factors) == 0


# --- derived properties ---------------------------------------------------------------------------


def sums_by_hand(racket: str) -> dict[str, float]:
    """Mass properties of the strung racket from Table 1, by the parallel axis theorem."""
    m1, l1, c1, x1, z1, y1 = TABLE_1[racket, "handle"]
    m2, _, c2, x2, z2, y2 = TABLE_1[racket, "head"]
    strings, s = 0.0149, 0.0685
    centre = l1 + RIM[racket][0]
    mass = m1 + m2 + strings
    axis = 4 * 0.0254
    offset = (
        m1 * (c1 - axis) ** 2 + m2 * (l1 + c2 - axis) ** 2 + strings * (centre - axis) ** 2
    )  # of the parts' centres of mass, along x
    spread = 6.0 / 9.0 * strings * s**2  # six of the nine masses are one spacing off the centre
    return {
        "mass": mass,
        "balance": (m1 * c1 + m2 * (l1 + c2) + strings * centre) / mass,
        "swingweight": y1 + y2 + offset + spread,
        "twistweight": x1 + x2 + spread,
        "spinweight": z1 + z2 + offset + 2.0 * spread,
    }


@pytest.mark.parametrize("racket", ["tour", "recreational"])
def test_racket_properties_equal_sums_by_hand(racket):
    properties = racket_properties(load_racket(racket))
    for key, value in sums_by_hand(racket).items():
        assert getattr(properties, key) == pytest.approx(value, rel=1e-12), key


# In-plane bending turns about z (frontal moments), out-of-plane bending about y (transverse).
PUBLISHED = [
    ("tour", "by_axis", 154.62, 128.54),
    ("recreational", "by_axis", 181.27, 148.58),
    ("tour", "as_printed", 114.83, 173.09),
]


@pytest.mark.parametrize(("racket", "reading", "in_plane", "out_of_plane"), PUBLISHED)
def test_fundamentals_equal_the_closed_form(racket, reading, in_plane, out_of_plane):
    m1, l1, c1, _, z1, y1 = TABLE_1[racket, "handle"]
    m2, _, c2, _, z2, y2 = TABLE_1[racket, "head"]
    k_in, k_out, *_ = TABLE_2[racket]
    k_z, k_y = (k_in, k_out) if reading == "as_printed" else (k_out, k_in)
    expected = (
        free_free_frequency(m1, l1, c1, z1, m2, c2, z2, k_z),
        free_free_frequency(m1, l1, c1, y1, m2, c2, y2, k_y),
    )
    assert expected == pytest.approx((in_plane, out_of_plane), abs=0.006)
    parameters = load_racket(racket, joint_reading=reading)
    assert frame_fundamentals(parameters) == pytest.approx(expected, rel=1e-6)
    properties = racket_properties(parameters)
    found = (properties.in_plane_frequency, properties.out_of_plane_frequency)
    assert found == pytest.approx(expected, rel=1e-6)


def test_an_overdamped_joint_has_its_undamped_frequency_and_no_damped_one():
    tour = load_racket()
    damped = apply_overrides(tour, {"racket.throat_joint.in_plane_damping": 5.0})
    assert frame_fundamentals(damped) == pytest.approx(frame_fundamentals(tour), rel=1e-9)
    assert math.isnan(bending_mode(damped, "in_plane").damped_frequency)
    assert bending_mode(tour, "in_plane").damped_frequency > 100.0


def test_strings_in_the_fundamentals():
    # the masses turn with the head in the plane, and do not follow it across (they are free there)
    m1, l1, c1, _, z1, _ = TABLE_1["tour", "handle"]
    m2, _, c2, _, z2, _ = TABLE_1["tour", "head"]
    strings, gsc, s = 0.0149, RIM["tour"][0], 0.0685
    m = m2 + strings
    c = (m2 * c2 + strings * gsc) / m
    inertia = z2 + m2 * (c2 - c) ** 2
    inertia += strings * (gsc - c) ** 2 + 2.0 * 6.0 / 9.0 * strings * s**2
    in_plane = free_free_frequency(m1, l1, c1, z1, m, c, inertia, TABLE_2["tour"][1])
    parameters = load_racket("tour")
    bare, strung = frame_fundamentals(parameters), frame_fundamentals(parameters, strung=True)
    assert strung == pytest.approx((in_plane, bare[1]), rel=1e-6)
    assert strung[0] < bare[0]


def test_properties_come_from_the_model_given():
    parameters = load_racket("tour")
    mass = dataclasses.replace(parameters.handle.mass, value=parameters.handle.mass.value + 0.05)
    handle = dataclasses.replace(parameters.handle, mass=mass)
    heavier = dataclasses.replace(parameters, handle=handle)
    difference = racket_properties(heavier).mass - racket_properties(parameters).mass
    assert difference == pytest.approx(0.05, rel=1e-12)


def test_the_slow_ball_joins_the_other_at_its_lowest_speed():
    slow, fast = load_ball("penn_titanium_slow"), load_ball()
    assert slow.speed_high.value == fast.speed_low.value == 18.0
    for name in ("stiffness", "damping"):
        low, growth = (getattr(slow, f"{name}_{end}").value for end in ("low", "growth"))
        assert low * (1.0 + growth) == pytest.approx(getattr(fast, f"{name}_low").value, rel=1e-5)
    same = {"mass", "radius", "surface.inertia_factor", "surface.tangential_damping"}
    for key in same:
        assert values(slow)[key] == values(fast)[key]
    # kb goes on along the paper's line
    line = 45e3 * (1.0 - 0.52 * (18.0 - slow.speed_low.value) / 15.0)
    assert slow.stiffness_low.value == pytest.approx(line, rel=1e-4)


def test_any_activation_at_all_is_another_topology():
    assert LimbSettings(activation=1e-6).topology() != LimbSettings().topology()
    one, other = (LimbSettings(activation=x).topology() for x in (0.2, 0.9))
    assert one == other
