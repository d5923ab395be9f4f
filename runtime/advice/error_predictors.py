"""What is expected of each flexible body before any richer model runs.

From one run in which all of them respond one way, and from invariants.  Per body: how far its
ends deflect (d), the share of the inertia at its hinge that a shape holds (chi), what its loads
change of its stiffness (gamma), its largest slope (kappa).  A rigid body errs by d, a one-way
response by about 3 d chi / (1 - chi), linear kinematics by d gamma, shapes left out by what they
deflect the ends, and any single floating frame by up to d kappa^2 / 2.

Padilla, von Flotow, J. Guidance 15 (1992) 148-155 (when stress stiffening may be left out).
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

#: Recoil and phase of a response that is not coupled, in d chi / (1 - chi); and the most that it
#: may err by, in d: out of phase with a recoil as large as itself.
_RECOIL, _MOST = 3.0, 2.0


@dataclass(frozen=True)
class ErrorPrediction:
    """What a run tells of one body.

    Attributes:
        deflection: d, m, the largest of its ends, with what its rotation displaces.
        by_shape: name of a shape -> its part of that, m.
        coupling: chi.
        load_ratio: gamma.
        slope: kappa.
        frequency: rad/s, of its first shape.
        spin_ratio: spin across the body over its first frequency.
        missed: part of the bending energy that all its shapes miss; None where it is not known.
        course: (t, deflection) over the samples, s and m.
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
        """Expected of a choice, m."""
        d, chi = self.deflection, self.coupling
        if choice.level == RIGID:
            return d
        shortening = d * self.load_ratio
        if choice.level == ONE_WAY:
            recoil = _RECOIL * chi / (1 - chi) if chi < 1 else _MOST
            return d * min(recoil, _MOST) + shortening
        left_out = sum(size for name, size in self.by_shape.items() if not choice.keeps(name))
        return left_out + (shortening if choice.level == LINEAR else 0.0)

    def rise(self, until: float) -> float:
        """How many times more it deflects at any time than up to one, s."""
        before = max((size for t, size in self.course if t <= until), default=0.0)
        return self.deflection / before if before > 0 else 1.0

    @property
    def frame_error(self) -> float:
        """Of one floating frame, d kappa^2 / 2, m."""
        return self.deflection * min(self.slope**2 / 2, 1.0)

    @property
    def stiffens(self) -> bool:
        """Whether linear kinematics may diverge."""
        return self.load_ratio > MAX_LOAD_RATIO or self.spin_ratio > 1.0

    def to_dict(self) -> dict[str, Any]:
        """Plain values, without the course."""
        keys = ("deflection", "coupling", "load_ratio", "slope", "frequency", "spin_ratio",
                "missed")  # fmt: skip
        return {key: getattr(self, key) for key in keys} | {"by_shape": dict(self.by_shape)}


def evidence_of(result: Result, reach: float) -> dict[str, ErrorPrediction]:
    """Body -> what a run tells in which it responds one way, or coupled; `reach` (m) is how far
    rotations of ends displace what is fixed there.

    Raises NumericalFailure where the response cannot be had.
    """
    model = result.model
    bodies: Mapping[str, ModalBody] = model.flexible
    if isinstance(result, OneWayResult):
        bodies = rigidified_bodies(model).one_way
    known = {one.name: one for one in result.certificate.flexible}
    found = {}
    for name, body in bodies.items():
        if name in known:
            eta = _coordinates(result, name)
            loaded = _loaded(result.model, name)
            found[name] = _one(body, result.t, np.abs(eta), known[name], loaded, reach)
    return found


def _coordinates(result: Result, name: str) -> Array:
    """(n, modes) modal coordinates."""
    if isinstance(result, OneWayResult):
        return np.asarray(result.response(name).eta)
    return result.q[:, result.model.layout.modal[name].q_slice]


def _loaded(model: CompiledScene, name: str) -> set[str]:
    """Ends at which another body is fixed."""
    return {
        end
        for h in model.scene.hinge
        for body, end in (split_reference(h.inboard),)
        if body == name
    } | {
        end
        for c in model.scene.chain
        for body, end in (split_reference(c.inboard),)
        if body == name
    }


def _one(
    body: ModalBody, t: Array, eta: Array, seen: ModelRange, loaded: set[str], reach: float
) -> ErrorPrediction:
    by_shape, course = np.zeros(body.n), np.zeros(len(eta))
    for end, port in body.ports.items():
        each = np.linalg.norm(port.phi, axis=0)
        if end in loaded:
            each = each + reach * np.linalg.norm(port.theta, axis=0)
        moved = each * eta
        by_shape = np.maximum(by_shape, moved.max(axis=0, initial=0.0))
        course = np.maximum(course, moved.sum(axis=1))
    return ErrorPrediction(
        float(course.max(initial=0.0)), dict(zip(body.modes, by_shape.tolist(), strict=True)),
        0.0 if seen.coupling is None else seen.coupling[0], seen.load_ratio, seen.slope,
        seen.first_frequency, seen.spin_ratio, seen.tail,
        tuple(zip(t.tolist(), course.tolist(), strict=True)),
    )  # fmt: skip


def predict_errors(result: Result | None, reach: float) -> tuple[dict[str, ErrorPrediction], str]:
    """The evidence, and why there is none."""
    if result is None or not result.is_comparable:
        return {}, "" if result is None else result.message
    try:
        return evidence_of(result, reach), ""
    except (MstmmError, np.linalg.LinAlgError) as problem:
        return {}, str(problem)
