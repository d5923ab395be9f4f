"""Chains written out: their members as bodies and hinges of their own, which may be changed alone.

"rope[3]" becomes "rope_3", its hinge "rope[3].hinge" becomes "rope_3_hinge".
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field

from mstmm.scene import Body, Chain, Hinge, Scene
from mstmm.scene.tables.chain import HINGE_SUFFIX

from ...chart.model_levels import with_tables
from .reference_renaming import with_names

#: Chains of more members stay chains.
MOST = 100


@dataclass(frozen=True)
class Member:
    """A member of a chain: its body and its hinge as they are called there, and their new names."""

    body: str
    hinge: str
    new_body: str
    new_hinge: str


@dataclass(frozen=True)
class ExpandedScene:
    """A scene with chains written out.

    Attributes:
        scene: the new one.
        names: places and hinges of the chains -> their names in it.
        words: a sentence for each chain.
    """

    scene: Scene
    names: Mapping[str, str] = field(default_factory=dict)
    words: tuple[str, ...] = ()


def short(scene: Scene) -> tuple[Chain, ...]:
    """Chains with few enough members to be written out."""
    return tuple(chain for chain in scene.chain if chain.count <= MOST)


def members(scene: Scene, chain: Chain) -> Iterator[Member]:
    """The members of a chain, whatever else is written out."""
    taken = {one.name for one in scene.skeleton.body} | {one.name for one in scene.hinge}
    taken |= {one.name for one in scene.chain}
    for k in range(chain.count):
        old = f"{chain.name}[{k}]"
        body, hinge = (
            _unused(name, taken)
            for name in (f"{chain.name}_{k}", f"{chain.name}_{k}_{HINGE_SUFFIX}")
        )
        yield Member(old, f"{old}.{HINGE_SUFFIX}", body, hinge)


def _unused(name: str, taken: Collection[str]) -> str:
    while name in taken:
        name += "_"
    return name


def expand_chains(scene: Scene, chains: Collection[Chain]) -> ExpandedScene:
    """The scene with these chains as bodies and hinges."""
    if not chains:
        return ExpandedScene(scene)
    places: dict[str, str] = {}
    hinges: dict[str, str] = {}
    own_bodies: list[Body] = []
    own_hinges: list[Hinge] = []
    words = []
    for chain in chains:
        row = list(members(scene, chain))
        last = f"{chain.name}[last]"
        for one in row:
            body = scene.bodies.by_name[one.body]
            own_bodies.append(body.model_copy(update={"name": one.new_body}))
            named = {"name": one.new_hinge, "outboard": one.new_body}
            own_hinges.append(scene.hinges.by_name[one.hinge].model_copy(update=named))
            for old in (one.body, *([last] if one is row[-1] else ())):
                hinges[f"{old}.{HINGE_SUFFIX}"] = one.new_hinge
                places[old] = one.new_body
                places |= {f"{old}.{end}": f"{one.new_body}.{end}" for end in body.ends}
        words.append(
            f'chain "{chain.name}": bodies of their own, {row[0].new_body} to '
            f"{row[-1].new_body}, on {row[0].new_hinge} to {row[-1].new_hinge}"
        )
    gone = {chain.name for chain in chains}
    kept = tuple(chain for chain in scene.chain if chain.name not in gone)
    made = with_tables(
        scene, body=(*scene.body, *own_bodies), hinge=(*scene.hinge, *own_hinges), chain=kept
    )
    return ExpandedScene(with_names(made, places, hinges), {**places, **hinges}, tuple(words))
