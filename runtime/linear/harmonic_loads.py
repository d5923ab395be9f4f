"""What harmonic pushes do: efforts, and of drives the motion of their own coordinates."""

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
    """What pushes (p,) do: columns (c, nu) of efforts, each times a power of s and part of one of
    the pushes; a drive has several, for it moves its coordinate besides."""

    pushes: Sequence[Channel]
    columns: Array
    powers: NDArray[np.int64]
    parts: Array  # (c, p)

    @classmethod
    def of(
        cls, linear: LinearEquations, pushes: Sequence[Channel], efforts: Array
    ) -> HarmonicLoads:
        """Of efforts (p, nu), of drives those of their accelerations."""
        columns, owners = list(efforts), list(range(len(pushes)))
        powers = [2 - one.drive if one.drive >= 0 else 0 for one in pushes]
        for j, one in enumerate(pushes):
            if one.drive >= 0:
                moved = linear.driving(one.moves)
                columns += [-_placed(linear, x) for x in (moved.stiffness, moved.damping)]
                powers += [-one.drive, 1 - one.drive]
                owners += [j, j]
        parts = np.eye(len(pushes))[owners]
        wide = np.reshape(columns, (len(columns), linear.model.nu))
        return cls(pushes, wide, np.array(powers, dtype=np.int64), parts)

    def summed(self, s: Complex, answers: Complex) -> Complex:
        """(k, outputs, p) of answers (k, outputs, c) to the columns alone."""
        if len(self.columns) == len(self.pushes) and not self.powers.any():
            return answers
        return (answers * s[:, None, None] ** self.powers) @ self.parts

    def carried(self, rows: Array) -> dict[int, tuple[int, Array]]:
        """Place of a push -> power of s and (outputs,): what outputs have of the motion of its own
        drive."""
        found = {}
        for j, one in enumerate(self.pushes):
            if one.moves:
                speeds, factors = zip(*one.moves, strict=True)
                found[j] = -one.drive, rows[:, speeds] @ np.array(factors)
        return found


def _placed(linear: LinearEquations, x: Array) -> Array:
    """(nu,) entries of x (n,) in the places of its speeds."""
    found = np.zeros(linear.model.nu)
    found[list(linear.free)] = x
    return found
