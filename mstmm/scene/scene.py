"""Scene of a multibody system: bodies, hinges, beams, loads, events, springs; validated, frozen.

The same class is read from TOML and JSON (`load_scene`) and built in Python
(`Scene(gravity=[...], body=[{...}], hinge=[{...}])`).  Invalid data raise SceneError, with one line
per problem.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextvars import ContextVar
from typing import Any, ClassVar

from pydantic import ConfigDict, ValidationError

from ..argument_validation import abbreviate
from ..display import NotebookDisplay, PublicMembers
from ..display import table as html_table
from ..errors import SceneError
from ..ir.element_spec import ElementSpec
from ..risk import Risk, sentences
from .checks import closures, consistency, flexible_bodies, input_warnings, user_types
from .files import to_toml
from .tables.beam import ROOT
from .tables.scene_tables import SceneTables, evaluate_constants
from .validators import constant_expressions
from .validators.scalars_and_vectors import Problem, ValidationProblems
from .validators.validation_messages import TABLES, build_scene_error, scene_error

#: Name of the scene that is being validated, for messages.
_source: ContextVar[str] = ContextVar("source", default="scene")


class Scene(PublicMembers, SceneTables, NotebookDisplay):
    """Validated description of a multibody system in SI units and radians; frozen.

    `gravity` is in m/s^2, inertial axes; `constants` are named numbers.  Lists keep the order of
    the file.  q and u contain the hinge coordinates in the order of `hinge`, then those of the
    chains in the order of `chain`, then the modal coordinates in the order of `beam` and `elastic`.
    """

    member_groups: ClassVar[Mapping[str, str]] = {
        "Tables": "schema_version gravity allow_unphysical_inertia constants input signal "
        "body beam elastic hinge chain spring bushing load coupling constraint "
        "controller event output shape names",
        "Elements": "bodies hinges summary",
        "Checks": "risks warnings check_types",
        "Copies and files": "with_inputs from_data to_toml",
    }

    model_config = ConfigDict(title="mstmm scene")

    def __init__(self, /, **data: Any) -> None:
        """Validate the tables of a scene; raise SceneError with up to ten problems, one a line."""
        try:
            constants = evaluate_constants(data.get("constants", {}))
        except ValidationProblems as refused:
            problems = [
                (("constants", *location), message) for location, message in refused.problems
            ]
            raise build_scene_error(problems, data, _source.get()) from None
        try:
            with constant_expressions.constants_context(constants, _input_and_signal_names(data)):
                super().__init__(**data)
        except ValidationError as error:
            raise scene_error(error, type(self), data, _source.get()) from None

    @classmethod
    def from_data(cls, data: Mapping[str, Any], where: str = "scene") -> Scene:
        """Create a scene from the keys of a file; `where` begins every message."""
        if not isinstance(data, Mapping) or not all(isinstance(key, str) for key in data):
            raise SceneError(f"{where}: expected a table of scene keys, found {abbreviate(data)}")
        token = _source.set(where)
        try:
            return cls(**data)
        finally:
            _source.reset(token)

    @property
    def summary(self) -> str:
        """Number of elements of each kind: 3 bodies, 3 hinges, 1 spring."""
        counts = {"body": len(self.bodies), "hinge": len(self.hinges)}
        counts |= {name: len(getattr(self, name)) for name in _SUMMARY_TABLES}
        return ", ".join(_count_text(n, table) for table, n in counts.items() if n)

    def __repr__(self) -> str:
        return f"<Scene: {self.summary}>"

    def _repr_html_(self) -> str:
        hinges = [
            (hinge.name, hinge.type, hinge.inboard, hinge.outboard)
            for hinge in self.hinges[:_MAX_LISTED_HINGES]
        ]
        head = ("hinge", "type", "inboard", "outboard")
        more_count = len(self.hinges) - len(hinges)
        more_html = f"<p>and {more_count} more</p>" if more_count else ""
        return f"<p>{self.summary}</p>{html_table(hinges, head)}{more_html}"

    @property
    def risks(self) -> tuple[Risk, ...]:
        """Warnings about accepted but doubtful input."""
        return input_warnings.risks(self)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings as text, one sentence each."""
        return sentences(self.risks)

    def to_toml(self) -> str:
        """Convert to TOML text with all defaults; loading it gives an equal scene."""
        return to_toml(self)

    def check_type(self, spec: ElementSpec, where: str = "scene") -> None:
        """Check every element of a user-defined type against its definition.

        Raises SceneError; `where` begins every message.
        """
        problems = user_types.problems_of_type(self, spec)
        if problems:
            raise build_scene_error(problems, self._tables(), where)

    def check_types(
        self, known_types: Mapping[tuple[str, str], ElementSpec], where: str = "scene"
    ) -> None:
        """Check that every type is built in or defined, and that elements fit their definition.

        `known_types` maps (kind, name), kind one of hinge, body, force, to the definition.  Hinges
        of user-defined types then have the facts of their type.  Raises SceneError.
        """
        if not isinstance(known_types, Mapping):
            raise SceneError(f"known_types: expected a table, found {abbreviate(known_types)}")
        problems = user_types.type_problems(self, known_types)
        if not problems:
            with constant_expressions.constants_context(self.constants, self.channels):
                problems = user_types.apply_definitions(self, known_types)
                problems = problems or [
                    *closures.coupling_problems(self),
                    *flexible_bodies.spin_problems(self),
                ]
        if problems:
            raise build_scene_error(problems, self._tables(), where)

    def _tables(self) -> dict[str, Any]:
        return {table: getattr(self, table) for table in TABLES}

    def _check(self) -> None:
        for table in _AUTO_NAMED_TABLES:
            vars(self)[table] = _name_elements(table, getattr(self, table))
        vars(self).update(_tables_with_beam_roots(self))

    def _problems(self) -> list[Problem]:
        return consistency.problems(self)


