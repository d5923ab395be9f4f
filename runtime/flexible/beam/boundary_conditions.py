"""Boundary conditions and loads of a beam in its scene, for the choice of frames and bases."""

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
from .planar_motion import restrained_beams
from .static_shapes import direction_stiffness

if TYPE_CHECKING:
    from mstmm.scene import Chain, Scene
    from mstmm.scene.tables.beam import Beam
    from mstmm.scene.tables.hinge import Hinge

    _LoadElement = Chain | Spring | Bushing | Load

#: Axis of the rotation of a section by direction: bending along y rotates it about z.
AXES = {"y": (0.0, 0.0, 1.0), "z": (0.0, 1.0, 0.0), "twist": (1.0, 0.0, 0.0)}
#: Least component along the free axes of a hinge for which a rotation counts as free.
MOSTLY = 0.7
#: Share of the beam's mass, inertia or stiffness above which a body outboard of an end, a rotor at
#: the inboard end or a spring counts as heavy or stiff.
HEAVY_MASS_RATIO = 0.1

#: Direction that a force at a section loads besides bending.
_ALONG = ("axial",)

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class End:
    """Loads at one section of a beam.

    `moments` are the directions that need static shapes: loaded by moments, or axially by forces;
    `is_heavy` says whether a heavy body or stiff element acts there.
    """

    x: float
    moments: frozenset[str] = frozenset()
    is_heavy: bool = False


@dataclass(frozen=True)
class BoundaryConditions:
    """Inboard hinge of a beam at `x` (m), and the loads on its ends.

    The hinge leaves the rotations `free_rotations` (directions) free, and translations if
    `has_free_translation`.  Heavy rotors resist the rotations `heavy_rotor_rotations`; springs or
    motors act in those of `spring_rotations`.
    """

    name: str  #: inboard end
    x: float
    free_rotations: frozenset[str]
    has_free_translation: bool
    heavy_rotor_rotations: frozenset[str] = frozenset()
    spring_rotations: frozenset[str] = frozenset()
    ends: tuple[End, ...] = ()
    hinge_text: str = ""  #: description of the hinge, for messages
    is_length_restrained: bool = False  #: the rest of the scene constrains its length


class BeamEnvironment:
    """Hinges, loads and outboard masses by body of a scene, computed once for all its beams."""

    def __init__(self, scene: Scene) -> None:
        self.inboard_hinges = inboard_hinges_by_body(scene)
        #: Cut hinges by outboard body, whose inboard hinge is another one.
        self.cut_hinges: dict[str, list[Hinge]] = {}
        for hinge in scene.hinge:
            if self.inboard_hinges.get(hinge.outboard_body) is not hinge:
                self.cut_hinges.setdefault(hinge.outboard_body, []).append(hinge)
        self.outboard_hinges: dict[str, list[Hinge]] = {}
        for hinge in scene.hinge:
            self.outboard_hinges.setdefault(hinge.inboard_body, []).append(hinge)
        self.load_elements: dict[str, list[tuple[str, _LoadElement]]] = {}
        acting: list[_LoadElement] = [*scene.chain, *scene.forces, *scene.load]
        for element in acting:
            for reference in _loaded_ends(element):
                name, end = split_reference(reference)
                self.load_elements.setdefault(name, []).append((end or "root", element))
        self._masses = {b.name: b.mass if b.type == "rigid" else np.inf for b in scene.body}
        self._masses |= {b.name: b.mass for b in scene.beam}
        for name in _coupled_bodies(scene, self.cut_hinges):
            self._masses[name] = np.inf
        self.restrained = restrained_beams(scene)
        self._outboard_masses: dict[str, float] = {}

    def outboard_mass(self, body: str) -> float:
        """Mass (kg) of a body and of all bodies outboard of it; infinite if not known."""
        pending = [body]
        while pending:
            name = pending[-1]
            children = [
                hinge.outboard_body for hinge in self.outboard_hinges.get(name, ())
                if self.inboard_hinges.get(hinge.outboard_body) is hinge
            ]  # fmt: skip
            missing = [child for child in children if child not in self._outboard_masses]
            if missing:
                pending += missing
                continue
            pending.pop()
            own = self._masses.get(name, np.inf)
            outboard = sum(self._outboard_masses[child] for child in children)
            self._outboard_masses[name] = own + outboard
        return self._outboard_masses[body]


def _coupled_bodies(scene: Scene, closes: Mapping[str, list[Hinge]]) -> Iterator[str]:
    """Bodies whose loads exceed those of their outboard mass, as in loops and chains."""
    for body, hinges in closes.items():
        yield from (body, *(hinge.inboard_body for hinge in hinges))
    yield from (split_reference(chain.inboard)[0] for chain in scene.chain)
    for element in (*scene.forces, *scene.constraint):
        yield from (split_reference(element.from_)[0], split_reference(element.to)[0])


def _loaded_ends(element: _LoadElement) -> tuple[str, ...]:
    """References of the bodies and ends that an element acts on."""
    if isinstance(element, Load):
        return (element.on,)
    if isinstance(element, (Spring, Bushing)):
        return (element.from_, element.to)
    return (element.inboard,)


