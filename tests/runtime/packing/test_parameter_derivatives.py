"""Derivatives with respect to numbers of the scene: the way from the scene to the kernel is exact
to rounding, and the whole agrees with differences of the looped engine."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.numerics import rotations
from mstmm.numerics.dual import Dual, atan2, hypot
from mstmm.runtime.packing import scene_parameters
from mstmm.runtime.packing.fused_structure import structure_of
from mstmm.runtime.packing.parameter_derivatives import parameter_derivatives
from mstmm.runtime.packing.system_builder import system_of
from tests.reference.compare import seeded_scene, worst
from tests.reference.jets import Array
from tests.reference.random_scenes import aligned_chain, random_state

TIME = 0.3
#: Weights of the central difference of eighth order, for the steps 1 to 4.
EIGHTH = (Fraction(4, 5), Fraction(-1, 5), Fraction(4, 105), Fraction(-1, 280))


def eighth_order(f: Any, step: float) -> Array:
    """f'(0) to the eighth order, for steps of half a per cent exact but for rounding."""
    terms = [float(w) * (f(k * step) - f(-k * step)) / step for k, w in enumerate(EIGHTH, start=1)]
    return np.asarray(sum(terms))


def scene_of(seed: int, **options: Any) -> tuple[mstmm.Scene, Array, Array]:
    data, q, u = seeded_scene(seed, **options)
    # Steps of some per cent may violate the triangle inequality of an inertia.
    data["allow_unphysical_inertia"] = True
    for body in data["body"]:
        body["allow_unphysical_inertia"] = True
    return mstmm.Scene(**data), q, u


def numbers(scene: mstmm.Scene) -> Array:
    return structure_of(system_of(scene)[0], {})[1]


class OtherStructure(Exception):
    """A number that moves turns a structural zero into a place of p, or is refused."""


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("seed", range(5))
def test_numbers_of_the_kernel_to_rounding(seed: int) -> None:
    """dp/dname for numbers drawn from those that are not zero, all hinge types in skew frames."""
    scene, _, _ = scene_of(400 + seed, most=2)
    values = {name: x for name, x in scene_parameters.scene_parameters(scene).items() if x}
    names = np.random.default_rng(seed).permutation([n for n in values if "initial" not in n])
    checked = 0
    for name in names[:25]:
        _, p, moved = parameter_derivatives(scene, {}, [name])

        def shifted_numbers(change: float, name: str = name, size: int = len(p)) -> Array:
            try:
                found = numbers(
                    scene_parameters.with_parameters(scene, {name: values[name] + change})
                )
            except SceneError:
                raise OtherStructure from None
            if len(found) != size:
                raise OtherStructure
            return found

        step = 0.005 * min(1.0, abs(values[name]))
        try:
            wanted = eighth_order(shifted_numbers, step)
        except OtherStructure:
            continue
        assert np.array_equal(p, shifted_numbers(0.0)), name
        size = max(1.0, float(np.abs(p[np.abs(wanted) > 0]).max(initial=0)))
        assert np.abs(moved[:, 0] - wanted).max() < 1e-14 * size / step + 1e-12 * size, name
        checked += 1
    assert checked >= 10


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("seed", range(4))
def test_accelerations_against_the_looped_engine(seed: int) -> None:
    """All numbers of a scene at once, against differences of models with other numbers."""
    scene, q, u = scene_of(500 + seed, most=3)
    model = mstmm.compile(scene)
    found = model.derivatives(q, u, TIME, parameters=list(model.parameters))
    size = max(1.0, float(np.abs(found.udot).max(initial=0)))
    names = np.random.default_rng(seed).permutation(list(model.parameters))
    checked = 0
    for name in names[:40]:
        step = 1e-5
        value = model.parameters[name]
        try:
            ahead, behind = (
                model.with_parameters({name: value + s}).accelerations(q, u, TIME)
                for s in (step, -step)
            )
        except SceneError:
            continue  # a bound, such as a stiffness of zero
        wanted = (ahead - behind) / (2 * step)
        assert worst(found.parameters[name], wanted, floor=size) < 1e-7, name
        checked += 1
    assert checked > 10


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("seed", range(3))
def test_numbers_that_the_structure_takes_for_zero_or_an_axis(seed: int) -> None:
    """A straight chain: most of its frames are structure, and still have slopes."""
    data = aligned_chain(seed, ("pin", "prismatic", "universal"), springs=True)
    data["load"] = [{"on": "body1.tip", "force": [0, 2.0, 0], "moment": [0, 0, 0]}]
    scene = mstmm.Scene(**data)
    q, u = random_state(data, seed)
    model = mstmm.compile(scene)
    names = [n for n, x in model.parameters.items() if x in (0.0, 1.0, -1.0)]
    names = [n for n in names if ".law." not in n and "initial" not in n]
    names = [str(n) for n in np.random.default_rng(seed).permutation(names)[:40]]
    found = model.derivatives(q, u, TIME, parameters=names)
    moved = 0
    for name in names:
        value, step = model.parameters[name], 1e-5
        try:
            ahead, behind = (
                model.with_parameters({name: value + s}).accelerations(q, u, TIME)
                for s in (step, -step)
            )
        except SceneError:
            continue  # a number that this hinge does not take
        wanted = (ahead - behind) / (2 * step)
        assert worst(found.parameters[name], wanted, floor=1.0) < 1e-6, name
        moved += bool(np.abs(wanted).max() > 1e-3)
    assert moved >= 5


