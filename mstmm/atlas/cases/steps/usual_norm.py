"""Adaptive steps with errors of speeds weighted separately, for a slack stiff spring."""

from __future__ import annotations

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import elbow_with_spring
from ...variants.bare_rosenbrock import BareRosenbrock

T_END, RTOL, ATOL = 0.5, 1e-4, 1e-6

#: Largest number of steps that is counted.
MAX_STEPS = 4000


def _steps_with_usual_norm(stiffness: float) -> float:
    return BareRosenbrock(elbow_with_spring(stiffness), "rodas4p2").adaptive_step_count(
        T_END, RTOL, ATOL, MAX_STEPS
    )


def _steps_of_run(stiffness: float) -> float:
    run = simulate_to_end(elbow_with_spring(stiffness), T_END, "rodas4p2", rtol=RTOL, atol=ATOL)
    assert run.statistics is not None
    return run.statistics.steps + run.statistics.rejected_steps


CASE = CaseDefinition(
    name="usual-norm",
    title="The usual error norm: a stiff spring that is slack at the start",
    cause="A slack spring starts to vibrate with the speed of the load over its frequency, far "
    "above any tolerance, while the displacement of that vibration is far below. In the usual norm "
    "that speed forces every period to be resolved. Weighted by the displacement within the step "
    "the speed is ignored, and the run follows only the slow motion. (A spring so stiff that even "
    "its speed is below the tolerance is harmless in both norms.)",
    parameter="stiffness of an elbow between falling rods",
    unit="N m/rad",
    low=1.0,
    high=1e8,
    scale=LOG_SCALE,
    measured="steps in 0.5 s, including rejected ones",
    limit=500,
    method=MethodDefinition(
        "rodas4p2, rtol 1e-4, speeds weighted separately", _steps_with_usual_norm
    ),
    remedy=MethodDefinition("rodas4p2, rtol 1e-4", _steps_of_run),
    reach=1e16,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.8 (the norm); "
    "Lubich, ZAMP 44, 1993 (stiff mechanical systems)",
)
