"""One-way linear elastodynamics: elastic response of bodies to a run with rigid bodies.

Jing, Stephansson, section 2.7.1: rigid bodies first, then each body's deformation under the
resulting inertia and interaction forces, then superposition. The second step is the second line of
(2.82),

    M_ff etadd + D etad + K eta = Q_f - M_fr ydd_r        (and the centrifugal load of the run)

with n oscillators per body, which are solved exactly for loads sampled from the rigid run, as
piecewise polynomials. In the eigenvectors of its first-order form every component obeys yd = lambda
y + sum c_j s^j, whose solution over a cell is evaluated without steps: the only errors are those of
the polynomials, whatever the frequencies.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.risk import RUN, Risk

from ...flexible.modal_body import kernel, moment_inputs
from ...kernels.numpy_kernels import evaluate
from ...run.run_execution import RunMonitor, first_run
from ..observations import Observations

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...flexible.modal_body import ModalBody
    from ...packing.rigid_substitution import RigidSubstitution
    from ...run.trajectory import Trajectory

#: Sampling points of a load in each cell: a polynomial of degree 5.
POINTS_PER_CELL = 6
#: Larger condition numbers of the eigenvectors indicate critically damped oscillators.
_MAX_CONDITION = 1e7


@dataclass(frozen=True)
class Cells:
    """Intervals of time on each of which loads are one polynomial.

    `edges` (m + 1,) s, increasing; `breaks` are indices of edges at which loads may jump.
    """

    edges: Array
    breaks: frozenset[int]

    @classmethod
    def from_times(cls, times: Array, cells: int) -> Cells:
        """Cells from the first to the last of `times`, about `cells`, with edges at all times."""
        share = np.diff(times) / (times[-1] - times[0])
        counts = np.maximum(np.ceil(cells * share), 1).astype(int)
        parts = [
            np.linspace(a, b, n, endpoint=False)
            for a, b, n in zip(times[:-1], times[1:], counts, strict=True)
        ]
        break_positions = np.cumsum(counts)[:-1]
        return cls(np.concatenate([*parts, times[-1:]]), frozenset(break_positions.tolist()))

    @property
    def lengths(self) -> Array:
        """Cell lengths (m,) in s."""
        return np.diff(self.edges)

    @property
    def samples(self) -> Array:
        """Times (m * POINTS_PER_CELL,) of the load samples, inside the cells (Gauss points)."""
        nodes = (np.polynomial.legendre.leggauss(POINTS_PER_CELL)[0] + 1) / 2
        return np.asarray((self.edges[:-1, None] + self.lengths[:, None] * nodes).reshape(-1))

    def polynomials(self, values: Array) -> Array:
        """Coefficients (m, POINTS_PER_CELL, n) of (s / length)^j from values at `samples`.

        `values` is (m * POINTS_PER_CELL, n).
        """
        nodes = (np.polynomial.legendre.leggauss(POINTS_PER_CELL)[0] + 1) / 2
        inverse = np.linalg.inv(np.vander(nodes, increasing=True))
        by_cell = values.reshape(len(self.lengths), POINTS_PER_CELL, -1)
        return np.asarray(np.einsum("jp,cpn->cjn", inverse, by_cell))

    def jumps(self, coefficients: Array) -> Array:
        """Largest jump (n,) of the polynomials at edges where loads are smooth: their error."""
        before, after = coefficients.sum(axis=1)[:-1], coefficients[1:, 0]
        smooth_edges = [k - 1 for k in range(1, len(self.edges) - 1) if k not in self.breaks]
        return np.asarray(np.max(np.abs(after - before)[smooth_edges], axis=0, initial=0.0))

    def find(self, times: Array) -> NDArray[np.int64]:
        """Cell index of each time; an edge belongs to the next cell, the last edge to the last."""
        indices = np.searchsorted(self.edges, times, side="right") - 1
        return np.clip(indices, 0, len(self.lengths) - 1)


@dataclass(frozen=True)
class Oscillators:
    """Coefficients (n, n): stiffness and mass symmetric and definite, damping symmetric."""

    stiffness: Array
    damping: Array
    mass: Array

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        """Frequencies (n,) in rad/s and mode shapes (n, n) with unit modal mass, undamped."""
        from scipy import linalg

        squares, shapes = linalg.eigh(self.stiffness, self.mass)
        return np.sqrt(squares), shapes

    @cached_property
    def _first_order(self) -> tuple[Any, Any, Any]:
        """Eigenvalues lambda (2n,), eigenvectors, and their inverse, over [eta; etad].

        In undamped modes.
        """
        omega, shapes = self.modes
        n, damping = len(omega), shapes.T @ self.damping @ shapes
        while True:
            matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(omega**2), -damping]])
            scale = np.concatenate([np.ones(n), omega])
            roots, vectors = np.linalg.eig(matrix * scale / scale[:, None])
            if np.linalg.cond(vectors) < _MAX_CONDITION:
                vectors = vectors * scale[:, None]
                return roots, vectors, np.linalg.inv(vectors)
            damping = damping * (1 + 1e-9) + 1e-12 * np.diag(omega)

    def motion(self, cells: Cells, loads: Array, start: tuple[Array, Array], times: Array) -> Array:
        """Motion (3, times, n): eta, etad, etadd at `times`.

        `start` = (eta, etad) at the first edge, and `loads` (m, POINTS_PER_CELL, n) are the
        coefficients of the polynomials.
        """
        roots, vectors, inverse = self._first_order
        shapes = self.modes[1]
        n = len(shapes)
        forcing = np.einsum("kj,cpi,ij->cpk", inverse[:, n:], loads, shapes)
        projection = shapes.T @ self.mass
        state = inverse @ np.concatenate([projection @ start[0], projection @ start[1]])
        starts = [state]
        growth, weights = _propagation(roots, cells.lengths, cells.lengths)
        for cell in range(len(cells.lengths)):
            state = growth[cell] * state + np.sum(weights[cell] * forcing[cell], axis=0)
            starts.append(state)
        cell_indices = cells.find(times)
        offsets = times - cells.edges[cell_indices]
        growth, weights = _propagation(roots, offsets, cells.lengths[cell_indices])
        states = growth * np.array(starts)[cell_indices] + np.sum(
            weights * forcing[cell_indices], axis=1
        )
        shares = (offsets / cells.lengths[cell_indices])[:, None] ** np.arange(POINTS_PER_CELL)
        load_values = np.einsum("tp,tpk->tk", shares, forcing[cell_indices])
        rates = states * roots + load_values
        components = np.stack(
            [states @ vectors[:n].T, states @ vectors[n:].T, rates @ vectors[n:].T]
        )
        return np.asarray(components.real @ shapes.T)


def _propagation(roots: Any, lengths: Array, whole: Array) -> tuple[Any, Any]:
    """Propagators e^(lambda s) (m, 2n), and integrals of the powers (m, POINTS_PER_CELL, 2n).

    The integrals are int_0^s e^(lambda (s - r)) (r / whole)^j dr.
    """
    z = lengths[:, None] * roots
    growth = np.exp(z)
    share = (lengths / whole)[:, None]
    is_large = np.abs(z) > 2.0
    safe_z = np.where(is_large, z, 1.0)
    recursive, series, integrals = (growth - 1) / safe_z, 0.0, []
    for j in range(POINTS_PER_CELL):
        if j:
            recursive = (j * recursive - 1) / safe_z
        series, term = np.zeros_like(z), np.full_like(z, 1 / (j + 1))
        for k in range(30):
            series = series + term
            term = term * np.where(is_large, 0.0, z) / (j + 2 + k)
        integral = np.where(is_large, recursive, series)
        integrals.append(integral * lengths[:, None] * share**j)
    return growth, np.stack(integrals, axis=1)


#: Largest jump of the load polynomials at smooth edges, relative to the largest load, at which the
#: refinement ends.
LOAD_TOLERANCE = 1e-7
MIN_CELLS, MAX_CELLS = 32, 4096

#: Relative distance, as part of the run, below which two edges are merged.
_MIN_EDGE_DISTANCE = 1e-9


@dataclass(frozen=True)
class Response:
    """Modal coordinates (n, modes) in m or rad, with first and second rates, at the samples."""

    eta: Array
    etad: Array
    etadd: Array


@dataclass(frozen=True)
class ResponseCost:
    """Cost of the elastic response in addition to the rigid run.

    evaluations: right-hand sides of the rigid runs from which loads were sampled; samples: states
    at which loads were computed; cells: intervals with one load polynomial each; oscillators: modal
    coordinates of all bodies; error: largest jump of the loads between cells, relative to the
    largest load.
    """

    evaluations: int
    samples: int
    cells: int
    oscillators: int
    error: float

    def __str__(self) -> str:
        return (
            f"{self.oscillators} oscillators over {self.cells} cells, loads at {self.samples} "
            f"states of {self.evaluations} evaluations (loads to {self.error:.1g})"
        )


@dataclass(frozen=True)
class OneWayResponses:
    """Responses of the one-way bodies over a run, and their cost."""

    responses: Mapping[str, Response]
    cost: ResponseCost

    @property
    def risks(self) -> tuple[Risk, ...]:
        """Finding that the loads are too rough for their polynomials."""
        if self.cost.error <= 10 * LOAD_TOLERANCE:
            return ()
        return (Risk(
            "one-way-loads", RUN,
            f"one-way response: the loads of the rigid run change too fast for {self.cost.cells} "
            f"cells (jumps of {self.cost.error:.1g} of the largest)", "simulate a shorter time",
            self.cost.error, 10 * LOAD_TOLERANCE,
        ),)  # fmt: skip


def compute_responses(model: CompiledScene, run: Trajectory) -> OneWayResponses:
    """Compute the responses of every one-way body at the samples of a run of the rigid bodies.

    The rigid run is repeated from its start with samples at the points where loads are needed,
    doubling their number until the polynomials join. Raises NumericalFailure where the run cannot
    be repeated.
    """
    rigid = rigidified_bodies(model)
    total = sum(body.n for body in rigid.one_way.values())
    break_times, cells, evaluations = _break_times(model, run), MIN_CELLS, 0
    if break_times[-1] == break_times[0]:
        return OneWayResponses(_start_responses(model, run), ResponseCost(0, 0, 0, total, 0.0))
    while True:
        grid = Cells.from_times(break_times, cells)
        load_run = _rerun_at_samples(model, run, grid)
        evaluations += load_run.statistics.evaluations
        observed = Observations(model, load_run)
        loads = {
            name: grid.polynomials(
                _require_finite(modal_loads(model, body, observed), name, observed)
            )
            for name, body in rigid.one_way.items()
        }
        error = max(
            (_relative_jump(rigid.one_way[n], grid, p) for n, p in loads.items()), default=0.0
        )
        if error <= LOAD_TOLERANCE or 2 * cells > MAX_CELLS:
            break
        cells *= 2
    responses = {
        name: _body_response(model, body, grid, loads[name], run.t)
        for name, body in rigid.one_way.items()
    }
    count = len(grid.lengths)
    return OneWayResponses(
        responses, ResponseCost(evaluations, len(grid.samples), count, total, error)
    )


def rigidified_bodies(model: CompiledScene) -> RigidSubstitution:
    """Substitution of the bodies that are rigid in a model's runs."""
    expanded = model.packed_scene.expanded
    assert expanded is not None and expanded.rigidified is not None
    return expanded.rigidified


