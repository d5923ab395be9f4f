"""One floating frame for a beam with large deflections."""

from __future__ import annotations

from functools import cache

import numpy as np

from ....array_validation import Array
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped


@cache
def _tip_position(load: float, pieces: int, shapes: int) -> Array:
    """Static tip position of a clamped beam of 1 m and 1 N m2 under a transverse tip load (N)."""
    beam = {
        "length": 1 / pieces, "mass_per_length": 1.0, "bending_stiffness": 1.0,
        "modes": {"y": shapes},
    }  # fmt: skip
    names = [f"piece{i}" for i in range(pieces)]
    welds = [
        {"name": f"weld{i}", "type": "fixed", "outboard": name,
         "inboard": f"{names[i - 1]}.tip" if i else "ground"}
        for i, name in enumerate(names)
    ]  # fmt: skip
    end = f"{names[-1]}.tip"
    beam_model = compile_looped({
        "gravity": [0, 0, 0], "beam": [beam | {"name": name} for name in names], "hinge": welds,
        "load": [{"on": end, "force": [0, load, 0]}],
    })  # fmt: skip
    rest = beam_model.equilibrium(), np.zeros(beam_model.nu)
    run = simulate_to_end(beam_model, 1e-9, initial=rest, output_times=[0.0, 1e-9])
    return np.asarray(run.position(end)[0])


def _error(load: float, pieces: int, shapes: int) -> float:
    return float(np.abs(_tip_position(load, pieces, shapes) - _tip_position(load, 12, 2)).max())


CASE = CaseDefinition(
    name="single-frame",
    title="One floating frame: large deflections of a beam",
    cause="Shape functions are small deflections from a frame. One frame is accurate only as long "
    "as the sections of the beam rotate little against it: the relative error of the deflection is "
    "half the square of the slope. More shapes do not help; welded pieces with separate frames do.",
    parameter="load across the tip of a clamped beam, in EI/L²",
    unit="",
    low=0.02,
    high=10.0,
    scale=LOG_SCALE,
    measured="tip position error over the length",
    limit=0.01,
    method=MethodDefinition("one beam, 3 shapes", lambda load: _error(load, 1, 3)),
    remedy=MethodDefinition("6 welded pieces, 2 shapes each", lambda load: _error(load, 6, 2)),
    reach=10.0,
    source="Shabana, Dynamics of Multibody Systems, 2020, ch. 5 and 6; Rui, Wang, Zhang, Transfer "
    "Matrix Method for Multibody Systems, 2019, ch. 8",
)
