"""Parameters of a scene by name: "rod1.mass", "shoulder.law.stiffness[0]", "constants.k".

Integers (members of a chain, shapes of a beam, nodes of a mesh) are not parameters: they determine
the length of q and u.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from mstmm.array_validation import finite_float, mapping_by_name
from mstmm.errors import SceneError
from mstmm.expression.derivatives import motion_at
from mstmm.scene import Scene
from mstmm.scene.checks.user_types import copy_definitions
from mstmm.scene.files import to_toml
from mstmm.scene.tables.scene_tables import evaluate_constants
from mstmm.scene.validators.constant_expressions import constants_context
from mstmm.scene.validators.names_and_text import to_expression
from mstmm.scene.validators.scalars_and_vectors import ValidationProblems
from mstmm.scene.validators.validation_messages import did_you_mean

TABLES = (
    "input", "body", "beam", "elastic", "hinge", "chain", "load", "event", "spring", "bushing",
    "constraint",
)  # fmt: skip
_INDEX = re.compile(r"(.*)\[(\d+)\]")
_INDICES = re.compile(r"\[\d+\]")


def scene_data(scene: Scene, evaluated: bool = False) -> dict[str, Any]:
    """Scene as the data of a file, without the default ends of beams.

    With `evaluated`, expressions of named constants are replaced by their values.
    """
    data = tomllib.loads(to_toml(scene, evaluated))
    for beam in data.get("beam", []):
        for name in ("root", "tip"):
            if not any(beam["ends"][name].get("orientation", ())):
                del beam["ends"][name]
    return data


def _elements(data: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """(name, table) of all named elements."""
    for table in TABLES:
        for element in data.get(table, []):
            yield element["name"], element


def _numbers(path: str, value: Any) -> Iterator[tuple[str, float]]:
    """(name, value) of all floats in a value."""
    if isinstance(value, float):
        yield path, value
    elif isinstance(value, dict):
        for key, entry in value.items():
            yield from _numbers(f"{path}.{key}", entry)
    elif isinstance(value, list):
        for i, entry in enumerate(value):
            yield from _numbers(f"{path}[{i}]", entry)


def scene_parameters(scene: Scene) -> dict[str, float]:
    """Name -> value of all parameters, in the scene's order."""
    data = scene_data(scene, evaluated=True)
    parameters = dict(_numbers("constants", data.get("constants", {})))
    parameters.update(_numbers("gravity", data["gravity"]))
    for name, element in _elements(data):
        parameters.update(_numbers(name, element))
    return parameters


def with_parameters(scene: Scene, changes: Mapping[str, float]) -> Scene:
    """Change parameters of a scene and validate it again.

    A name without an index means all entries of a list with one entry or with equal entries (both
    bending stiffnesses of a beam that were given as one), and all bodies or hinges of a chain's
    pattern: "rope.body.mass".  Raises SceneError for unknown names and invalid values.
    """
    data = scene_data(scene)
    parameters: dict[str, float] | None = None
    given_names, names_without_index = dict[str, str](), dict[str, list[str]]()
    for given_name, given_value in mapping_by_name("parameters", changes).items():
        value = finite_float(f'parameter "{given_name}"', given_value)
        candidates = scene.names.resolve(given_name)
        name = next((path for path in candidates if _set(data, path, value)), None)
        if name is None:
            parameters = parameters or scene_parameters(scene)
            raise _unknown_parameter(given_name, parameters)
        similar = names_without_index.setdefault(_INDICES.sub("", name), [])
        overlapping = [other for other in similar if _overlap(name, other)]
        if overlapping and parameters is None:
            parameters = scene_parameters(scene)
        same = next(
            (o for o in overlapping if _entries(o, parameters) == _entries(name, parameters)), None
        )
        if same is not None:
            raise SceneError(
                f'parameters: "{given_names[same]}" and "{given_name}" are the same number; give '
                "one of them"
            )
        given_names[name] = given_name
        similar.append(name)
    for beam in data.get("beam", []):  # an end "tip" with its own axes stays at the tip
        if "tip" in beam["ends"]:
            beam["ends"]["tip"]["position"] = [beam["length"], 0.0, 0.0]
    return scene_from_data(data, scene)


