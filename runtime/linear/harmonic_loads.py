"""Effort columns of harmonic inputs, and the motion of driven coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from .input_channels import Channel

if TYPE_CHECKING:
    from .linear_equations import LinearEquations

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
