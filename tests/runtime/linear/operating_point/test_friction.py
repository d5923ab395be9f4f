"""Dry friction in linear models: left out at rest, viscous at an amplitude, kept in sliding."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.linear.mck_matrices import FrameTransform
from tests.support.scenes.linear import pendulum

#: m g l and the inertia of `pendulum` about its pivot.
WEIGHT, INERTIA = 2 * 9.81 * 0.5, 0.53
RUB = {"coulomb": 0.01}


def compile_model(scene: mstmm.Scene, engine: str = "looped") -> mstmm.Model:
    return mstmm.compile(scene, engine=engine)


def rough(law: dict[str, Any] | None = None, **friction: float) -> mstmm.Scene:
    return pendulum(law={**(law or {}), "friction": RUB | friction})


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_it_is_left_out_at_rest(engine: str) -> None:
    """sqrt(m g l/J) without damping; it sticks where its weight is less than friction."""
    model = compile_model(rough(), engine)
    linear = model.linearize()
    np.testing.assert_allclose(linear.modes().eigenvalues, [1j * math.sqrt(WEIGHT / INERTIA)])
    (text,) = linear.warnings
    assert "dry friction is neglected" in text
    assert f"pivot below an amplitude of {0.01 / WEIGHT:.4g} rad or efforts of 0.01 N*m" in text
    slope = model.derivatives([0.0], [0.0]).state_matrix[1, 1]
    assert slope == pytest.approx(-0.01 / 1e-3 / INERTIA)  # the exact slope of the law


@pytest.mark.parametrize("amplitude", [0.004, 0.02, 0.7])
def test_it_is_viscous_at_an_amplitude(amplitude: float) -> None:
    """The damper that takes as much work from a sine as Coulomb's friction, 4 F/(pi V), and as
    Stribeck's law, by quadrature."""
    coulomb = compile_model(rough()).linearize(friction=amplitude)
    assert coulomb.C[0, 0] == pytest.approx(4 * 0.01 / (math.pi * amplitude), rel=1e-12)
    assert not coulomb.warnings
    linear = compile_model(rough({"damping": 0.3}, static=0.025)).linearize(
        friction={"pivot": amplitude}
    )

    def work(x: float) -> float:
        speed = amplitude * math.sin(x)
        return (0.01 + 0.015 * math.exp(-((speed / 0.01) ** 2))) * math.sin(x)

    mean = 2 * quad(work, 0, math.pi, epsabs=1e-13)[0] / (math.pi * amplitude)
    assert linear.C[0, 0] == pytest.approx(0.3 + mean, rel=1e-9)
    assert linear.C_damping[0, 0] == pytest.approx(0.3 + mean, rel=1e-9)


def test_a_hinge_that_slides_keeps_its_slope() -> None:
    """That of Stribeck's law at the speed of the motion."""
    speed = 0.02
    linear = compile_model(rough(static=0.05)).linearize([0.0], [speed])
    slope = -2 * speed / 0.01**2 * 0.04 * math.exp(-((speed / 0.01) ** 2))
    assert linear.C[0, 0] == pytest.approx(slope, rel=1e-9)
    assert not any("friction" in text for text in linear.warnings)


def test_members_of_a_chain_by_themselves() -> None:
    """One slides, two do not; amplitudes by the names of a member and of the chain."""
    body = {"mass": 1.0, "center_of_mass": [0, -0.5, 0], "inertia": [0.1, 0.1, 0.1],
            "ends": {"tip": [0, -1, 0]}}  # fmt: skip
    hinge = {"type": "pin", "law": {"damping": 0.2, "friction": {"coulomb": 1.0, "static": 2.0}}}
    model = compile_model(mstmm.Scene(
        gravity=(0, 0, 0),
        chain=[{"name": "rope", "count": 3, "inboard": "ground", "body": body, "hinge": hinge,
                "end": "tip"}],
    ))  # fmt: skip
    u = [0.0, 0.02, 0.0]
    slope = 0.2 - 2 * 0.02 / 0.01**2 * math.exp(-4.0)
    linear = model.linearize([0.0, 0.0, 0.0], u)
    np.testing.assert_allclose(linear.C_damping.diagonal(), [0.2, slope, 0.2], rtol=1e-9)
    assert "any amplitude" in next(text for text in linear.warnings if "friction" in text)
    given = model.linearize([0.0] * 3, u, friction={"rope": 1e6, "rope[2].hinge": 2e6})
    extra = [4 / (math.pi * 1e6), 0.0, 4 / (math.pi * 2e6)]
    np.testing.assert_allclose(
        given.C_damping.diagonal() - [0.2, slope, 0.2], extra, rtol=1e-6, atol=1e-13
    )


