"""Kernels with a run-time size: sums, stores and solves as C loops, at n = 0, 1, 3, 17."""

from __future__ import annotations

import dataclasses

import mpmath
import numpy as np
import pytest

from mstmm.abi import element_library as abi
from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import LOOP_INDEX, Element, KernelIR, Port, Solve, Store, from_json, to_json
from mstmm.ir.element_spec import ElementSpec
from mstmm.ir.graph import Graph
from mstmm.ir.interpreter import GuardFailure, evaluate_floats
from mstmm.ir.tape import compile_tape
from tests.support.kernels.c_library import CLibrary, are_same_numbers, build
from tests.support.kernels.random_kernels import element

SIZES = (0, 1, 3, 17)
NOT_DEFINITE = 9


def modal_kernel() -> KernelIR:
    """A modal mass with rigid coupling: a generalised sum, stores by mode, and two solves.

    The statements after the solves read what was solved for.
    """
    graph = Graph()
    shape = [graph.element("phi", row, LOOP_INDEX) for row in range(2)]
    rate = graph.element("rate", LOOP_INDEX)
    scale = graph.element("scale") / 3
    power = graph.sum_over_modes(shape[0] * rate * scale)
    count = graph.sum_over_modes(graph.constant(1))
    graph.solve("x", "M", "rate", NOT_DEFINITE, "modal mass is not positive definite")
    graph.solve("X", "M", "F", NOT_DEFINITE + 1, "modal mass is not positive definite")
    after = graph.sum_over_modes(graph.element("x", LOOP_INDEX) * shape[1])
    return graph.kernel(
        "modal",
        (
            Port("scale"), Port("phi", (2, "n")), Port("rate", ("n",)), Port("M", ("n", "n")),
            Port("F", ("n", 3)),
        ),
        (
            Port("x", ("n",)), Port("X", ("n", 3)), Port("s", (3,)), Port("g", ("n", 2)),
            Port("h", (2, "n"), accumulate=True),
        ),
        {
            "s": [power, count, after],
            "g": [shape[0] * power, graph.constant(7)],
            "h": [graph.element("X", LOOP_INDEX, 2), shape[0] + shape[1] * scale],
        },
        size_symbol="n",
        purpose="made up: /* every loop */ there is",
        sources=("none",),
    )  # fmt: skip


KERNEL = modal_kernel()


