"""Table [[hinge]]: a hinge between two bodies, or between a body and the ground."""

from __future__ import annotations

import math
from functools import cache, cached_property
from typing import Annotated, Any, Self, TypeGuard

from pydantic import Field, model_validator

from ...errors import ExpressionError
from ...expression.derivatives import jump_message, motion_at
from ...expression.expression import Expression
from ...expression.parser import context_of_name
from ...ir.hinge_properties import HingeProperties, builtin_hinges, effort_unit
from ...numerics.rotations import (
    Matrix,
    Vector,
    cross,
    from_orientation,
    norm,
    perpendicular_vector,
    unit_rejection,
    unit_vector,
)
from ..validators import constant_expressions, rotations_and_inertia
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.rotations_and_inertia import unit_quaternion
from ..validators.scalars_and_vectors import (
    GROUND,
    Location,
    Numbers,
    Orientation,
    Table,
    ValidationProblems,
    count_text,
    describe_value,
    split_reference,
)
from .law import Law, LawEntry


class Initial(Table):
    """Initial values of a hinge: q (quaternions w, x, y, z) and u, one entry per coordinate."""

    q: Annotated[Numbers | None, rules.numbers_rule("one number per coordinate")] = None
    u: Annotated[Numbers | None, rules.numbers_rule("one number per speed")] = None


class HingeRating(Table):
    """Rating of a joint: range, largest effort and speed; without effect on the motion."""

    lower: Annotated[float | None, rules.number_rule("m or rad")] = None
    upper: Annotated[float | None, rules.number_rule("m or rad")] = None
    effort: Annotated[float | None, rules.number_rule("N or N m", minimum=0)] = None
    velocity: Annotated[float | None, rules.number_rule("m/s or rad/s", minimum=0)] = None

    @model_validator(mode="after")
    def _check(self) -> HingeRating:
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            hint = "; swap them" if self.lower > self.upper else ""
            message = f"lower ({self.lower:g}) must be below upper ({self.upper:g}){hint}"
            raise rules.problem(message, "lower")
        return self


