"""First-order linear models (A, B) with nonholonomic rows: rolling contacts, coupled speeds.

The state z = (x, v) holds the independent positions and speeds of the admissible perturbations
(`nonholonomic_perturbations`).  Rates and accelerations are linear in all perturbations and speeds,
d/dt (phi, du) = F (phi, du), with (phi, du) = L z and z = E (phi, du).  R rotates from the axes of
the bodies to the frames, with dR/dt = R W (`Frames`); in the frames

    A = E (W + R F R^T) L,

with constant entries along a steady motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from mstmm.array_validation import Array
from mstmm.display import abbreviate_names
from mstmm.errors import NumericalFailure, SceneError
from mstmm.risk import RUN, DeferredRisks, Risk

from ..engine.compiled_scene import speed_scales
from ..result.checks.answer_checks import find_state_risks
from ..run.scene_system import SceneSystem
from . import energy_shares
from .frequency_response import FrequencyResponse, angular_frequencies, select_inputs
from .harmonic.damping import check_state_at_rest
from .input_channels import Channel, columns, some_names
from .linear_model import Linear
from .mck_matrices import State, matrices
from .modes import Modes
from .nonholonomic_perturbations import (
    Frames,
    RollingMechanism,
    coupled_states,
    eigenpairs,
    frames_at,
    has_rotating_frame,
    reject_second_order,
    rolling_at,
)
from .operating_point.later_states import SAME, relative_difference
from .operating_point.omitted_effects import IndependentMotions, friction_risks, saturation_risks
from .outputs import Rows, outputs_of, rows_of
from .validity import find_omissions, find_response_risks, ineffective_input_risks

if TYPE_CHECKING:
    from .outputs import LinearQuantity


Complex = NDArray[np.complex128]
#: Exact derivatives (nu, nu) at a state, by the names of `Derivatives`.
Slopes = Callable[[State], Mapping[str, Array]]

#: Accelerations that are rounding: in characteristic scales, 1/s^2; relative to squared speeds.
_STILL, _ROUNDING = 1e-6, 1e-9
#: Travel along the motion to the later state, in rad or characteristic scales; number of steps.
_AHEAD, _STEPS = 0.1, 8
#: Condition number of i omega - A that indicates an undamped resonance.
_SINGULAR = 1e13


@dataclass(frozen=True, eq=False, repr=False)
class NonholonomicLinear(Linear):
    """Linear model about a motion with rolling contacts or other nonholonomic rows.

    d/dt (x, v) = A (x, v) + B inputs + B_disturbances w, with perturbations x (n,) of independent
    positions and v (m,) of independent speeds, m < n.  M, C, K, V and W do not exist and raise
    SceneError.

    Attributes:
        frames: frames of perturbations and speeds of rotating bodies, see `frame_rates`.
        slopes: function that gives derivatives of rates and accelerations at a state.
        rotation: (nu, nu) from the axes of bodies at the state to the frames; None: identity.
    """

    frames: Frames = field(default_factory=lambda: Frames({}, np.zeros((0, 0))))
    slopes: Slopes = field(default=lambda _: {})
    rotation: Array | None = None

    @property
    def _rolling(self) -> RollingMechanism:
        assert isinstance(self.constrained_motion, RollingMechanism)
        return self.constrained_motion

    @property
    def speeds(self) -> tuple[str, ...]:
        """Names of v."""
        return tuple(self.model.coordinate_layout.u_name(k) for k in self._rolling.speed_indices)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of (x, v)."""
        return (*self.coordinate_names, *self.speeds)

    @property
    def position_states(self) -> list[int]:
        """Indices of x in the state."""
        return list(range(len(self)))

    @property
    def velocity_states(self) -> list[int]:
        """Indices of v in the state."""
        return list(range(len(self), len(self.state_names)))

    @property
    def has_stiffness(self) -> bool:
        """False: the model has no K."""
        return False

    @property
    def frame_rates(self) -> dict[str, Array]:
        """Angular velocity (3,), rad/s, of outboard bodies relative to the frames, by hinge.

        In axes of the body; perturbations and speeds of the hinge refer to the frame.  Hinges whose
        frame is the body itself are left out.
        """
        return dict(self.frames.rates)

    @cached_property
    def frame(self) -> str:
        """Frame of the perturbations: "fixed" if no frame rotates in space, else "rotating".

        The frame of a disc that rolls in a circle follows its heading.
        """
        return "rotating" if has_rotating_frame(self.model, self.state, self.frames) else "fixed"

    def to_fixed_frame(self) -> NonholonomicLinear:
        """The model itself if its frame is fixed.

        Raises SceneError where its frames rotate in space.
        """
        if self.frame == "fixed":
            return self
        raise SceneError(
            "to_fixed_frame: with rolling contacts, coefficients are constant only in frames that "
            "follow the motion; use the model as it is"
        )

    # --- matrices ---------------------------------------------------------------------------------

    @cached_property
    def _slopes(self) -> Mapping[str, Array]:
        """Derivatives of rates and accelerations, with dry friction as in the model."""
        slopes, rolling = dict(self.slopes(self.state)), self._rolling
        if self.dry and rolling.tree_with_friction is not None:
            free, left = list(rolling.free), np.zeros((self.model.nu, self.model.nu))
            rough, smooth = (
                matrices(tree, self.state, free).C
                for tree in (rolling.tree_with_friction, rolling.tree)
            )
            left[np.ix_(free, free)] = rough - smooth
            slopes["u"] = slopes["u"] + slopes["efforts"] @ left
        return slopes

    @property
    def frame_rotation(self) -> Array:
        """Rotation R (nu, nu) of perturbations or speeds from body axes to the frames."""
        return np.eye(self.model.nu) if self.rotation is None else self.rotation

    @cached_property
    def _state_rotation(self) -> Array:
        """Rotation (2 nu, 2 nu) of both perturbations and speeds."""
        return np.asarray(block_diag(self.frame_rotation, self.frame_rotation))

    @cached_property
    def _basis(self) -> Array:
        """Basis L (2 nu, n + m) in the frames."""
        basis = self._state_rotation @ self._rolling.basis
        return np.asarray(basis @ np.linalg.inv(basis[self._rolling.state_indices]))

    @cached_property
    def A(self) -> Array:
        """State matrix (n + m, n + m)."""
        slopes, turned, basis = self._slopes, self._state_rotation, self._basis
        both = np.block([[slopes["rate_q"], slopes["rate_u"]], [slopes["q"], slopes["u"]]])
        rates = self.frames.state_generator() @ basis + turned @ both @ (turned.T @ basis)
        return np.asarray(rates[self._rolling.state_indices])

    @cached_property
    def B(self) -> Array:
        """Input matrix (n + m, inputs)."""
        return self._effect(self.input_channels)

    @cached_property
    def B_disturbances(self) -> Array:
        """Input matrix (n + m, disturbances) of w."""
        return self._effect(self.disturbance_channels)

    def _effect(self, pushes: Sequence[Channel]) -> Array:
        """Input matrix (n + m, inputs) of some inputs."""
        if any(given.drive >= 0 for given in pushes):
            self._rolling.drive_columns()
        nu, tree = self.model.nu, self._rolling.tree
        answers = self._slopes["efforts"] @ columns(tree, self.state, pushes, list(range(nu)))
        effect = self._state_rotation @ np.vstack([np.zeros_like(answers), answers])
        return np.asarray(effect[self._rolling.state_indices])

    def _matrices_of(self, *_: object) -> NoReturn:
        reject_second_order(self._rolling)

    def state_output_matrices(self, rows: Rows, b: Array) -> tuple[Array, Array]:
        """Output matrices C (outputs, states) and D (outputs, inputs) of output rows.

        `rows` are along perturbations, speeds and accelerations; `b` (states, inputs) is the input
        matrix.
        """
        increments, speeds = np.split(self._state_rotation.T @ self._basis, 2)
        slopes = self._slopes
        along = (increments, speeds, slopes["q"] @ increments + slopes["u"] @ speeds)
        c, d = np.zeros((len(rows.feedthrough), len(self.state_names))), rows.feedthrough.copy()
        for order, wide in rows.orders.items():
            c += wide @ along[order]
            if order == 2:
                d += wide @ speeds[:, self.velocity_states] @ b[self.velocity_states]
        return c, d

    # --- modes and frequency response -------------------------------------------------------------

    def modes(self, count: int | None = None, damped: bool | None = None) -> NonholonomicModes:
        """Modes of (x, v): all, or the `count` slowest.

        Each ignorable coordinate (position on the road, heading, angle of a wheel) is a mode of
        eigenvalue 0.

        Raises SceneError for an invalid count, and for `damped` false.
        """
        if damped is not None and not damped:
            raise SceneError(
                "damped = False: with rolling contacts A has no undamped part; omit it"
            )
        self.check_count(count, len(self.state_names))
        values, vectors = eigenpairs(self.A)
        n, k = len(self), np.arange(len(values))
        shapes = np.where(vectors[:n].any(axis=0), vectors[:n], self.A[:n] @ vectors)
        largest = shapes[np.abs(shapes).argmax(axis=0), k] if n else np.ones(len(k))
        scale = np.where(largest == 0, 1.0, largest)
        increments, speeds = np.split(self._state_rotation.T @ self._basis @ (vectors / scale), 2)
        moved = np.where(speeds.any(axis=0), speeds, increments)
        modes_found = NonholonomicModes(self, values, shapes / scale, True, moved)
        return modes_found if count is None else modes_found.lowest(int(count))

    def frequency_response(
        self,
        omega: ArrayLike,
        inputs: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
        *,
        structural: Any = 0.0,
        modal: Any = 0.0,
        exact: Any = False,
    ) -> FrequencyResponse:
        """Frequency response of A and B; see `Linear.frequency_response`.

        Includes only the damping of the scene; exact beams are not available.

        Raises SceneError for exact beams, for structural or modal damping about a moving state, and
        where coefficients, inputs or outputs change along the motion.
        """
        check_state_at_rest(self, structural, modal)
        if exact is not False:
            raise SceneError("exact: not supported with rolling contacts; leave it out")
        frequencies, pushes = angular_frequencies(omega), select_inputs(self, inputs)
        shown = outputs_of(self, None if outputs is None else some_names("outputs", outputs))
        self._check_steady(pushes, shown)
        b = self._effect(pushes)
        c, d = self.state_output_matrices(rows_of(self, shown, pushes), b)
        values = np.array([c @ self._solve(frequency, b) + d for frequency in frequencies])
        return FrequencyResponse(
            frequencies,
            tuple(channel.name for channel in pushes), tuple(entry.name for entry in shown),
            tuple(channel.unit for channel in pushes), tuple(entry.unit for entry in shown), values,
            DeferredRisks(lambda: find_response_risks(self, pushes, outputs is not None)),
        )  # fmt: skip

    def _solve(self, omega: float, b: Array) -> Complex:
        shifted = 1j * omega * np.eye(len(self.state_names)) - self.A
        if not np.linalg.cond(shifted) < _SINGULAR:
            raise NumericalFailure(
                f"frequency response: omega = {omega:.9g} rad/s is an undamped resonance; "
                "add damping, or leave this frequency out"
            )
        return np.asarray(np.linalg.solve(shifted, b), dtype=np.complex128)

    # --- validity ---------------------------------------------------------------------------------

    @cached_property
    def findings(self) -> tuple[Risk, ...]:  # type: ignore[override]
        """Risks of the operating point and of effects that a linear model omits."""
        return tuple(self._find_risks())

    def _find_risks(self) -> Iterator[Risk]:
        state = self.state
        yield from find_state_risks(self.model, state.t, state.q, state.u)
        leaving = self._accelerating_speeds()
        if leaving:
            yield Risk(
                "unsteady-state",
                abbreviate_names(leaving),
                f"the state is not steady: {abbreviate_names(leaving)} accelerate, so that the "
                "model describes deviations from the motion through it, for a short time only",
                "linearise at an equilibrium or a steady motion",
            )
        elif self._has_changing_matrix():
            yield Risk(
                "changing-coefficients", RUN,
                "the matrices change along the motion of this state: frequencies and growth "
                "rates at one time are not those of the motion",
                "simulate the motion, or linearise about a state that keeps its matrices",
            )  # fmt: skip
        yield from friction_risks(self)
        yield from saturation_risks(self, self._independent_motions)
        yield from ineffective_input_risks(self, self.B)
        yield from find_omissions(self)
        yield from self.modes().motion_risks()

    @property
    def _independent_motions(self) -> IndependentMotions:
        """Motions along the independent speeds."""
        layout, rolling, speed_indices = (
            self.model.coordinate_layout,
            self._rolling,
            list(self._rolling.speed_indices),
        )
        hinges = [layout.hinge_of_speed(k) for k in speed_indices]
        units = [
            h.u_units[k - h.u].removesuffix("/s")
            for h, k in zip(hinges, speed_indices, strict=True)
        ]
        along = rolling.speed_basis
        return IndependentMotions(
            self.speeds, units, speed_scales(self.model)[speed_indices], lambda x: along @ x,
            lambda efforts: along.T @ efforts,
        )  # fmt: skip

    def _accelerating_speeds(self) -> list[str]:
        """Names of independent speeds that change in the frames, at this or the later state."""
        names, sizes = list[str](), speed_scales(self.model)
        for model in (self, self._later):
            state, speed_indices = model.state, [*self._rolling.speed_indices]
            left = (model.frame_rotation @ (state.udot + self.frames.generator @ state.u))[
                speed_indices
            ]
            bound = _STILL + _ROUNDING * float(np.square(state.u / sizes).max(initial=0.0))
            leaving = np.flatnonzero(np.abs(left) > bound * sizes[speed_indices])
            names += [self.model.coordinate_layout.u_name(speed_indices[k]) for k in leaving]
        return list(dict.fromkeys(names))

    def _has_changing_matrix(self) -> bool:
        """Whether A differs at the later state, except for ignorable coordinates."""
        later = self._later.A
        kept = np.ix_(*2 * (sorted({*coupled_states(self.A)[0], *coupled_states(later)[0]}),))
        return relative_difference(self.A[kept], later[kept]) > SAME

    @cached_property
    def _later(self) -> NonholonomicLinear:
        """Linear model at the later state of the motion, in the same frames."""
        model, own = self.model, self._rolling
        state, rotation = _later_state(self)
        rolling = rolling_at(
            model, state, None, self.dry, (own.independent_indices, own.speed_indices)
        )
        return replace(self, state=state, constrained_motion=rolling, rotation=rotation)

    def _check_steady(self, pushes: Sequence[Channel], shown: Sequence[LinearQuantity]) -> None:
        """Raise SceneError where matrices, inputs or outputs change along the motion."""
        changing, there = [*self._accelerating_speeds()], self._later
        changing += ["the matrices"] if self._has_changing_matrix() else []
        now, then = (model._effect(pushes) for model in (self, there))
        changing += [
            x.name
            for k, x in enumerate(pushes)
            if relative_difference(now[:, k], then[:, k]) > SAME
        ]
        later_quantities = outputs_of(there, [quantity.name for quantity in shown])
        read, later = (
            model.state_output_matrices(rows_of(model, some, pushes), b)[0]
            for model, some, b in ((self, shown, now), (there, later_quantities, then))
        )
        changing += [
            x.name for k, x in enumerate(shown) if relative_difference(read[k], later[k]) > SAME
        ]
        if changing:
            raise SceneError(
                f"frequency response: not constant along the motion: {abbreviate_names(changing)}, "
                "so that the response contains other frequencies; use inputs and outputs with "
                "constant axes, or simulate"
            )


