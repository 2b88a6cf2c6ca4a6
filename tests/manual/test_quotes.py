"""Sentences and tables of the studies' pages have the numbers of the files in docs/results.

`python -m manual.refresh NAME` writes the files. A test that fails shows the sentence that the page
should have.
"""

from __future__ import annotations

import csv
import functools
import re

import pytest

from manual.refresh import COMMANDS, RESULTS
from tests.conftest import ROOT


@functools.cache
def page_text(name: str) -> str:
    """A page on one line, without emphasis."""
    text = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    return " ".join(text.replace("**", "").split())


def says(page: str, *sentences: str) -> None:
    """Checks that the page has these sentences, or lines of tables."""
    missing = [s for s in sentences if " ".join(s.split()) not in page_text(page)]
    assert not missing, "\n".join([f"docs/{page}.md should say:", *missing])


@functools.cache
def printed(name: str) -> str:
    """What a command printed."""
    return (RESULTS / f"{name}.txt").read_text(encoding="utf-8")


def found(name: str, pattern: str) -> tuple[float, ...]:
    """The numbers of the groups of a pattern in what a command printed."""
    match = re.search(pattern, printed(name))
    assert match is not None, f"docs/results/{name}.txt: {pattern}"
    return tuple(map(float, match.groups()))


@functools.cache
def rows(table: str) -> list[dict[str, str]]:
    """The rows of a table (CSV), by the names of its columns without units."""
    with (RESULTS / f"{table}.csv").open(encoding="utf-8", newline="") as file:
        return [
            {column.split(" [")[0]: cell for column, cell in row.items()}
            for row in csv.DictReader(file)
        ]


def row(table: str, **wanted: object) -> dict[str, float]:
    """The numbers of the one row that has these cells."""
    (one,) = [
        r for r in rows(table) if all(r[k.replace("_", " ")] == str(v) for k, v in wanted.items())
    ]
    return {column: _number(cell) for column, cell in one.items()}


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return float("nan")


def short(value: float, digits: int = 3) -> str:
    """As the pages write shares: .409."""
    return f"{value:.{digits}f}".replace("0.", ".", 1)


def test_each_result_has_its_command_and_is_quoted():
    names = {path.name.split(".")[0] for path in RESULTS.iterdir()}
    assert names <= set(COMMANDS)
    for name in names:
        assert printed(name).startswith(f"$ python {COMMANDS[name]}\n")


TEN = "where_to_put_ten_grams"
PLACES = {row["place"]: row for row in rows("ten_grams")}


def ten(place: str, column: str) -> float:
    return float(PLACES[place][column])


@pytest.mark.parametrize("place", PLACES)
def test_ten_grams(place):
    at = functools.partial(ten, place)
    restitution = " / ".join(short(at(f"restitution {a}")) for a in ("centre", "tip", "side"))
    speeds = " / ".join(f"{at(f'same {p}, centre'):.2f}" for p in ("rate", "effort"))
    says(
        TEN,
        f"| {place} | {1e4 * at('swingweight'):.1f} | {1e4 * at('twistweight'):.2f} |"
        f" {restitution} | {speeds} | {at('peak force on hand'):.1f} |",
    )


def test_what_ten_grams_do():
    def gain(place: str, column: str) -> float:
        return ten(place, column) - ten("nowhere", column)

    side, tip, throat = "3 and 9 o'clock", "12 o'clock", "throat, 30 cm"
    force = {p: ten(p, "peak force on hand") / ten("nowhere", "peak force on hand") for p in PLACES}
    says(
        TEN,
        f"at the side from {ten('nowhere', 'restitution side'):.3f} to"
        f" {ten(side, 'restitution side'):.3f}.",
        f"grows by {gain(side, 'same rate, centre'):.2f} m/s if you swing as fast as before, and by"
        f" {gain(side, 'same effort, centre'):.2f} m/s if",
        f"They cost {1e4 * gain(side, 'swingweight'):.0f} kg cm² of swingweight.",
        f"{gain(tip, 'same rate, centre'):.2f} m/s at the centre, and"
        f" {gain(tip, 'same rate, 60 mm to tip'):.2f} m/s 60 mm towards the tip.",
        f"the hand takes {100 * (force[tip] - 1):.0f} % more force",
        f"they take {100 * (1 - force[throat]):.0f} % of the hand's force away",
    )


