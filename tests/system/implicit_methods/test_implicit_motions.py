"""Known motions by implicit methods: figures of independent programs, limits and orders."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import mstmm
from benchmarks.stiff import references
from benchmarks.stiff.cases import CASES
from mstmm.runtime.model.model import Model
from tests.support.implicit_methods import motions
from tests.support.implicit_methods.motions import KNOWN
from tests.support.paths import EXAMPLES

#: Absolute angles of the double pendulum after 1 s, from Lagrange's equations.
ANGLES = np.array([-2.77851256, -2.38518735])
STEPS = (0.02, 0.01, 0.005, 0.0025)


@cache
def known_model(name: str) -> Model:
    return mstmm.compile(mstmm.Scene(**KNOWN[name].scene), engine="looped")


def bushed_pendulum(k: float, zeta: float = 0.0, stretch: float = 0.0) -> Model:
    """The double pendulum on bushings, with dampers."""
    scene = motions.double_pendulum(k, stretch)
    for hinge in scene["hinge"]:
        hinge["law"] = motions.bushing(k, zeta)["law"]
    return mstmm.compile(mstmm.Scene(**scene), engine="looped")


def distance(name: str, method: str, step: float | None = None, **more: Any) -> float:
    """How far (m) the end is from where it is known to be."""
    case = KNOWN[name]
    run = known_model(name).simulate(case.t_end, method, step, output_times=[case.t_end], **more)
    assert run.success, run.message
    return float(np.linalg.norm(run.position(case.end)[-1] - case.place))


def angle_error(model: Model, method: str, step: float) -> float:
    run = model.simulate(1.0, method, step, output_times=[1.0])
    turns = run.q[-1] if model.nq == 2 else run.q[-1][[2, 5]]
    return float(np.abs(np.cumsum(turns) - ANGLES).max())


# --- rigid rods -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "method, largest",
    [("genalpha", 1.5e-3), ("dttmm", 1.5e-3), ("newmark", 1.5e-3), ("hht", 2e-3),
     ("wilson", 4e-3), ("houbolt", 1e-2)],
)  # fmt: skip
def test_double_pendulum_to_second_order(method: str, largest: float) -> None:
    """The discrete form tends to the motion of the acceleration form as the square of the step."""
    errors = [angle_error(known_model("double pendulum"), method, step) for step in STEPS]
    assert errors[1] < largest
    assert np.log2(errors[:-1]) - np.log2(errors[1:]) == pytest.approx([2.0] * 3, abs=0.05)


def test_one_linearisation_a_step_is_as_good_as_many() -> None:
    for step in STEPS:
        once, often = (
            angle_error(known_model("double pendulum"), method, step)
            for method in ("dttmm", "genalpha")
        )
        assert once == pytest.approx(often, rel=0.02)


@pytest.mark.parametrize("method", ["genalpha", "dttmm", "newmark", "hht"])
def test_double_pendulum_keeps_its_energy_in_hinge_coordinates(method: str) -> None:
    """In absolute coordinates undamped Newmark is lost within 8 s; 20 J are exchanged."""
    run = known_model("double pendulum").simulate(20.0, method, 0.01)
    assert run.success, run.message
    energy = np.asarray(run.energy())
    assert np.abs(energy - energy[0]).max() < 0.35


@pytest.mark.parametrize("method", ["genalpha", "dttmm", "newmark", "hht", "wilson"])
def test_rods_on_balls_to_second_order(method: str) -> None:
    errors = [distance("rods on balls", method, step) for step in STEPS]
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[-1]) / 3 == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("method", ["rodas4p2", "rodas5p", "esdirk436", "kvaerno5"])
def test_rods_on_balls_to_the_seventh_digit(method: str) -> None:
    assert distance("rods on balls", method, rtol=1e-9, atol=1e-11) < 1e-7


@pytest.mark.parametrize("method", ["rodas4p2", "rodas5p", "esdirk436", "kvaerno5"])
def test_bodies_that_turn_by_far_in_a_step(method: str) -> None:
    """Light ones that spin on balls about a heavy one: the mass matrix of a stage is another than
    that of the step's start."""
    scene = mstmm.load_scene(EXAMPLES / "three_bodies_on_balls/scene.toml")
    model = mstmm.compile(scene, engine="looped")
    times = [2.0]
    exact = model.simulate(2.0, rtol=1e-11, atol=1e-12, output_times=times).q
    for step, error in ((0.02, 0.1), (0.01, 6e-3), (0.005, 3e-4)):
        run = model.simulate(2.0, method, step, output_times=times)
        assert run.success, run.message
        assert run.q == pytest.approx(exact, abs=error)
    run = model.simulate(2.0, method, rtol=1e-4, atol=1e-6, output_times=times)
    assert run.success, run.message
    assert run.q == pytest.approx(exact, abs=2e-2)
    assert run.statistics is not None
    assert run.statistics.steps < 150


