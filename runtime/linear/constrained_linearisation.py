"""Linearisation of scenes with closed loops: spanning tree projected on independent motions.

The spanning tree has the residual R(q, u, a), its required efforts; with the constraint loads,
R + J^T lambda = 0.  Independent perturbations x give dq = N x, and N^T J^T = 0 wherever the loops
are closed.  The equations are N^T R = 0, linearised at rest

    M = N^T R_a N,   C = N^T R_u N,   K = N^T (R_q + d(J^T lambda)/dq) N

with constant lambda.  The geometric stiffness of the constraint loads is K of the closed scene,
whose tangent contains these loads, less K of the tree.  About a moving or accelerating state C and
K follow from the derivatives of its accelerations (`Motion`).

A displacement d of a drive moves the other coordinates too: dq = N x + n d with zero entries of n
at the independent coordinates.  The columns of the drive are the same derivatives along n.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ..engine.compiled_scene import CompiledScene
from ..engine.looped_engine import LoopedEngine
from ..packing.scene_packing import packed_system
from ..packing.system_variants import with_loops_open
from .input_channels import (
    Channel,
    Columns,
    DriveFactors,
    columns,
    coordinate,
    residual_derivatives,
)
from .mck_matrices import Matrices, State, matrices
from .operating_point.friction import DryFriction

#: Exact derivatives (nu, nu) of the accelerations at a state, by the names of `Derivatives`.
Slopes = Callable[[State], Mapping[str, Array]]


# --- moving or accelerating states ----------------------------------------------------------------
#
# Loops restrict all speeds to u = N(q) v with independent speeds v.  Perturbations of a state are
# dq = N x with x' = G_x x + dv, and
#
#     du = N dv + S x,    S x = (dN along N x) v,    da = N dv' + B dv + T x.
#
# Accelerations a(q, u) that keep the loops closed are N v' + b with b quadratic in the speeds.
# Hence B, the derivative a_u N less N times its independent rows, is twice a symmetric bilinear
# form of two speeds.  S is this form except for the order of its arguments: perturbations do not
# commute where coordinates are not integrals of the speeds (dphi' = G dphi + du), so that
#
#     S = (B - G N + N G_x) / 2.
#
# No finite differences are involved.  Nonholonomic rows (rolling discs) restrict speeds that are
# not rates of coordinates and lack this symmetry; see `nonholonomic_model`.


@dataclass(frozen=True, eq=False)
class Motion:
    """Derivatives with respect to n independent perturbations x and their speeds v.

    Attributes:
        swept: (nu, n) S, change of all speeds for a unit of each x at the same v.
        speed_derivatives, position_derivatives: (n, n) derivatives of the independent accelerations
            by v and by x.
        dependent_speed_part, dependent_position_part: (nu, n) B and T, dependent parts of the
            derivatives of all accelerations.
        rate_matrix: (n, n) G_x, 1/s; None where x are integrals of v.
    """

    swept: Array
    speed_derivatives: Array
    position_derivatives: Array
    dependent_speed_part: Array
    dependent_position_part: Array
    rate_matrix: Array | None

    @classmethod
    def from_derivatives(
        cls, slopes: Mapping[str, Array], speed_indices: Sequence[int], motion_basis: Array
    ) -> Motion:
        """Build from derivatives (nu, nu) of accelerations that keep the loops closed.

        `slopes` has the names of `Derivatives`, `speed_indices` are those of the n independent
        speeds, `motion_basis` is N (nu, n).
        """
        own, by_speed, turned = (
            list(speed_indices),
            slopes["u"] @ motion_basis,
            slopes["rate_q"] @ motion_basis,
        )
        bent = by_speed - motion_basis @ by_speed[own]
        swept = (bent - turned + motion_basis @ turned[own]) / 2
        by_place = slopes["q"] @ motion_basis + slopes["u"] @ swept
        turning = turned[own] if turned.any() else None
        shifted = by_place - motion_basis @ by_place[own]
        return cls(swept, by_speed[own], by_place[own], bent, shifted, turning)

    def matrices(self, mass: Array) -> Matrices:
        """M, C, K of M dv' + C dv + K x = 0 from the mass matrix M (n, n) along x."""
        return Matrices(mass, -mass @ self.speed_derivatives, -mass @ self.position_derivatives)

    def lower_order_terms(self, order: int) -> Iterator[tuple[int, Array]]:
        """Lower-order terms (order, (nu, n)) of all speeds (1) or accelerations (2)."""
        if order == 1:
            yield 0, self.swept
        if order == 2:
            yield 1, self.dependent_speed_part
            yield 0, self.dependent_position_part


