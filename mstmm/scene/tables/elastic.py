"""Table [[elastic]]: elastic body from mass and stiffness matrices or from a mesh."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field

from ...numerics.rotations import Matrix, Vector, from_orientation
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.rotations_and_inertia import Orientation
from ..validators.scalars_and_vectors import (
    Numbers,
    Position,
    Problem,
    Rule,
    Table,
    ValidationProblems,
    check_entries,
    problem,
    to_python,
    unexpected,
)
from .flexible_keys import AUTO, NO_STRAINS, FlexibleTable, frame_field, or_auto

SOURCES = ("matrices", "arrays", "mesh", "box")
REGIONS = ("nodes", "box", "plane", "sphere", "set")
COUPLINGS = ("rigid", "mean")
ORDERS = ("node", "component")
#: Material keys of meshed bodies, with their meaning and unit.
MATERIAL_KEYS = {
    "young": "Young's modulus in Pa, more than 0",
    "poisson": "Poisson's ratio, more than -1 and less than 0.5",
    "density": "a number in kg/m^3, more than 0",
}
#: Most unknowns of matrices given in the scene file.
MAX_UNKNOWNS = 3000
MAX_MODES = 200

Rows = tuple[Numbers, ...]


def _checked_at(rule: Rule, value: Any, i: int) -> Any:
    """Value of entry i of a list; problems of a rule are located in the entry."""
    try:
        return rule.check(value)
    except ValidationProblems as refused:
        located = (((i, *location), message) for location, message in refused.problems)
        raise ValidationProblems(*located) from None


def number_table_rule(expected: str, columns: int = 0) -> Rule:
    """Rule for rows of finite numbers of equal length (`columns` if given)."""

    def check(value: Any) -> Rows:
        value = to_python(value.toarray() if hasattr(value, "toarray") else value)
        rows = rules.require_list(value, expected)
        width = columns or (len(rows[0]) if rows and isinstance(rows[0], (list, tuple)) else 0)
        if not rows or len(rows) > MAX_UNKNOWNS:
            raise problem(
                f"expected {expected}, 1 to {MAX_UNKNOWNS} rows, found {len(rows)}"
                + ("; save larger ones to a file and give its path in matrices" if rows else "")
            )
        row = rules.numbers_rule(f"rows of {width} numbers", width or 1)
        return tuple(_checked_at(row, entry, i) for i, entry in enumerate(rows))

    inner = {"type": "array", "items": {"type": ["number", "string"]}}
    return Rule(expected, check, {"type": "array", "items": inner})


class Arrays(Table):
    """Matrices of a finite-element model: rows of numbers, kg (kg m^2) and N/m (N m).

    N nodes have 3 N unknowns (x, y, z of each) or 6 N (with rotations).  `order` "node" means
    x1 y1 z1 x2 ..., "component" means x1 x2 ... y1 y2 ...
    """

    mass: Annotated[Rows, number_table_rule("the mass matrix, rows of numbers")]
    stiffness: Annotated[Rows, number_table_rule("the stiffness matrix, rows of numbers")]
    nodes: Annotated[Rows, number_table_rule("the positions of the nodes, rows of x, y, z in m", 3)]
    scalar_mass: Annotated[
        Rows | None, number_table_rule("the mass matrix of one component, rows of numbers")
    ] = None
    order: Annotated[str, texts.choice_rule(*ORDERS)] = ORDERS[0]

    def _problems(self) -> Iterator[Problem]:
        count = len(self.nodes)
        for key in ("mass", "stiffness", "scalar_mass"):
            rows = getattr(self, key)
            if rows is None:
                continue
            sizes = (count,) if key == "scalar_mass" else (3 * count, 6 * count)
            if len(rows) not in sizes or len(rows[0]) != len(rows):
                expected_sizes = " or ".join(f"{n} x {n}" for n in sizes)
                yield (
                    (key,),
                    f"expected {expected_sizes} numbers for {count} nodes, found {len(rows)} x "
                    f"{len(rows[0])}",
                )
        if len(self.mass) != len(self.stiffness):
            yield (
                ("stiffness",),
                f"expected as many unknowns as the mass matrix, {len(self.mass)}, found "
                f"{len(self.stiffness)}",
            )


class Box(Table):
    """Block meshed with hexahedra: edges (m), elements along each edge, lowest corner (m)."""

    size: Annotated[Vector, rules.numbers_rule("three numbers in m, more than 0", 3, of="m")]
    divisions: Annotated[tuple[int, ...], rules.numbers_rule("three whole numbers, 1 or more", 3)]
    corner: Position = (0.0, 0.0, 0.0)

    def _check(self) -> None:
        if min(self.size) <= 0:
            raise unexpected("three numbers in m, more than 0", self.size, "size")
        counts = tuple(int(n) for n in self.divisions)
        if counts != self.divisions or min(counts) < 1 or max(counts) > 10_000:
            raise unexpected("three whole numbers from 1 to 10000", self.divisions, "divisions")
        vars(self)["divisions"] = counts


def _node_numbers_rule() -> Rule:
    expected = "numbers of nodes, from 0, in the order of the file"
    number_rule = rules.integer(0, 10**9)

    def check(value: Any) -> tuple[int, ...]:
        entries = rules.require_list(value, expected)
        if not entries:
            raise problem(f"expected {expected}, found an empty list")
        return check_entries(entries, expected, lambda v, i: _checked_at(number_rule, v, i))

    schema = {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 1}
    return Rule(expected, check, schema)


def _corners_rule() -> Rule:
    expected = "two corners, [[x, y, z], [x, y, z]] in m, the smaller first"
    inner = number_table_rule(expected, 3)

    def check(value: Any) -> Rows:
        rows: Rows = inner.check(value)
        if len(rows) != 2 or any(a > b for a, b in zip(*rows, strict=True)):
            raise unexpected(expected, rows)
        return rows

    return Rule(expected, check, inner.schema | {"minItems": 2, "maxItems": 2})


class ElasticEnd(Table):
    """End of an elastic body: the nodes that move with it as one section.

    Exactly one of `nodes` (numbers from 0), `box` (two corners), `plane` (n . r = d as
    [nx, ny, nz, d]), `sphere` ([x, y, z, radius]) and `set` (a named surface of the mesh file)
    selects them.  `position` None is their mean.  With `coupling` "rigid" the nodes form a rigid
    section; with "mean" they share the load evenly.  `static_shapes` None adds static shapes only
    where something acts on the end.
    """

    nodes: Annotated[tuple[int, ...] | None, _node_numbers_rule()] = None
    box: Annotated[Rows | None, _corners_rule()] = None
    plane: Annotated[
        Numbers | None, rules.numbers_rule("[nx, ny, nz, d]: a normal and its distance in m", 4)
    ] = None
    sphere: Annotated[Numbers | None, rules.numbers_rule("[x, y, z, radius] in m", 4, of="m")] = (
        None
    )
    set: Annotated[str | None, texts.label_rule("the name of a surface in the mesh file")] = None
    position: Annotated[Vector | None, rules.vector_rule("m")] = None
    orientation: Orientation = (0.0, 0.0, 0.0)
    coupling: Annotated[str, texts.choice_rule(*COUPLINGS)] = COUPLINGS[0]
    static_shapes: Annotated[bool | None, or_auto(texts.flag_rule())] = None

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix from axes of the end to body axes."""
        return from_orientation(self.orientation)

    @property
    def region(self) -> str:
        """Key that selects the nodes."""
        return next(key for key in REGIONS if getattr(self, key) is not None)

    def _check(self) -> None:
        given_keys = [key for key in REGIONS if getattr(self, key) is not None]
        if len(given_keys) != 1:
            raise problem(
                f"expected exactly one of {', '.join(REGIONS)} for the nodes of this end, found "
                f"{', '.join(given_keys) or 'none'}; write for example plane = [1, 0, 0, 0.0]"
            )
        if self.plane is not None and max(map(abs, self.plane[:3])) == 0:
            raise problem("expected a normal that is not zero, as in [1, 0, 0, 0.0]", "plane")
        if self.sphere is not None and self.sphere[3] <= 0:
            raise unexpected("a radius in m, more than 0", self.sphere[3], "sphere", 3)


