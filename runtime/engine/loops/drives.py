"""Redundant drives: several drives that move the same degree of freedom of closed loops."""

from __future__ import annotations

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import MstmmError

from ...pack.loops.variants import freed
from ...pack.pack import packed_system
from ..engine import Engine
from .assembly import Assembly
from .calls import REPEATED
from .rank import judging

#: Number of random motions in addition to the number of drives.
_MORE = 2
#: Relative motions that are rounding, and relative shares of a drive in a combination that count as
#: none.
_ROUNDING, _NO_PART = 1e-6, 1e-4
#: Maximum number of drives named in a message.
_NAMED = 8


def sharing(engine: Engine, q: Array) -> str:
    """End of a message that names drives of the same degree of freedom near q (nq,), with a remedy.

    Empty if each drive moves its own degree of freedom, or if loops stay open without drives too.
    """
    driven = engine.packed.system.driven
    if len(driven) < 2:
        return ""
    try:
        moved = _moved(engine, q)
    except MstmmError:
        return ""
    sizes = np.linalg.norm(moved, axis=1)
    moving = np.flatnonzero(sizes > _ROUNDING * sizes.max())
    left, lengths, _ = np.linalg.svd(moved[moving] / sizes[moving, None])
    rank = int((lengths > _ROUNDING).sum())
    shared = moving[np.linalg.norm(left[:, rank:], axis=1) > _NO_PART].tolist()
    names = dict.fromkeys(engine.hinge_name(driven[k][0]) for k in shared)
    return _words(list(names), len(shared), len(moving) - rank) if shared else ""


def _moved(engine: Engine, q: Array) -> Array:
    """Driven speeds (drives, n) in random motions of the mechanism without its drives."""
    packed = engine.packed
    free = Engine(packed_system(freed(packed.system), packed))
    closed = Assembly(free, q).positions(q)
    calls = judging(free, closed)
    for row, mobility in enumerate(calls.mobility.tolist()):
        calls.records.judge(row, REPEATED * mobility)
    places = [
        packed.layout.hinges[engine.hinge_name(place)].u + k for place, k in packed.system.driven
    ]
    count = len(places) + _MORE
    trials = np.random.default_rng(0).standard_normal((count, engine.nu))
    still = calls.correction(calls.slip, closed, np.zeros(engine.nu))[0]
    motions = [one + calls.correction(calls.slip, closed, one)[0] - still for one in trials]
    return np.array(motions)[:, places].T


def _words(names: list[str], drives: int, surplus: int) -> str:
    told = ", ".join(f'"{name}"' for name in names[:_NAMED]) + " ..." * bool(names[_NAMED:])
    if len(names) == 2:
        told = told.replace(", ", " and ")
    alone = drives - surplus == 1
    moved = "the same degree of freedom" if alone else "the same degrees of freedom"
    less = "one" if surplus == 1 else "all but one" if alone else "some"
    return (
        f"the drives of hinges {told} move {moved} of the mechanism; omit {less} of these drives, "
        "or replace a hinge of the loop by a compliant [[bushing]]"
    )