# --- mechanisms -----------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class ConstrainedLinearisation:
    """Independent perturbations of a closed-loop scene at one operating point.

    Attributes:
        model: the model of the scene.
        tree: spanning tree of the scene, with dry friction as in the linear model.
        free: indices of the speeds of the tree without prescribed motion.
        independent_indices: indices of the n independent speeds, those of x.
        motion_basis: (nu, n) N, all speeds for a unit of each independent speed.
        constraint_stiffness: (n, n) geometric stiffness of the constraint loads at rest.
        motion: derivatives about a moving or accelerating state, from `slopes`; else None.
        slopes: derivatives of the accelerations at a state; None at rest.
        tree_with_friction: spanning tree with all its dry friction, the basis of `slopes`.
        dry: dry friction that viscous dampers replace in `tree`.
    """

    model: CompiledScene = field(repr=False)
    tree: LoopedEngine
    free: tuple[int, ...]
    independent_indices: tuple[int, ...]
    motion_basis: Array
    constraint_stiffness: Array = field(repr=False)
    motion: Motion | None = field(default=None, repr=False)
    slopes: Slopes | None = field(default=None, repr=False)
    tree_with_friction: LoopedEngine | None = field(default=None, repr=False)
    dry: DryFriction | None = field(default=None, repr=False)

    @property
    def rate_matrix(self) -> Array | None:
        """Matrix G (n, n), 1/s, of x' = G x + dv; None where x are integrals of the speeds v."""
        return None if self.motion is None else self.motion.rate_matrix

    def at_state(self, state: State) -> ConstrainedLinearisation | None:
        """The same linearisation at another state."""
        if self.slopes is None:
            return mechanism_at(self.model, state, self.dry)
        return mechanism_in_motion(
            self.model, state, self.slopes, self.independent_indices, self.dry
        )

    def matrices(self, engine: LoopedEngine, state: State) -> Matrices:
        """Matrices M, C, K along x for the tree, or for an engine of it with other elements."""
        projected = self._project(engine, state)
        if self.motion is None:
            return Matrices(projected.M, projected.C, projected.K + self.constraint_stiffness)
        whole = self.motion.matrices(projected.M)
        rough = self.tree_with_friction or self.tree
        if engine is rough:
            return whole
        tree = self._project(rough, state)  # the constraint loads are the same for both
        return Matrices(projected.M, whole.C + projected.C - tree.C, whole.K + projected.K - tree.K)

    def _project(self, engine: LoopedEngine, state: State) -> Matrices:
        swept = None if self.motion is None else self.motion.swept
        return _projected_matrices(
            engine, state, self.free, self.motion_basis, self.motion_basis, swept
        )

    def input_matrix(self, state: State, channels: Sequence[Channel]) -> Array:
        """Efforts (n, channels) along x for a unit of each input; for drives, of acceleration."""
        every, columns_found = (
            list(range(len(self.motion_basis))),
            np.zeros((len(self.independent_indices), len(channels))),
        )
        still = [k for k, given in enumerate(channels) if given.drive < 0]
        pushes = [channels[k] for k in still]
        columns_found[:, still] = self.motion_basis.T @ columns(self.tree, state, pushes, every)
        for k, given in enumerate(channels):
            if given.drive >= 0:
                columns_found[:, k] = -self.drive_columns(state, given.drive_factors).inertia
        return columns_found

    def drive_columns(self, state: State, moves: DriveFactors) -> Columns:
        """Columns (n,) along x of stiffness, damping and inertia for drives moved by one input."""
        along = np.sum(
            [factor * self._drive_motion(state, speed) for speed, factor in moves], axis=0
        )
        closed, tree = self.model.looped, self.tree
        rows = _zero_cut_hinge_rows(self.model, self.motion_basis)
        return Columns(
            rows.T @ residual_derivatives(closed, state, along).stiffness,
            self.motion_basis.T @ residual_derivatives(tree, state, along).damping,
            self.motion_basis.T @ residual_derivatives(tree, state, along).inertia,
        )

    def _drive_motion(self, state: State, speed: int) -> Array:
        """Vector n (nu,): all speeds for a unit of one prescribed speed.

        Raises SceneError where the loops lock the drive, and about a state that is not at rest.
        """
        if self.motion is not None:
            raise SceneError(
                f'"{coordinate(self.model, speed)}": drive motions in closed loops can be inputs '
                "at an equilibrium only, and this state is not one; leave them out"
            )
        freedom = self.model.independent_speeds
        assert freedom is not None
        along = freedom.prescribed_motion(state.q, speed)
        if not np.isfinite(along).all():
            raise SceneError(
                f'"{coordinate(self.model, speed)}": the loops lock this drive at this state; use '
                "a nearby state, or another input"
            )
        return np.asarray(along - self.motion_basis @ along[list(self.independent_indices)])

    def rows(
        self, state: State, orders: Mapping[int, Array], drives: Collection[int]
    ) -> dict[int, Array]:
        """Output rows (k, nu) along x and drives from rows along all speeds, by power of s.

        The entries of x and of drives are at the indices of their speeds.
        """
        rows_by_order, speed_indices = dict[int, Array](), list(self.independent_indices)
        for order, wide in orders.items():
            rows = rows_by_order.setdefault(order, np.zeros_like(wide))
            rows[:, speed_indices] += wide @ self.motion_basis
            for speed in drives:
                rows[:, speed] += wide @ self._drive_motion(state, speed)
            for lower, along in () if self.motion is None else self.motion.lower_order_terms(order):
                rows_by_order.setdefault(lower, np.zeros_like(wide))[:, speed_indices] += (
                    wide @ along
                )
        return rows_by_order


