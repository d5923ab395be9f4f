"""Wireframe of a scene: bodies from hinge to ends, beams along their axes, springs.

Displacements are those of the linear model: every point moves along a straight line, by the scaled
difference of two adjacent poses.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene import split_reference

from ...engine.looped_engine import Probe
from ...result.flexible import motion as observe

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

#: Number of speeds of a hinge without constraints.
_FREE = 6
#: Number of points along a beam.
_FINE = 61
#: Largest perturbation of a coordinate between adjacent poses: rounding and curvature are small.
_STEP = 1e-6


@dataclass(frozen=True)
class Outline:
    """Lines of a scene in m, inertial axes.

    `bodies` and `springs` are lines (m, 3), `joints` (k, 3) the hinge positions on outboard bodies,
    `ground` (k, 3) those of hinges on the ground.
    """

    bodies: list[Array]
    springs: list[Array]
    joints: Array
    ground: Array

    @property
    def points(self) -> Array:
        """Points (n, 3) of all lines, joints and ground hinges, m."""
        return np.concatenate([*self.bodies, *self.springs, self.joints, self.ground])

    def displace(self, outline: Outline, scale: float) -> Outline:
        """Outline with every point moved by `scale` times its displacement to the other outline."""

        def displace_points(points: Array, there: Array) -> Array:
            return points + scale * (there - points)

        def displace_lines(lines: list[Array], there: list[Array]) -> list[Array]:
            return [displace_points(*pair) for pair in zip(lines, there, strict=True)]

        return Outline(
            displace_lines(self.bodies, outline.bodies),
            displace_lines(self.springs, outline.springs),
            displace_points(self.joints, outline.joints),
            displace_points(self.ground, outline.ground),
        )  # fmt: skip


def deformed_outlines(
    linear: LinearEquations, shapes: Array, part: float
) -> tuple[Outline, list[Outline]]:
    """Outline at the operating point, and outlines displaced by each of the real shapes (n, k).

    The largest displacement of a point is `part` times the size of the scene.
    """
    rest, near, scales = _small_displacements(linear, shapes, _steps(shapes), part)
    return rest, [
        rest.displace(outline, scale) for outline, scale in zip(near, scales, strict=True)
    ]


def amplitudes(linear: LinearEquations, shapes: Array, part: float) -> Array:
    """Factors (k,) of real shapes (n, k) for a largest displacement of `part` times the size.

    0 where no point moves.
    """
    steps = _steps(shapes)
    return steps * np.array(_small_displacements(linear, shapes, steps, part)[2])


def _steps(shapes: Array) -> Array:
    return _STEP / np.maximum(np.abs(shapes).max(axis=0, initial=0), 1e-300)


def _small_displacements(
    linear: LinearEquations, shapes: Array, steps: Array, part: float
) -> tuple[Outline, list[Outline], list[float]]:
    """Outline at the operating point, outlines displaced by small steps, and scale factors.

    A scale factor enlarges the largest displacement to `part` times the size of the scene.
    """
    states = [linear.state.q, *(linear.displaced_state(x) for x in (shapes * steps).T)]
    rest, *near = outlines(linear, np.array(states))
    size = float(np.linalg.norm(np.ptp(rest.points, axis=0)))
    largest = [
        float(np.linalg.norm(outline.points - rest.points, axis=1).max()) for outline in near
    ]
    scales = [
        part * (size or 1.0) / far if far > _MIN_DISPLACEMENT * _STEP * size else 0.0
        for far in largest
    ]
    return rest, near, scales


#: Negligible displacements, relative to those of a rotation of the whole scene by the same step.
_MIN_DISPLACEMENT = 1e-7


def outlines(linear: LinearEquations, q: Array) -> list[Outline]:
    """Outlines of the scene at each of the coordinates q (n, nq)."""
    sight = _SceneObservation(linear, q)
    bodies, springs = list(sight.bodies()), list(sight.springs())
    joints, ground = sight.joints(), sight.ground()
    return [
        Outline([x[k] for x in bodies], [x[k] for x in springs], joints[:, k], ground)
        for k in range(len(q))
    ]


class _SceneObservation:
    """Positions of all bodies and ends at n states, each observed once."""

    def __init__(self, linear: LinearEquations, q: Array) -> None:
        self.model, self.q = linear.model, q
        self.packed = linear.model.looped.packed
        self.scene = linear.model.scene.skeleton
        hinges = self.scene.hinges
        self.hinges = [hinges[k] for k in range(len(hinges))]
        self.outboard_references = {
            split_reference(hinge.outboard)[0]: hinge.outboard for hinge in reversed(self.hinges)
        }
        names = [self.scene.bodies.name(k) for k in range(len(self.scene.bodies))]
        ends = [f"{name}.{end}" for name in names for end in self.scene.bodies.ends(name) or ()]
        self.names = names
        self.motions = dict(
            zip([*names, *ends], self._observe_references([*names, *ends]), strict=True)
        )

    def _observe_references(self, references: Sequence[str]) -> Array:
        """Motion (references, n, 24) of bodies and ends; columns of `Observation.points`."""
        return self._observe([Probe(*self.packed.end(reference)) for reference in references])

    def _observe(self, probes: list[Probe]) -> Array:
        engine, q = self.model.looped.inertia_only, self.q
        memory = np.tile(engine.start_memory(), (len(q), 1))
        still = np.zeros((len(q), engine.nu))
        seen = engine.observe(np.zeros(len(q)), q, still, memory, probes, parts=("points",))
        return np.moveaxis(seen.points, 1, 0)

    def bodies(self) -> Iterator[Array]:
        """Lines (n, m, 3) of bodies, and lines from inboard to outboard ends of hinges."""
        for name in self.names:
            flexible = self.model.flexible_bodies.get(name)
            if flexible is not None and flexible.shapes is not None:
                yield self._axis(name)
            else:
                yield from self._star(name)
        for hinge in self.hinges:
            if hinge.inboard != "ground":
                yield self._line(hinge.inboard, hinge.outboard)

    def _line(self, first_end: str, second_end: str) -> Array:
        return np.stack([self.motions[first_end][:, 0:3], self.motions[second_end][:, 0:3]], axis=1)

    def _star(self, name: str) -> Iterator[Array]:
        """Lines from the hinge of a body to its other ends, or without such to its mass centre."""
        held = self.outboard_references.get(name, name)
        ends = [f"{name}.{end}" for end in self.scene.bodies.ends(name) or ()]
        free_ends = [end for end in ends if end != held]
        for end in free_ends:
            yield self._line(held, end)
        if not free_ends:
            pose = self.motions[name]
            body = self.scene.bodies.by_name[name]
            offset = pose[:, 15:24].reshape(-1, 3, 3) @ np.array(body.center_of_mass, float)
            yield np.stack([self.motions[held][:, 0:3], pose[:, 0:3] + offset], axis=1)

    def _axis(self, name: str) -> Array:
        """Deflected axis (n, m, 3) of a beam."""
        pose, body = self.motions[name], self.model.flexible_bodies[name]
        eta = self.q[:, self.model.coordinate_layout.modal[name].q_slice]
        none, still = np.zeros_like(eta), np.zeros((len(eta), 3))
        motion = observe.Motion(
            body, np.zeros(len(eta)), eta, none, none, pose[:, 0:3],
            pose[:, 15:24].reshape(-1, 3, 3), still, still, still, still,
        )  # fmt: skip
        return observe.deflected_axis(motion, np.linspace(0.0, motion.shapes.length, _FINE))

    def springs(self) -> Iterator[Array]:
        """Lines (n, 2, 3) of springs and bushings."""
        for force in self.packed.system.forces:
            ends = self._observe([Probe(*end) for end in force.ends])
            yield np.moveaxis(ends[:, :, 0:3], 0, 1)

    def joints(self) -> Array:
        """Positions (k, n, 3) of hinges on their outboard bodies."""
        return np.array([self.motions[hinge.outboard][:, 0:3] for hinge in self.hinges])

    def ground(self) -> Array:
        """Positions (k, 3) of hinges that constrain bodies to the ground."""
        slots = self.model.coordinate_layout.hinges
        positions = [
            hinge.position for hinge in self.hinges
            if hinge.inboard == "ground" and slots[hinge.name].nu < _FREE
        ]  # fmt: skip
        return np.array(positions, float).reshape(-1, 3)
