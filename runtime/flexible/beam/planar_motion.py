"""Does a scene move in a plane?  Then beams need shapes in that plane alone.

A structural test, exact: every hinge turns about one direction n or slides at right angles to it,
gravity and loads lie in the plane, all mass centres at one height over it, and n is a principal
direction of every inertia.  Anything that is not known to stay in the plane counts as leaving it.

What nothing pushes out of the plane may still buckle out of it.  That cannot come first where each
beam is at least as stiff across the plane as in it: hinges that turn about n alone hold every
deflection across that they hold in the plane, and bending about the softer axis does not twist a
beam (Timoshenko and Gere, Theory of Elastic Stability, 2nd ed., sections 2.1 and 6.3).  Springs and
constraints in the plane brace beams in it alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

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

#: Angles, and heights relative to the largest, below this are rounding.
_ROUNDING = 1e-9
#: Below 1 / sqrt(2): which of two axes at right angles is along a direction.
_HALF = 0.5


class PlanarMotionCheck:
    """Attitudes and heights of all bodies of a scene at q = 0, from which every plane is judged."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._turn: dict[str, Array] = {GROUND: np.eye(3)}
        self._origin: dict[str, Array] = {GROUND: np.zeros(3)}
        self._known: dict[tuple[float, ...], bool] = {}
        self._braced: dict[tuple[float, ...], bool] = {}
        self._ends = {b.name: b.ends for b in scene.body} | {b.name: b.ends for b in scene.beam}
        self.possible = not (scene.chain or scene.elastic) and self._place_all()

    def leaves(self, beam: str, axis: int) -> bool:
        """Could the beam deflect along its own axis 1 (y) or 2 (z)?"""
        if not self.possible:
            return True
        n = self._turn[beam][:, axis]
        key = _key(n)
        if key not in self._known:
            self._known[key] = self._in_plane(n)
        return not self._known[key]

    def stay(self, beam: str, axis: int, hinges: Sequence[Hinge]) -> bool:
        """Whether hinges move what they join at right angles to the beam's own axis 1 or 2."""
        n = self._turn[beam][:, axis]
        return all(self._hinge_stays(hinge, n) for hinge in hinges)

    def buckles(self, beam: str, axis: int) -> bool:
        """Whether loads in the plane at right angles to the beam's own axis 1 (y) or 2 (z) can
        buckle a beam of the scene along that axis before they buckle it in the plane."""
        n = self._turn[beam][:, axis]
        key = _key(n)
        if key not in self._braced:
            supports = [spring for spring in self.scene.spring if spring.law.stiffness]
            self._braced[key] = not (supports or self.scene.constraint) and all(
                self._is_stiffer_across(one, n) for one in self.scene.beam if one.model != "rigid"
            )
        return not self._braced[key]

    def _is_stiffer_across(self, beam: Beam, n: Array) -> bool:
        """Whether no section bends more easily along n than in the plane at right angles to it."""
        along_z = abs(float(self._turn[beam.name][:, 2] @ n)) > _HALF
        across, within = (0, 1) if along_z else (1, 0)  # [about y, about z]
        return all(
            piece.bending_stiffness is not None
            and piece.bending_stiffness[across] >= piece.bending_stiffness[within] * (1 - _ROUNDING)
            for piece in beam.sections
        )

    # --- where everything is ----------------------------------------------------------------------

    def _end(self, reference: str) -> tuple[str, Array, Array]:
        """(body, place in its axes, end axes -> body axes)."""
        name, end = split_reference(reference)
        if name == GROUND or not end:
            return name, np.zeros(3), np.eye(3)
        one = self._ends[name][end]
        return name, np.array(one.position), np.array(one.rotation)

    def _place_all(self) -> bool:
        """Poses at q = 0, from the ground outwards; False where one is not found."""
        waiting = list(self.scene.hinge)
        while waiting:
            rest = [hinge for hinge in waiting if not self._place(hinge)]
            if len(rest) == len(waiting):
                return False
            waiting = rest
        return all(name in self._turn for name in self._ends)

    def _place(self, hinge: Hinge) -> bool:
        inner, place, turn = self._end(hinge.inboard)
        if inner not in self._turn:
            return False
        outer, own, end = self._end(hinge.outboard)
        if inner == GROUND:
            place = np.array(hinge.position)
        attitude = self._turn[inner] @ turn @ np.array(hinge.rotation) @ end.T
        point = self._origin[inner] + self._turn[inner] @ place
        self._turn[outer], self._origin[outer] = attitude, point - attitude @ own
        return True

    # --- one plane --------------------------------------------------------------------------------

    def _in_plane(self, n: Array) -> bool:
        scene = self.scene
        gravity = np.array(scene.gravity)
        heights = self._heights(n)
        upright = abs(float(gravity @ n)) <= _ROUNDING * max(1.0, float(np.linalg.norm(gravity)))
        return (
            not scene.bushing
            and upright
            and heights is not None
            and all(self._hinge_stays(hinge, n) for hinge in scene.hinge)
            and all(self._load_stays(load, n, heights) for load in scene.load)
            and all(
                spring.type == "spring"
                and self._at_height(spring.from_, n, heights, np.array(spring.position))
                and self._at_height(spring.to, n, heights, np.array(spring.position))
                for spring in scene.spring
            )
        )

    def _heights(self, n: Array) -> float | None:
        """The one height over the plane of all mass centres; None if there is no such height, or
        if a body is not symmetric to the plane."""
        found = []
        for body in self.scene.body:
            own = self._turn[body.name].T @ n
            moment = np.array(body.inertia_matrix) @ own
            scale = float(np.abs(np.array(body.inertia_matrix)).max())
            if body.type != "rigid":
                return None
            if np.abs(moment - own * (own @ moment)).max() > _ROUNDING * max(scale, 1e-300):
                return None
            if body.mass:
                found.append(self._height(body.name, np.array(body.center_of_mass), n))
        for beam in self.scene.beam:
            if abs(self._turn[beam.name][:, 0] @ n) > _ROUNDING:
                return None
            if np.abs(self._turn[beam.name][:, 1:].T @ n).max() < 1 - _ROUNDING:
                return None
            found.append(self._height(beam.name, np.zeros(3), n))
        size = max(1.0, *(float(np.abs(o).max()) for o in self._origin.values()))
        level = max(found) - min(found) <= _ROUNDING * size
        return found[0] if level else None

    def _height(self, body: str, place: Array, n: Array) -> float:
        return float((self._origin[body] + self._turn[body] @ place) @ n)

    def _at_height(self, end: str, n: Array, height: float, ground: Array) -> bool:
        name, place, _ = self._end(end)
        where = self._height(name, ground if name == GROUND else place, n)
        return abs(where - height) <= _ROUNDING * max(1.0, abs(height))

    def _hinge_stays(self, hinge: Hinge, n: Array) -> bool:
        facts, motions = hinge.facts, initial_motion_axes(hinge)
        if facts is None or motions is None or not facts.in_place:
            return False
        outer, _, end = self._end(hinge.outboard)
        turn = self._turn[outer] @ end
        if facts.steady:
            return all(_stays(turn @ np.array(t), turn @ np.array(r), n) for t, r in motions)
        z = turn @ np.array(hinge_frames(hinge)[1])[:, 2]
        return facts.keeps_z and abs(float(z @ n)) >= 1 - _ROUNDING

    def _load_stays(self, load: Load, n: Array, height: float) -> bool:
        name, _, end = self._end(load.on)
        if load.axes == "inertial":
            turn = np.eye(3)
        elif load.axes == "body":
            turn = self._turn[name] @ (end if split_reference(load.on)[1] else np.eye(3))
        else:
            turn = self._turn.get(load.axes, np.eye(3))
        own = turn.T @ n
        pushes = (load.force, load.force_per_length or ())
        return (
            (load.at is not None or self._at_height(load.on, n, height, np.zeros(3)))
            and all(_nothing(push, own) for push in pushes if push)
            and _only(load.moment, own)
        )


def _key(n: Array) -> tuple[float, ...]:
    """The same for a direction and its opposite."""
    return tuple(np.round(n * np.sign(n[np.argmax(np.abs(n))]), 9) + 0.0)


def _stays(translation: Array, rotation: Array, n: Array) -> bool:
    """A motion in the plane: it slides at right angles to n and turns about n."""
    about = float(np.linalg.norm(rotation))
    return (
        abs(float(translation @ n)) <= _ROUNDING * max(float(np.linalg.norm(translation)), 1e-300)
        and abs(float(rotation @ n)) >= (1 - _ROUNDING) * about
    )


def _nothing(push: tuple[Expression, ...], n: Array) -> bool:
    """No component along n: every axis that n leans on has none."""
    return all(p.is_zero for p, share in zip(push, n, strict=True) if abs(share) > _ROUNDING)


def _only(moment: tuple[Expression, ...], n: Array) -> bool:
    """No component but along n, which lies along an axis."""
    return all(m.is_zero for m, share in zip(moment, n, strict=True) if abs(share) < 1 - _ROUNDING)