def _overlap(name: str, other: str) -> bool:
    """Whether two names have a number in common: parts without an index mean all entries."""
    parts, other_parts = ([part.partition("[") for part in n.split(".")] for n in (name, other))
    return len(parts) == len(other_parts) and all(
        a[0] == b[0] and (a[2] == b[2] or not (a[1] and b[1]))
        for a, b in zip(parts, other_parts, strict=True)
    )


def _entries(name: str, parameters: Mapping[str, float] | None) -> set[str]:
    """Parameters that a name means, or the name itself."""
    return {entry for entry in parameters or () if _overlap(name, entry)} or {name}


def scene_from_data(data: dict[str, Any], scene: Scene, where: str = "scene") -> Scene:
    """Validate changed data of a scene; `where` begins every message."""
    _update_driven_start(data)
    changed = Scene.from_data(data, where)
    copy_definitions(changed, scene)
    return changed


def _update_driven_start(data: dict[str, Any]) -> None:
    """Set initial values of driven coordinates from the drives, which may have changed."""
    try:
        constants = evaluate_constants(data.get("constants", {}))
    except ValidationProblems:
        return  # the validation of the scene reports them
    with constants_context(constants):
        for table in data.get("hinge", []):
            initial = table.get("initial", {})
            for k, drive in enumerate(table.get("drive", ())):
                if drive == "free" or not initial:
                    continue
                expression = to_expression(drive, "a drive")
                if expression.depends_on_time_only:
                    initial["q"][k], initial["u"][k], _ = motion_at(expression, 0.0)


def resolve_names(scene: Scene, names: Sequence[str]) -> list[str]:
    """Full names, with the index 0 for lists with a single entry.

    Raises SceneError for unknown names.
    """
    parameters = scene_parameters(scene)
    without_index = {name.replace("[0]", ""): name for name in parameters}
    full_names = []
    for given in names:
        candidates = (
            name for name in scene.names.resolve(given)
            if name in parameters or name in without_index
        )  # fmt: skip
        name = next(candidates, given)
        full = name if name in parameters else without_index.get(name, "")
        if not full or (full != name and full.replace("[0]", "[1]") in parameters):
            raise _unknown_parameter(name, parameters)
        full_names.append(full)
    return full_names


def _unknown_parameter(name: str, parameters: Mapping[str, float]) -> SceneError:
    full_names = [full for full in parameters if full.endswith(f".{name}")]
    hint = f'; did you mean "{full_names[0]}"?' if full_names else did_you_mean(name, parameters)
    return SceneError(f'parameter "{name}": there is no such number in the scene{hint}')


def _set(data: dict[str, Any], path: str, value: float) -> bool:
    """Write `value` at a path of the data; False if the path does not exist."""
    parts = path.split(".")
    owners = _owners(data, parts)
    return any(_assign(owner, parts, value) for owner in owners)


def _owners(data: dict[str, Any], parts: list[str]) -> list[Any]:
    """Tables in which the path continues; removes the element's name from `parts`."""
    if parts[0].startswith("gravity") or (parts[0] == "constants" and len(parts) > 1):
        return [data]
    name = parts.pop(0)
    return [element for owner, element in _elements(data) if owner == name]


def _assign(target: Any, parts: list[str], value: float) -> bool:
    """Write `value` at the end of the path; False if the path does not exist."""
    for i, part in enumerate(parts):
        match = _INDEX.fullmatch(part)
        key, index = (match[1], int(match[2])) if match else (part, None)
        if not isinstance(target, dict) or key not in target:
            return False
        container: Any = target
        entry: Any = key
        if index is None and key in ("body", "hinge") and isinstance(container[key], list):
            return all(_assign(table, parts[i + 1 :], value) for table in container[key])
        if isinstance(container[key], list) and (index is not None or len(container[key]) == 1):
            container, entry = container[key], index or 0
            if entry >= len(container):
                return False
        elif index is not None:
            return False
        if i == len(parts) - 1 and index is None and _are_equal_numbers(container[entry]):
            container[entry] = [float(value)] * len(container[entry])
            return True
        if i == len(parts) - 1:
            if isinstance(container[entry], (dict, list, int)):
                return False
            container[entry] = float(value)
            return True
        target = container[entry]
    return False


def _are_equal_numbers(value: Any) -> bool:
    """Whether a value is a list of equal numbers other than zero."""
    return isinstance(value, list) and len(set(map(str, value))) == 1 and bool(value[0])
