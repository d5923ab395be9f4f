"""Bending moments at work on twist: lateral buckling and vibration of beams in the engine.

References: the linear equations of a narrow beam under a bending load (`reference.lateral`, Prandtl
1899, Michell 1899) and an exact Kirchhoff rod (`reference.kirchhoff`); neither shares code with the
product.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.flexible import lateral
from tests.reference.flexible.kirchhoff import Load, Rod, solve

#: EI_y = GI_t = m = L = 1, and so stiff upwards that it hardly bends there.
NARROW = {
    "mass_per_length": 1.0,
    "bending_stiffness": [1.0, 1e6],
    "torsional_stiffness": 1.0,
    "polar_inertia_per_length": 0.01,
}
REFERENCE = lateral.Beam(1.0, 1.0, 1.0, 1.0, 0.01, rotary=0.0)
PRANDTL = lateral.prandtl()


def cantilever(parts: int, load: dict[str, Any], **beam: Any) -> mstmm.Scene:
    """`parts` equal beams welded in line, the first clamped, a load on the last tip."""
    beams = [{**NARROW, "length": 1.0 / parts, **beam, "name": f"b{i}"} for i in range(parts)]
    hinges = [
        {"name": f"h{i}", "type": "fixed", "outboard": f"b{i}",
         "inboard": f"b{i - 1}.tip" if i else "ground"}
        for i in range(parts)
    ]  # fmt: skip
    on = {"name": "push", "on": f"b{parts - 1}.tip", **load}
    return mstmm.Scene(gravity=[0, 0, 0], beam=beams, hinge=hinges, load=[on])


def squares(scene: mstmm.Scene) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Squares of the frequencies about the straight beam, ascending."""
    model = mstmm.compile(scene, engine="looped")
    q, u = model.initial_state()
    values = np.linalg.eigvals(model.derivatives(q, u).state_matrix)
    return np.sort((-(values**2)).real)[::2]


def first(parts: int, share: float, **beam: Any) -> float:
    """Square of the first frequency under a share of Prandtl's load down at the tip."""
    return float(squares(cantilever(parts, {"force": [0, -share * PRANDTL, 0]}, **beam))[0])


def critical(parts: int, **beam: Any) -> float:
    """P L^2 / sqrt(EI GI_t) where the first frequency vanishes, within a hundredth of Prandtl's."""
    low, high = (first(parts, share, **beam) for share in (0.99, 1.01))
    return float(PRANDTL * (0.99 + 0.02 * low / (low - high)))


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 0.75, 0.9])
def test_lateral_vibration_of_one_beam_slows_under_load(share: float) -> None:
    exact = lateral.lowest_rate(REFERENCE, lateral.end_force(1.0), share * PRANDTL) ** 2
    assert first(1, share, modes={"y": 0, "z": 6, "twist": 6}) == pytest.approx(exact, abs=8e-3)


@pytest.mark.parametrize("frame", ["tangent", "chord", "mean"])
def test_one_beam_buckles_sideways_at_prandtls_load(frame: str) -> None:
    """Static shapes carry the root's moment in any frame; nothing but the frame differs."""
    beam = {"modes": {"y": 0, "z": 6, "twist": 6}, "frame": frame, "quadrature": False}
    basis = "auto" if frame == "tangent" else "static+fixed-interface"
    assert critical(1, **beam, basis=basis) == pytest.approx(PRANDTL, rel=1e-3)


def test_either_plane_buckles_alike() -> None:
    turned = cantilever(
        1, {"force": [0, 0, 0.7 * PRANDTL]}, bending_stiffness=[1e6, 1.0],
        modes={"y": 4, "z": 0, "twist": 4},
    )  # fmt: skip
    other = first(1, 0.7, modes={"y": 0, "z": 4, "twist": 4})
    assert squares(turned)[0] == pytest.approx(other, rel=1e-10)


def test_welded_parts_converge_with_their_number() -> None:
    """By the fourth order in their length, with two static shapes each."""
    errors = [
        abs(critical(parts, modes={"y": 0, "z": 2, "twist": 2}) / PRANDTL - 1) for parts in (2, 4)
    ]
    assert errors[1] < 1e-3
    assert errors[1] < errors[0] / 10


