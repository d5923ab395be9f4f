"""Estimators of how far a flexible body left the validity range of its model.

Per body: slope kappa, spin ratio, stiffening gamma, share of the last shape function, bending
energy that the shape functions miss, coupling chi, shear. Thresholds and their reasons are given
next to the values.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from ...flexible.beam.beam_integrals import second_moments
from .momentum import modal_energy
from .motion import Motion, rotation_vectors, tilde, values_at

if TYPE_CHECKING:
    from ...flexible.beam.exact_sections import ExactSections
    from ...flexible.beam.section_ports import BeamShapes
    from ...flexible.modal_body import ModalBody


#: Quantity that the truncated part refers to: for a beam, and for an elastic body.
BENDING_ENERGY, DEFLECTION = "bending energy", "deflection of its ends"

#: Sections of a beam that are examined.
SECTION_COUNT = 33


def max_slope(motion: Motion) -> float:
    """Largest slope kappa = max |phi' eta| of the deflected axis relative to the frame.

    For an elastic body, the largest rotation of an end transverse to its frame.
    """
    return max((float(np.max(np.hypot(t[..., 1], t[..., 2]), initial=0.0))
                for t in _rotation_vectors(motion)), default=0.0)  # fmt: skip


def max_rotation(motion: Motion) -> float:
    """Largest rotation max |Psi| in rad of a section or an end in the frame, twist included."""
    return max((float(np.max(np.linalg.norm(t, axis=-1), initial=0.0))
                for t in _rotation_vectors(motion)), default=0.0)  # fmt: skip


def _rotation_vectors(motion: Motion) -> list[Array]:
    """Rotation vectors (n, m, 3) of sections along a beam, or of the ends of an elastic body."""
    body = motion.body
    if body.shapes is not None:
        positions = np.linspace(0.0, body.shapes.length, SECTION_COUNT)
        return [rotation_vectors(motion, positions)]
    return [np.einsum("ak,tk->ta", p.theta, motion.eta)[:, None] for p in body.ports.values()]


def has_second_order_terms(body: ModalBody) -> bool:
    """Whether the kinematics of a body include second-order displacements."""
    if body.exact is not None:
        return True
    return bool(np.any(body.G)) if body.shapes is None else bool(body.shapes.stiffening)


def transverse_spin(motion: Motion) -> float:
    """Largest spin in rad/s of the frame transverse to a beam; of other bodies, about any axis.

    Spin about a beam's own axis neither stretches nor bends it.
    """
    first = 1 if motion.body.shapes is not None else 0
    return float(
        np.max(np.linalg.norm(motion.frame_angular_velocity[:, first:], axis=1), initial=0.0)
    )


@dataclass(frozen=True)
class SecondOrder:
    """Moments of the second-order displacement, and its values at the ends.

    G (3, n, n) = int rho g_a, X (3, 3, n, n) = int rho r0_a g_b; displacement and rotation of
    second order (6, n, n) at the ends.
    """

    G: Array
    X: Array
    ends: dict[str, Array]


def second_order_moments(body: ModalBody) -> SecondOrder | None:
    """Second-order moments of a body; None if it has none.

    For a beam, those due to bending and twist, even if its kinematics neglect them.
    """
    if body.shapes is None or body.shapes.stiffening:
        ends = {name: port.second_order for name, port in body.ports.items()}
        has_terms = np.any(body.G) or any(np.any(g) for g in ends.values())
        return SecondOrder(body.G, body.X, ends) if has_terms or body.shapes is not None else None
    x, weights = body.shapes.rule()
    density = body.shapes.data.inertia[:, body.shapes.data.piece(x)]
    end_positions = np.array([port.position[0] for port in body.ports.values()])
    at_ends = body.shapes.second_order.field_at(end_positions)
    return SecondOrder(
        *second_moments(body.shapes, density, x, weights),
        dict(zip(body.ports, at_ends, strict=True)),
    )


def stiffness_from_loads(
    motion: Motion, gravity: Array, ports: dict[str, tuple[Array, Array]], second: SecondOrder
) -> Array:
    """Geometric stiffness K_g (n, modes, modes) of the loads on the undeformed body.

    K_g = - int rho (a - g)_a g_a + sum_ports F_a g_a(port) + M_a h_a(port), with the acceleration a
    = a_o + W r0 of the rigid motion, W = wd~ + w~ w~, and g, h the displacement and rotation of
    second order: for a beam (w_y^2 + w_z^2) G1 - a_x G0 + (end load, as a tension) G(L), and the
    work of transverse loads on its twist. `ports` are forces in N and moments in N*m (n, 3) on the
    ends, inertial axes.
    """
    force = motion.frame_acceleration - motion.inward(
        np.broadcast_to(gravity, motion.angular_velocity.shape)
    )
    spin = tilde(motion.frame_angular_velocity)
    frame_rotation_rate = tilde(motion.frame_angular_acceleration) + spin @ spin
    total = -np.tensordot(force, second.G, axes=1)
    total -= np.tensordot(frame_rotation_rate, second.X, axes=((1, 2), (1, 0)))
    for name, loads in ports.items():
        wrench = np.concatenate([motion.inward(load) for load in loads], axis=1)
        total += np.tensordot(wrench, second.ends[name], axes=1)
    return np.asarray(total)


def load_ratios(stiffness: Array, from_loads: Array) -> tuple[float, float]:
    """Smallest and largest eigenvalue of K^-1 K_g over the samples.

    gamma is the one of larger magnitude; at -1 the loads alone buckle the body.
    """
    whitened = np.linalg.inv(np.linalg.cholesky(stiffness))
    whitened_loads = whitened @ from_loads @ whitened.T
    values = np.linalg.eigvalsh((whitened_loads + np.swapaxes(whitened_loads, -1, -2)) / 2)
    return float(values.min(initial=0.0)), float(values.max(initial=0.0))


def last_shape_share(motion: Motion) -> tuple[float, str]:
    """Largest energy share of the last shape function of a family, and its name.

    Families are the mode names without their number: y, z, twist, axial. A family that always has
    less than a thousandth of the energy does not count, nor one with a single shape function.
    """
    energy = modal_energy(motion)
    total = float(np.max(energy.sum(axis=1), initial=0.0))
    families: dict[str, list[int]] = {}
    for k, name in enumerate(motion.body.modes):
        families.setdefault(name.rstrip("0123456789"), []).append(k)
    worst = (0.0, "")
    for members in families.values():
        family_energy = float(np.max(energy[:, members].sum(axis=1), initial=0.0))
        if len(members) < 2 or total <= 0 or family_energy < 1e-3 * total:
            continue
        share = float(np.max(energy[:, members[-1]], initial=0.0)) / family_energy
        worst = max(worst, (share, motion.body.modes[members[-1]]))
    return worst


def has_bending_shapes(body: ModalBody, plane: str) -> bool:
    """Whether a beam has shape functions of deflection along y or z."""
    return any(name.startswith(plane) for name in body.modes)


def gyration_radii(shapes: BeamShapes | ExactSections, x: Array) -> Array:
    """Radii of gyration (3, m) in m of the sections at x, about y and z in rows 1 and 2.

    Zero where unknown. From rotary inertia, else from E I / E A, else from half the polar inertia.
    """
    s = shapes.sections(x)
    radii = np.sqrt(s.rho_I / s.mass_per_length)
    if not shapes.data.rotary:
        for row, bending in ((1, s.EI_y), (2, s.EI_z)):
            has_axial_stiffness = s.EA > 0
            radii[row, has_axial_stiffness] = np.sqrt(
                bending[has_axial_stiffness] / s.EA[has_axial_stiffness]
            )
    return np.asarray(radii)


def max_strain(motion: Motion) -> float | None:
    """Largest strain of a beam; None if unknown.

    |s'| of the axis, and of the outermost fibre sqrt(3) r |curvature| where the radius of gyration
    r is known, as for a rectangle. For another body, the stretch of the lines between its ends,
    over their lengths.
    """
    body = motion.body
    if body.shapes is None:
        return _max_line_stretch(motion)
    x = np.linspace(0.0, body.shapes.length, SECTION_COUNT)
    values, radii = values_at(body.shapes, x), gyration_radii(body.shapes, x)
    if not values.axial_strain.any() and not radii[1:].any():
        return None
    strain = np.abs(np.einsum("mk,tk->tm", values.axial_strain, motion.eta))
    for row in (1, 2):
        curvature = np.einsum("mk,tk->tm", values.curvature[:, row], motion.eta)
        strain += np.sqrt(3.0) * radii[row] * np.abs(curvature)
    return float(np.max(strain, initial=0.0))


def _max_line_stretch(motion: Motion) -> float | None:
    """Largest relative change of the distance of two ends along their undeformed line."""
    stretches = []
    for a, b in combinations(motion.body.ports.values(), 2):
        line = b.position - a.position
        square = float(line @ line)
        if square > 0:
            stretch = np.einsum("a,ak,tk->t", line, b.phi - a.phi, motion.eta) / square
            stretches.append(float(np.max(np.abs(stretch), initial=0.0)))
    return max(stretches, default=None)


def shear_errors(body: ModalBody, line: float | None = None) -> Array | None:
    """Relative frequency error (n,) of each bending shape function of a beam without shear.

    Also without rotary inertia where the model has none; 0 for other shape functions and with
    shear; None where the section's radius of gyration is unknown.

    1/2 (beta r)^2 (E/(k G) + 1) of Timoshenko's correction: beta the wave number of the shape
    function in 1/m, r the radius of gyration in m; the 1 is rotary inertia. `line` (m) is the
    length of the beams that are welded in line with it: the same number of shape functions is then
    assessed on that whole length.
    """
    shapes = body.shapes
    if body.exact is not None:
        return _shear_errors_of_strains(body, body.exact)
    if shapes is None:
        return None
    if shapes.data.has_shear:
        return np.zeros(body.n)
    x, weights = shapes.rule()
    errors, is_known = np.zeros(body.n), False
    for plane, axis in (("y", 2), ("z", 1)):
        mode_indices = [k for k, name in enumerate(body.modes) if name.startswith(plane)]
        gyration = float(np.max(gyration_radii(shapes, x)[axis]))
        if not mode_indices or not gyration > 0:
            continue
        phi, bending = (
            values_at(shapes, x).phi[:, "xyz".index(plane)],
            values_at(shapes, x).curvature[:, axis],
        )
        squares = (weights @ bending[:, mode_indices] ** 2) / (weights @ phi[:, mode_indices] ** 2)
        wave_number_squared = np.sqrt(squares)  # int phi''^2 / int phi^2 = beta^4
        wave_number_squared *= (shapes.length / line) ** 2 if line else 1.0
        errors[mode_indices] = (
            0.5 * wave_number_squared * gyration**2 * (_SHEAR_RATIO + float(not shapes.data.rotary))
        )
        is_known = True
    return errors if is_known else None


def _shear_errors_of_strains(body: ModalBody, exact: ExactSections) -> Array | None:
    """The same for strain shapes; K / M = EI / rho A beta^4 of each shape alone."""
    x = np.linspace(0.0, exact.length, SECTION_COUNT)
    sections, radii, errors = exact.sections(x), gyration_radii(exact, x), np.zeros(body.n)
    for plane, row, bending in (("y", 2, sections.EI_z), ("z", 1, sections.EI_y)):
        indices = [k for k, name in enumerate(body.modes) if name.startswith(plane)]
        gyration = float(radii[row].max())
        if not indices or not gyration > 0:
            continue
        ratio = np.mean(sections.mass_per_length) / np.mean(bending)
        squares = np.sqrt(ratio * np.diag(body.K)[indices] / np.diag(body.Mff)[indices])
        rotary = float(not exact.data.rotary)
        errors[indices] = 0.5 * squares * gyration**2 * (_SHEAR_RATIO + rotary)
    return errors if errors.any() else None


def weighted_shear_error(motion: Motion, line: float | None = None) -> float | None:
    """Largest shear error, each weighted by the largest energy share of its shape function.

    Shape functions that do not move cause no error.
    """
    errors = shear_errors(motion.body, line)
    if errors is None or not len(motion.t):
        return errors if errors is None else 0.0
    energies = modal_energy(motion)
    max_energy = float(energies.sum(axis=1).max())
    if not max_energy > 0:
        return 0.0
    return float(np.max(np.clip(energies.max(axis=0) / max_energy, 0.0, 1.0) * errors))


#: E / (k G) of a rectangular section, nu = 0.3, k = 5/6.
_SHEAR_RATIO = 2 * (1 + 0.3) * 6 / 5
