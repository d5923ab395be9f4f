"""Linear models beside rolling and knife edges: the benchmark bicycle, discs, a sleigh."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.errors import NumericalFailure, SceneError
from mstmm.runtime.linear.linear_model import Linear
from mstmm.runtime.linear.nonholonomic_model import NonholonomicLinear

Array = NDArray[Any]
GRAVITY = 9.81


def nonholonomic_model(linear: Linear) -> NonholonomicLinear:
    assert isinstance(linear, NonholonomicLinear)
    return linear


# --- the benchmark bicycle ------------------------------------------------------------------------
# Meijaard, Papadopoulos, Ruina, Schwab: Linearized dynamics equations for the balance and steer of
# a bicycle: a benchmark and review, Proc. R. Soc. A 463 (2007) 1955-1982: parameters, matrices and
# eigenvalues of the benchmark.  Axes there: x ahead, z down.

WHEELBASE, TRAIL, TILT = 1.02, 0.08, np.pi / 10
REAR, FRONT = 0.3, 0.35
MASS = np.array([[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]])
DAMPING = np.array([[0.0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]])
STIFFNESS = np.array([[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]])
BY_SPEED = np.array([[0.0, 76.59734589573222], [0.0, 2.65431523794604]])
WEAVE, CAPSIZE, CASTER = -0.77534188219585 + 4.46486771378823j, -0.32286642900409, -14.0783896927982


def published_eigenvalues(speed: float) -> Array:
    """Eigenvalues of M q'' + v C1 q' + (g K0 + v^2 K2) q = 0."""
    stiffness = GRAVITY * STIFFNESS + speed**2 * BY_SPEED
    below = -np.linalg.solve(MASS, np.hstack([stiffness, speed * DAMPING]))
    return np.linalg.eigvals(np.vstack([np.eye(4)[2:], below]))


@pytest.fixture(scope="module")
def bicycle() -> mstmm.Model:
    return benchmark()


def benchmark(**steering: Any) -> mstmm.Model:
    """The bicycle, with more keys of the hinge of its steering."""
    foot = np.array([WHEELBASE + TRAIL, 0.0, 0.0])  # where the steering axis meets the road
    fork: dict[str, Any] = {
        "name": "fork", "mass": 4.0, "center_of_mass": (np.array([0.9, 0, 0.7]) - foot).tolist(),
        "inertia": [0.05892, 0.06, 0.00708, 0, 0.00756, 0],
        "ends": {"axle": (np.array([WHEELBASE, 0, FRONT]) - foot).tolist()},
    }  # fmt: skip
    frame: dict[str, Any] = {
        "name": "frame", "mass": 85.0, "center_of_mass": [0.3, 0, 0.9],
        "inertia": [9.2, 11, 2.8, 0, -2.4, 0],
        "ends": {"axle": [0, 0, REAR], "head": foot.tolist()},
    }  # fmt: skip
    rolls = {"type": "rolling", "from": "ground", "normal": [0, 0, 1], "axis": [0, 1, 0]}
    across = {"type": "pin", "axis": [0, 1, 0]}
    return mstmm.compile(mstmm.Scene(
        gravity=[0, 0, -GRAVITY],
        body=[frame, {"name": "rear", "mass": 2.0, "inertia": [0.0603, 0.12, 0.0603]}, fork,
              {"name": "front", "mass": 3.0, "inertia": [0.1405, 0.28, 0.1405]}],
        hinge=[{"name": "ride", "type": "free", "inboard": "ground", "outboard": "frame"},
               across | {"name": "hub", "inboard": "frame.axle", "outboard": "rear"},
               {"name": "steer", "type": "pin", "axis": [-np.sin(TILT), 0, np.cos(TILT)],
                "inboard": "frame.head", "outboard": "fork", **steering},
               across | {"name": "spin", "inboard": "fork.axle", "outboard": "front"}],
        constraint=[rolls | {"name": "behind", "to": "rear", "radius": REAR},
                    rolls | {"name": "ahead", "to": "front", "radius": FRONT}],
    ))  # fmt: skip


