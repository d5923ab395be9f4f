"""Equilibria and linear models of mechanisms, with the stiffness of the loads that loops carry."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.compare import worst
from tests.reference.jets import Array
from tests.support import planar_four_bar as planar
from tests.support.models import compile_scene
from tests.support.scenes.linkages import OBLIQUE, bricard, cranks, four_bar, legs
from tests.support.scenes.published_mechanisms import andrews, four_bars

#: Springs, dampers and rotors in all hinges of the four-bar, without friction.
LAWS: dict[str, dict[str, Any]] = {
    "foot": {"stiffness": 30.0, "rest": 0.2, "inertia": 0.02, "damping": 0.05},
    "knee": {"stiffness": 6.0, "rest": -0.3, "damping": 0.1, "inertia": 0.03},
    "tip": {"stiffness": 3.0, "rest": 0.8, "effort": -0.7, "inertia": 0.01},
    "end": {"damping": 0.2, "stiffness": 2.0, "rest": 1.5, "inertia": 0.05},
}


def relative_difference(found: Any, wanted: Any) -> float:
    """Largest difference of complex numbers, in parts of the largest."""
    return float(np.abs(found - wanted).max() / np.abs(wanted).max())


def on_a_spring() -> dict[str, Any]:
    """Four-bar of 1, 2 and 1.5 kg, rods 0.05 m wide, its crank on a spring of 30 N m/rad."""
    scene = four_bar(0.2, laws={"foot": {"stiffness": 30.0, "rest": 0.2}})
    for body, mass in zip(scene["body"], (1.0, 2.0, 1.5), strict=True):
        length = body["ends"]["tip"][0]
        moment = mass * (length**2 + 0.05**2) / 12
        body |= {"mass": mass, "inertia": [1e-3, moment, moment]}
    return scene


def test_a_crank_on_a_spring() -> None:
    """Angle and frequency as they come from one coordinate; without what the loads of the loop
    make of turning rows the frequency is off by 1.5 parts in a hundred."""
    model = compile_scene(on_a_spring())
    rest = model.equilibrium()
    assert abs(rest[0] + 0.0276626292722723) < 1e-13
    assert list(rest.residuals) == ["foot.angle_rate"]
    linear = model.linearize()
    assert linear.coordinate_names == ("foot.angle",)
    square = linear.modes().omega[0] ** 2
    assert abs(square / 35.3364900695893 - 1) < 3e-13
    assert abs(model.modes().omega[0] ** 2 - square) < 1e-10
    assert linear.constrained_motion is not None
    without = (linear.K - linear.constrained_motion.constraint_stiffness)[0, 0] / linear.M[0, 0]
    assert 0.01 < abs(without / square - 1) < 0.02
    assert linear.K_elastic[0, 0] == pytest.approx(30.0, rel=1e-13)
    whole = linear.K_elastic + linear.K_geometric + linear.K_load
    assert worst(whole, linear.K) < 1e-13


@pytest.mark.parametrize("cut", planar.NAMES)
def test_cutting_another_hinge_changes_nothing(cut: str) -> None:
    model = compile_scene(four_bar(cut=cut, laws=LAWS, tilt=OBLIQUE))
    plain = compile_scene(four_bar(laws=LAWS))
    assert abs(model.equilibrium()[0] - plain.equilibrium()[0]) < 1e-12
    here, there = model.linearize(), plain.linearize()
    for name in ("M", "C", "K", "C_damping", "K_elastic", "K_geometric"):
        assert worst(getattr(here, name), getattr(there, name)) < 1e-10
    assert relative_difference(here.modes().eigenvalues, there.modes().eigenvalues) < 1e-10
    energies = here.modes().strain_energy_shares()
    assert (
        worst(list(energies.values()), list(there.modes().strain_energy_shares().values())) < 1e-9
    )
    moving = here.modes().kinetic_energy_shares()
    for parts in (energies, moving):
        assert worst(np.sum(list(parts.values()), axis=0), np.ones(1)) < 1e-12


def test_springs_of_a_tree_that_has_no_inertia_when_opened() -> None:
    """Andrews' mechanism: spring and damper act along the length, by central differences of it."""
    scene = andrews()
    (spring,) = scene["spring"]
    stiffness, damping, size = spring["law"]["stiffness"], 3.0, 1e-5
    linear = compile_scene(
        scene | {"spring": [spring | {"law": spring["law"] | {"damping": damping}}]}
    ).linearize()
    (spring_end,) = (spring[key] for key in ("from", "to") if spring[key] != "ground")
    model = compile_scene(scene)
    assert linear.constrained_motion is not None
    motion, q = linear.constrained_motion.motion_basis[:, 0], linear.state.q

    def length(x: float) -> float:
        point = model.positions(model.assemble(q + x * motion)[0], spring_end)
        return float(np.linalg.norm(point - spring["position"]))

    slope = (length(size) - length(-size)) / (2 * size)
    np.testing.assert_allclose(linear.K_elastic, stiffness * slope**2, rtol=1e-6)
    np.testing.assert_allclose(linear.C_damping, damping * slope**2, rtol=1e-6)


