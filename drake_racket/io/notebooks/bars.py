"""Shows in a notebook, or on standard error, how far long work is."""

from __future__ import annotations

import sys
from html import escape
from typing import Any

from drake_racket.io.progress import Progress


class ProgressBar:
    """The bar shows how far long work is: pass one as `progress=` to a sweep, a fit, a comparison.

    In a notebook each task has a bar that moves; elsewhere one line on standard error is written
    over again.
    """

    def __init__(self) -> None:
        self._shown: dict[str, Any] = {}

    def __call__(self, progress: Progress) -> None:
        """Shows one step."""
        display = _notebook_display()
        if display is None:
            end = "\n" if progress.done >= progress.total else ""
            print(f"\r{_text(progress)}", end=end, file=sys.stderr, flush=True)
            return
        bar = _Bar(progress)
        if progress.task in self._shown:
            self._shown[progress.task].update(bar)
        else:
            self._shown[progress.task] = display(bar, display_id=True)


def _text(progress: Progress) -> str:
    left = progress.time_left()
    waiting = "" if left is None or progress.done >= progress.total else f", {left:.0f} s left"
    failed = f", {progress.failed} failed" if progress.failed else ""
    return f"{progress.task}: {progress.done:g} of {progress.total:g}{failed}{waiting}"


class _Bar:
    def __init__(self, progress: Progress) -> None:
        self._progress = progress

    def __repr__(self) -> str:
        return _text(self._progress)

    def _repr_html_(self) -> str:
        now = self._progress
        share = f'value="{now.done:g}" max="{now.total:g}"'
        return f"<div><progress {share}></progress> {escape(_text(now))}</div>"


def _notebook_display() -> Any:
    """IPython's `display` where a notebook runs this; None elsewhere."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    if shell is None or "IPKernelApp" not in shell.config:
        return None
    return ipython.display.display  # type: ignore[union-attr]
