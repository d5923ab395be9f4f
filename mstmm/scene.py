"""A scene: bodies, hinges, beams, loads, events and springs, validated and frozen.

The same model is read from TOML and JSON (`load_scene`) and built in Python
(`Scene(gravity=[...], body=[{...}], hinge=[{...}])`).  Everything that does not describe a system
raises SceneError, one line per problem.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextvars import ContextVar
from functools import cached_property
from typing import Annotated, Any

from pydantic import ConfigDict, ValidationError, model_validator

from . import scene_checks, scene_errors, scene_skeleton, scene_text, scene_types
from . import scene_rules as rules
from . import scene_rules_text as texts
from .rotations import Vector
from .scene_beam import Beam, Modes, Section, Shapes
from .scene_chain import Chain
from .scene_elastic import Arrays, Box, Elastic, ElasticEnd
from .scene_file import load_scene, read
from .scene_flexible import Damping, Start
from .scene_law import Friction, Law, LawEntry, Limits, SpringLaw
from .scene_members import Bodies, Hinges
from .scene_parts import Body, End, Event, Hinge, Initial, Load, Spring
from .scene_rules import Table, split
from .spec import ElementSpec

__all__ = [
    "Arrays", "Beam", "Body", "Box", "Chain", "Damping", "Elastic", "ElasticEnd", "End", "Event",
    "Friction", "Hinge", "Initial", "Law", "LawEntry", "Limits", "Load", "Modes", "Scene",
    "Section", "Shapes", "Spring", "SpringLaw", "Start", "load_scene", "read", "split",
]  # fmt: skip

#: What messages call the scene that is being read.
_source: ContextVar[str] = ContextVar("source", default="scene")


def _version(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value != 1:
        raise rules.refuse(f"expected 1, the only version there is, found {rules.found(value)}")
    return value


class Scene(Table):
    """Everything a simulation needs to know, SI units and radians, frozen.

    `gravity` in m/s^2, inertial axes.  Lists keep the order of the file: hinge coordinates appear
    in q and u in the order of `hinge`, then those of the chains in the order of `chain`, then the
    modal coordinates in the order of `beam` and of `elastic`.
    """

    model_config = ConfigDict(title="mstmm scene")

    schema_version: Annotated[int, rules.Rule("1", _version, {"const": 1})] = 1
    gravity: Annotated[Vector, rules.vector("m/s^2, such as [0, -9.81, 0]")]
    allow_unphysical_inertia: Annotated[bool, texts.flag()] = False
    body: tuple[Body, ...] = ()
    hinge: tuple[Hinge, ...] = ()
    chain: tuple[Chain, ...] = ()
    beam: tuple[Beam, ...] = ()
    elastic: tuple[Elastic, ...] = ()
    load: tuple[Load, ...] = ()
    event: tuple[Event, ...] = ()
    spring: tuple[Spring, ...] = ()

    def __init__(self, /, **data: Any) -> None:
        """Validate; SceneError names every problem (at most ten lines)."""
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise scene_errors.scene_error(error, type(self), data, _source.get()) from None

    @classmethod
    def from_data(cls, data: Mapping[str, Any], where: str = "scene") -> Scene:
        """Scene from the keys of a file; `where` begins every message."""
        token = _source.set(where)
        try:
            return cls(**data)
        finally:
            _source.reset(token)

    @cached_property
    def bodies(self) -> Bodies:
        """Every body: `body`, then the members of the chains, made when they are asked for."""
        return Bodies(self.body, self.chain)

    @cached_property
    def hinges(self) -> Hinges:
        """Every hinge: `hinge`, then the members of the chains, made when they are asked for."""
        return Hinges(self.hinge, self.chain)

    @property
    def skeleton(self) -> Scene:
        """The same scene with every beam and elastic body as a body with the same ends (and no
        mass), behind `body`: what names and the tree are checked on."""
        return self._skeleton if self.beam or self.elastic else self

    @cached_property
    def _skeleton(self) -> Scene:
        return scene_skeleton.skeleton(self)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is accepted but worth knowing, one sentence each."""
        return scene_checks.warnings(self)

    def to_toml(self) -> str:
        """The scene as TOML with every default filled in; it loads back to an equal scene."""
        return scene_text.to_toml(self)

    def check_against(self, spec: ElementSpec, where: str = "scene") -> None:
        """Check every element of a user's type against the definition of that type."""
        problems = scene_types.problems_with(self, spec)
        if problems:
            raise scene_errors.report(problems, self._tables(), where)

    def check_types(
        self, known_types: Mapping[tuple[str, str], ElementSpec], where: str = "scene"
    ) -> None:
        """Check that every type is built in or known, and fits its definition.

        `known_types` maps (kind, name), kind one of hinge, body, force, to the definition.
        """
        problems = scene_types.problems(self, known_types)
        if problems:
            raise scene_errors.report(problems, self._tables(), where)

    def _tables(self) -> dict[str, Any]:
        return {table: getattr(self, table) for table in scene_errors.TABLES}

    @model_validator(mode="after")
    def _settle(self) -> Scene:
        for table in ("load", "event", "spring"):
            object.__setattr__(self, table, _named(table, getattr(self, table)))
        for table, elements in scene_skeleton.at_roots(self).items():
            object.__setattr__(self, table, elements)
        problems = scene_checks.problems(self)
        if problems:
            raise rules.Refused(*problems)
        return self


def _named(table: str, elements: tuple[Any, ...]) -> tuple[Any, ...]:
    """Elements without a name get "load1" and so on, avoiding names that are taken."""
    taken = {element.name for element in elements}
    named = []
    for i, element in enumerate(elements, 1):
        if not element.name:
            name = f"{table}{i}"
            while name in taken:
                name += "_"
            taken.add(name)
            element = element.model_copy(update={"name": name})
        named.append(element)
    return tuple(named)
