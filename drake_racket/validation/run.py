"""Goes through the sections, keeps each as soon as it is finished, and writes the report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

from drake_racket.io.errors import InputError
from drake_racket.io.files import (
    check_directory,
    directory_error,
    write_figure,
    write_netcdf,
)
from drake_racket.io.fingerprint import as_text, computation, digest
from drake_racket.io.progress import Progress, Report
from drake_racket.pool import leave_if_imported_again
from drake_racket.store import KeptResults
from drake_racket.validation.frame import force_plate, frame_modes, impact_hammer, inertia_bench
from drake_racket.validation.hand import frame_and_hand
from drake_racket.validation.impacts import (
    head_clamped,
    moving_racket,
    oblique,
    static_stiffness,
)
from drake_racket.validation.outcome import Plan, Section, SectionResult
from drake_racket.validation.published import load_published
from drake_racket.validation.report import write_report
from drake_racket.validation.rows import Comparison, compare
from drake_racket.validation.spin import spin

SECTIONS: dict[str, tuple[str, Section]] = {
    "force_plate": ("Ball on a force plate", force_plate),
    "frame_modes": ("Modes of the frame", frame_modes),
    "impact_hammer": ("Impact hammer", impact_hammer),
    "inertia_bench": ("Inertia bench", inertia_bench),
    "frame_and_hand": ("Shops' numbers, six segments, and the hand", frame_and_hand),
    "head_clamped": ("Head clamped, normal impacts", head_clamped),
    "oblique": ("Head clamped, oblique impacts", oblique),
    "moving_racket": ("Free, held and clamped racket", moving_racket),
    "spin": ("Ball with radius and spin", spin),
    "static_stiffness": ("String-bed pressed slowly", static_stiffness),
}
"""Each section of the report has a name, a title, and the function that computes it."""

FILE = "validation.sqlite"


def validate(
    out: str | Path,
    *,
    only: Sequence[str] = (),
    plan: Plan | None = None,
    fresh: bool = False,
    progress: Report | None = None,
) -> list[Comparison]:
    """Computes the sections, compares, and writes the report to `out`.

    A finished section is kept in `out`; a later call with the same plan, package and versions takes
    it from there, so that an interrupted run goes on where it stopped.

    Args:
        only: names of sections; all if empty.
        fresh: compute every section anew.
        progress: called with the steps of each section; `task` is its title.

    Returns:
        The rows of the report.

    Raises:
        InputError: unknown section, or a directory that cannot be written.

    """
    out = Path(out)
    leave_if_imported_again()
    plan = plan or Plan()
    for name in only:
        if name not in SECTIONS:
            raise InputError("section", name, ", ".join(SECTIONS))
    names = [name for name in SECTIONS if not only or name in only]
    published = load_published()
    mark = fingerprint(plan)
    check_directory(out, "out")
    try:
        for directory in (out, out / "figures", out / "data"):
            directory.mkdir(parents=True, exist_ok=True)
        records = {}
        with closing(KeptResults(out / FILE, key="out", what="validation")) as store:
            for name in names:
                record = None if fresh else _read(store, out, name, mark)
                records[name] = record or _compute(store, out, name, mark, plan, progress)
        rows = [
            compare(entry, records[entry.section]["values"].get(entry.key))
            for entry in published
            if entry.section in records
        ]
        titles = {name: SECTIONS[name][0] for name in names}
        write_report(out, rows, records, titles, plan)
    except OSError as error:
        raise directory_error(out, error, "out") from None
    return rows


def fingerprint(plan: Plan) -> str:
    """Stands for all that decides the numbers: plan, package sources and data, versions."""
    return digest(as_text([plan.settings(), computation("validation")]).encode())


def _read(store: KeptResults, out: Path, name: str, mark: str) -> dict[str, Any] | None:
    """A finished section with the same fingerprint, if it and its files are there."""
    content = store.kept(name, mark)
    if content is None:
        return None
    record: dict[str, Any] = json.loads(content)
    files = [out / "figures" / figure["file"] for figure in record["figures"]]
    files += [out / "data" / file for file in record["datasets"]]
    return record if all(path.is_file() for path in files) else None


def _compute(
    store: KeptResults, out: Path, name: str, mark: str, plan: Plan, progress: Report | None
) -> dict[str, Any]:
    title, section = SECTIONS[name]

    def step(now: Progress) -> None:
        if progress is not None:
            progress(replace(now, task=title))

    step(Progress(title, 0, 1))
    found: SectionResult = section(plan, step)
    for key, dataset in found.datasets.items():
        write_netcdf(dataset, out / "data" / f"{name}_{key}.nc")
    for key, (_, figure) in found.figures.items():
        write_figure(figure, out / "figures" / f"{name}_{key}.png")
    record = {
        "values": found.values,
        "text": found.text,
        "figures": [
            {"file": f"{name}_{key}.png", "caption": caption}
            for key, (caption, _) in found.figures.items()
        ],
        "datasets": [f"{name}_{key}.nc" for key in found.datasets],
    }
    # last: its presence says that the section is whole
    store.keep(name, mark, json.dumps(record).encode())
    step(Progress(title, 1, 1))
    return record
