"""Matrix equations with a size known at run time: lowered with loops, and with the size put in."""

from __future__ import annotations

import random
from collections.abc import Iterator

import numpy as np
import pytest
import sympy as sp

from mstmm.derive.definition.derivation import Derivation, Equation, Quantity, Solve
from mstmm.derive.lower.kernel_lowering import lower
from mstmm.derive.show.document import kernel_listing
from mstmm.derive.verification.equation_evaluation import evaluate_equations
from mstmm.derive.verification.kernel_evaluation import evaluate, rounding_bounds
from mstmm.errors import NumericalFailure
from mstmm.ir import Element, KernelIR, Port, Store, Sum, from_json, to_json
from mstmm.ir.differentiation import differentiate
from mstmm.ir.graph import Graph
from mstmm.ir.inline import unroll
from mstmm.ir.interpreter import GuardFailure, evaluate_floats
from mstmm.runtime.kernels import numpy_kernels
from tests.support.kernels.c_library import CLibrary, are_same_numbers, build
from tests.support.kernels.random_kernels import element

n = sp.Symbol("n", integer=True, positive=True)
SIZES = (1, 2, 3, 4)

A, B = sp.MatrixSymbol("A", n, n), sp.MatrixSymbol("B", n, n)
C, eta = sp.MatrixSymbol("C", 3, n), sp.MatrixSymbol("eta", n, 1)
S, w = sp.MatrixSymbol("S", 3, 3), sp.MatrixSymbol("w", 3, 1)


def stack(*rows: sp.Basic) -> sp.BlockMatrix:
    return sp.BlockMatrix([[row] for row in rows])


def derivation() -> Derivation:
    """Every form there is: sums in stores, double sums, workspace, blocks, slices, solve."""
    ct, rows = sp.MatrixSymbol("Ct", 3, n), sp.MatrixSymbol("rows", 5, n)
    c, energy = sp.MatrixSymbol("c", 3, 1), sp.MatrixSymbol("V", 1, 1)
    load, mass = sp.MatrixSymbol("f", n, 1), sp.MatrixSymbol("M", n, n)
    right, gain = sp.MatrixSymbol("right", n, 4), sp.MatrixSymbol("gain", n, 4)
    rest, grown = sp.MatrixSymbol("rest", 3, 3), sp.MatrixSymbol("grown", 3, n)
    hidden, turned = sp.MatrixSymbol("hidden", n, 1), sp.MatrixSymbol("turned", n, n)
    none = sp.ZeroMatrix(1, n)
    return Derivation(
        "made up",
        "every form of a run-time size",
        (
            Quantity(A), Quantity(B, symmetric=True), Quantity(C), Quantity(eta),
            Quantity(S, symmetric=True), Quantity(w),
        ),
        (
            Quantity(ct), Quantity(rows), Quantity(c), Quantity(energy), Quantity(mass),
            Quantity(load, accumulate=True), Quantity(right), Quantity(gain),
            Quantity(rest), Quantity(grown, accumulate=True), Quantity(turned),
        ),
        (
            Equation("rows of a block", ct, stack(*(C[a, :] - eta.T * A for a in range(3)))),
            Equation("read from memory", c, (C * eta + ct * eta) / 2),
            Equation("double sum", energy, eta.T * A * eta),
            Equation("no output: expanded", hidden, A * eta - B.T * eta),
            Equation("zeros", rows, stack(none, ct[:2, :], hidden.T, none)),
            Equation("scalars of columns", load, c[0, 0] * hidden + ct.T * (S * c)),
            Equation("fixed middle", mass, ct.T * S * ct + A + A.T),
            Equation("side by side", right, sp.BlockMatrix([[ct.T, A * eta]])),
            Equation("solved", gain, Solve(B, right, True)),
            Equation("sum over modes", rest, S - ct * gain[:, :3]),
            Equation("added", grown, S * C + w[1, 0] * ct),
            Equation("transposed", turned, (A - w[2, 0] * mass).T),
        ),
        sources=("none",),
    )  # fmt: skip


DERIVATION = derivation()
GUARDS = ((sp.MatrixSymbol("V", 1, 1)[0, 0] < 1000, 5, "too much energy"),)
KERNEL = lower(DERIVATION, "forms", GUARDS)


