"""Frequencies of a linkage under load, by matrices that leave out how loads at its cut turn."""

from __future__ import annotations

import math

from ....runtime.model.model import Model
from ...definition import Definition, Method
from ...scale import LOG
from ...scenes import LEAN, hung_linkage, model
from ...variants import still_loads

#: Moment of the weights of coupler and half the cranks by the metre of a crank, N*m.
WEIGHT = 2 * 9.81


def _linkage(load: float) -> Model:
    return model(hung_linkage(WEIGHT / load))


def _error(load: float, squared: float) -> float:
    """Of omega^2, beside its closed form.

    With cranks of 1 m that lean by a, feet apart by 1 + 2 sin a and all masses 1, the ends of the
    coupler stay 1 m apart to second order where the mean lean grows by (1/2 + sin a) tan a s^2 for
    cranks that turn by s.
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
    why="The tree of a mechanism, made linear along the motions that its loops leave, has masses "
    "and springs right, and the weight of all bodies as if each swung by itself. What the loop "
    "carries is missing: the loads at its cut turn with the rods, and stiffen or soften the whole. "
    "Where springs are stiff nobody sees it; of a linkage that is held by its weight the frequency "
    "is wrong. The stiffness of these loads belongs to the matrix, with what they are there.",
    parameter="weight times length over stiffness of the spring", unit="",
    low=1e-4, high=10.0, scale=LOG,
    measured="error of the squared frequency, relative", limit=1e-2,
    method=Method("tree along its motions, loads standing still", _still),
    remedy=Method("loads turned as well (model.modes)", _turned), reach=1e6,
    source="Gonzalez, Masarati, Cuadrado, Naya, Journal of Computational and Nonlinear Dynamics "
    "12, 2017 (linearised equations of constrained systems)",
)  # fmt: skip
