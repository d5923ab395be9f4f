"""Classical hinge matrices: chains by the overall transfer equation against dense Newton-Euler."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
import pytest

from mstmm.derive.classical import (
    acceleration_hinge,
    ball_hinge,
    body_planar,
    body_spatial,
    hinge_relation,
    pin_planar,
    pin_spatial,
)
from mstmm.derive.classical.catalogue import CLASSICAL
from mstmm.derive.classical.hinge_relation import VANISHING_PIVOT, HingeStatement
from mstmm.derive.definition.notation import matrix_symbols
from mstmm.ir import KernelIR
from mstmm.ir.interpreter import GuardFailure
from tests.support.classical.classical_kernels import (
    PLANAR_ROWS,
    chain_accelerations,
    kernel,
    planar_inputs,
    run,
    run_precisely,
    spatial_inputs,
)
from tests.support.classical.dense_chain import (
    Array,
    Body,
    Joint,
    accelerations,
    planar_body,
    random_body,
)
from tests.support.classical.sign_flips import Flip, flip_sign, flips, terms

SPATIAL_BODY = kernel(body_spatial.derivation())
PLANAR_BODY = kernel(body_planar.derivation())
NONE = np.zeros(3)


@cache
def hinge_kernel(name: str) -> KernelIR:
    return kernel(CLASSICAL[name]())


def unit(rng: np.random.Generator) -> Array:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def frame(rng: np.random.Generator) -> Array:
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q


def worst(found: Sequence[Array], expected: Sequence[Array]) -> float:
    scale = max(float(np.abs(e).max()) for e in expected)
    return max(float(np.abs(f - e).max()) for f, e in zip(found, expected, strict=True)) / scale


# --- chains of each kind ----------------------------------------------------------------------


def pin_chain_error(rng: np.random.Generator, count: int, hinge: KernelIR) -> float:
    """Spatial pins with skew axes, motor torques in every pin."""
    bodies = [random_body(rng) for _ in range(count)]
    axes = [unit(rng) for _ in range(count)]
    speeds, torques = rng.normal(size=count), rng.normal(size=count)
    joints, elements = [], []
    for k, (body, a) in enumerate(zip(bodies, axes, strict=True)):
        omega = bodies[k - 1].omega if k else NONE
        joints.append(
            Joint(
                np.concatenate([NONE, a])[:, None],
                np.concatenate([NONE, np.cross(omega, a) * speeds[k]]),
                NONE,
                torques[k : k + 1],
            )
        )
        outboard = run_precisely(SPATIAL_BODY, **spatial_inputs(body))
        last = k + 1 == count
        matrix = run_precisely(
            hinge, **outboard, a=a, u=speeds[k], omega_I=omega,
            a_n=a if last else axes[k + 1], tau_n=0.0 if last else torques[k + 1],
        )  # fmt: skip
        elements.append((matrix["U_h"], outboard["U"]))
    root = np.concatenate([axes[0], NONE])
    found = _solve_chain(elements, root[None, :], torques[:1])
    return worst(found, accelerations(bodies, joints))


def ball_chain_error(rng: np.random.Generator, count: int, hinge: KernelIR) -> float:
    """Balls with moments in every ball."""
    bodies = [random_body(rng) for _ in range(count)]
    torques = rng.normal(size=(count + 1, 3))
    torques[count] = 0.0
    subspace = np.vstack([np.zeros((3, 3)), np.eye(3)])
    joints = [Joint(subspace, np.zeros(6), NONE, torque) for torque in torques[:count]]
    elements = []
    for k, body in enumerate(bodies):
        outboard = run_precisely(SPATIAL_BODY, **spatial_inputs(body))
        matrix = run_precisely(hinge, **outboard, tau_n=torques[k + 1])
        elements.append((matrix["U_h"], outboard["U"]))
    found = _solve_chain(elements, np.hstack([np.eye(3), np.zeros((3, 3))]), torques[0])
    return worst(found, accelerations(bodies, joints))


def planar_chain_error(rng: np.random.Generator, count: int, hinge: KernelIR) -> float:
    """Planar pins with motor torques."""
    bodies = [planar_body(rng) for _ in range(count)]
    torques = np.append(rng.normal(size=count), 0.0)
    subspace = np.eye(6)[:, 5:]
    joints = [Joint(subspace, np.zeros(6), NONE, torques[k : k + 1]) for k in range(count)]
    elements = []
    for k, body in enumerate(bodies):
        outboard = run_precisely(PLANAR_BODY, **planar_inputs(body))
        matrix = run_precisely(hinge, **outboard, tau_n=torques[k + 1])
        elements.append((matrix["U_h"], outboard["U"]))
    found = _solve_chain(elements, np.array([[1.0, 0, 0]]), torques[:1])
    dense = [a[[0, 1, 5]] for a in accelerations(bodies, joints)]
    return worst(found, dense)


def acceleration_chain_error(
    rng: np.random.Generator, count: int, hinge: KernelIR, free: tuple[str, ...]
) -> float:
    """Acceleration hinges with offsets, bias and efforts along their free directions."""
    bodies = [random_body(rng) for _ in range(count)]
    known = acceleration_hinge.SPATIAL_DIRECTIONS
    indices = [known.index(name) for name in free]
    whole = [set(range(3)) <= set(indices), set(range(3, 6)) <= set(indices)]
    axes = [frame(rng) for _ in range(count + 1)]
    offsets = rng.normal(size=(count + 1, 3)) * 0.3
    offsets[count] = 0.0
    efforts = rng.normal(size=(count + 1, len(free)))
    efforts[count] = 0.0
    biases = rng.normal(size=(count, 6))

    def subspace(k: int) -> Array:
        full = np.zeros((6, 6))
        for part in range(2):
            block = np.eye(3) if whole[part] else axes[k]
            full[3 * part : 3 * part + 3, 3 * part : 3 * part + 3] = block
        return full[:, indices]

    joints = [Joint(subspace(k), biases[k], offsets[k], efforts[k]) for k in range(count)]
    wanted = {port.name for port in hinge.inputs}
    elements = []
    for k, body in enumerate(bodies):
        outboard = run_precisely(SPATIAL_BODY, **spatial_inputs(body))
        values = {
            "A": axes[k], "d": offsets[k], "eta_v": biases[k, :3], "eta_w": biases[k, 3:],
            "A_n": axes[k + 1], "d_n": offsets[k + 1], "tau_n": efforts[k + 1],
        }  # fmt: skip
        values = {name: value for name, value in values.items() if name in wanted}
        matrix = run_precisely(hinge, **outboard, **values)
        elements.append((matrix["U_h"], outboard["U"]))
    # Own condition of the first hinge, in terms of (m, q) before it: m_P = m - d x q, q_P = q.
    at_root = np.zeros((6, 6))
    at_root[3:, :3] = np.eye(3)
    at_root[:3, 3:] = np.eye(3)
    at_root[3:, 3:] = -np.column_stack([np.cross(offsets[0], e) for e in np.eye(3)])
    found = _solve_chain(elements, subspace(0).T @ at_root, efforts[0])
    return worst(found, accelerations(bodies, joints))


def _solve_chain(elements: list[tuple[object, object]], rows: Array, effort: Array) -> list[Array]:
    return chain_accelerations(elements, rows, [float(e) for e in effort])


Chain = Callable[[np.random.Generator, int, KernelIR], float]
CHAINS: dict[str, Chain] = {
    "pin_spatial": pin_chain_error,
    "ball": ball_chain_error,
    "pin_planar": planar_chain_error,
}


@pytest.mark.parametrize("count", [1, 2, 4, 8])
@pytest.mark.parametrize("name", sorted(CHAINS))
def test_chain_of_hinges_against_dense(name: str, count: int, rng: np.random.Generator) -> None:
    assert CHAINS[name](rng, count, hinge_kernel(name)) < 1e-11


FREE = [
    acceleration_hinge.SPATIAL_DIRECTIONS, ("x",), ("rz",), ("y", "rx"), ("x", "y", "z"),
    ("rx", "ry", "rz"), ("x", "y", "rx", "ry", "rz"),
]  # fmt: skip


@pytest.mark.parametrize("free", FREE, ids="-".join)
def test_chain_of_acceleration_hinges(free: tuple[str, ...], rng: np.random.Generator) -> None:
    hinge = kernel(acceleration_hinge.derivation(free))
    assert acceleration_chain_error(rng, 3, hinge, free) < 1e-11


@pytest.mark.parametrize("free", [("x", "y", "rz"), ("x",), ("rz",), ("y", "rz"), ("x", "y")])
def test_planar_acceleration_hinge_is_the_spatial_one(
    free: tuple[str, ...], rng: np.random.Generator
) -> None:
    """Planar data in both: the planar matrix is the sub-matrix of the spatial one."""
    body = planar_body(rng)
    angle, next_angle = rng.normal(size=2)
    axes, next_axes = _turn(angle), _turn(next_angle)
    spatial = kernel(acceleration_hinge.derivation(free))
    planar = kernel(acceleration_hinge.derivation(free, planar=True))
    flat = np.array([1.0, 1, 0])
    values = {
        "A": axes, "d": rng.normal(size=3) * flat, "eta_v": rng.normal(size=3) * flat,
        "eta_w": np.array([0, 0, rng.normal()]), "A_n": next_axes,
        "d_n": rng.normal(size=3) * flat, "tau_n": rng.normal(size=len(free)),
    }  # fmt: skip
    outboard = run(SPATIAL_BODY, **spatial_inputs(body))
    full = run(spatial, **outboard, **_kernel_inputs(spatial, values))["U_h"]
    small = {
        "A": axes[:2, :2], "d": values["d"][:2], "eta_v": values["eta_v"][:2],
        "eta_w": values["eta_w"][2], "A_n": next_axes[:2, :2], "d_n": values["d_n"][:2],
        "tau_n": values["tau_n"],
    }  # fmt: skip
    if {"x", "y"} <= set(free):  # then planar efforts refer to inertial axes, spatial ones to A_n
        small["tau_n"] = np.append(next_axes[:2, :2] @ values["tau_n"][:2], values["tau_n"][2:])
    outboard = run(PLANAR_BODY, **planar_inputs(body))
    part = run(planar, **outboard, **_kernel_inputs(planar, small))["U_h"]
    assert np.allclose(part, full[np.ix_(PLANAR_ROWS, PLANAR_ROWS)], rtol=1e-9, atol=1e-9)


def _turn(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def _kernel_inputs(hinge: KernelIR, values: dict[str, Array]) -> dict[str, Array]:
    wanted = {port.name for port in hinge.inputs}
    return {name: value for name, value in values.items() if name in wanted}


# --- closed forms of the books ----------------------------------------------------------------


def test_planar_pin_closed_form(rng: np.random.Generator) -> None:
    body = run(PLANAR_BODY, **planar_inputs(planar_body(rng)))
    tau, u = 0.7, body["U"][3]
    expected = np.eye(7)
    expected[2] = -u / u[2]
    expected[2, 2] = 0.0
    expected[2, 6] += tau / u[2]
    found = run(hinge_kernel("pin_planar"), **body, tau_n=tau)["U_h"]
    assert np.allclose(found, expected, rtol=1e-12, atol=1e-12)


def test_ball_closed_form(rng: np.random.Generator) -> None:
    body = run(SPATIAL_BODY, **spatial_inputs(random_body(rng)))
    tau, rows = rng.normal(size=3), body["U"][6:9]
    expected = np.eye(13)
    expected[3:6] = -np.linalg.solve(rows[:, 3:6], rows)
    expected[3:6, 3:6] = 0.0
    expected[3:6, 12] += np.linalg.solve(rows[:, 3:6], tau)
    found = run(hinge_kernel("ball"), **body, tau_n=tau)["U_h"]
    assert np.allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_acceleration_hinge_leaves_the_body_free(rng: np.random.Generator) -> None:
    """All six directions free and no efforts: the body falls as a free body."""
    body = random_body(rng)
    outboard = run(SPATIAL_BODY, **spatial_inputs(body))
    matrix = run(hinge_kernel("acceleration"), **outboard, d=NONE, d_n=NONE, tau_n=np.zeros(6))[
        "U_h"
    ]
    state = matrix @ np.append(rng.normal(size=6), [0.0] * 6 + [1.0])
    alpha = np.linalg.solve(body.j_c, body.m_c - np.cross(body.omega, body.j_c @ body.omega))
    spun = np.cross(alpha, body.r_ic) + np.cross(body.omega, np.cross(body.omega, body.r_ic))
    assert np.allclose(state[3:6], alpha, rtol=1e-9, atol=1e-9)
    assert np.allclose(state[:3], body.f_c / body.mass - spun, rtol=1e-9, atol=1e-9)


# --- pivots -----------------------------------------------------------------------------------


def _rod(r_io: Array, r_ic: Array, j_c: Array) -> Body:
    return Body(1.0, r_io, r_ic, j_c, NONE, NONE, NONE)


def test_percussion_centre_is_refused() -> None:
    """J_C = M r_IC . (r_IO - r_IC): the output end is the centre of percussion of the input end."""
    body = _rod(np.array([1.0, 0, 0]), np.array([0.5, 0, 0]), 0.25 * np.eye(3))
    outboard = run(PLANAR_BODY, **planar_inputs(body))
    with pytest.raises(GuardFailure) as failure:
        run(hinge_kernel("pin_planar"), **outboard, tau_n=0.0)
    assert failure.value.code in (1, VANISHING_PIVOT)


@pytest.mark.parametrize("excess", [1e-12, -1e-9])
def test_nearly_a_percussion_centre_is_refused_by_the_margin(excess: float) -> None:
    body = _rod(np.array([1.0, 0, 0]), np.array([0.5, 0, 0]), (0.25 + excess) * np.eye(3))
    outboard = run(PLANAR_BODY, **planar_inputs(body))
    with pytest.raises(GuardFailure, match="Riccati") as failure:
        run(hinge_kernel("pin_planar"), **outboard, tau_n=0.0)
    assert failure.value.code == VANISHING_PIVOT


def test_margin_is_the_relative_size_of_the_pivot() -> None:
    body = _rod(np.array([1.0, 0, 0]), np.array([0.5, 0, 0]), (0.25 + 1e-6) * np.eye(3))
    outboard = run(PLANAR_BODY, **planar_inputs(body))
    margin = run(hinge_kernel("pin_planar"), **outboard, tau_n=0.0)["margin"][0, 0]
    assert margin == pytest.approx(1e-6 / (0.25 + 0.25 + 0.5), rel=1e-5)


def test_perpendicular_pins_are_refused() -> None:
    """The usual robot arm: successive axes at right angles, matching principal axes."""
    body = _rod(np.array([1.0, 0, 0]), np.array([0.5, 0, 0]), np.diag([0.01, 0.08, 0.08]))
    outboard = run(SPATIAL_BODY, **spatial_inputs(body))
    axes = {"a": np.array([0, 0, 1.0]), "a_n": np.array([0, 1.0, 0])}
    with pytest.raises(GuardFailure):
        run(hinge_kernel("pin_spatial"), **outboard, **axes, u=1.0, omega_I=NONE, tau_n=0.0)


def test_a_zero_in_the_corner_of_the_pivot_is_no_failure() -> None:
    """The unrolled LU exchanges rows: only a singular pivot is refused."""
    j_c = np.array([[0.3, 0.1, 0.05], [0.1, 0.35, 0.02], [0.05, 0.02, 0.4]])
    r_ic, r_io = np.array([0.0, 0.5, 0.0]), np.array([0.2, 1.1, 0.1])
    body = _rod(r_io, r_ic, j_c)
    outboard = run(SPATIAL_BODY, **spatial_inputs(body))
    assert abs(outboard["U"][6, 3]) < 1e-15
    found = run(hinge_kernel("ball"), **outboard, tau_n=NONE)
    rows = outboard["U"][6:9]
    assert np.allclose(found["U_h"][3:6, :3], -np.linalg.solve(rows[:, 3:6], rows[:, :3]))


def test_margin_does_not_exceed_one(rng: np.random.Generator) -> None:
    for _ in range(20):
        outboard = run(SPATIAL_BODY, **spatial_inputs(random_body(rng)))
        margin = run(hinge_kernel("ball"), **outboard, tau_n=NONE)["margin"][0, 0]
        assert 0 < margin <= 1 + 1e-12


# --- mutations --------------------------------------------------------------------------------

STATEMENTS: dict[str, HingeStatement] = {
    "pin_spatial": pin_spatial.statement(),
    "ball": ball_hinge.statement(),
    "pin_planar": pin_planar.statement(),
    "acceleration": acceleration_hinge.statement(("y", "rx")),
}


def _mutations() -> list[tuple[str, Flip]]:
    """Flips of every term but the free acceleration's own (its sign is a choice)."""
    result = []
    for name, statement in STATEMENTS.items():
        for flip in flips(statement.premises):
            i, side, k = flip
            term = terms(getattr(statement.premises[i], side))[k]
            if statement.free not in matrix_symbols(term) and not _free_alone(statement, i):
                result.append((name, flip))
    return result


