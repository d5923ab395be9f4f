"""Answers that are no runs say how far they can be trusted, by the checks that runs have."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import mstmm
from mstmm.risk import AssessedResult, Risk
from mstmm.runtime.linear import root_locus
from mstmm.runtime.linear.linear_model import Linear
from mstmm.runtime.model.model import Model
from mstmm.runtime.result.checks.answer_checks import find_state_risks, merge_over_values

ROOT = Path(mstmm.__file__).resolve().parents[1]


def cantilever(load: float, constant: bool = False, **more: object) -> mstmm.Model:
    """A beam of unit length, mass and bending stiffness with a force across its tip."""
    beam = {
        "name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
        "modes": {"y": 4, "z": 0, "twist": 0, "axial": 0},
    }  # fmt: skip
    scene = mstmm.Scene(
        gravity=(0, 0, 0), beam=[beam | more], constants={"P": load},
        hinge=[{"name": "wall", "type": "fixed", "inboard": "ground", "outboard": "b.root"}],
        load=[{"on": "b.tip", "force": ["0-P", 0, 0] if constant else [0, "P", 0]}],
    )  # fmt: skip
    return mstmm.compile(scene, engine="looped")


def spinning_disc() -> mstmm.Model:
    """A disc that a drive spins on a carriage held by springs along y and z."""
    spring = {"stiffness": 100.0, "damping": 1.0}
    light = {"mass": 0.1, "inertia": [1e-3] * 3}
    scene = mstmm.Scene(
        gravity=(0, 0, 0), constants={"spin": 1.0},
        body=[{"name": "slide", **light}, {"name": "housing", **light},
              {"name": "disc", "mass": 1.0, "inertia": [0.1, 0.05, 0.05]}],
        hinge=[{"name": "y", "type": "prismatic", "axis": [0, 1, 0], "inboard": "ground",
                "outboard": "slide", "law": spring},
               {"name": "z", "type": "prismatic", "axis": [0, 0, 1], "inboard": "slide",
                "outboard": "housing", "law": spring},
               {"name": "pin", "type": "pin", "axis": [1, 0, 0], "inboard": "housing",
                "outboard": "disc", "drive": "spin*t"}],
    )  # fmt: skip
    return mstmm.compile(scene, engine="looped")


# --- every answer --------------------------------------------------------------------------------

#: Calls of a model that give an answer about a scene.
ANSWERS: dict[str, Callable[[mstmm.Model], object]] = {
    "assemble": lambda model: model.assemble(),
    "stability_limit": lambda model: model.stability_limit("constants.P", 1.0, 4.0),
    "equilibrium": lambda model: model.equilibrium(),
    "dynamic_stiffness_modes": lambda model: cantilever(0.0).dynamic_stiffness_modes(1),
    "frequency_response": lambda model: model.frequency_response([1.0]),
    "linearize": lambda model: model.linearize(),
    "root_locus": lambda model: model.root_locus("constants.P", [0.5, 1.0]),
    "modes": lambda model: model.modes(),
    "simulate": lambda model: model.simulate(0.1),
    "simulate_batch": lambda model: model.simulate_batch(model.initial_state(), t_end=0.1),
    "unbalance_response": lambda model: spinning_disc().unbalance_response(
        "constants.spin", [1.0, 2.0], "disc", 1e-3
    ),
    "waterfall": lambda model: model.waterfall(
        "constants.P", [0.5, 1.0], [1.0], "ground.acceleration.y", "b.tip.vy"
    ),
}

_VALUE = "a value of the equations at a state that is given, without a search or a range"
_MODEL = "another model, or a part of this one"
#: Other public calls, and why they carry no verdict.
EXEMPT = {
    "session": "its result() is that of a run",
    "assemble_path": "rows of closed states; assemble examines each",
    **dict.fromkeys(
        (
            "accelerations",
            "bias_efforts",
            "derivatives",
            "energy_components",
            "energy",
            "gravity_efforts",
            "integrate",
            "inverse_dynamics",
            "jacobian",
            "jacobian_rate",
            "mass_matrix",
            "momentum",
            "poses",
            "positions",
            "solve",
            "velocities",
        ),
        _VALUE,
    ),
    **dict.fromkeys(
        (
            "initial_state",
            "check_start_determined",
            "check_outputs",
            "with_packed_scene",
            "with_inputs",
            "with_parameters",
        ),
        _MODEL,
    ),
}


def test_every_public_call_is_an_answer_or_exempt() -> None:
    calls = {
        name for name, _ in inspect.getmembers(Model, inspect.isfunction) if name[0] != "_"
    }  # fmt: skip
    assert calls == ANSWERS.keys() | EXEMPT.keys()


@pytest.mark.parametrize("name", ANSWERS)
def test_answers_carry_a_verdict(name: str) -> None:
    answer = ANSWERS[name](cantilever(1.0, constant=True))
    assert isinstance(answer.trusted, bool)  # type: ignore[attr-defined]
    assert all(isinstance(text, str) for text in answer.warnings)  # type: ignore[attr-defined]
    html = answer._repr_html_()  # type: ignore[attr-defined]
    assert ("NOT trusted" in html) != answer.trusted or name == "simulate"  # type: ignore[attr-defined]


def test_answers_of_linear_models_are_assessed() -> None:
    for name in ("modes", "frequency_response", "dynamic_stiffness_modes"):
        assert callable(getattr(Linear, name)) and name in ANSWERS
    assert issubclass(Linear, AssessedResult)


# --- every check ---------------------------------------------------------------------------------

#: Risks of answers alone.
OF_ANSWERS = {
    "changing-coefficients", "changing-input", "controller-left-out", "dry-friction",
    "input-without-effect", "no-equilibrium", "output-left-out", "run-failed",
    "stability-unknown", "start-at-speed", "time-dependent", "unexamined",
    "unrestrained", "unstable", "unsteady-state",
}  # fmt: skip

_STEPS = "an answer about a state takes no steps"
_TIME = "an answer about a state covers no time"

#: Risk of runs that does not apply to answers about a state -> reason.
NOT_APPLICABLE = {
    **dict.fromkeys(
        ("step-stability", "step-accuracy", "stiff", "quaternion-length", "wanted-error"), _STEPS
    ),
    **dict.fromkeys(
        ("narrow-load", "pole", "switches", "chatter", "energy-drift", "momentum-drift",
         "one-way-loads", "one-way-blow", "one-way-release"), _TIME
    ),
}  # fmt: skip


def risk_names(*folders: str) -> set[str]:
    """The kinds of risk that the source in some folders gives rows for."""
    found = set()
    for folder in folders or ("mstmm", "runtime"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if (
                    isinstance(node, ast.Call)
                    and isinstance(node.func, ast.Name)
                    and node.func.id in ("Risk", "information")
                    and node.args
                    and isinstance(node.args[0], ast.Constant)
                ):
                    found.add(str(node.args[0].value))
    return found


def test_every_check_of_runs_serves_answers_or_is_not_applicable() -> None:
    """What steps and time tell, in the rooms of runs, is stated not to apply; all other checks are
    those of scenes and states, which reach answers by the run of no duration that examines them."""
    of_runs = risk_names("runtime/run", "runtime/discontinuities", "runtime/integrate")
    assert of_runs <= NOT_APPLICABLE.keys()
    of_states = risk_names("mstmm/scene", "runtime/result/checks")
    of_steps = {"stiff", "quaternion-length"}  # of the steps of a run ahead, or behind
    assert (of_states - of_runs) & NOT_APPLICABLE.keys() == of_steps
    assert risk_names() | {"energy-drift", "momentum-drift"} >= OF_ANSWERS | NOT_APPLICABLE.keys()
    assert not OF_ANSWERS & NOT_APPLICABLE.keys()
    assert all(NOT_APPLICABLE.values())


def test_every_risk_is_in_the_docs() -> None:
    page = (ROOT / "docs/howto/warnings.md").read_text(encoding="utf-8")
    assert not [name for name in risk_names() if f"`{name}`" not in page]


def test_a_state_has_the_risks_of_a_run_there() -> None:
    model = cantilever(3.0)
    q = np.asarray(model.equilibrium())
    of_run = model.simulate(1e-6, initial=(q, np.zeros(model.nu))).risks
    found = find_state_risks(model, 0.0, q, np.zeros(model.nu))
    assert found and {risk.name for risk in found} <= {risk.name for risk in of_run}


# --- what is wrong is told -----------------------------------------------------------------------


@pytest.mark.parametrize(("load", "tip"), [(0.1, (0.99933, 0.03326)), (3.0, (0.74558, 0.60325))])
def test_a_cantilever_beyond_its_range_is_not_trusted(
    load: float, tip: tuple[float, float]
) -> None:
    """Elastica: Mattiasson, Int. J. Numer. Methods Eng. 17 (1981) 145-153, table I (3); for the
    small load the series of Bisshopp and Drucker (1945)."""
    model = cantilever(load)
    found = model.equilibrium()
    off = np.abs(model.positions(found, "b.tip")[:2] - tip).max()
    assert found.trusted == (off < 1e-3)
    answers = model.linearize(), model.modes(), model.frequency_response([1.0])
    assert {one.trusted for one in answers} == {found.trusted}


def test_a_column_that_buckles_out_of_its_plane_is_not_trusted() -> None:
    """Euler: pi^2 E I / (4 L^2), of the weaker axis 1.234, of the modelled one 4.935."""
    column = cantilever(1.0, constant=True, bending_stiffness=[0.5, 2.0])
    found = column.stability_limit("constants.P", 1.0, 8.0)
    assert found.value == pytest.approx(np.pi**2 / 2, rel=3e-3)  # what its shapes can show
    assert not found.trusted and "out of the plane" in found.warnings[0]
    assert "constants.P = 4.9" in found.warnings[0]
    assert column.equilibrium().trusted
    beyond = column.with_parameters({"constants.P": 2.0})
    assert not beyond.equilibrium().trusted and not beyond.modes().trusted


def test_values_in_a_locus_are_named() -> None:
    found = cantilever(1.0).root_locus("constants.P", [0.1, 2.0, 3.0])
    assert not found.trusted
    assert "at constants.P = 3 and 1 other values" in found.warnings[0]
    risk = Risk("slope", '"b"', "steep", "split it", 0.5)
    (row,) = merge_over_values("x", [(1.0, [risk]), (2.0, ())])
    assert row.description == "at x = 1: steep"


def pendulum(effort: str) -> mstmm.Model:
    body = {"name": "bob", "mass": 1.0, "center_of_mass": [0, -1, 0], "inertia": [0, 0, 0]}
    hinge = {
        "name": "pivot", "type": "pin", "inboard": "ground", "outboard": "bob",
        "law": {"effort": effort},
    }  # fmt: skip
    scene = mstmm.Scene(gravity=(0, -9.81, 0), body=[body], hinge=[hinge], constants={"P": 0.0})
    return mstmm.compile(scene, engine="looped")


def test_an_equilibrium_that_vanishes_at_a_limit_point_is_told_from_one_that_is_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A torque P turns a pendulum until m g l holds it no more, where its frequency vanishes; a
    torque that jumps there from nothing leaves it a stiffness until the end."""
    monkeypatch.setattr(root_locus, "_NEAR", 1e-7)  # a search that finds nothing takes long
    limit = pendulum("P").stability_limit("constants.P", 0.0, 20.0)
    assert limit.value == pytest.approx(9.81, rel=1e-6) and limit.trusted
    jump = pendulum("where(P > 5, 100, 0)").stability_limit("constants.P", 0.0, 20.0)
    assert jump.value == pytest.approx(5.0) and not jump.trusted
    assert "no equilibrium was found" in jump.warnings[0]


def test_unstable_answers_say_so() -> None:
    model = pendulum("0*P")
    upright = model.equilibrium(q=[np.pi])
    assert upright.unstable_speeds and "unstable" in upright.warnings[0]
    linear = model.linearize(q=[np.pi])
    assert linear.trusted and "unstable" in linear.warnings[0]
    response = linear.frequency_response([1.0])
    assert not response.trusted  # a steady response is never reached
    assert np.asarray(upright + 0).tolist() == upright.tolist()
    assert not getattr(upright + 0, "warnings")  # noqa: B009


def test_closed_states_are_examined_where_they_are_assembled() -> None:
    q, u = cantilever(0.1).assemble()
    assert q.shape == u.shape == (4,)


def test_a_column_that_buckles_in_both_planes_at_once_is_trusted() -> None:
    """Equal axes: what another plane loses at the same load does not speak against the load."""
    found = cantilever(1.0, constant=True, bending_stiffness=[0.5, 0.5]).stability_limit(
        "constants.P", 0.5, 4.0
    )
    assert found.value == pytest.approx(np.pi**2 / 8, rel=3e-3) and found.trusted
