"""Hinges that may be rigid, and springs that may be left out, by what they did in a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from mstmm.array_validation import Array
from mstmm.expression.expression import number
from mstmm.ir.hinge_properties import builtin_hinges
from mstmm.numerics.rotations import product, rotation_about, to_quaternion
from mstmm.scene import Chain, Hinge, Scene
from mstmm.scene.tables.hinge import HingeTable
from mstmm.scene.tables.law import Law

from ..chart.model_levels import with_tables
from .scene_edits.chain_expansion import ExpandedScene, expand_chains, members, short

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

T = TypeVar("T", bound=HingeTable)

#: Coordinates nearer to zero than this part of the scene's length count as zero.
_AT_REST = 1e-9

#: The keys of a law that are left out together.
_PASSIVE = ("stiffness", "rest", "damping", "friction")


@dataclass(frozen=True)
class Change:
    """One thing that may be done to a scene.

    Attributes:
        what: hinge, chain or spring, with its name.
        words: what is done, and the figures that speak for it.
        expected: m, how far it may displace what is fixed there; 0 where nothing is known.
        name: of what is changed; of a chain's member the one that it gets.
        made: the new hinge or chain, None for a spring that is left out.
        parts: what may be done where this is too much.
    """

    what: str
    words: str
    expected: float
    name: str
    made: Hinge | Chain | None = None
    parts: tuple[Change, ...] = ()

    def __str__(self) -> str:
        return f"{self.what}: {self.words}"


def apply_changes(scene: Scene, changes: Sequence[Change]) -> ExpandedScene:
    """The scene with these changes; chains of which members are changed are written out."""
    made = {one.name: one.made for one in changes if isinstance(one.made, Hinge)}
    chains = {one.name: one.made for one in changes if isinstance(one.made, Chain)}
    springs = {one.name for one in changes if one.made is None}
    whole = with_tables(
        scene,
        chain=tuple(chains.get(one.name, one) for one in scene.chain),
        spring=tuple(one for one in scene.spring if one.name not in springs),
    )
    touched = [
        chain for chain in short(whole) if any(m.new_hinge in made for m in members(whole, chain))
    ]
    found = expand_chains(whole, touched)
    hinges = tuple(made.get(one.name, one) for one in found.scene.hinge)
    return replace(found, scene=with_tables(found.scene, hinge=hinges))


def _hinges(scene: Scene) -> Iterator[tuple[str, Hinge]]:
    """Every hinge with the name that it has in the scene; members of chains as they are written
    out."""
    yield from ((hinge.name, hinge) for hinge in scene.hinge)
    chains = short(scene)
    written = expand_chains(scene, chains).scene.hinge
    known = {one.name: one for one in written[len(scene.hinge) :]}
    for chain in chains:
        yield from ((one.hinge, known[one.new_hinge]) for one in members(scene, chain))


# --- rigid ----------------------------------------------------------------------------------------


def rigid(scene: Scene, model: CompiledScene, q: Array, reach: float) -> list[Change]:
    """Hinges made rigid where they stood in a run of `model`, whose coordinates are q (n, nq);
    least motion first.  `reach` (m) is how far a rotation of 1 rad displaces what is behind it.
    """
    found: list[Change] = []
    released = {event.hinge for event in scene.event}
    for name, hinge in _hinges(scene):
        known = model.scene.hinges.by_name.get(name)
        facts = hinge.builtin
        if facts is None or facts.welds or known is None or known.type != hinge.type:
            continue
        if hinge.drive is not None or hinge.lets_go or name in released:
            continue
        own = q[:, model.layout.hinges[name].q_slice]
        change = _turned(hinge, own, reach) if facts.quaternion is not None else None
        if facts.quaternion is None and facts.straight:
            change = _straight(hinge, own, reach)
        if change is not None:
            found.append(replace(change, what=f'hinge "{name}"'))
    return sorted(found, key=lambda one: one.expected)


def _straight(hinge: Hinge, own: Array, reach: float) -> Change:
    """A hinge without quaternion, at the middle of what its coordinates went through."""
    facts = hinge.builtin
    assert facts is not None
    low, high = own.min(axis=0), own.max(axis=0)
    middle, half = (low + high) / 2, (high - low) / 2
    arms = [reach if one.unit == "rad" else 1.0 for one in facts.coordinates]
    expected = float(np.max(half * arms, initial=0.0))
    places = ", ".join(
        f"{one.name} {value:.3g} {one.unit}"
        for one, value in zip(facts.coordinates, middle, strict=True)
    )
    words = f"rigid at {places}, from which it moves by {np.max(half, initial=0.0):.1e} at most"
    if facts.in_place and not np.any(np.abs(middle) * arms > _AT_REST * reach):
        made = _weld(hinge, to_quaternion(hinge.rotation))
    elif facts.axial and facts.turns and not facts.slides:
        turned = product(hinge.rotation, rotation_about(hinge.unit_axis, float(middle[0])))
        made = _weld(hinge, to_quaternion(turned))
    else:
        drive = tuple(number(float(value)) for value in middle)
        made = hinge.model_copy(update={"drive": drive, "initial": None, "law": _nothing(hinge)})
    return Change(f'hinge "{hinge.name}"', words, expected, hinge.name, made)


def _turned(hinge: Hinge, own: Array, reach: float) -> Change | None:
    """A hinge with a quaternion that stays near to where both of its ends are one."""
    facts = hinge.builtin
    assert facts is not None
    if facts.quaternion is None or len(facts.slides) not in (0, 3) or facts.frame != "own":
        return None
    vector = own[:, facts.quaternion + 1 : facts.quaternion + 4]
    angle = 2 * float(np.arcsin(np.clip(np.linalg.norm(vector, axis=1), 0, 1)).max(initial=0.0))
    far = float(np.linalg.norm(own[:, : facts.quaternion], axis=1).max(initial=0.0))
    words = f"rigid, for it moves by {far:.1e} m and {angle:.1e} rad"
    made = _weld(hinge, to_quaternion(hinge.rotation))
    return Change(f'hinge "{hinge.name}"', words, far + reach * angle, hinge.name, made)


def _weld(hinge: Hinge, orientation: Sequence[float]) -> Hinge:
    """A fixed hinge at the same place."""
    kind = next(name for name, facts in builtin_hinges().items() if facts.welds)
    return Hinge(
        name=hinge.name, type=kind, inboard=hinge.inboard, outboard=hinge.outboard,
        orientation=tuple(orientation), position=hinge.position,
    )  # fmt: skip


# --- left out -------------------------------------------------------------------------------------


def needless(scene: Scene) -> list[Change]:
    """Springs, dampers and friction of hinges, and springs between bodies, each left out; of a
    chain those of all its hinges, or of each."""
    rows = {chain.name: [one.hinge for one in members(scene, chain)] for chain in short(scene)}
    of_chains = {name for row in rows.values() for name in row}
    found = {
        name: Change(
            f'hinge "{name}"', _without(_acting(hinge.law)), 0.0, hinge.name, _slack(hinge)
        )
        for name, hinge in _hinges(scene)
        if _acts(hinge)
    }
    changes = [one for name, one in found.items() if name not in of_chains]
    for chain in scene.chain:
        if any(_acts(one) for one in chain.hinge):
            made = chain.model_copy(
                update={"hinge": tuple(_slack(h) if _acts(h) else h for h in chain.hinge)}
            )
            acting = dict.fromkeys(word for hinge in chain.hinge for word in _acting(hinge.law))
            words = _without(acting)
            parts = [found[name] for name in rows.get(chain.name, ()) if name in found]
            changes.append(
                Change(f'chain "{chain.name}"', words, 0.0, chain.name, made, tuple(parts))
            )
    changes += [
        Change(f'spring "{one.name}"', "left out, for it hardly matters", 0.0, one.name)
        for one in scene.spring
    ]
    return changes


def _slack(hinge: T) -> T:
    """A hinge without springs, dampers and friction."""
    update = {key: getattr(_nothing(hinge), key) for key in _PASSIVE}
    return hinge.model_copy(update={"law": hinge.law.model_copy(update=update)})


def _without(acting: Iterable[str]) -> str:
    return f"without its {' and '.join(acting)}, which hardly matters"


def _acts(hinge: HingeTable) -> bool:
    return (
        hinge.builtin is not None
        and hinge.drive is None
        and next(_acting(hinge.law), None) is not None
    )


def _acting(law: Law) -> Iterator[str]:
    if any(law.stiffness):
        yield "spring"
    if any(law.damping):
        yield "damper"
    if any(one.acts for one in law.friction):
        yield "friction"


def _nothing(hinge: HingeTable) -> Law:
    """A law that does nothing, with as many entries as the hinge has speeds."""
    facts = hinge.builtin
    assert facts is not None
    neutral, count = Law().entry(0), len(facts.speeds)
    return Law().model_copy(
        update={key: (getattr(neutral, key),) * count for key in Law.model_fields}
    )
