"""Keys of a beam: sections, shapes, ends; `beam_rules` checks them against each other."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, Field

from ...expression.expression import Expression
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.scalars_and_vectors import (
    NAME_PATTERN,
    Shorthand,
    Table,
    describe_value,
    problem,
    to_python,
)
from .body import End
from .flexible_keys import AUTO, FlexibleTable, frame_field, or_auto

GIVEN = "given"
BASES = (AUTO, "clamped-free", "free-free", "simply-supported", "static+fixed-interface", GIVEN)
ROOT, TIP = "root", "tip"

#: Directions of the shapes in the order of the modal coordinates: deflection along y, along z,
#: rotation about x, displacement along x.
DIRECTIONS = ("y", "z", "twist", "axial")
#: Most shapes in one direction.  For more, half-waves are too short for the theory, and products of
#: shapes cannot be integrated accurately in double precision.
MAX_SHAPES = 60
SHAPE_COUNT_RULE = rules.Rule(
    "a whole number, 0 or more",
    lambda value: _check_count(value),
    {"type": "integer", "minimum": 0},
)


def _check_count(value: Any) -> int:
    value = to_python(value)
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise problem(f"expected {SHAPE_COUNT_RULE.expected}, found {describe_value(value)}")
    return value


class Modes(Table):
    """Number of shapes in each direction."""

    y: Annotated[int, SHAPE_COUNT_RULE] = 0
    z: Annotated[int, SHAPE_COUNT_RULE] = 0
    twist: Annotated[int, SHAPE_COUNT_RULE] = 0
    axial: Annotated[int, SHAPE_COUNT_RULE] = 0

    @property
    def counts(self) -> tuple[int, int, int, int]:
        """Number of shapes along y, along z, in twist and axial."""
        return (self.y, self.z, self.twist, self.axial)

    @property
    def total(self) -> int:
        """Number of modal coordinates."""
        return sum(self.counts)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the modal coordinates in order: "y1", "y2", "z1", ..."""
        counts_by_direction = zip(DIRECTIONS, self.counts, strict=True)
        return tuple(
            f"{direction}{k}"
            for direction, count in counts_by_direction
            for k in range(1, count + 1)
        )


def _widen_modes(value: Any) -> Any:
    value = to_python(value)
    if value == AUTO:
        return None
    if value is None or isinstance(value, (dict, BaseModel)):
        return value
    if isinstance(value, int) and not isinstance(value, bool):
        return {"y": value, "z": value}
    raise problem(f"expected {_MODES_DESCRIPTION}, found {describe_value(value)}")


_MODES_DESCRIPTION = (
    "a whole number of shapes per bending plane, a table { y, z, twist, axial } of whole "
    'numbers, or "auto"'
)


_MODES_RULE = Shorthand(_MODES_DESCRIPTION, _widen_modes, {"type": ["integer", "string"]})


class Shapes(Table):
    """User-defined shape functions by direction: expressions of x (m, from the root) and L (m).

    L is the length.  Deflections and axial displacements are in m per m of the modal coordinate,
    twists in rad per rad.
    """

    y: Annotated[tuple[Expression, ...], texts.expressions_rule("a list of expressions of x")] = ()
    z: Annotated[tuple[Expression, ...], texts.expressions_rule("a list of expressions of x")] = ()
    twist: Annotated[
        tuple[Expression, ...], texts.expressions_rule("a list of expressions of x")
    ] = ()
    axial: Annotated[
        tuple[Expression, ...], texts.expressions_rule("a list of expressions of x")
    ] = ()

    @property
    def modes(self) -> Modes:
        """Number of shapes in each direction, as `Modes`."""
        return Modes(**{direction: len(getattr(self, direction)) for direction in DIRECTIONS})


def _pair_rule(of: str) -> rules.Rule:
    """Rule for one number for both bending planes, or one for each."""
    expected = f"a number, or two, [about y, about z], in {of}"
    inner = rules.numbers_rule(expected, of=of)

    def check(value: Any) -> tuple[float, float]:
        values = inner.check(value)
        if len(values) not in (1, 2):
            raise problem(f"expected {expected}, found {rules.count_text(len(values))}")
        for i, entry in enumerate(values):
            if entry <= 0:
                location = (i,) if len(values) == 2 else ()
                raise problem(
                    f"expected {expected}, more than 0, found {describe_value(entry)}", *location
                )
        return (values[0], values[-1])

    number = {"type": ["number", "string"], "exclusiveMinimum": 0}
    pair = {"type": "array", "items": number, "minItems": 1, "maxItems": 2}
    return rules.Rule(expected, check, {"anyOf": [number, pair]})


