"""How fast an iteration by the slopes of laws alone contracts: by the square of the step times the
fastest motion that inertia and loads cause, however stiff the laws are.

The figures were made elsewhere, with sweeps and matrices of their own, for generalised alpha with a
radius of 0.8.
"""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from benchmarks.stiff import scenes
from mstmm.runtime.engine.tangent_matrix import TangentMatrix
from mstmm.runtime.integrate.steppers import get
from mstmm.runtime.integrate.steppers.alpha_family import NewmarkFamily

STEPS = (1e-3, 3e-3, 1e-2, 3e-2)
KNOWN = {
    "bushings": (scenes.bushed_rods(10, 1e6, 0.01), (0.0019, 0.0044, 0.013, 0.10)),
    "damped pins": (scenes.damped_rods(100, 1e3), (0.0007, 0.0019, 0.005, 0.014)),
}


def contraction(model: mstmm.Model, step: float) -> float:
    """Spectral radius of 1 - L^-1 Z after half a second, Z the exact tangent, L that of laws."""
    tableau = get("genalpha", 0.8)
    assert isinstance(tableau, NewmarkFamily)
    part = (1 - tableau.alpha_f) / (1 - tableau.alpha_m)
    cu, cq = step * tableau.gamma_n * part, step**2 * tableau.beta_n * part
    start = model.simulate(0.5, "rodas5p", rtol=1e-6, atol=1e-8, output_times=[0.5])
    q, u = start.q[-1], start.u[-1]
    exact, laws = TangentMatrix(model.looped), TangentMatrix(model.looped)
    for tangent in (exact, laws):
        tangent.residual(0.5, q, u, model.accelerations(q, u, t=0.5))
    laws.factor_laws(1 / cu, cu / cq, 0.0)
    rows = [
        unit - laws.solve(exact.slope(0.0, laws.coordinates(unit), unit, unit / cu))
        for unit in np.eye(model.nu)
    ]
    return float(np.abs(np.linalg.eigvals(np.array(rows))).max())


@pytest.mark.parametrize("name", KNOWN)
def test_iterations_by_laws_alone_contract_as_known(name: str) -> None:
    scene, known = KNOWN[name]
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    assert [contraction(model, h) for h in STEPS] == pytest.approx(known, rel=0.2)
