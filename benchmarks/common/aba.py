"""The articulated-body algorithm in CasADi, as one straight-line C function: the peer to beat.

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
    """Scene numbers as literals, or as inputs with the values that belong to them."""

    baked: bool
    symbols: list[Any] = field(default_factory=list)
    values: list[float] = field(default_factory=list)

    def of(self, value: float) -> Any:
        if self.baked or value == 0:
            return ca.SX(float(value))
        self.values.append(float(value))
        self.symbols.append(ca.SX.sym(f"p{len(self.values)}"))
        return self.symbols[-1]

    def vector(self, values: Any) -> Vector:
        return [self.of(v) for v in values]

    def symmetric(self, matrix: np.ndarray) -> list[Vector]:
        upper = {(a, b): self.of(matrix[a, b]) for a in range(3) for b in range(a, 3)}
        return [[upper[min(a, b), max(a, b)] for b in range(3)] for a in range(3)]


def dot(a: Vector, b: Vector) -> Any:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def add(*vectors: Vector) -> Vector:
    """Sum of vectors."""
    return [sum(parts[1:], parts[0]) for parts in zip(*vectors, strict=True)]


def times(matrix: list[Vector], vector: Vector) -> Vector:
    """Matrix times vector."""
    return [dot(row, vector) for row in matrix]


def transposed(matrix: list[Vector]) -> list[Vector]:
    """Rows as columns."""
    return [list(row) for row in zip(*matrix, strict=True)]


def skew(v: Vector) -> list[Vector]:
    """The matrix that takes the vector product from the left."""
    return [[ZERO, -v[2], v[1]], [v[2], ZERO, -v[0]], [-v[1], v[0], ZERO]]


def scaled(x: Any, reciprocal: Any) -> Any:
    """x * reciprocal; CasADi left to itself writes x * (1 / y) as one more division."""
    if x.is_zero() or x.is_constant() or reciprocal.is_constant():
        return x * reciprocal
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    found = x * reciprocal
    ca.GlobalOptions.setSimplificationOnTheFly(True)
    return found


def inverse(m: list[Vector]) -> list[Vector]:
    """Of a symmetric 3 x 3 matrix, by cofactors and one reciprocal."""
    xx = m[1][1] * m[2][2] - m[1][2] * m[1][2]
    xy = m[0][2] * m[1][2] - m[0][1] * m[2][2]
    xz = m[0][1] * m[1][2] - m[0][2] * m[1][1]
    r = 1 / (m[0][0] * xx + m[0][1] * xy + m[0][2] * xz)
    yy = scaled(m[0][0] * m[2][2] - m[0][2] * m[0][2], r)
    yz = scaled(m[0][1] * m[0][2] - m[0][0] * m[1][2], r)
    zz = scaled(m[0][0] * m[1][1] - m[0][1] * m[0][1], r)
    xx, xy, xz = scaled(xx, r), scaled(xy, r), scaled(xz, r)
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]


@dataclass
class Inertia:
    """Force = A a + B alpha, moment = B' a + C alpha, about one point."""

    A: list[Vector]
    B: list[Vector]
    C: list[Vector]

    def __add__(self, other: Inertia) -> Inertia:
        return Inertia(
            *([add(x, y) for x, y in zip(m, n, strict=True)]
              for m, n in ((self.A, other.A), (self.B, other.B), (self.C, other.C)))
        )  # fmt: skip

    def shifted(self, r: Vector) -> Inertia:
        """About the point that lies -r away."""
        tilde = skew(r)
        moved = [
            [self.B[a][b] - dot(self.A[a], [tilde[k][b] for k in range(3)]) for b in range(3)]
            for a in range(3)
        ]
        upper: dict[tuple[int, int], Any] = {}
        for a in range(3):
            for b in range(a, 3):
                left = dot(tilde[a], [moved[k][b] for k in range(3)])
                right = dot([self.B[k][a] for k in range(3)], [tilde[k][b] for k in range(3)])
                upper[a, b] = self.C[a][b] + left - right
        turned = [[upper[min(a, b), max(a, b)] for b in range(3)] for a in range(3)]
        return Inertia(self.A, moved, turned)


