"""What to draw of a run if nobody chose: of each kind what moves most, and in words what not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from ..names import columns
from ..owners.angles import EULER
from .shown import Candidate, Named, Shown

if TYPE_CHECKING:
    from ...pack.layout import HingeSlots
    from ..record import Record

#: Curves of a panel, and panels of a picture.
LINES, PANELS = 6, 4

#: A tip that moves by less than this part of the middle is held by the floating frame.
_HELD = 1e-9

#: Hinges among which these are looked for; ball and free hinges, whose angles are computed; beams.
_LOOKED_AT, _TURNING, _BENT = 10_000, 60, 60


@dataclass(frozen=True)
class Chosen:
    """Names of one panel, in the order of the scene; `more` says what is left out, "" if nothing,
    of which `other` is one."""

    names: tuple[str, ...]
    unit: str
    more: str = ""
    other: str = ""

    @property
    def sentence(self) -> str:
        """What is left out, and how to get it; "" if nothing."""
        return f"{self.more}: name what else you want, such as {self.other}" if self.more else ""


def looked_at(shown: Named, names: Iterable[str]) -> Iterator[Candidate]:
    """Candidates of quantities by name."""
    for name in names:
        found = shown.quantity(name)
        known = found.values[np.isfinite(found.values)]
        yield Candidate(name, found.unit, float(np.ptp(known)) if len(known) else 0.0)


def choose(shown: Shown, lines: int = LINES, panels: int = PANELS) -> list[Chosen]:
    """By unit, in the order of the candidates, those that move most."""
    units: dict[str, list[tuple[str, float]]] = {}
    for name, unit, moved in shown.candidates():
        units.setdefault(unit, []).append((name, moved))
    return [_chosen(unit, some, lines) for unit, some in islice(units.items(), panels)]


def _chosen(unit: str, some: list[tuple[str, float]], lines: int) -> Chosen:
    order = sorted(range(len(some)), key=lambda k: -some[k][1])
    names = tuple(some[k][0] for k in sorted(order[:lines]))
    if len(some) <= lines:
        return Chosen(names, unit)
    first = some[order[lines]]
    more = f"{len(some) - lines} more that move by {first[1]:.2g} {unit or '1'} or less"
    return Chosen(names, unit, more, first[0])


def candidates(result: Record) -> list[Candidate]:
    """Outputs of the scene; where there are none, coordinates of hinges, Euler angles of those that
    have quaternions, and deflections of flexible bodies; where nothing moves, the last end."""
    outputs = result._quantities.outputs()
    if outputs:
        named = [result.quantity(name) for name in outputs]
        return list(looked_at(result, [text for one in named for text in columns(one)]))
    hinges = list(islice(result.model.layout.hinges.values(), _LOOKED_AT))
    turning = [hinge.name for hinge in hinges if hinge.quaternion is not None]
    angles = [f"{name}.{angle}" for name in turning[:_TURNING] for angle in EULER.labels]
    found = [*_coordinates(result, hinges), *looked_at(result, (*angles, *_deflections(result)))]
    return found or list(looked_at(result, _last_end(result)))


def _coordinates(result: Record, hinges: Sequence[HingeSlots]) -> Iterator[Candidate]:
    """Those that have a unit, which quaternions have not; all at once, as there may be many."""
    known = result.q[np.isfinite(result.q).all(axis=1)]
    moved = np.ptp(known, axis=0) if len(known) else np.zeros(result.q.shape[1])
    for hinge in hinges:
        for k, (name, unit) in enumerate(zip(hinge.q_names, hinge.q_units, strict=True)):
            if unit:
                yield Candidate(f"{hinge.name}.{name}", unit, float(moved[hinge.q + k]))


def _last_end(result: Record) -> list[str]:
    body = result.model.scene.skeleton.bodies[-1]
    end = ".".join([body.name, *list(body.ends)[-1:]])
    return [f"{end}.{axis}" for axis in "xyz"]


def _deflections(result: Record) -> Iterator[str]:
    """The larger deflection of the tip of each beam, or the first modal coordinate of a body whose
    frame follows its tip or that is no beam."""
    for name, body in islice(result.model.flexible.items(), _BENT):
        if body.shapes is None:
            yield f"{name}.{body.modes[0]}"
            continue
        across = np.abs(
            np.nan_to_num(result.deflection(name, np.array([0.5, 1.0]) * body.shapes.length))
        )
        middle, tip = np.max(across[:, :, 1:], axis=0, initial=0.0)
        if tip.max() <= _HELD * middle.max():
            yield f"{name}.{body.modes[0]}"
        else:
            yield f"{name}.tip.deflection.{'yz'[int(tip.argmax())]}"
