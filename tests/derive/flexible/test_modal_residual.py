"""The residual of a flexible body follows from its kinetic and strain energy, symbolically.

T = 1/2 yd^T M(eta) yd with yd = [v; w; etad] is formed from the moments that the kernel
`momentum` states; the equations of Boltzmann and Hamel are then taken by SymPy:

    d/dt dT/dv + w x dT/dv = f                 d/dt dT/deta' - dT/deta + K eta + D etad = 0
    d/dt dT/dw + w x dT/dw + v x dT/dv = m
"""

import sympy as sp

from mstmm.derive.definition.derivation import Derivation
from mstmm.derive.flexible import modal_residual, section

N = 2


def _explicit(name: str, rows: int, columns: int, symmetric: bool = False) -> sp.Matrix:
    def entry(i: int, j: int) -> sp.Symbol:
        i, j = (min(i, j), max(i, j)) if symmetric else (i, j)
        return sp.Symbol(f"{name}_{i}{j}")

    return sp.Matrix(rows, columns, entry)


def _value(expression: sp.Basic, known: dict[str, sp.Matrix]) -> sp.Matrix:
    """A matrix expression with every array replaced by its entries."""
    if isinstance(expression, sp.MatrixSymbol):
        return known[expression.name]
    if isinstance(expression, sp.MatrixBase):
        return sp.Matrix(expression.applyfunc(lambda x: _scalar(x, known)))
    if isinstance(expression, sp.MatAdd):
        first, *rest = (_value(x, known) for x in expression.args)
        return sum(rest, first)
    if isinstance(expression, sp.MatMul):
        factor, matrices = expression.as_coeff_matrices()
        result = _value(matrices[0], known)
        for matrix in matrices[1:]:
            result = result * _value(matrix, known)
        return _scalar(factor, known) * result
    if isinstance(expression, sp.Transpose):
        return _value(expression.arg, known).T
    if isinstance(expression, sp.BlockMatrix):
        blocks = expression.blocks
        rows = [
            sp.Matrix.hstack(*(_value(blocks[i, j], known) for j in range(blocks.cols)))
            for i in range(blocks.rows)
        ]
        return sp.Matrix.vstack(*rows)
    if isinstance(expression, sp.ZeroMatrix):
        return sp.zeros(*expression.shape)
    whole = _value(expression.parent, known)
    (r0, r1, _), (c0, c1, _) = expression.rowslice, expression.colslice
    return whole[int(r0) : int(r1), int(c0) : int(c1)]


def _scalar(entry: sp.Expr, known: dict[str, sp.Matrix]) -> sp.Expr:
    entries = entry.atoms(sp.matrices.expressions.matexpr.MatrixElement)
    return entry.xreplace({x: known[x.parent.name][int(x.i), int(x.j)] for x in entries})


def _definition_values(derivation: Derivation, given: dict[str, sp.Matrix]) -> dict[str, sp.Matrix]:
    known = dict(given)
    for equation in derivation.at_size(N).definitions:
        known[equation.left.name] = _value(equation.right, known)
    return known


#: Second derivatives are symmetric matrices; the others are what they are.
_SYMMETRIC = ("Z_", "G_", "M", "K", "D")


def _data() -> dict[str, sp.Matrix]:
    arrays = {}
    for quantity in (*modal_residual.MOMENTS, modal_residual.STIFFNESS, modal_residual.DAMPING):
        rows, columns = (N if x == modal_residual.N else int(x) for x in quantity.symbol.shape)
        symmetric = quantity.name.startswith(_SYMMETRIC)
        arrays[quantity.name] = _explicit(quantity.name, rows, columns, symmetric)
    return arrays


def test_residual_is_that_of_its_energy() -> None:
    data = _data()
    v, w, a, wd = (_explicit(name, 3, 1) for name in ("v", "w", "a", "wd"))
    eta, etad, etadd = (_explicit(name, N, 1) for name in ("eta", "etad", "etadd"))
    found = _definition_values(
        modal_residual.momentum(), data | {"eta": eta, "etad": etad, "v": v, "w": w}
    )
    energy = found["T"][0, 0]
    speeds = [*v, *w, *etad]
    momenta = sp.Matrix([energy.diff(x) for x in speeds])
    assert sp.expand(momenta - sp.Matrix([*found["h"], *found["h_f"]])) == sp.zeros(6 + N, 1)

    # The rate of v in frame axes is a - w x v for the acceleration a of the origin.
    rates = dict(zip(speeds, [*(a - w.cross(v)), *wd, *etadd], strict=True))
    rates |= dict(zip(eta, etad, strict=True))
    change = sum((momenta.diff(x) * rate for x, rate in rates.items()), sp.zeros(6 + N, 1))
    p, turn = momenta[:3, :], momenta[3:6, :]
    forces = sp.Matrix.vstack(
        change[:3, :] + w.cross(p),
        change[3:6, :] + w.cross(turn) + v.cross(p),
        change[6:, :]
        - sp.Matrix([energy.diff(x) for x in eta])
        + data["K"] * eta
        + data["D"] * etad,
    )
    motion = sp.Matrix([*w, *wd, *a])
    own = _definition_values(
        modal_residual.residual(), data | {"eta": eta, "etad": etad, "motion": motion}
    )
    stated = sp.Matrix.vstack(
        own["e"] + own["S_rf"] * etadd, own["e_f"] + own["S_rf"].T * sp.zeros(6, 1)
    )
    stated[6:, :] += own["S_ff"] * etadd
    assert (forces - stated).applyfunc(sp.expand) == sp.zeros(6 + N, 1)


def test_rotation_of_a_section_and_its_rate_are_one_map() -> None:
    """exp by its series is orthogonal, and T its derivative, as far as the terms go."""
    s = sp.Symbol("s", positive=True)
    exact = {1: sp.sin(sp.sqrt(s)) / sp.sqrt(s), 2: (1 - sp.cos(sp.sqrt(s))) / s}
    exact[3] = (sp.sqrt(s) - sp.sin(sp.sqrt(s))) / s ** sp.Rational(3, 2)
    largest = section.MAX_SECTION_ROTATION**2
    for first, function in exact.items():
        gap = (section.even_series(first, s) - function).subs(s, largest)
        slope = (section.even_series(first, s, derivative=True) - function.diff(s)).subs(s, largest)
        assert abs(sp.N(gap, 40)) < 1e-17
        assert abs(sp.N(slope, 40)) < 1e-16
