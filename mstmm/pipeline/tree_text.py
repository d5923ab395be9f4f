"""Description of a scene as lines of text: its tree, its hinges and the passes of the sweep."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ..derive.schedule.forward_kinematics import FORWARD
from ..derive.schedule.pass_steps import Pass
from ..derive.schedule.riccati_sweep import CONDENSE, RECOVER
from ..runtime.model.model import Model

#: Largest number of lines of a tree or pass; longer ones end with the number omitted.
MAX_LINES = 60
_GROUND = "ground"


@dataclass(frozen=True)
class TreeEdge:
    """Hinge between two bodies, an edge of the drawn tree."""

    name: str
    type: str
    inboard: str
    outboard: str


def tree_edges(model: Model) -> list[TreeEdge]:
    """Hinges of a scene, including those of chains, excluding those of constraints."""
    return [
        TreeEdge(
            hinge.name,
            hinge.type,
            hinge.inboard.partition(".")[0],
            hinge.outboard.partition(".")[0],
        )
        for hinge in model.scene.hinges
    ]


def tree_lines(model: Model) -> list[str]:
    """Lines of the tree from the ground outwards: each hinge with the body that it carries."""
    hinges, cut = tree_edges(model), set(model.loops.cut_hinges)
    edges_by_body: dict[str, list[TreeEdge]] = {}
    for edge in hinges:
        edges_by_body.setdefault(edge.inboard, []).append(edge)
    lines = [_GROUND]
    stack = _branches(edges_by_body, _GROUND, "")
    while stack:
        edge, indent, is_last = stack.pop()
        mark = " (closes a loop)" if edge.name in cut else ""
        lines.append(
            f"{indent}{'└─' if is_last else '├─'} {edge.name} ({edge.type}) ─ {edge.outboard}{mark}"
        )
        if edge.name not in cut:
            stack += _branches(edges_by_body, edge.outboard, indent + ("   " if is_last else "│  "))
    return _truncate(lines)


def _branches(
    held: dict[str, list[TreeEdge]], body: str, before: str
) -> list[tuple[TreeEdge, str, bool]]:
    """Hinges on a body in reverse order, as needed by a stack."""
    edges = held.get(body, [])
    return [(edge, before, edge is edges[-1]) for edge in reversed(edges)]


def sweep_passes(model: Model) -> list[tuple[Pass, list[str]]]:
    """Passes of the sweep over a tree, each with the bodies in its order."""
    edges = [
        edge for edge in _edges_from_root(model) if edge.name not in set(model.loops.cut_hinges)
    ]
    outward_lines = _truncate([f"{j.inboard} → {j.outboard} across {j.name}" for j in edges])
    inward_lines = _truncate(
        [f"{j.outboard} → {j.inboard} across {j.name}" for j in reversed(edges)]
    )
    return [(FORWARD, outward_lines), (CONDENSE, inward_lines), (RECOVER, outward_lines)]


def _edges_from_root(model: Model) -> Iterator[TreeEdge]:
    remaining, reached_bodies = tree_edges(model), {_GROUND}
    while remaining:
        ready = [edge for edge in remaining if edge.inboard in reached_bodies]
        if not ready:
            return
        for edge in ready:
            reached_bodies.add(edge.outboard)
            remaining.remove(edge)
            yield edge


def _truncate(lines: list[str]) -> list[str]:
    if len(lines) <= MAX_LINES:
        return lines
    return [*lines[:MAX_LINES], f"... and {len(lines) - MAX_LINES} more"]
