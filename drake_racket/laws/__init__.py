"""The laws of the model are pure functions: they run on floats, on AutoDiffXd and compiled."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
