"""A disc that rolls without slipping, against steady circles and Kane's equations.

Statements: (1) started for it the disc leans the same on a circle for ever: after ten seconds its
centre is on the circle of the closed form within 1e-8 m.  (2) Thrown over, it wobbles as Kane's
equations of SymPy have it: centre and lean over three seconds within 1e-7 m and rad.  (3) It loses
no energy within 1e-8 of it, and where it touches it rests, to 1e-8 m/s, at whatever time.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp
import sympy.physics.mechanics as me
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
RADIUS, MASS, GRAVITY = 0.3, 2.0, 9.81
LEAN, TURN = 0.4, -2.0
#: What throws it over, rad/s about the direction in which it rolls.
THROWN = 1.5
Array = NDArray[np.float64]


def kane() -> Any:
    """(lean, u1, u2, u3) -> mass matrix and forcing of the angular velocity's rates, in axes that
    lean with the disc but do not spin: x forward, y its axis."""
    q, u = me.dynamicsymbols("q:3"), me.dynamicsymbols("u:3")
    ground = me.ReferenceFrame("N")
    yaw = ground.orientnew("Y", "Axis", [q[0], ground.z])
    lean = yaw.orientnew("L", "Axis", [q[1], yaw.x])
    disc = lean.orientnew("D", "Axis", [q[2], lean.y])
    turning = disc.ang_vel_in(ground)
    spin = sum((one * axis for one, axis in zip(u, lean, strict=True)), me.Vector(0))
    disc.set_ang_vel(ground, spin)
    contact = me.Point("C")
    contact.set_vel(ground, 0)
    center = contact.locatenew("O", RADIUS * lean.z)
    center.v2pt_theory(contact, ground, disc)
    moment = MASS * RADIUS**2 / 4
    inertia = me.inertia(lean, moment, 2 * moment, moment)
    method = me.KanesMethod(ground, q, u, kd_eqs=[me.dot(turning - spin, axis) for axis in lean])
    rigid = me.RigidBody("disc", center, disc, MASS, (inertia, center))
    method.kanes_equations([rigid], [(center, -MASS * GRAVITY * ground.z)])
    plain = sp.symbols("x:4")
    known = dict(zip([q[1], *u], plain, strict=True))
    matrices = [m.xreplace(known) for m in (method.mass_matrix, method.forcing)]
    return sp.lambdify(plain, matrices, "numpy")


def rolled(times: Array, u: Array) -> Array:
    """(yaw, lean, x, y) over time, by Kane's equations."""
    equations = kane()

    def rates(_: float, state: Array) -> Array:
        yaw, lean, _, _, *u = state
        matrix, forcing = equations(lean, *u)
        forth, aside = RADIUS * u[1], -RADIUS * u[0] * np.cos(lean)
        return np.array([
            u[2] / np.cos(lean), u[0],
            forth * np.cos(yaw) - aside * np.sin(yaw), forth * np.sin(yaw) + aside * np.cos(yaw),
            *np.linalg.solve(matrix, forcing)[:, 0],
        ])  # fmt: skip

    start = np.array([0, LEAN, 0, 0, *u])
    done = solve_ivp(
        rates, times[[0, -1]], start, "DOP853", t_eval=times, rtol=1e-11, atol=1e-12
    )  # fmt: skip
    return np.asarray(done.y[:4])


def axes_of(q: Array) -> Array:
    """Rotation of the disc (times, 3, 3)."""
    w, x, y, z = q[:, 3:7].T
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]).transpose(2, 0, 1)  # fmt: skip


def touching(q: Array, u: Array) -> float:
    """Largest speed of the material point that touches."""
    turned = axes_of(q)
    up = np.array([0, 0, 1.0])
    axis = turned[:, :, 1]
    down = axis[:, 2:] * axis - up
    lever = RADIUS * down / np.linalg.norm(down, axis=1, keepdims=True)
    velocity, spin = (np.einsum("tij,tj->ti", turned, u[:, k : k + 3]) for k in (0, 3))
    return float(np.abs(velocity + np.cross(spin, lever)).max())


def main() -> None:
    """All three statements."""
    model = mstmm.compile(mstmm.load_scene(SCENE))
    assert (model.loops.rank, model.loops.mobility) == (3, 3)
    steady = model.simulate(10.0, rtol=1e-10, output_times=np.linspace(0, 10, 101))
    assert steady.success, steady.message
    spin = TURN * np.sin(LEAN) / 6 - 2 * GRAVITY * np.tan(LEAN) / (3 * RADIUS * TURN)
    yaw, circle = TURN * steady.t, spin * RADIUS / TURN
    wanted = circle * np.stack([np.sin(yaw), 1 - np.cos(yaw)], 1)
    off = np.abs(steady.q[:, :2] - wanted).max()
    print(f"circle of {abs(circle):.4f} m: off by {off:.1e} m")
    assert off < 1e-8

    q, u = model.initial_state()
    u[[1, 3]] = [-RADIUS * THROWN, THROWN]
    times = np.linspace(0, 3, 61)
    thrown = model.simulate(3.0, rtol=1e-10, initial=(q, u), output_times=times)
    assert thrown.success, thrown.message
    _, lean, x, y = rolled(times, np.array([THROWN, spin, TURN * np.cos(LEAN)]))
    apart = np.abs(thrown.q[:, :2] - np.stack([x, y], 1)).max()
    found = np.arcsin(axes_of(thrown.q)[:, 2, 1])
    print(f"leaning {lean.min():.2f} to {lean.max():.2f} rad: centre off by {apart:.1e} m, "
          f"lean by {np.abs(found - lean).max():.1e} rad")  # fmt: skip
    assert apart < 1e-7
    assert np.abs(found - lean).max() < 1e-7

    energy, slip = thrown.energy(), touching(thrown.q, thrown.u)
    print(f"energy {energy[0]:.3f} J by {np.ptp(energy):.1e} J; it touches at {slip:.1e} m/s")
    assert np.ptp(energy) < 1e-8 * energy[0]
    assert slip < 1e-8


if __name__ == "__main__":
    main()
