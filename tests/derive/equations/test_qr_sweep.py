"""The sweep as least squares, step by step at 40 digits, against the Riccati sweep's own steps."""

from __future__ import annotations

import random
from functools import cache
from typing import Any

import mpmath
import pytest
import sympy as sp

from mstmm.derive.catalogue.kernels import generic_kernels, kernels_of, qr_kernels
from mstmm.derive.definition.derivation import Derivation, Equation, Quantity, Triangle
from mstmm.derive.elements.body_rigid import RigidBody
from mstmm.derive.lower.kernel_lowering import lower
from mstmm.derive.verification.equation_evaluation import evaluate_equations
from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.derive.verification.sample_points import random_rotation
from mstmm.ir import KernelIR
from mstmm.ir.interpreter import GuardFailure

DIGITS = 40
SPEEDS = (0, 1, 2, 3, 6)
STEPS = {kernel.name: kernel.ir() for kernel in qr_kernels()}
Values = dict[str, Any]


@cache
def generic_irs(nu: int) -> dict[str, KernelIR]:
    """Kernels of the sweep for hinges with `nu` free speeds, by name."""
    return {kernel.name: kernel.ir() for kernel in generic_kernels(nu)}


def random_floats(count: int, numbers: random.Random) -> list[float]:
    return [numbers.uniform(-1.0, 1.0) for _ in range(count)]


def close(found: Any, wanted: Any) -> bool:
    return all(abs(a - b) < mpmath.mpf(10) ** -30 for a, b in zip(found, wanted, strict=True))


def triangular(numbers: Any) -> Any:
    """6 x 6 from its upper triangle, row by row."""
    entries, matrix = iter(numbers), mpmath.zeros(6, 6)
    for i in range(6):
        for j in range(i, 6):
            matrix[i, j] = next(entries)
    return matrix


def upper(matrix: Any) -> list[Any]:
    return [matrix[i, j] for i in range(6) for j in range(i, 6)]


def rows(numbers: random.Random, missing: int | None = None) -> list[float]:
    """A regular triangle, or one with a row of zeros."""
    matrix = triangular(random_floats(21, numbers))
    for i in range(6):
        matrix[i, i] = 0.0 if i == missing else 1.0 + abs(matrix[i, i])
        if i == missing:
            matrix[i, :] = mpmath.zeros(1, 6)
    return upper(matrix)


# --- the primitive ------------------------------------------------------------------------------


@pytest.mark.parametrize(("height", "width", "count"), [(1, 2, 1), (4, 4, 3), (7, 5, 4), (3, 5, 3)])
@pytest.mark.parametrize("sparse", [False, True])
def test_triangle(height: int, width: int, count: int, sparse: bool) -> None:
    """R^T R = A^T A in the columns of the triangle, zeros below a positive diagonal."""
    a = sp.MatrixSymbol("A", height, width)
    there = sp.ImmutableDenseMatrix(
        height, width, lambda i, j: sp.Integer(0) if sparse and i in (j + 1, j + 2) else a[i, j]
    )
    r = sp.MatrixSymbol("R", count, width)
    equation = Equation("R", r, Triangle(there, count))
    derivation = Derivation("test", "triangle", (Quantity(a),), (Quantity(r),), (equation,))
    given = {"A": random_floats(height * width, random.Random(height))}
    with mpmath.workdps(DIGITS):
        found = evaluate(lower(derivation, "test"), given, DIGITS)["R"]
        assert close(found, evaluate_equations(derivation, given, digits=DIGITS).outputs["R"])
        entries = [
            [0 if there[i, j] == 0 else given["A"][i * width + j] for j in range(width)]
            for i in range(height)
        ]
        A = mpmath.matrix(entries)
        R = mpmath.matrix([list(found[i * width : (i + 1) * width]) for i in range(count)])
        gap = A.T * A - R.T * R
        assert max(abs(gap[i, j]) for i in range(count) for j in range(width)) < 1e-30
        assert all(R[i, j] == 0 for i in range(count) for j in range(i))
        assert all(R[i, i] > 0 for i in range(count))


