"""Loads that could buckle a beam in a way for which it has no shapes.

Sideways a beam buckles where the loads do more work than its stiffness takes up.  With phi the
slope of a deflection across, compression N does the work int N phi^2 against int EI phi'^2; with
phi the twist of its sections, moments M in the stiff plane bend it across by M phi / EI, which is
work of int M^2 phi^2 / EI against int GI_t phi'^2 (Timoshenko and Gere, Theory of Elastic
Stability, 2nd ed., sections 2.8 and 6.3).  Both are one question, with phi = 0 where it is held.
"""

from __future__ import annotations

import numpy as np

from mstmm.arrays import Array

from ...flexible.beam.gauss import gauss_between
from ...flexible.beam.ports import BeamShapes
from ...flexible.modal_body import ModalBody
from .estimators import bends

#: Quarter waves of phi on either side of the held section.
_WAVES = 6
#: What is shorter, as part of a beam, does not buckle.
_STUB = 0.01


def rule(shapes: BeamShapes, held: float) -> tuple[Array, Array]:
    """Places and weights (m) along a beam held at x = `held`, for its shapes and phi."""
    waves = _WAVES / 2 / min(map(abs, _reaches(shapes.length, held)))
    return gauss_between(
        np.union1d(shapes.pieces, [held]), lambda a, b: max(shapes.density(a, b), waves)
    )


def _reaches(length: float, held: float) -> list[float]:
    """From the held section to either end, in m along x, but for stubs."""
    return [reach for reach in (-held, length - held) if abs(reach) > _STUB * length]


def sideways(
    body: ModalBody, x: Array, weights: Array, held: float, line: float, force: Array,
    moment: Array,
) -> float | None:  # fmt: skip
    """Largest load over the one that buckles the beam in a way for which it has no shapes.

    `force` and `moment` (n, m, 3) in N and N*m are what its sections carry, in their own axes, at
    the points x (m,) in m of a `rule`.  It is held at x = `held` (m) alone, and `line` in m is the
    length of the straight line of beams that it is a part of.  None for a beam with all shapes.
    """
    if body.shapes is None:
        return None
    length, twists = body.shapes.length, "twist1" in body.modes
    sections, longer = body.shapes.sections(x), max(line / length, 1.0)
    from_held = x - held
    sides = [(from_held * reach > 0, abs(reach)) for reach in _reaches(length, held)]

    def largest(load: Array, stiffness: Array) -> float:
        return max(
            _work_over_stiffness(
                load[:, side], stiffness[side], np.abs(from_held[side]), weights[side], reach
            )
            for side, reach in sides
        )

    found = []
    for plane, soft, stiff, component in (
        ("z", sections.EI_y, sections.EI_z, 2), ("y", sections.EI_z, sections.EI_y, 1),
    ):  # fmt: skip
        if np.min(soft) <= 0 or (bends(body, plane) and twists):
            continue
        if not bends(body, plane):
            found.append(longer**2 * largest(-force[..., 0], soft))
        if np.min(sections.GI_t) > 0:
            share = np.maximum(1 - soft / stiff, 0.0)  # as soft in its plane it just bends
            square = share * moment[..., component] ** 2 / soft
            found.append(longer * np.sqrt(largest(square, sections.GI_t)))
    return max(found, default=None)


def _work_over_stiffness(
    load: Array, stiffness: Array, x: Array, weights: Array, length: float
) -> float:
    """Largest int load phi^2 / int stiffness phi'^2 over all samples of `load` (n, m), at least 0;
    phi = 0 at x = 0, and free at x = length."""
    turns = (np.arange(_WAVES) + 0.5) * np.pi / length
    phi, rate = np.sin(np.outer(turns, x)), turns[:, None] * np.cos(np.outer(turns, x))
    rate *= np.sqrt(stiffness * weights)
    phi = np.linalg.solve(np.linalg.cholesky(rate @ rate.T), phi)
    work = np.einsum("im,nm,jm->nij", phi, load * weights, phi, optimize=True)
    if not np.isfinite(work).all():
        return 0.0
    return float(np.max(np.linalg.eigvalsh(work), initial=0.0))