def swing(racket: str, player: str, rate: int, column: str = "centre") -> float:
    name = racket.split(" (")[0]
    (one,) = [
        r
        for r in rows("my_swing")
        if r["racket"] == name and r["player"] == player and float(r["rate"]) == rate
    ]
    return float(one[column])


def test_my_swing():
    page, names = (
        "which_racket_for_my_swing",
        list(dict.fromkeys(r["racket"] for r in rows("my_swing"))),
    )
    for name in names:
        weight = 1e4 * swing(name, "same rate", 22, "swingweight")
        cells = [
            " / ".join(f"{swing(name, player, rate):.2f}" for rate in (15, 22, 30))
            for player in ("same rate", "same effort")
        ]
        says(page, f"| {name} (SW {weight:.0f}) | {cells[0]} | {cells[1]} |")
    same = [swing(name, "same rate", 22) for name in names]
    effort = [swing(name, "same effort", 22) for name in names]
    says(
        page,
        f"returns the ball at {min(same):.1f} m/s and the fastest (Prestige Mid, 336 g) at"
        f" {max(same):.1f} m/s.",
        f"shrinks to {max(effort) - min(effort):.1f} m/s ({min(effort):.1f} to"
        f" {max(effort):.1f} m/s)",
    )
    long = [
        swing("Head Liquid Metal 8", p, r, "60 mm to tip") - swing("usual", p, r, "60 mm to tip")
        for p in ("same rate", "same effort")
        for r in (15, 22, 30)
    ]
    says(page, f"gains {min(long):.1f} to {max(long):.1f} m/s on the usual one")


def change(what: str, point: int, column: str) -> float:
    now = {(r["change"], r["point"]): float(r[column]) for r in rows("strings_or_frame.changes")}
    return 100.0 * (now[what, str(point)] / now["as it is", str(point)] - 1.0)


def test_strings_or_frame():
    page = "strings_or_frame_and_the_arm"
    for what in dict.fromkeys(r["change"] for r in rows("strings_or_frame.changes")):
        if what != "as it is":
            cells = [
                f"{change(what, 5, column):+.1f} / {change(what, 2, column):+.1f}"
                for column in (
                    "restitution", "peak_hand_force", "peak_hand_torque", "handle_ringing",
                )
            ]  # fmt: skip
            says(page, f"| {what} | {' | '.join(cells)} |")
    tight, loose, tip = "grip: tight", "grip: loose", "frame: 10 g at 12 o'clock"
    says(
        page,
        f"changes the peak force on the hand by"
        f" {abs(change('strings: tension -20 %', 5, 'peak_hand_force')):.0f} %",
        f"adds {change(tight, 5, 'peak_hand_force'):.0f} % of force and nearly triples the torque",
        f"takes {-change(loose, 5, 'peak_hand_force'):.0f} % of the force and"
        f" {-change(loose, 5, 'peak_hand_torque'):.0f} % of the torque away",
        f"add {change(tip, 5, 'peak_hand_force'):.0f} % of force for a ball at the centre",
    )


def tension(racket: str, support: str, point: int) -> tuple[float, ...]:
    number = r"([\d.]+)"
    pairs = [f"{number} to {number}{unit}" for unit in ("", " m/s", " ms", " N", " mm")]
    return found("tension_and_power", rf"{racket} +{support} +point {point} +" + r" +".join(pairs))


