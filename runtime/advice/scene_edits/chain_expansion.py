"""Expand chains into separate bodies and hinges, which can be changed individually.

"rope[3]" becomes "rope_3", its hinge "rope[3].hinge" becomes "rope_3_hinge".
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field

from mstmm.scene import Body, Chain, Hinge, Scene
from mstmm.scene.tables.chain import HINGE_SUFFIX

from ...chart.model_levels import with_tables
from .reference_renaming import with_references

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
            _unused_name(name, taken)
            for name in (f"{chain.name}_{k}", f"{chain.name}_{k}_{HINGE_SUFFIX}")
        )
        yield Member(member, f"{member}.{HINGE_SUFFIX}", body, hinge)


def _unused_name(name: str, taken: Collection[str]) -> str:
    while name in taken:
        name += "_"
    return name


def expand_chains(scene: Scene, chains: Collection[Chain]) -> ExpandedScene:
    """Expand these chains into bodies and hinges."""
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