def riding(model: mstmm.Model, speed: float, heading: float = 0.0) -> tuple[Array, Array]:
    """q and u straight ahead along a heading."""
    q, u, hinges = np.zeros(model.nq), np.zeros(model.nu), model.coordinate_layout.hinges
    q[3], q[6] = np.cos(heading / 2), np.sin(heading / 2)
    for name, rate in (("ride", speed), ("hub", speed / REAR), ("spin", speed / FRONT)):
        u[hinges[name].u] = rate
    return q, u


def paired_distance(found: Array, expected: Array) -> float:
    """Largest distance from an expected value to the nearest that was found, each once."""
    left, far = list(found), 0.0
    for one in expected:
        k = int(np.argmin(np.abs(np.array(left) - one)))
        far = max(far, abs(left.pop(k) - one))
    return far


@pytest.mark.parametrize(("speed", "heading"), [(0.0, 0.0), (5.0, 0.0), (10.0, 0.0), (5.0, 0.8)])
def test_the_benchmark_bicycle(bicycle: mstmm.Model, speed: float, heading: float) -> None:
    linear = bicycle.linearize(*riding(bicycle, speed, heading), inputs=[])
    found = np.linalg.eigvals(linear.A)
    moving = found[np.abs(found) > 1e-6]
    assert len(moving) == 4 and paired_distance(moving, published_eigenvalues(speed)) < 1e-9
    if speed == 5.0:
        table = [WEAVE, np.conj(WEAVE), CAPSIZE, CASTER]
        assert paired_distance(moving, np.array(table)) < 1e-8
        modes = linear.modes()
        assert [x for x in modes.eigenvalues if x] == pytest.approx([CAPSIZE, WEAVE, CASTER])
        assert modes.trusted and not modes.unstable.any()
        assert set(modes.dominant_coordinates(len(modes) - 1)) >= {"steer.angle"}
        assert nonholonomic_model(linear).frame_rates == {}
        assert linear.coordinate_names[-2:] == ("steer.angle", "spin.angle")


def test_steering_torque_turns_the_bicycle(bicycle: mstmm.Model) -> None:
    """H = (-w^2 M + i w v C1 + g K0 + v^2 K2)^-1 (0, 1), of the steering angle."""
    linear = bicycle.linearize(*riding(bicycle, 5.0), inputs=["steer.effort"])
    omega = np.array([0.5, 3.0, 20.0])
    outputs = ["steer.angle", "steer.angle_rate", "steer.angle_acceleration", "ride.wx"]
    found = linear.frequency_response(omega, outputs=outputs).response[:, :, 0]
    for w, row in zip(omega, found, strict=True):
        z = -(w**2) * MASS + 5j * w * DAMPING + GRAVITY * STIFFNESS + 25 * BY_SPEED
        lean, steer = np.linalg.solve(z, [0.0, 1.0])
        expected = [steer, 1j * w * steer, -(w**2) * steer, 1j * w * lean]
        expected[3] *= np.sign((row[3] / expected[3]).real)  # y is to the right there
        np.testing.assert_allclose(row, expected, rtol=1e-9)
    driven = bicycle.linearize(*riding(bicycle, 5.0), inputs=["frame.fy"])
    assert not driven.B.any()  # it acts where the wheel stands on the road
    assert any("has no effect" in text for text in driven.warnings)
    assert linear.output_matrices(["steer.angle"])[0].shape == (1, len(linear.state_names))


def test_dry_friction_of_the_steering_is_left_out_or_counts_as_viscous() -> None:
    rough = benchmark(law={"friction": {"coulomb": 0.5}})
    free = rough.linearize(*riding(rough, 5.0), inputs=[])
    assert paired_distance(free.modes().eigenvalues, np.array([WEAVE, CAPSIZE, CASTER])) < 1e-8
    assert "dry-friction" in {risk.name for risk in free.risks}
    damped = rough.linearize(*riding(rough, 5.0), inputs=[], friction=0.2)
    steer = 4 * 0.5 / (np.pi * 0.2)  # the damper of equal work
    below = np.hstack([GRAVITY * STIFFNESS + 25 * BY_SPEED, 5 * DAMPING + np.diag([0, steer])])
    expected = np.linalg.eigvals(np.vstack([np.eye(4)[2:], -np.linalg.solve(MASS, below)]))
    assert paired_distance(np.linalg.eigvals(damped.A), expected) < 1e-9


