"""Changes of matrices, inputs and outputs along the motion of an operating point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from ..harmonic_loads import HarmonicLoads
from ..input_channels import Channel
from ..outputs.linear_outputs import outputs_of, rows_of
from ..outputs.output_rows import LinearQuantity
from .departure import LARGEST
from .later_states import LaterStates

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

#: Name of M, C and K in the results of `find_changes`.
MATRICES = "the matrices"
#: Negligible changes relative to rows and columns, relative to the largest entry, and absolute.
_SAME, _FAINT, _ROUNDING = 1e-6, 1e-9, 1e-12


def find_changes(
    linear: LinearEquations,
    later: LaterStates,
    pushes: Sequence[Channel],
    shown: Sequence[LinearQuantity] = (),
) -> list[str]:
    """Names of inputs and outputs that change along the motion, and `MATRICES` if these do."""
    names, changing = [quantity.name for quantity in shown], dict[str, None]()
    if not later.compared_states:
        return []
    effects, rows = _effects(linear, pushes), _rows(linear, shown, pushes)
    for there in later.equations():
        if len(linear) <= LARGEST and _matrices_differ(linear, there):
            changing[MATRICES] = None
        now = _effects(there, pushes)
        again = _rows(there, outputs_of(there, names) if names else (), pushes)
        pairs = zip((*(push.name for push in pushes), *names), (*effects, *rows), (*now, *again),
                    strict=True)  # fmt: skip
        changing |= {name: None for name, first, second in pairs if _differ(first, second)}
    return list(changing)


def _effects(linear: LinearEquations, pushes: Sequence[Channel]) -> list[Array]:
    """Effort columns per unit of each input, including those of the motion of its drive."""
    if not pushes:
        return []
    efforts = np.zeros((len(pushes), linear.model.nu))
    efforts[:, list(linear.free_speed_indices)] = linear.input_matrix(pushes).T
    loads = HarmonicLoads.from_efforts(linear, pushes, efforts)
    return [loads.columns[loads.parts[:, k] != 0] for k in range(len(pushes))]


def _rows(
    linear: LinearEquations, shown: Sequence[LinearQuantity], pushes: Sequence[Channel]
) -> list[Array]:
    """Row of each output.

    Each row has the factors of increments, rates and accelerations, of those of drives that are
    inputs, and the feedthrough of the inputs.
    """
    speed_indices = [
        *linear.free_speed_indices,
        *(speed for channel in pushes for speed, _ in channel.drive_factors),
    ]
    all_rows, none = [], np.zeros((1, linear.model.nu))
    for quantity in shown:
        rows = rows_of(linear, [quantity], pushes)
        orders = [rows.orders.get(order, none)[0, speed_indices] for order in range(3)]
        all_rows.append(np.concatenate([*orders, rows.feedthrough[0]]))
    return all_rows


def _differ(first: Array, second: Array) -> bool:
    scale = max(float(np.abs(x).max(initial=0)) for x in (first, second))
    return float(np.abs(first - second).max(initial=0)) > _SAME * scale + _ROUNDING


def _matrices_differ(first_model: LinearEquations, second_model: LinearEquations) -> bool:
    """Whether M, C or K differ, scaled to unit masses and relative to rows and columns."""
    scale = np.sqrt(np.maximum(first_model.M.diagonal(), np.finfo(float).tiny))
    first, second = (
        [x / np.outer(scale, scale) for x in (at.M, at.C, at.K)]
        for at in (first_model, second_model)
    )
    spin = float(np.abs(first_model.state.u).max(initial=0))
    stiffness = float(np.abs(first[2]).max(initial=0)) + spin**2
    for a, b, unit in zip(first, second, (1.0, np.sqrt(stiffness), stiffness), strict=True):
        size = np.maximum(np.abs(a), np.abs(b))
        whole = max(float(size.max(initial=0)), float(unit))
        rows = np.sqrt(np.outer(size.max(axis=1, initial=0), size.max(axis=0, initial=0)))
        if (np.abs(a - b) > _SAME * rows + _FAINT * whole).any():
            return True
    return False
