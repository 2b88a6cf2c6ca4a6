"""How many segments does a stroke need? Ball, hand, handle and limb over the frame's segments.

    python -m studies.how_many_segments --out how_many_segments

Frames of 2 to 12 segments, of both families of mass density (0: keeps the printed moments; 1: hoop
and exponential handle), struck at four points: free, in a hand that has mass, with the handle
clamped, and in the shipped limb. All of one fundamental frequency. Read are the ball's rebound, the
peak load on the hand, the acceleration of the handle by bands of frequency, the peak force in the
limb's wrist and elbow, and what a run costs.

Leaves a table (CSV) and a figure. `--quick` takes fewer cases.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket import (
    CompiledImpact,
    ImpactResult,
    Scenario,
    check_directory,
    make_impact_diagram,
    one_line_errors,
    resolve,
    simulate,
    write_figure,
    write_text,
)
from studies.how_many_segments.figures import segments_figure

COUNTS = (2, 3, 4, 6, 8, 12)
POINTS = {"centre": "5", "throat": "8", "tip": "2", "side": "4"}
SUPPORTS: dict[str, dict[str, Any]] = {
    "free": {"support": "free"},
    "hand": {"support": "grip", "grip": "hand_medium", "grip_kind": "hand"},
    "clamped": {"support": "clamped_handle"},
    "limb": {"support": "limb", "grip": "hand_medium", "grip_kind": "hand"},
}
BANDS = ((0.0, 250.0), (250.0, 1000.0), (1000.0, 3000.0))
"""Hz: rigid motion and first bending; second and third; what is beyond a hand's feeling."""
RATE = 20e3  # Hz, of the acceleration that the bands are read from
AFTER = 0.02  # s, simulated from touch on
SPEED = 25.0  # m/s
LIMB_JOINTS = ("wrist_deviation", "elbow_flexion")
REPEATS = 15  # runs whose median CPU time is the cost


def bands(result: ImpactResult) -> list[float]:
    """Gives the root mean square (m/s^2) of the handle's acceleration along z in each band."""
    history = result.history
    assert history is not None
    t = history["time"].to_numpy()
    even = np.arange(0.0, t[-1], 1.0 / RATE)
    raw = np.interp(even, t, history["handle_acceleration"].sel(axis="z").to_numpy())
    lines, power = np.fft.rfftfreq(len(even), 1.0 / RATE), np.abs(np.fft.rfft(raw)) ** 2
    power[1:] *= 2.0
    return [
        float(np.sqrt(np.sum(power[(lines >= low) & (lines < high)])) / len(even))
        for low, high in BANDS
    ]


def peak(values: NDArray[np.float64]) -> float:
    """Gives the largest magnitude."""
    return float(np.max(np.abs(values)))


def cost(scenario: Scenario) -> float:
    """Gives the median CPU time (ms) of one run in the compiled engine, without results."""
    case = resolve(scenario)
    model = CompiledImpact(make_impact_diagram(case))
    start, times = model.start(case), []
    for _ in range(REPEATS + 1):  # the first may compile
        began = time.process_time()
        model.run_from(case, start, every_sample=False)
        times.append(time.process_time() - began)
    return 1e3 * float(np.median(times[1:]))


def row_of(count: int, density: float, support: str, point: str) -> dict[str, Any]:
    """Runs one case and reads its row."""
    scenario = replace(
        Scenario(**SUPPORTS[support]),
        point=POINTS[point],
        speed=SPEED,
        after=AFTER,
        engine="compiled",
        overrides={"racket.frame.segments": float(count), "racket.frame.density": density},
    )
    result = simulate(scenario)
    history = result.history
    assert history is not None
    row: dict[str, Any] = {
        "segments": count,
        "density": density,
        "support": support,
        "point": point,
        "restitution [1]": result.apparent_restitution,
        "contact [ms]": 1e3 * (result.contact_time or np.nan),
    }
    row |= {
        f"handle {low:g}-{high:g} Hz [m/s^2]": value
        for (low, high), value in zip(BANDS, bands(result), strict=True)
    }
    held = "hand_force" in history
    for name, axis, unit in (("hand_force", "z", "N"), ("hand_torque", "y", "N*m")):
        values = history[name].sel(axis=axis).to_numpy() if held else np.full(1, np.nan)
        row[f"{name}_{axis} [{unit}]"] = peak(values)
    for joint in LIMB_JOINTS:
        of_limb = "joint_reaction_force" in history
        force = history["joint_reaction_force"].sel(joint=joint).to_numpy() if of_limb else None
        row[f"{joint} force [N]"] = np.nan if force is None else peak(force - force[0])
    timed = point == "centre" and support in ("free", "hand")
    row["cost [ms]"] = cost(replace(scenario, after=0.05)) if timed else np.nan
    return row


def _text(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def main() -> None:
    """Reads the options, runs all cases, prints and writes."""
    parser = argparse.ArgumentParser(description="What segments of the frame change in a stroke.")
    parser.add_argument("--out", type=Path, default=Path("how_many_segments"), help="directory")
    parser.add_argument("--quick", action="store_true", help="fewer cases")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    counts = (2, 4, 6) if options.quick else COUNTS
    points = ("centre",) if options.quick else tuple(POINTS)
    rows = [
        row_of(count, density, support, point)
        for support in SUPPORTS
        for density in (0.0, 1.0)
        for count in counts
        for point in points
    ]
    options.out.mkdir(parents=True, exist_ok=True)
    lines = [",".join(rows[0]), *(",".join(map(_text, row.values())) for row in rows)]
    write_text("\n".join(lines) + "\n", options.out / "segments.csv")
    write_figure(segments_figure(rows), options.out / "segments.png")
    for row in rows:
        if row["point"] == "centre":
            print(
                f"{row['support']:8} family {'AB'[int(row['density'])]} N {row['segments']:2d}:"
                f" restitution {row['restitution [1]']:.4f},"
                f" hand {row['hand_force_z [N]']:6.1f} N {row['hand_torque_y [N*m]']:5.2f} N m,"
                f" handle {row['handle 0-250 Hz [m/s^2]']:6.0f}"
                f" {row['handle 250-1000 Hz [m/s^2]']:6.0f} m/s2,"
                f" wrist {row['wrist_deviation force [N]']:6.1f} N,"
                f" {row['cost [ms]']:.1f} ms"
            )
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.how_many_segments"):
        main()
