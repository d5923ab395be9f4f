"""Residual of a small scene for implicit methods, and its factored tangent.

Inverse dynamics is evaluated on one graph and differentiated by every unknown. With few unknowns no
elimination by bodies is needed: the tangent is a matrix whose zeros fold, and the factorisation
from tips to root causes no fill-in.
"""

from __future__ import annotations

from mstmm.ir import KernelIR, Port
from mstmm.ir.differentiation import derivatives
from mstmm.ir.graph import Graph, Node
from mstmm.ir.inline import Nodes
from mstmm.ir.scene_structure import Structure
from mstmm.ir.unrolled_solve import factor_reverse_lu, solve_pivoted, solve_reverse_lu

from ..schedule.forward_kinematics import FORWARD, PRESCRIBED_ACCELERATIONS
from ..schedule.pass_steps import Run, Sweep
from ..schedule.sweeps import INVERSE_DYNAMICS
from .fusion_state import FusionState, Kernels
from .scene_kernels import FAILED, FusedSceneIR, inputs_of
from .schedule_interpreter import ScheduleInterpreter
from .sum_balancing import BalancedKernels

Matrix = list[Nodes]
#: Largest number of speeds for which K and M are stored separately. A product by them costs about a
#: tenth of a directional derivative of R, but the code of the tangent grows: twice as much for 12
#: speeds, with four times the compile time.
_MAX_SPEEDS_STORED = 8
#: Prescribed motion is not applied: coordinates are used as given.
RATES = Sweep("rates", "Rates of q.", (Run(whole=PRESCRIBED_ACCELERATIONS), Run(whole=FORWARD)))


def fuse_implicit(structure: Structure, kernels: Kernels) -> FusedSceneIR:
    """Kernels that `mstmm_implicit` (runtime/integrate/c/implicit.h) needs of a scene.

    All read p, t, q, u, memory and the accelerations a.  "residual": R (nu) by inverse
    dynamics, zero for prescribed speeds; "residual_power": R and the power of everything that
    is not stored. "residual_rate": the derivative of R in t.  "tangent": the factors (nu x nu,
    see `factor_reverse_lu`) of K W + C + s M with a one for every prescribed speed, where K, C
    and M are the derivatives of R in q, u and a, steps are s, sq and kappa, and W = (sq - kappa
    g_q)^-1 N where q' = N u has the derivative g_q in q.  "tangent_slopes", of very small
    scenes: the factors, and K and M (nu x (nq + nu)).  "rest": r - K dq - M da, of those
    derivatives where they exist. "solution": x (nu) of factors and r.  "coordinates": dq (nq)
    of x and rho (nq), sq dq = kappa g_q dq + N x + rho.  "rates": q' alone.  Prescribed
    coordinates have neither.

    A failing guard does not name its cause: evaluate the looped engine for the message.
    """
    stores_derivatives = structure.nu <= _MAX_SPEEDS_STORED
    kernel_list = _ResidualKernels(structure, kernels).kernels(rest=not stores_derivatives)
    if stores_derivatives:
        kernel_list += _ResidualKernels(structure, kernels).matrix_kernels()
    kernel_list += [_solution_kernel(structure.nu), *_RateKernels(structure, kernels).kernels()]
    return FusedSceneIR(BalancedKernels(*kernel_list), ((0, -1, FAILED),))


def _inputs(structure: Structure) -> list[Port]:
    return [*inputs_of(structure)[:-1], Port("a", (structure.nu,))]


def _is_prescribed(structure: Structure) -> list[bool]:
    mask = [False] * structure.nu
    for body in structure.bodies:
        for k, imposed in enumerate(body.imposed):
            mask[body.u + k] = bool(imposed)
    return mask


def _factors_port(nu: int) -> Port:
    return Port("factors", (nu, nu))


def _slopes_port(structure: Structure) -> Port:
    return Port("slopes", (structure.nu, structure.nq + structure.nu))


