"""Engines turn a case into a trajectory: Drake itself, or loops that are compiled."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
