"""Factors, triangular solves, and the elimination made of them, at 40 digits."""

from __future__ import annotations

import random
from functools import cache
from typing import Any

import mpmath
import pytest
import sympy as sp

from mstmm.derive.catalogue.kernels import generic_kernels, hinge_kernels
from mstmm.derive.catalogue.registry import builtin_elements
from mstmm.derive.definition.derivation import Derivation, Equation, Factor, Quantity, Triangular
from mstmm.derive.definition.element import Hinge
from mstmm.derive.equations import screw_transport
from mstmm.derive.lower.kernel_lowering import lower
from mstmm.derive.verification.equation_evaluation import Undefined, evaluate_equations
from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.derive.verification.sample_points import random_rotation
from mstmm.ir import KernelIR

DIGITS = 40
Values = dict[str, Any]


def close(found: list[Any], wanted: list[Any]) -> bool:
    return all(abs(a - b) < mpmath.mpf(10) ** -30 for a, b in zip(found, wanted, strict=True))


def random_floats(count: int, numbers: random.Random) -> list[float]:
    return [numbers.uniform(-1.0, 1.0) for _ in range(count)]


def definite(n: int, numbers: random.Random) -> Any:
    root = mpmath.matrix(n, n)
    for i in range(n):
        for j in range(n):
            root[i, j] = numbers.uniform(-1.0, 1.0) + (i == j)
    return root * root.T


def upper(matrix: Any) -> list[Any]:
    return [matrix[i, j] for i in range(matrix.rows) for j in range(i, matrix.rows)]


# --- the two primitives -----------------------------------------------------------------------