def test_numbers_inside_laws_loads_and_drives() -> None:
    """Constants of expressions are numbers of the scene too, zero or not."""
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.1, 0.2, 0.2]}
    data = {
        "gravity": [0, -9.81, 0],
        "body": [
            rod | {"name": "upper", "ends": {"tip": [1, 0, 0]}},
            rod | {"name": "lower", "ends": {"tip": [1, 0, 0]}},
        ],
        "hinge": [
            {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "upper",
             "drive": "0.4"},
            {"name": "elbow", "type": "pin", "inboard": "upper.tip", "outboard": "lower",
             "law": {"effort": "-1.5"}},
        ],
        "load": [{"name": "push", "on": "lower.tip", "force": [0, 3.0, 0], "axes": "body"}],
    }  # fmt: skip
    model = mstmm.compile(mstmm.Scene(**data))
    q, u = np.array([0.4, 0.3]), np.array([0.0, 0.2])
    names = ["motor.drive", "elbow.law.effort", "push.force[0]", "push.force[1]", "push.moment[2]"]
    found = model.derivatives(q, u, parameters=names)
    for name in names:
        step = 1e-5
        full = scene_parameters.resolve_names(model.scene, [name])[0]
        value = model.parameters[full]
        ahead, behind = (
            model.with_parameters({name: value + s}).accelerations(q, u) for s in (step, -step)
        )
        wanted = (ahead - behind) / (2 * step)
        assert worst(found.parameters[name], wanted, floor=1e-2) < 1e-8, name
    inertia = 0.2 + 0.25
    assert abs(found.parameters["elbow.law.effort"][1] - 1 / inertia) < 1e-14
    assert abs(found.parameters["push.force[1]"][1] - 1 / inertia) < 1e-14


def test_numbers_of_a_chain_move_all_its_members() -> None:
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.1, 0.1]}
    chain = {"name": "rope", "count": 4, "inboard": "ground", "hinge": {"type": "ball"}}
    body = rod | {"ends": {"tip": [1, 0, 0]}}
    model = mstmm.compile(mstmm.Scene(gravity=[0, -9.81, 0], chain=[chain | {"body": body}]))
    rng = np.random.default_rng(2)
    q, u = rng.normal(size=model.nq), rng.normal(size=model.nu)
    names = ["rope.body[0].mass", "rope.body[0].inertia[3]", "rope.body[0].ends.tip.position[1]"]
    found, step = model.derivatives(q, u, parameters=names), 1e-5
    for name in names:
        value = model.parameters[name]
        ahead, behind = (
            model.with_parameters({name: value + s}).accelerations(q, u) for s in (step, -step)
        )
        wanted = (ahead - behind) / (2 * step)
        assert np.abs(wanted).max() > 1
        assert worst(found.parameters[name], wanted) < 1e-6, name


def test_a_number_inside_an_expression_is_refused() -> None:
    hinge = {"name": "own", "type": "custom", "inboard": "ground", "outboard": "rod",
             "parameters": {"gain": 2.0}, "law": {"effort": "gain*sin(t)"}}  # fmt: skip
    rod = {"name": "rod", "mass": 1.0, "inertia": [0.1, 0.1, 0.1]}
    scene = mstmm.Scene(gravity=[0, 0, 0], body=[rod], hinge=[hinge])
    with pytest.raises(SceneError, match="an effort expression of the hinge contains it"):
        parameter_derivatives(scene, {}, ["own.parameters.gain"])


def test_a_huge_number_is_itself() -> None:
    """2^1000 is a number like any other."""
    rod = {"name": "rod", "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.1, 0.1, 0.1]}
    hinge = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod",
             "law": {"stiffness": [2.0**1000]}}  # fmt: skip
    scene = mstmm.Scene(gravity=[0, 0, 0], body=[rod], hinge=[hinge])
    _, p, moved = parameter_derivatives(scene, {}, ["rod.mass", "pin.law.stiffness[0]"])
    place = p.tolist().index(2.0**1000)
    assert moved[place].tolist() == [0.0, 1.0]
    assert sorted(moved[:, 0]) == [*[0.0] * (len(p) - 4), 0.25, 0.25, 0.5, 1.0]


