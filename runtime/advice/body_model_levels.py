"""A level of model for each flexible body, and the scene that has it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mstmm.scene import Scene
from mstmm.scene.tables.beam import Beam
from mstmm.scene.tables.beam_keys import DIRECTIONS, Modes
from mstmm.scene.tables.elastic import Elastic

from ..chart.model_levels import beam_modes, vibration_mode_count, with_mode_counts, with_tables
from ..packing.flexible.rigid_substitution import LEVELS

RIGID, ONE_WAY, LINEAR, STIFFENED = "rigid", "one-way", "linear", "stiffened"

#: What the shapes of an elastic body are counted under: vibration shapes beside its static ones.
VIBRATION = "vibration"


@dataclass(frozen=True)
class BodyModel:
    """What one flexible body is to be.

    Attributes:
        level: rigid, one-way, linear or stiffened.
        shapes: (direction, how many of its first shapes), directions without any left out; of an
            elastic body ("vibration", n) beside its static ones.
    """

    level: str
    shapes: tuple[tuple[str, int], ...] = ()

    @property
    def coupled(self) -> bool:
        """Whether its shapes move together with the hinges."""
        return self.level in (LINEAR, STIFFENED)

    @property
    def total(self) -> int:
        """How many shapes a run integrates."""
        return sum(n for _, n in self.shapes) if self.coupled else 0

    def keeps(self, mode: str) -> bool:
        """Whether a shape of this name ("y2") is among those kept; static shapes always are."""
        direction = mode.rstrip("0123456789")
        counts = dict(self.shapes)
        if VIBRATION in counts:
            return True
        return int(mode[len(direction) :]) <= counts.get(direction, 0)

    def with_count(self, direction: str, count: int) -> BodyModel:
        """With so many shapes in one direction."""
        counts = {**dict(self.shapes), direction: count}
        always = direction == VIBRATION  # static shapes stay where no vibration does
        kept = tuple((word, n) for word, n in counts.items() if n or always)
        return BodyModel(self.level, tuple(sorted(kept, key=lambda pair: _place(pair[0]))))

    def __str__(self) -> str:
        if self.level == RIGID:
            return RIGID
        parts = [_counted(word, n) for word, n in self.shapes]
        return f"{self.level}, shapes {' + '.join(parts)}" if parts else self.level


def _counted(direction: str, n: int) -> str:
    if direction != VIBRATION:
        return f"{n} {direction}"
    return f"static + {n} of vibration" if n else "static alone"


def _place(direction: str) -> int:
    return DIRECTIONS.index(direction) if direction in DIRECTIONS else len(DIRECTIONS)


class Bodies:
    """The flexible bodies of a scene in its richest form, and the scene with others' choices."""

    def __init__(self, richest: Scene) -> None:
        self.scene = richest
        self._modes = beam_modes(richest)
        self.richest: dict[str, BodyModel] = {}
        found: tuple[Beam | Elastic, ...] = (*richest.beam, *richest.elastic)
        for body in found:
            if body.model != RIGID:
                level = STIFFENED if body.stiffening else LINEAR
                self.richest[body.name] = BodyModel(level, self._counts(body))

    def _counts(self, body: Beam | Elastic) -> tuple[tuple[str, int], ...]:
        if isinstance(body, Elastic):
            return ((VIBRATION, vibration_mode_count(body)),)
        modes = self._modes[body.name]
        return tuple((w, getattr(modes, w)) for w in DIRECTIONS if getattr(modes, w))

    def scene_of(self, choices: Mapping[str, BodyModel]) -> Scene:
        """The scene with these choices."""

        def changed(body: Any) -> Any:
            choice = choices.get(body.name)
            return body if choice is None else self._changed(body, choice)

        return with_tables(
            self.scene,
            beam=tuple(map(changed, self.scene.beam)),
            elastic=tuple(map(changed, self.scene.elastic)),
        )

    def _changed(self, body: Any, choice: BodyModel) -> Any:
        if not choice.coupled:
            return body.model_copy(update={"model": LEVELS[choice.level]})
        update: dict[str, Any] = {
            "model": LEVELS["coupled"], "stiffening": choice.level == STIFFENED,
        }  # fmt: skip
        if isinstance(body, Elastic):
            return body.model_copy(update=update | {"modes": dict(choice.shapes)[VIBRATION]})
        kept = Modes(**dict(choice.shapes))
        return with_mode_counts(body, self._modes[body.name], kept).model_copy(update=update)


def given_choice(body: Beam | Elastic, richest: BodyModel) -> BodyModel:
    """What a body is in the scene as it was written."""
    if body.model == ONE_WAY:
        return BodyModel(ONE_WAY, richest.shapes)
    return BodyModel(STIFFENED if body.stiffening else LINEAR, richest.shapes)
