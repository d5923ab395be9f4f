"""Loads and amplitudes of harmonic motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from ..input_channels import Channel
from ..mck_matrices import Matrices

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations


# --- effort columns of harmonic inputs ------------------------------------------------------------

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class HarmonicLoads:
    """Effort columns of harmonic inputs.

    Attributes:
        inputs: (p,) inputs.
        columns: (c, nu) efforts; a drive has several columns because it also moves its coordinate.
        powers: (c,) power of s that multiplies each column.
        parts: (c, p) assignment of columns to inputs.
    """

    inputs: Sequence[Channel]
    columns: Array
    powers: NDArray[np.int64]
    parts: Array  # (c, p)

    @classmethod
    def from_efforts(
        cls, linear: LinearEquations, pushes: Sequence[Channel], efforts: Array
    ) -> HarmonicLoads:
        """Columns from efforts (p, nu) of the inputs; for drives, of their accelerations."""
        columns, owners = list(efforts), list(range(len(pushes)))
        powers = [2 - channel.drive if channel.drive >= 0 else 0 for channel in pushes]
        for j, channel in enumerate(pushes):
            if channel.drive >= 0:
                moved = linear.drive_columns(channel.drive_factors)
                columns += [-_expand(linear, x) for x in (moved.stiffness, moved.damping)]
                powers += [-channel.drive, 1 - channel.drive]
                owners += [j, j]
        parts = np.eye(len(pushes))[owners]
        wide = np.reshape(columns, (len(columns), linear.model.nu))
        return cls(pushes, wide, np.array(powers, dtype=np.int64), parts)

    def sum_by_input(self, s: Complex, answers: Complex) -> Complex:
        """Responses (k, outputs, p) to the inputs from responses (k, outputs, c) to the columns."""
        if len(self.columns) == len(self.inputs) and not self.powers.any():
            return answers
        return (answers * s[:, None, None] ** self.powers) @ self.parts

    def drive_contributions(self, rows: Array) -> dict[int, tuple[int, Array]]:
        """Direct contribution of the motion of drives to outputs.

        Maps the index of an input to a power of s and a column (outputs,).
        """
        contributions = {}
        for j, channel in enumerate(self.inputs):
            if channel.drive_factors:
                speeds, factors = zip(*channel.drive_factors, strict=True)
                contributions[j] = -channel.drive, rows[:, speeds] @ np.array(factors)
        return contributions


def _expand(linear: LinearEquations, x: Array) -> Array:
    """Vector (nu,) with the entries of x (n,) at the indices of its speeds."""
    expanded = np.zeros(linear.model.nu)
    expanded[list(linear.free_speed_indices)] = x
    return expanded


# --- amplitudes from M, C, K ----------------------------------------------------------------------


class Amplitudes:
    """Solver of Z(s) x = r with the dynamic stiffness Z, for dense matrices.

    Replaces `HarmonicResponse`, which covers trees at rest; x and r are at the indices `places`
    among the speeds.
    """

    def __init__(self, places: Sequence[int], whole: Matrices, lossy: Matrices | None) -> None:
        self._indices, self._matrices = list(places), whole
        self._loss_stiffness = 0.0 if lossy is None else 1j * (lossy.K - whole.K)

    def amplitudes(self, s: Complex, columns: Array) -> tuple[Complex, Array, NDArray[np.int32]]:
        """Amplitudes x (k, n, nu) at s (k,) for n right-hand sides (n, nu).

        Also returns the condition number (k,) of Z and the body index -1 (k,): no body.
        """
        x = np.zeros((len(s), *columns.shape), dtype=np.complex128)
        growth, whole = np.zeros(len(s)), self._matrices
        for k, at in enumerate(s):
            parts = at**2 * whole.M, at * whole.C, whole.K + self._loss_stiffness
            z = np.asarray(sum(parts))
            growth[k] = _condition(z, np.asarray(sum(map(np.abs, parts))))
            if np.isfinite(growth[k]):
                x[k][:, self._indices] = np.linalg.solve(z, columns[:, self._indices].T).T
        return x, growth, np.full(len(s), -1, dtype=np.int32)


def _condition(z: Complex, cancelling: Array) -> float:
    """Condition number of z relative to the sizes of its cancelling terms; inf if singular."""
    scale = np.sqrt(cancelling.max(axis=1, initial=0.0))
    if not len(z) or not scale.all():
        return float(np.inf) if len(z) else 1.0
    size = float(np.linalg.norm(cancelling / np.outer(scale, scale), 2))
    least = float(np.linalg.svd(z / np.outer(scale, scale), compute_uv=False).min())
    return size / least if least else float(np.inf)