@dataclass(frozen=True, eq=False, repr=False)
class NonholonomicModes(Modes):
    """Modes about a motion with nonholonomic rows; `moved` (nu, k) are all speeds of each."""

    moved: Complex = field(default_factory=lambda: np.zeros((0, 0), dtype=np.complex128))

    @cached_property
    def frame(self) -> str:
        """Frame of the frequencies, see `NonholonomicLinear.frame`."""
        linear = self.linear
        assert isinstance(linear, NonholonomicLinear)
        return linear.frame

    def lowest(self, count: int) -> NonholonomicModes:
        """The first `count` modes."""
        return replace(
            self, eigenvalues=self.eigenvalues[:count], shapes=self.shapes[:, :count],
            moved=self.moved[:, :count],
        )  # fmt: skip

    def kinetic_energy_shares(self) -> dict[str, Array]:
        """Share (k,) of each body in the kinetic energy of the modes, by body."""
        return energy_shares.kinetic_shares(self.linear.model, self.linear.state.q, self.moved)


def nonholonomic_at(bare: Linear, slopes: Slopes) -> NonholonomicLinear:
    """Nonholonomic linear model about the motion through the state of `bare`.

    Raises NumericalFailure as `rolling_at`.
    """
    model, state, dry = bare.model, bare.state, bare.dry
    frames = frames_at(model, state)
    changing = state.udot + frames.generator @ state.u
    return NonholonomicLinear(
        model, state, bare.input_channels, bare.disturbance_channels,
        constrained_motion=rolling_at(model, state, changing, dry), dry=dry, frames=frames,
        slopes=slopes,
    )  # fmt: skip


