"""Motion of a flexible body over a run: floating frame, modal coordinates, sections.

The first array axis is time. A section at x of a beam is displaced by r0 + phi eta - 1/2 eta^T g
eta in the floating frame and rotated by exp(Psi~), Psi = theta eta - 1/2 eta^T h eta (the kernel
`section`). With s the axial and v, w the transverse displacements, to first order Psi = (twist,
-w', v').
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array, finite_array
from mstmm.errors import SceneError

if TYPE_CHECKING:
    from ...flexible.beam.exact_sections import ExactSections
    from ...flexible.beam.section_ports import BeamShapes
    from ...flexible.beam.shape_fields import ShapeValues
    from ...flexible.modal_body import ModalBody

#: Relative length by which a section may exceed the ends: rounding of the user's numbers.
_LENGTH_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Motion:
    """Motion of one flexible body over n samples.

    Attributes:
        body: its modal data.
        t: (n,) s.
        eta, etad, etadd: (n, modes) modal coordinates, speeds and accelerations.
        position: (n, 3) m, origin of the floating frame, inertial axes.
        rotation: (n, 3, 3), frame axes to inertial axes.
        velocity, angular_velocity: (n, 3) m/s and rad/s, of the frame, inertial axes.
        acceleration, angular_acceleration: (n, 3) m/s2 and rad/s2, of the frame, inertial axes.
    """

    body: ModalBody
    t: Array
    eta: Array
    etad: Array
    etadd: Array
    position: Array
    rotation: Array
    velocity: Array
    angular_velocity: Array
    acceleration: Array
    angular_acceleration: Array

    @classmethod
    def of_points(
        cls, body: ModalBody, t: Array, modal: tuple[Array, Array, Array], points: Array
    ) -> Motion:
        """Motion from (eta, etad, etadd) and the motion (n, 24) of the frame, see `Observation`."""
        return cls(
            body, t, *modal, points[:, 0:3], points[:, 15:24].reshape(-1, 3, 3), points[:, 3:6],
            points[:, 9:12], points[:, 6:9], points[:, 12:15],
        )  # fmt: skip

    def select_samples(self, samples: Any) -> Motion:
        """Motion at some of the samples: a slice or indices."""
        arrays = {f.name: getattr(self, f.name)[samples] for f in fields(self) if f.name != "body"}
        return Motion(self.body, **arrays)

    @property
    def shapes(self) -> BeamShapes:
        """Shape functions along the axis of a beam; SceneError for a body without any."""
        return shapes_of(self.body, "a quantity along its axis")

    @property
    def length(self) -> float:
        """Length of a beam, m."""
        return axis_of(self.body, "a quantity along its axis").length

    # --- floating frame in its own axes ---------------------------------------------------------

    def inward(self, vectors: Array) -> Array:
        """Frame components of inertial components (n, 3) or (n, m, 3)."""
        return np.einsum("tji,t...j->t...i", self.rotation, vectors)

    def outward(self, vectors: Array) -> Array:
        """Inertial components of frame components (n, 3) or (n, m, 3)."""
        return np.einsum("tij,t...j->t...i", self.rotation, vectors)

    @cached_property
    def frame_velocity(self) -> Array:
        """Velocity (n, 3) in m/s of the frame's origin, frame axes."""
        return self.inward(self.velocity)

    @cached_property
    def frame_angular_velocity(self) -> Array:
        """Angular velocity (n, 3) in rad/s of the frame, frame axes."""
        return self.inward(self.angular_velocity)

    @cached_property
    def frame_acceleration(self) -> Array:
        """Acceleration (n, 3) in m/s2 of the frame's origin, frame axes."""
        return self.inward(self.acceleration)

    @cached_property
    def frame_angular_acceleration(self) -> Array:
        """Angular acceleration (n, 3) in rad/s2 of the frame, frame axes."""
        return self.inward(self.angular_acceleration)


# --- sections along a beam ------------------------------------------------------------------------


def axis_of(body: ModalBody, what: str) -> BeamShapes | ExactSections:
    """Sections along the axis of a beam; SceneError for a body without an axis."""
    axis = body.exact or body.shapes
    if axis is None:
        raise SceneError(
            f'"{body.name}": {what} exists along beams only; for this elastic body use '
            "the position of its ends and modal_energy"
        )
    return axis


