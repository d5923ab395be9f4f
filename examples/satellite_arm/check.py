"""Satellite with an arm: conservation laws in space, and a turn by moving the arm alone.

Statements: (1) with motors working, linear momentum and angular momentum about the inertial
origin stay constant to round-off of the integration, the mass centre moves in a straight line,
and the kinetic energy changes by the work of the motors; the sums are written out below from
coordinates and speeds.  (2) At rest, with the arm driven in the plane once around a loop of its
two angles, the satellite ends turned by the line integral of the zero-momentum condition
(a quadrature over the loop, independent of how fast it is travelled).
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_simpson, quad

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
LOOP = "(2*pi*t^2*(3 - 2*t))"  # phase on the loop, at rest at t = 0 and t = 1
SHOULDER, ELBOW = f"1.2*sin({LOOP})", f"1.5*(1 - cos({LOOP}))"
Array = NDArray[np.float64]


def rotation(quaternion: Array) -> Array:
    """Body to inertial axes from w, x, y, z."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    v = np.array([x, y, z])
    tilde = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray((w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * tilde)


def about(axis: int, angle: float) -> Array:
    """Rotation about y (1) or z (2)."""
    quaternion = np.zeros(4)
    quaternion[0], quaternion[1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
    return rotation(quaternion)


def sums(data: dict[str, Any], q: Array, u: Array) -> tuple[Array, Array, Array, float]:
    """Linear and angular momentum about the origin, mass times mass centre, kinetic energy."""
    R, r = rotation(q[3:7]), q[:3]
    v, w = R @ u[:3], R @ u[3:6]
    P, L, S, T = np.zeros(3), np.zeros(3), np.zeros(3), 0.0
    joints = [(q[7], u[6], 2), (q[8], u[7], 1), None]
    for body, joint in zip(data["body"], joints, strict=True):
        m, c = body["mass"], R @ np.array(body["center_of_mass"])
        J, v_center = R @ np.diag(body["inertia"]) @ R.T, v + np.cross(w, c)
        P, S = P + m * v_center, S + m * (r + c)
        L = L + np.cross(r + c, m * v_center) + J @ w
        T += 0.5 * float(m * v_center @ v_center + w @ J @ w)
        if joint is not None:
            arm = R @ np.array(next(iter(body["ends"].values())), float)
            angle, speed, axis = joint
            r, v = r + arm, v + np.cross(w, arm)
            R = R @ about(axis, angle)
            w = w + R[:, axis] * speed
    return P, L, S, T


def check_momentum(data: dict[str, Any]) -> None:
    """Statement 1."""
    times = np.linspace(0.0, 10.0, 2001)
    result = mstmm.compile(mstmm.Scene(**data)).simulate(
        t_end=10.0, method="dop853", rtol=1e-11, atol=1e-12, output_times=times
    )
    assert result.success, result.message
    rows = [sums(data, q, u) for q, u in zip(result.q, result.u, strict=True)]
    P, L, S, T = (np.array(column) for column in zip(*rows, strict=True))
    straight = S - S[0] - times[:, None] * P[0]
    power = 3 * np.sin(1.5 * times) * result.u[:, 6]
    power = power + (np.cos(2 * times) - 0.5 * result.u[:, 7]) * result.u[:, 7]
    work = cumulative_simpson(power, x=times, initial=0.0)
    linear, angular = float(np.ptp(P, axis=0).max()), float(np.ptp(L, axis=0).max())
    reported = max(
        float(abs(result.momentum() - P).max()),
        float(abs(result.angular_momentum() - L).max()),
        float(abs(result.energy_components()["kinetic"] - T).max()),
        float(abs(result.work - result.work[0] - work).max()),
    )
    print(f"momentum {linear:.1e} N s, {angular:.1e} N m s of {np.linalg.norm(L[0]):.2f}")
    print(f"mass centre {abs(straight).max():.1e} kg m, work {work[-1]:.4f} J, ", end="")
    print(f"energy minus work {np.ptp(T - work):.1e} J")
    print(f"momentum, energy and work as mstmm reports them: {reported:.1e}")
    assert linear < 2e-9 and angular < 2e-9
    assert abs(straight).max() < 5e-9
    assert abs(work[-1]) > 0.1 and np.ptp(T - work) < 1e-8
    assert reported < 1e-8


def planar_momentum(data: dict[str, Any], q: Array, u: Array) -> tuple[float, float]:
    """Angular momentum about the mass centre along z, and the inertia of the locked system."""
    bodies = data["body"]
    ends = [np.array(next(iter(b["ends"].values())))[:2] for b in bodies]
    angles, speeds = np.array([0.0, q[0], q[0] + q[1]]), np.array([u[0], u[0] + u[1], sum(u)])
    r, v, rows = np.zeros(2), np.zeros(2), []
    for body, end, angle, speed in zip(bodies, ends, angles, speeds, strict=True):
        R = about(2, angle)[:2, :2]
        c, arm = R @ np.array(body["center_of_mass"][:2]), R @ end
        rows.append((body["mass"], r + c, v + speed * np.array([-c[1], c[0]]), body, speed))
        r, v = r + arm, v + speed * np.array([-arm[1], arm[0]])
    total = sum(row[0] for row in rows)
    center = sum(m * x for m, x, *_ in rows) / total
    drift = sum(m * y for m, _, y, *_ in rows) / total
    spin = inertia = 0.0
    for m, x, y, body, speed in rows:
        d, e, Jzz = x - center, y - drift, body["inertia"][2]
        spin += m * (d[0] * e[1] - d[1] * e[0]) + Jzz * speed
        inertia += m * d @ d + Jzz
    return spin, inertia


def check_turn(data: dict[str, Any]) -> None:
    """Statement 2."""

    def slope(phase: float) -> float:
        q = np.array([1.2 * np.sin(phase), 1.5 * (1 - np.cos(phase))])
        rates = np.array([1.2 * np.cos(phase), 1.5 * np.sin(phase)])
        spin, inertia = planar_momentum(data, q, np.r_[0.0, rates])
        return -spin / inertia

    for hinge, drive in zip(data["hinge"][1:], (SHOULDER, ELBOW), strict=True):
        hinge |= {"axis": [0, 0, 1], "drive": drive}
        del hinge["law"], hinge["initial"]
    data["hinge"][0]["initial"]["u"] = [0.0] * 6
    result = mstmm.compile(mstmm.Scene(**data)).simulate(
        t_end=1.0, method="dop853", rtol=1e-11, atol=1e-12
    )
    assert result.success, result.message
    w, z = result.q[-1, 3], result.q[-1, 6]
    turned, expected = 2 * np.arctan2(z, w), quad(slope, 0, 2 * np.pi, epsabs=1e-12)[0]
    print(f"turned by the loop: {turned:.9f} rad, quadrature {expected:.9f} rad")
    assert abs(expected) > 0.01
    assert abs(turned - expected) < 1e-8
    assert np.abs(result.q[-1, [2, 4, 5]]).max() < 1e-12


def main() -> None:
    """Both statements."""
    data = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    check_momentum(data)
    check_turn(data)


if __name__ == "__main__":
    main()
