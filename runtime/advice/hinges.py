"""Hinges that may be rigid, and springs that may be left out, by what they did in a run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.expression.expression import number
from mstmm.ir.facts import builtin_hinges
from mstmm.numbers.rotations import about, product, to_quaternion
from mstmm.scene import Hinge, Scene
from mstmm.scene.tables.law import Law

from ..chart.models import with_tables

if TYPE_CHECKING:
    from ..engine.compiled import Compiled

#: Coordinates nearer to zero than this part of the scene's length count as zero.
_AT_REST = 1e-9

#: The keys of a law that are left out together.
_PASSIVE = ("stiffness", "rest", "damping", "friction")


@dataclass(frozen=True)
class Change:
    """One thing that may be done to a scene.

    Attributes:
        what: hinge or spring, with its name.
        words: what is done, and the figures that speak for it.
        expected: m, how far it may displace what is fixed there; 0 where nothing is known.
        hinge, spring: name of what is changed; the new hinge, None for a spring that is left out.
    """

    what: str
    words: str
    expected: float
    name: str
    hinge: Hinge | None = None

    def __str__(self) -> str:
        return f"{self.what}: {self.words}"


def applied(scene: Scene, changes: Sequence[Change]) -> Scene:
    """The scene with these changes."""
    hinges = {one.name: one.hinge for one in changes if one.hinge is not None}
    springs = {one.name for one in changes if one.hinge is None}
    return with_tables(
        scene,
        hinge=tuple(hinges.get(one.name, one) for one in scene.hinge),
        spring=tuple(one for one in scene.spring if one.name not in springs),
    )


# --- rigid ----------------------------------------------------------------------------------------


def rigid(scene: Scene, model: Compiled, q: Array, reach: float) -> list[Change]:
    """Hinges made rigid where they stood in a run of `model`, whose coordinates are q (n, nq);
    least motion first.  `reach` (m) is how far a rotation of 1 rad displaces what is behind it.
    """
    found: list[Change] = []
    for hinge in scene.hinge:
        known = next((one for one in model.scene.hinge if one.name == hinge.name), None)
        facts = hinge.builtin
        if facts is None or facts.welds or known is None or known.type != hinge.type:
            continue
        if hinge.drive is not None or _released(scene, hinge):
            continue
        own = q[:, model.layout.hinges[hinge.name].q_slice]
        change = _turned(hinge, own, reach) if facts.quaternion is not None else None
        if facts.quaternion is None and facts.straight:
            change = _straight(hinge, own, reach)
        if change is not None:
            found.append(change)
    return sorted(found, key=lambda one: one.expected)


def _released(scene: Scene, hinge: Hinge) -> bool:
    return hinge.lets_go or any(event.hinge == hinge.name for event in scene.event)


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
        turned = product(hinge.rotation, about(hinge.unit_axis, float(middle[0])))
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
    """Springs, dampers and friction of hinges, and springs between bodies, each left out."""
    found = []
    for hinge in scene.hinge:
        if hinge.builtin is not None and hinge.drive is None and _acts(hinge.law):
            law = hinge.law.model_copy(
                update={key: getattr(_nothing(hinge), key) for key in _PASSIVE}
            )
            made = hinge.model_copy(update={"law": law})
            acting = " and ".join(_acting(hinge.law))
            words = f"without its {acting}, which hardly matters"
            found.append(Change(f'hinge "{hinge.name}"', words, 0.0, hinge.name, made))
    found += [
        Change(f'spring "{one.name}"', "left out, for it hardly matters", 0.0, one.name)
        for one in scene.spring
    ]
    return found


def _acts(law: Law) -> bool:
    return next(_acting(law), None) is not None


def _acting(law: Law) -> Iterator[str]:
    if any(law.stiffness):
        yield "spring"
    if any(law.damping):
        yield "damper"
    if any(one.acts for one in law.friction):
        yield "friction"


def _nothing(hinge: Hinge) -> Law:
    """A law that does nothing, with as many entries as the hinge has speeds."""
    facts = hinge.builtin
    assert facts is not None
    neutral, count = Law().entry(0), len(facts.speeds)
    return Law().model_copy(
        update={key: (getattr(neutral, key),) * count for key in Law.model_fields}
    )