def random_inputs(kernel: KernelIR, size: int, seed: int = 1) -> dict[str, list[float]]:
    numbers = random.Random(seed)
    inputs = {
        p.name: [numbers.uniform(-1, 1) for _ in range(p.length(size))] for p in kernel.inputs
    }
    if "B" in inputs:
        half = np.array(inputs["B"]).reshape(size, size)
        inputs["B"] = list((half @ half.T + np.eye(size)).ravel())
    return inputs


def extents(port: Port, size: int) -> tuple[int, ...]:
    return tuple(size if isinstance(extent, str) else extent for extent in port.shape)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> CLibrary:
    return build(tmp_path_factory.mktemp("forms"), element("forms", KERNEL))


@pytest.mark.parametrize("size", SIZES)
def test_with_loops_and_with_the_size_put_in(size: int) -> None:
    inputs = random_inputs(KERNEL, size)
    stated = evaluate_equations(DERIVATION, inputs, GUARDS, 50, size).outputs
    forms = {
        "loops": evaluate(KERNEL, inputs, 50, size),
        "size put in": evaluate(lower(DERIVATION.at_size(size), "forms", GUARDS), inputs),
        "unrolled": evaluate(unroll(KERNEL, size), inputs),
    }
    for form, found in forms.items():
        assert list(found) == list(stated)
        for name, row in stated.items():
            assert len(row) == len(found[name])
            gap = max(abs(a - b) for a, b in zip(row, found[name], strict=True))
            assert gap < 1e-46, (form, name)


@pytest.mark.parametrize("size", SIZES)
def test_c_equals_floats(size: int, library: CLibrary) -> None:
    inputs = random_inputs(KERNEL, size)
    outcome = library.call("forms", "forms", inputs, size)
    assert outcome.code == 0
    wanted = evaluate_floats(KERNEL, inputs, size)
    for name, row in wanted.items():
        assert are_same_numbers(outcome.outputs[name], row), name
    for name, limits in rounding_bounds(KERNEL, inputs, size).items():
        for value, (exact, bound) in zip(outcome.outputs[name], limits, strict=True):
            assert abs(value - exact) <= bound


def test_guards_and_pivots_leave_in_every_form(library: CLibrary) -> None:
    huge = random_inputs(KERNEL, 2)
    huge["A"] = [1e4 * a for a in huge["A"]]
    huge["eta"] = [1.0, 1.0]
    huge["A"][0] = 1e6
    singular = random_inputs(KERNEL, 2) | {"B": [1.0, 1.0, 1.0, 1.0]}
    for inputs, code in ((huge, 5), (singular, 1)):
        assert library.call("forms", "forms", inputs, 2).code == code
        for kernel, size in ((KERNEL, 2), (unroll(KERNEL, 2), None)):
            with pytest.raises(GuardFailure) as caught:
                evaluate(kernel, inputs, n=size)
            assert caught.value.code == code
        shaped = {
            port.name: np.array(inputs[port.name]).reshape(extents(port, 2))
            for port in KERNEL.inputs
        }
        with pytest.raises(NumericalFailure, match="forms: "):
            numpy_kernels.evaluate(KERNEL, shaped, 2)


@pytest.mark.parametrize("size", (0, 1, 3))
def test_many_points_at_once(size: int) -> None:
    """Inputs with different leading axes, against one point at a time."""
    leads: Iterator[tuple[int, ...]] = iter([(), (4,), (2, 1), (2, 4), (), (1, 4)])
    points = [random_inputs(KERNEL, size, seed) for seed in range(8)]
    shapes = {port.name: extents(port, size) for port in (*KERNEL.inputs, *KERNEL.outputs)}
    inputs: dict[str, np.ndarray] = {}
    for port in KERNEL.inputs:
        lead = next(leads)
        count = int(np.prod(lead))
        rows = [points[i][port.name] for i in range(count)]
        inputs[port.name] = np.reshape(rows, (*lead, *shapes[port.name]))
    found = numpy_kernels.evaluate(KERNEL, inputs, size)
    for i in range(2):
        for j in range(4):
            at = {
                name: np.broadcast_to(a, (2, 4, *shapes[name]))[i, j].ravel().tolist()
                for name, a in inputs.items()
            }
            for name, row in evaluate_floats(KERNEL, at, size).items():
                assert found[name].shape == (2, 4, *shapes[name])
                assert np.allclose(found[name][i, j].ravel(), row, rtol=1e-13, atol=1e-14), name


