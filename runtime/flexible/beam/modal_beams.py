"""Beams of a scene as `ModalBody`: sections, frame, shapes, integrals, damping, start values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.scene.tables.beam_keys import Modes
from mstmm.scene.tables.loads import Load

from ..mass_definiteness import depends_on_count, stays_definite
from ..modal_body import ModalBody
from ..numerical_checks import checked_result
from ..support_motion import Support, Supports
from .automatic_choices import (
    BENDING,
    DirectionChoice,
    choices,
    in_the_mean,
    may_change_frame,
    warnings,
)
from .beam_data import BeamData, beam_data
from .beam_integrals import drag_moments, mass_moments, stiffness
from .boundary_conditions import BeamEnvironment, BoundaryConditions, holding
from .frame_conditions import in_frame
from .lumped_mass import mass_points
from .planar_motion import PlanarMotionCheck
from .section_ports import BeamShapes
from .shape_bases import shapes_of
from .shape_fields import DIRECTIONS, Mode

if TYPE_CHECKING:
    from mstmm.scene import Scene
    from mstmm.scene.tables.beam import Beam


class BeamBodies:
    """Beams of one scene; equal ones that are held alike are worked out once."""

    def __init__(self, scene: Scene) -> None:
        self._around, self._supports = BeamEnvironment(scene), Supports(scene)
        self._plane = (
            PlanarMotionCheck(scene) if any(beam.modes is None for beam in scene.beam) else None
        )
        self._known: dict[str, ModalBody] = {}

    def body(self, beam: Beam) -> ModalBody:
        """The numbers of one beam.  SceneError for shapes that cannot be told apart."""
        data = beam_data(beam)
        held = holding(self._around, beam, data)
        idle = self._idle(beam)
        support = self._supports.of(beam.name)
        key = repr((beam.model_copy(update={"name": ""}), held, support, sorted(idle)))
        if key not in self._known:
            self._known[key] = checked_result(
                f'beam "{beam.name}"', lambda: _made(beam, data, held, support, idle)
            )
        core = self._known[key]
        assert core.shapes is not None
        spans = {
            load.name: core.shapes.mean_section(*_span(load, data.length))
            for _, load in self._around.acts.get(beam.name, ())
            if isinstance(load, Load) and load.force_per_length is not None
        }
        said = tuple(f'beam "{beam.name}": {text}' for text in core.warnings)
        return replace(core, name=beam.name, ports={**core.ports, **spans}, warnings=said)

    def modes(self, beam: Beam) -> Modes:
        """How many shapes it has in each direction, also where the scene leaves that open."""
        data = beam_data(beam)
        chosen = choices(beam, data, holding(self._around, beam, data), self._idle(beam))
        return Modes(**{choice.direction: choice.count for choice in chosen})

    def _idle(self, beam: Beam) -> frozenset[str]:
        """Directions in which nothing moves the beam, nor buckles it before it buckles in another
        one; asked for where the shapes are "auto"."""
        if self._plane is None or beam.modes is not None:
            return frozenset()
        axes = {"y": 1, "z": 2}
        stays = [word for word, axis in axes.items() if not self._plane.leaves(beam.name, axis)]
        # A beam that nothing bends at all keeps the shapes along y, to show that it stays straight.
        if not stays or self._plane.buckles(beam.name, axes[stays[-1]]):
            return frozenset()
        return frozenset([stays[-1], "twist"])


def beam_body(scene: Scene, beam: Beam) -> ModalBody:
    """The numbers of one beam of a scene.  SceneError for shapes that cannot be told apart."""
    return BeamBodies(scene).body(beam)


def _span(load: Load, length: float) -> tuple[float, float]:
    start, end = load.span or (0.0, length)
    return start, min(end, length)


def _made(
    beam: Beam, data: BeamData, held: BoundaryConditions, support: Support, idle: frozenset[str]
) -> ModalBody:
    chosen = choices(beam, data, held, idle)
    body = _of_choices(beam, data, held, chosen, idle)
    definite = bool(beam.quadrature) or beam.model == "one-way"  # whose inertia stays as it is
    definite = definite or _stays_definite(body, held, support)
    if not definite and may_change_frame(beam, chosen):
        counted = depends_on_count(body, held.name, support, _turns(body))
        natural = body.frame if counted else ""
        body = _of_choices(beam, data, held, in_the_mean(chosen), idle)
        body = replace(body, notes=(*body.notes, *_counted(natural)), unmoved_frame=natural)
        definite = _stays_definite(body, held, support)
    if beam.quadrature or (beam.quadrature is None and not definite):
        assert body.shapes is not None
        points = mass_points(body.shapes)
        said = f"the mass sits in {len(points)} points (quadrature)"
        return replace(body, points=points, notes=(*body.notes, said))
    return body


def _counted(natural: str) -> list[str]:
    """What is said of a frame that fewer shapes would not have."""
    if not natural:
        return []
    return [
        f"with fewer shapes deflections may count from a {natural} frame; frame = "
        '"mean" keeps this one whatever their number'
    ]


def _stays_definite(body: ModalBody, held: BoundaryConditions, support: Support) -> bool:
    return stays_definite(body, body.ports[held.name], support, _turns(body))


def _turns(body: ModalBody) -> Array:
    """(m, 3, n) rotations of sections along a beam, per mode."""
    assert body.shapes is not None
    return body.shapes.at(np.linspace(0.0, body.shapes.length, 2 * body.n + 3)).theta


def _of_choices(
    beam: Beam,
    data: BeamData,
    held: BoundaryConditions,
    chosen: tuple[DirectionChoice, ...],
    idle: frozenset[str],
) -> ModalBody:
    modes: list[Mode] = []
    notes = [f"{d}: none, because the scene stays in a plane" for d in BENDING if d in idle]
    for choice in chosen:
        shapes = shapes_of(data, choice.direction, choice.basis, choice.count)
        made, said = in_frame(data, choice.direction, shapes, choice.frame)
        modes += made
        notes += [_described(choice, len(made)), *said]
    if any(c.frame.kind != "tangent" and c.direction in held.turns for c in chosen):
        notes.append(
            f'the angle of {held.said} is that of the section "{held.name}", not of the frame'
        )
    frames = [c.frame for c in chosen]
    shapes_all = BeamShapes(
        data, tuple(modes), beam.stiffening, {c.direction: c.frame for c in chosen}
    )
    body_moments = mass_moments(shapes_all)
    k = stiffness(shapes_all)
    mass = np.einsum("aakl->kl", body_moments.F)
    names = tuple(mode.name for mode in modes)
    eta, etad = _start(beam, names)
    return ModalBody(
        **vars(body_moments),
        name=beam.name,
        modes=names,
        K=k,
        D=damping(mass, k, beam.damping.ratio, beam.damping.stiffness, _blocks(modes), beam.name),
        ports={name: shapes_all.section(x, turn) for name, (x, turn) in data.ends.items()},
        drag=drag_moments(shapes_all),
        eta=eta,
        etad=etad,
        shapes=shapes_all,
        frame="/".join(dict.fromkeys(frame.kind for frame in frames)),
        notes=tuple(notes),
        warnings=warnings(chosen, held),
    )


def _described(choice: DirectionChoice, count: int) -> str:
    frame = choice.frame
    where = f" at x = {frame.x:g} m" if frame.kind == "tangent" else ""
    why = f", because {choice.why}" if choice.why and choice.why != "as asked for" else ""
    shapes = f"{count} {choice.basis.kind} shape{'s' if count != 1 else ''}"
    return f"{choice.direction}: {shapes}, frame {frame.kind}{where}{why}"


# --- damping, start -------------------------------------------------------------------------------


def damping(
    mass: Array, k: Array, ratio: tuple[float, ...], time: float, blocks: list[list[int]], name: str
) -> Array:
    """D = M V diag(2 zeta omega) V^T M + time K, with the modes V of the body itself.

    V^T M V = 1; `ratio` is one zeta for all or one per shape, of each direction's modes (`blocks`
    of indices) in the order of their frequencies.  Raises SceneError for a list that does not fit.
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
        mv = lower @ vectors
        omega = np.sqrt(np.maximum(squares, 0.0))
        part = (mv * (2 * zeta[block] * omega)) @ mv.T
        size = np.sqrt(np.diag(part))
        part = np.where(np.abs(part) <= 1e-13 * np.outer(size, size), 0.0, (part + part.T) / 2)
        d[np.ix_(block, block)] += part
    return d


def _blocks(modes: list[Mode]) -> list[list[int]]:
    """Indices of the modes of each direction."""
    found = ([i for i, m in enumerate(modes) if m.direction == d] for d in DIRECTIONS)
    return [block for block in found if block]


def _start(beam: Beam, names: tuple[str, ...]) -> tuple[Array, Array]:
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
