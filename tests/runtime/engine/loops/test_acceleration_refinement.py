"""Heavy bodies behind light ones: accelerations of closed loops are refined where digits are lost.

A chain of rods between two points of the ground, and the saddle point of its absolute angles in 40
digits.
"""

from __future__ import annotations

from itertools import pairwise

import mpmath
import numpy as np
import pytest

import mstmm
from tests.reference.jets import Array
from tests.support.scenes.published_mechanisms import Scene, rod
from tests.system.loops.test_four_bar import linkage

ANGLES = (1.9, 0.7, 1.1, -0.4, -1.3, -0.8)
LENGTHS = (0.5, 0.9, 0.4, 0.7, 0.6, 0.8)


def chain(masses: list[float]) -> Scene:
    """The rods, held at both ends; the pin at the far one is cut."""
    tip = np.sum(LENGTHS * np.exp(1j * np.array(ANGLES)))
    names = [f"rod{k}" for k in range(len(masses))]
    sides = [("ground", names[0]), *((f"{a}.tip", b) for a, b in pairwise(names))]
    turns = np.diff(ANGLES, prepend=0.0)
    hinges: list[Scene] = [
        {"name": f"pin{k}", "type": "pin", "inboard": inboard, "outboard": outboard, "cut": False,
         "initial": {"q": float(turns[k])}}
        for k, (inboard, outboard) in enumerate(sides)
    ]  # fmt: skip
    hinges[0]["initial"]["u"] = 1.0
    hinges.append({
        "name": "end", "type": "pin", "inboard": "ground", "outboard": f"{names[-1]}.tip",
        "position": [float(tip.real), float(tip.imag), 0.0], "cut": True,
        "initial": {"q": ANGLES[-1]},
    })  # fmt: skip
    bodies = [rod(*one) for one in zip(names, LENGTHS, masses, strict=True)]
    return {"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges}


def exact(q: Array, u: Array, masses: list[float]) -> Array:
    """Accelerations of the pins of the chain, the equations solved with 40 digits."""
    n, m, length = len(masses), [mpmath.mpf(x) for x in masses], [mpmath.mpf(x) for x in LENGTHS]
    angle = [mpmath.fsum(map(float, q[: k + 1])) for k in range(n)]
    rate = [mpmath.fsum(map(float, u[: k + 1])) for k in range(n)]
    system, right = mpmath.zeros(n + 2), mpmath.zeros(n + 2, 1)
    for i in range(n):
        behind = m[i] / 2 + mpmath.fsum(m[i + 1 :])
        right[i] = -mpmath.mpf(9.81) * behind * length[i] * mpmath.cos(angle[i])
        for j in range(n):
            outer = max(i, j)
            shared = m[outer] * (mpmath.mpf(1) / 3 if i == j else mpmath.mpf(1) / 2)
            shared = (shared + mpmath.fsum(m[outer + 1 :])) * length[i] * length[j]
            system[i, j] = shared * mpmath.cos(angle[i] - angle[j])
            right[i] -= shared * mpmath.sin(angle[i] - angle[j]) * rate[j] ** 2
        rows = (-length[i] * mpmath.sin(angle[i]), length[i] * mpmath.cos(angle[i]))
        inwards = (length[i] * mpmath.cos(angle[i]), length[i] * mpmath.sin(angle[i]))
        for row in range(2):
            system[n + row, i] = system[i, n + row] = rows[row]
            right[n + row] += inwards[row] * rate[i] ** 2
    found = mpmath.lu_solve(system, right)
    return np.diff([float(found[k]) for k in range(n)], prepend=0.0)


@pytest.mark.parametrize(
    ("power", "refines", "accuracy"),
    [
        (0, 0, 1e-13),
        (3, 0, 1e-12),
        (6, 1, 1e-14),
        (8, 1, 1e-14),
        (10, 1, 1e-12),
        (12, 2, 1e-12),
        (14, 4, 1e-8),
    ],
)
def test_a_heavy_rod_between_light_ones(power: int, refines: int, accuracy: float) -> None:
    masses = [1.0, 1.0, 1.0, 10.0**power, 1.0, 1.0]
    model = mstmm.compile(mstmm.Scene(**chain(masses)))
    assert model.packed_scene.model.refines == refines
    q, u = model.initial_state()
    with mpmath.workdps(40):
        wanted = exact(q, u, masses)
    found = model.accelerations(q, u)[: len(masses)]
    error = np.abs(found - wanted).max() / np.abs(wanted).max()
    assert error < accuracy, error


@pytest.mark.parametrize(
    ("heavy", "message"),
    [((5,), r"refinement does not reduce: "), ((2, 4), r'closed by "end" is lost to ')],
)
def test_masses_that_leave_no_digits(heavy: tuple[int, ...], message: str) -> None:
    """Beside true values the accelerations were wrong by 0.4 of their size, and nothing said so."""
    masses = [1e15 if k in heavy else 1.0 for k in range(6)]
    with pytest.raises(mstmm.SceneError, match=message + r".*kg\); make their masses more similar"):
        mstmm.compile(mstmm.Scene(**chain(masses)))


@pytest.mark.parametrize("body", [1, 2])
def test_a_start_of_heavy_bodies_keeps_its_speed(body: int) -> None:
    """Honest rows of light links have small pivots: no other row says what they say."""
    scene = linkage("closing_pin", laws=False)
    scene["body"][body] |= {"mass": 1e10, "inertia": [0.0, 1e9, 1e9]}
    model = mstmm.compile(mstmm.Scene(**scene))
    q, u = model.initial_state()
    assert u[0] == 1.0
    a, b, c = u[0], u[0] + u[1], u[2]
    rates = np.array([0.5 * a, 1.1 * b, -0.8 * c])
    turned = 1j * np.exp(1j * np.array([q[0], q[0] + q[1], q[2]]))
    assert abs(np.sum(rates * turned)) < 1e-12
