"""Checks of exact beams: resolution by strains and segments, strain, shear, stretch."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING

from mstmm.risk import Risk

from ..flexible.exact_range import ExactRange, exact_ranges
from .check import Check, MeasuringCheck, RunStart
from .flexible import MAX_MISSED_SHARE, MAX_SHEAR_ERROR, MAX_STRAIN, worst_risk

if TYPE_CHECKING:
    from ..result_record import Record

#: Thresholds: rotation along a segment (rad; a run ends at 1.5), difference of Magnus steps of
#: orders 6 and 4 (of the length; the error of order 6 is below a tenth of it), energy share of the
#: last shape of a direction.
MAX_SEGMENT_ROTATION, MAX_MAGNUS_DIFFERENCE, MAX_LAST_SHARE = 1.0, 1e-2, 0.1


class ExactRangeCheck(MeasuringCheck[tuple[ExactRange, ...]]):
    """Measures of all checks here; it has no risk itself."""

    def measure(self, result: Record) -> tuple[ExactRange, ...]:
        """Range of each exact beam."""
        return exact_ranges(result._flexible)


EXACT_RANGE = ExactRangeCheck()


class _ExactBeamCheck(Check):
    """Check of each exact beam, with one risk for the one whose segments rotate most."""

    @abstractmethod
    def _risk(self, body: ExactRange) -> Risk | None:
        """Risk of one beam, or None."""

    def after(self, result: Record) -> Iterator[Risk]:
        """Risk of the worst beam, with the number of others."""
        ranges = sorted(EXACT_RANGE.measured(result), key=lambda body: -body.segment_rotation)
        yield from worst_risk(map(self._risk, ranges))


class SegmentRotationCheck(_ExactBeamCheck):
    """Beams that bend or twist nearly as far as a segment can."""

    def _risk(self, body: ExactRange) -> Risk | None:
        if body.segment_rotation <= MAX_SEGMENT_ROTATION:
            return None
        return Risk(
            "turn", f'"{body.name}"',
            f'a segment of "{body.name}" rotates by {body.segment_rotation:.2g} rad; a run stops '
            "where one rotates by more than 1.5 rad",
            "use more modes, which shortens the segments, or split the beam",
            body.segment_rotation, MAX_SEGMENT_ROTATION, "rad", invalidates=False,
        )  # fmt: skip


class MagnusCheck(_ExactBeamCheck):
    """Beams with segments too long for the Magnus series of their poses."""

    def _risk(self, body: ExactRange) -> Risk | None:
        if body.magnus_difference <= MAX_MAGNUS_DIFFERENCE:
            return None
        return Risk(
            "segments", f'"{body.name}"',
            f'positions on "{body.name}" by Magnus steps of orders 6 and 4 differ by '
            f"{body.magnus_difference:.1%} of its length: its segments are too long for its "
            "curvature",
            "use more modes, which shortens the segments, or split the beam",
            body.magnus_difference, MAX_MAGNUS_DIFFERENCE,
        )  # fmt: skip


class FibreStrainCheck(_ExactBeamCheck):
    """Beams strained beyond a linear law of stress and strain."""

    def _risk(self, body: ExactRange) -> Risk | None:
        if body.fibre_strain is None or body.fibre_strain <= MAX_STRAIN:
            return None
        return Risk(
            "strain", f'"{body.name}"',
            f'the outermost fibres of "{body.name}" are strained by {body.fibre_strain:.2g}; above '
            f"{MAX_STRAIN:g} its law, linear in the strain, is not valid",
            "check stiffness and loads", body.fibre_strain, MAX_STRAIN,
        )  # fmt: skip


class SectionLoadCheck(_ExactBeamCheck):
    """Beams whose strains differ from those of the section loads from equilibrium."""

    def _risk(self, body: ExactRange) -> Risk | None:
        if body.missed_energy is None or body.missed_energy <= MAX_MISSED_SHARE:
            return None
        return Risk(
            "shapes", f'"{body.name}"',
            f'bending moments of "{body.name}" from strain and from equilibrium differ by '
            f"{body.missed_energy:.0%} of their energy", 'use more modes, or basis = "legendre"',
            body.missed_energy, MAX_MISSED_SHARE,
        )  # fmt: skip


class LastShapeCheck(_ExactBeamCheck):
    """Beams whose last strain shape of a direction holds much of the energy."""

    def _risk(self, body: ExactRange) -> Risk | None:
        if body.last_share is None or body.last_share[0] <= MAX_LAST_SHARE:
            return None
        share, name = body.last_share
        return Risk(
            "shapes", f'"{body.name}"',
            f'{name}, the last strain shape of "{body.name}" in its direction, holds {share:.0%} '
            "of the energy: the motion is not resolved", "use more modes", share, MAX_LAST_SHARE,
            invalidates=False,
        )  # fmt: skip


class ShearRuleCheck(_ExactBeamCheck):
    """Beams without shear that are too thick for it."""

    def _risk(self, body: ExactRange) -> Risk | None:
        if body.shear is None or body.shear <= MAX_SHEAR_ERROR:
            return None
        return Risk(
            "shear", f'"{body.name}"',
            f'"{body.name}" is too thick for a beam without shear: weighted error of its '
            f"frequencies about {min(body.shear, 1.0):.0%}",
            'give shear_stiffness and kinematics = "second-order", or use an elastic body',
            body.shear, MAX_SHEAR_ERROR,
        )  # fmt: skip


class StretchCheck(Check):
    """Beams with a single stretch coordinate, which cannot follow a varying axial force."""

    def before(self, start: RunStart) -> Iterator[Risk]:
        """Advice for the first such beam."""
        yield from worst_risk(
            Risk(
                "stretch", f'"{name}"',
                f'"{name}" has one stretch coordinate, but its axial force varies along it',
                "use axial = 2 of its modes, or none", 1, 2, invalidates=False,
                seen_before_run=True,
            )
            for name, body in start.model.flexible_bodies.items()
            if body.exact is not None
            and sum(mode.startswith("axial") for mode in body.modes) == 1
        )  # fmt: skip


EXACT_BEAM_CHECKS = (
    SegmentRotationCheck(), MagnusCheck(), FibreStrainCheck(), SectionLoadCheck(), LastShapeCheck(),
    ShearRuleCheck(),
)  # fmt: skip
