"""Model level of each flexible body, and the scene with these levels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mstmm.scene import Scene
from mstmm.scene.tables.beam import DIRECTIONS, Beam, Modes
from mstmm.scene.tables.elastic import Elastic

from ..chart.model_levels import beam_modes, vibration_mode_count, with_mode_counts, with_tables
from ..packing.flexible.rigid_substitution import LEVELS

RIGID, ONE_WAY, LINEAR, STIFFENED = "rigid", "one-way", "linear", "stiffened"

#: Key of the number of shapes of an elastic body: its vibration shapes, without the static ones.
VIBRATION = "vibration"


@dataclass(frozen=True)
class BodyModel:
    """Model level and shapes of one flexible body.

    Attributes:
        level: rigid, one-way, linear or stiffened.
        shapes: (direction, number of its first shapes), without directions that have none; of an
            elastic body ("vibration", n) in addition to its static shapes.
    """

    level: str
    shapes: tuple[tuple[str, int], ...] = ()

    @property
    def is_coupled(self) -> bool:
        """Whether the body is coupled with the motion of the hinges."""
        return self.level in (LINEAR, STIFFENED)

    @property
    def total(self) -> int:
        """Number of shapes that are integrated in a run."""
        return sum(count for _, count in self.shapes) if self.is_coupled else 0

    def keeps_shape(self, mode: str) -> bool:
        """Whether a shape of this name ("y2") is kept; static shapes always are."""
        direction = mode.rstrip("0123456789")
        counts = dict(self.shapes)
        if VIBRATION in counts:
            return True
        return int(mode[len(direction) :]) <= counts.get(direction, 0)

    def with_count(self, direction: str, count: int) -> BodyModel:
        """Copy with this number of shapes in one direction."""
        counts = {**dict(self.shapes), direction: count}
        keep_zero = direction == VIBRATION  # static shapes remain without vibration shapes
        shapes = [pair for pair in counts.items() if pair[1] or keep_zero]
        shapes.sort(key=lambda pair: _direction_index(pair[0]))
        return BodyModel(self.level, tuple(shapes))

    def __str__(self) -> str:
        if self.level == RIGID:
            return RIGID
        parts = [_count_text(direction, count) for direction, count in self.shapes]
        return f"{self.level}, shapes {' + '.join(parts)}" if parts else self.level


def _count_text(direction: str, count: int) -> str:
    if direction != VIBRATION:
        return f"{count} {direction}"
    return f"static + {count} vibration" if count else "static only"


def _direction_index(direction: str) -> int:
    return DIRECTIONS.index(direction) if direction in DIRECTIONS else len(DIRECTIONS)


class Bodies:
    """Flexible bodies of a scene: their richest models, and the scene with other models."""

    def __init__(self, richest: Scene) -> None:
        self.scene = richest
        self._modes = beam_modes(richest)
        self.richest: dict[str, BodyModel] = {}
        bodies: tuple[Beam | Elastic, ...] = (*richest.beam, *richest.elastic)
        for body in bodies:
            if body.model != RIGID:
                level = STIFFENED if body.stiffening else LINEAR
                self.richest[body.name] = BodyModel(level, self._shape_counts(body))

    def _shape_counts(self, body: Beam | Elastic) -> tuple[tuple[str, int], ...]:
        if isinstance(body, Elastic):
            return ((VIBRATION, vibration_mode_count(body)),)
        modes = self._modes[body.name]
        return tuple(
            (direction, getattr(modes, direction))
            for direction in DIRECTIONS
            if getattr(modes, direction)
        )

    def scene_of(self, choices: Mapping[str, BodyModel]) -> Scene:
        """The scene with these models of its flexible bodies."""

        def choose_model(body: Any) -> Any:
            choice = choices.get(body.name)
            return body if choice is None else self._with_choice(body, choice)

        return with_tables(
            self.scene,
            beam=tuple(map(choose_model, self.scene.beam)),
            elastic=tuple(map(choose_model, self.scene.elastic)),
        )

    def _with_choice(self, body: Any, choice: BodyModel) -> Any:
        if not choice.is_coupled:
            return body.model_copy(update={"model": LEVELS[choice.level]})
        update: dict[str, Any] = {
            "model": LEVELS["coupled"], "stiffening": choice.level == STIFFENED,
        }  # fmt: skip
        if isinstance(body, Elastic):
            return body.model_copy(update=update | {"modes": dict(choice.shapes)[VIBRATION]})
        kept = Modes(**dict(choice.shapes))
        return with_mode_counts(body, self._modes[body.name], kept).model_copy(update=update)


def given_body_model(body: Beam | Elastic, richest: BodyModel) -> BodyModel:
    """Model of a body in the given scene."""
    if body.model == ONE_WAY:
        return BodyModel(ONE_WAY, richest.shapes)
    return BodyModel(STIFFENED if body.stiffening else LINEAR, richest.shapes)
