"""Check whether a scene moves in a plane, so that beams need shapes in that plane alone.

The test is structural and exact: every hinge rotates about one direction n or slides normal to it,
gravity and loads lie in the plane, all mass centres have one height above it, and n is a principal
direction of every inertia.  Elements of unknown behaviour count as leaving the plane.

Without load out of the plane, beams may still buckle out of it.  In-plane buckling comes first if
each beam is at least as stiff across the plane as in it: hinges that rotate about n alone constrain
every deflection across that they constrain in the plane, and bending about the softer axis does not
twist a beam (Timoshenko and Gere, Theory of Elastic Stability, 2nd ed., sections 2.1 and 6.3).
Springs and constraints in the plane brace beams in the plane alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene.tables.hinge_frames import hinge_frames, initial_motion_axes
from mstmm.scene.validators.scalars_and_vectors import GROUND, split_reference

if TYPE_CHECKING:
    from mstmm.expression.expression import Expression
    from mstmm.scene import Scene
    from mstmm.scene.tables.beam import Beam
    from mstmm.scene.tables.hinge import Hinge
    from mstmm.scene.tables.loads import Load


#: Angles, and relative heights, below this are rounding.
_ROUNDING = 1e-9
#: Component of an axis from which it counts as along a direction; below 1 / sqrt(2).
_ALONG = 0.5


class PlanarMotionCheck:
    """Check of planar motion, from the poses of all bodies of a scene at q = 0."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._rotations: dict[str, Array] = {GROUND: np.eye(3)}
        self._origins: dict[str, Array] = {GROUND: np.zeros(3)}
        self._planes: dict[tuple[float, ...], bool] = {}
        self._laterally_stiff: dict[tuple[float, ...], bool] = {}
        self._ends = {b.name: b.ends for b in scene.body} | {b.name: b.ends for b in scene.beam}
        self.possible = not (scene.chain or scene.elastic) and self._place_bodies()

    def leaves(self, beam: str, axis: int) -> bool:
        """Whether the beam may deflect along its own axis 1 (y) or 2 (z)."""
        if not self.possible:
            return True
        n = self._rotations[beam][:, axis]
        key = _direction_key(n)
        if key not in self._planes:
            self._planes[key] = self._in_plane(n)
        return not self._planes[key]

    def is_planar(self, beam: str, axis: int, hinges: Sequence[Hinge]) -> bool:
        """Whether all motions of the hinges are planar, normal to axis 1 or 2 of the beam."""
        n = self._rotations[beam][:, axis]
        return all(self._is_hinge_planar(hinge, n) for hinge in hinges)

    def buckles(self, beam: str, axis: int) -> bool:
        """Whether a beam of the scene may buckle along an axis before it buckles in the plane.

        The axis is the own axis 1 (y) or 2 (z) of `beam`, the plane is normal to it.
        """
        n = self._rotations[beam][:, axis]
        key = _direction_key(n)
        if key not in self._laterally_stiff:
            springs = [spring for spring in self.scene.spring if spring.law.stiffness]
            self._laterally_stiff[key] = not (springs or self.scene.constraint) and all(
                self._is_stiffer_across(other, n)
                for other in self.scene.beam
                if other.model != "rigid"
            )
        return not self._laterally_stiff[key]

    def _is_stiffer_across(self, beam: Beam, n: Array) -> bool:
        """Whether every section is at least as stiff in bending along n as in the plane."""
        along_z = abs(float(self._rotations[beam.name][:, 2] @ n)) > _ALONG
        across, within = (0, 1) if along_z else (1, 0)  # [about y, about z]
        return all(
            piece.bending_stiffness is not None
            and piece.bending_stiffness[across] >= piece.bending_stiffness[within] * (1 - _ROUNDING)
            for piece in beam.sections
        )

    # --- poses ------------------------------------------------------------------------------------

    def _end_pose(self, reference: str) -> tuple[str, Array, Array]:
        """Body, position in its axes (m), and rotation, end axes to body axes, of an end."""
        name, end = split_reference(reference)
        if name == GROUND or not end:
            return name, np.zeros(3), np.eye(3)
        table = self._ends[name][end]
        return name, np.array(table.position), np.array(table.rotation)

    def _place_bodies(self) -> bool:
        """Compute the poses at q = 0, from the ground outwards; return whether all are found."""
        pending = list(self.scene.hinge)
        while pending:
            failed = [hinge for hinge in pending if not self._place_outboard_body(hinge)]
            if len(failed) == len(pending):
                return False
            pending = failed
        return all(name in self._rotations for name in self._ends)

    def _place_outboard_body(self, hinge: Hinge) -> bool:
        inboard, position, inboard_rotation = self._end_pose(hinge.inboard)
        if inboard not in self._rotations:
            return False
        outboard, outboard_position, outboard_rotation = self._end_pose(hinge.outboard)
        if inboard == GROUND:
            position = np.array(hinge.position)
        hinge_rotation = inboard_rotation @ np.array(hinge.rotation)
        attitude = self._rotations[inboard] @ hinge_rotation @ outboard_rotation.T
        point = self._origins[inboard] + self._rotations[inboard] @ position
        self._rotations[outboard] = attitude
        self._origins[outboard] = point - attitude @ outboard_position
        return True

    # --- one plane --------------------------------------------------------------------------------

    def _in_plane(self, n: Array) -> bool:
        scene = self.scene
        gravity = np.array(scene.gravity)
        height = self._common_height(n)
        limit = _ROUNDING * max(1.0, float(np.linalg.norm(gravity)))
        return (
            not scene.bushing
            and abs(float(gravity @ n)) <= limit
            and height is not None
            and all(self._is_hinge_planar(hinge, n) for hinge in scene.hinge)
            and all(self._is_load_planar(load, n, height) for load in scene.load)
            and all(
                spring.type == "spring"
                and self._is_at_height(spring.from_, n, height, np.array(spring.position))
                and self._is_at_height(spring.to, n, height, np.array(spring.position))
                for spring in scene.spring
            )
        )

    def _common_height(self, n: Array) -> float | None:
        """Height (m) above the plane of all mass centres.

        None if they differ, or if a body is not symmetric to the plane.
        """
        heights = []
        for body in self.scene.body:
            normal = self._rotations[body.name].T @ n
            moment = np.array(body.inertia_matrix) @ normal
            scale = float(np.abs(np.array(body.inertia_matrix)).max())
            if body.type != "rigid":
                return None
            if np.abs(moment - normal * (normal @ moment)).max() > _ROUNDING * max(scale, 1e-300):
                return None
            if body.mass:
                heights.append(self._height(body.name, np.array(body.center_of_mass), n))
        for beam in self.scene.beam:
            if abs(self._rotations[beam.name][:, 0] @ n) > _ROUNDING:
                return None
            if np.abs(self._rotations[beam.name][:, 1:].T @ n).max() < 1 - _ROUNDING:
                return None
            heights.append(self._height(beam.name, np.zeros(3), n))
        scale = max(1.0, *(float(np.abs(o).max()) for o in self._origins.values()))
        is_level = max(heights) - min(heights) <= _ROUNDING * scale
        return heights[0] if is_level else None

    def _height(self, body: str, place: Array, n: Array) -> float:
        return float((self._origins[body] + self._rotations[body] @ place) @ n)

    def _is_at_height(self, end: str, n: Array, height: float, ground: Array) -> bool:
        name, position, _ = self._end_pose(end)
        end_height = self._height(name, ground if name == GROUND else position, n)
        return abs(end_height - height) <= _ROUNDING * max(1.0, abs(height))

    def _is_hinge_planar(self, hinge: Hinge, n: Array) -> bool:
        facts, motions = hinge.facts, initial_motion_axes(hinge)
        if facts is None or motions is None or not facts.in_place:
            return False
        body, _, end_rotation = self._end_pose(hinge.outboard)
        rotation = self._rotations[body] @ end_rotation
        if facts.constant_subspace:
            turned = ((rotation @ np.array(t), rotation @ np.array(r)) for t, r in motions)
            return all(_is_planar(t, r, n) for t, r in turned)
        z = rotation @ np.array(hinge_frames(hinge)[1])[:, 2]
        return facts.keeps_z and abs(float(z @ n)) >= 1 - _ROUNDING

    def _is_load_planar(self, load: Load, n: Array, height: float) -> bool:
        name, _, end_rotation = self._end_pose(load.on)
        if load.axes == "inertial":
            rotation = np.eye(3)
        elif load.axes == "body":
            has_end = bool(split_reference(load.on)[1])
            rotation = self._rotations[name] @ (end_rotation if has_end else np.eye(3))
        else:
            rotation = self._rotations.get(load.axes, np.eye(3))
        normal = rotation.T @ n
        forces = (load.force, load.force_per_length or ())
        return (
            (load.at is not None or self._is_at_height(load.on, n, height, np.zeros(3)))
            and all(_has_no_component(force, normal) for force in forces if force)
            and _is_along(load.moment, normal)
        )


