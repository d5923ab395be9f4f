"""Table [[shape]]: geometry for drawing, without effect on the motion."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Annotated

from ...numerics.rotations import Matrix, Vector, from_orientation
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.rotations_and_inertia import Orientation
from ..validators.scalars_and_vectors import (
    GROUND,
    Position,
    Problem,
    Table,
    describe_value,
    split_reference,
)

#: Keys of each type.
_KEYS_BY_TYPE = {
    "box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"), "mesh": ("file",),
}  # fmt: skip
_KEY_DESCRIPTIONS = {
    "size": "[x, y, z] in m", "radius": "a number in m", "length": "a number in m",
    "file": "an .stl or .obj file in the folder of the scene",
}  # fmt: skip
_COLOUR = texts.pattern_rule('a colour such as "#4477aa"', re.compile("#[0-9a-fA-F]{6}"), str.lower)


class Shape(Table):
    """Box, cylinder, sphere, capsule or mesh drawn at a body, an end or the ground.

    It is drawn in the axes of `on`, rotated by `orientation` and displaced by `position` (m).
    Cylinders and capsules are along z, with their centre there.  A body with shapes is drawn only
    by them.  `length` of a capsule excludes its round ends; `scale` is in m per unit of the mesh.
    """

    name: Annotated[str, texts.name_rule("the shape's name")] = ""
    on: texts.Reference
    type: Annotated[str, texts.choice_rule(*_KEYS_BY_TYPE)]
    size: Annotated[Vector | None, rules.vector_rule("m")] = None
    radius: Annotated[float | None, rules.number_rule("m", above=0)] = None
    length: Annotated[float | None, rules.number_rule("m", above=0)] = None
    file: Annotated[str | None, texts.path_inside_rule(".stl", ".obj")] = None
    scale: Annotated[float | None, rules.number_rule("m per unit of the mesh", above=0)] = None
    position: Position = (0.0, 0.0, 0.0)
    orientation: Orientation = (0.0, 0.0, 0.0)
    color: Annotated[str | None, _COLOUR] = None
    opacity: Annotated[float, rules.number_rule("0 to 1", above=0)] = 1.0

    def _problems(self) -> Iterator[Problem]:
        required_keys = _KEYS_BY_TYPE[self.type]
        for key, description in _KEY_DESCRIPTIONS.items():
            is_given = getattr(self, key) is not None
            if key in required_keys and not is_given:
                yield (key,), f"missing; a {self.type} needs {description}"
            elif is_given and key not in required_keys:
                yield (key,), f"a {self.type} has no {key}; leave it out"
        if self.size is not None and min(self.size) <= 0:
            yield ("size",), f"expected three lengths above 0, found {describe_value(self.size)}"
        if self.scale is not None and self.type != "mesh":
            yield ("scale",), "only a mesh has a scale; leave it out"
        if self.opacity > 1:
            yield ("opacity",), f"expected at most 1, found {describe_value(self.opacity)}"

    @property
    def owner(self) -> str:
        """Body on which the shape is drawn, or "ground"."""
        return split_reference(self.on)[0]

    @property
    def is_on_ground(self) -> bool:
        return self.owner == GROUND

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix from axes of the shape to axes of `on`."""
        return from_orientation(self.orientation)
