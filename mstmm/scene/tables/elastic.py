"""Table [[elastic]]: elastic body from mass and stiffness matrices or from a mesh."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from ...numerics.rotations import Matrix, Vector, from_orientation
from ..validators import names_and_text as texts
from ..validators import rotations_and_inertia
from ..validators import scalars_and_vectors as rules
from ..validators.scalars_and_vectors import (
    NAME_PATTERN,
    Location,
    Rule,
    Shorthand,
    Table,
    ValidationProblems,
    describe_value,
    problem,
    to_python,
)
from .flexible_keys import AUTO, FlexibleTable, Numbers, frame_field, or_auto

#: Folder from which relative paths start while a scene file is read; "" leaves paths unchanged.
SCENE_FOLDER: ContextVar[str] = ContextVar("folder", default="")

SOURCES = ("matrices", "arrays", "mesh", "box")
REGIONS = ("nodes", "box", "plane", "sphere", "set")
COUPLINGS = ("rigid", "mean")
ORDERS = ("node", "component")
#: Most unknowns of matrices given in the scene file.
MAX_UNKNOWNS = 3000
MAX_MODES = 200

Rows = tuple[Numbers, ...]


def path_rule(*suffixes: str) -> Rule:
    """Rule for the path of a file, relative to the folder of the scene file."""
    suffix_text = " or ".join(suffixes)
    expected = "the path of a file" + (f" ending in {suffix_text}" if suffixes else "")

    def check(value: Any) -> str:
        value = os.fspath(value) if isinstance(value, os.PathLike) else value
        if not isinstance(value, str) or not value or not value.isprintable():
            raise problem(f"expected {expected}, found {describe_value(value)}")
        if suffixes and not value.lower().endswith(suffixes):
            raise problem(f"expected {expected}, found {describe_value(value)}")
        return str(Path(SCENE_FOLDER.get()) / value) if SCENE_FOLDER.get() else value

    return Rule(expected, check, {"type": "string"})


def path_inside_rule(*suffixes: str) -> Rule:
    """Rule for the path of a regular file in the folder of the scene file, or below.

    For a scene that was not read from a file, any path is accepted.
    """
    any_path_rule = path_rule(*suffixes)

    def check(value: Any) -> str:
        name: str = any_path_rule.check(value)
        if not SCENE_FOLDER.get():
            return name
        scene_folder, location = Path(SCENE_FOLDER.get()).resolve(), Path(name).resolve()
        if not location.is_relative_to(scene_folder):
            raise problem(
                f"expected a file in the folder of the scene, found {describe_value(value)}; copy "
                f"it there"
            )
        if not location.is_file():
            raise problem(
                f"{describe_value(value)}: there is no such file in the folder of the scene"
            )
        return name

    return Rule(any_path_rule.expected, check, {"type": "string"})


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
        return tuple(_check_row(row, row_value, i) for i, row_value in enumerate(rows))

    inner = {"type": "array", "items": {"type": ["number", "string"]}}
    return Rule(expected, check, {"type": "array", "items": inner})


def _check_row(rule: Rule, value: Any, i: int) -> Numbers:
    try:
        numbers: Numbers = rule.check(value)
    except ValidationProblems as refused:
        raise ValidationProblems(
            *(((i, *location), message) for location, message in refused.problems)
        ) from None
    return numbers


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

    @model_validator(mode="after")
    def _check(self) -> Arrays:
        problems = list(self._sizes())
        if problems:
            raise ValidationProblems(*problems)
        return self

    def _sizes(self) -> Iterator[tuple[Location, str]]:
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
    corner: Annotated[Vector, rules.vector_rule("m")] = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _check(self) -> Box:
        if min(self.size) <= 0:
            raise problem(
                f"expected three numbers in m, more than 0, found {describe_value(self.size)}",
                "size",
            )
        counts = tuple(int(n) for n in self.divisions)
        if counts != self.divisions or min(counts) < 1 or max(counts) > 10_000:
            raise problem(
                f"expected three whole numbers from 1 to 10000, found "
                f"{describe_value(self.divisions)}",
                "divisions",
            )
        object.__setattr__(self, "divisions", counts)
        return self


def _node_numbers_rule() -> Rule:
    expected = "numbers of nodes, from 0, in the order of the file"
    number_rule = rules.integer(0, 10**9)

    def check(value: Any) -> tuple[int, ...]:
        entries = rules.require_list(value, expected)
        if not entries:
            raise problem(f"expected {expected}, found an empty list")
        node_numbers = rules.check_entries(
            entries, expected, lambda v, i: _check_at(number_rule, v, i)
        )
        return node_numbers

    schema = {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 1}
    return Rule(expected, check, schema)


def _check_at(rule: Rule, value: Any, *place: str | int) -> Any:
    try:
        return rule.check(value)
    except ValidationProblems as refused:
        raise ValidationProblems(*((place, message) for _, message in refused.problems)) from None


def _corners_rule() -> Rule:
    expected = "two corners, [[x, y, z], [x, y, z]] in m, the smaller first"
    inner = number_table_rule(expected, 3)

    def check(value: Any) -> Rows:
        rows: Rows = inner.check(value)
        if len(rows) != 2 or any(a > b for a, b in zip(*rows, strict=True)):
            raise problem(f"expected {expected}, found {describe_value(rows)}")
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
    orientation: Annotated[Numbers, rotations_and_inertia.orientation_rule()] = (0.0, 0.0, 0.0)
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

    @model_validator(mode="after")
    def _check(self) -> ElasticEnd:
        given_keys = [key for key in REGIONS if getattr(self, key) is not None]
        if len(given_keys) != 1:
            keys_text = ", ".join(given_keys) if given_keys else "none"
            raise problem(
                f"expected exactly one of {', '.join(REGIONS)} for the nodes of this end, found "
                f"{keys_text}; write for example plane = [1, 0, 0, 0.0]"
            )
        if self.plane is not None and max(map(abs, self.plane[:3])) == 0:
            raise problem("expected a normal that is not zero, as in [1, 0, 0, 0.0]", "plane")
        if self.sphere is not None and self.sphere[3] <= 0:
            raise problem(
                f"expected a radius in m, more than 0, found {describe_value(self.sphere[3])}",
                "sphere",
                3,
            )
        return self


def _check_ends(value: Any) -> Any:
    if not isinstance(value, dict):
        raise problem(f"expected {_ENDS.expected}, found {describe_value(value)}")
    for key in value:
        if not isinstance(key, str) or not NAME_PATTERN.fullmatch(key):
            raise problem(f"expected the name of an end, found {describe_value(key)}")
    return value


_ENDS = Shorthand(
    "ends by name, each a table such as { plane = [1, 0, 0, 0.0] }", _check_ends, {"type": "object"}
)


class ElasticKeys(FlexibleTable):
    """Keys of an elastic body."""

    matrices: Annotated[str | None, path_rule(".npz")] = None
    arrays: Arrays | None = None
    mesh: Annotated[str | None, path_rule()] = None
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


Problem = tuple[Location, str]

#: Material keys of meshed bodies, with their meaning and unit.
MATERIAL_KEYS = {
    "young": "Young's modulus in Pa, more than 0",
    "poisson": "Poisson's ratio, more than -1 and less than 0.5",
    "density": "a number in kg/m^3, more than 0",
}


def problems(elastic: ElasticKeys) -> Iterator[Problem]:
    """Problems of the keys of an elastic body with each other."""
    given_sources = [key for key in SOURCES if getattr(elastic, key) is not None]
    if len(given_sources) != 1:
        sources_text = " and ".join(given_sources) if given_sources else "none"
        yield (
            (),
            f"expected exactly one of {', '.join(SOURCES)} as the source of the body, found "
            f'{sources_text}; write for example matrices = "link.npz"',
        )
        return
    yield from _material_problems(elastic, given_sources[0])
    yield from _end_problems(elastic, given_sources[0])
    yield from _start_problems(elastic)


def _material_problems(elastic: ElasticKeys, source: str) -> Iterator[Problem]:
    is_meshed = source in ("mesh", "box")
    for key, meaning in MATERIAL_KEYS.items():
        value = getattr(elastic, key)
        if is_meshed and value is None:
            yield (key,), f"missing; a body from a {source} needs {meaning}"
        elif not is_meshed and value is not None:
            yield (key,), f"{source} already contain the material; leave it out"
    if elastic.poisson is not None and not -1 < elastic.poisson < 0.5:
        yield (
            ("poisson",),
            f"expected {MATERIAL_KEYS['poisson']}, found {elastic.poisson:g}"
            + ("; no element is incompressible" if elastic.poisson == 0.5 else ""),
        )
    if elastic.order is not None and not is_meshed:
        yield ("order",), "only mesh and box have an element order; leave it out"
    if elastic.scale is not None and source != "mesh":
        yield ("scale",), "only a mesh file has its own length unit; leave it out"


def _end_problems(elastic: ElasticKeys, source: str) -> Iterator[Problem]:
    if not elastic.ends:
        yield (
            ("ends",),
            "missing; an elastic body connects only at its ends; write for example "
            "ends = { root = { plane = [1, 0, 0, 0.0] } }",
        )
    nodes = len(elastic.arrays.nodes) if elastic.arrays is not None else None
    for name, end in elastic.ends.items():
        if end.set is not None and source != "mesh":
            yield (
                ("ends", name, "set"),
                "only a mesh file has named surfaces; use plane, box, sphere or nodes",
            )
        invalid_nodes = [n for n in end.nodes or () if nodes is not None and n >= nodes]
        if invalid_nodes:
            yield (
                ("ends", name, "nodes"),
                f"expected numbers from 0 to {(nodes or 0) - 1}, found {invalid_nodes[0]}",
            )


def _start_problems(elastic: ElasticKeys) -> Iterator[Problem]:
    """Problem of eta and etad with different lengths; the matrices determine their number."""
    start = elastic.initial
    if start.eta is not None and start.etad is not None and len(start.eta) != len(start.etad):
        yield (
            ("initial", "etad"),
            f"expected as many entries as eta, {len(start.eta)}, found {len(start.etad)}",
        )


class Elastic(ElasticKeys):
    """General elastic body; its axes are those of its mesh.

    Exactly one of `matrices` (a .npz file), `arrays`, `mesh` (a file) and `box` gives its finite
    elements.  `modes` is the number of vibration modes, None for "auto".
    """

    @model_validator(mode="after")
    def _check(self) -> Elastic:
        found = list(problems(self))
        if found:
            raise ValidationProblems(*found)
        return self
