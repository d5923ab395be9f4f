"""What acts on the bodies, as arrows: loads and gravity."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.scene import Load, split

from ..flexible import motion as observed
from ..owners.acting import Acting as Values
from ..owners.loads import turned
from . import arrows, flexible
from .moments import Moments
from .solids import Colour, Faces, Surface
from .stage import Bent, Poses, Solid, Stage, Told

if TYPE_CHECKING:
    from ..record import Record

_LOAD: Colour = (205, 55, 50)
_GRAVITY: Colour = (85, 105, 130)
#: Length of the largest force, radius of the largest moment, thickness of their arrows, by the size
#: of the scene; the same of gravity's arrow, and how far it is from the scene.
_FORCE, _MOMENT, _THICK = 0.16, 0.08, 0.005
_DOWN, _THIN, _ASIDE = 0.1, 0.0035, 0.05
#: Arrows of a load per length, and how long they are beside one of the same force.
_COMB, _SHORT = 7, 0.5


@dataclass(frozen=True)
class _Seen:
    """A load over the moments: force (f, 3) N and moment (f, 3) N*m, where it acts (f, 3) m, all
    places if there are several, and the axes of its end."""

    load: Load
    force: Array
    moment: Array
    places: list[Array]
    pose: Poses


class Acting:
    """The loads of a run, over the moments of a film; `size` (m) is that of the scene."""

    def __init__(self, run: Record, when: Moments, size: float) -> None:
        self.run, self.when, self.size = run, when, size
        values = Values(run._observed)
        self.seen = [self._one(one, k, values) for k, one in enumerate(run.model.scene.load)]

    def _one(self, load: Load, number: int, values: Values) -> _Seen:
        numbers = values.system.loads[number]
        both = np.hstack([turned(values, number, x) for x in (numbers.force, numbers.moment)])
        both = self.when.straight(both[self.when.kept])
        beams = {beam.name for beam in self.run.model.scene.beam}
        at_root = load.on in beams and load.force_per_length is None
        pose = self.when.poses(self.run, f"{load.on}.root" if at_root else load.on)
        if load.at is not None:
            points = values.load(number)[0][self.when.kept]
            pose = replace(pose, position=self.when.smooth(points[:, 0:3], points[:, 3:6]))
        places = [pose.position]
        if load.force_per_length is not None and split(load.on)[0] in self.run.model.flexible:
            places = self._along(load, pose)
        return _Seen(load, both[:, :3], both[:, 3:], places, pose)

    def _along(self, load: Load, pose: Poses) -> list[Array]:
        shown = flexible.motion_at(self.run, split(load.on)[0], self.when, pose)
        first, last = load.span or (0.0, float(shown.shapes.length))
        return list(np.moveaxis(observed.shape(shown, np.linspace(first, last, _COMB)), 1, 0))

    def bent(self) -> Iterator[Bent]:
        """Arrows of forces and moments, those of a kind to one scale."""
        most = max((_largest(one.force) for one in self.seen), default=0.0)
        strongest = max((_largest(one.moment) for one in self.seen), default=0.0)
        thick = _THICK * self.size
        for one in self.seen:
            if _largest(one.force) > 0:
                part = 1.0 if len(one.places) == 1 else _SHORT
                vector = part * _FORCE * self.size / most * one.force
                drawn = [arrows.straight(place, vector, thick) for place in one.places]
                yield _bent(f"forces/{one.load.name}", drawn)
            if _largest(one.moment) > 0:
                vector = _MOMENT * self.size / strongest * one.moment
                drawn = [arrows.turned(place, vector, thick) for place in one.places]
                yield _bent(f"moments/{one.load.name}", drawn)

    def poses(self) -> Iterator[tuple[str, Poses]]:
        """Owners of what the page says of loads."""
        for one in self.seen:
            yield f"loads/{one.load.name}", one.pose

    def told(self) -> Iterator[tuple[str, Told]]:
        """What the page says of them."""
        for one in self.seen:
            numbers = [(f"force {x}", "N", v) for x, v in zip("xyz", one.force.T, strict=True)]
            numbers += [(f"moment {x}", "N m", v) for x, v in zip("xyz", one.moment.T, strict=True)]
            there = [number for number in numbers if number[2].any()]
            labels = tuple((label, unit) for label, unit, _ in there)
            values = np.array([v for *_, v in there]).reshape(len(there), len(one.force)).T
            where = f", at its {one.load.at}" if one.load.at else ""
            text = (f'load on "{one.load.on}"{where}',)
            yield f"loads/{one.load.name}", Told(one.load.name, text, np.zeros(3), labels, values)


def _largest(vectors: Array) -> float:
    return float(np.linalg.norm(np.nan_to_num(vectors), axis=1).max(initial=0.0))


def _bent(name: str, drawn: list[tuple[Array, Faces]]) -> Bent:
    starts = np.cumsum([0, *(vertices.shape[1] for vertices, _ in drawn)])
    faces = [faces + start for (_, faces), start in zip(drawn, starts, strict=False)]
    vertices = np.concatenate([np.nan_to_num(vertices) for vertices, _ in drawn], axis=1)
    return Bent(name, vertices, np.concatenate(faces), _LOAD)


def gravity(stage: Stage, strength: float) -> tuple[Solid, Told] | None:
    """An arrow beside everything that is drawn, down; None without gravity (m/s2)."""
    if not strength > 0:
        return None
    low, high = stage.corners()
    up, size = stage.up, stage.size
    level = np.abs(high - low) - np.abs(up) * np.abs(high - low)
    aside = np.eye(3)[int(np.argmax(level))]
    aside = aside - (aside @ up) * up
    aside = aside / np.linalg.norm(aside)
    reach = float(((stage.cloud - low) @ aside).min())
    at = (low + high) / 2
    at = at + (reach - (at - low) @ aside - _ASIDE * size) * aside + _DOWN / 2 * size * up
    vertices, faces = arrows.straight(at[None], -_DOWN * size * up[None], _THIN * size)
    arrow = Solid("gravity", "arrow", Surface(vertices[0], faces), _GRAVITY)
    return arrow, Told("gravity", (f"{strength:.6g} m/s2",), at - _DOWN / 2 * size * up)
