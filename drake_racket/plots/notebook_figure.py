"""Makes figures that a notebook shows when one is the value of a cell."""

from __future__ import annotations

import io

from matplotlib.figure import Figure


class NotebookFigure(Figure):
    """The figure is matplotlib's, which shows itself in notebooks without pyplot.

    pyplot keeps every figure that it makes until it is closed; these are made without it.
    """

    def _repr_png_(self) -> bytes:
        picture = io.BytesIO()
        self.savefig(picture, format="png")
        return picture.getvalue()
