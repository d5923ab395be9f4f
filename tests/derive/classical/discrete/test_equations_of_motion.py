"""The residual of a flexible body against Lagrange's equations, and against its particles.

Lagrange's equations of a planar beam with two polynomial shapes are formed by SymPy in the
coordinates of its points; particles give accelerations.  Both are exact in rational numbers.
"""

from __future__ import annotations

import random

import numpy as np
import pytest
import sympy as sp

from mstmm.derive.classical.discrete.equations_of_motion import (
    Equations,
    Motion,
    equations_of_motion,
)
from mstmm.derive.classical.discrete.mass_moments import (
    ETA,
    SymbolTable,
    planar_moments,
    spatial_moments,
)
from mstmm.derive.definition.derivation import Equation, vector

Numbers = dict[sp.Basic, sp.Rational]


def rational(numbers: random.Random) -> sp.Rational:
    return sp.Rational(numbers.randint(-20, 20), numbers.randint(1, 9))


@pytest.fixture
def numbers(rng: np.random.Generator) -> random.Random:
    return random.Random(int(rng.integers(2**32)))


def columns(numbers: random.Random, rows: int, count: int = 1) -> sp.Matrix:
    return sp.Matrix(rows, count, lambda *_: rational(numbers))


# --- planar: Lagrange -------------------------------------------------------------------------


def test_planar_beam_with_two_shapes_is_lagrange(numbers: random.Random) -> None:
    """d/dt dT/dyd - dT/dy in [X, Y, theta, eta], turned to frame axes."""
    t, x = sp.symbols("t x")
    y = [sp.Function(name)(t) for name in ("X", "Y", "theta", "e1", "e2")]
    shapes = [columns(numbers, 2)[k] * x**2 + rational(numbers) * x**3 for k in range(2)]
    deflection = y[3] * shapes[0] + y[4] * shapes[1]
    c, s = sp.cos(y[2]), sp.sin(y[2])
    place = sp.Matrix([y[0] + c * x - s * deflection, y[1] + s * x + c * deflection])
    velocity = place.diff(t)
    density, length = sp.Rational(3, 2), 2
    energy = density * sp.integrate(sp.expand(velocity.dot(velocity).expand()), (x, 0, length)) / 2
    rows = [energy.diff(q.diff(t)).diff(t) - energy.diff(q) for q in y]
    values = [{q.diff(t, k): rational(numbers) for q in y} for k in (2, 1, 0)]
    angle = values[2][y[2]] = sp.Integer(1)
    turn = {sp.cos(angle): sp.Rational(3, 5), sp.sin(angle): sp.Rational(4, 5)}
    for group in values:
        rows = [row.subs(group) for row in rows]
    rows = [sp.expand(row.subs(turn)) for row in rows]
    expected = _in_frame_axes(rows)
    motion = {
        "w": [values[1][y[2].diff(t)]], "wd": [values[0][y[2].diff(t, 2)]],
        "a": _in_frame_axes([values[0][q.diff(t, 2)] for q in y[:2]]),
        ETA: [values[2][q] for q in y[3:]], "etad": [values[1][q.diff(t)] for q in y[3:]],
        "etadd": [values[0][q.diff(t, 2)] for q in y[3:]],
    }  # fmt: skip
    found = _planar_rows(shapes, x, density, length, motion)
    assert sp.Matrix(expected) == found


def _in_frame_axes(rows: list[sp.Expr]) -> list[sp.Expr]:
    c, s = sp.Rational(3, 5), sp.Rational(4, 5)
    return [c * rows[0] + s * rows[1], c * rows[1] - s * rows[0], *rows[2:]]


def _planar_rows(
    shapes: list[sp.Expr],
    x: sp.Symbol,
    density: sp.Rational,
    length: int,
    motion: dict[str, list[sp.Expr]],
) -> sp.Matrix:
    def mass_integral(f: sp.Expr) -> sp.Expr:
        return density * sp.integrate(sp.expand(f), (x, 0, length))

    letters = SymbolTable()
    body = planar_moments(2, letters, "beam")
    given = {
        "m": [mass_integral(sp.Integer(1))],
        "S_0": [mass_integral(x), 0], "I_0": [mass_integral(x**2)],
        "s": [mass_integral(f) for f in shapes], "S_c": [mass_integral(x * f) for f in shapes],
        "M_f": [mass_integral(f * g) for f in shapes for g in shapes], ETA: motion[ETA],
    }  # fmt: skip
    solved = equations_of_motion(body.moments, motion_of(letters, 2, 2), sp.zeros(2, 1))
    return numeric(solved.rows, letters, body.definitions, given | motion)


def motion_of(letters: SymbolTable, shifts: int, modes: int) -> Motion:
    def three(name: str, size: int, before: int) -> sp.Matrix:
        behind = [0] * (3 - before - size)
        return sp.Matrix([*[0] * before, *letters.entries_of(vector(name, size)), *behind])

    turns = 1 if shifts == 2 else 3
    return Motion(
        three("a", shifts, 0), three("w", turns, 3 - turns), three("wd", turns, 3 - turns),
        *(letters.entries_of(vector(name, modes)) for name in (ETA, "etad", "etadd")),
    )  # fmt: skip


