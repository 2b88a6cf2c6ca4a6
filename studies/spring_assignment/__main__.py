"""Which string spring carries which of k1-k4 and p1-p6? Every assignment, ranked.

    python -m studies.spring_assignment --out spring_assignment

The source shows it in a figure that its text does not have. Criterion: restitution as uniform over
the string-bed as can be, for the four published beds at once. The best of all assignments are then
looked at with other balls and rims, at three speeds, and by other statements of the source. Takes
several minutes; a run that was interrupted goes on where it was (`parts.sqlite` in --out).
"""

import argparse
from pathlib import Path

import numpy as np
import xarray as xr
from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bars

from drake_racket import (
    InputError,
    Progress,
    check_directory,
    load_racket,
    one_line_errors,
    replace_file,
    write_figure,
    write_netcdf,
)
from studies.spring_assignment import ranking as ranking_of
from studies.spring_assignment.assignments import GROUPINGS, all_assignments, assignment_of
from studies.spring_assignment.figures import assignment_figure
from studies.spring_assignment.scores import DEFAULT, SETTINGS


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description="Rank every assignment of the string springs.")
    parser.add_argument("--out", type=Path, default=Path("spring_assignment"), help="directory")
    parser.add_argument("--grouping", nargs="+", choices=list(GROUPINGS), default=[*GROUPINGS])
    parser.add_argument("--best", type=int, default=300, help="how many to look at closely")
    parser.add_argument("--others", type=int, default=300, help="of the others, a random sample")
    parser.add_argument("--seed", type=int, default=0, help="of that sample")
    parser.add_argument(
        "--setting",
        nargs="+",
        choices=[s.name for s in SETTINGS],
        default=[s.name for s in SETTINGS],
        help=f"choices of what is not printed; {DEFAULT.name!r} is always among them",
    )
    return parser.parse_args()


def table(ranking: xr.Dataset, varied: xr.Dataset, best: int) -> str:
    """Markdown: the best ten, the shipped assignment and the one nearest the rim's geometry."""
    shipped = int(np.flatnonzero(ranking["shipped"].to_numpy())[0])
    geometric = int(np.argmin(ranking["geometry_misfit"].to_numpy()))
    lines = [
        "| rank | k | p | spread | range | p misfit | rebound (m/s) | tension | match |",
        "|" + "---|" * 9,
    ]
    closely = varied.sel(setting=DEFAULT.name)
    for i in dict.fromkeys([*range(min(10, best)), shipped, geometric]):
        row, close = ranking.isel(assignment=i), closely.sel(assignment=i + 1)
        k, p = (" ".join(map(str, row[name].to_numpy())) for name in "kp")
        mark = " (shipped)" if i == shipped else ""
        lines.append(
            f"| {i + 1}{mark} | {k} | {p} | "
            f"{float(row['spread']):.5f} | {float(row['range']):.4f} | "
            f"{float(row['geometry_misfit']):.2f} | {float(close['lowest_rebound']):.1f}-"
            f"{float(close['highest_rebound']):.1f} | {float(close['tension_effect']):+.4f}, "
            f"{100.0 * float(close['faster_when_tight']):.0f} % | "
            f"{float(close['matched']):+.4f} |"
        )
    return "\n".join(lines)


def settings_table(firm: xr.Dataset) -> str:
    """Markdown: what each setting makes of the ranking."""
    lines = [
        "| setting | shipped: rank, spread | least spread | kept of ten | correlation |",
        "|" + "---|" * 5,
    ]
    for name in firm["setting"].to_numpy():
        row = firm.sel(setting=name)
        lines.append(
            f"| {name} | {int(row['shipped_rank'])}, {float(row['shipped_spread']):.5f} | "
            f"{float(row['least_spread']):.5f} | {int(row['kept_of_ten'])} | "
            f"{float(row['correlation_best']):.2f}, {float(row['correlation_others']):.2f} |"
        )
    return "\n".join(lines)


