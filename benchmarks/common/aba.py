"""The articulated-body algorithm in CasADi, as one straight-line C function.

Written scalar by scalar in its best known form, so that SX folds every structural zero:

* body-fixed frames whose coordinate axis is the pin axis; articulated inertias as symmetric 6, full
  9 and symmetric 6 numbers, moved by axial screws (McMillan and Orin 1995), each symmetric 2 x 2
  block turned with four multiplications;
* after a pin its row and column of the inertia vanish and are never touched; after a ball three by
  three numbers are left; a free root is solved by blocks;
* velocity products by inverse dynamics at a convenient bias (`form="bias"`: only angular
  velocities, no inertia times bias products; what a ball or free hinge will solve for anyway starts
  from zero), or as the textbook prints them (`form="textbook"`: S times velocity products);
* one reciprocal per pin, one per ball; `casadi.cse` over everything.

Numbers of the scene are inputs (`baked=False`, only where they are not zero, products that depend
on them alone computed beforehand) or literals (`baked=True`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from .links import COORDINATES, Link, Tree

Vector = list[Any]
ZERO = ca.SX(0)


@dataclass
class Numbers:
    """Scene numbers as literals, or as inputs with their values."""

    baked: bool
    symbols: list[Any] = field(default_factory=list)
    values: list[float] = field(default_factory=list)

    def scalar(self, value: float) -> Any:
        if self.baked or value == 0:
            return ca.SX(float(value))
        self.values.append(float(value))
        self.symbols.append(ca.SX.sym(f"p{len(self.values)}"))
        return self.symbols[-1]

    def vector(self, values: Any) -> Vector:
        return [self.scalar(v) for v in values]

    def symmetric(self, matrix: np.ndarray) -> list[Vector]:
        upper = {(a, b): self.scalar(matrix[a, b]) for a in range(3) for b in range(a, 3)}
        return [[upper[min(a, b), max(a, b)] for b in range(3)] for a in range(3)]


def dot(a: Vector, b: Vector) -> Any:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def vector_sum(*vectors: Vector) -> Vector:
    """Sum of vectors."""
    return [sum(parts[1:], parts[0]) for parts in zip(*vectors, strict=True)]


def matrix_vector(matrix: list[Vector], vector: Vector) -> Vector:
    """Matrix times vector."""
    return [dot(row, vector) for row in matrix]


def transpose(matrix: list[Vector]) -> list[Vector]:
    """Rows as columns."""
    return [list(row) for row in zip(*matrix, strict=True)]


def skew(v: Vector) -> list[Vector]:
    """The matrix that takes the vector product from the left."""
    return [[ZERO, -v[2], v[1]], [v[2], ZERO, -v[0]], [-v[1], v[0], ZERO]]


def scale(x: Any, reciprocal: Any) -> Any:
    """x * reciprocal, which CasADi would otherwise turn into a division."""
    if x.is_zero() or x.is_constant() or reciprocal.is_constant():
        return x * reciprocal
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    result = x * reciprocal
    ca.GlobalOptions.setSimplificationOnTheFly(True)
    return result


def inverse(m: list[Vector]) -> list[Vector]:
    """Of a symmetric 3 x 3 matrix, by cofactors and one reciprocal."""
    xx = m[1][1] * m[2][2] - m[1][2] * m[1][2]
    xy = m[0][2] * m[1][2] - m[0][1] * m[2][2]
    xz = m[0][1] * m[1][2] - m[0][2] * m[1][1]
    r = 1 / (m[0][0] * xx + m[0][1] * xy + m[0][2] * xz)
    yy = scale(m[0][0] * m[2][2] - m[0][2] * m[0][2], r)
    yz = scale(m[0][1] * m[0][2] - m[0][0] * m[1][2], r)
    zz = scale(m[0][0] * m[1][1] - m[0][1] * m[0][1], r)
    xx, xy, xz = scale(xx, r), scale(xy, r), scale(xz, r)
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]


@dataclass
class Inertia:
    """Force = A a + B alpha, moment = B' a + C alpha, about one point."""

    A: list[Vector]
    B: list[Vector]
    C: list[Vector]

    def __add__(self, other: Inertia) -> Inertia:
        return Inertia(
            *([vector_sum(x, y) for x, y in zip(m, n, strict=True)]
              for m, n in ((self.A, other.A), (self.B, other.B), (self.C, other.C)))
        )  # fmt: skip

    def shift(self, r: Vector) -> Inertia:
        """About the point displaced by -r."""
        tilde = skew(r)
        shifted_B = [
            [self.B[a][b] - dot(self.A[a], [tilde[k][b] for k in range(3)]) for b in range(3)]
            for a in range(3)
        ]
        upper: dict[tuple[int, int], Any] = {}
        for a in range(3):
            for b in range(a, 3):
                reduced = dot(tilde[a], [shifted_B[k][b] for k in range(3)])
                right = dot([self.B[k][a] for k in range(3)], [tilde[k][b] for k in range(3)])
                upper[a, b] = self.C[a][b] + reduced - right
        shifted_C = [[upper[min(a, b), max(a, b)] for b in range(3)] for a in range(3)]
        return Inertia(self.A, shifted_B, shifted_C)