def _later_state(linear: NonholonomicLinear) -> tuple[State, Array]:
    """Later state of the motion, at the same independent speeds in the frames.

    Also returns the rotation (nu, nu) from the body axes at that state to the frames.
    """
    model, state, frames = linear.model, linear.state, linear.frames
    engine, memory, rolling = model.looped, model.looped.start_memory(), linear._rolling
    dt = _AHEAD / float(np.abs(state.u / speed_scales(model)).max())
    h, q = dt / _STEPS, state.q

    def speeds(time: float, at: Array) -> Array:
        return rolling.admissible_speeds(at, state.u, frames.rotation(time))

    def rates(time: float, at: Array) -> Array:
        return np.asarray(engine.rates(state.t + time, at, speeds(time, at), memory))

    for k in range(_STEPS):  # classical fourth-order Runge-Kutta method
        change_of_q = rates(k * h, q)
        two = rates((k + 0.5) * h, q + h / 2 * change_of_q)
        three = rates((k + 0.5) * h, q + h / 2 * two)
        four = rates((k + 1) * h, q + h * three)
        q = q + h / 6 * (change_of_q + 2 * two + 2 * three + four)
    whole = SceneSystem(engine).start(state.t + dt, q, speeds(dt, q))
    q, u = whole[: model.nq], whole[model.nq : model.nq + model.nu]
    return State.moving(engine, state.t + dt, q, u), frames.rotation(dt)