def _break_times(model: CompiledScene, run: Trajectory) -> Array:
    """Times of the start, the last sample, and possible jumps or narrow features of loads."""
    first, last = run.settings.t_start, float(np.max(run.t, initial=run.settings.t_start))
    events = run.t[np.flatnonzero(run.event)]
    time_map = model.packed_scene.time_map(first, last)
    inner_times = [t for t in (*time_map.breaks, *time_map.starts, *events) if first < t < last]
    times = np.unique([first, *inner_times, last])
    is_distinct = np.diff(times) > _MIN_EDGE_DISTANCE * (
        last - first
    )  # a time may fall between two breaks
    return np.append(times[:-1][is_distinct], last)


def _rerun_at_samples(model: CompiledScene, run: Trajectory, grid: Cells) -> Trajectory:
    s, (t, q, u) = run.settings, run.first
    times = tuple(grid.samples.tolist())
    settings = replace(s, t_start=t, t_end=times[-1], output_times=times, first_step=0.0)
    repeated = first_run(model, settings, q, u, RunMonitor(None, settings))
    if not repeated.is_comparable or repeated.t[-1] < times[-1]:
        raise NumericalFailure(
            f"one-way response: the run could not be repeated: {repeated.message}"
        )
    rows = np.searchsorted(repeated.t, grid.samples)  # without those of events
    keys = ("t", "q", "u", "memory", "work", "event")
    return replace(repeated, **{key: getattr(repeated, key)[rows] for key in keys})