@pytest.fixture(scope="module")
def platform() -> mstmm.Model:
    """Six legs on springs and dampers: 15 rows, 6 motions."""
    return compile_scene(legs(law=1e4))


def test_matrices_are_slopes_of_accelerations(platform: mstmm.Model) -> None:
    """By central differences between closed states."""
    linear = platform.linearize()
    assert linear.constrained_motion is not None
    ways, places, size = (
        linear.constrained_motion.motion_basis,
        list(linear.free_speed_indices),
        1e-4,
    )
    q, memory = linear.state.q, platform.looped.start_memory()

    def closed_position(x: Array) -> Array:
        return platform.assemble(q + platform.looped.rates(0.0, q, ways @ x, memory))[0]

    for k, unit in enumerate(np.eye(6) * size):
        moved = [platform.accelerations(closed_position(s * unit), 0 * ways[:, 0]) for s in (1, -1)]
        going = [platform.accelerations(q, s * ways @ unit) for s in (1, -1)]
        for (ahead, behind), matrix in ((moved, linear.K), (going, linear.C)):
            found = (ahead - behind)[places] / (2 * size)
            assert worst(found, -np.linalg.solve(linear.M, matrix[:, k])) < 1e-7


def test_a_platform_at_rest_is_trusted(platform: mstmm.Model) -> None:
    """What moves is rounding, and no drift of momentum."""
    rest = np.asarray(platform.equilibrium()), np.zeros(platform.nu)
    assert not platform.simulate(0.5, initial=rest, rtol=1e-6).warnings


def test_responses_are_those_of_the_matrices(platform: mstmm.Model) -> None:
    """Outputs of bodies, cut hinges and accelerations, by states and by frequencies."""
    linear = platform.linearize(inputs=["slide2.effort", "platform.fx"])
    outputs = ["platform.head1.position.z", "head3.wx", "slide4.displacement",
               "platform.head0.acceleration.y"]  # fmt: skip
    c, d = linear.output_matrices(outputs)
    omega = np.array([3.0, 20.0, 55.0])
    found = linear.frequency_response(omega, outputs=outputs)
    for k, s in enumerate(1j * omega):
        wanted = c @ np.linalg.solve(s * np.eye(12) - linear.A, linear.B) + d
        assert relative_difference(found.response[k], wanted) < 1e-10
    lossy = linear.frequency_response(omega, outputs=outputs, structural=0.1)
    stiff = linear.K + 0.1j * linear.K_elastic
    for k, s in enumerate(1j * omega):
        x = np.linalg.solve(s**2 * linear.M + s * linear.C + stiff, linear.V)
        assert relative_difference(lossy.response[k][2], c[2, :6] @ x) < 1e-10


