"""Exact beams against elliptic integrals, closed forms and programs in absolute angles.

The chains of `tests.reference.flexible.inextensible` have neither strain coordinates nor segments.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipeinc, ellipk, ellipkinc

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.experiments.model_levels import model_levels
from tests.reference.flexible.inextensible import Beam, spectral
from tests.reference.flexible.inextensible import spin_up as turning
from tests.support.models import compile_scene, looped_model
from tests.support.scenes.flexible import Array, Scene, hinge, scene, spin_up

DOWN = (0.0, -9.81, 0.0)
TIMES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])


def exact(name: str, length: float = 1.0, stiffness: Any = 1.0, **keys: Any) -> Scene:
    """An exact [[beam]] of 1 kg/m."""
    own = {"name": name, "length": length, "bending_stiffness": stiffness, "kinematics": "exact"}
    return {"mass_per_length": 1.0} | own | keys


def tips(data: Scene, name: str, times: Array = TIMES, rtol: float = 1e-8) -> Array:
    result = compile_scene(data, "looped").simulate(times[-1], output_times=times, rtol=rtol)
    assert result.success, result.message
    return np.asarray(result.position(f"{name}.tip")[:, :2])


# --- statics --------------------------------------------------------------------------------------


def elastica(load: float) -> Array:
    """Deflection and shortening of a cantilever of EI = L = 1 under a dead load at its tip.

    Bisshopp and Drucker, Quarterly of Applied Mathematics 3 (1945) 272-275.
    """

    def start(modulus: float) -> float:
        return float(np.arcsin(1 / (modulus * np.sqrt(2))))

    def excess(k: float) -> float:
        return float(ellipk(k * k) - ellipkinc(start(k), k * k) - np.sqrt(load))

    k = brentq(excess, np.sqrt(0.5) + 1e-12, 1 - 1e-12, xtol=1e-16)
    integral = ellipeinc(np.pi / 2, k * k) - ellipeinc(start(k), k * k)
    sine = 2 * k * k - 1
    return np.array([1 - 2 * integral / np.sqrt(load), 1 - np.sqrt(2 * sine / load)])


@pytest.mark.parametrize(
    ("load", "count", "tolerance"),
    [(1.0, 4, 1e-6), (10.0, 6, 2e-6), (1.0, 8, 1e-9), (10.0, 9, 1e-8)],
)
def test_elastica(load: float, count: int, tolerance: float) -> None:
    push = {"on": "rod.tip", "force": [0.0, load, 0.0]}
    data = scene(
        exact("rod", modes={"y": count}), hinge("clamp", "fixed", "ground", "rod"), load=[push]
    )
    model = compile_scene(data)
    tip = model.positions(model.equilibrium(), "rod.tip")
    deflection, shortening = elastica(load)
    assert abs(tip[1] - deflection) < tolerance
    assert abs(1 - tip[0] - shortening) < tolerance


def test_a_moment_bends_a_beam_to_a_circle() -> None:
    moment = {"on": "rod.tip", "moment": [0.0, 0.0, 2 * np.pi]}
    data = scene(
        exact("rod", modes={"y": 3}), hinge("clamp", "fixed", "ground", "rod"), load=[moment]
    )
    model = compile_scene(data)
    rest = model.equilibrium()
    assert np.abs(model.positions(rest, "rod.tip")).max() < 1e-9
    result = model.simulate(1e-9, initial=(np.asarray(rest), np.zeros(model.nu)))
    curvature = result.strain("rod", [0.1, 0.5, 0.9])[0, :, 5]
    assert np.abs(curvature - 2 * np.pi).max() < 1e-9
    middle = result.deflected_shape("rod", 3)[0, 1]
    assert np.abs(middle - [0.0, 1 / np.pi, 0.0]).max() < 1e-6  # of the pose, order 6


def test_a_moment_bends_each_piece_of_a_stepped_beam_to_an_arc() -> None:
    """One coordinate is exact: the moment is constant, the curvature jumps with the section."""
    pieces = [
        {"from": 0.0, "to": 0.35, "bending_stiffness": 4.0},
        {"from": 0.35, "to": 1.0, "bending_stiffness": 0.5},
    ]
    moment = {"on": "rod.tip", "moment": [0.0, 0.0, 1.0]}
    rod = exact("rod", section=pieces, modes={"y": 1})
    data = scene(rod, hinge("clamp", "fixed", "ground", "rod"), load=[moment])
    model = compile_scene(data, "looped")
    tip = model.positions(model.equilibrium(), "rod.tip")
    place, angle = np.zeros(2), 0.0
    for length, curvature in ((0.35, 0.25), (0.65, 2.0)):
        turned = angle + curvature * length
        chord = np.array([np.sin(turned) - np.sin(angle), np.cos(angle) - np.cos(turned)])
        place += chord / curvature
        angle = turned
    assert tip[:2] == pytest.approx(place, abs=1e-9)


# --- motions --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("stiffness", "count", "tolerance"), [(5.0, 3, 3e-5), (1.0, 3, 1.2e-4), (0.1, 8, 1e-4)]
)
def test_a_pinned_rod_falls(stiffness: float, count: int, tolerance: float) -> None:
    data = scene(
        exact("rod", stiffness=stiffness, modes={"y": count}),
        hinge("pin", "pin", "ground", "rod"), gravity=DOWN,
    )  # fmt: skip
    reference = spectral([Beam(1.0, stiffness)], 16, 9.81).tips(TIMES, 1e-10)
    assert np.abs(tips(data, "rod") - reference).max() < tolerance


@pytest.mark.parametrize("joint", ["fixed", "pin"])
def test_strain_modes_know_what_hangs_on_the_tip(joint: str) -> None:
    tip = {"name": "tip", "mass": 1.0, "inertia": [1e-9, 1e-9, 1e-9]}
    data = scene(
        exact("rod", modes={"y": 3}), tip, hinge("pin", "pin", "ground", "rod"),
        hinge("mount", joint, "rod.tip", "tip"), gravity=DOWN,
    )  # fmt: skip
    reference = spectral([Beam(1.0, 1.0, tip_mass=1.0)], 10, 9.81).tips(TIMES, 1e-10)
    assert np.abs(tips(data, "rod") - reference).max() < 1.5e-5


def test_two_beams_in_a_corner() -> None:
    turned = [0.5**0.5, 0.0, 0.0, 0.5**0.5]
    data = scene(
        exact("first", modes={"y": 4}), exact("second", modes={"y": 4}),
        hinge("pin", "pin", "ground", "first"),
        hinge("weld", "fixed", "first.tip", "second", orientation=turned), gravity=DOWN,
    )  # fmt: skip
    beams = [Beam(1.0, 1.0), Beam(1.0, 1.0, joint="weld", angle=np.pi / 2)]
    times = np.array([0.0, 0.3, 0.6])
    reference = spectral(beams, 12, 9.81).tips(times, 1e-10)
    assert np.abs(tips(data, "second", times) - reference).max() < 5e-4


def test_spin_up() -> None:
    """Simo and Vu-Quoc 1986: past the first frequency within 15 s."""
    data = scene(
        exact("rod", 10.0, 1.4e4, mass_per_length=1.2, modes={"y": 3}),
        hinge("motor", "pin", "ground", "rod", drive=spin_up(6.0)),
    )
    times = np.linspace(0.0, 20.0, 41)
    clamped = spectral([Beam(10.0, 1.4e4, 1.2)], 8, clamped=True).with_driven_base(turning(6.0))
    found = tips(data, "rod", times, 1e-6)
    assert np.abs(found - clamped.tips(times, 1e-8)).max() < 2e-3


SPATIAL: Scene = {
    "stiffness": [1.0, 2.0], "torsional_stiffness": 1.0, "polar_inertia_per_length": 0.01,
    "modes": {"y": 4, "z": 4, "twist": 3}, "ends": {"mid": 0.5},
}  # fmt: skip


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_energy_of_a_spatial_motion(engine: str) -> None:
    data = scene(
        exact("rod", **SPATIAL), hinge("ball", "ball", "ground", "rod"), gravity=(0.0, -4.0, -3.0)
    )
    result = compile_scene(data, engine).simulate(1.0, rtol=1e-9)
    kinetic = np.ptp(result.energy_components()["kinetic"])
    assert np.ptp(result.energy()) < 1e-9 * kinetic
    assert np.abs(result.strain("rod", 0.3)[-1, 3:]).min() > 1e-3  # it bends and twists


def test_implicit_methods_find_the_same_motion() -> None:
    data = scene(
        exact("rod", **SPATIAL), hinge("clamp", "fixed", "ground", "rod"), gravity=(0.0, -4.0, -3.0)
    )
    model = looped_model(data)
    runs = [
        model.simulate(0.6, method=method, rtol=1e-7).position("rod.tip")[-1]
        for method in ("dop853", "rodas5p")
    ]
    assert np.abs(runs[0] - runs[1]).max() < 1e-6


def test_the_supported_section_makes_no_difference() -> None:
    """A free rod carried by its root, its middle or its tip."""
    ends = []
    for end, x in (("root", 0.0), ("mid", 0.5), ("tip", 1.0)):
        start = {"q": [x, 0, 0, 1, 0, 0, 0], "u": [0.0, 3.0 * x, -2.0 * x, 1.0, 2.0, 3.0]}
        push = {"on": "rod.tip", "force": ["5*sin(10*t)", 0.0, 1.0], "axes": "inertial"}
        data = scene(
            exact("rod", basis="modes", **SPATIAL),
            hinge("free", "free", "ground", f"rod.{end}", initial=start),
            gravity=(0.0, 0.0, -9.81), load=[push],
        )  # fmt: skip
        result = looped_model(data).simulate(0.5, rtol=1e-9, output_times=[0.0, 0.5])
        ends.append([result.position(f"rod.{name}")[-1] for name in ("root", "mid", "tip")])
    assert np.ptp(ends, axis=0).max() < 1e-7


def test_a_closed_loop() -> None:
    """Rod and bar between two pins: gaps stay closed, energy stays, both engines agree."""
    ends = {"a": [-0.5, 0, 0], "b": [0.5, 0, 0]}
    bar = {"name": "bar", "mass": 1.0, "inertia": [0.1] * 3, "ends": ends}
    data = scene(
        exact("rod", modes={"y": 3}), bar, hinge("root", "pin", "ground", "rod"),
        hinge("joint", "pin", "rod.tip", "bar.a"),
        hinge("support", "pin", "ground", "bar.b", position=[1.9, 0.0, 0.0]), gravity=DOWN,
    )  # fmt: skip
    found = []
    for engine in ("looped", "fused"):
        result = compile_scene(data, engine).simulate(1.0, rtol=1e-9, output_times=TIMES)
        assert np.ptp(result.energy()) < 1e-8
        assert np.abs(result.position("bar.b") - [1.9, 0.0, 0.0]).max() < 1e-9
        found.append(result.position("rod.tip"))
    assert np.abs(found[0] - found[1]).max() < 1e-7


# --- frequencies ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "roots"),
    [("fixed", [1.875104068711961, 4.694091132974175, 7.854757438237613]),
     ("pin", [3.926602312047919, 7.068582745628732, 10.210176122813031])],
)  # fmt: skip
@pytest.mark.parametrize("basis", ["modes", "legendre"])
def test_frequencies_at_rest(kind: str, roots: list[float], basis: str) -> None:
    """Clamped and pinned beams without weight: closed form."""
    count = {"modes": 5, "legendre": 9}[basis]
    data = scene(
        exact("rod", modes={"y": count}, basis=basis), hinge("support", kind, "ground", "rod")
    )
    omega = np.sort(np.abs(looped_model(data).linearize().modes().eigenvalues))
    found = omega[omega > 1e-3][:3]
    assert np.abs(found / np.square(roots) - 1).max() < 3e-5


# --- loads along the beam -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("span", "expected"), [(None, 1 / 8), ([0.5, 1.0], 1 / 8 - (1 / 128 + 1 / 96))]
)
def test_loads_per_length(span: list[float] | None, expected: float) -> None:
    wind = {"name": "wind", "on": "rod", "force_per_length": [0.0, 1e-3, 0.0]}
    data = scene(
        exact("rod", modes={"y": 6}, basis="legendre"), hinge("clamp", "fixed", "ground", "rod"),
        load=[wind | ({} if span is None else {"span": span})],
    )  # fmt: skip
    model = compile_scene(data)
    rest = (np.asarray(model.equilibrium()), np.zeros(model.nu))
    result = model.simulate(1e-9, initial=rest)
    assert result.deflection("rod", "tip")[0, 1] == pytest.approx(1e-3 * expected, rel=1e-6)
    total = 1e-3 * (1.0 if span is None else 0.5)
    assert result.quantity("wind.force").values[0, 1] == pytest.approx(total)
    assert result.section_force("rod", 0.0)[0, 1] == pytest.approx(total, rel=1e-6)
    center = 0.5 if span is None else 0.75
    assert result.section_moment("rod", 0.0)[0, 2] == pytest.approx(total * center, rel=1e-6)


def test_section_loads_balance_the_hinge() -> None:
    data = scene(exact("rod", **SPATIAL), hinge("ball", "ball", "ground", "rod"), gravity=DOWN)
    result = looped_model(data).simulate(0.7, rtol=1e-9)
    force, moment = result.section_force("rod", 0.0), result.section_moment("rod", 0.0)
    hinge_force = np.linalg.norm(result.force("ball"), axis=1)
    assert np.abs(np.linalg.norm(force, axis=1) - hinge_force).max() < 1e-9
    assert np.abs(moment).max() < 1e-9


def test_a_run_ends_where_a_segment_rotates_too_far() -> None:
    moment = {"on": "rod.tip", "moment": [0.0, 0.0, "40*t"]}
    data = scene(
        exact("rod", modes={"y": 1}), hinge("clamp", "fixed", "ground", "rod"), load=[moment]
    )
    result = compile_scene(data, "looped").simulate(1.0)
    assert not result.success
    assert "the segment to it rotates by more than 1.5 rad" in result.message


def test_no_one_way_response() -> None:
    data = scene(exact("rod", modes={"y": 2}), hinge("pin", "pin", "ground", "rod"))
    with pytest.raises(SceneError, match="one-way response is linear"):
        compile_scene(data, flexibility="one-way")


# --- refused --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keys", "part"),
    [
        ({"frame": "chord"}, "frame: an exact beam has no frame"),
        ({"quadrature": True}, "quadrature: an exact beam has no quadrature"),
        ({"viscous_drag": 0.1}, "drag acts only on second-order beams"),
        ({"shear_stiffness": 1.0, "rotary_inertia": 0.1}, "only second-order beams have shear"),
        ({"basis": "free-free"}, 'expected "auto", "modes" or "legendre"'),
        ({"model": "one-way"}, "the one-way response is linear"),
        ({"kinematics": "second-order", "basis": "legendre"}, 'write kinematics = "exact"'),
    ],
)
def test_refused(keys: Scene, part: str) -> None:
    rod = exact("rod", modes={"y": 2}) | keys
    data = scene(rod, hinge("pin", "pin", "ground", "rod"))
    with pytest.raises(SceneError, match=re.escape(part)):
        mstmm.Scene(**data)


def test_advice_tries_no_linear_model_of_an_exact_beam() -> None:
    """It would be the same beam under another name, or a scene that is refused."""
    data = scene(exact("rod", modes={"y": 2}), hinge("pin", "pin", "ground", "rod"), gravity=DOWN)
    rod = mstmm.Scene(**data)
    names = [level.name for level in model_levels(rod)]
    assert names == ["rigid", "stiffened, 1 shape", "stiffened, 2 shapes"]
    advice = mstmm.advise(rod, 0.2, error=1e-3, rounds=0, samples=5, budget=600)
    tried = " ".join(trial.name for trial in advice.tried_models)
    assert "rigid" in tried and "linear" not in tried and "one-way" not in tried
