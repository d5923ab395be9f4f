"""Table [[beam]]: Euler-Bernoulli beam along its x axis, with ends "root" (x = 0) and "tip"."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import BaseModel, Field, model_validator

from ...expression.expression import Expression
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.scalars_and_vectors import (
    NAME_PATTERN,
    Location,
    Shorthand,
    Table,
    ValidationProblems,
    count_text,
    describe_value,
    problem,
    to_python,
)
from ..validators.validation_messages import did_you_mean
from .body import End
from .flexible_keys import AUTO, FlexibleTable, frame_field, or_auto
from .shape_functions import shape_problem

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


Problem = tuple[Location, str]

#: Largest gap between pieces, and distance of ends from the beam, relative to its length.
_MAX_RELATIVE_ROUNDING = 1e-9
#: Largest relative difference of the polar inertia from the sum of both rotary inertias.
_MAX_POLAR_DIFFERENCE = 1e-3
#: Smallest mass, moment and stiffness of a beam, and the inverse of the largest.
_MIN_MAGNITUDE = 1e-100
#: Largest ratio between two pieces of a beam in mass or stiffness per length.
_MAX_PIECE_RATIO = 1e12

#: Key of the section -> its meaning and unit.
_KEY_DESCRIPTIONS = {
    "mass_per_length": "a number in kg/m, more than 0",
    "bending_stiffness": "E I in N m^2, more than 0: a number, or [about y, about z]",
    "axial_stiffness": "E A in N, more than 0",
    "torsional_stiffness": "G I_t in N m^2, more than 0",
    "polar_inertia_per_length": "rho I_p in kg m, more than 0",
    "rotary_inertia": "[rho I_y, rho I_z] in kg m, more than 0",
}


def problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of the keys of a beam with each other."""
    section_problems = list(_section_problems(beam))
    yield from section_problems
    yield from _mode_problems(beam)
    if not section_problems:
        yield from _property_problems(beam)
        yield from _polar_inertia_problems(beam)
        yield from _magnitude_problems(beam)
    yield from _shape_problems(beam)
    yield from _end_problems(beam)
    yield from _list_problems(beam)


def joined_sections(beam: BeamKeys) -> tuple[Section, ...]:
    """Pieces of a beam, each starting exactly where the one before ends."""
    joined_pieces: list[Section] = []
    for k, piece in enumerate(beam.section):
        start = joined_pieces[-1].to if joined_pieces else 0.0
        end = beam.length if k == len(beam.section) - 1 else piece.to
        joined_pieces.append(piece.model_copy(update={"from_": start, "to": end}))
    return tuple(joined_pieces)


def _section_problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of pieces that do not cover the beam exactly once from root to tip."""
    covered_length, tolerance = 0.0, _MAX_RELATIVE_ROUNDING * beam.length
    for i, piece in enumerate(beam.section):
        if piece.to - piece.from_ <= tolerance:
            yield (
                ("section", i, "to"),
                f"expected a number in m, more than from ({piece.from_:g}), found {piece.to:g}",
            )
            return
        if abs(piece.from_ - covered_length) > tolerance:
            defect = "gap" if piece.from_ > covered_length else "overlap"
            boundary_text = "the beam begins" if i == 0 else "the previous piece ends"
            yield (
                ("section", i, "from"),
                f"expected {covered_length:g} m, where {boundary_text}, found {piece.from_:g}, "
                f"{_with_article(defect)} of {abs(piece.from_ - covered_length):g} m; write from "
                f"= {covered_length:g}",
            )
            return
        covered_length = piece.to
    if beam.section and abs(covered_length - beam.length) > tolerance:
        yield (
            ("section", len(beam.section) - 1, "to"),
            f"expected the length of the beam, {beam.length:g} m, found {covered_length:g}; "
            "correct the end of the last piece, or length",
        )


def _with_article(word: str) -> str:
    return f"{'an' if word[0] in 'aeiou' else 'a'} {word}"


# --- shapes and their required properties ---------------------------------------------------------


def _mode_problems(beam: BeamKeys) -> Iterator[Problem]:
    if beam.modes is None or beam.model == "rigid":
        return
    if beam.modes.total == 0:
        yield (
            ("modes",),
            "expected at least one shape, found none; write for example modes = 3, or "
            'model = "rigid"',
        )
    for direction, count in zip(DIRECTIONS, beam.modes.counts, strict=True):
        if count > MAX_SHAPES:
            yield (
                ("modes", direction),
                f"expected {MAX_SHAPES} shapes or fewer, found {count}: shapes with such short "
                "waves are linearly dependent to rounding and outside beam theory; "
                "divide the beam into parts on fixed hinges",
            )


def _property_problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of missing section properties, or of properties given only for some pieces."""
    sections = beam.sections
    for key, reason in _required_keys(beam).items():
        for i, piece in enumerate(sections):
            if getattr(piece, key) is None:
                yield (
                    _location_of(beam, i, key),
                    f"missing; {reason}expected {_KEY_DESCRIPTIONS[key]}",
                )
                break
    for key in _KEY_DESCRIPTIONS:
        incomplete_indices = [i for i, piece in enumerate(sections) if getattr(piece, key) is None]
        if 0 < len(incomplete_indices) < len(sections) and key not in _required_keys(beam):
            yield (
                _location_of(beam, incomplete_indices[0], key),
                f"missing, though other pieces have it; expected {_KEY_DESCRIPTIONS[key]}",
            )


