"""A racket of a shop's numbers: what goes in comes out, and what does not fit is refused."""

from __future__ import annotations

import dataclasses
import math

import pytest

import drake_racket as dr
from drake_racket.parameters.specs import recipe, regressions
from drake_racket.parameters.specs.build import with_specs
from drake_racket.parameters.specs.given import PRINTED, _checked
from tests.oracles import two_body

SHOP = {
    "mass": "320g",
    "balance": "33cm",
    "swingweight": "320",
    "twistweight": "14.2",
    "head": "98in2",
    "ra": "65",
}

# Tennis Warehouse University's racket table: row, f1 (Hz), apparent restitution
PUBLISHED = {
    "lm_8": (
        {
            "mass": "280g",
            "balance": "36.2cm",
            "swingweight": "322",
            "twistweight": "14.7",
            "head": "112in2",
            "length": "27.25in",
            "ra": "63",
        },
        143.0,
        0.41,
    ),
    "prestige_mid": (
        {
            "mass": "336g",
            "balance": "32.7cm",
            "swingweight": "344",
            "twistweight": "11.9",
            "head": "93in2",
            "length": "27in",
            "ra": "57",
        },
        129.0,
        0.42,
    ),
}

# mass (kg), balance (m), swingweight, twistweight (kg m^2), RA: corners of the population's 5-95 %
# that go together (a light racket is balanced towards its head)
CORNERS = [
    (0.343, 0.318, 0.0337, 1.17e-3, 58.0),
    (0.343, 0.318, 0.0296, 1.63e-3, 72.0),
    (0.272, 0.365, 0.0337, 1.63e-3, 58.0),
    (0.272, 0.365, 0.0296, 1.17e-3, 72.0),
    (0.272, 0.318, 0.0296, 1.63e-3, 58.0),
]


@pytest.mark.parametrize("name", PUBLISHED)
def test_the_published_rackets_from_their_shop_rows(name):
    row, frequency, restitution = PUBLISHED[name]
    racket = dr.racket_from_specs(name, **row)
    has = dr.racket_properties(racket)
    assert has.out_of_plane_frequency == pytest.approx(frequency, rel=0.03)
    # the printed value is that of 0.517 m from the butt, wherever the centre is
    aim = 0.517 - racket.centre()[0]
    case = dr.resolve(dr.Scenario(speed=25.0, after=0.008, audit=False, offset_x=aim))
    found = dr.simulate(dataclasses.replace(case, racket=racket), history=False)
    assert found.apparent_restitution == pytest.approx(restitution, abs=0.02)


@pytest.mark.parametrize("corner", CORNERS)
def test_the_populations_corners_come_back(corner):
    mass, balance, swingweight, twistweight, ra = corner
    racket = dr.racket_from_specs(
        "corner",
        mass=mass,
        balance=balance,
        swingweight=swingweight,
        twistweight=twistweight,
        head=100.0 * regressions.SQUARE_INCH,
        ra=ra,
    )
    has = dr.racket_properties(racket)
    assert has.mass == pytest.approx(mass, abs=1e-9)
    assert has.balance == pytest.approx(balance, abs=1e-9)
    assert has.swingweight == pytest.approx(swingweight, abs=1e-10)
    assert has.twistweight == pytest.approx(twistweight, abs=1e-11)
    assert has.out_of_plane_frequency == pytest.approx(1.702 * ra * mass**-0.24, rel=1e-9)
    assert has.in_plane_frequency == pytest.approx(1.19 * has.out_of_plane_frequency, rel=1e-9)


@pytest.mark.parametrize(("racket", "error"), [("tour", -0.001), ("recreational", 0.028)])
def test_the_recipe_on_the_papers_own_totals(racket, error):
    """With Table 2's stiffness, the split's frequency is off by what the split is off."""
    paper = dr.load_racket(racket)
    has = dr.racket_properties(paper)
    bed, joint = paper.string_bed, paper.handle.length.value
    length = joint + paper.head.length.value
    strings = recipe.Strings(
        bed.mass.value,
        bed.spacing.value * paper.bed_topology().places + [joint + bed.gsc.value, 0.0],
    )
    whole = recipe.Whole(
        has.mass, has.balance, has.swingweight, has.twistweight, length, 100.0, 119.0
    )
    found = recipe.split(whole, strings, bed.rim_semi_axis_y.value)
    stiffness = paper.throat_joint.out_of_plane()[0]
    frequency = math.sqrt(stiffness / found.out_of_plane) * 100.0
    assert frequency / has.out_of_plane_frequency - 1.0 == pytest.approx(error, abs=6e-4)