# --- discs ----------------------------------------------------------------------------------------

RADIUS = 0.5


def coin(**more: Any) -> mstmm.Model:
    """A thin uniform disc of 1 kg with its axis along y."""
    across = RADIUS**2 / 4
    body = {"name": "coin", "mass": 1.0, "inertia": [across, 2 * across, across]} | more
    rolls = {"name": "road", "type": "rolling", "from": "ground", "to": "coin",
             "normal": [0, 0, 1], "radius": RADIUS, "axis": [0, 1, 0]}  # fmt: skip
    fly = {"name": "fly", "type": "free", "inboard": "ground", "outboard": "coin",
           "initial": {"q": [0, 0, RADIUS, 1, 0, 0, 0]}}  # fmt: skip
    return mstmm.compile(
        mstmm.Scene(gravity=[0, 0, -GRAVITY], body=[body], hinge=[fly], constraint=[rolls])
    )


@pytest.mark.parametrize("speed", [0.3, 1.2, 1.3, 2.0, 10.0])
@pytest.mark.parametrize("turned", [0.0, 1.1])
def test_an_upright_disc_is_stable_above_a_third_of_g_r(speed: float, turned: float) -> None:
    """Lean theta of a thin disc: 5/4 theta'' + (3 (v/r)^2 - g/r) theta = 0 (Neimark, Fufaev:
    Dynamics of nonholonomic systems, 1972), wherever its mark stands."""
    model, spin = coin(), speed / RADIUS
    q = [0, 0, RADIUS, np.cos(turned / 2), 0, np.sin(turned / 2), 0]
    u = [speed * np.cos(turned), 0, speed * np.sin(turned), 0, spin, 0]
    linear = model.linearize(q, u, inputs=[])
    square = -(3 * spin**2 - GRAVITY / RADIUS) / (5 / 4)
    modes = linear.modes()
    (found,) = [x for x in modes.eigenvalues if x.imag] or [max(modes.eigenvalues, key=np.real)]
    assert found == pytest.approx(np.sqrt(complex(square)), rel=1e-9)
    assert modes.unstable.any() == (speed**2 < GRAVITY * RADIUS / 3)
    assert nonholonomic_model(linear).frame_rates["fly"] == pytest.approx([0, spin, 0], abs=1e-12)
    names = {risk.name for risk in linear.risks}
    assert names <= {"unrestrained", "unstable"} and linear.trusted
    assert linear.frame == modes.frame == "fixed" and linear.to_fixed_frame() is linear


def disc_rates(z: Array) -> Array:
    """d/dt of lean and (w1, w2, w3) along the horizontal tangent, the spoke from the contact and
    the axis: Newton and Euler with the force of the contact eliminated, m = 1."""
    lean, w = z[0], z[1:]
    up = np.array([0 * lean, np.cos(lean), -np.sin(lean)])
    turn = np.array([w[0], w[1], -w[1] * np.tan(lean)])  # of these directions
    spoke, inertia = np.array([0, RADIUS, 0]), RADIUS**2 / 4 * np.diag([1.0, 1.0, 2.0])
    arm = RADIUS**2 * np.diag([1.0, 0.0, 1.0])  # of -spoke x (wdot x spoke), moved to the left
    momentum = np.cross(turn, inertia @ w)
    force = np.cross(turn, np.cross(w, spoke)) + GRAVITY * up
    wdot = np.linalg.solve(inertia + arm, -momentum - np.cross(spoke, force))
    return np.array([w[0], *wdot])


