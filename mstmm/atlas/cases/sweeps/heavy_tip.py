"""Riccati sweep with heavier and heavier tips."""

from __future__ import annotations

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import rounding_error
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped, random_pin_states, rod

ROD_COUNT = 8


def error(ratio: float, sweep: str) -> float:
    """Largest relative error of the accelerations over some random states."""
    masses = [1.0] * (ROD_COUNT - 1) + [ratio]
    bodies = [rod(f"rod{i}", mass=mass) for i, mass in enumerate(masses)]
    hinges = [
        {"name": f"pin{i}", "type": "pin", "outboard": f"rod{i}",
         "inboard": f"rod{i - 1}.tip" if i else "ground"}
        for i in range(ROD_COUNT)
    ]  # fmt: skip
    scene = {"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges}
    return rounding_error(compile_looped(scene, sweep=sweep), random_pin_states(ROD_COUNT))


CASE = CaseDefinition(
    name="heavy-tip",
    title="Riccati sweep: a heavy body outboard of light ones",
    cause="The sweep subtracts from the inertia that a hinge carries the part that moves freely in "
    "the hinge. Three hinges inboard of a heavy tip, in a plane, only rounding is left of its "
    "inertia, next to the inertia of light links. Least squares carry rows, whose sums of squares "
    "are both inertias: rotations combine them without a difference.",
    parameter="mass of the last rod over that of the others",
    unit="",
    low=1.0,
    high=1e12,
    scale=LOG_SCALE,
    measured="error of the accelerations, relative",
    limit=1e-8,
    method=MethodDefinition(
        f"Riccati sweep, {ROD_COUNT} rods", lambda ratio: error(ratio, "riccati")
    ),
    remedy=MethodDefinition('least squares (sweep="qr")', lambda ratio: error(ratio, "qr")),
    reach=1e20,
    source="Bjoerck, Numerical Methods for Least Squares Problems, SIAM 1996, ch. 2 and 4 (normal "
    "equations, weighted rows); sweep: Rui et al., Multibody System Dynamics 49, 2020",
)