def _known_ports(structure: Structure) -> list[Port]:
    """Ports of the known terms of a linear equation: right-hand side and given increments."""
    nq, nu = structure.nq, structure.nu
    return [_slopes_port(structure), Port("r", (nu,)), Port("dq", (nq,)), Port("da", (nu,))]


def _remainder_kernel(
    graph: Graph, structure: Structure, ports: list[Port], remainder: list[Node]
) -> KernelIR:
    """Kernel of the right-hand side without the part of known increments."""
    return graph.kernel(
        "rest",
        [*ports, *_known_ports(structure)],
        [Port("rest", (structure.nu,))],
        {"rest": remainder},
        keep_order=True,
    )


def _solution_kernel(nu: int) -> KernelIR:
    graph = Graph()
    factors = [[graph.element("factors", i, j) for j in range(nu)] for i in range(nu)]
    x = solve_reverse_lu(factors, graph.vector("r", nu))
    return graph.kernel(
        "solution",
        [_factors_port(nu), Port("r", (nu,))],
        [Port("x", (nu,))],
        {"x": x},
        keep_order=True,
    )


def _prescribed_coordinates(structure: Structure) -> set[int]:
    """Indices of prescribed coordinates."""
    indices = set[int]()
    for body in structure.bodies:
        if body.nu and all(body.imposed):
            indices |= set(range(body.q, body.q + body.nq))
        else:  # coordinate rates equal speeds where only some of them are prescribed
            indices |= {body.q + k for k in range(body.nu) if body.imposed[k]}
    return indices


class _CoordinateIncrements:
    """Coordinate increments that follow from speed increments, per hinge: Q dq = N x + rho."""

    def __init__(self, state: FusionState) -> None:
        self.graph, q, u = state.graph, state.q, state.u
        self._prescribed_coordinates = _prescribed_coordinates(state.structure)
        self.replay = replay = ScheduleInterpreter(state, staged=False)
        replay.sweep(RATES)
        s, sq, kappa = self.graph.vector("steps", 3)
        self.s, self._sq, self._kappa = s, sq, kappa
        self._speed_of_coordinate: dict[int, int] = {}
        self._coupled_rates: list[tuple[int, int, Matrix, Matrix]] = []
        for index, body in enumerate(state.structure.bodies):
            if body.modal is not None:
                self._speed_of_coordinate |= {
                    body.modal.q + k: body.modal.u + k for k in range(body.modal.n)
                }
            rates = replay.value(index, "body.qdot") or []
            first, speeds = q[body.q : body.q + body.nq], u[body.u : body.u + body.nu]
            slopes = [derivatives(rates, {variable: 1}) for variable in first]
            by_speeds = [derivatives(rates, {variable: 1}) for variable in speeds]
            if body.nq == body.nu and not any(x.value != 0 for row in slopes for x in row):
                self._speed_of_coordinate |= {body.q + k: body.u + k for k in range(body.nu)}
            elif body.nq:
                self._coupled_rates.append(
                    (body.q, body.u, _transpose(slopes), _transpose(by_speeds))
                )

    def coordinate_changes(self, x: Nodes, rho: Nodes | None) -> dict[int, Node]:
        """dq by coordinate index; coordinates that do not change are omitted."""
        increments = {}
        for index, speed in self._speed_of_coordinate.items():
            change = x[speed] if rho is None else x[speed] + rho[index]
            if change.value != 0:
                increments[index] = change / self._sq
        for first, speed, slopes, by_speeds in self._coupled_rates:
            n, rates = len(slopes), x[speed : speed + len(by_speeds[0])]
            right = [_product(self.graph, row, dict(enumerate(rates))) for row in by_speeds]
            if rho is not None:
                right = [a + b for a, b in zip(right, rho[first : first + n], strict=True)]
            if any(entry.value != 0 for entry in right):
                increments |= dict(enumerate(self._solve_hinge(slopes, right), first))
        return {
            index: change
            for index, change in increments.items()
            if index not in self._prescribed_coordinates
        }

    def _solve_hinge(self, slopes: Matrix, right: Nodes) -> Nodes:
        """dq of one hinge: solution of (sq - kappa g_q) dq = right."""
        matrix = [[-self._kappa * entry for entry in row] for row in slopes]
        for i in range(len(matrix)):
            matrix[i][i] = matrix[i][i] + self._sq
        return [row[0] for row in solve_pivoted(self.graph, matrix, [[x] for x in right])]


