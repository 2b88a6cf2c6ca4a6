"""Sorts the public names by subject, from the stubs; it needs neither Drake nor griffe."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "drake_racket"

SUBJECTS: dict[str, tuple[str, tuple[str, ...]]] = {
    "run": (
        "Run an impact",
        (
            "simulation",
            "cases",
            "parameters.scenario",
            "parameters.limb_settings",
            "parameters.overrides",
            "results.impact",
            "results.history",
            "results.outputs",
            "results.loads",
            "results.audit",
            "laws.phases",
        ),
    ),
    "rackets": (
        "Rackets, balls and hands as data",
        ("parameters",),
    ),
    "compose": ("Put racket and ball on your plant", ("plant",)),
    "arms": ("Arms and strokes", ("limbs",)),
    "engines": ("Engines", ("engines",)),
    "derivatives": ("Derivatives and the best of many", ("derivatives", "optimise")),
    "logs": ("Logs and figures", ("results.formats", "plots")),
    "scripts": ("For scripts of your own: files, errors, processes", ("io", "pool", "store")),
}
"""Page -> its title, and the modules whose names stand on it; the longest match decides."""

PACKAGES = {
    "sweep": "Sweeps: many impacts as data",
    "rigs": "Rigs: the paper's experiments",
    "identify": "Identification: parameters from measurements",
    "compare": "Comparing rackets",
    "limbs": "Arms from files",
    "laws": "Laws: the equations as functions",
    "engines": "Engines, closer",
    "plots": "Figures",
    "animation": "Animations",
    "validation": "Validation",
}


@dataclass(frozen=True)
class PublicName:
    """A public name is where users import something from, and where it is written."""

    path: str  # drake_racket.add_racket
    module: str  # plant.racket
    source: str  # drake_racket.plant.racket.add_racket


def public_names(package: str = "") -> list[PublicName]:
    """Lists the names of the face, or of one package below it, as its stub has them."""
    folder = ROOT / PACKAGE / package
    text = (folder / "__init__.pyi").read_text(encoding="utf-8")
    base = f"{PACKAGE}.{package}" if package else PACKAGE
    found = []
    for module, name in re.findall(r"^from \.(\S+) import (\S+) as \S+$", text, re.MULTILINE):
        found.append(PublicName(f"{base}.{name}", module, f"{base}.{module}.{name}"))
    return found


def subject_of(name: PublicName) -> str:
    """Tells on which page a name of the face stands."""
    fits = [
        (len(prefix), page)
        for page, (_, prefixes) in SUBJECTS.items()
        for prefix in prefixes
        if f"{name.module}.".startswith(f"{prefix}.")
    ]
    if not fits:
        raise KeyError(f"{name.path}: no subject in manual/api.py for module {name.module}")
    return max(fits)[1]