def test_windows_that_hang() -> None:
    """Five windows of four-bars swing as one pendulum of six rods that carry five."""
    model = compile_scene(four_bars(5, 0.7, 0.0))
    rest = model.equilibrium()
    feet = [rest[model.coordinate_layout.hinges[f"foot{k}"].q] for k in range(6)]
    assert worst(np.remainder(feet, 2 * np.pi), np.full(6, 1.5 * np.pi)) < 1e-10
    assert model.modes().omega == pytest.approx([np.sqrt(9.81 * (6 / 2 + 5) / (6 / 3 + 5))])


def test_upright_cranks_buckle() -> None:
    """Three cranks with a coupler on top fall over where a spring is too weak, one of them
    redundant: its loads are not determined, the frequency is."""
    scene = cranks(angle=np.pi / 2)
    scene["hinge"][0]["law"] = {"stiffness": 30.0, "rest": np.pi / 2}
    model = compile_scene(scene)
    weight, inertia = 9.81 * 0.6 * (3 / 2 + 1), 0.6**2 * (3 / 3 + 1)
    assert model.modes().omega == pytest.approx([np.sqrt((30 - weight) / inertia)], rel=1e-10)
    found = model.stability_limit("foot0.law.stiffness", 30.0, 5.0)
    assert found.value == pytest.approx(weight, rel=1e-6)


def test_cranks_that_hang() -> None:
    """Where a row of the third crank takes the place of another."""
    rest = compile_scene(cranks(angle=1.5 * np.pi)).modes()
    weight, inertia = 9.81 * 0.6 * (3 / 2 + 1), 0.6**2 * (3 / 3 + 1)
    assert rest.omega == pytest.approx([np.sqrt(weight / inertia)], rel=1e-9)


def test_bricards_ring_comes_to_rest() -> None:
    """Where its height changes no more with any turn, followed through poses where other rows take
    over."""
    model = compile_scene(bricard())
    rest = model.equilibrium()
    assert np.abs(model.accelerations(rest, np.zeros(model.nu))).max() < 1e-8
    linear = model.linearize()
    assert linear.K[0, 0] > 0 and len(linear) == 1


REFUSED: dict[str, tuple[Callable[[mstmm.Model], Any], str]] = {
    "symbols": (lambda m: m.linearize().symbolic(["crank.mass"]), "linear models of closed loops"),
    "exact": (lambda m: m.linearize().dynamic_stiffness_modes(1), "exact: expected a tree"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_refused(what: str) -> None:
    asked, message = REFUSED[what]
    with pytest.raises(mstmm.SceneError, match=message):
        asked(compile_scene(four_bar()))


def test_motions_of_drives() -> None:
    """A drive beside the loop stands still; as an input it pushes by its inertia alone."""
    scene = four_bar(laws={"foot": {"stiffness": 30.0}})
    scene["body"].append({"name": "flag", "mass": 0.1, "inertia": [1e-3, 1e-3, 1e-3]})
    scene["hinge"].append({"name": "mast", "type": "pin", "inboard": "crank.tip",
                           "outboard": "flag", "drive": "0.3"})  # fmt: skip
    model = compile_scene(scene)
    assert model.linearize().coordinate_names == ("foot.angle",)
    shaken = model.linearize(inputs=["mast.angle_acceleration"])
    assert abs(shaken.V[0, 0] + 1e-3) < 1e-15
    assert not shaken.K_prescribed.any() and not shaken.C_prescribed.any()


def test_nothing_holds_it() -> None:
    scene = four_bar() | {"gravity": [0.0, 0.0, 0.0]}
    model = compile_scene(scene)
    with pytest.raises(mstmm.NumericalFailure, match=r"undetermined along foot\.angle_rate"):
        model.equilibrium()
    assert model.modes().omega == pytest.approx([0.0], abs=1e-7)