class Turn:
    """Constant rotation, then (outboard) about a coordinate axis by an angle, or a full matrix."""

    def __init__(self, constant: np.ndarray) -> None:
        self.constant = [[ca.SX(float(x)) for x in row] for row in constant]
        self.plain = bool(np.array_equal(constant, np.eye(3)))

    def inboard(self, v: Vector) -> Vector:
        w = self.own_inboard(v)
        return w if self.plain else times(self.constant, w)

    def outboard(self, v: Vector) -> Vector:
        return self.own_outboard(v if self.plain else times(transposed(self.constant), v))

    def inertia(self, s: Inertia) -> Inertia:
        """Seen from the inboard axes."""
        found = Inertia(self.symmetric(s.A), self.general(s.B), self.symmetric(s.C))
        if self.plain:
            return found
        r, back = self.constant, transposed(self.constant)
        return Inertia(*(product(product(r, m), back) for m in (found.A, found.B, found.C)))

    def own_inboard(self, v: Vector) -> Vector:
        raise NotImplementedError

    def own_outboard(self, v: Vector) -> Vector:
        raise NotImplementedError

    def symmetric(self, m: list[Vector]) -> list[Vector]:
        raise NotImplementedError

    def general(self, m: list[Vector]) -> list[Vector]:
        raise NotImplementedError


def product(m: list[Vector], n: list[Vector]) -> list[Vector]:
    """Matrix times matrix."""
    return [[dot(row, column) for column in transposed(n)] for row in m]


class PinTurn(Turn):
    """About coordinate axis k."""

    def __init__(self, constant: np.ndarray, k: int, sine: Any, cosine: Any) -> None:
        super().__init__(constant)
        self.k, self.i, self.j = k, (k + 1) % 3, (k + 2) % 3
        self.c, self.s = cosine, sine

    def own_inboard(self, v: Vector) -> Vector:
        out, i, j = list(v), self.i, self.j
        out[i], out[j] = self.c * v[i] - self.s * v[j], self.s * v[i] + self.c * v[j]
        return out

    def own_outboard(self, v: Vector) -> Vector:
        out, i, j = list(v), self.i, self.j
        out[i], out[j] = self.c * v[i] + self.s * v[j], self.c * v[j] - self.s * v[i]
        return out

    def _plane(self, m: list[Vector], out: list[Vector]) -> None:
        """R m R' in the plane of the turn: four multiplications."""
        i, j, c, s = self.i, self.j, self.c, self.s
        x = s * (m[i][i] - m[j][j]) + c * (m[i][j] + m[j][i])
        out[i][i], out[j][j] = m[i][i] - s * x, m[j][j] + s * x
        out[i][j], out[j][i] = c * x - m[j][i], c * x - m[i][j]

    def symmetric(self, m: list[Vector]) -> list[Vector]:
        out = [list(row) for row in m]
        self._plane(m, out)
        side = self.own_inboard(m[self.k])
        for a in (self.i, self.j):
            out[self.k][a] = out[a][self.k] = side[a]
        return out

    def general(self, m: list[Vector]) -> list[Vector]:
        out = [list(row) for row in m]
        self._plane(m, out)
        row, column = self.own_inboard(m[self.k]), self.own_inboard([r[self.k] for r in m])
        for a in (self.i, self.j):
            out[self.k][a], out[a][self.k] = row[a], column[a]
        return out


class FullTurn(Turn):
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

    def own_inboard(self, v: Vector) -> Vector:
        return times(self.matrix, v)

    def own_outboard(self, v: Vector) -> Vector:
        return times(transposed(self.matrix), v)

    def symmetric(self, m: list[Vector]) -> list[Vector]:
        """R m R', one diagonal entry by the trace."""
        if all(x.is_zero() for row in m for x in row):
            return m
        half = product(self.matrix, m)
        upper = {
            (a, b): dot(half[a], self.matrix[b]) for a in range(3) for b in range(a, 3) if a + b < 4
        }
        upper[2, 2] = m[0][0] + m[1][1] + m[2][2] - upper[0, 0] - upper[1, 1]
        return [[upper[min(a, b), max(a, b)] for b in range(3)] for a in range(3)]

    def general(self, m: list[Vector]) -> list[Vector]:
        return product(product(self.matrix, m), transposed(self.matrix))


