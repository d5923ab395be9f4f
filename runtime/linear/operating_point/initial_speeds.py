"""Initial speeds of a scene that persist and that a linear model at rest omits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.display import abbreviate_names
from mstmm.errors import NumericalFailure
from mstmm.risk import Risk, information

from ...engine.compiled_scene import speed_scales
from ...run.start_state import initial_state

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

#: Stiffness and damping per mass are weak below these fractions of the squared speed and of the
#: speed, in characteristic scales per second.
_WEAK, _SLOW = 0.01, 0.1
#: Significant changes of the matrices, relative to the speed, and relative rounding.
_CHANGED, _ROUNDING = 1e-3, 1e-9


def find_start_risks(linear: LinearEquations, most: int) -> Iterator[Risk]:
    """Risk of initial speeds that persist and change a model that is at rest.

    It applies if the model is at rest because no state was given.  With more than `most`
    coordinates any initial speed counts.
    """
    if linear.equations_at_speeds is None or not len(linear):
        return
    speeds = initial_state(linear.model)[1][list(linear.free_speed_indices)]
    if not speeds.any():
        return
    plain = replace(linear, frame_transform=None)
    if len(linear) <= most:
        speeds = _persistent_speeds(plain, speeds)
        if not speeds.any() or not _are_significant(plain, speeds):
            return
    moving = np.flatnonzero(np.abs(speeds) > _ROUNDING * np.abs(speeds).max())
    names = abbreviate_names(
        [linear.model.coordinate_layout.u_name(linear.free_speed_indices[k]) for k in moving]
    )
    yield information(
        "start-at-speed", names,
        f"the scene starts with steady speeds ({names}), but this model is linearised at rest, "
        "without their effects",
        "to linearise about the initial motion give its state, linearize(*model.initial_state()), "
        "or --at-start on the command line",
    )  # fmt: skip


def _fastest(linear: LinearEquations, speeds: Array) -> float:
    """Largest of the speeds (n,), in characteristic scales per second."""
    return float(np.abs(speeds / speed_scales(linear.model)[list(linear.free_speed_indices)]).max())


def _persistent_speeds(linear: LinearEquations, speeds: Array) -> Array:
    """Part of the speeds (n,) that no stiffness or damping changes within a revolution."""
    scale = np.sqrt(linear.M.diagonal())
    fastest, stiffness = _fastest(linear, speeds), linear.K / np.outer(scale, scale)
    _, squares, motions = np.linalg.svd(stiffness)
    kept = motions[squares < _WEAK * fastest**2]
    lasting = np.asarray(kept.T @ (kept @ (scale * speeds)) / scale)
    slowed, energy = lasting @ linear.C @ lasting, lasting @ linear.M @ lasting
    return lasting if slowed < _SLOW * fastest * energy else np.zeros_like(lasting)


def _are_significant(linear: LinearEquations, speeds: Array) -> bool:
    """Whether the matrices at these speeds (n,) differ from those at rest."""
    assert linear.equations_at_speeds is not None
    try:
        beside = linear.equations_at_speeds(linear.state.u + linear.expand(speeds))
    except NumericalFailure:
        return True
    if not beside.has_stiffness or beside.free_speed_indices != linear.free_speed_indices:
        return True
    fastest, scale = _fastest(linear, speeds), np.sqrt(linear.M.diagonal())
    pairs = ((linear.C, beside.C, fastest), (linear.K, beside.K, fastest**2))
    return any(
        float(np.abs((there - here) / np.outer(scale, scale)).max())
        > _CHANGED * rate + _ROUNDING * float(np.abs(here / np.outer(scale, scale)).max())
        for here, there, rate in pairs
    )