def test_tension_and_power():
    page = "sample_studies"
    tour, other = tension("tour", "free", 5), tension("recreational", "free", 5)
    places = [tension("recreational", "free", p) for p in (2, 4, 8)]
    gains = sorted(p[2] - p[3] for p in places)
    clamped = sorted(
        t[2] - t[3] for t in (tension("recreational", "clamped_head", p) for p in (2, 4, 5, 8))
    )
    tip, side, throat = (tension("tour", "free", p) for p in (2, 4, 8))
    says(
        page,
        f"| at the centre | {tour[2] - tour[3]:+.2f} m/s ({tour[3]:.2f} to {tour[2]:.2f}) |"
        f" {other[2] - other[3]:+.2f} m/s ({other[3]:.2f} to {other[2]:.2f}) |",
        f"| towards the tip | {tip[2] - tip[3]:+.2f} m/s | +{gains[0]:.1f} to {gains[-1]:.1f} m/s",
        f"| at the side | {side[2] - side[3]:+.2f} m/s |",
        f"| towards the throat | {throat[2] - throat[3]:+.2f} m/s |",
        f"gains {clamped[0]:.1f} to {clamped[-1]:.1f} m/s",
        f"{other[5]:.2f} to {other[4]:.2f} ms",
        f"({other[9]:.1f} to {other[8]:.1f} mm)",
    )


def frame(support: str, point: int, stiffness: str, damping: int) -> tuple[float, ...]:
    """Fundamental (Hz), rebound (m/s), handle's acceleration (m/s^2)."""
    return found(
        "frame_stiffness",
        rf"{support} +{point} +{stiffness} x +{damping} x +([\d.]+) Hz +([\d.]+) m/s +(\d+) m/s",
    )


def test_frame_stiffness():
    soft, stiff = ([frame("free", p, s, 1) for p in (5, 2, 8)] for s in ("0.50", "2.00"))
    centre, tip, throat = (high[1] - low[1] for low, high in zip(soft, stiff, strict=True))
    says(
        "sample_studies",
        f"moves the fundamental from {soft[0][0]:.0f} to {stiff[0][0]:.0f} Hz",
        f"changes by {centre:.2f} m/s at the centre",
        f"by {tip:.2f} m/s towards the tip, and by {throat:.2f} m/s towards the throat"
        f" ({soft[2][1]:.2f} to {stiff[2][1]:.2f} m/s)",
        f"towards the throat: {frame('grip', 8, '1.00', 1)[2]:.0f} m/s² (RMS), against"
        f" {frame('grip', 5, '1.00', 1)[2]:.0f} m/s² at the centre",
        f"raises it to {frame('grip', 8, '2.00', 1)[2]:.0f} m/s² there, and ten times the damping"
        f" brings it down to {frame('grip', 8, '1.00', 10)[2]:.0f} m/s²",
    )


def stroke(head: str, spin: int, mu: str) -> tuple[float, float]:
    """Angle (degrees) and spin (rpm) after."""
    block = printed("spin_and_angle").split(f"{head}: ")[1]
    match = re.search(rf"\n +{spin} rpm before;.*?mu {mu}: +([-\d.]+) deg, +(-?\d+) rpm", block)
    assert match is not None
    return float(match[1]), float(match[2])


@pytest.mark.parametrize(
    ("head", "name", "mu"),
    [
        ("topspin drive, free", "topspin drive, 31 m/s, 17°, mu .3", "0.3"),
        ("topspin drive, free", "the same, mu .6", "0.6"),
        ("slice, free", "slice, 25 m/s, 16°, mu .3", "0.3"),
        ("slice, free", "the same, mu .6", "0.6"),
    ],
)
def test_spin_and_angle(head, name, mu):
    cells = [stroke(head, spin, mu) for spin in (-3000, 0, 3000)]
    said = " | ".join(f"{angle:.1f}°, {spin:,.0f} rpm" for angle, spin in cells)
    says("spin_and_angle", f"| {name} | {said} |")


def test_what_friction_does_to_a_stroke():
    changes = [
        [b - a for a, b in zip(stroke(h, 0, "0.3"), stroke(h, 0, "0.6"), strict=True)]
        for h in ("topspin drive, free", "slice, free")
    ]
    angles = sorted(a for a, _ in changes)
    assert max(abs(s) for _, s in changes) < 10
    says(
        "spin_and_angle",
        f"from .3 to .6 moves the rebound angle by {angles[0]:.1f}-{angles[1]:.1f}°",
    )
    low, high = (stroke("topspin drive, free", s, "0.3") for s in (-3000, 3000))
    says(
        "spin_and_angle",
        f"from {low[0]:.0f} to {high[0]:.0f}°, and the spin after from"
        f" {round(low[1], -2):,.0f} to {round(high[1], -2):,.0f} rpm",
    )


