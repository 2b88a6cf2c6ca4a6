"""Writes what any fit leaves in its directory: files by name, then the report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drake_racket.identify.core.estimate import Estimate
from drake_racket.identify.core.result import FitResult
from drake_racket.identify.core.search import unit_text
from drake_racket.identify.report.parameter_file import Provenance, interval_text, write_parameters
from drake_racket.io.files import write_figure, write_netcdf, write_table, write_text

_WRITERS: dict[str, Any] = {
    ".yaml": lambda content, path: (
        write_text(content, path) if isinstance(content, str) else write_parameters(content, path)
    ),
    ".json": write_text,
    ".nc": write_netcdf,
    ".csv": write_table,
    ".png": write_figure,
}


def write_fit(
    out: Path,
    title: str,
    provenance: Provenance,
    files: Mapping[str, Any],
    sections: Sequence[str],
    intervals: str = "",
) -> list[Path]:
    """Writes a fit's files and its report; returns the paths.

    The report is written last, so that it stands for a whole set.

    Args:
        title: of the report.
        provenance: of the fitted values.
        files: content by name: parameters or text (yaml), text (json), Datasets (nc, csv),
            Figures (png).
        sections: of the report, without its figures.
        intervals: what else the report's first paragraph says.

    """
    out.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        _WRITERS[Path(name).suffix](content, out / name)
    figures = [name.removesuffix(".png") for name in files if name.endswith(".png")]
    head = (
        f"Data: `{provenance.data}`, sha256 `{provenance.sha256}`. Fitted on {provenance.date} by "
        f"{provenance.method}. RMS difference {provenance.rms}{intervals}."
    )
    pictures = [f"![{name.replace('_', ' ')}]({name}.png)" for name in figures]
    text = "\n\n".join([f"# {title}", head, "## Estimates", *sections, *pictures])
    write_text(text + "\n", out / "report.md")
    return [out / name for name in (*files, "report.md")]


def estimates_table(found: Mapping[str, Estimate], result: FitResult | None = None) -> str:
    """Tabulates value, standard error, interval; start and bounds where the result is given."""
    header = ["parameter", "unit", "estimate", "standard error", "95 % interval"]
    rows = []
    parameters = {} if result is None else {p.name: p for p in result.parameters}
    for name, e in found.items():
        text = interval_text(e).replace("95 % interval ", "").removesuffix(unit_text(e.unit))
        error = f"{e.standard_error:.3g}" if np.isfinite(e.standard_error) else "none"
        row = [name, e.unit, f"{e.value:.6g}", error, text]
        if name in parameters:
            p = parameters[name]
            row += [f"{p.start:.6g}", f"{p.lower:.4g} to {p.upper:.4g}"]
        rows.append(row)
    if parameters:
        header += ["start", "bounds"]
    return markdown_table(header, rows)


def warnings_section(warnings: Iterable[str]) -> list[str]:
    """Gives the warnings as a list, or that there are none."""
    lines = "\n".join(f"- {text}" for text in warnings)
    return ["## Warnings", lines or "None."]


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Gives a table in Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)
