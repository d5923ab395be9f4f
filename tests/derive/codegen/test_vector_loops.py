"""Entries printed as a loop over pairs: the numbers of the straight line, bit for bit."""

from __future__ import annotations

from pathlib import Path

import pytest
from numpy.random import Generator

from mstmm.abi.element_library import c_kernels
from mstmm.derive.codegen.template_rendering import element_source
from mstmm.derive.codegen.vector_loops import VECTORIZED_OUTPUTS
from mstmm.ir import KernelIR, Port
from mstmm.ir.element_spec import ElementSpec, element_from_json
from mstmm.ir.graph import Graph, Node
from mstmm.ir.interpreter import evaluate_floats
from tests.support.kernels.c_library import build
from tests.support.kernels.random_kernels import element
from tests.support.paths import ROOT

GENERATED = ROOT / "generated"


def rotation_kernel(lanes: int) -> KernelIR:
    """Rows of Y are R times those of X; Z gathers and takes off what is in Y."""
    graph = Graph()
    x, r = graph.matrix("X", 2, lanes), graph.matrix("R", 2, 2)
    scale = r[0][0] / r[1][1]
    y = [[scale * (row[0] * x[0][k] + x[1][k] * row[1]) for k in range(lanes)] for row in r]
    z = [
        [y[0][k] + y[1][k], -(y[0][k] * y[0][k]), -y[1][k], x[0][k] / -y[1][k]]
        for k in range(lanes)
    ]
    total = sum((entry for entry in y[0]), graph.constant(0))
    outputs = (Port("Y", (2, lanes)), Port("Z", (lanes, 4), accumulate=True), Port("total", ()))
    return graph.kernel(
        "k", (Port("X", (2, lanes)), Port("R", (2, 2))), outputs,
        {"Y": y, "Z": z, "total": total},
    )  # fmt: skip


@pytest.mark.parametrize("lanes", [2, 5, 6])
def test_pairs_are_the_straight_line(
    lanes: int, tmp_path: Path, rng: Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of an odd number the last entry comes alone; what stands behind the loops reads them."""
    spec = element("drawn", rotation_kernel(lanes))
    monkeypatch.setitem(VECTORIZED_OUTPUTS, ("drawn", "k"), (("Y", 1), ("Z", 0)))
    assert element_source(spec).count("for (int k = 0;") == 2
    library = build(tmp_path, spec)
    inputs = {"X": rng.normal(size=2 * lanes).tolist(), "R": rng.normal(size=4).tolist()}
    found = library.call("drawn", "k", inputs)
    assert found.code == 0
    assert found.outputs == evaluate_floats(spec.kernels[0], inputs)


def of_entries(graph: Graph, *entries: Node) -> ElementSpec:
    ports = (Port("x", (3,)),), (Port("y", (len(entries),)),)
    return element("drawn", graph.kernel("k", *ports, {"y": list(entries)}))


def test_what_is_not_alike_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another operation, another place, a number that all entries share, an operation with
    branches, a guard."""
    monkeypatch.setitem(VECTORIZED_OUTPUTS, ("drawn", "k"), (("y", 0),))

    def expect_refusal(words: str, spec: ElementSpec) -> None:
        with pytest.raises(ValueError, match=words):
            element_source(spec)

    graph = Graph()
    x = graph.vector("x", 3)
    expect_refusal("not computed alike", of_entries(graph, x[0] + x[2], x[1] * x[2]))
    expect_refusal("not computed alike", of_entries(graph, 2 * x[0], 2 * x[2]))
    expect_refusal("the same in every lane", of_entries(graph, x[0] * x[1], x[0] * x[1]))
    expect_refusal(
        "not computed alike", of_entries(graph, graph.call("sin", x[0]), graph.call("sin", x[1]))
    )
    graph.guard(graph.call("lt", x[0], x[1]), 3, "in order")
    expect_refusal("guard", of_entries(graph, 2 * x[0], 2 * x[1]))


def test_kernels_that_are_printed_so_exist() -> None:
    """Every entry of the table names a kernel that has C, and its outputs."""
    for name, kernel in VECTORIZED_OUTPUTS:
        spec = element_from_json((GENERATED / f"sweep_{name}.json").read_text())
        found = next(k for k in c_kernels(spec) if k.name == kernel)
        assert {port for port, _ in VECTORIZED_OUTPUTS[name, kernel]} <= {
            port.name for port in found.outputs
        }
