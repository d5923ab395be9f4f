"""Risks that are seen before a run: in its scene, its settings, and its start."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from mstmm.arrays import Array
from mstmm.risk import DeferredRisks, Risk

from ..run.notes import foreseen
from . import branches, fast, heavy, locked, misfit, shapes, spun

if TYPE_CHECKING:
    from ..engine.compiled import Compiled
    from ..integrate.settings import Settings
    from ..run.trajectory import Trajectory


Guard = Callable[["Compiled", "Settings", Array, Array], Iterable[Risk]]

#: Whether a scene gives reason to look, and what looks.
_GUARDS: tuple[tuple[Callable[[Compiled], bool], Guard], ...] = (
    (heavy.concerns, heavy.lost_digits), (locked.concerns, locked.near_lock),
    (spun.concerns, spun.linear_bodies), (shapes.concerns, shapes.too_few),
    (fast.concerns, fast.many_steps), (branches.concerns, branches.at_a_branch),
    (misfit.concerns, misfit.nearly_redundant),
)  # fmt: skip

#: The guards that the scene of a model gives reason for, found before its first run.
_concerned: WeakKeyDictionary[Compiled, tuple[Guard, ...]] = WeakKeyDictionary()


@dataclass(frozen=True)
class Start:
    """What is known of a run of a model at its start: risks, but for that of its fixed step, which
    the result knows; whether its user wants to be told of them."""

    model: Compiled
    risks: Iterable[Risk]
    told: bool = True

    def given(self, run: Trajectory, q: Array, u: Array) -> Trajectory:
        """The run from (nq,), (nu,) with what was known of it, and what its steps tell."""
        risks = DeferredRisks(lambda: (*self.risks, *run.risks, *fast.held_back(self.model, run)))
        return replace(run, start=(q, u), risks=risks, told=self.told)


def look(model: Compiled, settings: Settings, q: Array, u: Array) -> Start:
    """Look at a run from (nq,), (nu,) before it is made.

    Raises SceneError for settings that no run can have.
    """
    if model not in _concerned:
        _concerned[model] = tuple(guard for concerns, guard in _GUARDS if concerns(model))
    guards, known = _concerned[model], foreseen(model.packed, settings)
    found = DeferredRisks(
        lambda: (*known, *(x for guard in guards for x in guard(model, settings, q, u)))
    )
    return Start(model, found)
