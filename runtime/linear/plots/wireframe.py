"""A scene as lines: bodies from where they are held to their ends, beams along their axes, springs.

What moves is drawn as the linear model sees it, every point along its own straight line: the
difference of two poses next to each other, enlarged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene import split_reference

from ...engine.engine_calls import Probe
from ...result.flexible import motion as observe

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

#: Speeds of a hinge that holds nothing.
_FREE = 6
#: Points along a beam.
_FINE = 61
#: Largest increment of a coordinate by which poses differ: small beside rounding and curvature.
_STEP = 1e-6


@dataclass(frozen=True)
class Outline:
    """Lines of a scene, each (m, 3) in m, inertial axes: `bodies` and `springs`; `joints` (k, 3)
    are where hinges hold bodies, `ground` (k, 3) where they hold on the ground."""

    bodies: list[Array]
    springs: list[Array]
    joints: Array
    ground: Array

    @property
    def points(self) -> Array:
        """(n, 3) of all lines and joints."""
        return np.concatenate([*self.bodies, *self.springs, self.joints, self.ground])

    def moved(self, other: Outline, scale: float) -> Outline:
        """The same, every point moved to the other's place and beyond: `scale` times as far."""

        def along(one: Array, there: Array) -> Array:
            return one + scale * (there - one)

        def each(lines: list[Array], there: list[Array]) -> list[Array]:
            return [along(*pair) for pair in zip(lines, there, strict=True)]

        return Outline(
            each(self.bodies, other.bodies), each(self.springs, other.springs),
            along(self.joints, other.joints), along(self.ground, other.ground),
        )  # fmt: skip


def deformed_outlines(
    linear: LinearEquations, shapes: Array, part: float
) -> tuple[Outline, list[Outline]]:
    """(at rest, moved by each of the real shapes (n, k)), the largest displacement of a point being
    a `part` of the scene's size."""
    rest, near, scales = _near(linear, shapes, _steps(shapes), part)
    return rest, [rest.moved(one, scale) for one, scale in zip(near, scales, strict=True)]


def amplitudes(linear: LinearEquations, shapes: Array, part: float) -> Array:
    """(k,) what real shapes (n, k) are to be multiplied with for that; 0 where no point moves."""
    steps = _steps(shapes)
    return steps * np.array(_near(linear, shapes, steps, part)[2])


def _steps(shapes: Array) -> Array:
    return _STEP / np.maximum(np.abs(shapes).max(axis=0, initial=0), 1e-300)


def _near(
    linear: LinearEquations, shapes: Array, steps: Array, part: float
) -> tuple[Outline, list[Outline], list[float]]:
    """At rest, moved a little by each shape, and how many times as far it is to be."""
    states = [linear.state.q, *(linear.displaced(x) for x in (shapes * steps).T)]
    rest, *near = outlines(linear, np.array(states))
    size = float(np.linalg.norm(np.ptp(rest.points, axis=0)))
    largest = [float(np.linalg.norm(one.points - rest.points, axis=1).max()) for one in near]
    scales = [part * (size or 1.0) / far if far > _SEEN * _STEP * size else 0.0 for far in largest]
    return rest, near, scales


#: Displacements below this, beside what a turn of the whole scene makes, are none.
_SEEN = 1e-7


def outlines(linear: LinearEquations, q: Array) -> list[Outline]:
    """The scene at coordinates q (n, nq), one by one."""
    sight = _Sight(linear, q)
    bodies, springs = list(sight.bodies()), list(sight.springs())
    joints, ground = sight.joints(), sight.ground()
    return [
        Outline([x[k] for x in bodies], [x[k] for x in springs], joints[:, k], ground)
        for k in range(len(q))
    ]


class _Sight:
    """Where everything is at n states, each reference seen once."""

    def __init__(self, linear: LinearEquations, q: Array) -> None:
        self.model, self.q = linear.model, q
        self.packed = linear.model.looped.packed
        self.scene = linear.model.scene.skeleton
        hinges = self.scene.hinges
        self.hinges = [hinges[k] for k in range(len(hinges))]
        self.held = {
            split_reference(hinge.outboard)[0]: hinge.outboard for hinge in reversed(self.hinges)
        }
        names = [self.scene.bodies.name(k) for k in range(len(self.scene.bodies))]
        ends = [f"{name}.{end}" for name in names for end in self.scene.bodies.ends(name) or ()]
        self.names = names
        self.at = dict(zip([*names, *ends], self._seen([*names, *ends]), strict=True))

    def _seen(self, references: Sequence[str]) -> Array:
        """(references, n, 24) as of `Observation.points`."""
        return self._observed([Probe(*self.packed.end(one)) for one in references])

    def _observed(self, probes: list[Probe]) -> Array:
        engine, q = self.model.looped.inertia_alone, self.q
        memory = np.tile(engine.start_memory(), (len(q), 1))
        still = np.zeros((len(q), engine.nu))
        seen = engine.observe(np.zeros(len(q)), q, still, memory, probes, parts=("points",))
        return np.moveaxis(seen.points, 1, 0)

    def bodies(self) -> Iterator[Array]:
        """(n, m, 3) lines of bodies, and from the ends that carry others to where they are held."""
        for name in self.names:
            flexible = self.model.flexible.get(name)
            if flexible is not None and flexible.shapes is not None:
                yield self._axis(name)
            else:
                yield from self._star(name)
        for hinge in self.hinges:
            if hinge.inboard != "ground":
                yield self._line(hinge.inboard, hinge.outboard)

    def _line(self, one: str, other: str) -> Array:
        return np.stack([self.at[one][:, 0:3], self.at[other][:, 0:3]], axis=1)

    def _star(self, name: str) -> Iterator[Array]:
        """From where a body is held to its ends, or to its centre of mass where it has no other."""
        held = self.held.get(name, name)
        ends = [f"{name}.{end}" for end in self.scene.bodies.ends(name) or ()]
        others = [end for end in ends if end != held]
        for end in others:
            yield self._line(held, end)
        if not others:
            pose = self.at[name]
            body = self.scene.bodies.by_name[name]
            offset = pose[:, 15:24].reshape(-1, 3, 3) @ np.array(body.center_of_mass, float)
            yield np.stack([self.at[held][:, 0:3], pose[:, 0:3] + offset], axis=1)

    def _axis(self, name: str) -> Array:
        """The axis of a beam, bent."""
        pose, body = self.at[name], self.model.flexible[name]
        eta = self.q[:, self.model.layout.modal[name].q_slice]
        none, still = np.zeros_like(eta), np.zeros((len(eta), 3))
        motion = observe.Motion(
            body, np.zeros(len(eta)), eta, none, none, pose[:, 0:3],
            pose[:, 15:24].reshape(-1, 3, 3), still, still, still, still,
        )  # fmt: skip
        return observe.deflected_axis(motion, np.linspace(0.0, motion.shapes.length, _FINE))

    def springs(self) -> Iterator[Array]:
        """(n, 2, 3) lines of springs and bushings."""
        for force in self.packed.system.forces:
            ends = self._observed([Probe(*end) for end in force.ends])
            yield np.moveaxis(ends[:, :, 0:3], 0, 1)

    def joints(self) -> Array:
        """(k, n, 3)"""
        return np.array([self.at[hinge.outboard][:, 0:3] for hinge in self.hinges])

    def ground(self) -> Array:
        """(k, 3)"""
        slots = self.model.layout.hinges
        places = [
            hinge.position for hinge in self.hinges
            if hinge.inboard == "ground" and slots[hinge.name].nu < _FREE
        ]  # fmt: skip
        return np.array(places, float).reshape(-1, 3)
