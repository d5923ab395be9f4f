"""Small vibrations of flexible bodies by one dense eigenvalue problem, from their moments alone.

Every body keeps its six frame coordinates and its modes; hinges are equations between them, solved
by the null space.  Nothing of the sweep is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.runtime.flexible.modal_body import ModalBody
from mstmm.runtime.flexible.modal_parts import ModalPort

Array = NDArray[np.float64]


def tilde(a: Array) -> Array:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def axial(x: Array) -> Array:
    """int a x b of X = int a b^T; further axes of X stay behind."""
    return np.array([x[1, 2] - x[2, 1], x[2, 0] - x[0, 2], x[0, 1] - x[1, 0]])


def mass_matrix(body: ModalBody) -> Array:
    """(6 + n, 6 + n) of the undeformed body: frame's origin, frame's rotation, modes."""
    n = body.n
    m = np.zeros((6 + n, 6 + n))
    m[:3, :3] = body.mass * np.eye(3)
    m[:3, 3:6], m[3:6, :3] = -tilde(body.first), tilde(body.first)
    m[3:6, 3:6] = np.trace(body.second) * np.eye(3) - body.second
    m[:3, 6:], m[6:, :3] = body.C, body.C.T
    p = axial(body.E)
    m[3:6, 6:], m[6:, 3:6] = p, p.T
    m[6:, 6:] = body.Mff
    return m


def stiffness_matrix(body: ModalBody) -> Array:
    k = np.zeros((6 + body.n, 6 + body.n))
    k[6:, 6:] = body.K
    return k


def port_rows(port: ModalPort) -> Array:
    """(6, 6 + n): displacement and rotation of a port, frame axes."""
    lever = np.block([[np.eye(3), -tilde(port.position)], [np.zeros((3, 3)), np.eye(3)]])
    return np.hstack([lever, np.vstack([port.phi, port.theta])])


def frequencies(
    bodies: Sequence[ModalBody], turned: Sequence[Array], equations: Sequence[dict[int, Array]],
    count: int,
) -> Array:  # fmt: skip
    """The `count` lowest frequencies (rad/s) that are not zero.

    `turned[i]` (3, 3) takes frame axes of body i to inertial ones.  An equation is {body: rows}
    with rows (m, 6 + n) in the body's own axes; the sum over bodies is zero.
    """
    sizes = [6 + b.n for b in bodies]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    m, k = np.zeros((starts[-1],) * 2), np.zeros((starts[-1],) * 2)
    for i, body in enumerate(bodies):
        cut = slice(starts[i], starts[i + 1])
        m[cut, cut], k[cut, cut] = mass_matrix(body), stiffness_matrix(body)
    rows = []
    for equation in equations:
        height = len(next(iter(equation.values())))
        row = np.zeros((height, starts[-1]))
        for i, part in equation.items():
            row[:, starts[i] : starts[i + 1]] = part
        rows.append(row)
    total = np.vstack([np.zeros((0, starts[-1])), *rows])
    free = null_space(total) if len(total) else np.eye(starts[-1])
    return lowest(free.T @ k @ free, free.T @ m @ free, count)


def lowest(k: Array, m: Array, count: int) -> Array:
    lower = np.linalg.cholesky(m)
    reduced = np.linalg.solve(lower, np.linalg.solve(lower, k).T)
    squares = np.linalg.eigvalsh((reduced + reduced.T) / 2)
    elastic = squares[squares > 1e-7 * squares[-1] / len(squares) ** 2]
    return np.sqrt(elastic[:count])


def null_space(a: Array) -> Array:
    _, s, vt = np.linalg.svd(a)
    rank = int((s > 1e-10 * s[0]).sum())
    return vt[rank:].T


def hinge_equations(
    first: tuple[int, ModalPort, Array], second: tuple[int, ModalPort, Array], free: Any = ()
) -> list[dict[int, Array]]:
    """Equations of a hinge between two ports (body, port, turned); `free`: inertial directions
    0 to 5 (translations, rotations) that it leaves."""
    keep = [i for i in range(6) if i not in free]
    (i, a, ra), (j, b, rb) = first, second
    ga, gb = (np.kron(np.eye(2), r) @ port_rows(p) for r, p in ((ra, a), (rb, b)))
    return [{i: ga[keep], j: -gb[keep]}]


def ground_hinge_equations(
    body: tuple[int, ModalPort, Array], free: Any = ()
) -> list[dict[int, Array]]:
    """Equations of a hinge between the ground and a port."""
    i, port, turn = body
    keep = [d for d in range(6) if d not in free]
    return [{i: (np.kron(np.eye(2), turn) @ port_rows(port))[keep]}]
