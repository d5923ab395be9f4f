"""Validity range of flexible bodies: how far a run stayed within it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array
from mstmm.scene.checks.welded import lines

from ...flexible.parts import slices
from ...flexible.sizes import radius_of_gyration
from . import estimators as e
from .coupling import couplings
from .energy import frequencies, modal_energy, strain_energy
from .loads import section_loads
from .motion import elastic_moment, tilde
from .sideways import rule, sideways

if TYPE_CHECKING:
    from .bodies import FlexibleBodies
    from .motion import Motion


#: Samples that are looked at, and flexible bodies of a scene.
SAMPLES, LARGEST = 160, 400

#: Slopes below this are rounding: what bends so little is not judged by its shapes.
_STRAIGHT = 1e-9

#: Coordinates, rates and accelerations that are judged are below this.
_MOST = 1e50


@dataclass(frozen=True)
class Flexibility:
    """How far one flexible body went, over the samples of a run.

    Attributes:
        name, modes, frame: of the body.
        stiffening: second-order displacements are in its kinematics.
        slope: kappa, the largest slope against its floating frame; the frame's own error is up to
            kappa^2 / 2.
        turn: rad, largest rotation of a section against the frame, twist included.
        first_frequency: rad/s of its shapes, the frame at rest.
        spin_ratio: largest spin across the body over its first frequency.
        gamma: (smallest, largest) eigenvalue of K^-1 K_g of the loads; None if not known.
        last_share: largest share of the energy that the last shape of a family held, which one.
        tail: part of the bending energy of the true section loads that the shapes miss, of an
            elastic body of the deflection of its ends; None where it is not known.
        coupling: share chi of the inertia at its hinge that the mode with the most energy holds,
            and this mode.
        shear: largest error of a bending frequency without shear (and rotary inertia), times the
            share of the energy that its shape holds; None where the section's radius of gyration is
            not known.
        strain: largest strain of its axis and, where the radius of gyration is known, of its
            outermost fibres; None where it has no length.
        sideways: loads over those that can buckle a beam in a way for which it has no shapes; None
            where it has all shapes.
        said: what is known of the body's model before it moves, and a way out, one sentence each.
        one_way: it responds to a rigid run, linearly, and is no part of it.
        tail_of: what `tail` is a part of.
        unmoved_frame: the frame that deflections count from with fewer shapes, where it is another.
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

    @property
    def frame_error(self) -> float:
        """kappa^2 / 2, at most 1: what one frame may err by, as a part of the deflection."""
        return min(self.slope * self.slope / 2, 1.0)  # ** raises where this is infinite

    @property
    def shortening_error(self) -> float:
        """kappa^2: the same as a part of how far a bent body shortens, which goes with the square
        of its deflection and so errs by twice as much."""
        return self.slope * self.slope

    @property
    def load_ratio(self) -> float:
        """gamma: the larger of the two ratios in size."""
        return 0.0 if self.gamma is None else max(abs(x) for x in self.gamma)


def flexibilities(flexible: FlexibleBodies) -> tuple[Flexibility, ...]:
    """One entry per flexible body; none for runs without samples and for very many bodies."""
    if not len(flexible.run.t) or not 0 < len(flexible.known) <= LARGEST:
        return ()
    shares = couplings(flexible)
    welded = lines(flexible.model.scene)
    return tuple(
        _one(flexible, name, shares.get(name), welded[name].length if name in welded else None)
        for name in flexible.known
    )


