"""A small scene as implicit methods see it: its residual, and the tangent of it factored.

Inverse dynamics is replayed on the nodes of one graph and differentiated there along every unknown.
Few unknowns need no elimination by bodies: the tangent is a matrix in which what is zero folds
away, and it is factored from tips to root, which fills nothing in.
"""

from __future__ import annotations

from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Graph, Node
from mstmm.ir.structure import Structure
from mstmm.ir.tangent import PREFIX, derivatives
from mstmm.ir.unrolled import lu_from_the_last, solve_by_rows, solve_from_the_last

from ..schedule.motion import FORWARD, PRESCRIBED
from ..schedule.steps import Run, Sweep
from ..schedule.sweeps import INVERSE_DYNAMICS
from .inline import Nodes
from .passes.balance import balance
from .replay import Replay
from .scene import Fused, gathered, inputs_of
from .state import FusionState, Kernels

Matrix = list[Nodes]
#: Guard code of all these kernels: the looped engine names what fails.
_FAILED = 1
#: Drives have no say in it: coordinates are what they are.
_RATES = Sweep("rates", "Rates of the coordinates.", (Run(whole=PRESCRIBED), Run(whole=FORWARD)))


def fuse_implicit(structure: Structure, kernels: Kernels) -> Fused:
    """What `mstmm_implicit` (runtime/integrate/c/implicit.h) asks of a scene, as kernels.

    All read p, t, q, u, memory and the accelerations a.  "residual": R (nu) by inverse dynamics,
    zero where speeds are imposed; "residual_power": and the power of everything that is not
    stored.  "residual_slope": its derivative along d_t, d_q, d_u, d_a.  "tangent": the factors
    (nu x nu, see `lu_from_the_last`) of K W + C + s M with a one for every imposed speed; steps are
    s, sq and kappa, and W = (sq - kappa g_q)^-1 N where q' = N u has the slopes g_q in q.
    "solution": x (nu) of such factors and r (nu).  "coordinates": dq (nq) of x and rho (nq),
    sq dq = kappa g_q dq + N x + rho.  "rates": q' alone.  Driven coordinates have
    neither.

    A guard that fails says no more than that the looped engine must be asked.
    """
    residual, moving = _Residual(structure, kernels), _Moving(structure, kernels)
    found = [*residual.kernels(), _solution(structure.nu), *moving.kernels()]
    return Fused({kernel.name: balance(kernel) for kernel in found}, ((0, -1, _FAILED),))


def _inputs(structure: Structure) -> list[Port]:
    return [*inputs_of(structure)[:-1], Port("a", (structure.nu,))]


def _imposed(structure: Structure) -> list[bool]:
    found = [False] * structure.nu
    for body in structure.bodies:
        for k, imposed in enumerate(body.imposed):
            found[body.u + k] = bool(imposed)
    return found


def _factors(nu: int) -> Port:
    return Port("factors", (nu, nu))


def _solution(nu: int) -> KernelIR:
    graph = Graph()
    factors = [[graph.element("factors", i, j) for j in range(nu)] for i in range(nu)]
    x = solve_from_the_last(factors, graph.vector("r", nu))
    return graph.kernel(
        "solution", [_factors(nu), Port("r", (nu,))], [Port("x", (nu,))], {"x": x}, as_made=True
    )


def _driven(structure: Structure) -> set[int]:
    """Coordinates that drives prescribe."""
    found = set[int]()
    for body in structure.bodies:
        if body.nu and all(body.imposed):
            found |= set(range(body.q, body.q + body.nq))
        else:  # rates are speeds where some of them alone are driven
            found |= {body.q + k for k in range(body.nu) if body.imposed[k]}
    return found


class _Lag:
    """How coordinates follow speeds within a step, hinge by hinge: Q dq = N x + rho."""

    def __init__(self, state: FusionState) -> None:
        self.graph, q, u = state.graph, state.q, state.u
        self._driven = _driven(state.structure)
        self.replay = replay = Replay(state, staged=False)
        replay.sweep(_RATES)
        s, sq, kappa = self.graph.vector("steps", 3)
        self.s, self._sq, self._kappa = s, sq, kappa
        self._straight: dict[int, int] = {}
        self._turning: list[tuple[int, int, Matrix, Matrix]] = []
        for index, body in enumerate(state.structure.bodies):
            if body.modal is not None:
                self._straight |= {body.modal.q + k: body.modal.u + k for k in range(body.modal.n)}
            rates = replay.filled(index, "body.qdot") or []
            first, speeds = q[body.q : body.q + body.nq], u[body.u : body.u + body.nu]
            slopes = [derivatives(rates, {one: 1}) for one in first]
            turned = [derivatives(rates, {one: 1}) for one in speeds]
            if body.nq == body.nu and not any(x.value != 0 for row in slopes for x in row):
                self._straight |= {body.q + k: body.u + k for k in range(body.nu)}
            elif body.nq:
                self._turning.append((body.q, body.u, _transposed(slopes), _transposed(turned)))

    def changes(self, x: Nodes, rho: Nodes | None) -> dict[int, Node]:
        """dq by coordinate; coordinates that do not change are left out."""
        found = {}
        for place, speed in self._straight.items():
            change = x[speed] if rho is None else x[speed] + rho[place]
            if change.value != 0:
                found[place] = change / self._sq
        for first, speed, slopes, turned in self._turning:
            n, own = len(slopes), x[speed : speed + len(turned[0])]
            right = [self._product(row, own) for row in turned]
            if rho is not None:
                right = [a + b for a, b in zip(right, rho[first : first + n], strict=True)]
            if any(entry.value != 0 for entry in right):
                found |= dict(enumerate(self._answered(slopes, right), first))
        return {place: change for place, change in found.items() if place not in self._driven}

    def _answered(self, slopes: Matrix, right: Nodes) -> Nodes:
        """dq of one hinge: (sq - kappa g_q) dq = right."""
        matrix = [[-self._kappa * entry for entry in row] for row in slopes]
        for i in range(len(matrix)):
            matrix[i][i] = matrix[i][i] + self._sq
        return [row[0] for row in solve_by_rows(self.graph, matrix, [[x] for x in right])]

    def _product(self, row: Nodes, column: Nodes) -> Node:
        total = self.graph.constant(0)
        for a, b in zip(row, column, strict=True):
            total = total + a * b
        return total


