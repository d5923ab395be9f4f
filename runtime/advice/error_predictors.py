"""Error estimates for the models of each flexible body, before richer models are run.

They use a run with one-way coupling and properties of the body: deflection of its ends (d), share
of the inertia at its hinge that a shape has (chi), relative change of its stiffness by loads
(gamma) and largest slope (kappa).  The error of a rigid body is d, of one-way coupling about
3 d chi / (1 - chi), of linear kinematics d gamma, of omitted shapes their deflection of the ends,
and of a single floating frame up to d kappa^2 / 2.

Padilla, von Flotow, J. Guidance 15 (1992) 148-155 (when stress stiffening is negligible).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import MstmmError
from mstmm.scene import split_reference

from ..result.flexible.model_range import ModelRange
from ..result.flexible.risks import MAX_LOAD_RATIO
from ..result.one_way.response import rigidified_bodies
from ..result.one_way.result import OneWayResult
from .body_model_levels import LINEAR, ONE_WAY, RIGID, BodyModel

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..flexible.modal_body import ModalBody
    from ..result.result import Result

#: Error of one-way coupling by recoil and phase, in d chi / (1 - chi); and its largest value, in d:
#: out of phase, with a recoil as large as the deflection.
_RECOIL, _MAX_ONE_WAY = 3.0, 2.0


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
            recoil = _RECOIL * chi / (1 - chi) if chi < 1 else _MAX_ONE_WAY
            return d * min(recoil, _MAX_ONE_WAY) + shortening
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
            eta = np.abs(_modal_coordinates(result, name))
            loaded = _loaded_ends(result.model, name)
            predictions[name] = _body_prediction(body, result.t, eta, ranges[name], loaded, reach)
    return predictions


def _modal_coordinates(result: Result, name: str) -> Array:
    """(n, modes) modal coordinates."""
    if isinstance(result, OneWayResult):
        return np.asarray(result.response(name).eta)
    return result.q[:, result.model.coordinate_layout.modal[name].q_slice]


def _loaded_ends(model: CompiledScene, name: str) -> set[str]:
    """Ends of a body that are the inboard end of a hinge or chain."""
    inboard = [hinge.inboard for hinge in model.scene.hinge]
    inboard += [chain.inboard for chain in model.scene.chain]
    return {end for body, end in map(split_reference, inboard) if body == name}


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