def _transpose(rows: Matrix) -> Matrix:
    return [list(column) for column in zip(*rows, strict=True)]


def _product(graph: Graph, row: Nodes, column: dict[int, Node]) -> Node:
    """Scalar product of a row and a sparse column (missing entries are zero)."""
    total = graph.constant(0)
    for index, entry in column.items():
        total = total + row[index] * entry
    return total


class _RateKernels:
    """Kernels that need only the coordinate rates."""

    def __init__(self, structure: Structure, kernels: Kernels) -> None:
        self._structure = structure
        state = FusionState(structure, kernels, None)
        self._graph, self._increments = state.graph, _CoordinateIncrements(state)
        self._rates = self._increments.replay.collect("qdot")
        for index in _prescribed_coordinates(structure):
            self._rates[index] = state.zero

    def kernels(self) -> list[KernelIR]:
        return [self._rate_kernel(), self._coordinates_kernel()]

    def _rate_kernel(self) -> KernelIR:
        s = self._structure
        return self._graph.kernel(
            "rates", _inputs(s), [Port("dq", (s.nq,))], {"dq": self._rates}, keep_order=True
        )

    def _coordinates_kernel(self) -> KernelIR:
        graph, s = self._graph, self._structure
        changes = self._increments.coordinate_changes(
            graph.vector("x", s.nu), graph.vector("rho", s.nq)
        )
        increment_ports = [Port("steps", (3,)), Port("x", (s.nu,)), Port("rho", (s.nq,))]
        dq = [changes.get(index, graph.constant(0)) for index in range(s.nq)]
        return graph.kernel(
            "coordinates",
            [*_inputs(s), *increment_ports],
            [Port("dq", (s.nq,))],
            {"dq": dq},
            keep_order=True,
        )


