"""Shapes that a user gives as expressions of x: values, exact derivatives, what they must be."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from ...expression.drive import value
from ...expression.expression import Expression, Name
from ...ir.graph import Graph, Node
from ...ir.tangent import derivative
from ..rules.messages import near

#: Names a shape may use: the place along the beam and the beam's length, both in m.
NAMES = ("x", "L")
#: Pieces of the beam in which a shape is sampled.
_PIECES = 32
#: Three-point Gauss rule on [0, 1]: places and weights.
_GAUSS = ((0.5 - math.sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + math.sqrt(0.15), 5 / 18))
#: A slope may differ by this share of its size from the integral of its derivative.
_CONTINUOUS = 1e-2
_ROUNDING = 1e-9

Values = tuple[float, float, float, float]


class ShapeFunction:
    """One shape f(x) of a beam of this length, with f', f'' and f''' by exact differentiation."""

    def __init__(self, expression: Expression, length: float) -> None:
        self.length = length
        self._x = Graph().element("x")
        graph = self._x.graph
        self._L = graph.element("L")
        nodes = [expression.build(graph, self._leaf)]
        for _ in range(3):
            nodes.append(derivative(nodes[-1], {self._x: 1}))
        self._nodes = nodes

    def _leaf(self, name: Name) -> Node:
        return self._x if name.text == "x" else self._L

    def __call__(self, x: float) -> Values:
        """(f, f', f'', f''') at x in m; nan or infinite where the mathematics has no value."""
        at = {self._x.number: x, self._L.number: self.length}
        f, slope, second, third = (value(n, lambda leaf: at[leaf.number]) for n in self._nodes)
        return f, slope, second, third


def shape_at(expression: Expression, x: float, length: float) -> Values:
    """(f, f', f'', f''') of a shape at x (m) of a beam of this length (m)."""
    return ShapeFunction(expression, length)(x)


def problem_with(expression: Expression, length: float, order: int) -> str | None:
    """Why an expression is no shape, None where it is one.

    `order` is that of the derivative that strains: 2 for deflections, 1 for twist and axial
    displacement; the derivatives below it must be continuous.
    """
    for name in expression.names:
        if name.text not in NAMES:
            return f"{name.text!r} is unknown{near(name.text, (*NAMES, 'pi'))}"
    shape = ShapeFunction(expression, length)
    return next(_findings(shape, length, order), None)


def _findings(shape: ShapeFunction, length: float, order: int) -> Iterator[str]:
    places = [length * k / _PIECES for k in range(_PIECES + 1)]
    samples = [shape(x) for x in places]
    for x, sample in zip(places, samples, strict=True):
        if not all(map(math.isfinite, sample[: order + 1])):
            words = "it, its slope or its curvature" if order == 2 else "it or its slope"
            yield f"{words} is not finite at x = {x:g} m; write a smooth shape such as (x/L)^2"
            return
    sizes = [max(abs(sample[k]) for sample in samples) for k in range(order + 1)]
    for k in range(order):
        allowed = max(_CONTINUOUS * sizes[k + 1] * length, _ROUNDING * sizes[k])
        if max(_gaps(shape, places, samples, k)) > allowed:
            what = ("it jumps", "its slope jumps")[k]
            yield (
                f"{what} somewhere along the beam; join the pieces smoothly, or divide the beam "
                "into two on a fixed hinge"
            )
            return
    if sizes[order] * length**order <= _ROUNDING * sizes[0]:
        yield "it does not deform the beam; rigid motion comes from the hinge, leave it out"


def _gaps(
    shape: ShapeFunction, places: list[float], samples: list[Values], k: int
) -> Iterator[float]:
    """Per piece, how far the k-th derivative's change is from the integral of the next one."""
    for (a, b), (before, after) in zip(pairwise(places), pairwise(samples), strict=True):
        integral = sum(w * (b - a) * shape(a + s * (b - a))[k + 1] for s, w in _GAUSS)
        yield abs(after[k] - before[k] - integral)
