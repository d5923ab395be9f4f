"""Laws and modes so fast that an explicit method will need very many steps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from mstmm.arrays import Array
from mstmm.errors import MstmmError
from mstmm.risk import Risk

from ..integrate.steppers import AUTO, get
from ..run import classical, second_opinion
from ..run.fastest import Fastest, may_be_fast
from .shapes import squares

if TYPE_CHECKING:
    from ..engine.compiled import Compiled
    from ..integrate.settings import Settings

#: |lambda| times the time of a run from which on the user is told.
_MANY = 2e4

#: h |lambda| of the longest steps of explicit methods that are stable, about.
_STABLE = 3.0


def concerns(model: Compiled) -> bool:
    """Whether there are any."""
    return _may_be(model, 0.0)


def _may_be(model: Compiled, rate: float) -> bool:
    """Whether laws or shapes may move as fast as that, 1/s."""
    fast = (squares(body).max(initial=0.0) > rate * rate for body in model.flexible.values())
    return may_be_fast(model.scene, rate) or any(fast)


def many_steps(model: Compiled, settings: Settings, q: Array, u: Array) -> Iterator[Risk]:
    """Of adaptive steps of an explicit method that was asked for by name."""
    method, span = settings.method, settings.t_end - settings.t_start
    others = (AUTO, *classical.METHODS, *second_opinion.METHODS)
    if settings.step is not None or method in others or get(method).implicit:
        return
    if not (span > 0 and _may_be(model, _MANY / span)):
        return
    try:
        rate = Fastest(model.looped, model.looped.start_memory()).rate(settings.t_start, q, u)
    except MstmmError:  # a scene without tangent, or a start that the run itself will blame
        return
    if rate * span > _MANY:
        yield Risk(
            "stiff", "",
            f"springs, dampers or shapes move at {rate:.2g} 1/s, which holds {method} to about "
            f"{rate * span / _STABLE:.1g} steps in {span:.3g} s",
            'method = "auto" or "rodas4p2" may be faster', rate * span, _MANY, doubt=False,
            before=True,
        )  # fmt: skip
