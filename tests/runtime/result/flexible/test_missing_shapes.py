"""Beams with shapes of one plane, whose loads could buckle them out of it: critical loads of
Timoshenko and Gere, Theory of Elastic Stability, 2nd ed., are seen as such, and told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.packing.expansion import expansion_of
from mstmm.runtime.result.flexible.missing_shapes import lateral_load_ratio, quadrature_rule
from mstmm.runtime.result.flexible.model_range import model_ranges

Array = NDArray[np.float64]

LENGTH, SOFT, STIFF, TWISTED = 2.0, 3.0, 3e8, 5.0
BEAM = {
    "name": "blade", "length": LENGTH, "mass_per_length": 1.0, "modes": {"y": 2},
    "bending_stiffness": [SOFT, STIFF], "torsional_stiffness": TWISTED,
    "polar_inertia_per_length": 0.01,
}  # fmt: skip
HELD = {"name": "foot", "type": "fixed", "inboard": "ground", "outboard": "blade"}


def scene(load: list[Any], **changes: Any) -> mstmm.Scene:
    push = {"on": "blade.tip", "force": load}
    return mstmm.Scene(gravity=(0, 0, 0), beam=[BEAM | changes], hinge=[HELD], load=[push])


def load_ratio(
    carried: str, size: float, of: Any, held: float = 0.0, line: float = LENGTH
) -> float:
    """Load over critical load where the sections at x carry size * of(L - x)."""
    expanded = expansion_of(scene([0, 0, 0]))
    assert expanded is not None
    body = expanded.bodies["blade"]
    assert body.shapes is not None
    x, weights = quadrature_rule(body.shapes, held)
    force, moment = np.zeros((1, len(x), 3)), np.zeros((1, len(x), 3))
    {"N": force[..., 0], "M_z": moment[..., 2]}[carried][0] = size * of(LENGTH - x)
    seen = lateral_load_ratio(body, x, weights, held, line, force, moment)
    assert seen is not None
    return seen


ROOT = np.sqrt(SOFT * TWISTED)


@pytest.mark.parametrize(
    ("carried", "size", "of"),
    [
        ("M_z", np.pi / 2 * ROOT / LENGTH, np.ones_like),  # a moment at the end
        ("M_z", 4.01260 * ROOT / LENGTH**2, lambda y: y),  # Prandtl: a force there
        ("M_z", 12.854 * ROOT / LENGTH**3, lambda y: y**2 / 2),  # its own weight
        ("N", -(np.pi**2) / 4 * SOFT / LENGTH**2, np.ones_like),  # Euler
        ("N", -7.83735 * SOFT / LENGTH**3, lambda y: y),  # Greenhill
    ],
)
def test_critical_loads(carried: str, size: float, of: Any) -> None:
    assert load_ratio(carried, size, of) == pytest.approx(1.0, rel=1e-4)
    assert load_ratio(carried, 0.0 * size, of) == 0.0
    power = 1 if carried == "M_z" else 2  # the same along a line twice as long
    assert load_ratio(carried, size, np.ones_like, line=2 * LENGTH) == pytest.approx(
        2**power * load_ratio(carried, size, np.ones_like)
    )


def test_a_beam_held_in_its_middle_and_a_pull() -> None:
    half = load_ratio(
        "N", -(np.pi**2) / 4 * SOFT / (LENGTH / 2) ** 2, np.ones_like, held=LENGTH / 2
    )
    assert half == pytest.approx(1.0, rel=1e-4)
    assert load_ratio("N", 1e3, np.ones_like) == 0.0


@pytest.mark.parametrize("modes", [{"y": 2}, {"y": 2, "z": 2}])
def test_half_and_twice_the_load_of_prandtl(modes: dict[str, int]) -> None:
    """Raised slowly, so that the beam is at rest under it."""
    told = []
    for part in (0.5, 2.0):
        force = f"-{part * 4.0126 * ROOT / LENGTH**2}*(1 - cos(pi*t))/2"
        pushed = scene([0, force, 0], modes=modes, bending_stiffness=[SOFT, 3e4])
        run = mstmm.compile(pushed).simulate(1.0, rtol=1e-6)
        one = model_ranges(run._flexible)[0]
        assert one.sideways == pytest.approx(part, rel=0.02)
        told.append([text for text in run.certificate.warnings if "out of the plane" in text])
    assert told[0] == [] and len(told[1]) == 1 and "20" in told[1][0]


def test_a_beam_with_all_shapes_needs_no_such_word() -> None:
    run = mstmm.compile(scene([0, -0.1, 0], modes={"y": 1, "z": 1, "twist": 1})).simulate(0.1)
    assert model_ranges(run._flexible)[0].sideways is None
