"""Exact beams in frequency responses and natural motions: closed forms, and dense assemblies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import mstmm
from mstmm.errors import SceneError
from tests.runtime.linear.harmonic.test_dynamic_stiffness_modes import spans
from tests.support.scenes.linear import UNIT

LENGTH, BENDING, MASS = 2.0, 30.0, 0.8
BOOM = {"name": "boom", "length": LENGTH, "mass_per_length": MASS, "bending_stiffness": BENDING}
FOOT = {"name": "foot", "type": "fixed", "inboard": "ground", "outboard": "boom"}
OMEGA = np.array([3.0, 40.0, 200.0, 3000.0])


def boom(beam: dict[str, Any], hinge: dict[str, Any] | None = None, **more: Any) -> mstmm.Model:
    table = BOOM | {"modes": {"y": 3}} | beam
    scene: dict[str, Any] = {"gravity": [0, 0, 0], "beam": [table], "hinge": [FOOT | (hinge or {})]}
    scene["hinge"] += more.pop("outboard", [])
    scene |= more
    return mstmm.compile(mstmm.Scene(**scene), engine="looped")


def cantilever(omega: Any, softened: Any = 1.0, drag: float = 0.0) -> Any:
    """Deflection and slope of the tip by a force there."""
    inertia = MASS * omega**2 - 1j * omega * drag
    beta = (inertia / (BENDING * softened)) ** 0.25
    z = beta * LENGTH
    ch, sh, co, si = np.cosh(z), np.sinh(z), np.cos(z), np.sin(z)
    below = BENDING * softened * (1 + ch * co)
    return (si * ch - co * sh) / (beta**3 * below), si * sh / (beta**2 * below)


def test_the_tip_of_a_cantilever() -> None:
    """Held by its root or by its tip; in either plane; turned in space."""
    turned = {"orientation": [np.cos(0.4), np.sin(0.4), 0, 0]}
    deflection, slope = cantilever(OMEGA)
    for beam, hinge, push, shown in (
        ({}, {}, "boom.tip.fy", ["boom.tip.y", "boom.tip.wz"]),
        ({"modes": {"z": 1}}, {}, "boom.tip.fz", ["boom.tip.z", "boom.tip.wy"]),
        ({}, {"outboard": "boom.tip"}, "boom.root.fy", ["boom.root.y", "boom.root.wz"]),
        ({"modes": {"y": 1, "z": 1}}, turned, "boom.tip.fz", ["boom.tip.z", "boom.tip.wy"]),
    ):
        found = boom(beam, hinge).frequency_response(OMEGA, [push], shown, exact=True)
        np.testing.assert_allclose(found.response[:, 0, 0], deflection, rtol=1e-11)
        values = np.abs(found.response[:, 1, 0] / OMEGA)
        np.testing.assert_allclose(values, np.abs(slope), rtol=1e-11)


def test_more_shapes_come_nearer() -> None:
    """Errors of n shapes at the tip fall by eight with twice as many, as 1 / n^3."""
    deflection, _ = cantilever(OMEGA[:2])
    ask = OMEGA[:2], ["boom.tip.fy"], ["boom.tip.y"]
    basis = {"basis": "clamped-free"}
    errors = np.array(
        [
            boom({"modes": {"y": n}} | basis).frequency_response(*ask).response[:, 0, 0]
            / deflection
            - 1
            for n in (4, 8, 16)
        ]
    )
    ratios = np.abs(errors[:-1] / errors[1:])
    assert (ratios > 7).all() and (ratios < 9).all()


def test_damping_makes_the_stiffness_complex() -> None:
    delay, loss, drag = 1e-3, 0.05, 0.7
    damped = {"damping": {"stiffness": delay}, "viscous_drag": drag}
    ask = OMEGA[:3], ["boom.tip.fy"], ["boom.tip.y"]
    for structural in (loss, {"boom": loss}):
        found = boom(damped).frequency_response(*ask, exact=["boom"], structural=structural)
        softened = 1 + 1j * loss + 1j * OMEGA[:3] * delay
        expected, _ = cantilever(OMEGA[:3], softened, drag)
        np.testing.assert_allclose(found.response[:, 0, 0], expected, rtol=1e-11)


def test_a_beam_that_floats() -> None:
    """Free-free: (sin cosh - cos sinh) / (E I beta^3 (1 - cos cosh)) at either end; far below its
    first frequency a rigid rod, 4 / (m omega^2)."""
    hinge = {"name": "space", "type": "free"}
    omega = np.array([1e-5, 20.0, 500.0])
    table = {"modes": {"y": 2, "z": 2, "axial": 1}, "axial_stiffness": 1e4}
    found = boom(table | {"polar_inertia_per_length": 1e-3}, hinge)
    answer = found.frequency_response(
        omega, ["boom.tip.fy", "boom.tip.fx"], ["boom.tip.y", "boom.root.x"], exact=True
    )
    beta = (MASS * omega**2 / BENDING) ** 0.25
    z = beta * LENGTH
    ch, sh, co, si = np.cosh(z), np.sinh(z), np.cos(z), np.sin(z)
    with np.errstate(all="ignore"):
        expected = -(si * ch - co * sh) / (BENDING * beta**3 * (1 - co * ch))
    expected[0] = -4 / (MASS * LENGTH * omega[0] ** 2)
    np.testing.assert_allclose(answer.response[:, 0, 0], expected, rtol=1e-9)
    alpha = np.sqrt(MASS / 1e4) * omega
    along = -1 / (1e4 * alpha * np.sin(alpha * LENGTH))
    np.testing.assert_allclose(answer.response[:, 1, 1], along, rtol=1e-9)


def test_a_shaft_with_a_disk_and_a_rod_with_a_mass() -> None:
    """Torsion z tan z = J_shaft / J_disk and tension z tan z = m_rod / m."""
    polar, twist, axial = 0.03, 50.0, 900.0
    table = {"modes": {"twist": 1, "axial": 1}, "torsional_stiffness": twist,
             "axial_stiffness": axial, "polar_inertia_per_length": polar}  # fmt: skip
    disk = {"name": "disk", "mass": 0.4, "inertia": [0.02, 0.01, 0.01]}
    grip = {"name": "grip", "type": "fixed", "inboard": "boom.tip", "outboard": "disk"}
    found = boom(table, {}, body=[disk], outboard=[grip]).dynamic_stiffness_modes(6).omega
    expected = []
    for inertia, stiffness, end in ((polar, twist, 0.02), (MASS, axial, 0.4)):
        for k in range(6):
            z = brentq(lambda z, r=inertia * LENGTH / end: z * np.sin(z) - r * np.cos(z),
                       k * np.pi, (k + 0.5) * np.pi, xtol=1e-15)  # fmt: skip
            expected.append(z / LENGTH * np.sqrt(stiffness / inertia))
    np.testing.assert_allclose(found, sorted(expected)[:6], rtol=1e-12)


# --- natural motions by count ---------------------------------------------------------------------


def divided_beam_model(parts: int, **hinge: Any) -> mstmm.Model:
    """A unit beam along x in welded parts."""
    beams = [{"name": f"b{k}", **UNIT, "length": 1.0 / parts, "modes": {"y": 2}}
             for k in range(parts)]  # fmt: skip
    welds = [{"name": f"h{k}", "type": "fixed", "inboard": f"b{k - 1}.tip", "outboard": f"b{k}"}
             for k in range(1, parts)]  # fmt: skip
    foot = {"name": "foot", "type": "fixed", "inboard": "ground", "outboard": "b0"} | hinge
    scene = mstmm.Scene(gravity=(0, 0, 0), beam=beams, hinge=[foot, *welds])
    return mstmm.compile(scene, engine="looped")


def roots(function: Any, count: int, first: float) -> Any:
    """Zeros near first, first + pi, ...."""
    found = [
        brentq(function, x - 0.4, x + 0.4, xtol=1e-14) for x in first + np.pi * np.arange(count)
    ]
    return np.array(found)


@pytest.mark.parametrize(("parts", "digits"), [(1, 1e-9), (4, 1e-12)])
def test_two_hundred_frequencies_of_a_cantilever(parts: int, digits: float) -> None:
    """cos x = -1 / cosh x; none missed, none twice, where determinants end at the eleventh."""
    expected = roots(lambda x: np.cos(x) + 1 / np.cosh(x), 200, np.pi / 2 + 0.2)
    found = divided_beam_model(parts).dynamic_stiffness_modes(200)
    assert found.is_complete and len(found) == 200
    np.testing.assert_allclose(np.sqrt(found.omega), expected, rtol=digits)


def test_pinned_and_free() -> None:
    """tan x = tanh x behind a motion of frequency 0."""
    found = divided_beam_model(1, type="pin", axis=[0, 0, 1]).dynamic_stiffness_modes(60)
    assert found.omega[0] == 0
    expected = roots(lambda x: np.sin(x) - np.tanh(x) * np.cos(x), 59, 5 * np.pi / 4)
    np.testing.assert_allclose(np.sqrt(found.omega[1:]), expected, rtol=1e-9)


def test_free_in_space_in_two_planes() -> None:
    """cos x cosh x = 1, every frequency twice, behind six motions of frequency 0."""
    space = {"name": "space", "type": "free"}
    turning = {"polar_inertia_per_length": 1e-3}
    found = boom({"modes": {"y": 2, "z": 2}} | turning, space).dynamic_stiffness_modes(26)
    assert not found.omega[:6].any()
    expected = roots(lambda x: np.cos(x) - 1 / np.cosh(x), 10, 3 * np.pi / 2) / LENGTH
    omega = np.repeat(expected**2 * np.sqrt(BENDING / MASS), 2)
    np.testing.assert_allclose(
        found.omega[6:], omega, rtol=2e-3
    )  # its sections turn with the frame
    assert np.linalg.matrix_rank(found.shapes[:, 6:8]) == 2


def span_free(z: float) -> Any:
    """(4, 4) of one unit beam."""
    ch, sh, co, si = np.cosh(z), np.sinh(z), np.cos(z), np.sin(z)
    d = 1 - co * ch
    f1, f2 = z * (si * ch - co * sh) / d, z * (sh - si) / d
    f3, f4 = z**2 * si * sh / d, z**2 * (ch - co) / d
    f5, f6 = z**3 * (si * ch + co * sh) / d, z**3 * (si + sh) / d
    return np.array([[f5, f3, -f6, f4], [f3, f1, -f4, f2], [-f6, -f4, f5, -f3], [f4, f2, -f3, f1]])


def span_stiffness(beta: float, count: int) -> Any:
    """Assembled dynamic stiffness of unit spans with masses of 0.5 on springs of 2000."""
    whole = np.zeros((2 * count + 2, 2 * count + 2))
    for k in range(count):
        whole[2 * k : 2 * k + 4, 2 * k : 2 * k + 4] += span_free(beta)
        whole[2 * k + 2, 2 * k + 2] += 2e3 - 0.5 * beta**4
    return whole[2:, 2:]


@pytest.mark.parametrize("count", [4, 8])
def test_rows_of_spans(count: int) -> None:
    """2 n - 1 motions below beta = 6.5, each where the assembly is singular; and answers."""
    model = mstmm.compile(spans(count), engine="looped")
    beta = np.sqrt(model.dynamic_stiffness_modes(2 * count).omega)
    assert beta[-2] < 6.5 < beta[-1]
    for x in beta[:: count // 4]:
        near = [np.linalg.slogdet(span_stiffness(x * (1 + e), count))[0] for e in (-1e-9, 1e-9)]
        assert near[0] != near[1], x
    at = np.array([2.0, 4.1, 6.0])
    k = count // 2
    push, shown = [f"beam{k}.tip.fy"], [f"beam{k - 2}.tip.y", f"mass{k + 1}.y"]
    found = model.frequency_response(at**2, push, shown, exact=True).response[:, :, 0]
    for x, values in zip(at, found, strict=True):
        unit = np.zeros(2 * count)
        unit[2 * k] = 1.0
        expected = np.linalg.solve(span_stiffness(x, count), unit)[[2 * k - 4, 2 * k + 2]]
        assert np.abs(values - expected).max() < 1e-9 * np.abs(expected).max()


def test_hinges_with_laws_at_both_ends_and_bodies_outboard() -> None:
    """A sprung pin, the beam, a sprung and damped pin and a rod: dense by the same textbook."""
    k1, k2, c2, m, arm, inertia = 40.0, 6.0, 0.1, 0.5, 0.3, 0.02
    rod = {"name": "rod", "mass": m, "center_of_mass": [arm, 0, 0], "inertia": [1.0, 1.0, inertia]}
    pins = [
        {"type": "pin", "axis": [0, 0, 1], "law": {"stiffness": k1}},
        {"name": "wrist", "type": "pin", "axis": [0, 0, 1], "inboard": "boom.tip",
         "outboard": "rod", "law": {"stiffness": k2, "damping": c2}},
    ]  # fmt: skip
    model = boom({"basis": "simply-supported"}, pins[0], body=[rod], outboard=[pins[1]])
    found = model.frequency_response(
        OMEGA[:3], ["wrist.effort"], ["foot.angle", "boom.tip.y", "wrist.angle"], exact=True
    )
    for w, values in zip(OMEGA[:3], found.response[:, :, 0], strict=True):
        z, by = (MASS * w**2 / BENDING) ** 0.25 * LENGTH, [1, LENGTH, 1, LENGTH]
        beam = span_free(z) * np.outer(by, by) * BENDING / LENGTH**3
        # Unknown: angle of the root, deflection and angle of the tip, angle of the rod.
        whole = np.zeros((4, 4), dtype=complex)
        whole[:3, :3] = beam[1:, 1:]
        whole[0, 0] += k1
        spring = k2 + 1j * w * c2
        whole[2:, 2:] += spring * np.array([[1, -1], [-1, 1]])
        whole[np.ix_([1, 3], [1, 3])] -= w**2 * np.array(
            [[m, m * arm], [m * arm, inertia + m * arm**2]]
        )
        x = np.linalg.solve(whole, [0, 0, -1, 1])
        np.testing.assert_allclose(values, [x[0], x[1], x[3] - x[2]], rtol=1e-10)


# --- what is refused ------------------------------------------------------------------------------

LOAD = {"on": "boom.tip"}
PIECES = [{"from": 0, "to": 1}, {"from": 1, "to": 2, "mass_per_length": 0.4}]
STAY = {"name": "stay", "from": "ground", "to": "boom.mid", "position": [1, -1, 0],
        "law": {"stiffness": 9.0, "rest": 1.0}}  # fmt: skip


WIND = {"name": "wind", "unit": "N/m"}
BLOWN = {"on": "boom", "force_per_length": [0, "wind", 0]}


@pytest.mark.parametrize(
    ("beam", "more", "arguments", "expected"),
    [
        ({}, {}, {"exact": ["bom"]}, '"bom": expected a flexible beam.*"?boom'),
        ({}, {}, {"exact": []}, "exact is empty"),
        ({}, {}, {"exact": "boom"}, "expected True, or a list of names"),
        ({}, {"gravity": [0, -9.81, 0]}, {}, "loads the beams"),
        ({"section": PIECES}, {}, {}, 'beam "boom" is not uniform'),
        ({"rotary_inertia": 1e-3}, {}, {}, 'beam "boom" has rotary inertia'),
        ({"damping": 0.01}, {}, {}, "has modal damping ratios"),
        ({"ends": {"mid": 1.0}}, {"spring": [STAY]}, {}, "loaded at x = 1 m"),
        ({"ends": {"mid": 1.0}}, {}, {"outputs": ["boom.mid.y"]}, "at root and tip only"),
        ({}, {}, {"outputs": ["boom.y1"]}, "has no modal coordinates"),
        ({}, {"load": [LOAD | {"force": [0, 2, 0]}]}, {}, "bent at rest"),
        ({}, {"load": [LOAD | {"force": [-3, 0, 0]}]}, {}, "under tension or compression at rest"),
        ({}, {}, {"modal": 0.1}, "damping ratios refer to normal modes"),
        ({}, {}, {"inputs": ["ground.acceleration.y"]}, 'acts along the whole beam "boom"'),
        ({}, {"input": [WIND], "load": [BLOWN]}, {"inputs": ["wind"]}, '"wind" acts along'),
        ({}, {}, {"outputs": None}, "all coordinates are those of beam shapes; give outputs"),
    ],
)
def test_what_the_solution_does_not_have_is_named(
    beam: dict[str, Any], more: dict[str, Any], arguments: dict[str, Any], expected: str
) -> None:
    model = boom(beam, {}, **more)
    usual = {"inputs": ["boom.tip.fy"], "outputs": ["boom.tip.y"]}
    with pytest.raises(SceneError, match=expected):
        model.frequency_response([1.0], **{"exact": True, **usual, **arguments})


def test_motions_that_cannot_be_counted() -> None:
    block = {"name": "block", "mass": 1.0, "inertia": [1, 1, 1]}
    rail = {"name": "rail", "type": "prismatic", "axis": [0, 1, 0], "inboard": "ground",
            "outboard": "block", "position": [LENGTH, -1, 0]}  # fmt: skip
    across = {"name": "across", "from": "block", "to": "boom.tip",
              "law": {"stiffness": 9.0, "rest": 1.0}}  # fmt: skip
    joined = boom({}, {}, body=[block], outboard=[rail], spring=[across])
    pushed = joined.frequency_response([1.0], ["boom.tip.fy", "rail.effort"], exact=True)
    assert pushed.response.shape == (1, 1, 2)
    with pytest.raises(SceneError, match="couple branches of the tree"):
        joined.dynamic_stiffness_modes(2)
    still = boom({})
    for count in (0, 1.5, True):
        with pytest.raises(SceneError, match="a number of modes, 1 or more"):
            still.dynamic_stiffness_modes(count)  # type: ignore[arg-type]
    moving = boom({}, {"type": "pin", "axis": [0, 0, 1]}).linearize(None, [1.0, 0, 0, 0])
    with pytest.raises(SceneError, match="expected a state at rest"):
        moving.frequency_response([1.0], exact=True)
