"""Linear equations of motion about a state: matrices with their parts, inputs and names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.argument_validation import require_texts
from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.risk import AssessedResult

from ..packing.coordinate_layout import check_dense_size
from ..run.scene_system import SceneSystem
from .constrained_linearisation import ConstrainedLinearisation
from .frozen_loads import with_frozen_loads, with_frozen_springs, without_laws
from .input_channels import Channel, Columns, DriveFactors, columns, coordinate, drive_columns
from .mck_matrices import FrameTransform, Matrices, Pencil, State, matrices
from .operating_point.friction import DryFriction

if TYPE_CHECKING:
    from ..engine.compiled_derivatives import CompiledState
    from ..engine.compiled_scene import CompiledScene
    from ..engine.looped_engine import LoopedEngine
    from .mck_matrices import SymbolicLinearModel


@dataclass(frozen=True, eq=False)
class LinearEquations(AssessedResult):
    """M x'' + C x' + K x = V v + W w for perturbations x about a state of a scene, SI units.

    x (n,) are tangent increments of the coordinates without prescribed motion: dq = N(q) x where
    qdot = N(q) u.  For most hinges and for modal coordinates they are increments of the coordinates
    themselves, for ball hinges rotation vectors in outboard axes.  Rows are in N or N*m; v and w
    are efforts, forces and moments in addition to those of the state, accelerations of the ground,
    and accelerations d'' of drives.  With drives,
    M x'' + C x' + K x + C_driven d' + K_driven d = V v + W w.

    Attributes:
        model: the compiled scene.
        state: operating point: t (s), q (nq,), u (nu,) and accelerations a (nu,).
        input_channels, disturbance_channels: channels of v and w.
        rate_matrix: (n, n) G of x' = G x + du, for coordinates that are not integrals of speeds;
            None where x' = du.
        compiled_state: linearisation by code compiled for the scene; None without such code.
        constrained_motion: reduction of closed loops to independent speeds, to which x belong
            then; None for a tree.
        dry: friction of hinges that do not slide at the state, left out or replaced by viscous
            damping; None where the laws keep all friction.
        frame_transform: transformation of the increments of a spinning rotor to the fixed frame;
            None where x are increments of the coordinates themselves.
        equations_at_speeds: function that returns the equations at q with given speeds (nu,), if
            the operating point was sought at rest because no state was given; else None.
    """

    model: CompiledScene
    state: State
    input_channels: tuple[Channel, ...] = ()
    disturbance_channels: tuple[Channel, ...] = ()
    rate_matrix: Array | None = field(default=None, repr=False)
    compiled_state: CompiledState | None = field(default=None, repr=False)
    constrained_motion: ConstrainedLinearisation | None = field(default=None, repr=False)
    dry: DryFriction | None = field(default=None, repr=False)
    frame_transform: FrameTransform | None = field(default=None, repr=False)
    equations_at_speeds: Callable[[Array], LinearEquations] | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        return (
            f"<{type(self).__name__}: {len(self)} coordinates, {len(self.input_channels)} inputs, "
            f"{len(self.disturbance_channels)} disturbances, at t = {self.state.t:g} s>"
        )

    def __len__(self) -> int:
        return len(self.free_speed_indices)

    @property
    def free_speed_indices(self) -> tuple[int, ...]:
        """Indices of the speeds that x belongs to."""
        return (
            self.model.free_speed_indices
            if self.constrained_motion is None
            else self.constrained_motion.independent_indices
        )

    @property
    def open_tree(self) -> LoopedEngine:
        """Engine of the spanning tree, with dry friction as in the linear model."""
        if self.constrained_motion is not None:
            return self.constrained_motion.tree
        return self._smooth if self.dry else self.model.looped

    @cached_property
    def _smooth(self) -> LoopedEngine:
        assert self.dry is not None
        return self.dry.engine(self.model)

    @cached_property
    def _names_and_units(self) -> list[tuple[str, str]]:
        """Names and units of x."""
        known = dict(zip(self.model.free_speed_indices, self.model.tangent_increments, strict=True))
        return [known[index] for index in self.free_speed_indices]

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names of x."""
        return tuple(name for name, _ in self._names_and_units)

    @property
    def coordinate_units(self) -> tuple[str, ...]:
        """Units of x."""
        return tuple(unit for _, unit in self._names_and_units)

    # --- matrices ---------------------------------------------------------------------------------

    @cached_property
    def _full_matrices(self) -> Matrices:
        about = self.compiled_state
        if about is not None:
            return self._second_order(Matrices(about.M, about.C, about.K))
        check_dense_size(len(self), "the matrix of a linear model")
        return self._second_order(self._matrices_of(self.open_tree))

    @cached_property
    def _frozen_spring_matrices(self) -> Matrices:
        return self._second_order(
            self._matrices_of(with_frozen_springs(self.open_tree, self.state))
        )

    @cached_property
    def _frozen_load_matrices(self) -> Matrices:
        return self._second_order(self._matrices_of(with_frozen_loads(self.open_tree, self.state)))

    def _matrices_of(self, engine: LoopedEngine) -> Matrices:
        """Matrices along x of the spanning tree, or of a variant with other elements."""
        if self.constrained_motion is not None:
            return self.constrained_motion.matrices(engine, self.state)
        return matrices(engine, self.state, list(self.free_speed_indices))

    def _second_order(self, given: Matrices) -> Matrices:
        """Transform from speeds to x' and to the fixed frame.

        From x' = G x + du: C du = C x' - C G x and M da = M x'' - M G x'.
        """
        g = self.rate_matrix
        if g is not None:
            given = Matrices(given.M, given.C - given.M @ g, given.K - given.C @ g)
        return given if self.frame_transform is None else self.frame_transform.matrices(given)

    @property
    def has_stiffness(self) -> bool:
        """Whether the model has a stiffness matrix K."""
        return True

    @property
    def M(self) -> Array:
        """Mass matrix (n, n)."""
        return self._full_matrices.M

    @property
    def C(self) -> Array:
        """Matrix (n, n) of x': `damping` + `C_gyroscopic`."""
        return self._full_matrices.C

    @property
    def K(self) -> Array:
        """Stiffness matrix (n, n): `K_elastic` + `K_geometric` + `K_load`."""
        return self._full_matrices.K

    @cached_property
    def C_damping(self) -> Array:
        """Damping part (n, n) of C: from laws, flexible bodies and loads."""
        return self.C - self._frozen_load_matrices.C + self._modal_matrix(lambda body: body.D)

    @property
    def C_gyroscopic(self) -> Array:
        """Gyroscopic part (n, n) of C: inertia forces of the motion at the state; zero at rest."""
        return self.C - self.C_damping

    @cached_property
    def K_elastic(self) -> Array:
        """Elastic part (n, n) of K: from hinge laws, springs and flexible bodies."""
        return self.K - self._frozen_spring_matrices.K + self._modal_matrix(lambda body: body.K)

    @cached_property
    def K_springs(self) -> Array:
        """Part (n, n) of `K_elastic` from springs between ends."""
        lawless = self._second_order(self._matrices_of(without_laws(self.open_tree)))
        return lawless.K - self._frozen_spring_matrices.K

    @property
    def K_load(self) -> Array:
        """Load stiffness (n, n) in K: from loads in body axes and loads by expressions."""
        return self._frozen_spring_matrices.K - self._frozen_load_matrices.K

    @property
    def K_geometric(self) -> Array:
        """Geometric stiffness (n, n) in K.

        It stems from gravity, inertia forces and constant loads and tensions on the displaced
        scene.
        """
        return self._frozen_load_matrices.K - self._modal_matrix(lambda body: body.K)

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of v."""
        return tuple(given.name for given in self.input_channels)

    @property
    def disturbance_names(self) -> tuple[str, ...]:
        """Names of w."""
        return tuple(given.name for given in self.disturbance_channels)

    @property
    def drive_indices(self) -> tuple[int, ...]:
        """Speed indices of the drives whose motions are inputs or disturbances."""
        moved = [
            entry.drive_factors
            for entry in (*self.input_channels, *self.disturbance_channels)
            if entry.drive_factors
        ]
        return (
            tuple(dict.fromkeys(speed for factors in moved for speed, _ in factors))
            if moved
            else ()
        )

    @property
    def prescribed_coordinates(self) -> tuple[str, ...]:
        """Names of d, the increments of the coordinates of these drives."""
        return tuple(coordinate(self.model, speed) for speed in self.drive_indices)

    @cached_property
    def _drive_matrices(self) -> tuple[Array, Array]:
        """Matrices K_driven and C_driven, each (n, drives)."""
        if self.drive_indices and self.frame_transform is not None:
            raise SceneError(
                "fixed frame: motions of drives cannot be inputs; leave them out, or use efforts "
                "and forces"
            )
        drive_columns = [self.drive_columns(((speed, 1.0),)) for speed in self.drive_indices]
        both = [(drive_column.stiffness, drive_column.damping) for drive_column in drive_columns]
        wide = np.reshape(both, (len(drive_columns), 2, len(self)))
        return wide[:, 0].T, wide[:, 1].T

    def drive_columns(self, moves: DriveFactors) -> Columns:
        """Columns (n,) of drives that follow one common motion."""
        if self.constrained_motion is not None:
            return self.constrained_motion.drive_columns(self.state, moves)
        wide = drive_columns(self.model.looped, self.state, moves)
        return Columns(*(column[list(self.free_speed_indices)] for column in wide))

    @property
    def C_prescribed(self) -> Array:
        """Matrix (n, drives) of d' on the left-hand side."""
        return self._drive_matrices[1]

    @property
    def K_prescribed(self) -> Array:
        """Matrix (n, drives) of d on the left-hand side."""
        return self._drive_matrices[0]

    @cached_property
    def V(self) -> Array:
        """Efforts (n, inputs) per unit of each input."""
        return self.input_matrix(self.input_channels)

    @cached_property
    def W(self) -> Array:
        """Efforts (n, disturbances) per unit of each disturbance."""
        return self.input_matrix(self.disturbance_channels)

    def input_matrix(self, channels: Sequence[Channel]) -> Array:
        """Efforts (n, channels) per unit of each channel."""
        if self.constrained_motion is None:
            input_columns = columns(
                self.open_tree, self.state, channels, list(self.free_speed_indices)
            )
        else:
            input_columns = self.constrained_motion.input_matrix(self.state, channels)
        return (
            input_columns
            if self.frame_transform is None
            else self.frame_transform.input_matrix(input_columns)
        )

    def _modal_matrix(self, matrix: Callable[..., Array]) -> Array:
        """Matrix (n, n) assembled from a matrix of each flexible body."""
        modal_matrix = np.zeros((self.model.nu, self.model.nu))
        for name, slots in self.model.coordinate_layout.modal.items():
            modal_matrix[slots.u_slice, slots.u_slice] = matrix(self.model.flexible_bodies[name])
        if self.constrained_motion is not None:
            return (
                self.constrained_motion.motion_basis.T
                @ modal_matrix
                @ self.constrained_motion.motion_basis
            )
        return modal_matrix[np.ix_(self.free_speed_indices, self.free_speed_indices)]

    def symbolic(self, keep: Sequence[str]) -> SymbolicLinearModel:
        """M, C, K, V and W as SymPy expressions in the names `keep`.

        `keep` are parameters of the scene as in `with_parameters` ("rod1.mass", "gravity[1]"), and
        coordinates and speeds of hinges ("shoulder.angle").

        The numeric schedule is evaluated on symbols.  All other values are inserted as numbers,
        short decimals as fractions.  This includes the state and its accelerations: an equilibrium
        does not follow the kept parameters, and a piecewise law keeps its branch at the state.

        Raises SceneError for unknown names, for parameters of flexible bodies, and for scenes and
        expressions that are too large.
        """
        if self.frame_transform is not None:
            raise SceneError(
                "symbolic: linear models in the fixed frame are numerical; use M, C and K"
            )
        if self.constrained_motion is not None:
            raise SceneError(
                "symbolic: linear models of closed loops are numerical; open the loop, or use M, "
                "C and K"
            )
        names = keep if isinstance(keep, str) else require_texts("keep", keep, "rod1.mass")
        symbolic_model: SymbolicLinearModel = self.model.fusion.symbolic(self, names)
        return symbolic_model

    @cached_property
    def operators(self) -> Pencil:
        """M, C and K as O(bodies) operators without matrices, for trees at rest."""
        return Pencil(self.open_tree, self.state, list(self.free_speed_indices))

    def expand(self, x: NDArray[Any]) -> NDArray[Any]:
        """Increments (nu, ...) along all speeds for x (n, ...)."""
        if self.frame_transform is not None:
            x = np.linalg.solve(self.frame_transform.rotation, x)
        if self.constrained_motion is not None:
            return np.asarray(self.constrained_motion.motion_basis @ x)
        expanded = np.zeros((self.model.nu, *x.shape[1:]), dtype=x.dtype)
        expanded[list(self.free_speed_indices)] = x
        return expanded

    def displaced_state(self, x: Array) -> Array:
        """Coordinates q (nq,) of the state displaced by increments x (n,)."""
        model, speeds = self.model, self.expand(x)
        engine, state = model.looped, self.state
        moved = state.q + engine.rates(state.t, state.q, speeds, engine.start_memory())
        return SceneSystem(engine).start(state.t, moved, state.u)[: model.nq]
