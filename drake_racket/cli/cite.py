"""`drake-racket cite` prints what to cite."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from drake_racket.cli.console import new_console, working
from drake_racket.io.errors import one_line


def cite(
    scenario_file: Annotated[
        Path | None,
        typer.Argument(metavar="[SCENARIO]", help="A scenario file (YAML), or backhand."),
    ] = None,
    racket: Annotated[
        str | None, typer.Option(help="tour, recreational, or a parameter file (YAML).")
    ] = None,
    bibtex: Annotated[bool, typer.Option("--bibtex", help="Print entries for BibTeX.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object and nothing else.")
    ] = False,
) -> None:
    """Prints what to cite: software, paper, Drake, and the sources of the numbers of a case."""
    with working("reading"):
        import dataclasses

        from drake_racket.cases.case import load_scenario
        from drake_racket.cases.citations import citations
        from drake_racket.parameters.scenario import Scenario

        scenario = None
        if scenario_file is not None or racket is not None:
            scenario = Scenario() if scenario_file is None else load_scenario(scenario_file)
            if racket is not None:
                scenario = dataclasses.replace(scenario, racket=racket)
        found = citations(scenario)
    if as_json:
        print(json.dumps([dataclasses.asdict(citation) for citation in found]))
        return
    if bibtex:
        print("\n\n".join(c.reference.bibtex() for c in found if c.reference is not None))
        for citation in found:
            if citation.reference is None:
                print(f"\n% {one_line(citation.source)} ({len(citation.numbers)} numbers)")
        return
    console = new_console()
    for citation in found:
        count = f" [{len(citation.numbers)} numbers]" if citation.numbers else ""
        console.print(f"- {citation.text()}{count}", markup=False, soft_wrap=True)
    if scenario is None:
        console.print("With a scenario file, also the sources of the numbers that it uses.")
