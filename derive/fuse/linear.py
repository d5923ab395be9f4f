"""The linear equations of a small scene about any state, as one kernel.

Inverse dynamics is replayed on the nodes of one graph and differentiated there, as the looped
engine does it by a pass: along accelerations, speeds, and tangent increments of the coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence

from mstmm.ir import KernelIR, Port
from mstmm.ir.structure import Structure
from mstmm.ir.tangent import derivative, derivatives

from ..schedule.sweeps import INVERSE_DYNAMICS
from .implicit import RATES
from .inline import Nodes
from .replay import Replay
from .scene import gathered, inputs_of
from .state import FusionState, Kernels


def fuse_linear(
    structure: Structure, kernels: Kernels, free: Sequence[int], numbers: Sequence[int] = ()
) -> KernelIR:
    """Kernel "linear": M, C and K (n x n) of the speeds `free`, and N (nq x n) of q' = N u.

    M = R_a, C = R_u and K = R_q N of the efforts R by inverse dynamics; P (n x numbers) is R_p of
    some places in p.  Inputs p, t, q, u, memory and the accelerations a.
    """
    state, n = FusionState(structure, kernels, None), len(free)
    q, u, a = list(state.q), list(state.u), list(state.given)
    rates = Replay(state, staged=False)
    rates.sweep(RATES)
    rate = gathered(rates, "qdot")
    moves = [derivatives(rate, {u[j]: 1}) for j in free]
    required = _required(state)
    r = [required[j] for j in free]
    values: dict[str, object] = {
        "M": _matrix([derivatives(r, {a[j]: 1}) for j in free]),
        "C": _matrix([derivatives(r, {u[j]: 1}) for j in free]),
        "K": _matrix([derivatives(r, dict(zip(q, move, strict=True))) for move in moves]),
        "N": _matrix(moves),
        "P": [
            derivative(one, {state.graph.element("p", place): 1}) for one in r for place in numbers
        ],
    }
    outputs = [
        *(Port(name, (n, n)) for name in "MCK"), Port("N", (structure.nq, n)),
        Port("P", (n * len(numbers),)),
    ]  # fmt: skip
    return state.graph.kernel("linear", _inputs(structure), outputs, values, as_made=True)


def fuse_required(structure: Structure, kernels: Kernels) -> KernelIR:
    """Kernel "required": the efforts R (nu) by inverse dynamics, of the same inputs."""
    state = FusionState(structure, kernels, None)
    outputs = [Port("required", (structure.nu,))]
    values: dict[str, object] = {"required": _required(state)}
    return state.graph.kernel("required", _inputs(structure), outputs, values, as_made=True)


def _required(state: FusionState) -> Nodes:
    state.efforts = state.zeros(state.structure.nu)
    replay = Replay(state, staged=False, inverse=True)
    replay.sweep(INVERSE_DYNAMICS)
    return gathered(replay, "required")


def _inputs(structure: Structure) -> list[Port]:
    return [*inputs_of(structure)[:-1], Port("a", (structure.nu,))]


def _matrix(columns: list[Nodes]) -> list[Nodes]:
    """The matrix of these columns, row by row."""
    return [list(row) for row in zip(*columns, strict=True)]
