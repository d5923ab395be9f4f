"""Named numbers of a scene: "rod1.mass", "shoulder.law.stiffness[0]", "gravity[1]", "constants.k".

Whole numbers (members of a chain, shapes of a beam, nodes of a mesh) are no parameters: they decide
the length of q and u.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from mstmm.array_validation import finite_float, mapping_by_name
from mstmm.errors import SceneError
from mstmm.expression.drive import motion_at
from mstmm.scene import Scene
from mstmm.scene.checks.user_types import copy_definitions
from mstmm.scene.files.write import to_toml
from mstmm.scene.tables.constants import evaluate_constants
from mstmm.scene.validators.constant_expressions import constants_context
from mstmm.scene.validators.names_and_text import to_expression
from mstmm.scene.validators.scalars_and_vectors import ValidationProblems
from mstmm.scene.validators.validation_messages import did_you_mean

TABLES = (
    "input", "body", "beam", "elastic", "hinge", "chain", "load", "event", "spring", "bushing",
    "constraint",
)  # fmt: skip
_INDEX = re.compile(r"(.*)\[(\d+)\]")
_EVERY = re.compile(r"\[\d+\]")


def scene_data(scene: Scene, evaluated: bool = False) -> dict[str, Any]:
    """The scene as a file has it, without the ends that every beam has of itself; `evaluated`, with
    numbers alone for what is written as expressions of named constants."""
    data = tomllib.loads(to_toml(scene, evaluated))
    for beam in data.get("beam", []):
        for name in ("root", "tip"):
            if not any(beam["ends"][name].get("orientation", ())):
                del beam["ends"][name]
    return data


def _named(data: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    for table in TABLES:
        for element in data.get(table, []):
            yield element["name"], element


def _numbers(path: str, value: Any) -> Iterator[tuple[str, float]]:
    if isinstance(value, float):
        yield path, value
    elif isinstance(value, dict):
        for key, entry in value.items():
            yield from _numbers(f"{path}.{key}", entry)
    elif isinstance(value, list):
        for i, entry in enumerate(value):
            yield from _numbers(f"{path}[{i}]", entry)


def scene_parameters(scene: Scene) -> dict[str, float]:
    """Every number by its name, in the scene's order."""
    data = scene_data(scene, evaluated=True)
    found = dict(_numbers("constants", data.get("constants", {})))
    found.update(_numbers("gravity", data["gravity"]))
    for name, element in _named(data):
        found.update(_numbers(name, element))
    return found


def with_parameters(scene: Scene, changes: Mapping[str, float]) -> Scene:
    """The scene with other numbers, validated afresh.

    A name without an index stands for all entries of a list of one or of equal numbers (both
    bending stiffnesses of a beam that were given as one), and for all bodies or hinges of a chain's
    pattern: "rope.body.mass".  Raises SceneError for unknown names and for values that the scene
    refuses.
    """
    data = scene_data(scene)
    there: dict[str, float] | None = None
    given_as, together = dict[str, str](), dict[str, list[str]]()
    for path, given in mapping_by_name("parameters", changes).items():
        value = finite_float(f'parameter "{path}"', given)
        own = next((one for one in scene.names.meant(path) if _set(data, one, value)), None)
        if own is None:
            there = there or scene_parameters(scene)
            raise _unknown(path, there)
        beside = together.setdefault(_EVERY.sub("", own), [])
        alike = [one for one in beside if _meets(own, one)]
        there = scene_parameters(scene) if alike and there is None else there
        same = next((one for one in alike if _meant(own, there) == _meant(one, there)), None)
        if same is not None:
            other = given_as[same]
            raise SceneError(f'parameters "{other}" and "{path}" are one number; give one of them')
        given_as[own] = path
        beside.append(own)
    for beam in data.get("beam", []):  # an end "tip" with axes of its own stays at the tip
        if "tip" in beam["ends"]:
            beam["ends"]["tip"]["position"] = [beam["length"], 0.0, 0.0]
    return scene_from_data(data, scene)


