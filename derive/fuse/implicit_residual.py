"""A small scene as implicit methods see it: its residual, and the tangent of it factored.

Inverse dynamics is replayed on the nodes of one graph and differentiated there along every unknown.
Few unknowns need no elimination by bodies: the tangent is a matrix in which what is zero folds
away, and it is factored from tips to root, which fills nothing in.
"""

from __future__ import annotations

from mstmm.ir import KernelIR, Port
from mstmm.ir.differentiation import derivatives
from mstmm.ir.graph import Graph, Node
from mstmm.ir.inline import Nodes
from mstmm.ir.scene_structure import Structure
from mstmm.ir.unrolled_solve import factor_reverse_lu, solve_pivoted, solve_reverse_lu

from ..schedule.forward_kinematics import FORWARD, PRESCRIBED
from ..schedule.pass_steps import Run, Sweep
from ..schedule.sweeps import INVERSE_DYNAMICS
from .fusion_state import FusionState, Kernels
from .optimisation.sum_balancing import BalancedKernels
from .scene_kernels import FAILED, FusedSceneIR, inputs_of
from .schedule_interpreter import ScheduleInterpreter

Matrix = list[Nodes]
#: Speeds up to which K and M are kept apart.  A product by them is then some tenth of R
#: differentiated along a direction, but the tangent takes ever more code: twice as much for 12
#: speeds, which a compiler takes four times as long for.
_MOST_WITH_SLOPES = 8
#: Drives have no say in it: coordinates are what they are.
RATES = Sweep("rates", "Rates of the coordinates.", (Run(whole=PRESCRIBED), Run(whole=FORWARD)))


def fuse_implicit(structure: Structure, kernels: Kernels) -> FusedSceneIR:
    """What `mstmm_implicit` (runtime/integrate/c/implicit.h) asks of a scene, as kernels.

    All read p, t, q, u, memory and the accelerations a.  "residual": R (nu) by inverse dynamics,
    zero where speeds are imposed; "residual_power": and the power of everything that is not
    stored.  "residual_rate": its derivative in t.  "tangent": the factors (nu x nu, see
    `factor_reverse_lu`) of K W + C + s M with a one for every imposed speed, where K, C and M are
    the slopes of R in q, u and a, steps are s, sq and kappa, and W = (sq - kappa g_q)^-1 N where
    q' = N u has the slopes g_q in q.  "tangent_slopes", of very small scenes: the factors, and K
    and M (nu x (nq + nu)).  "rest": r - K dq - M da, of those slopes where there are any.
    "solution": x (nu) of factors and r.  "coordinates": dq (nq) of x and rho (nq),
    sq dq = kappa g_q dq + N x + rho.  "rates": q' alone.  Driven coordinates have neither.

    A guard that fails says no more than that the looped engine must be asked.
    """
    with_slopes = structure.nu <= _MOST_WITH_SLOPES
    found = _Residual(structure, kernels).kernels(rest=not with_slopes)
    if with_slopes:
        found += _Residual(structure, kernels).by_slopes()
    found += [_solution(structure.nu), *_Moving(structure, kernels).kernels()]
    return FusedSceneIR(BalancedKernels(*found), ((0, -1, FAILED),))


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


def _slopes_port(structure: Structure) -> Port:
    return Port("slopes", (structure.nu, structure.nq + structure.nu))


def _known(structure: Structure) -> list[Port]:
    """What is known of an equation: its right-hand side, and parts of the increments."""
    nq, nu = structure.nq, structure.nu
    return [_slopes_port(structure), Port("r", (nu,)), Port("dq", (nq,)), Port("da", (nu,))]


def _solution(nu: int) -> KernelIR:
    graph = Graph()
    factors = [[graph.element("factors", i, j) for j in range(nu)] for i in range(nu)]
    x = solve_reverse_lu(factors, graph.vector("r", nu))
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
        self.replay = replay = ScheduleInterpreter(state, staged=False)
        replay.sweep(RATES)
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
            right = [_product(self.graph, row, dict(enumerate(own))) for row in turned]
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
        return [row[0] for row in solve_pivoted(self.graph, matrix, [[x] for x in right])]


def _transposed(rows: Matrix) -> Matrix:
    return [list(column) for column in zip(*rows, strict=True)]


def _product(graph: Graph, row: Nodes, column: dict[int, Node]) -> Node:
    """Of a row and a column, whose entries that are not there are zero."""
    total = graph.constant(0)
    for place, entry in column.items():
        total = total + row[place] * entry
    return total


