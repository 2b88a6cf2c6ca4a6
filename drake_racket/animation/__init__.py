"""Animations are made from a time history: a page that moves, a GIF, an MP4."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
