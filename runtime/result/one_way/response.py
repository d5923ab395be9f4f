"""One-way linear elastodynamics: elastic response of bodies to a run with rigid bodies.

Jing, Stephansson, section 2.7.1: rigid bodies first, then each body's deformation under the
resulting inertia and interaction forces, then superposition. The second step is the second line of
(2.82),

    M_ff etadd + D etad + K eta = Q_f - M_fr ydd_r        (and the centrifugal load of the run)

with n oscillators per body, which are solved exactly for loads sampled from the rigid run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.risk import RUN, Risk

from ...flexible.modal_body import kernel, moment_inputs
from ...kernels.numpy_kernels import evaluate
from ...run.run_execution import RunMonitor, first_run
from ..observations import Observations
from .oscillators import Cells, Oscillators

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...flexible.modal_body import ModalBody
    from ...packing.rigid_substitution import RigidSubstitution
    from ...run.trajectory import Trajectory


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
    return _drop_event_rows(repeated, grid)


def _drop_event_rows(run: Trajectory, grid: Cells) -> Trajectory:
    """Rows of a run at the output times only."""
    rows = np.searchsorted(run.t, grid.samples)
    keys = ("t", "q", "u", "memory", "work", "event")
    return replace(run, **{key: getattr(run, key)[rows] for key in keys})


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