def _direction_key(n: Array) -> tuple[float, ...]:
    """Key of a direction, equal for its opposite."""
    return tuple(np.round(n * np.sign(n[np.argmax(np.abs(n))]), 9) + 0.0)


def _is_planar(translation: Array, rotation: Array, n: Array) -> bool:
    """Whether a motion is planar: translation normal to n, rotation about n."""
    angle = float(np.linalg.norm(rotation))
    return (
        abs(float(translation @ n)) <= _ROUNDING * max(float(np.linalg.norm(translation)), 1e-300)
        and abs(float(rotation @ n)) >= (1 - _ROUNDING) * angle
    )


def _has_no_component(force: tuple[Expression, ...], n: Array) -> bool:
    """Whether a force has no component along n, axis by axis."""
    return all(
        component.is_zero
        for component, share in zip(force, n, strict=True)
        if abs(share) > _ROUNDING
    )


def _is_along(moment: tuple[Expression, ...], n: Array) -> bool:
    """Whether a moment is along n, which must be along an axis."""
    return all(
        component.is_zero
        for component, share in zip(moment, n, strict=True)
        if abs(share) < 1 - _ROUNDING
    )


# --- beams whose length the rest of the scene constrains ------------------------------------------
#
# Gruebler's count over the smallest part of the scene with all loops through a beam (a block of its
# graph): the free coordinates of its hinges less 3 (in a plane, else 6) per independent loop.  If
# the count is negative, there is no motion even with the length of the beam as a further
# coordinate.


