"""A straight-line linkage that runs through the pose in which its rhombus folds, a bifurcation."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.result.result import Result

#: Long and short bars, and the crank, whose foot is as far from that of the long bars, m.
LONG, SHORT, CRANK = 2.0, 1.0, 0.8


def peaucellier(crank: float = 0.3) -> dict[str, Any]:
    """The inversor of C.-N. Peaucellier (1864): two long bars from the origin to A and B, and a
    rhombus A P B Q, of which P is led on a circle through the origin; drawn as it begins."""
    inner = CRANK * np.array([1 + math.cos(crank), math.sin(crank)])
    along = float(np.hypot(*inner))
    outer = inner * (LONG**2 - SHORT**2) / along**2
    middle = (inner + outer) / 2
    aside = np.array([-inner[1], inner[0]]) / along
    width = math.sqrt(LONG**2 - float(middle @ middle))
    corners = {
        "O": np.zeros(2), "C": np.array([CRANK, 0]), "P": inner, "Q": outer,
        "A": middle + width * aside, "B": middle - width * aside,
    }  # fmt: skip
    bodies: list[dict[str, Any]] = []
    hinges: list[dict[str, Any]] = []
    for name, mass in (("CP", 1.0), ("OA", 1.0), ("OB", 1.2), ("AP", 0.5), ("BP", 0.6),
                       ("AQ", 0.7), ("BQ", 0.5)):  # fmt: skip
        arm = corners[name[1]] - corners[name[0]]
        moment = mass * float(arm @ arm) / 12
        bodies.append({
            "name": name, "mass": mass, "inertia": [moment] * 3,
            "center_of_mass": [*(arm / 2).tolist(), 0],
            "ends": {name[1]: [*arm.tolist(), 0]},
        })  # fmt: skip
    sides = {
        "CP": "ground", "OA": "ground", "OB": "ground", "AP": "OA.A", "AQ": "OA.A",
        "BP": "OB.B", "BQ": "OB.B",
    }  # fmt: skip
    for body, inboard in sides.items():
        hinges.append({"name": body.lower(), "inboard": inboard, "outboard": body})
    hinges[0] |= {"position": [CRANK, 0, 0], "initial": {"u": [1.0]}}
    hinges += [
        {"name": "p1", "inboard": "CP.P", "outboard": "AP.P"},
        {"name": "p2", "inboard": "CP.P", "outboard": "BP.P"},
        {"name": "q1", "inboard": "AQ.Q", "outboard": "BQ.Q"},
    ]
    pins = [{"type": "pin", "axis": [0, 0, 1]} | hinge for hinge in hinges]
    return {"gravity": [0, -9.81, 0], "body": bodies, "hinge": pins}


@functools.cache
def run(rtol: float) -> Result:
    """Four passages."""
    model = mstmm.compile(mstmm.Scene(**peaucellier()), engine="looped")
    times = np.linspace(0.0, 5.0, 51)
    return model.simulate(5.0, rtol=rtol, atol=rtol, output_times=times)


@pytest.mark.parametrize("rtol", [1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13])
def test_tighter_tolerances_are_not_worse(rtol: float) -> None:
    """Q stays on its line, energy stays, and steps are not many more than elsewhere."""
    found, energy = run(rtol), run(rtol).energy()
    assert found.success and found.statistics is not None and found.statistics.steps < 1500
    line = (LONG**2 - SHORT**2) / (2 * CRANK)
    assert np.abs(found.position("AQ.Q")[:, 0] - line).max() < 1e-9
    assert found.position("AQ.Q")[:, 1].min() < -2.3  # where OP is 1, Q is as low as it gets
    loose = run(1e-9).energy()
    bound = max(
        float(np.abs(loose - loose[0]).max()),
        1e-6 * float(np.ptp(found.energy_components()["kinetic"])),
    )
    assert np.abs(energy - energy[0]).max() < (bound if rtol < 1e-9 else 1e-4)
    assert np.abs(found.q - run(1e-9).q).max() < (1e-4 if rtol > 1e-9 else 1e-5)


def test_absolute_tolerances_below_rounding_are_not_worse() -> None:
    model = mstmm.compile(mstmm.Scene(**peaucellier()), engine="looped")
    times = np.linspace(0.0, 5.0, 51)
    found = model.simulate(5.0, rtol=1e-12, atol=1e-15, output_times=times)
    assert found.success and found.statistics is not None and found.statistics.steps < 1500
    assert np.abs(found.q - run(1e-9).q).max() < 1e-5