def _one(
    flexible: FlexibleBodies, name: str, coupling: Array | None, line: float | None
) -> Flexibility:
    whole = flexible.motion(name)
    body, finite = whole.body, _squared(whole.eta)
    bent_all = whole.some(finite)  # also where the rest of the motion cannot be evaluated
    finite &= _squared(whole.etad) & _squared(whole.etadd) & _squared(whole.acceleration)
    good = np.flatnonzero(finite)
    bent = strain_energy(whole.some(good))
    picked = np.unique(np.linspace(0, len(good) - 1, min(SAMPLES, len(good))).astype(int))
    picked = np.union1d(picked, [int(np.argmax(bent))]) if len(good) else picked
    motion, some = whole.some(good), good[picked]
    slope, shapes = e.largest_slope(bent_all), body.shapes
    first = float(frequencies(body)[0])
    known = shapes is not None and name not in flexible.unbalanced
    tail, aside = _from_sections(flexible, name, some, line) if known else (None, None)
    if body.truncation is not None and name not in flexible.unbalanced:
        tail = missed_by_loads(flexible, name, some)
    return Flexibility(
        name, len(body.modes), body.frame,
        e.is_stiffened(body) and name not in flexible.one_way,
        slope, e.largest_turn(bent_all), first, e.cross_spin(motion) / first if first > 0 else 0.0,
        _gamma(flexible, name, some), e.last_shape_share(motion) if slope > _STRAIGHT else None,
        tail if slope > _STRAIGHT else None, _leading(motion, coupling),
        e.shear_error(motion, line), e.largest_strain(bent_all), aside, body.warnings,
        name in flexible.one_way, e.BENDING_ENERGY if shapes else e.DEFLECTION, body.unmoved_frame,
    )  # fmt: skip


def _squared(numbers: Array) -> NDArray[np.bool_]:
    """(n,) where squares of squares of numbers (n, k) are numbers: what runs away grows beyond that
    and has long said so."""
    return np.asarray((np.abs(numbers) < _MOST).all(axis=1))


def _leading(motion: Motion, coupling: Array | None) -> tuple[float, str] | None:
    """chi of the mode that held the most energy."""
    if coupling is None or not len(motion.t):
        return None
    k = int(np.argmax(modal_energy(motion).max(axis=0)))
    return float(coupling[k]), motion.body.modes[k]


def _gamma(
    flexible: FlexibleBodies, name: str, some: NDArray[np.int64]
) -> tuple[float, float] | None:
    """Load ratios; of a linear beam by the shortening that it leaves out."""
    motion, loads = flexible.motion(name), flexible.end_loads(name)
    second = e.second_order(motion.body)
    if second is None or not len(some):
        return None
    ratios = []
    try:
        for part in (some[k] for k in slices(len(some), 4 * motion.body.n**2)):
            own = {port: (force[part], moment[part]) for port, (force, moment) in loads.items()}
            k_g = e.stiffness_from_loads(motion.some(part), flexible.gravity, own, second)
            ratios.append(e.load_ratios(motion.body.K, k_g))
    except np.linalg.LinAlgError:  # loads beyond what numbers hold
        return None
    lowest, highest = zip(*ratios, strict=True)
    return min(lowest), max(highest)


def _from_sections(
    flexible: FlexibleBodies, name: str, some: NDArray[np.int64], line: float | None
) -> tuple[float | None, float | None]:
    """What the true loads of a beam's sections tell: bending energy of the difference of their
    moments and those of the shapes, over that of the former; and `sideways`."""
    motion = flexible.motion(name).some(some)
    if not len(some):
        return None, None
    held = flexible.held_place(name)
    places, weights = rule(motion.shapes, held)
    points = [p.some(some) for p in flexible.point_loads(name)]
    lines = [line.some(some) for line in flexible.line_loads(name)]
    force, moment = section_loads(motion, places, flexible.gravity, held, points, lines)
    length = motion.shapes.length if line is None else line
    return (
        missed(motion, places, weights, moment[:, :, 1:]),
        sideways(motion.body, places, weights, held, length, force, moment),
    )


def missed(motion: Motion, places: Array, weights: Array, moment: Array) -> float | None:
    """Part of the bending energy of `moment` (n, m, 2) that the shapes miss when they are bent
    most (just after a load was switched on they have not yet followed); None without any."""
    shapes = motion.shapes
    sections = shapes.sections(places)
    softness = weights[:, None] / np.stack([sections.EI_y, sections.EI_z], axis=1)
    bends = np.array([e.bends(motion.body, "z"), e.bends(motion.body, "y")])
    softness = np.where(bends, softness, 0.0)
    followed = elastic_moment(motion, places)
    true, held, lost = (
        np.einsum("tma,ma->t", m**2, softness) for m in (moment, followed, moment - followed)
    )
    k = int(np.argmax(held))
    return float(lost[k] / true[k]) if true[k] > 0 else None