def test_bending_inertia_is_that_of_two_bodies_on_a_hinge():
    racket = dr.racket_from_specs("mine", **SHOP)
    handle, head = racket.handle, racket.head
    frequency = two_body.free_free_frequency(
        handle.mass.value,
        handle.length.value,
        handle.com.value,
        handle.moi_transverse.value,
        head.mass.value,
        head.com.value,
        head.moi_transverse.value,
        racket.throat_joint.out_of_plane()[0],
    )
    assert frequency == pytest.approx(racket.specs["frequency"].value, rel=1e-9)


@pytest.mark.parametrize(("ra", "stiffness"), [(57.0, 911.0), (63.0, 1104.0)])
def test_stiffness_of_the_flex(ra, stiffness):
    """Table 2 prints 910 and 1075 N m/rad for rackets of RA 57 and 63."""
    found = regressions.stiffness_of_ra(ra)
    # the exponent is printed with three digits
    assert found.value == pytest.approx(stiffness, rel=0.02)
    assert found.sd == pytest.approx(0.073 * found.value)


def test_a_guessed_twistweight_says_so():
    racket = dr.racket_from_specs("mine", **{**SHOP, "twistweight": None})
    spec = racket.specs["twistweight"]
    assert spec.status == "inferred"
    assert spec.value == pytest.approx(1e-4 * (0.18 * 98 + 0.0046 * 320 + 0.034 * 320 - 16.3))
    assert spec.sd == pytest.approx(1.07e-4)
    assert "1,337 rackets" in spec.source
    assert dr.racket_properties(racket).twistweight == pytest.approx(spec.value, abs=1e-10)


def test_every_number_says_where_it_is_from():
    racket = dr.racket_from_specs("mine", **SHOP)
    assert racket.specs["mass"].status == "measured"
    assert racket.specs["frequency"].status == "inferred"
    assert "sd 3.4 %" in racket.specs["frequency"].source
    assert "sd 6.8 %" in racket.throat_joint.stiffness_in.source
    # 2 (3.4^2 + 2^2)^(1/2), the guess of the ratio with it
    assert "sd 7.9 %" in racket.throat_joint.stiffness_out.source
    assert racket.specs["in_over_out"].sd == pytest.approx(0.02 * racket.specs["in_over_out"].value)
    measured = dr.racket_from_specs("mine", **SHOP, frequency="148")
    assert measured.throat_joint.stiffness_in.status == "calculated"
    assert "safe" in racket.notes[0]
    assert "not" in racket.notes[1]
    assert "kf = 0.378 RA^1.93, gives 1192 N m/rad (sd 7.3 %)" in racket.notes[-1]