class FrameRotation:
    """Constant rotation, then (outboard) about a coordinate axis by an angle, or a full matrix."""

    def __init__(self, constant: np.ndarray) -> None:
        self.constant = [[ca.SX(float(x)) for x in row] for row in constant]
        self.is_identity = bool(np.array_equal(constant, np.eye(3)))

    def to_inboard(self, v: Vector) -> Vector:
        w = self.hinge_to_inboard(v)
        return w if self.is_identity else matrix_vector(self.constant, w)

    def to_outboard(self, v: Vector) -> Vector:
        return self.hinge_to_outboard(
            v if self.is_identity else matrix_vector(transpose(self.constant), v)
        )

    def inertia(self, s: Inertia) -> Inertia:
        """Seen from the inboard axes."""
        result = Inertia(self.symmetric(s.A), self.rotate_general(s.B), self.symmetric(s.C))
        if self.is_identity:
            return result
        r, transposed = self.constant, transpose(self.constant)
        return Inertia(
            *(product(product(r, m), transposed) for m in (result.A, result.B, result.C))
        )

    def hinge_to_inboard(self, v: Vector) -> Vector:
        raise NotImplementedError

    def hinge_to_outboard(self, v: Vector) -> Vector:
        raise NotImplementedError

    def symmetric(self, m: list[Vector]) -> list[Vector]:
        raise NotImplementedError

    def rotate_general(self, m: list[Vector]) -> list[Vector]:
        raise NotImplementedError


def product(m: list[Vector], n: list[Vector]) -> list[Vector]:
    """Matrix times matrix."""
    return [[dot(row, column) for column in transpose(n)] for row in m]


class PinRotation(FrameRotation):
    """About coordinate axis k."""

    def __init__(self, constant: np.ndarray, k: int, sine: Any, cosine: Any) -> None:
        super().__init__(constant)
        self.k, self.i, self.j = k, (k + 1) % 3, (k + 2) % 3
        self.c, self.s = cosine, sine

    def hinge_to_inboard(self, v: Vector) -> Vector:
        out, i, j = list(v), self.i, self.j
        out[i], out[j] = self.c * v[i] - self.s * v[j], self.s * v[i] + self.c * v[j]
        return out

    def hinge_to_outboard(self, v: Vector) -> Vector:
        out, i, j = list(v), self.i, self.j
        out[i], out[j] = self.c * v[i] + self.s * v[j], self.c * v[j] - self.s * v[i]
        return out

    def _rotate_in_plane(self, m: list[Vector], out: list[Vector]) -> None:
        """R m R' in the plane of the turn: four multiplications."""
        i, j, c, s = self.i, self.j, self.c, self.s
        x = s * (m[i][i] - m[j][j]) + c * (m[i][j] + m[j][i])
        out[i][i], out[j][j] = m[i][i] - s * x, m[j][j] + s * x
        out[i][j], out[j][i] = c * x - m[j][i], c * x - m[i][j]

    def symmetric(self, m: list[Vector]) -> list[Vector]:
        out = [list(row) for row in m]
        self._rotate_in_plane(m, out)
        plane_row = self.hinge_to_inboard(m[self.k])
        for a in (self.i, self.j):
            out[self.k][a] = out[a][self.k] = plane_row[a]
        return out

    def rotate_general(self, m: list[Vector]) -> list[Vector]:
        out = [list(row) for row in m]
        self._rotate_in_plane(m, out)
        row, column = (
            self.hinge_to_inboard(m[self.k]),
            self.hinge_to_inboard([r[self.k] for r in m]),
        )
        for a in (self.i, self.j):
            out[self.k][a], out[a][self.k] = row[a], column[a]
        return out


