"""Motion of any hinge from its rotation and position: subspace, bias, and their checks.

With R(q) (P axes to Q axes), d(q) (P from Q, Q axes) and qdot = N(q) u:

    w = axial(R^T dR/dt),  v = R^T dd/dt                  relative velocity in P axes
    [v; w] = H u,          c = d/dt[v; w] + [w x v; 0]     at udot = 0

so that a_P = X a_Q + H udot + (terms of the carrier's rotation) + c.  Rui, Wang and Zhang state
these relations hinge by hinge (ch. 5, sections 5.6 to 5.8); here they are one derivation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import sympy as sp

from mstmm.errors import ElementError

from ..definition import derivation as stated
from ..definition.derivation import Derivation, Equation, Quantity, Solve, axial, vector
from ..definition.element import Hinge, Param, Symbols, describe_array
from ..definition.nonsmooth_functions import slope
from ..definition.notation import symbol

#: Trigonometric entries with more operations than this are not simplified.
SIMPLIFY_LIMIT = 400

#: Digits used to evaluate H numerically, and digits to which values must agree.
_DIGITS, _SAME = 60, 40


@dataclass(frozen=True)
class HingePose:
    """Relative position of a hinge as SymPy matrices in the symbols q, p."""

    hinge: Hinge
    q: Symbols
    u: Symbols
    p: Symbols
    rotation: sp.Matrix
    position: sp.Matrix

    @property
    def nu(self) -> int:
        return len(self.u)


@dataclass(frozen=True)
class HingeMotion(HingePose):
    """Relative motion of a hinge as SymPy matrices in the symbols q, u, p."""

    subspace: sp.Matrix
    velocity: sp.Matrix
    spin: sp.Matrix
    bias: sp.Matrix
    rates: sp.Matrix

    def in_arrays(self, matrix: sp.Matrix) -> sp.ImmutableDenseMatrix:
        """Matrix in terms of the entries of the arrays q, u, p."""
        replace: dict[sp.Basic, sp.Basic] = {}
        for name, symbols in (("q", self.q), ("u", self.u), ("p", self.p)):
            if len(symbols):
                array = vector(name, len(symbols))
                replace.update({s: array[i, 0] for i, s in enumerate(symbols)})
        return sp.ImmutableDenseMatrix(sp.Matrix(matrix).xreplace(replace))


def speeds_of(hinge: Hinge) -> tuple[Param, ...]:
    """Declared speeds, or the rates of the coordinates with their units."""
    if hinge.speeds is not None:
        return hinge.speeds
    return tuple(
        Param(f"{c.name}_rate", f"{c.unit or '1'}/s", f"rate of {c.name}")
        for c in hinge.coordinates
    )


@lru_cache(maxsize=32)
def hinge_pose(hinge: Hinge) -> HingePose:
    """Rotation and position as defined, without derived quantities."""
    q = Symbols("q", tuple(c.name for c in hinge.coordinates))
    u = Symbols("u", tuple(s.name for s in speeds_of(hinge)))
    p = Symbols("p", tuple(x.name for x in hinge.parameters))
    location = f"hinge {hinge.name}"
    rotation = stated.matrix(location, "rotation(q, p)", hinge.rotation, (3, 3), q, p)
    position = stated.matrix(location, "position(q, p)", hinge.position, (3, 1), q, p)
    return HingePose(hinge, q, u, p, rotation, position)


@lru_cache(maxsize=32)
def motion_of(hinge: Hinge) -> HingeMotion:
    """Relative motion of a hinge with derived H and c, cached by definition.

    Raises ElementError naming the equation that a definition contradicts.
    """
    place = hinge_pose(hinge)
    q, u, p, rotation, position = place.q, place.u, place.p, place.rotation, place.position
    rates = _rates(place)
    subspace = _simplify(_subspace(rotation, position, rates, q, u))
    velocities = subspace * sp.Matrix(list(u)) if len(u) else sp.zeros(6, 1)
    v, w = velocities[:3, :], velocities[3:, :]
    bias = _simplify(_bias(v, w, rates, q))
    return HingeMotion(hinge, q, u, p, rotation, position, subspace, v, w, bias, rates)


def has_subspace(hinge: Hinge, subspace: sp.Matrix) -> bool:
    """Whether H equals this constant matrix, compared at two positions to forty digits.

    The numerical comparison avoids deriving kernels that are only named.
    """
    place = hinge_pose(hinge)
    if (6, place.nu) != subspace.shape:
        return False
    subspace_derived = _subspace(place.rotation, place.position, _rates(place), place.q, place.u)
    for denominator in (7, 11):
        symbols = (*place.q, *place.p)
        sample = {variable: sp.Rational(k + 2, denominator) for k, variable in enumerate(symbols)}
        difference = (subspace_derived - subspace).xreplace(sample)
        if any(abs(entry.evalf(_DIGITS)) > sp.Float(10) ** -_SAME for entry in difference):
            return False
    return True


def _rates(place: HingePose) -> sp.Matrix:
    hinge, q, u, location = place.hinge, place.q, place.u, f"hinge {place.hinge.name}"
    rates = stated.optional(
        location, "coordinate_rates(q, u, p)", hinge.coordinate_rates, q, u, place.p
    )
    if rates is None and len(q) != len(u):
        raise ElementError(
            f"{location}: {len(q)} coordinates but {len(u)} speeds; "
            "state qdot = N(q) u in rates(q, u, p)"
        )
    given = sp.Matrix(list(u)) if rates is None else rates
    return stated.matrix(location, "coordinate_rates(q, u, p)", lambda: given, (len(q), 1))


def _subspace(
    rotation: sp.Matrix, position: sp.Matrix, rates: sp.Matrix, q: Symbols, u: Symbols
) -> sp.Matrix:
    columns = []
    for speed in u:
        along = rates.diff(speed)  # coordinate rates for a unit value of this speed
        d_rotation, d_position = sp.zeros(3, 3), sp.zeros(3, 1)
        for coordinate, rate in zip(q, along, strict=True):
            d_rotation += slope(rotation, coordinate) * rate
            d_position += slope(position, coordinate) * rate
        v = rotation.T * d_position
        columns.append(sp.Matrix.vstack(v, sp.Matrix(axial(rotation.T * d_rotation))))
    return sp.Matrix.hstack(*columns) if columns else sp.zeros(6, 0)


def _bias(v: sp.Matrix, w: sp.Matrix, rates: sp.Matrix, q: Symbols) -> sp.Matrix:
    v_rate, w_rate = sp.zeros(3, 1), sp.zeros(3, 1)
    for coordinate, rate in zip(q, rates, strict=True):
        v_rate += slope(v, coordinate) * rate
        w_rate += slope(w, coordinate) * rate
    return sp.Matrix.vstack(v_rate + w.cross(v), w_rate)


def _simplify(matrix: sp.Matrix) -> sp.Matrix:
    return matrix.applyfunc(simplify_entry)


def simplify_entry(entry: sp.Expr) -> sp.Expr:
    """Shortest of a few cheap forms; rational entries are cancelled, angles collected."""
    if entry.is_number:
        return entry
    if entry.is_rational_function():
        candidates = [entry, sp.factor_terms(sp.cancel(sp.together(entry)))]
    elif entry.count_ops() > SIMPLIFY_LIMIT:
        return entry
    elif any(not power.exp.is_integer for power in entry.atoms(sp.Pow)):
        candidates = [entry, sp.factor_terms(entry)]  # collecting angles under roots is too slow
    else:
        candidates = [entry, sp.trigsimp(sp.expand(entry)), sp.factor_terms(entry)]
    return min(candidates, key=lambda e: (e.count_ops(), str(e)))


def hinge_quantities(hinge: Hinge) -> tuple[Quantity, ...]:
    """Inputs p, q, u of every hinge kernel; arrays of length zero are left out."""
    groups = (
        ("p", "parameters", hinge.parameters),
        ("q", "coordinates", hinge.coordinates),
        ("u", "speeds", speeds_of(hinge)),
    )
    return tuple(
        Quantity(sp.MatrixSymbol(name, len(declared), 1), "", describe_array(what, declared))
        for name, what, declared in groups
    )


def hinge_derivation(motion: HingeMotion) -> Derivation:
    """Kernel of every hinge: (p, q, u) -> R, d, H, v, w, c, qdot."""
    rows = (
        ("R", motion.rotation, "", "rotation, P axes to Q axes"),
        ("d", motion.position, "m", "position of P from Q, Q axes"),
        ("H", motion.subspace, "", "motion subspace, rows v then w, P axes"),
        ("v", motion.velocity, "m/s", "relative velocity of P, P axes"),
        ("w", motion.spin, "rad/s", "relative angular velocity, P axes"),
        ("c", motion.bias, "m/s2, rad/s2", "relative acceleration at udot = 0, P axes"),
        ("qdot", motion.rates, "", "coordinate rates"),
    )
    definitions, outputs = [], []
    for name, value, unit, meaning in rows:
        symbol = sp.MatrixSymbol(name, value.rows, value.cols)
        outputs.append(Quantity(symbol, unit, meaning))
        definitions.append(Equation(meaning, symbol, motion.in_arrays(value)))
    return Derivation(
        motion.hinge.name,
        f"relative motion of the {motion.hinge.title or motion.hinge.name}",
        hinge_quantities(motion.hinge),
        tuple(outputs),
        tuple(definitions),
        sources=motion.hinge.sources,
    )


# --- constrained directions -----------------------------------------------------------------------
# Of the six directions between the two sides of a hinge, H spans the free ones.  The rows of
#
#     W = [H^+; N^T],  H^+ = (H^T H)^-1 H^T,  N^T H = 0,  N^T N = 1
#
# applied to a relative motion give the hinge's own speeds, then the constrained components.  N is
# formed by reflections that map the columns of H to coordinate directions one by one (Householder,
# J. ACM 5 (1958) 339-342), so that axes along coordinates leave coordinate directions.

SOURCES = ("Householder, J. ACM 5 (1958) 339-342 (reflections)",)

#: Rows of W; each is a load along a free or a constrained direction.
DIRECTIONS = Quantity(symbol("W", 6, 6), "", "rows: H^+, then the constrained directions")


def complement(nu: int) -> Derivation:
    """W of a hinge with nu speeds."""
    h = Quantity(symbol("H", 6, nu), "", "motion subspace")
    equations: list[Equation] = []
    reflected: sp.Basic = h.symbol
    mirrors: list[tuple[sp.MatrixSymbol, sp.MatrixSymbol]] = []
    for k in range(nu):
        mirror, equations_of_mirror = _reflection(k, reflected)
        equations += equations_of_mirror
        mirrors.append(mirror)
        if k + 1 < nu:
            next_matrix = symbol(f"H_{k + 1}", 6, nu)
            equations.append(
                Equation(
                    f"H, reflected {k + 1} times", next_matrix, _apply_reflection(mirror, reflected)
                )
            )
            reflected = next_matrix
    constrained: sp.Basic = sp.ImmutableDenseMatrix(6, 6 - nu, lambda i, j: sp.Integer(i == j + nu))
    for k in reversed(range(nu)):
        next_matrix = symbol(f"N_{k + 1}", 6, 6 - nu)
        if nu < 6:
            equations.append(
                Equation(
                    f"N after reflection {k + 1}",
                    next_matrix,
                    _apply_reflection(mirrors[k], constrained),
                )
            )
            constrained = next_matrix
    rows: list[list[sp.Expr]] = []
    if nu:
        gram, inverse = symbol("HH", nu, nu), symbol("H_inv", nu, 6)
        equations += [
            Equation("H^T H", gram, h.symbol.T * h.symbol),
            Equation("H^+", inverse, Solve(gram, h.symbol.T, symmetric=True)),
        ]
        rows += [[inverse[k, i] for i in range(6)] for k in range(nu)]
    rows += [[constrained[i, j] for i in range(6)] for j in range(6 - nu)]
    equations.append(Equation("W", DIRECTIONS.symbol, sp.ImmutableDenseMatrix(rows)))
    return Derivation(
        f"generic{nu}",
        f"free and constrained directions of a hinge with {nu} speeds",
        (h,),
        (DIRECTIONS,),
        tuple(equations),
        sources=SOURCES,
    )


def _reflection(
    k: int, matrix: sp.Basic
) -> tuple[tuple[sp.MatrixSymbol, sp.MatrixSymbol], list[Equation]]:
    """v and b of the reflection 1 - b v v^T that maps column k to direction k."""
    size, v, b = symbol(f"size_{k + 1}", 1), symbol(f"v_{k + 1}", 6), symbol(f"b_{k + 1}", 1)
    length, first = size[0, 0], matrix[k, k]
    first_entry = first + sp.Piecewise((-length, first < 0), (length, True))
    entries = [*[sp.Integer(0)] * k, first_entry, *(matrix[i, k] for i in range(k + 1, 6))]
    share = length * (length + sp.Abs(first))
    return (v, b), [
        Equation(
            f"length of column {k + 1}", size,
            sp.ImmutableDenseMatrix([sp.sqrt(sum(matrix[i, k] ** 2 for i in range(k, 6)))]),
        ),
        Equation(f"reflection vector {k + 1}", v, sp.ImmutableDenseMatrix(entries)),
        Equation(
            f"2 / v^T v of reflection vector {k + 1}", b,
            sp.ImmutableDenseMatrix([sp.Piecewise((1 / share, share > 0), (0, True))]),
        ),
    ]  # fmt: skip


def _apply_reflection(
    mirror: tuple[sp.MatrixSymbol, sp.MatrixSymbol], matrix: sp.Basic
) -> sp.Basic:
    v, b = mirror
    rows, columns = (int(extent) for extent in matrix.shape)
    projections = [sum(v[i, 0] * matrix[i, j] for i in range(rows)) for j in range(columns)]
    return sp.ImmutableDenseMatrix(
        rows, columns, lambda i, j: matrix[i, j] - b[0, 0] * v[i, 0] * projections[j]
    )
