"""Table [[shape]]: geometry for drawing, without effect on the motion."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import model_validator

from ....numbers.rotations import Matrix, Vector, from_orientation
from ...rules import text as texts
from ...rules import turns
from ...rules import values as rules
from ...rules.values import (
    GROUND,
    Location,
    Orientation,
    Refused,
    Rule,
    Table,
    found,
    refuse,
    split,
)
from ..elastic_keys import path_inside

#: Keys of each type.
_KEYS = {
    "box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"), "mesh": ("file",),
}  # fmt: skip
_MEANT = {
    "size": "[x, y, z] in m", "radius": "a number in m", "length": "a number in m",
    "file": "an .stl or .obj file in the folder of the scene",
}  # fmt: skip
_COLOUR = re.compile("#[0-9a-fA-F]{6}")


def _colour() -> Rule:
    expected = 'a colour such as "#4477aa"'

    def check(value: Any) -> str:
        if not isinstance(value, str) or not _COLOUR.fullmatch(value):
            raise refuse(f"expected {expected}, found {found(value)}")
        return value.lower()

    return Rule(expected, check, {"type": "string", "pattern": f"^{_COLOUR.pattern}$"})


class Shape(Table):
    """Box, cylinder, sphere, capsule or mesh drawn at a body, an end or the ground.

    It is drawn in the axes of `on`, rotated by `orientation` and displaced by `position` (m).
    Cylinders and capsules are along z, with their centre there.  A body with shapes is drawn only
    by them.  `length` of a capsule excludes its round ends; `scale` is in m per unit of the mesh.
    """

    name: Annotated[str, texts.name("the shape's name")] = ""
    on: Annotated[str, texts.end()]
    type: Annotated[str, texts.choice(*_KEYS)]
    size: Annotated[Vector | None, rules.vector("m")] = None
    radius: Annotated[float | None, rules.number("m", above=0)] = None
    length: Annotated[float | None, rules.number("m", above=0)] = None
    file: Annotated[str | None, path_inside(".stl", ".obj")] = None
    scale: Annotated[float | None, rules.number("m per unit of the mesh", above=0)] = None
    position: Annotated[Vector, rules.vector("m")] = (0.0, 0.0, 0.0)
    orientation: Annotated[Orientation, turns.orientation()] = (0.0, 0.0, 0.0)
    color: Annotated[str | None, _colour()] = None
    opacity: Annotated[float, rules.number("0 to 1", above=0)] = 1.0

    @model_validator(mode="after")
    def _check(self) -> Shape:
        problems = list(self._problems())
        if problems:
            raise Refused(*problems)
        return self

    def _problems(self) -> Iterator[tuple[Location, str]]:
        wanted = _KEYS[self.type]
        for key, meant in _MEANT.items():
            given = getattr(self, key) is not None
            if key in wanted and not given:
                yield (key,), f"missing; a {self.type} needs {meant}"
            elif given and key not in wanted:
                yield (key,), f"a {self.type} has no {key}; leave it out"
        if self.size is not None and min(self.size) <= 0:
            yield ("size",), f"expected three lengths above 0, found {found(self.size)}"
        if self.scale is not None and self.type != "mesh":
            yield ("scale",), "only a mesh has a scale; leave it out"
        if self.opacity > 1:
            yield ("opacity",), f"expected at most 1, found {found(self.opacity)}"

    @property
    def owner(self) -> str:
        """Body on which the shape is drawn, or "ground"."""
        return split(self.on)[0]

    @property
    def is_on_ground(self) -> bool:
        return self.owner == GROUND

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix from axes of the shape to axes of `on`."""
        return from_orientation(self.orientation)