@pytest.mark.parametrize("n", [3, 5, 7])
def test_finer_beds(n):
    tau, sigma, *pairs = found(
        "finer_beds",
        rf"{n} x {n}: tau ([\d.]+), sigma ([\d.]+); restitution ([\d.]+) to ([\d.]+),"
        r" contact ([\d.]+) to ([\d.]+) ms, deflection ([\d.]+) to ([\d.]+) mm",
    )
    name = f"{n} x {n}" + (" (the paper's)" if n == 3 else "")
    factors = "1 | 1" if n == 3 else f"{tau:.3f} | {sigma:.3f}"
    low, high = short(pairs[0]), short(pairs[1])
    says(
        "finer_beds",
        f"| {name} | {factors} | {low}-{high} | {pairs[2]:.2f}-{pairs[3]:.2f} ms |"
        f" {pairs[4]:.1f}-{pairs[5]:.1f} mm |",
    )


def test_spin_by_string():
    lines = re.findall(
        r"^(\w+) +([\d.]+) +([\d.]+) +([\d.]+) +(\d+) +([\d.]+) %", printed("spin_by_string"), re.M
    )
    assert len(lines) == 8
    for material, kt, ct, chi, spin, loss in lines[1:4] + lines[5:]:
        says(
            "spin",
            f"{material} | {kt} kN/m | {ct} N s/m | {short(float(chi), 2)} | {int(spin):,} rpm |"
            f" {float(loss):.0f} % |",
        )
    shipped = [lines[0], lines[4]]
    says("spin", *(f"{int(spin):,} rpm | {float(loss):.0f} % |" for *_, spin, loss in shipped))


def test_slow_balls():
    kb, hb, cb, db = found(
        "slow_balls", r"stiffness (\S+), stiffness_rise (\S+), damping (\S+), damping_rise (\S+)\n"
    )
    says(
        "spin",
        f"| kb | {kb / 1e3:.1f} kN/m |",
        f"| hb | {hb / 1e6:.2f} MN/m² |",
        f"| cb | {cb:.1f} N s/m |",
        f"| db | {db:,.0f} N s/m² |",
    )
    floor, bed = printed("slow_balls").split("floor ")[1].split("\nbed ")

    def at(part: str, ball: str, speed: float) -> float:
        lists = {
            (name or "speed").strip(): [float(v) for v in values.split(", ")]
            for name, values in re.findall(r"([a-z_]*) *\[(.*?)\]", part)
        }
        return lists[ball][lists["speed"].index(speed)]

    law, slow = "hunt_crossley", "penn_titanium_slow"
    says(
        "spin",
        f"{short(at(floor, slow, 7.058))} at 7.1, {short(at(floor, slow, 10.0))} at 10,"
        f" {short(at(floor, slow, 14.0))} at 14, {short(at(floor, slow, 18.0))} at 18 m/s",
        f"On a clamped bed the law gives {short(at(bed, law, 7.058))} after the ITF's drop",
        f"(the linear ball: {short(at(bed, 'linear', 7.058))}, the slow one"
        f" {short(at(bed, slow, 7.058))})",
        f"{short(at(bed, law, 4.43))} with this law, {short(at(bed, slow, 4.43))} with the slow",
        f"{short(at(floor, law, 7.058))}), |",
    )


COUNTS = (2, 3, 4, 6, 8, 12)
FAMILIES = {"A": "0", "B": "1"}


def segments(support: str, family: str, column: str) -> list[float]:
    """Over COUNTS, at the centre."""
    kept = {
        r["segments"]: float(r[column])
        for r in rows("how_many_segments.segments")
        if (r["support"], r["density"], r["point"]) == (support, FAMILIES[family], "centre")
    }
    return [kept[str(n)] for n in COUNTS]


def clamp_effect(family: str) -> list[float]:
    free, clamped = (segments(s, family, "restitution") for s in ("free", "clamped"))
    return [100.0 * (c / f - 1.0) for f, c in zip(free, clamped, strict=True)]


