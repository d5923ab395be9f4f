"""Section loads of a beam from the equilibrium of the part beyond a section.

On the part of the beam between a section and the free side act its inertia, gravity, distributed
loads, drag, the loads of its ends, and the load of the rest of the beam, which balances them
(d'Alembert). Unlike EI v'', which is limited to the curvature of the shape functions, this includes
loads to which the shape functions cannot deform: concentrated loads, and the axial force of an
inextensible axis.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.scene.checks.topology import inboard_hinges_by_body
from mstmm.scene.validators.validation_messages import did_you_mean

from .motion import (
    Motion,
    deflection,
    first_order_field,
    rotation_vectors,
    second_order_motion,
    section_rotations,
    tilde,
    values_at,
)

if TYPE_CHECKING:
    from mstmm.scene import Hinge, Load

    from ...engine.compiled_scene import CompiledScene
    from ...flexible.modal_body import ModalBody
    from ..observations import Observations

#: Gauss points of a panel and least number of panels of a beam: exact for products of cubics at the
#: panel size, and fine enough for shape functions that are linearly independent.
_GAUSS_POINTS, _MIN_PANELS = 5, 8

#: Numbers in one batch of samples, about 30 MB per array.
_MAX_BATCH_NUMBERS = 2**22


@dataclass(frozen=True)
class PointLoad:
    """Concentrated load on the beam at x (m), inertial axes.

    Force (n, 3) N and moment (n, 3) N*m about the point of the axis there.
    """

    x: float
    force: Array
    moment: Array

    def select_samples(self, samples: Any) -> PointLoad:
        """Load at some of the samples."""
        return PointLoad(self.x, self.force[samples], self.moment[samples])


@dataclass(frozen=True)
class LineLoad:
    """Force (n, 3) N and moment (n, 3) N*m spread evenly from x = first to last (m).

    In inertial axes.
    """

    first: float
    last: float
    force: Array
    moment: Array

    def select_samples(self, samples: Any) -> LineLoad:
        """Load at some of the samples."""
        return LineLoad(self.first, self.last, self.force[samples], self.moment[samples])


def section_loads(
    motion: Motion,
    positions: Array,
    gravity: Array,
    held: float,
    points: Sequence[PointLoad] = (),
    lines: Sequence[LineLoad] = (),
) -> tuple[Array, Array]:
    """Section force (n, m, 3) in N and moment (n, m, 3) in N*m from equilibrium.

    Loads of the part beyond x on the part before it, in rotated section axes: axial force (tension
    positive) and shear along y and z; torque and bending moments about y and z. Moments are about
    the deflected axis. `gravity` in m/s2, inertial axes. `held` is the x of the section by which
    the beam is attached to the tree: loads there are not needed, because the loads of the free side
    are summed. At a concentrated load, the values are those on its inboard side.
    """
    edges = _panel_edges(motion, positions, points, lines)
    rows = max(1, _MAX_BATCH_NUMBERS // (3 * _GAUSS_POINTS * len(edges)))
    force, moment = (np.empty((len(motion.t), len(positions), 3)) for _ in range(2))
    for first in range(0, len(motion.t), rows):
        samples = slice(first, first + rows)
        sampled_points, sampled_lines = (
            [p.select_samples(samples) for p in points],
            [p.select_samples(samples) for p in lines],
        )
        sums = _PanelSums(
            motion.select_samples(samples), edges, gravity, sampled_points, sampled_lines
        )
        force[samples], moment[samples] = sums.section_loads(positions, held)
    return force, moment


def _panel_edges(
    motion: Motion, stations: Array, points: Sequence[PointLoad], lines: Sequence[LineLoad]
) -> Array:
    """Edges of the panels; no load jumps within a panel."""
    shapes = motion.shapes
    count = max(_MIN_PANELS, 2 * motion.eta.shape[1])
    positions = [np.linspace(0.0, shapes.length, count + 1), stations, np.asarray(shapes.pieces)]
    positions += [np.array([p.x]) for p in points]
    positions += [np.array([p.first, p.last]) for p in lines]
    return np.unique(np.clip(np.concatenate(positions), 0.0, shapes.length))


class _PanelSums:
    """Sums of loads per panel, frame axes, moments about the frame's origin."""

    def __init__(
        self,
        motion: Motion,
        edges: Array,
        gravity: Array,
        points: Sequence[PointLoad],
        lines: Sequence[LineLoad],
    ) -> None:
        self.motion, self.edges = motion, edges
        nodes, weights = np.polynomial.legendre.leggauss(_GAUSS_POINTS)
        half = np.diff(edges) / 2
        x = (edges[:-1, None] + half[:, None] * (1 + nodes)).ravel()
        self.weights = (half[:, None] * weights).ravel()
        position, force, moment = _load_densities(motion, x, gravity)
        for line in lines:
            share = ((x > line.first) & (x < line.last)) / max(line.last - line.first, 1e-300)
            force = force + motion.inward(line.force)[:, None] * share[:, None]
            moment = moment + motion.inward(line.moment)[:, None] * share[:, None]
        moment = moment + np.cross(position, force)
        self.panels = np.concatenate([self._per_panel(force), self._per_panel(moment)], axis=2)
        self.points = [(p.x, self._wrench(p)) for p in points]

    def _per_panel(self, density: Array) -> Array:
        weighted = density * self.weights[:, None]
        return weighted.reshape(len(density), -1, _GAUSS_POINTS, 3).sum(axis=2)

    def _wrench(self, load: PointLoad) -> Array:
        """Force and moment (n, 6) of a load about the frame's origin."""
        force, moment = self.motion.inward(load.force), self.motion.inward(load.moment)
        position = _deflected_positions(self.motion, np.array([load.x]))[:, 0]
        return np.concatenate([force, moment + np.cross(position, force)], axis=1)

    def section_loads(self, positions: Array, held: float) -> tuple[Array, Array]:
        """Force and moment at the sections, section axes."""
        zero = np.zeros((len(self.panels), 1, 6))
        inboard_sums = np.concatenate([zero, np.cumsum(self.panels, axis=1)], axis=1)
        outboard_sums = np.concatenate(
            [np.cumsum(self.panels[:, ::-1], axis=1)[:, ::-1], zero], axis=1
        )
        edge_indices = np.searchsorted(self.edges, positions)
        # At the inboard section the part beyond is that on the outer side, unless it is the tip.
        outer = positions >= held if held < self.motion.shapes.length else positions > held
        total = np.where(
            outer[:, None], outboard_sums[:, edge_indices], -inboard_sums[:, edge_indices]
        )
        for x, wrench in self.points:
            is_beyond = outer & (x >= positions) & (x != held)
            is_below = ~outer & (x <= positions) & (x != held)
            total = total + wrench[:, None] * (is_beyond.astype(float) - is_below)[:, None]
        force = total[:, :, :3]
        moment = total[:, :, 3:] - np.cross(_deflected_positions(self.motion, positions), force)
        rotations = section_rotations(rotation_vectors(self.motion, positions))
        return np.einsum("tmji,tmj->tmi", rotations, force), np.einsum(
            "tmji,tmj->tmi", rotations, moment
        )