def shapes_of(body: ModalBody, what: str) -> BeamShapes:
    """Shape functions of a second-order beam; SceneError for other bodies."""
    if body.exact is not None:
        raise SceneError(f'"{body.name}": {what} exists for second-order beams only')
    axis_of(body, what)
    assert body.shapes is not None
    return body.shapes


def checked_stations(body: ModalBody, x: ArrayLike, what: str) -> Array:
    """Positions x in m as (m,); SceneError for a position off the beam or not a number."""
    length = float(axis_of(body, what).length)
    positions = np.atleast_1d(finite_array(f'{what} of "{body.name}": x', x))
    if positions.ndim != 1:
        raise SceneError(f"{what}: x has shape {positions.shape}, expected one number or (m,)")
    is_off_beam = ~(
        (positions >= -_LENGTH_TOLERANCE * length) & (positions <= length * (1 + _LENGTH_TOLERANCE))
    )
    if is_off_beam.any():
        raise SceneError(
            f'{what} of "{body.name}": x = {positions[is_off_beam][0]:g} m is not on the beam; '
            f"expected 0 to {length:g} m"
        )
    return np.asarray(np.clip(positions, 0.0, length))


def values_at(shapes: BeamShapes, positions: Array) -> ShapeValues:
    """Values of the shape functions at x (m,), cached unless there are too many."""
    if len(positions) * shapes.n > _MAX_CACHED_VALUES:
        return shapes.values_at(positions)
    return _cached_values(shapes, np.ascontiguousarray(positions, dtype=np.float64).tobytes())


#: Largest number of cached shape function values at sections.
_MAX_CACHED_VALUES = 2**17


@lru_cache(maxsize=16)
def _cached_values(shapes: BeamShapes, positions: bytes) -> ShapeValues:
    return shapes.values_at(np.frombuffer(positions))


def deflection(motion: Motion, positions: Array) -> Array:
    """Elastic displacement (n, m, 3) in m of the axis at x, frame axes, second order included."""
    if motion.body.exact is not None:
        return local_axis(motion, positions) - axis_at_rest(motion, positions)
    first = first_order_field(values_at(motion.shapes, positions).phi, motion.eta)
    return first - 0.5 * second_order_motion(motion, positions, "eta", "eta")[..., :3]


def rotation_vectors(motion: Motion, positions: Array) -> Array:
    """Rotation vectors (n, m, 3) in rad of the sections in the frame, second order included.

    To first order twist, -psi_w, psi_v.
    """
    first = first_order_field(values_at(motion.shapes, positions).theta, motion.eta)
    return first - 0.5 * second_order_motion(motion, positions, "eta", "eta")[..., 3:]


def section_rotation_matrices(motion: Motion, positions: Array) -> Array:
    """Rotations (n, m, 3, 3) of the sections at x, section axes to frame axes."""
    if motion.body.exact is not None:
        return motion.body.exact.poses(motion.eta, positions)[0]
    return section_rotations(rotation_vectors(motion, positions))


def first_order_field(field: Array, modal: Array) -> Array:
    """Field (n, m, 3) from (m, 3, modes) and modal coordinates or their rates (n, modes)."""
    flat = field.reshape(-1, field.shape[-1])
    return np.asarray((modal @ flat.T).reshape(len(modal), *field.shape[:-1]))


def second_order_motion(
    motion: Motion, positions: Array, a: str, b: str, carried: bool = False
) -> Array:
    """Second-order displacement and rotation (n, m, 6) at x: a^T g b.

    `a` and `b` are among eta, etad and etadd. Zeros for a linear beam; `carried` as in
    `SecondOrder`.
    """
    if not motion.shapes.stiffening:
        return np.zeros((len(motion.t), len(positions), 6))
    field = motion.shapes.second_order
    return field.evaluate(positions, getattr(motion, a), getattr(motion, b), carried)


