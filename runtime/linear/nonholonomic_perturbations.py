"""Perturbations with nonholonomic rows: their frames, admissible directions and eigenvalues."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, NoReturn

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.scene.tables.closures import ROLLING

from ..engine.loops.independent_speeds import IndependentSpeeds, select_rows
from .constrained_linearisation import ConstrainedLinearisation, torn_trees

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..packing.coordinate_layout import HingeSlots
    from .mck_matrices import State
    from .operating_point.friction import DryFriction


# --- frames in which a steady motion with rotating bodies has constant speeds ---------------------
#
# Perturbations and speeds of ball and free hinges are in the axes of their outboard body.  For a
# rolling coin these axes rotate, so that the coefficients of its linear equations vary.  The body
# axes rotate at w relative to a frame in which the speeds u of the steady motion are constant:
# du/dt = -w x u in the axes of the body.  This determines w except for a component parallel to all
# speeds.  A body that spins about a fixed direction on the spot keeps its own axes.

#: Relative threshold for rates w, and for directions in which the speeds do not determine w.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Frames:
    """Angular velocities of body axes relative to the frames of perturbations and speeds.

    `rates` maps a hinge to w (3,), rad/s, of its outboard body relative to the frame, in body axes;
    hinges with zero w are left out.  `generator` (nu, nu), 1/s, is w x for all speeds.
    """

    rates: Mapping[str, Array]
    generator: Array

    def state_generator(self) -> Array:
        """Generator (2 nu, 2 nu), 1/s, of perturbations and speeds."""
        return np.asarray(block_diag(self.generator, self.generator))

    def rotation(self, dt: float) -> Array:
        """Rotation (nu, nu) from the body axes after dt (s) to the frames."""
        return np.asarray(expm(dt * self.generator))


def frames_at(model: CompiledScene, state: State) -> Frames:
    """Frames in which the speeds of a state have the smallest rates of change."""
    rates, generator = dict[str, Array](), np.zeros((model.nu, model.nu))
    for slots in _quaternion_hinges(model):
        parts = [slice(k, k + 3) for k in range(slots.u, slots.u + slots.nu, 3)]
        speeds = np.vstack([cross_matrix(state.u[part]) for part in parts])
        changes = np.concatenate([state.udot[part] for part in parts])
        rate = np.linalg.lstsq(speeds, changes, rcond=_ROUNDING)[0]  # u x w = du/dt
        if np.abs(rate).max() > _ROUNDING * np.abs(state.u[slots.u_slice]).max(initial=0.0):
            rates[slots.name] = rate
            for part in parts:
                generator[part, part] = cross_matrix(rate)
    return Frames(rates, generator)


def has_rotating_frame(model: CompiledScene, state: State, frames: Frames) -> bool:
    """Whether a frame of a ball or free hinge rotates relative to the inboard body."""
    for slots in _quaternion_hinges(model):
        speeds = state.u[slots.u + slots.nu - 3 : slots.u + slots.nu]
        left = np.abs(speeds - frames.rates.get(slots.name, 0.0)).max()
        if left > _ROUNDING * np.abs(state.u[slots.u_slice]).max():
            return True
    return False


def _quaternion_hinges(model: CompiledScene) -> Iterator[HingeSlots]:
    """Quaternion hinges with speeds in axes of the outboard body, angular speeds last."""
    for slots in model.coordinate_layout.hinges.values():
        if slots.quaternion is not None and slots.constant_subspace and slots.nu in (3, 6):
            yield slots


def cross_matrix(v: Array) -> Array:
    """Cross-product matrix (3, 3) of v (3,)."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


# --- admissible perturbations: rolling discs, knife edges -----------------------------------------
#
# Rows J(q) u = 0 restrict all speeds.  The holonomic rows J_h restrict the perturbations of
# coordinates too, J_h phi = 0.  Independent perturbations x of positions and v of speeds give
#
#     phi = P x,    du = N v + S x,    J N = 0,    J S x + d(J u)/dq phi = 0,
#
# so that there are more positions than speeds.  The derivative in the last equation is a central
# difference of eighth order of a load-free expression; everything else is exact.