class Edge(NamedTuple):
    """Edge between two bodies: a hinge, or a constraint (hinge None) with its number of rows."""

    ends: tuple[str, str]
    hinge: Hinge | None
    rows: int = 0


def restrained_beams(scene: Scene) -> frozenset[str]:
    """Names of the beams whose length the rest of the scene constrains."""
    hinges = [Edge((h.inboard_body, h.outboard_body), h) for h in scene.hinge]
    constraints = [
        Edge((split_reference(c.from_)[0], split_reference(c.to)[0]), None, c.rows)
        for c in scene.constraint
    ]
    beams = {beam.name for beam in scene.beam if any(s.axial_stiffness for s in beam.sections)}
    if not beams or len(hinges) + len(constraints) <= len(scene.skeleton.body):
        return frozenset()
    planar_check, restrained = PlanarMotionCheck(scene), set[str]()
    for block in biconnected_components([*hinges, *constraints]):
        bodies = {end for edge in block for end in edge.ends}
        loops = len(block) - len(bodies) + 1
        for beam in beams & bodies if loops else ():
            if _mobility(planar_check, beam, block, loops) < 0:
                restrained.add(beam)
    return frozenset(restrained)


def _mobility(check: PlanarMotionCheck, beam: str, block: list[Edge], loops: int) -> int:
    """Mobility of a block by count, planar if all its hinges move in a plane of the beam."""
    hinges = [edge.hinge for edge in block if edge.hinge is not None]
    in_plane = not check.possible or any(check.is_planar(beam, axis, hinges) for axis in (1, 2))
    per_body = 3 if in_plane else 6  # 3 is the weaker claim where the poses are unknown
    free_by_constraints = sum(per_body - edge.rows for edge in block if edge.hinge is None)
    return sum(map(_free_coordinates, hinges)) + free_by_constraints - per_body * loops


def _free_coordinates(hinge: Hinge) -> int:
    """Number of coordinates of a hinge without drive; 6 for an unknown type."""
    drive = hinge.drive or ()
    count = 6 if hinge.facts is None else len(hinge.facts.speeds)
    return count - sum(entry is not None for entry in drive)


def biconnected_components(edges: list[Edge]) -> list[list[Edge]]:
    """Biconnected components of a graph: any two edges of one lie on a common cycle.

    R. Tarjan, SIAM J. Comput. 1 (1972) 146-160, without recursion.
    """
    edges_at: dict[str, list[int]] = {}
    for number, edge in enumerate(edges):
        for end in edge.ends:
            edges_at.setdefault(end, []).append(number)
    components: list[list[Edge]] = []
    order, low = dict[str, int](), dict[str, int]()
    visited, open_edges = set[int](), list[int]()
    for start in edges_at:
        if start in order:
            continue
        order[start] = low[start] = len(order)
        path = [(start, -1, iter(edges_at[start]))]
        while path:
            body, entry, remaining = path[-1]
            number = next((k for k in remaining if k not in visited), -1)
            if number < 0:
                path.pop()
                if path:
                    parent = path[-1][0]
                    low[parent] = min(low[parent], low[body])
                    if low[body] >= order[parent]:
                        first = open_edges.index(entry)
                        components.append([edges[k] for k in open_edges[first:]])
                        del open_edges[first:]
                continue
            visited.add(number)
            open_edges.append(number)
            first_end, second_end = edges[number].ends
            end = second_end if first_end == body else first_end
            if end in order:
                low[body] = min(low[body], order[end])
            else:
                order[end] = low[end] = len(order)
                path.append((end, number, iter(edges_at[end])))
    return components
