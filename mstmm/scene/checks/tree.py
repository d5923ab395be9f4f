"""What keeps the hinges of a scene from holding every body, and the way out."""

from __future__ import annotations

from collections.abc import Iterator

from ...graph.obstacles import Cyclic, KeptTwice, Loose, Obstacle, OnlyCut, Turned, obstacles
from ..rules.messages import Problem
from .joints import Joints


def problems(joints: Joints) -> Iterator[Problem]:
    """Places and messages of everything for which there is no tree."""
    for one in obstacles(joints.by_nodes):
        yield _problem(joints, one)


def _problem(joints: Joints, one: Obstacle) -> Problem:
    match one:
        case Turned(body, hinge):
            return (
                ("body", body),
                f'held by no hinge; turn hinge "{joints.edge_name(hinge)}" round: swap its '
                "inboard and outboard",
            )
        case Loose():
            return _loose(joints, one)
        case KeptTwice(body, (first, second, *_)):
            return (
                (*joints.place(second), "cut"),
                f'a body hangs on one hinge, and "{joints.edge_name(first)}" is not to be cut '
                f'either, which holds "{joints.name(body)}" too; leave cut out of one of them',
            )
        case OnlyCut(body, (hinge,)):
            return (
                (*joints.place(hinge), "cut"),
                f'it is the only hinge that holds "{joints.name(body)}", so it cannot be cut; '
                "leave cut out",
            )
        case OnlyCut(body, hinges) | Cyclic(body, hinges):
            names = " or ".join(f'"{joints.edge_name(hinge)}"' for hinge in hinges[:4])
            return (
                (*joints.place(hinges[0]), "cut"),
                f'with what is to be cut, and what not, nothing holds "{joints.name(body)}"; '
                f"leave cut out of {names}",
            )
    raise AssertionError(one)


def _loose(joints: Joints, one: Loose) -> Problem:
    names = [joints.name(node) for node in one.bodies]
    more = f" (with {', '.join(names[1:5])}{', ...' if len(names) > 5 else ''})"
    more = more if names[1:] else ""
    bodies = len(joints.scene.body)
    if one.bodies[0] >= bodies:
        return (
            ("chain", one.bodies[0] - bodies),
            f'no hinge connects it{more} to the ground; hang it on the ground, inboard = "ground"',
        )
    return (
        ("body", one.bodies[0]),
        f'no hinge connects it{more} to the ground; add a hinge of type "free" with '
        f'inboard = "ground" and outboard = "{joints.name(one.base)}"',
    )
