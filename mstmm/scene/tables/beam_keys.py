"""Keys of a beam: sections, shapes, ends; `beam_rules` checks them against each other."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, Field

from ...expression.expression import Expression
from ..rules import text as texts
from ..rules import values as rules
from ..rules.values import NAME, Shorthand, Table, found, plain, refuse
from .body import End
from .flexible import AUTO, FlexibleTable, decided, framed

GIVEN = "given"
BASES = (AUTO, "clamped-free", "free-free", "simply-supported", "static+fixed-interface", GIVEN)
ROOT, TIP = "root", "tip"

#: Directions of the shapes in the order of the modal coordinates: deflection along y, along z,
#: rotation about x, displacement along x.
DIRECTIONS = ("y", "z", "twist", "axial")
#: Most shapes in one direction.  For more, half-waves are too short for the theory, and products of
#: shapes cannot be integrated accurately in double precision.
MAX_SHAPES = 60
SHAPES = rules.Rule(
    "a whole number, 0 or more", lambda value: _count(value), {"type": "integer", "minimum": 0}
)


def _count(value: Any) -> int:
    value = plain(value)
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise refuse(f"expected {SHAPES.expected}, found {found(value)}")
    return value


class Modes(Table):
    """Number of shapes in each direction."""

    y: Annotated[int, SHAPES] = 0
    z: Annotated[int, SHAPES] = 0
    twist: Annotated[int, SHAPES] = 0
    axial: Annotated[int, SHAPES] = 0

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
        counted = zip(DIRECTIONS, self.counts, strict=True)
        return tuple(f"{word}{k}" for word, count in counted for k in range(1, count + 1))


def _as_modes(value: Any) -> Any:
    value = plain(value)
    if value == AUTO:
        return None
    if value is None or isinstance(value, (dict, BaseModel)):
        return value
    if isinstance(value, int) and not isinstance(value, bool):
        return {"y": value, "z": value}
    raise refuse(f"expected {_MODES}, found {found(value)}")


_MODES = (
    "a whole number of shapes per bending plane, a table { y, z, twist, axial } of whole "
    'numbers, or "auto"'
)


_MODES_RULE = Shorthand(_MODES, _as_modes, {"type": ["integer", "string"]})


class Shapes(Table):
    """User-defined shape functions by direction: expressions of x (m, from the root) and L (m).

    L is the length.  Deflections and axial displacements are in m per m of the modal coordinate,
    twists in rad per rad.
    """

    y: Annotated[tuple[Expression, ...], texts.expressions("a list of expressions of x")] = ()
    z: Annotated[tuple[Expression, ...], texts.expressions("a list of expressions of x")] = ()
    twist: Annotated[tuple[Expression, ...], texts.expressions("a list of expressions of x")] = ()
    axial: Annotated[tuple[Expression, ...], texts.expressions("a list of expressions of x")] = ()

    @property
    def modes(self) -> Modes:
        """Number of shapes in each direction, as `Modes`."""
        return Modes(**{word: len(getattr(self, word)) for word in DIRECTIONS})


def _pair(of: str) -> rules.Rule:
    """Rule for one number for both bending planes, or one for each."""
    expected = f"a number, or two, [about y, about z], in {of}"
    inner = rules.numbers(expected, of=of)

    def check(value: Any) -> tuple[float, float]:
        values = inner.check(value)
        if len(values) not in (1, 2):
            raise refuse(f"expected {expected}, found {rules.counted(len(values))}")
        for i, entry in enumerate(values):
            if entry <= 0:
                place = (i,) if len(values) == 2 else ()
                raise refuse(f"expected {expected}, more than 0, found {found(entry)}", *place)
        return (values[0], values[-1])

    number = {"type": ["number", "string"], "exclusiveMinimum": 0}
    pair = {"type": "array", "items": number, "minItems": 1, "maxItems": 2}
    return rules.Rule(expected, check, {"anyOf": [number, pair]})


class SectionTable(Table):
    """Properties of a section, or of the whole beam (None: not given).

    `bending_stiffness` is (EI_y, EI_z): about y, for deflection along z, and about z, for
    deflection along y; `rotary_inertia` (rho I_y, rho I_z) likewise.
    """

    mass_per_length: Annotated[float | None, rules.number("kg/m", above=0)] = None
    bending_stiffness: Annotated[tuple[float, float] | None, _pair("N m^2")] = None
    axial_stiffness: Annotated[float | None, rules.number("N", above=0)] = None
    torsional_stiffness: Annotated[float | None, rules.number("N m^2", above=0)] = None
    polar_inertia_per_length: Annotated[float | None, rules.number("kg m", above=0)] = None
    rotary_inertia: Annotated[tuple[float, float] | None, _pair("kg m")] = None


class Section(SectionTable):
    """Piece of a beam with a constant section, `from` one x `to` another (m)."""

    from_: Annotated[float, rules.number("m", minimum=0)] = Field(alias="from")
    to: Annotated[float, rules.number("m", above=0)]


def _as_ends(value: Any) -> Any:
    if not isinstance(value, dict):
        raise refuse(f"expected a table such as {{ mid = 5.0 }}, found {found(value)}")
    for key in value:
        if not isinstance(key, str) or not NAME.fullmatch(key):
            raise refuse(f"expected the name of an end, found {found(key)}")
    return {key: _as_end(one) for key, one in value.items()}


def _as_end(value: Any) -> Any:
    """Expand the position of an end along the beam (m) to a point in beam axes."""
    value = plain(value)
    if isinstance(value, dict):
        position = plain(value.get("position"))
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

    length: Annotated[float, rules.number("m", above=0)]
    section: tuple[Section, ...] = ()
    modes: Annotated[Modes | None, _MODES_RULE] = None
    frame: Annotated[str, framed(AUTO, "tangent", "chord", "mean", at_end=True)] = AUTO
    basis: Annotated[str, texts.choice(*BASES)] = AUTO
    shapes: Shapes | None = None
    quadrature: Annotated[bool | None, decided(texts.flag())] = None
    viscous_drag: Annotated[float, rules.number("N s/m^2", minimum=0)] = 0.0
    ends: Annotated[
        dict[str, End],
        Shorthand(
            "ends by name: x in m, or a table with position and orientation",
            _as_ends,
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
        pieces = self.section or (
            Section.model_construct(from_=0.0, to=self.length, **dict.fromkeys(_DATA)),
        )
        return tuple(self._filled(piece) for piece in pieces)

    def _filled(self, piece: Section) -> Section:
        data = {
            key: getattr(self, key) if getattr(piece, key) is None else getattr(piece, key)
            for key in _DATA
        }
        if data["polar_inertia_per_length"] is None and data["rotary_inertia"] is not None:
            data["polar_inertia_per_length"] = sum(data["rotary_inertia"])
        return piece.model_copy(update=data)

    @property
    def mass(self) -> float:
        """Total mass (kg)."""
        return sum((s.mass_per_length or 0.0) * (s.to - s.from_) for s in self.sections)

    @property
    def mode_names(self) -> tuple[str, ...] | None:
        """Names of the modal coordinates, None where their number is chosen at compilation.

        This is the case for "auto", and for a tangent frame at an inner section, which has
        clamped-free shapes on both sides.
        """
        inner = [name for name in self.ends if 0 < self.end_x(name) < self.length]
        either_side = self.frame_end in inner if self.frame_end else bool(inner)
        clamped = self.basis in (AUTO, "clamped-free") and self.frame_kind in (AUTO, "tangent")
        if self.modes is None or (clamped and either_side):
            return None
        return self.modes.names

    def end_x(self, at: str) -> float:
        """Position of the end `at` along the beam (m); "" is the root."""
        return self.ends[at or ROOT].position[0]


_DATA = tuple(SectionTable.model_fields)
