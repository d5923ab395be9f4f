"""Springs between ends in results and linear models: length, effort, and where they push."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError

LAW = {"stiffness": 900.0, "damping": 12.0, "rest": 0.9, "effort": "motor + 30*q*swing.q - 4*u"}


def crane(**more: Any) -> mstmm.Model:
    """A boom on a pin, held by a strut from the ground; a load swings on its tip."""
    boom = {"name": "boom", "mass": 3.0, "center_of_mass": [0.8, 0, 0], "inertia": [0.1, 0.5, 0.5],
            "ends": {"mid": [0.9, 0, 0], "tip": [1.6, 0, 0]}}  # fmt: skip
    load = {"name": "load", "mass": 1.0, "center_of_mass": [0, -0.5, 0], "inertia": [0.1, 0.1, 0.1]}
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0), body=[boom, load],
        hinge=[{"name": "foot", "type": "pin", "inboard": "ground", "outboard": "boom"},
               {"name": "swing", "type": "pin", "inboard": "boom.tip", "outboard": "load",
                "law": {"damping": 0.2}}],
        spring=[{"name": "strut", "from": "ground", "position": [0.1, -0.8, 0], "to": "boom.mid",
                 "law": LAW}],
        input=[{"name": "motor", "unit": "N", "value": 2.0}],
        **more,
    )  # fmt: skip
    return mstmm.compile(scene, engine="looped")


def test_quantities_of_results() -> None:
    result = crane().simulate(0.5, output_times=[0.0, 0.2, 0.5])
    apart = result.position("boom.mid") - [0.1, -0.8, 0]
    length = np.linalg.norm(apart, axis=1)
    rate = np.sum(apart * result.velocity("boom.mid"), axis=1) / length
    swing = result.quantity("swing.angle").values
    effort = -900 * (length - 0.9) - 12 * rate + 2 + 30 * length * swing - 4 * rate
    for kind, found, unit in (("length", length, "m"), ("length_rate", rate, "m/s"),
                              ("effort", effort, "N")):  # fmt: skip
        quantity = result.quantity(f"strut.{kind}")
        np.testing.assert_allclose(quantity.values, found, rtol=1e-12, atol=1e-12)
        assert quantity.unit == unit
    assert abs(rate[1]) > 0.01
    with pytest.raises(SceneError, match=r'did you mean "strut\.length"'):
        result.quantity("strut.lenght")


def test_the_column_of_an_effort_is_how_the_length_goes() -> None:
    """Both beside the derivative of the length by differences, and the effort beside that of the
    law."""
    model = crane()
    linear = model.linearize(inputs=["strut.effort", "motor"])
    assert linear.input_names == ("strut.effort", "motor") and linear.input_channels[0].unit == "N"
    c, d = linear.output_matrices(["strut.length", "strut.length_rate", "strut.effort"])
    np.testing.assert_allclose(linear.V[:, 0], linear.V[:, 1], atol=1e-13)
    np.testing.assert_allclose(linear.V[:, 0], c[0, :2], atol=1e-13)
    np.testing.assert_allclose(c[1], [0, 0, *c[0, :2]], atol=1e-13)
    np.testing.assert_allclose(d, [[0, 0], [0, 0], [0, 1]], atol=1e-13)

    def length_and_effort(q: Any, u: Any) -> np.ndarray:
        run = model.simulate(1e-9, output_times=[0.0], initial=(q, u))
        return np.array([run.quantity(f"strut.{x}").values[0] for x in ("length", "effort")])

    q, u, step = linear.state.q, linear.state.u, 1e-6
    for k in range(2):
        e = step * np.eye(2)[k]
        by_q = (length_and_effort(q + e, u) - length_and_effort(q - e, u)) / (2 * step)
        by_u = (length_and_effort(q, u + e) - length_and_effort(q, u - e)) / (2 * step)
        np.testing.assert_allclose(c[[0, 2], k], by_q, rtol=1e-6, atol=1e-7)
        np.testing.assert_allclose(c[2, 2 + k], by_u[1], rtol=1e-6, atol=1e-7)


def test_outputs_of_springs_in_the_scene() -> None:
    outputs = [{"name": "stroke", "of": "1000*(strut.length - 0.9)", "unit": "mm"},
               {"name": "push", "of": "strut.effort"}]  # fmt: skip
    model = crane(output=outputs)
    answer = model.frequency_response([2.0, 9.0])
    assert answer.output_names == ("stroke", "push") and answer.output_units == ("mm", "N")
    plain = model.frequency_response([2.0, 9.0], outputs=["strut.length"])
    np.testing.assert_allclose(answer.response[:, :1], 1000 * plain.response, rtol=1e-12)
    run = model.simulate(0.1)
    np.testing.assert_array_equal(run.quantity("push").values, run.quantity("strut.effort").values)


def test_what_makes_no_sense() -> None:
    with pytest.raises(SceneError, match=r'did you mean "strut\.effort"'):
        crane().linearize(inputs=["strut.efort"])
    with pytest.raises(SceneError, match="at a moving state"):
        crane().linearize([0, 0], [1, 0]).output_matrices(["strut.effort"])
