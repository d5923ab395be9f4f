"""Kernel inputs of flexible bodies and their sections, and changes of frame."""

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


def moment_inputs(body: Moments) -> dict[str, Array]:
    """Inputs p, C, P, B, Z_xx.., Y_x.., G_x.., M of the kernels of ("sweep", "modal").

    They are defined in `derive.flexible.modal_symbols`.
    """
    e, f, g, x = body.E, body.F, body.G, body.X
    inputs = {
        "p": np.array([body.mass, *body.first, *(body.second[a, b] for a, b in _PAIRS)]),
        "C": body.C,
        "P": np.array([e[a, b] - e[b, a] for a, b in _CYCLIC]),
        "B": np.array([e[a, b] + e[b, a] for a, b in _PAIRS]),
    }
    for a, b in _PAIRS:
        name = "xyz"[a] + "xyz"[b]
        inputs[f"Z_{name}"] = f[a, b] + f[a, b].T - x[a, b] - x[b, a]
    for i, (a, b) in enumerate(_CYCLIC):
        inputs[f"Y_{'xyz'[i]}"] = (f[a, b] - x[a, b]) - (f[b, a] - x[b, a])
    for i in range(3):
        inputs[f"G_{'xyz'[i]}"] = g[i]
    inputs["M"] = f[0, 0] + f[1, 1] + f[2, 2]
    return inputs


def section_inputs(port: ModalPort) -> dict[str, Array]:
    """Inputs r, phi, theta, g_x .. h_z of the kernel "section" of ("sweep", "modal")."""
    names = [f"{kind}_{axis}" for kind in "gh" for axis in "xyz"]
    return {"r": port.position, "phi": port.phi, "theta": port.theta} | dict(
        zip(names, port.second_order, strict=True)
    )


M = TypeVar("M", bound=Moments)


def transform_body(body: ModalBody, rotation: Array, origin: Array) -> ModalBody:
    """Body in other axes about another origin.

    `rotation` (3, 3) turns new axes to old ones; `origin` (3,) is in old axes, m.
    """
    axes, shift = rotation, origin
    if np.array_equal(axes, np.eye(3)) and not np.any(shift):
        return body
    return replace(
        _transform_moments(body, axes, shift),
        ports={name: transform_section(port, axes, shift) for name, port in body.ports.items()},
        points=tuple(
            replace(point, port=transform_section(point.port, axes, shift)) for point in body.points
        ),
        drag=None if body.drag is None else _transform_moments(body.drag, axes, shift),
    )


def _transform_moments(body: M, rotation: Array, origin: Array) -> M:
    """Moments about another origin, in the axes `rotation`."""
    first = body.first - body.mass * origin
    second = body.second - np.outer(origin, body.first) - np.outer(first, origin)
    e = body.E - origin[:, None, None] * body.C[None]
    x = body.X - origin[:, None, None, None] * body.G[None]
    return replace(
        body,
        first=rotation.T @ first,
        second=rotation.T @ second @ rotation,
        C=rotation.T @ body.C,
        E=np.einsum("ia,jb,ijk->abk", rotation, rotation, e),
        F=np.einsum("ia,jb,ijkl->abkl", rotation, rotation, body.F),
        G=_rotate_components(rotation, body.G),
        X=np.einsum("ia,jb,ijkl->abkl", rotation, rotation, x),
    )


def transform_section(port: ModalPort, rotation: Array, origin: Array) -> ModalPort:
    """Section in other axes about another origin; arguments as in `transform_body`."""
    r = rotation
    return ModalPort(
        r.T @ (port.position - origin), r.T @ port.rotation, r.T @ port.phi, r.T @ port.theta,
        np.concatenate([_rotate_components(r, part) for part in np.split(port.second_order, 2)]),
    )  # fmt: skip


def _rotate_components(rotation: Array, vectors: Array) -> Array:
    """Components (3, n, n) in the axes `rotation`."""
    return np.asarray(np.einsum("ia,ikl->akl", rotation, vectors))


def without_mass(body: ModalBody) -> ModalBody:
    """Body with stiffness and damping alone, for a body whose mass sits in points."""
    zeros = {name: np.zeros_like(getattr(body, name)) for name in "CEFGX"}
    return replace(body, mass=0.0, first=np.zeros(3), second=np.zeros((3, 3)), **zeros)
