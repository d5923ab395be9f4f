"""Structural and modal damping of frequency responses: closed forms and dense solutions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.linear.linear_model import Linear
from tests.runtime.linear.test_frequency_response import Scene, chain, masses
from tests.support.models import looped_model
from tests.support.scenes.linear import pendulum

OMEGA = np.array([0.4, 3.0, 11.0])


def test_one_mass_with_a_loss_factor() -> None:
    """x = 1 / (k (1 + i eta) + i omega d - omega^2 m); at its resonance |x| = 1 / (k eta)."""
    m, k, d, eta = 2.0, 50.0, 0.3, 0.04
    for links, damper in ((masses((m, k, d)), d), (masses((m, k, 0.0)), 0.0)):
        omega = np.array([0.1, 5.0, 700.0])
        found = looped_model(links).frequency_response(omega, ["s0.effort"], structural=eta)
        expected = 1 / (k * (1 + 1j * eta) + 1j * omega * damper - omega**2 * m)
        np.testing.assert_allclose(found.response[:, 0, 0], expected, rtol=1e-12)
    assert abs(found.response[1, 0, 0]) == pytest.approx(1 / (k * eta), rel=1e-12)


def test_two_masses_with_losses_of_their_own() -> None:
    (m1, k1), (m2, k2), losses = (3.0, 70.0), (1.0, 40.0), {"s0": 0.1, "s1": 0.02}
    model = looped_model(masses((m1, k1, 0.0), (m2, k2, 0.0)))
    found = model.frequency_response(OMEGA, ["s1.effort"], structural=losses).response[:, :, 0]
    a, b = k1 * (1 + 0.1j), k2 * (1 + 0.02j)
    for w, values in zip(OMEGA, found, strict=True):
        # Displacements of each mass beside the one before: the effort pushes the second alone.
        z = np.array([[a - w**2 * (m1 + m2), -(w**2) * m2], [-(w**2) * m2, b - w**2 * m2]])
        np.testing.assert_allclose(values, np.linalg.solve(z, [0, 1]), rtol=1e-12)


def beam_and_chain_scene() -> Scene:
    """A beam on a sprung pin with a rod on a ball at its tip, a chain on that, and springs: one
    stretched to the ground, one between the beam and the chain."""
    rod = {"mass": 0.3, "center_of_mass": [0.2, 0, 0], "inertia": [0.01, 0.02, 0.02],
           "ends": {"tip": [0.4, 0, 0]}}  # fmt: skip
    return {
        "gravity": [0, 0, 0],
        "beam": [{"name": "boom", "length": 2.0, "mass_per_length": 0.8, "bending_stiffness": 30.0,
                  "modes": {"y": 2, "z": 2}, "damping": 0.01}],
        "body": [{"name": "rod", **rod}],
        "hinge": [
            {"name": "shoulder", "type": "pin", "inboard": "ground", "outboard": "boom",
             "law": {"stiffness": 40.0, "damping": 0.2}},
            {"name": "wrist", "type": "ball", "inboard": "boom.tip", "outboard": "rod",
             "law": {"stiffness": [3.0, 4.0, 5.0], "damping": 0.02}},
        ],
        "chain": [{"name": "tail", "count": 3, "inboard": "rod.tip", "body": rod, "end": "tip",
                   "hinge": {"type": "pin", "law": {"stiffness": 6.0, "damping": 0.01}}}],
        "spring": [
            {"name": "stay", "from": "ground", "to": "boom.tip", "position": [0, 2, 0.4],
             "law": {"stiffness": 25.0, "rest": 2.0, "damping": 0.1}},
            {"name": "across", "from": "boom", "to": "tail[1].tip",
             "law": {"stiffness": 9.0, "rest": 2.5}},
        ],
    }  # fmt: skip


@pytest.fixture(scope="module")
def of_mixed() -> Linear:
    return looped_model(beam_and_chain_scene()).linearize(inputs=["shoulder.effort", "rod.fy"])


def check(linear: Linear, added: Any, **damping: Any) -> None:
    """Beside a dense solution with `added` in its place in Z."""
    found = linear.frequency_response(OMEGA, **damping).response
    for w, values in zip(OMEGA, found, strict=True):
        z = linear.K + 1j * w * linear.C - w**2 * linear.M + added(w)
        expected = np.linalg.solve(z, linear.V)
        assert np.abs(values - expected).max() < 1e-10 * np.abs(expected).max(), w


def test_losses_of_all_that_is_elastic(of_mixed: Linear) -> None:
    check(of_mixed, lambda _: 0.05j * of_mixed.K_elastic, structural=0.05)


def test_losses_of_some(of_mixed: Linear) -> None:
    """What one member loses is what its stiffness adds, tensions left as they are."""
    only_shapes = of_mixed._modal_matrix(lambda body: body.K)
    check(of_mixed, lambda _: 0.3j * only_shapes, structural={"boom": 0.3})
    springs = of_mixed.K_springs
    check(of_mixed, lambda _: 0.2j * springs, structural={"stay": 0.2, "across": 0.2})
    stiff = np.array([0, 0, 6.0, 6.0, 0.0])
    names = of_mixed.coordinate_names
    for losses, factors in (({"tail": 0.1}, [0.1] * 3), ({"tail[1].hinge": 0.1}, [0, 0.1, 0])):
        lost = np.zeros((len(names), len(names)))
        for k, factor in enumerate(factors):
            place = names.index(f"tail[{k}].hinge.angle")
            lost[place, place] = factor * stiff[2]
        check(of_mixed, lambda _, lost=lost: 1j * lost, structural=losses)


def test_modal_ratios_are_those_of_the_natural_motions(of_mixed: Linear) -> None:
    modes = of_mixed.modes(damped=False)
    for ratios in (0.02, [0.03, 0.0, 0.1]):
        zeta = np.zeros(len(modes))
        zeta[: np.size(ratios) if np.ndim(ratios) else None] = ratios
        u = of_mixed.M @ modes.shapes
        c = (u * (2 * zeta * modes.omega)) @ u.T
        check(of_mixed, lambda w, c=c: 1j * w * c, modal=ratios)
        check(of_mixed, lambda w, c=c: 1j * w * c + 0.1j * of_mixed.K_elastic, modal=ratios,
              structural=0.1)  # fmt: skip


@pytest.mark.parametrize("links", [[(2.0, 50.0)], [(3.0, 70.0), (1.0, 100.0), (0.5, 20.0)]])
def test_modal_damping_at_the_resonances_themselves(links: list[tuple[float, float]]) -> None:
    """Without it the answer has no bound there: superposed, 1 / (2 i zeta omega^2) and the rest."""
    model = looped_model(masses(*((m, k, 0.0) for m, k in links)))
    linear = model.linearize(inputs=["s0.effort"])
    modes = linear.modes()
    omega = np.array([*modes.omega, *(modes.omega * (1 + 1e-9))])
    found = linear.frequency_response(omega, modal=0.01).response[:, :, 0]
    pushed = modes.shapes.T @ linear.V[:, 0]
    for w, values in zip(omega, found, strict=True):
        amplitudes = pushed / (modes.omega**2 - w**2 + 0.02j * w * modes.omega)
        expected = modes.shapes @ amplitudes
        assert np.abs(values - expected).max() < 1e-8 * np.abs(expected).max(), w


def test_the_slowest_motions_of_many_are_damped_alone() -> None:
    linear = looped_model(chain(500, 0.0)).linearize(
        np.zeros(500), inputs=["rope[499].hinge.effort"]
    )
    modes = linear.modes(3)
    at = np.array([modes.omega[1], modes.omega[2] * 0.999])
    found = linear.frequency_response(at, modal=[0.01, 0.02, 0.03]).response[:, :, 0]
    u = linear.M @ modes.shapes
    for w, values in zip(at, found, strict=True):
        c = (u * (2 * np.array([0.01, 0.02, 0.03]) * modes.omega)) @ u.T
        expected = np.linalg.solve(linear.K - w**2 * linear.M + 1j * w * c, linear.V[:, 0])
        assert np.abs(values - expected).max() < 1e-7 * np.abs(expected).max()


def test_what_cannot_be_damped_is_refused() -> None:
    model = looped_model(masses((2.0, 50.0, 0.0), (1.0, 3.0, 0.0)))

    def ask(**damping: Any) -> None:
        model.frequency_response([1.0], ["s0.effort"], **damping)

    for damping, text in (
        ({"structural": -0.1}, "structural = -0.1: expected a loss factor of 0 or more"),
        ({"structural": {"s0": "a"}}, r"structural\[\"s0\"\] = 'a': expected a loss factor"),
        ({"structural": {"sO": 0.1}}, '"sO": expected a hinge with a law.*one of s0, s1'),
        ({"modal": -0.1}, "modal = -0.1: expected damping ratios of 0 or more"),
        ({"modal": [0.1] * 3}, "3 ratios, but the scene has 2 modes"),
        ({"modal": "a"}, "modal"),
        ({"modal": float("nan")}, "modal"),
    ):
        with pytest.raises(SceneError, match=text):
            ask(**damping)
    upright = mstmm.compile(pendulum(), engine="looped").linearize([np.pi])
    with pytest.raises(SceneError, match="this state is unstable"):
        upright.frequency_response([1.0], modal=0.1)
    moving = model.linearize([0.0, 0.0], [1.0, 0.0])
    with pytest.raises(SceneError, match="require a state at rest"):
        moving.frequency_response([1.0], structural=0.1)
