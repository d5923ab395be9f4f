"""Validity range of flexible bodies: how far a run stayed within it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.scene.checks.flexible_bodies import beam_lines

from ...flexible.modal_body import radius_of_gyration
from ...flexible.modal_parts import chunk_slices
from . import range_estimators as e
from .missing_shapes import (
    UnshapedDeformation,
    lateral_load_ratio,
    quadrature_rule,
    unshaped_deformation,
)
from .modal_participation import participation_by_body
from .momentum import modal_energy, modal_frequencies, strain_energy
from .motion import elastic_moment, tilde
from .section_loads import section_loads

if TYPE_CHECKING:
    from .motion import Motion
    from .section_loads import FlexibleBodies


#: Largest numbers of samples and of flexible bodies that are examined.
MAX_SAMPLES, MAX_BODIES = 160, 400

#: Slopes below this are rounding; the shape functions are then not assessed.
_ZERO_SLOPE = 1e-9

#: Coordinates, rates and accelerations above this are not assessed.
_MAX_MAGNITUDE = 1e50


@dataclass(frozen=True)
class ModelRange:
    """Range of validity measures of one flexible body over the samples of a run.

    Attributes:
        name, modes, frame: of the body.
        stiffening: whether its kinematics include second-order displacements.
        slope: kappa, the largest slope relative to its floating frame; the frame error is up to
            kappa^2 / 2.
        turn: rad, largest rotation of a section relative to the frame, twist included.
        first_frequency: rad/s of its shape functions, with a fixed frame.
        spin_ratio: largest transverse spin over its first frequency.
        gamma: (smallest, largest) eigenvalue of K^-1 K_g of the loads; None if unknown.
        last_share: largest energy share of the last shape function of a family, and its name.
        tail: truncated part of the bending energy of the true section loads; for an elastic
            body, of the deflection of its ends; None if unknown.
        coupling: share chi of the inertia at its hinge due to the mode with the most energy,
            and this mode.
        shear: largest error of a bending frequency without shear (and rotary inertia), times
            the energy share of its shape function; None if the section's radius of gyration is
            unknown.
        strain: largest strain of its axis and, if the radius of gyration is known, of its
            outermost fibres; None if it has no length.
        sideways: ratio of loads to buckling loads of a beam in directions without shape
            functions; None if it has all shape functions.
        said: known limitations of the body's model before it moves, and a remedy, one sentence
            each.
        one_way: whether it is a one-way body: a linear response to a rigid run, not part of it.
        tail_of: quantity that `tail` is a part of.
        unmoved_frame: reference frame of deflections with fewer shape functions, if different.
        unshaped: deformation of a beam in a direction without shape functions, if significant.
    """

    name: str
    modes: int
    frame: str
    stiffening: bool
    slope: float
    turn: float
    first_frequency: float
    spin_ratio: float
    gamma: tuple[float, float] | None
    last_share: tuple[float, str] | None
    tail: float | None
    coupling: tuple[float, str] | None
    shear: float | None
    strain: float | None = None
    sideways: float | None = None
    said: tuple[str, ...] = ()
    one_way: bool = False
    tail_of: str = e.BENDING_ENERGY
    unmoved_frame: str = ""
    unshaped: UnshapedDeformation | None = None

    @property
    def frame_error(self) -> float:
        """Relative error of the deflection due to a single frame, kappa^2 / 2, at most 1."""
        return min(self.slope * self.slope / 2, 1.0)  # ** raises if this is infinite

    @property
    def shortening_error(self) -> float:
        """Relative error of the foreshortening due to a single frame, kappa^2.

        Foreshortening is quadratic in the deflection, so its relative error is twice as large.
        """
        return self.slope * self.slope

    @property
    def load_ratio(self) -> float:
        """Load ratio gamma: the eigenvalue of larger magnitude."""
        return 0.0 if self.gamma is None else max(abs(x) for x in self.gamma)


def model_ranges(flexible: FlexibleBodies) -> tuple[ModelRange, ...]:
    """Ranges, one per flexible body; empty for runs without samples and for too many bodies."""
    if not len(flexible.run.t) or not 0 < len(flexible.modal_bodies) <= MAX_BODIES:
        return ()
    shares = participation_by_body(flexible)
    lengths = {name: line.length for name, line in beam_lines(flexible.model.scene).items()}
    return tuple(
        _model_range(flexible, name, shares.get(name), lengths.get(name))
        for name, body in flexible.modal_bodies.items()
        if body.exact is None
    )


def _model_range(
    flexible: FlexibleBodies, name: str, coupling: Array | None, line: float | None
) -> ModelRange:
    full_motion = flexible.motion(name)
    body, finite = full_motion.body, _is_squarable(full_motion.eta)
    finite_motion = full_motion.select_samples(
        finite
    )  # also where the rest of the motion cannot be evaluated
    finite &= (
        _is_squarable(full_motion.etad)
        & _is_squarable(full_motion.etadd)
        & _is_squarable(full_motion.acceleration)
    )
    valid_samples = np.flatnonzero(finite)
    energies = strain_energy(full_motion.select_samples(valid_samples))
    count = len(valid_samples)
    picked = np.unique(np.linspace(0, count - 1, min(MAX_SAMPLES, count)).astype(int))
    if count:
        picked = np.union1d(picked, [int(np.argmax(energies))])
    motion, samples = full_motion.select_samples(valid_samples), valid_samples[picked]
    slope, shapes = e.max_slope(finite_motion), body.shapes
    first_frequency = float(modal_frequencies(body)[0])
    has_section_loads = shapes is not None and name not in flexible.unbalanced
    tail, lateral_load_ratio, unshaped = (
        _section_estimates(flexible, name, samples, line, slope)
        if has_section_loads and len(samples)
        else (None, None, None)
    )
    if body.truncation is not None and name not in flexible.unbalanced:
        tail = missed_deflection(flexible, name, samples)
    return ModelRange(
        name,
        len(body.modes),
        body.frame,
        e.has_second_order_terms(body) and name not in flexible.one_way,
        slope,
        e.max_rotation(finite_motion),
        first_frequency,
        e.transverse_spin(motion) / first_frequency if first_frequency > 0 else 0.0,
        _load_ratio_bounds(flexible, name, samples),
        e.last_shape_share(motion) if slope > _ZERO_SLOPE else None,
        tail if slope > _ZERO_SLOPE else None,
        _leading_coupling(motion, coupling),
        e.weighted_shear_error(motion, line),
        e.max_strain(finite_motion),
        lateral_load_ratio,
        body.warnings,
        name in flexible.one_way,
        e.BENDING_ENERGY if shapes else e.DEFLECTION,
        body.unmoved_frame,
        unshaped,
    )


def _is_squarable(numbers: Array) -> NDArray[np.bool_]:
    """Mask (n,) of rows of `numbers` (n, k) whose fourth powers do not overflow.

    A diverging run exceeds this long after other findings have reported it.
    """
    return np.asarray((np.abs(numbers) < _MAX_MAGNITUDE).all(axis=1))


def _leading_coupling(motion: Motion, coupling: Array | None) -> tuple[float, str] | None:
    """Participation chi of the mode with the most energy, and its name."""
    if coupling is None or not len(motion.t):
        return None
    k = int(np.argmax(modal_energy(motion).max(axis=0)))
    return float(coupling[k]), motion.body.modes[k]


def _load_ratio_bounds(
    flexible: FlexibleBodies, name: str, some: NDArray[np.int64]
) -> tuple[float, float] | None:
    """Load ratios; for a linear beam, by the foreshortening that it neglects."""
    motion, loads = flexible.motion(name), flexible.end_loads(name)
    second_order_moments = e.second_order_moments(motion.body)
    if second_order_moments is None or not len(some):
        return None
    ratios = []
    try:
        for part in (some[k] for k in chunk_slices(len(some), 4 * motion.body.n**2)):
            end_loads = {
                port: (force[part], moment[part]) for port, (force, moment) in loads.items()
            }
            k_g = e.stiffness_from_loads(
                motion.select_samples(part), flexible.gravity, end_loads, second_order_moments
            )
            ratios.append(e.load_ratios(motion.body.K, k_g))
    except np.linalg.LinAlgError:  # overflow of loads
        return None
    lowest, highest = zip(*ratios, strict=True)
    return min(lowest), max(highest)


def _section_estimates(
    flexible: FlexibleBodies, name: str, some: NDArray[np.int64], line: float | None, slope: float
) -> tuple[float | None, float | None, UnshapedDeformation | None]:
    """Estimates from the true section loads of a beam.

    The truncated part of the bending energy, `lateral_load_ratio`, and the deformation in
    directions without shape functions.
    """
    motion = flexible.motion(name).select_samples(some)
    inboard_x = flexible.inboard_position(name)
    x, weights = quadrature_rule(motion.shapes, inboard_x)
    points = [p.select_samples(some) for p in flexible.point_loads(name)]
    lines = [line.select_samples(some) for line in flexible.line_loads(name)]
    force, moment = section_loads(motion, x, flexible.gravity, inboard_x, points, lines)
    length = motion.shapes.length if line is None else line
    return (
        missed_bending_energy(motion, x, weights, moment[:, :, 1:]),
        lateral_load_ratio(motion.body, x, weights, inboard_x, length, force, moment),
        unshaped_deformation(motion.body, x, weights, force, moment, slope),
    )


def missed_bending_energy(
    motion: Motion, positions: Array, weights: Array, moment: Array
) -> float | None:
    """Part of the bending energy of `moment` (n, m, 2) that the shape functions miss.

    Taken where the shape functions are bent most: just after a load is applied they have not yet
    followed. None without bending.
    """
    shapes = motion.shapes
    sections = shapes.sections(positions)
    compliance = weights[:, None] / np.stack([sections.EI_y, sections.EI_z], axis=1)
    bends = np.array(
        [e.has_bending_shapes(motion.body, "z"), e.has_bending_shapes(motion.body, "y")]
    )
    compliance = np.where(bends, compliance, 0.0)
    shape_moment = elastic_moment(motion, positions)
    true_energy, shape_energy, missed_energy = (
        np.einsum("tma,ma->t", m**2, compliance)
        for m in (moment, shape_moment, moment - shape_moment)
    )
    k = int(np.argmax(shape_energy))
    return float(missed_energy[k] / true_energy[k]) if true_energy[k] > 0 else None


def missed_deflection(flexible: FlexibleBodies, name: str, some: NDArray[np.int64]) -> float | None:
    """Part of the deflection of an elastic body's ends that the shape functions miss.

    Under the loads on the ends, the spin of the body and the inertia of its shape functions, taken
    where these are strained most; None without any.
    """
    motion = flexible.motion(name).select_samples(some)
    truncation, inboard_end = motion.body.truncation, flexible.inboard_end(name)
    energies = strain_energy(motion)
    if truncation is None or not len(some) or not energies.max() > 0:
        return None
    loads = flexible.end_loads(name) | {inboard_end: flexible.inboard_load(name)}
    zero = np.zeros((len(some), 3))
    inputs = []
    for port in truncation.ports:
        force, moment = (part[some] for part in loads[port]) if port in loads else (zero, zero)
        inputs += [motion.inward(force), motion.inward(moment)]
    spin = tilde(motion.frame_angular_velocity)
    frame_rotation_rate = tilde(motion.frame_angular_acceleration) + spin @ spin
    inputs += [-np.swapaxes(frame_rotation_rate, 1, 2).reshape(-1, 9), motion.etadd]
    length = radius_of_gyration(motion.body)
    missed = truncation.missed_share(np.concatenate(inputs, axis=1), length)
    return float(missed[int(np.argmax(energies))])


# --- rows -----------------------------------------------------------------------------------------

#: Largest number of bodies with own rows in the certificate; beyond, only the extremes are shown.
_MAX_BODY_ROWS = 4

#: Rows of extremes: name, measure and its format.
_EXTREMES = (
    ("largest slope", "slope", ".2g"), ("largest spin ratio", "spin_ratio", ".2g"),
    ("largest load ratio", "load_ratio", ".2g"), ("largest strain", "strain", ".1e"),
    ("missed bending", "tail", ".1e"),
)  # fmt: skip


def rows(ranges: Sequence[ModelRange]) -> list[tuple[str, str]]:
    """Rows of the certificate, (name, text)."""
    if len(ranges) <= _MAX_BODY_ROWS:
        return [row for body_range in ranges for row in _body_rows(body_range)]
    parts = []
    for title, measure, digits in _EXTREMES:
        known = [body for body in ranges if getattr(body, measure) is not None]
        if known:
            worst = max(known, key=attrgetter(measure))
            parts.append((title, f'{getattr(worst, measure):{digits}} at "{worst.name}"'))
    return parts


def _body_rows(body_range: ModelRange) -> list[tuple[str, str]]:
    motion_parts = [
        f"slope {body_range.slope:.2g} (frame error up to {body_range.frame_error:.0e} of the "
        f"deflection, {body_range.shortening_error:.0e} of the foreshortening)"
    ]
    if body_range.strain is not None:
        motion_parts.append(f"strain {body_range.strain:.1e}")
    motion_parts.append(
        f"spin {body_range.spin_ratio:.2g} of omega_1 = {body_range.first_frequency:.4g} rad/s"
    )
    if body_range.gamma is not None:
        low, high = body_range.gamma
        worst = high if high >= -low else low
        change = "stiffened" if worst >= 0 else "softened"
        change = f"not {change}" if body_range.one_way else change
        motion_parts.append(f"{change} by loads {abs(worst):.2g} (gamma)")
    frame = f" in a {body_range.frame} frame" if body_range.frame else ""
    frame += f" ({body_range.unmoved_frame} with fewer shapes)" if body_range.unmoved_frame else ""
    shape_parts = [f"{body_range.modes}{frame}"]
    if body_range.last_share is not None and body_range.last_share[1]:
        shape_parts.append(
            f"{body_range.last_share[1]} holds {body_range.last_share[0]:.1e} of the energy"
        )
    if body_range.tail is not None:
        shape_parts.append(f"{body_range.tail:.1e} of the {body_range.tail_of} missed")
    if body_range.coupling is not None:
        shape_parts.append(f"coupling {body_range.coupling[0]:.2g} ({body_range.coupling[1]})")
    if body_range.shear is not None:
        shape_parts.append(f"shear {body_range.shear:.0e}")
    return [
        (f"{body_range.name}", "; ".join(motion_parts)),
        (f"{body_range.name} shapes", "; ".join(shape_parts)),
    ]
