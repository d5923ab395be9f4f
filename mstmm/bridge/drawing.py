"""Description of a scene as lines of text: its tree, its hinges and the passes of the sweep."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ..derive.schedule.motion import FORWARD
from ..derive.schedule.riccati import CONDENSE, RECOVER
from ..derive.schedule.steps import Pass
from ..runtime.model.model import Model

#: Largest number of lines of a tree or pass; longer ones end with the number omitted.
MOST_LINES = 60
_GROUND = "ground"


@dataclass(frozen=True)
class Joint:
    """Hinge between two bodies, an edge of the drawn tree."""

    name: str
    type: str
    inboard: str
    outboard: str


def joints(model: Model) -> list[Joint]:
    """Hinges of a scene, including those of chains, excluding those of constraints."""
    return [
        Joint(h.name, h.type, h.inboard.partition(".")[0], h.outboard.partition(".")[0])
        for h in model.scene.hinges
    ]


def tree(model: Model) -> list[str]:
    """Lines of the tree from the ground outwards: each hinge with the body that it carries."""
    hinges, cut = joints(model), set(model.loops.cut)
    held: dict[str, list[Joint]] = {}
    for joint in hinges:
        held.setdefault(joint.inboard, []).append(joint)
    lines = [_GROUND]
    stack = _branches(held, _GROUND, "")
    while stack:
        joint, before, last = stack.pop()
        mark = " (closes a loop)" if joint.name in cut else ""
        lines.append(
            f"{before}{'└─' if last else '├─'} {joint.name} ({joint.type}) ─ {joint.outboard}{mark}"
        )
        if joint.name not in cut:
            stack += _branches(held, joint.outboard, before + ("   " if last else "│  "))
    return _cut_short(lines)


def _branches(
    held: dict[str, list[Joint]], body: str, before: str
) -> list[tuple[Joint, str, bool]]:
    """Hinges on a body in reverse order, as needed by a stack."""
    there = held.get(body, [])
    return [(joint, before, joint is there[-1]) for joint in reversed(there)]


def path(model: Model) -> list[tuple[Pass, list[str]]]:
    """Passes of the sweep over a tree, each with the bodies in its order."""
    carried = [joint for joint in _from_root(model) if joint.name not in set(model.loops.cut)]
    out = _cut_short([f"{j.inboard} → {j.outboard} across {j.name}" for j in carried])
    back = _cut_short([f"{j.outboard} → {j.inboard} across {j.name}" for j in reversed(carried)])
    return [(FORWARD, out), (CONDENSE, back), (RECOVER, out)]


def _from_root(model: Model) -> Iterator[Joint]:
    waiting, met = joints(model), {_GROUND}
    while waiting:
        ready = [joint for joint in waiting if joint.inboard in met]
        if not ready:
            return
        for joint in ready:
            met.add(joint.outboard)
            waiting.remove(joint)
            yield joint


def _cut_short(lines: list[str]) -> list[str]:
    if len(lines) <= MOST_LINES:
        return lines
    return [*lines[:MOST_LINES], f"... and {len(lines) - MOST_LINES} more"]
