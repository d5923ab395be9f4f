"""Default axial shapes: beams that are held at both ends, and beams that are pulled.

Reference: EI v'''' - N v'' = w of a beam on two pins, whose tension is that of its own stretching,
N = EA / (2 L) int v'^2 (Timoshenko, Strength of Materials, part II, 3rd ed., section 6)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import mstmm
from mstmm.runtime.flexible.beam.planar_motion import Edge, biconnected_components
from mstmm.runtime.flexible.flexible_bodies import modal_bodies
from tests.support.scenes.single_beam import FREE, HELD, PIN, body_of

WEIGHT, BENDING = 9.81, 10.0


def sag(tension: float, x: Any) -> Any:
    """Deflection in m of the pinned beam of length 1 under its weight and a given tension."""
    k = np.sqrt(tension / BENDING)
    lever = x * (1 - x) / 2
    curved = (np.cosh(k * (x - 0.5)) / np.cosh(k / 2) - 1) / k**2
    return WEIGHT / tension * (lever + curved)


def tension_of(axial: float) -> float:
    x = np.linspace(0.0, 1.0, 4001)

    def excess(tension: float) -> float:
        slope = np.gradient(sag(tension, x), x, edge_order=2)
        return axial / 2 * float(np.trapezoid(slope**2, x)) - tension

    return float(brentq(excess, 1e-3, 1e6))


def held_beam(axial: float, **beam: Any) -> mstmm.Scene:
    """Between two pins on the ground, the second by a light body that a weld holds."""
    table = {"name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": BENDING,
             "axial_stiffness": axial, "ends": {"mid": 0.5}, **beam}  # fmt: skip
    light = {"name": "w", "mass": 1e-3, "inertia": [1e-3, 1e-3, 1e-3]}
    hinges = [
        {"name": "l", "type": "pin", "inboard": "ground", "outboard": "b.root"},
        {"name": "g", "type": "fixed", "inboard": "ground", "outboard": "w", "position": [1, 0, 0]},
        {"name": "r", "type": "pin", "inboard": "b.tip", "outboard": "w"},
    ]
    return mstmm.Scene(gravity=[0, -9.81, 0], beam=[table], body=[light], hinge=hinges)


@pytest.mark.parametrize("axial", [1e5, 1e7])
def test_tension_and_sag_of_a_beam_between_two_pins(axial: float) -> None:
    """With a shape of a free end the tension was 16 % too high; a stiff beam had none and was
    rigid between its pins."""
    model = mstmm.compile(held_beam(axial), engine="looped")
    q, body = model.equilibrium(), model.flexible_bodies["b"]
    eta = np.asarray(q)[-body.n :]
    tension = tension_of(axial)
    found = axial * (body.ports["tip"].phi - body.ports["root"].phi)[0] @ eta
    assert found == pytest.approx(tension, rel=5e-3)
    middle = body.ports["mid"].phi[1] @ eta
    assert -middle == pytest.approx(sag(tension, 0.5), rel=5e-3)


def test_a_restrained_beam_without_axial_shapes_says_so() -> None:
    (said,) = modal_bodies(held_beam(1e5, modes={"y": 3}))["b"].warnings
    assert "axial" in said
    assert not modal_bodies(held_beam(1e5, modes={"y": 3, "axial": 1}))["b"].warnings


@pytest.mark.parametrize(
    ("hinge", "more"),
    [(HELD, {"load": [{"on": "b.tip", "force": [1, 0, 0]}]}),
     (HELD, {"spring": [{"from": "ground", "to": "b.tip", "law": {"stiffness": 1.0}}]})],
)  # fmt: skip
def test_a_pull_on_the_end_stretches_a_beam_as_it_should(hinge: Any, more: Any) -> None:
    """By F L / EA; the shape of a free end gives 81 % of it."""
    body = body_of(hinge, more=more, modes="auto", axial_stiffness=50.0)
    tip = body.ports["tip"].phi
    assert tip[0] @ np.linalg.solve(body.K, tip[0]) == pytest.approx(1 / 50.0, rel=1e-9)


def linkage(**drive: Any) -> mstmm.Scene:
    """A slider-crank whose rod stretches little."""
    rod = {"name": "rod", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": BENDING,
           "axial_stiffness": 1e7}  # fmt: skip
    solid = {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]}
    body = [{"name": "crank", **solid, "ends": {"tip": [0.3, 0, 0]}}, {"name": "slider", **solid}]
    hinges = [
        {"name": "a", "type": "pin", "inboard": "ground", "outboard": "crank", **drive},
        {"name": "b", "type": "pin", "inboard": "crank.tip", "outboard": "rod"},
        {"name": "c", "type": "prismatic", "inboard": "ground", "outboard": "slider",
         "axis": [1, 0, 0], "position": [1.3, 0, 0]},
        {"name": "d", "type": "pin", "inboard": "rod.tip", "outboard": "slider"},
    ]  # fmt: skip
    return mstmm.Scene(gravity=[0, 0, 0], beam=[rod], body=body, hinge=hinges)


@pytest.mark.parametrize("drive", [{}, {"drive": "3*t"}])
def test_the_rod_of_a_slider_crank_needs_no_axial_shape(drive: dict[str, str]) -> None:
    modes = modal_bodies(linkage(**drive))["rod"].modes
    assert not any(name.startswith("axial") for name in modes)


def test_blocks_of_a_graph() -> None:
    """Two triangles that share the ground, one of them at the end of a bridge."""
    pairs = ["0a", "ab", "b0", "0c", "cd", "de", "ec"]
    parts = biconnected_components([Edge((pair[0], pair[1]), None) for pair in pairs])
    found = sorted(sorted("".join(edge.ends) for edge in part) for part in parts)
    assert found == [["0a", "ab", "b0"], ["0c"], ["cd", "de", "ec"]]


def test_a_free_end_keeps_its_shapes() -> None:
    assert body_of(PIN, modes="auto", axial_stiffness=50.0).modes[-1] == "axial1"


@pytest.mark.parametrize("end", ["root", "tip"])
@pytest.mark.parametrize("bends", [False, True])
def test_loads_at_either_end_of_a_free_beam_deform_it(end: str, bends: bool) -> None:
    """Strain energy under a force along, or a moment at, one end, in balance with its inertia: the
    axial force falls linearly, F^2 L / (6 EA); of the moment M (1 - 3 x^2 + 2 x^3) remains,
    13 M^2 L / (70 EI)."""
    load = {"moment": [0, 0, 1]} if bends else {"force": [1, 0, 0]}
    body = body_of(FREE, more={"load": [{"on": f"b.{end}"} | load]}, modes="auto",
                   axial_stiffness=5.0)  # fmt: skip
    port = body.ports[end]
    pushed = port.theta[2] if bends else port.phi[0]
    energy = pushed @ np.linalg.solve(body.K, pushed) / 2
    assert energy == pytest.approx(13 / 70 if bends else 1 / (6 * 5.0), rel=5e-3)