class Body:
    """A link's numbers, its motion, and what the sweep leaves of it."""

    def __init__(self, link: Link, numbers: Numbers) -> None:
        self.link, self.children = link, []  # type: Link, list[Body]
        about_origin = link.inertia + link.mass * (
            link.center @ link.center * np.eye(3) - np.outer(link.center, link.center)
        )
        self.mass = numbers.of(link.mass)
        self.moment = numbers.vector(link.mass * link.center)
        self.inertia = numbers.symmetric(about_origin)
        self.second = numbers.symmetric(np.trace(about_origin) / 2 * np.eye(3) - about_origin)
        self.place, self.armature = numbers.vector(link.place), numbers.of(link.armature)

    def rigid(self) -> Inertia:
        m = [[self.mass if a == b else ZERO for b in range(3)] for a in range(3)]
        return Inertia(m, [[-x for x in row] for row in skew(self.moment)], self.inertia)

    def set_spin(self) -> None:
        """K = skew(alpha) + skew(omega)^2 from omega and the bias angular acceleration."""
        (x, y, z), (p, q, r) = self.omega, self.alpha
        xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
        self.spin = [
            [-(yy + zz), xy - r, xz + q],
            [xy + r, -(xx + zz), yz - p],
            [xz - q, yz + p, -(xx + yy)],
        ]

    def bias_force(self) -> tuple[Vector, Vector]:
        """Force and moment about the origin that the bias accelerations need."""
        force = add([self.mass * a for a in self.a], times(self.spin, self.moment))
        m = product(self.spin, self.second)
        gyro = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
        return force, add(gyro, cross(self.moment, self.a))


class Ground:
    """At rest, and accelerated against gravity."""

    def __init__(self, gravity: Vector) -> None:
        self.omega = self.alpha = self.change_alpha = self.change_a = [ZERO] * 3
        self.a = [-g for g in gravity]
        self.spin = [[ZERO] * 3] * 3


def bias(body: Body, inboard: Body | Ground, q: Vector, u: Vector, turn: Vector) -> Vector:
    """Outward: turn, angular velocity and bias accelerations; returns qdot."""
    link, kind = body.link, body.link.kind
    if kind == "pin":
        k = int(np.flatnonzero(link.axis)[0])
        assert link.axis[k] == 1, "pins turn about a coordinate axis"
        body.turn, rate = PinTurn(link.turn, k, *turn), [ZERO] * 3
        rate[k], qdot = u[0], [u[0]]
    else:
        body.turn, rate = FullTurn(link.turn, q[-4:]), u[-3:]
        qdot = [] if kind == "ball" else body.turn.own_inboard(u[:3])
        qdot += quaternion_rate(q[-4:], rate)
    carried = body.turn.outboard(inboard.omega)
    body.omega = add(carried, rate)
    body.turned, body.gyro = rate, cross(carried, rate)
    body.alpha = add(body.turn.outboard(inboard.alpha), body.gyro)
    if kind == "pin":
        k = int(np.flatnonzero(link.axis)[0])
        body.start = body.alpha[k]
        body.alpha[k] = ZERO
    else:
        body.alpha = [ZERO] * 3
    body.a = body.turn.outboard(add(inboard.a, times(inboard.spin, body.place)))
    if kind == "free":
        body.fall, body.speed, body.a = body.a, u[:3], [ZERO] * 3
    body.set_spin()
    return qdot


def quaternion_rate(q: Vector, w: Vector) -> Vector:
    """Rates of w, x, y, z from the angular velocity in outboard axes."""
    a, b, c, d = q
    x, y, z = (0.5 * v for v in w)
    return [-(b * x + c * y + d * z), a * x + c * z - d * y, a * y + d * x - b * z,
            a * z + b * y - c * x]  # fmt: skip