class SectionTable(Table):
    """Properties of a section, or of the whole beam (None: not given).

    `bending_stiffness` is (EI_y, EI_z): about y, for deflection along z, and about z, for
    deflection along y; `rotary_inertia` (rho I_y, rho I_z) likewise.
    """

    mass_per_length: Annotated[float | None, rules.number_rule("kg/m", above=0)] = None
    bending_stiffness: Annotated[tuple[float, float] | None, _pair_rule("N m^2")] = None
    axial_stiffness: Annotated[float | None, rules.number_rule("N", above=0)] = None
    torsional_stiffness: Annotated[float | None, rules.number_rule("N m^2", above=0)] = None
    polar_inertia_per_length: Annotated[float | None, rules.number_rule("kg m", above=0)] = None
    rotary_inertia: Annotated[tuple[float, float] | None, _pair_rule("kg m")] = None


class Section(SectionTable):
    """Piece of a beam with a constant section, `from` one x `to` another (m)."""

    from_: Annotated[float, rules.number_rule("m", minimum=0)] = Field(alias="from")
    to: Annotated[float, rules.number_rule("m", above=0)]


def _widen_ends(value: Any) -> Any:
    if not isinstance(value, dict):
        raise problem(f"expected a table such as {{ mid = 5.0 }}, found {describe_value(value)}")
    for key in value:
        if not isinstance(key, str) or not NAME_PATTERN.fullmatch(key):
            raise problem(f"expected the name of an end, found {describe_value(key)}")
    return {key: _widen_end(end_value) for key, end_value in value.items()}


def _widen_end(value: Any) -> Any:
    """Expand the position of an end along the beam (m) to a point in beam axes."""
    value = to_python(value)
    if isinstance(value, dict):
        position = to_python(value.get("position"))
        if isinstance(position, (int, float, str)) and not isinstance(position, bool):
            return {**value, "position": [position, 0.0, 0.0]}
        return value
    if isinstance(value, (list, tuple)):
        return {"position": value}
    if isinstance(value, (int, float, str)) and not isinstance(value, bool):
        return {"position": [value, 0.0, 0.0]}
    return value


class BeamKeys(FlexibleTable, SectionTable):
    """Keys of a beam, before and after `Beam` resolves their defaults."""

    length: Annotated[float, rules.number_rule("m", above=0)]
    section: tuple[Section, ...] = ()
    modes: Annotated[Modes | None, _MODES_RULE] = None
    frame: Annotated[str, frame_field(AUTO, "tangent", "chord", "mean", at_end=True)] = AUTO
    basis: Annotated[str, texts.choice_rule(*BASES)] = AUTO
    shapes: Shapes | None = None
    quadrature: Annotated[bool | None, or_auto(texts.flag_rule())] = None
    viscous_drag: Annotated[float, rules.number_rule("N s/m^2", minimum=0)] = 0.0
    ends: Annotated[
        dict[str, End],
        Shorthand(
            "ends by name: x in m, or a table with position and orientation",
            _widen_ends,
            {
                "type": "object",
                "additionalProperties": {"type": ["number", "string", "array", "object"]},
            },
        ),
    ] = Field(default_factory=dict)

    @property
    def sections(self) -> tuple[Section, ...]:
        """Pieces from root to tip, each with all properties that are given for it or the beam.

        Without `section` there is one piece.  If rotary_inertia is given and
        polar_inertia_per_length is not, the latter is the sum of both entries, as for every plane
        section.
        """
        given_sections = self.section or (
            Section.model_construct(from_=0.0, to=self.length, **dict.fromkeys(_SECTION_KEYS)),
        )
        return tuple(self._complete_section(given_section) for given_section in given_sections)

    def _complete_section(self, piece: Section) -> Section:
        data = {
            key: getattr(self, key) if getattr(piece, key) is None else getattr(piece, key)
            for key in _SECTION_KEYS
        }
        if data["polar_inertia_per_length"] is None and data["rotary_inertia"] is not None:
            data["polar_inertia_per_length"] = sum(data["rotary_inertia"])
        return piece.model_copy(update=data)

    @property
    def mass(self) -> float:
        """Total mass (kg)."""
        return sum(
            (section_data.mass_per_length or 0.0) * (section_data.to - section_data.from_)
            for section_data in self.sections
        )

    @property
    def mode_names(self) -> tuple[str, ...] | None:
        """Names of the modal coordinates, None where their number is chosen at compilation.

        This is the case for "auto", and for a tangent frame at an inner section, which has
        clamped-free shapes on both sides.
        """
        inner_ends = [name for name in self.ends if 0 < self.end_x(name) < self.length]
        has_inner_frame = self.frame_end in inner_ends if self.frame_end else bool(inner_ends)
        may_be_clamped = self.basis in (AUTO, "clamped-free") and self.frame_kind in (
            AUTO,
            "tangent",
        )
        if self.modes is None or (may_be_clamped and has_inner_frame):
            return None
        return self.modes.names

    def end_x(self, at: str) -> float:
        """Position of the end `at` along the beam (m); "" is the root."""
        return self.ends[at or ROOT].position[0]


_SECTION_KEYS = tuple(SectionTable.model_fields)
