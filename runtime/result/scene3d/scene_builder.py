"""Builder of the scene graph of a run: bodies, hinges, springs and trails over the frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.numerics.rotations import IDENTITY
from mstmm.scene import Body, Hinge, Spring, split_reference
from mstmm.scene.validators.scalars_and_vectors import GROUND

from . import geometry
from .frame_times import FrameTimes
from .load_arrows import LoadArrows, gravity_arrow
from .scene_graph import DeformingSurface, Line, ObjectLabel, Poses, SceneGraph, Solid
from .solid_meshes import Colour, box_surface, ellipsoid_surface

if TYPE_CHECKING:
    from ..result_record import Record

#: Colours of bodies in order, distinguishable for colour-blind readers on white and on black.
_BODY_COLOURS: tuple[Colour, ...] = (
    (68, 119, 170), (204, 119, 68), (68, 150, 90), (170, 90, 150), (190, 170, 60), (90, 180, 190),
    (190, 80, 90), (120, 130, 140),
)  # fmt: skip
_TRAIL_COLOUR: Colour = (150, 160, 175)

#: Hinges are not drawn in scenes with more of them.
_MAX_HINGES = 300
#: Radius of a hinge's glyph, and of a ground block, relative to that of the bars that it joins.
_GLYPH_RADIUS_RATIO, _FOOT_RADIUS_RATIO = 1.6, 1.2
#: Largest number of samples for the size of the scene.
_MAX_SIZE_SAMPLES = 40


def build_scene_graph(
    run: Record,
    title: str,
    trails: Sequence[str] = (),
    speed: float | None = None,
    most: int | None = None,
    when: FrameTimes | None = None,
) -> SceneGraph:
    """Scene graph of a run.

    `trails`: ends whose paths are drawn; `speed`: seconds of the run per second of film; `most`:
    largest number of frames; `when`: given frame times instead of these. SceneError for an unknown
    end, and for a run without samples.
    """
    return _SceneBuilder(run, trails, speed, most, when).stage(title)


class _SceneBuilder:
    def __init__(
        self, run: Record, trails: Sequence[str], speed: float | None, most: int | None,
        when: FrameTimes | None,
    ) -> None:  # fmt: skip
        self.run, self.scene = run, run.model.scene
        self.skeleton = self.scene.skeleton
        self.names = [self.skeleton.bodies.name(i) for i in range(len(self.skeleton.bodies))]
        drawn = len(self.scene.hinges) <= _MAX_HINGES
        self.hinges: Sequence[Hinge] = self.scene.hinges if drawn else ()
        owners = len(self.names) + len(self.hinges)
        self.frame_times = when or FrameTimes.for_run(run, owners, speed, most)
        self.trails = tuple(trails)
        self.elastic = {body.name: body for body in self.scene.elastic if body.name in self.names}
        run._observations.fetch(self.names)
        self.poses = {f"bodies/{name}": self.frame_times.poses(run, name) for name in self.names}
        self.size = self._size()
        self.radius = geometry.bar_radius(self.size, self.size)
        self.load_arrows = LoadArrows(run, self.frame_times, self.size)
        self.notes = () if drawn else (f"more than {_MAX_HINGES} hinges: they are not drawn",)

    def stage(self, title: str) -> SceneGraph:
        solids = [*self._shapes(), *self._rigid_bodies(), *self._joints(), *self._feet()]
        self.poses |= dict(self.load_arrows.poses())
        scene_graph = SceneGraph(
            title=title, times=self.frame_times.times, speed=self.frame_times.speed,
            up=self._up_direction(), poses=self.poses, solids=tuple(solids),
            deforming_surfaces=(*self._deforming_surfaces(), *self.load_arrows.arrow_surfaces()),
            lines=(*self._coils(), *self._path_lines()),
            labels=dict([*self._body_labels(), *self.load_arrows.label_texts()]), notes=self.notes,
        )  # fmt: skip
        gravity_objects = gravity_arrow(scene_graph, float(np.linalg.norm(self.scene.gravity)))
        if gravity_objects is None:
            return scene_graph
        arrow, label = gravity_objects
        return replace(
            scene_graph,
            solids=(*scene_graph.solids, arrow),
            labels={**scene_graph.labels, arrow.owner: label},
        )

    # --- geometry ---------------------------------------------------------------------------------

    def _size(self) -> float:
        """Diagonal (m) of the box that contains origins and ends of all bodies."""
        frames = np.unique(
            np.linspace(0, len(self.frame_times.times) - 1, _MAX_SIZE_SAMPLES).astype(int)
        )
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for name, body in zip(self.names, self.skeleton.bodies, strict=True):
            pose = self.poses[f"bodies/{name}"]
            ends = np.array([(0.0, 0.0, 0.0), *(body.end_position(end) for end in body.ends)])
            positions = Poses(pose.position[frames], pose.quaternion[frames]).inertial_points(ends)
            if name in self.elastic:
                positions = np.stack([trail[frames] for trail in self._end_paths(name)], axis=1)
            low = np.minimum(low, positions.min(axis=(0, 1)))
            high = np.maximum(high, positions.max(axis=(0, 1)))
        for hinge in self._ground_hinges():
            position = np.array(hinge.position)
            low, high = np.minimum(low, position), np.maximum(high, position)
        size = float(np.linalg.norm(high - low)) if len(self.names) else 1.0
        return size if size > 0 else 1.0

    def _up_direction(self) -> Array:
        gravity = np.array(self.scene.gravity)
        strength = float(np.linalg.norm(gravity))
        return -gravity / strength if strength > 0 else np.array([0.0, 0.0, 1.0])

    def _colour(self, name: str) -> Colour:
        return _BODY_COLOURS[self.names.index(name) % len(_BODY_COLOURS)]

    def _rigid_bodies(self) -> Iterator[Solid]:
        flexible_bodies = self.run.model.flexible_bodies
        names_with_geometry = {
            name for name, body in flexible_bodies.items() if body.has_axis or body.skin
        }
        names_with_geometry |= {shape.owner for shape in self.scene.shape}
        hinged_references = {hinge.inboard for hinge in self.scene.hinges}
        hinged_references |= {hinge.outboard for hinge in self.scene.hinges}
        for i, (name, body) in enumerate(zip(self.names, self.skeleton.bodies, strict=True)):
            if name not in names_with_geometry:
                colour = _BODY_COLOURS[i % len(_BODY_COLOURS)]
                yield from geometry.rigid_body_solids(
                    name, body, name in hinged_references, self.size, colour
                )

    def _shapes(self) -> Iterator[Solid]:
        """Solids of the shapes of the scene: bodies with shapes are drawn by these only."""
        saved_files = self.run.meshes
        for shape in self.scene.shape:
            if shape.is_on_ground:
                yield geometry.shape_solid(
                    shape, (0.0, 0.0, 0.0), IDENTITY, geometry.GROUND_COLOUR, saved_files
                )
                continue
            number = self.skeleton.bodies.find(shape.owner)
            assert number is not None
            body, end = self.skeleton.bodies[number], split_reference(shape.on)[1]
            position, axes = body.end_position(end), body.end_rotation(end)
            colour = _BODY_COLOURS[number % len(_BODY_COLOURS)]
            yield geometry.shape_solid(shape, position, axes, colour, saved_files)

    def _deforming_surfaces(self) -> Iterator[DeformingSurface]:
        shaped = {shape.owner for shape in self.scene.shape}
        for name, body in self.run.model.flexible_bodies.items():
            pose, colour = self.poses[f"bodies/{name}"], self._colour(name)
            if body.has_axis:
                yield geometry.beam_tube(self.run, name, self.frame_times, pose, self.size, colour)
            elif body.skin is not None and name not in shaped:
                r = 0.3 * self.radius
                yield geometry.elastic_surface(self.run, name, self.frame_times, pose, r, colour)

    def _joints(self) -> Iterator[Solid]:
        for hinge in self.hinges:
            surface = geometry.hinge_glyph(hinge, _GLYPH_RADIUS_RATIO * self._girth(hinge))
            if surface is not None:
                owner = f"hinges/{hinge.name}"
                self.poses[owner] = self._glyph_poses(hinge)
                yield Solid(owner, "glyph", surface, geometry.HINGE_COLOUR)
        for force in self.scene.bushing:
            owner = f"bushings/{force.name}"
            reference = force.from_ if split_reference(force.to)[0] == GROUND else force.to
            self.poses[owner] = self.frame_times.poses(self.run, reference)
            r = _GLYPH_RADIUS_RATIO * self.radius
            yield Solid(
                owner, "glyph", ellipsoid_surface((r, r, 0.6 * r), 10), geometry.SPRING_COLOUR
            )

    def _glyph_poses(self, hinge: Hinge) -> Poses:
        """Poses of a glyph: at the outboard end; a sliding hinge's rail at the inboard end."""
        outer = self.frame_times.poses(self.run, hinge.outboard)
        if hinge.facts is None or hinge.facts.turns or not hinge.facts.slides:
            return outer
        if hinge.inboard_body == GROUND:
            start = np.tile(np.array(hinge.position), (len(self.frame_times.times), 1))
        else:
            start = self.frame_times.poses(self.run, hinge.inboard).position
        return Poses(start, outer.quaternion)

    def _ground_hinges(self) -> Iterator[Hinge]:
        """Hinges that attach a body to the ground."""
        for hinge in self.hinges:
            free = hinge.facts is not None and hinge.facts.free_body
            if hinge.inboard_body == GROUND and not free:
                yield hinge

    def _girth(self, hinge: Hinge) -> float:
        """Radius in m of the thinner of the two bodies that a hinge joins."""
        radii = [self.radius]
        for name in (hinge.inboard_body, hinge.outboard_body):
            number = self.skeleton.bodies.find(name)
            if number is not None:
                radii.append(geometry.body_bar_radius(self.skeleton.bodies[number], self.size))
        return min(radii)

    def _feet(self) -> Iterator[Solid]:
        radii_by_position = {hinge.position: self._girth(hinge) for hinge in self._ground_hinges()}
        for number, (at, girth) in enumerate(radii_by_position.items(), 1):
            edge = 2.6 * (_FOOT_RADIUS_RATIO * girth)
            surface = box_surface((edge, edge, edge)).with_pose(at)
            yield Solid("ground", f"{number}", surface, geometry.GROUND_COLOUR)

    # --- lines ------------------------------------------------------------------------------------

    def _coils(self) -> Iterator[Line]:
        for spring in self.scene.spring:
            start, end = (
                self._spring_end_path(spring, spring.from_),
                self._spring_end_path(spring, spring.to),
            )
            points = geometry.spring_coil(start, end, _GLYPH_RADIUS_RATIO * self.radius)
            yield Line(f"springs/{spring.name}", points, geometry.SPRING_COLOUR)

    def _end_paths(self, name: str) -> list[Array]:
        """Paths (f, 3) of the ends of an elastic body, one array for each end."""
        ends = self.elastic[name].ends
        return [self.frame_times.poses(self.run, f"{name}.{end}").position for end in ends]

    def _spring_end_path(self, spring: Spring, reference: str) -> Array:
        """Path (f, 3) of an end of a spring."""
        if split_reference(reference)[0] == GROUND:
            return np.tile(np.array(spring.position), (len(self.frame_times.times), 1))
        return self.frame_times.poses(self.run, reference).position

    def _path_lines(self) -> Iterator[Line]:
        for reference in self.trails:
            if split_reference(reference)[0] == GROUND:
                raise SceneError(
                    f'trail of "{reference}": the ground does not move; give an end of a body'
                )
            path = self.frame_times.path(self.run, reference)
            yield Line(f"trails/{reference}", path[None], _TRAIL_COLOUR, 2.0)

    def _centre(self, name: str, body: Body) -> Array:
        """Label position of a body, in its axes."""
        flexible_body = self.run.model.flexible_bodies.get(name)
        if flexible_body is None or not flexible_body.ports:
            return geometry.body_centre(body)
        return np.mean([port.position for port in flexible_body.ports.values()], axis=0)

    # --- labels of the page -----------------------------------------------------------------------

    def _body_labels(self) -> Iterator[tuple[str, ObjectLabel]]:
        for name, body in zip(self.names, self.skeleton.bodies, strict=True):
            text = (
                (f"mass {body.mass:g} kg",)
                if name not in self.run.model.flexible_bodies
                else ("flexible",)
            )
            pose = self.poses[f"bodies/{name}"]
            labels = (("x", "m"), ("y", "m"), ("z", "m"))
            centre = self._centre(name, body)
            positions = pose.inertial_points(centre[None])[:, 0]
            lines = (*text, "mass centre at" if body.mass else "centre at")
            yield f"bodies/{name}", ObjectLabel(name, lines, centre, labels, positions)
        for hinge in self.hinges:
            if f"hinges/{hinge.name}" in self.poses:
                slots = self.run.coordinate_info(hinge.name)
                q = self.run.coordinates(hinge.name)
                coordinates = tuple(zip(slots.q_names, slots.q_units, strict=True))
                values = self.frame_times.interpolate_linear(q[self.frame_times.samples])
                yield (
                    f"hinges/{hinge.name}",
                    ObjectLabel(hinge.name, (hinge.type,), np.zeros(3), coordinates, values),
                )
