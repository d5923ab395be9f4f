"""The sprayer of scene.toml by a second program: every node of both wings, no shapes, no sweep.

Unknowns are those of the source (Anthonis et al. 2003): eight motions of the rigid bodies, then all
free unknowns of the finite elements of both wings.  Masses sit in points and rigid bodies whose
places are differentiated twice by hand.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

HERE = Path(__file__).parent
Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

X, Y, Z = np.eye(3)
#: Axes and roots (m) of the left and the right wing in the middle of the boom.
TURNED, ROOTS = (np.diag([1.0, 1, 1]), np.diag([-1.0, -1, 1])), (0.6, -0.6)
SHIFT, TURN, LIFT, ROLL, RIGID = slice(0, 3), slice(3, 6), 6, 7, 8
#: s: damping of the wings by their stiffness; N s/m: of lift and leveller, whose arm is in m.
BETA, LIFT_DAMPING, LEVELLER_DAMPING, ARM = 1.5e-3, 2700.0, 1.3e4, 0.8


def wing() -> tuple[Array, Array, Array]:
    """Masses (N,) kg, stiffness (6 N, 6 N) and places (N, 3) m of wing.npz."""
    with np.load(HERE / "wing.npz") as data:
        size = 6 * len(data["nodes"])
        mass, stiffness = (
            sparse.csr_array(tuple(data[f"{key}_{part}"] for part in ("data", "indices", "indptr")),
                             shape=(size, size)).toarray()
            for key in ("mass", "stiffness")
        )  # fmt: skip
        return np.diag(mass)[::6].copy(), stiffness, data["nodes"]


class Whole:
    """M, C and K of all unknowns about the equilibrium, and what pushes.

    Attributes:
        M, C, K: (n, n) kg, N s/m and N/m with the rad that go with them.
        constants: the plain numbers of [constants].
    """

    def __init__(self) -> None:
        given = tomllib.loads((HERE / "scene.toml").read_text())["constants"]
        self.constants = {key: x for key, x in given.items() if isinstance(x, float)}
        c = self.constants
        self.centre = c["h"] * c["b"] / (c["b"] - c["a"])
        self.mast = np.array([-c["back"], 0, 1.2 + self.centre])
        self.masses, stiffness, self.places = wing()
        inner = np.flatnonzero(np.repeat(self.places[:, 1] > 0, 6))
        self.wing_K, self.free = stiffness[np.ix_(inner, inner)], len(inner)
        size = RIGID + 2 * self.free
        self.M, self.C, self.K = np.zeros((3, size, size))
        self.hanging = self._hanging()
        self._rigid_bodies()
        for side in (0, 1):
            self._wing(side)
        self._springs()

    def columns(self, place: Array, level: int) -> Array:
        """(3, 8) m/m, m/rad: how a point moves with the rigid motions; `place` from the pin of the
        trapezoid (level 2), from the mast (1), from the origin (0)."""
        found = np.zeros((3, RIGID))
        from_origin = place + (self.mast if level else 0)
        found[:, SHIFT] = np.eye(3)
        found[:, TURN] = np.cross(np.eye(3), from_origin).T
        found[:, LIFT] = Z if level else 0
        found[:, ROLL] = np.cross(X, place) if level == 2 else 0
        return found

    def climbing(self, place: Array, level: int) -> Array:
        """(8, 8): second derivatives of a point's height by the rigid motions."""
        found = np.zeros((RIGID, RIGID))
        from_origin = place + (self.mast if level else 0)
        for i in range(3):
            for j in range(3):
                both = [(i, j), (j, i)]
                found[3 + i, 3 + j] = sum(
                    Z @ np.cross(np.eye(3)[k], np.cross(np.eye(3)[m], from_origin)) / 2
                    for k, m in both
                )
            if level == 2:
                turned = Z @ np.cross(np.eye(3)[i], np.cross(X, place))
                found[3 + i, ROLL] = found[ROLL, 3 + i] = turned
        if level == 2:
            found[ROLL, ROLL] = Z @ np.cross(X, np.cross(X, place))
        return found

    def _mass(self, mass: float, place: Array, level: int) -> None:
        by = self.columns(place, level)
        self.M[:RIGID, :RIGID] += mass * by.T @ by
        self.K[:RIGID, :RIGID] += mass * self.constants["g"] * self.climbing(place, level)

    def _rigid_bodies(self) -> None:
        c = self.constants
        moved = c["frame"] + 2 * c["wing"] + c["carriage"]
        ahead = moved * c["back"] / c["machine"]
        self._mass(c["machine"], np.array([ahead, 0, 1.15]), 0)
        self._mass(c["carriage"], np.array([0, 0, -0.4]), 1)
        self._mass(c["frame"], np.array([0, 0, -self.centre]), 2)
        turning = np.zeros((3, RIGID))
        turning[:, TURN] = np.eye(3)
        rolling = turning.copy()
        rolling[0, ROLL] = 1.0
        carried = np.diag([5512.0, 16006.0, 17010.0])  # tractor and carriage
        self.M[:RIGID, :RIGID] += turning.T @ carried @ turning
        self.M[:RIGID, :RIGID] += rolling.T @ np.diag([40.0, 15.0, 45.0]) @ rolling

    def _hanging(self) -> Array:
        """(2, N, 3) m: nodes of both wings at rest, from the pin of the trapezoid."""
        held = len(self.places) - self.free // 6
        weight = np.zeros(self.free)
        weight[2::6] = -self.constants["g"] * self.masses[held:]
        rest = self.places.copy()
        rest[held:] += np.linalg.solve(self.wing_K, weight).reshape(-1, 6)[:, :3]
        roots = [np.array([0, y, -self.centre]) for y in ROOTS]
        return np.stack([rest @ turn + root for turn, root in zip(TURNED, roots, strict=True)])

    def _wing(self, side: int) -> None:
        turn, g = TURNED[side], self.constants["g"]
        held = len(self.places) - self.free // 6
        at = RIGID + side * self.free + np.arange(self.free)
        for k, (mass, here) in enumerate(zip(self.masses, self.hanging[side], strict=True)):
            self._mass(mass, here, 2)
            if k < held:
                continue
            own = at[6 * (k - held) + np.arange(3)]
            self.M[np.ix_(own, own)] += mass * np.eye(3)
            both = mass * self.columns(here, 2).T @ turn
            for i, axis in ((3, X), (4, Y), (5, Z), (ROLL, X)):
                self.K[i, own] += mass * g * (Z @ np.cross(axis, turn.T).T)
            self.M[:RIGID, own] += both
        self.M[at, :RIGID] = self.M[:RIGID, at].T
        self.K[at, :RIGID] = self.K[:RIGID, at].T
        self.K[np.ix_(at, at)] += self.wing_K
        self.C[np.ix_(at, at)] += BETA * self.wing_K

    def _springs(self) -> None:
        c = self.constants
        about = np.array([c["track"] ** 2, c["axle"] ** 2])
        shares = np.array([*about, about.sum()])
        for matrix, up, across in ((self.K, c["tyre"], c["side"]),
                                   (self.C, c["tyre_damping"], c["side_damping"])):  # fmt: skip
            each = [across, across, up, *(np.array([up, up, across]) * shares)]
            matrix[range(6), range(6)] += 4 * np.array(each)
        self.K[LIFT, LIFT] += c["lift"]
        self.C[LIFT, LIFT] += LIFT_DAMPING
        self.C[ROLL, ROLL] += LEVELLER_DAMPING * ARM**2
        a, b, h = c["a"], c["b"], c["h"]
        climb = a * b * ((b - a) ** 2 + h**2) / (h * (b - a) ** 2)
        self.K[ROLL, ROLL] += (c["frame"] + 2 * c["wing"]) * c["g"] * climb

    def pushes(self) -> Array:
        """(n, 4): leveller, tilt of the road and its rate, acceleration of the ground upward."""
        c, found = self.constants, np.zeros((len(self.M), 4))
        found[ROLL, 0] = -ARM
        found[3, 1] = 4 * c["track"] ** 2 * c["tyre"]
        found[3, 2] = 4 * c["track"] ** 2 * c["tyre_damping"]
        found[:, 3] = -self.M[:, 2]
        return found

    def rows(self) -> Array:
        """(3, n): height of the left tip, of the left wing's half and of the right tip."""
        found = np.zeros((3, len(self.M)))
        held = len(self.places) - self.free // 6
        for row, (side, y) in enumerate(((0, 13.2), (0, 6.0), (1, 13.2))):
            nodes = np.flatnonzero(np.isclose(self.places[:, 1], y))
            found[row, :RIGID] = self.columns(self.hanging[side, nodes].mean(axis=0), 2)[2]
            found[row, RIGID + side * self.free + 6 * (nodes - held) + 2] = 1 / len(nodes)
        return found

    def response(self, omega: Array) -> Complex:
        """(k, 3, 4) of the rows under the pushes, by a dense solution at every frequency."""
        pushes, rows = self.pushes(), self.rows()
        return np.array([
            rows @ np.linalg.solve(self.K + 1j * w * self.C - w**2 * self.M, pushes) for w in omega
        ])  # fmt: skip

    def omega(self, count: int) -> Array:
        """(count,) rad/s, slowest first, without damping."""
        inverse = linalg.eigh(self.M, self.K, eigvals_only=True)
        return np.asarray(1 / np.sqrt(inverse[::-1][:count]))
