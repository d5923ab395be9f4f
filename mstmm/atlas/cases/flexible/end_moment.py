"""Shape functions without moment at the end of a beam, loaded by a moment there."""

from __future__ import annotations

from functools import cache

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import COUNT_SCALE
from ...shared_scenes import compile_looped

MOMENT = 0.05


@cache
def _tip_deflection(basis: str, shapes: int) -> float:
    """Static tip deflection (m) of a clamped beam of 1 m and 1 N m2 under a moment at its tip."""
    beam = {
        "name": "beam", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
        "modes": {"y": shapes}, "basis": basis, "frame": "tangent", "stiffening": False,
    }  # fmt: skip
    wall = {"name": "wall", "type": "fixed", "inboard": "ground", "outboard": "beam"}
    load = {"on": "beam.tip", "moment": [0, 0, MOMENT]}
    beam_model = compile_looped(
        {"gravity": [0, 0, 0], "beam": [beam], "hinge": [wall], "load": [load]}
    )
    rest = beam_model.equilibrium(), np.zeros(beam_model.nu)
    run = simulate_to_end(beam_model, 1e-9, initial=rest, output_times=[0.0, 1e-9])
    return float(run.deflection("beam", "tip")[0, 1])


def _error(shapes: float, basis: str) -> float:
    exact = _tip_deflection("static+fixed-interface", 6)
    return abs(_tip_deflection(basis, int(shapes)) / exact - 1)


CASE = CaseDefinition(
    name="end-moment",
    title="Shapes of a free end under an end moment",
    cause="The eigenfunctions of a beam with a free end have no curvature there. A moment at that "
    "end, or a body welded to it, requires one, and their sum converges to it slowly. Two static "
    "shapes of the end loads represent it at once; the basis `auto` uses them where hinges need "
    "them.",
    parameter="number of shapes",
    unit="",
    low=2,
    high=40,
    scale=COUNT_SCALE,
    measured="error of the deflection, relative",
    limit=1e-3,
    method=MethodDefinition("clamped-free", lambda n: _error(n, "clamped-free")),
    remedy=MethodDefinition(
        "static+fixed-interface", lambda n: _error(n, "static+fixed-interface")
    ),
    reach=2,
    source="Craig, Bampton, AIAA Journal 6, 1968; Shabana, Dynamics of Multibody Systems, 2020, "
    "ch. 5",
)