def _free_alone(statement: HingeStatement, index: int) -> bool:
    return statement.premises[index].right == statement.free


@pytest.mark.parametrize("mutation", _mutations(), ids=str)
def test_a_flipped_sign_in_a_hinge_premise_is_found(mutation: tuple[str, Flip]) -> None:
    name, flip = mutation
    statement = STATEMENTS[name]
    changed = dataclasses.replace(statement, premises=flip_sign(statement.premises, flip))
    mutated = kernel(hinge_relation.derivation(changed))
    draws = np.random.default_rng(3)
    if name == "acceleration":
        assert acceleration_chain_error(draws, 2, mutated, ("y", "rx")) > 1e-4
    else:
        assert CHAINS[name](draws, 2, mutated) > 1e-4


def test_condition_count_must_match() -> None:
    statement = STATEMENTS["ball"]
    first = dataclasses.replace(statement, conditions=pin_spatial.statement().conditions)
    with pytest.raises(ValueError, match="1 conditions for 3 free directions"):
        hinge_relation.derivation(first)


@pytest.mark.parametrize("free", [(), ("x", "x"), ("theta",)])
def test_unknown_directions_are_refused(free: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match="free directions"):
        acceleration_hinge.derivation(free)


# --- growth of rounding errors ----------------------------------------------------------------