def coin_on_pins(lean: float) -> mstmm.Model:
    """The same disc by slides along x, y, z and pins of its heading, its lean and its spin."""
    across, names = RADIUS**2 / 4, ["x", "y", "z", "yaw", "lean", "spin"]
    axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [1, 0, 0], [0, 1, 0]]
    hinges: list[dict[str, Any]] = [
        {"name": name, "type": "prismatic" if k < 3 else "pin", "axis": axes[k],
         "inboard": f"b{k - 1}" if k else "ground", "outboard": f"b{k}"}
        for k, name in enumerate(names)
    ]  # fmt: skip
    hinges[2]["initial"], hinges[4]["initial"] = {"q": [RADIUS * np.cos(lean)]}, {"q": [lean]}
    bodies: list[dict[str, Any]] = [{"name": f"b{k}", "mass": 0.0} for k in range(6)]
    bodies[5] |= {"mass": 1.0, "inertia": [across, 2 * across, across]}
    rolls = {"name": "road", "type": "rolling", "from": "ground", "to": "b5",
             "normal": [0, 0, 1], "radius": RADIUS, "axis": [0, 1, 0]}  # fmt: skip
    return mstmm.compile(
        mstmm.Scene(gravity=[0, 0, -GRAVITY], body=bodies, hinge=hinges, constraint=[rolls])
    )


def circling(lean: float, yaw: float) -> tuple[Array, complex]:
    """Lean and rates of a disc that rolls in a circle, and the eigenvalue of its wobble, from the
    equations of its lean and its rates by complex steps."""
    z = np.array([lean, 0.0, yaw * np.cos(lean), 0.0])
    torque = [disc_rates(np.array([*z[:3], w]))[1] for w in (0.0, 1.0)]
    z[3] = -torque[0] / (torque[1] - torque[0])  # the spin of a lean that lasts
    assert np.abs(disc_rates(z)).max() < 1e-12
    step = 1e-30
    slopes = np.array([disc_rates(z + 1j * step * one).imag / step for one in np.eye(4)]).T
    expected = np.linalg.eigvals(slopes)
    (wobble,) = [x for x in expected if x.imag > 0.1]
    return z, complex(wobble)


@pytest.mark.parametrize(("lean", "yaw"), [(0.3, 1.5), (-0.7, 2.0), (0.5, 4.0)])
def test_a_disc_that_rolls_in_a_circle(lean: float, yaw: float) -> None:
    z, wobble = circling(lean, yaw)
    # x of the body is the tangent, z the spoke, y against the axis
    q = [0, 0, RADIUS * np.cos(lean), np.cos(lean / 2), np.sin(lean / 2), 0, 0]
    w = np.array([z[1], -z[3], z[2]])
    u = [*np.cross(w, [0, 0, RADIUS]), *w]
    model = coin()
    linear = model.linearize(q, u, inputs=[])
    assert np.abs(linear.modes().eigenvalues - wobble).min() < 1e-9
    assert linear.trusted and linear.frame == "rotating"
    with pytest.raises(SceneError, match="in frames that follow the motion"):
        linear.to_fixed_frame()


def test_a_disc_on_pins_rolls_in_a_circle(lean: float = 0.3, yaw: float = 1.5) -> None:
    """Its places accelerate, on which nothing depends."""
    (_, _, w2, w3), wobble = circling(lean, yaw)
    heading, speed = 0.4, -w3 * RADIUS
    u = [speed * np.cos(heading), speed * np.sin(heading), 0, yaw, 0, -w3 - w2 * np.tan(lean)]
    q = [0, 0, RADIUS * np.cos(lean), heading, lean, 0.2]
    linear = coin_on_pins(lean).linearize(q, u, inputs=[])
    assert np.abs(linear.modes().eigenvalues - wobble).min() < 1e-9
    assert linear.trusted and np.abs(linear.state.udot[:2]).min() > 0.5


