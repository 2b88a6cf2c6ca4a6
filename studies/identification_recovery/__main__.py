"""Do the fits find again what made their data? Recovery tables and coverage of the intervals.

    python -m studies.identification_recovery --out recovery --repeats 40

Synthetic measurements with the paper's errors (`identify.laboratory`), fitted again and again with
new noise: strings, T0 alone, friction, ball, frame. Leaves a NetCDF for each part, `tables.md` and
`coverage.png`. Parts that are finished in OUT are not computed again.
"""

import argparse
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray

from drake_racket import (
    Progress,
    check_directory,
    load_ball,
    load_racket,
    one_line_errors,
    write_figure,
    write_netcdf,
    write_text,
)
from drake_racket.identify import Search, fit_string_bed, markdown_table
from studies.identification_recovery import recovery
from studies.identification_recovery.figures import coverage_figure
from studies.synthetic_laboratory.laboratory import Noise, restitution_table

PARTS = (
    "strings",
    "tension",
    "friction",
    "friction_displacement",
    "friction_from_normal",
    "ball",
    "frame_in_plane",
    "frame_out_of_plane",
)
TITLES = {
    "strings": "String-bed, all eleven parameters (tour, 254 N)",
    "tension": "T0 alone (tour, 311 N)",
    "friction": "Friction, 73 and 74 degrees from the normal (tour, 254 N)",
    "friction_displacement": "The same, friction by displacement",
    "friction_from_normal": "Friction, 17 and 16 degrees from the normal",
    "ball": "Ball (Penn), two impacts at each of six speeds",
    "frame_in_plane": "Frame in plane (tour), three strikes",
    "frame_out_of_plane": "Frame out of plane (tour), three strikes",
}

WIDE, NARROW = 10.0, 3.0
ANNEALINGS = 3  # seeds

RMS_UNITS = {"friction": "deg", "ball": "N", "frame": "m/s^2"}


def trial_of(part: str) -> tuple:
    """The trial of a part, and its true values."""
    low, high, ball = load_racket("tour", "low"), load_racket("tour", "high"), load_ball()
    if part == "strings":
        truth = recovery.string_bed_truth(low, None)
        return recovery.string_bed_trial(low, ball), truth
    if part == "tension":
        trial = recovery.string_bed_trial(high, ball, free=["T0"], profiles=True)
        return trial, recovery.string_bed_truth(high, ["T0"])
    if part.startswith("friction"):
        reading = "displacement" if part == "friction_displacement" else "velocity"
        angle = "from_normal" if part == "friction_from_normal" else "from_plane"
        trial = recovery.friction_trial(low, ball, reading=reading, angle_reading=angle)
        return trial, recovery.friction_truth(low)
    if part == "ball":
        return recovery.ball_trial(ball), recovery.ball_truth(ball)
    direction = part.removeprefix("frame_")
    return recovery.frame_trial(low, direction), recovery.frame_truth(low, direction)


def compute(part: str, repeats: int, out: Path) -> xarray.Dataset:
    """A part, from its file if it is there."""
    path = out / f"{part}.nc"
    if path.exists():
        found = xarray.load_dataset(path, engine="h5netcdf")
        if found.sizes["repeat"] == repeats:
            return found
    trial, truth = trial_of(part)

    def progress(now: Progress) -> None:
        print(f"\r{part}: {now.done} of {now.total}", end="", file=sys.stderr, flush=True)

    unit = next((u for name, u in RMS_UNITS.items() if part.startswith(name)), "of restitution")
    options = {"title": TITLES[part], "rms_unit": unit, "progress": progress}
    found = recovery.repeat(trial, truth, repeats, **options)
    print(file=sys.stderr)
    write_netcdf(found, path)
    return found


def exact_table() -> str:
    """All eleven parameters of the four beds from data without noise, begun up to 1.5 times off."""
    rows = []
    for racket in ("tour", "recreational"):
        for tension in ("low", "high"):
            bed = load_racket(racket, tension)
            fit = recovery.exact_string_bed(bed, load_ball())
            truth = recovery.string_bed_truth(bed, None)
            off = {n: abs(fit.estimates[n].value / v - 1.0) for n, v in truth.items()}
            worst = max(off, key=lambda n: off[n])
            rows.append(
                (
                    f"{racket} {tension}",
                    f"{fit.rms:.1e}",
                    f"{off['T0']:.1e}",
                    f"{off[worst]:.1e} ({worst})",
                    f"{fit.result.evaluations}",
                    f"{fit.result.seconds:.1f}",
                )
            )
    header = ("bed", "RMS", "T0 off by", "largest relative error", "evaluations", "seconds")
    return markdown_table(header, rows)