# --- bushings -------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["rodas4p2", "rodas4", "rodas5p"])
def test_accelerations_are_carried_where_springs_are_stiff_and_evaluated_elsewhere(
    method: str,
) -> None:
    """A step of the former takes residuals, one of the latter evaluations."""
    stiff = known_model("double pendulum, 1e8").simulate(1.0, method, 0.01, output_times=[1.0])
    turning = known_model("rods on balls").simulate(1.0, method, 0.01, output_times=[1.0])
    assert stiff.statistics is not None
    assert turning.statistics is not None
    assert stiff.statistics.residuals > 2 * stiff.statistics.evaluations
    assert turning.statistics.evaluations > 10 * turning.statistics.residuals


@pytest.mark.parametrize("rtol, error", [(1e-3, 5e-4), (1e-4, 1e-4), (1e-6, 2e-6)])
def test_ten_rods_on_stiff_bushings_to_the_tolerance(rtol: float, error: float) -> None:
    """Evaluated accelerations alone err by up to ten times as much."""
    case = CASES["a10-1e8"]
    model = mstmm.compile(mstmm.Scene(**case.scene()), engine="looped")
    run = model.simulate(1.0, "rodas4p2", rtol=rtol, atol=rtol / 100, output_times=[1.0])
    assert run.success, run.message
    exact, _ = references.load_reference(case)
    assert np.linalg.norm(references.end_positions(run, case) - exact, axis=1).max() < error


@pytest.mark.parametrize("k", [1e8, 1e10])
def test_steps_on_stiff_bushings_err_as_those_on_pins(k: float) -> None:
    """The springs vibrate at up to 3e5 rad/s; one linearisation a step in hinge coordinates."""
    model = bushed_pendulum(k)
    for step in STEPS:
        pinned = angle_error(known_model("double pendulum"), "dttmm", step)
        assert angle_error(model, "dttmm", step) == pytest.approx(pinned, rel=0.02)


@pytest.mark.parametrize("method", ["rodas5p", "kvaerno5"])
def test_stiff_bushings_tend_to_pins_as_their_compliance(method: str) -> None:
    place = KNOWN["double pendulum"].place
    parts = []
    for k in (1e4, 1e6, 1e8):
        run = bushed_pendulum(k, 1.0).simulate(
            1.0, method, rtol=1e-9, atol=1e-12, output_times=[1.0]
        )
        assert run.success, run.message
        parts.append(k * float(np.linalg.norm(run.position("rod1.tip")[-1] - place)))
    assert parts[1] == pytest.approx(parts[2], rel=0.03)
    assert parts[0] == pytest.approx(parts[2], rel=0.3)


@pytest.mark.parametrize("method, radius", [("genalpha", None), ("dttmm", None), ("hht", None),
                                            ("genalpha", 0.2)])  # fmt: skip
def test_the_energy_of_a_vibration_that_no_step_resolves_leaves(
    method: str, radius: float | None
) -> None:
    """A spring of 1e6 N/m holds 0.5 J, the step is five of its periods; the rods keep theirs."""
    run = bushed_pendulum(1e6, stretch=1e-3).simulate(
        2.0, mstmm.methods.GeneralizedAlpha(method, radius=radius), 0.01
    )
    assert run.success, run.message
    energy = np.asarray(run.energy())
    assert energy[-1] - energy[0] == pytest.approx(-0.45, abs=0.15)


@pytest.mark.parametrize("method, radius", [("newmark", None), ("genalpha", 1.0)])
def test_what_is_not_damped_does_not_grow(method: str, radius: float | None) -> None:
    """As long as Newton's iteration is made to converge: what it leaves is all that drives it."""
    run = bushed_pendulum(1e6, stretch=1e-3).simulate(
        12.0, mstmm.methods.GeneralizedAlpha(method, radius=radius), 0.01
    )
    assert run.success, run.message
    energy = np.asarray(run.energy())
    assert np.abs(energy - energy[0]).max() < 8.0


# --- beams ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "bending_stiffness, errors",
    [(5, (5.4e-3, 1.8e-3, 8.7e-5, 2.0e-5)), (500, (6.4e-5, 3.7e-5, 2.0e-5, 9.2e-5))],
)
def test_beam_pendulum_by_one_linearisation_a_step(
    bending_stiffness: int, errors: tuple[float, ...]
) -> None:
    """Errors that an independent program makes with the same steps, the last of which only begin to
    resolve its vibration."""
    name = f"beam, {bending_stiffness}"
    found = [distance(name, "dttmm", step) for step in (0.02, 0.01, 0.005, 0.001)]
    assert found == pytest.approx(errors, rel=0.03)


@pytest.mark.parametrize("method", ["rodas4p2", "rodas5p", "esdirk436", "kvaerno5"])
def test_beam_pendulum_to_the_tolerance(method: str) -> None:
    for name in ("beam, 5", "beam, 500"):
        assert distance(name, method, rtol=1e-6, atol=1e-8) < 3e-5