class _ResidualKernels:
    """Kernels based on inverse dynamics."""

    def __init__(self, structure: Structure, kernels: Kernels) -> None:
        self._structure, self._is_prescribed = structure, _is_prescribed(structure)
        state = FusionState(structure, kernels, None)
        state.efforts = state.zeros(structure.nu)
        self._graph, self._t, self._q, self._u = state.graph, state.t, list(state.q), list(state.u)
        self._a, self._increments = state.given_accelerations, _CoordinateIncrements(state)
        replay = ScheduleInterpreter(state, staged=False, inverse=True)
        replay.sweep(INVERSE_DYNAMICS)
        required = replay.collect("required")
        terms = zip(required, state.u, self._is_prescribed, strict=True)
        self._power = sum(
            (load * speed for load, speed, imposed in terms if imposed),
            replay.get("sums.power", 1)[0],
        )
        self._r = [
            state.zero if imposed else effort
            for effort, imposed in zip(required, self._is_prescribed, strict=True)
        ]
        for condition in replay.conditions:
            state.graph.guard(condition, FAILED, "the looped engine names what fails")

    def kernels(self, rest: bool = False) -> list[KernelIR]:
        """Kernels without stored derivatives; the tangent is last because it adds guards."""
        s, ports = self._structure, _inputs(self._structure)
        graph, r, power = self._graph, Port("r", (s.nu,)), Port("power", (1,))
        values: dict[str, object] = {"r": self._r, "power": [self._power]}
        rate: dict[str, object] = {"r_t": derivatives(self._r, {self._t: 1})}
        return [
            graph.kernel("residual", ports, [r], {"r": self._r}, keep_order=True),
            graph.kernel("residual_power", ports, [r, power], values, keep_order=True),
            graph.kernel("residual_rate", ports, [Port("r_t", (s.nu,))], rate, keep_order=True),
            *([self._known_increments_kernel(ports)] if rest else []),
            self._tangent_kernel(ports),
        ]

    def _tangent_kernel(self, ports: list[Port]) -> KernelIR:
        graph, s = self._graph, self._structure
        matrix = _transpose([self._tangent_column(j) for j in range(s.nu)])
        return graph.kernel(
            "tangent", [*ports, Port("steps", (3,))], [_factors_port(s.nu)],
            {"factors": factor_reverse_lu(graph, matrix)}, keep_order=True,
        )  # fmt: skip

    def _tangent_column(self, j: int) -> Nodes:
        """Column j of the tangent."""
        graph = self._graph
        unit = [graph.constant(int(i == j)) for i in range(self._structure.nu)]
        if self._is_prescribed[j]:
            return unit
        seeds: dict[Node, Node | float] = {self._u[j]: 1, self._a[j]: self._increments.s}
        for index, change in self._increments.coordinate_changes(unit, None).items():
            seeds[self._q[index]] = change
        return derivatives(self._r, seeds)

    def _known_increments_kernel(self, ports: list[Port]) -> KernelIR:
        """Directional derivative of R along the known increments."""
        graph, s = self._graph, self._structure
        increments = [*graph.vector("dq", s.nq), *graph.vector("da", s.nu)]
        derivative = derivatives(self._r, dict(zip([*self._q, *self._a], increments, strict=True)))
        remainder = [a - b for a, b in zip(graph.vector("r", s.nu), derivative, strict=True)]
        return _remainder_kernel(graph, s, ports, remainder)

    def matrix_kernels(self) -> list[KernelIR]:
        """Kernels that store K and M, and the tangent formed from them."""
        graph, s, ports = self._graph, self._structure, _inputs(self._structure)
        stored, by_speeds = (
            self._derivative_rows([*self._q, *self._a]),
            self._derivative_rows(self._u),
        )
        matrix = _transpose(
            [self._stored_tangent_column(j, stored, by_speeds) for j in range(s.nu)]
        )
        ports_out = [_slopes_port(s), _factors_port(s.nu)]
        values: dict[str, object] = {"slopes": stored, "factors": factor_reverse_lu(graph, matrix)}
        tangent = graph.kernel(
            "tangent_slopes", [*ports, Port("steps", (3,))], ports_out, values, keep_order=True
        )
        return [tangent, self._stored_increments_kernel(ports, stored)]

    def _derivative_rows(self, leaves: Nodes) -> Matrix:
        """Derivatives of R, one row for each entry."""
        return _transpose([derivatives(self._r, {leaf: 1}) for leaf in leaves])

    def _stored_tangent_column(self, j: int, stored: Matrix, by_speeds: Matrix) -> Nodes:
        """Column j of K W + C + s M."""
        graph, s = self._graph, self._structure
        unit = [graph.constant(int(i == j)) for i in range(s.nu)]
        if self._is_prescribed[j]:
            return unit
        changes = {s.nq + j: self._increments.s, **self._increments.coordinate_changes(unit, None)}
        return [
            by_speed[j] + _product(graph, row, changes)
            for row, by_speed in zip(stored, by_speeds, strict=True)
        ]

    def _stored_increments_kernel(self, ports: list[Port], stored: Matrix) -> KernelIR:
        """Kernel "rest" from stored K and M; structural zeros are not read."""
        s, graph = self._structure, Graph()
        increments = [*graph.vector("dq", s.nq), *graph.vector("da", s.nu)]
        remainder = []
        for i, row in enumerate(stored):
            nonzero = {k: increments[k] for k, slope in enumerate(row) if slope.value != 0}
            slopes = [graph.element("slopes", i, k) for k in range(len(row))]
            remainder.append(graph.element("r", i) - _product(graph, slopes, nonzero))
        return _remainder_kernel(graph, s, ports, remainder)
