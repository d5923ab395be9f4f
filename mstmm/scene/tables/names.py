"""Table [names]: names of bodies, ends and hinges in other programs, such as a robot file."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field

from ..validators.scalars_and_vectors import (
    Problem,
    Rule,
    Table,
    ValidationProblems,
    describe_value,
    unexpected,
)

#: Most characters of a name in other programs.
MAX_NAME_LENGTH = 200


def is_external_name(name: object) -> bool:
    """Whether text is a valid name in other programs: printable, not blank, not too long."""
    return (
        isinstance(name, str)
        and len(name) <= MAX_NAME_LENGTH
        and name.isprintable()
        and bool(name.strip())
    )


def _names_rule(of: str, example: str) -> Rule:
    expected = f"a table of {of} by their names in other programs, such as {example}"

    def check(value: Any) -> dict[str, str]:
        if not isinstance(value, dict):
            raise unexpected(expected, value)
        characters = f"printable names of 1 to {MAX_NAME_LENGTH} characters, not only blanks"
        problems = list[Problem]()
        for name, scene_name in value.items():
            if not is_external_name(name):
                problems.append(((str(name),), f"expected {characters}"))
            elif not isinstance(scene_name, str):
                text = f"expected a name of the scene, found {describe_value(scene_name)}"
                problems.append(((name,), text))
        if problems:
            raise ValidationProblems(*problems)
        return dict(value)

    return Rule(expected, check, {"type": "object", "additionalProperties": {"type": "string"}})


_BODIES = _names_rule("bodies and ends", '{ "arm-1" = "arm_1" }')
_HINGES = _names_rule("hinges", '{ "joint-1" = "joint_1" }')


class Names(Table):
    """Map from names in other programs to names of the scene.

    `body` contains bodies and ends ("arm", "arm.tool"), `hinge` hinges.  Names of the scene take
    precedence.
    """

    body: Annotated[dict[str, str], _BODIES] = Field(default_factory=dict)
    hinge: Annotated[dict[str, str], _HINGES] = Field(default_factory=dict)

    def reference(self, name: str) -> str:
        """Body or end with this name in other programs, else the name itself.

        The name may be followed by an end of the body.
        """
        return _replace_known_prefix(name, self.body)

    def of_hinge(self, name: str) -> str:
        """Hinge with this name in other programs, else the name itself."""
        return _replace_known_prefix(name, self.hinge)

    def resolve(self, name: str) -> Iterator[str]:
        """Possible meanings of the name of a quantity or parameter.

        First the name itself, then with names of other programs replaced by those of the scene.
        """
        yield from dict.fromkeys((name, self.of_hinge(name), self.reference(name)))

    def among(self, references: Container[str], hinges: Container[str]) -> Names:
        """Subset of the names whose bodies, ends and hinges exist."""
        body = {name: other for name, other in self.body.items() if other in references}
        hinge = {name: other for name, other in self.hinge.items() if other in hinges}
        return Names.model_construct(body=body, hinge=hinge)


def _replace_known_prefix(name: str, known: Mapping[str, str]) -> str:
    """Replace the longest known prefix of a name, up to a dot, by the name in the scene."""
    end = len(name) if known else -1
    while end > 0:
        if name[:end] in known:
            return known[name[:end]] + name[end:]
        end = name.rfind(".", 0, end)
    return name