def test_many_points_know_every_operation() -> None:
    """Operations on special numbers as the IR in floats has them."""
    from mstmm.ir import OPERATIONS, Assign, Temporary

    values = [0.0, 0.5, -1.5, 2.0, np.nan]
    for op, row in OPERATIONS.items():
        count = row.arity
        ports = tuple(Port(name) for name in "abc"[:count])
        call = Assign(0, op, tuple(Element(port.name) for port in ports))
        kernel = KernelIR("one", ports, (Port("y"),), (call, Store("y", (), Temporary(0))))
        grid = np.meshgrid(*[values] * count, indexing="ij")
        found = numpy_kernels.evaluate(kernel, dict(zip("abc", grid, strict=False)))["y"]
        for place in np.ndindex(found.shape):
            at = {name: float(axis[place]) for name, axis in zip("abc", grid, strict=False)}
            wanted = evaluate_floats(kernel, at)["y"][0]
            assert np.isclose(found[place], wanted, rtol=1e-15, equal_nan=True), (op, at)


def test_many_points_refuse_what_does_not_fit() -> None:
    kernel = lower(DERIVATION, "forms")
    with pytest.raises(ValueError, match="no value for the input 'A'"):
        numpy_kernels.evaluate(kernel, {}, 2)
    with pytest.raises(ValueError, match=r"A ends in the shape \(2, 2\), not \(2, 3\)"):
        numpy_kernels.evaluate(kernel, {"A": np.zeros((2, 3))}, 2)


def test_outputs_are_workspace_and_zeros_fold() -> None:
    """What is stored is read, not computed again; no statement computes a zero row."""
    stores = {s.port: s for s in KERNEL.statements if isinstance(s, Store) and s.port == "Ct"}
    assert isinstance(stores["Ct"].body[0], Sum)
    later = [s for s in KERNEL.statements if isinstance(s, Store) and s.port == "rows"]
    assert [s.body for s in later[:3]] == [(), (), ()]
    read = {s.value.port for s in later[1:3] if isinstance(s.value, Element)}
    assert read == {"Ct"}
    text = "\n".join(kernel_listing(KERNEL))
    assert "sum over l < n" in text
    assert "for k, l < n" in text


def test_stored_form_gives_the_kernel_back() -> None:
    assert from_json(to_json(KERNEL)) == KERNEL


def test_equal_sums_are_one_whatever_their_letter() -> None:
    graph = Graph()
    one = graph.sum_over_modes(graph.element("x", "k") * graph.element("y", "k"))
    two = graph.sum_over_modes(graph.element("x", "l") * graph.element("y", "l"), "l")
    assert one is two
    inner = graph.sum_over_modes(graph.element("A", "l", "k"), "k")
    both = graph.sum_over_modes(inner, "l")
    assert both is graph.sum_over_modes(graph.sum_over_modes(graph.element("A", "k", "l"), "l"))
    assert graph.sum_over_modes(graph.constant(0)).value == 0


def test_nested_sums_are_differentiated() -> None:
    """d(x^T A x) and d(A x), exact against the closed form."""
    graph = Graph()
    ax = graph.sum_over_modes(graph.element("A", "k", "l") * graph.element("x", "l"), "l")
    kernel = graph.kernel(
        "quadratic",
        (Port("A", ("n", "n")), Port("x", ("n",))),
        (Port("V"), Port("f", ("n",))),
        {"V": graph.sum_over_modes(graph.element("x", "k") * ax), "f": ax},
        size_symbol="n",
    )
    rng = np.random.default_rng(3)
    a, d_a = rng.normal(size=(2, 3, 3))
    x, d_x = rng.normal(size=(2, 3))
    inputs = {"A": a, "x": x, "d_A": d_a, "d_x": d_x}
    found = numpy_kernels.evaluate(differentiate(kernel, ["A", "x"]), inputs, 3)
    assert np.allclose(found["d_f"], d_a @ x + a @ d_x)
    assert np.isclose(found["d_V"], x @ d_a @ x + d_x @ (a + a.T) @ x)
    with pytest.raises(ValueError, match=r"reads 'right', which the kernel has stored.*fixed size"):
        differentiate(KERNEL, ["eta"])


# --- what is refused ------------------------------------------------------------------------------


def lower_equations(
    *definitions: tuple[sp.Basic, sp.Basic], outputs: tuple[sp.Basic, ...]
) -> KernelIR:
    return lower(
        Derivation(
            "wrong",
            "",
            tuple(map(Quantity, (A, B, C, eta, S, w))),
            tuple(map(Quantity, outputs)),
            tuple(Equation(str(left), left, right) for left, right in definitions),
        ),
        "wrong",
    )