def _rod_chain(count: int) -> list[Body]:
    """Uniform rods, 1 m, 1 kg, folded at random and turning at random."""
    draws = np.random.default_rng(11)
    bodies = []
    for _ in range(count):
        c, s = np.cos(angle := draws.uniform(-1, 1)), np.sin(angle)
        along = np.array([c, s, 0.0])
        spin = np.array([0, 0, draws.uniform(-1, 1)])
        bodies.append(
            Body(1.0, along, along / 2, np.eye(3) / 12, spin, np.array([0, -9.81, 0]), NONE)
        )
    return bodies


def _error_in_doubles(count: int) -> float:
    """Product in doubles against the product of the same kernels at 50 digits."""
    hinge = hinge_kernel("pin_planar")
    rough, exact = [], []
    for body in _rod_chain(count):
        outboard = run(PLANAR_BODY, **planar_inputs(body))
        rough.append((run(hinge, **outboard, tau_n=0.0)["U_h"], outboard["U"]))
        precise = run_precisely(PLANAR_BODY, **planar_inputs(body))
        exact.append((run_precisely(hinge, **precise, tau_n=0.0)["U_h"], precise["U"]))
    total = np.eye(7)
    for u_h, u in rough:
        total = u @ u_h @ total
    state = np.zeros(7)
    state[4:6] = np.linalg.solve(total[4:6, 4:6], -total[4:6, 6])
    state[6] = 1.0
    found = []
    for u_h, u in rough:
        found.append((u_h @ state)[:3])
        state = u @ u_h @ state
    return worst(found, _solve_chain(exact, np.array([[1.0, 0, 0]]), np.zeros(1)))


def test_rounding_errors_of_the_product_grow_geometrically() -> None:
    errors = {count: _error_in_doubles(count) for count in (2, 8, 16, 24)}
    assert errors[2] < 1e-13
    assert errors[8] < errors[16] < errors[24]
    assert errors[24] > 1e6 * errors[2]
