"""Linear equations of a small scene about any state, as one kernel.

Inverse dynamics is evaluated on one graph and differentiated there, as in the pass of the looped
engine: by accelerations, speeds, and tangent increments of the coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence

from mstmm.ir import KernelIR, Port
from mstmm.ir.differentiation import derivative, derivatives
from mstmm.ir.graph import Node
from mstmm.ir.inline import Nodes
from mstmm.ir.scene_structure import Structure
from mstmm.ir.unrolled_solve import solve_symmetric

from ..schedule.sweeps import INVERSE_DYNAMICS
from .fusion_state import FusionState, Kernels
from .implicit_residual import RATES
from .scene_kernels import FAILED, FusedSceneIR, fuse, inputs_of
from .schedule_interpreter import ScheduleInterpreter
from .sum_balancing import balance


def fuse_linear(
    structure: Structure, kernels: Kernels, free: Sequence[int], numbers: Sequence[int] = ()
) -> KernelIR:
    """Kernel "linear": M, C and K (n x n) of the speeds `free`, and N (nq x n) of q' = N u.

    M = R_a, C = R_u and K = R_q N of the efforts R by inverse dynamics; P (n x numbers) is R_p
    of the parameters with these indices in p.  Inputs p, t, q, u, memory and the accelerations
    a.
    """
    scene, n = _StateDerivatives(structure, kernels, free), len(free)
    values = scene.slopes()
    values["N"] = _rows_of_columns(scene.coordinate_motions)
    values["P"] = [
        scene.input_derivative("p", index, effort) for effort in scene.r for index in numbers
    ]
    outputs = [
        *(Port(name, (n, n)) for name in "MCK"), Port("N", (structure.nq, n)),
        Port("P", (n * len(numbers),)),
    ]  # fmt: skip
    return scene.graph.kernel("linear", _inputs(structure), outputs, values, keep_order=True)


def fuse_slopes(structure: Structure, kernels: Kernels) -> FusedSceneIR:
    """Kernel "linear" of a library, together with "accelerations".

    M, C and K as in `fuse_linear`, of the speeds that are not prescribed; G (n x n) is of x' =
    G x + du, and r_t (n) the time derivative of R at constant accelerations.  A failing guard
    does not name its cause: evaluate the looped engine for the message.
    """
    free = [
        body.u + k
        for body in structure.bodies
        for k, is_prescribed in enumerate(body.imposed)
        if not is_prescribed
    ]
    free += [body.modal.u + k for body in structure.bodies if body.modal is not None
             for k in range(body.modal.n)]  # fmt: skip
    scene, n = _StateDerivatives(structure, kernels, sorted(free)), len(free)
    for condition in scene.conditions:
        scene.graph.guard(condition, FAILED, "the looped engine names what fails")
    values = scene.slopes()
    values["G"] = scene.rate_matrices()
    values["r_t"] = [scene.input_derivative("t", 0, effort) for effort in scene.r]
    outputs = [*(Port(name, (n, n)) for name in "MCKG"), Port("r_t", (n,))]
    kernel = scene.graph.kernel("linear", _inputs(structure), outputs, values, keep_order=True)
    kernel_map = {"accelerations": fuse(structure, kernels).kernels["accelerations"]}
    return FusedSceneIR(kernel_map | {kernel.name: balance(kernel)}, ((0, -1, FAILED),))


def fuse_required(structure: Structure, kernels: Kernels) -> KernelIR:
    """Kernel "required": efforts R (nu) by inverse dynamics; inputs as in `fuse_linear`."""
    state = FusionState(structure, kernels, None)
    outputs = [Port("required", (structure.nu,))]
    values: dict[str, object] = {"required": _inverse_dynamics(state).collect("required")}
    return state.graph.kernel("required", _inputs(structure), outputs, values, keep_order=True)


class _StateDerivatives:
    """Derivatives of a scene at any state: efforts R, and coordinate change per free speed."""

    def __init__(self, structure: Structure, kernels: Kernels, free: Sequence[int]) -> None:
        state = FusionState(structure, kernels, None)
        self.graph, self._structure, self._free = state.graph, structure, list(free)
        self._q, self._u, self._a = list(state.q), list(state.u), list(state.given_accelerations)
        rates = ScheduleInterpreter(state, staged=False)
        rates.sweep(RATES)
        self._rates = rates.collect("qdot")
        self.coordinate_motions = [derivatives(self._rates, {self._u[j]: 1}) for j in free]
        replay = _inverse_dynamics(state)
        self.conditions = replay.conditions
        required = replay.collect("required")
        self.r = [required[j] for j in free]

    def input_derivative(self, port: str, index: int, node: Node) -> Node:
        """Derivative of a node by one entry of an input."""
        return derivative(node, {self.graph.element(port, index): 1})

    def slopes(self) -> dict[str, object]:
        """M, C and K; only one half of the symmetric M is differentiated."""
        half = [derivatives(self.r[k:], {self._a[j]: 1}) for k, j in enumerate(self._free)]
        n = range(len(half))
        return {
            "M": [[half[min(i, j)][abs(i - j)] for j in n] for i in n],
            "C": _rows_of_columns([derivatives(self.r, {self._u[j]: 1}) for j in self._free]),
            "K": _rows_of_columns(
                [
                    derivatives(self.r, self._coordinate_seeds(move))
                    for move in self.coordinate_motions
                ]
            ),
        }

    def rate_matrices(self) -> list[Nodes]:
        """G by hinge: for q(t) + N x, N x' = (q'_q N - N') x + N du."""
        n, position = len(self._free), {j: k for k, j in enumerate(self._free)}
        rows = [[self.graph.constant(0)] * n for _ in range(n)]
        for body in self._structure.bodies:
            columns = [position[j] for j in range(body.u, body.u + body.nu) if j in position]
            moves = [self.coordinate_motions[k][body.q : body.q + body.nq] for k in columns]
            rates = [
                self._subspace_rate(self.coordinate_motions[k])[body.q : body.q + body.nq]
                for k in columns
            ]
            if not any(x.value != 0 for column in rates for x in column):
                continue
            square = [[_dot_product(a, b) for b in moves] for a in moves]
            right = [[_dot_product(a, column) for column in rates] for a in moves]
            for i, row in zip(columns, solve_symmetric(self.graph, square, right), strict=True):
                for j, entry in zip(columns, row, strict=True):
                    rows[i][j] = entry
        return rows

    def _subspace_rate(self, move: Nodes) -> Nodes:
        """q'_q n - n' of a column n of N."""
        seeds, rate_seeds = self._coordinate_seeds(move), self._coordinate_seeds(self._rates)
        pairs = zip(derivatives(self._rates, seeds), derivatives(move, rate_seeds), strict=True)
        return [a - b for a, b in pairs]

    def _coordinate_seeds(self, rates: Nodes) -> dict[Node, Node | float]:
        return dict(zip(self._q, rates, strict=True))


def _inverse_dynamics(state: FusionState) -> ScheduleInterpreter:
    state.efforts = state.zeros(state.structure.nu)
    replay = ScheduleInterpreter(state, staged=False, inverse=True)
    replay.sweep(INVERSE_DYNAMICS)
    return replay


def _inputs(structure: Structure) -> list[Port]:
    return [*inputs_of(structure)[:-1], Port("a", (structure.nu,))]


def _dot_product(u: Nodes, v: Nodes) -> Node:
    total = u[0] * v[0]
    for a, b in zip(u[1:], v[1:], strict=True):
        total = total + a * b
    return total


def _rows_of_columns(columns: list[Nodes]) -> list[Nodes]:
    """Rows of the matrix with these columns."""
    return [list(row) for row in zip(*columns, strict=True)]