def boundary_conditions(
    environment: BeamEnvironment, beam: Beam, data: BeamData
) -> BoundaryConditions:
    """Boundary conditions of a beam, from the hinges, springs and loads of the scene."""
    ends = tuple(sorted(set(_end_loads(environment, beam, data)), key=lambda end: end.x))
    hinge = environment.inboard_hinges[beam.name]
    name = hinge.outboard_end or "root"
    x, rotation = data.ends[name]
    free = _free_directions(rotation, free_axes(hinge))
    is_sprung, has_heavy_rotor = _has_stiff_spring_or_rotor(hinge, data)
    return BoundaryConditions(
        name,
        x,
        free,
        hinge.facts is not None and hinge.facts.is_free,
        heavy_rotor_rotations=free if has_heavy_rotor else frozenset(),
        spring_rotations=free
        if is_sprung or any(not e.is_zero for e in hinge.law.effort)
        else frozenset(),
        ends=ends,
        hinge_text=f"the {hinge.type} hinge",
        is_length_restrained=beam.name in environment.restrained,
    )


def _free_directions(rotation: Array, axes: tuple[Vector, ...]) -> frozenset[str]:
    """Directions of a beam whose rotation is free, for free axes in the axes of the end."""
    if not axes:
        return frozenset()
    basis, values, _ = np.linalg.svd(rotation @ np.array(axes).T, full_matrices=False)
    basis = basis[:, values > 1e-9]
    return frozenset(
        direction
        for direction, axis in AXES.items()
        if np.linalg.norm(basis.T @ np.array(axis)) > MOSTLY
    )


def _lowest_bending_stiffness(data: BeamData) -> float:
    """Lowest bending stiffness of both planes, N m^2."""
    return float(min(direction_stiffness(data, "y").min(), direction_stiffness(data, "z").min()))


def _has_stiff_spring_or_rotor(hinge: Hinge, data: BeamData) -> tuple[bool, bool]:
    """Whether a spring, and whether a rotor of the hinge is significant for the beam."""
    bending = _lowest_bending_stiffness(data) / data.length
    inertia = data.mass * data.length**2 / 3
    stiffness, rotor_inertia = (
        _largest_rotational_entry(hinge, key) for key in ("stiffness", "inertia")
    )
    return stiffness > HEAVY_MASS_RATIO * bending, rotor_inertia > HEAVY_MASS_RATIO * inertia


def _largest_rotational_entry(hinge: Hinge, key: str) -> float:
    """Largest entry of a hinge law among its rotational speeds."""
    values = getattr(hinge.law, key)
    if len(values) > 1 and hinge.facts is not None:
        values = [values[k] for k in hinge.facts.turns]
    return float(max(values, default=0.0))


# --- loads at the other sections ------------------------------------------------------------------


def _end_loads(environment: BeamEnvironment, beam: Beam, data: BeamData) -> Iterator[End]:
    for hinge in environment.outboard_hinges.get(beam.name, ()):
        x, rotation = data.ends[hinge.inboard_end or "root"]
        free = _free_directions(rotation @ np.array(hinge.rotation), free_axes(hinge))
        if any(hinge.law.stiffness) or any(hinge.law.inertia) or _is_driven(hinge):
            free = frozenset()
        closes = environment.inboard_hinges.get(hinge.outboard_body) is not hinge
        heavy = (
            closes or environment.outboard_mass(hinge.outboard_body) > HEAVY_MASS_RATIO * data.mass
        )
        yield End(x, frozenset(AXES) - free, heavy)
    for hinge in environment.cut_hinges.get(beam.name, ()):
        x, rotation = data.ends[hinge.outboard_end or "root"]
        free = frozenset() if _is_driven(hinge) else _free_directions(rotation, free_axes(hinge))
        yield End(x, frozenset(AXES) - free, True)
    for end, element in environment.load_elements.get(beam.name, ()):
        x = data.ends[end][0]
        if isinstance(element, Load):
            if element.force_per_length is None:
                has_moment = any(not m.is_zero for m in element.moment)
                has_force = any(not f.is_zero for f in element.force)
                yield End(x, frozenset([*(AXES if has_moment else ()), *_ALONG[:has_force]]))
        elif isinstance(element, Spring):
            yield End(x, frozenset(_ALONG), _is_stiff(element, data))
        elif isinstance(element, Bushing):
            along, about = element.stiffest
            yield End(
                x,
                frozenset(AXES if about else ()),
                along > HEAVY_MASS_RATIO * _cantilever_stiffness(data),
            )
        else:
            yield End(x, frozenset(AXES), True)


def _is_stiff(spring: Spring, data: BeamData) -> bool:
    """Whether a spring is stiff against the beam as a cantilever, or of a user-defined type."""
    return (
        spring.type != "spring"
        or spring.law.stiffness > HEAVY_MASS_RATIO * _cantilever_stiffness(data)
    )


def _cantilever_stiffness(data: BeamData) -> float:
    """Stiffness of the tip of the beam as a cantilever, N/m."""
    return 3 * _lowest_bending_stiffness(data) / data.length**3


def _is_driven(hinge: Hinge) -> bool:
    """Whether a hinge has a drive or an effort, which act whatever the motion of the beam."""
    is_driven = hinge.drive is not None and any(d is not None for d in hinge.drive)
    return is_driven or any(not e.is_zero for e in hinge.law.effort)