def primitives(n: int, width: int) -> Derivation:
    a = Quantity(sp.MatrixSymbol("A", n, n), symmetric=True)
    b = Quantity(sp.MatrixSymbol("B", n, width))
    f, x, y = (
        Quantity(sp.MatrixSymbol(name, n, k))
        for name, k in zip("FXY", (n, width, width), strict=True)
    )
    return Derivation(
        "test", "primitives", (a, b), (f, x, y),
        (
            Equation("factor", f.symbol, Factor(a.symbol)),
            Equation("L^-1 B", x.symbol, Triangular(f.symbol, b.symbol)),
            Equation("L^-T B", y.symbol, Triangular(f.symbol, b.symbol, transposed=True)),
        ),
    )  # fmt: skip


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_factor_and_triangular(n: int) -> None:
    numbers = random.Random(n)
    with mpmath.workdps(DIGITS):
        a = definite(n, numbers)
        given = {"A": upper(a), "B": random_floats(2 * n, numbers)}
        derivation = primitives(n, 2)
        found = evaluate(lower(derivation, "test"), given, DIGITS)
        stated = evaluate_equations(derivation, given, digits=DIGITS).outputs
        assert all(close(found[name], stated[name]) for name in "FXY")
        b, f, x, y = (mpmath.matrix(n, k) for k in (2, n, 2, 2))
        for matrix, values in ((b, given["B"]), (f, found["F"]), (x, found["X"]), (y, found["Y"])):
            for i, value in enumerate(values):
                matrix[i // matrix.cols, i % matrix.cols] = value
        unit, scale = mpmath.eye(n), mpmath.zeros(n)
        for i in range(n):
            scale[i, i] = 1 / f[i, i]
            for j in range(n):
                if j < i:
                    unit[i, j] = f[i, j]
                if j > i:
                    assert f[i, j] == 0
        assert mpmath.norm(unit * scale * unit.T - a) < 1e-30
        assert mpmath.norm(unit * x - b) < 1e-30
        assert mpmath.norm(unit.T * y - b) < 1e-30


def test_an_indefinite_matrix_has_no_factor() -> None:
    derivation, given = primitives(2, 1), {"A": [1, 2, 1], "B": [1, 1]}
    with pytest.raises(Undefined):
        evaluate_equations(derivation, given)


# --- the elimination ----------------------------------------------------------------------------

STILL: Values = {"Rc": [1, 0, 0, 0, 1, 0, 0, 0, 1], "r": [0, 0, 0]}


@cache
def generic_irs(nu: int) -> dict[str, KernelIR]:
    """Kernels of the sweep for hinges with `nu` free speeds, by name."""
    return {kernel.name: kernel.ir() for kernel in generic_kernels(nu)}


def state(nu: int, numbers: random.Random) -> Values:
    drawn = {
        "S": upper(definite(6, numbers)),
        "e": random_floats(6, numbers),
        "tau": random_floats(nu, numbers),
    }
    return drawn | {"delta_I": random_floats(6, numbers)}


def factored_elimination(kernel: KernelIR, given: Values) -> Values:
    """S_Q, e_Q, udot and delta by way of the factored elimination."""
    names = {port.name for port in kernel.inputs}
    found = evaluate(kernel, {k: v for k, v in given.items() if k in names}, DIGITS)
    recover = generic_irs(len(given["tau"]))["recover_factored"]
    return found | evaluate(recover, given | found | STILL, DIGITS)


def full(given: Values) -> Values:
    """The same by the full gain G of the looped engine's steps."""
    steps = generic_irs(len(given["tau"]))
    found = evaluate(steps["condense"], given | STILL | {"floor": [0, 0]}, DIGITS)
    return found | evaluate(steps["recover"], given | found | STILL, DIGITS)


def assert_same_results(one: Values, other: Values) -> None:
    for left, right in (("S_Q", "S_I"), ("e_Q", "e_I"), ("udot", "udot"), ("delta", "delta")):
        assert close(one[left], other[right]), left


@pytest.mark.parametrize("nu", [1, 2, 3, 6])
def test_factored_elimination_of_any_subspace(nu: int) -> None:
    numbers = random.Random(10 + nu)
    with mpmath.workdps(DIGITS):
        given = state(nu, numbers) | {"H": random_floats(6 * nu, numbers)}
        given["J"] = [numbers.uniform(0.1, 1.0) for _ in range(nu)]
        assert_same_results(factored_elimination(generic_irs(nu)["eliminate"], given), full(given))


@pytest.mark.parametrize("name", ["pin", "cylindrical", "ball", "free"])
def test_factored_elimination_of_unit_directions(name: str) -> None:
    """What is declared of unit directions instead of computed agrees with the full equations."""
    hinge = next(e for e in builtin_elements() if isinstance(e, Hinge) and e.name == name)
    kernels = {k.name: k.ir() for k in hinge_kernels(hinge)}
    rows = {"pin": (5,), "cylindrical": (2, 5), "ball": (3, 4, 5), "free": tuple(range(6))}[name]
    nu = len(rows)
    numbers = random.Random(20 + nu)
    with mpmath.workdps(DIGITS):
        given = state(nu, numbers) | {"J": [0] * nu, "p": [], "q": random_floats(nu, numbers)}
        given["H"] = [int(row == rows[k]) for row in range(6) for k in range(nu)]
        kernel = kernels["eliminate"]
        for port in kernel.inputs:
            if port.name in ("p", "q"):
                given[port.name] = random_floats(port.length(), numbers)
        assert_same_results(factored_elimination(kernel, given), full(given))


# --- turned axes --------------------------------------------------------------------------------


def test_turn_by_trace_is_the_turn() -> None:
    turn = lower(screw_transport.turn(), "condense_turn")
    by_trace = lower(screw_transport.turn_by_trace(), "condense_turn_by_trace")
    numbers = random.Random(5)
    with mpmath.workdps(DIGITS):
        given = {
            "Rc": random_rotation(numbers),
            "S": upper(definite(6, numbers)),
            "e": random_floats(6, numbers),
        }
        plain = evaluate(turn, given, DIGITS)
        traced = evaluate(by_trace, given, DIGITS)
        assert close(traced["S_I"], plain["S_I"])
        assert close(traced["e_I"], plain["e_I"])
    assert by_trace.flops() < turn.flops()