def test_a_rotation_keeps_small_rows_beside_large_ones() -> None:
    """In doubles: of rows 1e12 times as large as another nothing is left in that one."""
    a, r = sp.MatrixSymbol("A", 3, 3), sp.MatrixSymbol("R", 3, 3)
    equation = Equation("R", r, Triangle(a, 3))
    derivation = Derivation("test", "triangle", (Quantity(a),), (Quantity(r),), (equation,))
    numbers = random.Random(1)
    given = {"A": [*random_floats(3, numbers), *(1e12 * x for x in random_floats(6, numbers))]}
    kernel = lower(derivation, "test")
    for first in range(3):  # wherever the light row stands
        turned = given["A"][3 * first :] + given["A"][: 3 * first]
        exact = evaluate(kernel, {"A": turned}, DIGITS)["R"]
        found = evaluate(kernel, {"A": turned}, 15)["R"]
        assert abs(found[8] / exact[8] - 1) < 1e-13


# --- rows of a body -----------------------------------------------------------------------------


def mass_matrix(mass: float, center: list[float], moments: list[float]) -> Any:
    """About the input end, by moments of inertia about the mass centre."""
    x, y, z = (mpmath.mpf(c) for c in center)
    arm = mpmath.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = mpmath.eye(6) * mass
    matrix[:3, 3:], matrix[3:, :3] = -mass * arm, mass * arm
    matrix[3:, 3:] = mpmath.diag(moments) - mass * arm * arm
    return matrix


@pytest.mark.parametrize(
    ("mass", "center", "moments"),
    [(2.0, [0.1, 0.2, -0.4], [0.3, 0.4, 0.5]), (2.0, [0.5, 0, 0], [0, 0.1, 0.1]),
     (3.0, [0.3, 0.4, 0.1], [0, 0, 0]), (1.0, [0, 0, 0], [0, 0, 0.2]), (0.0, [0, 0, 0], [0, 0, 0])],
)  # fmt: skip
@pytest.mark.parametrize("digits", [DIGITS, 15])
def test_rows_of_a_body_are_a_factor(
    mass: float, center: list[float], moments: list[float], digits: int
) -> None:
    with mpmath.workdps(DIGITS):
        exact = mass_matrix(mass, center, moments)
        given = [mpmath.mpf(float(x)) for x in upper(exact)]
        U = triangular(evaluate(STEPS["factor"], {"S": given}, digits)["U"])
        gap = U.T * U - exact
        assert max(abs(x) for x in gap) <= 4e-15 * max(abs(x) for x in exact)


def test_loads_of_a_body_by_its_rows() -> None:
    """Together they are the load that the body's own equations give, short arm or long."""
    kernels = {kernel.name: kernel.ir() for kernel in kernels_of(RigidBody())}
    numbers = random.Random(4)
    with mpmath.workdps(DIGITS):
        for moments in ([0.3, 0.4, 0.5], [1e-9, 2e-9, 2e-9], [0.0, 0.0, 0.1]):
            mass, center = 2.0, [mpmath.mpf(x) for x in random_floats(3, numbers)]
            inertia = mass_matrix(mass, center, moments)[3:, 3:]
            tensor = [inertia[i, j] for i in range(3) for j in range(i, 3)]
            p = [mpmath.mpf(mass), *(mass * x for x in center), *tensor]
            motion = random_floats(9, numbers)
            S = evaluate(kernels["inertia"], {"p": p}, DIGITS)["S"]
            load = evaluate(kernels["bias_load"], {"p": p, "motion": motion}, DIGITS)["e"]
            U = evaluate(STEPS["factor"], {"S": S}, DIGITS)["U"]
            own = evaluate(STEPS["bias"], {"U": U, "motion": motion}, DIGITS)
            found = riccati_form(U, own["d"], own["e"])["e_S"]
            gaps = [abs(a - b) for a, b in zip(found, load, strict=True)]
            assert max(gaps) < (1e-30 if min(moments) > 0 else 1e-13)  # rounding added to zeros