def test_a_disc_that_is_not_round_in_its_inertia_is_told() -> None:
    """Its coefficients are periodic; with a heavy side it does not even roll steadily."""
    speed = 2.0
    state = [0, 0, RADIUS, 1, 0, 0, 0], [speed, 0, 0, 0, speed / RADIUS, 0]
    egg = coin(inertia=[0.05, 0.125, 0.075]).linearize(*state, inputs=["fly.effort_wx"])
    assert [risk.name for risk in egg.risks if risk.invalidates] == ["changing-coefficients"]
    with pytest.raises(SceneError, match="not constant along the motion: the matrices"):
        egg.frequency_response([1.0], outputs=["fly.wy"])
    heavy = coin(center_of_mass=[0.1, 0, 0]).linearize(*state, inputs=[])
    assert [risk.name for risk in heavy.risks if risk.invalidates] == ["unsteady-state"]


# --- rows of speeds -------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [3.0, -3.0])
@pytest.mark.parametrize("heading", [0.0, 0.6])
def test_chaplygins_sleigh(speed: float, heading: float) -> None:
    """Its yaw dies out with m a v/(J + m a^2), and grows backwards (Chaplygin 1911)."""
    mass, arm, inertia = 2.0, 0.3, 0.5
    edge = {"name": "edge", "speeds": "cos(yaw.q)*y.u - sin(yaw.q)*x.u"}
    slide = {"type": "prismatic"}
    model = mstmm.compile(mstmm.Scene(
        gravity=[0, 0, 0],
        body=[{"name": "a", "mass": 0.0}, {"name": "b", "mass": 0.0},
              {"name": "sleigh", "mass": mass, "center_of_mass": [arm, 0, 0],
               "inertia": [1, 1, inertia]}],
        hinge=[slide | {"name": "x", "axis": [1, 0, 0], "inboard": "ground", "outboard": "a"},
               slide | {"name": "y", "axis": [0, 1, 0], "inboard": "a", "outboard": "b"},
               {"name": "yaw", "type": "pin", "inboard": "b", "outboard": "sleigh",
                "initial": {"q": [heading]}}],
        coupling=[edge],
    ))  # fmt: skip
    u = [speed * np.cos(heading), speed * np.sin(heading), 0.0]
    linear = model.linearize([0.0, 0.0, heading], u, inputs=[])
    (found,) = [x for x in linear.modes().eigenvalues if x]
    assert found == pytest.approx(-mass * arm * speed / (inertia + mass * arm**2), rel=1e-11)
    assert linear.coordinate_names == ("x.displacement", "y.displacement", "yaw.angle")
    assert len(nonholonomic_model(linear).speeds) == 2 and linear.trusted


# --- what it is -----------------------------------------------------------------------------------


def test_there_are_no_second_order_matrices(tmp_path: Path) -> None:
    linear = coin().linearize(None, [2.0, 0, 0, 0, 4.0, 0], inputs=["fly.effort_wy"])
    for name in ("M", "C", "K", "V", "W", "C_damping", "K_elastic"):
        with pytest.raises(SceneError, match=r"M, C, K, .* 5 positions and 3 speeds"):
            getattr(linear, name)
    with pytest.raises(SceneError, match="damped = False"):
        linear.modes(damped=False)
    with pytest.raises(SceneError, match="a number of modes from 1 to 8"):
        linear.modes(9)
    data = linear.to_dict()
    assert data["A"] == linear.A.tolist() and "M" not in data and data["trusted"]
    assert len(data["B"]) == 8
    assert linear.save(tmp_path / "coin.csv").read_text().startswith("matrix,row,column,value")
    shares = linear.modes(3).to_dict()["kinetic"]["coin"]
    assert shares == pytest.approx([1.0, 1.0, 1.0])


def test_a_resonance_is_refused() -> None:
    linear = coin().linearize(None, [2.0, 0, 0, 0, 4.0, 0], inputs=["fly.effort_wy"])
    omega = float(linear.modes().omega[-1])
    with pytest.raises(NumericalFailure, match="is an undamped resonance"):
        linear.frequency_response([omega], outputs=["fly.wy"])
