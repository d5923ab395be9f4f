"""Linear models as SymPy expressions: against Lagrange's equations, and against their own numbers
at other values of what was kept."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp
from sympy.physics import mechanics

import mstmm
from mstmm.errors import EnvironmentFailure, SceneError
from mstmm.runtime.linear.linear_model import Linear
from mstmm.runtime.linear.mck_matrices import SymbolicLinearModel
from mstmm.runtime.model.model import Model
from tests.reference.compare import seeded_scene
from tests.reference.jets import Array

ROD = {"mass": 2.5, "center_of_mass": [0.3, 0, 0], "inertia": [0.1, 0.2, 0.2],
       "ends": {"tip": [0.7, 0, 0]}}  # fmt: skip
MATRICES = "MCKVW"


def pendulum(links: int, **law: Any) -> mstmm.Model:
    """Rods one below the other in a plane."""
    names = [f"rod{k}" for k in range(1, links + 1)]
    inboard = ["ground", *(f"{name}.tip" for name in names)]
    hinges = [
        {"name": f"pin{k}", "type": "pin", "inboard": inboard[k - 1], "outboard": name, "law": law}
        for k, name in enumerate(names, start=1)
    ]
    bodies = [ROD | {"name": name} for name in names]
    return mstmm.compile(mstmm.Scene(gravity=[0, -9.81, 0], body=bodies, hinge=hinges))


def check_numbers(linear: Linear, found: SymbolicLinearModel, values: dict[str, float]) -> None:
    """Every matrix against the looped engine at these values of numbers of the scene."""
    other = replace(linear, model=linear.model.with_parameters(values))
    for name in MATRICES:
        matrix, expected = getattr(found, name), getattr(other, name)
        numbers = matrix.subs({found.symbols[key]: value for key, value in values.items()})
        assert relative_difference(numbers, expected) < 1e-12, name


def relative_difference(matrix: sp.Matrix, expected: Array) -> float:
    """Largest difference over the largest entry."""
    assert matrix.shape == expected.shape
    scale = np.abs(expected).max(initial=0) or 1.0
    return float(np.abs(np.array(matrix, dtype=float) - expected).max(initial=0)) / scale


# --- against Lagrange's equations -----------------------------------------------------------------


def test_a_pendulum_reads_as_in_books() -> None:
    linear = pendulum(1).linearize(inputs=["pin1.effort", "rod1.tip.fx"])
    found = linear.symbolic(["rod1.mass", "gravity[1]", "rod1.center_of_mass[0]"])
    m, g, c = found.symbols.values()
    assert sp.ImmutableMatrix([[m * c**2 + sp.Rational(1, 5)]]) == found.M
    assert sp.zeros(1) == found.C
    assert sp.ImmutableMatrix([[-m * g * c]]) == found.K
    assert sp.ImmutableMatrix([[1, sp.Rational(7, 10)]]) == found.V
    assert sp.ImmutableMatrix([[-m * c, 0, 0]]) == found.W
    assert found.coordinate_names == ("pin1.angle",)
    assert found.input_names == ("pin1.effort", "rod1.tip.force.x")
    assert found.symbol_values == {m: 2.5, g: -9.81, c: 0.3}


def test_a_double_pendulum_against_lagrange() -> None:
    """In every mass, length and angle, about any angles and speeds without accelerations."""
    names = ["rod1.mass", "rod1.center_of_mass[0]", "rod1.inertia[2]", "rod1.ends.tip.position[0]",
             "rod2.mass", "rod2.center_of_mass[0]", "rod2.inertia[2]", "gravity[1]"]  # fmt: skip
    motion = ["pin1.angle", "pin2.angle", "pin1.angle_rate", "pin2.angle_rate"]
    found = pendulum(2).linearize().symbolic([*names, *motion])
    m1, c1, j1, l1, m2, c2, j2, g = (found.symbols[name] for name in names)
    time, q = sp.Symbol("t"), sp.Matrix(mechanics.dynamicsymbols("q1 q2"))
    u = sp.Matrix([sp.diff(q[k], time) for k in range(2)])
    first = sp.Matrix([sp.cos(q[0]), sp.sin(q[0])])
    second = sp.Matrix([sp.cos(q[0] + q[1]), sp.sin(q[0] + q[1])])
    centres = [c1 * first, l1 * first + c2 * second]
    turns = [u[0], u[0] + u[1]]
    energy: sp.Expr = sp.Integer(0)
    for m, j, centre, turn in zip((m1, m2), (j1, j2), centres, turns, strict=True):
        speed = centre.diff(time)
        energy += (m * speed.dot(speed) + j * turn**2) / 2 + m * g * centre[1]
    lagrange = mechanics.LagrangesMethod(energy, q)
    lagrange.form_lagranges_equations()
    at = dict(zip([*u, *q], [found.symbols[name] for name in (*motion[2:], *motion[:2])],
                  strict=True))  # fmt: skip
    for matrix, expected in (
        (found.M, lagrange.mass_matrix),
        (found.C, -lagrange.forcing.jacobian(u)),
        (found.K, -lagrange.forcing.jacobian(q)),
    ):
        assert sp.simplify(sp.expand_trig(matrix - expected.subs(at))) == sp.zeros(2)


def test_a_spinning_rotor_keeps_its_speed() -> None:
    """A disk on a spinning shaft: C = Omega (Jp - ...) is linear in the speed that is kept."""
    disk = {"name": "disk", "mass": 3.0, "inertia": [0.3, 0.3, 0.5]}
    frame = {"name": "frame", "mass": 1.0, "inertia": [0.2, 0.2, 0.2]}
    hinges = [
        {"name": "tilt", "type": "universal", "inboard": "ground", "outboard": "frame",
         "axis": [1, 0, 0], "axis2": [0, 1, 0]},
        {"name": "shaft", "type": "pin", "inboard": "frame", "outboard": "disk",
         "axis": [0, 0, 1]},
    ]  # fmt: skip
    model = mstmm.compile(mstmm.Scene(gravity=[0, 0, 0], body=[frame, disk], hinge=hinges))
    linear = model.linearize(q=np.zeros(3), u=np.array([0.0, 0.0, 40.0]))
    found = linear.symbolic(["shaft.angle_rate", "disk.inertia[2]"])
    omega, polar = found.symbols.values()
    assert sp.ImmutableMatrix([[0, polar * omega, 0], [-polar * omega, 0, 0], [0, 0, 0]]) == found.C
    assert sp.zeros(3) == found.K


# --- against the numbers --------------------------------------------------------------------------


def spatial_arm() -> Model:
    """Ball, universal and slide, dampers, a spring between bodies and one to the ground, loads."""
    link = {
        "mass": 1.3,
        "center_of_mass": [0.2, 0.03, 0.01],
        "inertia": [0.02, 0.05, 0.04, 0.004, 0.002, 0.001],
        "ends": {"tip": [0.5, 0, 0.1]},
    }
    hinges = [
        {"name": "root", "type": "ball", "inboard": "ground", "outboard": "a",
         "law": {"stiffness": [8.0, 9.0, 7.0], "damping": [0.2, 0.3, 0.1]}},
        {"name": "wrist", "type": "universal", "inboard": "a.tip", "outboard": "b",
         "axis": [0, 0, 1], "axis2": [0, 1, 0], "law": {"stiffness": [30.0, 20.0]}},
        {"name": "slide", "type": "prismatic", "inboard": "b.tip", "outboard": "c",
         "axis": [1, 0, 0], "law": {"stiffness": [90.0], "rest": [0.1], "damping": [2.5]}},
    ]  # fmt: skip
    springs = [
        {"name": "tie", "from": "a", "to": "c.tip", "law": {"stiffness": 40.0, "rest": 0.5,
                                                           "damping": 1.5}},
        {"name": "stay", "from": "ground", "position": [0.2, 1.0, 0.4], "to": "b.tip",
         "law": {"stiffness": 25.0, "rest": 0.8}},
    ]  # fmt: skip
    loads = [{"name": "push", "on": "c.tip", "force": [1.0, -2.0, 0.5], "axes": "body"}]
    bodies = [link | {"name": name} for name in "abc"]
    return mstmm.compile(
        mstmm.Scene(gravity=[0, -9.81, 0], body=bodies, hinge=hinges, spring=springs, load=loads)
    )


KEPT = [
    ["b.mass", "gravity[1]", "root.law.stiffness[1]", "wrist.law.stiffness[0]"],
    ["tie.law.stiffness", "tie.law.rest", "tie.law.damping", "slide.law.damping"],
    ["c.mass", "c.center_of_mass[0]", "c.inertia[3]", "slide.law.stiffness"],
    ["stay.position[1]", "stay.law.rest"],
    ["push.force[1]", "a.ends.tip.position[0]", "a.inertia[0]"],
]


@pytest.mark.drawn
@pytest.mark.parametrize("keep", KEPT)
@pytest.mark.parametrize("moving", [False, True])
def test_a_spatial_arm_at_other_values(
    keep: list[str], moving: bool, rng: np.random.Generator
) -> None:
    model = spatial_arm()
    rest = np.array(model.equilibrium())
    u = rng.uniform(-1, 1, model.nu) if moving else None
    linear = model.linearize(q=rest, u=u, inputs=["wrist.effort_angle2", "c.tip.mz", "b.tip.fy"])
    found = linear.symbolic(keep)
    assert list(found.symbols) == keep
    for name in MATRICES:
        assert (
            relative_difference(
                getattr(found, name).subs(found.symbol_values), getattr(linear, name)
            )
            < 1e-12
        )
    known = model.parameters
    for _ in range(2):
        values = {
            name: known[name if name in known else f"{name}[0]"] * rng.uniform(0.7, 1.4)
            for name in keep
        }
        check_numbers(linear, found, values)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("seed", range(6))
def test_drawn_trees_at_other_values(seed: int) -> None:
    """Trees with all hinge types, friction, stops, loads and springs in skew frames."""
    data, q, u = seeded_scene(730 + seed, most=2)
    data["allow_unphysical_inertia"] = True
    for body in data["body"]:
        body["allow_unphysical_inertia"] = True
    model = mstmm.compile(mstmm.Scene(**data), engine="looped")
    linear = model.linearize(q, u, 0.3, inputs=["body0.plain.fx", "body0.lug.mz"])
    keep = ["body0.mass", "body0.center_of_mass[1]", "gravity[2]"]
    found, known = linear.symbolic(keep), model.parameters
    for factor in (1.0, 0.8, 1.3):
        check_numbers(linear, found, {name: factor * known[name] for name in keep})


def test_coordinates_along_a_drive_stay_numbers() -> None:
    model = mstmm.compile(
        mstmm.Scene(
            gravity=[0, -9.81, 0],
            body=[ROD | {"name": "upper"}, ROD | {"name": "lower"}],
            hinge=[
                {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "upper",
                 "drive": "0.4 + 2*t"},
                {"name": "elbow", "type": "pin", "inboard": "upper.tip", "outboard": "lower"},
            ],
        )
    )  # fmt: skip
    linear = model.linearize(q=np.array([0.4, 0.3]), u=np.array([2.0, 0.5]))
    found = linear.symbolic(["lower.mass", "elbow.angle"])
    assert found.M.shape == (1, 1)
    for angle in (0.3, -0.7):
        at = {**found.symbol_values, found.symbols["elbow.angle"]: angle}
        state = replace(linear.state, q=np.array([0.4, angle]))
        moved = replace(linear, state=state)
        assert relative_difference(found.K.subs(at), moved.K) < 1e-12
        assert relative_difference(found.C.subs(at), moved.C) < 1e-12
    with pytest.raises(
        SceneError, match=r'keep "motor.angle": expected a free coordinate.*that a drive imposes'
    ):
        linear.symbolic(["motor.angle"])


def test_powers_in_expressions_are_multiplied_out() -> None:
    model = pendulum(1, effort="-4*q^3 - 0.5*u*abs(u)")
    linear = model.linearize(q=np.array([0.4]), u=np.array([-0.3]))
    found = linear.symbolic(["pin1.angle", "pin1.angle_rate", "gravity[1]"])
    q, u, g = found.symbols.values()
    assert sp.expand(found.K[0, 0] - 12 * q**2 - sp.Rational(3, 4) * g * sp.sin(q)) == 0
    assert sp.ImmutableMatrix([[-u]]) == found.C


@pytest.mark.parametrize("t", [0.0, 0.5])
def test_inputs_of_the_scene_push(t: float) -> None:
    """By a law, a load that turns with the rod and a spring; one follows a signal."""
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod",
           "law": {"effort": "(motor^2 + t)*cos(q)"}}  # fmt: skip
    spring = {"name": "tie", "from": "ground", "position": [0.3, -2, 0], "to": "rod.tip",
              "law": {"stiffness": 3.0, "effort": "2*(q - 0.5) + motor"}}  # fmt: skip
    load = {"name": "push", "on": "rod.tip", "axes": "body", "force": [0, "0.5*motor + jet", 0]}
    model = mstmm.compile(
        mstmm.Scene(
            gravity=[0, -9.81, 0], body=[ROD | {"name": "rod"}], hinge=[pin], spring=[spring],
            load=[load],
            input=[{"name": "jet", "value": 0.3}, {"name": "motor", "value": "gust"}],
            signal=[{"name": "gust", "times": [0, 1], "values": [0.2, 1.2]}],
        )
    )  # fmt: skip
    linear = model.linearize(
        [0.3], [0.2], t, inputs=["motor", "pin.effort", "jet"], disturbances=["jet", "rod.tip.fx"]
    )
    found = linear.symbolic(["rod.mass", "rod.ends.tip.position[0]", "tie.law.stiffness"])
    for factor in (1.0, 1.2):
        values = {
            name: factor * found.symbol_values[symbol] for name, symbol in found.symbols.items()
        }
        check_numbers(linear, found, values)
    assert found.V[0, 2] == found.W[0, 0] == found.symbols["rod.ends.tip.position[0]"]


def flexible() -> Model:
    blade = {"name": "blade", "length": 1.0, "mass_per_length": 1.2, "bending_stiffness": 50.0,
             "axial_stiffness": 1e5, "torsional_stiffness": 10.0}  # fmt: skip
    hub = {"name": "hub", "mass": 0.5, "inertia": [0.1, 0.1, 0.1]}
    hinges = [
        {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "blade.root",
         "axis": [0, 1, 0], "law": {"stiffness": 300.0}},
        {"name": "weld", "type": "fixed", "inboard": "blade.tip", "outboard": "hub"},
    ]  # fmt: skip
    return mstmm.compile(mstmm.Scene(gravity=[0, 0, -9.81], body=[hub], beam=[blade], hinge=hinges))


def test_a_flexible_body_with_a_tip_mass() -> None:
    linear = flexible().linearize()
    found = linear.symbolic(["hub.mass", "pin.law.stiffness", "gravity[2]"])
    check_numbers(linear, found, {"hub.mass": 0.7, "pin.law.stiffness": 200.0, "gravity[2]": -3.7})
    with pytest.raises(SceneError, match=r"flexible bodies.* have no formula; linearize models"):
        linear.symbolic(["blade.length"])


# --- what is refused ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keep", "message"),
    [
        (["rod1.mas"], r'keep "rod1.mas": expected a number.*did you mean "rod1.mass"'),
        (["pin1.angel"], r'did you mean "pin1.angle"'),
        (["rod1.mass", "rod1.inertia[2]", "rod1.mass[0]"], r'keep "rod1.mass\[0\]"'),
        (["pin1.law.stiffness", "pin1.law.stiffness[0]"], r"is listed twice; name it once"),
        ("rod1.mass", r"expected a list of names"),
    ],
)
def test_names_that_are_refused(keep: Any, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        pendulum(1).linearize().symbolic(keep)


def test_coordinates_of_quaternions_are_refused() -> None:
    with pytest.raises(SceneError, match=r"no integral of a speed"):
        spatial_arm().linearize().symbolic(["root.wx"])


def test_scenes_that_are_too_large_are_refused() -> None:
    with pytest.raises(SceneError, match=r"has 25 coordinates; the limit is 24; use M, C and K"):
        pendulum(25).linearize().symbolic(["rod1.mass"])


def test_expressions_that_are_too_large_are_refused() -> None:
    angles = [f"pin{k}.angle" for k in range(1, 10)]
    with pytest.raises(SceneError, match=r"products of terms exceed the limit of 300000; keep"):
        pendulum(9).linearize().symbolic(angles)


def test_a_scene_with_a_release_is_refused() -> None:
    hinge = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod",
             "drive": "0.1*t", "release": "t > 1"}  # fmt: skip
    scene = mstmm.Scene(gravity=[0, -9.81, 0], body=[ROD | {"name": "rod"}], hinge=[hinge])
    linear = mstmm.compile(scene).linearize(q=np.zeros(1))
    with pytest.raises(SceneError, match=r'hinge "pin" is released during the run'):
        linear.symbolic(["rod.mass"])


def test_a_model_made_by_hand_has_no_derivation() -> None:
    linear = Model(pendulum(1).scene).linearize()
    with pytest.raises(EnvironmentFailure, match=r"without support"):
        linear.symbolic(["rod1.mass"])


def test_what_cannot_be_kept_is_not_suggested() -> None:
    rod = {"name": "rod1", "mass": 1.0, "center_of_mass": [0, -0.5, 0], "inertia": [1, 1, 1]}
    pin = {"name": "pin1", "type": "pin", "inboard": "ground", "outboard": "rod1",
           "law": {"stiffness": "stiff"}}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, -9.81, 0), body=[rod], hinge=[pin], constants={"stiff": 2.0})
    linear = mstmm.compile(scene).linearize()
    with pytest.raises(SceneError, match='keep "stiff": expected') as refused:
        linear.symbolic(keep=["stiff"])
    assert "constants" not in str(refused.value)
    with pytest.raises(SceneError, match="named constants are evaluated before"):
        linear.symbolic(keep=["constants.stiff"])