def test_answers_to_harmonic_pushes() -> None:
    """1/(k - J w^2 + i w c), by the sweep."""
    omega, model = np.array([0.5, 4.0, 9.0]), compile_model(rough())
    for friction, c in ((None, 0.0), (0.3, 4 * 0.01 / (math.pi * 0.3))):
        found = model.frequency_response(omega, ["pivot.effort"], friction=friction)
        expected = 1 / (WEIGHT - INERTIA * omega**2 + 1j * omega * c)
        np.testing.assert_allclose(found.response[:, 0, 0], expected, rtol=1e-12)
    linear = model.linearize()
    assert linear.operators.damping(np.ones(1)) == [0.0]
    assert linear.symbolic(keep=["bob.mass"]).C.is_zero_matrix


def test_growth_sets_in_where_the_given_damping_ends() -> None:
    """A motor that pushes with c u: at once without friction, at c = 4 F/(pi V) with it."""
    data = rough().model_dump(by_alias=True, exclude_defaults=True)
    data["hinge"][0]["law"]["effort"] = ["c*u"]
    model = compile_model(mstmm.Scene(constants={"c": 0.0}, **data))
    low, high = -0.1, 1.0
    assert model.stability_limit("constants.c", low, high).value == pytest.approx(0.0, abs=1e-6)
    found = model.stability_limit("constants.c", low, high, friction=0.2)
    assert found.value == pytest.approx(4 * 0.01 / (math.pi * 0.2), abs=1e-6)
    locus = model.root_locus("constants.c", [0.0, 0.02], friction=0.2)
    c = 4 * 0.01 / (math.pi * 0.2) - locus.parameter_values
    np.testing.assert_allclose(locus.growth_rate[:, 0], -c / (2 * INERTIA), rtol=1e-9)


def test_in_closed_loops_at_rest_and_in_motion() -> None:
    """As the same loops without friction, in the hinge that is cut too; given, as dampers in
    all hinges."""

    def loop(friction: dict[str, float]) -> mstmm.Model:
        law = {"law": {"damping": 0.1, "stiffness": 2.0, "friction": friction}}
        about = {"mass": 0.4, "center_of_mass": [0, -0.15, 0], "inertia": [3e-3, 2e-4, 3e-3],
                 "ends": {"tip": [0, -0.3, 0]}}  # fmt: skip
        solid = {"mass": 1.0, "inertia": [0.01, 0.01, 0.01]}
        pin = {"type": "pin", "axis": [0, 0, 1], **law}
        return compile_model(mstmm.Scene(
            gravity=(0, -9.81, 0),
            body=[solid | {"name": "shaft"}, about | {"name": "arm"}, about | {"name": "rod"},
                  solid | {"name": "sleeve"}],
            hinge=[
                {"name": "spin", "type": "pin", "axis": [0, 1, 0], "inboard": "ground",
                 "outboard": "shaft"},
                pin | {"name": "swing", "inboard": "shaft", "outboard": "arm",
                       "initial": {"q": 0.5}},
                pin | {"name": "knee", "inboard": "arm.tip", "outboard": "rod",
                       "initial": {"q": -1.0}},
                {"name": "slide", "type": "prismatic", "axis": [0, 1, 0], "inboard": "shaft",
                 "outboard": "sleeve", "initial": {"q": -0.6 * math.cos(0.5)}, **law},
                pin | {"name": "foot", "inboard": "sleeve", "outboard": "rod.tip",
                       "initial": {"q": -0.5}},
            ],
        ))  # fmt: skip

    dry, bare = loop({"coulomb": 0.05}), loop({})
    q = bare.initial_state()[0]
    for speed in (0.0, 4.0):
        u = np.zeros(bare.nu)
        u[0] = speed
        here, there = dry.linearize(q, u), bare.linearize(q, u)
        assert here.free_speed_indices == there.free_speed_indices
        for name in ("M", "C", "K"):
            wanted = getattr(there, name)
            np.testing.assert_allclose(getattr(here, name), wanted, atol=1e-9, err_msg=name)
        assert any("dry friction is neglected" in text for text in here.warnings)
    assert here.constrained_motion is not None
    ways, places = here.constrained_motion.motion_basis, here.constrained_motion.independent_indices
    given = dry.linearize(q, u, friction=2.0)
    rests = np.ones(bare.nu)
    rests[0] = 0.0
    added = ways.T @ np.diag(rests * 4 * 0.05 / (2 * math.pi)) @ ways
    assert len(places) == 2
    np.testing.assert_allclose(given.C - here.C, added, rtol=1e-8, atol=1e-9)


