"""User-defined shape functions as expressions of x: values, exact derivatives, and checks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from ...expression.derivatives import node_value
from ...expression.expression import Expression, Name
from ...ir.differentiation import derivative
from ...ir.graph import Graph, Node
from ..validators.validation_messages import did_you_mean

#: Names in shape functions: the position along the beam and the length of the beam, both in m.
SHAPE_NAMES = ("x", "L")
#: Intervals of the beam in which a shape function is sampled.
_SAMPLE_INTERVALS = 32
#: Three-point Gauss rule on [0, 1]: points and weights.
_GAUSS_RULE = ((0.5 - math.sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + math.sqrt(0.15), 5 / 18))
#: Largest difference of a derivative from the integral of the next one, relative to the latter.
_MAX_RELATIVE_GAP = 1e-2
_MAX_RELATIVE_ROUNDING = 1e-9

Values = tuple[float, float, float, float]


class ShapeFunction:
    """Shape function f(x) of a beam of given length (m), with exact derivatives f', f'', f'''."""

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
        """Values (f, f', f'', f''') at x (m); nan or infinite where there is no finite value."""
        leaf_values = {self._x.number: x, self._L.number: self.length}
        f, slope, second, third = (
            node_value(n, lambda leaf: leaf_values[leaf.number]) for n in self._nodes
        )
        return f, slope, second, third


def shape_at(expression: Expression, x: float, length: float) -> Values:
    """Values (f, f', f'', f''') of a shape function at x (m) of a beam of given length (m)."""
    return ShapeFunction(expression, length)(x)


def shape_problem(expression: Expression, length: float, order: int) -> str | None:
    """Message about an expression that is no shape function; None for valid ones.

    `order` is the order of the derivative in the strain: 2 for deflections, 1 for twist and axial
    displacement.  The derivatives of lower order must be continuous.
    """
    for name in expression.names:
        if name.text not in SHAPE_NAMES:
            return f"{name.text!r} is unknown{did_you_mean(name.text, (*SHAPE_NAMES, 'pi'))}"
    shape = ShapeFunction(expression, length)
    return next(_shape_problems(shape, length, order), None)


def _shape_problems(shape: ShapeFunction, length: float, order: int) -> Iterator[str]:
    sample_points = [length * k / _SAMPLE_INTERVALS for k in range(_SAMPLE_INTERVALS + 1)]
    samples = [shape(x) for x in sample_points]
    for x, sample in zip(sample_points, samples, strict=True):
        if not all(map(math.isfinite, sample[: order + 1])):
            quantities = "the value, slope or curvature" if order == 2 else "the value or slope"
            yield f"{quantities} is not finite at x = {x:g} m; use a smooth shape such as (x/L)^2"
            return
    sizes = [max(abs(sample[k]) for sample in samples) for k in range(order + 1)]
    for k in range(order):
        allowed = max(_MAX_RELATIVE_GAP * sizes[k + 1] * length, _MAX_RELATIVE_ROUNDING * sizes[k])
        if max(_derivative_gaps(shape, sample_points, samples, k)) > allowed:
            defect = ("the value jumps", "the slope jumps")[k]
            yield (
                f"{defect} along the beam; join the pieces smoothly, or divide the beam "
                "into two on a fixed hinge"
            )
            return
    if sizes[order] * length**order <= _MAX_RELATIVE_ROUNDING * sizes[0]:
        yield "the shape does not deform the beam; leave it out, the hinge gives rigid motion"


def _derivative_gaps(
    shape: ShapeFunction, places: list[float], samples: list[Values], k: int
) -> Iterator[float]:
    """Difference per interval of the k-th derivative from the integral of the next one."""
    for (a, b), (start_sample, end_sample) in zip(pairwise(places), pairwise(samples), strict=True):
        integral = sum(w * (b - a) * shape(a + s * (b - a))[k + 1] for s, w in _GAUSS_RULE)
        yield abs(end_sample[k] - start_sample[k] - integral)
