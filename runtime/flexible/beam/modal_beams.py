"""Beams of a scene as `ModalBody`: frame, shapes, integrals, damping, initial values."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.scene.tables.beam import EXACT, ROOT, Modes
from mstmm.scene.tables.flexible_keys import AUTO
from mstmm.scene.tables.loads import Load

from ..mass_definiteness import is_definite_with_first_shape, is_mass_definite
from ..modal_body import ModalBody, checked_result
from ..modal_parts import CacheKey
from ..supports import Support, Supports
from .automatic_choices import (
    BENDING,
    DirectionChoice,
    can_use_mean_frame,
    direction_choices,
    in_mean_frame,
    missing_static_shapes,
)
from .beam_data import BeamData, beam_data
from .beam_integrals import drag_moments, mass_moments, mass_points, stiffness
from .boundary_conditions import BeamEnvironment, BoundaryConditions, boundary_conditions
from .exact_beam import LEGENDRE, STRAIN_MODES, ExactBeamSetting, exact_beam_body
from .frame_conditions import modes_in_frame
from .planar_motion import PlanarMotionCheck
from .section_ports import BeamShapes
from .shape_bases import basis_shapes
from .shape_fields import DIRECTIONS, Mode

if TYPE_CHECKING:
    from mstmm.scene import Scene
    from mstmm.scene.tables.beam import Beam


#: What determines the body of a beam.
_Source = tuple["Beam", BeamData, BoundaryConditions, Support, frozenset[str]]
#: Default numbers of strain shapes of an exact beam, per bending plane and of twist.
_BENDING_COUNT, _TWIST_COUNT = 3, 2
#: Largest number of bodies kept, for equal beams of this and of later scenes.
_MAX_CACHED_BODIES = 64


class BeamBodies:
    """Beams of one scene; equal beams with equal boundary conditions are computed once."""

    def __init__(self, scene: Scene) -> None:
        self._environment, self._supports = BeamEnvironment(scene), Supports(scene)
        self._plane = (
            PlanarMotionCheck(scene) if any(beam.modes is None for beam in scene.beam) else None
        )

    def body(self, beam: Beam) -> ModalBody:
        """Modal body of one beam.  Raises SceneError for linearly dependent shapes."""
        data = beam_data(beam)
        if beam.kinematics == EXACT:
            return self._exact_body(beam, data)
        conditions = boundary_conditions(self._environment, beam, data)
        idle = self._idle_directions(beam)
        support = self._supports.support_of(beam.name)
        key = (
            repr(beam.model_copy(update={"name": ""})), repr(conditions), idle,
            support.motion.tobytes(), support.inertia.tobytes(),
        )  # fmt: skip
        body = _cached_body(CacheKey(key, (beam, data, conditions, support, idle)))
        assert body.shapes is not None
        spans = {
            load.name: body.shapes.mean_section(*_span(load, data.length))
            for _, load in self._environment.load_elements.get(beam.name, ())
            if isinstance(load, Load) and load.force_per_length is not None
        }
        messages = tuple(f'beam "{beam.name}": {text}' for text in body.warnings)
        return replace(body, name=beam.name, ports={**body.ports, **spans}, warnings=messages)

    def _exact_body(self, beam: Beam, data: BeamData) -> ModalBody:
        hinge = self._environment.inboard_hinges[beam.name]
        inboard_end = hinge.outboard_end or ROOT
        spans = {
            load.name: _span(load, data.length)
            for _, load in self._environment.load_elements.get(beam.name, ())
            if isinstance(load, Load) and load.force_per_length is not None
        }
        setting = ExactBeamSetting(
            data, dict(zip(DIRECTIONS, self.modes(beam).counts, strict=True)),
            self._exact_basis(beam), self._supports.inboard_hinge_support(beam.name), inboard_end,
            {end: self._supports.outboard_inertia(beam.name, end) for end in data.ends}, spans,
        )  # fmt: skip
        what = f'beam "{beam.name}"'
        body = checked_result(what, lambda: exact_beam_body(beam, setting))
        blocks = _name_blocks(body.modes)
        eta, etad = _initial_modal_state(beam, body.modes)
        d = damping(body.Mff, body.K, beam.damping.ratio, beam.damping.stiffness, blocks, beam.name)
        return replace(body, D=body.D + d, eta=eta, etad=etad)

    def _exact_basis(self, beam: Beam) -> str:
        """Basis of an exact beam; "auto" is Legendre if a load, spring or loop acts on an end."""
        if beam.basis != AUTO:
            return beam.basis
        environment = self._environment
        acting = environment.load_elements.get(beam.name, ())
        is_loaded = any(getattr(element, "force_per_length", None) is None for _, element in acting)
        closes = any(
            environment.inboard_hinges.get(hinge.outboard_body) is not hinge
            for hinge in environment.outboard_hinges.get(beam.name, ())
        )
        is_loaded = is_loaded or closes or beam.name in environment.cut_hinges
        return LEGENDRE if is_loaded else STRAIN_MODES

    def modes(self, beam: Beam) -> Modes:
        """Number of shapes of a beam by direction, also where the scene leaves it open."""
        if beam.kinematics == EXACT:
            return self._exact_modes(beam)
        data = beam_data(beam)
        conditions = boundary_conditions(self._environment, beam, data)
        chosen = direction_choices(beam, data, conditions, self._idle_directions(beam))
        return Modes(**{choice.direction: choice.count for choice in chosen})

    def _exact_modes(self, beam: Beam) -> Modes:
        """Three shapes in each plane that the beam can leave, and two of twist where it can."""
        if beam.modes is not None:
            return beam.modes
        idle = self._idle_directions(beam)
        counts = {d: 0 if d in idle else _BENDING_COUNT for d in BENDING}
        section = beam.sections[0]
        can_twist = None not in (section.torsional_stiffness, section.polar_inertia_per_length)
        if can_twist and all(counts.values()):
            counts["twist"] = _TWIST_COUNT
        return Modes(**counts)

    def _idle_directions(self, beam: Beam) -> frozenset[str]:
        """Directions without load and without buckling before another one, for modes = "auto"."""
        if self._plane is None or beam.modes is not None:
            return frozenset()
        axes = {"y": 1, "z": 2}
        planar = [d for d, axis in axes.items() if not self._plane.leaves(beam.name, axis)]
        # A beam without any bending load keeps the shapes along y, so that its results show zeros.
        if not planar or self._plane.buckles(beam.name, axes[planar[-1]]):
            return frozenset()
        return frozenset([planar[-1], "twist"])


def beam_body(scene: Scene, beam: Beam) -> ModalBody:
    """Modal body of one beam of a scene.  Raises SceneError for linearly dependent shapes."""
    return BeamBodies(scene).body(beam)


def _span(load: Load, length: float) -> tuple[float, float]:
    start, end = load.span or (0.0, length)
    return start, min(end, length)


@lru_cache(maxsize=_MAX_CACHED_BODIES)
def _cached_body(source: CacheKey[_Source]) -> ModalBody:
    beam = source.value[0]
    return checked_result(f'beam "{beam.name}"', lambda: _beam_body(*source.value))


def _beam_body(
    beam: Beam,
    data: BeamData,
    conditions: BoundaryConditions,
    support: Support,
    idle: frozenset[str],
) -> ModalBody:
    chosen = direction_choices(beam, data, conditions, idle)
    body = _body_of_choices(beam, data, conditions, chosen, idle)
    is_definite = bool(beam.quadrature) or beam.model == "one-way"  # inertia does not depend on eta
    is_definite = is_definite or _stays_definite(body, conditions, support)
    if not is_definite and can_use_mean_frame(beam, chosen):
        rotations = _section_rotations(body)
        fewer_suffice = is_definite_with_first_shape(body, conditions.name, support, rotations)
        natural = body.frame if fewer_suffice else ""
        body = _body_of_choices(beam, data, conditions, in_mean_frame(chosen), idle)
        body = replace(body, notes=(*body.notes, *_frame_notes(natural)), unmoved_frame=natural)
        is_definite = _stays_definite(body, conditions, support)
    if beam.quadrature or (beam.quadrature is None and not is_definite):
        assert body.shapes is not None
        points = mass_points(body.shapes)
        note = f"the mass is lumped in {len(points)} points (quadrature)"
        return replace(body, points=points, notes=(*body.notes, note))
    return body


def _frame_notes(natural_frame: str) -> list[str]:
    """Note on a mean frame that fewer shapes would not need."""
    if not natural_frame:
        return []
    return [
        f"with fewer shapes deflections may refer to a {natural_frame} frame; give frame = "
        '"mean" to keep this one for any number of shapes'
    ]


def _stays_definite(body: ModalBody, held: BoundaryConditions, support: Support) -> bool:
    return is_mass_definite(body, body.ports[held.name], support, _section_rotations(body))


def _section_rotations(body: ModalBody) -> Array:
    """Rotation vectors (m, 3, n) of sections along a beam per mode, rad."""
    assert body.shapes is not None
    return body.shapes.values_at(np.linspace(0.0, body.shapes.length, 2 * body.n + 3)).theta


def _body_of_choices(
    beam: Beam,
    data: BeamData,
    conditions: BoundaryConditions,
    chosen: tuple[DirectionChoice, ...],
    idle: frozenset[str],
) -> ModalBody:
    modes: list[Mode] = []
    notes = [f"{d}: none, because the scene stays in a plane" for d in BENDING if d in idle]
    for choice in chosen:
        shapes = basis_shapes(data, choice.direction, choice.basis, choice.count)
        direction_modes, shape_notes = modes_in_frame(data, choice.direction, shapes, choice.frame)
        modes += direction_modes
        notes += [_choice_note(choice, len(direction_modes)), *shape_notes]
    if any(c.frame.kind != "tangent" and c.direction in conditions.free_rotations for c in chosen):
        notes.append(
            f"the angle of {conditions.hinge_text} is that of the section "
            f'"{conditions.name}", not of the frame'
        )
    frames = [c.frame for c in chosen]
    shapes_all = BeamShapes(
        data, tuple(modes), beam.stiffening, {c.direction: c.frame for c in chosen}
    )
    body_moments = mass_moments(shapes_all)
    k = stiffness(shapes_all)
    mass = np.einsum("aakl->kl", body_moments.F)
    names = tuple(mode.name for mode in modes)
    ratio = beam.damping.ratio
    eta, etad = _initial_modal_state(beam, names)
    return ModalBody(
        **vars(body_moments),
        name=beam.name,
        modes=names,
        K=k,
        D=damping(mass, k, ratio, beam.damping.stiffness, _name_blocks(names), beam.name),
        ports={name: shapes_all.section(x, rotation) for name, (x, rotation) in data.ends.items()},
        drag=drag_moments(shapes_all),
        eta=eta,
        etad=etad,
        shapes=shapes_all,
        frame="/".join(dict.fromkeys(frame.kind for frame in frames)),
        notes=tuple(notes),
        warnings=missing_static_shapes(chosen, conditions),
    )


def _choice_note(choice: DirectionChoice, count: int) -> str:
    frame = choice.frame
    where = f" at x = {frame.x:g} m" if frame.kind == "tangent" else ""
    why = f", because {choice.reason}" if choice.reason else ""
    shapes = f"{count} {choice.basis.kind} shape{'s' if count != 1 else ''}"
    return f"{choice.direction}: {shapes}, frame {frame.kind}{where}{why}"


# --- damping, start -------------------------------------------------------------------------------


def damping(
    mass: Array, k: Array, ratio: tuple[float, ...], time: float, blocks: list[list[int]], name: str
) -> Array:
    """Damping matrix D = M V diag(2 zeta omega) V^T M + time K, with the modes V of the body.

    V^T M V = 1.  `ratio` is one zeta for all or one per shape, for the modes of each direction
    (`blocks` of indices) in ascending order of frequency.  Raises SceneError for a list of another
    length.
    """
    n = len(k)
    if len(ratio) not in (1, n):
        raise SceneError(
            f'beam "{name}": damping: expected one modal damping ratio, or {n}, one per shape, '
            f"found {len(ratio)}"
        )
    zeta = np.broadcast_to(np.asarray(ratio, dtype=float), (n,))
    d = time * k
    for block in blocks:
        if not zeta[block].any():
            continue
        m = mass[np.ix_(block, block)]
        lower = np.linalg.cholesky(m)
        reduced = np.linalg.solve(lower, np.linalg.solve(lower, k[np.ix_(block, block)]).T)
        squares, vectors = np.linalg.eigh((reduced + reduced.T) / 2)
        weighted = lower @ vectors
        omega = np.sqrt(np.maximum(squares, 0.0))
        part = (weighted * (2 * zeta[block] * omega)) @ weighted.T
        scale = np.sqrt(np.diag(part))
        part = np.where(np.abs(part) <= 1e-13 * np.outer(scale, scale), 0.0, (part + part.T) / 2)
        d[np.ix_(block, block)] += part
    return d


def _name_blocks(names: tuple[str, ...]) -> list[list[int]]:
    """Indices of the modes by direction, from their names."""
    blocks = ([i for i, name in enumerate(names) if name.startswith(d)] for d in DIRECTIONS)
    return [block for block in blocks if block]


def _initial_modal_state(beam: Beam, names: tuple[str, ...]) -> tuple[Array, Array]:
    values = []
    for key in ("eta", "etad"):
        given = getattr(beam.initial, key)
        if given is not None and len(given) != len(names):
            raise SceneError(
                f'beam "{beam.name}": initial.{key}: expected {len(names)} numbers, one per shape '
                f"({', '.join(names[:8])}), found {len(given)}"
            )
        values.append(np.zeros(len(names)) if given is None else np.asarray(given, dtype=float))
    return values[0], values[1]