def condense(body: Body, tau: Vector) -> None:
    """Inward: the inertia and force that the carrier feels, about the carrier's origin."""
    s, (f, n) = body.rigid(), body.bias_force()
    for child in body.children:
        s = s + child.carried[0]
        f, n = add(f, child.carried[1]), add(n, child.carried[2])
    if body.link.kind == "free":
        solve_free(body, s, f, n, tau)
        return
    eliminated = eliminate_pin if body.link.kind == "pin" else eliminate_ball
    s, f, n = eliminated(body, s, f, n, tau)
    s, f, n = body.turn.inertia(s), body.turn.inboard(f), body.turn.inboard(n)
    body.carried = s.shifted(body.place), f, add(n, cross(body.place, f))


def eliminate_pin(body: Body, s: Inertia, f: Vector, n: Vector, tau: Vector) -> Any:
    """What a pin lets through; where no drive has inertia, row and column k vanish."""
    k = int(np.flatnonzero(body.link.axis)[0])
    others = [a for a in range(3) if a != k]
    r = 1 / (s.C[k][k] + body.armature)
    uf, un = [row[k] for row in s.B], s.C[k]
    gf, gn = [scaled(x, r) for x in uf], [scaled(x, r) for x in un]
    g = scaled(tau[0] - n[k] + body.armature * body.start, r)
    body.gain = gf, gn, g
    A = [[s.A[a][b] - uf[min(a, b)] * gf[max(a, b)] for b in range(3)] for a in range(3)]
    B = [[s.B[a][b] - uf[a] * gn[b] if b != k else ZERO for b in range(3)] for a in range(3)]
    C = [[s.C[a][b] - un[min(a, b)] * gn[max(a, b)] if a != k and b != k else ZERO
          for b in range(3)] for a in range(3)]  # fmt: skip
    f, n = [x + y * g for x, y in zip(f, uf, strict=True)], list(n)
    for a in others:
        n[a] = n[a] + un[a] * g
    n[k] = tau[0] if body.link.armature == 0 else n[k] + un[k] * g
    if body.link.armature != 0:
        # The rotor's inertia is felt at the coordinate alone: row and column k do not vanish.
        for a in range(3):
            B[a][k] = s.B[a][k] - uf[a] * gn[k]
            C[a][k] = C[k][a] = s.C[a][k] - un[a] * gn[k]
    return Inertia(A, B, C), f, n


def eliminate_ball(body: Body, s: Inertia, f: Vector, n: Vector, tau: Vector) -> Any:
    """What a ball lets through: three by three numbers."""
    inverted = inverse(s.C)
    P = product(s.B, inverted)
    g = times(inverted, [t - x for t, x in zip(tau, n, strict=True)])
    body.gain = transposed(P), g
    A = [[s.A[a][b] - dot(P[min(a, b)], s.B[max(a, b)]) for b in range(3)] for a in range(3)]
    none = [[ZERO] * 3] * 3
    return Inertia(A, none, none), add(f, times(s.B, g)), list(tau)


def solve_free(body: Body, s: Inertia, f: Vector, n: Vector, tau: Vector) -> None:
    """Accelerations of a free root: S x = tau - e by blocks."""
    f = [t - x for t, x in zip(tau[:3], f, strict=True)]
    n = [t - x for t, x in zip(tau[3:], n, strict=True)]
    inverted = inverse(s.A)
    P = product(inverted, s.B)
    left = [[s.C[a][b] - dot([row[a] for row in s.B], [row[b] for row in P]) if a <= b else None
             for b in range(3)] for a in range(3)]  # fmt: skip
    left = [[left[min(a, b)][max(a, b)] for b in range(3)] for a in range(3)]
    alpha = times(inverse(left), add(n, [-x for x in times(transposed(P), f)]))
    body.solution = add(times(inverted, f), [-x for x in times(P, alpha)]), alpha


def recover(body: Body, inboard: Body | Ground) -> Vector:
    """Outward: what is added to the bias accelerations; returns udot."""
    if body.link.kind == "free":
        body.change_a, body.change_alpha = body.solution
        spun = cross(body.omega, body.speed)
        linear = [a - x - y for a, x, y in zip(body.change_a, body.fall, spun, strict=True)]
        return linear + list(body.change_alpha)
    a = body.turn.outboard(add(inboard.change_a, cross(inboard.change_alpha, body.place)))
    alpha = body.turn.outboard(inboard.change_alpha)
    body.change_a = a
    if body.link.kind == "pin":
        k = int(np.flatnonzero(body.link.axis)[0])
        gf, gn, g = body.gain
        if body.link.armature == 0:
            gn = [ca.SX(1) if b == k else x for b, x in enumerate(gn)]
        udot = g - dot(gf, a) - dot(gn, alpha)
        body.change_alpha = [x + udot if b == k else x for b, x in enumerate(alpha)]
        return [udot - body.start]
    P, g = body.gain
    body.change_alpha = [x - y for x, y in zip(g, times(P, a), strict=True)]
    total = add(body.turn.outboard(inboard.alpha), alpha, body.gyro)
    return [x - y for x, y in zip(body.change_alpha, total, strict=True)]


