"""How a scene holds a beam and what it loads it with: what frames and bases are chosen from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene.checks.flexible_bodies import free_axes
from mstmm.scene.checks.topology import inboard_hinges_by_body
from mstmm.scene.tables.bushing import Bushing
from mstmm.scene.tables.loads import Load, Spring
from mstmm.scene.validators.scalars_and_vectors import split_reference

from .beam_data import BeamData
from .restraint import restrained_beams
from .static_shapes import stiffness_of

if TYPE_CHECKING:
    from mstmm.scene import Chain, Scene
    from mstmm.scene.tables.beam import Beam
    from mstmm.scene.tables.hinge import Hinge

    _Acting = Chain | Spring | Bushing | Load

#: Deflection along y turns the section about z, along z about y, and twist turns it about x.
AXES = {"y": (0.0, 0.0, 1.0), "z": (0.0, 1.0, 0.0), "twist": (1.0, 0.0, 0.0)}
#: So much of an axis must lie among the free ones for a hinge to leave the rotation free.
MOSTLY = 0.7
#: A mass beyond an end is heavy from this share of the beam's mass on, a rotor at the held end from
#: this share of the beam's inertia about it, a spring from this share of the beam's own stiffness.
HEAVY = 0.1

#: What a force at a section loads besides bending, which needs no static shapes for it.
_ALONG = ("axial",)

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class End:
    """What acts at one section: directions that are loaded so that they need static shapes (by
    moments, and axially by forces), and whether a heavy load does."""

    x: float
    moments: frozenset[str] = frozenset()
    heavy: bool = False


@dataclass(frozen=True)
class BoundaryConditions:
    """How a beam is held: at `x` by a hinge that leaves `turns` (directions) free and translations
    if `moves`; among them heavy rotors resist in some, springs or motors act in `sprung` ones."""

    name: str  #: end by which it is held
    x: float
    turns: frozenset[str]
    moves: bool
    heavy_rotor: frozenset[str] = frozenset()
    sprung: frozenset[str] = frozenset()
    ends: tuple[End, ...] = ()
    said: str = ""  #: the hinge in words
    restrained: bool = False  #: the rest of the scene holds its length


class BeamEnvironment:
    """What acts on which body of a scene, found once for all its beams."""

    def __init__(self, scene: Scene) -> None:
        self.holds = inboard_hinges_by_body(scene)
        #: Hinges that close loops, by the bodies that others hold.
        self.closes: dict[str, list[Hinge]] = {}
        for hinge in scene.hinge:
            if self.holds.get(hinge.outboard_body) is not hinge:
                self.closes.setdefault(hinge.outboard_body, []).append(hinge)
        self.carries: dict[str, list[Hinge]] = {}
        for hinge in scene.hinge:
            self.carries.setdefault(hinge.inboard_body, []).append(hinge)
        self.acts: dict[str, list[tuple[str, _Acting]]] = {}
        acting: list[_Acting] = [*scene.chain, *scene.forces, *scene.load]
        for element in acting:
            for reference in _references(element):
                name, end = split_reference(reference)
                self.acts.setdefault(name, []).append((end or "root", element))
        self._masses = {b.name: b.mass if b.type == "rigid" else np.inf for b in scene.body}
        self._masses |= {b.name: b.mass for b in scene.beam}
        for name in _tied(scene, self.closes):
            self._masses[name] = np.inf
        self.restrained = restrained_beams(scene)
        self._beyond: dict[str, float] = {}

    def mass_beyond(self, body: str) -> float:
        """Mass of a body and of all that hangs on it; infinite where that is not known."""
        waiting = [body]
        while waiting:
            name = waiting[-1]
            children = [
                hinge.outboard_body for hinge in self.carries.get(name, ())
                if self.holds.get(hinge.outboard_body) is hinge
            ]  # fmt: skip
            missing = [child for child in children if child not in self._beyond]
            if missing:
                waiting += missing
                continue
            waiting.pop()
            own = self._masses.get(name, np.inf)
            self._beyond[name] = own + sum(self._beyond[child] for child in children)
        return self._beyond[body]


def _tied(scene: Scene, closes: Mapping[str, list[Hinge]]) -> Iterator[str]:
    """Bodies that carry what their mass does not tell: loops, chains, springs and constraints."""
    for body, hinges in closes.items():
        yield from (body, *(hinge.inboard_body for hinge in hinges))
    yield from (split_reference(chain.inboard)[0] for chain in scene.chain)
    for element in (*scene.forces, *scene.constraint):
        yield from (split_reference(element.from_)[0], split_reference(element.to)[0])


def _references(element: _Acting) -> tuple[str, ...]:
    """The bodies and ends that an element acts on."""
    if isinstance(element, Load):
        return (element.on,)
    if isinstance(element, (Spring, Bushing)):
        return (element.from_, element.to)
    return (element.inboard,)


def holding(around: BeamEnvironment, beam: Beam, data: BeamData) -> BoundaryConditions:
    """Read from the hinges, springs and loads of the scene; every beam is held by one hinge."""
    ends = tuple(sorted(set(_ends(around, beam, data)), key=lambda end: end.x))
    hinge = around.holds[beam.name]
    at = hinge.outboard_end or "root"
    x, turn = data.ends[at]
    free = _directions(turn, free_axes(hinge))
    stiff, rotors = _resisted(hinge, data)
    return BoundaryConditions(
        at,
        x,
        free,
        hinge.facts is not None and hinge.facts.goes_anywhere,
        heavy_rotor=free if rotors else frozenset(),
        sprung=free if stiff or any(not e.is_zero for e in hinge.law.effort) else frozenset(),
        ends=ends,
        said=f"the {hinge.type} hinge",
        restrained=beam.name in around.restrained,
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


def _softest(data: BeamData) -> float:
    """The least bending stiffness of the two planes, N m^2."""
    return float(min(stiffness_of(data, "y").min(), stiffness_of(data, "z").min()))


def _resisted(hinge: Hinge, data: BeamData) -> tuple[bool, bool]:
    """(springs, rotors) that matter beside the beam's own stiffness and inertia."""
    bending = _softest(data) / data.length
    inertia = data.mass * data.length**2 / 3
    stiffness, rotors = (_about_axes(hinge, key) for key in ("stiffness", "inertia"))
    return stiffness > HEAVY * bending, rotors > HEAVY * inertia