def _meets(name: str, other: str) -> bool:
    """Whether two names stand for a number together: words without an index stand for each."""
    words, others = ([part.partition("[") for part in one.split(".")] for one in (name, other))
    return len(words) == len(others) and all(
        mine[0] == theirs[0] and (mine[2] == theirs[2] or not (mine[1] and theirs[1]))
        for mine, theirs in zip(words, others, strict=True)
    )


def _meant(name: str, there: Mapping[str, float] | None) -> set[str]:
    """All numbers that a name stands for, or itself."""
    return {one for one in there or () if _meets(name, one)} or {name}


def scene_from_data(data: dict[str, Any], scene: Scene, where: str = "scene") -> Scene:
    """The scene that data like those of another one are, validated afresh; `where` begins every
    message."""
    _begin_driven(data)
    found = Scene.from_data(data, where)
    copy_definitions(found, scene)
    return found


def _begin_driven(data: dict[str, Any]) -> None:
    """Start values of driven coordinates follow the drives, which may have changed."""
    try:
        constants = evaluate_constants(data.get("constants", {}))
    except ValidationProblems:
        return  # as the scene will be, which says where
    with constants_context(constants):
        for table in data.get("hinge", []):
            start = table.get("initial", {})
            for k, drive in enumerate(table.get("drive", ())):
                by = None if drive == "free" or not start else to_expression(drive, "a drive")
                if by is not None and by.depends_on_time_only:
                    q, u, _ = motion_at(by, 0.0)
                    start["q"][k], start["u"][k] = q, u


def resolve_names(scene: Scene, names: Sequence[str]) -> list[str]:
    """The names in full, with the index 0 where a list of one stands without an index.

    Raises SceneError for a name that the scene does not have.
    """
    there = scene_parameters(scene)
    alone = {name.replace("[0]", ""): name for name in there}
    found = []
    for asked in names:
        meant = (name for name in scene.names.meant(asked) if name in there or name in alone)
        name = next(meant, asked)
        full = name if name in there else alone.get(name, "")
        if not full or (full != name and full.replace("[0]", "[1]") in there):
            raise _unknown(name, there)
        found.append(full)
    return found


def _unknown(name: str, known: Mapping[str, float]) -> SceneError:
    whole = [one for one in known if one.endswith(f".{name}")]
    hint = f'; did you mean "{whole[0]}"?' if whole else did_you_mean(name, known)
    return SceneError(f'parameter "{name}": there is no such number in the scene{hint}')


def _set(data: dict[str, Any], path: str, value: float) -> bool:
    parts = path.split(".")
    owners = _owners(data, parts)
    return any(_assign(owner, parts, value) for owner in owners)


def _owners(data: dict[str, Any], parts: list[str]) -> list[Any]:
    if parts[0].startswith("gravity") or (parts[0] == "constants" and len(parts) > 1):
        return [data]
    name = parts.pop(0)
    return [element for owner, element in _named(data) if owner == name]


def _assign(target: Any, parts: list[str], value: float) -> bool:
    """Write `value` at the end of the path; False where the path leads nowhere."""
    for i, part in enumerate(parts):
        match = _INDEX.fullmatch(part)
        key, index = (match[1], int(match[2])) if match else (part, None)
        if not isinstance(target, dict) or key not in target:
            return False
        holder: Any = target
        place: Any = key
        if index is None and key in ("body", "hinge") and isinstance(holder[key], list):
            return all(_assign(table, parts[i + 1 :], value) for table in holder[key])
        if isinstance(holder[key], list) and (index is not None or len(holder[key]) == 1):
            holder, place = holder[key], index or 0
            if place >= len(holder):
                return False
        elif index is not None:
            return False
        if i == len(parts) - 1 and index is None and _equal_numbers(holder[place]):
            holder[place] = [float(value)] * len(holder[place])
            return True
        if i == len(parts) - 1:
            if isinstance(holder[place], (dict, list, int)):
                return False
            holder[place] = float(value)
            return True
        target = holder[place]
    return False


def _equal_numbers(value: Any) -> bool:
    """Whether a value is a list of several numbers, all alike and none of them zero."""
    return isinstance(value, list) and len(set(map(str, value))) == 1 and bool(value[0])