def tension_table(tensions: list[float]) -> str:
    """T0 alone for rackets strung at other tensions, one set of noisy measurements each."""
    rows = []
    ball = load_ball()
    for racket in ("tour", "recreational"):
        known = load_racket(racket, "low")
        for tension in tensions:
            strung = load_racket(racket, f"{tension:g}")
            rng = np.random.default_rng(int(tension))
            made = restitution_table(strung, ball, rng)
            table = recovery.measured_restitution(made).averaged()
            fit = fit_string_bed(
                table, known, ball, free=["T0"], profiles=True, options=Search(starts=2)
            )
            e, true = fit.estimates["T0"], strung.string_bed.initial_tension.value
            rows.append(
                (
                    f"{racket}, {tension:g} N",
                    f"{true:.1f}",
                    f"{e.value:.1f}",
                    f"{e.interval[0]:.1f} to {e.interval[1]:.1f}",
                    "yes" if e.interval[0] <= true <= e.interval[1] else "no",
                    f"{100.0 * fit.rms:.2f}",
                )
            )
    header = ("bed", "true T0 (N)", "fitted (N)", "95 % interval (N)", "contains it", "RMS (%)")
    return markdown_table(header, rows)


def annealing_table(evaluations: int) -> str:
    """The paper's method beside least squares on one set of noisy measurements."""
    racket, ball = load_racket(), load_ball()
    made = restitution_table(racket, ball, np.random.default_rng(0))
    table = recovery.measured_restitution(made).averaged()
    rows: list[tuple[str, ...]] = []

    def run(
        name: str, span: float, options: Search, checkpoint: Path | None = None, before: float = 0.0
    ) -> float:
        """Adds a row; returns its seconds, those of the part that it goes on from included."""
        began = time.monotonic()
        start = {"T0": 500.0, "k3": 3e5, "k4": 4e5}
        fit = fit_string_bed(
            table, racket, ball, start=start, span=span, options=options, checkpoint=checkpoint
        )
        seconds = before + time.monotonic() - began
        chains = fit.result.convergence
        rows.append(
            (
                name,
                f"{span:g}",
                f"{100.0 * fit.rms:.4f}",
                f"{min(r.cost for r in chains):.3f}",
                ", ".join(f"{100.0 * r.rms:.3f}" for r in chains),
                str(fit.result.evaluations),
                f"{seconds:.1f}",
            )
        )
        print("; ".join(rows[-1]), file=sys.stderr, flush=True)
        return seconds

    for starts, span in ((1, WIDE), (4, WIDE), (1, NARROW), (4, NARROW)):
        run("least squares", span, Search(starts=starts))
    for seed, span in (*((seed, NARROW) for seed in range(ANNEALINGS)), (0, WIDE)):
        options = Search(method="annealing", seed=seed, evaluations=evaluations)
        with tempfile.TemporaryDirectory() as directory:  # the second goes on where the first ended
            checkpoint = Path(directory)
            spent = run(f"annealing, seed {seed}", span, options, checkpoint)
            polished = replace(options, polish=True)
            run(f"annealing, seed {seed}, then least squares", span, polished, checkpoint, spent)
    header = (
        "method",
        "bounds: start / and x",
        "RMS (%)",
        "chi squared",
        "RMS of each start (%)",
        "evaluations",
        "seconds",
    )
    return markdown_table(header, rows)


def noise_line(data: xarray.Dataset) -> str:
    """RMS of the fits beside that of the noise."""
    unit = data["rms"].attrs["units"]
    rms, noise = float(data["rms"].mean()), float(data["noise"].mean())
    return f"RMS of the fits {rms:.4g}, of the noise {noise:.4g} {unit} (means)."


def main() -> None:
    """Reads the options, computes what is not there, prints and writes."""
    parser = argparse.ArgumentParser(description="Recovery of parameters from synthetic data.")
    parser.add_argument("--out", type=Path, default=Path("recovery"), help="output directory")
    parser.add_argument("--repeats", type=int, default=40)
    parser.add_argument("--frame-repeats", type=int, default=10)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--tensions", type=float, nargs="*", default=[200.0, 250.0, 300.0, 350.0])
    parser.add_argument(
        "--evaluations", type=int, default=0, help="of each annealing chain; 0: none, usual: 20000"
    )
    parser.add_argument("--exact", action="store_true", help="data without noise, four beds")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    options.out.mkdir(parents=True, exist_ok=True)
    noise = Noise()
    texts = [
        "# Recovery tables",
        f"Written by `studies.identification_recovery`, {options.repeats} repeats "
        f"({options.frame_repeats} of the frame). Measured speeds have a standard deviation of "
        f"{noise.speed:g} m/s; five shots are averaged. Standard error: that of the linearised "
        "fit; the intervals of T0 alone and of friction are those of the likelihood profile.",
    ]
    if options.exact:
        texts += ["## String-bed, all eleven parameters, no noise", exact_table()]
    parts = {}
    for part in options.only:
        repeats = options.frame_repeats if part.startswith("frame") else options.repeats
        parts[part] = data = compute(part, repeats, options.out)
        table = markdown_table(recovery.RECOVERY_HEADER, recovery.recovery_rows(data))
        texts += [f"## {TITLES[part]}", noise_line(data), table]
    if options.tensions:
        texts += ["## T0 alone at other tensions", tension_table(options.tensions)]
    if options.evaluations:
        texts += ["## Annealing and least squares", annealing_table(options.evaluations)]
    text = "\n\n".join(texts) + "\n"
    print(text)
    write_text(text, options.out / "tables.md")
    short = {part.replace("_", " "): data for part, data in parts.items()}
    write_figure(coverage_figure(short), options.out / "coverage.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    with one_line_errors("studies.identification_recovery"):
        main()