def missed_by_loads(flexible: FlexibleBodies, name: str, some: NDArray[np.int64]) -> float | None:
    """Part of the deflection of an elastic body's ends, under what they carry, its spin and the
    inertia of its shapes, that the shapes miss when they are strained most; None without any."""
    motion = flexible.motion(name).some(some)
    truncation, held = motion.body.truncation, flexible.held_end(name)
    strained = strain_energy(motion)
    if truncation is None or not len(some) or not strained.max() > 0:
        return None
    loads = flexible.end_loads(name) | {held: flexible.held_load(name)}
    none = np.zeros((len(some), 3))
    given = []
    for port in truncation.ports:
        force, moment = (part[some] for part in loads[port]) if port in loads else (none, none)
        given += [motion.inward(force), motion.inward(moment)]
    spin = tilde(motion.frame_spin)
    turning = tilde(motion.frame_spin_rate) + spin @ spin
    given += [-np.swapaxes(turning, 1, 2).reshape(-1, 9), motion.etadd]
    length = radius_of_gyration(motion.body)
    missed = truncation.missed(np.concatenate(given, axis=1), length)
    return float(missed[int(np.argmax(strained))])


# --- rows -----------------------------------------------------------------------------------------

#: Bodies that get rows of their own in the certificate; of more only the extremes are shown.
_ROWS = 4


def rows(found: Sequence[Flexibility]) -> list[tuple[str, str]]:
    """Lines of the certificate, (name, text)."""
    if len(found) <= _ROWS:
        return [row for one in found for row in _rows_of(one)]
    steepest = max(found, key=lambda one: one.slope)
    fastest = max(found, key=lambda one: one.spin_ratio)
    loaded = max(found, key=lambda one: one.load_ratio)
    strains = [one for one in found if one.strain is not None]
    parts = [
        ("largest slope", f'{steepest.slope:.2g} at "{steepest.name}"'),
        ("largest spin ratio", f'{fastest.spin_ratio:.2g} at "{fastest.name}"'),
        ("largest load ratio", f'{loaded.load_ratio:.2g} at "{loaded.name}"'),
    ]
    if strains:
        worst = max(strains, key=lambda one: one.strain or 0.0)
        parts.append(("largest strain", f'{worst.strain:.1e} at "{worst.name}"'))
    tails = [one for one in found if one.tail is not None]
    if tails:
        worst = max(tails, key=lambda one: one.tail or 0.0)
        parts.append(("bending missed", f'{worst.tail:.1e} at "{worst.name}"'))
    return parts


def _rows_of(one: Flexibility) -> list[tuple[str, str]]:
    went = [
        f"slope {one.slope:.2g} (the frame errs by up to {one.frame_error:.0e} of the deflection, "
        f"{one.shortening_error:.0e} of the shortening)"
    ]
    if one.strain is not None:
        went.append(f"strain {one.strain:.1e}")
    went.append(f"spin {one.spin_ratio:.2g} of omega_1 = {one.first_frequency:.4g} rad/s")
    if one.gamma is not None:
        low, high = one.gamma
        worst = high if high >= -low else low
        word = "stiffened" if worst >= 0 else "softened"
        word = f"not {word}" if one.one_way else word
        went.append(f"{word} by loads {abs(worst):.2g} (gamma)")
    kept = [f"{one.modes} in a {one.frame} frame" if one.frame else f"{one.modes}"]
    if one.unmoved_frame:
        kept[0] += f" ({one.unmoved_frame} with fewer shapes)"
    if one.last_share is not None and one.last_share[1]:
        kept.append(f"{one.last_share[1]} holds {one.last_share[0]:.1e} of the energy")
    if one.tail is not None:
        kept.append(f"{one.tail:.1e} of the {one.tail_of} missed")
    if one.coupling is not None:
        kept.append(f"coupling {one.coupling[0]:.2g} ({one.coupling[1]})")
    if one.shear is not None:
        kept.append(f"shear {one.shear:.0e}")
    return [(f"{one.name}", "; ".join(went)), (f"{one.name} shapes", "; ".join(kept))]
