"""Flexible bodies and their sections -> C records of the looped engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from mstmm.arrays import Array

from .modal_body import ModalBody
from .modal_port import ModalPort
from .moments import Moments

_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
#: (a, b) with eps_iab = 1, by i.
_CYCLIC = ((1, 2), (2, 0), (0, 1))


def moments_of(body: Moments) -> dict[str, Array]:
    """Inputs p, C, P, B, Z_xx.., Y_x.., G_x.., M of the kernels of ("sweep", "modal").

    See `derive.flexible.symbols` for what they are.
    """
    e, f, g, x = body.E, body.F, body.G, body.X
    found = {
        "p": np.array([body.mass, *body.first, *(body.second[a, b] for a, b in _PAIRS)]),
        "C": body.C,
        "P": np.array([e[a, b] - e[b, a] for a, b in _CYCLIC]),
        "B": np.array([e[a, b] + e[b, a] for a, b in _PAIRS]),
    }
    for a, b in _PAIRS:
        name = "xyz"[a] + "xyz"[b]
        found[f"Z_{name}"] = f[a, b] + f[a, b].T - x[a, b] - x[b, a]
    for i, (a, b) in enumerate(_CYCLIC):
        found[f"Y_{'xyz'[i]}"] = (f[a, b] - x[a, b]) - (f[b, a] - x[b, a])
    for i in range(3):
        found[f"G_{'xyz'[i]}"] = g[i]
    found["M"] = f[0, 0] + f[1, 1] + f[2, 2]
    return found


def section_inputs(port: ModalPort) -> dict[str, Array]:
    """Inputs r, phi, theta, g_x .. h_z of the kernel "section" of ("sweep", "modal")."""
    second = [f"{kind}_{axis}" for kind in "gh" for axis in "xyz"]
    return {"r": port.position, "phi": port.phi, "theta": port.theta} | dict(
        zip(second, port.second_order, strict=True)
    )


M = TypeVar("M", bound=Moments)


def in_frame(body: ModalBody, rotation: Array, origin: Array) -> ModalBody:
    """The same body in other axes about another origin: `rotation` (3, 3) new axes to old ones,
    `origin` (3,) in old axes, m."""
    r, o = rotation, origin
    if np.array_equal(r, np.eye(3)) and not np.any(o):
        return body
    return replace(
        _moved(body, r, o),
        ports={name: section_in(port, r, o) for name, port in body.ports.items()},
        points=tuple(replace(p, port=section_in(p.port, r, o)) for p in body.points),
        drag=None if body.drag is None else _moved(body.drag, r, o),
    )


def _moved(body: M, r: Array, o: Array) -> M:
    """Moments about another origin o, in axes r."""
    first = body.first - body.mass * o
    second = body.second - np.outer(o, body.first) - np.outer(first, o)
    e = body.E - o[:, None, None] * body.C[None]
    x = body.X - o[:, None, None, None] * body.G[None]
    return replace(
        body,
        first=r.T @ first,
        second=r.T @ second @ r,
        C=r.T @ body.C,
        E=np.einsum("ia,jb,ijk->abk", r, r, e),
        F=np.einsum("ia,jb,ijkl->abkl", r, r, body.F),
        G=_turned(r, body.G),
        X=np.einsum("ia,jb,ijkl->abkl", r, r, x),
    )


def section_in(port: ModalPort, rotation: Array, origin: Array) -> ModalPort:
    """A section in other axes about another origin."""
    r = rotation
    return ModalPort(
        r.T @ (port.position - origin), r.T @ port.rotation, r.T @ port.phi, r.T @ port.theta,
        np.concatenate([_turned(r, port.second_order[:3]), _turned(r, port.second_order[3:])]),
    )  # fmt: skip


def _turned(rotation: Array, vectors: Array) -> Array:
    """Components (3, n, n) in other axes."""
    return np.asarray(np.einsum("ia,ikl->akl", rotation, vectors))


def massless(body: ModalBody) -> ModalBody:
    """The frame node of a body whose mass stands in points: stiffness and damping alone."""
    zero = {name: np.zeros_like(getattr(body, name)) for name in "CEFGX"}
    return replace(body, mass=0.0, first=np.zeros(3), second=np.zeros((3, 3)), **zero)


class ModalRecords:
    """Makes `mstmm_modal` and `mstmm_section`; `kept` holds what C points to.

    `place` counts the workspace that they need; who fills the model sets where it begins.
    """

    def __init__(self, ffi: Any, lib: Any, kept: list[Any]) -> None:
        self.ffi, self.lib, self.kept = ffi, lib, kept
        self.size = 0
        self._made: list[Any] = []

    def modal(self, body: ModalBody, q: int, u: int) -> Any:
        """`mstmm_modal *` of a body whose numbers are in the axes of its node."""
        record = self._new("mstmm_modal *")
        record.n, record.q, record.u = len(body.modes), q, u
        inertial = massless(body) if body.points else body
        self._moments(record.moments, inertial)
        if body.drag is not None:
            record.drag = self._new("mstmm_moments *")
            self._moments(record.drag, body.drag)
        record.stiffness, record.damping = self._reals(body.K), self._reals(body.D)
        record.place = self._room(self.lib.mstmm_modal_numbers(record.n))
        return record

    def section(self, port: ModalPort, modal: Any, inward: bool) -> Any:
        """`mstmm_section *` of a section of the body of `modal`."""
        record = self._new("mstmm_section *")
        record.modal, record.inward = modal, int(inward)
        record.point, record.phi = self._reals(port.position), self._reals(port.phi)
        record.theta, record.end = self._reals(port.theta), self._reals(port.rotation)
        for a in range(3):
            record.drawn[a] = self._reals(port.second_order[a])
            record.turned[a] = self._reals(port.second_order[3 + a])
        record.place = self._room(self.lib.mstmm_section_numbers(modal.n))
        return record

    def begin(self, first: int) -> int:
        """Put all numbers behind `first` of the workspace; returns the place behind them."""
        for record in self._made:
            record.place += first
        return first + self.size

    def _moments(self, record: Any, body: Moments) -> None:
        found = moments_of(body)
        record.rigid, record.c = self._reals(found["p"]), self._reals(found["C"])
        record.p, record.b = self._reals(found["P"]), self._reals(found["B"])
        for k, (a, b) in enumerate(_PAIRS):
            record.z[k] = self._reals(found[f"Z_{'xyz'[a]}{'xyz'[b]}"])
        for k in range(3):
            record.y[k] = self._reals(found[f"Y_{'xyz'[k]}"])
            record.g[k] = self._reals(found[f"G_{'xyz'[k]}"])
        record.m = self._reals(found["M"])

    def _room(self, count: int) -> int:
        first = self.size
        self.size += int(count)
        return first

    def _new(self, kind: str) -> Any:
        record = self.ffi.new(kind)
        self.kept.append(record)
        if "moments" not in kind:
            self._made.append(record)
        return record

    def _reals(self, numbers: Array | Sequence[float]) -> Any:
        array = np.ascontiguousarray(np.ravel(numbers) if np.size(numbers) else [0.0], dtype=float)
        self.kept.append(array)
        return self.ffi.from_buffer("real[]", array)