def _deflected_positions(motion: Motion, x: Array) -> Array:
    """Positions (n, m, 3) of the deflected axis, frame axes."""
    at_rest = np.zeros((len(x), 3))
    at_rest[:, 0] = x
    return at_rest + deflection(motion, x)


def _second_order_terms(motion: Motion, x: Array) -> tuple[Array, Array, Array]:
    """Second-order displacement and rotation (n, m, 6) of the sections and their two rates.

    The rotation is that of the sections' inertia; for slices that are separate rigid bodies, the
    whole rotation.
    """
    is_for_inertia = not motion.body.points
    pairs = [("eta", "eta"), ("eta", "etad"), ("eta", "etadd"), ("etad", "etad")]
    value, rate, eta_etadd, etad_etad = (
        second_order_motion(motion, x, a, b, is_for_inertia) for a, b in pairs
    )
    return -0.5 * value, -rate, -(eta_etadd + etad_etad)


def _load_densities(motion: Motion, x: Array, gravity: Array) -> tuple[Array, Array, Array]:
    """Positions, and force and moment per length of gravity, drag and inertia; frame axes."""
    body, shapes, values = motion.body, motion.shapes, values_at(motion.shapes, x)
    sections = shapes.sections(x)
    second = _second_order_terms(motion, x)
    position, relative_velocity, relative_acceleration = (
        first_order_field(values.phi, modal) + term[..., :3]
        for modal, term in zip((motion.eta, motion.etad, motion.etadd), second, strict=True)
    )
    position[..., 0] += x
    w = motion.frame_angular_velocity[:, None]
    wd = motion.frame_angular_acceleration[:, None]
    frame_velocity = np.cross(w, position)
    acceleration = (
        motion.frame_acceleration[:, None] + np.cross(wd, position) + np.cross(w, frame_velocity)
    )
    acceleration += 2 * np.cross(w, relative_velocity) + relative_acceleration
    weight = motion.inward(np.broadcast_to(gravity, motion.velocity.shape))[:, None]
    density = weight - acceleration
    force = density * sections.mass_per_length[:, None]
    if body.drag is not None:
        drag = sections.drag[:, None]
        force -= drag * (motion.frame_velocity[:, None] + frame_velocity + relative_velocity)
    rotations = [term[..., 3:] for term in second]
    return (
        position,
        force,
        -_rotary_inertia_moment(motion, x, values.theta, rotations, sections.rho_I.T),
    )


