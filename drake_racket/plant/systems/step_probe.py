"""The StepProbe looks at a simulation where each step begins."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from typing import Any

from pydrake.systems.framework import LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from drake_racket.plant.systems.scalars import on_float


@TemplateSystem.define("StepProbe_", scope=sys.modules[__name__])
def StepProbe_(T: Any) -> Any:
    """Gives the probe as a LeafSystem on the scalar type T; `StepProbe` is that on float."""

    class Impl(LeafSystem_[T]):
        """Calls a function when the derivatives at a wanted time are first evaluated.

        An integrator evaluates the derivatives at the beginning of a step anyway, after the events
        of that instant. What depends on accelerations costs next to nothing there; anywhere else
        Drake would have to solve for the accelerations once more.

        No ports, no state, no parameters. Attributes:
            wanted: the time (s) at which to call; NaN for never.
            read: the function; None for none, and once it is called.
        """

        def _construct(self, converter: Any = None) -> None:
            LeafSystem_[T].__init__(self, converter)
            self.wanted = math.nan
            self.read: Callable[[], None] | None = None

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            Impl._construct(self, converter=converter)

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            if self.read is not None and context.get_time() == self.wanted:
                read, self.read = self.read, None
                read()

    return Impl


StepProbe = on_float(StepProbe_)
