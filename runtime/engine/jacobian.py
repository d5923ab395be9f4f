"""Jacobian of the equations of motion, exact or by differences, and its eigenvalues.

For implicit integrators the exact Jacobian is the derivative of the fused kernel
(`mstmm.ir.differentiation`), run by the interpreter.  Central differences are used for scenes
without that kernel (releases change its form), for scenes with so many bodies that its generation
takes longer than it saves, and for states at which a derivative does not exist.  Increments never
grow: larger ones give no information along a coordinate that the equations do not contain.

Eigenvalues use central differences.  For a hinge with stiffness k, damping c and effective inertia
mu the largest one is about c/mu + sqrt(k/mu).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import ElementError, EnvironmentFailure
from mstmm.ir.differentiation import DERIVATIVE_PREFIX, differentiate

from ..kernels.tape_kernel import TapeKernel
from ..packing.fused_structure import structure_of
from .inputs import LiveInputs
from .looped_engine import LoopedEngine

if TYPE_CHECKING:
    from .compiled_scene import CompiledScene

Rates = Callable[[float, Array], Array]

#: Function from a time (s) and the memory of a run to the numbers p of compiled code.
Numbers = Callable[[float, Array], Array]

#: Maximum number of bodies for the exact Jacobian: generating larger kernels takes many seconds.
MAX_BODIES = 64

#: Increment of a difference, in rad, m and their rates, or relative to a larger number.
_DIFFERENCE_INCREMENT = 1e-6


class OdeJacobian:
    """Jacobian d(dy/dt)/dy of the state y = (q, u), extended by the work if `with_work`.

    `rates(t, y)` are the equations, nan where they cannot be evaluated; `memory` (m,) is read at
    every call.
    """

    def __init__(self, model: CompiledScene, with_work: bool, memory: Array, rates: Rates) -> None:
        self._rates, self._memory, self._nq = rates, memory, model.nq
        self._outputs = ["qdot", "udot", *(["power"] if with_work else [])]
        self._tape, self._numbers = _tangent_kernel(model, self._outputs)
        #: Length of the memory that the kernel reads; stored inputs and controller states follow.
        self._n_memory = model.packed_scene.system.held_inputs.first

    @property
    def exact(self) -> bool:
        """True if the equations are differentiated exactly, False for differences."""
        return self._tape is not None

    def __call__(self, t: float, y: Array) -> Array:
        """Jacobian (n, n) at y (n,); columns that cannot be evaluated are zero."""
        if self._tape is not None:
            jacobian = self._exact_jacobian(self._tape, t, y)
            if np.isfinite(jacobian).all():
                return jacobian
        jacobian = self._difference_jacobian(t, y)
        return np.where(np.isfinite(jacobian), jacobian, 0.0)

    def _exact_jacobian(self, tape: TapeKernel, t: float, y: Array) -> Array:
        n, nq, nu = len(y), self._nq, len(y) - self._nq - (len(self._outputs) == 3)
        jacobian = np.zeros((n, n))
        unit_vectors = np.eye(nq + nu)
        kernel_inputs = {
            "p": self._numbers(t, self._memory), "t": np.array([t]), "q": y[:nq],
            "u": y[nq : nq + nu], "memory": self._memory[: self._n_memory],
        }  # fmt: skip
        for j, unit in enumerate(unit_vectors):
            directions = {DERIVATIVE_PREFIX + "q": unit[:nq], DERIVATIVE_PREFIX + "u": unit[nq:]}
            _, outputs = tape.run({**kernel_inputs, **directions})
            kernel_inputs = {}  # the kernel keeps the inputs of the state
            column = np.concatenate(
                [outputs[DERIVATIVE_PREFIX + name][:length]
                 for name, length in zip(self._outputs, (nq, nu, 1), strict=False)
                 if DERIVATIVE_PREFIX + name in outputs]
            )  # fmt: skip
            jacobian[: len(column), j] = column
        return jacobian

    def _difference_jacobian(self, t: float, y: Array) -> Array:
        sizes = _DIFFERENCE_INCREMENT * np.maximum(1.0, np.abs(y))
        columns = [
            (self._rates(t, y + step) - self._rates(t, y - step)) / (2 * size)
            for step, size in zip(np.diag(sizes), sizes, strict=True)
        ]
        return np.array(columns).T


def _tangent_kernel(model: CompiledScene, outputs: list[str]) -> tuple[TapeKernel | None, Numbers]:
    """Tangent kernel with respect to q and u, or None, and the function for its numbers p."""
    packed, added_elements = model.packed_scene, model.known or {}
    if packed.releases or packed.system.count > MAX_BODIES:
        return None, _no_numbers
    structure, numbers = structure_of(packed.system, added_elements, floors=packed.floors)
    try:
        kernels = model.fusion.structure_ir(structure).kernels
    except (ElementError, EnvironmentFailure):
        return None, _no_numbers
    kernel = kernels["accelerations"]
    if "power" in outputs:  # zero in a scene without that kernel: only impacts do work there
        kernel = kernels.get("accelerations_power", kernel)
    output_names = [port.name for port in kernel.outputs if port.name in outputs]
    tape = TapeKernel(differentiate(kernel, ["q", "u"], output_names, values=False, guards=False))
    live = LiveInputs(packed.system, structure.inputs)
    return tape, lambda t, memory: live.numbers_in_run(numbers, t, memory)


def _no_numbers(_t: float, _memory: Array) -> Array:
    return np.zeros(0)


Complex = NDArray[np.complex128]

#: Maximum number of state components for a dense solution; for larger states a Krylov method
#: computes only the fastest motion.
MAX_DENSE_STATES = 160


def fastest_eigenvalue(
    engine: LoopedEngine, t: float, y: Array, memory: Array
) -> tuple[complex, Complex]:
    """Eigenvalue (1/s) and eigenvector (nq + nu,) of the fastest motion without pure growth."""
    values, vectors = eigenvalues(engine, t, y, memory)
    k = int(np.abs(values).argmax())
    return complex(values[k]), vectors[:, k]


def eigenvalues(engine: LoopedEngine, t: float, y: Array, memory: Array) -> tuple[Complex, Complex]:
    """Eigenvalues (k,), 1/s, and eigenvectors (nq + nu, k) of the Jacobian at a state.

    Eigenvalues of monotonic growth, and positive real parts of the others, are set to 0.  For large
    scenes only the fastest motion is computed.
    """
    n = len(y)
    sizes = np.maximum(1e-6, 1e-6 * np.abs(y))
    if n <= MAX_DENSE_STATES:
        values, vectors = np.linalg.eig(
            _central_differences(engine, t, y, memory, np.diag(sizes)) / sizes
        )
    else:
        values, vectors = _fastest_by_krylov(engine, t, y, memory)
    is_growing = values.real > np.abs(
        values.imag
    )  # physical growth, not a stability limit of a method
    limited_values = np.minimum(values.real, 0.0) + 1j * values.imag
    return np.where(is_growing, 0.0, limited_values).astype(np.complex128), vectors


def _central_differences(
    engine: LoopedEngine, t: float, y: Array, memory: Array, moves: Array
) -> Array:
    """Central differences (n, k) of the right-hand side along the columns of `moves` (n, k)."""
    rates = _right_hand_sides(engine, t, np.concatenate([y + moves.T, y - moves.T]), memory)
    half = len(rates) // 2
    return np.asarray((rates[:half] - rates[half:]).T / 2)


def _right_hand_sides(engine: LoopedEngine, t: float, states: Array, memory: Array) -> Array:
    """Right-hand sides (k, n) of states (k, n)."""
    q, u = (np.ascontiguousarray(x) for x in np.split(states, [engine.nq], axis=1))
    return np.hstack(engine.accelerations(t, q, u, np.tile(memory, (len(states), 1))))


def _fastest_by_krylov(
    engine: LoopedEngine, t: float, y: Array, memory: Array
) -> tuple[Complex, Complex]:
    """Eigenvalue and eigenvector of the fastest motion, from Jacobian-vector products."""
    from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigs

    n, rates_at_state = len(y), _right_hand_sides(engine, t, y[None], memory)[0]

    def product(vector: Any) -> Array:
        size = float(np.linalg.norm(vector)) or 1.0
        step = 1e-6 * np.sqrt(n) * np.asarray(vector, dtype=float).reshape(1, n) / size
        change = (
            _right_hand_sides(engine, t, y + step, memory)[0] - rates_at_state
        )  # 1 per cent accuracy is sufficient
        return np.asarray(change * size / (1e-6 * np.sqrt(n)))

    operator = LinearOperator((n, n), matvec=product, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(n)
    zero_result = np.zeros(1, dtype=np.complex128), start[:, None].astype(np.complex128)
    try:
        values, vectors = eigs(
            operator, k=1, which="LM", tol=1e-2, maxiter=40, v0=start, ncv=min(n, 12)
        )
    except ArpackNoConvergence as error:
        values, vectors = error.eigenvalues, error.eigenvectors
    except ArpackError:  # all rates are zero: no step is too long
        return zero_result
    return (values, vectors) if len(values) else zero_result
