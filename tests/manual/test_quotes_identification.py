"""Pages on identification quote the files of docs/results and the tables of the recovery study."""

from __future__ import annotations

import re

import pytest

from tests.conftest import ROOT
from tests.manual.quotes import found, page_text, printed, says

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


def recovered(heading: str, first: str) -> list[str]:
    """The cells of a row of the tables that the recovery study writes."""
    text = (ROOT / "docs/identification_tables.md").read_text(encoding="utf-8")
    (line,) = re.findall(
        rf"^\| {re.escape(first)} \|(.*)\|$",
        text.split(f"## {heading}\n")[1].split("\n## ")[0],
        re.M,
    )
    return [cell.strip() for cell in line.split("|")]


def test_how_well_fits_recover():
    exact = [
        float(recovered("String-bed, all eleven parameters, no noise", bed)[2].split()[0])
        for bed in ("tour low", "tour high", "recreational low", "recreational high")
    ]
    scatter = float(recovered("String-bed, all eleven parameters (tour, 254 N)", "T0")[3])
    alone = recovered("T0 alone (tour, 311 N)", "T0")[4]
    says(
        "identification",
        f"all eleven parameters of all four beds came back to {max(exact):.1e} or better",
        f"T0 scatters by {scatter:.0f} %",
        f"T0 alone is found with a standard error of {alone} %",
    )


def test_annealing_and_least_squares():
    heading = "Annealing and least squares"
    text = (ROOT / "docs/identification_tables.md").read_text(encoding="utf-8")
    tight = [
        [cell.strip() for cell in line.split("|")]
        for line in re.findall(r"^\| annealing, seed \d \| 3 \|(.*)\|$", text, re.MULTILINE)
    ]
    polished = {recovered(heading, f"annealing, seed {s}, then least squares")[1] for s in (1, 2)}
    (one,) = re.findall(
        r"^\| least squares \| 3 \| (\S+) \| \S+ \| \S+ \| (\d+) \| (\S+) \|$", text, re.M
    )[:1]
    assert polished == {one[0]}
    says(
        "identification",
        f"| least squares, one start | {one[1]} | {float(one[2]):.0f} s | {one[0]} % |",
        f"| {', '.join(f'{float(t[0]):.3f}' for t in tight)} % |",
        f"| the same, polished | | | {one[0]} % with all three seeds |",
    )
