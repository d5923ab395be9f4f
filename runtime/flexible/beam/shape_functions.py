"""Shape functions along a beam with derivatives, accurate for any number of half-waves.

The eigenfunctions of the uniform beam are sums of cos, sin, cosh and sinh of beta x/l.  The growing
exponentials of cosh and sinh cancel up to a remainder given by the boundary conditions, which is
written as an exponential that decays from the far end:

    phi = g e^(-beta (1 - xi)) + (1 + sigma)/2 e^(-beta xi) + s (cos(beta xi) - sigma sin(beta xi))

with xi = x/l.  From cosh - sigma sinh = (1 - sigma)/2 e^(beta xi) + (1 + sigma)/2 e^(-beta xi)
follows g = (1 - sigma)/2 e^beta, which is computed from the quotient of sigma without cancellation.
Each is scaled to int phi^2 dxi = 1.  Euler-Bernoulli theory, e.g. Rao, Vibration of Continuous
Systems, ch. 11.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.expression.expression import Expression, Name
from mstmm.ir.differentiation import derivative
from mstmm.ir.graph import Graph
from mstmm.ir.operations import OPERATIONS
from mstmm.ir.terms import Node, dependencies

_SQRT2 = math.sqrt(2.0)


class Shape(Protocol):
    """Function of x on 0 <= x <= length, with its derivatives."""

    @property
    def breaks(self) -> tuple[float, ...]:
        """Positions (m) between which the function is smooth, with both ends of its support."""

    @property
    def density(self) -> float:
        """Half-waves per metre, 0 for a low polynomial; sets the number of Gauss points."""

    def __call__(self, x: Array, d: int = 0) -> Array:
        """Derivative of order `d` (0 to 4) at every x (m)."""


@dataclass(frozen=True)
class _Constants:
    beta: float
    sigma: float
    growing: float  #: g
    sign: float  #: s


@lru_cache(maxsize=4096)
def wave_number(kind: str, number: int) -> float:
    """Dimensionless wave number beta of an eigenfunction of the uniform beam.

    Root of cos b = -sech b ("clamped-free") or cos b = +sech b ("free-free", "clamped-clamped"),
    by Newton's method on the equation without growing terms.
    """
    sign = 1.0 if kind == "clamped-free" else -1.0
    b = (number - 0.5 if kind == "clamped-free" else number + 0.5) * math.pi
    for _ in range(60):
        decaying = math.exp(-b)
        sech = 2.0 * decaying / (1.0 + decaying * decaying)
        step = (math.cos(b) + sign * sech) / (math.sin(b) + sign * sech * math.tanh(b))
        b += step
        if abs(step) <= 4e-16 * b:
            break
    return b


@lru_cache(maxsize=4096)
def _constants(kind: str, number: int) -> _Constants:
    b = wave_number(kind, number)
    e, c, s = math.exp(-b), math.cos(b), math.sin(b)
    if kind == "clamped-free":
        divisor = 1.0 - e * e + 2.0 * e * s
        return _Constants(b, (1.0 + e * e + 2.0 * e * c) / divisor, (s - c - e) / divisor, -1.0)
    divisor = 1.0 - e * e - 2.0 * e * s
    return _Constants(
        b,
        (1.0 + e * e - 2.0 * e * c) / divisor,
        (c - s - e) / divisor,
        1.0 if kind == "free-free" else -1.0,
    )


#: sin(k pi/2) by k modulo 4; cos(k pi/2) is the next entry.
_QUARTER_SINE = (0.0, 1.0, 0.0, -1.0)


@dataclass(frozen=True)
class _Eigenfunction:
    """Function of xi = 0..1 on start <= x <= end (m), zero outside; `mirrored`: xi from `end`."""

    kind: str
    number: int
    start: float
    end: float
    mirrored: bool = False
    closed: bool = True  #: whether `end` belongs to the span

    @property
    def breaks(self) -> tuple[float, ...]:
        return (self.start, self.end)

    def _locate(self, x: Array) -> tuple[float, Array, NDArray[np.bool_]]:
        """Length of the span, xi in 0..1, and whether x belongs to the span."""
        span = self.end - self.start
        xi = ((self.end - x) if self.mirrored else (x - self.start)) / span
        inside = (x >= self.start) & ((x <= self.end) if self.closed else (x < self.end))
        return span, np.clip(xi, 0.0, 1.0), inside

    def _sign(self, d: int) -> float:
        """Sign of a derivative of order d by x relative to xi."""
        return -1.0 if self.mirrored and d % 2 else 1.0


class Eigenfunction(_Eigenfunction):
    """Bending eigenfunction of a uniform beam on start <= x <= end (m), zero outside.

    `kind` is "clamped-free" (clamped at `start`, or at `end` if `mirrored`), "free-free",
    "clamped-clamped" or "simply-supported".
    """

    @property
    def density(self) -> float:
        return (self.number + 1.0) / (self.end - self.start)

    @property
    def beta(self) -> float:
        """Wave number times the length of the span."""
        if self.kind == "simply-supported":
            return self.number * math.pi
        return wave_number(self.kind, self.number)

    def __call__(self, x: Array, d: int = 0) -> Array:
        span, xi, inside = self._locate(x)
        return np.where(inside, self._sign(d) / span**d * self._unit(xi, d), 0.0)

    def _unit(self, xi: Array, d: int) -> Array:
        if self.kind == "simply-supported":
            b = self.beta
            return _SQRT2 * b**d * _wave(b * xi, d, 0.0, 1.0)
        k = _constants(self.kind, self.number)
        decaying = 0.5 * (1.0 + k.sigma) * (-1.0) ** d * np.exp(-k.beta * xi)
        growing = k.growing * np.exp(-k.beta * (1.0 - xi))
        return k.beta**d * (growing + decaying + k.sign * _wave(k.beta * xi, d, 1.0, -k.sigma))


def _wave(angle: Array, d: int, cosine: float, sine: float) -> Array:
    """Derivative of order d of cosine cos(angle) + sine sin(angle)."""
    c, s = _QUARTER_SINE[(d + 1) % 4], _QUARTER_SINE[d % 4]
    return (cosine * c + sine * s) * np.cos(angle) + (sine * c - cosine * s) * np.sin(angle)


class Sine(_Eigenfunction):
    """Eigenfunction of a uniform rod on start <= x <= end (m): sqrt2 sin or cos, zero outside.

    `kind`: "fixed-free" sin((k - 1/2) pi xi) (fixed at `end` if `mirrored`), "free-free"
    cos(k pi xi), "fixed-fixed" sin(k pi xi).
    """

    @property
    def density(self) -> float:
        return self.number / (self.end - self.start)

    @property
    def beta(self) -> float:
        """Wave number times the length of the span."""
        return (self.number - 0.5 * (self.kind == "fixed-free")) * math.pi

    def __call__(self, x: Array, d: int = 0) -> Array:
        span, xi, inside = self._locate(x)
        scale = self._sign(d) * _SQRT2 * (self.beta / span) ** d
        wave = (1.0, 0.0) if self.kind == "free-free" else (0.0, 1.0)
        return np.where(inside, scale * _wave(self.beta * xi, d, *wave), 0.0)


class Piecewise:
    """Piecewise polynomial: `coefficients[i, j]` of (x - nodes[i])^j between nodes i and i + 1."""

    density = 0.0

    def __init__(self, nodes: Array, coefficients: Array) -> None:
        self.nodes = np.asarray(nodes, dtype=float)
        self.coefficients = np.asarray(coefficients, dtype=float)

    @property
    def breaks(self) -> tuple[float, ...]:
        return tuple(float(x) for x in self.nodes)

    def __call__(self, x: Array, d: int = 0) -> Array:
        piece = np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, len(self.nodes) - 2)
        t = x - self.nodes[piece]
        value = np.zeros_like(t)
        for j in reversed(range(d, self.coefficients.shape[1])):
            value = value * t + math.perm(j, d) * self.coefficients[piece, j]
        return value


class ShearedShape(Piecewise):
    """Deflection v of a beam with shear; `rotation` is that of its sections, psi."""

    def __init__(self, nodes: Array, deflection: Array, rotation: Array) -> None:
        super().__init__(nodes, deflection)
        self.rotation = Piecewise(nodes, rotation)


class ShiftedShape:
    """Shape less a rigid part, shape(x) - a - b x, for another floating frame."""

    def __init__(self, shape: Shape, a: float, b: float) -> None:
        self.shape, self.a, self.b = shape, a, b

    @property
    def breaks(self) -> tuple[float, ...]:
        return self.shape.breaks

    @property
    def density(self) -> float:
        return self.shape.density

    def __call__(self, x: Array, d: int = 0) -> Array:
        value = self.shape(x, d)
        if d == 0:
            return value - self.a - self.b * x
        return value - self.b if d == 1 else value


def section_rotation(shape: Shape, x: Array, d: int = 0) -> Array:
    """Derivative of order d of the rotation of sections by a bending shape: of psi, else of v'."""
    if isinstance(shape, ShearedShape):
        return shape.rotation(x, d)
    if isinstance(shape, ShiftedShape):
        return section_rotation(shape.shape, x, d) - (shape.b if d == 0 else 0.0)
    return shape(x, d + 1)