def test_what_makes_no_sense() -> None:
    model = compile_model(rough())
    with pytest.raises(SceneError, match=r'friction: "pivott": expected .*did you mean "?pivot'):
        model.linearize(friction={"pivott": 1.0})
    for wrong in (0.0, -1.0):
        with pytest.raises(SceneError, match="expected an amplitude of speed above 0"):
            model.modes(friction=wrong)
    with pytest.raises(SceneError, match="an amplitude of speed"):
        model.linearize(friction="much")  # type: ignore[arg-type]


def test_beside_beams_without_shapes() -> None:
    """An exact beam on a hinge with friction, at low frequencies a rigid one on a damper."""
    beam = {"name": "jib", "length": 1.0, "mass_per_length": 3.0, "bending_stiffness": 1e7,
            "modes": {"y": 1}}  # fmt: skip
    hinge = {"name": "slew", "type": "pin", "inboard": "ground", "outboard": "jib",
             "law": {"stiffness": 10.0, "friction": {"coulomb": 0.5}}}  # fmt: skip
    model = compile_model(mstmm.Scene(gravity=(0, 0, 0), beam=[beam], hinge=[hinge]))
    for friction, c in ((None, 0.0), (2.0, 1 / math.pi)):
        found = model.frequency_response(
            [2.0], ["slew.effort"], ["slew.angle"], exact=True, friction=friction
        )
        assert found.response[0, 0, 0] == pytest.approx(1 / (10.0 - 4.0 + 2j * c), rel=1e-5)


def test_friction_by_an_expression_is_told() -> None:
    """Its slope is that of the regularised law, 10 at speeds below 0.001 rad/s; drag and a linear
    damper are what they are."""
    scenes = {law: pendulum(law={"effort": law}) for law in
              ("-0.01*tanh(u/0.001)", "-0.3*u*abs(u)", "-0.2*u", "-2*sinh(u)")}  # fmt: skip
    told = [law for law, scene in scenes.items() if not compile_model(scene).linearize().trusted]
    assert told == ["-0.01*tanh(u/0.001)"]
    (text,) = compile_model(scenes[told[0]]).linearize().warnings
    assert "damping of pivot.angle is valid for speeds close to the state only" in text


def test_friction_that_jumps_is_told() -> None:
    """No slope shows it; its jump is twice the friction, and sliding (u = 0.5) has none."""
    jumps = {"-0.01*sign(u)": 0.02, "-0.2*u - 0.01*sign(u)": 0.02, "-0.01*where(u > 0, 1, 0)": 0.01}
    smooth = ["-0.2*u", "-0.3*u*abs(u)", "-0.3*sign(u)*u", "-0.2*u*where(u > 0, 1, 2)",
              "-0.01*sign(q)", "-1000*u"]  # fmt: skip
    for law in (*jumps, *smooth):
        model = compile_model(pendulum(law={"effort": law}))
        linear = model.linearize([0.0], [0.0])
        told = [risk for risk in linear.risks if risk.name == "dry-friction"]
        assert [risk.value for risk in told] == pytest.approx([jumps[law]] if law in jumps else [])
        assert linear.trusted == (law not in jumps)
        assert linear.frequency_response([2.0], ["pivot.effort"]).trusted == (law not in jumps)
        assert linear.modes().trusted == (law not in jumps)
    model = compile_model(pendulum(law={"effort": "where(u > 0, -0.01, 0.01)"}))
    (text,) = model.modes().warnings
    assert "an effort along pivot.angle jumps by 0.02 N*m" in text
    sliding = compile_model(pendulum(law={"effort": "-0.01*sign(u)"})).linearize([0.0], [0.5])
    assert not any(risk.name == "dry-friction" for risk in sliding.risks)


