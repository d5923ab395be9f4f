"""Classical kernels on numbers: lower a derivation, evaluate it, multiply along a chain."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from mstmm.derive.classical.catalogue import classical_guards
from mstmm.derive.definition.derivation import Derivation
from mstmm.derive.lower.kernel_lowering import lower
from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import KernelIR
from mstmm.ir.interpreter import evaluate_floats
from tests.support.classical.dense_chain import Array, Body

#: Index of the planar state in the spatial one: x, y, theta, m_z, q_x, q_y, 1.
PLANAR_ROWS = [0, 1, 5, 8, 9, 10, 12]


def kernel(derivation: Derivation) -> KernelIR:
    """The derivation lowered with its pivot guard."""
    return lower(derivation, derivation.element, classical_guards(derivation))


def run(kernel_ir: KernelIR, **inputs: Any) -> dict[str, Array]:
    """Outputs as arrays in their shapes, in doubles."""
    values = evaluate_floats(
        kernel_ir, {name: _flat_entries(value) for name, value in inputs.items()}
    )
    ports = {port.name: port for port in kernel_ir.outputs}
    return {name: np.array(row).reshape(_shape(ports[name].shape)) for name, row in values.items()}


def run_precisely(kernel_ir: KernelIR, **inputs: Any) -> dict[str, mpmath.matrix]:
    """Outputs as mpmath matrices, at 50 digits."""
    values = evaluate(
        kernel_ir, {name: _flat_entries(value) for name, value in inputs.items()}, digits=50
    )
    ports = {port.name: port for port in kernel_ir.outputs}
    result = {}
    for name, row in values.items():
        rows, columns = _shape(ports[name].shape)
        result[name] = mpmath.matrix(rows, columns)
        for index, value in enumerate(row):
            result[name][index // columns, index % columns] = value
    return result


def _shape(shape: tuple[int | str, ...]) -> tuple[int, int]:
    rows = int(shape[0]) if shape else 1
    return rows, int(shape[1]) if len(shape) > 1 else 1


def _flat_entries(value: Any) -> list[Any]:
    if isinstance(value, mpmath.matrix):
        return list(value)
    return [float(entry) for entry in np.asarray(value, dtype=float).ravel()]


def spatial_inputs(body: Body) -> dict[str, Any]:
    """Inputs of the spatial body kernel."""
    return {
        "M": body.mass, "r_IO": body.r_io, "r_IC": body.r_ic,
        "J_I": body.j_i[np.triu_indices(3)], "omega": body.omega, "f_C": body.f_c, "m_C": body.m_c,
    }  # fmt: skip


def planar_inputs(body: Body) -> dict[str, Any]:
    """Inputs of the planar body kernel."""
    return {
        "M": body.mass, "r_IO": body.r_io[:2], "r_IC": body.r_ic[:2], "J_I": body.j_i[2, 2],
        "omega": body.omega[2], "f_C": body.f_c[:2], "m_C": body.m_c[2],
    }  # fmt: skip


def chain_accelerations(
    elements: Sequence[tuple[Any, Any]], root_rows: Any, root_effort: Iterable[Any]
) -> list[NDArray[np.float64]]:
    """Accelerations at the input end of every body from the overall transfer equation.

    `elements` are (U_hinge, U_body) from root to tip (mpmath); at the root, which is at rest,
    root_rows (m, q) = root_effort; at the tip m = q = 0.
    """
    with mpmath.workdps(50):
        return _chain_accelerations(elements, root_rows, root_effort)


def _chain_accelerations(
    elements: Sequence[tuple[Any, Any]], root_rows: Any, root_effort: Iterable[Any]
) -> list[NDArray[np.float64]]:
    n = elements[0][0].rows
    half = (n - 1) // 2
    total = mpmath.eye(n)
    for hinge, body in elements:
        total = body * hinge * total
    tip = total[half : n - 1, half : n - 1]
    right = [-total[half + i, n - 1] for i in range(half)]
    rows = np.atleast_2d(root_rows)
    system, values = mpmath.matrix(half + len(rows), half), [*right, *root_effort]
    for i in range(half):
        for j in range(half):
            system[i, j] = tip[i, j]
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            system[half + i, j] = mpmath.mpf(float(entry))
    # The tip's efforts along the last hinge vanish identically: more rows than unknowns.
    forces, _ = mpmath.qr_solve(system, mpmath.matrix(values))
    state = mpmath.matrix(n, 1)
    for i in range(half):
        state[half + i] = forces[i]
    state[n - 1] = 1
    result = []
    for hinge, body in elements:
        state = hinge * state
        result.append(np.array([float(state[i]) for i in range(half)]))
        state = body * state
    return result
