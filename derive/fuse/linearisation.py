"""The linear equations of a small scene about any state, as one kernel.

Inverse dynamics is replayed on the nodes of one graph and differentiated there, as the looped
engine does it by a pass: along accelerations, speeds, and tangent increments of the coordinates.
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
from .optimisation.sum_balancing import balance
from .scene_kernels import FAILED, FusedSceneIR, fuse, inputs_of
from .schedule_interpreter import ScheduleInterpreter


def fuse_linear(
    structure: Structure, kernels: Kernels, free: Sequence[int], numbers: Sequence[int] = ()
) -> KernelIR:
    """Kernel "linear": M, C and K (n x n) of the speeds `free`, and N (nq x n) of q' = N u.

    M = R_a, C = R_u and K = R_q N of the efforts R by inverse dynamics; P (n x numbers) is R_p of
    some places in p.  Inputs p, t, q, u, memory and the accelerations a.
    """
    about, n = _About(structure, kernels, free), len(free)
    values = about.slopes()
    values["N"] = _matrix(about.moves)
    values["P"] = [about.along("p", place, one) for one in about.r for place in numbers]
    outputs = [
        *(Port(name, (n, n)) for name in "MCK"), Port("N", (structure.nq, n)),
        Port("P", (n * len(numbers),)),
    ]  # fmt: skip
    return about.graph.kernel("linear", _inputs(structure), outputs, values, as_made=True)


def fuse_slopes(structure: Structure, kernels: Kernels) -> FusedSceneIR:
    """Kernel "linear" of a library, and "accelerations" beside it.

    M, C and K are as above, of the speeds that nobody imposes; G (n x n) is of x' = G x + du, and
    r_t (n) of R by time at accelerations that stay.  A guard that fails says no more than that the
    looped engine must be asked.
    """
    free = [body.u + k for body in structure.bodies for k, held in enumerate(body.imposed)
            if not held]  # fmt: skip
    free += [body.modal.u + k for body in structure.bodies if body.modal is not None
             for k in range(body.modal.n)]  # fmt: skip
    about, n = _About(structure, kernels, sorted(free)), len(free)
    for condition in about.conditions:
        about.graph.guard(condition, FAILED, "the looped engine names what fails")
    values = about.slopes()
    values["G"] = about.turning()
    values["r_t"] = [about.along("t", 0, one) for one in about.r]
    outputs = [*(Port(name, (n, n)) for name in "MCKG"), Port("r_t", (n,))]
    kernel = about.graph.kernel("linear", _inputs(structure), outputs, values, as_made=True)
    both = {"accelerations": fuse(structure, kernels).kernels["accelerations"]}
    return FusedSceneIR(both | {kernel.name: balance(kernel)}, ((0, -1, FAILED),))


def fuse_required(structure: Structure, kernels: Kernels) -> KernelIR:
    """Kernel "required": the efforts R (nu) by inverse dynamics, of the same inputs."""
    state = FusionState(structure, kernels, None)
    outputs = [Port("required", (structure.nu,))]
    values: dict[str, object] = {"required": _required(state).gathered("required")}
    return state.graph.kernel("required", _inputs(structure), outputs, values, as_made=True)


class _About:
    """One scene about any state: efforts `r` in the speeds `free`, and how q follows each."""

    def __init__(self, structure: Structure, kernels: Kernels, free: Sequence[int]) -> None:
        state = FusionState(structure, kernels, None)
        self.graph, self._structure, self._free = state.graph, structure, list(free)
        self._q, self._u, self._a = list(state.q), list(state.u), list(state.given)
        rates = ScheduleInterpreter(state, staged=False)
        rates.sweep(RATES)
        self._rates = rates.gathered("qdot")
        self.moves = [derivatives(self._rates, {self._u[j]: 1}) for j in free]
        replay = _required(state)
        self.conditions = replay.conditions
        required = replay.gathered("required")
        self.r = [required[j] for j in free]

    def along(self, port: str, place: int, one: Node) -> Node:
        """A node by an entry of an input."""
        return derivative(one, {self.graph.element(port, place): 1})

    def slopes(self) -> dict[str, object]:
        """M, C and K; of M, which is symmetric, one half is differentiated."""
        half = [derivatives(self.r[k:], {self._a[j]: 1}) for k, j in enumerate(self._free)]
        n = range(len(half))
        return {
            "M": [[half[min(i, j)][abs(i - j)] for j in n] for i in n],
            "C": _matrix([derivatives(self.r, {self._u[j]: 1}) for j in self._free]),
            "K": _matrix([derivatives(self.r, self._moved(move)) for move in self.moves]),
        }

    def turning(self) -> list[Nodes]:
        """G: where q goes by q(t) + N x, N x' = (q'_q N - N') x + N du, hinge by hinge."""
        n, place = len(self._free), {j: k for k, j in enumerate(self._free)}
        found = [[self.graph.constant(0)] * n for _ in range(n)]
        for body in self._structure.bodies:
            own = [place[j] for j in range(body.u, body.u + body.nu) if j in place]
            moves = [self.moves[k][body.q : body.q + body.nq] for k in own]
            bent = [self._bend(self.moves[k])[body.q : body.q + body.nq] for k in own]
            if not any(x.value != 0 for column in bent for x in column):
                continue
            square = [[_dot(one, other) for other in moves] for one in moves]
            right = [[_dot(one, column) for column in bent] for one in moves]
            for i, row in zip(own, solve_symmetric(self.graph, square, right), strict=True):
                for j, entry in zip(own, row, strict=True):
                    found[i][j] = entry
        return found

    def _bend(self, move: Nodes) -> Nodes:
        """q'_q n - n' of a column n of N."""
        along, carried = self._moved(move), self._moved(self._rates)
        pairs = zip(derivatives(self._rates, along), derivatives(move, carried), strict=True)
        return [one - other for one, other in pairs]

    def _moved(self, rates: Nodes) -> dict[Node, Node | float]:
        return dict(zip(self._q, rates, strict=True))


def _required(state: FusionState) -> ScheduleInterpreter:
    state.efforts = state.zeros(state.structure.nu)
    replay = ScheduleInterpreter(state, staged=False, inverse=True)
    replay.sweep(INVERSE_DYNAMICS)
    return replay


def _inputs(structure: Structure) -> list[Port]:
    return [*inputs_of(structure)[:-1], Port("a", (structure.nu,))]


def _dot(one: Nodes, other: Nodes) -> Node:
    total = one[0] * other[0]
    for a, b in zip(one[1:], other[1:], strict=True):
        total = total + a * b
    return total


def _matrix(columns: list[Nodes]) -> list[Nodes]:
    """The matrix of these columns, row by row."""
    return [list(row) for row in zip(*columns, strict=True)]
