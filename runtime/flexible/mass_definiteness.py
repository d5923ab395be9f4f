"""Does the mass matrix of a stiffened body stay positive definite as far as its model goes?

Cut off after the second order, M(eta) of `derive.flexible.modal` is definite only for deflections
that are not too large: where the shapes can take up nearly all inertia, terms of eta soon exceed
what is left.  Here it is formed, by the generated kernels, for many deflections whose sections turn
by as much as the model is made for, as what moves the held end sees it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from ..kernels.numpy_kernels import evaluate
from .kernel_inputs import moments_of, section_inputs
from .memory_chunks import slices
from .modal_kernels import kernel
from .modal_scales import modal_sizes
from .support_motion import ANY, Support

if TYPE_CHECKING:
    from .modal_body import ModalBody
    from .modal_port import ModalPort


#: Largest rotation of a section against the frame for which a model is made, rad, and the margin
#: over it: deflections are drawn, and the worst is not among them.
SLOPE, MARGIN = 0.3, 1.25

#: Deflections drawn besides the shapes themselves and what forces on the ends bring.
_DRAWN = 48
#: What turns no section goes as far as this part of what it would at a rotation of 1 rad.
_STRETCH = 0.1
#: Inertia below this part of the largest is none: a straight beam about its own axis.
_NONE = 1e-13


def stays_definite(body: ModalBody, held: ModalPort, support: Support, turns: Array) -> bool:
    """Whether every deflection drawn leaves a positive inertia to every motion.

    `turns` (places, 3, n) are the rotations of sections per mode, rad.  What hangs on the other
    ends only adds inertia and is left out.
    """
    if not np.any(body.G) and not np.any(body.X):
        return True  # M is the exact integral of squares
    if not held.moves and not support.speeds:
        return True  # what is left is the constant matrix of the modes
    return is_definite_at(body, held, support, _deflections(body, turns))


def depends_on_count(body: ModalBody, held: str, support: Support, turns: Array) -> bool:
    """Whether a body that does not stay definite would with its first shape alone."""
    port = {"phi": (slice(None), slice(1)), "theta": (slice(None), slice(1)),
            "second_order": (slice(None), slice(1), slice(1))}  # fmt: skip
    one = replace(
        body, modes=body.modes[:1], C=body.C[:, :1], E=body.E[..., :1], F=body.F[..., :1, :1],
        G=body.G[:, :1, :1], X=body.X[..., :1, :1], K=body.K[:1, :1], D=body.D[:1, :1],
        shapes=None,
        ports={
            name: replace(end, **{key: getattr(end, key)[cut] for key, cut in port.items()})
            for name, end in body.ports.items()
        },
    )  # fmt: skip
    return stays_definite(one, one.ports[held], support, turns[..., :1])


def is_definite_at(body: ModalBody, held: ModalPort, support: Support, eta: Array) -> bool:
    """Whether deflections (N, n) leave a positive inertia to every motion that has one without."""
    inertia = _Inertia(body, held, np.concatenate([np.zeros((1, body.n)), eta]))
    for way in (support, ANY):
        kept, scale = _scale(next(inertia.on(way)))
        scaled = (m[:, kept[:, None], kept] / scale for m in inertia.on(way))
        if _is_definite(next(scaled)):
            return all(map(_is_definite, scaled))
    return True  # what a straight body lacks is not lost by bending


def _scale(straight: Array) -> tuple[NDArray[np.intp], Array]:
    """Motions that a matrix (1, ., .) has an inertia for, and the roots of their own inertias,
    products of two."""
    own = np.diagonal(straight[0])
    kept = np.flatnonzero(own > _NONE * own.max(initial=0.0))
    root = np.sqrt(own[kept])
    return kept, np.outer(root, root)


def _is_definite(matrices: Array) -> bool:
    try:
        np.linalg.cholesky(matrices)
    except np.linalg.LinAlgError:
        return False
    return True


# --- deflections ----------------------------------------------------------------------------------


def _deflections(body: ModalBody, turns: Array) -> Array:
    """(N, n) deflections whose largest rotation is SLOPE with its margin."""
    straight = ~turns.any(axis=(0, 1))
    sizes = modal_sizes(body) * np.where(straight, _STRETCH, 1.0)
    random = np.random.default_rng(0).normal(size=(_DRAWN, body.n))
    softest = np.sqrt(np.diag(body.K)) * sizes
    loads = [body.C, *(np.concatenate([p.phi, p.theta]) for p in body.ports.values())]
    bent = np.linalg.lstsq(body.K, np.concatenate(loads).T, rcond=None)[0].T
    rows = [sizes * np.eye(body.n), bent, sizes * random, sizes * random / softest]
    directions = np.concatenate(rows)
    directions = directions[np.abs(directions).max(axis=1) > 0]
    largest = np.linalg.norm(np.einsum("man,kn->kma", turns, directions), axis=2).max(axis=1)
    moved = np.abs(directions / sizes)[:, straight].max(axis=1, initial=0.0)
    return np.asarray(directions * (SLOPE * MARGIN / np.maximum(largest, moved))[:, None])


# --- mass matrix ----------------------------------------------------------------------------------


class _Inertia:
    """Mass matrices at deflections eta (N, n), as what the held end rides on sees them."""

    def __init__(self, body: ModalBody, held: ModalPort, eta: Array) -> None:
        n, zero, self.held, self.Mff = body.n, np.zeros(3), held, body.Mff
        given = {**moments_of(body), "eta": eta, "etad": np.zeros(n), "v": zero, "w": zero}
        found = evaluate(kernel("momentum"), given, n)
        self.S, self.S_rf = np.empty((len(eta), 6, 6)), found["S_rf"]
        rows, columns = np.triu_indices(6)
        self.S[:, rows, columns] = self.S[:, columns, rows] = found["S"]
        back = held.rotation.T
        self.ride, self.own = _shifted(back, -back @ held.position), np.zeros((len(eta), 6, n))
        if held.moves:
            self.ride, self.own = _frame_motion(held, eta)

    def on(self, support: Support) -> Iterator[Array]:
        """(., m + n, m + n) for the speeds of the support and the modes, the first one and then
        some at a time: M(eta) of [v; w; etad] in frame axes, with v, w by the speeds and etad."""
        m, n = support.speeds, len(self.Mff)
        moved = self.ride @ support.motion
        pushed = self.S @ self.own + self.S_rf
        corner = np.swapaxes(moved, -1, -2) @ self.S @ moved + support.inertia
        edge = np.swapaxes(moved, -1, -2) @ pushed
        for some in (slice(0, 1), *slices(len(self.S), (m + n) ** 2)):
            own, free = np.swapaxes(self.own[some], 1, 2), np.swapaxes(self.S_rf[some], 1, 2)
            whole = np.empty((len(own), m + n, m + n))
            whole[:, :m, :m], whole[:, :m, m:] = corner[some], edge[some]
            whole[:, m:, :m] = np.swapaxes(edge[some], 1, 2)
            whole[:, m:, m:] = own @ pushed[some] + free @ self.own[some] + self.Mff
            yield whole


def _frame_motion(held: ModalPort, eta: Array) -> tuple[Array, Array]:
    """Twist of the frame by that of the held end (N, 6, 6) and by the modal speeds (N, 6, n)."""
    given = section_inputs(held)
    section = evaluate(kernel("section"), {**given, "eta": eta, "etad": 0 * eta}, eta.shape[1])
    passed = {name: section[name] for name in ("x", "Psi", "xd", "Psid", "xdd", "Psidd")}
    inward = evaluate(kernel("inward"), {**passed, "R_end": held.rotation})
    return _shifted(inward["R"], inward["d"]), inward["H6"] @ section["Phi"]


def _shifted(turn: Array, shift: Array) -> Array:
    """(..., 6, 6): twist of an outboard point, its axes, from that of the inboard one; `turn`
    outboard axes to inboard axes, `shift` from the inboard point, inboard axes."""
    back = np.swapaxes(turn, -1, -2)
    moved = np.zeros((*turn.shape[:-2], 6, 6))
    moved[..., :3, :3] = moved[..., 3:, 3:] = back
    x, y, z = (shift[..., k] for k in range(3))
    o = np.zeros_like(x)
    cross = np.stack([o, z, -y, -z, o, x, y, -x, o], axis=-1).reshape(*x.shape, 3, 3)
    moved[..., :3, 3:] = back @ cross
    return moved