def _rotary_inertia_moment(
    motion: Motion, x: Array, theta: Array, turned: Sequence[Array], per_length: Array
) -> Array:
    """Rate (n, m, 3) of the sections' own moment of momentum per length, frame axes.

    A point s of a section is at B s from the axis, B = exp(Psi~) to second order with the part of
    Psi that rotates the sections' inertia (twist alone without rotary inertia), and is accelerated
    by Q s, Q = (wd~ + w~ w~) B + 2 w~ Bd + Bdd; so int rho (B s) x (Q s) is the axial vector of B
    (int rho s s^T) Q^T. Slices that are separate rigid bodies rotate with all of Psi.
    """
    if not per_length.any():
        return np.zeros((len(motion.t), len(per_length), 3))
    if not motion.body.points:
        theta = np.moveaxis(motion.shapes.inertia_rotation(x), 2, 0)
    rotation, rate, growth = _section_rotation(motion, theta, turned)
    w = tilde(motion.frame_angular_velocity)[:, None]
    acceleration = (
        (tilde(motion.frame_angular_acceleration)[:, None] + w @ w) @ rotation
        + 2 * w @ rate
        + growth
    )
    second = np.zeros((len(x), 3, 3))
    second[:, 1, 1], second[:, 2, 2] = per_length[:, 2], per_length[:, 1]
    product = rotation @ second @ np.swapaxes(acceleration, -1, -2)
    axial = [product[..., a, b] - product[..., b, a] for a, b in ((1, 2), (2, 0), (0, 1))]
    return np.stack(axial, axis=-1)


def _section_rotation(
    motion: Motion, theta: Array, turned: Sequence[Array]
) -> tuple[Array, Array, Array]:
    """Rotation of the sections' inertia and its two rates, (n, m, 3, 3).

    B = 1 + Psi~ + Psi~ Psi~ / 2, from the first-order rotation (m, 3, modes) and the second-order
    rotation with its rates (n, m, 3).
    """
    skew, skew_rate, skew_acceleration = (
        tilde(first_order_field(theta, modal)) for modal in (motion.eta, motion.etad, motion.etadd)
    )
    if not motion.shapes.stiffening:
        return np.eye(3) + skew, skew_rate, skew_acceleration
    mixed_product = skew @ skew_rate
    acceleration_product = skew @ skew_acceleration + skew_rate @ skew_rate
    second_order_skew, second_order_rate, second_order_acceleration = map(tilde, turned)
    return (
        np.eye(3) + skew + second_order_skew + skew @ skew / 2,
        skew_rate + second_order_rate + (mixed_product + np.swapaxes(mixed_product, -1, -2)) / 2,
        skew_acceleration
        + second_order_acceleration
        + (acceleration_product + np.swapaxes(acceleration_product, -1, -2)) / 2,
    )


