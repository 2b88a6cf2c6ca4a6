"""Writes the result files that the pages quote: python -m manual.refresh NAME...

Each name is a command of the repository. What it prints is kept as docs/results/NAME.txt, its
tables (CSV) beside it, and its pictures replace those in docs/figures. The pages' sentences are
compared with these files by tests (`tests/manual/quotes.py`).
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from drake_racket.io.files import write_text

ROOT = Path(__file__).resolve().parents[1]
RESULTS, FIGURES = ROOT / "docs" / "results", ROOT / "docs" / "figures"
OUT = "OUT"

COMMANDS = {
    "against_others": "benchmarks/against_others.py",
    "ball_calibration": "-m studies.ball_calibration --out OUT",
    "best_racket": "-m studies.best_racket --out OUT",
    "best_stroke": "-m studies.best_stroke --out OUT",
    "clamped_batch": "benchmarks/clamped_batch.py",
    "compiled_engine": "benchmarks/compiled_engine.py",
    "evaluation_cost": "benchmarks/evaluation_cost.py",
    "finer_beds": "studies/finer_beds.py --out OUT",
    "frame_stiffness": "-m studies.frame_stiffness_and_handle_vibration --out OUT",
    "how_many_segments": "-m studies.how_many_segments --out OUT",
    "identifiability": "-m studies.identifiability --out OUT",
    "limb_impact": "benchmarks/limb_impact.py",
    "my_swing": "-m studies.which_racket_for_my_swing --out OUT",
    "segments_cost": "benchmarks/segments_cost.py",
    "slow_balls": "studies/slow_balls.py --out OUT",
    "spin_and_angle": "-m studies.spin_and_angle --out OUT",
    "spin_by_string": "studies/spin_by_string.py",
    "strings_or_frame": "-m studies.strings_or_frame_and_the_arm --out OUT",
    "surface_cost": "benchmarks/surface_cost.py",
    "sweet_spots": "-m studies.sweet_spots --out OUT",
    "tangents": "benchmarks/tangents.py",
    "ten_grams": "-m studies.where_to_put_ten_grams --out OUT",
    "tension_and_power": "-m studies.tension_and_power --out OUT",
    "what_decides": "-m studies.what_decides_ball_speed --out OUT --samples 16384",
    "work_precision": "benchmarks/work_precision.py",
}


def refresh(name: str) -> None:
    """Runs one command from the repository's root and keeps what it says and writes."""
    command = COMMANDS[name]
    with tempfile.TemporaryDirectory() as directory:
        out = Path(directory) / name
        words = [str(out) if word == OUT else word for word in command.split()]
        done = subprocess.run(
            [sys.executable, *words], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True
        )
        said = done.stdout.replace(str(out), OUT).strip()
        write_text(f"$ python {command}\n{said}\n", RESULTS / f"{name}.txt")
        for table in sorted(out.glob("*.csv")):
            kept = table.name if table.stem == name else f"{name}.{table.name}"
            shutil.copyfile(table, RESULTS / kept)
        for picture in sorted(out.glob("*.png")):
            for figure in (FIGURES / picture.name, FIGURES / f"{name}.png"):
                if figure.is_file():
                    shutil.copyfile(picture, figure)
                    break


def main() -> None:
    """Refreshes the files that are named, or says which there are."""
    unknown = set(sys.argv[1:]) - set(COMMANDS)
    if unknown or not sys.argv[1:]:
        raise SystemExit(f"python -m manual.refresh NAME..., of {', '.join(COMMANDS)}")
    RESULTS.mkdir(exist_ok=True)
    for name in sys.argv[1:]:
        refresh(name)
        print(f"wrote {RESULTS / name}.txt")


if __name__ == "__main__":
    main()