def test_a_moment_that_keeps_its_direction_does_no_work_on_a_twisted_tip() -> None:
    """Dead and thus without potential: it never buckles the cantilever, but stiffens it."""
    scene = cantilever(1, {"moment": [0, 0, 1.0]}, modes={"y": 0, "z": 8, "twist": 8})
    exact = lateral.squares(REFERENCE, lateral.end_moment("dead"), 1.0)[0]
    assert exact == pytest.approx(13.342770553, rel=1e-8)
    assert squares(scene)[0] == pytest.approx(exact, rel=2e-3)


def test_a_load_past_the_critical_one_is_said_to_buckle() -> None:
    """gamma sees the work of forces across the beam, and every load below is told by its share."""
    for share in (0.5, 1.5):
        scene = cantilever(
            1, {"force": [0, -share * PRANDTL, 0]}, modes={"y": 0, "z": 6, "twist": 6}
        )
        run = mstmm.compile(scene).simulate(t_end=0.01)
        (found,) = run.certificate.flexible_bodies
        assert found.gamma is not None
        assert -found.gamma[0] == pytest.approx(share, rel=1e-3)
        assert any("buckling" in text for text in run.certificate.warnings) == (share > 1)


#: A 4:1 section, loaded at 45 degrees to its principal axes.
SKEW = {"bending_stiffness": [1.0, 16.0], "torsional_stiffness": 1.2960598193}


def bent_tip(parts: int, load: float, **beam: Any) -> tuple[Any, list[str]]:
    """Displacement (3,) of the tip at rest under dead forces along y and z, and what is said."""
    force = [0, load / np.sqrt(2), load / np.sqrt(2)]
    model = mstmm.compile(cantilever(parts, {"force": force}, **SKEW, **beam), engine="looped")
    at_rest = (model.equilibrium(), np.zeros(model.coordinate_layout.nu))
    run = model.simulate(t_end=1e-6, step=1e-6, method="rk4", initial=at_rest)
    return run.position(f"b{parts - 1}.tip")[0] - [1, 0, 0], list(run.certificate.warnings)


def exact_tip(load: float) -> Any:
    rod = Rod((1.0, 16.0), 1.2960598193, length=1.0)
    return solve(rod, Load(force=(0, load / np.sqrt(2), load / np.sqrt(2)))).tip


@pytest.mark.parametrize("parts", [1, 2, 4])
def test_bending_askew_twists_as_an_exact_rod(parts: int) -> None:
    """Slopes to .18: what is left is of third order in the slope of a part."""
    found, _ = bent_tip(parts, 0.5, modes={"y": 3, "z": 3, "twist": 3})
    bound = 0.022 / parts**3
    assert np.abs(found / exact_tip(0.5) - 1).max() < bound


def test_far_bending_askew_converges_and_one_beam_is_warned_about() -> None:
    exact = exact_tip(1.0)
    modes = {"y": 2, "z": 2, "twist": 2}
    one, said = bent_tip(1, 1.0, modes=modes)
    assert any("split the body" in text for text in said)
    assert 0.01 < np.abs(one / exact - 1).max() < 0.12
    errors = [np.abs(bent_tip(parts, 1.0, modes=modes)[0] / exact - 1).max() for parts in (2, 4)]
    assert errors[0] < 0.015
    assert errors[1] < errors[0] / 6


def test_far_past_buckling_the_tip_swings_sideways() -> None:
    """Twice Prandtl's load with a thousandth of it sideways: the straight beam does not stay, and
    the run ends by name where a beam in one frame has no more meaning."""
    push = {"force": [0, "-2*4.0126*min(5*t, 1)", 0.008]}
    model = mstmm.compile(
        cantilever(1, push, bending_stiffness=[1.0, 1e4], modes={"y": 1, "z": 3, "twist": 3}),
        engine="looped",
    )
    run = model.simulate(t_end=2.0, rtol=1e-6)
    assert np.abs(run.position("b0.tip")[:, 2]).max() > 0.2
    assert any("buckling" in text for text in run.certificate.warnings)
    assert not run.success and "welded" in run.message
