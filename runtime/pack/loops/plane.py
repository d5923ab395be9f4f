"""Whether all of a mechanism moves in a plane, whatever its state."""

from __future__ import annotations

from ..bodies import RIGID
from ..elements import Elements
from ..system import BodyNumbers, System

#: Entries of a rotation that a turn about z leaves zero, and how far they may be off: rounding.
_ACROSS, _ROUNDING = (2, 5, 6, 7), 1e-14


def moves_in_a_plane(system: System, elements: Elements) -> bool:
    """Whether hinges alone close its loops, all are free and turn about one axis, and all bodies
    are rigid.  Where bodies lie and what acts across the plane makes no difference."""
    if not system.closures or system.couplings:
        return False
    if any(one.kind != "hinge" for one in system.closures):
        return False
    return all(_turns_in_it(one, elements) for run in system.bodies for one in run.alike)


def _turns_in_it(body: BodyNumbers, elements: Elements) -> bool:
    flat = ("sweep", f"planar_{body.hinge[1]}") in elements
    if not flat or body.body[1] != RIGID or any(body.imposed):
        return False
    rotation = body.connection[:9]
    return rotation[8] > 0.0 and all(abs(rotation[k]) <= _ROUNDING for k in _ACROSS)