@pytest.mark.parametrize(
    ("name", "values", "form"),
    [
        ("free racket, apparent restitution, A", segments("free", "A", "restitution"), ".3f"),
        ("the same, B", segments("free", "B", "restitution"), ".3f"),
        ("handle clamped returns the ball faster by (%), A", clamp_effect("A"), ".1f"),
        ("the same, B", clamp_effect("B"), ".1f"),
        ("peak force on the hand (N), A", segments("hand", "A", "hand_force_z"), ".0f"),
        ("the same, B", segments("hand", "B", "hand_force_z"), ".0f"),
        ("peak torque on the hand (N m), A", segments("hand", "A", "hand_torque_y"), ".1f"),
        ("peak force on the limb's hand (N), A", segments("limb", "A", "hand_force_z"), ".0f"),
        (
            "peak force in the limb's wrist (N), A",
            segments("limb", "A", "wrist_deviation force"),
            ".0f",
        ),
        (
            "handle's acceleration, to 250 Hz (m/s² rms, in the hand), A",
            segments("hand", "A", "handle 0-250 Hz"),
            ".0f",
        ),
        ("the same, 250 to 1000 Hz, A", segments("hand", "A", "handle 250-1000 Hz"), ".0f"),
    ],
)
def test_how_many_segments(name, values, form):
    cells = " | ".join(f"{value:{form}}" for value in values)
    says(
        "how_many_segments", f"| {name} | {cells.replace('0.', '.') if form == '.3f' else cells} |"
    )


BEDS = {
    "tour low": "Tour, low tension",
    "tour high": "Tour, high tension",
    "recreational low": "Recreational, low tension",
    "recreational high": "Recreational, high tension",
}
CASES = {
    "restitution (published)": "restitution",
    "+ contact time": "+ contact time",
    "+ peak deflection": "+ peak deflection",
    "+ static stiffness": "+ static stiffness",
    "+ these three": "+ these three",
    "+ static shape": "+ static shape",
    "static stiffness alone": "static stiffness alone",
    "static shape alone": "static shape alone",
    "restitution, ball fitted": "restitution, kb and cb fitted",
    "+ contact time, ball fitted": "+ contact time, kb and cb fitted",
    "+ static shape, ball fitted": "+ static shape, kb and cb fitted",
}


@pytest.mark.parametrize("bed", BEDS)
def test_errors_of_every_parameter(bed):
    block = printed("identifiability").split(f"measurements, {bed}: ")[1].split("\n\n")[0]
    part = page_text("identifiability").split(BEDS[bed])[1].split("each alone")[0]
    for case, name in CASES.items():
        (line,) = [
            x
            for x in block.splitlines()
            if (x.startswith(f"{case} ") and x[len(case) + 1] == " ") or x.startswith(f"{case}  ")
        ][:1]
        cells = line[len(case) :].split()
        shown = [*cells[:11], *cells[-2:]]
        assert f"| {name} | {' | '.join(shown)} |" in part, f"{bed}: {name}: {shown}"


def test_how_many_are_determined():
    counts = {
        (bed, case): "{:.0f} / {:.0f}".format(
            *found(
                "identifiability",
                rf"measurements, {bed}: (?:.*\n)*?{re.escape(case)}  .* (\d+) +(\d+)\n",
            )
        )
        for bed in BEDS
        for case in CASES
    }
    for case, name in {
        "restitution (published)": "restitution",
        "+ contact time": "+ contact time",
        "+ these three": "+ contact time, peak deflection and static stiffness",
        "+ static shape": "+ static shape",
        "static shape alone": "static shape alone",
        "restitution, ball fitted": "restitution, with kb and cb fitted, too",
    }.items():
        says("identifiability", f"| {name} | {' | '.join(counts[bed, case] for bed in BEDS)} |")


PLACES_OF_STROKES = ("centre", "tip", "throat", "one side", "other side")


@pytest.mark.parametrize("name", ["as shipped", "for the centre", "for all five places"])
def test_best_stroke(name):
    balls = [
        found("best_stroke", rf"\n{name}; {place}; ball ([\d.]+) m/s")[0]
        for place in PLACES_OF_STROKES
    ]
    shown = " / ".join(f"{ball:.1f}" for ball in balls[:4]) + f", {balls[4]:.1f} |"
    if name == "as shipped":
        says("best_racket_and_stroke", shown)
        return
    speed, up, aside, turning = found(
        "best_stroke",
        rf"{name}: speed (\S+), velocity_elevation_deg (\S+), velocity_azimuth_deg (\S+),"
        r" angular_velocity.z (\S+)\n",
    )
    says(
        "best_racket_and_stroke",
        f"| {name} | {speed:.0f} | {up:.0f} / {aside:.0f} | {abs(turning):.0f} | {shown}",
    )


