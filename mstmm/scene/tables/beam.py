"""Table [[beam]]: beam along its x axis, with ends "root" (x = 0) and "tip"."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import BaseModel, Field

from ...expression.expression import Expression
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.scalars_and_vectors import (
    Location,
    Problem,
    Shorthand,
    Table,
    ValidationProblems,
    count_text,
    describe_value,
    is_integer,
    problem,
    to_python,
    unexpected,
)
from ..validators.validation_messages import did_you_mean
from .body import End
from .flexible_keys import AUTO, NO_STRAINS, FlexibleTable, frame_field, or_auto
from .shape_functions import shape_problem

GIVEN = "given"
#: Bases of shapes of second-order beams, and of strains of exact beams.
SHAPE_BASES = ("clamped-free", "free-free", "simply-supported", "static+fixed-interface", GIVEN)
STRAIN_BASES = ("modes", "legendre")
BASES = (AUTO, *SHAPE_BASES, *STRAIN_BASES)
SECOND_ORDER, EXACT = "second-order", "exact"
ROOT, TIP = "root", "tip"

#: Directions of the shapes in the order of the modal coordinates: deflection along y, along z,
#: rotation about x, displacement along x.
DIRECTIONS = ("y", "z", "twist", "axial")
#: Most shapes in one direction.  For more, half-waves are too short for the theory, and products of
#: shapes cannot be integrated accurately in double precision.
MAX_SHAPES = 60
#: Largest gap between pieces, and distance of ends from the beam, relative to its length.
_MAX_RELATIVE_ROUNDING = 1e-9
#: Largest relative difference of the polar inertia from the sum of both rotary inertias.
_MAX_POLAR_DIFFERENCE = 1e-3
#: Smallest mass, moment and stiffness of a beam, and the inverse of the largest.
_MIN_MAGNITUDE = 1e-100
#: Largest ratio between two pieces of a beam in mass or stiffness per length.
_MAX_PIECE_RATIO = 1e12


# --- shapes ---------------------------------------------------------------------------------------

_ShapeCount = Annotated[
    int,
    rules.value_rule(
        "a whole number, 0 or more",
        lambda value: is_integer(value) and value >= 0,
        {"type": "integer", "minimum": 0},
    ),
]
_ShapeList = Annotated[tuple[Expression, ...], texts.expressions_rule("a list of expressions of x")]


class Modes(Table):
    """Number of shapes in each direction."""

    y: _ShapeCount = 0
    z: _ShapeCount = 0
    twist: _ShapeCount = 0
    axial: _ShapeCount = 0

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
    if is_integer(value):
        return {"y": value, "z": value}
    raise unexpected(_MODES.expected, value)


_MODES = Shorthand(
    "a whole number of shapes per bending plane, a table { y, z, twist, axial } of whole "
    'numbers, or "auto"',
    _widen_modes,
    {"type": ["integer", "string"]},
)


class Shapes(Table):
    """User-defined shape functions by direction: expressions of x (m, from the root) and L (m).

    L is the length.  Deflections and axial displacements are in m per m of the modal coordinate,
    twists in rad per rad.
    """

    y: _ShapeList = ()
    z: _ShapeList = ()
    twist: _ShapeList = ()
    axial: _ShapeList = ()

    @property
    def modes(self) -> Modes:
        """Number of shapes in each direction, as `Modes`."""
        return Modes(**{direction: len(getattr(self, direction)) for direction in DIRECTIONS})


# --- sections -------------------------------------------------------------------------------------


def _pair_rule(of: str, axes: str = "about y, about z") -> rules.Rule:
    """Rule for one number for both bending planes, or one for each."""
    expected = f"a number, or two, [{axes}], in {of}"
    inner = rules.numbers_rule(expected, of=of)

    def check(value: Any) -> tuple[float, float]:
        values = inner.check(value)
        if len(values) not in (1, 2):
            raise problem(f"expected {expected}, found {rules.count_text(len(values))}")
        for i, entry in enumerate(values):
            if entry <= 0:
                location = (i,) if len(values) == 2 else ()
                raise unexpected(f"{expected}, more than 0", entry, *location)
        return (values[0], values[-1])

    number = {"type": ["number", "string"], "exclusiveMinimum": 0}
    pair = {"type": "array", "items": number, "minItems": 1, "maxItems": 2}
    return rules.Rule(expected, check, {"anyOf": [number, pair]})


class SectionTable(Table):
    """Properties of a section, or of the whole beam (None: not given).

    `bending_stiffness` is (EI_y, EI_z): about y, for deflection along z, and about z, for
    deflection along y; `rotary_inertia` (rho I_y, rho I_z) likewise.  `shear_stiffness` is k G A
    along y and along z.
    """

    mass_per_length: Annotated[float | None, rules.number_rule("kg/m", above=0)] = None
    bending_stiffness: Annotated[tuple[float, float] | None, _pair_rule("N m^2")] = None
    axial_stiffness: Annotated[float | None, rules.number_rule("N", above=0)] = None
    torsional_stiffness: Annotated[float | None, rules.number_rule("N m^2", above=0)] = None
    polar_inertia_per_length: Annotated[float | None, rules.number_rule("kg m", above=0)] = None
    rotary_inertia: Annotated[tuple[float, float] | None, _pair_rule("kg m")] = None
    shear_stiffness: Annotated[tuple[float, float] | None, _pair_rule("N", "along y, along z")] = (
        None
    )


class Section(SectionTable):
    """Piece of a beam with a constant section, `from` one x `to` another (m)."""

    from_: Annotated[float, rules.number_rule("m", minimum=0)] = Field(alias="from")
    to: Annotated[float, rules.number_rule("m", above=0)]


#: Key of the section -> its meaning and unit.
_KEY_DESCRIPTIONS = {
    "mass_per_length": "a number in kg/m, more than 0",
    "bending_stiffness": "E I in N m^2, more than 0: a number, or [about y, about z]",
    "axial_stiffness": "E A in N, more than 0",
    "torsional_stiffness": "G I_t in N m^2, more than 0",
    "polar_inertia_per_length": "rho I_p in kg m, more than 0",
    "rotary_inertia": "[rho I_y, rho I_z] in kg m, more than 0",
    "shear_stiffness": "k G A in N, more than 0: a number, or [along y, along z]",
}


# --- beam -----------------------------------------------------------------------------------------


def _widen_end(value: Any) -> Any:
    """Expand the position of an end along the beam (m) to a point in beam axes."""
    value = to_python(value)
    if isinstance(value, dict):
        position = to_python(value.get("position"))
        return {**value, "position": [position, 0.0, 0.0]} if _is_number(position) else value
    if isinstance(value, (list, tuple)):
        return {"position": value}
    return {"position": [value, 0.0, 0.0]} if _is_number(value) else value


def _is_number(value: Any) -> bool:
    """Whether a value is a number or the text of an expression."""
    return isinstance(value, (int, float, str)) and not isinstance(value, bool)


_ENDS = texts.ends_rule(
    "ends by name: x in m, or a table with position and orientation",
    "a table such as { mid = 5.0 }",
    {"additionalProperties": {"type": ["number", "string", "array", "object"]}},
    _widen_end,
)


class Beam(FlexibleTable, SectionTable):
    """Straight beam: Euler-Bernoulli or Timoshenko to second order, or with exact kinematics.

    `modes` and `quadrature` are None for "auto".  `ends` also contains "root" and "tip".  Keys that
    are left out in an entry of `section` have the value of the beam; `sections` are the completed
    entries.
    """

    length: Annotated[float, rules.number_rule("m", above=0)]
    section: tuple[Section, ...] = ()
    modes: Annotated[Modes | None, _MODES] = None
    frame: Annotated[str, frame_field(AUTO, "tangent", "chord", "mean", at_end=True)] = AUTO
    kinematics: Annotated[str, texts.choice_rule(SECOND_ORDER, EXACT)] = SECOND_ORDER
    basis: Annotated[str, texts.choice_rule(*BASES)] = AUTO
    shapes: Shapes | None = None
    quadrature: Annotated[bool | None, or_auto(texts.flag_rule())] = None
    viscous_drag: Annotated[float, rules.number_rule("N s/m^2", minimum=0)] = 0.0
    ends: Annotated[dict[str, End], _ENDS] = Field(default_factory=dict)

    def _check(self) -> None:
        """Complete ends, basis and modes, and join pieces of the beam exactly."""
        tip = (self.length, 0.0, 0.0)
        ends = {ROOT: (0.0, 0.0, 0.0), TIP: tip}
        default_ends = {name: End.model_construct(position=x) for name, x in ends.items()}
        vars(self)["ends"] = default_ends | self.ends
        if self.shapes is not None and self.basis == AUTO:
            vars(self)["basis"] = GIVEN
        if self.shapes is not None and self.modes is None:
            vars(self)["modes"] = self.shapes.modes
        if problems := tuple(_beam_problems(self)):
            raise ValidationProblems(*problems)
        vars(self)["section"] = _joined_sections(self)

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


# --- rules ----------------------------------------------------------------------------------------


def _beam_problems(beam: Beam) -> Iterator[Problem]:
    """Problems of the keys of a beam with each other."""
    section_problems = list(_section_problems(beam))
    yield from section_problems
    yield from _mode_problems(beam)
    if not section_problems:
        yield from _property_problems(beam)
        yield from _polar_inertia_problems(beam)
        yield from _magnitude_problems(beam)
    yield from _shape_problems(beam)
    yield from _kinematics_problems(beam)
    yield from _end_problems(beam)
    yield from _list_problems(beam)


def _joined_sections(beam: Beam) -> tuple[Section, ...]:
    """Pieces of a beam, each starting exactly where the one before ends."""
    joined_pieces: list[Section] = []
    for k, piece in enumerate(beam.section):
        start = joined_pieces[-1].to if joined_pieces else 0.0
        end = beam.length if k == len(beam.section) - 1 else piece.to
        joined_pieces.append(piece.model_copy(update={"from_": start, "to": end}))
    return tuple(joined_pieces)


def _section_problems(beam: Beam) -> Iterator[Problem]:
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
            defect = "a gap" if piece.from_ > covered_length else "an overlap"
            boundary_text = "the beam begins" if i == 0 else "the previous piece ends"
            yield (
                ("section", i, "from"),
                f"expected {covered_length:g} m, where {boundary_text}, found {piece.from_:g}, "
                f"{defect} of {abs(piece.from_ - covered_length):g} m; write from = "
                f"{covered_length:g}",
            )
            return
        covered_length = piece.to
    if beam.section and abs(covered_length - beam.length) > tolerance:
        yield (
            ("section", len(beam.section) - 1, "to"),
            f"expected the length of the beam, {beam.length:g} m, found {covered_length:g}; "
            "correct the end of the last piece, or length",
        )


def _mode_problems(beam: Beam) -> Iterator[Problem]:
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


def _property_problems(beam: Beam) -> Iterator[Problem]:
    """Problems of missing section properties, or of properties given only for some pieces."""
    sections, required = beam.sections, _required_keys(beam)
    for key in (*required, *(key for key in _KEY_DESCRIPTIONS if key not in required)):
        lacking = [i for i, piece in enumerate(sections) if getattr(piece, key) is None]
        reason = f"; {required[key]}" if key in required else ", though other pieces have it; "
        if lacking and (key in required or len(lacking) < len(sections)):
            text = f"missing{reason}expected {_KEY_DESCRIPTIONS[key]}"
            yield _location_of(beam, lacking[0], key), text


def _location_of(beam: Beam, i: int, key: str) -> Location:
    return ("section", i, key) if beam.section else (key,)


def _required_keys(beam: Beam) -> dict[str, str]:
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
    if any(piece.shear_stiffness is not None for piece in beam.sections):
        required["rotary_inertia"] = "shear_stiffness needs it: "
    return required


def _polar_inertia_problems(beam: Beam) -> Iterator[Problem]:
    """Problems of a polar inertia that is not the sum of both rotary inertias."""
    for i, piece in enumerate(beam.sections):
        polar, rotary = piece.polar_inertia_per_length, piece.rotary_inertia
        if polar is None or rotary is None:
            continue
        if abs(polar - sum(rotary)) > _MAX_POLAR_DIFFERENCE * polar:
            yield (
                _location_of(beam, i, "polar_inertia_per_length"),
                f"expected the sum of both entries of rotary_inertia, {sum(rotary):g} kg m, as for "
                f"every plane section, found {polar:g}; leave it out",
            )
            return


def _magnitude_problems(beam: Beam) -> Iterator[Problem]:
    """Problems of a beam whose moments, stiffnesses or frequencies overflow or underflow."""
    if any(piece.mass_per_length is None for piece in beam.sections):
        return
    length_squared = beam.length * beam.length
    length_cubed = length_squared * beam.length
    sizes = [length_cubed, beam.mass, beam.mass * length_squared]
    for piece in beam.sections:
        stiffness = [EI / (length_cubed or 1) for EI in piece.bending_stiffness or ()]
        stiffness += [EA / beam.length for EA in (piece.axial_stiffness,) if EA is not None]
        sizes += [*stiffness, *(k / (beam.mass or 1) for k in stiffness)]
        polar_inertia, twist = piece.polar_inertia_per_length, piece.torsional_stiffness
        if polar_inertia and twist is not None:
            sizes += [twist, twist / polar_inertia / (length_squared or 1)]
    if not all(_MIN_MAGNITUDE < size < 1 / _MIN_MAGNITUDE for size in sizes):
        yield (
            ("length",),
            f"a beam of {beam.length:g} m and {beam.mass:g} kg has mass and stiffness outside the "
            "range of double precision; check the units (m, kg/m, N m^2)",
        )
        return
    yield from _ratio_problems(beam)


def _ratio_problems(beam: Beam) -> Iterator[Problem]:
    """Problems of pieces so different that shapes of one are lost to rounding of another."""
    for key in _KEY_DESCRIPTIONS:
        values = [getattr(piece, key) for piece in beam.sections]
        rows = [x if isinstance(x, tuple) else (x,) for x in values if x is not None]
        for column in zip(*rows, strict=True):
            smallest, largest = min(column), max(column)
            if smallest > 0 and largest > _MAX_PIECE_RATIO * smallest:
                i = next(i for i, row in enumerate(rows) if smallest in row)
                yield (
                    _location_of(beam, i, key),
                    f"expected {1 / _MAX_PIECE_RATIO:g} of the largest one, {largest:g}, or more, "
                    f"found {smallest:g}: the shapes of such a beam are linearly dependent to "
                    "rounding; model the light part as a separate beam",
                )
                return


#: Keys without meaning for exact beams -> the value that they may have, and why.
_KEYS_OF_SECOND_ORDER: dict[str, tuple[object, str]] = {
    "frame": (AUTO, "its frame is the section at the inboard hinge"),
    "shapes": (None, "its shapes are strains"),
    "quadrature": (None, "its mass is always in points"),
    "stiffening": (True, "its kinematics includes every order"),
    "viscous_drag": (0.0, "drag acts only on second-order beams"),
}
_NO_SHEAR = (
    "an exact beam has no shear_stiffness: only second-order beams have shear; leave it or "
    "kinematics out"
)


def _kinematics_problems(beam: Beam) -> Iterator[Problem]:
    """Problems of keys that the kinematics of a beam do not have."""
    if beam.kinematics != EXACT:
        if beam.basis in STRAIN_BASES:
            yield (
                ("basis",),
                f'"{beam.basis}" is a basis of strains; write kinematics = "exact", or choose '
                f"another basis: {', '.join(SHAPE_BASES)}",
            )
        if any(beam.damping.strain):
            yield ("damping", "strain"), NO_STRAINS
        return
    for key, (allowed, reason) in _KEYS_OF_SECOND_ORDER.items():
        if getattr(beam, key) != allowed:
            yield (key,), f"an exact beam has no {key}: {reason}; leave it out"
    for i, piece in enumerate(beam.sections):
        if piece.shear_stiffness is not None:
            yield _location_of(beam, i, "shear_stiffness"), _NO_SHEAR
            break
    if beam.basis in SHAPE_BASES:
        yield (
            ("basis",),
            f'expected "auto", "modes" or "legendre" for an exact beam, found "{beam.basis}"',
        )
    if beam.model == "one-way":
        yield (
            ("model",),
            'expected "flexible" or "rigid": the one-way response is linear; leave out kinematics',
        )


def _shape_problems(beam: Beam) -> Iterator[Problem]:
    shapes = beam.shapes
    if shapes is None:
        if beam.basis == GIVEN:
            yield ("shapes",), 'missing; basis = "given" needs shapes, as in { y = ["(x/L)^2"] }'
        return
    if beam.basis != GIVEN:
        yield (
            ("basis",),
            f'expected "given" with shapes, found "{beam.basis}"; leave out basis or shapes',
        )
    if (shapes.y or shapes.z) and any(p.shear_stiffness is not None for p in beam.sections):
        yield (
            ("shapes",),
            "expected no bending shapes with shear_stiffness: sections then rotate by other angles "
            "than the slope; leave out shapes or shear_stiffness",
        )
    if beam.modes is not None and beam.modes != shapes.modes:
        pairs = zip(DIRECTIONS, shapes.modes.counts, strict=True)
        counts = ", ".join(f"{direction} = {count}" for direction, count in pairs)
        yield ("modes",), f"shapes has {counts}; leave out modes"
    for direction in DIRECTIONS:
        for i, expression in enumerate(getattr(shapes, direction)):
            message = shape_problem(expression, beam.length, 2 if direction in ("y", "z") else 1)
            if message is not None:
                yield ("shapes", direction, i), message


def _end_problems(beam: Beam) -> Iterator[Problem]:
    tolerance = _MAX_RELATIVE_ROUNDING * beam.length
    for name, end in beam.ends.items():
        x, y, z = end.position
        location: Location = ("ends", name)
        fixed_position = {ROOT: 0.0, TIP: beam.length}.get(name)
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


def _list_problems(beam: Beam) -> Iterator[Problem]:
    """Problems of lists that need one entry per shape."""
    lists = {
        ("initial", "eta"): beam.initial.eta,
        ("initial", "etad"): beam.initial.etad,
        ("damping", "ratio"): beam.damping.ratio if len(beam.damping.ratio) != 1 else None,
    }
    names = beam.mode_names
    for location, values in lists.items():
        if values is not None and beam.modes is None:
            yield location, 'modes = "auto" chooses the number of shapes; give modes as numbers'
        elif values is not None and names is not None and len(values) != len(names):
            yield (
                location,
                f"expected {count_text(len(names))}, one per shape: {_names_text(names)}, "
                f"found {len(values)}",
            )


def _names_text(names: tuple[str, ...]) -> str:
    shown_names = ", ".join(names[:8])
    return f"{shown_names}, ..., {names[-1]}" if len(names) > 8 else shown_names or "none"