#: Tables that a summary counts besides bodies and hinges; hinges that a notebook lists.
_SUMMARY_TABLES = (
    "beam", "elastic", "load", "spring", "bushing", "constraint", "coupling", "event",
)  # fmt: skip
_MAX_LISTED_HINGES = 20
_PLURALS = {"body": "bodies", "elastic": "elastic bodies", "bushing": "bushings"}


def _count_text(n: int, word: str) -> str:
    singular = "elastic body" if word == "elastic" else word
    return f"{n} {singular if n == 1 else _PLURALS.get(word, word + 's')}"


#: Tables whose elements need no name; they are numbered.
_AUTO_NAMED_TABLES = ("load", "event", "spring", "bushing", "constraint", "coupling", "shape")


def _input_and_signal_names(data: Mapping[str, Any]) -> Iterator[str]:
    """Names of inputs and signals in unvalidated data."""
    for table in ("input", "signal"):
        elements = data.get(table, ())
        for element in elements if isinstance(elements, (list, tuple)) else ():
            name = element.get("name") if isinstance(element, dict) else element
            name = getattr(name, "name", name)
            if isinstance(name, str):
                yield name


def _name_elements(table: str, elements: tuple[Any, ...]) -> tuple[Any, ...]:
    """Name elements without a name "load1" and so on, avoiding existing names."""
    used_names = {element.name for element in elements}
    named_elements = []
    for i, element in enumerate(elements, 1):
        if not element.name:
            name = f"{table}{i}"
            while name in used_names:
                name += "_"
            used_names.add(name)
            element = element.model_copy(update={"name": name})
        named_elements.append(element)
    return tuple(named_elements)


#: Keys that refer to a body or one of its ends.
_REFERENCE_KEYS = {
    "hinge": ("inboard", "outboard"), "chain": ("inboard",), "load": ("on",),
    "spring": ("from_", "to"), "bushing": ("from_", "to"), "constraint": ("from_", "to"),
    "shape": ("on",),
}  # fmt: skip


def _tables_with_beam_roots(scene: SceneTables) -> dict[str, tuple[Any, ...]]:
    """Tables in which the name of a beam is replaced by its root, "blade.root".

    Loads per length keep the name of the beam.
    """
    beams = {beam.name for beam in scene.beam}
    changed_tables: dict[str, tuple[Any, ...]] = {}
    for table, keys in _REFERENCE_KEYS.items() if beams else ():
        elements = []
        for element in getattr(scene, table):
            update = {
                key: f"{getattr(element, key)}.{ROOT}"
                for key in keys
                if getattr(element, key) in beams
                and getattr(element, "force_per_length", None) is None
            }
            elements.append(element.model_copy(update=update) if update else element)
        changed_tables[table] = tuple(elements)
    return changed_tables
