"""Differentiated kernels against differences at 60 digits and against the complex step."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest

from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import Constant, KernelIR, Port, Store
from mstmm.ir.differentiation import differentiate
from mstmm.ir.graph import Graph
from mstmm.ir.interpreter import GuardFailure, evaluate_floats
from tests.derive.codegen.test_kernel_text import KERNEL as MODAL
from tests.derive.codegen.test_kernel_text import SIZES, random_kernel_inputs
from tests.support.kernels.complex_arithmetic import complex_step
from tests.support.kernels.random_kernels import random_inputs, random_kernel

Arrays = dict[str, list[float]]


def directions(kernel: KernelIR, ports: list[str], n: int, seed: int) -> Arrays:
    draw = random.Random(seed)
    return {
        port.name: [draw.uniform(-1, 1) for _ in range(port.length(n))]
        for port in kernel.inputs
        if port.name in ports
    }


def difference(
    kernel: KernelIR, inputs: Arrays, along: Arrays, n: int | None = None
) -> dict[str, list[Any]]:
    """Central difference with a step of 1e-25 at 60 digits: exact to 1e-30 or so."""
    step = Fraction(1, 10**25)
    sides = []
    for sign in (1, -1):
        moved: dict[str, Any] = {
            name: [
                Fraction(x) + sign * step * Fraction(d)
                for x, d in zip(values, along.get(name, [0.0] * len(values)), strict=True)
            ]
            for name, values in inputs.items()
        }
        sides.append(evaluate(kernel, moved, 60, n))
    with mpmath.workdps(60):
        return {
            name: [(a - b) * 10**25 / 2 for a, b in zip(row, sides[1][name], strict=True)]
            for name, row in sides[0].items()
        }


def with_directions(inputs: Arrays, along: Arrays) -> Arrays:
    return inputs | {f"d_{name}": values for name, values in along.items()}


def farthest(found: list[Any], wanted: list[Any]) -> float:
    size = max((abs(w) for w in wanted), default=1)
    pairs = zip(found, wanted, strict=True)
    return float(max((abs(f - w) for f, w in pairs), default=0) / max(size, 1))


@pytest.mark.parametrize("seed", range(25))
def test_random_kernels_of_all_operations(seed: int) -> None:
    kernel = random_kernel("all", seed, size=40)
    inputs = random_inputs(seed + 1000)
    ports = [["x", "A"], ["x"], ["A"]][seed % 3]
    along = directions(kernel, ports, 0, seed)
    differentiated = differentiate(kernel, ports)
    given = with_directions(inputs, along)
    precise = evaluate(differentiated, given, 60)
    for name, wanted in difference(kernel, inputs, along).items():
        assert farthest(precise[f"d_{name}"], wanted) < 1e-20, name
    floats = evaluate_floats(differentiated, given)
    stepped = complex_step(kernel, inputs, along)
    for name in ("y", "total"):
        assert floats[name] == evaluate_floats(kernel, inputs)[name]
        assert farthest(floats[f"d_{name}"], precise[f"d_{name}"]) < 1e-9
        assert farthest(floats[f"d_{name}"], stepped[name]) < 1e-9


@pytest.mark.parametrize("n", SIZES)
def test_loops_and_solves_of_a_run_time_size(n: int, rng: np.random.Generator) -> None:
    """Sums, stores by mode and x = M^-1 b with b moving."""
    ports = ["scale", "phi", "rate", "F"]
    inputs, along = random_kernel_inputs(n, rng), directions(MODAL, ports, n, n)
    found = evaluate(differentiate(MODAL, ports), with_directions(inputs, along), 60, n)
    for name, wanted in difference(MODAL, inputs, along, n).items():
        assert farthest(found[f"d_{name}"], wanted) < 1e-18, name


def test_a_solve_whose_right_side_stands_still_has_no_derivative() -> None:
    found = evaluate(
        differentiate(MODAL, ["scale"]),
        {**random_kernel_inputs(3, np.random.default_rng(1)), "d_scale": [1.0]}, 50, 3,
    )  # fmt: skip
    assert not any(found["d_x"]) and not any(found["d_X"]) and any(found["d_s"])


def test_a_solve_whose_matrix_moves_is_refused() -> None:
    with pytest.raises(ValueError, match="the matrix 'M' of a run-time sized solve depends on"):
        differentiate(MODAL, ["M", "rate"])


@pytest.mark.parametrize(("ports", "outputs"), [(["z"], None), (["x"], ["z"])])
def test_unknown_ports_are_refused(ports: list[str], outputs: list[str] | None) -> None:
    with pytest.raises(ValueError, match="all: no port 'z' to differentiate"):
        differentiate(random_kernel("all", 1, 10), ports, outputs)


def small() -> KernelIR:
    """y = [a sin b + 3 c, b^2, 7], for c > 0."""
    graph = Graph()
    a, b, c = (graph.element(name) for name in "abc")
    graph.guard(graph.call("lt", 0, c), 4, "c is not positive")
    values: dict[str, object] = {"y": [a * graph.sin(b) + 3 * c, b * b, graph.constant(7)]}
    return graph.kernel("small", [Port(n) for n in "abc"], [Port("y", (3,))], values)


def test_what_does_not_move_costs_nothing() -> None:
    slope = differentiate(small(), ["a"], values=False, guards=False)
    assert slope.operation_counts() == {"mul": 1, "sin": 1}
    stored = [s.value for s in slope.statements if isinstance(s, Store)]
    assert stored[1:] == [Constant("0"), Constant("0")]
    assert differentiate(small(), ["c"], values=False, guards=False).operation_counts() == {
        "mul": 1
    }
    # Value and derivative share what they have in common.
    both = differentiate(small(), ["a", "b"]).operation_counts()
    assert both["sin"] == both["cos"] == 1


def test_guards_stay_unless_they_are_not_wanted() -> None:
    given = {"a": 1, "b": 2, "c": -1, "d_c": 1}
    with pytest.raises(GuardFailure, match="c is not positive"):
        evaluate(differentiate(small(), ["c"]), given)
    assert evaluate(differentiate(small(), ["c"], guards=False), given)["d_y"] == [3, 0, 0]


def test_ports_stand_behind_those_of_the_kernel_and_say_what_they_are() -> None:
    found = differentiate(random_kernel("all", 2, 10), ["A"])
    assert [(p.name, p.shape) for p in found.inputs[2:]] == [("d_A", (2, 3))]
    assert [(p.name, p.accumulate) for p in found.outputs[2:]] == [
        ("d_y", False), ("d_total", True),
    ]  # fmt: skip
    assert found.inputs[2].meaning == "derivative of A"
