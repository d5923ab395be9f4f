"""Closed equations of scenes: against Lagrange's, and against the numbers of the engine."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import sympy as sp
from sympy.physics import mechanics

import mstmm
from mstmm.errors import ElementError, SceneError
from mstmm.pipeline.equations import EquationSheet
from mstmm.pipeline.symbolic_equations import SymbolicEquations
from tests.support.latex import problems
from tests.support.paths import EXAMPLES

ROD = {"mass": 2.5, "center_of_mass": [0.3, 0.0, 0.0], "inertia": [0.1, 0.2, 0.2],
       "ends": {"tip": [0.7, 0.0, 0.0]}}  # fmt: skip
NAMES = ["rod1.mass", "rod1.center_of_mass[0]", "rod1.inertia[2]", "rod1.ends.tip.position[0]",
         "rod2.mass", "rod2.center_of_mass[0]", "rod2.inertia[2]", "gravity[1]"]  # fmt: skip


def rods(*hinges: dict[str, Any], **more: Any) -> mstmm.Scene:
    """Rods one on the tip of the other."""
    names = [f"rod{k}" for k in range(1, len(hinges) + 1)]
    inboard = ["ground", *(f"{name}.tip" for name in names)]
    held = [
        {"name": f"pin{k}", "type": "pin", "inboard": inboard[k], "outboard": names[k]} | hinge
        for k, hinge in enumerate(hinges)
    ]
    return mstmm.Scene(
        gravity=[0, -9.81, 0], body=[ROD | {"name": name} for name in names], hinge=held, **more
    )


def closed_equations(of: mstmm.Scene | mstmm.Model, keep: tuple[str, ...] | list[str] = ()) -> Any:
    found = mstmm.equations(of, keep).closed
    assert isinstance(found, SymbolicEquations)
    return found


def test_a_double_pendulum_is_that_of_lagrange() -> None:
    """In every mass, length, angle and speed."""
    found = closed_equations(rods({}, {}), NAMES)
    m1, c1, j1, l1, m2, c2, j2, g = (found.parameters[name] for name in NAMES)
    time, q = sp.Symbol("t"), sp.Matrix(mechanics.dynamicsymbols("q1 q2"))
    u = q.diff(time)
    first = sp.Matrix([sp.cos(q[0]), sp.sin(q[0])])
    second = sp.Matrix([sp.cos(q[0] + q[1]), sp.sin(q[0] + q[1])])
    turns = [u[0], u[0] + u[1]]
    energy: sp.Expr = sp.Integer(0)
    bodies = ((m1, j1, c1 * first), (m2, j2, l1 * first + c2 * second))
    for (m, j, centre), turn in zip(bodies, turns, strict=True):
        speed = centre.diff(time)
        energy += (m * speed.dot(speed) + j * turn**2) / 2 + m * g * centre[1]
    lagrange = mechanics.LagrangesMethod(energy, q)
    lagrange.form_lagranges_equations()
    at = dict(zip([*u, *q], [x.symbol for x in (*found.speeds, *found.coordinates)], strict=True))
    for matrix, expected in ((found.M, lagrange.mass_matrix), (found.h, -lagrange.forcing)):
        assert sp.simplify(sp.expand_trig(matrix - expected.subs(at))) == sp.zeros(*matrix.shape)


LAW = {"stiffness": 3.0, "damping": 0.2, "friction": {"coulomb": 0.5, "static": 0.7},
       "limits": {"lower": -0.5, "upper": 0.4, "stiffness": 100.0, "damping": 1.0}}  # fmt: skip
SCENES = {
    "axes that differ": rods({"axis": [0, 0, 1]}, {"axis": [0, 1, 0]}, {"axis": [0.6, 0, 0.8]}),
    "a ball and a slider": rods({"type": "ball"}, {"type": "prismatic", "axis": [1, 0, 0]}),
    "laws that switch": rods({"law": LAW}, {"law": {"stiffness": 2.0, "rest": 0.3}}),
    "a drive": rods({"drive": "0.3 * sin(2 * t)"}, {}),
    "a spring": rods({}, {}, spring=[
        {"name": "s", "from": "ground", "to": "rod2.tip", "position": [0.1, 0.2, 0.3],
         "law": {"stiffness": 40.0, "rest": 0.4}}
    ]),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_closed_equations_are_those_that_the_engine_computes(
    name: str, rng: np.random.Generator
) -> None:
    """M and h at states far from the start, where other branches are in force."""
    model = mstmm.compile(SCENES[name], engine="looped")
    found, free = closed_equations(model), list(closed_equations(model).free_speed_indices)
    for _ in range(3):
        q, u = rng.uniform(-1.5, 1.5, model.nq), rng.uniform(-2, 2, model.nu)
        if name == "a ball and a slider":
            q[:4] /= np.linalg.norm(q[:4])
        state = dict(zip((x.symbol for x in found.coordinates), q, strict=True))
        state |= dict(zip((x.symbol for x in found.speeds), u, strict=True))
        if name == "a drive":
            q[0], u[0] = 0.0, 0.6
            state |= {found.coordinates[0].symbol: 0.0, found.speeds[0].symbol: 0.6}
        state |= dict.fromkeys(found.accelerations, 0.0) | {sp.Symbol("t", real=True): 0.0}
        mass = np.array(found.M.subs(state), dtype=float)
        expected = model.mass_matrix(q)
        expected = expected if expected.shape == mass.shape else expected[np.ix_(free, free)]
        assert np.abs(mass - expected).max() < 1e-12 * np.abs(expected).max()
        load = np.array(found.h.subs(state), dtype=float)[:, 0]
        needed = model.inverse_dynamics(q, u, np.zeros(model.nu))[free]
        assert np.abs(load - needed).max() < 1e-11 * (1 + np.abs(needed).max())


def test_numbers_of_the_start_come_with_the_symbols() -> None:
    scene = mstmm.load_scene(EXAMPLES / "simple_pendulum" / "scene.toml")
    found = closed_equations(scene, ["pendulum.mass", "gravity[1]"])
    m, g = found.parameters.values()
    q = found.coordinates[0].symbol
    assert sp.ImmutableMatrix([[m]]) == found.M
    assert sp.ImmutableMatrix([[-m * g * sp.cos(q)]]) == found.h
    assert found.parameter_values[m] == 1.0 and found.parameter_values[g] == -9.81
    assert found.coordinates[0].name == "pivot.angle" and found.coordinates[0].unit == "rad"


@pytest.mark.parametrize("value", [0.5, 0.0, 2.0])
def test_an_input_of_a_law_and_of_a_load_stays_a_symbol(value: float) -> None:
    """Whatever its value is: h = m g c cos(q) - 3 p + 0.7 F t sin(q), by hand."""
    scene = rods({"law": {"effort": "3*push"}}, input=[
        {"name": "push", "value": value, "rates": [0.3, 0.4]}, {"name": "pull", "value": value}
    ], load=[{"on": "rod1.tip", "force": ["pull * t", 0, 0]}])  # fmt: skip
    found = closed_equations(scene)
    q, t = found.coordinates[0].symbol, sp.Symbol("t", real=True)
    push, pull = found.inputs["push"], found.inputs["pull"]
    lever = sp.Rational("0.3") * sp.Rational("2.5") * sp.Rational("9.81")
    expected = lever * sp.cos(q) - 3 * push + sp.Rational("0.7") * pull * t * sp.sin(q)
    assert sp.simplify(found.h[0] - expected) == 0
    assert list(found.inputs) == ["push", "pull"] and found.parameter_values[push] == value


def test_a_drive_that_follows_an_input_has_its_rates_as_symbols() -> None:
    """As the engine computes them at numbers of the input that are others than the page's."""

    def scene(value: float, *rates: float) -> mstmm.Scene:
        given = {"name": "turn", "value": value, "rates": list(rates)}
        return rods({"drive": "2 * turn"}, {}, input=[given])

    found = closed_equations(scene(0.0, 0.0, 0.0))
    model = mstmm.compile(scene(0.4, 0.7, -0.9), engine="looped")
    needed = model.inverse_dynamics([0.8, 0.3], [1.4, -0.5], [-1.8, 0.0])[1]
    values = {"turn": 0.4, "turn.rates[0]": 0.7, "turn.rates[1]": -0.9}
    at = {found.inputs[name]: value for name, value in values.items()}
    at |= {found.coordinates[1].symbol: 0.3, found.speeds[1].symbol: -0.5}
    assert found.h.subs(at)[0] == pytest.approx(needed, rel=1e-12)