#: Weights of a central difference by number of steps; step sizes tried, in characteristic scales.
_WEIGHTS = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
_STEPS = (1e-2, 1e-3, 1e-4)
#: Relative size below which rows and speeds are rounding.
_ROW_ROUNDING = 1e-9


def has_speed_rows(model: CompiledScene) -> bool:
    """Whether the scene has nonholonomic rows: rolling discs, couplings of speeds."""
    scene = model.packed_scene.user_scene
    return any(constraint.type == ROLLING for constraint in scene.constraint) or any(
        coupling.speeds is not None for coupling in scene.coupling
    )


@dataclass(frozen=True, eq=False)
class RollingMechanism(ConstrainedLinearisation):
    """Independent positions and speeds; the inherited indices and basis belong to the positions.

    Attributes:
        speed_indices: indices of the m independent speeds v.
        speed_basis: (nu, m) N, all speeds for a unit of each v.
        swept: (nu, n) S, change of all speeds for a unit of each position at the same v.
    """

    speed_indices: tuple[int, ...] = ()
    speed_basis: Array = field(default_factory=lambda: np.zeros((0, 0)), repr=False)
    swept: Array = field(default_factory=lambda: np.zeros((0, 0)), repr=False)

    @property
    def basis(self) -> Array:
        """Basis (2 nu, n + m): (phi, du) for a unit of each of (x, v)."""
        nothing = np.zeros_like(self.speed_basis)
        return np.block([[self.motion_basis, nothing], [self.swept, self.speed_basis]])

    @property
    def state_indices(self) -> list[int]:
        """Indices of (x, v) in (phi, du)."""
        return [
            *self.independent_indices,
            *(len(self.motion_basis) + k for k in self.speed_indices),
        ]

    def admissible_speeds(self, q: Array, u: Array, rotation: Array) -> Array:
        """Admissible speeds (nu,) at q (nq,) with the independent speeds of u (nu,) in the frames.

        `rotation` (nu, nu) maps from the axes of the bodies at q to the frames.
        """
        freedom, speed_indices = self.model.independent_speeds, list(self.speed_indices)
        assert freedom is not None
        wished = rotation.T @ u
        corrected_speeds = freedom.remove_velocity_errors(q, wished)
        motions = rotation @ freedom.motion_matrix(q, speed_indices)
        missed = (rotation @ (wished - corrected_speeds))[speed_indices]
        return np.asarray(
            corrected_speeds
            + rotation.T @ (motions @ np.linalg.solve(motions[speed_indices], missed))
        )

    def rows(self, state: State, orders: Mapping[int, Array], drives: object) -> dict[int, Array]:
        """Output rows (k, nu), unchanged: along all perturbations, speeds and accelerations."""
        return dict(orders)

    def matrices(self, *_: object) -> NoReturn:
        reject_second_order(self)

    def input_matrix(self, *_: object) -> NoReturn:
        reject_second_order(self)

    def drive_columns(self, *_: object) -> NoReturn:
        raise SceneError(
            "linear model: motions of drives cannot be inputs about a motion with velocity "
            "constraints; give efforts or forces"
        )


def reject_second_order(rolling: RollingMechanism) -> NoReturn:
    """Raise SceneError for M, C, K and quantities derived from them."""
    raise SceneError(
        "linear model: M, C, K, V and W do not exist with velocity constraints, which leave "
        f"{len(rolling.independent_indices)} positions and {len(rolling.speed_indices)} speeds "
        "independent; use A, B and states"
    )


