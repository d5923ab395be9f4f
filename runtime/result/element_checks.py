"""Checks of elements after a run: contacts that pull, and stiff springs that deflect."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.risk import Risk
from mstmm.scene.tables.closures import ROLLING

from .certificate_data import SpringDeflection
from .result_record import Record

if TYPE_CHECKING:
    from mstmm.scene import Constraint, Spring

    from .result_record import Record

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


#: Scenes with more springs are not checked.
_MAX_SPRINGS = 200


def stiffest_spring_deflection(result: Record) -> SpringDeflection | None:
    """Largest deflection of the stiffest spring of a scene.

    Of the springs and bushings between ends and of hinges with all motions free; None if there are
    none, without samples, and for scenes with too many springs.
    """
    scene = result.model.scene
    springs = [s for s in scene.spring if s.type == "spring" and s.law.stiffness > 0]
    mounts = [h for h in scene.hinge if h.facts is not None and h.facts.free_body]
    bushings = [b for b in scene.bushing if b.stiffest[0] > 0]
    if not len(result.t) or not 0 < len(springs) + len(mounts) + len(bushings) <= _MAX_SPRINGS:
        return None
    stiffest_spring = max(springs, key=lambda s: s.law.stiffness, default=None)
    deflections: list[SpringDeflection] = []
    if stiffest_spring is not None:
        deflections.append(
            SpringDeflection(
                f'spring "{stiffest_spring.name}"',
                stiffest_spring.law.stiffness,
                _max_stretch(result, stiffest_spring),
            )
        )
    stiffest_bushing = max(bushings, key=lambda b: b.stiffest[0], default=None)
    if stiffest_bushing is not None:
        deflection = result.quantity(f"{stiffest_bushing.name}.deflection").values
        deflections.append(
            SpringDeflection(
                f'bushing "{stiffest_bushing.name}"',
                stiffest_bushing.stiffest[0],
                _max_length(deflection),
            )
        )
    for mount in mounts:
        entries = [mount.law.entry(k) for k in range(3)]
        if any(entry.stiffness > 0 for entry in entries):
            offsets = result.coordinates(mount.name)[:, :3] - [entry.rest for entry in entries]
            stiffness = max(entry.stiffness for entry in entries)
            sprung_offsets = offsets[:, [entry.stiffness > 0 for entry in entries]]
            deflections.append(
                SpringDeflection(f'hinge "{mount.name}"', stiffness, _max_length(sprung_offsets))
            )
    return max(deflections, key=lambda give: give.stiffness, default=None)


def _max_stretch(result: Record, spring: Spring) -> float:
    """Largest |length - rest| in m."""
    ends = [
        np.array(spring.position) if end == "ground" else result.position(end)
        for end in (spring.from_, spring.to)
    ]
    difference = np.asarray(ends[1] - ends[0])
    return _max_length((np.linalg.norm(difference, axis=1) - spring.law.rest)[:, None])


def _max_length(rows: Array) -> float:
    lengths = np.linalg.norm(rows, axis=1)
    return float(np.max(lengths[np.isfinite(lengths)], initial=0.0))
