"""Transport across axial screws: in parts it is the transport across the whole connection."""

from __future__ import annotations

import random
from typing import Any

import mpmath
import pytest

from mstmm.derive.catalogue.kernels import Kernel, generic_kernels, screw_kernels
from mstmm.derive.definition.derivation import Derivation
from mstmm.derive.equations import screw_transport
from mstmm.derive.equations.riccati_sweep import DELTA, MOTION, PARENT_DELTA, PARENT_MOTION
from mstmm.derive.lower.kernel_lowering import lower
from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.derive.verification.sample_points import InputSampler
from mstmm.ir import Assign, Constant, Element, KernelIR, Operand, Store, Temporary
from mstmm.ir.graph import Graph, Node

DIGITS = 40
INPUTS = (screw_transport.ROTATION, screw_transport.SHIFT_ALONG)


def motion(axis: str) -> Derivation:
    """Bias motion behind a screw, as the links have it."""
    equations = screw_transport.screw_from_inputs(axis).outboard_motion(
        PARENT_MOTION.symbol, MOTION.symbol
    )
    return Derivation("screw", "motion", (*INPUTS, PARENT_MOTION), (MOTION,), equations)


def delta(axis: str) -> Derivation:
    """Deviation behind a screw, as the links have it."""
    equations = screw_transport.screw_from_inputs(axis).deviation(PARENT_DELTA.symbol, DELTA.symbol)
    return Derivation("screw", "deviation", (*INPUTS, PARENT_DELTA), (DELTA,), equations)


SCREW = {kernel.name: kernel.ir() for kernel in screw_kernels()}
SCREW |= {
    f"{step.__name__}_{axis}": lower(step(axis), step.__name__)
    for step in (motion, delta)
    for axis in screw_transport.AXES
}
RIGID: dict[str, Kernel] = {kernel.name: kernel for kernel in generic_kernels(0)}

Values = dict[str, Any]

#: Arrays of a hinge without speeds, and the floor of its pivots.
NO_SPEEDS: Values = {name: [] for name in ("H", "J", "s", "tau", "G", "g")} | {"floor": [0.0] * 2}


def random_inputs(seed: int) -> Values:
    """Screws about x and z, S, e, a motion and a deviation."""
    numbers = random.Random(seed)
    source = InputSampler("sweep", (), ())
    inputs: Values = {}
    for name in ("condense_x", "motion_x", "delta_x"):
        for port in SCREW[name].inputs:
            inputs[port.name] = source.draw(port, SCREW[name], numbers)
    for axis in "xz":
        for port in SCREW["condense_x"].inputs[:2]:
            inputs[f"{port.name}_{axis}"] = source.draw(port, SCREW["condense_x"], numbers)
    return inputs


def step(name: str, axis: str, inputs: Values, **given: Any) -> Values:
    here = {"turn": inputs[f"turn_{axis}"], "d": inputs[f"d_{axis}"]}
    return evaluate(SCREW[f"{name}_{axis}"], inputs | here | given, DIGITS)


def combined_connection(inputs: Values) -> Values:
    """Rotation and shift of a screw about x followed outwards by one about z."""
    (cx, sx), (cz, sz) = inputs["turn_x"], inputs["turn_z"]
    (dx,), (dz,) = inputs["d_x"], inputs["d_z"]
    return {
        "Rc": [cz, -sz, 0, cx * sz, cx * cz, -sx, sx * sz, sx * cz, cx],
        "r": [dx, -sx * dz, cx * dz],
    }


def close(found: list[Any], wanted: list[Any]) -> bool:
    return all(abs(a - b) < mpmath.mpf(10) ** -30 for a, b in zip(found, wanted, strict=True))


@pytest.mark.parametrize("seed", range(3))
def test_condense_in_parts(seed: int) -> None:
    with mpmath.workdps(DIGITS):
        inputs = random_inputs(seed)
        first = step("condense", "z", inputs)
        second = step("condense", "x", inputs, S=first["S_I"], e=first["e_I"])
        direct = evaluate(
            RIGID["condense"].ir(), inputs | combined_connection(inputs) | NO_SPEEDS, DIGITS
        )
        assert close(second["S_I"], direct["S_I"])
        assert close(second["e_I"], direct["e_I"])


@pytest.mark.parametrize("seed", range(3))
def test_motion_and_deviation_in_parts(seed: int) -> None:
    with mpmath.workdps(DIGITS):
        inputs = random_inputs(seed)
        connection = combined_connection(inputs)
        first = step("motion", "x", inputs)
        second = step("motion", "z", inputs, motion_I=first["motion"])
        rest: Values = {
            "Rt": connection["Rc"], "ro": connection["r"], "R": [1, 0, 0, 0, 1, 0, 0, 0, 1],
            "d": [0] * 3, "v": [0] * 3, "w": [0] * 3, "c": [0] * 6,
        }  # fmt: skip
        direct = evaluate(RIGID["forward"].ir(), inputs | rest | NO_SPEEDS, DIGITS)
        assert close(second["motion"], direct["motion"])
        first = step("delta", "x", inputs)
        second = step("delta", "z", inputs, delta_I=first["delta"])
        direct = evaluate(RIGID["recover"].ir(), inputs | connection | NO_SPEEDS, DIGITS)
        assert close(second["delta"], direct["delta"])


# --- structure ------------------------------------------------------------------------------------


def trace_kernel(
    kernel: KernelIR, graph: Graph, known: dict[str, list[Node]]
) -> dict[str, list[Node]]:
    """The kernel's outputs as nodes of `graph`, from nodes for its (flat) inputs."""
    numbers: dict[int, Node] = {}

    def node(operand: Operand) -> Node:
        if isinstance(operand, Temporary):
            return numbers[operand.number]
        if isinstance(operand, Constant):
            return graph.constant(int(operand.text))
        assert isinstance(operand, Element)
        return known[operand.port][int(operand.index[0])]

    found: dict[str, list[Node]] = {
        port.name: [graph.constant(0)] * port.length() for port in kernel.outputs
    }
    for statement in kernel.statements:
        if isinstance(statement, Assign):
            arguments = [node(a) for a in statement.args]
            numbers[statement.number] = graph.call(statement.op, *arguments)
        else:
            assert isinstance(statement, Store)
            found[statement.port][int(statement.index[0])] = node(statement.value)
    return found


#: Places of the upper triangle of S that a pin about z leaves zero: row and column 5.
AFTER_PIN = (5, 10, 14, 17, 19, 20)


def test_zeros_stay_zeros() -> None:
    graph = Graph()
    zero = graph.constant(0)
    s = [zero if i in AFTER_PIN else node for i, node in enumerate(graph.vector("S", 21))]
    inputs = {"S": s, "e": graph.vector("e", 6), "turn": graph.vector("turn", 2)}
    found = trace_kernel(SCREW["condense_z"], graph, inputs | {"d": graph.vector("d", 1)})
    assert [i for i, node in enumerate(found["S_I"]) if node.value == 0] == list(AFTER_PIN)


@pytest.mark.parametrize("turn", [(1, 0), (0, 1), (-1, 0), (0, -1)])
@pytest.mark.parametrize("axis", ["x", "z"])
def test_right_angles_cost_nothing(axis: str, turn: tuple[int, int]) -> None:
    graph = Graph()
    inputs = {"S": graph.vector("S", 21), "e": graph.vector("e", 6), "d": [graph.constant(0)]}
    inputs["turn"] = [graph.constant(n) for n in turn]
    found = trace_kernel(SCREW[f"condense_{axis}"], graph, inputs)
    assert all(node.op in ("element", "neg") for row in found.values() for node in row)
