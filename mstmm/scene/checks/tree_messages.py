"""Messages about hinges that form no spanning tree, with remedies."""

from __future__ import annotations

from collections.abc import Iterator

from ...graph.tree_errors import (
    AllHingesCut,
    ConflictingTreeHinges,
    Cyclic,
    TreeProblem,
    UnconnectedBodies,
    WrongHingeDirection,
    tree_problems,
)
from ..validators.validation_messages import Problem
from .connectivity import ConnectivityGraph


def problems(joints: ConnectivityGraph) -> Iterator[Problem]:
    """Locations and messages of all reasons why there is no spanning tree."""
    for problem in tree_problems(joints.node_mechanism):
        yield _tree_problem(joints, problem)


def _tree_problem(joints: ConnectivityGraph, one: TreeProblem) -> Problem:
    match one:
        case WrongHingeDirection(body, hinge):
            return (
                ("body", body),
                f"it has no inboard hinge; swap inboard and outboard of hinge "
                f'"{joints.edge_name(hinge)}"',
            )
        case UnconnectedBodies():
            return _unconnected_problem(joints, one)
        case ConflictingTreeHinges(body, (first, second, *_)):
            return (
                (*joints.scene_location(second), "cut"),
                f'"{joints.name(body)}" already has the inboard hinge "{joints.edge_name(first)}" '
                "with cut = false; leave cut out of one of them",
            )
        case AllHingesCut(body, (hinge,)):
            return (
                (*joints.scene_location(hinge), "cut"),
                f'cannot be cut: it is the only inboard hinge of "{joints.name(body)}"; '
                "leave cut out",
            )
        case AllHingesCut(body, hinges) | Cyclic(body, hinges):
            names = " or ".join(f'"{joints.edge_name(hinge)}"' for hinge in hinges[:4])
            return (
                (*joints.scene_location(hinges[0]), "cut"),
                f'with these cut keys no tree of hinges reaches "{joints.name(body)}"; '
                f"leave cut out of {names}",
            )
    raise AssertionError(one)


def _unconnected_problem(joints: ConnectivityGraph, one: UnconnectedBodies) -> Problem:
    names = [joints.name(node) for node in one.bodies]
    more_text = f" (with {', '.join(names[1:5])}{', ...' if len(names) > 5 else ''})"
    more_text = more_text if names[1:] else ""
    bodies = len(joints.scene.body)
    if one.bodies[0] >= bodies:
        return (
            ("chain", one.bodies[0] - bodies),
            f'no hinge connects it{more_text} to the ground; set inboard = "ground"',
        )
    return (
        ("body", one.bodies[0]),
        f'no hinge connects it{more_text} to the ground; add a hinge of type "free" with '
        f'inboard = "ground" and outboard = "{joints.name(one.base)}"',
    )
