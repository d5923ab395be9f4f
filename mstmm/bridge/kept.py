"""Names that stay symbols in a symbolic linear model: parameters, coordinates and speeds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ..errors import SceneError
from ..runtime.pack import parameters
from ..runtime.pack.slopes import folded
from ..scene.rules.messages import near

if TYPE_CHECKING:
    from ..runtime.linear.equations import Equations


@dataclass(frozen=True)
class Kept:
    """Names given by the user: of parameters by full name, of q and u by index."""

    parameters: dict[str, str] = field(default_factory=dict)
    coordinates: dict[int, str] = field(default_factory=dict)
    speeds: dict[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Motion:
    """Coordinate or speed: the table for its name, its index, and whether it is free."""

    among: dict[int, str]
    place: int
    free: bool


def kept(linear: Equations, keep: Sequence[str]) -> Kept:
    """Resolve the names of `keep` to parameters, coordinates and speeds.

    Raises SceneError for a name that is unknown or listed twice, and for coordinates with a
    prescribed motion or whose rates are not their speeds, as those of quaternions.
    """
    if isinstance(keep, str) or not all(isinstance(name, str) for name in keep):
        raise SceneError(f'keep = {keep!r}: expected a list of names such as ["rod1.mass"]')
    found = Kept()
    motions = dict(_motions(linear, found))
    numbers = parameters.read(linear.model.scene)
    for name in keep:
        if name in motions:
            motion = motions[name]
            if not motion.free:
                raise SceneError(
                    f'keep "{name}": expected a free coordinate whose rate is a speed, or its '
                    "speed, found one that a drive imposes or that is no integral of a speed; "
                    "leave it a number"
                )
            twice = motion.among.setdefault(motion.place, name) != name
        elif name in numbers or f"{name}[0]" in numbers:
            (full,) = parameters.resolved(linear.model.scene, [name])
            twice = found.parameters.setdefault(full, name) != name
        else:
            without = set(folded(linear.model.scene, numbers))
            known = [x for x in numbers if x not in without]
            known += (x for x, motion in motions.items() if motion.free)
            raise SceneError(
                f'keep "{name}": expected a number, coordinate or speed of the scene'
                f"{near(name, known)}"
            )
        if twice:
            raise SceneError(f'keep "{name}": this number is listed twice; name it once')
    return found


def _motions(linear: Equations, found: Kept) -> Iterator[tuple[str, _Motion]]:
    """Iterate over all coordinates and speeds with their full names."""
    for slots in linear.model.layout.owners:
        for k, name in enumerate(slots.q_names):
            free = slots.straight and slots.u + k in linear.free
            yield f"{slots.name}.{name}", _Motion(found.coordinates, slots.q + k, free)
        for k, name in enumerate(slots.u_names):
            free = slots.straight and slots.u + k in linear.free
            yield f"{slots.name}.{name}", _Motion(found.speeds, slots.u + k, free)