# --- expressions of x -----------------------------------------------------------------------------


class ExpressionShape:
    """Shape function given as an expression of x (m) and L (length of the beam, m).

    Breaks are where a comparison, sign, abs, min or max in the expression switches.
    """

    #: Half-waves per length that the quadrature resolves.
    WAVES = 16.0
    #: Pieces of the beam that are searched for switches, at most one in each.
    PIECES = 512

    def __init__(self, expression: Expression, length: float) -> None:
        self.text, self.length = expression.text, length
        graph = Graph()
        self._x = graph.element("x")
        variables = {"x": self._x, "L": graph.constant(length)}
        nodes = [expression.build(graph, lambda name: variables[_dotted_name(name)])]
        for _ in range(4):
            nodes.append(derivative(nodes[-1], {self._x: 1}))
        self._nodes = nodes
        self.breaks = (0.0, *sorted(self._breaks(nodes[0])), length)

    def _breaks(self, root: Node) -> set[float]:
        """Positions (m) at which the expression changes from one smooth piece to the next."""
        places: set[float] = set()
        for switch in _switch_functions(root):
            x = np.linspace(0.0, self.length, self.PIECES + 1)
            values = _evaluate(switch, x) + np.zeros_like(x)
            for i in np.flatnonzero(np.diff(np.sign(values))):
                low, high = x[i], x[i + 1]
                for _ in range(60):
                    middle = (low + high) / 2
                    sign = np.sign(_evaluate(switch, np.array([middle]))).item()
                    is_left = sign == np.sign(values[i])
                    low, high = (middle, high) if is_left else (low, middle)
                places.add(float(high))
        return {x for x in places if 1e-9 < x / self.length < 1 - 1e-9}

    @property
    def density(self) -> float:
        return self.WAVES / self.length

    def __call__(self, x: Array, d: int = 0) -> Array:
        value = _evaluate(self._nodes[d], np.asarray(x, dtype=float))
        return np.broadcast_to(value, np.shape(x))


def _dotted_name(name: Name) -> str:
    return ".".join(name.parts)


def _switch_functions(root: Node) -> list[Node]:
    """Nodes whose sign change switches the expression."""
    switches = []
    for node in dependencies(root):
        if node.op in ("lt", "le", "eq", "min", "max"):
            switches.append(node.args[0] - node.args[1])
        elif node.op in ("abs", "sign"):
            switches.append(node.args[0])
    return switches


def _evaluate(root: Node, x: Array) -> Array:
    """Value of a node at every x (m)."""
    known_values: dict[int, Any] = {}
    for node in dependencies(root):
        arguments = [known_values[a.number] for a in node.args]
        known_values[node.number] = _evaluate_node(node, arguments, x)
    return np.asarray(known_values[root.number], dtype=float)


def _evaluate_node(node: Node, args: list[Any], x: Array) -> Any:
    if node.op == "element":
        return x
    if node.op == "pi":
        return np.pi
    if node.value is not None:
        return float(node.value)
    with np.errstate(all="ignore"):  # the branch not selected may be undefined
        return getattr(np, OPERATIONS[node.op].numpy)(*args)
