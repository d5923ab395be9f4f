"""Redundant drives: several drives that move the same degree of freedom of closed loops."""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import MstmmError

from ...packing.scene_packing import packed_system
from ...packing.system_variants import with_drives_released
from ..looped_engine import LoopedEngine
from .assembly import Assembly
from .constraint_rank import geometric_loop_calls
from .loop_calls import REDUNDANT_PIVOT

#: Number of random motions in addition to the number of drives.
_EXTRA_TRIALS = 2
#: Relative size of motions that counts as rounding, and share of a drive in a combination that
#: counts as zero.
_RELATIVE_ROUNDING, _MIN_SHARE = 1e-6, 1e-4
#: Maximum number of drives named in a message.
_MAX_NAMES = 8


def shared_drives_text(engine: LoopedEngine, q: Array) -> str:
    """Message part that names drives of the same degree of freedom near q (nq,), with a remedy.

    Empty if each drive moves its own degree of freedom, or if loops remain open even without
    drives.
    """
    driven = engine.packed.system.driven
    if len(driven) < 2:
        return ""
    try:
        driven_speeds = _driven_speeds_in_motions(engine, q)
    except MstmmError:
        return ""
    drive_sizes = np.linalg.norm(driven_speeds, axis=1)
    moving_drives = np.flatnonzero(drive_sizes > _RELATIVE_ROUNDING * drive_sizes.max())
    left_vectors, singular_values, _ = np.linalg.svd(
        driven_speeds[moving_drives] / drive_sizes[moving_drives, None]
    )
    rank = int((singular_values > _RELATIVE_ROUNDING).sum())
    shared = moving_drives[np.linalg.norm(left_vectors[:, rank:], axis=1) > _MIN_SHARE].tolist()
    names = dict.fromkeys(engine.hinge_name(driven[k][0]) for k in shared)
    return (
        _redundant_drives_text(list(names), len(shared), len(moving_drives) - rank)
        if shared
        else ""
    )


def _driven_speeds_in_motions(engine: LoopedEngine, q: Array) -> Array:
    """Driven speeds (drives, n) in random motions of the mechanism without its drives."""
    packed = engine.packed
    undriven_engine = LoopedEngine(packed_system(with_drives_released(packed.system), packed))
    closed_q = Assembly(undriven_engine, q).positions(q)
    calls = geometric_loop_calls(undriven_engine, closed_q)
    for row, mobility in enumerate(calls.mobility.tolist()):
        calls.records.set_pivot_floor(row, REDUNDANT_PIVOT * mobility)
    driven_speeds = [
        packed.layout.hinges[engine.hinge_name(tree_index)].u + k
        for tree_index, k in packed.system.driven
    ]
    count = len(driven_speeds) + _EXTRA_TRIALS
    trials = np.random.default_rng(0).standard_normal((count, engine.nu))
    rest_correction = calls.correction(calls.velocity_level, closed_q, np.zeros(engine.nu))[0]
    motions = [
        trial + calls.correction(calls.velocity_level, closed_q, trial)[0] - rest_correction
        for trial in trials
    ]
    return np.array(motions)[:, driven_speeds].T


def _redundant_drives_text(names: list[str], drives: int, surplus: int) -> str:
    drive_names = ", ".join(f'"{name}"' for name in names[:_MAX_NAMES]) + " ..." * bool(
        names[_MAX_NAMES:]
    )
    if len(names) == 2:
        drive_names = drive_names.replace(", ", " and ")
    is_single_freedom = drives - surplus == 1
    freedom_text = (
        "the same degree of freedom" if is_single_freedom else "the same degrees of freedom"
    )
    omitted_text = "one" if surplus == 1 else "all but one" if is_single_freedom else "some"
    return (
        f"the drives of hinges {drive_names} move {freedom_text} of the mechanism; omit "
        f"{omitted_text} of these drives, or replace a hinge of the loop by a compliant [[bushing]]"
    )