def _relative_jump(body: ModalBody, grid: Cells, loads: Array) -> float:
    """Largest jump at smooth edges over the largest load, both as static deflections."""
    largest = np.max(np.abs(loads[:, 0]), axis=0, initial=0.0)
    stiffness = np.diag(body.K)
    scale = float(np.max(largest / stiffness, initial=0.0))
    return float(np.max(grid.jumps(loads) / stiffness)) / scale if scale > 0 else 0.0


def modal_loads(model: CompiledScene, body: ModalBody, observed: Observations) -> Array:
    """Modal loads (n, modes) in N on a body in rigid motion, minus its inertia."""
    rigid, packed = rigidified_bodies(model), observed.engine.packed
    points = observed.points(body.name)
    rotation = points[:, 15:24].reshape(-1, 3, 3)

    def inward(vectors: Array) -> Array:
        return np.asarray(np.einsum("tji,tj->ti", rotation, vectors))

    spin, spin_rate = inward(points[:, 9:12]), inward(points[:, 12:15])
    acceleration = inward(points[:, 6:9] - np.array(model.scene.gravity))
    zero = np.zeros((len(points), body.n))
    inputs = {
        **moment_inputs(body), "K": body.K, "D": body.D, "eta": zero, "etad": zero,
        "motion": np.concatenate([spin, spin_rate, acceleration], axis=1),
    }  # fmt: skip
    loads = -evaluate(kernel("residual"), inputs, body.n)["e_f"]
    inboard_end = rigid.inboard_ends[body.name]
    inboard_hinge = rigid.inboard_hinges.get(body.name)
    hinge_loads = [] if inboard_hinge is None else [(inboard_end, inboard_hinge.name, 1.0)]
    welds = [node for node in rigid.nodes.values() if split_node(node)[0] == body.name]
    hinge_loads += [(split_node(node)[1], node, -1.0) for node in welds]
    for end, hinge, sign in hinge_loads:
        load = sign * observed.columns("loads", (packed.hinge_position[hinge],))
        port = body.ports[end]
        loads = loads + inward(load[:, :3]) @ port.phi + inward(load[:, 3:]) @ port.theta
    return np.asarray(loads)