class QuaternionRotation(FrameRotation):
    """By a unit quaternion (w, x, y, z)."""

    def __init__(self, constant: np.ndarray, q: Vector) -> None:
        super().__init__(constant)
        w, x, y, z = q
        xx, yy, zz = x * (x + x), y * (y + y), z * (z + z)
        xy, xz, yz = x * (y + y), x * (z + z), y * (z + z)
        wx, wy, wz = w * (x + x), w * (y + y), w * (z + z)
        self.matrix = [
            [1 - (yy + zz), xy - wz, xz + wy],
            [xy + wz, 1 - (xx + zz), yz - wx],
            [xz - wy, yz + wx, 1 - (xx + yy)],
        ]

    def hinge_to_inboard(self, v: Vector) -> Vector:
        return matrix_vector(self.matrix, v)

    def hinge_to_outboard(self, v: Vector) -> Vector:
        return matrix_vector(transpose(self.matrix), v)

    def symmetric(self, m: list[Vector]) -> list[Vector]:
        """R m R', one diagonal entry by the trace."""
        if all(x.is_zero() for row in m for x in row):
            return m
        rows_product = product(self.matrix, m)
        upper = {
            (a, b): dot(rows_product[a], self.matrix[b])
            for a in range(3)
            for b in range(a, 3)
            if a + b < 4
        }
        upper[2, 2] = m[0][0] + m[1][1] + m[2][2] - upper[0, 0] - upper[1, 1]
        return [[upper[min(a, b), max(a, b)] for b in range(3)] for a in range(3)]

    def rotate_general(self, m: list[Vector]) -> list[Vector]:
        return product(product(self.matrix, m), transpose(self.matrix))


class Body:
    """Numbers, motion and intermediate results of a link."""

    def __init__(self, link: Link, numbers: Numbers) -> None:
        self.link, self.children = link, []  # type: Link, list[Body]
        about_origin = link.inertia + link.mass * (
            link.center @ link.center * np.eye(3) - np.outer(link.center, link.center)
        )
        self.mass = numbers.scalar(link.mass)
        self.first_moment = numbers.vector(link.mass * link.center)
        self.inertia = numbers.symmetric(about_origin)
        self.second_moments = numbers.symmetric(
            np.trace(about_origin) / 2 * np.eye(3) - about_origin
        )
        self.position, self.armature = numbers.vector(link.position), numbers.scalar(link.armature)

    def rigid_inertia(self) -> Inertia:
        m = [[self.mass if a == b else ZERO for b in range(3)] for a in range(3)]
        return Inertia(m, [[-x for x in row] for row in skew(self.first_moment)], self.inertia)

    def set_spin(self) -> None:
        """K = skew(alpha) + skew(omega)^2 from omega and the bias angular acceleration."""
        (x, y, z), (p, q, r) = self.omega, self.alpha
        xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
        self.spin_matrix = [
            [-(yy + zz), xy - r, xz + q],
            [xy + r, -(xx + zz), yz - p],
            [xz - q, yz + p, -(xx + yy)],
        ]

    def bias_force(self) -> tuple[Vector, Vector]:
        """Force and moment about the origin that the bias accelerations need."""
        force = vector_sum(
            [self.mass * a for a in self.a], matrix_vector(self.spin_matrix, self.first_moment)
        )
        m = product(self.spin_matrix, self.second_moments)
        gyroscopic = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
        return force, vector_sum(gyroscopic, cross(self.first_moment, self.a))


