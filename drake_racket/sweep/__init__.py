"""Sweeps run many impacts as data, with durable results. See docs/sweeps.md."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
