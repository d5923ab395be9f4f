"""Redundant rows of a planar mechanism in space, with slightly misaligned axes."""

from __future__ import annotations

from functools import cache

import numpy as np

from ....arrays import Array
from ....errors import NumericalFailure, SceneError
from ....runtime.model.model import Model
from ...definition import Definition, Method
from ...scale import LOG
from ...scenes import four_bar, model
from ...variants import all_rows


@cache
def _linkage(askew: float) -> Model:
    try:
        return model(four_bar(askew=askew))
    except SceneError as refused:
        raise NumericalFailure(str(refused)) from None


def _error(found: Array) -> float:
    """Relative error against the linkage with parallel axes."""
    straight = _linkage(0.0)
    wanted = straight.accelerations(*straight.initial_state())[: len(found)]
    return float(np.abs(found - wanted).max() / np.abs(wanted).max())


def _all(askew: float) -> float:
    linkage, tree = _linkage(askew), model(four_bar(askew=askew, closed=False))
    return _error(all_rows.accelerations_at_rest(linkage, tree, linkage.initial_state()[0]))


def _some(askew: float) -> float:
    linkage = _linkage(askew)
    return _error(linkage.accelerations(*linkage.initial_state())[:3])


CASE = Definition(
    name="repeated-rows",
    title="Redundant rows with axes not quite parallel: a four-bar",
    why="A pin that closes a planar loop in space has five rows, of which three are redundant. "
    "Where the axes are misaligned by less than any drawing tolerance, these rows disagree by the "
    "square of the angle. Once that exceeds rounding, a rank by rounding keeps them, and the "
    "linkage is locked. Compared with the mobility of their hinge they are redundant, and are left "
    "out for the whole run. Where the gap that they leave is a thousandth of the scene, the scene "
    "is rejected with a message.",
    parameter="misalignment of the axes", unit="rad", low=1e-11, high=1e-3, scale=LOG,
    measured="error of the accelerations, relative", limit=1e-3,
    method=Method("all rows, rank by rounding (pseudo-inverse)", _all),
    remedy=Method("rows compared by mobility, a fixed choice", _some), reach=1e-2,
    source="Garcia de Jalon, Gutierrez-Lopez, Multibody System Dynamics 30, 2013 (redundant "
    "constraints and their forces)",
)  # fmt: skip