def mechanism_at(
    model: CompiledScene, state: State, dry: DryFriction | None = None
) -> ConstrainedLinearisation | None:
    """Linearisation of the closed loops at a state at rest; None for a tree.

    Viscous dampers replace `dry` friction.

    Raises NumericalFailure where the independent speeds do not determine all others: dead centre,
    singular configuration, open loop.
    """
    if model.independent_speeds is None:
        return None
    mechanism = _mechanism(model, state, model.independent_speeds.select(state.q), dry)
    tree, free, motion_basis = mechanism.tree, mechanism.free, mechanism.motion_basis
    carried = _projected_matrices(
        model.looped, state, free, motion_basis, _zero_cut_hinge_rows(model, motion_basis)
    ).K
    return replace(
        mechanism,
        constraint_stiffness=carried
        - _projected_matrices(tree, state, free, motion_basis, motion_basis).K,
    )


def mechanism_in_motion(
    model: CompiledScene, state: State, slopes: Slopes,
    speed_indices: tuple[int, ...] | None = None,
    dry: DryFriction | None = None,
) -> ConstrainedLinearisation | None:  # fmt: skip
    """Linearisation of the closed loops at a moving or accelerating state; None for a tree.

    The independent speeds have the indices `speed_indices`, by default a well-conditioned choice.
    Viscous dampers replace `dry` friction.

    Raises SceneError for scenes whose accelerations have no derivatives, NumericalFailure as
    `mechanism_at`.
    """
    if model.independent_speeds is None:
        return None
    mechanism = _mechanism(
        model, state, speed_indices or model.independent_speeds.select(state.q), dry
    )
    return replace(
        mechanism,
        motion=Motion.from_derivatives(
            slopes(state), mechanism.independent_indices, mechanism.motion_basis
        ),
        slopes=slopes,
    )


def _mechanism(
    model: CompiledScene, state: State, speed_indices: tuple[int, ...], dry: DryFriction | None
) -> ConstrainedLinearisation:
    """Linearisation without the effects of constraint loads and of motion."""
    freedom = model.independent_speeds
    assert freedom is not None
    motion_basis, n = freedom.motion_matrix(state.q, speed_indices), len(speed_indices)
    rough, tree = torn_trees(model, dry)
    return ConstrainedLinearisation(
        model,
        tree,
        model.free_speed_indices,
        speed_indices,
        motion_basis,
        np.zeros((n, n)),
        tree_with_friction=rough,
        dry=dry,
    )


def torn_trees(model: CompiledScene, dry: DryFriction | None) -> tuple[LoopedEngine, LoopedEngine]:
    """Spanning tree of the scene, and the same with viscous dampers for `dry` friction."""
    packed, system = model.packed_scene, with_loops_open(model.packed_scene.system)
    tree = LoopedEngine(packed_system(system, packed))
    if not dry:
        return tree, tree
    return tree, LoopedEngine(
        packed_system(replace(system, laws=dry.replace_friction(system.laws)), packed)
    )


def _projected_matrices(
    engine: LoopedEngine, state: State, free: tuple[int, ...], motion_basis: Array, rows: Array,
    swept: Array | None = None,
) -> Matrices:  # fmt: skip
    """Projected matrices rows^T (M, C, K) ways; K includes the change `swept` of speeds with x."""
    tree_matrices, n, left = (
        matrices(engine, state, list(free)),
        motion_basis[list(free)],
        rows[list(free)],
    )
    mass, damping, stiffness = (
        left.T @ matrix @ n for matrix in (tree_matrices.M, tree_matrices.C, tree_matrices.K)
    )
    if swept is not None:
        stiffness = stiffness + left.T @ tree_matrices.C @ swept[list(free)]
    return Matrices(mass, damping, stiffness)


def _zero_cut_hinge_rows(model: CompiledScene, motion_basis: Array) -> Array:
    """`motion_basis` (nu, n) with zero rows for cut hinges, whose loads act on their bodies."""
    system, rows = model.packed_scene.system, motion_basis.copy()
    for closure in system.closures:
        first = int(system.first_indices["u"][closure.frame])
        rows[first : first + system.body(closure.frame).nu] = 0.0
    return rows
