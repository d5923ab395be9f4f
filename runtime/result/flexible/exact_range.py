"""Validity range of exact beams: how well a run is resolved by strains and segments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from ...flexible.beam.gauss_quadrature import gauss_rule
from . import range_estimators as e
from .momentum import strain_energy
from .motion import elastic_moment, strain
from .station_loads import station_loads

if TYPE_CHECKING:
    from .motion import Motion
    from .section_loads import FlexibleBodies

#: Largest number of examined samples, and Gauss points at which section loads are compared.
_MAX_SAMPLES, _COMPARED_POINTS = 160, 12


@dataclass(frozen=True)
class ExactRange:
    """Resolution and range of one exact beam over the samples of a run.

    Attributes:
        name, modes: of the beam, and its number of strain coordinates.
        segment_rotation: rad, largest rotation along a segment between stations.
        magnus_difference: largest difference of positions by Magnus steps of orders 6 and 4, of the
            length; a bound of the error of order 6.
        fibre_strain: largest strain of the outermost fibres; None if the radius of gyration is
            unknown.
        last_share: largest energy share of the last shape of a direction, and its name.
        missed_energy: part of the bending energy of the section loads from equilibrium by which
            those from strain differ; None without bending.
        shear: error of bending frequencies without shear, weighted by energy; None if the radius of
            gyration is unknown.
    """

    name: str
    modes: int
    segment_rotation: float
    magnus_difference: float
    fibre_strain: float | None
    last_share: tuple[float, str] | None
    missed_energy: float | None
    shear: float | None


def exact_ranges(flexible: FlexibleBodies) -> tuple[ExactRange, ...]:
    """Ranges, one per exact beam; empty for runs without samples."""
    if not len(flexible.run.t):
        return ()
    return tuple(
        _exact_range(flexible, name)
        for name, body in flexible.modal_bodies.items()
        if body.exact is not None
    )


def _exact_range(flexible: FlexibleBodies, name: str) -> ExactRange:
    whole = flexible.motion(name)
    body, samples = whole.body, _examined_samples(whole)
    exact, motion = body.exact, whole.select_samples(samples)
    assert exact is not None
    return ExactRange(
        name, body.n,
        float(exact.segment_rotations(motion.eta).max(initial=0.0)),
        float(exact.magnus_difference(motion.eta).max(initial=0.0)) / exact.length,
        _fibre_strain(motion, np.linspace(0.0, exact.length, e.SECTION_COUNT)),
        e.last_shape_share(motion) if len(samples) else None,
        _missed_energy(flexible, motion, samples),
        e.weighted_shear_error(motion),
    )  # fmt: skip


def _examined_samples(motion: Motion) -> NDArray[np.int64]:
    """Indices of finite samples spread over the run, and of that with the largest strain energy."""
    arrays = (motion.eta, motion.etad, motion.etadd, motion.acceleration)
    valid = np.flatnonzero(np.all([np.abs(x).max(axis=1) < 1e50 for x in arrays], axis=0))
    if not len(valid):
        return valid
    picked = np.linspace(0, len(valid) - 1, min(_MAX_SAMPLES, len(valid))).astype(int)
    largest = int(np.argmax(strain_energy(motion.select_samples(valid))))
    return valid[np.union1d(picked, [largest])]


def _fibre_strain(motion: Motion, x: Array) -> float | None:
    """Largest strain of the outermost fibres, at sqrt(3) r from the axis as in a rectangle."""
    assert motion.body.exact is not None
    radii = e.gyration_radii(motion.body.exact, x)[1:]
    if not radii.any():
        return None
    strains = np.abs(strain(motion, x))
    fibres = strains[..., 0] + np.sqrt(3.0) * np.einsum("nma,am->nm", strains[..., 4:], radii)
    return float(fibres.max(initial=0.0))


def _missed_energy(
    flexible: FlexibleBodies, motion: Motion, samples: NDArray[np.int64]
) -> float | None:
    """Share of the bending energy of the loads from equilibrium that those from strain differ by.

    Taken where the bending energy is largest: just after a load is applied the beam has not yet
    followed.  None without bending.
    """
    exact = motion.body.exact
    assert exact is not None
    nodes, weights = gauss_rule(_COMPARED_POINTS)
    x = nodes * exact.length
    columns = [k for k, direction in enumerate("zy") if direction in exact.shapes.coefficients]
    if not columns or not len(samples):
        return None
    sections = exact.sections(x)
    compliance = weights[:, None] / np.stack([sections.EI_y, sections.EI_z], axis=1)[:, columns]
    own = elastic_moment(motion, x)[..., columns]
    balanced = station_loads(flexible, motion, x, samples)[1][..., 1:][..., columns]
    true, shown, missed = (
        np.einsum("nma,ma->n", load**2, compliance) for load in (balanced, own, balanced - own)
    )
    k = int(np.argmax(shown))
    return float(missed[k] / true[k]) if true[k] > 0 and shown[k] > 0 else None


# --- rows -----------------------------------------------------------------------------------------

#: Largest number of beams with own rows in the certificate.
_MAX_BODY_ROWS = 4


def rows(ranges: Sequence[ExactRange]) -> list[tuple[str, str]]:
    """Rows of the certificate, (name, text)."""
    beams = sorted(ranges, key=lambda body: -body.segment_rotation)[:_MAX_BODY_ROWS]
    return [(body.name, _text(body)) for body in beams]


def _text(body: ExactRange) -> str:
    parts = [
        f"exact, {body.segment_rotation:.2g} rad along a segment",
        f"Magnus order 6 to 4 {body.magnus_difference:.0e} of the length",
    ]
    if body.fibre_strain is not None:
        parts.append(f"strain {body.fibre_strain:.1e}")
    if body.last_share is not None and body.last_share[1]:
        parts.append(f"{body.last_share[1]} holds {body.last_share[0]:.1e} of the energy")
    if body.missed_energy is not None:
        parts.append(f"{body.missed_energy:.1e} of the bending energy missed")
    if body.shear is not None:
        parts.append(f"shear {body.shear:.0e}")
    return "; ".join(parts)