def articulated_body(
    tree: Tree, baked: bool = False, ahead: bool = False
) -> tuple[ca.Function, np.ndarray]:
    """f(p, q, u, tau) -> (qdot, udot), and the numbers p of this tree.

    With `ahead` the function has two more inputs: sines and cosines of the pins' angles, in order.
    """
    numbers = Numbers(baked)
    ground = Ground(numbers.vector(tree.gravity))
    bodies = [Body(link, numbers) for link in tree.links]
    q, u, tau = ca.SX.sym("q", tree.nq), ca.SX.sym("u", tree.nu), ca.SX.sym("tau", tree.nu)
    places, at_q, at_u = [], 0, 0
    for link in tree.links:
        nq, nu = COORDINATES[link.kind]
        places.append((slice(at_q, at_q + nq), slice(at_u, at_u + nu)))
        at_q, at_u = at_q + nq, at_u + nu
    inboard = [bodies[link.parent] if link.parent >= 0 else ground for link in tree.links]
    split = [(ca.vertsplit(q[a]), ca.vertsplit(u[b]), ca.vertsplit(tau[b])) for a, b in places]
    qdot, udot = [], []
    angles = [own_q[0] for link, (own_q, _, _) in zip(tree.links, split, strict=True)
              if link.kind == "pin"]  # fmt: skip
    turns = iter([(ca.sin(x), ca.cos(x)) for x in angles])
    if ahead:
        sines, cosines = ca.SX.sym("sine", len(angles)), ca.SX.sym("cosine", len(angles))
        turns = zip(ca.vertsplit(sines), ca.vertsplit(cosines), strict=True)
    for body, carrier, (own_q, own_u, _) in zip(bodies, inboard, split, strict=True):
        turn = next(turns) if body.link.kind == "pin" else ()
        qdot += bias(body, carrier, own_q, own_u, turn)
        if isinstance(carrier, Body):
            carrier.children.append(body)
    for body, (_, _, own_tau) in zip(reversed(bodies), reversed(split), strict=True):
        condense(body, own_tau)
    for body, carrier in zip(bodies, inboard, strict=True):
        udot += recover(body, carrier)
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    outputs = ca.cse([ca.vertcat(*qdot), ca.vertcat(*udot)])
    ca.GlobalOptions.setSimplificationOnTheFly(True)
    symbols = ca.vertcat(*numbers.symbols) if numbers.symbols else ca.SX(0, 1)
    inputs, names = [symbols, q, u, tau], ["p", "q", "u", "tau"]
    if ahead:
        inputs, names = [*inputs, sines, cosines], [*names, "sines", "cosines"]
    function = ca.Function("aba", inputs, outputs, names, ["qdot", "udot"])
    return function, np.array(numbers.values)


def operations(function: ca.Function) -> dict[str, int]:
    """How many of each operation the function has."""
    names = {
        ca.OP_ADD: "add", ca.OP_SUB: "add", ca.OP_NEG: "negate", ca.OP_MUL: "multiply",
        ca.OP_SQ: "multiply", ca.OP_TWICE: "add", ca.OP_DIV: "divide", ca.OP_INV: "divide",
        ca.OP_SIN: "sine or cosine", ca.OP_COS: "sine or cosine",
    }  # fmt: skip
    silent = {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST}
    counts: dict[str, int] = {}
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        if code not in silent:
            name = names.get(code, "other")
            counts[name] = counts.get(name, 0) + 1
    counts["flops"] = sum(counts.get(name, 0) for name in ("add", "multiply", "divide"))
    return counts
