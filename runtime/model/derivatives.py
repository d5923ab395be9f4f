"""Exact derivatives of the accelerations, without differences.

Where there is code for the linear equations of a scene about a state, they are all found at once:
M da + C du + K dphi + r_t dt = d efforts.  Else by forward mode (`mstmm.ir.differentiation`) on
the fused
kernel: one run of a tangent kernel gives the derivative along one direction.

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

from ..engine.live_inputs import LiveInputs
from ..engine.tangent_kernels import TangentKernels
from ..packing.fused_structure import structure_of
from ..packing.parameter_derivatives import slopes

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene


#: What code of linear equations saves a state beside directions one by one, in what it saves where
#: a model is made linear; measured.
_SAVED = 10.0
#: What that code finds, in its order.
_FOUND = ("udot", "q", "u", "efforts", "t", "rate_q", "rate_u")
#: More bodies than this are not differentiated: work and results grow with their square.
MOST_BODIES = 1000


@dataclass(frozen=True)
class Derivatives:
    """Derivatives of udot and of the rates of the tangent increments; (..., row, column).

    `q`, `u`, `efforts` (..., nu, nu): of the accelerations with respect to the tangent increments
    of q, the speeds and the efforts; `efforts` is the inverse of the mass matrix on the free
    coordinates, zero for driven ones.  `t` (..., nu): with respect to time at fixed q and u; driven
    coordinates move with t.  `parameters[name]` (..., nu): with respect to a number of the scene.
    Where loops are closed, `q` and `u` hold along motions that keep them closed, and `efforts` is
    what `Model.solve` answers.
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
        """A (..., 2 nu, 2 nu): d/dt (dphi, du) = A (dphi, du) of motions near this one.

        At this moment: where A changes along the motion its eigenvalues tell nothing of stability
        (`Model.linearize` says whether it does).
        """
        return np.block([[self.rate_q, self.rate_u], [self.q, self.u]])

    def kept_in(self, out: Derivatives) -> Derivatives:
        """`out` with these numbers.  SceneError unless it is of the same shapes and parameters."""
        if not isinstance(out, Derivatives) or list(out.parameters) != list(self.parameters):
            raise SceneError(
                f"out = {abbreviate(out)}: expected what an earlier call of derivatives gave, "
                f"with the "
                "same parameters"
            )
        for name in _FOUND:
            copy_to(getattr(out, name), getattr(self, name))
        for name, numbers in self.parameters.items():
            copy_to(out.parameters[name], numbers)
        return out


