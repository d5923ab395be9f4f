"""How a scene holds a beam and what it loads it with: what frames and bases are chosen from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from mstmm.scene_flexible_checks import free_axes
from mstmm.scene_rules import GROUND, split

from .beam_data import BeamData
from .modal_body import Array
from .static_shapes import stiffness_of

if TYPE_CHECKING:
    from mstmm.scene import Scene
    from mstmm.scene_beam import Beam
    from mstmm.scene_parts import Hinge

#: Deflection along y turns the section about z, along z about y, and twist turns it about x.
AXES = {"y": (0.0, 0.0, 1.0), "z": (0.0, 1.0, 0.0), "twist": (1.0, 0.0, 0.0)}
#: So much of an axis must lie among the free ones for a hinge to leave the rotation free.
MOSTLY = 0.7
#: A mass beyond an end is heavy from this share of the beam's mass on, a rotor at the held end from
#: this share of the beam's inertia about it, a spring from this share of the beam's own stiffness.
HEAVY = 0.1

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class End:
    """What acts at one section: moments per direction, and whether a heavy load does."""

    x: float
    moments: frozenset[str] = frozenset()
    heavy: bool = False


@dataclass(frozen=True)
class Holding:
    """How a beam is held: at `x` by a hinge that leaves `turns` (directions) free and translations
    if `moves`; `sprung` are the directions among them in which a spring or rotor resists."""

    name: str  #: end by which it is held
    x: float
    turns: frozenset[str]
    moves: bool
    heavy_rotor: frozenset[str] = frozenset()
    sprung: frozenset[str] = frozenset()
    ends: tuple[End, ...] = ()
    said: str = ""  #: the hinge in words
    other_sections: Mapping[str, float] = field(default_factory=dict)


def holding(scene: Scene, beam: Beam, data: BeamData) -> Holding:
    """Read from the hinges, springs and loads of the scene; a beam without hinge floats."""
    ends = tuple(_ends(scene, beam, data))
    hinge = next((h for h in scene.hinge if h.outboard_body == beam.name), None)
    if hinge is None:
        return Holding("root", 0.0, frozenset(AXES), True, ends=ends, said="no hinge")
    at = hinge.outboard_end or "root"
    x, turn = data.ends[at]
    free = _directions(turn, free_axes(hinge))
    stiff, rotors = _resisted(hinge, data)
    return Holding(
        at,
        x,
        free,
        hinge.type in ("free", "planar", "elastic"),
        heavy_rotor=free if rotors else frozenset(),
        sprung=free if stiff else frozenset(),
        ends=ends,
        said=f'{hinge.type} hinge "{hinge.name}"',
    )


def _directions(turn: Array, axes: tuple[Vector, ...]) -> frozenset[str]:
    """The directions whose rotation lies among free axes given in the axes of the end."""
    if not axes:
        return frozenset()
    span, values, _ = np.linalg.svd(turn @ np.array(axes).T, full_matrices=False)
    span = span[:, values > 1e-9]
    return frozenset(
        word for word, axis in AXES.items() if np.linalg.norm(span.T @ np.array(axis)) > MOSTLY
    )


def _resisted(hinge: Hinge, data: BeamData) -> tuple[bool, bool]:
    """(springs, rotors) that matter beside the beam's own stiffness and inertia."""
    bending = min(stiffness_of(data, "y").min(), stiffness_of(data, "z").min()) / data.length
    inertia = data.mass * data.length**2 / 3
    law = hinge.law
    rotary = slice(3, None) if hinge.type in ("free", "elastic") else slice(None)
    stiffness = max(law.stiffness[rotary], default=0.0)
    return stiffness > HEAVY * bending, max(law.inertia[rotary], default=0.0) > HEAVY * inertia


# --- what acts at the other sections --------------------------------------------------------------


def _ends(scene: Scene, beam: Beam, data: BeamData) -> Iterator[End]:
    for hinge in scene.hinge:
        name, end = split(hinge.inboard)
        if name == beam.name:
            x, turn = data.ends[end or "root"]
            back = np.array(hinge.rotation)
            free = _directions(turn @ back, free_axes(hinge))
            if any(hinge.law.stiffness) or any(hinge.law.inertia) or _acts(hinge):
                free = frozenset()
            carried = frozenset(AXES) - free
            yield End(x, carried, _mass_beyond(scene, hinge.outboard_body) > HEAVY * data.mass)
    for chain in scene.chain:
        name, end = split(chain.inboard)
        if name == beam.name:
            yield End(data.ends[end or "root"][0], frozenset(AXES), True)
    own = 3 * min(stiffness_of(data, "y").min(), stiffness_of(data, "z").min()) / data.length**3
    for spring in scene.spring:
        for reference in (spring.from_, spring.to):
            name, end = split(reference)
            if name == beam.name:
                heavy = spring.type != "spring" or spring.law.stiffness > HEAVY * own
                yield End(data.ends[end or "root"][0], frozenset(), heavy)
    for load in scene.load:
        name, end = split(load.on)
        if name == beam.name and load.force_per_length is None:
            turning = any(not m.is_zero for m in load.moment)
            yield End(data.ends[end or "root"][0], frozenset(AXES if turning else ()), False)


def _acts(hinge: Hinge) -> bool:
    """A drive or an effort: a moment whatever the beam does."""
    driven = hinge.drive is not None and any(d is not None for d in hinge.drive)
    return driven or any(not e.is_zero for e in hinge.law.effort)


def _mass_beyond(scene: Scene, body: str) -> float:
    """Mass of a body and of all that hangs on it; infinite where a user's type hides it."""
    children: dict[str, list[str]] = {}
    for hinge in scene.hinge:
        children.setdefault(hinge.inboard_body, []).append(hinge.outboard_body)
    masses = {b.name: b.mass if b.type == "rigid" else np.inf for b in scene.body}
    masses |= {b.name: b.mass for b in scene.beam}
    carries_chain = {split(chain.inboard)[0] for chain in scene.chain}
    total, waiting, seen = 0.0, [body], {GROUND}
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        total += np.inf if name in carries_chain else masses.get(name, np.inf)
        waiting += children.get(name, [])
    return total