def rolling_at(
    model: CompiledScene,
    state: State,
    changing: Array | None = None,
    dry: DryFriction | None = None,
    own: tuple[tuple[int, ...], tuple[int, ...]] | None = None,
) -> RollingMechanism:
    """Admissible perturbations at a state with nonholonomic rows.

    `own` are the indices of independent positions and speeds, by default a well-conditioned choice
    that prefers speeds at which `changing` (nu,) is zero.  Viscous dampers replace `dry` friction.

    Raises NumericalFailure where the independent speeds do not determine all others: dead centre,
    singular configuration, open loop.
    """
    freedom = model.independent_speeds
    assert freedom is not None
    rows = _Rows(freedom, state.q)
    basis = rows.null_space_basis(rows.position_rows)
    if own is None:
        free = list(model.free_speed_indices)
        size = np.abs(state.u).max(initial=0.0) ** 2
        leaves = np.zeros(model.nu) if changing is None else np.abs(changing) > _ROW_ROUNDING * size
        lasting = sorted(free, key=lambda k: bool(leaves[k]))
        motions = np.linalg.qr(freedom.motion_matrix(state.q, freedom.select(state.q))
                               / freedom.sizes[:, None])[0]  # fmt: skip
        own = (
            tuple(sorted(select_rows(basis, free)[0])),
            tuple(sorted(select_rows(motions, lasting)[0])),
        )
    positions, speeds = own
    motion_basis = basis * freedom.sizes[:, None]
    motion_basis = motion_basis @ np.linalg.inv(motion_basis[list(positions)])
    speed_ways = freedom.motion_matrix(state.q, speeds)
    swept = rows.swept(motion_basis, state.u)
    swept -= speed_ways @ swept[list(speeds)]
    nothing = np.zeros((len(positions), len(positions)))
    rough, tree = torn_trees(model, dry)
    return RollingMechanism(
        model,
        tree,
        model.free_speed_indices,
        positions,
        motion_basis,
        nothing,
        tree_with_friction=rough,
        dry=dry,
        speed_indices=speeds,
        speed_basis=speed_ways,
        swept=swept,
    )


class _Rows:
    """Jacobian J (rows, nu) of the constraint rows at q (nq,), and derivative of J u by q."""

    def __init__(self, freedom: IndependentSpeeds, q: Array) -> None:
        self._freedom, self._q, self._sizes = freedom, q, freedom.sizes
        self._J = np.array(
            [freedom.velocity_errors(q, unit_speeds) for unit_speeds in np.eye(len(self._sizes))]
        ).T
        of_speeds = freedom.speed_rows
        self.position_rows = [k for k in range(len(self._J)) if k not in of_speeds]

    def null_space_basis(self, rows: Sequence[int]) -> Array:
        """Basis (nu, n) of the null space of some rows, orthonormal in characteristic scales."""
        free = self._freedom.free_indices
        scaled = (self._J * self._sizes)[np.ix_(rows, free)]
        _, lengths, across = np.linalg.svd(scaled)
        rank = int((lengths > _ROW_ROUNDING * lengths.max(initial=0.0)).sum())
        basis = np.zeros((len(self._sizes), len(free) - rank))
        basis[free] = across[rank:].T
        return basis

    def swept(self, motions: Array, u: Array) -> Array:
        """Changes of speed (nu, n) that keep J u zero along perturbations `motions` (nu, n)."""
        free = self._freedom.free_indices
        changes = np.reshape(
            [self._directional_derivative(motion, u) for motion in motions.T], (-1, len(self._J))
        ).T
        scaled = (self._J * self._sizes)[:, free]
        result = np.zeros_like(motions)
        result[free] = -np.linalg.lstsq(scaled, changes, rcond=_ROW_ROUNDING)[0]
        return np.asarray(result * self._sizes[:, None])

    def _directional_derivative(self, motion: Array, u: Array) -> Array:
        """Derivative (rows,) of J u along a perturbation (nu,), with the most consistent step."""
        size = float(np.abs(motion / self._sizes).max())
        tried = [self._difference(motion, u, step / size) for step in _STEPS]
        apart = [np.abs(a - b).max(initial=0.0) for a, b in pairwise(tried)]
        return tried[int(np.argmin(apart))]

    def _difference(self, motion: Array, u: Array, step: float) -> Array:
        difference = np.zeros(len(self._J))
        for count, weight in _WEIGHTS.items():
            for sign in (1.0, -1.0):
                q = self._freedom.move(self._q, sign * count * step * motion)
                difference += sign * weight / step * self._freedom.velocity_errors(q, u)
        return difference


