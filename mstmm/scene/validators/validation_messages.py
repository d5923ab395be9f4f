"""Messages for validation errors: one line per problem with file, element, key, remedy."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from ...errors import SceneError
from .scalars_and_vectors import Location, Rule, Shorthand, ValidationProblems, describe_value

MAX_MESSAGE_LINES = 10
#: Most problems collected, so that a file with errors in every element fails within seconds.
MAX_PROBLEMS = 60
#: Most names compared for suggestions, and most candidates among them.
_MAX_SUGGESTION_OPTIONS, _MAX_SUGGESTION_CANDIDATES = 2000, 20
#: Least similarity of a suggestion, from 0 to 1, of the whole name and of the part that differs.
_MIN_SIMILARITY = 0.6
#: Keys reserved for future releases, with their planned content.
RESERVED_KEYS = dict.fromkeys(("thermal", "temperature"), "thermal data")
RESERVED_KEYS |= dict.fromkeys(("import", "imports", "include"), "imports")

#: Other keys that users try for closed loops.
_LOOP_KEYS = ("loop", "loops", "closure", "closures", "joint", "joints")

#: The lists of tables of a scene.
TABLES = (
    "input", "signal", "output", "controller", "body", "hinge", "chain", "beam", "elastic",
    "load", "event", "spring", "bushing", "constraint", "coupling", "shape",
)  # fmt: skip

Problem = tuple[Location, str]


def did_you_mean(name: str, options: Iterable[str]) -> str:
    """Suggestion '; did you mean "x"?', or a list of the options where none is similar."""
    choices = list(dict.fromkeys(islice(options, _MAX_SUGGESTION_OPTIONS)))
    options_by_lower_case = {option.lower(): option for option in reversed(choices)}
    candidates = difflib.get_close_matches(
        name.lower(), options_by_lower_case, n=_MAX_SUGGESTION_CANDIDATES, cutoff=_MIN_SIMILARITY
    )
    for candidate in candidates:
        if _are_similar(name.lower(), candidate):
            return f'; did you mean "{options_by_lower_case[candidate]}"?'
    if not choices:
        return "; none is defined"
    if len(choices) > 12:
        return f"; for example {', '.join(choices[:5])}"
    if len(choices) == 1:
        return f"; the only one is {choices[0]}"
    return "; use one of " + ", ".join(choices)


def _are_similar(name: str, option: str) -> bool:
    """Whether names are similar without common parts such as an owner or a file suffix."""
    name_parts, option_parts = name.split("."), option.split(".")
    for end in (0, -1):
        while min(len(name_parts), len(option_parts)) > 1 and name_parts[end] == option_parts[end]:
            del name_parts[end], option_parts[end]
    return (
        difflib.SequenceMatcher(None, ".".join(name_parts), ".".join(option_parts)).ratio()
        >= _MIN_SIMILARITY
    )


def scene_error(
    error: ValidationError, model: type[BaseModel], data: Any, where: str
) -> SceneError:
    """SceneError for a scene that pydantic rejected."""
    return build_scene_error(
        list(islice(iterate_problems(error, model), MAX_PROBLEMS)), data, where
    )


def build_scene_error(found_problems: Sequence[Problem], data: Any, where: str) -> SceneError:
    """SceneError with one line per problem, at most MAX_LINES; `data` gives element names."""
    unique = list(dict.fromkeys(found_problems))
    lines = [
        f"{where}: {message_line(location, message, data)}"
        for location, message in unique[:MAX_MESSAGE_LINES]
    ]
    if len(unique) > MAX_MESSAGE_LINES:
        more_count = "many" if len(unique) >= MAX_PROBLEMS else len(unique) - MAX_MESSAGE_LINES
        lines.append(f"{where}: and {more_count} more problems")
    return SceneError("\n".join(lines))


def iterate_problems(error: ValidationError, model: type[BaseModel]) -> Iterator[Problem]:
    """Yield every problem of a validation error with its location."""
    for item in error.errors(include_url=False):
        location: Location = tuple(item["loc"])
        cause = item.get("ctx", {}).get("error")
        if isinstance(cause, ValidationProblems):
            for inner, message in cause.problems:
                yield (*location, *inner), message
        else:
            yield location, _message_for(item, location, model)


def _message_for(item: Mapping[str, Any], place: Location, model: type[BaseModel]) -> str:
    """Message for an error that pydantic itself found."""
    if item["type"] == "missing":
        return f"missing; expected {_expected_value(model, place)}"
    if item["type"] == "extra_forbidden":
        return _unknown_key_message(str(place[-1]), _model_at(model, place[:-1]), place)
    return f"expected {_expected_value(model, place)}, found {describe_value(item['input'])}"


#: Keys of bodies and hinges that members of a chain do not have, with the remedy.
_CHAIN_KEY_REMEDIES = {
    "name": 'members of a chain are named automatically, as in "rope[3]"; leave it out',
    "inboard": "each member is connected to the one before, the first to inboard of the chain; "
    "leave it out",
    "outboard": "the hinge of a member is at the origin of its body; leave it out",
    "position": "the position belongs to the chain; leave it out here",
    "release": "members of a chain cannot be released; define this hinge as a [[hinge]]",
    "cut": "hinges of a chain are never cut; leave it out",
    "hold": "initial values of chain members always apply; define this hinge as a [[hinge]]",
}


#: Symbols and synonyms that users try for keys of beams and hinges.
_KEY_SYNONYMS = {
    "EI": "bending_stiffness", "EA": "axial_stiffness", "GJ": "torsional_stiffness",
    "GIt": "torsional_stiffness", "rhoA": "mass_per_length", "mu": "mass_per_length",
    "rhoI": "rotary_inertia", "kGA": "shear_stiffness", "GA": "shear_stiffness",
    "mass": "mass_per_length", "L": "length", "E": "young", "nu": "poisson", "rho": "density",
    "parent": "inboard", "child": "outboard",
}  # fmt: skip


def _unknown_key_message(key: str, model: type[BaseModel], place: Location) -> str:
    if len(place) == 5 and place[0] == "chain" and key in _CHAIN_KEY_REMEDIES:
        return _CHAIN_KEY_REMEDIES[key]
    if key in RESERVED_KEYS:
        return f"{RESERVED_KEYS[key]} are planned for a later release; leave {key} out"
    if key in _LOOP_KEYS and len(place) == 1:
        return "unknown key; use [[hinge]]: a second inboard hinge of a body closes a loop"
    if key == "units" and len(place) == 1:
        return (
            "unknown key; scenes are in m, kg, s, N and rad; convert the numbers and leave it out"
        )
    keys = [f.alias or name for name, f in model.model_fields.items()]
    if _KEY_SYNONYMS.get(key) in keys:
        return f'unknown key; did you mean "{_KEY_SYNONYMS[key]}"?'
    parent_key = next((name for name in keys if key in _keys_of_inner_table(model, name)), None)
    if parent_key is not None:
        return f"unknown key; write it inside {parent_key}, as in {parent_key} = {{ {key} = ... }}"
    return f"unknown key{did_you_mean(key, keys)}"


def _keys_of_inner_table(model: type[BaseModel], name: str) -> Iterable[str]:
    """Keys of the table that is the value of a key; none where the value is no single table."""
    inner = model.model_fields[name].annotation if name in model.model_fields else None
    return inner.model_fields if isinstance(inner, type) and issubclass(inner, BaseModel) else ()


def _expected_value(model: type[BaseModel], place: Location) -> str:
    """Expected value of the key at `place`, from the annotation of its field."""
    parent = _model_at(model, place[:-1]) if place else model
    key = place[-1] if place else ""
    for name, info in parent.model_fields.items():
        if key not in (name, info.alias):
            continue
        for mark in info.metadata:
            if isinstance(mark, (Rule, Shorthand)):
                return mark.expected
        if "tuple" in str(info.annotation):
            names = ".".join(part for part in place if isinstance(part, str))
            return f"a list of tables; write [[{names}]]"
    return "a table"


def _model_at(model: type[BaseModel], place: Location) -> type[BaseModel]:
    """Model class of the table at `place`."""
    current = model
    for part in place:
        for name, info in current.model_fields.items():
            if part in (name, info.alias):
                current = _inner_model(info.annotation) or current
    return current


def _inner_model(annotation: Any) -> type[BaseModel] | None:
    """First model class inside an annotation such as tuple[Body, ...]."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for part in get_args(annotation):
        inner = _inner_model(part)
        if inner is not None:
            return inner
    return None


def message_line(place: Location, message: str, data: Any) -> str:
    """Line of a message with its location: 'hinge "shoulder": axis: message'."""
    parts = list(place)
    label = ""
    if len(parts) >= 2 and parts[0] in TABLES and isinstance(parts[1], int):
        table, index = str(parts.pop(0)), int(parts.pop(0))
        label = f"{table} {_element_name(data, table, index)}: "
    key = "".join(f"[{x}]" if isinstance(x, int) else f".{_key_text(x)}" for x in parts)
    key = key.removeprefix(".")
    return f"{label}{key}: {message}" if key else f"{label}{message}"


def _key_text(part: str) -> str:
    is_plain = part.isascii() and part.replace("_", "").isalnum() and len(part) <= 64
    return part if is_plain else describe_value(part)


def _element_name(data: Any, table: str, index: int) -> str:
    """Name of an element in quotes, or its number in the file."""
    try:
        element = data[table][index]
        name = element["name"] if isinstance(element, dict) else element.name
    except (KeyError, IndexError, TypeError, AttributeError):
        name = None
    if isinstance(name, str) and name.isprintable() and 0 < len(name) <= 64:
        return f'"{name}"'
    return f"number {index + 1}"
