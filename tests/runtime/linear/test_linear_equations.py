"""Linear equations of scenes: closed forms, and derivatives found in another way."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigvalsh

import mstmm
from mstmm.runtime.linear.linear_model import Linear
from tests.reference.flexible.finite_elements import rotating
from tests.support.paths import EXAMPLES
from tests.support.scenes.linear import column, hanging_beam, pendulum, rotor_blade, top

PARTS = ("K_elastic", "K_geometric", "K_load")


def example(name: str) -> mstmm.Model:
    return mstmm.compile(mstmm.load_scene(EXAMPLES / name / "scene.toml"), engine="looped")


def moving(model: mstmm.Model) -> Linear:
    """Near the start, everything moving."""
    q, u = model.initial_state()
    return model.linearize(q, u + 0.1 * np.random.default_rng(1).standard_normal(model.nu))


@pytest.mark.parametrize(
    "name",
    ["flexible_arm", "satellite_panels", "three_pin_arm_springs", "heavy_top", "elastic_link"],
)
def test_matrices_are_those_of_the_differentiated_accelerations(name: str) -> None:
    """Which the fused kernel gives: another route through the same equations."""
    model = example(name)
    linear = moving(model)
    state, free = linear.state, list(linear.free_speed_indices)
    other = model.derivatives(state.q, state.u)
    ours = np.linalg.solve(linear.M, np.hstack([linear.K, linear.C]))
    by_speed, rates = other.u[np.ix_(free, free)], other.rate_q[np.ix_(free, free)]
    # x' = G x + du, and du' = q-part x + u-part du
    c = -(by_speed + rates)
    k = -(other.q[np.ix_(free, free)] - by_speed @ rates)
    expected = np.hstack([k, c])
    np.testing.assert_allclose(ours, expected, atol=2e-10 * np.abs(expected).max())
    np.testing.assert_allclose(linear.M, model.mass_matrix(state.q)[np.ix_(free, free)], atol=1e-13)


@pytest.mark.parametrize("name", ["flexible_arm", "elastic_link", "branched_tree", "spray_boom"])
def test_stiffness_is_the_slope_of_the_efforts(name: str) -> None:
    """By central differences of the swept residual."""
    model = example(name)
    linear = model.linearize()
    q, still = linear.state.q, np.zeros(model.nu)
    columns = []
    for unit in np.eye(len(linear)):
        ahead, behind = (
            model.inverse_dynamics(linear.displaced_state(x * unit), still, still)
            for x in (1e-5, -1e-5)
        )
        columns.append((ahead - behind)[list(linear.free_speed_indices)] / 2e-5)
    stiffness = np.array(columns).T
    np.testing.assert_allclose(linear.K, stiffness, atol=1e-7 * np.abs(stiffness).max())
    assert np.abs(model.inverse_dynamics(q, still, still)).max() < 1e-6 * np.abs(stiffness).max()


@pytest.mark.parametrize("name", ["flexible_arm", "three_pin_arm_springs", "satellite_panels"])
def test_parts_add_up(name: str) -> None:
    linear = moving(example(name))
    total = sum(getattr(linear, part) for part in PARTS)
    np.testing.assert_allclose(total, linear.K, atol=1e-12 * np.abs(linear.K).max())
    np.testing.assert_allclose(linear.C_damping + linear.C_gyroscopic, linear.C, atol=1e-12)


@pytest.mark.parametrize(("angle", "sign"), [(0.0, 1.0), (np.pi, -1.0)])
def test_a_pendulum_hangs_or_stands(angle: float, sign: float) -> None:
    law = {"stiffness": 3.0, "rest": angle, "damping": 0.4}
    linear = mstmm.compile(pendulum(angle, law=law)).linearize([angle])
    assert linear.coordinate_names == ("pivot.angle",) and linear.coordinate_units == ("rad",)
    assert pytest.approx(0.03 + 2 * 0.25) == linear.M
    assert linear.K_elastic == pytest.approx(3.0) and linear.C_damping == pytest.approx(0.4)
    assert linear.K_geometric == pytest.approx(sign * 2 * 9.81 * 0.5)
    assert not linear.K_load.any() and not linear.C_gyroscopic.any()


def test_a_string_under_tension_holds_across() -> None:
    """A mass between two springs with tension f over a length l: 2 f/l across, 2 k along."""
    spring = {"law": {"stiffness": 50.0, "rest": 0.6}}
    scene = mstmm.Scene(
        gravity=(0, 0, 0), body=[{"name": "bead", "mass": 1.0, "inertia": [1, 1, 1]}],
        hinge=[{"name": "plane", "type": "planar", "axis": [0, 0, 1], "axis2": [1, 0, 0],
                "inboard": "ground", "outboard": "bead"}],
        spring=[{"name": side, "from": "ground", "to": "bead", "position": [x, 0, 0], **spring}
                for side, x in (("left", -1.0), ("right", 1.0))],
    )  # fmt: skip
    linear = mstmm.compile(scene).linearize(np.zeros(3))
    along, across = (
        linear.coordinate_names.index("plane.x"),
        linear.coordinate_names.index("plane.y"),
    )
    assert linear.K_elastic[along, along] == pytest.approx(100.0)
    assert linear.K_geometric[along, along] == pytest.approx(0.0, abs=1e-12)
    assert linear.K_geometric[across, across] == pytest.approx(2 * 50 * 0.4 / 1.0)
    assert linear.K_elastic[across, across] == pytest.approx(0.0, abs=1e-12)


def test_a_load_that_follows_is_no_potential() -> None:
    """A force along a link turns with it, -f l on the turn of the link alone."""
    load = [{"on": "bob.tip", "force": [0, 7.0, 0]}]
    dead, follows = (
        mstmm.compile(
            pendulum().model_copy(update={"load": mstmm.Scene(
                **{**pendulum().model_dump(by_alias=True), "load": [load[0] | {"axes": axes}]}
            ).load})
        ).linearize([0.0])
        for axes in ("inertial", "body")
    )  # fmt: skip
    assert not dead.K_load.any() and dead.K_geometric[0, 0] == pytest.approx(9.81 - 7.0)
    assert follows.K_load[0, 0] == pytest.approx(7.0) and follows.K[0, 0] == pytest.approx(9.81)


@pytest.mark.parametrize(("load", "stable"), [(2.467, True), (2.469, False)])
def test_a_column_buckles_where_euler_has_it(load: float, stable: bool) -> None:
    """At pi^2/4 E I/L^2 = 2.4674; eight shapes are a little stiffer."""
    linear = mstmm.compile(column(load, "inertial", 8)).linearize()
    assert (linear.modes().eigenvalues.real.max() <= 0) == stable
    assert any("unstable" in text for text in linear.warnings) != stable


@pytest.mark.parametrize(("load", "stable"), [(20.03, True), (20.07, False)])
def test_a_column_flutters_where_beck_has_it(load: float, stable: bool) -> None:
    """At 20.05 E I/L^2 (Beck, ZAMP 3 (1952) 225-228), without any other equilibrium."""
    linear = mstmm.compile(column(load, "body", 10)).linearize()
    assert np.abs(linear.K_load - linear.K_load.T).max() > 1.0
    assert (linear.modes().eigenvalues.real.max() <= 0) == stable


#: Flapping frequencies of a clamped beam that rotates, first and second, by spin, in sqrt(EI/m)/L^2
#: (Wright, Smith, Thresher and Wang, J. Appl. Mech. 49 (1982) 197-202, table 1, no hub).
FLAP = {0: (3.5160, 22.0345), 6: (7.3604, 26.8091), 12: (13.1702, 37.6031)}


@pytest.mark.parametrize("spin", list(FLAP))
def test_a_rotating_beam_stiffens(spin: int) -> None:
    """Across the plane of rotation as published; within it omega^2 is less by the spin's square."""
    linear = mstmm.compile(rotor_blade(spin)).linearize()
    assert linear.state.u[0] == spin and not linear.warnings
    across = [k for k, name in enumerate(linear.coordinate_names) if ".z" in name]
    omega = linear.modes().omega
    flap = np.sqrt(np.linalg.eigvals(np.linalg.solve(linear.M, linear.K)[np.ix_(across, across)]))
    np.testing.assert_allclose(np.sort(flap.real)[:2], FLAP[spin], rtol=1e-4)
    lag = np.sqrt(np.sort(flap.real) ** 2 - spin**2)
    assert min(abs(omega - lag[0])) < 1e-9 * lag[0]