class Ground:
    """Ground at rest, accelerated against gravity."""

    def __init__(self, gravity: Vector) -> None:
        self.omega = self.alpha = self.change_alpha = self.change_a = [ZERO] * 3
        self.a = [-g for g in gravity]
        self.spin_matrix = [[ZERO] * 3] * 3


def propagate_bias(
    body: Body, inboard: Body | Ground, q: Vector, u: Vector, sine_cosine: Vector
) -> Vector:
    """Forward pass: rotation, angular velocity and bias accelerations; returns qdot."""
    link, kind = body.link, body.link.kind
    if kind == "pin":
        k = int(np.flatnonzero(link.axis)[0])
        assert link.axis[k] == 1, "pins turn about a coordinate axis"
        body.rotation, rate = PinRotation(link.orientation, k, *sine_cosine), [ZERO] * 3
        rate[k], qdot = u[0], [u[0]]
    else:
        body.rotation, rate = QuaternionRotation(link.orientation, q[-4:]), u[-3:]
        qdot = [] if kind == "ball" else body.rotation.hinge_to_inboard(u[:3])
        qdot += quaternion_rate(q[-4:], rate)
    inboard_omega = body.rotation.to_outboard(inboard.omega)
    body.omega = vector_sum(inboard_omega, rate)
    body.relative_velocity, body.gyroscopic = rate, cross(inboard_omega, rate)
    body.alpha = vector_sum(body.rotation.to_outboard(inboard.alpha), body.gyroscopic)
    if kind == "pin":
        k = int(np.flatnonzero(link.axis)[0])
        body.bias_rate = body.alpha[k]
        body.alpha[k] = ZERO
    else:
        body.alpha = [ZERO] * 3
    body.a = body.rotation.to_outboard(
        vector_sum(inboard.a, matrix_vector(inboard.spin_matrix, body.position))
    )
    if kind == "free":
        body.free_bias, body.speed, body.a = body.a, u[:3], [ZERO] * 3
    body.set_spin()
    return qdot


def quaternion_rate(q: Vector, w: Vector) -> Vector:
    """Rates of w, x, y, z from the angular velocity in outboard axes."""
    a, b, c, d = q
    x, y, z = (0.5 * v for v in w)
    return [-(b * x + c * y + d * z), a * x + c * z - d * y, a * y + d * x - b * z,
            a * z + b * y - c * x]  # fmt: skip


def eliminate_body(body: Body, tau: Vector) -> None:
    """Backward pass: inertia and force on the inboard body, about its origin."""
    s, (f, n) = body.rigid_inertia(), body.bias_force()
    for child in body.children:
        s = s + child.load_on_parent[0]
        f, n = vector_sum(f, child.load_on_parent[1]), vector_sum(n, child.load_on_parent[2])
    if body.link.kind == "free":
        solve_free(body, s, f, n, tau)
        return
    eliminate = eliminate_pin if body.link.kind == "pin" else eliminate_ball
    s, f, n = eliminate(body, s, f, n, tau)
    s, f, n = body.rotation.inertia(s), body.rotation.to_inboard(f), body.rotation.to_inboard(n)
    body.load_on_parent = s.shift(body.position), f, vector_sum(n, cross(body.position, f))