class _Moving:
    """The kernels that ask for the rates of the coordinates alone."""

    def __init__(self, structure: Structure, kernels: Kernels) -> None:
        self._structure = structure
        state = FusionState(structure, kernels, None)
        self._graph, self._lag = state.graph, _Lag(state)
        self._rates = self._lag.replay.gathered("qdot")
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
        replay = ScheduleInterpreter(state, staged=False, inverse=True)
        replay.sweep(INVERSE_DYNAMICS)
        required = replay.gathered("required")
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
            state.graph.guard(condition, FAILED, "the looped engine names what fails")

    def kernels(self, rest: bool = False) -> list[KernelIR]:
        """All but those of the slopes; the tangent last, whose pivots are guards of the graph."""
        s, ports = self._structure, _inputs(self._structure)
        graph, r, power = self._graph, Port("r", (s.nu,)), Port("power", (1,))
        values: dict[str, object] = {"r": self._r, "power": [self._power]}
        rate: dict[str, object] = {"r_t": derivatives(self._r, {self._t: 1})}
        return [
            graph.kernel("residual", ports, [r], {"r": self._r}, as_made=True),
            graph.kernel("residual_power", ports, [r, power], values, as_made=True),
            graph.kernel("residual_rate", ports, [Port("r_t", (s.nu,))], rate, as_made=True),
            *([self._rest(ports)] if rest else []),
            self._tangent(ports),
        ]

    def _tangent(self, ports: list[Port]) -> KernelIR:
        graph, s = self._graph, self._structure
        matrix = _transposed([self._along(j) for j in range(s.nu)])
        return graph.kernel(
            "tangent", [*ports, Port("steps", (3,))], [_factors(s.nu)],
            {"factors": factor_reverse_lu(graph, matrix)}, as_made=True,
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

    def _rest(self, ports: list[Port]) -> KernelIR:
        """R differentiated along the increments that are known."""
        graph, s = self._graph, self._structure
        moved = [*graph.vector("dq", s.nq), *graph.vector("da", s.nu)]
        slope = derivatives(self._r, dict(zip([*self._q, *self._a], moved, strict=True)))
        rest = [a - b for a, b in zip(graph.vector("r", s.nu), slope, strict=True)]
        return graph.kernel(
            "rest", [*ports, *_known(s)], [Port("rest", (s.nu,))], {"rest": rest}, as_made=True
        )

    def by_slopes(self) -> list[KernelIR]:
        """The same where K and M are kept, and the tangent that is made of them."""
        graph, s, ports = self._graph, self._structure, _inputs(self._structure)
        known, speeds = self._slopes([*self._q, *self._a]), self._slopes(self._u)
        matrix = _transposed([self._sum(j, known, speeds) for j in range(s.nu)])
        slopes = [_slopes_port(s), _factors(s.nu)]
        values: dict[str, object] = {"slopes": known, "factors": factor_reverse_lu(graph, matrix)}
        both = graph.kernel(
            "tangent_slopes", [*ports, Port("steps", (3,))], slopes, values, as_made=True
        )
        return [both, self._product_kernel(ports, known)]

    def _slopes(self, leaves: Nodes) -> Matrix:
        """Of R, a row for each of its entries."""
        return _transposed([derivatives(self._r, {leaf: 1}) for leaf in leaves])

    def _sum(self, j: int, known: Matrix, speeds: Matrix) -> Nodes:
        """Column j of K W + C + s M."""
        graph, s = self._graph, self._structure
        unit = [graph.constant(int(i == j)) for i in range(s.nu)]
        if self._imposed[j]:
            return unit
        changes = {s.nq + j: self._lag.s, **self._lag.changes(unit, None)}
        return [
            by_speed[j] + _product(graph, row, changes)
            for row, by_speed in zip(known, speeds, strict=True)
        ]

    def _product_kernel(self, ports: list[Port], known: Matrix) -> KernelIR:
        """Where K and M are zero whatever the numbers, nothing is read."""
        s, graph = self._structure, Graph()
        moved = [*graph.vector("dq", s.nq), *graph.vector("da", s.nu)]
        rest = []
        for i, row in enumerate(known):
            there = {k: moved[k] for k, slope in enumerate(row) if slope.value != 0}
            slopes = [graph.element("slopes", i, k) for k in range(len(row))]
            rest.append(graph.element("r", i) - _product(graph, slopes, there))
        return graph.kernel(
            "rest", [*ports, *_known(s)], [Port("rest", (s.nu,))], {"rest": rest}, as_made=True
        )
