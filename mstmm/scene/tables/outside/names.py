"""Table [names]: names of bodies, ends and hinges in other programs, such as a robot file."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field

from ...rules.values import Location, Refused, Rule, Table, found, refuse

#: Most characters of a name in other programs.
LONGEST = 200


def is_name(name: object) -> bool:
    """Whether text is a valid name in other programs: printable, not blank, at most `LONGEST`."""
    if not isinstance(name, str) or len(name) > LONGEST:
        return False
    return name.isprintable() and bool(name.strip())


def _names(of: str, example: str) -> Rule:
    expected = f"a table of {of} by their names in other programs, such as {example}"

    def check(value: Any) -> dict[str, str]:
        if not isinstance(value, dict):
            raise refuse(f"expected {expected}, found {found(value)}")
        problems = list[tuple[Location, str]]()
        for name, one in value.items():
            if not is_name(name):
                what = f"expected printable names of 1 to {LONGEST} characters, not only blanks"
                problems.append(((str(name),), what))
            elif not isinstance(one, str):
                problems.append(((name,), f"expected a name of the scene, found {found(one)}"))
        if problems:
            raise Refused(*problems)
        return dict(value)

    return Rule(expected, check, {"type": "object", "additionalProperties": {"type": "string"}})


_BODIES = _names("bodies and ends", '{ "arm-1" = "arm_1" }')
_HINGES = _names("hinges", '{ "joint-1" = "joint_1" }')


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
        return _own(name, self.body)

    def of_hinge(self, name: str) -> str:
        """Hinge with this name in other programs, else the name itself."""
        return _own(name, self.hinge)

    def meant(self, name: str) -> Iterator[str]:
        """Possible meanings of the name of a quantity or parameter.

        First the name itself, then with names of other programs replaced by those of the scene.
        """
        yield from dict.fromkeys((name, self.of_hinge(name), self.reference(name)))

    def among(self, references: Container[str], hinges: Container[str]) -> Names:
        """Subset of the names whose bodies, ends and hinges exist."""
        return Names.model_construct(
            body={name: one for name, one in self.body.items() if one in references},
            hinge={name: one for name, one in self.hinge.items() if one in hinges},
        )


def _own(name: str, known: Mapping[str, str]) -> str:
    """Replace the longest known prefix of a name, up to a dot, by the name in the scene."""
    end = len(name) if known else -1
    while end > 0:
        if name[:end] in known:
            return known[name[:end]] + name[end:]
        end = name.rfind(".", 0, end)
    return name
