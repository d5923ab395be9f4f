"""Model level of each flexible body, and the scene with these levels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import MstmmError
from mstmm.scene import Scene, split_reference
from mstmm.scene.tables.beam import DIRECTIONS, Beam, Modes
from mstmm.scene.tables.elastic import Elastic

from ...packing.expansion import LEVELS
from ...result.checks.flexible import MAX_LOAD_RATIO
from ...result.flexible.model_range import ModelRange
from ...result.one_way.response import rigidified_bodies
from ...result.one_way.result import OneWayResult
from ..model_levels import (
    beam_modes,
    exact_beam_names,
    vibration_mode_count,
    with_mode_counts,
    with_tables,
)
from ..tuning import REDUCTION as TUNING

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody
    from ...result.result import Result


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
        order = (*DIRECTIONS, VIBRATION)
        shapes.sort(key=lambda pair: order.index(pair[0]))
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


class Bodies:
    """Flexible bodies of a scene: their richest models, and the scene with other models."""

    def __init__(self, richest: Scene) -> None:
        self.scene = richest
        self._modes = beam_modes(richest)
        self._exact = exact_beam_names(richest)
        self.richest: dict[str, BodyModel] = {}
        bodies: tuple[Beam | Elastic, ...] = (*richest.beam, *richest.elastic)
        for body in bodies:
            if body.model != RIGID:
                level = STIFFENED if body.stiffening else LINEAR
                self.richest[body.name] = BodyModel(level, self._shape_counts(body))

    def has_linear_model(self, name: str) -> bool:
        """Whether a body has linear and one-way models; exact beams have none."""
        return name not in self._exact

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


@dataclass(frozen=True)
class ErrorPrediction:
    """Quantities of a run that estimate the errors of the models of one body.

    Attributes:
        deflection: d, m: largest deflection of its ends, with displacements by their rotation.
        by_shape: name of a shape -> its contribution to d, m.
        coupling: chi.
        load_ratio: gamma.
        slope: kappa.
        frequency: of the first shape, rad/s.
        spin_ratio: spin normal to the body over its first frequency.
        missed: truncated energy: fraction of the bending energy that its shapes miss; None if
            unknown.
        course: (t, deflection) at the samples, s and m.
    """

    deflection: float
    by_shape: Mapping[str, float]
    coupling: float
    load_ratio: float
    slope: float
    frequency: float
    spin_ratio: float
    missed: float | None = None
    course: tuple[tuple[float, float], ...] = ()

    def error(self, choice: BodyModel) -> float:
        """Estimated error of a model, m."""
        d, chi = self.deflection, self.coupling
        if choice.level == RIGID:
            return d
        shortening = d * self.load_ratio
        if choice.level == ONE_WAY:
            recoil = TUNING.recoil * chi / (1 - chi) if chi < 1 else TUNING.max_one_way
            return d * min(recoil, TUNING.max_one_way) + shortening
        left_out = sum(size for name, size in self.by_shape.items() if not choice.keeps_shape(name))
        return left_out + (shortening if choice.level == LINEAR else 0.0)

    def rise(self, until: float) -> float:
        """Ratio of the largest deflection to that until a time, s."""
        before = max((size for t, size in self.course if t <= until), default=0.0)
        return self.deflection / before if before > 0 else 1.0

    @property
    def frame_error(self) -> float:
        """Estimated error of a single floating frame, d kappa^2 / 2, m."""
        return self.deflection * min(self.slope**2 / 2, 1.0)

    @property
    def stiffens(self) -> bool:
        """Whether linear kinematics may diverge: large stiffening by loads or spin."""
        return self.load_ratio > MAX_LOAD_RATIO or self.spin_ratio > 1.0

    def to_dict(self) -> dict[str, Any]:
        """Plain values, without the course."""
        keys = ("deflection", "coupling", "load_ratio", "slope", "frequency", "spin_ratio",
                "missed")  # fmt: skip
        return {key: getattr(self, key) for key in keys} | {"by_shape": dict(self.by_shape)}


def body_predictions(result: Result, reach: float) -> dict[str, ErrorPrediction]:
    """Error estimates by body from a run with one-way or coupled flexible bodies.

    `reach` (m) is the lever arm by which rotations of an end displace the bodies attached to it.
    Raises NumericalFailure if the elastic response cannot be computed.
    """
    model = result.model
    bodies: Mapping[str, ModalBody] = model.flexible_bodies
    if isinstance(result, OneWayResult):
        bodies = rigidified_bodies(model).one_way
    ranges = {model_range.name: model_range for model_range in result.certificate.flexible_bodies}
    predictions = {}
    for name, body in bodies.items():
        if name in ranges:
            eta = (
                np.asarray(result.response(name).eta) if isinstance(result, OneWayResult)
                else result.q[:, model.coordinate_layout.modal[name].q_slice]
            )  # fmt: skip
            attached = [hinge.inboard for hinge in model.scene.hinge]
            attached += [chain.inboard for chain in model.scene.chain]
            loaded = {end for part, end in map(split_reference, attached) if part == name}
            predictions[name] = _body_prediction(
                body, result.t, np.abs(eta), ranges[name], loaded, reach
            )
    return predictions


def _body_prediction(
    body: ModalBody, t: Array, eta: Array, model_range: ModelRange, loaded: set[str], reach: float
) -> ErrorPrediction:
    """Error estimates for one body; eta are absolute modal coordinates (n, modes)."""
    by_shape, course = np.zeros(body.n), np.zeros(len(eta))
    for end, port in body.ports.items():
        displacement_per_eta = np.linalg.norm(port.phi, axis=0)
        if end in loaded:
            displacement_per_eta += reach * np.linalg.norm(port.theta, axis=0)
        displacements = displacement_per_eta * eta
        by_shape = np.maximum(by_shape, displacements.max(axis=0, initial=0.0))
        course = np.maximum(course, displacements.sum(axis=1))
    return ErrorPrediction(
        float(course.max(initial=0.0)), dict(zip(body.modes, by_shape.tolist(), strict=True)),
        0.0 if model_range.coupling is None else model_range.coupling[0], model_range.load_ratio,
        model_range.slope, model_range.first_frequency, model_range.spin_ratio, model_range.tail,
        tuple(zip(t.tolist(), course.tolist(), strict=True)),
    )  # fmt: skip


def predict_errors(result: Result | None, reach: float) -> tuple[dict[str, ErrorPrediction], str]:
    """Error estimates by body from a run, and the reason why there are none, or ""."""
    if result is None or not result.is_comparable:
        return {}, "" if result is None else result.message
    try:
        return body_predictions(result, reach), ""
    except (MstmmError, np.linalg.LinAlgError) as problem:
        return {}, str(problem)
