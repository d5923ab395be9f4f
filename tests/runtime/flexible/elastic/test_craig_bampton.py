"""A bar of finite elements against beam theory and its own whole mesh."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg

from mstmm.runtime.flexible.elastic.mesh import MeshStress
from tests.support.scenes import elastic_bar as bar

#: Of the clamped bar by beam theory: bending along z, along y, along z, along y, rad/s.
BEAM = np.array([103.36, 258.40, 647.75, 1619.4])


def test_beam_theory_is_what_it_is_said_to_be() -> None:
    """The references themselves: beta^2 sqrt(EI / rho A L^4)."""
    betas = np.array([1.8751040687, 4.6940911330])
    z, y = (betas**2 * np.sqrt(ei / bar.MASS) for ei in (bar.EI_Z, bar.EI_Y))
    assert np.allclose(sorted([*z, *y]), BEAM, rtol=5e-5)


def test_matrices_carry_rigid_motions() -> None:
    model = bar.model()
    force = np.abs(model.stiffness @ model.rigid_displacements).max() / abs(model.stiffness).max()
    assert force < 2e-15
    assert model.mass.shape == (1107, 1107)
    assert np.allclose(model.inertia[:3, :3], bar.MASS * np.eye(3), rtol=1e-13)


def test_elements_turn_without_strain() -> None:
    """In any finite rotation, as the rectangle of Jing, Stephansson (2.83) to (2.87) does: the
    displacement gradient is A - 1 everywhere, because coordinates are fields of the elements."""
    model = bar.model()
    a, b = np.array([1.0, 2.0, -0.5]), 1.9
    axis = a / np.linalg.norm(a)
    tilde = np.cross(np.eye(3), axis)
    turn = np.eye(3) - np.sin(b) * tilde + (1 - np.cos(b)) * tilde @ tilde
    assert np.allclose(turn @ turn.T, np.eye(3), atol=1e-15)
    moved = (model.nodes @ (turn - np.eye(3)).T).reshape(-1, 1)
    assert isinstance(model.stress, MeshStress)
    gradients = model.stress.gradients(moved)[0]
    assert np.abs(gradients - (turn - np.eye(3))[:, :, None]).max() < 1e-12


def test_frequencies_of_the_cantilever() -> None:
    found = bar.frequencies(bar.body(bar.table()))
    assert np.allclose(found[:4], [103.85, 259.02, 650.47, 1613.4], rtol=4e-5)
    assert np.allclose(found[:4], BEAM, rtol=5e-3)


def test_reduction_error_against_the_whole_mesh() -> None:
    """Four fixed-interface modes: 2e-5 in the first frequency, 4e-3 in the fourth, from above."""
    model, reduction = bar.model(), bar.reduction(0.3, 4)
    held = reduction.sections.clamp([reduction.held_port])
    free = held.free_indices
    stiffness = reduction.sections.stiffness.toarray()[np.ix_(free, free)]
    mass = reduction.sections.mass.toarray()[np.ix_(free, free)]
    whole = np.sqrt(linalg.eigh(stiffness, mass, eigvals_only=True, subset_by_index=(0, 3)))
    error = bar.frequencies(bar.body(bar.table()))[:4] / whole - 1
    assert (error > -1e-9).all()
    assert error[0] < 3e-5
    assert error[3] < 5e-3
    assert model.unknowns == 3


def test_linear_elements_lock_and_say_so() -> None:
    box = bar.table()["box"] | {"divisions": [40, 2, 2]}
    locked = bar.body(bar.table(box=box, order=1))
    assert np.allclose(bar.frequencies(locked)[:4], [134.07, 274.91, 839.64, 1713.0], rtol=5e-5)
    (warning,) = locked.warnings
    assert 'elastic "bar"' in warning
    assert "too stiff in bending" in warning
    assert "order = 2" in warning
    assert not bar.body(bar.table()).warnings


@pytest.mark.parametrize("frame", ["tangent", "mean"])
def test_static_shapes_are_exact(frame: str) -> None:
    """The compliance between the ends is the whole mesh's: K_reduced holds it without loss."""
    reduction = bar.reduction(0.3, 0, frame)
    relative = reduction.motion(reduction.sections.ports[1])
    root = reduction.motion(reduction.held_port)
    turned = np.cross(root[3:].T, [bar.LENGTH, 0, 0]).T
    relative = relative - root - np.vstack([turned, np.zeros_like(turned)])
    stiffness = bar.MASS * reduction.frequencies**2
    compliance = (relative / stiffness) @ relative.T
    held = reduction.sections.clamp([reduction.held_port])
    loads = reduction.sections.rows["tip"].toarray().T
    whole = reduction.sections.rows["tip"] @ held.statics(loads)
    assert np.allclose(compliance, whole, rtol=0, atol=1e-7 * np.abs(whole).max())
    assert whole[2, 2] == pytest.approx(bar.LENGTH**3 / (3 * bar.EI_Z), rel=1e-2)


