"""Which string-bed parameters restitution determines, and what would settle the others.

    python -m studies.identifiability --out identifiability

Prints a table per bed; leaves NetCDF, CSV and figures. `--profiles` and `--refits` check the linear
answer, on the beds chosen and on one, and take many minutes for each bed.
"""

import argparse
from itertools import product
from pathlib import Path

import xarray

from drake_racket import (
    RACKETS,
    TENSIONS,
    InputError,
    check_directory,
    load_ball,
    load_racket,
    one_line_errors,
    write_figure,
    write_netcdf,
    write_table,
)
from studies.identifiability import figures
from studies.identifiability.cases import design_cases, measurement_cases
from studies.identifiability.information import identifiability_dataset
from studies.identifiability.measurements import Design, Errors
from studies.identifiability.refits import profiles_dataset, refits_dataset

CHECKED = ("restitution (published)", "+ static shape")


def main() -> None:
    """Reads the options, computes, prints and writes."""
    usual, design = Errors(), Design()
    parser = argparse.ArgumentParser(description="Identifiability of the string-bed.")
    parser.add_argument("--out", type=Path, default=Path("identifiability"), help="directory")
    parser.add_argument("--rackets", nargs="+", choices=RACKETS, default=list(RACKETS))
    parser.add_argument("--tensions", nargs="+", choices=TENSIONS, default=list(TENSIONS))
    parser.add_argument("--points", type=int, nargs="+", default=list(design.points))
    parser.add_argument("--speeds", type=float, nargs="+", default=list(design.speeds), help="m/s")
    parser.add_argument("--forces", type=float, nargs="+", default=list(design.forces), help="N")
    units = {"speed": "m/s", "repeats": "1", "ball": "1", "contact_time": "s"}
    for key, value in vars(usual).items():
        text = f"standard deviation, {units.get(key, 'm')}"
        text = "impacts averaged" if key == "repeats" else text
        parser.add_argument(
            f"--error-{key.replace('_', '-')}", type=float, default=value, help=text
        )
    parser.add_argument(
        "--profiles", nargs="*", metavar="PARAMETER", help="default: T0 k2 k4 p2 p6"
    )
    parser.add_argument("--profile-points", type=int, default=7)
    parser.add_argument("--refits", type=int, default=0, metavar="N", help="0: none; usual: 40")
    parser.add_argument("--seed", type=int, default=0, help="of the refits' noise")
    parser.add_argument("--check", nargs="+", default=list(CHECKED), help="of profiles and refits")
    parser.add_argument("--bed", nargs=2, default=["tour", "low"], help="of the refits")
    options = parser.parse_args()
    check_directory(options.out, "--out")
    errors = Errors(**{key: getattr(options, f"error_{key}") for key in vars(usual)})
    design = Design(tuple(options.points), tuple(options.speeds), tuple(options.forces))
    cases = measurement_cases(design, errors)
    by_name = {case.name: case for case in cases}
    for name in options.check:
        if name not in by_name:
            raise InputError("--check", name, " | ".join(by_name))
    checked = [by_name[name] for name in options.check]
    racket, ball = load_racket(*options.bed), load_ball()
    options.out.mkdir(parents=True, exist_ok=True)

    beds = {"rackets": options.rackets, "tensions": options.tensions}
    measured = identifiability_dataset(cases, **beds)
    designs = identifiability_dataset(design_cases(errors), **beds)
    for name, dataset in (("measurements", measured), ("designs", designs)):
        report(name, dataset)
        write_netcdf(dataset, options.out / f"{name}.nc")
        write_table(dataset[["standard_error", "error_alone"]], options.out / f"{name}.csv")
        picture = figures.errors_figure(dataset)
        write_figure(picture, options.out / f"identifiability_{name}.png")
    picture = figures.directions_figure(measured)
    write_figure(picture, options.out / "identifiability_directions.png")

    if options.profiles is not None:
        names = options.profiles or ["T0", "k4", "k2", "p6", "p2"]
        curves = xarray.concat(
            [
                profiles_dataset(
                    load_racket(*bed),
                    ball,
                    checked,
                    names,
                    points=options.profile_points,
                    progress=lambda text, bed=bed: print(f"{' '.join(bed)}: {text}", flush=True),
                )
                for bed in product(options.rackets, options.tensions)
            ],
            dim="bed",
        )
        write_netcdf(curves, options.out / "profiles.nc")
        picture = figures.profiles_figure(curves)
        write_figure(picture, options.out / "identifiability_profiles.png")
    if options.refits:
        fits = refits_dataset(racket, ball, checked, repeats=options.refits, seed=options.seed)
        report_refits(fits)
        write_netcdf(fits, options.out / "refits.nc")
        picture = figures.refits_figure(fits)
        write_figure(picture, options.out / "identifiability_refits.png")
    print(f"wrote {options.out}")


def report(title, dataset) -> None:
    """Prints standard errors in per cent, and how many are within 10 and 100 %."""
    names = [str(n) for n in dataset["parameter"].to_numpy()]
    for bed in dataset["bed"].to_numpy():
        print(f"\n{title}, {bed}: relative standard errors (%)")
        print(f"{'':32}" + "".join(f"{n:>7}" for n in names) + "   <=10 % <=100 %")
        for case in dataset["case"].to_numpy():
            row = dataset.sel(bed=bed, case=case)
            numbers = [figures.per_cent(float(e)) for e in row["standard_error"]]
            counts = "".join(f"{int(n):8}" for n in row["parameters_determined"])
            print(f"{case:32}" + "".join(f"{n:>7}" for n in numbers) + counts)
        row = dataset.sel(bed=bed).isel(case=0)
        groups = zip(
            row["rim_group"].to_numpy(), row["product_error"], row["rim_correlation"], strict=True
        )
        print(
            "error of p k, and correlation of p with k, first case: "
            + ", ".join(f"{g} {figures.per_cent(float(e))} % {float(r):+.2f}" for g, e, r in groups)
        )


def report_refits(fits) -> None:
    """Prints the scatter of the refits beside the linear answer."""
    for case in fits["case"].to_numpy():
        one = fits.sel(case=case)
        spread = one["log_ratio"].std("repeat", ddof=1)
        print(f"\n{case}: {fits.sizes['repeat']} refits, {int(one['converged'].sum())} converged")
        print(f"{'':12}{'linear (%)':>12}{'scatter (%)':>12}{'mean (%)':>12}")
        for name in fits["parameter"].to_numpy():
            here = one.sel(parameter=name)
            numbers = here["standard_error"], spread.sel(parameter=name), here["log_ratio"].mean()
            print(f"{name:12}" + "".join(f"{100.0 * float(x):12.2f}" for x in numbers))


if __name__ == "__main__":
    with one_line_errors("studies.identifiability"):
        main()