@pytest.fixture(
    scope="module", params=[(), ("-fsanitize=undefined", "-fsanitize-undefined-trap-on-error")]
)
def library(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> CLibrary:
    """Plain, and with undefined behaviour turned into a crash."""
    spec = element("modal", KERNEL)
    return build(tmp_path_factory.mktemp("modal"), spec, flags=request.param)


def random_kernel_inputs(n: int, rng: np.random.Generator) -> dict[str, list[float]]:
    half = rng.normal(size=(n, n))
    return {
        "scale": [1.5],
        "phi": list(rng.normal(size=2 * n)),
        "rate": list(rng.normal(size=n)),
        "M": list((half @ half.T + n * np.eye(n)).ravel()),
        "F": list(rng.normal(size=3 * n)),
    }


@pytest.mark.parametrize("n", SIZES)
def test_c_equals_floats(n: int, library: CLibrary, rng: np.random.Generator) -> None:
    inputs = random_kernel_inputs(n, rng)
    outcome = library.call("modal", "modal", inputs, n)
    wanted = evaluate_floats(KERNEL, inputs, n)
    assert outcome.code == 0
    assert len(outcome.outputs.pop("work")) == n * n
    assert list(outcome.outputs) == list(wanted)
    for name, row in wanted.items():
        assert are_same_numbers(outcome.outputs[name], row), name


@pytest.mark.parametrize("n", SIZES)
def test_fifty_digits_solve_the_equations(n: int, rng: np.random.Generator) -> None:
    inputs = random_kernel_inputs(n, rng)
    found = {name: np.array(row) for name, row in evaluate(KERNEL, inputs, 50, n).items()}
    matrix = np.array([mpmath.mpf(entry) for entry in inputs["M"]], dtype=object).reshape(n, n)
    right = np.array(inputs["F"]).reshape(n, 3)
    with mpmath.workdps(60):
        assert np.all(abs(matrix @ found["X"].reshape(n, 3) - right) < 1e-45)
        assert np.all(abs(matrix @ found["x"] - inputs["rate"]) < 1e-45)
    phi = np.array(inputs["phi"]).reshape(2, n)
    power = 0.5 * float(phi[0] @ np.array(inputs["rate"]))
    assert np.allclose(found["s"].astype(float), [power, n, phi[1] @ found["x"].astype(float)])
    assert np.allclose(found["g"].astype(float).reshape(n, 2), np.c_[phi[0] * power, [7] * n])


def test_a_vanishing_pivot_leaves_with_its_code(
    library: CLibrary, rng: np.random.Generator
) -> None:
    for spoiled in (0.0, -1.0, np.nan):
        inputs = random_kernel_inputs(3, rng)
        inputs["M"][4] = spoiled
        assert library.call("modal", "modal", inputs, 3).code == NOT_DEFINITE
        with pytest.raises(GuardFailure, match="modal mass is not positive definite") as caught:
            evaluate_floats(KERNEL, inputs, 3)
        assert caught.value.code == NOT_DEFINITE


def test_a_pivot_just_above_its_limit_passes(library: CLibrary) -> None:
    """Singular to 1e-12 of the diagonal entry passes, to 1e-14 does not (limit 1e-13)."""
    for gap, code in ((1e-12, 0), (1e-14, NOT_DEFINITE)):
        inputs = {
            "scale": [1.0], "phi": [1.0] * 4, "rate": [1.0, 2.0],
            "M": [1.0, 1.0, 1.0, 1.0 + gap], "F": [0.0] * 6,
        }  # fmt: skip
        assert library.call("modal", "modal", inputs, 2).code == code


def test_the_descriptor_says_how_long_arrays_are(library: CLibrary) -> None:
    kernel = library.kernel("modal", "modal")
    ports = [kernel.outputs[i] for i in range(kernel.n_outputs)]
    sizes = {library.text(p.name): (p.length, p.power, p.accumulate) for p in ports}
    assert sizes == {
        "x": (1, 1, 0), "X": (3, 1, 0), "s": (3, 0, 0), "g": (2, 1, 0), "h": (2, 1, 1),
        "work": (1, 2, 0),
    }  # fmt: skip
    guards = {kernel.guards[i].code: library.text(kernel.guards[i].message) for i in range(2)}
    assert set(guards) == {NOT_DEFINITE, NOT_DEFINITE + 1}
    assert guards[NOT_DEFINITE] == "modal mass is not positive definite"


def test_prototype_has_the_size_first_and_the_work_array_last() -> None:
    text = " ".join(abi.prototype("hinge", "modal", KERNEL).split())
    assert text.startswith("int mstmm_hinge_modal_modal(int n, in_t scale,")
    assert text.endswith("out_t work)")


def test_stored_form_gives_the_kernel_back() -> None:
    assert from_json(to_json(KERNEL)) == KERNEL


def test_a_tape_has_no_loops() -> None:
    with pytest.raises(ValueError, match="needs fixed sizes, found the size 'n'"):
        compile_tape(KERNEL)


def test_the_size_must_be_given(rng: np.random.Generator) -> None:
    with pytest.raises(ValueError, match="give n, the run-time size 'n'"):
        evaluate(KERNEL, random_kernel_inputs(2, rng))


def test_arrays_called_like_the_loop_and_the_work_array(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """Ports may have any name: words of C, the kernel's own locals, the work array's name."""
    square = ("n", "n")
    names = ("int", "t3", "sin", "k", "n")
    inputs = tuple(Port(name, square if name == "int" else ("n",)) for name in names)
    total = [Store("work", ("k",), Element(name, ("k",))) for name in names[1:]]
    kernel = KernelIR(
        "names",
        inputs,
        (Port("t0", ("n",)), Port("work", ("n",), accumulate=True)),
        (Solve("t0", "int", "sin", 1, "never"), *total),
        size_symbol="n",
    )
    spec: ElementSpec = element("names", kernel)
    opened = build(tmp_path_factory.mktemp("names"), spec)
    given = {"int": [2.0, 0.0, 0.0, 4.0]} | {name: [1.0, 2.0] for name in names[1:]}
    outputs = opened.call("names", "names", given, 2).outputs
    assert outputs["t0"] == [0.5, 0.5]
    assert outputs["work"] == [4.0, 8.0]
    assert set(abi.parameter_names(kernel).values()) >= {"int_", "t3_", "sin_", "t0_", "work"}
    assert dataclasses.replace(kernel, name="other").hash() != kernel.hash()
