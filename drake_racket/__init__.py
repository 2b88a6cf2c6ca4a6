"""Tennis racket and ball impacts as Drake multibody systems.

The model is that of Glynn, King & Mitchell (2011), Sports Engineering 13(2):65-72,
doi:10.1007/s12283-010-0056-x. Compose it on your own plant with `add_racket`, `add_ball` and
`add_impact`, or run the ready-made case with `simulate`.

By subject: this package composes and simulates; `drake_racket.sweep` runs many cases,
`drake_racket.rigs` the paper's experiments, `drake_racket.identify` fits parameters to
measurements, `drake_racket.limbs` brings arms, `drake_racket.laws` has the equations,
`drake_racket.engines` what runs them, `drake_racket.plots` and `drake_racket.animation` pictures.
Names are loaded when they are first used; the stubs beside the packages (`__init__.pyi`) list them.
"""

import lazy_loader

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    """Loads what a name stands for (PEP 562)."""
    if name == "__version__":
        from importlib.metadata import version

        return version("drake-racket")
    return _load(name)
