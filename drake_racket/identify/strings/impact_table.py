"""Tables of normal and of oblique impacts on the clamped head share what is here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]

SETTING_WIDTH = 1.5
"""m/s: shots at a point no further than this above the slowest of them are of one setting. Glynn et
al. 2011 set the cannon 3 m/s apart, to within 0.5 m/s."""


@dataclass(frozen=True, kw_only=True)
class ImpactTable:
    """Holds the impacts on the clamped head, m rows.

    Attributes:
        points: (m,) 1-9.
        speeds: (m,) m/s, of approach.
        sigma: (m,) standard deviation of each measured value, in its unit; None: not known.
        repeats: (m,) shots that a row is the mean of.
        where, sha256: the file, and the hash of its bytes.
        warnings: one line each.

    """

    points: NDArray[np.int64]
    speeds: Array
    sigma: Array | None
    repeats: NDArray[np.int64]
    where: str
    sha256: str
    warnings: tuple[str, ...] = ()

    def _means(self, kind: NDArray[np.int64], name: str, weight: Array, width: float) -> Self:
        """Shots of one kind and setting as one row: the mean, with its standard error.

        Other columns keep the value of a setting's first shot. Without repeats the table stays as
        it is.

        Args:
            kind: (m,) number of what the shots of a setting have in common.
            name: of the field that is averaged.
            weight: (m,) of a shot's error: it is s / weight, with one s for the whole table,
                estimated from all settings together. Not used where `sigma` is known.
            width: m/s; see SETTING_WIDTH.

        """
        groups = settings(kind, self.speeds, width)
        if len(groups) == len(self.points):
            return self
        values: Array = getattr(self, name)
        mean = np.array([values[g].mean() for g in groups])
        if self.sigma is not None:
            sigma = np.array([np.sqrt(np.sum(self.sigma[g] ** 2)) / len(g) for g in groups])
        else:
            inside = sum(
                float(np.sum((weight[g] * (values[g] - middle)) ** 2))
                for g, middle in zip(groups, mean, strict=True)
            )
            s = np.sqrt(inside / (len(self.points) - len(groups)))
            sigma = s / np.array([weight[g].mean() * np.sqrt(len(g)) for g in groups])
        new: dict[str, Any] = {
            name: mean,
            "speeds": np.array([self.speeds[g].mean() for g in groups]),
            "sigma": sigma if (sigma > 0.0).all() else None,
            "repeats": np.array([self.repeats[g].sum() for g in groups]),
        }
        return replace(self.rows([g[0] for g in groups]), **new)

    def rows(self, chosen: Sequence[int] | NDArray[np.bool_]) -> Self:
        """Gives the chosen rows: their numbers, or a mask (m,)."""
        columns: dict[str, Any] = {
            n: v[chosen] for n, v in vars(self).items() if isinstance(v, np.ndarray)
        }
        return replace(self, **columns)


def settings(kind: NDArray[np.int64], speeds: Array, width: float) -> list[list[int]]:
    """Gives rows of one kind whose speeds lie within `width` of the slowest of them, in order."""
    groups: list[list[int]] = []
    for i in np.lexsort((speeds, kind)):
        last = groups[-1][0] if groups else -1
        if groups and kind[i] == kind[last] and speeds[i] <= speeds[last] + width:
            groups[-1].append(int(i))
        else:
            groups.append([int(i)])
    return groups