# --- pages --------------------------------------------------------------------------------------


def test_a_scene_tells_its_tree_and_the_way_of_the_sweep() -> None:
    text = mstmm.equations(EXAMPLES / "three_pin_arm" / "scene.toml").text
    assert "└─ pin0 (pin) ─ body1\n   └─ pin2 (pin) ─ body2\n" in text
    way = [text.index(said) for said in (
        "forward, root to tips", "body1 → body2 across pin2", "condense, tips to root",
        "body3 → body2 across pin4", "recover, root to tips", "M u̇ + h = τ",
    )]  # fmt: skip
    assert way == sorted(way)


def test_loops_and_large_scenes_say_why_there_are_no_closed_equations() -> None:
    loop = mstmm.equations(EXAMPLES / "four_bar" / "scene.toml")
    assert loop.closed is None and "(closes a loop)" in loop.text and "linearize" in loop.text
    large = mstmm.equations(rods(*[{}] * 13))
    assert large.closed is None and "found 13" in large.text
    with pytest.raises(SceneError, match="at most 12 speeds"):
        mstmm.equations(rods(*[{}] * 13), ["rod1.mass"])


@pytest.mark.parametrize(
    ("of", "keep", "said"),
    [("pni", [], "did you mean"), ("pin", ["rod1.mass"], "keep applies to scenes"),
     (rods({}), ["rod1.mas"], "there is no such number"), (rods({}), 3, "a list of names"),
     (None, [], "expected the name of an element"), (object, [], "expected the name of"),
     ("none.json", [], "there is no such file"), ("none.urdf", [], "there is no such file")],
    ids=["name", "element", "number", "text", "nothing", "class", "scene", "robot"],
)  # fmt: skip
def test_refused(of: Any, keep: Any, said: str) -> None:
    with pytest.raises((ElementError, SceneError), match=said):
        mstmm.equations(of, keep)