_ENDS_TEXT = "ends by name, each a table such as { plane = [1, 0, 0, 0.0] }"
_ENDS = texts.ends_rule(_ENDS_TEXT, _ENDS_TEXT, {}, lambda end: end)


class Elastic(FlexibleTable):
    """General elastic body; its axes are those of its mesh.

    Exactly one of `matrices` (a .npz file), `arrays`, `mesh` (a file) and `box` gives its finite
    elements.  `modes` is the number of vibration modes, None for "auto".
    """

    matrices: Annotated[str | None, texts.path_rule(".npz")] = None
    arrays: Arrays | None = None
    mesh: Annotated[str | None, texts.path_rule()] = None
    box: Box | None = None
    scale: Annotated[float | None, rules.number_rule("m per unit of the mesh", above=0)] = None
    order: Annotated[int | None, rules.integer(1, 2)] = None
    young: Annotated[float | None, rules.number_rule("Pa", above=0)] = None
    poisson: Annotated[float | None, rules.number_rule("")] = None
    density: Annotated[float | None, rules.number_rule("kg/m^3", above=0)] = None
    modes: Annotated[int | None, or_auto(rules.integer(0, MAX_MODES))] = None
    frame: Annotated[str, frame_field(AUTO, "tangent", "mean")] = AUTO
    highest_frequency: Annotated[float | None, rules.number_rule("rad/s", above=0)] = None
    ends: Annotated[dict[str, ElasticEnd], _ENDS] = Field(default_factory=dict)

    @property
    def source(self) -> str:
        """Key that gives the finite elements: matrices, arrays, mesh or box."""
        return next(key for key in SOURCES if getattr(self, key) is not None)

    def _problems(self) -> Iterator[Problem]:
        given_sources = [key for key in SOURCES if getattr(self, key) is not None]
        if len(given_sources) != 1:
            yield (
                (),
                f"expected exactly one of {', '.join(SOURCES)} as the source of the body, found "
                f"{' and '.join(given_sources) or 'none'}; write for example matrices = "
                '"link.npz"',
            )
            return
        yield from self._material_problems()
        yield from self._end_problems()
        if any(self.damping.strain):
            yield ("damping", "strain"), NO_STRAINS
        start = self.initial
        if start.eta is not None and start.etad is not None and len(start.eta) != len(start.etad):
            yield (
                ("initial", "etad"),
                f"expected as many entries as eta, {len(start.eta)}, found {len(start.etad)}",
            )

    def _material_problems(self) -> Iterator[Problem]:
        is_meshed = self.source in ("mesh", "box")
        for key, meaning in MATERIAL_KEYS.items():
            is_given = getattr(self, key) is not None
            if is_meshed and not is_given:
                yield (key,), f"missing; a body from a {self.source} needs {meaning}"
            elif is_given and not is_meshed:
                yield (key,), f"{self.source} already contain the material; leave it out"
        if self.poisson is not None and not -1 < self.poisson < 0.5:
            remedy = "; no element is incompressible" if self.poisson == 0.5 else ""
            expected = MATERIAL_KEYS["poisson"]
            yield ("poisson",), f"expected {expected}, found {self.poisson:g}{remedy}"
        if self.order is not None and not is_meshed:
            yield ("order",), "only mesh and box have an element order; leave it out"
        if self.scale is not None and self.source != "mesh":
            yield ("scale",), "only a mesh file has its own length unit; leave it out"

    def _end_problems(self) -> Iterator[Problem]:
        if not self.ends:
            yield (
                ("ends",),
                "missing; an elastic body connects only at its ends; write for example "
                "ends = { root = { plane = [1, 0, 0, 0.0] } }",
            )
        count = None if self.arrays is None else len(self.arrays.nodes)
        for name, end in self.ends.items():
            if end.set is not None and self.source != "mesh":
                yield (
                    ("ends", name, "set"),
                    "only a mesh file has named surfaces; use plane, box, sphere or nodes",
                )
            invalid_nodes = [n for n in end.nodes or () if count is not None and n >= count]
            if invalid_nodes:
                yield (
                    ("ends", name, "nodes"),
                    f"expected numbers from 0 to {(count or 0) - 1}, found {invalid_nodes[0]}",
                )
