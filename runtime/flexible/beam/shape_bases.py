"""Shape bases of a beam: which functions of x stand for its deformation in one direction.

clamped-free, free-free and simply-supported are the eigenfunctions of those beams; a beam clamped
at an inner section has those of both parts, each zero on the other.  Static and fixed-interface
shapes (Craig and Bampton, AIAA J. 6, 1968) are the deflections under unit displacements of the
interfaces, and the eigenfunctions with all interfaces clamped: they carry any load at them.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from .beam_data import BeamData
from .expression_shapes import ExpressionShape
from .shape_functions import Eigenfunction, Shape, Sine
from .static_shapes import (
    bending_eigenfunctions,
    bending_statics,
    end_slope,
    rod_eigenfunctions,
    rod_statics,
)

CLAMPED_FREE, FREE_FREE = "clamped-free", "free-free"
SIMPLY_SUPPORTED, STATIC, GIVEN = "simply-supported", "static+fixed-interface", "given"


@dataclass(frozen=True)
class Basis:
    """A choice of shapes in one direction.

    `base` (m) is the section that clamped shapes hold, `others` the further interfaces of static
    shapes; simply supported shapes get a static shape with unit end slope at each of `slopes`.
    """

    kind: str
    base: float = 0.0
    others: tuple[float, ...] = ()
    slopes: tuple[float, ...] = ()
    given: tuple[ExpressionShape, ...] = ()


def static_count(basis: Basis, direction: str) -> int:
    """How many of the shapes are static ones."""
    per_interface = 2 if direction in ("y", "z") else 1
    if basis.kind == STATIC:
        return per_interface * len(basis.others)
    return len(basis.slopes) if direction in ("y", "z") else 0


def shapes_of(data: BeamData, direction: str, basis: Basis, count: int) -> list[Shape]:
    """`count` shapes; of a beam clamped at an inner section `count` for each part."""
    if basis.kind == GIVEN:
        return list(basis.given)
    bends = direction in ("y", "z")
    if basis.kind == STATIC:
        statics = (bending_statics if bends else rod_statics)(
            data, direction, basis.base, basis.others
        )
        held = sorted({basis.base, *basis.others})
        rest = count - len(statics)
        fixed = _fixed_interface(data, direction, held, rest) if rest > 0 else []
        return [*statics[:count], *fixed]
    return (_bending if bends else _rod)(data, direction, basis, count)


def _bending(data: BeamData, direction: str, basis: Basis, count: int) -> list[Shape]:
    length = data.length
    if basis.kind == CLAMPED_FREE:
        return _parts(data, direction, basis.base, count)
    if basis.kind == FREE_FREE:
        if data.uniform:
            return [Eigenfunction(FREE_FREE, k, 0.0, length) for k in range(1, count + 1)]
        return list(bending_eigenfunctions(data, direction, count, skip=2))
    slopes = [end_slope(data, direction, x) for x in basis.slopes][:count]
    rest = count - len(slopes)
    if data.uniform:
        sines = [Eigenfunction(SIMPLY_SUPPORTED, k, 0.0, length) for k in range(1, rest + 1)]
        return [*slopes, *sines]
    supports = (0.0, length)
    return [*slopes, *bending_eigenfunctions(data, direction, rest, supported=supports)]


def _parts(data: BeamData, direction: str, base: float, count: int) -> list[Shape]:
    """Clamped-free shapes of what lies on either side of the clamp, root side first."""
    length = data.length
    if data.uniform:
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


def _rod(data: BeamData, direction: str, basis: Basis, count: int) -> list[Shape]:
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


def _fixed_interface(
    data: BeamData, direction: str, held: Sequence[float], count: int
) -> list[Shape]:
    """The `count` lowest eigenfunctions with all interfaces held."""
    bends = direction in ("y", "z")
    if not data.uniform:
        if bends:
            return list(bending_eigenfunctions(data, direction, count, clamped=held))
        return list(rod_eigenfunctions(data, direction, count, fixed=held))
    found: list[tuple[float, int, Shape]] = []
    places = [0.0, *held, data.length]
    for i, (start, end) in enumerate(itertools.pairwise(places)):
        if end <= start:
            continue
        left, right = i > 0, i < len(places) - 2
        for k in range(1, count + 1):
            shape = _span(bends, k, start, end, left, right)
            found.append((shape.beta / (end - start), i, shape))
    return [shape for _, _, shape in sorted(found, key=lambda one: one[:2])[:count]]


def _span(
    bends: bool, k: int, start: float, end: float, left: bool, right: bool
) -> Eigenfunction | Sine:
    """Shape k of a span held at its left end, its right end or both."""
    kinds = ("clamped-clamped", CLAMPED_FREE) if bends else ("fixed-fixed", "fixed-free")
    make = Eigenfunction if bends else Sine
    return make(kinds[0 if left and right else 1], k, start, end, not left, not right)