REFUSED = {
    "too heavy a swing": ({"mass": "200g", "swingweight": "400"}, "200 g balanced at 33 cm has"),
    "soft as no racket": ({"ra": "10"}, "ra: got '10'; allowed: 35 to 90"),
    "balanced in the air": ({"balance": "80cm"}, "less than the racket's length, 68.58 cm"),
    "flex and frequency": ({"frequency": "200"}, "RA 65 at 320 g is 145 Hz"),
    "twist of a plank": ({"twistweight": "29"}, "which fits a head of 130 g"),
    "no unit": ({"mass": "320"}, "a number with its unit (g, kg, oz, lb)"),
    "pattern": ({"pattern": "dense"}, "mains x crosses, as in 16x19"),
    "tension": ({"tension": "24mm"}, "a number with its unit (N, kg, lb)"),
    "nothing": ({"head": None}, "head: got 'nothing'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_does_not_fit_together_is_said_in_one_line(case):
    changes, text = REFUSED[case]
    with pytest.raises(dr.InputError) as caught:
        dr.racket_from_specs("mine", **{**SHOP, **changes})
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


BORDERS = {
    "mass": (0.15, 0.5), "balance": (0.2, 1.5), "swingweight": (0.01, 0.06),
    "twistweight": (5e-4, 3e-3), "head": (0.045, 0.09), "length": (0.45, 0.75),
    "ra": (35.0, 90.0), "frequency": (80.0, 250.0),
}  # fmt: skip


@pytest.mark.parametrize("key", PRINTED)
def test_a_shops_numbers_are_taken_up_to_their_borders(key):
    printed, (low, high) = PRINTED[key], BORDERS[key]
    for value in (low, high):
        assert _checked(key, value, printed) == value
    for value in (0.999 * low, 1.001 * high):
        with pytest.raises(dr.InputError, match=key):
            _checked(key, value, printed)


def test_tension_and_pattern_are_used():
    racket = dr.racket_from_specs("mine", **SHOP, tension="24kg", pattern="18x20")
    assert racket.string_bed.stringing_tension.value == pytest.approx(24 * 9.80665)
    low, high = (dr.load_racket("tour", t).string_bed for t in ("low", "high"))
    share = (24 * 9.80665 - 254) / (311 - 254)
    line = low.initial_tension.value + share * (
        high.initial_tension.value - low.initial_tension.value
    )
    assert racket.string_bed.initial_tension.value == pytest.approx(line)
    strings = racket.string_bed.mass.value / 0.0155
    assert strings == pytest.approx((18 + 20 * 0.75) / (16 + 19 * 0.75))
    assert dr.racket_properties(racket).mass == pytest.approx(0.320)


def test_specs_can_be_solved_anew():
    racket = dr.racket_from_specs("mine", **SHOP)
    same = with_specs(racket, {})
    assert (same.handle, same.head) == (racket.handle, racket.head)
    assert same.throat_joint.out_of_plane() == pytest.approx(racket.throat_joint.out_of_plane())
    heavier = with_specs(racket, {"swingweight": 0.0330})
    assert dr.racket_properties(heavier).swingweight == pytest.approx(0.0330)
    assert dr.racket_properties(heavier).mass == pytest.approx(0.320)


def test_the_file_holds_the_racket(tmp_path):
    racket = dr.racket_from_specs("mine", **SHOP)
    dr.write_racket(racket, tmp_path / "mine.yaml")
    assert dr.load_racket(tmp_path / "mine.yaml") == racket
    assert "com_y" not in (tmp_path / "mine.yaml").read_text()


def test_a_table_of_rackets(tmp_path):
    path = tmp_path / "shop.csv"
    path.write_text(
        "Racquet,Strung Weight (oz),Balance (cm),Swingweight,Stiffness,Head Size (in2),Pattern\n"
        "Pure One 100,11.3,33,320,69,100,16x19\n"
        "No 2,310g,12.5 in,312,57,98,18x20\n"
    )
    one, two = dr.rackets_from_table(path)
    assert (one.name, two.name) == ("pure_one_100", "no_2")
    assert one.title == "Pure One 100"
    assert dr.racket_properties(one).mass == pytest.approx(11.3 * 0.45359237 / 16)
    assert dr.racket_properties(two).mass == pytest.approx(0.310)
    assert dr.racket_properties(two).balance == pytest.approx(12.5 * 0.0254)
    assert two.specs["ra"].value == 57.0


TABLES = {
    "no mass": ("name,balance (cm)\nx,33\n", "a column mass (or --column mass=...)"),
    "wrong unit": (
        "name,mass (mm),balance (cm),swingweight,head (in2)\nx,1,33,320,98\n",
        "a multiple of kg",
    ),
    "bad row": (
        "name,mass (g),balance (cm),swingweight,head (in2)\nx,320,33,320,98\ny,200,33,400,98\n",
        "row 3, mass, balance, swingweight",
    ),
    "twice": (
        "name,mass (g),balance (cm),swingweight,head (in2)\nX 1,320,33,320,98\nx-1,321,33,320,98\n",
        "another name than that of row 2",
    ),
    "no unit": (
        "name,mass,balance (cm),swingweight,head (in2)\nx,320,33,320,98\n",
        "row 2, mass",
    ),
}


@pytest.mark.parametrize("case", TABLES)
def test_tables_that_are_refused(case, tmp_path):
    text, message = TABLES[case]
    (tmp_path / "shop.csv").write_text(text)
    with pytest.raises(dr.InputError) as caught:
        dr.rackets_from_table(tmp_path / "shop.csv")
    assert message in str(caught.value)
