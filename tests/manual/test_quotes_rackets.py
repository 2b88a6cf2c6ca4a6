"""Pages on rackets, strokes and segments quote the files of docs/results."""

from __future__ import annotations

import functools

import pytest

from tests.manual.quotes import cells, found, rows, says, short

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
        (
            "CPU time of 50 ms in the hand (ms, compiled engine), A",
            segments("hand", "A", "cost"),
            ".0f",
        ),
        ("the same, B", segments("hand", "B", "cost"), ".0f"),
    ],
)
def test_how_many_segments(name, values, form):
    cells = " | ".join(f"{value:{form}}" for value in values)
    says(
        "how_many_segments", f"| {name} | {cells.replace('0.', '.') if form == '.3f' else cells} |"
    )


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


DESIGNS = rows("best_racket")


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design["bound"])
def test_best_racket(design):
    name = {"as it starts": "as the search starts", "softest": "the softest"}.get(
        design["bound"], design["bound"]
    )
    speed, force = float(design["ball speed"]), float(design["peak force on hand"])
    line = f"| {name} | {speed:.2f} | {short(float(design['restitution']))} | {force:.1f} |"
    if design["bound"] != "as it starts":
        side, throat, tension, stiffness = (
            float(design[key])
            for key in ("rim 3 + 9 h", "throat 30 cm", "tension", "frame stiffness")
        )
        line += f" {side:.1f} / {throat:.0f} | {tension:.0f} / {stiffness:.0f} |"
    says("best_racket_and_stroke", line)


@pytest.mark.parametrize("output", ["ball_speed", "peak_hand_torque", "handle_ringing"])
def test_what_decides_ball_speed(output):
    index = {
        row["parameter"]: row for row in rows("what_decides.indices") if row["output"] == output
    }
    shown = []
    for name in ("impact point, x", "impact point, y", "frame stiffness", "mass moved to the head"):
        total, half = (float(index[name][column]) for column in ("total", "total_half_width"))
        shown.append(f"{total:.3f}" + (f" ± {half:.3f}" if half >= 5e-4 else ""))
    shown.append(f"{float(index['stringing tension']['total']):.3f}")
    says("sample_studies", f" | {' | '.join(shown)} |")
    first = sum(float(row["first_order"]) for row in index.values())
    stated = "0.91" if output == "peak_hand_torque" else "0.98"
    assert f"{first:.2f}" == stated
    says("sample_studies", stated)
    widths = [
        float(row[f"{kind}_half_width"])
        for row in index.values()
        for kind in ("first_order", "total")
    ]
    assert max(widths) < 0.02
