"""Risks that are seen before a run: in its scene, its settings, and its start."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from mstmm.array_validation import Array
from mstmm.risk import DeferredRisks, Risk

from ..run.run_notes import unmapped_expression_notes
from . import (
    coordinate_singularity,
    excitation_bandwidth,
    loop_misfit,
    mass_ratio,
    singular_start,
    spin_stiffening,
    stiffness,
)

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..integrate.settings import Settings
    from ..run.trajectory import Trajectory


Guard = Callable[["CompiledScene", "Settings", Array, Array], Iterable[Risk]]

#: Whether a scene gives reason to look, and what looks.
_GUARDS: tuple[tuple[Callable[[CompiledScene], bool], Guard], ...] = (
    (mass_ratio.applies_to, mass_ratio.mass_ratio_risks),
    (coordinate_singularity.applies_to, coordinate_singularity.coordinate_singularity_risks),
    (spin_stiffening.has_linear_bodies, spin_stiffening.spin_stiffening_risks),
    (excitation_bandwidth.applies_to, excitation_bandwidth.excitation_bandwidth_risks),
    (stiffness.applies_to, stiffness.explicit_step_count_risks),
    (singular_start.applies_to, singular_start.singular_start_risks),
    (loop_misfit.applies_to, loop_misfit.loop_misfit_risks),
)

#: The guards that the scene of a model gives reason for, found before its first run.
_concerned: WeakKeyDictionary[CompiledScene, tuple[Guard, ...]] = WeakKeyDictionary()


@dataclass(frozen=True)
class PreRunFindings:
    """What is known of a run of a model at its start: risks, but for that of its fixed step, which
    the result knows; whether its user wants to be told of them."""

    model: CompiledScene
    risks: Iterable[Risk]
    told: bool = True

    def given(self, run: Trajectory, q: Array, u: Array) -> Trajectory:
        """The run from (nq,), (nu,) with what was known of it, and what its steps tell."""
        risks = DeferredRisks(
            lambda: (*self.risks, *run.risks, *stiffness.stability_limited_risks(self.model, run))
        )
        return replace(run, start=(q, u), risks=risks, told=self.told)


def check_before_run(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> PreRunFindings:
    """Look at a run from (nq,), (nu,) before it is made.

    Raises SceneError for settings that no run can have.
    """
    if model not in _concerned:
        _concerned[model] = tuple(guard for concerns, guard in _GUARDS if concerns(model))
    guards, known = _concerned[model], unmapped_expression_notes(model.packed, settings)
    found = DeferredRisks(
        lambda: (*known, *(x for guard in guards for x in guard(model, settings, q, u)))
    )
    return PreRunFindings(model, found)
