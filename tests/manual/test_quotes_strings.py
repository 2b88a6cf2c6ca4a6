"""Pages on strings, frame, ball and spin quote the files of docs/results."""

from __future__ import annotations

import re

import pytest

from tests.manual.quotes import REPORT, found, model, printed, says, short


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


def test_what_contact_surface_costs():
    lines = [
        line.split("|")[2:-1] for line in printed("surface_cost").splitlines() if "degrees" in line
    ]
    assert len(lines) == 12
    counts, times = ([float(line[i]) for line in lines] for i in (2, 5))
    of_counts = f"{short(min(counts))} to {short(max(counts))}"
    of_times = f"{short(min(times), 2)} to {short(max(times), 2)}"
    means = f"{short(sum(counts) / 12)} and {short(sum(times) / 12)}"
    says(
        "spin",
        f"it takes {of_counts} of the evaluations and {of_times} of the CPU time",
        f"evaluations {of_counts}, CPU time {of_times}, in the mean of twelve {means} |",
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


@pytest.mark.parametrize("hand", ["light", "medium", "tight"])
def test_hands(hand):
    def pair(racket: str, what: str) -> str:
        key = f"hand.{hand}.{racket}.{what}"
        return f"{short(model(key))} ({short(REPORT[key]['published'] + 1e-9)})"

    said = [pair(racket, what) for what in ("frequency", "damping") for racket in ("A", "B")]
    says("frame_and_hand", f"| `hand_{hand}` | {' | '.join(said)} |")
    says("frame_and_hand", f"its frequency falls to {short(model('hand.transfer.frequency'))} in")


def test_what_the_report_knows_of_spin():
    limits = [model(f"spin.{kind}_limit.{mu}") for kind in ("rolling", "slip") for mu in (25, 40)]
    cross = [model(f"clamped.tour.drop_1m{law}") for law in (".hunt_crossley", "")]
    korte = model("clamped.tour.drop.hunt_crossley")
    says(
        "spin",
        f"{model('spin.clamped'):,.0f} rpm with the head clamped",
        f"{100 * model('spin.held'):.0f} % less in a hand",
        "| {:.1f} and {:.1f}°; {:.1f} and {:.1f}° |".format(*limits),
        f"which is {-limits[2]:.1f} and {-limits[3]:.1f}° off the formula",
        f"{short(cross[0])} with this law, {short(cross[1])} with the slow ball",
        f"{short(model('plate.drop_restitution.hunt_crossley'))}; {short(korte)};"
        f" {short(cross[0])} against .84 |",
    )


def test_what_the_report_knows_of_the_free_racket():
    held = sorted(100 * model(f"grip.{racket}.centre") for racket in ("tour", "recreational"))
    clamped = [100 * model(f"grip.{racket}.clamped") for racket in ("tour", "recreational")]
    low = sorted(
        REPORT[f"free.{racket}.throat"]["published"] - model(f"free.{racket}.throat")
        for racket in ("tour", "recreational")
    )
    says(
        "model",
        f"as the free one does ({held[0]:.1f}-{held[1]:.1f} % at the centre)",
        "does not ({:+.0f} and {:+.0f} %)".format(*clamped),
        f"it is {low[0]:.1f}-{low[1]:.2f} low near the throat",
    )
