"""What a run by the classical method gives, and what it refuses by name."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Status
from tests.support.scenes import elastic_bar
from tests.support.scenes.classical import beam, rods, spinning_rods, tree

RICCATI, PRODUCT = "dttmm-classical", "dttmm-classical-product"


def test_times_between_steps_and_a_last_short_step() -> None:
    model = mstmm.compile(rods(2))
    times = [0.0, 0.013, 0.02, 0.5, 0.777, 0.995]
    run = model.simulate(0.995, RICCATI, 0.01, output_times=times)
    steps = model.simulate(0.995, RICCATI, 0.01)
    assert run.t.tolist() == times
    assert steps.t[-1] == 0.995 and len(steps.t) == 101
    assert run.q[-1].tolist() == steps.q[-1].tolist()
    assert run.q[2].tolist() == steps.q[2].tolist()
    exact = model.simulate(0.995, rtol=1e-11, atol=1e-12, output_times=times)
    assert run.q == pytest.approx(exact.q, abs=2e-3)
    assert run.u == pytest.approx(exact.u, abs=2e-2)


def test_samples_between_steps_are_of_second_order() -> None:
    model, errors = mstmm.compile(spinning_rods()), []
    exact = model.simulate(0.5, rtol=1e-11, atol=1e-12, output_times=[0.1234])
    for step in (0.01, 0.005, 0.0025):
        run = model.simulate(0.5, RICCATI, step, output_times=[0.1234])
        errors.append(float(np.abs(run.q - exact.q).max()))
    assert errors[2] < errors[0] / 12


def test_angles_and_quaternions_go_on_through_whole_turns() -> None:
    model = mstmm.compile(rods(1))
    run = model.simulate(2.0, RICCATI, 0.005, initial=([0.0], [20.0]))
    exact = model.simulate(2.0, output_times=[2.0], initial=([0.0], [20.0]))
    assert run.q[-1] == pytest.approx(exact.q[-1], abs=0.05)
    assert run.q[-1, 0] > 2 * np.pi
    ball = mstmm.compile(rods(1, "ball"))
    turned = ball.simulate(2.0, RICCATI, 0.005, initial=([1.0, 0, 0, 0], [1.0, 0, 20.0]))
    assert np.abs(np.diff(turned.q, axis=0)).max() < 0.1


def test_the_work_of_dampers_closes_the_energy() -> None:
    model = mstmm.compile(tree(["elastic"]))
    run = model.simulate(1.0, RICCATI, 0.002)
    assert run.work[-1] < -0.5
    balance = run.energy() - run.work
    assert np.abs(balance - balance[0]).max() < 0.01 * abs(run.work[-1])


def test_a_result_is_saved_loaded_and_certified(tmp_path: Path) -> None:
    run = mstmm.compile(rods(2)).simulate(
        0.5, mstmm.methods.ClassicalDiscreteTime(RICCATI, scheme="hht:0.1"), 0.005, certify=True
    )
    error = run.certificate.error
    assert error is not None and 1e-5 < error.largest()["rad"] < 1e-2
    run.save(tmp_path / "run.nc")
    again = mstmm.load_result(tmp_path / "run.nc")
    assert again.settings == run.settings
    assert again.q.tolist() == run.q.tolist()


def test_steps_are_counted_and_limited() -> None:
    run = mstmm.compile(rods(2)).simulate(
        1.0, mstmm.methods.ClassicalDiscreteTime(RICCATI, max_steps=7, iterations=20), 0.01
    )
    assert run.status is Status.TOO_MANY_STEPS
    assert len(run.t) == 8
    assert run.statistics is not None and run.statistics.evaluations >= 14


def test_ctrl_c_keeps_what_was_computed(heard: None) -> None:
    def interrupt(t: float, t_end: float) -> None:
        if t > 1.0:
            signal.raise_signal(signal.SIGINT)

    run = mstmm.compile(rods(2)).simulate(
        1e4, RICCATI, 0.001, execution=mstmm.Execution(progress=interrupt)
    )
    assert run.status is None and "interrupted at t = " in run.message
    assert 1.0 < run.t[-1] < 1e4


def test_options_are_for_this_method_alone() -> None:
    model = mstmm.compile(rods(1))
    with pytest.raises(SceneError, match="takes neither scheme nor iterations"):
        model.simulate(0.1, mstmm.methods.ClassicalDiscreteTime("dop853", scheme="hht"))
    with pytest.raises(SceneError, match="takes neither scheme nor iterations"):
        model.simulate(0.1, mstmm.methods.ClassicalDiscreteTime("dop853", iterations=2))
    with pytest.raises(SceneError, match=r'scheme: method "dop853" .*dttmm-classical'):
        mstmm.methods.method("dop853", scheme="hht")


def test_a_batch_is_refused() -> None:
    model = mstmm.compile(rods(1))
    with pytest.raises(SceneError, match="cannot run batches; use simulate"):
        model.simulate_batch(([[0.0]], [[0.0]]), t_end=0.1, method=RICCATI, step=0.01)


@pytest.mark.parametrize("method", [RICCATI, PRODUCT])
def test_what_is_welded_on_needs_no_mass(method: str) -> None:
    tool = {"name": "tool", "mass": 0.0, "ends": {"tip": [0.2, 0, 0]}}
    weld = {"name": "weld", "type": "fixed", "inboard": "b", "outboard": "tool"}
    alone = mstmm.Scene(gravity=[0, -9.81, 0], body=[_BODY], hinge=[_PIN])
    both = mstmm.Scene(gravity=[0, -9.81, 0], body=[_BODY, tool], hinge=[_PIN, weld])
    runs = [mstmm.compile(one).simulate(0.5, method, 0.01) for one in (alone, both)]
    assert runs[1].q == pytest.approx(runs[0].q, abs=1e-10)


def test_nothing_to_do_is_the_start_alone() -> None:
    run = mstmm.compile(rods(2)).simulate(0.0, RICCATI, 0.01)
    assert run.success and run.t.tolist() == [0.0]


@pytest.mark.parametrize(
    "options, said",
    [
        ({"scheme": "euler"}, "use one of generalised-alpha, hht, newmark, wilson"),
        ({"scheme": "hht:x"}, "expected alpha from 0 to 0.333333"),
        ({"scheme": "newmark:0.4"}, "expected gamma from 0.5 to 1"),
        ({"iterations": 0}, "a whole number of iterations, 1 or more"),
    ],
)
def test_options_that_make_no_sense_are_refused(options: dict[str, Any], said: str) -> None:
    method = mstmm.methods.ClassicalDiscreteTime(RICCATI, **options)
    with pytest.raises(SceneError, match=said):
        mstmm.compile(rods(1)).simulate(0.1, method, 0.01)


def test_settings_that_make_no_sense_are_refused() -> None:
    model = mstmm.compile(rods(1))
    with pytest.raises(SceneError, match="takes fixed steps: give step"):
        model.simulate(0.1, RICCATI)
    with pytest.raises(SceneError, match="writes no checkpoints"):
        model.simulate(0.1, RICCATI, 0.01, execution=mstmm.Execution(checkpoint="x"))


_PIN = {"name": "h", "type": "pin", "inboard": "ground", "outboard": "b", "axis": [0, 0, 1]}
_BODY = {"name": "b", "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.1, 0.1, 0.1]}
_ARM = _PIN | {"outboard": "a"}

REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "load": (
        {
            "body": [_BODY], "hinge": [_PIN],
            "load": [{"name": "push", "on": "b", "force": [1, 0, 0]}],
        },
        'load "push".*the only supported loads are gravity and elastic hinges',
    ),
    "spring": (
        {
            "body": [_BODY], "hinge": [_PIN],
            "spring": [{"name": "s", "from": "ground", "to": "b", "position": [1, 1, 0]}],
        },
        'spring "s"',
    ),
    "event": (
        {"body": [_BODY], "hinge": [_PIN], "event": [{"name": "e", "when": "t > 1", "do": "stop"}]},
        'event "e".*neither locate nor process events',
    ),
    "hinge": (
        {"body": [_BODY], "hinge": [_PIN | {"type": "cylindrical"}]},
        'hinge "h".*type cylindrical.*supported are fixed, pin, ball, elastic, and free on the',
    ),
    "law": (
        {"body": [_BODY], "hinge": [_PIN | {"law": {"stiffness": 5.0}}]},
        'hinge "h".*a law on a hinge of type pin',
    ),
    "effort": (
        {"body": [_BODY], "hinge": [_PIN | {"law": {"effort": "sin(t)"}}]},
        'hinge "h".*efforts',
    ),
    "drive": ({"body": [_BODY], "hinge": [_PIN | {"drive": "0.1*sin(t)"}]}, 'hinge "h".*drives'),
    "friction": (
        {
            "body": [_BODY],
            "hinge": [
                {
                    "name": "h", "type": "elastic", "inboard": "ground", "outboard": "b",
                    "law": {
                        "stiffness": [1, 1, 1, 1, 1, 1],
                        "friction": [{"coulomb": 1.0, "regularisation_velocity": 0.1}] * 6,
                    },
                }
            ],
        },
        'hinge "h".*friction',
    ),
    "slack": (
        {
            "body": [_BODY],
            "hinge": [
                {
                    "name": "h", "type": "elastic", "inboard": "ground", "outboard": "b",
                    "law": {"stiffness": [1, 1, 0, 1, 1, 1]},
                }
            ],
        },
        'hinge "h".*along x, y and z',
    ),
    "stiffening": (
        {"beam": [beam("a", {"y": 1}, stiffening=True)], "hinge": [_ARM]},
        '"a".*set stiffening = false',
    ),
    "finite elements": (
        {
            "elastic": [elastic_bar.table(modes=1)],
            "hinge": [{"name": "h", "type": "fixed", "inboard": "ground", "outboard": "bar.root"}],
        },
        '"bar".*beams are the only flexible bodies with matrices',
    ),
    "twist": (
        {"beam": [beam("a", {"y": 1, "twist": 1})], "hinge": [_ARM]},
        '"a".*twist and axial',
    ),
    "mean": (
        {"beam": [beam("a", {"y": 1}, frame="mean")], "hinge": [_ARM]}, '"a".*tangent or chord',
    ),
    "shapes": ({"beam": [beam("a", {"y": 4})], "hinge": [_ARM]}, '"a".*one shape along y'),
    "two on a beam": (
        {
            "beam": [beam("a", {"y": 1}, ends={"mid": 0.5})],
            "body": [_BODY, _BODY | {"name": "c"}],
            "hinge": [
                _ARM, _PIN | {"name": "h1", "inboard": "a.tip"},
                _PIN | {"name": "h2", "inboard": "a.mid", "outboard": "c"},
            ],
        },
        'hinge "h2".*carries another hinge',
    ),
}  # fmt: skip


@pytest.mark.parametrize("scene, said", REFUSED.values(), ids=REFUSED)
def test_what_has_no_matrix_is_refused_by_name(scene: dict[str, Any], said: str) -> None:
    model = mstmm.compile(mstmm.Scene(gravity=[0, -9.81, 0], **scene))
    with pytest.raises(SceneError, match=said):
        model.simulate(0.1, RICCATI, 0.01)


@pytest.mark.parametrize("inertia", [[0.1, 0.1, 0.1], [0.1, 0.1, 0.1, 0.01, 0.0, 0.0]],
                         ids=["plane", "space"])  # fmt: skip
def test_a_twist_of_several_turns_keeps_its_spring(inertia: list[float]) -> None:
    law = {"stiffness": [100, 100, 100, 1, 1, 0.02], "damping": [1, 1, 1, 0.1, 0.1, 0]}
    hinge = {"name": "h", "type": "elastic", "inboard": "ground", "outboard": "b", "law": law}
    body = {"name": "b", "mass": 1.0, "center_of_mass": [0, 0, 0], "inertia": inertia}
    model = mstmm.compile(mstmm.Scene(gravity=[0, 0, 0], body=[body], hinge=[hinge]))
    start = ([0, 0, 0, 1.0, 0, 0, 0], [0, 0, 0, 0, 0, 8.0])
    run = model.simulate(4.0, RICCATI, 0.002, initial=start)
    exact = model.simulate(4.0, rtol=1e-10, initial=start)
    assert run.trajectory.memory[-1, 0] > 4 * np.pi
    assert run.trajectory.memory[-1] == pytest.approx(exact.trajectory.memory[-1], abs=1e-2)
    assert run.q[-1, 3:] == pytest.approx(exact.q[-1, 3:], abs=1e-2)
    assert run.energy() - run.work == pytest.approx(run.energy()[0], rel=1e-2)