def slope(motion: Motion, positions: Array) -> Array:
    """Rotations (n, m, 2) of sections, psi_v and psi_w, in the frame; v' and w' without shear.

    Of an exact beam they are the components of the section's normal along y and z: sines.
    """
    if motion.body.exact is not None:
        return section_rotation_matrices(motion, positions)[:, :, 1:, 0]
    rotation = rotation_vectors(motion, positions)
    return np.stack([rotation[:, :, 2], -rotation[:, :, 1]], axis=2)


def curvature(motion: Motion, positions: Array) -> Array:
    """Curvature (n, m, 2) in 1/m about y, -w'', and about z, v''."""
    if motion.body.exact is not None:
        return motion.body.exact.strains(motion.eta, positions)[..., 4:]
    curvature_of_modes = values_at(motion.shapes, positions).curvature[:, 1:]
    return np.einsum("mak,tk->tma", curvature_of_modes, motion.eta)


def strain(motion: Motion, positions: Array) -> Array:
    """Strains (n, m, 6) of an exact beam beyond those at rest; SceneError for other bodies."""
    if motion.body.exact is None:
        raise SceneError(
            f'"{motion.body.name}": strain exists for beams with kinematics = "exact" only; '
            "use curvature"
        )
    return motion.body.exact.strains(motion.eta, positions)


def deflected_axis(motion: Motion, positions: Array) -> Array:
    """Inertial positions (n, m, 3) in m of the deflected axis."""
    local = local_axis(motion, positions)
    return motion.position[:, None, :] + motion.outward(local)


def axis_at_rest(motion: Motion, positions: Array) -> Array:
    """Positions (m, 3) in m of the axis at rest, frame axes."""
    if motion.body.exact is not None:
        return motion.body.exact.poses(np.zeros((1, motion.body.n)), positions)[1][0]
    at_rest = np.zeros((len(positions), 3))
    at_rest[:, 0] = positions
    return at_rest


def local_axis(motion: Motion, positions: Array) -> Array:
    """Positions (n, m, 3) in m of the deflected axis, frame axes."""
    if motion.body.exact is not None:
        return motion.body.exact.poses(motion.eta, positions)[1]
    return axis_at_rest(motion, positions) + deflection(motion, positions)


def section_rotations(turned: Array) -> Array:
    """Rotations (..., 3, 3), exp(Psi~), of rotation vectors (..., 3), section to frame axes.

    1 + sinc(t) Psi~ + 1/2 sinc(t/2)^2 Psi~ Psi~, t = |Psi|: no special case for small angles.
    """
    angle = np.linalg.norm(turned, axis=-1)[..., None, None]
    skew = tilde(turned)
    first = np.sinc(angle / np.pi) * skew
    second = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (skew @ skew)
    return np.asarray(np.eye(3) + first + second)


def tilde(v: Array) -> Array:
    """Cross-product matrices (..., 3, 3) of v (..., 3)."""
    zero = np.zeros(v.shape[:-1])
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    rows = [zero, -z, y, z, zero, -x, -y, x, zero]
    return np.stack(rows, axis=-1).reshape(*v.shape[:-1], 3, 3)


def elastic_moment(motion: Motion, positions: Array) -> Array:
    """Bending moments (n, m, 2) in N*m of the curvature of the shapes, about y and about z."""
    sections = axis_of(motion.body, "bending_moment").sections(positions)
    stiffness = np.stack([sections.EI_y, sections.EI_z], axis=1)
    return curvature(motion, positions) * stiffness


def elastic_force(motion: Motion, positions: Array) -> Array:
    """Axial force (n, m), EA s' in N, of the axial shapes; SceneError for a beam without them."""
    exact = motion.body.exact
    if exact is not None and "axial" in exact.shapes.coefficients:
        stretch = exact.strains(motion.eta, positions)[..., 0]
        return np.asarray(stretch * exact.sections(positions).EA)
    values = None if exact is not None else values_at(motion.shapes, positions)
    if values is None or not values.axial_strain.any():
        raise SceneError(
            f'axial_force of "{motion.body.name}" from its shapes: it has no axial modes; '
            'use source = "equilibrium"'
        )
    stretch = np.einsum("mk,tk->tm", values.axial_strain, motion.eta)
    return np.asarray(stretch * motion.shapes.sections(positions).EA)