def eliminate_pin(body: Body, s: Inertia, f: Vector, n: Vector, tau: Vector) -> Any:
    """Elimination of a pin; without drive inertia row and column k vanish."""
    k = int(np.flatnonzero(body.link.axis)[0])
    cross_axes = [a for a in range(3) if a != k]
    r = 1 / (s.C[k][k] + body.armature)
    uf, un = [row[k] for row in s.B], s.C[k]
    gf, gn = [scale(x, r) for x in uf], [scale(x, r) for x in un]
    g = scale(tau[0] - n[k] + body.armature * body.bias_rate, r)
    body.gain = gf, gn, g
    A = [[s.A[a][b] - uf[min(a, b)] * gf[max(a, b)] for b in range(3)] for a in range(3)]
    B = [[s.B[a][b] - uf[a] * gn[b] if b != k else ZERO for b in range(3)] for a in range(3)]
    C = [[s.C[a][b] - un[min(a, b)] * gn[max(a, b)] if a != k and b != k else ZERO
          for b in range(3)] for a in range(3)]  # fmt: skip
    f, n = [x + y * g for x, y in zip(f, uf, strict=True)], list(n)
    for a in cross_axes:
        n[a] = n[a] + un[a] * g
    n[k] = tau[0] if body.link.armature == 0 else n[k] + un[k] * g
    if body.link.armature != 0:
        # The inertia of the rotor acts on the coordinate only: row and column k do not vanish.
        for a in range(3):
            B[a][k] = s.B[a][k] - uf[a] * gn[k]
            C[a][k] = C[k][a] = s.C[a][k] - un[a] * gn[k]
    return Inertia(A, B, C), f, n


def eliminate_ball(body: Body, s: Inertia, f: Vector, n: Vector, tau: Vector) -> Any:
    """Elimination of a ball; a 3 x 3 block remains."""
    C_inverse = inverse(s.C)
    P = product(s.B, C_inverse)
    g = matrix_vector(C_inverse, [t - x for t, x in zip(tau, n, strict=True)])
    body.gain = transpose(P), g
    A = [[s.A[a][b] - dot(P[min(a, b)], s.B[max(a, b)]) for b in range(3)] for a in range(3)]
    zero = [[ZERO] * 3] * 3
    return Inertia(A, zero, zero), vector_sum(f, matrix_vector(s.B, g)), list(tau)


def solve_free(body: Body, s: Inertia, f: Vector, n: Vector, tau: Vector) -> None:
    """Accelerations of a free root: S x = tau - e by blocks."""
    f = [t - x for t, x in zip(tau[:3], f, strict=True)]
    n = [t - x for t, x in zip(tau[3:], n, strict=True)]
    A_inverse = inverse(s.A)
    P = product(A_inverse, s.B)
    reduced = [[s.C[a][b] - dot([row[a] for row in s.B], [row[b] for row in P]) if a <= b else None
             for b in range(3)] for a in range(3)]  # fmt: skip
    reduced = [[reduced[min(a, b)][max(a, b)] for b in range(3)] for a in range(3)]
    alpha = matrix_vector(
        inverse(reduced), vector_sum(n, [-x for x in matrix_vector(transpose(P), f)])
    )
    body.solution = (
        vector_sum(matrix_vector(A_inverse, f), [-x for x in matrix_vector(P, alpha)]),
        alpha,
    )


def recover_accelerations(body: Body, inboard: Body | Ground) -> Vector:
    """Forward pass: corrections of the bias accelerations; returns udot."""
    if body.link.kind == "free":
        body.change_a, body.change_alpha = body.solution
        convective = cross(body.omega, body.speed)
        linear = [
            a - x - y for a, x, y in zip(body.change_a, body.free_bias, convective, strict=True)
        ]
        return linear + list(body.change_alpha)
    a = body.rotation.to_outboard(
        vector_sum(inboard.change_a, cross(inboard.change_alpha, body.position))
    )
    alpha = body.rotation.to_outboard(inboard.change_alpha)
    body.change_a = a
    if body.link.kind == "pin":
        k = int(np.flatnonzero(body.link.axis)[0])
        gf, gn, g = body.gain
        if body.link.armature == 0:
            gn = [ca.SX(1) if b == k else x for b, x in enumerate(gn)]
        udot = g - dot(gf, a) - dot(gn, alpha)
        body.change_alpha = [x + udot if b == k else x for b, x in enumerate(alpha)]
        return [udot - body.bias_rate]
    P, g = body.gain
    body.change_alpha = [x - y for x, y in zip(g, matrix_vector(P, a), strict=True)]
    total = vector_sum(body.rotation.to_outboard(inboard.alpha), alpha, body.gyroscopic)
    return [x - y for x, y in zip(body.change_alpha, total, strict=True)]


