"""Common keys of beams and elastic bodies: damping, initial values, frame, model level."""

from __future__ import annotations

import re
from typing import Annotated, Any

from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.scalars_and_vectors import (
    NAME_PATTERN,
    Numbers,
    Rule,
    Shorthand,
    Table,
    ValidationProblems,
    count_text,
    problem,
    to_python,
    unexpected,
    value_rule,
)

#: Model levels: coupled with the rigid motion; no deformation; rigid motion first, then the linear
#: elastic response to it.
MODELS = ("flexible", "rigid", "one-way")

AUTO = "auto"
#: Why `damping.strain` is refused.
NO_STRAINS = "only exact beams have strains; give damping = { stiffness = ... }"
_TANGENT = re.compile(rf"tangent(@{NAME_PATTERN.pattern})?")


class Damping(Table):
    """Damping of the shapes: D = 2 ratio omega m for each shape, plus `stiffness` times K.

    `ratio` is one modal damping ratio for all, or one per shape; `stiffness` is a time in s.
    `strain` is the same time for each strain of an exact beam: stretch, shear y, shear z, twist,
    bending about y, bending about z; s.
    """

    ratio: Annotated[
        Numbers, rules.numbers_rule("a modal damping ratio, or a list, one per shape", minimum=0)
    ] = (0.0,)
    stiffness: Annotated[float, rules.number_rule("s", minimum=0)] = 0.0
    strain: Annotated[
        Numbers, rules.numbers_rule("a time in s, or six, one per strain", minimum=0, of="s")
    ] = (0.0,)

    def _check(self) -> None:
        if len(self.strain) not in (1, 6):
            found = count_text(len(self.strain))
            raise problem(f"expected a time in s, or six, one per strain, found {found}", "strain")
        if not self.ratio:
            raise problem("expected a modal damping ratio or more, found an empty list", "ratio")

    @property
    def acts(self) -> bool:
        """Whether there is any damping."""
        return self.stiffness > 0 or any(self.ratio) or any(self.strain)


def _widen_damping(value: Any) -> Any:
    value = to_python(value)
    return value if isinstance(value, (dict, Damping)) else {"ratio": value}


DAMPING = Shorthand(
    "a modal damping ratio, a list of them, one per shape, or a table { ratio, stiffness, strain }",
    _widen_damping,
    {"anyOf": [rules.NUMBER_SCHEMA, {"type": "array", "items": rules.NUMBER_SCHEMA}]},
)


class InitialDeformation(Table):
    """Deformation at t = 0: modal coordinates and their rates (None: zero).

    With `static` it is the static deformation under the loads at t = 0.
    """

    static: texts.Flag = False
    eta: Annotated[Numbers | None, rules.numbers_rule("one number per shape")] = None
    etad: Annotated[Numbers | None, rules.numbers_rule("one number per shape")] = None

    def _check(self) -> None:
        if self.static and self.eta is not None:
            raise problem("static already gives the deformation; leave one of them out", "eta")
        for key in ("eta", "etad"):
            if getattr(self, key) == ():
                raise problem("expected one number per shape, found none; leave it out", key)


_START_SHORTHANDS: dict[str, dict[str, Any]] = {"undeformed": {}, "static": {"static": True}}


def _widen_start(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    if value not in _START_SHORTHANDS:
        expected = '"undeformed", "static" or a table { eta, etad }'
        raise unexpected(expected, value)
    return _START_SHORTHANDS[value]


START = Shorthand(
    '"undeformed", "static" or a table { eta = [...], etad = [...] }',
    _widen_start,
    {"enum": list(_START_SHORTHANDS)},
)


def frame_field(*words: str, at_end: bool = False) -> Rule:
    """Rule for the floating frame: one of these keywords, and with `at_end` "tangent@mid"."""
    expected = ", ".join(f'"{keyword}"' for keyword in words[:-1]) + f' or "{words[-1]}"'
    if at_end:
        expected += ' ("tangent@mid": at that end, else at the end of the inboard hinge)'

    def accepts(value: Any) -> bool:
        is_tangent = at_end and isinstance(value, str) and _TANGENT.fullmatch(value) is not None
        return is_tangent or value in words

    forms: list[dict[str, Any]] = [{"enum": list(words)}]
    if at_end:
        forms.append({"type": "string", "pattern": f"^{_TANGENT.pattern}$"})
    return value_rule(expected, accepts, {"anyOf": forms}, str)


def or_auto(rule: Rule) -> Rule:
    """Rule for the values of another rule, or "auto", which becomes None."""
    expected = f'{rule.expected} or "{AUTO}"'

    def check(value: Any) -> Any:
        if isinstance(value, str):
            if value == AUTO:
                return None
            raise unexpected(expected, value)
        try:
            return rule.check(value)
        except ValidationProblems as refused:
            if all(not location for location, _ in refused.problems):
                raise unexpected(expected, to_python(value)) from None
            raise

    return Rule(expected, check, {"anyOf": [rule.schema, {"const": AUTO}]})


class FlexibleTable(Table):
    """Common keys of flexible bodies.

    `stiffening` includes second-order displacements in the kinematics.
    """

    name: Annotated[str, texts.name_rule("the body's name")]
    stiffening: texts.Flag = True
    damping: Annotated[Damping, DAMPING] = Damping()
    initial: Annotated[InitialDeformation, START] = InitialDeformation()
    model: Annotated[str, texts.choice_rule(*MODELS)] = MODELS[0]

    @property
    def frame_kind(self) -> str:
        """Kind of the floating frame: "auto", "tangent", "chord" or "mean"."""
        return str(getattr(self, "frame", AUTO)).partition("@")[0]

    @property
    def frame_end(self) -> str:
        """End given for a tangent frame; "" is the end of the inboard hinge."""
        return str(getattr(self, "frame", AUTO)).partition("@")[2]
