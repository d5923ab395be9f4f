"""Positive definiteness of the mass matrix of a stiffened body over the range of its model.

The mass matrix M(eta) of `derive.flexible.modal_residual` is cut off after second order, so that it
is definite only for moderate deflections: where the shapes represent nearly all inertia, terms in
eta soon exceed the rest.  The check evaluates M(eta) with the generated kernels for many
deflections whose sections rotate as far as the model is valid, for the motions that the support
allows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.scene.checks.flexible_bodies import free_axes
from mstmm.scene.checks.topology import inboard_hinges_by_body
from mstmm.scene.tables.beam import ROOT, Beam
from mstmm.scene.tables.hinge_frames import initial_motion_axes
from mstmm.scene.validators.scalars_and_vectors import GROUND

from ..kernels.numpy_kernels import evaluate
from .modal_body import kernel, modal_sizes, moment_inputs, section_inputs
from .modal_parts import chunk_slices

if TYPE_CHECKING:
    from mstmm.scene import Body, Hinge, Scene

    from .modal_body import ModalBody
    from .modal_parts import ModalPort


# --- motion that the supports of a body permit ----------------------------------------------------


@dataclass(frozen=True)
class Support:
    """Possible motions of the inboard end, and the inertia of what moves with it.

    The twist (v, w; end axes) of the end is `motion` (6, m) times m speeds; the inboard bodies
    have the `inertia` (m, m) for these speeds: kg, kg m, kg m^2.
    """

    motion: Array
    inertia: Array

    @property
    def speeds(self) -> int:
        """Number of speeds."""
        return int(self.motion.shape[1])


#: An end with six free motions, and no known inertia inboard.
ANY = Support(np.eye(6), np.zeros((6, 6)))
#: An end whose motion is prescribed.
RESTING = Support(np.zeros((6, 0)), np.zeros((0, 0)))

#: Largest number of inboard rigid bodies included; the next one counts as free to move.
_MAX_BODIES = 6


class Supports:
    """Supports of the flexible bodies of a scene."""

    def __init__(self, scene: Scene) -> None:
        self._inboard_hinges = inboard_hinges_by_body(scene)
        self._bodies = {body.name: body for body in scene.body if body.type == "rigid"}
        self._beams = {beam.name: beam for beam in scene.beam}
        self._outboard_hinges: dict[str, list[Hinge]] = {}
        for hinge in self._inboard_hinges.values():
            self._outboard_hinges.setdefault(hinge.inboard_body, []).append(hinge)
        self._released = {event.hinge for event in scene.event if event.hinge}

    def support_of(self, name: str) -> Support:
        """Support of a flexible body: its inboard hinge and rigid bodies.

        They are followed up to the ground or to another flexible body.
        """
        hinge = self._inboard_hinges.get(name)
        return ANY if hinge is None else self._hinge_support(hinge)

    def own_support(self, name: str) -> Support:
        """Support of a flexible body by its inboard hinge alone, whose inboard side rests."""
        hinge = self._inboard_hinges.get(name)
        motions = None if hinge is None else self._free_motions(hinge)
        if hinge is None or motions is None:
            return ANY
        return Support(motions, _rotor_inertia(hinge, motions))

    def _hinge_support(self, hinge: Hinge, followed: int = 0) -> Support:
        """Support at the outboard end of a hinge, its axes, `followed` bodies inboard."""
        motions = self._free_motions(hinge)
        if motions is None or followed > _MAX_BODIES:
            return ANY
        inboard = self._body_support(hinge.inboard_body, followed)
        inboard_body = self._bodies.get(hinge.inboard_body)
        pose = _ORIGIN if inboard_body is None else _end_pose(inboard_body, hinge.inboard_end)
        transform = _hinge_transform(*pose, hinge)
        return Support(
            np.concatenate([transform @ inboard.motion, motions], axis=1),
            _block_diagonal(inboard.inertia, _rotor_inertia(hinge, motions)),
        )

    def _body_support(self, name: str, followed: int) -> Support:
        """Support at the origin of a rigid body, its axes, with the inertia of the body."""
        if name == GROUND:
            return RESTING
        body, hinge = self._bodies.get(name), self._inboard_hinges.get(name)
        if body is None:
            return ANY
        support = ANY
        if hinge is not None and not hinge.outboard_end:
            support = self._hinge_support(hinge, followed + 1)
        inertia = support.motion.T @ _spatial_inertia(body) @ support.motion
        return Support(support.motion, support.inertia + inertia)

    def hanging_inertia(self, name: str, end: str, followed: int = 0) -> Array:
        """Inertia (6, 6) of what hangs on an end of a flexible body, its axes, at q = 0.

        Beams count as rigid rods.  Speeds that a hinge leaves free move without effort.
        """
        total = np.zeros((6, 6))
        for hinge in self._outboard_hinges.get(name, ()):
            if (hinge.inboard_end or ROOT) == end and followed <= _MAX_BODIES:
                total += self._inertia_behind(hinge, _ORIGIN, followed)
        return total

    def _inertia_behind(
        self, hinge: Hinge, inboard_end: tuple[Array, Array], followed: int
    ) -> Array:
        """Inertia (6, 6) outboard of a hinge at an end with that pose, about the pose's origin."""
        name = hinge.outboard_body
        carrier = self._bodies.get(name) or self._beams.get(name)
        if carrier is None:
            return np.zeros((6, 6))
        inertia = _rod_inertia(carrier) if isinstance(carrier, Beam) else _spatial_inertia(carrier)
        for other in self._outboard_hinges.get(name, ()):
            if followed < _MAX_BODIES:
                pose = _end_pose(carrier, other.inboard_end)
                inertia += self._inertia_behind(other, pose, followed + 1)
        back = _twist_at_origin(*_end_pose(carrier, hinge.outboard_end))
        inertia = back.T @ inertia @ back
        free = self._free_motions(hinge)
        if free is not None and free.shape[1]:
            response = np.linalg.pinv(free.T @ inertia @ free, hermitian=True)
            inertia -= inertia @ free @ response @ free.T @ inertia
        transform = _hinge_transform(*inboard_end, hinge)
        return np.asarray(transform.T @ inertia @ transform)

    def _free_motions(self, hinge: Hinge) -> Array | None:
        """Free motions (6, m) of a hinge, outboard axes; None if they are not known."""
        if hinge.is_released or hinge.name in self._released:
            return None
        if _is_prescribed(hinge):
            return np.zeros((6, 0))
        facts, motions = hinge.facts, initial_motion_axes(hinge)
        if facts is None or motions is None or not facts.in_place:
            return None
        if facts.slides and (facts.turns or not facts.constant_subspace):
            return None
        if facts.slides:
            directions = np.array([translation for translation, _ in motions]).T
            return np.concatenate([directions, np.zeros_like(directions)])
        axes = np.array(free_axes(hinge)).reshape(-1, 3).T
        return np.concatenate([np.zeros_like(axes), axes])