def _transposed(rows: Matrix) -> Matrix:
    return [list(column) for column in zip(*rows, strict=True)]


class _Moving:
    """The kernels that ask for the rates of the coordinates alone."""

    def __init__(self, structure: Structure, kernels: Kernels) -> None:
        self._structure = structure
        state = FusionState(structure, kernels, None)
        self._graph, self._lag = state.graph, _Lag(state)
        self._rates = gathered(self._lag.replay, "qdot")
        for place in _driven(structure):
            self._rates[place] = state.zero

    def kernels(self) -> list[KernelIR]:
        return [self._rate(), self._coordinates()]

    def _rate(self) -> KernelIR:
        s = self._structure
        return self._graph.kernel(
            "rates", _inputs(s), [Port("dq", (s.nq,))], {"dq": self._rates}, as_made=True
        )

    def _coordinates(self) -> KernelIR:
        graph, s = self._graph, self._structure
        changes = self._lag.changes(graph.vector("x", s.nu), graph.vector("rho", s.nq))
        more = [Port("steps", (3,)), Port("x", (s.nu,)), Port("rho", (s.nq,))]
        dq = [changes.get(place, graph.constant(0)) for place in range(s.nq)]
        return graph.kernel(
            "coordinates", [*_inputs(s), *more], [Port("dq", (s.nq,))], {"dq": dq}, as_made=True
        )


class _Residual:
    """The kernels that are made of inverse dynamics."""

    def __init__(self, structure: Structure, kernels: Kernels) -> None:
        self._structure, self._imposed = structure, _imposed(structure)
        state = FusionState(structure, kernels, None)
        state.efforts = state.zeros(structure.nu)
        self._graph, self._t, self._q, self._u = state.graph, state.t, list(state.q), list(state.u)
        self._a, self._lag = state.given, _Lag(state)
        replay = Replay(state, staged=False, inverse=True)
        replay.sweep(INVERSE_DYNAMICS)
        required = gathered(replay, "required")
        driven = zip(required, state.u, self._imposed, strict=True)
        self._power = sum(
            (felt * speed for felt, speed, imposed in driven if imposed),
            replay.get("sums.power", 1)[0],
        )
        self._r = [
            state.zero if imposed else one
            for one, imposed in zip(required, self._imposed, strict=True)
        ]
        for condition in replay.conditions:
            state.graph.guard(condition, _FAILED, "the looped engine names what fails")

    def kernels(self) -> list[KernelIR]:
        s, ports = self._structure, _inputs(self._structure)
        graph, r, power = self._graph, Port("r", (s.nu,)), Port("power", (1,))
        values: dict[str, object] = {"r": self._r, "power": [self._power]}
        return [
            graph.kernel("residual", ports, [r], {"r": self._r}, as_made=True),
            graph.kernel("residual_power", ports, [r, power], values, as_made=True),
            self._slope(ports),
            self._tangent(ports),
        ]

    def _slope(self, ports: list[Port]) -> KernelIR:
        graph, s = self._graph, self._structure
        leaves = {"t": [self._t], "q": self._q, "u": self._u, "a": self._a}
        seeds: dict[Node, Node | float] = {
            leaf: graph.element(PREFIX + name, i)
            for name, entries in leaves.items()
            for i, leaf in enumerate(entries)
        }
        more = [Port(PREFIX + name, (len(entries),)) for name, entries in leaves.items()]
        return graph.kernel(
            "residual_slope", [*ports, *more], [Port("d_r", (s.nu,))],
            {"d_r": derivatives(self._r, seeds)}, as_made=True,
        )  # fmt: skip

    def _tangent(self, ports: list[Port]) -> KernelIR:
        graph, s = self._graph, self._structure
        columns = [self._along(j) for j in range(s.nu)]
        factors = lu_from_the_last(graph, _transposed(columns))
        return graph.kernel(
            "tangent", [*ports, Port("steps", (3,))], [_factors(s.nu)], {"factors": factors},
            as_made=True,
        )  # fmt: skip

    def _along(self, j: int) -> Nodes:
        """Column j of the tangent."""
        graph = self._graph
        unit = [graph.constant(int(i == j)) for i in range(self._structure.nu)]
        if self._imposed[j]:
            return unit
        seeds: dict[Node, Node | float] = {self._u[j]: 1, self._a[j]: self._lag.s}
        for place, change in self._lag.changes(unit, None).items():
            seeds[self._q[place]] = change
        return derivatives(self._r, seeds)