# --- a hinge ------------------------------------------------------------------------------------


def eliminate_and_merge(nu: int, given: Values) -> Values:
    """G, g, and what reaches a parent that has rows already, by rotations of rows."""
    found = evaluate(generic_irs(nu)["qr_eliminate"], given, DIGITS)
    behind = {name: found[name] for name in ("V", "d_V", "e_Q")}
    merged = evaluate(STEPS["merge"], given | behind, DIGITS)
    return {"G": found["G"], "g": found["g"]} | {name: merged[name] for name in ("U", "d", "e_I")}


def riccati_form(rows_of: Any, taken: Any, rest: Any) -> Values:
    return evaluate(STEPS["rows_to_riccati"], {"U": rows_of, "d": taken, "e": rest}, DIGITS)


@pytest.mark.parametrize("missing", [None, 0, 4])
@pytest.mark.parametrize("rotors", [False, True])
@pytest.mark.parametrize("nu", SPEEDS)
def test_a_hinge_is_passed_as_by_the_riccati_sweep(
    nu: int, rotors: bool, missing: int | None
) -> None:
    """G, g, S and e; also where rows cannot take all of the load (`missing`)."""
    numbers = random.Random(nu + 10 * rotors)
    if missing is not None and nu == 6 and not rotors:
        missing = None  # a free body of singular mass matrix has no accelerations
    given: Values = {
        "Rc": random_rotation(numbers), "r": random_floats(3, numbers),
        "H": random_floats(6 * nu, numbers),
        "J": [numbers.uniform(0.5, 2.0) * rotors for _ in range(nu)], "floor": [0.0, 0.0],
        "U": rows(numbers, missing), "d": random_floats(6, numbers), "e": random_floats(6, numbers),
        "tau": random_floats(nu, numbers), "U_P": rows(numbers), "d_P": random_floats(6, numbers),
    }  # fmt: skip
    with mpmath.workdps(DIGITS):
        found = eliminate_and_merge(nu, given)
        whole = riccati_form(given["U"], given["d"], given["e"])
        riccati = {name: given[name] for name in ("Rc", "r", "H", "J", "floor", "tau")}
        wanted = evaluate(
            generic_irs(nu)["condense"], riccati | {"S": whole["S"], "e": whole["e_S"]}, DIGITS
        )
        assert close(found["G"], wanted["G"]) and close(found["g"], wanted["g"])
        parent = riccati_form(given["U_P"], given["d_P"], [0] * 6)
        after = riccati_form(found["U"], found["d"], found["e_I"])
        added = [a + b for a, b in zip(parent["S"], wanted["S_I"], strict=True)]
        loads = [a + b for a, b in zip(parent["e_S"], wanted["e_I"], strict=True)]
        assert close(after["S"], added) and close(after["e_S"], loads)


def test_a_motion_without_inertia_is_undetermined() -> None:
    given: Values = {
        "H": [1, 0, 0, 0, 0, 0], "J": [0], "floor": [0, 0], "d": [0] * 6, "e": [0] * 6, "tau": [1],
        "U": rows(random.Random(1), missing=0),
    }  # fmt: skip
    with pytest.raises(GuardFailure, match="moves no inertia"):
        evaluate(generic_irs(1)["qr_eliminate"], given, DIGITS)


def test_two_speeds_that_are_one_motion_are_undetermined() -> None:
    direction = random_floats(6, random.Random(2))
    given: Values = {
        "H": [x for x in direction for _ in range(2)], "J": [0, 0], "floor": [0, 0], "d": [0] * 6,
        "e": [0] * 6, "tau": [1, 2], "U": rows(random.Random(3)),
    }  # fmt: skip
    with pytest.raises(GuardFailure, match="pivot 2 of 2 vanishes"):
        evaluate(generic_irs(2)["qr_eliminate"], given, DIGITS)
