"""Momentum of bodies, rigid-body equivalent velocities, and energies by modes.

V_RB = p / m and w_RB = I_G^-1 L_G: velocity and spin of the undeformed body in a rigid motion with
the same momentum p and angular momentum L_G about the mass centre. For any choice of the floating
frame, V_RB is the velocity of the mass centre; in free flight V_RB follows gravity, and w_RB is the
steady part of the rotation, while frames oscillate with the vibration.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ...engine.looped_engine import symmetric_matrices
from ...flexible.modal_body import kernel, moment_inputs
from ...kernels.numpy_kernels import evaluate
from .motion import Motion, tilde

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody
    from ...flexible.modal_parts import MassPoint, Station
    from .motion import Motion
    from .section_loads import FlexibleBodies


def modal_mass(body: ModalBody) -> Array:
    """Modal mass matrix (n, n), int rho phi . phi in kg; for mass points, their sum."""
    if not body.points:
        return np.einsum("aakl->kl", body.F)
    total = np.zeros_like(body.K)
    for point in body.points:
        phi, theta = point.port.phi, point.port.theta
        total += point.mass * phi.T @ phi + theta.T @ point.inertia @ theta
    return total


def strain_shares(motion: Motion) -> Array:
    """Strain energy (n, modes) in J by mode, 1/2 eta_k (K eta)_k; the sum is the strain energy."""
    return 0.5 * motion.eta * (motion.eta @ motion.body.K)


def modal_energy(motion: Motion) -> Array:
    """Energy (n, modes) in J by mode: strain energy plus kinetic energy in the floating frame.

    1/2 eta_k (K eta)_k + 1/2 etad_k (M etad)_k.
    """
    kinetic = 0.5 * motion.etad * (motion.etad @ modal_mass(motion.body))
    return strain_shares(motion) + kinetic


def strain_energy(motion: Motion) -> Array:
    """Strain energy (n,) in J, 1/2 eta^T K eta."""
    return strain_shares(motion).sum(axis=1)


def modal_frequencies(body: ModalBody) -> Array:
    """Modal frequencies (n,) in rad/s with a fixed floating frame, ascending.

    Zeros where the modal mass cannot be distinguished from rounding.
    """
    try:
        lower = np.linalg.cholesky(modal_mass(body))
        half = np.linalg.solve(lower, body.K)
        squares = np.linalg.eigvalsh(np.linalg.solve(lower, half.T))
    except np.linalg.LinAlgError:
        squares = np.zeros(body.n)
    return np.sqrt(np.maximum(squares, 0.0))


#: Moments of inertia below this part of the largest count as zero.
_ZERO_INERTIA_RATIO = 1e-12


@dataclass(frozen=True)
class Momentum:
    """Momentum of one body over n samples, inertial axes.

    linear (n, 3) kg*m/s, angular (n, 3) kg*m2/s about the mass centre, the centre (n, 3) m,
    equivalent velocity (n, 3) m/s and spin (n, 3) rad/s.
    """

    linear: Array
    angular: Array
    center: Array
    velocity: Array
    angular_velocity: Array


class Momenta:
    """Momenta of bodies, computed on first use."""

    def __init__(self, flexible: FlexibleBodies) -> None:
        self.flexible, self.observations = flexible, flexible.observations
        self._momentum_by_name: dict[str, Momentum] = {}

    def body_momentum(self, name: str) -> Momentum:
        """Momentum of one body; SceneError for an unknown body, and for one without mass."""
        references = self.observations.references
        canonical_name = references.canonical(name)
        if canonical_name is None or references.bodies.find(canonical_name) is None:
            raise SceneError(self.observations.references.unknown(name))
        if canonical_name not in self._momentum_by_name:
            compute = (
                self._flexible_momentum
                if canonical_name in self.flexible.modal_bodies
                else self._rigid_momentum
            )
            self._momentum_by_name[canonical_name] = compute(canonical_name)
        return self._momentum_by_name[canonical_name]

    def _rigid_momentum(self, name: str) -> Momentum:
        """Momentum of a rigid body from its inertia matrix and its own motion."""
        mass, center, inertia = self._inertia(name)
        points = self.observations.node(name)
        rotation = points[:, 15:24].reshape(-1, 3, 3)
        spin, arm = points[:, 9:12], rotation @ center
        velocity = points[:, 3:6] + np.cross(spin, arm)
        angular = np.einsum("tij,jk,tlk,tl->ti", rotation, inertia, rotation, spin)
        return Momentum(mass * velocity, angular, points[:, 0:3] + arm, velocity, spin)

    def _inertia(self, name: str) -> tuple[float, Array, Array]:
        """Mass, mass centre and inertia about it in the user's axes.

        Evaluated by the kernel from which the engine obtains them.
        """
        engine = self.observations.unmerged_observations.engine
        body_index, axes, offset = engine.packed.end(name)
        body = engine.packed.system.body(body_index)
        matrix = engine.inertia_matrix(body.body, (*body.body_p, *body.body_frame))
        mass = float(matrix[0, 0])
        if not mass > 0:
            raise SceneError(f'"{name}": a body without mass has no equivalent velocity')
        return mass, *shift_inertia(matrix, np.array(axes).reshape(3, 3), np.array(offset))

    def _flexible_momentum(self, name: str) -> Momentum:
        motion = self.flexible.motion(name)
        if motion.body.points or motion.body.stations:
            return self._point_momentum(motion)
        linear, about_origin, first = frame_momentum(motion)
        return equivalent_momentum(motion, linear, about_origin, first / motion.body.mass)

    def _point_momentum(self, motion: Motion) -> Momentum:
        """Momentum of a body with mass points or stations, summed over them."""
        name = motion.body.name
        slices: dict[str, MassPoint | Station] = {
            f"{name}/point {k}": piece for k, piece in enumerate(motion.body.points, 1)
        }
        slices |= {
            f"{name}/station {k}": piece
            for k, piece in enumerate(motion.body.stations, 1)
            if piece.mass
        }
        parts = [self._rigid_momentum(node) for node in slices]
        linear = np.sum([part.linear for part in parts], axis=0)
        angular = np.sum([part.angular for part in parts], axis=0)
        first = np.zeros_like(linear)
        for part, point in zip(parts, slices.values(), strict=True):
            arm = part.center - motion.position
            angular = angular + np.cross(arm, part.linear)
            first += point.mass * arm
        center = first / sum(point.mass for point in slices.values())
        inward = motion.inward
        return equivalent_momentum(motion, inward(linear), inward(angular), inward(center))


def shift_inertia(matrix: Array, axes: Array, offset: Array) -> tuple[Array, Array]:
    """Mass centre (3,) and inertia (3, 3) about it in the user's axes.

    `matrix` is an inertia matrix in the engine's axes; `axes` (3, 3) and `offset` (3,) are those of
    a probe of the user's axes.
    """
    mass = matrix[0, 0]
    center = np.array([matrix[5, 1], matrix[3, 2], matrix[4, 0]]) / mass
    inertia = matrix[3:, 3:] + mass * (tilde(center) @ tilde(center))
    return axes.T @ (center - offset), axes.T @ inertia @ axes


def equivalent_momentum(
    motion: Motion, linear: Array, about_origin: Array, center: Array
) -> Momentum:
    """Momentum with equivalent velocity and spin, from sums in frame axes.

    `linear` is the momentum (n, 3), `about_origin` the moment of momentum about the frame's origin
    and `center` the mass centre. About an axis without inertia (that of a beam without polar
    inertia) the spin is zero.
    """
    mass, inertia = undeformed_inertia(motion.body)
    angular = about_origin - np.cross(center, linear)
    spin = angular @ np.linalg.pinv(inertia, rcond=_ZERO_INERTIA_RATIO, hermitian=True)
    outward = motion.outward
    return Momentum(
        outward(linear),
        outward(angular),
        motion.position + outward(center),
        outward(linear) / mass,
        outward(spin),
    )


def undeformed_inertia(body: ModalBody) -> tuple[float, Array]:
    """Mass, and inertia (3, 3) about the mass centre of the undeformed body, frame axes."""
    mass, first, second, point_inertia = body.mass, body.first, body.second, np.zeros((3, 3))
    if body.points:
        mass = sum(p.mass for p in body.points)
        first = sum((p.mass * p.port.position for p in body.points), np.zeros(3))
        second = sum(
            (p.mass * np.outer(p.port.position, p.port.position) for p in body.points),
            np.zeros((3, 3)),
        )
        point_inertia = sum((p.inertia for p in body.points), np.zeros((3, 3)))
    center = first / mass
    inner = second - mass * np.outer(center, center)
    return mass, np.trace(inner) * np.eye(3) - inner + point_inertia


#: Numbers in one batch of samples, about 30 MB per array.
_MAX_BATCH_NUMBERS = 2**22


def frame_momentum(motion: Motion) -> tuple[Array, Array, Array]:
    """Momentum, moment of momentum and first mass moment (n, 3) each, frame axes.

    Units kg*m/s, kg*m2/s about the frame's origin and kg*m; evaluated by the kernel `momentum`.
    """
    body, parts = motion.body, []
    rows = max(1, _MAX_BATCH_NUMBERS // max(1, body.n**2 * 8))
    for first in range(0, len(motion.t), rows):
        samples = slice(first, first + rows)
        inputs = {
            **moment_inputs(body), "eta": motion.eta[samples], "etad": motion.etad[samples],
            "v": motion.frame_velocity[samples], "w": motion.frame_angular_velocity[samples],
        }  # fmt: skip
        outputs = evaluate(kernel("momentum"), inputs, body.n)
        parts.append(np.concatenate([outputs["h"], outputs["S"]], axis=1))
    sums = np.concatenate(parts) if parts else np.zeros((0, 27))
    inertia = symmetric_matrices(sums[:, 6:])
    moment = np.stack([inertia[:, 5, 1], inertia[:, 3, 2], inertia[:, 4, 0]], axis=1)
    return sums[:, :3], sums[:, 3:6], moment