def numeric(
    rows: sp.Matrix,
    letters: SymbolTable,
    definitions: tuple[Equation, ...],
    given: dict[str, list[sp.Expr]],
) -> sp.Matrix:
    """Rows with the arrays' numbers: the given ones, then those that are defined from them."""
    values: Numbers = {}

    def set_symbol_values(name: str, shape: tuple[int, int], entries: list[sp.Expr]) -> None:
        symbol = sp.MatrixSymbol(name, *shape)
        values.update(zip(symbol.as_explicit(), entries, strict=True))

    for name, entries in given.items():
        side = round(len(entries) ** 0.5)
        square = name in ("M_f", "J_0", "M_phi")
        set_symbol_values(name, (side, side) if square else (len(entries), 1), list(entries))
    for equation in definitions:
        value = equation.right.xreplace(values)
        set_symbol_values(str(equation.left.name), value.shape, list(value))
    return sp.Matrix(letters.to_matrix_entries(rows).xreplace(values)).applyfunc(sp.expand)


# --- space: particles -------------------------------------------------------------------------


@pytest.mark.parametrize("planes", ["yz", "yyz"])
def test_spatial_beam_is_its_particles(planes: str, numbers: random.Random) -> None:
    modes, x = len(planes), [rational(numbers) for _ in range(3)]
    along = [sp.eye(3)[:, "xyz".index(p)] for p in planes]
    sizes = columns(numbers, len(x), modes)
    masses = [1 + sp.Abs(rational(numbers)) for _ in x]
    places = [sp.Matrix([value, 0, 0]) for value in x]
    shapes = [sp.Matrix.hstack(*(sizes[i, k] * along[k] for k in range(modes))) for i in range(3)]
    motion = {name: list(columns(numbers, 3)) for name in ("a", "w", "wd")}
    motion |= {name: list(columns(numbers, modes)) for name in (ETA, "etad", "etadd")}
    letters = SymbolTable()
    body = spatial_moments(modes, letters, "beam", planes)
    total = [(m, r, phi) for m, r, phi in zip(masses, places, shapes, strict=True)]
    rest = sum((m * (r.dot(r) * sp.eye(3) - r * r.T) for m, r, _ in total), sp.zeros(3))
    given = {
        "m": [sum(masses)], "S_0": list(sum((m * r for m, r, _ in total), sp.zeros(3, 1))),
        "J_0": list(rest),
        "s": [sum(m * sizes[i, k] for i, m in enumerate(masses)) for k in range(modes)],
        "e": [sum(m * x[i] * sizes[i, k] for i, m in enumerate(masses)) for k in range(modes)],
        "M_phi": [
            sum(m * sizes[i, k] * sizes[i, j] for i, m in enumerate(masses))
            for k in range(modes)
            for j in range(modes)
        ],
    }  # fmt: skip
    solved = equations_of_motion(body.moments, motion_of(letters, 3, modes), sp.zeros(modes, 1))
    found = numeric(solved.rows, letters, body.definitions, given | motion)
    assert found == particle_rows(total, motion)


def particle_rows(
    total: list[tuple[sp.Expr, sp.Matrix, sp.Matrix]], motion: dict[str, list[sp.Expr]]
) -> sp.Matrix:
    a, w, wd, eta, etad, etadd = (
        sp.Matrix(motion[name]) for name in ("a", "w", "wd", ETA, "etad", "etadd")
    )
    force, moment, modal = sp.zeros(3, 1), sp.zeros(3, 1), sp.zeros(eta.rows, 1)
    for m, rest, phi in total:
        r = rest + phi * eta
        acceleration = a + wd.cross(r) + w.cross(w.cross(r)) + 2 * w.cross(phi * etad) + phi * etadd
        force += m * acceleration
        moment += m * r.cross(acceleration)
        modal += m * phi.T * acceleration
    return sp.Matrix([*force, *moment, *modal])


def test_derivatives_of_the_rows_are_theirs() -> None:
    """Columns of mass matrix, rates and shape against SymPy's derivatives of the rows."""
    letters = SymbolTable()
    body = planar_moments(2, letters, "elastic")
    motion = motion_of(letters, 2, 2)
    solved: Equations = equations_of_motion(body.moments, motion, sp.zeros(2, 1))
    put = {e.left: e.right for e in body.definitions}
    entries = {
        entry: value
        for symbol, values in put.items()
        for entry, value in zip(symbol.as_explicit(), values, strict=True)
    }

    def expand_entries(matrix: sp.Matrix) -> sp.Matrix:
        return sp.Matrix(letters.to_matrix_entries(matrix).xreplace(entries))

    rows = expand_entries(solved.rows)
    for name, columns_, matrix in (
        ("etadd", slice(3, 5), solved.mass), ("etad", slice(3, 5), solved.rates),
        (ETA, slice(0, 2), solved.shape),
    ):  # fmt: skip
        symbols = list(vector(name, 2).as_explicit())
        plain = dict(zip(symbols, sp.symbols("u1 u2"), strict=True))
        direct = rows.xreplace(plain).jacobian(list(plain.values()))
        stated = expand_entries(matrix)[:, columns_].xreplace(plain)
        assert (direct - stated).applyfunc(sp.expand) == sp.zeros(5, 2)
