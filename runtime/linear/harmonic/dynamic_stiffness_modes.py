"""Complete normal modes of scenes with exact beams by the Wittrick-Williams algorithm.

No mode is missed: the number of undamped modes below omega is (Wittrick and Williams, Q. J. Mech.
Appl. Math. 24 (1971) 263-284)

    J(omega) = sum over exact beams of their clamped-clamped modes + negative pivots of the sweep.

J rises at each natural frequency by its multiplicity.  Simultaneous bisection on J finds all
frequencies without a root search.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array, Integers, integer
from mstmm.errors import NumericalFailure, SceneError
from mstmm.risk import AssessedResult, DeferredRisks, Risk

from ...engine.tangent_matrix import HarmonicResponse
from ..modes import CHANNEL_RISKS
from .exact_beams import BeamSelection, ExactBeams, exact_beams

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

#: Relative width of the final bracket; relative shifts of omega tried where a pivot vanishes. Near
#: poles of a long beam, whose ends are almost decoupled, larger shifts are needed.
_CLOSE, _BESIDE = 2.0**-51, tuple(2.0**-k for k in range(46, 26, -4))
#: Frequencies relative to the lowest one of a single beam: below the first they count as 0; the
#: search ends at the second.
_SLOWEST, _FASTEST = 1e-6, 1e12
#: Relative distance from a natural frequency at which its shapes are computed.
_NEAR = 1e-9
#: Size limit of one batch of frequencies, in matrix entries.
_BATCH = 2**20
#: Relative asymmetry above which a stiffness does not derive from a potential.
_SYMMETRIC = 1e-9


@dataclass(frozen=True, eq=False)
class DynamicStiffnessModes(AssessedResult):
    """The k slowest undamped normal modes of a scene with exact beams, by rising omega.

    Attributes:
        omega: (k,) angular natural frequencies, rad/s.
        coordinates: n names; for an exact beam, the deflection and the slope times length of its
            far end relative to the tangent at the near end.
        shapes: (n, k) mode shapes, the largest entry of each 1.
        is_complete: always True: no mode below the last one is missing.
        findings: risks of the linear model.
    """

    omega: Array
    coordinates: tuple[str, ...] = field(repr=False)
    shapes: Array = field(repr=False)
    is_complete: bool = True
    findings: Iterable[Risk] = field(default=(), repr=False)

    def __len__(self) -> int:
        return len(self.omega)

    @property
    def frequency(self) -> Array:
        """Natural frequencies (k,), Hz."""
        return self.omega / (2 * np.pi)

    def to_dict(self) -> dict[str, Any]:
        """All results as a dictionary for JSON."""
        return {
            "omega": self.omega.tolist(), "frequency": self.frequency.tolist(),
            "coordinates": list(self.coordinates), "shapes": self.shapes.tolist(),
            "complete": self.is_complete, **self.assessment(),
        }  # fmt: skip


def exact_modes(
    linear: LinearEquations, count: int, chosen: BeamSelection
) -> DynamicStiffnessModes:
    """Normal modes with exact beams; see `Linear.exact_modes`."""
    count = integer("count", count, 1, "a number of modes, 1 or more")
    beams = exact_beams(linear, chosen, 0.0).without_damping()
    counter = _Counter(beams)
    omega = counter.natural_frequencies(count)
    excluded_risks = ("shapes", *CHANNEL_RISKS)
    shapeless = DeferredRisks(
        lambda: (risk for risk in linear.risks if risk.name not in excluded_risks)
    )
    return DynamicStiffnessModes(
        omega, beams.linear.coordinate_names, counter.shapes(omega), findings=shapeless
    )


class _Counter:
    """Mode count J of one model, and its mode shapes."""

    def __init__(self, beams: ExactBeams) -> None:
        linear = beams.linear
        engine, state = linear.model.looped, linear.state
        self.beams, self.free = beams, list(linear.free_speed_indices)
        self.response = HarmonicResponse(
            engine, state.t, state.q, state.u, state.udot, exact=beams.bodies
        )  # fmt: skip
        if self.response.tangent.off_tree_count:
            raise SceneError(
                "exact modes: springs between bodies and loads that follow other bodies couple "
                "branches of the tree, for which modes cannot be counted; remove them"
            )
        if linear.operators.skew() > _SYMMETRIC:
            raise SceneError(
                "exact modes: follower loads have no potential, so that modes cannot be counted; "
                "remove these loads, or use modes with shape functions"
            )
        self.response.omit_damping()
        self.unit = beams.slowest
        size = sum(beam.size**2 for beam in beams.beams) + engine.nu
        self.max_batch = max(4, _BATCH // max(1, size))

    def count_below(self, omega: Array) -> Integers:
        """Mode count J (k,) below omega (k,), rad/s."""
        parts = [omega[k : k + self.max_batch] for k in range(0, len(omega), self.max_batch)]
        return np.concatenate([self._count_modes(part) for part in parts])

    def _count_modes(self, omega: Array) -> Integers:
        for beside in (*_BESIDE, 0.0):
            counts = self.response.count_negative(-(omega**2))
            if (counts >= 0).all():
                return counts + self.beams.clamped_mode_count(omega)
            omega = np.where(counts < 0, omega * (1 + beside), omega)
        raise NumericalFailure(
            f"exact modes: singular factors near {omega[counts < 0][0]:.9g} rad/s"
        )

    def natural_frequencies(self, count: int) -> Array:
        """Natural frequencies omega (count,) of the slowest modes, rad/s."""
        low = _SLOWEST * self.unit
        if (self.response.count_negative(np.array([low**2])) > 0).any():
            raise SceneError("exact modes: this state is unstable; use a stable state")
        high = self.unit
        while self.count_below(np.array([high]))[0] < count:
            high *= 2
            if high > _FASTEST * self.unit:
                raise SceneError(
                    f"count = {count}: the scene has no more than "
                    f"{self.count_below(np.array([high]))[0]} modes; request fewer"
                )
        mode_numbers = np.arange(1, count + 1)
        lower, upper = np.full(count, low), np.full(count, high)
        still = self.count_below(np.array([low]))[0]
        while (upper - lower > _CLOSE * upper).any():
            middle, which = np.unique((lower + upper) / 2, return_inverse=True)
            reached = self.count_below(middle)[which] >= mode_numbers
            lower, upper = (
                np.where(reached, lower, middle[which]),
                np.where(reached, middle[which], upper),
            )
        return np.where(mode_numbers <= still, 0.0, (lower + upper) / 2)

    def shapes(self, omega: Array) -> Array:
        """Mode shapes (n, k): responses next to each frequency, one for each multiplicity."""
        runs = _runs(omega)
        near = np.maximum(omega[[first for first, _ in runs]], _SLOWEST * self.unit) * (1 - _NEAR)
        most = max(last - first for first, last in runs)
        columns = np.zeros((most, self.response.engine.nu))
        columns[:, self.free] = np.random.default_rng(0).standard_normal((most, len(self.free)))
        answers, _, _ = self.response.amplitudes(near.astype(np.complex128) * 1j, columns)
        vectors = [np.linalg.qr(answer[: last - first, self.free].real.T)[0]
                 for answer, (first, last) in zip(answers, runs, strict=True)]  # fmt: skip
        shapes = np.concatenate(vectors, axis=1)
        largest_rows = np.abs(shapes).argmax(axis=0)
        return np.asarray(shapes / shapes[largest_rows, np.arange(len(omega))])


def _runs(omega: Array) -> list[tuple[int, int]]:
    """Index ranges (first, end) of coinciding frequencies."""
    apart = np.diff(omega) > 10 * _NEAR * omega[1:]
    cuts = [0, *(np.flatnonzero(apart) + 1).tolist(), len(omega)]
    return list(itertools.pairwise(cuts))
