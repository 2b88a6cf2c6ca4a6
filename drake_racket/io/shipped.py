"""Tells where the shipped files are, from a wheel and from an editable install alike."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydrake.multibody.parsing import PackageMap

_HERE = Path(__file__).resolve().parent.parent
_DATA = _HERE / "parameters" / "data"


def data_directory() -> Path:
    """Gives the directory of the parameter files (YAML)."""
    return _DATA


def sdf_directory() -> Path:
    """Gives the directory of the SDF models, the root of `package://drake_racket/`.

    A wheel carries it inside the package; a source tree has it beside the package.
    """
    inside = _HERE / "sdf"
    return inside if inside.is_dir() else _HERE.parent / "sdf"


def studies_directory() -> Path:
    """Gives the directory of the studies; a wheel and a source tree have it as the models."""
    inside = _HERE / "studies"
    return inside if inside.is_dir() else _HERE.parent / "studies"


def add_to_package_map(package_map: PackageMap) -> None:
    """Makes `package://drake_racket/racket_tour.sdf` and the other models known to a Parser."""
    if not package_map.Contains("drake_racket"):
        package_map.Add("drake_racket", str(sdf_directory()))