def row_of_pendulums(n: int, laws: dict[int, str]) -> mstmm.Scene:
    """Pendulums beside each other on the ground, some with laws."""
    body = {"mass": 1.0, "center_of_mass": [0, -1, 0], "inertia": [0, 0, 0]}
    hinge = {"type": "pin", "inboard": "ground"}
    return mstmm.Scene(
        gravity=(0, -9.81, 0), body=[body | {"name": f"b{k}"} for k in range(n)],
        hinge=[hinge | {"name": f"h{k}", "outboard": f"b{k}"}
               | ({"law": {"effort": laws[k]}} if k in laws else {}) for k in range(n)],
    )  # fmt: skip


def test_friction_by_expressions_in_large_scenes_is_told() -> None:
    """Beyond 400 coordinates: a jump of 0.02, a damping that saturates, drag that does not."""
    laws = {3: "-0.01*sign(u)", 200: "-0.3*u*abs(u)", 300: "-0.2*u"}
    jumping = compile_model(row_of_pendulums(410, laws))
    linear = jumping.linearize(np.zeros(410))
    told = [risk for risk in linear.risks if risk.name == "dry-friction"]
    assert [risk.element for risk in told] == ["h3.angle"] and not linear.trusted
    assert told[0].value == pytest.approx(0.02)
    saturating = compile_model(
        row_of_pendulums(410, {7: "-0.01*tanh(u/0.001)", 200: "-0.3*u*abs(u)"})
    )
    told = [r for r in saturating.linearize(np.zeros(410)).risks if r.name == "dry-friction"]
    assert [risk.element for risk in told] == ["h7.angle"]


def spun_disc(law: str) -> mstmm.Model:
    """A disc that a drive spins, on a carriage whose slide along y has a law."""
    spring = {"stiffness": 100.0}
    light = {"mass": 0.1, "inertia": [1e-3] * 3}
    return compile_model(mstmm.Scene(
        gravity=(0, 0, 0),
        body=[{"name": "slide", **light}, {"name": "housing", **light},
              {"name": "disc", "mass": 1.0, "inertia": [0.1, 0.05, 0.05]}],
        hinge=[{"name": "y", "type": "prismatic", "axis": [0, 1, 0], "inboard": "ground",
                "outboard": "slide", "law": spring | {"effort": law}},
               {"name": "z", "type": "prismatic", "axis": [0, 0, 1], "inboard": "slide",
                "outboard": "housing", "law": spring},
               {"name": "x", "type": "pin", "axis": [1, 0, 0], "inboard": "housing",
                "outboard": "disc", "drive": "30*t"}],
    ))  # fmt: skip


def test_friction_by_an_expression_is_told_in_the_fixed_frame() -> None:
    for law, trusted in (("-0.5*sign(u)", False), ("-0.5*u", True)):
        linear = spun_disc(law).linearize()
        assert linear.trusted == linear.to_fixed_frame().trusted == trusted
        fixed = replace(linear, frame_transform=FrameTransform(np.eye(2), np.zeros((2, 2))))
        assert any(risk.name == "dry-friction" for risk in fixed.risks) != trusted


def test_friction_by_an_expression_is_told_beside_rolling() -> None:
    """A wheel that rolls on the ground at a constant speed, a bar on its hub at rest beside it."""
    wheel = {"name": "wheel", "mass": 1.0, "inertia": [0.02, 0.04, 0.02]}
    arm = {"name": "arm", "mass": 0.5, "inertia": [0.01] * 3}
    for law, trusted in (("-0.01*sign(u)", False), ("-0.01*u", True)):
        model = compile_model(mstmm.Scene(
            gravity=(0, 0, 0), body=[wheel, arm],
            hinge=[{"name": "motion", "type": "free", "inboard": "ground", "outboard": "wheel",
                    "initial": {"q": [0, 0, 0.3, 1, 0, 0, 0], "u": [0.6, 0, 0, 0, 2.0, 0]}},
                   {"name": "hub", "type": "pin", "axis": [0, 1, 0], "inboard": "wheel",
                    "outboard": "arm", "law": {"effort": law, "stiffness": 1.0}}],
            constraint=[{"name": "road", "type": "rolling", "from": "ground", "to": "wheel",
                         "normal": [0, 0, 1], "radius": 0.3, "axis": [0, 1, 0]}],
        ))  # fmt: skip
        linear = model.linearize(*model.initial_state())
        assert not linear.has_stiffness
        assert any(risk.name == "dry-friction" for risk in linear.risks) != trusted
