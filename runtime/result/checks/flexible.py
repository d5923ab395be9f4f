"""Checks of flexible bodies: the validity range of their model, before and after a run.

In the axes of a linear beam, spin reduces the stiffness, while the neglected foreshortening would
increase it by more.  For a clamped beam in the plane of its spin the relative reduction is about
(spin / first frequency)^2 (Kane, Ryan, Banerjee, Journal of Guidance, Control, and Dynamics 10,
1987).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ...discontinuities.cell_subdivision import MAX_STEP_ANGLE
from ..flexible.model_range import ModelRange, model_ranges
from ..flexible.momentum import modal_frequencies, modal_mass
from ..flexible.range_estimators import BENDING_ENERGY, has_second_order_terms, transverse_spin
from ..flexible.section_loads import FlexibleBodies
from ..observations import Observations
from .check import Check, MeasuringCheck, RunStart

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody
    from ..result_record import Record

#: Thresholds: slope, load ratio of a linear beam and spin in first frequencies, truncated bending
#: energy, shear, rotation of a section (rad), buckling, strain.
(
    MAX_SLOPE, MAX_LOAD_RATIO, MAX_SPIN_RATIO, MAX_MISSED_SHARE, MAX_SHEAR_ERROR, MAX_ROTATION,
    MIN_BUCKLING_RATIO, MAX_STRAIN,
) = 0.3, 0.1, 1.0, 0.1, 0.05, 1.4, -0.9, 0.05  # fmt: skip

#: Largest accepted ratio of the frequency of a load to that of the last shape.
_MAX_FREQUENCY_RATIO = 1.5


#: Remedy where one floating frame is not enough.
_LARGE_SLOPE_REMEDY = 'use kinematics = "exact" for a beam, or split the body into welded parts'


class ModelRangeCheck(MeasuringCheck[tuple[ModelRange, ...]]):
    """Known limitations of the models of flexible bodies; measures the range of all checks here."""

    def measure(self, result: Record) -> tuple[ModelRange, ...]:
        """Validity measures of each flexible body."""
        return model_ranges(result._flexible)

    def after(self, result: Record) -> Iterator[Risk]:
        """Risk of each limitation that is known before a body moves."""
        for body in self.measured(result):
            for text in body.said:
                means, _, remedy = text.partition("; ")
                yield Risk("body-model", f'"{body.name}"', means, remedy)


MODEL_RANGE = ModelRangeCheck()


def worst_risk(risks: Iterable[Risk | None]) -> Iterator[Risk]:
    """First risk of those of several bodies, with the number of others; nothing without any."""
    found = [risk for risk in risks if risk is not None]
    if found:
        more = f" (and {len(found) - 1} more bodies)" if len(found) > 1 else ""
        yield replace(found[0], description=found[0].description + more)


class _BodyCheck(Check):
    """Check of each flexible body, with one risk for the worst one."""

    @abstractmethod
    def _risk(self, body: ModelRange) -> Risk | None:
        """Risk of one body, or None."""

    def after(self, result: Record) -> Iterator[Risk]:
        """Risk of the worst body, with the number of others."""
        worst_first = sorted(
            MODEL_RANGE.measured(result),
            key=lambda body: -max(body.slope, body.spin_ratio, body.load_ratio),
        )
        yield from worst_risk(map(self._risk, worst_first))


class StiffeningCheck(_BodyCheck):
    """Bodies without geometric stiffening that spin fast or are loaded strongly."""

    def before(self, start: RunStart) -> Iterator[Risk]:
        """Risk of linear bodies whose stiffness changes too much by a spin that is known."""
        flexible = start.model.flexible_bodies
        linear = [name for name, body in flexible.items() if not has_second_order_terms(body)]
        if not linear:
            return
        bodies = FlexibleBodies(start.model, Observations(start.model, start.drive_path))
        for name in linear:
            first = float(modal_frequencies(flexible[name])[0])
            spin = transverse_spin(bodies.motion(name))
            ratio = spin / first if first > 0 else 0.0
            if ratio**2 > MAX_LOAD_RATIO:
                yield Risk(
                    "stiffening", f'"{name}"',
                    f'"{name}" has no geometric stiffening and will spin at {ratio:.2g} times its '
                    f"first frequency: stiffness error about {min(ratio**2, 9.99):.0%}",
                    "leave stiffening on", ratio, MAX_LOAD_RATIO**0.5, seen_before_run=True,
                )  # fmt: skip

    def _risk(self, body: ModelRange) -> Risk | None:
        if body.stiffening:
            return None
        remedy = 'use flexibility = "coupled"' if body.one_way else "leave stiffening on"
        kind = "a one-way response without" if body.one_way else "no geometric"
        if body.spin_ratio > MAX_SPIN_RATIO:
            if not (body.gamma or body.one_way):
                remedy = "model it by beams, or from a mesh"
            return Risk(
                "stiffening", f'"{body.name}"',
                f'"{body.name}" has {kind} stiffening and spins at {body.spin_ratio:.2g} times '
                "its first frequency: its deflection grows without bound, while a real body "
                "stiffens", remedy, body.spin_ratio, MAX_SPIN_RATIO,
            )  # fmt: skip
        if body.load_ratio > MAX_LOAD_RATIO:
            return Risk(
                "stiffening", f'"{body.name}"',
                f'"{body.name}" has {kind} stiffening, but its loads change its stiffness by '
                f"{body.load_ratio:.0%} (gamma): relative error of deflections of the same size",
                remedy, body.load_ratio, MAX_LOAD_RATIO,
            )  # fmt: skip
        return None


class SlopeCheck(_BodyCheck):
    """Bodies that bend too far for one floating frame."""

    def _risk(self, body: ModelRange) -> Risk | None:
        if body.slope <= MAX_SLOPE:
            return None
        return Risk(
            "slope", f'"{body.name}"',
            f'"{body.name}" bends to a slope of {body.slope:.2g} relative to its floating frame; '
            f"above {MAX_SLOPE:g} one frame is not accurate (error up to {body.frame_error:.0%} of "
            f"the deflection, {min(body.shortening_error, 9.99):.0%} of the foreshortening)",
            _LARGE_SLOPE_REMEDY, body.slope, MAX_SLOPE,
        )  # fmt: skip


class RotationCheck(_BodyCheck):
    """Bodies with a section that rotates too far in its frame."""

    def _risk(self, body: ModelRange) -> Risk | None:
        if body.turn <= MAX_ROTATION:
            return None
        return Risk(
            "turn", f'"{body.name}"',
            f'a section of "{body.name}" rotates by {body.turn:.2g} rad relative to its floating '
            "frame; the model is not valid above 1.5 rad",
            _LARGE_SLOPE_REMEDY, body.turn, MAX_ROTATION, "rad",
        )  # fmt: skip


class StrainCheck(_BodyCheck):
    """Bodies strained beyond their linear model."""

    def _risk(self, body: ModelRange) -> Risk | None:
        if body.strain is None or body.strain <= MAX_STRAIN:
            return None
        return Risk(
            "strain", f'"{body.name}"',
            f'the strain of "{body.name}" reaches {body.strain:.2g}; above {MAX_STRAIN:g} its '
            "model, linear in the strain, is not valid", "check stiffness and loads",
            body.strain, MAX_STRAIN,
        )  # fmt: skip


class ShapeCheck(_BodyCheck):
    """Shape functions that miss a part of the deformation, or cannot follow fast loads."""

    def before(self, start: RunStart) -> Iterator[Risk]:
        """Information on bodies whose last bending shape is slower than an expression of time.

        The load may be small, or act on another body; the result estimates the truncation error.
        """
        if not start.model.flexible_bodies:
            return
        settings = start.settings
        time_map = start.model.packed_scene.time_map(settings.t_start, settings.t_end)
        shortest = float(time_map.longest.min(initial=np.inf))
        for name, body in start.model.flexible_bodies.items() if np.isfinite(shortest) else ():
            last = _last_bending_frequency(body)
            ratio = MAX_STEP_ANGLE / shortest / last if last > 0 else 0.0
            if ratio > _MAX_FREQUENCY_RATIO:
                yield Risk(
                    "shapes", f'"{name}"',
                    f"{time_map.narrowest} changes at up to {MAX_STEP_ANGLE / shortest:.3g} rad/s, "
                    f'faster than the last shape of "{name}" ({last:.3g} rad/s) can respond',
                    "use more modes", ratio, _MAX_FREQUENCY_RATIO, invalidates=False,
                    seen_before_run=True,
                )  # fmt: skip

    def _risk(self, body: ModelRange) -> Risk | None:
        if body.tail is None or body.tail <= MAX_MISSED_SHARE:
            return None
        whose, remedy = "the", "static_shapes at its ends"
        if body.tail_of == BENDING_ENERGY:
            whose, remedy = "its", 'basis = "static+fixed-interface"'
        return Risk(
            "shapes", f'"{body.name}"',
            f'the shapes of "{body.name}" miss {body.tail:.0%} of {whose} {body.tail_of}',
            f"use more modes, or {remedy}, which represents the loads of its hinges",
            body.tail, MAX_MISSED_SHARE,
        )  # fmt: skip


class MissingShapeCheck(_BodyCheck):
    """Beams loaded in a direction without shape functions."""

    def _risk(self, body: ModelRange) -> Risk | None:
        if body.unshaped is None:
            return None
        return Risk(
            "shapes", f'"{body.name}"',
            f'the loads of "{body.name}" would {body.unshaped}, but it has no shape functions for '
            "this and stays rigid", f"add {body.unshaped.direction} = 2 to its modes",
            body.unshaped.size, body.unshaped.limit, body.unshaped.unit,
        )  # fmt: skip


class BucklingCheck(_BodyCheck):
    """Bodies at their buckling load."""

    def _risk(self, body: ModelRange) -> Risk | None:
        if body.gamma is None or body.gamma[0] >= MIN_BUCKLING_RATIO:
            return None
        return Risk(
            "buckling", f'"{body.name}"',
            f'loads reduce the stiffness of "{body.name}" by {-body.gamma[0]:.0%} (gamma): it is '
            "at its buckling load, by compression or, with twist, by lateral buckling under "
            "bending", "increase its stiffness, or reduce its loads",
            body.gamma[0], MIN_BUCKLING_RATIO,
        )  # fmt: skip


class LateralBucklingCheck(_BodyCheck):
    """Beams near a buckling load in directions without shape functions."""

    def _risk(self, body: ModelRange) -> Risk | None:
        if body.sideways is None or body.sideways < -MIN_BUCKLING_RATIO:
            return None
        return Risk(
            "buckling", f'"{body.name}"',
            f'the loads of "{body.name}" reach {body.sideways:.0%} of the lateral buckling load, '
            "out of the plane of its shape functions, which the model does not include",
            "give it shapes of y, z and twist", body.sideways, -MIN_BUCKLING_RATIO,
        )  # fmt: skip


class ShearCheck(_BodyCheck):
    """Beams with bending shapes that are too short without shear."""

    def _risk(self, body: ModelRange) -> Risk | None:
        if body.shear is None or body.shear <= MAX_SHEAR_ERROR:
            return None
        return Risk(
            "shear", f'"{body.name}"',
            f'bending shapes of "{body.name}" are too short for a beam without shear: weighted '
            f"error of their frequencies about {min(body.shear, 1.0):.0%}",
            "give shear_stiffness, or use an elastic body", body.shear, MAX_SHEAR_ERROR,
        )  # fmt: skip


FLEXIBILITY_CHECKS = (
    MODEL_RANGE, StiffeningCheck(), SlopeCheck(), RotationCheck(), StrainCheck(), ShapeCheck(),
    MissingShapeCheck(), BucklingCheck(), LateralBucklingCheck(), ShearCheck(),
)  # fmt: skip


def squared_frequencies(body: ModalBody) -> Array:
    """Squared angular frequencies (n,) of the single shapes in a fixed frame, rad^2/s^2.

    They are 0 for shapes without mass.
    """
    mass = modal_mass(body).diagonal()
    return np.divide(np.diag(body.K), mass, out=np.zeros(body.n), where=mass > 0)


def _last_bending_frequency(body: ModalBody) -> float:
    """Highest angular frequency of the bending shapes, or of all shapes without any, rad/s."""
    bending = [k for k, name in enumerate(body.modes) if name.startswith(("y", "z"))]
    return float(np.sqrt(np.max(squared_frequencies(body)[bending or slice(None)], initial=0.0)))
