"""Edits of a scene: renamed references, expanded chains, loads along other axes."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from mstmm.expression.expression import Expression, Name, number, parse
from mstmm.numerics.rotations import Matrix
from mstmm.scene import Body, Chain, End, Hinge, Load, Scene, split_reference
from mstmm.scene.tables.chain import HINGE_SUFFIX
from mstmm.scene.tables.loads import MASS_CENTER

from ..model_levels import with_tables


def rename_reference(name: str, names: Mapping[str, str]) -> str:
    """New name of a body or end, or of its quantity such as "arm.tip.position"."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        reference = ".".join(parts[:count])
        if reference in names:
            return ".".join([names[reference], *parts[count:]])
    return name


def compose_names(first: Mapping[str, str], second: Mapping[str, str]) -> dict[str, str]:
    """Names after two successive renamings: former name -> last name."""
    return {**second, **{old: rename_reference(new, second) for old, new in first.items()}}


def unused_name(name: str, taken: Collection[str]) -> str:
    """The name, with underscores appended until it is not taken."""
    while name in taken:
        name += "_"
    return name


#: Keys of each table that refer to a body or end, and keys that refer to a hinge.
_PLACE_KEYS: dict[str, tuple[str, ...]] = {
    "hinge": ("inboard", "outboard"), "chain": ("inboard",), "load": ("on", "axes"),
    "spring": ("from_", "to"), "bushing": ("from_", "to"), "event": (), "output": (),
    "constraint": ("from_", "to"), "coupling": (),
}  # fmt: skip
_HINGE_KEYS: dict[str, tuple[str, ...]] = {"event": ("hinge",)}

#: Values of `axes` of a load other than the name of a body.
OWN_AXES, INERTIAL = "body", "inertial"

#: Quantities of hinges in expressions.
_HINGE_QUANTITIES = ("q", "u")


def with_references(
    scene: Scene, places: Mapping[str, str], hinges: Mapping[str, str] | None = None
) -> Scene:
    """Rename bodies, ends and hinges in references and expressions.

    The tables of these elements keep their names.
    """
    names = (places, hinges or {})
    return with_tables(
        scene,
        **{
            table: tuple(
                _rename_in_element(element, table, names) for element in getattr(scene, table)
            )
            for table in _PLACE_KEYS
        },
    )


def _rename_in_element(
    element: Any, table: str, names: tuple[Mapping[str, str], Mapping[str, str]]
) -> Any:
    update: dict[str, Any] = {}
    for keys, new_names in ((_PLACE_KEYS[table], names[0]), (_HINGE_KEYS.get(table, ()), names[1])):
        for key in keys:
            old = getattr(element, key)
            if (
                old is not None
                and old not in (OWN_AXES, INERTIAL)
                and rename_reference(old, new_names) != old
            ):
                update[key] = rename_reference(old, new_names)
    renamed = _rename_in_value(element, names)
    return renamed.model_copy(update=update) if update else renamed


def _rename_in_value(value: Any, names: tuple[Mapping[str, str], Mapping[str, str]]) -> Any:
    """Rename in the expressions of a value; returns the same object if nothing changes."""
    if isinstance(value, Expression):
        return _rename_in_expression(value, names)
    if isinstance(value, tuple):
        renamed = tuple(_rename_in_value(item, names) for item in value)
        return renamed if any(a is not b for a, b in zip(renamed, value, strict=True)) else value
    if hasattr(type(value), "model_fields"):
        old = {key: getattr(value, key) for key in type(value).model_fields}
        new = {key: _rename_in_value(item, names) for key, item in old.items()}
        changed = {key: item for key, item in new.items() if item is not old[key]}
        return value.model_copy(update=changed) if changed else value
    return value


def _rename_in_expression(
    expression: Expression, names: tuple[Mapping[str, str], Mapping[str, str]]
) -> Expression:
    text = expression.text
    names_by_position: dict[int, Name] = {
        term.name.position: term.name
        for term in expression.terms
        if term.name is not None and len(term.name.parts) > 1
    }
    for position, name in sorted(names_by_position.items(), reverse=True):
        old = ".".join(name.parts)
        new = rename_reference(old, names[1 if name.quantity in _HINGE_QUANTITIES else 0])
        text = text[:position] + new + text[position + len(old) :]
    if text == expression.text:
        return expression
    return parse(text, constants=dict(expression.constants))


# --- chains ---------------------------------------------------------------------------------------

#: Chains with more members are not expanded.
MAX_MEMBERS = 100


@dataclass(frozen=True)
class Member:
    """Names of the body and the hinge of a chain member, in the chain and when expanded."""

    body: str
    hinge: str
    new_body: str
    new_hinge: str


@dataclass(frozen=True)
class ExpandedScene:
    """Scene with expanded chains.

    Attributes:
        scene: the new scene.
        names: body, end or hinge of a chain -> its name in the new scene.
        descriptions: a sentence for each chain.
    """

    scene: Scene
    names: Mapping[str, str] = field(default_factory=dict)
    descriptions: tuple[str, ...] = ()


