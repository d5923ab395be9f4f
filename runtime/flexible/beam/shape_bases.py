"""Shape bases of a beam: assumed deformations in one direction as functions of x.

clamped-free, free-free and simply-supported are the eigenfunctions of those beams; a beam clamped
at an inner section has those of both parts, each zero on the other.  Static and fixed-interface
shapes (Craig and Bampton, AIAA J. 6, 1968) are the deflections under unit displacements of the
interfaces, and the eigenfunctions with all interfaces clamped; they represent any load on the
interfaces.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from .beam_data import BeamData
from .shape_functions import Eigenfunction, ExpressionShape, Shape, Sine
from .static_shapes import (
    bending_eigenfunctions,
    bending_static_shapes,
    end_slope_shape,
    rod_eigenfunctions,
    rod_static_shapes,
)

CLAMPED_FREE, FREE_FREE = "clamped-free", "free-free"
SIMPLY_SUPPORTED, STATIC, GIVEN = "simply-supported", "static+fixed-interface", "given"


@dataclass(frozen=True)
class Basis:
    """Shape basis in one direction.

    `base` (m) is the clamped section, `other_interfaces` (m) are further interfaces of static
    shapes. Simply supported shapes get a static shape with unit end slope at each of `slopes` (m).
    """

    kind: str
    base: float = 0.0
    other_interfaces: tuple[float, ...] = ()
    slopes: tuple[float, ...] = ()
    given_shapes: tuple[ExpressionShape, ...] = ()


def static_count(basis: Basis, direction: str) -> int:
    """Number of static shapes of a basis."""
    per_interface = 2 if direction in ("y", "z") else 1
    if basis.kind == STATIC:
        return per_interface * len(basis.other_interfaces)
    return len(basis.slopes) if direction in ("y", "z") else 0


def basis_shapes(data: BeamData, direction: str, basis: Basis, count: int) -> list[Shape]:
    """Shapes of a basis; `count` for each part of a beam that is clamped at an inner section."""
    if basis.kind == GIVEN:
        return list(basis.given_shapes)
    bends = direction in ("y", "z")
    if basis.kind == STATIC:
        statics = (bending_static_shapes if bends else rod_static_shapes)(
            data, direction, basis.base, basis.other_interfaces
        )
        interfaces = sorted({basis.base, *basis.other_interfaces})
        fixed_count = count - len(statics)
        if fixed_count <= 0:
            return list(statics[:count])
        return [*statics, *_fixed_interface_shapes(data, direction, interfaces, fixed_count)]
    return (_bending_shapes if bends else _rod_shapes)(data, direction, basis, count)


def _has_closed_form(data: BeamData) -> bool:
    """Whether the bending eigenfunctions are those of the uniform beam without shear."""
    return data.uniform and not data.has_shear


def _bending_shapes(data: BeamData, direction: str, basis: Basis, count: int) -> list[Shape]:
    length = data.length
    if basis.kind == CLAMPED_FREE:
        return _clamped_free_shapes(data, direction, basis.base, count)
    if basis.kind == FREE_FREE:
        if _has_closed_form(data):
            return [Eigenfunction(FREE_FREE, k, 0.0, length) for k in range(1, count + 1)]
        return list(bending_eigenfunctions(data, direction, count, skip=2))
    slopes = [end_slope_shape(data, direction, x) for x in basis.slopes][:count]
    sine_count = count - len(slopes)
    if _has_closed_form(data):
        sines = [Eigenfunction(SIMPLY_SUPPORTED, k, 0.0, length) for k in range(1, sine_count + 1)]
        return [*slopes, *sines]
    supports = (0.0, length)
    return [*slopes, *bending_eigenfunctions(data, direction, sine_count, supported=supports)]


def _clamped_free_shapes(data: BeamData, direction: str, base: float, count: int) -> list[Shape]:
    """Clamped-free shapes of the parts on both sides of the clamp, root side first."""
    length = data.length
    if _has_closed_form(data):
        shapes: list[Shape] = []
        for start, end, mirrored in ((0.0, base, True), (base, length, False)):
            if end > start:
                shapes += [
                    Eigenfunction(CLAMPED_FREE, k, start, end, mirrored, end == length)
                    for k in range(1, count + 1)
                ]
        return shapes
    sides = 2 if 0.0 < base < length else 1
    return list(bending_eigenfunctions(data, direction, sides * count, clamped=[base]))


def _rod_shapes(data: BeamData, direction: str, basis: Basis, count: int) -> list[Shape]:
    length = data.length
    if basis.kind == FREE_FREE:
        if data.uniform:
            return [Sine(FREE_FREE, k, 0.0, length) for k in range(1, count + 1)]
        return list(rod_eigenfunctions(data, direction, count, skip=1))
    base = basis.base
    if not data.uniform:
        sides = 2 if 0.0 < base < length else 1
        return list(rod_eigenfunctions(data, direction, sides * count, fixed=[base]))
    shapes: list[Shape] = []
    for start, end, mirrored in ((0.0, base, True), (base, length, False)):
        if end > start:
            shapes += [
                Sine("fixed-free", k, start, end, mirrored, end == length)
                for k in range(1, count + 1)
            ]
    return shapes


def _fixed_interface_shapes(
    data: BeamData, direction: str, interfaces: Sequence[float], count: int
) -> list[Shape]:
    """The `count` lowest eigenfunctions with all interfaces fixed."""
    bends = direction in ("y", "z")
    if not (_has_closed_form(data) if bends else data.uniform):
        if bends:
            return list(bending_eigenfunctions(data, direction, count, clamped=interfaces))
        return list(rod_eigenfunctions(data, direction, count, fixed=interfaces))
    candidates: list[tuple[float, int, Shape]] = []
    places = [0.0, *interfaces, data.length]
    for i, (start, end) in enumerate(itertools.pairwise(places)):
        if end <= start:
            continue
        left_fixed, right_fixed = i > 0, i < len(places) - 2
        for k in range(1, count + 1):
            shape = _span_shape(bends, k, start, end, left_fixed, right_fixed)
            candidates.append((shape.beta / (end - start), i, shape))
    candidates.sort(key=lambda candidate: candidate[:2])
    return [shape for _, _, shape in candidates[:count]]


def _span_shape(
    bends: bool, k: int, start: float, end: float, left_fixed: bool, right_fixed: bool
) -> Eigenfunction | Sine:
    """Shape k of a span fixed at its left end, its right end or both."""
    kinds = ("clamped-clamped", CLAMPED_FREE) if bends else ("fixed-fixed", "fixed-free")
    shape_type = Eigenfunction if bends else Sine
    kind = kinds[0 if left_fixed and right_fixed else 1]
    return shape_type(kind, k, start, end, not left_fixed, not right_fixed)