def test_a_number_may_be_named_twice() -> None:
    """ "a[0]" and "a" of a list of one are the same number; that of an expression too."""
    rod = {"name": "rod", "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.1, 0.1, 0.1]}
    hinge = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod",
             "law": {"effort": "-1.5", "damping": 0.2}}  # fmt: skip
    scene = mstmm.Scene(gravity=[0, 0, 0], body=[rod], hinge=[hinge])
    for name in ("pin.law.effort", "pin.law.damping", "rod.mass"):
        _, p, moved = parameter_derivatives(scene, {}, [name, name])
        _, alone, once = parameter_derivatives(scene, {}, [name])
        assert p.tolist() == alone.tolist()
        assert (moved == once).all() and once.any()


def test_hinges_of_bodies_that_respond_one_way() -> None:
    """Their run is one of rigid bodies; the shapes stay what they are."""
    beam = {"name": "blade", "length": 1.0, "mass_per_length": 1.2, "bending_stiffness": 50.0,
            "axial_stiffness": 1e5, "torsional_stiffness": 10.0, "model": "one-way"}  # fmt: skip
    hinge = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "blade.root",
             "axis": [0, 1, 0.5], "orientation": [0.3, 0.2, 0.1]}  # fmt: skip
    model = mstmm.compile(mstmm.Scene(gravity=[0, 0, -9.81], beam=[beam], hinge=[hinge]))
    q, u, step = np.array([0.3]), np.array([0.7]), 1e-5
    for name in ("pin.axis[0]", "pin.axis[2]"):
        found = model.derivatives(q, u, parameters=[name]).parameters[name]
        value = model.parameters[name]
        ahead, behind = (
            model.with_parameters({name: value + s}).accelerations(q, u) for s in (step, -step)
        )
        assert np.abs(found).max() > 0.1
        assert worst(found, (ahead - behind) / (2 * step), floor=1.0) < 1e-7


# --- the numbers that carry slopes ----------------------------------------------------------------


def test_duals_are_exact() -> None:
    """A rational function of two numbers against its derivative in fractions."""
    x, y = Fraction(3, 8), Fraction(-5, 16)
    a, b = Dual(float(x), {0: 1.0}), Dual(float(y), {1: 1.0})
    value = (2 * a - b / 4) * (1 - a * b) / (a + 3) - 7 / b
    wanted = [
        (2 * (1 - x * y) - (2 * x - y / 4) * y) / (x + 3)
        - (2 * x - y / 4) * (1 - x * y) / (x + 3) ** 2,
        (-(1 - x * y) / 4 - (2 * x - y / 4) * x) / (x + 3) + 7 / y**2,
    ]
    assert abs(value.slope[0] - wanted[0]) < 1e-15
    assert abs(value.slope[1] - wanted[1]) < 1e-13
    exact = (2 * x - y / 4) * (1 - x * y) / (x + 3) - 7 / y
    assert abs(value.value - exact) < 1e-14


def test_a_zero_that_moves_is_no_zero() -> None:
    still, moves = Dual(0.0, {}), Dual(0.0, {0: 1.0})
    assert still == 0 and not still
    assert moves != 0 and bool(moves) and moves <= 0 and moves >= 0 and not moves < 0
    assert (moves - moves) == 0


def test_a_dual_is_no_float() -> None:
    """Nothing takes it for one in silence, neither an array nor C."""
    for dual in (Dual(1.5, {0: 1.0}), Dual(1.5, {})):
        with pytest.raises(TypeError):
            float(dual)  # type: ignore[arg-type]
        with pytest.raises(TypeError):
            np.array([dual], dtype=float)


@pytest.mark.parametrize(
    "function",
    [
        rotations.from_rpy,
        rotations.from_quaternion,
        lambda v: [rotations.unit_vector(v)],
        lambda v: [rotations.perpendicular_vector(v[1:])],
        lambda v: [rotations.unit_rejection(v[:3], (v[1], v[0], 0.3))],
        lambda v: [[hypot(v), atan2(v[0], v[1]), rotations.norm(v[1:])]],
        lambda v: rotations.rotation_about(v[:3], v[1]),
    ],
)
def test_rotations_of_duals(function: Any) -> None:
    """Values to the bit, slopes to those of a difference of eighth order."""
    v = [0.3, -0.8, 0.45, 0.2]
    if function is rotations.from_rpy:
        v = v[:3]
    for k in range(len(v)):
        moving = [Dual(x, {0: 1.0}) if i == k else x for i, x in enumerate(v)]
        found = [x for row in function(moving) for x in row]

        def shifted_values(change: float, k: int = k) -> Array:
            return np.array(function([x + change * (i == k) for i, x in enumerate(v)])).ravel()

        assert [getattr(x, "value", x) for x in found] == list(shifted_values(0.0))
        slope = [x.slope.get(0, 0.0) if isinstance(x, Dual) else 0.0 for x in found]
        assert np.abs(np.array(slope) - eighth_order(shifted_values, 0.01)).max() < 1e-11
