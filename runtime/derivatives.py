"""Exact derivatives of the accelerations: the fused kernel differentiated, not its values.

Forward mode (`mstmm.tangent`): one run of a tangent kernel gives the derivative along one
direction.  Coordinates are varied by tangent increments dphi, one for each speed: dq = N(q) dphi,
where qdot = N(q) u.  For coordinates whose rate is their speed that is the coordinate itself; for
the quaternion of a ball or free hinge it is the rotation vector in outboard axes.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.errors import NumericalFailure, SceneError
from mstmm.ir import Constant, KernelIR, Store
from mstmm.tangent import PREFIX, tangent

from .pack import pack
from .seeded import slopes
from .structure import structure_of
from .tape_kernel import TapeKernel

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]

#: More bodies than this are not differentiated: work and results grow with their square.
MOST_BODIES = 1000


@dataclass(frozen=True)
class Derivatives:
    """Derivatives of udot and of the rates of the tangent increments; (..., row, column).

    `q`, `u`, `efforts` (..., nu, nu): of the accelerations with respect to the tangent increments
    of q, the speeds and the efforts; `efforts` is the inverse of the mass matrix on the free
    coordinates, zero for driven ones.  `t` (..., nu): with respect to time at fixed q and u; driven
    coordinates move with t.  `parameters[name]` (..., nu): with respect to a number of the scene.
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
        """A (..., 2 nu, 2 nu): d/dt (dphi, du) = A (dphi, du) of motions near this one."""
        return np.block([[self.rate_q, self.rate_u], [self.q, self.u]])


class Differentiation:
    """Tangent kernels of one model with one set of parameters, made when they are asked for."""

    def __init__(self, model: Model, names: Sequence[str]) -> None:
        self._model = model
        self.names = tuple(names)
        known = model.known or {}
        _refuse(model)
        if names:
            self.structure, self.p, self.slopes = slopes(model.scene, known, names)
        else:
            self.structure, self.p = structure_of(pack(model.scene, known), known)
            self.slopes = np.zeros((len(self.p), 0))
        self._kernel = model.fusion.fused(self.structure).kernels["accelerations"]
        self._tapes: dict[tuple[str, str], TapeKernel | None] = {}
        self._lock = threading.Lock()

    def _tape(self, port: str, output: str) -> TapeKernel | None:
        """The derivative of `output` along directions of `port`; None where it is zero."""
        if (port, output) not in self._tapes:
            kernel = tangent(self._kernel, [port], [output], values=False, guards=False)
            self._tapes[port, output] = None if _vanishes(kernel) else TapeKernel(kernel)
        return self._tapes[port, output]

    def _columns(
        self, port: str, output: str, state: Mapping[str, Array], directions: Array
    ) -> Array:
        """Derivatives of `output` along each column of `directions`, side by side."""
        tape = self._tape(port, output)
        length = self._model.nq if output == "qdot" else self._model.nu
        found = np.zeros((length, directions.shape[1]))
        if tape is None:
            return found
        for k in range(directions.shape[1]):
            _, outputs = tape.run({**state, PREFIX + port: directions[:, k]})
            found[:, k] = outputs[PREFIX + output][:length]
        return found

    def at(self, t: float, q: Array, u: Array, efforts: Array) -> dict[str, Array]:
        """Derivatives of one state, by the names of `Derivatives`, parameters as columns."""
        with self._lock:
            found = self._at(t, q, u, efforts)
        for name, array in found.items():
            if not np.isfinite(array).all():
                row = int(np.nonzero(~np.isfinite(array))[0][0])
                raise NumericalFailure(
                    f"the derivative of {self._model.layout.u_names[row]}'s acceleration with "
                    f"respect to {name} is not finite at t = {t:.9g} s"
                )
        return found

    def _at(self, t: float, q: Array, u: Array, efforts: Array) -> dict[str, Array]:
        one = np.eye(self._model.nu)
        state = {"p": self.p, "t": np.array([t]), "q": q, "u": u, "efforts": efforts}
        # qdot = N(q) u, so the columns of N are its derivatives with respect to u.
        increments = self._columns("u", "qdot", state, one)
        found = {
            "q": self._columns("q", "udot", state, increments),
            "u": self._columns("u", "udot", state, one),
            "efforts": self._columns("efforts", "udot", state, one),
            "t": self._columns("t", "udot", state, np.ones((1, 1)))[:, 0],
            "parameters": self._columns("p", "udot", state, self.slopes),
        }
        found["rate_q"], found["rate_u"] = self._rates(state, increments, u)
        return found

    def _rates(self, state: Mapping[str, Array], n: Array, u: Array) -> tuple[Array, Array]:
        """Derivatives of dphi' where q = q(t) + N dphi: N dphi' = (d qdot/dq N - N') dphi + N du.

        Column j of N' is the derivative of qdot(q, u = e_j) along the motion.
        """
        rate_q, rate_u = np.zeros_like(n.T @ n), np.zeros_like(n.T @ n)
        if not n.size:
            return rate_q, rate_u
        moved = self._columns("q", "qdot", state, n)
        motion = (n @ u)[:, None]
        turned = [
            self._columns("q", "qdot", {**state, "u": unit}, motion) for unit in np.eye(len(u))
        ]
        bend = moved - np.hstack(turned)
        for hinge in self._model.layout.hinges.values():
            rows, columns = hinge.q_slice, hinge.u_slice
            back = np.linalg.pinv(n[rows, columns])
            rate_q[columns, columns] = back @ bend[rows, columns]
            rate_u[columns, columns] = back @ n[rows, columns]
        return rate_q, rate_u


