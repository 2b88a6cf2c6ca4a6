"""Published numbers against the model: `drake-racket validate`.

`published` reads the numbers, `sections` computes the model's with the rigs, `rows` compares, `run`
goes through all of it, `report` writes it down.
"""

from drake_racket.validation.published import PublishedValue, load_published
from drake_racket.validation.rows import Comparison, compare
from drake_racket.validation.run import SECTIONS, validate

__all__ = ["SECTIONS", "Comparison", "PublishedValue", "compare", "load_published", "validate"]