def test_what_the_best_stroke_gains():
    before, after = found("best_stroke", r"for the centre: .*\n +ball (\S+) -> (\S+) m/s")
    says(
        "best_racket_and_stroke",
        f"With the same fastest joint the ball leaves {100 * (after / before - 1):.0f} % faster",
    )


def cells(name: str, first: str) -> list[str]:
    """The cells after the first of a row of a Markdown table that a command printed."""
    (line,) = re.findall(rf"^\| {re.escape(first)} +\|(.*)\|$", printed(name), re.MULTILINE)
    return [cell.strip() for cell in line.split("|")]


def test_what_six_segments_cost():
    page = "how_many_segments"
    read = "with reading the case and making its arrays"
    for name in ("integration alone", read, "`simulate` without a history", "evaluations"):
        row_of = cells("segments_cost", name.replace("`", ""))
        says(page, f"| {name} | {' | '.join(cell.removesuffix(' ms') for cell in row_of)} |")
    alone = [float(c.removesuffix(" ms")) for c in cells("segments_cost", "integration alone")]
    counts = [float(c) for c in cells("segments_cost", "evaluations")]
    each = [1e3 * alone[0] / counts[0]]
    each += [1e3 * alone[0] * alone[i] / counts[i] for i in (1, 2)]
    says(page, f"| one evaluation (µs) | {' | '.join(f'{e:.1f}' for e in each)} | |")
    a, b = cells("segments_cost", "simulate without a history")[1:3]
    says("frame_and_hand", f"compiled engine | {a} (A), {b} (B); Drake's 1.4 |")


def test_what_contact_surface_costs():
    lines = [
        line.split("|")[2:-1] for line in printed("surface_cost").splitlines() if "degrees" in line
    ]
    assert len(lines) == 12
    counts, times = ([float(line[i]) for line in lines] for i in (2, 5))
    says(
        "spin",
        f"it takes {short(min(counts))} to {max(counts):.3f} of the evaluations and"
        f" {short(min(times), 2)} to {max(times):.2f} of the CPU time",
        f"evaluations {short(min(counts))} to {max(counts):.3f}, CPU time {short(min(times), 2)} to"
        f" {max(times):.2f}, in the mean of twelve {short(sum(counts) / 12)} and"
        f" {short(sum(times) / 12)} |",
    )


def test_sweet_spots():
    number = r"([-+\d.]+)"
    most, quiet, soft, node, percussion = [], [], [], [], []
    for racket in ("tour", "recreational"):
        best, at = found(
            "sweet_spots", rf"{racket}, most restitution: .*on the axis {number} +at {number} mm"
        )
        most.append(f"{best:.3f}, at {at:.0f}")
        at, closed = found(
            "sweet_spots",
            rf"{racket}, least handle ringing: .*on the axis \S+ m/s² at {number} mm.*\n"
            rf" +closed form: {number} mm",
        )
        quiet.append(f"at {at:+.0f}")
        node.append(f"{closed:+.0f}")
        force, at, closed = found(
            "sweet_spots",
            rf"{racket}, least peak hand force: .*on the axis {number} N at {number} mm.*\n"
            rf" +closed form: {number} mm",
        )
        soft.append(f"{force:.0f} N, at {at:+.0f}")
        percussion.append(f"{closed:+.0f}")
    says(
        "sample_studies",
        f"| most restitution | {' | '.join(most)} |",
        f"| least vibration on the long axis | {' | '.join(quiet)} |",
        f"| the node of bending of the free racket (closed form) | {' | '.join(node)} |",
        f"| least force on the hand, on the long axis | {' | '.join(soft)} |",
        "| the centre of percussion for the hand's place (closed form) |"
        f" {' | '.join(percussion)} |",
    )
