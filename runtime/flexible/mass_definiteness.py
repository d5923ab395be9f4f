"""Positive definiteness of the mass matrix of a stiffened body over the range of its model.

The mass matrix M(eta) of `derive.flexible.modal_residual` is cut off after second order, so that it
is definite only for moderate deflections: where the shapes represent nearly all inertia, terms in
eta soon exceed the rest.  The check evaluates M(eta) with the generated kernels for many
deflections whose sections rotate as far as the model is valid, for the motions that the support
allows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from ..kernels.numpy_kernels import evaluate
from .modal_body import kernel, modal_sizes, moment_inputs, section_inputs
from .modal_parts import chunk_slices
from .supports import ANY, Support

if TYPE_CHECKING:
    from .modal_body import ModalBody
    from .modal_parts import ModalPort

#: Largest valid rotation of a section relative to the frame, rad, and a margin over it, because
#: random deflections do not include the worst one.
SLOPE, MARGIN = 0.3, 1.25

#: Random deflections, besides the shapes and the static deflections under loads on the ends.
_RANDOM_COUNT = 48
#: Amplitude of shapes that rotate no section, as a share of their modal scale.
_UNROTATED_FRACTION = 0.1
#: Share of the largest inertia that counts as none, as of a straight beam about its own axis.
_NO_INERTIA = 1e-13


def is_mass_definite(body: ModalBody, held: ModalPort, support: Support, rotations: Array) -> bool:
    """Whether the mass matrix is positive definite at every test deflection.

    `rotations` (sections, 3, n) are the rotation vectors of sections per mode, rad.  Bodies on the
    other ends only add inertia and are left out.
    """
    if not np.any(body.G) and not np.any(body.X):
        return True  # M is the exact integral of a square
    if not held.can_move and not support.speeds:
        return True  # only the constant modal mass matrix remains
    return is_definite_at(body, held, support, _test_deflections(body, rotations))


def is_definite_with_first_shape(
    body: ModalBody, held: str, support: Support, rotations: Array
) -> bool:
    """Whether the mass matrix would be positive definite with the first shape alone."""
    cuts = {"phi": (slice(None), slice(1)), "theta": (slice(None), slice(1)),
            "second_order": (slice(None), slice(1), slice(1))}  # fmt: skip
    reduced = replace(
        body, modes=body.modes[:1], C=body.C[:, :1], E=body.E[..., :1], F=body.F[..., :1, :1],
        G=body.G[:, :1, :1], X=body.X[..., :1, :1], K=body.K[:1, :1], D=body.D[:1, :1],
        shapes=None,
        ports={
            name: replace(port, **{key: getattr(port, key)[cut] for key, cut in cuts.items()})
            for name, port in body.ports.items()
        },
    )  # fmt: skip
    return is_mass_definite(reduced, reduced.ports[held], support, rotations[..., :1])


def is_definite_at(body: ModalBody, held: ModalPort, support: Support, eta: Array) -> bool:
    """Whether M is positive definite at deflections (N, n), for motions with inertia at eta = 0."""
    mass_matrices = _MassMatrices(body, held, np.concatenate([np.zeros((1, body.n)), eta]))
    for motion in (support, ANY):
        kept, scale = _scale_of_motions(next(mass_matrices.matrices(motion)))
        scaled = (m[:, kept[:, None], kept] / scale for m in mass_matrices.matrices(motion))
        if _all_definite(next(scaled)):
            return all(map(_all_definite, scaled))
    return True  # M is singular without deflection, so that the test has no meaning


def _scale_of_motions(undeformed: Array) -> tuple[NDArray[np.intp], Array]:
    """Indices of motions with inertia in a matrix (1, ., .), and a scale for each matrix entry."""
    diagonal = np.diagonal(undeformed[0])
    kept = np.flatnonzero(diagonal > _NO_INERTIA * diagonal.max(initial=0.0))
    root = np.sqrt(diagonal[kept])
    return kept, np.outer(root, root)


def _all_definite(matrices: Array) -> bool:
    try:
        np.linalg.cholesky(matrices)
    except np.linalg.LinAlgError:
        return False
    return True


# --- deflections ----------------------------------------------------------------------------------


def _test_deflections(body: ModalBody, rotations: Array) -> Array:
    """Deflections (N, n) whose largest rotation of a section is SLOPE * MARGIN."""
    unturned = ~rotations.any(axis=(0, 1))
    scales = modal_sizes(body) * np.where(unturned, _UNROTATED_FRACTION, 1.0)
    drawn = np.random.default_rng(0).normal(size=(_RANDOM_COUNT, body.n))
    root_energies = np.sqrt(np.diag(body.K)) * scales
    loads = [body.C, *(np.concatenate([p.phi, p.theta]) for p in body.ports.values())]
    static = np.linalg.lstsq(body.K, np.concatenate(loads).T, rcond=None)[0].T
    rows = [scales * np.eye(body.n), static, scales * drawn, scales * drawn / root_energies]
    directions = np.concatenate(rows)
    directions = directions[np.abs(directions).max(axis=1) > 0]
    rotation = np.linalg.norm(np.einsum("man,kn->kma", rotations, directions), axis=2).max(axis=1)
    stretch = np.abs(directions / scales)[:, unturned].max(axis=1, initial=0.0)
    return np.asarray(directions * (SLOPE * MARGIN / np.maximum(rotation, stretch))[:, None])


# --- mass matrix ----------------------------------------------------------------------------------


class _MassMatrices:
    """Mass matrices of a body and its support at deflections eta (N, n)."""

    def __init__(self, body: ModalBody, held: ModalPort, eta: Array) -> None:
        n, zero, self.held_port, self.Mff = body.n, np.zeros(3), held, body.Mff
        inputs = {**moment_inputs(body), "eta": eta, "etad": np.zeros(n), "v": zero, "w": zero}
        outputs = evaluate(kernel("momentum"), inputs, n)
        self.S, self.S_rf = np.empty((len(eta), 6, 6)), outputs["S_rf"]
        rows, columns = np.triu_indices(6)
        self.S[:, rows, columns] = self.S[:, columns, rows] = outputs["S"]
        back = held.rotation.T
        self.frame_by_end = _twist_transform(back, -back @ held.position)
        self.frame_by_modes = np.zeros((len(eta), 6, n))
        if held.can_move:
            self.frame_by_end, self.frame_by_modes = _frame_twist(held, eta)

    def matrices(self, support: Support) -> Iterator[Array]:
        """Mass matrices (., m + n, m + n) over support speeds and modal speeds.

        The first matrix comes alone, the rest in chunks.  They are M(eta) of [v; w; etad] in frame
        axes, with the twist v, w of the frame expressed by both kinds of speeds.
        """
        m, n = support.speeds, len(self.Mff)
        twist = self.frame_by_end @ support.motion
        coupling = self.S @ self.frame_by_modes + self.S_rf
        corner = np.swapaxes(twist, -1, -2) @ self.S @ twist + support.inertia
        edge = np.swapaxes(twist, -1, -2) @ coupling
        for chunk in (slice(0, 1), *chunk_slices(len(self.S), (m + n) ** 2)):
            by_modes = self.frame_by_modes[chunk]
            modal = np.swapaxes(by_modes, 1, 2) @ coupling[chunk]
            blocks = np.empty((len(by_modes), m + n, m + n))
            blocks[:, :m, :m], blocks[:, :m, m:] = corner[chunk], edge[chunk]
            blocks[:, m:, :m] = np.swapaxes(edge[chunk], 1, 2)
            blocks[:, m:, m:] = modal + np.swapaxes(self.S_rf[chunk], 1, 2) @ by_modes + self.Mff
            yield blocks


def _frame_twist(held: ModalPort, eta: Array) -> tuple[Array, Array]:
    """Twist of the frame per twist of the held end (N, 6, 6) and per modal speed (N, 6, n)."""
    inputs = section_inputs(held)
    section = evaluate(kernel("section"), {**inputs, "eta": eta, "etad": 0 * eta}, eta.shape[1])
    section_outputs = {name: section[name] for name in ("x", "Psi", "xd", "Psid", "xdd", "Psidd")}
    inward = evaluate(kernel("frame_motion"), {**section_outputs, "R_end": held.rotation})
    return _twist_transform(inward["R"], inward["d"]), inward["H6"] @ section["Phi"]


def _twist_transform(rotation: Array, shift: Array) -> Array:
    """Transform (..., 6, 6) from the twist of an inboard point to that of an outboard one.

    `rotation` turns outboard axes to inboard axes; `shift` leads from the inboard to the outboard
    point, inboard axes, m.
    """
    inverse = np.swapaxes(rotation, -1, -2)
    transform = np.zeros((*rotation.shape[:-2], 6, 6))
    transform[..., :3, :3] = transform[..., 3:, 3:] = inverse
    x, y, z = (shift[..., k] for k in range(3))
    zero = np.zeros_like(x)
    cross = np.stack([zero, z, -y, -z, zero, x, y, -x, zero], axis=-1).reshape(*x.shape, 3, 3)
    transform[..., :3, 3:] = inverse @ cross
    return transform
