"""Exact derivatives of the accelerations, without finite differences.

With code for the linear equations of a scene about a state, all are computed at once from
M da + C du + K dphi + r_t dt = d efforts.  Else by forward mode (`mstmm.ir.differentiation`) of the
fused kernel: one call of a tangent kernel gives the derivative along one direction.

Coordinates are varied by tangent increments dphi, one for each speed: dq = N(q) dphi, where
qdot = N(q) u.  For coordinates whose rate is their speed that is the coordinate itself; for the
quaternion of a ball or free hinge it is the rotation vector in outboard axes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mstmm.argument_validation import abbreviate
from mstmm.array_validation import Array, batch, copy_to
from mstmm.errors import NumericalFailure, SceneError

from ..engine.compiled_derivatives import TangentKernels
from ..engine.inputs import LiveInputs
from ..packing.fused_structure import structure_of
from ..packing.parameter_derivatives import parameter_derivatives

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene


#: CPU time that code for linear equations saves per state against single directions, relative to
#: its saving in a linearisation; measured.
_SINGLE_SAVING = 10.0
#: Arrays that this code computes, in its order.
_ARRAY_NAMES = ("udot", "q", "u", "efforts", "t", "rate_q", "rate_u")
#: Largest number of bodies: work and results grow with its square.
MAX_BODIES = 1000


@dataclass(frozen=True)
class Derivatives:
    """Derivatives of udot and of the rates of the tangent increments; (..., row, column).

    `q`, `u`, `efforts` (..., nu, nu): of the accelerations with respect to the tangent increments
    of q, the speeds and the efforts; `efforts` is the inverse of the mass matrix on the free
    coordinates, zero for driven ones.  `t` (..., nu): with respect to time at fixed q and u; driven
    coordinates move with t.  `parameters[name]` (..., nu): with respect to a parameter of the
    scene.  With closed loops, `q` and `u` are valid along motions that satisfy the constraints, and
    `efforts` is the result of `Model.solve`.
    `rate_q`, `rate_u` (..., nu, nu): of the rate of the tangent increments (rate_u is 1 on free
    coordinates, 0 on driven ones; rate_q is zero but for quaternions and users' own speeds).
    """

    udot: Array
    q: Array
    u: Array
    efforts: Array
    t: Array
    rate_q: Array
    rate_u: Array
    parameters: dict[str, Array] = field(default_factory=dict)

    @property
    def state_matrix(self) -> Array:
        """State matrix A (..., 2 nu, 2 nu) of perturbations: d/dt (dphi, du) = A (dphi, du).

        For one instant: if A changes along the motion, its eigenvalues do not determine stability
        (`Model.linearize` reports this).
        """
        return np.block([[self.rate_q, self.rate_u], [self.q, self.u]])

    def copy_to(self, out: Derivatives) -> Derivatives:
        """Copy into `out` and return it; raises SceneError for other shapes or parameters."""
        if not isinstance(out, Derivatives) or list(out.parameters) != list(self.parameters):
            raise SceneError(
                f"out = {abbreviate(out)}: expected the result of an earlier call of derivatives "
                "with the same parameters"
            )
        for name in _ARRAY_NAMES:
            copy_to(getattr(out, name), getattr(self, name))
        for name, numbers in self.parameters.items():
            copy_to(out.parameters[name], numbers)
        return out


class Differentiation:
    """Derivatives of one model by one set of parameters; kernels are generated on demand."""

    def __init__(self, model: CompiledScene, names: Sequence[str]) -> None:
        self._model = model
        self.names = tuple(names)
        known = model.known or {}
        _check_differentiable(model)
        if names:
            structure, self.p, self.slopes = parameter_derivatives(
                model.scene, known, names, model.packed_scene
            )
        else:
            packed = model.packed_scene
            structure, self.p = structure_of(packed.system, known, floors=packed.floors)
            self.slopes = np.zeros((len(self.p), 0))
        self._live_inputs = LiveInputs(model.packed_scene.system, structure.inputs)
        self.tangents = TangentKernels(model.fusion, structure, bool(names))
        self._memory = np.zeros(structure.n_memory)
        #: Without drives all speeds are free, and coordinates do not depend on time.
        self._undriven = not names and not model.packed_scene.system.driven
        self._units = np.eye(model.nu)
        self._has_rate_speeds = all(
            hinge.rates_are_speeds for hinge in model.coordinate_layout.hinges.values()
        )

    def __call__(
        self,
        q: ArrayLike,
        u: ArrayLike,
        t: ArrayLike,
        efforts: ArrayLike | None,
        accelerations: Callable[[], Array],
    ) -> Derivatives:
        """See `Model.derivatives`; `accelerations` returns those of all states, or raises."""
        nq, nu, names = self._model.nq, self._model.nu, self.names
        if self._undriven and type(t) is float and efforts is None:
            single = self._single_state(t, q, u)
            if single is not None:
                return single
        lead, (coordinates, speeds, times, extra) = batch(
            ("q", q, nq), ("u", u, nu), ("t", t, None),
            ("efforts", np.zeros(nu) if efforts is None else efforts, nu),
        )  # fmt: skip
        udot = accelerations()
        arrays = self.evaluate(times[:, None], coordinates, speeds, extra)

        def reshape(name: str, *shape: int) -> Array:
            return arrays[name].reshape(*lead, *shape)

        columns = reshape("parameters", nu, len(names)) if names else np.zeros((*lead, nu, 0))
        return Derivatives(
            udot=udot,
            t=reshape("t", nu),
            parameters={name: columns[..., k] for k, name in enumerate(names)},
            **{name: reshape(name, nu, nu) for name in ("q", "u", "efforts", "rate_q", "rate_u")},
        )

    def _single_state(self, t: float, q: ArrayLike, u: ArrayLike) -> Derivatives | None:
        """Derivatives at one state by the code of its linear equations.

        None without such code, or if it fails: forward mode then reports the reason.
        """
        call = self._model.compiled_linearisation.thread_call(_SINGLE_SAVING)
        arrays = None if call is None else call.derivatives(t, q, u)
        if arrays is None:
            return None
        derivatives = object.__new__(Derivatives)  # faster than the constructor of a frozen class
        derivatives.__dict__.update(zip(_ARRAY_NAMES, arrays, strict=True), parameters={})
        return derivatives

    def _by_linear_equations(
        self, t: Array, q: Array, u: Array, efforts: Array
    ) -> dict[str, Array] | None:
        """`evaluate` by the code of the linear equations; None without it."""
        call = (
            self._model.compiled_linearisation.thread_call(_SINGLE_SAVING * len(q))
            if self._undriven
            else None
        )
        if call is None:
            return None
        n = self._model.nu
        slopes, rate_matrices = np.empty((len(q), n, 3 * n + 1)), np.empty((len(q), n, n))
        for k, state in enumerate(zip(t[:, 0].tolist(), q, u, efforts, strict=True)):
            equations = call.evaluate_with_derivatives(*state)
            if equations is None:
                return None
            slopes[k], rate_matrices[k] = equations[1], equations[0].G
        return {
            "q": slopes[..., :n], "u": slopes[..., n : 2 * n], "efforts": slopes[..., 2 * n : -1],
            "t": slopes[..., -1:], "rate_q": rate_matrices,
            "rate_u": np.repeat(self._units[None], len(q), axis=0),
        }  # fmt: skip

    def evaluate(self, t: Array, q: Array, u: Array, efforts: Array) -> dict[str, Array]:
        """Derivatives (n, row, column) at n states, by the names of `Derivatives`.

        t (n, 1), q (n, nq), u and efforts (n, nu); parameters are columns of one array.
        """
        at_once = self._by_linear_equations(t, q, u, efforts)
        if at_once is not None:
            return at_once
        nu = self._model.nu
        states = {
            "p": np.atleast_2d(self._live_inputs.numbers_at(self.p, t[:, 0])), "t": t, "q": q,
            "u": u, "memory": self._memory[None], "efforts": efforts,
        }  # fmt: skip
        self.tangents.expect(len(q) * (4 * nu + 1 + len(self.names)))
        units, columns = np.eye(nu)[None], self.tangents.columns
        # qdot = N(q) u, so the columns of N are its derivatives with respect to u.
        increments = columns("u", "qdot", states, units)
        rows = {
            "q": columns("q", "udot", states, increments),
            "u": columns("u", "udot", states, units),
            "efforts": columns("efforts", "udot", states, units),
            "t": columns("t", "udot", states, np.ones((1, 1, 1))),
        }
        if self.names:
            rows["parameters"] = columns("p", "udot", states, self.slopes.T[None])
        arrays = {name: np.swapaxes(array, 1, 2) for name, array in rows.items()}
        self._check_finite(arrays, t)
        arrays["rate_q"], arrays["rate_u"] = self._rates(states, increments)
        return arrays

    def rate_matrix(self, q: Array, u: Array, t: float = 0.0) -> Array:
        """`rate_q` (nu, nu) of one state."""
        states = {
            "p": np.atleast_2d(self._live_inputs.numbers_at(self.p, np.array([t]))),
            "t": np.array([[t]]), "q": q[None], "u": u[None], "memory": self._memory[None],
            "efforts": np.zeros((1, self._model.nu)),
        }  # fmt: skip
        increments = self.tangents.columns("u", "qdot", states, np.eye(self._model.nu)[None])
        return self._rates(states, increments)[0][0]

    def _check_finite(self, arrays: Mapping[str, Array], t: Array) -> None:
        for name, array in arrays.items():
            if not np.isfinite(array).all():
                state, row, _ = (int(k[0]) for k in np.nonzero(~np.isfinite(array)))
                raise NumericalFailure(
                    f"the derivative of {self._model.coordinate_layout.u_names[row]}'s "
                    f"acceleration with respect to {name} is not finite at t = {t[state, 0]:.9g} s"
                )

    def _rates(self, states: Mapping[str, Array], n: Array) -> tuple[Array, Array]:
        """Derivatives `rate_q`, `rate_u` of dphi': N dphi' = (d qdot/dq N - N') dphi + N du.

        q = q(t) + N dphi.  `n` contains the columns of N as rows, (states, nu, nq).
        Column j of N' is the derivative of qdot(q, u = e_j) along the motion.
        """
        count, nu = n.shape[:2]
        rate_q, rate_u = np.zeros((count, nu, nu)), np.zeros((count, nu, nu))
        if self._has_rate_speeds:  # N is 1, and 0 for driven coordinates
            return rate_q, n @ np.swapaxes(n, 1, 2)
        columns = self.tangents.columns
        changes = columns("q", "qdot", states, n)
        motion = np.ascontiguousarray(states["u"][:, None] @ n)
        for j, unit in enumerate(np.eye(nu)):
            changes[:, j] -= columns("q", "qdot", {**states, "u": unit[None]}, motion)[:, 0]
        n, changes = np.swapaxes(n, 1, 2), np.swapaxes(changes, 1, 2)
        for owner in self._model.coordinate_layout.owners:
            rows, speeds = owner.q_slice, owner.u_slice
            inverse = np.linalg.pinv(n[:, rows, speeds])
            rate_q[:, speeds, speeds] = inverse @ changes[:, rows, speeds]
            rate_u[:, speeds, speeds] = inverse @ n[:, rows, speeds]
        return rate_q, rate_u


def _check_differentiable(model: CompiledScene) -> None:
    """Raise SceneError for releases and for too many bodies."""
    packed = model.packed_scene
    if packed.releases:
        names = ", ".join(f'"{name}"' for name in packed.releases)
        raise SceneError(
            f"derivatives: hinge {names} is released during the run, so that the accelerations "
            "change their form; remove the release"
        )
    if packed.system.count > MAX_BODIES:
        raise SceneError(
            f"derivatives: expected {MAX_BODIES} bodies or fewer, found "
            f"{packed.system.count}; work and results grow with the square of this number"
        )