class Differentiation:
    """Derivatives of one model with one set of parameters; kernels are made when asked for."""

    def __init__(self, model: CompiledScene, names: Sequence[str]) -> None:
        self._model = model
        self.names = tuple(names)
        known = model.known or {}
        _refuse(model)
        if names:
            structure, self.p, self.slopes = slopes(model.scene, known, names, model.packed)
        else:
            packed = model.packed
            structure, self.p = structure_of(packed.system, known, floors=packed.floors)
            self.slopes = np.zeros((len(self.p), 0))
        self._live = LiveInputs(model.packed.system, structure.inputs)
        self.tangents = TangentKernels(model.fusion, structure, bool(names))
        self._memory = np.zeros(structure.n_memory)
        #: Without drives all speeds are free, and time acts at coordinates that stay.
        self._undriven = not names and not model.packed.system.driven
        self._units = np.eye(model.nu)
        self._straight = all(hinge.straight for hinge in model.layout.hinges.values())

    def __call__(
        self,
        q: ArrayLike,
        u: ArrayLike,
        t: ArrayLike,
        efforts: ArrayLike | None,
        accelerations: Callable[[], Array],
    ) -> Derivatives:
        """`Model.derivatives`; `accelerations` gives those of all its states, or refuses them."""
        nq, nu, names = self._model.nq, self._model.nu, self.names
        if self._undriven and type(t) is float and efforts is None:
            one = self._one(t, q, u)
            if one is not None:
                return one
        lead, (coordinates, speeds, times, extra) = batch(
            ("q", q, nq), ("u", u, nu), ("t", t, None),
            ("efforts", np.zeros(nu) if efforts is None else efforts, nu),
        )  # fmt: skip
        udot = accelerations()
        found = self.at(times[:, None], coordinates, speeds, extra)

        def shaped(name: str, *shape: int) -> Array:
            return found[name].reshape(*lead, *shape)

        columns = shaped("parameters", nu, len(names)) if names else np.zeros((*lead, nu, 0))
        return Derivatives(
            udot=udot,
            t=shaped("t", nu),
            parameters={name: columns[..., k] for k, name in enumerate(names)},
            **{name: shaped(name, nu, nu) for name in ("q", "u", "efforts", "rate_q", "rate_u")},
        )

    def _one(self, t: float, q: ArrayLike, u: ArrayLike) -> Derivatives | None:
        """Those of one state by the code of its linear equations; None where there is no such code,
        or where it finds none: then the other way says why."""
        call = self._model.slopes.call(_SAVED)
        found = None if call is None else call.derivatives(t, q, u)
        if found is None:
            return None
        made = object.__new__(Derivatives)  # a frozen one is filled field by field otherwise
        made.__dict__.update(zip(_FOUND, found, strict=True), parameters={})
        return made

    def _all_at_once(self, t: Array, q: Array, u: Array, efforts: Array) -> dict[str, Array] | None:
        """`at` by that code."""
        call = self._model.slopes.call(_SAVED * len(q)) if self._undriven else None
        if call is None:
            return None
        n = self._model.nu
        slopes, turning = np.empty((len(q), n, 3 * n + 1)), np.empty((len(q), n, n))
        for k, state in enumerate(zip(t[:, 0].tolist(), q, u, efforts, strict=True)):
            found = call.with_slopes(*state)
            if found is None:
                return None
            slopes[k], turning[k] = found[1], found[0].G
        return {
            "q": slopes[..., :n], "u": slopes[..., n : 2 * n], "efforts": slopes[..., 2 * n : -1],
            "t": slopes[..., -1:], "rate_q": turning,
            "rate_u": np.repeat(self._units[None], len(q), axis=0),
        }  # fmt: skip

    def at(self, t: Array, q: Array, u: Array, efforts: Array) -> dict[str, Array]:
        """Derivatives of n states, t (n, 1), q (n, nq), u and efforts (n, nu), by the names of
        `Derivatives`; (n, row, column), parameters as columns."""
        at_once = self._all_at_once(t, q, u, efforts)
        if at_once is not None:
            return at_once
        nu = self._model.nu
        states = {
            "p": np.atleast_2d(self._live.at(self.p, t[:, 0])), "t": t, "q": q, "u": u,
            "memory": self._memory[None], "efforts": efforts,
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
        found = {name: np.swapaxes(array, 1, 2) for name, array in rows.items()}
        self._refuse_infinite(found, t)
        found["rate_q"], found["rate_u"] = self._rates(states, increments)
        return found

    def turning(self, q: Array, u: Array, t: float = 0.0) -> Array:
        """`rate_q` (nu, nu) of one state alone."""
        states = {
            "p": np.atleast_2d(self._live.at(self.p, np.array([t]))), "t": np.array([[t]]),
            "q": q[None], "u": u[None], "memory": self._memory[None],
            "efforts": np.zeros((1, self._model.nu)),
        }  # fmt: skip
        increments = self.tangents.columns("u", "qdot", states, np.eye(self._model.nu)[None])
        return self._rates(states, increments)[0][0]

    def _refuse_infinite(self, found: Mapping[str, Array], t: Array) -> None:
        for name, array in found.items():
            if not np.isfinite(array).all():
                state, row, _ = (int(k[0]) for k in np.nonzero(~np.isfinite(array)))
                raise NumericalFailure(
                    f"the derivative of {self._model.layout.u_names[row]}'s acceleration with "
                    f"respect to {name} is not finite at t = {t[state, 0]:.9g} s"
                )

    def _rates(self, states: Mapping[str, Array], n: Array) -> tuple[Array, Array]:
        """Derivatives of dphi' where q = q(t) + N dphi: N dphi' = (d qdot/dq N - N') dphi + N du.

        `n` holds the columns of N as rows, (states, nu, nq).  Column j of N' is the derivative of
        qdot(q, u = e_j) along the motion.
        """
        count, nu = n.shape[:2]
        rate_q, rate_u = np.zeros((count, nu, nu)), np.zeros((count, nu, nu))
        if self._straight:  # N is 1, and 0 where a drive decides
            return rate_q, n @ np.swapaxes(n, 1, 2)
        columns = self.tangents.columns
        bend = columns("q", "qdot", states, n)
        motion = np.ascontiguousarray(states["u"][:, None] @ n)
        for j, unit in enumerate(np.eye(nu)):
            bend[:, j] -= columns("q", "qdot", {**states, "u": unit[None]}, motion)[:, 0]
        n, bend = np.swapaxes(n, 1, 2), np.swapaxes(bend, 1, 2)
        for owner in self._model.layout.owners:
            rows, own = owner.q_slice, owner.u_slice
            back = np.linalg.pinv(n[:, rows, own])
            rate_q[:, own, own] = back @ bend[:, rows, own]
            rate_u[:, own, own] = back @ n[:, rows, own]
        return rate_q, rate_u


def _refuse(model: CompiledScene) -> None:
    """SceneError for a scene whose accelerations are no single smooth function."""
    packed = model.packed
    if packed.releases:
        names = ", ".join(f'"{name}"' for name in packed.releases)
        raise SceneError(
            f"derivatives: hinge {names} is released during the run, so that the accelerations "
            "change their form; take the release out"
        )
    if packed.system.count > MOST_BODIES:
        raise SceneError(
            f"derivatives: {packed.system.count} bodies; expected {MOST_BODIES} or fewer, as "
            "work and results grow with their square"
        )