def _location_of(beam: BeamKeys, i: int, key: str) -> Location:
    return ("section", i, key) if beam.section else (key,)


def _required_keys(beam: BeamKeys) -> dict[str, str]:
    """Required keys, each with the reason as a prefix for messages."""
    required = {"mass_per_length": ""}
    if beam.model == "rigid":
        return required
    modes = beam.modes
    if modes is None or modes.y or modes.z:
        required["bending_stiffness"] = ""
    if modes is not None and modes.twist:
        required["torsional_stiffness"] = "twist shapes need it: "
        required["polar_inertia_per_length"] = "twist shapes need it: "
    if modes is not None and modes.axial:
        required["axial_stiffness"] = "axial shapes need it: "
    return required


def _polar_inertia_problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of a polar inertia that is not the sum of both rotary inertias."""
    for i, piece in enumerate(beam.sections):
        polar, rotary = piece.polar_inertia_per_length, piece.rotary_inertia
        if (
            polar is None
            or rotary is None
            or abs(polar - sum(rotary)) <= _MAX_POLAR_DIFFERENCE * polar
        ):
            continue
        yield (
            _location_of(beam, i, "polar_inertia_per_length"),
            f"expected the sum of both entries of rotary_inertia, {sum(rotary):g} kg m, as for "
            f"every plane section, found {polar:g}; leave it out",
        )
        return


def _magnitude_problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of a beam whose moments, stiffnesses or frequencies overflow or underflow."""
    if any(piece.mass_per_length is None for piece in beam.sections):
        return
    length_squared, length_cubed = (
        beam.length * beam.length,
        beam.length * beam.length * beam.length,
    )
    sizes = [length_cubed, beam.mass, beam.mass * length_squared]
    for piece in beam.sections:
        stiffness = [EI / (length_cubed or 1) for EI in piece.bending_stiffness or ()]
        stiffness += [EA / beam.length for EA in (piece.axial_stiffness,) if EA is not None]
        sizes += [*stiffness, *(k / (beam.mass or 1) for k in stiffness)]
        polar_inertia = piece.polar_inertia_per_length
        for twist in (piece.torsional_stiffness,) if polar_inertia else ():
            sizes += (
                []
                if twist is None
                else [twist, twist / (polar_inertia or 1) / (length_squared or 1)]
            )
    if not all(_MIN_MAGNITUDE < size < 1 / _MIN_MAGNITUDE for size in sizes):
        yield (
            ("length",),
            f"a beam of {beam.length:g} m and {beam.mass:g} kg has mass and stiffness outside the "
            "range of double precision; check the units (m, kg/m, N m^2)",
        )
        return
    yield from _ratio_problems(beam)


