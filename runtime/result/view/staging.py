"""A run put on a stage: every body, hinge, spring and trail of it, over the moments of a film."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.numbers.rotations import IDENTITY
from mstmm.scene import Body, Hinge, Spring, split
from mstmm.scene.rules.values import GROUND

from . import bodies, flexible, hinges, shapes
from .acting import Acting, gravity
from .moments import Moments
from .solids import Colour, ellipsoid
from .stage import Bent, Line, Poses, Solid, Stage, Told

if TYPE_CHECKING:
    from ..record import Record

#: Colours of bodies, one after another: apart for the colour-blind too, on white and on black.
_COLOURS: tuple[Colour, ...] = (
    (68, 119, 170), (204, 119, 68), (68, 150, 90), (170, 90, 150), (190, 170, 60), (90, 180, 190),
    (190, 80, 90), (120, 130, 140),
)  # fmt: skip
_TRAIL: Colour = (150, 160, 175)

#: Hinges of a scene of more are not drawn.
_HINGES = 300
#: Radius of a hinge's glyph, and of a foot, by that of the bars that it joins.
_GLYPH, _FOOT = 1.6, 1.2
#: Samples by which the size of the scene is taken.
_LOOKS = 40


def staged(
    run: Record,
    title: str,
    trails: Sequence[str] = (),
    speed: float | None = None,
    most: int | None = None,
    when: Moments | None = None,
) -> Stage:
    """The stage of a run.  `trails`: ends whose ways are drawn; `speed`: seconds of the run per
    second of film; `most`: pictures at most; `when`: moments of one's own in place of these.
    SceneError for an end that there is not, and for a run without samples."""
    return _Staging(run, trails, speed, most, when).stage(title)


class _Staging:
    def __init__(
        self, run: Record, trails: Sequence[str], speed: float | None, most: int | None,
        when: Moments | None,
    ) -> None:  # fmt: skip
        self.run, self.scene = run, run.model.scene
        self.skeleton = self.scene.skeleton
        self.names = [self.skeleton.bodies.name(i) for i in range(len(self.skeleton.bodies))]
        drawn = len(self.scene.hinges) <= _HINGES
        self.hinges: Sequence[Hinge] = self.scene.hinges if drawn else ()
        owners = len(self.names) + len(self.hinges)
        self.when = when or Moments.of(run, owners, speed, most)
        self.trails = tuple(trails)
        self.elastic = {one.name: one for one in self.scene.elastic if one.name in self.names}
        run._observed.fetch(self.names)
        self.poses = {f"bodies/{name}": self.when.poses(run, name) for name in self.names}
        self.size = self._size()
        self.radius = bodies.thickness(self.size, self.size)
        self.acting = Acting(run, self.when, self.size)
        self.notes = () if drawn else (f"more than {_HINGES} hinges: they are not drawn",)

    def stage(self, title: str) -> Stage:
        solids = [*self._shapes(), *self._rigid(), *self._joints(), *self._feet()]
        self.poses |= dict(self.acting.poses())
        made = Stage(
            title=title, times=self.when.times, speed=self.when.speed, up=self._up(),
            poses=self.poses, solids=tuple(solids),
            bent=(*self._bent(), *self.acting.bent()),
            lines=(*self._coils(), *self._ways()),
            told=dict([*self._told(), *self.acting.told()]), notes=self.notes,
        )  # fmt: skip
        down = gravity(made, float(np.linalg.norm(self.scene.gravity)))
        if down is None:
            return made
        arrow, told = down
        return replace(made, solids=(*made.solids, arrow), told={**made.told, arrow.owner: told})

    # --- what is there ----------------------------------------------------------------------------

    def _size(self) -> float:
        """The diagonal (m) of the box that holds origins and ends of all bodies."""
        some = np.unique(np.linspace(0, len(self.when.times) - 1, _LOOKS).astype(int))
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for name, body in zip(self.names, self.skeleton.bodies, strict=True):
            pose = self.poses[f"bodies/{name}"]
            ends = np.array([(0.0, 0.0, 0.0), *(body.end_position(end) for end in body.ends)])
            places = Poses(pose.position[some], pose.quaternion[some]).of(ends)
            if name in self.elastic:
                places = np.stack([way[some] for way in self._ways_of(name)], axis=1)
            low = np.minimum(low, places.min(axis=(0, 1)))
            high = np.maximum(high, places.max(axis=(0, 1)))
        for hinge in self._held():
            at = np.array(hinge.position)
            low, high = np.minimum(low, at), np.maximum(high, at)
        size = float(np.linalg.norm(high - low)) if len(self.names) else 1.0
        return size if size > 0 else 1.0

    def _up(self) -> Array:
        gravity = np.array(self.scene.gravity)
        strength = float(np.linalg.norm(gravity))
        return -gravity / strength if strength > 0 else np.array([0.0, 0.0, 1.0])

    def _colour(self, name: str) -> Colour:
        return _COLOURS[self.names.index(name) % len(_COLOURS)]

    def _rigid(self) -> Iterator[Solid]:
        known = self.run.model.flexible
        drawn = {name for name, body in known.items() if body.shapes or body.skin}
        drawn |= {shape.owner for shape in self.scene.shape}
        joined = {hinge.inboard for hinge in self.scene.hinges}
        joined |= {hinge.outboard for hinge in self.scene.hinges}
        for i, (name, body) in enumerate(zip(self.names, self.skeleton.bodies, strict=True)):
            if name not in drawn:
                colour = _COLOURS[i % len(_COLOURS)]
                yield from bodies.rigid(name, body, name in joined, self.size, colour)

    def _shapes(self) -> Iterator[Solid]:
        """Every shape of the scene: such a body is drawn by its shapes alone."""
        kept = self.run.meshes
        for shape in self.scene.shape:
            if shape.is_on_ground:
                yield shapes.solid(shape, (0.0, 0.0, 0.0), IDENTITY, hinges.GROUND, kept)
                continue
            number = self.skeleton.bodies.find(shape.owner)
            assert number is not None
            body, end = self.skeleton.bodies[number], split(shape.on)[1]
            place, axes = body.end_position(end), body.end_rotation(end)
            colour = _COLOURS[number % len(_COLOURS)]
            yield shapes.solid(shape, place, axes, colour, kept)

    def _bent(self) -> Iterator[Bent]:
        shaped = {shape.owner for shape in self.scene.shape}
        for name, body in self.run.model.flexible.items():
            pose, colour = self.poses[f"bodies/{name}"], self._colour(name)
            if body.shapes is not None:
                yield flexible.tube(self.run, name, self.when, pose, self.size, colour)
            elif body.skin is not None and name not in shaped:
                r = 0.3 * self.radius
                yield flexible.outside(self.run, name, self.when, pose, r, colour)

    def _joints(self) -> Iterator[Solid]:
        for hinge in self.hinges:
            shown = hinges.glyph(hinge, _GLYPH * self._girth(hinge))
            if shown is not None:
                owner = f"hinges/{hinge.name}"
                self.poses[owner] = self._axes_of(hinge)
                yield Solid(owner, "glyph", shown, hinges.HINGE)
        for force in self.scene.bushing:
            owner = f"bushings/{force.name}"
            held = force.from_ if split(force.to)[0] == GROUND else force.to
            self.poses[owner] = self.when.poses(self.run, held)
            r = _GLYPH * self.radius
            yield Solid(owner, "glyph", ellipsoid((r, r, 0.6 * r), 10), hinges.SPRING)

    def _axes_of(self, hinge: Hinge) -> Poses:
        """Where a glyph is: with the outboard end; the rail of what slides alone stays behind."""
        outer = self.when.poses(self.run, hinge.outboard)
        if hinge.facts is None or hinge.facts.turns or not hinge.facts.slides:
            return outer
        if hinge.inboard_body == GROUND:
            start = np.tile(np.array(hinge.position), (len(self.when.times), 1))
        else:
            start = self.when.poses(self.run, hinge.inboard).position
        return Poses(start, outer.quaternion)

    def _held(self) -> Iterator[Hinge]:
        """Hinges that hold something to the ground."""
        for hinge in self.hinges:
            free = hinge.facts is not None and hinge.facts.free_body
            if hinge.inboard_body == GROUND and not free:
                yield hinge

    def _girth(self, hinge: Hinge) -> float:
        """Radius in m of the thinner of the two bodies that a hinge joins."""
        found = [self.radius]
        for name in (hinge.inboard_body, hinge.outboard_body):
            number = self.skeleton.bodies.find(name)
            if number is not None:
                found.append(bodies.girth(self.skeleton.bodies[number], self.size))
        return min(found)

    def _feet(self) -> Iterator[Solid]:
        places = {hinge.position: self._girth(hinge) for hinge in self._held()}
        for number, (at, girth) in enumerate(places.items(), 1):
            foot = hinges.foot(np.array(at), _FOOT * girth)
            yield Solid(foot.owner, f"{number}", foot.surface, foot.colour)

    # --- lines ------------------------------------------------------------------------------------

    def _coils(self) -> Iterator[Line]:
        for spring in self.scene.spring:
            start, end = self._place(spring, spring.from_), self._place(spring, spring.to)
            points = hinges.coil(start, end, _GLYPH * self.radius)
            yield Line(f"springs/{spring.name}", points, hinges.SPRING)

    def _ways_of(self, name: str) -> list[Array]:
        """(f, 3) where the ends of an elastic body are, each over the moments."""
        ends = self.elastic[name].ends
        return [self.when.poses(self.run, f"{name}.{end}").position for end in ends]

    def _place(self, spring: Spring, reference: str) -> Array:
        """(f, 3) where an end of a spring is."""
        if split(reference)[0] == GROUND:
            return np.tile(np.array(spring.position), (len(self.when.times), 1))
        return self.when.poses(self.run, reference).position

    def _ways(self) -> Iterator[Line]:
        for reference in self.trails:
            if split(reference)[0] == GROUND:
                raise SceneError(f'trail of "{reference}": the ground does not move; name an end')
            way = self.when.way(self.run, reference)
            yield Line(f"trails/{reference}", way[None], _TRAIL, 2.0)

    def _centre(self, name: str, body: Body) -> Array:
        """Where a body is pointed at, in its axes."""
        known = self.run.model.flexible.get(name)
        if known is None or not known.ports:
            return bodies.centre_of(body)
        return np.mean([port.position for port in known.ports.values()], axis=0)

    # --- what the page says -----------------------------------------------------------------------

    def _told(self) -> Iterator[tuple[str, Told]]:
        for name, body in zip(self.names, self.skeleton.bodies, strict=True):
            text = (
                (f"mass {body.mass:g} kg",)
                if name not in self.run.model.flexible
                else ("flexible",)
            )
            pose = self.poses[f"bodies/{name}"]
            labels = (("x", "m"), ("y", "m"), ("z", "m"))
            centre = self._centre(name, body)
            where = pose.of(centre[None])[:, 0]
            told = (*text, "its mass centre is at" if body.mass else "its middle is at")
            yield f"bodies/{name}", Told(name, told, centre, labels, where)
        for hinge in self.hinges:
            if f"hinges/{hinge.name}" in self.poses:
                slots = self.run.layout(hinge.name)
                q = self.run.coordinate(hinge.name)
                named = tuple(zip(slots.q_names, slots.q_units, strict=True))
                values = self.when.straight(q[self.when.kept])
                yield (
                    f"hinges/{hinge.name}",
                    Told(hinge.name, (hinge.type,), np.zeros(3), named, values),
                )
