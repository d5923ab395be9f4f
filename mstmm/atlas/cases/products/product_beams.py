"""Product of the discrete-time matrices of beams along a row of them."""

from __future__ import annotations

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import COUNT_SCALE
from ...shared_scenes import compile_looped

STEP, STEPS = 1e-3, 20


def _error(count: float, method: str) -> float:
    beam = {
        "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 50.0, "modes": {"y": 3},
        "frame": "tangent", "stiffening": False,
    }  # fmt: skip
    beams = [beam | {"name": f"beam{i}"} for i in range(int(count))]
    welds = [
        {"name": f"weld{i}", "type": "fixed", "outboard": f"beam{i}",
         "inboard": f"beam{i - 1}.tip" if i else "ground"}
        for i in range(int(count))
    ]  # fmt: skip
    model = compile_looped({"gravity": [0, -9.81, 0], "beam": beams, "hinge": welds})
    expected = simulate_to_end(model, STEPS * STEP, "dttmm", STEP).q[-1]
    computed = simulate_to_end(model, STEPS * STEP, method, STEP).q[-1]
    return float(np.abs(computed - expected).max() / np.abs(expected).max())


CASE = CaseDefinition(
    name="product-beams",
    title="Product of discrete-time matrices: a row of beams",
    cause="Modal rows make the matrices of beams far worse conditioned than those of rigid bodies. "
    "A product of a few of them has no accurate digit, and fewer with shorter steps. The same "
    "matrices eliminated by Riccati from the tip inwards stay accurate.",
    parameter="welded beams of three shapes",
    unit="",
    low=1,
    high=12,
    scale=COUNT_SCALE,
    measured="difference from steps in hinge coordinates",
    limit=1e-4,
    method=MethodDefinition(
        "dttmm-classical-product, h = 1 ms", lambda n: _error(n, "dttmm-classical-product")
    ),
    remedy=MethodDefinition("dttmm-classical, h = 1 ms", lambda n: _error(n, "dttmm-classical")),
    reach=40,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 8",
)