def expandable_chains(scene: Scene) -> tuple[Chain, ...]:
    """Chains with few enough members to be expanded."""
    return tuple(chain for chain in scene.chain if chain.count <= MAX_MEMBERS)


def chain_members(scene: Scene, chain: Chain) -> Iterator[Member]:
    """Members of a chain; their new names do not depend on which chains are expanded."""
    taken = {body.name for body in scene.skeleton.body} | {hinge.name for hinge in scene.hinge}
    taken |= {chain.name for chain in scene.chain}
    for k in range(chain.count):
        member = f"{chain.name}[{k}]"
        body, hinge = (
            unused_name(name, taken)
            for name in (f"{chain.name}_{k}", f"{chain.name}_{k}_{HINGE_SUFFIX}")
        )
        yield Member(member, f"{member}.{HINGE_SUFFIX}", body, hinge)


def expand_chains(scene: Scene, chains: Collection[Chain]) -> ExpandedScene:
    """Expand these chains into separate bodies and hinges, which can be changed individually.

    "rope[3]" becomes "rope_3", its hinge "rope[3].hinge" becomes "rope_3_hinge".
    """
    if not chains:
        return ExpandedScene(scene)
    place_names: dict[str, str] = {}
    hinge_names: dict[str, str] = {}
    bodies: list[Body] = []
    hinges: list[Hinge] = []
    words = []
    for chain in chains:
        members = list(chain_members(scene, chain))
        last_name = f"{chain.name}[last]"
        for member in members:
            body = scene.bodies.by_name[member.body]
            bodies.append(body.model_copy(update={"name": member.new_body}))
            update = {"name": member.new_hinge, "outboard": member.new_body}
            hinges.append(scene.hinges.by_name[member.hinge].model_copy(update=update))
            for name in (member.body, *([last_name] if member is members[-1] else ())):
                hinge_names[f"{name}.{HINGE_SUFFIX}"] = member.new_hinge
                place_names[name] = member.new_body
                place_names |= {f"{name}.{end}": f"{member.new_body}.{end}" for end in body.ends}
        first, last = members[0], members[-1]
        words.append(
            f'chain "{chain.name}": expanded into bodies {first.new_body} to {last.new_body} with '
            f"hinges {first.new_hinge} to {last.new_hinge}"
        )
    expanded_names = {chain.name for chain in chains}
    other_chains = tuple(chain for chain in scene.chain if chain.name not in expanded_names)
    expanded = with_tables(
        scene, body=(*scene.body, *bodies), hinge=(*scene.hinge, *hinges), chain=other_chains
    )
    renamed = with_references(expanded, place_names, hinge_names)
    return ExpandedScene(renamed, {**place_names, **hinge_names}, tuple(words))


# --- loads of a body that becomes part of another one ---------------------------------------------

Entries = tuple[Expression, ...]


def with_load_axes(scene: Scene, removed_body: str, axes: str, rotation: Matrix) -> Scene:
    """Express loads along the axes of a removed body along other `axes`.

    `rotation` (3, 3) is the orientation of the axes of the removed body in the new ones.
    """

    def body_of_axes(load: Load) -> str:
        return split_reference(load.on)[0] if load.axes == OWN_AXES else load.axes

    def rotated(load: Load) -> Load:
        update: dict[str, Any] = {"axes": axes}
        for key in ("force", "moment"):
            update[key] = tuple(_combined_component(row, getattr(load, key)) for row in rotation)
        return load.model_copy(update=update)

    return with_tables(
        scene,
        load=tuple(
            rotated(load) if body_of_axes(load) == removed_body else load for load in scene.load
        ),
    )


def with_ends_at_mass_centers(scene: Scene) -> Scene:
    """Move loads at mass centres of welded bodies to new ends at the same points.

    The mass centre of a merged body is another point; the ends remain.
    """
    welded = {e for h in scene.hinge if h.is_weld for e in (h.inboard_body, h.outboard_body)}
    loaded = {load.on for load in scene.load if load.at == MASS_CENTER} & welded
    if not loaded:
        return scene
    ends = {
        body.name: unused_name(MASS_CENTER, body.ends) for body in scene.body if body.name in loaded
    }
    return with_tables(
        scene,
        body=tuple(
            body.model_copy(
                update={"ends": {**body.ends, ends[body.name]: End(position=body.center_of_mass)}}
            ) if body.name in ends else body for body in scene.body
        ),
        load=tuple(
            load.model_copy(update={"on": f"{load.on}.{ends[load.on]}", "at": None})
            if load.at == MASS_CENTER and load.on in ends else load for load in scene.load
        ),
    )  # fmt: skip


def _combined_component(row: Sequence[float], entries: Entries) -> Expression:
    """Component of a vector along another axis: sum of row[k] * entries[k]."""
    terms = [
        (factor, entry) for factor, entry in zip(row, entries, strict=True)
        if factor != 0 and not entry.is_zero
    ]  # fmt: skip
    if not terms:
        return number(0)
    if len(terms) == 1 and terms[0][0] == 1:
        return terms[0][1]
    constants = {name: value for _, entry in terms for name, value in entry.constants}
    text = " + ".join(f"({factor!r})*({entry.text})" for factor, entry in terms)
    return parse(text, constants=constants)