@pytest.mark.parametrize(
    ("spin", "hub", "apart"),
    [(6.0, 0.0, 4e-6), (2.0, 1.0, 3e-7), (10.0, 1.0, 6e-5), (10.0, 5.0, 3e-4)],
)
def test_a_blade_on_a_hub(spin: float, hub: float, apart: float) -> None:
    """Both planes, against finite elements; the more the pull bends the shapes, the more of them
    there have to be."""
    linear = mstmm.compile(rotor_blade(spin, hub, 12)).linearize()
    for plane, lag in ((".z", False), (".y", True)):
        expected = rotating(hub, spin, lag, 2)
        here = [k for k, name in enumerate(linear.coordinate_names) if plane in name]
        squares = eigvalsh(linear.K[np.ix_(here, here)], linear.M[np.ix_(here, here)])
        np.testing.assert_allclose(np.sqrt(squares[:2]), expected, rtol=apart)


@pytest.mark.parametrize("spin", [40.0, 65.0])
def test_a_sleeping_top(spin: float) -> None:
    """A z'' - i C w z' - m g l z = 0 in axes that do not spin; stable from 2 sqrt(A m g l)/C on."""
    scene, q, u = top(spin)
    linear = mstmm.compile(scene).linearize(q, u)
    a, c, weight = 0.002 + 0.01, 0.004, 9.81 * 0.1
    roots = np.roots([a, -1j * c * spin, -weight]) - 1j * spin  # as the top itself sees them
    found = np.linalg.eigvals(linear.A)
    for root in roots:
        assert np.abs(found - root).min() < 1e-9 * spin
    stable = c * spin > 2 * np.sqrt(a * weight)
    assert any("unstable" in text for text in linear.warnings) != stable
    assert not any("last" in text or "change" in text for text in linear.warnings)


