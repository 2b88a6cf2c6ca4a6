"""Pictures, made from data alone. One module per subject; `style` has what they share."""

from drake_racket.plots.log.impact import impact_figure

__all__ = ["impact_figure"]
