"""Goes through the sections, keeps each as soon as it is finished, and writes the report."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from drake_racket.io.errors import InputError
from drake_racket.io.files import (
    check_directory,
    directory_error,
    write_figure,
    write_netcdf,
    write_text,
)
from drake_racket.io.fingerprint import environment
from drake_racket.io.shipped import data_directory, sdf_directory
from drake_racket.validation.frame import force_plate, frame_modes, impact_hammer, inertia_bench
from drake_racket.validation.impacts import (
    head_clamped,
    moving_racket,
    oblique,
    static_stiffness,
)
from drake_racket.validation.outcome import Outcome, Plan, Section
from drake_racket.validation.published import load_published
from drake_racket.validation.report import write_report
from drake_racket.validation.rows import Row, compare

SECTIONS: dict[str, tuple[str, Section]] = {
    "force_plate": ("Ball on a force plate", force_plate),
    "frame_modes": ("Modes of the frame", frame_modes),
    "impact_hammer": ("Impact hammer", impact_hammer),
    "inertia_bench": ("Inertia bench", inertia_bench),
    "head_clamped": ("Head clamped, normal impacts", head_clamped),
    "oblique": ("Head clamped, oblique impacts", oblique),
    "moving_racket": ("Free, held and clamped racket", moving_racket),
    "static_stiffness": ("String-bed pressed slowly", static_stiffness),
}

SectionProgress = Callable[[str, int, int], None]
"""Called with the section's title, the number of finished steps, and of all."""


def validate(
    out: Path,
    *,
    only: Sequence[str] = (),
    plan: Plan | None = None,
    fresh: bool = False,
    progress: SectionProgress | None = None,
) -> list[Row]:
    """Computes the sections, compares, and writes the report to `out`.

    A finished section is kept in `out`; a later call with the same plan, package and versions takes
    it from there, so that an interrupted run goes on where it stopped.

    Args:
        only: names of sections; all if empty.
        fresh: compute every section anew.

    Returns:
        The rows of the report.

    Raises:
        InputError: unknown section, or a directory that cannot be written.

    """
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
        kept = {}
        for name in names:
            record = None if fresh else _read(out, name, mark)
            kept[name] = record or _compute(out, name, mark, plan, progress)
        rows = [
            compare(entry, kept[entry.section]["values"].get(entry.key))
            for entry in published
            if entry.section in kept
        ]
        titles = {name: SECTIONS[name][0] for name in names}
        write_report(out, rows, kept, titles, plan)
    except OSError as error:
        raise directory_error(out, error, "out") from None
    return rows


def fingerprint(plan: Plan) -> str:
    """Stands for all that decides the numbers: plan, package sources and data, versions."""
    digest = hashlib.sha256(json.dumps(plan.settings(), sort_keys=True).encode())
    here = Path(__file__).resolve().parent.parent
    sources = [
        *here.rglob("*.py"),
        *data_directory().glob("*.yaml"),
        *sdf_directory().glob("*.sdf"),
    ]
    for path in sorted(sources):
        digest.update(path.name.encode() + path.read_bytes())
    digest.update(json.dumps([environment(), version("scipy")], sort_keys=True).encode())
    return digest.hexdigest()


def _record_path(out: Path, name: str) -> Path:
    return out / "data" / f"{name}.json"


def _read(out: Path, name: str, mark: str) -> dict[str, Any] | None:
    """A finished section with the same fingerprint, if it is there whole."""
    try:
        record = json.loads(_record_path(out, name).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(record, dict) or record.get("fingerprint") != mark:
        return None
    files = [out / "figures" / figure["file"] for figure in record["figures"]]
    files += [out / "data" / file for file in record["datasets"]]
    return record if all(path.is_file() for path in files) else None


def _compute(
    out: Path, name: str, mark: str, plan: Plan, progress: SectionProgress | None
) -> dict[str, Any]:
    title, section = SECTIONS[name]

    def step(done: int, total: int) -> None:
        if progress is not None:
            progress(title, done, total)

    step(0, 1)
    outcome: Outcome = section(plan, step)
    for key, dataset in outcome.datasets.items():
        write_netcdf(dataset, out / "data" / f"{name}_{key}.nc")
    for key, (_, figure) in outcome.figures.items():
        write_figure(figure, out / "figures" / f"{name}_{key}.png")
    record = {
        "fingerprint": mark,
        "values": outcome.values,
        "text": outcome.text,
        "figures": [
            {"file": f"{name}_{key}.png", "caption": caption}
            for key, (caption, _) in outcome.figures.items()
        ],
        "datasets": [f"{name}_{key}.nc" for key in outcome.datasets],
    }
    # last: its presence says that the section is whole
    write_text(json.dumps(record, indent=1) + "\n", _record_path(out, name))
    step(1, 1)
    return record
