"""The skeleton of a scene: every flexible body as a rigid one with the same ends.

References, names and the tree are checked on it, so that they know one kind of body.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .scene_beam import ROOT
from .scene_parts import Body, End

if TYPE_CHECKING:
    from .scene import Scene
    from .scene_beam import Beam
    from .scene_elastic import Elastic


def skeleton(scene: Scene) -> Scene:
    """The scene with its beams, then its elastic bodies, as bodies without mass behind `body`."""
    bodies = (*scene.body, *map(_bare, scene.beam), *map(_bare, scene.elastic))
    fields = {key: getattr(scene, key) for key in type(scene).model_fields}
    return type(scene).model_construct(**{**fields, "body": bodies, "beam": (), "elastic": ()})


def rigid_beam(beam: Beam) -> Body:
    """The undeformed beam: mass, mass centre and inertia of its sections, and its ends."""
    mass = first = second = polar = 0.0
    about = [0.0, 0.0]
    for s in beam.sections:
        line, long = s.mass_per_length or 0.0, s.to - s.from_
        mass += line * long
        first += line * long * (s.to + s.from_) / 2
        second += line * long * (s.to * s.to + s.to * s.from_ + s.from_ * s.from_) / 3
        spin = (s.polar_inertia_per_length or 0.0) * long
        polar += spin
        own = s.rotary_inertia
        about[0] += spin / 2 if own is None else own[0] * long
        about[1] += spin / 2 if own is None else own[1] * long
    middle = first / mass
    across = second - first * middle
    return Body.model_construct(
        name=beam.name, type="rigid", mass=mass, center_of_mass=(middle, 0.0, 0.0),
        inertia=(polar, across + about[0], across + about[1], 0.0, 0.0, 0.0), ends=beam.ends,
    )  # fmt: skip


def _bare(flexible: Beam | Elastic) -> Body:
    """A body with the ends alone: names and the tree ask for no more."""
    ends = {
        name: End.model_construct(position=end.position or (0.0, 0.0, 0.0),
                                  orientation=end.orientation)
        for name, end in flexible.ends.items()
    }  # fmt: skip
    return Body.model_construct(name=flexible.name, type="rigid", ends=ends)


#: The keys that refer to a body or an end of one.
REFERENCES = {
    "hinge": ("inboard", "outboard"), "chain": ("inboard",), "load": ("on",),
    "spring": ("from_", "to"),
}  # fmt: skip


def at_roots(scene: Scene) -> dict[str, tuple[Any, ...]]:
    """The tables in which a beam's name stands for its root, with "blade.root" in its place.

    Loads per length keep the name of the beam alone.
    """
    beams = {beam.name for beam in scene.beam}
    changed: dict[str, tuple[Any, ...]] = {}
    for table, keys in REFERENCES.items() if beams else ():
        elements = []
        for element in getattr(scene, table):
            update = {
                key: f"{getattr(element, key)}.{ROOT}"
                for key in keys
                if getattr(element, key) in beams
                and getattr(element, "force_per_length", None) is None
            }
            elements.append(element.model_copy(update=update) if update else element)
        changed[table] = tuple(elements)
    return changed
