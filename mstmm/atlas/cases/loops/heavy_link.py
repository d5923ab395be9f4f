"""Closing a loop of light rods with a heavy one."""

from __future__ import annotations

from mstmm.errors import NumericalFailure, SceneError

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import rounding_error
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped, rod_arch

ROD_COUNT = 5


def _error(ratio: float, refined: bool) -> float:
    try:
        arch = compile_looped(rod_arch([1.0, 1.0, 1.0, ratio, 1.0]))
    except SceneError as error:  # all digits are lost
        raise NumericalFailure(str(error)) from None
    arch.packed_scene.model.refines = int(refined)
    return rounding_error(arch, [arch.initial_state()])


CASE = CaseDefinition(
    name="heavy-link",
    title="Closed loops: a heavy link outboard of light ones",
    cause="The loads that close a loop follow from the accelerations of its rods under a load at "
    "the cut. Light rods inboard of a heavy one respond far more than it does, and its response is "
    "a difference of large numbers. Inverse dynamics eliminates nothing: its residual is small and "
    "accurate, and a second sweep corrects the result by it.",
    parameter="mass of the fourth rod over that of the others",
    unit="",
    low=1.0,
    high=1e13,
    scale=LOG_SCALE,
    measured="error of the accelerations, relative",
    limit=1e-9,
    method=MethodDefinition(
        f"one sweep, {ROD_COUNT} rods between two points", lambda x: _error(x, False)
    ),
    remedy=MethodDefinition("refined by one more sweep", lambda x: _error(x, True)),
    reach=1e16,
    source="Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002, ch. 12 (iterative "
    "refinement)",
)
