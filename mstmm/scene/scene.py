"""Scene of a multibody system: bodies, hinges, beams, loads, events, springs; validated, frozen.

The same class is read from TOML and JSON (`load_scene`) and built in Python
(`Scene(gravity=[...], body=[{...}], hinge=[{...}])`).  Invalid data raise SceneError, with one line
per problem.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextvars import ContextVar
from typing import Any

from pydantic import ConfigDict, ValidationError, model_validator

from ..arguments import short
from ..errors import SceneError
from ..ir.spec import ElementSpec
from ..markup import Displayed
from ..markup import table as html_table
from ..risk import Risk, sentences
from .checks import couplings, flexible, types
from .checks import scene as checks
from .files.write import to_toml
from .rules import written
from .rules.messages import TABLES, report, scene_error
from .rules.values import Refused
from .tables.all import SceneTables
from .tables.beam_keys import ROOT
from .tables.constants import evaluated

#: Name of the scene that is being validated, for messages.
_source: ContextVar[str] = ContextVar("source", default="scene")


class Scene(SceneTables, Displayed):
    """Validated description of a multibody system in SI units and radians; frozen.

    `gravity` is in m/s^2, inertial axes; `constants` are named numbers.  Lists keep the order of
    the file.  q and u contain the hinge coordinates in the order of `hinge`, then those of the
    chains in the order of `chain`, then the modal coordinates in the order of `beam` and `elastic`.
    """

    model_config = ConfigDict(title="mstmm scene")

    def __init__(self, /, **data: Any) -> None:
        """Validate the tables of a scene; raise SceneError with up to ten problems, one a line."""
        try:
            constants = evaluated(data.get("constants", {}))
        except Refused as refused:
            found = [(("constants", *place), message) for place, message in refused.problems]
            raise report(found, data, _source.get()) from None
        try:
            with written.known(constants, _names(data)):
                super().__init__(**data)
        except ValidationError as error:
            raise scene_error(error, type(self), data, _source.get()) from None

    @classmethod
    def from_data(cls, data: Mapping[str, Any], where: str = "scene") -> Scene:
        """Create a scene from the keys of a file; `where` begins every message."""
        if not isinstance(data, Mapping) or not all(isinstance(key, str) for key in data):
            raise SceneError(f"{where}: expected a table of scene keys, found {short(data)}")
        token = _source.set(where)
        try:
            return cls(**data)
        finally:
            _source.reset(token)

    @property
    def summary(self) -> str:
        """Number of elements of each kind: 3 bodies, 3 hinges, 1 spring."""
        counts = {"body": len(self.bodies), "hinge": len(self.hinges)}
        counts |= {name: len(getattr(self, name)) for name in _COUNTED}
        return ", ".join(_count(n, word) for word, n in counts.items() if n)

    def __repr__(self) -> str:
        return f"<Scene: {self.summary}>"

    def _repr_html_(self) -> str:
        hinges = [(one.name, one.type, one.inboard, one.outboard) for one in self.hinges[:_LISTED]]
        head = ("hinge", "type", "inboard", "outboard")
        more = len(self.hinges) - len(hinges)
        behind = f"<p>and {more} more</p>" if more else ""
        return f"<p>{self.summary}</p>{html_table(hinges, head)}{behind}"

    @property
    def risks(self) -> tuple[Risk, ...]:
        """Warnings about accepted but doubtful input."""
        return checks.risks(self)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings as text, one sentence each."""
        return sentences(self.risks)

    def to_toml(self) -> str:
        """Convert to TOML text with all defaults; loading it gives an equal scene."""
        return to_toml(self)

    def check_against(self, spec: ElementSpec, where: str = "scene") -> None:
        """Check every element of a user-defined type against its definition.

        Raises SceneError; `where` begins every message.
        """
        problems = types.problems_with(self, spec)
        if problems:
            raise report(problems, self._tables(), where)

    def check_types(
        self, known_types: Mapping[tuple[str, str], ElementSpec], where: str = "scene"
    ) -> None:
        """Check that every type is built in or defined, and that elements fit their definition.

        `known_types` maps (kind, name), kind one of hinge, body, force, to the definition.  Hinges
        of user-defined types then have the facts of their type.  Raises SceneError.
        """
        if not isinstance(known_types, Mapping):
            raise SceneError(f"known_types: expected a table, found {short(known_types)}")
        problems = types.problems(self, known_types)
        if not problems:
            with written.known(self.constants, self.channels):
                problems = types.learn(self, known_types)
                problems = problems or [*couplings.problems(self), *flexible.spins(self)]
        if problems:
            raise report(problems, self._tables(), where)

    def _tables(self) -> dict[str, Any]:
        return {table: getattr(self, table) for table in TABLES}

    @model_validator(mode="after")
    def _settle(self) -> Scene:
        for table in _UNNAMED:
            object.__setattr__(self, table, _named(table, getattr(self, table)))
        for table, elements in _at_roots(self).items():
            object.__setattr__(self, table, elements)
        problems = checks.problems(self)
        if problems:
            raise Refused(*problems)
        return self


#: Tables that a summary counts besides bodies and hinges; hinges that a notebook lists.
_COUNTED = ("beam", "elastic", "load", "spring", "bushing", "constraint", "coupling", "event")
_LISTED = 20
_MANY = {"body": "bodies", "elastic": "elastic bodies", "bushing": "bushings"}


def _count(n: int, word: str) -> str:
    one = "elastic body" if word == "elastic" else word
    return f"{n} {one if n == 1 else _MANY.get(word, word + 's')}"


#: Tables whose elements need no name; they are numbered.
_UNNAMED = ("load", "event", "spring", "bushing", "constraint", "coupling", "shape")


def _names(data: Mapping[str, Any]) -> Iterator[str]:
    """Names of inputs and signals in unvalidated data."""
    for table in ("input", "signal"):
        elements = data.get(table, ())
        for element in elements if isinstance(elements, (list, tuple)) else ():
            name = element.get("name") if isinstance(element, dict) else element
            name = getattr(name, "name", name)
            if isinstance(name, str):
                yield name


def _named(table: str, elements: tuple[Any, ...]) -> tuple[Any, ...]:
    """Name elements without a name "load1" and so on, avoiding existing names."""
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


#: Keys that refer to a body or one of its ends.
_REFERENCES = {
    "hinge": ("inboard", "outboard"), "chain": ("inboard",), "load": ("on",),
    "spring": ("from_", "to"), "bushing": ("from_", "to"), "constraint": ("from_", "to"),
    "shape": ("on",),
}  # fmt: skip


def _at_roots(scene: SceneTables) -> dict[str, tuple[Any, ...]]:
    """Tables in which the name of a beam is replaced by its root, "blade.root".

    Loads per length keep the name of the beam.
    """
    beams = {beam.name for beam in scene.beam}
    changed: dict[str, tuple[Any, ...]] = {}
    for table, keys in _REFERENCES.items() if beams else ():
        elements = []
        for element in getattr(scene, table):
            update = {
                key: f"{getattr(element, key)}.{ROOT}"
                for key in keys
                if getattr(element, key) in beams
                and getattr(element, "force_per_length", None) is None
            }
            elements.append(element.model_copy(update=update) if update else element)
        changed[table] = tuple(elements)
    return changed