def test_every_file_of_a_scene_is_one(tmp_path: Path) -> None:
    scene = rods({}, {})
    told = mstmm.equations(scene).text
    (tmp_path / "two.json").write_text(json.dumps(tomllib.loads(scene.to_toml())))
    assert mstmm.equations(str(tmp_path / "two.json")).text == told
    (tmp_path / "two.urdf").write_text(mstmm.export_robot(scene).text)
    assert mstmm.equations(str(tmp_path / "two.urdf")).closed is not None


@pytest.mark.parametrize("of", ["pin", rods({}, {"type": "ball"})], ids=["element", "scene"])
def test_notebooks_show_equations(of: Any) -> None:
    found = mstmm.equations(of)
    assert isinstance(found, EquationSheet) and str(found) == found.text
    frame = ElementTree.fromstring(found._repr_html_())
    assert frame.tag == "iframe"
    page = ElementTree.fromstring(frame.attrib["srcdoc"].removeprefix("<!DOCTYPE html>\n"))
    assert page.findall(".//{http://www.w3.org/1998/Math/MathML}math")
    assert re.search(r"\\begin\{align\*\}", found._repr_latex_())


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_latex_of_scenes_compiles_within_the_text_width() -> None:
    pages = [(name, mstmm.equations(scene).latex) for name, scene in SCENES.items()]
    assert problems(pages) == []