def _refuse(model: Model) -> None:
    """SceneError for a scene whose accelerations are no single smooth function."""
    packed = model._engine.packed
    if packed.releases:
        names = ", ".join(f'"{name}"' for name in packed.releases)
        raise SceneError(
            f"derivatives: hinge {names} is released during the run, so that the accelerations "
            "change their form; take the release out"
        )
    if packed.model.n_bodies > MOST_BODIES:
        raise SceneError(
            f"derivatives: {packed.model.n_bodies} bodies; expected {MOST_BODIES} or fewer, as "
            "work and results grow with their square"
        )


def _vanishes(kernel: KernelIR) -> bool:
    """Whether everything that the kernel stores is the constant zero."""
    stores = [s for s in kernel.statements if isinstance(s, Store)]
    return all(s.value == Constant("0") for s in stores)


def derivatives(
    model: Model,
    differentiation: Differentiation,
    q: ArrayLike,
    u: ArrayLike,
    t: ArrayLike,
    efforts: ArrayLike | None,
) -> Derivatives:
    """`Model.derivatives` of all states of a batch, one after the other."""
    lead = np.broadcast_shapes(np.shape(q)[:-1], np.shape(u)[:-1], np.shape(t))
    engine, nu = model._engine, model.nu
    given = np.zeros(nu) if efforts is None else efforts
    coordinates = engine.batch("q", q, model.nq, lead)
    speeds = engine.batch("u", u, nu, lead)
    extra = engine.batch("efforts", given, nu, lead)
    times = np.broadcast_to(np.asarray(t, dtype=np.float64), lead).reshape(-1)
    udot = model.accelerations(q, u, t, efforts)  # refuses states that have no accelerations
    states = zip(times, coordinates, speeds, extra, strict=True)
    found = [differentiation.at(float(time), *state) for time, *state in states]

    def batch(name: str, *shape: int) -> Array:
        return np.array([one[name] for one in found]).reshape(*lead, *shape)

    columns = batch("parameters", nu, len(differentiation.names))
    return Derivatives(
        udot=udot,
        t=batch("t", nu),
        parameters={name: columns[..., k] for k, name in enumerate(differentiation.names)},
        **{name: batch(name, nu, nu) for name in ("q", "u", "efforts", "rate_q", "rate_u")},
    )