def _is_prescribed(hinge: Hinge) -> bool:
    is_driven = hinge.drive is not None and all(entry is not None for entry in hinge.drive)
    return hinge.is_weld or is_driven


def _rotor_inertia(hinge: Hinge, motion: Array) -> Array:
    """Rotor inertia (m, m) of a hinge; zero unless given for each of its free motions."""
    inertia = np.array(hinge.law.inertia, dtype=float)
    return np.diag(inertia if len(inertia) == motion.shape[1] else np.zeros(motion.shape[1]))


def _block_diagonal(first: Array, second: Array) -> Array:
    matrix = np.zeros((len(first) + len(second),) * 2)
    matrix[: len(first), : len(first)], matrix[len(first) :, len(first) :] = first, second
    return matrix


#: Pose of an end that is the origin of its body.
_ORIGIN = np.zeros(3), np.eye(3)


def _end_pose(body: Body | Beam, end: str) -> tuple[Array, Array]:
    """Position and rotation of an end in the axes of its body."""
    end = end or (ROOT if ROOT in body.ends else "")
    if not end:
        return _ORIGIN
    return np.array(body.ends[end].position), np.array(body.ends[end].rotation)


def _twist_at_origin(position: Array, rotation: Array) -> Array:
    """Transform (6, 6) from the twist of an end of a body to that of the body's origin."""
    transform = np.zeros((6, 6))
    transform[:3, :3] = transform[3:, 3:] = rotation
    transform[:3, 3:] = _cross_matrix(position) @ rotation
    return transform


def _rod_inertia(beam: Beam) -> Array:
    """Spatial inertia (6, 6) of a beam as a uniform rigid rod, about its root."""
    lever = _cross_matrix(np.array([beam.length / 2, 0.0, 0.0]))
    inertia = np.zeros((6, 6))
    inertia[:3, :3] = beam.mass * np.eye(3)
    inertia[:3, 3:], inertia[3:, :3] = -beam.mass * lever, beam.mass * lever
    inertia[4, 4] = inertia[5, 5] = beam.mass * beam.length**2 / 3
    return inertia


def _hinge_transform(end_position: Array, end_rotation: Array, hinge: Hinge) -> Array:
    """Transform (6, 6) from the twist of the inboard body to that of the hinge's outboard end.

    At q = 0, from the body's origin and axes to those of the hinge's outboard end; the pose is that
    of the hinge's inboard end.
    """
    lever = end_position + end_rotation @ np.array(hinge.position)
    inverse = (end_rotation @ np.array(hinge.rotation)).T
    transform = np.zeros((6, 6))
    transform[:3, :3] = transform[3:, 3:] = inverse
    transform[:3, 3:] = -inverse @ _cross_matrix(lever)
    return transform


def _spatial_inertia(body: Body) -> Array:
    """Spatial inertia (6, 6) of a rigid body about its origin, its axes."""
    lever = _cross_matrix(np.array(body.center_of_mass))
    inertia = np.zeros((6, 6))
    inertia[:3, :3] = body.mass * np.eye(3)
    inertia[:3, 3:], inertia[3:, :3] = -body.mass * lever, body.mass * lever
    inertia[3:, 3:] = np.array(body.inertia_matrix) - body.mass * lever @ lever
    return inertia


def _cross_matrix(vector: Array) -> Array:
    """Matrix (3, 3) of the cross product with a vector."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


# --- mass matrices --------------------------------------------------------------------------------

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