# --- eigenvalues of state matrices with zero eigenvalues of ignorable coordinates -----------------

Complex = NDArray[np.complex128]

#: Entries of A that are rounding, relative to the largest of their row; lower bound of that largest
#: entry, relative to the largest of all; real and imaginary parts of eigenvalues that are rounding.
_NOTHING, _LEAST, _PART = 1e-9, 1e-6, 1e-8


def eigenpairs(a: Array) -> tuple[Complex, Complex]:
    """Eigenvalues (k,) of A (n, n) by rising magnitude, and eigenvectors (n, k).

    Of each conjugate pair only the eigenvalue above the real axis is kept.  Ignorable coordinates
    have eigenvalue 0 exactly.
    """
    core, ignorable = coupled_states(a)
    values, own = _deflated_eigenpairs(a[np.ix_(core, core)])
    vectors = np.zeros((len(a), len(values)), dtype=np.complex128)
    vectors[core] = own
    moving = values != 0
    for index in reversed(ignorable):
        vectors[index, moving] = (a[index] @ vectors)[moving] / values[moving]
    values = np.concatenate([np.zeros(len(ignorable)), values])
    vectors = np.hstack([np.eye(len(a))[:, ignorable], vectors])
    kept = np.flatnonzero(values.imag >= 0)
    kept = kept[np.argsort(np.abs(values[kept]), kind="stable")]
    return values[kept], vectors[:, kept]


def _deflated_eigenpairs(a: Array) -> tuple[Complex, Complex]:
    """Eigenvalues and eigenvectors of A (n, n), with the null space deflated stage by stage.

    Deflation is needed since a defective zero eigenvalue is otherwise accurate only to a root of
    the rounding error.
    """
    still, across, lengths = np.eye(0), np.eye(0), np.zeros(0)
    if len(a):
        _, lengths, across = np.linalg.svd(_scale_rows(a))
    count = int((lengths <= _NOTHING * lengths.max(initial=0.0)).sum())
    if not count:
        values, vectors = np.linalg.eig(a) if len(a) else (np.zeros(0), np.zeros((0, 0)))
        return _round_to_zero(values.astype(np.complex128)), vectors.astype(np.complex128)
    rest, still = across[:-count].T, across[-count:].T
    values, inner = _deflated_eigenpairs(rest.T @ a @ rest)
    vectors = rest @ inner
    moving = values != 0
    vectors[:, moving] += still @ (still.T @ a @ vectors[:, moving]) / values[moving]
    return np.concatenate([np.zeros(count), values]), np.hstack([still, vectors])


def _scale_rows(a: Array) -> Array:
    """A with each row scaled by its largest entry, as stiff and slow parts differ in size."""
    largest = np.abs(a).max(axis=1, initial=0.0)
    floor = _LEAST * float(largest.max(initial=0.0)) or 1.0
    return np.asarray(a / np.maximum(largest, floor)[:, None])


def _round_to_zero(values: Complex) -> Complex:
    """Eigenvalues with real or imaginary parts at rounding level set to zero."""
    rounding = _PART * np.abs(values).max(initial=0.0)
    values = np.where(np.abs(values.imag) <= rounding, values.real, values)
    return np.where(np.abs(values.real) <= rounding, 1j * values.imag, values)


def coupled_states(a: Array) -> tuple[list[int], list[int]]:
    """Indices of the coupled states, and of ignorable states in the order of their elimination.

    No remaining state depends on an ignorable one.
    """
    core, ignorable, scaled = list(range(len(a))), list[int](), np.abs(_scale_rows(a))
    while True:
        for index in core:
            if scaled[core, index].max(initial=0.0) <= _NOTHING:
                break
        else:
            return core, ignorable
        core.remove(index)
        ignorable.append(index)