class HingeKeys(Table):
    """Keys of a hinge, before and after `HingeTable` resolves their defaults."""

    type: Annotated[
        str,
        texts.name_rule("a hinge type", ", ".join(builtin_hinges()) + " or a user-defined type"),
    ]
    orientation: Annotated[Orientation, rotations_and_inertia.orientation_rule()] = (0.0, 0.0, 0.0)
    axis: Annotated[Vector, rules.direction_rule()] = (0.0, 0.0, 1.0)
    axis2: Annotated[Vector | None, rules.direction_rule()] = None
    normal: Annotated[Vector | None, rules.direction_rule()] = None
    lead: Annotated[float | None, rules.number_rule("m per turn")] = None
    initial: Initial | None = None
    law: Law = Law()
    drive: Annotated[
        tuple[Expression | None, ...] | None,
        texts.expressions_rule(
            'an expression of t, or a list with one per coordinate ("free" where none)', free=True
        ),
    ] = None
    parameters: Annotated[dict[str, float], texts.parameters_rule()] = Field(default_factory=dict)

    @property
    def builtin(self) -> HingeProperties | None:
        """Facts of the built-in type, None for a user-defined type."""
        return builtin_hinges().get(self.type)

    @cached_property
    def facts(self) -> HingeProperties | None:
        """Facts of the type: coordinates, speeds, keys.

        None for a user-defined type until `Scene.check_types` provides its definition.
        """
        return self.builtin

    @property
    def is_weld(self) -> bool:
        """Whether the type of the hinge is a weld."""
        return self.facts is not None and self.facts.welds

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix at q = 0 from axes of the outboard end to axes of the inboard end."""
        return from_orientation(self.orientation)

    @property
    def unit_axis(self) -> Vector:
        """Unit axis; for planar hinges the unit normal."""
        x, y, z = unit_vector(self.axis)
        return (x, y, z)

    @property
    def unit_axis2(self) -> Vector | None:
        """Second unit axis; for planar hinges made perpendicular to the normal."""
        if self.axis2 is None:
            return None
        if self.facts is not None and self.facts.frame == "plane":
            return unit_rejection(self.axis2, self.axis)
        x, y, z = unit_vector(self.axis2)
        return (x, y, z)

    def end_problems(self) -> list[tuple[Location, str]]:
        """Problems of the ends of the hinge; none for a table without ends."""
        return []

    @property
    def is_released(self) -> bool:
        """Whether the hinge has a release condition."""
        return False

    @property
    def keeps_initial_values(self) -> bool:
        """Whether initial values of q are kept exactly when loops are assembled."""
        return False


_Z_AXIS = (0.0, 0.0, 1.0)
_X_AXIS = (1.0, 0.0, 0.0)
#: Largest difference of initial values of a driven coordinate from its drive, relative above 1.
_MAX_RELATIVE_DIFFERENCE = 1e-9


def resolve_defaults(hinge: HingeKeys) -> dict[str, Any]:
    """Resolve the defaults of a hinge: changed fields.  Raises Refused with all problems.

    Hinges of user-defined types are resolved by `resolve_defaults_for` when their definition is
    available.
    """
    problems = hinge.end_problems()
    changes: dict[str, Any] = {}
    if hinge.builtin is not None:
        if hinge.parameters:
            problems.append((
                ("parameters",),
                f"a {hinge.type} hinge has no parameters; only user-defined types have them",
            ))  # fmt: skip
        changes = _resolve(hinge, hinge.builtin, problems)
    if problems:
        raise ValidationProblems(*problems)
    return changes


def resolve_defaults_for(hinge: HingeKeys, facts: HingeProperties) -> dict[str, Any]:
    """Resolve the defaults of a hinge of a user-defined type with these facts.

    Raises Refused with all problems.
    """
    problems: list[tuple[Location, str]] = []
    changes = _resolve(hinge, facts, problems)
    if problems:
        raise ValidationProblems(*problems)
    return changes


def _resolve(
    hinge: HingeKeys, kind: HingeProperties, problems: list[tuple[Location, str]]
) -> dict[str, Any]:
    changes = _resolve_axes(hinge, kind, problems)
    changes["law"] = _resolve_law(hinge, kind, problems)
    drive = _check_drive(hinge, kind, problems)
    changes["drive"] = drive
    if hinge.is_released and drive is None and kind.coordinates:
        problems.append((
            ("release",),
            "only a driven or fixed hinge can be released; add a drive, or leave it out",
        ))  # fmt: skip
    if hinge.keeps_initial_values and not kind.coordinates:
        problems.append(
            (("hold",), f"{hinge_with_article(kind.name)} has no coordinates; leave it out")
        )
    elif hinge.keeps_initial_values and drive is not None and None not in drive:
        problems.append((("hold",), "the drive gives the initial values; leave it out"))
    if not problems:
        changes["initial"] = _resolve_initial(hinge, kind, drive, problems)
    return changes


def unexpected_keys(hinge: HingeKeys, facts: HingeProperties | None) -> list[tuple[Location, str]]:
    """Problems of unused or missing keys of a hinge with a user-defined type."""
    problems: list[tuple[Location, str]] = []
    if facts is not None:
        _resolve_axes(hinge, facts, problems)
        return problems
    given_keys = [key for key in ("axis2", "normal", "lead") if getattr(hinge, key) is not None]
    return [
        ((key,), f"{hinge_with_article(hinge.type)} has no {key}; leave it out")
        for key in given_keys
    ]


def _resolve_axes(
    hinge: HingeKeys, kind: HingeProperties, problems: list[tuple[Location, str]]
) -> dict[str, Any]:
    """Check axis, axis2, normal and lead for a type; return changed fields."""
    for key in ("axis2", "lead"):
        if key not in kind.keys and getattr(hinge, key) is not None:
            problems.append(((key,), f"{hinge_with_article(kind.name)} has no {key}; leave it out"))
    if hinge.normal is not None and kind.frame != "plane":
        problems.append((("normal",), f"{hinge_with_article(kind.name)} has no normal; use axis"))
    if "axis" not in kind.keys and hinge.axis != _Z_AXIS:
        remedy = "leave it out" if kind.welds else "rotate it by orientation"
        problems.append((("axis",), f"{hinge_with_article(kind.name)} has no axis; {remedy}"))
    if "lead" in kind.keys and (hinge.lead is None or hinge.lead == 0):
        problems.append((
            ("lead",),
            f"a {kind.name} needs its lead in m per turn, not 0; write for example lead = 0.01"
            + ("" if hinge.lead is None else ', or type = "pin"'),
        ))  # fmt: skip
    if kind.frame == "plane":
        return _resolve_planar_axes(hinge, problems)
    if kind.frame == "crossing":
        if hinge.axis2 is None:
            problems.append(
                (
                    ("axis2",),
                    f"{hinge_with_article(kind.name)} needs its second axis; write for example "
                    f"[0, 1, 0]",
                )
            )
        else:
            _check_not_collinear("axis2", hinge.axis2, "axis", hinge.axis, problems)
    return {}


def _resolve_planar_axes(hinge: HingeKeys, problems: list[tuple[Location, str]]) -> dict[str, Any]:
    """Normal (keys `axis` and `normal`) and x direction of a planar hinge; defaults if absent."""
    normal = hinge.axis if hinge.normal is None else hinge.normal
    if hinge.normal is not None and hinge.axis not in (_Z_AXIS, hinge.normal):
        problems.append(
            (
                ("axis",),
                f"axis {describe_value(hinge.axis)} and normal {describe_value(hinge.normal)} "
                f"differ; give one",
            )
        )
    in_plane = hinge.axis2
    if in_plane is None:
        in_plane = _X_AXIS if normal == _Z_AXIS else perpendicular_vector(normal)
    _check_not_collinear("axis2", in_plane, "normal", normal, problems)
    return {"axis": normal, "normal": normal, "axis2": in_plane}


def _check_not_collinear(
    key: str, a: tuple[float, ...], other: str, b: tuple[float, ...],
    problems: list[tuple[Location, str]],
) -> None:  # fmt: skip
    if norm(cross(unit_vector(a), unit_vector(b))) < 1e-6:
        problems.append(
            (
                (key,),
                f"{key} {describe_value(a)} is parallel to {other} {describe_value(b)}; change "
                f"one of them",
            )
        )


# --- law ------------------------------------------------------------------------------------------


def _resolve_law(
    hinge: HingeKeys, kind: HingeProperties, problems: list[tuple[Location, str]]
) -> Law:
    """Resolve the law to one entry per speed."""
    law, count = hinge.law, len(kind.speeds)
    neutral = _inactive_law(type(law))
    changes: dict[str, Any] = {}
    for key in type(law).model_fields:
        values, default = getattr(law, key), getattr(neutral, key)
        location: Location = ("law", key)
        if len(values) > 1 and len(values) != count:
            problems.append(
                (
                    location,
                    f"expected {expected_entries(kind.name, kind.speeds)}, found {len(values)}",
                )
            )
        elif count == 0 and values:
            problems.append((location, "a fixed hinge has no coordinate for a law; leave it out"))
        elif len(values) == 1 and values[0] != default and _units_differ(kind):
            units = ", ".join(effort_unit(s.unit) for s in kind.speeds)
            problems.append(
                (
                    location,
                    f"one number cannot be used for all coordinates of "
                    f"{hinge_with_article(kind.name)}, whose "
                    f"efforts are in {units}; give a list with {count} entries",
                )
            )
        changes[key] = values * count if len(values) == 1 else values or (default,) * count
    if kind.quaternion is not None:
        problems += _rotation_law_problems(kind, changes)
    has_quaternion = kind.quaternion is not None  # already reported by _rotation_law
    if not (kind.straight or has_quaternion) and any(
        stop.restitution for stop in changes["limits"]
    ):
        problems.append(
            (
                ("law", "limits"),
                f"the rates of {hinge_with_article(kind.name)} are not its speeds, which a hard "
                "stop reverses; give the stop a stiffness instead of a restitution",
            )
        )
    return law.model_copy(update=changes)


@cache
def _inactive_law(law: type[Law]) -> LawEntry:
    """Law without effect."""
    return law().entry(0)


def hinge_with_article(type_name: str) -> str:
    """Hinge type with its article: "a pin hinge"."""
    return f"{'an' if type_name[0] in 'aeio' else 'a'} {type_name} hinge"


def expected_entries(type_name: str, coordinates: tuple[Any, ...]) -> str:
    """Expected entries of a list as text: "2 entries for a universal hinge: ..."."""
    names = ", ".join(f"{c.name} ({c.unit})" if c.unit else c.name for c in coordinates)
    return f"{count_text(len(coordinates))} for {hinge_with_article(type_name)}" + (
        f": {names}" if names else ""
    )


def _units_differ(kind: HingeProperties) -> bool:
    return len({s.unit for s in kind.speeds}) > 1


def _rotation_law_problems(
    kind: HingeProperties, law: dict[str, Any]
) -> list[tuple[Location, str]]:
    """Problems of rest and limits for a rotation stored as a quaternion, which has no angle."""
    problems: list[tuple[Location, str]] = []
    if any(law["rest"][-3:]):
        problems.append((
            ("law", "rest"),
            f"the rest angle of the rotation of {hinge_with_article(kind.name)} is 0; "
            "write 0 and change orientation instead",
        ))  # fmt: skip
    if any(stop.acts for stop in law["limits"]):
        problems.append((
            ("law", "limits"),
            f"{hinge_with_article(kind.name)} has no limits; use pin, universal or gimbal hinges",
        ))  # fmt: skip
    return problems


# --- drive and start values -----------------------------------------------------------------------


def _check_drive(
    hinge: HingeKeys, kind: HingeProperties, problems: list[tuple[Location, str]]
) -> tuple[Expression | None, ...] | None:
    drive = hinge.drive
    if drive is None or (drive and all(entry is None for entry in drive)):
        return None
    if kind.quaternion is not None:
        alternatives = "gimbal, planar or prismatic" if kind.slides else "gimbal or universal"
        problems.append(
            (
                ("drive",),
                f"{hinge_with_article(kind.name)} cannot be driven; use {alternatives} hinges",
            )
        )
    elif len(drive) != len(kind.speeds):
        problems.append((
            ("drive",),
            f"expected {expected_entries(kind.name, kind.coordinates)}, found {len(drive)}",
        ))  # fmt: skip
    for k, entry in enumerate(drive):
        if entry is None:
            continue
        location: Location = ("drive", k) if len(drive) > 1 else ("drive",)
        other_names = [
            n
            for n in entry.names
            if n.text != "t" and n.text not in constant_expressions.current_inputs()
        ]
        if other_names:
            inputs = " and inputs" if constant_expressions.current_inputs() else ""
            is_feedback = (
                other_names[0].text.partition("[")[0] in ("q", "u") or len(other_names[0].parts) > 1
            )
            remedy = (
                "; use law.effort for feedback"
                if is_feedback
                else constant_expressions.unknown_name_hint(
                    entry.text, ("t", *constant_expressions.current_inputs())
                )
            )
            problems.append((
                location,
                f"expected a function of t{inputs} only, found {other_names[0].text!r}"
                f"{context_of_name(entry.text, other_names[0])}{remedy}",
            ))  # fmt: skip
        elif entry.depends_on_time_only:
            problems += drive_problems(entry, location)
    return drive


def drive_problems(entry: Expression, place: Location) -> list[tuple[Location, str]]:
    """Problems of a drive: no finite start, no derivatives, or jumps."""
    try:
        start = motion_at(entry, 0.0)
    except ExpressionError as error:
        return [(place, str(error))]
    if all(math.isfinite(x) for x in start):
        switching_times = [t for t in entry.time_breaks() if t >= 0]
        gaps = (
            (math.nextafter(t, -math.inf), math.nextafter(t, math.inf)) for t in switching_times
        )
        jump_text = jump_message(entry, gaps)
        return [(place, f"{describe_value(entry.text)} {jump_text}")] if jump_text else []
    return [(
        place,
        f"{describe_value(entry.text)} or one of its first two derivatives is not finite at t = 0; "
        "start with a smooth motion, for example t^2",
    )]  # fmt: skip


def _resolve_initial(
    hinge: HingeKeys,
    kind: HingeProperties,
    drive: tuple[Expression | None, ...] | None,
    problems: list[tuple[Location, str]],
) -> Initial | None:
    """Resolve the initial values; None where a drive gives all of them."""
    given_initial = hinge.initial
    if drive is not None and None not in drive:
        if given_initial is not None and (
            given_initial.q is not None or given_initial.u is not None
        ):
            problems.append((
                ("initial",),
                "the drive already gives the initial values; leave one of them out",
            ))  # fmt: skip
        return None
    start = [
        motion_at(d, 0.0) if _depends_on_time_only(d) else (0.0, 0.0, 0.0) for d in drive or ()
    ]
    default_q = tuple(s[0] for s in start) if drive else kind.start
    default_u = tuple(s[1] for s in start) if drive else (0.0,) * len(kind.speeds)
    q = _check_start_values(
        kind, "q", given_initial.q if given_initial else None, default_q, drive, problems
    )
    u = _check_start_values(
        kind, "u", given_initial.u if given_initial else None, default_u, drive, problems
    )
    if kind.quaternion is not None and len(q) == len(kind.start):
        first_entry = kind.quaternion
        try:
            unit_q = unit_quaternion(
                q[first_entry : first_entry + 4], "a quaternion w, x, y, z", "initial", "q"
            )
            q = q[:first_entry] + unit_q + q[first_entry + 4 :]
        except ValidationProblems as refused:
            problems += refused.problems
    return Initial(q=q, u=u)


def _depends_on_time_only(drive: Expression | None) -> TypeGuard[Expression]:
    """Whether a coordinate has a drive that depends on time only; inputs are unknown here."""
    return drive is not None and drive.depends_on_time_only


def _check_start_values(
    kind: HingeProperties,
    key: str,
    given: tuple[float, ...] | None,
    default: tuple[float, ...],
    drive: tuple[Expression | None, ...] | None,
    problems: list[tuple[Location, str]],
) -> tuple[float, ...]:
    if given is None:
        return default
    if len(given) != len(default):
        names = kind.coordinates if key == "q" else kind.speeds
        problems.append((
            ("initial", key),
            f"expected {expected_entries(kind.name, names)}, found {len(given)}",
        ))  # fmt: skip
        return given
    for k, entry in enumerate(drive or ()):
        if _depends_on_time_only(entry) and abs(
            given[k] - default[k]
        ) > _MAX_RELATIVE_DIFFERENCE * max(1.0, abs(default[k])):
            problems.append((
                ("initial", key, k),
                f"expected {default[k]:g}, the start of the drive, found {given[k]:g}; correct "
                'it, or write "free" in the drive',
            ))  # fmt: skip
    return given


class HingeTable(HingeKeys):
    """Properties of a hinge without its name and ends.

    `axis` and `axis2` are in the axes of the outboard end at q = 0; for planar hinges they are the
    normal and the direction of x.  `drive` has one entry per coordinate, None where the coordinate
    is free; it is None for a hinge without drive.  For built-in types `initial` is complete (None
    if every coordinate is driven) and `law` has one entry per speed.
    """

    @model_validator(mode="after")
    def _apply_defaults(self) -> Self:
        for key, value in resolve_defaults(self).items():
            object.__setattr__(self, key, value)
        return self


class Hinge(HingeTable):
    """Hinge between an inboard end (or the ground) and an outboard body.

    If the outboard body has several inboard hinges, loops close: one of the hinges is part of the
    tree and the others are cut, which affects only the cost.  `cut` True: cut this one; False: not
    this one; None: whichever costs less.  In loops, initial values are targets of the assembly;
    `hold` keeps those of q exactly.  `rated` has no effect on the motion.
    """

    name: Annotated[str, texts.name_rule("the hinge's name")]
    inboard: Annotated[str, texts.end_rule()]
    outboard: Annotated[str, texts.end_rule()]
    position: Annotated[Vector, rules.vector_rule("m")] = (0.0, 0.0, 0.0)
    release: Annotated[
        Expression | None,
        texts.condition_rule('a time in s or a comparison such as "t >= 1"', time=True),
    ] = None
    cut: Annotated[bool | None, texts.flag_rule()] = None
    hold: Annotated[bool, texts.flag_rule()] = False
    rated: HingeRating | None = None

    @model_validator(mode="after")
    def _rates(self) -> Hinge:
        facts_of_type = self.builtin
        if self.rated is not None and facts_of_type is not None and len(facts_of_type.speeds) != 1:
            raise rules.problem("only hinges of one coordinate are rated; leave it out", "rated")
        return self

    @property
    def inboard_body(self) -> str:
        """Name of the inboard body, or "ground"."""
        return split_reference(self.inboard)[0]

    @property
    def inboard_end(self) -> str:
        """Inboard end of the hinge, "" for the origin of the body or the ground."""
        return split_reference(self.inboard)[1]

    @property
    def outboard_body(self) -> str:
        return split_reference(self.outboard)[0]

    @property
    def outboard_end(self) -> str:
        """Outboard end of the hinge, "" for the origin of the body."""
        return split_reference(self.outboard)[1]

    def end_problems(self) -> list[tuple[Location, str]]:
        """Problems of the ends: ground as outboard, a single body, or a misplaced position."""
        problems: list[tuple[Location, str]] = []
        if self.outboard_body == GROUND:
            problems.append(
                (("outboard",), "the ground cannot be outboard; swap inboard and outboard")
            )
        elif self.inboard_body == self.outboard_body:
            problems.append((
                ("outboard",),
                f'"{self.outboard_body}" is hinged to itself; connect two different bodies',
            ))  # fmt: skip
        if self.inboard_body != GROUND and self.position != (0.0, 0.0, 0.0):
            problems.append((
                ("position",),
                'only a hinge with inboard = "ground" has a position; '
                f'define an end of "{self.inboard_body}" there',
            ))  # fmt: skip
        return problems

    @property
    def keeps_initial_values(self) -> bool:
        """Whether initial values of q are kept exactly."""
        return self.hold

    @property
    def is_released(self) -> bool:
        """Whether the hinge has a release condition."""
        return self.release is not None
