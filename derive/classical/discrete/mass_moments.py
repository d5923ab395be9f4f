"""Mass moments of flexible bodies as functions of the modal coordinates, by kind of body.

Rigid bodies have no modes; a beam of Euler and Bernoulli bends across its straight x axis; an
elastic body is given by the invariants of its shapes, whatever their origin.  The moments are m,
S_0 = int r0, J_0 = int (r0.r0 1 - r0 r0^T), S_t = int phi, E_k = int r0 phi_k^T, F_kl = int phi_k
phi_l^T, M_f = tr F_kl; in the plane I_0, S_r = int r0.phi, S_c = int r0 x phi, G_f = int (phi_x
phi_y^T - phi_y phi_x^T).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ...definition.derivation import Equation, Quantity, vector
from ...definition.notation import Matrix
from .equations_of_motion import Moments

MASS = Quantity(sp.MatrixSymbol("m", 1, 1), "kg", "mass")
ETA = "eta_p"


class SymbolTable:
    """Plain symbols for entries of matrix symbols, which SymPy differentiates much faster."""

    def __init__(self) -> None:
        self._entries: dict[sp.Basic, sp.Basic] = {}

    def entries_of(self, symbol: sp.MatrixSymbol) -> sp.Matrix:
        """Matrix of plain symbols that represents a matrix symbol."""
        symbols = sp.Matrix(
            *symbol.shape, lambda i, j: sp.Symbol(f"{symbol.name}__{i}_{j}", real=True)
        )
        self._entries |= dict(zip(symbols, symbol.as_explicit(), strict=True))
        return symbols

    def to_matrix_entries(self, matrix: sp.MatrixBase) -> Matrix:
        """Matrix in terms of entries of matrix symbols."""
        return Matrix(matrix.xreplace(self._entries))


@dataclass(frozen=True)
class BodyMoments:
    """Kernel inputs, definitions and moments (in plain symbols) of one kind of body."""

    inputs: tuple[Quantity, ...]
    definitions: tuple[Equation, ...]
    moments: Moments
    stiffness: sp.MatrixBase | None
    damping: sp.MatrixBase | None


def symmetric_quantity(name: str, size: int, unit: str, meaning: str) -> Quantity:
    """Quantity of a symmetric matrix."""
    return Quantity(sp.MatrixSymbol(name, size, size), unit, meaning, symmetric=True)


def modal_inputs(modes: int, gram: str = "M_f") -> tuple[Quantity, ...]:
    """Modal mass, stiffness and damping."""
    if not modes:
        return ()
    mass = "modal masses" if gram == "M_f" else "int rho phi_k phi_l of the deflections, all pairs"
    return (
        symmetric_quantity(gram, modes, "kg", mass),
        symmetric_quantity("K_f", modes, "N/m", "modal stiffness"),
        symmetric_quantity("D_f", modes, "N*s/m", "modal damping"),
    )


# --- in the plane -----------------------------------------------------------------------------


def planar_moments(modes: int, letters: SymbolTable, kind: str) -> BodyMoments:
    """Planar moments; `kind`: rigid (no modes), beam (bending of the x axis) or elastic."""
    first_moments, inertia = vector("S_0", 2), sp.MatrixSymbol("I_0", 1, 1)
    inputs = [
        MASS,
        Quantity(first_moments, "kg*m", "first moments at rest, frame axes"),
        Quantity(inertia, "kg*m2", "moment of inertia at rest about the input end"),
    ]
    inputs += _planar_shapes(modes, kind)
    symbols = {q.name: letters.entries_of(q.symbol) for q in inputs}
    c, j = vector("c", 2), sp.MatrixSymbol("J", 1, 1)
    if not modes:
        defined_symbols, c_symbols, j_symbols = (c, j), letters.entries_of(c), letters.entries_of(j)
        values = (symbols["S_0"], symbols["I_0"])
        moments = _embed_planar_moments(
            symbols["m"], c_symbols, j_symbols, sp.zeros(2, 0), sp.zeros(1, 0), sp.zeros(0, 0), {}
        )
        return BodyMoments(
            tuple(inputs),
            _definition_equations(letters, defined_symbols, values, _PLANE_NAMES),
            moments,
            None,
            None,
        )
    return _planar_body_moments(modes, letters, kind, (tuple(inputs), symbols))


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


def _planar_body_moments(
    modes: int,
    letters: SymbolTable,
    kind: str,
    shape_data: tuple[tuple[Quantity, ...], dict[str, sp.Matrix]],
) -> BodyMoments:
    inputs, symbols = shape_data
    eta = letters.entries_of(vector(ETA, modes))
    shift, radial_product, cross_product = _planar_invariants(modes, kind, symbols)
    gram = symbols["M_f"]
    gram = sp.Matrix(modes, modes, lambda i, j: gram[min(i, j), max(i, j)])
    c, j = vector("c", 2), sp.MatrixSymbol("J", 1, 1)
    slope, spin = sp.MatrixSymbol("J_e", 1, modes), sp.MatrixSymbol("G", 1, modes)
    defined = [letters.entries_of(s) for s in (c, j, slope, spin)]
    values = (
        symbols["S_0"] + shift * eta,
        symbols["I_0"] + 2 * radial_product.T * eta + eta.T * gram * eta,
        2 * (radial_product.T + eta.T * gram),
        symbols["S_c"].T + eta.T * cross_product,
    )
    gradient: dict[sp.Symbol, Sequence[sp.Expr]] = {
        defined[0][i]: list(shift.row(i)) for i in range(2)
    }
    gradient[defined[1][0]] = list(defined[2])
    gradient |= {defined[2][k]: list(2 * gram.row(k)) for k in range(modes)}
    gradient |= {defined[3][k]: list(cross_product.col(k)) for k in range(modes)}
    moments = _embed_planar_moments(
        symbols["m"], defined[0], defined[1], shift, defined[3], gram, gradient
    )
    definitions = _definition_equations(letters, (c, j, slope, spin), values, _PLANE_NAMES)
    return BodyMoments(inputs, definitions, moments, symbols["K_f"], symbols["D_f"])


def _planar_invariants(
    modes: int, kind: str, symbols: dict[str, sp.Matrix]
) -> tuple[sp.Matrix, sp.Matrix, sp.Matrix]:
    """S_t, S_r, G_f."""
    if kind == "beam":
        shift = sp.zeros(1, modes).col_join(symbols["s"].T)
        return shift, sp.zeros(modes, 1), sp.zeros(modes)
    cross_product = symbols["G_f"]
    skew = sp.Matrix(modes, modes, lambda i, j: _skew_entry(cross_product, i, j))
    return symbols["S_t"], symbols["S_r"], skew


def _skew_entry(matrix: sp.Matrix, i: int, j: int) -> sp.Expr:
    """Entry of a skew matrix that is given by the part above its diagonal."""
    if i == j:
        return sp.Integer(0)
    return matrix[i, j] if i < j else -matrix[j, i]


def _embed_planar_moments(
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


def spatial_moments(modes: int, letters: SymbolTable, kind: str, planes: str = "") -> BodyMoments:
    """Spatial moments; for a beam `planes` gives the direction of each mode, such as "yz"."""
    inputs = [
        MASS,
        Quantity(vector("S_0", 3), "kg*m", "first moments at rest, frame axes"),
        symmetric_quantity("J_0", 3, "kg*m2", "inertia at rest about the input end, frame axes"),
        *_spatial_shapes(modes, kind),
    ]
    symbols = {q.name: letters.entries_of(q.symbol) for q in inputs}
    eta = letters.entries_of(vector(ETA, modes)) if modes else sp.zeros(0, 1)
    products = _shape_products(modes, kind, symbols, planes)
    return _spatial_body_moments(letters, tuple(inputs), symbols, eta, products)


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


def _shape_products(modes: int, kind: str, known: dict[str, sp.Matrix], planes: str) -> _Products:
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
    second_products = {}
    pairs = [(row, column) for row in range(modes) for column in range(row, modes)]
    for pair_index, (k, j) in enumerate(pairs):
        block = known["F"][:, 3 * pair_index : 3 * pair_index + 3]
        if k == j:
            block = sp.Matrix(3, 3, lambda r, c, b=block: b[min(r, c), max(r, c)])
        second_products[k, j], second_products[j, k] = block, block.T
    position_products = [known["E"][:, 3 * k : 3 * k + 3] for k in range(modes)]
    return _Products(known["S_t"], position_products, second_products)


def _inertia_of_moments(moments: sp.Matrix) -> sp.Matrix:
    """tr(X) 1 - (X + X^T) / 2."""
    return moments.trace() * sp.eye(3) - (moments + moments.T) / 2


def _axial_vector(moments: sp.Matrix) -> sp.Matrix:
    """int a x b of int a b^T."""
    return sp.Matrix(
        [
            moments[1, 2] - moments[2, 1],
            moments[2, 0] - moments[0, 2],
            moments[0, 1] - moments[1, 0],
        ]
    )


def _spatial_body_moments(
    letters: SymbolTable,
    inputs: tuple[Quantity, ...],
    known: dict[str, sp.Matrix],
    eta: sp.Matrix,
    products: _Products,
) -> BodyMoments:
    modes, inertia_at_rest = eta.rows, known["J_0"]
    inertia_at_rest = sp.Matrix(3, 3, lambda i, j: inertia_at_rest[min(i, j), max(i, j)])
    slopes = [2 * _inertia_of_moments(e) for e in products.first]
    inertia_products = {pair: 2 * _inertia_of_moments(f) for pair, f in products.second.items()}
    axial_products = {pair: _axial_vector(f) for pair, f in products.second.items()}
    c, j = vector("c", 3), sp.MatrixSymbol("J", 3, 3)
    defined_symbols, values = [c, j], [known["S_0"] + products.shift * eta, inertia_at_rest]
    for k in range(modes):
        values[1] = values[1] + eta[k] * slopes[k]
        for j_ in range(modes):
            values[1] = values[1] + eta[k] * eta[j_] * inertia_products[k, j_] / 2
    if not modes:
        defined = [letters.entries_of(s) for s in defined_symbols]
        no_columns = sp.zeros(3, 0)
        moments = Moments(
            known["m"][0],
            defined[0],
            _mirror_upper_triangle(defined[1]),
            no_columns,
            no_columns,
            sp.zeros(0, 0),
            {},
        )
        definitions = _definition_equations(letters, defined_symbols, values, _SPACE_NAMES)
        return BodyMoments(inputs, definitions, moments, None, None)
    defined_symbols += [sp.MatrixSymbol("J_e", 6, modes), sp.MatrixSymbol("G", 3, modes)]
    values.append(
        sp.Matrix(
            6, modes, lambda i, k: _inertia_derivative(slopes, inertia_products, eta, k)[_PAIRS[i]]
        )
    )
    values.append(
        sp.Matrix.hstack(
            *(_angular_coupling(products, axial_products, eta, k) for k in range(modes))
        )
    )
    return _assemble_spatial_moments(
        letters,
        inputs,
        known,
        (defined_symbols, values),
        (products, inertia_products, axial_products),
    )


_SPACE_NAMES = ("first moments", "inertia", "derivatives of J by eta (xx xy xz yy yz zz)",
                "angular coupling")  # fmt: skip


def _assemble_spatial_moments(
    letters: SymbolTable,
    inputs: tuple[Quantity, ...],
    known: dict[str, sp.Matrix],
    named: tuple[list[sp.MatrixSymbol], list[sp.Matrix]],
    parts: tuple[_Products, dict[tuple[int, int], sp.Matrix], dict[tuple[int, int], sp.Matrix]],
) -> BodyMoments:
    products, inertia_products, axial_products = parts
    defined_symbols, values = named
    modes = products.shift.cols
    defined = [letters.entries_of(s) for s in defined_symbols]
    gradient: dict[sp.Symbol, Sequence[sp.Expr]] = {
        defined[0][i]: list(products.shift.row(i)) for i in range(3)
    }
    gradient |= {defined[1][pair]: list(defined[2].row(i)) for i, pair in enumerate(_PAIRS)}
    for i, pair in enumerate(_PAIRS):
        gradient |= {
            defined[2][i, k]: [inertia_products[k, j][pair] for j in range(modes)]
            for k in range(modes)
        }
    gradient |= {
        defined[3][i, k]: [axial_products[j, k][i] for j in range(modes)]
        for k in range(modes)
        for i in range(3)
    }
    mass = sp.Matrix(modes, modes, lambda k, j: products.second[k, j].trace())
    moments = Moments(
        known["m"][0],
        defined[0],
        _mirror_upper_triangle(defined[1]),
        products.shift,
        defined[3],
        mass,
        gradient,
    )
    definitions = _definition_equations(letters, defined_symbols, values, _SPACE_NAMES)
    return BodyMoments(inputs, definitions, moments, known["K_f"], known["D_f"])


def _inertia_derivative(
    slopes: list[sp.Matrix], bends: dict[tuple[int, int], sp.Matrix], eta: sp.Matrix, k: int
) -> sp.Matrix:
    """dJ / deta_k."""
    total = slopes[k]
    for j in range(eta.rows):
        total = total + eta[j] * bends[k, j]
    return total


def _angular_coupling(
    products: _Products, turning: dict[tuple[int, int], sp.Matrix], eta: sp.Matrix, k: int
) -> sp.Matrix:
    """int r x phi_k."""
    total = _axial_vector(products.first[k])
    for j in range(eta.rows):
        total = total + eta[j] * turning[j, k]
    return total


def _mirror_upper_triangle(j: sp.Matrix) -> sp.Matrix:
    return sp.Matrix(3, 3, lambda r, c: j[min(r, c), max(r, c)])


def _definition_equations(
    letters: SymbolTable,
    symbols: Sequence[sp.MatrixSymbol],
    values: Sequence[sp.Matrix],
    names: Sequence[str],
) -> tuple[Equation, ...]:
    return tuple(
        Equation(name, symbol, letters.to_matrix_entries(value))
        for symbol, value, name in zip(symbols, values, names, strict=False)
    )