class FlexibleBodies:
    """Motions of the flexible bodies at the samples of a run, computed on first use."""

    def __init__(self, model: CompiledScene, observed: Observations) -> None:
        self.model, self.observations, self.run = model, observed, observed.run
        self.modal_bodies: Mapping[str, ModalBody] = model.flexible_bodies
        self.one_way: Collection[str] = ()  # one-way bodies, not part of the run
        self.unbalanced: Collection[str] = ()  # their end loads omit their vibration
        self._motions: dict[str, Motion] = {}

    def body(self, name: str, what: str) -> ModalBody:
        """Modal data of a flexible body; SceneError for a rigid or unknown body."""
        modal_body = self.modal_bodies.get(self.observations.references.canonical(name) or name)
        if modal_body is not None:
            return modal_body
        flexible_names = ", ".join(f'"{x}"' for x in self.modal_bodies)
        if name in self.observations.references:
            hint_text = (
                f"the flexible ones are {flexible_names}"
                if flexible_names
                else "the scene has none"
            )
            raise SceneError(f'"{name}": {what} exists for flexible bodies only; {hint_text}')
        hint = did_you_mean(name, self.modal_bodies)
        raise SceneError(f'"{name}": there is no such flexible body in the scene{hint}')

    def motion(self, name: str, what: str = "its motion") -> Motion:
        """Motion of one flexible body."""
        if name not in self._motions:
            body = self.body(name, what)
            slots = self.model.coordinate_layout.modal[name]
            points = self.observations.points(name)
            udot = self.observations.columns("udot", (slots.u_slice,))
            modal = self.run.q[:, slots.q_slice], self.run.u[:, slots.u_slice], udot
            self._motions[name] = Motion.of_points(body, self.run.t, modal, points)
        return self._motions[name]

    def coupled_start(self) -> tuple[CompiledScene, Array]:
        """Model in which all flexible bodies are coupled, and its q at the start of the run."""
        return self.model, self.run.first[1]

    @cached_property
    def gravity(self) -> Array:
        """Gravity (3,), m/s2, inertial axes."""
        return np.array(self.model.scene.gravity)

    # --- loads on a body ------------------------------------------------------------------------

    def inboard_end(self, name: str) -> str:
        """Name of the inboard end of a body."""
        hinge = self._holders.get(name)
        if hinge is None:
            raise SceneError(f'"{name}": this body has no inboard hinge')
        return hinge.outboard_end

    @cached_property
    def _holders(self) -> dict[str, Hinge]:
        return inboard_hinges_by_body(self.model.scene)

    def inboard_position(self, name: str) -> float:
        """Position x (m) of the section by which a beam is attached to the tree."""
        return float(self.modal_bodies[name].ports[self.inboard_end(name)].position[0])

    def load_at_end(self, name: str, end: str) -> tuple[Array, Array] | None:
        """External force and moment (n, 3) on a port, inertial axes; None if nothing is attached.

        Moments are about the section's point. Not available for the inboard end.
        """
        hinge_index = self.observations.engine.packed.hinge_position.get(f"{name}/{end}")
        if hinge_index is None:
            return None
        load = self.observations.columns("loads", (hinge_index,))
        return -load[:, :3], -load[:, 3:]

    def end_loads(self, name: str) -> dict[str, tuple[Array, Array]]:
        """External force and moment (n, 3) by port, inertial axes, except at the inboard end."""
        inboard_end, loads = self.inboard_end(name), dict[str, tuple[Array, Array]]()
        for port in self.modal_bodies[name].ports:
            load = None if port == inboard_end else self.load_at_end(name, port)
            if load is not None:
                loads[port] = load
        return loads

    def inboard_load(self, name: str) -> tuple[Array, Array]:
        """Force and moment (n, 3) of the inboard hinge on the inboard end, inertial axes.

        Moments are about the section's point.
        """
        hinge_index = self.observations.engine.packed.hinge_position[self._holders[name].name]
        load = self.observations.columns("loads", (hinge_index,))
        return load[:, :3], load[:, 3:]

    def point_loads(self, name: str) -> list[PointLoad]:
        """Concentrated loads on a beam, except at its inboard end."""
        body, line_load_names = (
            self.modal_bodies[name],
            {load.name for load in self._distributed_loads(name)},
        )
        result = []
        for port, load in self.end_loads(name).items():
            if port not in line_load_names:
                result.append(PointLoad(float(body.ports[port].position[0]), *load))
        return result

    def line_loads(self, name: str) -> list[LineLoad]:
        """Loads per length on a beam."""
        shapes, result = self.modal_bodies[name].shapes, []
        for load in self._distributed_loads(name):
            wrench = self.load_at_end(name, load.name)
            if shapes is not None and wrench is not None:
                first, last = load.span or (0.0, shapes.length)
                result.append(LineLoad(first, last, *wrench))
        return result

    def _distributed_loads(self, name: str) -> list[Load]:
        return [
            load for load in self.model.scene.load
            if load.on == name and load.force_per_length is not None
        ]  # fmt: skip