def _require_finite(loads: Array, name: str, observed: Observations) -> Array:
    if not np.isfinite(loads).all():
        reason = next(iter(observed.failures), "overflow")
        raise NumericalFailure(f'one-way response: no loads on the shapes of "{name}": {reason}')
    return loads


def split_node(node: str) -> tuple[str, str]:
    """Body and node of a node name: ("blade", "tip") of "blade/tip"."""
    body, _, end = node.partition("/")
    return body, end


def _body_response(
    model: CompiledScene, body: ModalBody, grid: Cells, loads: Array, times: Array
) -> Response:
    oscillators = Oscillators(body.K, body.D, body.Mff)
    return Response(*oscillators.motion(grid, loads, _modal_start(model, body, loads[0, 0]), times))


def _modal_start(model: CompiledScene, body: ModalBody, load: Array) -> tuple[Array, Array]:
    """Modal coordinates and speeds (eta, etad) at the start, under modal loads (modes,) in N."""
    if _starts_static(model, body.name):
        return np.asarray(np.linalg.solve(body.K, load)), np.zeros(body.n)
    return body.eta, body.etad


def _starts_static(model: CompiledScene, name: str) -> bool:
    scene = model.scene
    return any(b.initial.static for b in (*scene.beam, *scene.elastic) if b.name == name)


def _start_responses(model: CompiledScene, run: Trajectory) -> dict[str, Response]:
    """Responses of a run without samples, or with samples at its start only."""
    responses, observed = {}, Observations(model, run)
    for name, body in rigidified_bodies(model).one_way.items():
        loads = modal_loads(model, body, observed)
        rows = [(*_modal_start(model, body, load), load) for load in loads]
        states = np.array(rows).reshape(len(rows), 3, body.n)
        eta, etad = states[:, 0], states[:, 1]
        forces = states[:, 2] - eta @ body.K.T - etad @ body.D.T
        responses[name] = Response(eta, etad, np.asarray(np.linalg.solve(body.Mff, forces.T).T))
    return responses
