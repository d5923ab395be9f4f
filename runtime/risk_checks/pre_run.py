"""Risks found before a run: in its scene, settings and initial state."""

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
    mass_ratio,
    redundancy_gap,
    singular_start,
    spin_stiffening,
    stiffness,
)

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..integrate.settings import Settings
    from ..run.trajectory import Trajectory


Check = Callable[["CompiledScene", "Settings", Array, Array], Iterable[Risk]]

#: (whether a check applies to a model, check).
_CHECKS: tuple[tuple[Callable[[CompiledScene], bool], Check], ...] = (
    (mass_ratio.applies_to, mass_ratio.mass_ratio_risks),
    (coordinate_singularity.applies_to, coordinate_singularity.coordinate_singularity_risks),
    (spin_stiffening.has_linear_bodies, spin_stiffening.spin_stiffening_risks),
    (excitation_bandwidth.applies_to, excitation_bandwidth.excitation_bandwidth_risks),
    (stiffness.applies_to, stiffness.explicit_step_count_risks),
    (singular_start.applies_to, singular_start.singular_start_risks),
    (redundancy_gap.applies_to, redundancy_gap.redundancy_gap_risks),
)

#: Checks that apply to a model, found before its first run.
_applicable_checks: WeakKeyDictionary[CompiledScene, tuple[Check, ...]] = WeakKeyDictionary()


@dataclass(frozen=True)
class PreRunFindings:
    """Findings before a run of a model.

    Attributes:
        risks: without that of a fixed step, which the result adds.
        risks_reported: whether the user is warned of them.
    """

    model: CompiledScene
    risks: Iterable[Risk]
    risks_reported: bool = True

    def attach_to(self, run: Trajectory, q: Array, u: Array) -> Trajectory:
        """Attach these findings, and those of its steps, to the run from q (nq,), u (nu,)."""
        risks = DeferredRisks(
            lambda: (*self.risks, *run.risks, *stiffness.stability_limited_risks(self.model, run))
        )
        return replace(run, start=(q, u), risks=risks, reported_risks=self.risks_reported)


def check_before_run(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> PreRunFindings:
    """Check a run from q (nq,), u (nu,) before it starts.

    Raises SceneError for invalid settings.
    """
    if model not in _applicable_checks:
        _applicable_checks[model] = tuple(check for applies, check in _CHECKS if applies(model))
    checks, notes = (
        _applicable_checks[model],
        unmapped_expression_notes(model.packed_scene, settings),
    )
    risks = DeferredRisks(
        lambda: (*notes, *(risk for check in checks for risk in check(model, settings, q, u)))
    )
    return PreRunFindings(model, risks)