def test_pushes_and_the_ground() -> None:
    """Of a pendulum at 30 degrees: efforts, forces, moments and accelerations of the ground."""
    angle = np.pi / 6
    linear = mstmm.compile(pendulum()).linearize(
        [angle], inputs=["pivot.effort", "bob.tip.force.x", "bob.tip.fy", "bob.tip.mz"]
    )
    assert linear.input_names == (
        "pivot.effort", "bob.tip.force.x", "bob.tip.force.y", "bob.tip.moment.z"
    )  # fmt: skip
    np.testing.assert_allclose(linear.V, [[1, np.cos(angle), np.sin(angle), 1]], atol=1e-14)
    # In the ground's axes the mass feels -m a.
    assert linear.disturbance_names == tuple(f"ground.acceleration.{axis}" for axis in "xyz")
    expected = -2 * 0.5 * np.array([[np.cos(angle), np.sin(angle), 0]])
    np.testing.assert_allclose(linear.W, expected, atol=1e-14)
    np.testing.assert_allclose(linear.B[1], linear.V[0] / 0.53)
    np.testing.assert_allclose(linear.B_disturbances[1], linear.W[0] / 0.53)


def test_pushes_on_flexible_bodies() -> None:
    """By duality a force's column is how far its point goes with each coordinate."""
    model = example("flexible_arm")
    linear = model.linearize(inputs=["lower.tip.force.y"], disturbances=["ground.acceleration.y"])
    run = [
        model.simulate(
            1e-9, initial=(linear.displaced_state(x), np.zeros(model.nu)), output_times=[0.0]
        )
        for x in (1e-6 * np.eye(len(linear)))
    ]
    start = model.simulate(
        1e-9, initial=(linear.state.q, np.zeros(model.nu)), output_times=[0.0]
    ).position("lower.tip")[0, 1]
    moved = [(one.position("lower.tip")[0, 1] - start) / 1e-6 for one in run]
    np.testing.assert_allclose(linear.V[:, 0], moved, atol=2e-5)


def test_a_linear_model_foretells_small_motions() -> None:
    model = mstmm.compile(hanging_beam(1.0, 3), engine="looped")
    linear = model.linearize()
    assert not linear.warnings
    x = 1e-4 * np.random.default_rng(3).standard_normal(len(linear))
    times = np.linspace(0, 0.3, 7)
    run = model.simulate(
        0.3, initial=(linear.displaced_state(x), linear.state.u), output_times=times, rtol=1e-11,
        atol=1e-14,
    )  # fmt: skip
    values, vectors = np.linalg.eig(linear.A)
    parts = np.linalg.solve(vectors, np.concatenate([x, 0 * x]))
    for t, q in zip(times, run.q, strict=True):
        foretold = (vectors @ (np.exp(values * t) * parts)).real[: len(x)]
        np.testing.assert_allclose(q - linear.state.q, foretold, atol=2e-3 * np.abs(x).max())
