"""The tapered link against all nodes of its mesh, without any reduction.

    python examples/elastic_link/check.py

The second program below reads the same mesh with scikit-fem, assembles it, and integrates every
unknown in axes that turn with the root: Newmark's rule with 1041 unknowns.
"""

from __future__ import annotations

import warnings
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import skfem
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import eigsh, splu
from skfem.helpers import ddot, sym_grad, trace
from skfem.io.meshio import from_meshio

import mstmm

HERE = Path(__file__).parent
Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

YOUNG, POISSON, DENSITY = 7e10, 0.33, 2700.0
PAYLOAD, INERTIA, GRAVITY = 2.0, 2e-3, np.array([0.0, 0.0, -9.81])
RISE, SWING = 0.4, 1.2  # s, rad
STEP, END = 2.5e-4, 0.7


class Nodes:
    """Matrices of the mesh with the root held and the nodes of the tip rigid, payload included."""

    def __init__(self) -> None:
        with redirect_stdout(StringIO()):  # meshio prints an empty line
            read = meshio.read(HERE / "link.msh")
        mesh = from_meshio(read, ignore_orientation=True).scaled(1e-3)
        element = skfem.ElementHex2()
        vector = skfem.Basis(mesh, skfem.ElementVector(element), intorder=5)
        scalar = vector.with_element(element)
        first = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
        second = YOUNG / (2 * (1 + POISSON))

        def stress(u: Any, v: Any, w: Any) -> Any:
            a, b = sym_grad(u), sym_grad(v)
            return first * trace(a) * trace(b) + 2 * second * ddot(a, b)

        stiffness = skfem.BilinearForm(stress).assemble(vector)
        mass = skfem.BilinearForm(lambda u, v, w: DENSITY * u * v).assemble(scalar)
        self.places = scalar.doflocs.T
        self.by_node = sparse.kron(mass, sparse.eye(3)).tocsr()
        x = self.places[:, 0]
        tip, root = np.isclose(x, x.max()), np.isclose(x, 0.0)
        self.expand = self._rigid_tip(tip, root)
        self.point = np.array([x.max(), 0.0, 0.0])
        load = np.diag([PAYLOAD] * 3 + [INERTIA] * 3)
        extra = np.zeros((self.expand.shape[1],) * 2)
        extra[:6, :6] = load
        self.K = (self.expand.T @ stiffness @ self.expand).tocsc()
        self.M = (self.expand.T @ self.by_node @ self.expand + sparse.csc_matrix(extra)).tocsc()

    def _rigid_tip(self, tip: Mask, root: Mask) -> Any:
        """(3 N, 6 + inner): the tip's displacement and rotation, then the free unknowns."""
        inner = np.flatnonzero(np.repeat(~(tip | root), 3))
        columns = sparse.lil_matrix((3 * len(tip), 6 + len(inner)))
        columns[inner, 6 + np.arange(len(inner))] = 1.0
        for node in np.flatnonzero(tip):
            _, y, z = self.places[node]
            columns[3 * node : 3 * node + 3, :3] = np.eye(3)
            columns[3 * node : 3 * node + 3, 3:6] = [[0, z, -y], [-z, 0, 0], [y, 0, 0]]
        return columns.tocsr()

    def load(self, t: float, w: Array, rate: Array) -> Array:
        """Inertia of the turning axes and gravity on nodes and payload, in these axes."""
        angle, speed, change = swing(t)
        spin, turn = np.array([0, -speed, 0]), np.array([0, -change, 0])
        down = np.array([np.sin(angle) * GRAVITY[2], 0.0, np.cos(angle) * GRAVITY[2]])

        def inertial(place: Array, moved: Array, flow: Array) -> Array:
            here = place + moved
            carried = np.cross(turn, here) + np.cross(spin, np.cross(spin, here))
            return down - carried - 2 * np.cross(spin, flow)

        nodal = [(self.expand @ v).reshape(-1, 3) for v in (w, rate)]
        force = self.expand.T @ (self.by_node @ inertial(self.places, *nodal).reshape(-1))
        force[:3] += PAYLOAD * inertial(self.point, w[:3], rate[:3])
        force[3:6] -= INERTIA * (turn + np.cross(spin, rate[3:6]))
        return np.asarray(force)

    def tip(self, times: Array) -> Array:
        """(n, 3) displacement of the tip against the turning root, by Newmark's rule."""
        w = splu(self.K).solve(self.load(0.0, np.zeros(self.K.shape[0]), np.zeros(self.K.shape[0])))
        rate, second = np.zeros_like(w), np.zeros_like(w)
        solve, found, at = splu(self.M * (4 / STEP**2) + self.K), [w[:3]], [0.0]
        for k in range(1, round(END / STEP) + 1):
            t, ahead = k * STEP, w
            for _ in range(2):  # the loads hold the new displacement and rate
                flow = 2 / STEP * (ahead - w) - rate
                known = self.M @ (4 / STEP**2 * w + 4 / STEP * rate + second)
                ahead = solve.solve(self.load(t, ahead, flow) + known)
            new = 2 / STEP * (ahead - w) - rate
            second = 2 / STEP * (new - rate) - second
            w, rate = ahead, new
            found.append(w[:3])
            at.append(t)
        return np.stack([np.interp(times, at, column) for column in np.array(found).T], axis=1)


