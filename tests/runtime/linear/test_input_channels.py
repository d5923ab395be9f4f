"""Forces on ends, and motions of ends, where nothing else hangs or acts on them."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from mstmm.errors import NumericalFailure, SceneError
from tests.support.paths import EXAMPLES
from tests.support.scenes.linear import UNIT, pendulum


def cantilever(**more: object) -> mstmm.Model:
    scene = mstmm.Scene(
        gravity=(0, 0, 0), beam=[{"name": "beam", **UNIT, "modes": {"y": 4}}],
        hinge=[{"name": "foot", "type": "fixed", "inboard": "ground", "outboard": "beam"}],
        **more,
    )  # fmt: skip
    return mstmm.compile(scene, engine="looped")


def test_a_tip_gives_way_by_a_third() -> None:
    """F L^3 / 3 E I, pushed almost at rest, and a moment M L / E I for the slope."""
    model = cantilever()
    found = model.frequency_response([1e-3], ["beam.tip.fy", "beam.tip.mz"], ["beam.tip.y"])
    np.testing.assert_allclose(found.response[0, 0], [1 / 3, 1 / 2], rtol=1e-2)
    loaded = cantilever(load=[{"on": "beam.tip", "force": [0, 0, 0]}])
    ours, theirs = (x.linearize(inputs=["beam.tip.fy"]).V for x in (model, loaded))
    np.testing.assert_allclose(ours, theirs, atol=1e-14)


def test_the_tip_of_a_hinged_beam_goes_round_with_it() -> None:
    """Two metres behind the pin a force of 1 N has a moment of 2 N m."""
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0), beam=[{"name": "boom", **UNIT, "length": 2.0, "modes": {"y": 2}}],
        hinge=[{"name": "pin", "type": "pin", "inboard": "ground", "outboard": "boom",
                "law": {"stiffness": 1e5}}],
    )  # fmt: skip
    linear = mstmm.compile(scene).linearize([0, 0, 0], inputs=["boom.tip.fy"])
    assert linear.V[0, 0] == pytest.approx(2.0)
    assert linear.output_matrices(["boom.tip.vy"])[0][0, 3] == pytest.approx(2.0)


def test_the_tip_of_a_panel() -> None:
    model = mstmm.compile(mstmm.load_scene(EXAMPLES / "satellite_panels" / "scene.toml"))
    linear = model.linearize(inputs=["east.tip.fy"])
    assert np.abs(linear.V).max() > 0.5


def test_an_output_of_the_scene_is_the_quantity_that_it_names() -> None:
    outputs = [{"name": "sway", "of": "beam.tip.y"}]
    linear = cantilever(output=outputs).linearize(inputs=["beam.tip.fy"])
    ours = linear.frequency_response([1.0], outputs=["sway"]).response
    np.testing.assert_allclose(
        ours, linear.frequency_response([1.0], outputs=["beam.tip.y"]).response
    )
    with pytest.raises(SceneError, match="expected a list of names"):
        linear.output_matrices("sway")


def test_an_output_that_is_an_expression_goes_by_its_slope() -> None:
    """Of a pendulum on a spring: x = sin q of its tip and y'' = x q'', at rest."""
    of = "sqrt(bob.tip.x^2 + 2) + 3*pivot.angle_rate + t*sin(pivot.angle) - bob.tip.ay*bob.tip.x"
    scene = pendulum(0.4, law={"stiffness": 5.0, "rest": 1.0, "damping": 0.3})
    outputs = [{"name": "mixed", "of": of, "unit": "m"}, {"name": "still", "of": "bob.tip.z"}]
    data = scene.model_dump(by_alias=True, exclude_defaults=True) | {"output": outputs}
    model = mstmm.compile(mstmm.Scene(**data), engine="looped")
    linear = model.linearize(t=2.0, inputs=["pivot.effort"])
    q = linear.state.q[0]
    omega, x = np.array([0.5, 4.0, 20.0]), np.sin(q)
    assert 0.3 < q < 0.4
    response = linear.frequency_response(omega, outputs=["mixed", "pivot.angle", "still"])
    assert response.output_units[0] == "m" and not response.response[:, 2].any()
    slope = x * np.cos(q) / np.sqrt(x**2 + 2) + 3j * omega + 2 * np.cos(q) + x * omega**2 * x
    np.testing.assert_allclose(
        response.response[:, 0, 0], slope * response.response[:, 1, 0], rtol=1e-10
    )
    system = linear.output_matrices(["mixed"])
    states = 1j * omega[:, None, None] * np.eye(2) - linear.A
    found = system[0] @ np.linalg.solve(states, linear.B[None]) + system[1]
    np.testing.assert_allclose(found[:, 0, 0], response.response[:, 0, 0], rtol=1e-10)


def test_outputs_without_a_slope_are_named() -> None:
    outputs = [{"name": "root", "of": "sqrt(beam.tip.y)"}, {"name": "none", "of": "2*energy"}]
    linear = cantilever(output=outputs).linearize([0] * 4)
    for name, found in (
        ("root", 'output "root": of: "sqrt.beam.tip.y." has no finite derivative'),
        ("none", 'output "none": of: "energy": expected a coordinate'),
    ):
        with pytest.raises(SceneError, match=found):
            linear.frequency_response([1.0], ["beam.tip.fy"], [name])


def two_masses() -> mstmm.Scene:
    slide = {"type": "prismatic", "axis": [1, 0, 0], "inboard": "ground"}
    law = {"stiffness": 5.0, "rest": 1.0}
    return mstmm.Scene(
        gravity=(0, 0, 0),
        body=[{"name": name, "mass": mass, "inertia": [1, 1, 1]}
              for name, mass in (("a", 1.0), ("c", 2.0))],
        hinge=[{**slide, "name": "on_a", "outboard": "a", "law": {"stiffness": 10.0}},
               {**slide, "name": "on_c", "outboard": "c", "position": [1, 0, 0]}],
        spring=[{"name": "between", "from": "a", "to": "c", "law": law}],
    )  # fmt: skip


def test_springs_have_their_own_part_of_the_strain() -> None:
    modes = mstmm.compile(two_masses()).modes()
    strain, shape = modes.strain_energy_shares(), modes.shapes
    held, between = 10 * shape[0] ** 2, 5 * (shape[1] - shape[0]) ** 2
    np.testing.assert_allclose(strain["springs"], between / (held + between), atol=1e-12)
    np.testing.assert_allclose(strain["on_a"], held / (held + between), atol=1e-12)
    np.testing.assert_allclose(strain["on_c"], 0.0, atol=1e-12)


def rod(law: dict[str, object], **more: object) -> mstmm.Model:
    pin = {"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "rod", "law": law}
    body = {"name": "rod", "mass": 1.0, "center_of_mass": [0, -0.5, 0], "inertia": [1, 1, 1]}
    return mstmm.compile(mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[pin], **more))


def test_a_law_without_slope_is_named() -> None:
    linear = rod({"effort": "-sqrt(q)"}).linearize([0.0])
    for ask in (linear.modes, lambda: linear.K):
        with pytest.raises(NumericalFailure, match=r'"pivot": law.effort.*no finite derivative'):
            ask()


def test_pushes_that_move_nothing() -> None:
    driven = {"name": "turn", "type": "pin", "inboard": "ground", "outboard": "arm", "drive": "t"}
    hung = {"name": "pivot", "type": "pin", "inboard": "arm.tip", "outboard": "bob"}
    scene = mstmm.Scene(
        gravity=(0, 0, 0), hinge=[driven, hung], input=[{"name": "idle"}],
        body=[{"name": name, "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [1, 1, 1],
               "ends": {"tip": [1, 0, 0]}} for name in ("arm", "bob")],
    )  # fmt: skip
    model = mstmm.compile(scene, engine="looped")
    with pytest.raises(SceneError, match='hinge "turn" is driven there'):
        model.linearize(inputs=["turn.effort"])
    linear = model.linearize([0, 0], inputs=["idle"])
    assert any("input idle has no effect" in text for text in linear.warnings)
