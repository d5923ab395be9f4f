"""Flexible bodies and their sections -> inputs of the kernels that sweep them."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np

from mstmm.array_validation import Array

from .mass_moments import Moments
from .modal_body import ModalBody
from .modal_port import ModalPort

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