def swing(t: float) -> tuple[float, float, float]:
    """Angle of the drive with its rates."""
    if t >= RISE:
        return SWING, 0.0, 0.0
    phase, rate = 2 * np.pi * t / RISE, 2 * np.pi / RISE
    angle = SWING * (t / RISE - np.sin(phase) / (2 * np.pi))
    return angle, SWING / RISE * (1 - np.cos(phase)), SWING / RISE * rate * np.sin(phase)


def relative_tip(result: mstmm.Result) -> Array:
    """(n, 3) displacement of the tip against the turning root, its axes."""
    angle = np.array([swing(t)[0] for t in result.t])
    x, _, z = result.position("link.tip").T
    along, up = np.cos(angle) * x + np.sin(angle) * z, np.cos(angle) * z - np.sin(angle) * x
    return np.stack([along - 0.5, np.zeros_like(x), up], axis=1)


def main() -> None:
    """The statements of README.md."""
    warnings.simplefilter("error")
    scene, nodes = mstmm.load_scene(HERE / "scene.toml"), Nodes()
    times = np.linspace(0.0, END, 141)
    model = mstmm.compile(scene, engine="looped")
    body = model.flexible_bodies["link"]

    ends = [(w * h, w, h) for w, h in ((0.05, 0.016), (0.03, 0.01))]
    middle = (0.04) * (0.013)
    volume = 0.5 / 6 * (ends[0][0] + 4 * middle + ends[1][0])
    print(f"mass {body.mass:.9g} kg, of a truncated wedge {DENSITY * volume:.9g} kg")
    assert abs(body.mass / (DENSITY * volume) - 1) < 1e-12

    squares = eigsh(nodes.K, k=3, M=nodes.M, sigma=0.0, return_eigenvectors=False)
    whole = np.sqrt(np.sort(squares))
    inertia = np.array(body.Mff)
    motion = np.vstack([body.ports["tip"].phi, body.ports["tip"].theta])
    inertia += motion.T @ np.diag([PAYLOAD] * 3 + [INERTIA] * 3) @ motion
    reduced = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(inertia, body.K)).real))[:3]
    print(f"frequencies with payload {reduced.round(3)}, of all nodes {whole.round(3)} rad/s")
    assert np.abs(reduced / whole - 1).max() < 1e-5

    linear = scene.model_copy(
        update={"elastic": (scene.elastic[0].model_copy(update={"stiffening": False}),)}
    )
    reference = nodes.tip(times)
    largest = np.abs(reference).max()
    result = mstmm.compile(linear, engine="looped").simulate(END, output_times=times)
    error = np.abs(relative_tip(result) - reference).max() / largest
    print(f"{body.n} shapes against {nodes.K.shape[0]} unknowns: {error:.1e} of {largest:.4f} m")
    assert error < 1e-3

    stiffened = model.simulate(END, output_times=times)
    effect = np.abs(relative_tip(stiffened) - reference).max() / largest
    print(f"with the stiffness that its stresses bring: {effect:.1e} apart")
    assert error < effect < 2e-2


if __name__ == "__main__":
    main()