def _about_axes(hinge: Hinge, key: str) -> float:
    """The largest entry of a hinge's law among those of speeds that turn."""
    values = getattr(hinge.law, key)
    if len(values) > 1 and hinge.facts is not None:
        values = [values[k] for k in hinge.facts.turns]
    return float(max(values, default=0.0))


# --- what acts at the other sections --------------------------------------------------------------


def _ends(around: BeamEnvironment, beam: Beam, data: BeamData) -> Iterator[End]:
    for hinge in around.carries.get(beam.name, ()):
        x, turn = data.ends[hinge.inboard_end or "root"]
        free = _directions(turn @ np.array(hinge.rotation), free_axes(hinge))
        if any(hinge.law.stiffness) or any(hinge.law.inertia) or _acts(hinge):
            free = frozenset()
        closes = around.holds.get(hinge.outboard_body) is not hinge
        heavy = closes or around.mass_beyond(hinge.outboard_body) > HEAVY * data.mass
        yield End(x, frozenset(AXES) - free, heavy)
    for hinge in around.closes.get(beam.name, ()):
        x, turn = data.ends[hinge.outboard_end or "root"]
        free = frozenset() if _acts(hinge) else _directions(turn, free_axes(hinge))
        yield End(x, frozenset(AXES) - free, True)
    for end, element in around.acts.get(beam.name, ()):
        x = data.ends[end][0]
        if isinstance(element, Load):
            if element.force_per_length is None:
                turning = any(not m.is_zero for m in element.moment)
                pulling = any(not f.is_zero for f in element.force)
                yield End(x, frozenset([*(AXES if turning else ()), *_ALONG[:pulling]]))
        elif isinstance(element, Spring):
            yield End(x, frozenset(_ALONG), _is_stiff(element, data))
        elif isinstance(element, Bushing):
            along, about = element.stiffest
            yield End(x, frozenset(AXES if about else ()), along > HEAVY * _own_stiffness(data))
        else:
            yield End(x, frozenset(AXES), True)


def _is_stiff(spring: Spring, data: BeamData) -> bool:
    """Stiff beside the beam as a cantilever, or of a user's type."""
    return spring.type != "spring" or spring.law.stiffness > HEAVY * _own_stiffness(data)


def _own_stiffness(data: BeamData) -> float:
    """Of the tip of the beam as a cantilever, N/m."""
    return 3 * _softest(data) / data.length**3


def _acts(hinge: Hinge) -> bool:
    """A drive or an effort: a moment whatever the beam does."""
    driven = hinge.drive is not None and any(d is not None for d in hinge.drive)
    return driven or any(not e.is_zero for e in hinge.law.effort)
