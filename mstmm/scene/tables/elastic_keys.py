"""Keys of an elastic body: source, ends; `elastic_rules` checks them against each other."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from ...numbers.rotations import Matrix, Vector, from_orientation
from ..rules import text as texts
from ..rules import turns
from ..rules import values as rules
from ..rules.values import NAME, Location, Refused, Rule, Shorthand, Table, found, plain, refuse
from .flexible import AUTO, FlexibleTable, Numbers, decided, framed

#: Folder from which relative paths start while a scene file is read; "" leaves paths unchanged.
FOLDER: ContextVar[str] = ContextVar("folder", default="")

SOURCES = ("matrices", "arrays", "mesh", "box")
REGIONS = ("nodes", "box", "plane", "sphere", "set")
COUPLINGS = ("rigid", "mean")
ORDERS = ("node", "component")
#: Most unknowns of matrices given in the scene file.
MAX_UNKNOWNS = 3000
MAX_MODES = 200

Rows = tuple[Numbers, ...]


def path(*suffixes: str) -> Rule:
    """Rule for the path of a file, relative to the folder of the scene file."""
    kinds = " or ".join(suffixes)
    expected = "the path of a file" + (f" ending in {kinds}" if suffixes else "")

    def check(value: Any) -> str:
        value = os.fspath(value) if isinstance(value, os.PathLike) else value
        if not isinstance(value, str) or not value or not value.isprintable():
            raise refuse(f"expected {expected}, found {found(value)}")
        if suffixes and not value.lower().endswith(suffixes):
            raise refuse(f"expected {expected}, found {found(value)}")
        return str(Path(FOLDER.get()) / value) if FOLDER.get() else value

    return Rule(expected, check, {"type": "string"})


def path_inside(*suffixes: str) -> Rule:
    """Rule for the path of a regular file in the folder of the scene file, or below.

    For a scene that was not read from a file, any path is accepted.
    """
    anywhere = path(*suffixes)

    def check(value: Any) -> str:
        name: str = anywhere.check(value)
        if not FOLDER.get():
            return name
        home, place = Path(FOLDER.get()).resolve(), Path(name).resolve()
        if not place.is_relative_to(home):
            raise refuse(
                f"expected a file in the folder of the scene, found {found(value)}; copy it there"
            )
        if not place.is_file():
            raise refuse(f"{found(value)}: there is no such file in the folder of the scene")
        return name

    return Rule(anywhere.expected, check, {"type": "string"})


def table_of_numbers(expected: str, columns: int = 0) -> Rule:
    """Rule for rows of finite numbers of equal length (`columns` if given)."""

    def check(value: Any) -> Rows:
        value = plain(value.toarray() if hasattr(value, "toarray") else value)
        rows = rules.entries_of(value, expected)
        width = columns or (len(rows[0]) if rows and isinstance(rows[0], (list, tuple)) else 0)
        if not rows or len(rows) > MAX_UNKNOWNS:
            raise refuse(
                f"expected {expected}, 1 to {MAX_UNKNOWNS} rows, found {len(rows)}"
                + ("; save larger ones to a file and give its path in matrices" if rows else "")
            )
        row = rules.numbers(f"rows of {width} numbers", width or 1)
        return tuple(_row(row, one, i) for i, one in enumerate(rows))

    inner = {"type": "array", "items": {"type": ["number", "string"]}}
    return Rule(expected, check, {"type": "array", "items": inner})


def _row(rule: Rule, value: Any, i: int) -> Numbers:
    try:
        numbers: Numbers = rule.check(value)
    except Refused as refused:
        raise Refused(*(((i, *place), message) for place, message in refused.problems)) from None
    return numbers


class Arrays(Table):
    """Matrices of a finite-element model: rows of numbers, kg (kg m^2) and N/m (N m).

    N nodes have 3 N unknowns (x, y, z of each) or 6 N (with rotations).  `order` "node" means
    x1 y1 z1 x2 ..., "component" means x1 x2 ... y1 y2 ...
    """

    mass: Annotated[Rows, table_of_numbers("the mass matrix, rows of numbers")]
    stiffness: Annotated[Rows, table_of_numbers("the stiffness matrix, rows of numbers")]
    nodes: Annotated[Rows, table_of_numbers("the positions of the nodes, rows of x, y, z in m", 3)]
    scalar_mass: Annotated[
        Rows | None, table_of_numbers("the mass matrix of one component, rows of numbers")
    ] = None
    order: Annotated[str, texts.choice(*ORDERS)] = ORDERS[0]

    @model_validator(mode="after")
    def _check(self) -> Arrays:
        problems = list(self._sizes())
        if problems:
            raise Refused(*problems)
        return self

    def _sizes(self) -> Iterator[tuple[Location, str]]:
        count = len(self.nodes)
        for key in ("mass", "stiffness", "scalar_mass"):
            rows = getattr(self, key)
            if rows is None:
                continue
            sizes = (count,) if key == "scalar_mass" else (3 * count, 6 * count)
            if len(rows) not in sizes or len(rows[0]) != len(rows):
                wanted = " or ".join(f"{n} x {n}" for n in sizes)
                yield (
                    (key,),
                    f"expected {wanted} numbers for {count} nodes, found {len(rows)} x "
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

    size: Annotated[Vector, rules.numbers("three numbers in m, more than 0", 3, of="m")]
    divisions: Annotated[tuple[int, ...], rules.numbers("three whole numbers, 1 or more", 3)]
    corner: Annotated[Vector, rules.vector("m")] = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _check(self) -> Box:
        if min(self.size) <= 0:
            raise refuse(
                f"expected three numbers in m, more than 0, found {found(self.size)}", "size"
            )
        counts = tuple(int(n) for n in self.divisions)
        if counts != self.divisions or min(counts) < 1 or max(counts) > 10_000:
            raise refuse(
                f"expected three whole numbers from 1 to 10000, found {found(self.divisions)}",
                "divisions",
            )
        object.__setattr__(self, "divisions", counts)
        return self


def _numbers_of_nodes() -> Rule:
    expected = "numbers of nodes, from 0, in the order of the file"
    one = rules.whole(0, 10**9)

    def check(value: Any) -> tuple[int, ...]:
        entries = rules.entries_of(value, expected)
        if not entries:
            raise refuse(f"expected {expected}, found an empty list")
        checked = rules.collect(entries, expected, lambda v, i: _at(one, v, i))
        return checked

    schema = {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 1}
    return Rule(expected, check, schema)


def _at(rule: Rule, value: Any, *place: str | int) -> Any:
    try:
        return rule.check(value)
    except Refused as refused:
        raise Refused(*((place, message) for _, message in refused.problems)) from None


def _corners() -> Rule:
    expected = "two corners, [[x, y, z], [x, y, z]] in m, the smaller first"
    inner = table_of_numbers(expected, 3)

    def check(value: Any) -> Rows:
        rows: Rows = inner.check(value)
        if len(rows) != 2 or any(a > b for a, b in zip(*rows, strict=True)):
            raise refuse(f"expected {expected}, found {found(rows)}")
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

    nodes: Annotated[tuple[int, ...] | None, _numbers_of_nodes()] = None
    box: Annotated[Rows | None, _corners()] = None
    plane: Annotated[
        Numbers | None, rules.numbers("[nx, ny, nz, d]: a normal and its distance in m", 4)
    ] = None
    sphere: Annotated[Numbers | None, rules.numbers("[x, y, z, radius] in m", 4, of="m")] = None
    set: Annotated[str | None, texts.label("the name of a surface in the mesh file")] = None
    position: Annotated[Vector | None, rules.vector("m")] = None
    orientation: Annotated[Numbers, turns.orientation()] = (0.0, 0.0, 0.0)
    coupling: Annotated[str, texts.choice(*COUPLINGS)] = COUPLINGS[0]
    static_shapes: Annotated[bool | None, decided(texts.flag())] = None

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
        given = [key for key in REGIONS if getattr(self, key) is not None]
        if len(given) != 1:
            named = ", ".join(given) if given else "none"
            raise refuse(
                f"expected exactly one of {', '.join(REGIONS)} for the nodes of this end, found "
                f"{named}; write for example plane = [1, 0, 0, 0.0]"
            )
        if self.plane is not None and max(map(abs, self.plane[:3])) == 0:
            raise refuse("expected a normal that is not zero, as in [1, 0, 0, 0.0]", "plane")
        if self.sphere is not None and self.sphere[3] <= 0:
            raise refuse(
                f"expected a radius in m, more than 0, found {found(self.sphere[3])}", "sphere", 3
            )
        return self


def _as_ends(value: Any) -> Any:
    if not isinstance(value, dict):
        raise refuse(f"expected {_ENDS.expected}, found {found(value)}")
    for key in value:
        if not isinstance(key, str) or not NAME.fullmatch(key):
            raise refuse(f"expected the name of an end, found {found(key)}")
    return value


_ENDS = Shorthand(
    "ends by name, each a table such as { plane = [1, 0, 0, 0.0] }", _as_ends, {"type": "object"}
)


class ElasticKeys(FlexibleTable):
    """Keys of an elastic body."""

    matrices: Annotated[str | None, path(".npz")] = None
    arrays: Arrays | None = None
    mesh: Annotated[str | None, path()] = None
    box: Box | None = None
    scale: Annotated[float | None, rules.number("m per unit of the mesh", above=0)] = None
    order: Annotated[int | None, rules.whole(1, 2)] = None
    young: Annotated[float | None, rules.number("Pa", above=0)] = None
    poisson: Annotated[float | None, rules.number("")] = None
    density: Annotated[float | None, rules.number("kg/m^3", above=0)] = None
    modes: Annotated[int | None, decided(rules.whole(0, MAX_MODES))] = None
    frame: Annotated[str, framed(AUTO, "tangent", "mean")] = AUTO
    highest_frequency: Annotated[float | None, rules.number("rad/s", above=0)] = None
    ends: Annotated[dict[str, ElasticEnd], _ENDS] = Field(default_factory=dict)

    @property
    def source(self) -> str:
        """Key that gives the finite elements: matrices, arrays, mesh or box."""
        return next(key for key in SOURCES if getattr(self, key) is not None)
