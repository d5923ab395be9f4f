"""Moments of flexible bodies and how they follow the modal coordinates, by the kind of body.

Rigid bodies have no modes; a beam of Euler and Bernoulli bends across its straight x axis; an
elastic body is known by the invariants of its shapes, whatever they came from.  The moments are
m, S_0 = int r0, J_0 = int (r0.r0 1 - r0 r0^T), S_t = int phi, E_k = int r0 phi_k^T,
F_kl = int phi_k phi_l^T, M_f = tr F_kl; in the plane I_0, S_r = int r0.phi, S_c = int r0 x phi,
G_f = int (phi_x phi_y^T - phi_y phi_x^T).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ...language.derivation import Equation, Quantity, vector
from ...language.notation import Matrix
from .energy import Moments

MASS = Quantity(sp.MatrixSymbol("m", 1, 1), "kg", "mass")
ETA = "eta_p"


class Letters:
    """Plain symbols for the entries of matrix symbols: SymPy differentiates these much faster."""

    def __init__(self) -> None:
        self._entries: dict[sp.Basic, sp.Basic] = {}

    def of(self, symbol: sp.MatrixSymbol) -> sp.Matrix:
        """The matrix of plain symbols that stands for a matrix symbol."""
        made = sp.Matrix(
            *symbol.shape, lambda i, j: sp.Symbol(f"{symbol.name}__{i}_{j}", real=True)
        )
        self._entries |= dict(zip(made, symbol.as_explicit(), strict=True))
        return made

    def back(self, matrix: sp.MatrixBase) -> Matrix:
        """The matrix in entries of matrix symbols again."""
        return Matrix(matrix.xreplace(self._entries))


@dataclass(frozen=True)
class BodyMoments:
    """Kernel inputs, definitions and moments (in plain symbols) of one kind of body."""

    inputs: tuple[Quantity, ...]
    definitions: tuple[Equation, ...]
    moments: Moments
    stiffness: sp.MatrixBase | None
    damping: sp.MatrixBase | None


def symmetric(name: str, size: int, unit: str, meaning: str) -> Quantity:
    """A symmetric matrix."""
    return Quantity(sp.MatrixSymbol(name, size, size), unit, meaning, symmetric=True)


def modal_inputs(modes: int, gram: str = "M_f") -> tuple[Quantity, ...]:
    """Modal mass, stiffness and damping."""
    if not modes:
        return ()
    mass = "modal masses" if gram == "M_f" else "int rho phi_k phi_l of the deflections, all pairs"
    return (
        symmetric(gram, modes, "kg", mass),
        symmetric("K_f", modes, "N/m", "modal stiffness"),
        symmetric("D_f", modes, "N*s/m", "modal damping"),
    )


# --- in the plane -----------------------------------------------------------------------------


def planar(modes: int, letters: Letters, kind: str) -> BodyMoments:
    """Moments in the plane.  `kind`: rigid (no modes), beam (bending of the x axis) or elastic."""
    first, inertia = vector("S_0", 2), sp.MatrixSymbol("I_0", 1, 1)
    inputs = [
        MASS,
        Quantity(first, "kg*m", "first moments at rest, frame axes"),
        Quantity(inertia, "kg*m2", "moment of inertia at rest about the input end"),
    ]
    inputs += _planar_shapes(modes, kind)
    known = {q.name: letters.of(q.symbol) for q in inputs}
    c, j = vector("c", 2), sp.MatrixSymbol("J", 1, 1)
    if not modes:
        shown, at_c, at_j = (c, j), letters.of(c), letters.of(j)
        values = (known["S_0"], known["I_0"])
        moments = _plane(known["m"], at_c, at_j, sp.zeros(2, 0), sp.zeros(1, 0), sp.zeros(0, 0), {})
        return BodyMoments(
            tuple(inputs), _defined(letters, shown, values, _PLANE_NAMES), moments, None, None
        )
    return _planar_modal(modes, letters, kind, (tuple(inputs), known))


def _planar_shapes(modes: int, kind: str) -> tuple[Quantity, ...]:
    if not modes:
        return ()
    if kind == "beam":
        shapes: tuple[Quantity, ...] = (
            Quantity(vector("s", modes), "kg", "int rho phi of the deflections"),
            Quantity(vector("S_c", modes), "kg*m", "int rho x phi"),
        )
    else:
        shapes = (
            Quantity(sp.MatrixSymbol("S_t", 2, modes), "kg", "int rho phi"),
            Quantity(vector("S_r", modes), "kg*m", "int rho r0 . phi"),
            Quantity(vector("S_c", modes), "kg*m", "int rho r0 x phi"),
            Quantity(sp.MatrixSymbol("G_f", modes, modes), "kg", "int rho phi_k x phi_l"),
        )
    return (*shapes, *modal_inputs(modes))


_PLANE_NAMES = ("first moments", "moment of inertia", "its derivatives by eta", "angular coupling")


def _planar_modal(
    modes: int,
    letters: Letters,
    kind: str,
    given: tuple[tuple[Quantity, ...], dict[str, sp.Matrix]],
) -> BodyMoments:
    inputs, known = given
    eta = letters.of(vector(ETA, modes))
    shift, along, crossed = _planar_invariants(modes, kind, known)
    gram = known["M_f"]
    gram = sp.Matrix(modes, modes, lambda i, j: gram[min(i, j), max(i, j)])
    c, j = vector("c", 2), sp.MatrixSymbol("J", 1, 1)
    slope, spin = sp.MatrixSymbol("J_e", 1, modes), sp.MatrixSymbol("G", 1, modes)
    at = [letters.of(s) for s in (c, j, slope, spin)]
    values = (
        known["S_0"] + shift * eta,
        known["I_0"] + 2 * along.T * eta + eta.T * gram * eta,
        2 * (along.T + eta.T * gram),
        known["S_c"].T + eta.T * crossed,
    )
    gradient: dict[sp.Symbol, Sequence[sp.Expr]] = {at[0][i]: list(shift.row(i)) for i in range(2)}
    gradient[at[1][0]] = list(at[2])
    gradient |= {at[2][k]: list(2 * gram.row(k)) for k in range(modes)}
    gradient |= {at[3][k]: list(crossed.col(k)) for k in range(modes)}
    moments = _plane(known["m"], at[0], at[1], shift, at[3], gram, gradient)
    definitions = _defined(letters, (c, j, slope, spin), values, _PLANE_NAMES)
    return BodyMoments(inputs, definitions, moments, known["K_f"], known["D_f"])


def _planar_invariants(
    modes: int, kind: str, known: dict[str, sp.Matrix]
) -> tuple[sp.Matrix, sp.Matrix, sp.Matrix]:
    """S_t, S_r, G_f."""
    if kind == "beam":
        shift = sp.zeros(1, modes).col_join(known["s"].T)
        return shift, sp.zeros(modes, 1), sp.zeros(modes)
    crossed = known["G_f"]
    skew = sp.Matrix(modes, modes, lambda i, j: _skew(crossed, i, j))
    return known["S_t"], known["S_r"], skew


def _skew(matrix: sp.Matrix, i: int, j: int) -> sp.Expr:
    """Entry of a skew matrix of which the part above the diagonal is read."""
    if i == j:
        return sp.Integer(0)
    return matrix[i, j] if i < j else -matrix[j, i]


def _plane(
    mass: sp.Matrix,
    c: sp.Matrix,
    j: sp.Matrix,
    shift: sp.Matrix,
    spin: sp.Matrix,
    gram: sp.Matrix,
    gradient: dict[sp.Symbol, Sequence[sp.Expr]],
) -> Moments:
    modes = shift.cols
    return Moments(
        mass[0],
        sp.Matrix([*c, 0]),
        sp.diag(0, 0, j[0]),
        shift.col_join(sp.zeros(1, modes)),
        sp.zeros(2, modes).col_join(spin),
        gram,
        gradient,
    )


# --- in space ---------------------------------------------------------------------------------

_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def spatial(modes: int, letters: Letters, kind: str, planes: str = "") -> BodyMoments:
    """Moments in space.  Of a beam `planes` names the direction of each mode, such as "yz"."""
    inputs = [
        MASS,
        Quantity(vector("S_0", 3), "kg*m", "first moments at rest, frame axes"),
        symmetric("J_0", 3, "kg*m2", "inertia at rest about the input end, frame axes"),
        *_spatial_shapes(modes, kind),
    ]
    known = {q.name: letters.of(q.symbol) for q in inputs}
    eta = letters.of(vector(ETA, modes)) if modes else sp.zeros(0, 1)
    products = _products(modes, kind, known, planes)
    return _spatial_modal(letters, tuple(inputs), known, eta, products)


def _spatial_shapes(modes: int, kind: str) -> tuple[Quantity, ...]:
    if not modes:
        return ()
    if kind == "beam":
        return (
            Quantity(vector("s", modes), "kg", "int rho phi of the deflections"),
            Quantity(vector("e", modes), "kg*m", "int rho x phi"),
            *modal_inputs(modes, "M_phi"),
        )
    pairs = modes * (modes + 1) // 2
    return (
        Quantity(sp.MatrixSymbol("S_t", 3, modes), "kg", "int rho phi"),
        Quantity(sp.MatrixSymbol("E", 3, 3 * modes), "kg*m", "int rho r0 phi_k^T, k = 1 ... n"),
        Quantity(
            sp.MatrixSymbol("F", 3, 3 * pairs), "kg", "int rho phi_k phi_l^T, (k, l) = 11 12 ... nn"
        ),
        *modal_inputs(modes)[1:],
    )


@dataclass(frozen=True)
class _Products:
    """S_t (3 x n), E_k, and F_kl for every pair."""

    shift: sp.Matrix
    first: list[sp.Matrix]
    second: dict[tuple[int, int], sp.Matrix]


def _products(modes: int, kind: str, known: dict[str, sp.Matrix], planes: str) -> _Products:
    if kind == "beam":
        d = [sp.eye(3)[:, "xyz".index(plane)] for plane in planes]
        x, gram = sp.Matrix([1, 0, 0]), known["M_phi"]
        return _Products(
            sp.Matrix.hstack(*(known["s"][k] * d[k] for k in range(modes))),
            [known["e"][k] * x * d[k].T for k in range(modes)],
            {
                (k, j): gram[min(k, j), max(k, j)] * d[k] * d[j].T
                for k in range(modes)
                for j in range(modes)
            },
        )
    if not modes:
        return _Products(sp.zeros(3, 0), [], {})
    second = {}
    pairs = [(row, column) for row in range(modes) for column in range(row, modes)]
    for place, (k, j) in enumerate(pairs):
        block = known["F"][:, 3 * place : 3 * place + 3]
        if k == j:
            block = sp.Matrix(3, 3, lambda r, c, b=block: b[min(r, c), max(r, c)])
        second[k, j], second[j, k] = block, block.T
    first = [known["E"][:, 3 * k : 3 * k + 3] for k in range(modes)]
    return _Products(known["S_t"], first, second)


def _about(moments: sp.Matrix) -> sp.Matrix:
    """tr(X) 1 - (X + X^T) / 2."""
    return moments.trace() * sp.eye(3) - (moments + moments.T) / 2


def _axial(moments: sp.Matrix) -> sp.Matrix:
    """int a x b of int a b^T."""
    return sp.Matrix(
        [
            moments[1, 2] - moments[2, 1],
            moments[2, 0] - moments[0, 2],
            moments[0, 1] - moments[1, 0],
        ]
    )


def _spatial_modal(
    letters: Letters,
    inputs: tuple[Quantity, ...],
    known: dict[str, sp.Matrix],
    eta: sp.Matrix,
    products: _Products,
) -> BodyMoments:
    modes, rest = eta.rows, known["J_0"]
    rest = sp.Matrix(3, 3, lambda i, j: rest[min(i, j), max(i, j)])
    slopes = [2 * _about(e) for e in products.first]
    bends = {pair: 2 * _about(f) for pair, f in products.second.items()}
    turning = {pair: _axial(f) for pair, f in products.second.items()}
    c, j = vector("c", 3), sp.MatrixSymbol("J", 3, 3)
    shown, values = [c, j], [known["S_0"] + products.shift * eta, rest]
    for k in range(modes):
        values[1] = values[1] + eta[k] * slopes[k]
        for other in range(modes):
            values[1] = values[1] + eta[k] * eta[other] * bends[k, other] / 2
    if not modes:
        at = [letters.of(s) for s in shown]
        none = sp.zeros(3, 0)
        moments = Moments(known["m"][0], at[0], _mirrored(at[1]), none, none, sp.zeros(0, 0), {})
        definitions = _defined(letters, shown, values, _SPACE_NAMES)
        return BodyMoments(inputs, definitions, moments, None, None)
    shown += [sp.MatrixSymbol("J_e", 6, modes), sp.MatrixSymbol("G", 3, modes)]
    values.append(sp.Matrix(6, modes, lambda i, k: _slope(slopes, bends, eta, k)[_PAIRS[i]]))
    values.append(sp.Matrix.hstack(*(_spin(products, turning, eta, k) for k in range(modes))))
    return _spatial_body(letters, inputs, known, (shown, values), (products, bends, turning))


_SPACE_NAMES = ("first moments", "inertia", "derivatives of J by eta (xx xy xz yy yz zz)",
                "angular coupling")  # fmt: skip


def _spatial_body(
    letters: Letters,
    inputs: tuple[Quantity, ...],
    known: dict[str, sp.Matrix],
    named: tuple[list[sp.MatrixSymbol], list[sp.Matrix]],
    parts: tuple[_Products, dict[tuple[int, int], sp.Matrix], dict[tuple[int, int], sp.Matrix]],
) -> BodyMoments:
    products, bends, turning = parts
    shown, values = named
    modes = products.shift.cols
    at = [letters.of(s) for s in shown]
    gradient: dict[sp.Symbol, Sequence[sp.Expr]] = {
        at[0][i]: list(products.shift.row(i)) for i in range(3)
    }
    gradient |= {at[1][pair]: list(at[2].row(i)) for i, pair in enumerate(_PAIRS)}
    for i, pair in enumerate(_PAIRS):
        gradient |= {
            at[2][i, k]: [bends[k, other][pair] for other in range(modes)] for k in range(modes)
        }
    gradient |= {
        at[3][i, k]: [turning[other, k][i] for other in range(modes)]
        for k in range(modes)
        for i in range(3)
    }
    mass = sp.Matrix(modes, modes, lambda k, other: products.second[k, other].trace())
    moments = Moments(known["m"][0], at[0], _mirrored(at[1]), products.shift, at[3], mass, gradient)
    definitions = _defined(letters, shown, values, _SPACE_NAMES)
    return BodyMoments(inputs, definitions, moments, known["K_f"], known["D_f"])


def _slope(
    slopes: list[sp.Matrix], bends: dict[tuple[int, int], sp.Matrix], eta: sp.Matrix, k: int
) -> sp.Matrix:
    """dJ / deta_k."""
    total = slopes[k]
    for other in range(eta.rows):
        total = total + eta[other] * bends[k, other]
    return total


def _spin(
    products: _Products, turning: dict[tuple[int, int], sp.Matrix], eta: sp.Matrix, k: int
) -> sp.Matrix:
    """int r x phi_k."""
    total = _axial(products.first[k])
    for other in range(eta.rows):
        total = total + eta[other] * turning[other, k]
    return total


def _mirrored(j: sp.Matrix) -> sp.Matrix:
    return sp.Matrix(3, 3, lambda r, c: j[min(r, c), max(r, c)])


def _defined(
    letters: Letters,
    symbols: Sequence[sp.MatrixSymbol],
    values: Sequence[sp.Matrix],
    names: Sequence[str],
) -> tuple[Equation, ...]:
    return tuple(
        Equation(name, symbol, letters.back(value))
        for symbol, value, name in zip(symbols, values, names, strict=False)
    )
