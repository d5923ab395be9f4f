"""Table [[hinge]]: a hinge between two bodies, or between a body and the ground."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import Annotated, Any, TypeGuard

from pydantic import Field

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
from ..validators import constant_expressions
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.rotations_and_inertia import Orientation, unit_quaternion
from ..validators.scalars_and_vectors import (
    GROUND,
    Direction,
    Location,
    Numbers,
    Position,
    Problem,
    Table,
    ValidationProblems,
    count_text,
    describe_value,
    problem,
    split_reference,
)
from .law import Law, check_range

_Z_AXIS = (0.0, 0.0, 1.0)
_X_AXIS = (1.0, 0.0, 0.0)
#: Largest difference of initial values of a driven coordinate from its drive, relative above 1.
_MAX_RELATIVE_DIFFERENCE = 1e-9


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

    def _check(self) -> None:
        check_range(self)


class HingeTable(Table):
    """Properties of a hinge without its name and ends.

    `axis` and `axis2` are in the axes of the outboard end at q = 0; for planar hinges they are the
    normal and the direction of x.  `drive` has one entry per coordinate, None where the coordinate
    is free; it is None for a hinge without drive.  For built-in types `initial` is complete (None
    if every coordinate is driven) and `law` has one entry per speed.
    """

    type: Annotated[
        str,
        texts.name_rule("a hinge type", ", ".join(builtin_hinges()) + " or a user-defined type"),
    ]
    orientation: Orientation = (0.0, 0.0, 0.0)
    axis: Direction = _Z_AXIS
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
    parameters: texts.Parameters = Field(default_factory=dict)

    def _check(self) -> None:
        """Resolve the defaults of a built-in type; others wait for their definition."""
        problems, changes = list(self._end_problems()), dict[str, Any]()
        if self.builtin is not None:
            if self.parameters:
                text = f"a {self.type} hinge has no parameters; only user-defined types have them"
                problems.append((("parameters",), text))
            resolution = _Resolution(self, self.builtin, problems)
            changes = resolution.changes()
        if problems:
            raise ValidationProblems(*problems)
        vars(self).update(changes)

    def _end_problems(self) -> Iterator[Problem]:
        """Problems of the ends of the hinge; none for a table without ends."""
        return iter(())

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

    @property
    def is_released(self) -> bool:
        """Whether the hinge has a release condition."""
        return False

    @property
    def keeps_initial_values(self) -> bool:
        """Whether initial values of q are kept exactly when loops are assembled."""
        return False


class Hinge(HingeTable):
    """Hinge between an inboard end (or the ground) and an outboard body.

    If the outboard body has several inboard hinges, loops close: one of the hinges is part of the
    tree and the others are cut, which affects only the cost.  `cut` True: cut this one; False: not
    this one; None: whichever costs less.  In loops, initial values are targets of the assembly;
    `hold` keeps those of q exactly.  `rated` has no effect on the motion.
    """

    name: Annotated[str, texts.name_rule("the hinge's name")]
    inboard: texts.Reference
    outboard: texts.Reference
    position: Position = (0.0, 0.0, 0.0)
    release: Annotated[
        Expression | None,
        texts.condition_rule('a time in s or a comparison such as "t >= 1"', time=True),
    ] = None
    cut: Annotated[bool | None, texts.flag_rule()] = None
    hold: texts.Flag = False
    rated: HingeRating | None = None

    def _check(self) -> None:
        super()._check()
        if self.rated is not None and self.builtin is not None and len(self.builtin.speeds) != 1:
            raise problem("only hinges of one coordinate are rated; leave it out", "rated")

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

    def _end_problems(self) -> Iterator[Problem]:
        """Problems of the ends: ground as outboard, a single body, or a misplaced position."""
        if self.outboard_body == GROUND:
            yield ("outboard",), "the ground cannot be outboard; swap inboard and outboard"
        elif self.inboard_body == self.outboard_body:
            text = f'"{self.outboard_body}" is hinged to itself; connect two different bodies'
            yield ("outboard",), text
        if self.inboard_body != GROUND and self.position != (0.0, 0.0, 0.0):
            yield (
                ("position",),
                'only a hinge with inboard = "ground" has a position; '
                f'define an end of "{self.inboard_body}" there',
            )

    @property
    def keeps_initial_values(self) -> bool:
        """Whether initial values of q are kept exactly."""
        return self.hold

    @property
    def is_released(self) -> bool:
        """Whether the hinge has a release condition."""
        return self.release is not None


# --- defaults and rules by type -------------------------------------------------------------------


def resolve_defaults_for(hinge: HingeTable, facts: HingeProperties) -> dict[str, Any]:
    """Resolve the defaults of a hinge of a user-defined type with these facts.

    Raises Refused with all problems.
    """
    problems: list[Problem] = []
    changes = _Resolution(hinge, facts, problems).changes()
    if problems:
        raise ValidationProblems(*problems)
    return changes


def unexpected_keys(hinge: HingeTable, facts: HingeProperties | None) -> list[Problem]:
    """Problems of unused or missing keys of a hinge with a user-defined type."""
    problems: list[Problem] = []
    if facts is not None:
        _Resolution(hinge, facts, problems).axes()
        return problems
    given_keys = [key for key in ("axis2", "normal", "lead") if getattr(hinge, key) is not None]
    return [
        ((key,), f"{_with_article(hinge.type)} has no {key}; leave it out") for key in given_keys
    ]


class _Resolution:
    """Defaults of a hinge by its type; problems of its keys are added to a list."""

    def __init__(self, hinge: HingeTable, kind: HingeProperties, problems: list[Problem]) -> None:
        self.hinge, self.kind, self.problems = hinge, kind, problems
        self.name = _with_article(kind.name)

    def reject(self, message: str, *location: str | int) -> None:
        """Add a problem of a key."""
        self.problems.append((location, message))

    def changes(self) -> dict[str, Any]:
        """Changed fields of the hinge."""
        hinge, kind = self.hinge, self.kind
        changes = self.axes() | {"law": self.law(), "drive": self.drive()}
        drive = changes["drive"]
        if hinge.is_released and drive is None and kind.coordinates:
            self.reject(
                "only a driven or fixed hinge can be released; add a drive, or leave it out",
                "release",
            )
        if hinge.keeps_initial_values and not kind.coordinates:
            self.reject(f"{self.name} has no coordinates; leave it out", "hold")
        elif hinge.keeps_initial_values and drive is not None and None not in drive:
            self.reject("the drive gives the initial values; leave it out", "hold")
        if not self.problems:
            changes["initial"] = self.initial(drive)
        return changes

    def axes(self) -> dict[str, Any]:
        """Check axis, axis2, normal and lead for a type; return changed fields."""
        hinge, kind = self.hinge, self.kind
        for key in ("axis2", "lead"):
            if key not in kind.keys and getattr(hinge, key) is not None:
                self.reject(f"{self.name} has no {key}; leave it out", key)
        if hinge.normal is not None and kind.frame != "plane":
            self.reject(f"{self.name} has no normal; use axis", "normal")
        if "axis" not in kind.keys and hinge.axis != _Z_AXIS:
            remedy = "leave it out" if kind.welds else "rotate it by orientation"
            self.reject(f"{self.name} has no axis; {remedy}", "axis")
        if "lead" in kind.keys and (hinge.lead is None or hinge.lead == 0):
            self.reject(
                f"a {kind.name} needs its lead in m per turn, not 0; write for example lead = 0.01"
                + ("" if hinge.lead is None else ', or type = "pin"'),
                "lead",
            )
        if kind.frame == "plane":
            return self._planar_axes()
        if kind.frame == "crossing" and hinge.axis2 is None:
            text = f"{self.name} needs its second axis; write for example [0, 1, 0]"
            self.reject(text, "axis2")
        elif kind.frame == "crossing" and hinge.axis2 is not None:
            self._check_not_collinear("axis2", hinge.axis2, "axis", hinge.axis)
        return {}

    def _planar_axes(self) -> dict[str, Any]:
        """Normal (keys `axis` and `normal`) and x direction of a planar hinge."""
        hinge = self.hinge
        normal = hinge.axis if hinge.normal is None else hinge.normal
        if hinge.normal is not None and hinge.axis not in (_Z_AXIS, hinge.normal):
            self.reject(
                f"axis {describe_value(hinge.axis)} and normal {describe_value(hinge.normal)} "
                f"differ; give one",
                "axis",
            )
        in_plane = hinge.axis2
        if in_plane is None:
            in_plane = _X_AXIS if normal == _Z_AXIS else perpendicular_vector(normal)
        self._check_not_collinear("axis2", in_plane, "normal", normal)
        return {"axis": normal, "normal": normal, "axis2": in_plane}

    def _check_not_collinear(self, key: str, a: Numbers, other: str, b: Numbers) -> None:
        if norm(cross(unit_vector(a), unit_vector(b))) < 1e-6:
            self.reject(
                f"{key} {describe_value(a)} is parallel to {other} {describe_value(b)}; change "
                f"one of them",
                key,
            )

    def law(self) -> Law:
        """Law with one entry per speed."""
        law, kind, count = self.hinge.law, self.kind, len(self.kind.speeds)
        units_differ = len({s.unit for s in kind.speeds}) > 1
        changes = dict[str, Any]()
        for key in type(law).model_fields:
            values, default = getattr(law, key), getattr(_INACTIVE_LAW, key)
            if len(values) > 1 and len(values) != count:
                expected = _expected_entries(kind.name, kind.speeds)
                self.reject(f"expected {expected}, found {len(values)}", "law", key)
            elif count == 0 and values:
                self.reject("a fixed hinge has no coordinate for a law; leave it out", "law", key)
            elif len(values) == 1 and values[0] != default and units_differ:
                units = ", ".join(effort_unit(s.unit) for s in kind.speeds)
                self.reject(
                    f"one number cannot be used for all coordinates of {self.name}, whose "
                    f"efforts are in {units}; give a list with {count} entries",
                    "law",
                    key,
                )
            changes[key] = values * count if len(values) == 1 else values or (default,) * count
        if kind.quaternion is not None:  # a rotation stored as a quaternion has no angle
            if any(changes["rest"][-3:]):
                self.reject(
                    f"the rest angle of the rotation of {self.name} is 0; "
                    "write 0 and change orientation instead",
                    "law",
                    "rest",
                )
            if any(stop.acts for stop in changes["limits"]):
                text = f"{self.name} has no limits; use pin, universal or gimbal hinges"
                self.reject(text, "law", "limits")
        elif not kind.straight and any(stop.restitution for stop in changes["limits"]):
            self.reject(
                f"the rates of {self.name} are not its speeds, which a hard stop reverses; give "
                "the stop a stiffness instead of a restitution",
                "law",
                "limits",
            )
        return law.model_copy(update=changes)

    def drive(self) -> tuple[Expression | None, ...] | None:
        """Drive, None where all coordinates are free."""
        drive, kind = self.hinge.drive, self.kind
        if drive is None or (drive and all(entry is None for entry in drive)):
            return None
        if kind.quaternion is not None:
            alternatives = "gimbal, planar or prismatic" if kind.slides else "gimbal or universal"
            self.reject(f"{self.name} cannot be driven; use {alternatives} hinges", "drive")
        elif len(drive) != len(kind.speeds):
            expected = _expected_entries(kind.name, kind.coordinates)
            self.reject(f"expected {expected}, found {len(drive)}", "drive")
        for k, entry in enumerate(drive):
            location: Location = ("drive", k) if len(drive) > 1 else ("drive",)
            if entry is not None:
                self.problems += _drive_entry_problems(entry, location)
        return drive

    def initial(self, drive: tuple[Expression | None, ...] | None) -> Initial | None:
        """Initial values; None where a drive gives all of them."""
        kind, given = self.kind, self.hinge.initial or Initial()
        if drive is not None and None not in drive:
            if given.q is not None or given.u is not None:
                text = "the drive already gives the initial values; leave one of them out"
                self.reject(text, "initial")
            return None
        start = [
            motion_at(d, 0.0) if _depends_on_time_only(d) else (0.0, 0.0, 0.0) for d in drive or ()
        ]
        default_q = tuple(s[0] for s in start) if drive else kind.start
        default_u = tuple(s[1] for s in start) if drive else (0.0,) * len(kind.speeds)
        q = self._start_values("q", given.q, default_q, drive)
        u = self._start_values("u", given.u, default_u, drive)
        first = kind.quaternion
        if first is not None and len(q) == len(kind.start):
            try:
                quaternion = q[first : first + 4]
                unit = unit_quaternion(quaternion, "a quaternion w, x, y, z", "initial", "q")
                q = q[:first] + unit + q[first + 4 :]
            except ValidationProblems as refused:
                self.problems += refused.problems
        return Initial(q=q, u=u)

    def _start_values(
        self,
        key: str,
        given: Numbers | None,
        default: Numbers,
        drive: tuple[Expression | None, ...] | None,
    ) -> Numbers:
        if given is None:
            return default
        if len(given) != len(default):
            names = self.kind.coordinates if key == "q" else self.kind.speeds
            expected = _expected_entries(self.kind.name, names)
            self.reject(f"expected {expected}, found {len(given)}", "initial", key)
            return given
        for k, entry in enumerate(drive or ()):
            tolerance = _MAX_RELATIVE_DIFFERENCE * max(1.0, abs(default[k]))
            if _depends_on_time_only(entry) and abs(given[k] - default[k]) > tolerance:
                self.reject(
                    f"expected {default[k]:g}, the start of the drive, found {given[k]:g}; correct "
                    'it, or write "free" in the drive',
                    "initial",
                    key,
                    k,
                )
        return given


#: Law without effect.
_INACTIVE_LAW = Law().entry(0)


def _with_article(type_name: str) -> str:
    """Hinge type with its article: "a pin hinge"."""
    return f"{'an' if type_name[0] in 'aeio' else 'a'} {type_name} hinge"


def _expected_entries(type_name: str, coordinates: tuple[Any, ...]) -> str:
    """Expected entries of a list as text: "2 entries for a universal hinge: ..."."""
    names = ", ".join(f"{c.name} ({c.unit})" if c.unit else c.name for c in coordinates)
    count = f"{count_text(len(coordinates))} for {_with_article(type_name)}"
    return f"{count}: {names}" if names else count


# --- drives ---------------------------------------------------------------------------------------


def _depends_on_time_only(drive: Expression | None) -> TypeGuard[Expression]:
    """Whether a coordinate has a drive that depends on time only; inputs are unknown here."""
    return drive is not None and drive.depends_on_time_only


def _drive_entry_problems(entry: Expression, location: Location) -> list[Problem]:
    """Problems of the drive of a coordinate: other names than t and inputs, no smooth motion."""
    inputs = constant_expressions.current_inputs()
    other = next((n for n in entry.names if n.text != "t" and n.text not in inputs), None)
    if other is None:
        return drive_problems(entry, location) if entry.depends_on_time_only else []
    if other.text.partition("[")[0] in ("q", "u") or len(other.parts) > 1:
        remedy = "; use law.effort for feedback"
    else:
        remedy = constant_expressions.unknown_name_hint(entry.text, ("t", *inputs))
    known = "t and inputs" if inputs else "t"
    context = context_of_name(entry.text, other)
    return [
        (location, f"expected a function of {known} only, found {other.text!r}{context}{remedy}")
    ]


def drive_problems(entry: Expression, place: Location) -> list[Problem]:
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