def articulated_body(
    tree: Tree, baked: bool = False, precomputed_sines: bool = False
) -> tuple[ca.Function, np.ndarray]:
    """f(p, q, u, tau) -> (qdot, udot), and the numbers p of this tree.

    With `precomputed_sines` the function has two more inputs: sines and cosines of the angles of
    the pins, in order.
    """
    numbers = Numbers(baked)
    ground = Ground(numbers.vector(tree.gravity))
    bodies = [Body(link, numbers) for link in tree.links]
    q, u, tau = ca.SX.sym("q", tree.nq), ca.SX.sym("u", tree.nu), ca.SX.sym("tau", tree.nu)
    slices, iq, iu = [], 0, 0
    for link in tree.links:
        nq, nu = COORDINATES[link.kind]
        slices.append((slice(iq, iq + nq), slice(iu, iu + nu)))
        iq, iu = iq + nq, iu + nu
    inboard = [bodies[link.parent] if link.parent >= 0 else ground for link in tree.links]
    components = [(ca.vertsplit(q[a]), ca.vertsplit(u[b]), ca.vertsplit(tau[b])) for a, b in slices]
    qdot, udot = [], []
    angles = [own_q[0] for link, (own_q, _, _) in zip(tree.links, components, strict=True)
              if link.kind == "pin"]  # fmt: skip
    sine_cosine_pairs = iter([(ca.sin(x), ca.cos(x)) for x in angles])
    if precomputed_sines:
        sines, cosines = ca.SX.sym("sine", len(angles)), ca.SX.sym("cosine", len(angles))
        sine_cosine_pairs = zip(ca.vertsplit(sines), ca.vertsplit(cosines), strict=True)
    for body, carrier, (own_q, own_u, _) in zip(bodies, inboard, components, strict=True):
        sine_cosine = next(sine_cosine_pairs) if body.link.kind == "pin" else ()
        qdot += propagate_bias(body, carrier, own_q, own_u, sine_cosine)
        if isinstance(carrier, Body):
            carrier.children.append(body)
    for body, (_, _, own_tau) in zip(reversed(bodies), reversed(components), strict=True):
        eliminate_body(body, own_tau)
    for body, carrier in zip(bodies, inboard, strict=True):
        udot += recover_accelerations(body, carrier)
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    outputs = ca.cse([ca.vertcat(*qdot), ca.vertcat(*udot)])
    ca.GlobalOptions.setSimplificationOnTheFly(True)
    symbols = ca.vertcat(*numbers.symbols) if numbers.symbols else ca.SX(0, 1)
    inputs, names = [symbols, q, u, tau], ["p", "q", "u", "tau"]
    if precomputed_sines:
        inputs, names = [*inputs, sines, cosines], [*names, "sines", "cosines"]
    function = ca.Function("aba", inputs, outputs, names, ["qdot", "udot"])
    return function, np.array(numbers.values)


def operations(function: ca.Function) -> dict[str, int]:
    """Number of operations of a function, by kind."""
    names = {
        ca.OP_ADD: "add", ca.OP_SUB: "add", ca.OP_NEG: "negate", ca.OP_MUL: "multiply",
        ca.OP_SQ: "multiply", ca.OP_TWICE: "add", ca.OP_DIV: "divide", ca.OP_INV: "divide",
        ca.OP_SIN: "sine or cosine", ca.OP_COS: "sine or cosine",
    }  # fmt: skip
    ignored = {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST}
    counts: dict[str, int] = {}
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        if code not in ignored:
            name = names.get(code, "other")
            counts[name] = counts.get(name, 0) + 1
    counts["flops"] = sum(counts.get(name, 0) for name in ("add", "multiply", "divide"))
    return counts
