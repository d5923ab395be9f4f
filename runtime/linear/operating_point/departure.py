"""Departure from an operating point: unbalanced efforts at the state and along its motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ...engine.compiled_scene import scene_length, speed_scales, total_weight
from ..harmonic.harmonic_solve import HarmonicLoads
from ..input_channels import Channel
from ..outputs import LinearQuantity, outputs_of, rows_of
from .later_states import LaterStates

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations


#: Negligible distance from equilibrium, and acceleration (per s^2) of unrestrained coordinates, in
#: characteristic scales; relative stiffness that counts as zero.
_STILL, _SOFT = 1e-6, 1e-13
#: Small change of a state: effort relative to the weight of the scene, distance in characteristic
#: scales.
_SMALL_EFFORT, _SMALL_DISTANCE = 1e-3, 1e-2
#: Largest number of coordinates for which matrices are computed.
LARGEST = 2000


@dataclass(frozen=True)
class Departure:
    """Departure of coordinates from an operating point.

    Attributes:
        coordinates: names of the departing coordinates.
        worst_coordinate: coordinate with the largest unbalanced effort.
        effort, unit: that effort, N or N*m.
        t: its time (s).
        is_small: whether springs or gravity keep all of them near the state against a load far
            below the weight.
    """

    coordinates: list[str]
    worst_coordinate: str
    effort: float
    unit: str
    t: float
    is_small: bool = False

    def __str__(self) -> str:
        effort = f"{abs(self.effort):.4g} {self.unit}"
        return f"{effort} along {self.worst_coordinate} at t = {self.t:.6g} s"


def find_departure(linear: LinearEquations, later: LaterStates | None = None) -> Departure | None:
    """Departure from the operating point; None if it is steady.

    With `later`, states further along its motion are also checked.
    """
    states = [linear.state, *(() if later is None else later.all_states)]
    free = list(linear.free_speed_indices)
    a = np.array([later_state.udot[free] for later_state in states]).T
    if not a.any():
        return None
    sizes = speed_scales(linear.model)[free]
    leaves, efforts, distances = _departing_coordinates(linear, a, sizes)
    if not leaves.any():
        return None
    if leaves[:, 0].any():  # an immediate departure takes precedence
        leaves[:, 1:] = False
    work = np.where(leaves, np.abs(efforts) * sizes[:, None], 0.0)
    worst, at = np.unravel_index(int(work.argmax()), work.shape)
    names = [linear.coordinate_names[k] for k in np.flatnonzero(leaves.any(axis=1))]
    unit = "N*m" if linear.coordinate_units[worst] == "rad" else "N"
    effort = float(efforts[worst, at])
    largest_load = total_weight(linear.model) * scene_length(linear.model)
    is_small = (
        later is not None
        and np.max(distances[leaves]) <= _SMALL_DISTANCE
        and work.max() <= _SMALL_EFFORT * largest_load
        and _forced_distance(linear, later, efforts, sizes) <= _SMALL_DISTANCE
    )
    return Departure(
        names, linear.coordinate_names[worst], effort, unit, states[at].t, bool(is_small)
    )


def _departing_coordinates(
    linear: LinearEquations, a: Array, sizes: Array
) -> tuple[NDArray[np.bool_], Array, Array]:
    """Departing coordinates, unbalanced efforts and distances for accelerations a (n, k).

    All results are (n, k).  Distances from equilibrium are in characteristic scales.  A coordinate
    departs if its distance exceeds a small fraction of its scale, or if it accelerates without
    restraint; then the distance is infinite.
    """
    if len(linear) > LARGEST:
        columns = [_displacement_by_sweep(linear, column) for column in a.T]
        distances = np.abs(np.array(columns).T / sizes[:, None])
        return distances > _STILL, _efforts(linear, a), distances
    stiffness, efforts = linear.K * np.outer(sizes, sizes), linear.M @ a
    pushed = efforts * sizes[:, None]
    away = np.asarray(np.linalg.lstsq(stiffness, pushed, rcond=_SOFT)[0], dtype=np.float64)
    missing = (pushed - stiffness @ away) / sizes[:, None]
    free_acceleration = np.linalg.solve(linear.M, missing) / sizes[:, None]
    distances = np.where(np.abs(free_acceleration) > _STILL, np.inf, np.abs(away))
    return distances > _STILL, efforts, distances


def _forced_distance(
    linear: LinearEquations, later: LaterStates, efforts: Array, sizes: Array
) -> float:
    """Largest amplitude under harmonic efforts (n, k) at the rate of the fastest drive.

    It is in characteristic scales, and infinite without moving drives or for too large matrices.
    """
    if not later.driven or len(linear) > LARGEST:
        return np.inf
    rate = np.abs(linear.state.u[later.driven]).max()
    try:
        amplitudes = np.linalg.solve(linear.K - rate**2 * linear.M, efforts) / sizes[:, None]
    except np.linalg.LinAlgError:  # resonance
        return np.inf
    return float(np.abs(amplitudes).max(initial=0.0))


def _efforts(linear: LinearEquations, a: Array) -> Array:
    """Product M a (n, k), for trees without matrices."""
    if linear.constrained_motion is not None:
        return linear.M @ a
    return np.array([linear.operators.mass(column) for column in a.T]).T


def _displacement_by_sweep(linear: LinearEquations, a: Array) -> Array:
    """Distance (n,) from equilibrium, K^-1 M a, without matrices; infinite if K is singular."""
    if linear.constrained_motion is not None or linear.rate_matrix is not None:
        return np.where(a == 0, 0.0, np.inf)
    pencil = linear.operators
    try:
        pencil.factor(0.0)
    except NumericalFailure:
        return np.where(a == 0, 0.0, np.inf)
    return np.asarray(pencil.solve(pencil.mass(a)), dtype=np.float64)


# --- changes of matrices, inputs and outputs along the motion -------------------------------------

#: Name of M, C and K in the results of `find_changes`.
MATRICES = "the matrices"
#: Negligible changes relative to rows and columns, relative to the largest entry, and absolute.
_SAME, _FAINT, _ROUNDING = 1e-6, 1e-9, 1e-12


def find_changes(
    linear: LinearEquations,
    later: LaterStates,
    pushes: Sequence[Channel],
    shown: Sequence[LinearQuantity] = (),
) -> list[str]:
    """Names of inputs and outputs that change along the motion, and `MATRICES` if these do."""
    names, changing = [quantity.name for quantity in shown], dict[str, None]()
    if not later.compared_states:
        return []
    effects, rows = _effects(linear, pushes), _rows(linear, shown, pushes)
    for there in later.equations():
        if len(linear) <= LARGEST and _matrices_differ(linear, there):
            changing[MATRICES] = None
        now = _effects(there, pushes)
        again = _rows(there, outputs_of(there, names) if names else (), pushes)
        pairs = zip((*(push.name for push in pushes), *names), (*effects, *rows), (*now, *again),
                    strict=True)  # fmt: skip
        changing |= {name: None for name, first, second in pairs if _differ(first, second)}
    return list(changing)


def _effects(linear: LinearEquations, pushes: Sequence[Channel]) -> list[Array]:
    """Effort columns per unit of each input, including those of the motion of its drive."""
    if not pushes:
        return []
    efforts = np.zeros((len(pushes), linear.model.nu))
    efforts[:, list(linear.free_speed_indices)] = linear.input_matrix(pushes).T
    loads = HarmonicLoads.from_efforts(linear, pushes, efforts)
    return [loads.columns[loads.parts[:, k] != 0] for k in range(len(pushes))]


def _rows(
    linear: LinearEquations, shown: Sequence[LinearQuantity], pushes: Sequence[Channel]
) -> list[Array]:
    """Row of each output.

    Each row has the factors of increments, rates and accelerations, of those of drives that are
    inputs, and the feedthrough of the inputs.
    """
    speed_indices = [
        *linear.free_speed_indices,
        *(speed for channel in pushes for speed, _ in channel.drive_factors),
    ]
    all_rows, none = [], np.zeros((1, linear.model.nu))
    for quantity in shown:
        rows = rows_of(linear, [quantity], pushes)
        orders = [rows.orders.get(order, none)[0, speed_indices] for order in range(3)]
        all_rows.append(np.concatenate([*orders, rows.feedthrough[0]]))
    return all_rows


def _differ(first: Array, second: Array) -> bool:
    scale = max(float(np.abs(x).max(initial=0)) for x in (first, second))
    return float(np.abs(first - second).max(initial=0)) > _SAME * scale + _ROUNDING


def _matrices_differ(first_model: LinearEquations, second_model: LinearEquations) -> bool:
    """Whether M, C or K differ, scaled to unit masses and relative to rows and columns."""
    scale = np.sqrt(np.maximum(first_model.M.diagonal(), np.finfo(float).tiny))
    first, second = (
        [x / np.outer(scale, scale) for x in (at.M, at.C, at.K)]
        for at in (first_model, second_model)
    )
    spin = float(np.abs(first_model.state.u).max(initial=0))
    stiffness = float(np.abs(first[2]).max(initial=0)) + spin**2
    for a, b, unit in zip(first, second, (1.0, np.sqrt(stiffness), stiffness), strict=True):
        size = np.maximum(np.abs(a), np.abs(b))
        whole = max(float(size.max(initial=0)), float(unit))
        rows = np.sqrt(np.outer(size.max(axis=1, initial=0), size.max(axis=0, initial=0)))
        if (np.abs(a - b) > _SAME * rows + _FAINT * whole).any():
            return True
    return False
