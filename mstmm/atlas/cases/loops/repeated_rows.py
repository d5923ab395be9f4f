"""Redundant rows of a planar mechanism in space, with slightly misaligned axes."""

from __future__ import annotations

from functools import cache

import numpy as np

from ....array_validation import Array
from ....errors import NumericalFailure, SceneError
from ....runtime.model.model import Model
from ...case_definition import CaseDefinition, MethodDefinition
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped, four_bar
from ...variants import redundant_rows


@cache
def _linkage(askew: float) -> Model:
    try:
        return compile_looped(four_bar(askew=askew))
    except SceneError as error:
        raise NumericalFailure(str(error)) from None


def _error(udot: Array) -> float:
    """Relative error against the linkage with parallel axes."""
    aligned = _linkage(0.0)
    exact = aligned.accelerations(*aligned.initial_state())[: len(udot)]
    return float(np.abs(udot - exact).max() / np.abs(exact).max())


def _error_with_all_rows(askew: float) -> float:
    linkage, tree = _linkage(askew), compile_looped(four_bar(askew=askew, closed=False))
    return _error(redundant_rows.accelerations_at_rest(linkage, tree, linkage.initial_state()[0]))


def _error_with_fixed_rows(askew: float) -> float:
    linkage = _linkage(askew)
    return _error(linkage.accelerations(*linkage.initial_state())[:3])


CASE = CaseDefinition(
    name="repeated-rows",
    title="Redundant rows with axes not quite parallel: a four-bar",
    cause="A pin that closes a planar loop in space has five rows, of which three are redundant. "
    "Where the axes are misaligned by less than any drawing tolerance, these rows disagree by the "
    "square of the angle. Once that exceeds rounding, a rank by rounding keeps them, and the "
    "linkage is locked. Compared with the mobility of their hinge they are redundant, and are left "
    "out for the whole run. Where the gap that they leave is a thousandth of the scene, the scene "
    "is rejected with a message.",
    parameter="misalignment of the axes",
    unit="rad",
    low=1e-11,
    high=1e-3,
    scale=LOG_SCALE,
    measured="error of the accelerations, relative",
    limit=1e-3,
    method=MethodDefinition("all rows, rank by rounding (pseudo-inverse)", _error_with_all_rows),
    remedy=MethodDefinition("rows compared by mobility, a fixed choice", _error_with_fixed_rows),
    reach=1e-2,
    source="Garcia de Jalon, Gutierrez-Lopez, Multibody System Dynamics 30, 2013 (redundant "
    "constraints and their forces)",
)
