"""Frequencies of a linkage under load, with loads at its cut that do not rotate."""

from __future__ import annotations

import math

from ....runtime.model.model import Model
from ...definition import Definition, Method
from ...scale import LOG
from ...scenes import LEAN, hung_linkage, model
from ...variants import still_loads

#: Moment of the weights of coupler and half the cranks with an arm of a crank (1 m), N*m.
WEIGHT = 2 * 9.81


def _linkage(load: float) -> Model:
    return model(hung_linkage(WEIGHT / load))


def _error(load: float, squared: float) -> float:
    """Relative error of omega^2, against its closed form.

    The cranks of 1 m are inclined by a, the feet are 1 + 2 sin a apart, and all masses are 1.  The
    ends of the coupler stay 1 m apart to second order if the mean inclination grows by
    (1/2 + sin a) tan a s^2 for cranks that rotate by s.
    """
    sine, cosine = math.sin(LEAN), math.cos(LEAN)
    lifted = cosine + (1 + 2 * sine) * sine**2 / cosine
    moment = 2 / 3 + cosine**2 + sine**2 / 3
    return abs(squared * moment / (WEIGHT / load + WEIGHT * lifted) - 1)


def _still(load: float) -> float:
    return _error(load, float(still_loads.squared_frequencies(_linkage(load))[0]))


def _turned(load: float) -> float:
    return _error(load, float(_linkage(load).modes(1).omega[0]) ** 2)


CASE = Definition(
    name="loaded-linkage",
    title="Frequencies of closed loops: a linkage under load",
    why="The tree of a mechanism, linearised along the motions that its loops allow, has the "
    "right masses and springs, and the weight of every body as if it swung independently. The "
    "loads of the loop are missing: those at its cut rotate with the rods, and stiffen or soften "
    "the whole. With stiff springs the error is small; for a linkage supported by its weight the "
    "frequency is wrong. The geometric stiffness of these loads belongs to the stiffness matrix.",
    parameter="weight times length over stiffness of the spring", unit="",
    low=1e-4, high=10.0, scale=LOG,
    measured="error of the squared frequency, relative", limit=1e-2,
    method=Method("tree along its motions, loads of fixed direction", _still),
    remedy=Method("loads rotate as well (model.modes)", _turned), reach=1e6,
    source="Gonzalez, Masarati, Cuadrado, Naya, Journal of Computational and Nonlinear Dynamics "
    "12, 2017 (linearised equations of constrained systems)",
)  # fmt: skip
