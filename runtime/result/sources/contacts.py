"""Loads of unilateral contacts: those of bodies that roll on a plane.

Stops push by their law, and bounces by impacts; a rolling constraint keeps its disc on the plane in
both directions, so the sign of its normal load must be checked.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.risk import Risk
from mstmm.scene.tables.closures import ROLLING

if TYPE_CHECKING:
    from mstmm.scene import Constraint

    from ..result_record import Record

#: Parts of the largest load, and of the kinetic energy over the radius, up to which a pulling load
#: is rounding.
_LOAD_ROUNDING, _ENERGY_ROUNDING = 1e-6, 1e-9

#: Name of the row of a rolling constraint that carries its normal load.
_NORMAL_ROW = "normal"

_REMEDY = (
    "use the run up to this time, or model the contact by a stop, which can lift off (law.limits "
    "with a stiffness)"
)


def find_pulling_contacts(result: Record) -> Iterator[Risk]:
    """Find the rolling constraints whose normal load pulls in a sample of the run.

    Indeterminate reactions are checked by their sum; a pulling share is only a note.
    """
    model = result.model
    rolling = [constraint for constraint in model.scene.constraint if constraint.type == ROLLING]
    if not rolling or model.loop_start is None or not len(result.t):
        return
    shares = model.loop_start.loops.indeterminate_reactions
    is_open = {
        constraint.name: _NORMAL_ROW in shares.get(constraint.name, ()) for constraint in rolling
    }
    loads = {
        constraint.name: result.quantity(f"{constraint.name}.load").values for constraint in rolling
    }
    total = np.sum([loads[name] for name in loads if is_open[name]], axis=0)
    for constraint in rolling:
        bound = _load_rounding(result, constraint, loads)
        if not is_open[constraint.name]:
            yield from _pulling_risk(result.t, constraint.name, loads[constraint.name], bound)
        elif (total < -bound).any():
            yield from _pulling_risk(
                result.t, constraint.name, total, bound, "the sum of the normal loads"
            )
        else:
            yield from _pulling_risk(
                result.t, constraint.name, loads[constraint.name], bound,
                "its normal load, indeterminate for rigid bodies,", False,
            )  # fmt: skip


def _load_rounding(result: Record, constraint: Constraint, loads: dict[str, Array]) -> float:
    """Largest load (N) that is rounding."""
    energy = result.quantity("energy.kinetic").values
    largest = max(float(np.nanmax(np.abs(load), initial=0.0)) for load in loads.values())
    assert constraint.radius is not None
    return (
        _LOAD_ROUNDING * largest
        + _ENERGY_ROUNDING * float(np.nanmax(energy, initial=0.0)) / constraint.radius
    )


def _pulling_risk(
    t: Array, name: str, load: Array, bound: float, what: str = "its normal load",
    doubt: bool = True,
) -> Iterator[Risk]:  # fmt: skip
    """Finding of a contact load (n,) in N that pulls by more than `bound`."""
    pulls = load < -bound
    if not pulls.any():
        return
    first, worst = int(np.argmax(pulls)), int(np.nanargmin(load))
    yield Risk(
        "pulling-contact", f'constraint "{name}"',
        f'constraint "{name}" is in tension from t = {t[first]:.6g} s on, where a contact would '
        f"lift off: {what} falls to {load[worst]:.3g} N at t = {t[worst]:.6g} s", _REMEDY,
        float(load[worst]), 0.0, "N", doubt,
    )  # fmt: skip
