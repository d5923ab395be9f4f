"""Static shapes, stepped beams, user-defined shapes, linearly dependent shapes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mstmm.errors import SceneError
from mstmm.runtime.flexible.beam.beam_data import Frame
from mstmm.runtime.flexible.beam.frame_conditions import modes_in_frame
from mstmm.runtime.flexible.beam.shape_functions import Piecewise
from mstmm.runtime.flexible.modal_body import ModalBody
from tests.support.flexible.vibrations import frequencies, ground_hinge_equations, hinge_equations
from tests.support.scenes.single_beam import FREE, HELD, PIN, body_of

PIECES = [(0.0, 0.3, 1.0, 1.0), (0.3, 0.8, 4.0, 0.25), (0.8, 1.1, 0.5, 2.0)]  # from, to, EI, m


def stepped_beam_keys(**more: Any) -> dict[str, Any]:
    section = [
        {"from": a, "to": b, "bending_stiffness": ei, "mass_per_length": m,
         "torsional_stiffness": ei / 2, "axial_stiffness": 9 * ei}
        for a, b, ei, m in PIECES
    ]  # fmt: skip
    bare = {"length": 1.1, "mass_per_length": None, "bending_stiffness": None}
    return bare | {"section": section} | more


def flexibility(force_at: float, at: float, *, rod: bool = False) -> float:
    """Deflection of the stepped cantilever at `at` under a unit force at `force_at`, by Mohr."""
    total = 0.0
    for start, end, ei, _ in PIECES:
        stop = max(start, min(end, force_at, at))
        nodes, weights = np.polynomial.legendre.leggauss(4)
        x, w = start + (stop - start) * (nodes + 1) / 2, weights * (stop - start) / 2
        total += float(w @ (np.ones(4) if rod else (force_at - x) * (at - x))) / ei
    return total


def deflection(body: ModalBody, force_at: str, at: str, row: int = 1) -> float:
    """Static deflection from K and the ports."""
    load, seen = (body.ports[end].phi[row] for end in (force_at, at))
    return float(seen @ np.linalg.solve(body.K, load))


def test_static_shapes_carry_end_forces_exactly() -> None:
    body = body_of(HELD, **stepped_beam_keys(modes={"y": 4}, basis="static+fixed-interface",
                                             ends={"mid": 0.55}, frame="tangent"),
                   more={"load": [{"on": "b.mid", "force": [0, 1, 0]},
                                  {"on": "b.tip", "force": [0, 1, 0]}]})  # fmt: skip
    for force_at, x in (("mid", 0.55), ("tip", 1.1)):
        for at, y in (("mid", 0.55), ("tip", 1.1)):
            exact = flexibility(x, y)
            assert deflection(body, force_at, at) == pytest.approx(exact, rel=1e-9)


def test_static_shapes_are_unit_displacements_of_their_interface() -> None:
    body = body_of(HELD, **stepped_beam_keys(modes={"y": 6}, basis="static+fixed-interface",
                                             ends={"mid": 0.55}),
                   more={"load": [{"on": "b.mid", "force": [0, 1, 0]},
                                  {"on": "b.tip", "force": [0, 1, 0]}]})  # fmt: skip
    mid, tip = body.ports["mid"], body.ports["tip"]
    seen = np.array([mid.phi[1], 1.1 * mid.theta[2], tip.phi[1], 1.1 * tip.theta[2]])
    assert seen[:, :4] == pytest.approx(np.eye(4), abs=1e-12)
    assert seen[:, 4:] == pytest.approx(np.zeros((4, 2)), abs=1e-12)


@pytest.mark.parametrize(("key", "row"), [("twist", 3), ("axial", 0)])
def test_static_twist_and_stretch_are_exact(key: str, row: int) -> None:
    more = {"polar_inertia_per_length": 0.1} if key == "twist" else {}
    body = body_of(
        HELD, **stepped_beam_keys(modes={key: 2}, basis="static+fixed-interface", **more)
    )
    factor = {"twist": 2.0, "axial": 1 / 9}[key]
    tip = body.ports["tip"]
    seen = tip.theta[0] if key == "twist" else tip.phi[0]
    found = seen @ np.linalg.solve(body.K, seen)
    assert found == pytest.approx(factor * flexibility(1.1, 1.1, rod=True), rel=1e-9)


@pytest.mark.parametrize("basis", ["clamped-free", "static+fixed-interface"])
def test_a_stepped_beam_vibrates_like_its_pieces_welded(basis: str) -> None:
    whole = body_of(HELD, **stepped_beam_keys(modes={"y": 6}, basis=basis, frame="tangent"))
    parts = [
        body_of(HELD, length=b - a, bending_stiffness=ei, mass_per_length=m, modes={"y": 6},
                basis="static+fixed-interface", polar_inertia_per_length=1e-9)
        for a, b, ei, m in PIECES
    ]  # fmt: skip
    equations = ground_hinge_equations((0, parts[0].ports["root"], np.eye(3)))
    for i in (0, 1):
        equations += hinge_equations(
            (i, parts[i].ports["tip"], np.eye(3)), (i + 1, parts[i + 1].ports["root"], np.eye(3))
        )
    reference = frequencies(parts, [np.eye(3)] * 3, equations, 3)
    root = ground_hinge_equations((0, whole.ports["root"], np.eye(3)))
    found = frequencies([whole], [np.eye(3)], root, 3)
    assert found == pytest.approx(reference, rel=2e-3 if basis.startswith("static") else 2e-5)


@pytest.mark.parametrize(
    ("basis", "key", "exact"),
    [
        ("clamped-free", "y", [1.8751041, 4.6940911, 7.8547574]),
        ("free-free", "y", [4.7300407, 7.8532046, 10.9956078]),
        ("simply-supported", "y", [np.pi, 2 * np.pi, 3 * np.pi]),
        ("clamped-free", "twist", [np.pi / 2, 3 * np.pi / 2, 5 * np.pi / 2]),
        ("free-free", "axial", [np.pi, 2 * np.pi, 3 * np.pi]),
    ],
)
def test_a_beam_in_equal_pieces_has_the_shapes_of_a_uniform_one(
    basis: str, key: str, exact: list[float]
) -> None:
    """The shapes found by elements on a beam whose pieces happen to be equal."""
    data: dict[str, Any] = {
        "torsional_stiffness": 0.3, "axial_stiffness": 1.0, "polar_inertia_per_length": 0.3,
        "modes": {key: 3}, "basis": basis,
    }  # fmt: skip
    plain = body_of(HELD, **data)
    body = body_of(HELD, section=[{"from": 0.0, "to": 0.35}, {"from": 0.35, "to": 1.0}], **data)
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(body.Mff, body.K)).real)
    power = 4 if key == "y" else 2
    assert squares ** (1 / power) == pytest.approx(exact, rel=3e-4)
    for name in ("root", "tip"):
        assert body.ports[name].phi == pytest.approx(plain.ports[name].phi, abs=5e-3)
        assert body.ports[name].theta == pytest.approx(plain.ports[name].theta, rel=5e-3, abs=5e-2)


def test_a_beam_held_inside_has_shapes_on_either_side() -> None:
    body = body_of(HELD, at="b.mid", ends={"mid": 0.4}, modes={"y": 2}, length=1.0)
    assert body.modes == ("y1", "y2", "y3", "y4")
    root, mid, tip = (body.ports[name] for name in ("root", "mid", "tip"))
    assert not mid.can_move
    assert np.abs(root.phi[1]) == pytest.approx([2, 2, 0, 0], abs=1e-12)
    assert np.abs(tip.phi[1]) == pytest.approx([0, 0, 2, 2], abs=1e-12)
    expected = np.array([1.8751041, 4.6940911]) ** 4
    assert np.diag(body.K) == pytest.approx([*expected / 0.4**3, *expected / 0.6**3], rel=1e-6)
    # Bending draws both ends towards the clamp.
    assert root.second_order[0, 0, 0] < 0 < tip.second_order[0, 2, 2]


def test_many_shapes_stay_orthonormal_and_stiff() -> None:
    body = body_of(HELD, modes={"y": 60})
    assert np.abs(body.Mff - np.eye(60)).max() < 1e-12
    beta = (np.arange(1, 61) - 0.5) * np.pi
    assert np.diag(body.K)[12:] == pytest.approx(beta[12:] ** 4, rel=1e-11)


# --- shapes of the user's -------------------------------------------------------------------------


def test_given_shapes_span_what_static_shapes_span() -> None:
    given = body_of(HELD, modes="auto", shapes={"y": ["(x/L)^2", "x^3/L^3 + (x/L)^2"]})
    static = body_of(HELD, modes={"y": 2}, basis="static+fixed-interface")
    found, expected = (
        np.sort(np.linalg.eigvals(np.linalg.solve(b.Mff, b.K)).real) for b in (given, static)
    )
    assert found == pytest.approx(expected, rel=1e-10)
    assert deflection(given, "tip", "tip") == pytest.approx(1 / 3, rel=1e-12)


def test_given_shapes_may_use_functions_and_lose_their_rigid_part() -> None:
    body = body_of(FREE, modes="auto", frame="mean",
                   shapes={"y": ["1 - cos(pi*x/(2*L))", "exp(x) - 1 - x"]})  # fmt: skip
    assert np.abs(body.C).max() < 1e-12
    assert np.abs(body.E[0, 1] - body.E[1, 0]).max() < 1e-12
    assert body.K[0, 0] == pytest.approx((np.pi / 2) ** 4 / 2, rel=1e-12)
    e = np.e
    assert body.K[1, 1] == pytest.approx((e**2 - 1) / 2, rel=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "where(x < L/3, 0, (x - L/3)^2)",
        "max(x - L/3, 0)^2",
        "(x - L/3)*(x - L/3 + abs(x - L/3))/2",
        "where(sin(x) <= sin(L/3), 0, (x - L/3)^2)",
    ],
)
def test_given_shapes_may_be_in_pieces(text: str) -> None:
    body = body_of(HELD, modes="auto", shapes={"y": [text]}, length=1.5)
    assert body.K[0, 0] == pytest.approx(4.0, rel=1e-9)  # v'' = 2 on one metre
    assert body.Mff[0, 0] == pytest.approx(1 / 5, rel=1e-9)
    assert body.ports["tip"].second_order[0, 0, 0] == pytest.approx(4 / 3, rel=1e-9)


def test_a_linearly_dependent_shape_is_left_out() -> None:
    body = body_of(HELD, modes="auto", shapes={"y": ["x^2", "x^3", "2*x^2 - x^3"]})
    assert body.modes == ("y1", "y2")
    assert any("y3 is linearly dependent" in note for note in body.notes)


def test_linearly_dependent_shapes_are_rejected() -> None:
    powers = [f"(x/L)^{k}" for k in range(2, 16)]
    with pytest.raises(SceneError, match=r'beam "b".*14 shapes along y are linearly dependent'):
        body_of(HELD, modes="auto", shapes={"y": powers})


def test_rigid_shapes_leave_nothing_in_any_frame() -> None:
    beam: dict[str, Any] = {"rotary_inertia": 0.01, "polar_inertia_per_length": None}
    shapes = body_of(HELD, **beam).shapes
    assert shapes is not None
    line = Piecewise(np.array([0.0, 1.0]), np.array([[2.0, 3.0]]))
    bent = Piecewise(np.array([0.0, 1.0]), np.array([[2.0, 3.0, 1.0]]))
    for frame in (Frame("tangent", 0.3), Frame("chord"), Frame("mean")):
        modes, notes = modes_in_frame(shapes.data, "y", [line, bent], frame)
        assert [mode.name for mode in modes] == ["y1"]
        assert notes == ["shape y1 is a rigid motion; left out"]
        with pytest.raises(SceneError, match=r'beam "b".*are rigid motions'):
            modes_in_frame(shapes.data, "y", [line], frame)


def test_a_list_must_fit_the_shapes_there_are() -> None:
    with pytest.raises(SceneError, match=r'"b".*eta: expected 4 numbers.*found 2'):
        body_of(HELD, at="b.mid", ends={"mid": 0.4}, modes={"y": 2},
                initial={"eta": [0.1, 0.2]})  # fmt: skip


def test_a_list_of_damping_ratios_must_fit_too() -> None:
    with pytest.raises(SceneError, match=r'"b": damping: expected one modal.* or 4.*found 2'):
        body_of(HELD, at="b.mid", ends={"mid": 0.4}, modes={"y": 2}, damping=[0.1, 0.2])


# --- damping, loads, points -----------------------------------------------------------------------


@pytest.mark.parametrize("basis", ["clamped-free", "static+fixed-interface"])
def test_modal_damping_gives_every_mode_its_ratio(basis: str) -> None:
    ratio = [0.01, 0.02, 0.03, 0.05]
    body = body_of(HELD, modes={"y": 2, "z": 2}, basis=basis, bending_stiffness=[3.0, 2.0],
                   damping={"ratio": ratio, "stiffness": 0.002})  # fmt: skip
    for block, zeta in ((slice(0, 2), ratio[:2]), (slice(2, 4), ratio[2:])):
        m, d, k = (a[block, block] for a in (body.Mff, body.D, body.K))
        state = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(m, k),
                                                          -np.linalg.solve(m, d)]])  # fmt: skip
        poles = np.linalg.eigvals(state)
        poles = poles[np.argsort(np.abs(poles))][::2]
        omega = np.abs(poles)
        assert -poles.real / omega == pytest.approx(zeta + 0.001 * omega, rel=1e-9)
    assert not body.D[:2, 2:].any()


def test_a_load_per_length_acts_on_the_mean_section() -> None:
    load = {"name": "wind", "on": "b", "force_per_length": [0, 2, 0], "span": [0.2, 0.9]}
    body = body_of(HELD, modes={"y": 3, "z": 1}, more={"load": [load]})
    port, shapes = body.ports["wind"], body.shapes
    assert shapes is not None
    nodes, weights = np.polynomial.legendre.leggauss(30)
    x = 0.55 + 0.35 * nodes
    values, second = shapes.values_at(x), shapes.second_order.field_at(x)
    for found, exact in (
        (port.phi, values.phi), (port.theta, values.theta), (port.second_order, second)
    ):  # fmt: skip
        assert found == pytest.approx(np.einsum("m,m...->...", weights / 2, exact), abs=1e-12)
    assert port.position == pytest.approx([0.55, 0, 0])


def test_points_carry_mass_and_moments_of_the_beam() -> None:
    body = body_of(PIN, frame="tangent", quadrature=True, modes={"y": 4, "z": 2, "twist": 1},
                   torsional_stiffness=1.0, rotary_inertia=[0.01, 0.02],
                   polar_inertia_per_length=None)  # fmt: skip
    m = np.array([p.mass for p in body.points])
    r = np.array([p.port.position for p in body.points])
    phi = np.array([p.port.phi for p in body.points])
    theta = np.array([p.port.theta for p in body.points])
    inertia = np.array([p.inertia for p in body.points])
    assert len(m) == 3 * 4 + 4
    assert m.sum() == pytest.approx(body.mass, rel=1e-13)
    assert m @ r == pytest.approx(body.first, abs=1e-13)
    assert np.einsum("p,pak->ak", m, phi) == pytest.approx(body.C, abs=1e-9)
    modal = np.einsum("p,pak,pal->kl", m, phi, phi)
    modal += np.einsum("pab,pak,pbl->kl", inertia, theta, theta)
    assert modal == pytest.approx(body.Mff, abs=1e-9)
    second = np.einsum("p,pa,pb->ab", m, r, r)
    polar = np.trace(second) * np.eye(3) - second + inertia.sum(0)
    assert polar == pytest.approx(np.trace(body.second) * np.eye(3) - body.second, abs=1e-12)