def shares_table(ranking: xr.Dataset, bests: list[int]) -> str:
    """Markdown: what the best have in common."""
    lines = [
        "| springs | " + " | ".join(f"best {n}" for n in bests) + " |",
        "|---|" + "---|" * len(bests),
    ]
    found = [ranking_of.shares(ranking, n) for n in bests]
    for which, letter, dimension in ((0, "k", "line"), (1, "p", "rim")):
        for row, name in enumerate(ranking[dimension].to_numpy()):
            cells = []
            for both in found:
                share = both[which][row]
                order = np.argsort(-share, kind="stable")
                cells.append(
                    ", ".join(
                        f"{letter}{i + 1} {100 * share[i]:.0f}" for i in order if share[i] > 0.005
                    )
                )
            kind = "" if which == 0 else "rim: "
            lines.append(f"| {kind}{name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Ranks, varies, prints and writes."""
    options = parse()
    check_directory(options.out, "--out")
    own = assignment_of(load_racket()).grouping
    if own not in options.grouping:
        raise InputError("--grouping", options.grouping, f"with that of the rackets, {own!r}")
    some = [a for name in dict.fromkeys(options.grouping) for a in all_assignments(name)]
    if not 2 <= options.best <= len(some):
        raise InputError("--best", options.best, f"2 to {len(some)}")
    if not 0 <= options.others <= len(some) - options.best:
        raise InputError("--others", options.others, f"0 to {len(some) - options.best}")
    if options.seed < 0:
        raise InputError("--seed", options.seed, "0 or more")
    store = options.out / "parts.sqlite"
    names = {DEFAULT.name, *options.setting}
    settings = [s for s in SETTINGS if s.name in names]
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Bars(*columns, console=Console(stderr=True)) as bars:
        tasks = {}

        def step(now: Progress) -> None:
            title = f"{now.task}, {now.total} assignments"
            if title not in tasks:
                tasks[title] = bars.add_task(title)
            bars.update(tasks[title], completed=now.done, total=now.total)

        ranking = ranking_of.rank_all(some, store=store, progress=step)
        positions = ranking_of.shortlist(ranking, options.best, options.others, options.seed)
        varied = ranking_of.vary(ranking, positions, settings=settings, store=store, progress=step)
    firm = ranking_of.firmness(varied, options.best)
    spread = ranking["spread"].to_numpy()
    bests = [n for n in (10, 50, 200) if n <= len(spread)]
    print(
        f"{len(spread)} assignments, mirror images once; "
        f"k of {', '.join(ranking['line'].to_numpy())}"
    )
    print(f"p of {'; '.join(ranking['rim'].to_numpy())}\n")
    report = "\n\n".join(
        [table(ranking, varied, options.best), settings_table(firm), shares_table(ranking, bests)]
    )
    print(report)
    print(
        "\nspread, percentiles 0 1 10 50 100: "
        + " ".join(f"{x:.4f}" for x in np.percentile(spread, [0, 1, 10, 50, 100]))
    )
    print(
        f"within the source's RMS difference in every bed: {int(ranking['within_printed'].sum())}"
    )
    write_netcdf(ranking, options.out / "ranking.nc")
    write_netcdf(varied, options.out / "varied.nc")
    write_netcdf(firm, options.out / "firmness.nc")
    frame = ranking[
        ["grouping", "spread", "range", "geometry_misfit", "within_printed", "shipped"]
    ].to_dataframe()
    for name, dimension in (("k", "line"), ("p", "rim")):
        for label in ranking[dimension].to_numpy():
            frame[f"{name} of {label}"] = ranking[name].sel({dimension: label}).to_numpy()
    replace_file(options.out / "ranking.csv", lambda temporary: frame.to_csv(temporary))
    write_figure(assignment_figure(ranking, firm), options.out / "spring_assignment.png")
    print(f"wrote {options.out}")


if __name__ == "__main__":
    kept = "what is finished is kept: the same call goes on"
    with one_line_errors("studies.spring_assignment", kept=kept):
        main()
