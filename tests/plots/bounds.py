"""Finds texts of a figure that lie over each other, or stick out of it."""

from __future__ import annotations

from itertools import combinations
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

TOLERANCE = 1.5  # pixels at 100 dpi: boxes have some air


def _visible(figure: Any) -> list[Text]:
    """Texts that are drawn: not empty, not hidden with their axes or ticks."""
    found = []
    for axes in figure.axes:
        if not axes.axison:
            found += [axes.title, *axes.texts]
            continue
        found += [axes.title, axes.xaxis.label, axes.yaxis.label, *axes.texts]
        for axis, limits in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            low, high = sorted(limits)
            for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]:
                if low <= tick.get_loc() <= high:
                    found += [tick.label1, tick.label2]
        if axes.get_legend() is not None:
            found += axes.get_legend().get_texts()
    found += figure.texts + [t for legend in figure.legends for t in legend.get_texts()]
    found += [t for t in (figure._suptitle, figure._supxlabel) if t is not None]
    return [t for t in dict.fromkeys(found) if t.get_visible() and t.get_text().strip()]


def faults(figure: Any, *, ignore_inside: bool = False) -> list[str]:
    """What is wrong with a figure's texts, in words; nothing if all is well.

    Args:
        ignore_inside: texts within axes (numbers on a map) may lie over each other.

    """
    figure.set_dpi(100)
    FigureCanvasAgg(figure).draw()
    page = figure.bbox
    inside = {t for axes in figure.axes for t in axes.texts} if ignore_inside else set()
    boxes = [(t, t.get_window_extent()) for t in _visible(figure)]
    wrong = []
    for text, box in boxes:
        out = max(page.x0 - box.x0, box.x1 - page.x1, page.y0 - box.y0, box.y1 - page.y1)
        if out > TOLERANCE:
            wrong.append(f"{text.get_text()!r} sticks out by {out:.0f} px")
    for (a, box_a), (b, box_b) in combinations(boxes, 2):
        if a in inside and b in inside:
            continue
        width = min(box_a.x1, box_b.x1) - max(box_a.x0, box_b.x0)
        height = min(box_a.y1, box_b.y1) - max(box_a.y0, box_b.y0)
        if width > TOLERANCE and height > TOLERANCE:
            wrong.append(f"{a.get_text()!r} lies over {b.get_text()!r}")
    return wrong