def _ratio_problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of pieces so different that shapes of one are lost to rounding of another."""
    for key in _KEY_DESCRIPTIONS:
        section_values = [getattr(piece, key) for piece in beam.sections]
        rows = [
            entry if isinstance(entry, tuple) else (entry,)
            for entry in section_values
            if entry is not None
        ]
        for column in zip(*rows, strict=True):
            smallest, largest = min(column), max(column)
            if smallest > 0 and largest > _MAX_PIECE_RATIO * smallest:
                i = next(i for i, row in enumerate(rows) if smallest in row)
                yield (
                    _location_of(beam, i, key),
                    f"expected {1 / _MAX_PIECE_RATIO:g} of the largest one, {largest:g}, or more, "
                    f"found "
                    f"{smallest:g}: the shapes of such a beam are linearly dependent to rounding; "
                    "model the light part as a separate beam",
                )
                return


def _shape_problems(beam: BeamKeys) -> Iterator[Problem]:
    shapes = beam.shapes
    if shapes is None:
        if beam.basis == "given":
            yield ("shapes",), 'missing; basis = "given" needs shapes, as in { y = ["(x/L)^2"] }'
        return
    if beam.basis != "given":
        yield (
            ("basis",),
            f'expected "given" with shapes, found "{beam.basis}"; leave out basis or shapes',
        )
    if beam.modes is not None and beam.modes != shapes.modes:
        counts = ", ".join(
            f"{word_} = {shape_count}"
            for word_, shape_count in zip(DIRECTIONS, shapes.modes.counts, strict=True)
        )
        yield ("modes",), f"shapes has {counts}; leave out modes"
    for direction in DIRECTIONS:
        for i, expression in enumerate(getattr(shapes, direction)):
            message = shape_problem(expression, beam.length, 2 if direction in ("y", "z") else 1)
            if message is not None:
                yield ("shapes", direction, i), message


# --- ends, frame, start values --------------------------------------------------------------------


def _end_problems(beam: BeamKeys) -> Iterator[Problem]:
    tolerance = _MAX_RELATIVE_ROUNDING * beam.length
    for name, end in beam.ends.items():
        x, y, z = end.position
        location: Location = ("ends", name)
        fixed_position = {"root": 0.0, "tip": beam.length}.get(name)
        if y or z:
            yield (
                location,
                f"expected a point on the axis of the beam, found {describe_value(end.position)}; "
                "connect an offset end by a rigid body on a fixed hinge",
            )
        elif fixed_position is not None and abs(x - fixed_position) > tolerance:
            yield (
                location,
                f'expected {fixed_position:g} m, the position of "{name}" on every beam, found '
                f"{x:g}; choose another name",
            )
        elif not -tolerance <= x <= beam.length + tolerance:
            yield (
                location,
                f"expected a position on the beam, 0 to {beam.length:g} m, found {x:g}",
            )
    frame_end = beam.frame_end
    if frame_end and frame_end not in beam.ends:
        yield (
            ("frame",),
            f'there is no end "{frame_end}"{did_you_mean(frame_end, beam.ends)}; define a section '
            f"as an end, as in ends = {{ {frame_end} = {beam.length / 2:g} }}",
        )


def _list_problems(beam: BeamKeys) -> Iterator[Problem]:
    """Problems of lists that need one entry per shape."""
    lists = [
        (("initial", "eta"), beam.initial.eta),
        (("initial", "etad"), beam.initial.etad),
        (("damping", "ratio"), beam.damping.ratio if len(beam.damping.ratio) != 1 else None),
    ]
    for location, values in lists:
        if values is None:
            continue
        names = beam.mode_names
        if beam.modes is None:
            yield location, 'modes = "auto" chooses the number of shapes; give modes as numbers'
        elif names is not None and len(values) != len(names):
            yield (
                location,
                f"expected {count_text(len(names))}, one per shape: {_names_text(names)}, "
                f"found {len(values)}",
            )


def _names_text(names: tuple[str, ...]) -> str:
    shown_names = ", ".join(names[:8])
    return f"{shown_names}, ..., {names[-1]}" if len(names) > 8 else shown_names or "none"


class Beam(BeamKeys):
    """Euler-Bernoulli beam.

    `modes` and `quadrature` are None for "auto".  `ends` also contains "root" and "tip".  Keys that
    are left out in an entry of `section` have the value of the beam; `sections` are the completed
    entries.
    """

    @model_validator(mode="after")
    def _resolve_ends_and_basis(self) -> Beam:
        object.__setattr__(self, "ends", self._all_ends())
        if self.shapes is not None and self.basis == AUTO:
            object.__setattr__(self, "basis", GIVEN)
        if self.shapes is not None and self.modes is None:
            object.__setattr__(self, "modes", self.shapes.modes)
        found = list(problems(self))
        if found:
            raise ValidationProblems(*found)
        object.__setattr__(self, "section", joined_sections(self))
        return self

    def _all_ends(self) -> dict[str, End]:
        default_positions = {ROOT: (0.0, 0.0, 0.0), TIP: (self.length, 0.0, 0.0)}
        default_ends = {
            name: End.model_construct(position=end_position)
            for name, end_position in default_positions.items()
        }
        return default_ends | self.ends
