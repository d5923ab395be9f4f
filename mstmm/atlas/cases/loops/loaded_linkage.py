"""Frequencies of a linkage under load, with loads at its cut that do not rotate."""

from __future__ import annotations

import math

from ....runtime.model.model import Model
from ...case_definition import CaseDefinition, MethodDefinition
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import CRANK_INCLINATION, compile_looped, hanging_linkage
from ...variants import missing_load_stiffness

#: Moment of the weights of coupler and half the cranks with an arm of a crank (1 m), N*m.
WEIGHT_MOMENT = 2 * 9.81


def _linkage(load: float) -> Model:
    return compile_looped(hanging_linkage(WEIGHT_MOMENT / load))


def _error(load: float, squared: float) -> float:
    """Relative error of omega^2, against its closed form.

    The cranks of 1 m are inclined by a, the feet are 1 + 2 sin a apart, and all masses are 1.  The
    ends of the coupler stay 1 m apart to second order if the mean inclination grows by
    (1/2 + sin a) tan a s^2 for cranks that rotate by s.
    """
    sine, cosine = math.sin(CRANK_INCLINATION), math.cos(CRANK_INCLINATION)
    lift = cosine + (1 + 2 * sine) * sine**2 / cosine
    moment = 2 / 3 + cosine**2 + sine**2 / 3
    return abs(squared * moment / (WEIGHT_MOMENT / load + WEIGHT_MOMENT * lift) - 1)


def _error_with_frozen_loads(load: float) -> float:
    return _error(load, float(missing_load_stiffness.squared_frequencies(_linkage(load))[0]))


def _error_with_rotating_loads(load: float) -> float:
    return _error(load, float(_linkage(load).modes(1).omega[0]) ** 2)


CASE = CaseDefinition(
    name="loaded-linkage",
    title="Frequencies of closed loops: a linkage under load",
    cause="The tree of a mechanism, linearised along the motions that its loops allow, has the "
    "right masses and springs, and the weight of every body as if it swung independently. The "
    "loads of the loop are missing: those at its cut rotate with the rods, and stiffen or soften "
    "the whole. With stiff springs the error is small; for a linkage supported by its weight the "
    "frequency is wrong. The geometric stiffness of these loads belongs to the stiffness matrix.",
    parameter="weight times length over stiffness of the spring",
    unit="",
    low=1e-4,
    high=10.0,
    scale=LOG_SCALE,
    measured="error of the squared frequency, relative",
    limit=1e-2,
    method=MethodDefinition(
        "tree along its motions, loads of fixed direction", _error_with_frozen_loads
    ),
    remedy=MethodDefinition("loads rotate as well (model.modes)", _error_with_rotating_loads),
    reach=1e6,
    source="Gonzalez, Masarati, Cuadrado, Naya, Journal of Computational and Nonlinear Dynamics "
    "12, 2017 (linearised equations of constrained systems)",
)
