"""The numbers of a beam: against particles, against published figures, between frames."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.linalg

from mstmm.runtime.flexible.modal_body import ModalBody
from tests.support.flexible.vibrations import (
    Array,
    frequencies,
    ground_hinge_equations,
    hinge_equations,
    mass_matrix,
    port_rows,
)
from tests.support.scenes.single_beam import FREE, HELD, PIN, body_of

STEPPED: dict[str, Any] = {
    "length": 1.7,
    "section": [
        {"from": 0.0, "to": 0.6, "mass_per_length": 2.0, "bending_stiffness": [3.0, 5.0],
         "rotary_inertia": [0.011, 0.017]},
        {"from": 0.6, "to": 1.7, "mass_per_length": 0.7, "bending_stiffness": [1.0, 0.8],
         "rotary_inertia": [0.004, 0.002]},
    ],
    "mass_per_length": None, "bending_stiffness": None, "polar_inertia_per_length": None,
    "torsional_stiffness": 0.6, "axial_stiffness": 40.0,
    "modes": {"y": 3, "z": 2, "twist": 2, "axial": 1},
}  # fmt: skip


# --- integrals ------------------------------------------------------------------------------------


def particles(body: ModalBody, count: int = 6) -> tuple[Array, Array, Array]:
    """(masses, places, displacement per mode) of a cloud that has the sections' moments: four
    particles per slice at (+-a, +-b)."""
    shapes = body.shapes
    assert shapes is not None
    masses, places, moved = [], [], []
    for start, end in zip(shapes.pieces, shapes.pieces[1:], strict=False):
        nodes, weights = np.polynomial.legendre.leggauss(count)
        x = start + (end - start) * (nodes + 1) / 2
        values, section = shapes.values_at(x), shapes.sections(x)
        m = section.mass_per_length * weights * (end - start) / 2
        turn = values.theta.copy()
        if not shapes.rotary:
            # Sections keep the attitude of the frame in which the shapes were made.
            slope = np.array([mode.frame_rotation for mode in shapes.modes])
            for k, mode in enumerate(shapes.modes):
                turn[:, 1, k] = slope[k] if mode.direction == "z" else 0.0
                turn[:, 2, k] = slope[k] if mode.direction == "y" else 0.0
        a = np.sqrt(section.rho_I[2] / section.mass_per_length)
        b = np.sqrt(section.rho_I[1] / section.mass_per_length)
        for sy, sz in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            lever = np.stack([0 * x, sy * a, sz * b], axis=1)
            masses.append(m / 4)
            places.append(np.stack([x, sy * a, sz * b], axis=1))
            moved.append(values.phi + np.cross(turn, lever[:, :, None], axis=1))
    return np.concatenate(masses), np.concatenate(places), np.concatenate(moved)


@pytest.mark.parametrize("frame", ["tangent", "chord", "mean", "tangent@mid"])
@pytest.mark.parametrize("rotary", [True, False])
def test_moments_are_those_of_a_cloud_of_particles(frame: str, rotary: bool) -> None:
    beam = dict(STEPPED, frame=frame, ends={"mid": 0.9})
    if not rotary:
        beam["section"] = [
            {k: v for k, v in piece.items() if k != "rotary_inertia"} for piece in beam["section"]
        ]
        beam["polar_inertia_per_length"] = 0.02
    body = body_of(HELD, **beam)
    m, r, u = particles(body)
    for found, expected in (
        (body.mass, m.sum()),
        (body.first, m @ r),
        (body.second, np.einsum("p,pa,pb->ab", m, r, r)),
        (body.C, np.einsum("p,pak->ak", m, u)),
        (body.E, np.einsum("p,pa,pbk->abk", m, r, u)),
        (body.F, np.einsum("p,pak,pbl->abkl", m, u, u)),
    ):
        assert found == pytest.approx(expected, abs=2e-12 * max(1.0, np.abs(expected).max()))
    assert body.F[2, 1].any() or not rotary


def test_shortening_is_the_arc_length_of_the_bent_axis() -> None:
    """By the trapezoidal rule on many points, from the slopes that differences give."""
    body = body_of(HELD, **STEPPED)
    shapes = body.shapes
    assert shapes is not None
    eta = np.random.default_rng(7).normal(size=body.n)
    x = np.linspace(0.0, shapes.length, 1701)
    phi = shapes.values_at(x).phi @ eta
    slope = np.gradient(phi[:, 1:], x, axis=0, edge_order=2)
    arc = np.concatenate([[0.0], np.cumsum((slope[1:] ** 2 + slope[:-1] ** 2).sum(1) / 2)])
    arc *= x[1] - x[0]
    tip = body.ports["tip"].second_order[0]
    assert eta @ tip @ eta == pytest.approx(arc[-1], rel=1e-4)
    mass = shapes.sections(x).mass_per_length
    mass[600] = 1.35  # half a step on either side of the change of section
    assert eta @ body.G[0] @ eta == pytest.approx(np.trapezoid(mass * arc, x), rel=1e-4)
    lever = np.trapezoid(mass * x * arc, x)
    assert eta @ body.X[0, 0] @ eta == pytest.approx(lever, rel=1e-4)


def test_published_integrals_of_the_clamped_beam() -> None:
    body = body_of(HELD)
    assert body.G[0, 0, 0] == pytest.approx(1.5709, abs=5e-5)
    assert body.ports["tip"].second_order[0, 0, 0] == pytest.approx(4.6478, abs=5e-5)
    rows = np.array([[1.1933, -0.6859, -0.7924], [-0.6859, 6.4782, 0.1694],
                     [-0.7924, 0.1694, 17.8595]])  # fmt: skip
    assert body.X[0, 0] == pytest.approx(rows, abs=6e-5)


def test_what_vanishes_by_symmetry_is_exactly_zero() -> None:
    body = body_of(HELD, modes={"y": 4, "z": 3}, stiffening=False)
    assert not body.C[2, :4].any() and not body.C[1, 4:].any() and not body.C[0].any()
    assert np.array_equal(body.K, np.diag(np.diag(body.K)))
    assert np.count_nonzero(body.F) == 7 + 6  # y and z shapes of equal form
    assert not body.G.any() and not body.X.any() and not body.ports["tip"].second_order.any()
    assert not body.ports["root"].can_move
    assert body.ports["tip"].can_move
    mean = body_of(FREE, modes={"y": 4})
    assert not mean.C.any()
    assert np.count_nonzero(mean.E) == 0


def test_drag_has_the_moments_of_its_own_density() -> None:
    body = body_of(HELD, viscous_drag=3.0, modes={"y": 2, "z": 1})
    bare = body_of(HELD, modes={"y": 2, "z": 1}, polar_inertia_per_length=None)
    assert body.drag is not None and bare.drag is None
    for name in ("mass", "first", "second", "C", "E", "F", "G", "X"):
        expected = np.asarray(3.0 * getattr(bare, name))
        assert getattr(body.drag, name) == pytest.approx(expected, abs=1e-13)


# --- linear models that the numbers must give -----------------------------------------------------


def lowest_load(matrix: Callable[[float], tuple[Array, Array]], low: float, high: float) -> float:
    """Load at which two frequencies meet, by halving."""
    while high - low > 1e-6:
        middle = (low + high) / 2
        k, m = matrix(middle)
        squares = scipy.linalg.eigvals(k, m)
        steady = np.abs(squares.imag).max() < 1e-7 * np.abs(squares).max()
        low, high = (middle, high) if steady else (low, middle)
    return low


@pytest.mark.parametrize(("n", "load"), [(2, 7.853), (4, 7.8382), (6, 7.8375)])
def test_a_column_buckles_under_its_own_weight(n: int, load: float) -> None:
    body = body_of(HELD, modes={"y": n})
    found = scipy.linalg.eigvals(body.K, body.G[0]).real.min()
    assert found == pytest.approx(load, abs=6e-5)


@pytest.mark.parametrize(("n", "load"), [(4, 20.0526), (6, 20.0498), (8, 20.0502)])
def test_becks_column_flutters(n: int, load: float) -> None:
    body = body_of(HELD, modes={"y": n})
    tip = body.ports["tip"]
    follower = np.outer(tip.phi[1], tip.theta[2]) - tip.second_order[0]
    found = lowest_load(lambda p: (body.K + p * follower, body.Mff), 10.0, 30.0)
    assert found == pytest.approx(load, abs=6e-5)


@pytest.mark.parametrize("frame", ["mean", "chord", "tangent"])
def test_a_free_beam_under_thrust_flutters_alike_in_every_frame(frame: str) -> None:
    body = body_of(FREE, modes={"y": 8}, basis="free-free", frame=frame, quadrature=False)
    rigid, port = [1, 5], body.ports["root"]
    rows = np.array([*rigid, *range(6, 6 + body.n)])
    mass, ends = mass_matrix(body)[np.ix_(rows, rows)], port_rows(port)[1, rows]

    def matrices(thrust: float) -> tuple[Array, Array]:
        k = np.zeros_like(mass)
        along = thrust / body.mass
        k[2:, 2:] = body.K - along * body.G[0] + thrust * port.second_order[0]
        k[1, 2:] = -along * body.C[1] + thrust * port.phi[1]
        k[:, 2:] -= thrust * np.outer(ends, port.theta[2])
        carry = mass[2:, :2] @ np.linalg.inv(mass[:2, :2])
        return k[2:, 2:] - carry @ k[:2, 2:], mass[2:, 2:] - carry @ mass[:2, 2:]

    found = lowest_load(matrices, 50.0, 150.0)
    assert 109.7 < found < 109.8
    assert found == pytest.approx(109.72176, abs=2e-5)  # the same number in all three frames


@pytest.mark.parametrize(
    ("spin", "flap", "lag"),
    [(1, 3.6816, 3.5433), (2, 4.1373, 3.6218), (3, 4.7973, 3.7435), (6, 7.3604, 4.2633),
     (12, 13.1704, 5.4278)],
)  # fmt: skip
def test_a_rotating_beam_stiffens(spin: float, flap: float, lag: float) -> None:
    """Wright et al., J. Appl. Mech. 49 (1982): flapping; lag is softer by the spin squared."""
    body = body_of(HELD, modes={"y": 10})
    k = body.K + spin**2 * body.X[0, 0]
    out = np.sqrt(scipy.linalg.eigvalsh(k, body.Mff)[0])
    within = np.sqrt(scipy.linalg.eigvalsh(k - spin**2 * body.Mff, body.Mff)[0])
    assert out == pytest.approx(flap, abs=6e-5)
    assert within == pytest.approx(lag, abs=7e-5)


@pytest.mark.parametrize("rotary", [None, [0.002, 0.004]])
@pytest.mark.parametrize("basis", ["clamped-free", "free-free", "simply-supported",
                                   "static+fixed-interface"])  # fmt: skip
def test_frames_span_the_same_motions(basis: str, rotary: list[float] | None) -> None:
    """A free beam has the same frequencies whichever frame its shapes are seen from."""
    found = []
    for frame in ("tangent", "chord", "mean", "tangent@mid"):
        if frame == "tangent@mid" and basis != "free-free":
            continue  # those have shapes of their own there
        beam: dict[str, Any] = {
            "modes": {"y": 3, "z": 2, "twist": 2, "axial": 1}, "basis": basis, "frame": frame,
            "bending_stiffness": [2.0, 1.0], "torsional_stiffness": 1.0, "axial_stiffness": 50.0,
            "ends": {"mid": 0.4}, "quadrature": False,
        }  # fmt: skip
        if rotary is not None:
            beam |= {"rotary_inertia": rotary, "polar_inertia_per_length": None}
        body = body_of(FREE, **beam)
        found.append(frequencies([body], [np.eye(3)], [], 8))
    for other in found[1:]:
        assert other == pytest.approx(found[0], rel=1e-9)


QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    ("basis", "n", "errors"),
    [
        ("clamped-free", 2, (0.19, 0.05, 0.24)),
        ("clamped-free", 4, (0.088, 0.034, 0.069)),
        ("clamped-free", 8, (0.042, 0.019, 0.030)),
        ("simply-supported", 2, (0.14, 0.09, 0.14)),
        ("simply-supported", 8, (0.037, 0.021, 0.027)),
        ("static+fixed-interface", 2, (0.003, 0.16, 0.30)),
        ("static+fixed-interface", 4, (2e-5, 3e-5, 6e-4)),
        ("auto", 2, (2e-5, 1e-3, 1e-2)),
        ("auto", 4, (5e-6, 1.5e-5, 8e-6)),
    ],
)
def test_frequencies_of_the_welded_frame_by_basis(
    basis: str, n: int, errors: tuple[float, ...]
) -> None:
    """Two welded beams, the first pinned: only a basis that carries the weld's moment converges."""
    from mstmm.runtime.flexible.flexible_bodies import modal_bodies
    from mstmm.scene import Scene

    beam = {"mass_per_length": 1.0, "bending_stiffness": 50.0, "modes": {"y": n}, "basis": basis,
            "polar_inertia_per_length": 1e-6}  # fmt: skip
    scene = Scene(
        gravity=[0, 0, 0],
        beam=[{"name": "a", "length": 0.6, **beam}, {"name": "b", "length": 0.5, **beam}],
        hinge=[
            {"name": "h", "type": "pin", "inboard": "ground", "outboard": "a"},
            {"name": "w", "type": "fixed", "inboard": "a.tip", "outboard": "b",
             "orientation": [0, 0, np.pi / 2]},
        ],
    )  # fmt: skip
    a, b = modal_bodies(scene).values()
    equations = ground_hinge_equations((0, a.ports["root"], np.eye(3)), free=(5,))
    equations += hinge_equations((0, a.ports["tip"], np.eye(3)), (1, b.ports["root"], QUARTER))
    found = frequencies([a, b], [np.eye(3), QUARTER], equations, 3)
    error = np.abs(found / np.array([62.646, 270.33, 522.88]) - 1)
    assert (error <= 1.1 * np.array(errors) + 1e-5).all()
    if basis in ("clamped-free", "simply-supported"):
        assert (error >= 0.9 * np.array(errors)).all()  # it is as slow as that


@pytest.mark.parametrize(
    ("hinge", "exact"),
    [(HELD, (3.51602, 22.0345, 61.6972)), (PIN, (15.4182, 49.9649, 104.248)),
     (FREE, (22.3733, 61.6728, 120.903))],
)  # fmt: skip
def test_auto_finds_the_textbook_frequencies(
    hinge: dict[str, Any], exact: tuple[float, ...]
) -> None:
    free = {"fixed": (), "pin": (5,), "free": range(6)}[hinge["type"]]
    body = body_of(hinge, modes={"y": 8}, quadrature=False)
    found = frequencies(
        [body], [np.eye(3)], ground_hinge_equations((0, body.ports["root"], np.eye(3)), free), 3
    )
    assert found == pytest.approx(exact, rel=2e-3)