def test_what_cannot_be_lowered_says_why() -> None:
    square, column = sp.MatrixSymbol("Q", n, n), sp.MatrixSymbol("x", n, 1)
    work, number = sp.MatrixSymbol("P", n, n), sp.MatrixSymbol("y", 1, 1)
    other = sp.Symbol("m", integer=True, positive=True)
    cases = (
        ("three loops", [(square, A * B)], (square,)),
        ("more than two deep", [(work, A.T), (column, A * (B + A) * eta + A * B * eta)], (column,)),
        ("must be an input, or an output", [(square, 2 * B), (column, Solve(square, eta, True))],
         (column,)),
        ("must be an input, or an output", [(column, Solve(B, A * eta, True))], (column,)),
        ("defines an output that", [(column, Solve(B, eta, True)), (number, eta.T * column)],
         (number,)),
        ("not by its entries", [(number, sp.ImmutableDenseMatrix([(eta.T * A * eta)[0, 0]]))],
         (number,)),
        ("expected no single entry along n", [(number, sp.ImmutableDenseMatrix([eta[0, 0]]))],
         (number,)),
        ("share an axis", [(column, sp.BlockMatrix([[C, w]])[:, :n].T * w)], (column,)),
        ("Inverse", [(column, B.I * eta)], (column,)),
        ("more than one run-time size", [(sp.MatrixSymbol("z", other, 1), w)], ()),
    )  # fmt: skip
    for message, definitions, outputs in cases:
        with pytest.raises((NotImplementedError, ValueError), match=message):
            lower_equations(*definitions, outputs=outputs)


def sized_kernel(*statements: object, outputs: tuple[Port, ...] = (Port("y", ("n",)),)) -> KernelIR:
    inputs = (Port("A", ("n", "n")), Port("x", ("n",)))
    return KernelIR("wrong", inputs, outputs, statements, size_symbol="n")  # type: ignore[arg-type]


def test_the_ir_refuses_loops_that_no_backend_has() -> None:
    a_kl, x_k = Element("A", ("k", "l")), Element("x", ("k",))
    inner = Sum(0, (), a_kl, "k")
    with pytest.raises(ValueError, match="a sum over 'k' inside loops over"):
        sized_kernel(Store("y", ("k",), Element("x", ("k",)), (inner,)))
    with pytest.raises(ValueError, match="a sum over 'j'"):
        sized_kernel(Sum(0, (), x_k, "j"))
    with pytest.raises(ValueError, match="outside a loop"):
        sized_kernel(Store("y", ("k",), a_kl))
    square = (Port("Y", ("n", "n")),)
    with pytest.raises(ValueError, match="stores only a diagonal"):
        sized_kernel(Store("Y", ("k", "k"), x_k), outputs=square)
    with pytest.raises(ValueError, match="no port named 'y'"):
        sized_kernel(Sum(0, (), Element("y", ("k",))), Store("y", ("k",), x_k))
    with pytest.raises(ValueError, match="stored again"):
        sized_kernel(Store("y", ("k",), x_k), Store("y", ("k",), x_k))
    growing = (Port("y", ("n",), accumulate=True),)
    with pytest.raises(ValueError, match="no port named 'y'"):
        sized_kernel(Store("y", ("k",), x_k), Sum(0, (), Element("y", ("k",))), outputs=growing)
    two = (Port("Y", (2, "n")), Port("z"))
    half = Store("Y", (0, "k"), x_k)
    with pytest.raises(ValueError, match="no port named 'Y'"):
        sized_kernel(half, Sum(0, (), Element("Y", (0, "k"))), outputs=two)
    whole = sized_kernel(
        half, Store("Y", (1, "k"), x_k), Sum(0, (), Element("Y", (0, "k"))), outputs=two
    )
    assert from_json(to_json(whole)) == whole


def test_a_size_is_named_where_the_length_is_wrong() -> None:
    with pytest.raises(ValueError, match=r"A takes 4 numbers, not 3|A: expected 4 numbers"):
        evaluate(KERNEL, random_inputs(KERNEL, 2) | {"A": [1.0, 2.0, 3.0]}, n=2)
    assert DERIVATION.size == n
    assert DERIVATION.at_size(3).size is None
