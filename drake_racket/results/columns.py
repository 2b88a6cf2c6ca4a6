"""Turns a time history into the columns of a table, and back."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError

if TYPE_CHECKING:
    import xarray


class Column(NamedTuple):
    """Holds one component of one variable over time: `variable` or `variable_label`."""

    name: str
    variable: str
    place: int | None  # of the label along the dimension beside time
    units: str
    is_angle: bool  # in rad or rad/s


@dataclass(frozen=True)
class Layout:
    """Says what a table does not show: how its columns make up a Dataset. JSON's own types.

    Attributes:
        attributes: of the Dataset.
        variables: name -> (dimension beside time or None, attributes).
        coordinates: dimension -> (labels or None for time, attributes).

    """

    attributes: dict[str, Any]
    variables: dict[str, tuple[str | None, dict[str, Any]]]
    coordinates: dict[str, tuple[list[Any] | None, dict[str, Any]]]

    def columns(self) -> list[Column]:
        """Gives every column but time, in the order of the variables and of their labels."""
        columns = []
        for variable, (dimension, attributes) in self.variables.items():
            units = str(attributes.get("units", "1"))
            lengths: list[str] = []
            labels: list[Any] = [None]
            if dimension is not None:
                named, about = self.coordinates.get(dimension, (None, {}))
                labels = named or []
                lengths = json.loads(about.get("prismatic", "[]"))
            for i, label in enumerate(labels):
                name = variable if dimension is None else f"{variable}_{label}"
                is_angle = units in ("rad", "rad/s") and label not in lengths
                place = None if dimension is None else i
                columns.append(Column(name, variable, place, units, is_angle))
        return columns

    def to_json(self) -> str:
        """Gives one line of ASCII."""
        return json.dumps(
            {
                "attributes": self.attributes,
                "variables": self.variables,
                "coordinates": self.coordinates,
            },
            default=_plain,
        )

    @staticmethod
    def from_json(text: str, where: str) -> Layout:
        """Reads what `to_json` wrote; raises InputError."""
        try:
            tree = json.loads(text)
            return Layout(
                dict(tree["attributes"]),
                {name: (dim, dict(attrs)) for name, (dim, attrs) in tree["variables"].items()},
                {name: (labels, dict(a)) for name, (labels, a) in tree["coordinates"].items()},
            )
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            raise InputError(
                f"{where}: metadata", "broken JSON", "the metadata of a history, as written"
            ) from None


def _plain(value: Any) -> Any:
    """NumPy's scalars and arrays (attributes read from a NetCDF file) as JSON's types."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} in the metadata of a history")


def layout_of(dataset: xarray.Dataset) -> Layout:
    """Gives the layout of a history; raises InputError for a Dataset that is none."""
    coordinates: dict[str, tuple[list[Any] | None, dict[str, Any]]] = {}
    for name, coordinate in dataset.coords.items():
        labels = None if name == "time" else coordinate.to_numpy().tolist()
        coordinates[str(name)] = labels, dict(coordinate.attrs)
    variables: dict[str, tuple[str | None, dict[str, Any]]] = {}
    for name, variable in dataset.data_vars.items():
        if variable.dims[:1] != ("time",) or variable.ndim > 2:
            raise InputError(f"history: {name}", variable.dims, "time, and at most one dimension")
        dimension = str(variable.dims[1]) if variable.ndim == 2 else None
        variables[str(name)] = dimension, dict(variable.attrs)
    if "time" not in coordinates:
        raise InputError("history", ", ".join(variables), "variables over time")
    return Layout(dict(dataset.attrs), variables, coordinates)


def values_of(dataset: xarray.Dataset, column: Column) -> NDArray[np.float64]:
    """Gives the numbers of one column, (n,)."""
    values = dataset[column.variable].to_numpy()
    return values if column.place is None else values[:, column.place]


def dataset_of(
    layout: Layout, numbers: Mapping[str, NDArray[np.float64]], where: str
) -> xarray.Dataset:
    """Puts the columns of a table (by name, with `time`) together.

    Raises:
        InputError: a column of the layout is missing.

    """
    import xarray

    def take(name: str) -> NDArray[np.float64]:
        if name not in numbers:
            raise InputError(f"{where}: column {name}", "nothing", "the columns its metadata names")
        return numbers[name]

    coordinates: dict[str, Any] = {}
    for name, (labels, attributes) in layout.coordinates.items():
        coordinates[name] = (name, take("time") if labels is None else labels, attributes)
    parts: dict[str, list[NDArray[np.float64]]] = {name: [] for name in layout.variables}
    for column in layout.columns():
        parts[column.variable].append(take(column.name))
    variables: dict[str, Any] = {}
    for name, (dimension, attributes) in layout.variables.items():
        if not parts[name]:
            raise InputError(f"{where}: {dimension}", "no labels", f"labels of {name}'s columns")
        if dimension is None:
            variables[name] = ("time", parts[name][0], attributes)
        else:
            variables[name] = (("time", dimension), np.stack(parts[name], axis=1), attributes)
    return xarray.Dataset(variables, coordinates, layout.attributes)
