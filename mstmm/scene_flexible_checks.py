"""Flexible bodies among the other elements of a scene: loads per length, hinges, frames, bases."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from .scene_rules import Location

if TYPE_CHECKING:
    from .scene import Scene

Problem = tuple[Location, str]


def problems(scene: Scene) -> Iterator[Problem]:
    """Everything in which flexible bodies and other elements do not fit each other."""
    return iter(())


def spins(scene: Scene) -> Iterator[Problem]:
    """Beams without inertia about their axis where a hinge lets them spin about it."""
    return iter(())


def warnings(scene: Scene) -> Iterator[str]:
    """What is accepted but worth knowing of flexible bodies."""
    return iter(())