def test_mean_frame_carries_no_momentum() -> None:
    """Free-free frequencies by beam theory, and shapes without momentum about any point."""
    found = bar.body(bar.table(frame="mean", poisson=0.0), "free")
    betas = np.array([4.7300407449, 7.8532046241])
    beam = betas**2 * np.sqrt(bar.EI_Z / bar.MASS)
    assert bar.frequencies(found)[0] == pytest.approx(beam[0], rel=2e-3)
    assert np.abs(found.C).max() < 1e-10 * bar.MASS
    turning = found.E - found.E.transpose(1, 0, 2)
    assert np.abs(turning).max() < 1e-10 * bar.MASS
    assert np.allclose(found.Mff, bar.MASS * np.eye(found.n), atol=1e-10)


def test_frame_follows_the_hinge() -> None:
    coarse = bar.table(box=bar.short())
    assert bar.body(coarse).frame == "tangent"
    pinned = bar.body(coarse, "pin")
    assert pinned.frame == "mean"
    assert 'hinge "held" lets it rotate freely' in pinned.notes[0]
    assert bar.body(coarse | {"frame": "tangent"}, "pin").frame == "tangent"


def test_held_section_stays_in_a_tangent_frame() -> None:
    found = bar.body(bar.table())
    assert not found.ports["root"].can_move
    assert found.ports["tip"].can_move


def test_highest_frequency_leaves_shapes_out() -> None:
    found = bar.body(bar.table(highest_frequency=1000.0))
    assert np.allclose(bar.frequencies(found), [103.85, 259.02, 650.47], rtol=4e-5)
    assert any("left out: 7 shapes" in note for note in found.notes)


def test_mean_coupling_leaves_the_section_free_to_deform() -> None:
    """Softer than a rigid section, and by little where the section is small."""
    stiff = bar.frequencies(bar.body(bar.table()))[:2]
    ends = {name: end | {"coupling": "mean"} for name, end in bar.ENDS.items()}
    soft = bar.frequencies(bar.body(bar.table(ends=ends)))[:2]
    assert (soft < stiff).all()
    assert np.allclose(soft, stiff, rtol=0.03)
    assert soft[0] == pytest.approx(BEAM[0], rel=0.02)


def test_an_end_that_is_only_watched_gets_no_static_shapes() -> None:
    """It moves with its nodes, and the modes are those of the bar with that end free."""
    watched = bar.body(bar.table(), load=[])
    assert watched.n == 4
    assert np.allclose(bar.frequencies(watched)[:4], BEAM, rtol=9e-3)
    loaded = bar.body(bar.table())
    sizes = [np.linalg.norm(found.ports["tip"].phi[:, 0]) for found in (watched, loaded)]
    assert sizes[0] == pytest.approx(sizes[1], rel=1e-3)
    assert sizes[1] == pytest.approx(2.0, rel=5e-3)  # a clamped-free shape of mean square 1


def test_damping_and_start() -> None:
    damping = {"ratio": 0.01, "stiffness": 1e-5}
    eta = [1e-3] + [0.0] * 9
    found = bar.body(bar.table(damping=damping, initial={"eta": eta}))
    omega = bar.frequencies(found)
    assert np.allclose(np.diag(found.D), bar.MASS * (2 * 0.01 * omega + 1e-5 * omega**2))
    assert found.eta.tolist() == eta
    assert not found.etad.any()
