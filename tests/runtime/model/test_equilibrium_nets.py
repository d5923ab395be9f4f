"""Rest of what springs hold in space: a prism of struts and cables, and nets of cables."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

import mstmm

Array = NDArray[np.float64]

GRAVITY = 9.81
#: Stiffness of cables (N/m), mass of a strut (kg), rest lengths above and at the sides (m).
STIFFNESS, MASS, TOP, SIDE = 200.0, 2.0, 0.9 * 3**0.5, 1.35
#: Length of a strut between circles of 1 m that are turned against each other by 5 pi / 6.
STRUT = float(np.sqrt(2 * (1 - np.cos(5 * np.pi / 6)) + 1.5**2))


def about(angle: float, radius: float = 1.0, height: float = 0.0) -> Array:
    return np.array([radius * np.cos(angle), radius * np.sin(angle), height])


def direction_quaternion(way: Array) -> list[float]:
    """The quaternion that turns z into a direction."""
    axis = np.cross([0, 0, 1], way / np.linalg.norm(way))
    half = np.arcsin(np.linalg.norm(axis)) / 2
    return [float(np.cos(half)), *(np.sin(half) * axis / np.linalg.norm(axis)).tolist()]


def cable(rest: float, pulls_only: bool) -> dict[str, Any]:
    if pulls_only:
        return {"effort": f"-max(0, {STIFFNESS}*(q - {rest}))"}
    return {"stiffness": STIFFNESS, "rest": rest}


def prism(gravity: float, pulls_only: bool) -> dict[str, Any]:
    """Three struts on the ground whose tops three cables tie, and three to the ground."""
    body, hinge, spring = list[Any](), list[Any](), list[Any]()
    for k in range(3):
        foot, top = about(2 * np.pi * k / 3), about(2 * np.pi * k / 3 + 5 * np.pi / 6, 1.0, 1.5)
        body.append(
            {
                "name": f"strut{k}",
                "mass": MASS,
                "center_of_mass": [0, 0, STRUT / 2],
                "inertia": [1.0, 1.0, 0.005],
                "ends": {"top": [0, 0, STRUT]},
            }
        )
        hinge.append(
            {
                "name": f"foot{k}",
                "type": "ball",
                "inboard": "ground",
                "outboard": f"strut{k}",
                "position": foot.tolist(),
                "initial": {"q": direction_quaternion(top - foot)},
            }
        )
        after = (k + 1) % 3
        spring += [
            {"name": f"tie{k}", "type": "spring", "from": f"strut{k}.top",
             "to": f"strut{after}.top", "law": cable(TOP, pulls_only)},
            {"name": f"stay{k}", "type": "spring", "from": "ground", "to": f"strut{k}.top",
             "position": about(2 * np.pi * after / 3).tolist(), "law": cable(SIDE, pulls_only)},
        ]  # fmt: skip
    return {"gravity": [0, 0, -gravity], "body": body, "hinge": hinge, "spring": spring}


def prism_at_rest(gravity: float) -> Array:
    """Radius of the tops and their turn, of least energy among states alike in all struts."""

    def energy(x: Array) -> float:
        radius, turn = x
        height = np.sqrt(STRUT**2 - 1 - radius**2 + 2 * radius * np.cos(turn))
        stay = np.linalg.norm(about(turn, radius, height) - about(2 * np.pi / 3))
        springs = (np.sqrt(3) * radius - TOP) ** 2 + (stay - SIDE) ** 2
        return float(STIFFNESS / 2 * springs + MASS * gravity * height / 2)

    return np.asarray(minimize(energy, [1.0, 5 * np.pi / 6], method="Nelder-Mead",
                               options={"xatol": 1e-10, "fatol": 1e-15}).x)  # fmt: skip


@pytest.mark.parametrize("pulls_only", [False, True])
@pytest.mark.parametrize("gravity", [0.0, GRAVITY])
def test_a_prism_of_struts_and_cables_is_found(gravity: float, pulls_only: bool) -> None:
    """Without weight it is turned by 5 pi / 6, whatever the cables are (R. Connelly, A. Back,
    American Scientist 86 (1998) 142-151); struts may spin about themselves."""
    model = mstmm.compile(mstmm.Scene(**prism(gravity, pulls_only)), engine="looped")
    found = model.equilibrium()
    seen = model.simulate(0.0, "dop853", initial=(found, np.zeros(model.nu)))
    radius, turn = prism_at_rest(gravity)
    for k in range(3):
        x, y, _ = seen.position(f"strut{k}.top")[0] - 0.0
        top = complex(x, y) * np.exp(-2j * np.pi * k / 3)
        assert abs(top - radius * np.exp(1j * turn)) < 1e-6
        if not gravity:
            assert abs(np.angle(top) - 5 * np.pi / 6) < 1e-8
    assert found.unstable_speeds == () and found.trusted
    assert [risk.name for risk in found.risks] == ["free-spin"]


def net(count: int, rest: float) -> tuple[dict[str, Any], list[tuple[Any, Any]]]:
    """As many cables each way of springs between masses, in a frame; and the pairs of nodes."""
    inner = range(1, count + 1)
    body = [{"name": f"n{i}_{j}", "mass": 0.1, "inertia": [1e-3] * 3} for i in inner for j in inner]
    hinge = [{"name": f"h{i}_{j}", "type": "free", "inboard": "ground", "outboard": f"n{i}_{j}",
              "initial": {"q": [i, j, 0, 1, 0, 0, 0]}} for i in inner for j in inner]  # fmt: skip
    pairs = [((i, j), other) for i in range(count + 2) for j in range(count + 2)
             for other in ((i + 1, j), (i, j + 1))]  # fmt: skip
    held = {(i, j) for i in inner for j in inner}
    pairs = [pair for pair in pairs if held & set(pair) and max(max(pair)) <= count + 1]
    spring = []
    for number, (one, other) in enumerate(pairs):
        first, last = (one, other) if other in held else (other, one)
        at = {} if first in held else {"position": [*map(float, first), 0.0]}
        name = f"n{first[0]}_{first[1]}" if first in held else "ground"
        spring.append({"name": f"s{number}", "type": "spring", "from": name,
                       "to": f"n{last[0]}_{last[1]}", "law": {"stiffness": 200.0, "rest": rest},
                       **at})  # fmt: skip
    scene = {"gravity": [0, 0, -GRAVITY], "body": body, "hinge": hinge, "spring": spring}
    return scene, pairs


@pytest.mark.parametrize("count, rest", [(10, 0.9), (4, 1.3)])
def test_a_net_of_cables_is_found(count: int, rest: float) -> None:
    """Forces at every node balance, and the stiffness of the whole is positive; springs that push
    at first leave the plane of symmetry, too."""
    scene, pairs = net(count, rest)
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    found = model.equilibrium()
    hinges = model.coordinate_layout.hinges
    places = {(i, j): found[hinges[f"h{i}_{j}"].q :][:3] for i in range(1, count + 1)
              for j in range(1, count + 1)}  # fmt: skip
    rows = {node: 3 * number for number, node in enumerate(places)}
    forces, stiffness = np.zeros(3 * len(rows)), np.zeros((3 * len(rows), 3 * len(rows)))
    forces[2::3] = -0.1 * GRAVITY
    for one, other in pairs:
        ends = [places.get(node, np.array([*node, 0.0])) for node in (one, other)]
        length = float(np.linalg.norm(ends[1] - ends[0]))
        way = (ends[1] - ends[0]) / length
        tension = 200.0 * (length - rest)
        block = 200.0 * np.outer(way, way) + tension / length * (np.eye(3) - np.outer(way, way))
        for node, beside, sign in ((one, other, 1.0), (other, one, -1.0)):
            if node not in rows:
                continue
            own = slice(rows[node], rows[node] + 3)
            forces[own] += sign * tension * way
            stiffness[own, own] += block
            if beside in rows:
                stiffness[own, rows[beside] : rows[beside] + 3] -= block
    assert np.abs(forces).max() < 1e-9
    assert np.linalg.eigvalsh(stiffness).min() > 1e-3
    assert found.unstable_speeds == () and found.trusted


def test_a_soft_motion_beside_a_stiff_one_is_determined() -> None:
    """A pendulum of a millimetre under a spring of 1e9 N/m."""
    model = mstmm.compile(mstmm.Scene(
        gravity=[0, 0, -GRAVITY],
        body=[{"name": "block", "mass": 1.0, "inertia": [1, 1, 1]},
              {"name": "bob", "mass": 1e-3, "inertia": [1e-6] * 3,
               "center_of_mass": [0, 0, -1e-3]}],
        hinge=[{"name": "slide", "type": "prismatic", "axis": [0, 0, 1], "inboard": "ground",
                "outboard": "block", "law": {"stiffness": 1e9}},
               {"name": "swing", "type": "pin", "axis": [0, 1, 0], "inboard": "block",
                "outboard": "bob", "initial": {"q": 0.5}}],
    ), engine="looped")  # fmt: skip
    found = model.equilibrium()
    assert found[0] == pytest.approx(-1.001 * GRAVITY / 1e9, rel=1e-9)
    assert abs(found[1]) < 1e-9 and found.unstable_speeds == ()
