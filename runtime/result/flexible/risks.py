"""Findings about flexible bodies outside the validity range of their model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.risk import Risk

from .range_estimators import BENDING_ENERGY

if TYPE_CHECKING:
    from .model_range import ModelRange

#: Thresholds: slope, load ratio of a linear beam and spin in first frequencies, truncated bending
#: energy, shear, rotation of a section (rad), buckling, strain.
(
    MAX_SLOPE,
    MAX_LOAD_RATIO,
    MAX_SPIN_RATIO,
    MAX_MISSED_SHARE,
    MAX_SHEAR_ERROR,
    MAX_ROTATION,
    MIN_BUCKLING_RATIO,
    MAX_STRAIN,
) = 0.3, 0.1, 1.0, 0.1, 0.05, 1.4, -0.9, 0.05


def flexibility_risks(ranges: Sequence[ModelRange]) -> list[Risk]:
    """Objections to flexible models, one finding per kind, for the worst body."""
    rows = []
    for body_range in ranges:
        for text in body_range.said:
            means, _, remedy = text.partition("; ")
            rows.append(Risk("body-model", f'"{body_range.name}"', means, remedy))
    worst_first = sorted(
        ranges,
        key=lambda body_range: -max(body_range.slope, body_range.spin_ratio, body_range.load_ratio),
    )
    for kind in (
        _stiffening_risk,
        _slope_risk,
        _rotation_risk,
        _strain_risk,
        _shape_risk,
        _unshaped_risk,
        _buckling_risk,
        _lateral_buckling_risk,
        _shear_risk,
    ):
        kind_risks = [risk for body_range in worst_first if (risk := kind(body_range)) is not None]
        if kind_risks:
            more = f" (and {len(kind_risks) - 1} more bodies)" if len(kind_risks) > 1 else ""
            rows.append(replace(kind_risks[0], description=kind_risks[0].description + more))
    return rows


def _stiffening_risk(body: ModelRange) -> Risk | None:
    if body.stiffening:
        return None
    stiffening_remedy = 'use flexibility = "coupled"' if body.one_way else "leave stiffening on"
    limitation = (
        "has a one-way response without stiffening"
        if body.one_way
        else "has no geometric stiffening"
    )
    if body.spin_ratio > MAX_SPIN_RATIO:
        remedy = (
            stiffening_remedy if body.gamma or body.one_way else "model it by beams, or from a mesh"
        )
        return Risk(
            "stiffening", f'"{body.name}"',
            f'"{body.name}" {limitation} and spins at {body.spin_ratio:.2g} times its '
            "first frequency: its deflection grows without bound, while a real body stiffens",
            remedy, body.spin_ratio, MAX_SPIN_RATIO,
        )  # fmt: skip
    if body.load_ratio > MAX_LOAD_RATIO:
        return Risk(
            "stiffening", f'"{body.name}"',
            f'"{body.name}" {limitation}, but its loads change its stiffness by '
            f"{body.load_ratio:.0%} (gamma): relative error of deflections of the same size",
            stiffening_remedy, body.load_ratio, MAX_LOAD_RATIO,
        )  # fmt: skip
    return None


def _slope_risk(body: ModelRange) -> Risk | None:
    if body.slope <= MAX_SLOPE:
        return None
    return Risk(
        "slope",
        f'"{body.name}"',
        f'"{body.name}" bends to a slope of {body.slope:.2g} relative to its floating frame; above '
        f"{MAX_SLOPE:g} one frame is not accurate (error up to {body.frame_error:.0%} of the "
        f"deflection, {min(body.shortening_error, 9.99):.0%} of the foreshortening)",
        "split the body into welded parts",
        body.slope,
        MAX_SLOPE,
    )


def _strain_risk(body: ModelRange) -> Risk | None:
    if body.strain is None or body.strain <= MAX_STRAIN:
        return None
    return Risk(
        "strain", f'"{body.name}"',
        f'the strain of "{body.name}" reaches {body.strain:.2g}; above {MAX_STRAIN:g} its model, '
        "linear in the strain, is not valid", "check stiffness and loads", body.strain, MAX_STRAIN,
    )  # fmt: skip


def _rotation_risk(body: ModelRange) -> Risk | None:
    if body.turn <= MAX_ROTATION:
        return None
    return Risk(
        "turn",
        f'"{body.name}"',
        f'a section of "{body.name}" rotates by {body.turn:.2g} rad relative to its floating '
        "frame; the model is not valid above 1.5 rad",
        "split the body into welded parts",
        body.turn,
        MAX_ROTATION,
        "rad",
    )


def _shape_risk(body: ModelRange) -> Risk | None:
    if body.tail is None or body.tail <= MAX_MISSED_SHARE:
        return None
    is_beam = body.tail_of == BENDING_ENERGY
    basis_remedy = 'basis = "static+fixed-interface"' if is_beam else "static_shapes at its ends"
    return Risk(
        "shapes",
        f'"{body.name}"',
        f'the shapes of "{body.name}" miss {body.tail:.0%} of {"its" if is_beam else "the"} '
        f"{body.tail_of}",
        f"use more modes, or {basis_remedy}, which represents the loads of its hinges",
        body.tail,
        MAX_MISSED_SHARE,
    )


def _unshaped_risk(body: ModelRange) -> Risk | None:
    if body.unshaped is None:
        return None
    return Risk(
        "shapes", f'"{body.name}"',
        f'the loads of "{body.name}" would {body.unshaped}, but it has no shape functions for '
        "this and stays rigid", f"add {body.unshaped.direction} = 2 to its modes",
        body.unshaped.size, body.unshaped.limit, body.unshaped.unit,
    )  # fmt: skip


def _buckling_risk(body: ModelRange) -> Risk | None:
    if body.gamma is None or body.gamma[0] >= MIN_BUCKLING_RATIO:
        return None
    return Risk(
        "buckling", f'"{body.name}"',
        f'loads reduce the stiffness of "{body.name}" by {-body.gamma[0]:.0%} (gamma): it is at '
        "its buckling load, by compression or, with twist, by lateral buckling under bending",
        "increase its stiffness, or reduce its loads", body.gamma[0], MIN_BUCKLING_RATIO,
    )  # fmt: skip


def _lateral_buckling_risk(body: ModelRange) -> Risk | None:
    if body.sideways is None or body.sideways < -MIN_BUCKLING_RATIO:
        return None
    return Risk(
        "buckling", f'"{body.name}"',
        f'the loads of "{body.name}" reach {body.sideways:.0%} of the lateral buckling load, out '
        "of the plane of its shape functions, which the model does not include",
        "give it shapes of y, z and twist",
        body.sideways, -MIN_BUCKLING_RATIO,
    )  # fmt: skip


def _shear_risk(body: ModelRange) -> Risk | None:
    if body.shear is None or body.shear <= MAX_SHEAR_ERROR:
        return None
    return Risk(
        "shear", f'"{body.name}"',
        f'bending shapes of "{body.name}" are too short for a beam without shear: weighted error '
        f"of their frequencies about {min(body.shear, 1.0):.0%}",
        "use an elastic body", body.shear, MAX_SHEAR_ERROR,
    )  # fmt: skip
