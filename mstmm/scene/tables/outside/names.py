"""[names]: what others, such as a robot's file, call bodies, ends and hinges of the scene."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field

from ...rules.values import Location, Refused, Rule, Table, found, refuse

#: The longest name of others, in characters.
LONGEST = 200


def is_name(name: object) -> bool:
    """Whether others may call something so: printable text of `LONGEST` characters at most, not of
    blanks alone."""
    if not isinstance(name, str) or len(name) > LONGEST:
        return False
    return name.isprintable() and bool(name.strip())


def _names(of: str, example: str) -> Rule:
    expected = f"a table of {of} by the names that others have for them, such as {example}"

    def check(value: Any) -> dict[str, str]:
        if not isinstance(value, dict):
            raise refuse(f"expected {expected}, found {found(value)}")
        problems = list[tuple[Location, str]]()
        for name, one in value.items():
            if not is_name(name):
                what = f"expected printable names of 1 to {LONGEST} characters, not blanks alone"
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
    """Names of others -> names of the scene: `body` for bodies and ends ("arm", "arm.tool"),
    `hinge` for hinges.  The scene's own names go before them."""

    body: Annotated[dict[str, str], _BODIES] = Field(default_factory=dict)
    hinge: Annotated[dict[str, str], _HINGES] = Field(default_factory=dict)

    def reference(self, name: str) -> str:
        """The body or end that has this name elsewhere, also with an end of it behind; the name
        itself where none has."""
        return _own(name, self.body)

    def of_hinge(self, name: str) -> str:
        """The same of a hinge."""
        return _own(name, self.hinge)

    def meant(self, name: str) -> Iterator[str]:
        """What the name of a quantity or of a number may mean: itself first, then with the names of
        the scene in place of those of others."""
        yield from dict.fromkeys((name, self.of_hinge(name), self.reference(name)))

    def among(self, references: Container[str], hinges: Container[str]) -> Names:
        """Those of what there is."""
        return Names.model_construct(
            body={name: one for name, one in self.body.items() if one in references},
            hinge={name: one for name, one in self.hinge.items() if one in hinges},
        )


def _own(name: str, known: Mapping[str, str]) -> str:
    """The longest beginning of a name that is known, up to a dot, in the names of the scene."""
    end = len(name) if known else -1
    while end > 0:
        if name[:end] in known:
            return known[name[:end]] + name[end:]
        end = name.rfind(".", 0, end)
    return name
