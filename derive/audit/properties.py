"""Checks of kernels against the laws of mechanics, independent of their derivation.

Velocities and accelerations by differences along a motion at 60 digits, forces by energies, balance
of forces and moments, no work on closed paths.  Kernels are called by name through `Call`; the
checks do not use their derivation.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
from mpmath import mp

from .samples import Numbers, Source

#: (kernel, inputs) -> outputs, flat, at `DIGITS` digits.
Call = Callable[[str, dict[str, Any]], dict[str, list[Any]]]
Matrix = Any
Number = Any
End = tuple[Matrix, Matrix, Matrix, Matrix]  # axes, position, velocity, angular velocity

DIGITS = 60
#: Step of the differences: they err by its square, and by 1e-60 over its square.
STEP = mpmath.mpf(10) ** -15
#: Largest error of the differences, with a wide margin.
DIFFERENCES = 1e-22
#: Largest error of algebra at 60 digits.
ALGEBRA = 1e-40
#: Accelerations of a body of unit size above which its hinge's coordinates count as singular.
SINGULAR = 1e9
#: Time before and after a point where branches meet, and how far values may differ over it.
BESIDE = mpmath.mpf(10) ** -12
CONTINUOUS = 1e-6


@dataclass(frozen=True)
class Property:
    """A law of mechanics, the largest relative error found, and its limit."""

    name: str
    error: float
    limit: float

    @property
    def passed(self) -> bool:
        return self.error <= self.limit


class Worst:
    """Largest error of each property."""

    def __init__(self) -> None:
        self._found: dict[str, tuple[float, float]] = {}

    def see(self, name: str, got: Matrix, expected: Matrix, limit: float) -> None:
        got, expected = list(got), list(expected)
        scale = max([abs(x) for x in (*got, *expected)] + [mpmath.mpf(1) / 1000])
        gaps = [abs(a - b) / scale for a, b in zip(got, expected, strict=True)]
        error = float(max(gaps, default=0))
        error = error if error == error else float("inf")
        self._found[name] = (max(error, self._found.get(name, (0.0, 0.0))[0]), limit)

    def include(self, other: Worst) -> None:
        """Merge the errors of another collection."""
        for name, (error, limit) in other._found.items():
            self._found[name] = (max(error, self._found.get(name, (0.0, 0.0))[0]), limit)

    @property
    def passed(self) -> bool:
        return all(error <= limit for error, limit in self._found.values())

    def properties(self) -> tuple[Property, ...]:
        return tuple(Property(name, *found) for name, found in self._found.items())


# --- small matrices -----------------------------------------------------------------------------


def rows(values: Sequence[Any], width: int) -> Matrix:
    """Matrix of the numbers, with rows of this width."""
    return mp.matrix([list(values[i : i + width]) for i in range(0, len(values), width)])


def column(values: Sequence[Any]) -> Matrix:
    """Column of the numbers."""
    return mp.matrix(list(values))


def cross(a: Any) -> Matrix:
    """Cross-product matrix."""
    return mp.matrix([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def _axial(m: Matrix) -> Matrix:
    return mp.matrix([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]) / 2


def full(upper: Sequence[Any], n: int) -> Matrix:
    """Symmetric matrix from its upper triangle, row by row."""
    matrix, entries = mp.matrix(n, n), iter(upper)
    for i in range(n):
        for j in range(i, n):
            matrix[i, j] = matrix[j, i] = mpmath.mpf(next(entries))
    return matrix


def derivatives(path: Callable[[Number], Matrix]) -> tuple[Matrix, Matrix, Matrix]:
    """(value, rate, second derivative) at zero by central differences."""
    before, here, after = path(-STEP), path(mpmath.mpf(0)), path(STEP)
    return here, (after - before) / (2 * STEP), (after - 2 * here + before) / STEP**2


# --- hinges ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Hinge:
    """Kernels of a hinge and one of its states."""

    call: Call
    p: Numbers
    q: list[Any]
    u: list[Any]
    s: list[Any]

    def kernel(self, q: Any, u: Any) -> dict[str, list[Any]]:
        return self.call("hinge", {"p": self.p, "q": list(q), "u": list(u)})

    def coordinates(self, t: Number) -> Matrix:
        """q at time t along qdot = N(q) u, u = u_0 + s t, by one Runge-Kutta step of order four."""
        if not self.q:
            return []
        q = column(self.q)

        def rate(at: Number, q_at: Matrix) -> Matrix:
            speeds = [u + s * at for u, s in zip(self.u, self.s, strict=True)]
            return column(self.kernel(q_at, speeds)["qdot"])

        k1 = rate(mpmath.mpf(0), q)
        k2 = rate(t / 2, q + t / 2 * k1)
        k3 = rate(t / 2, q + t / 2 * k2)
        return list(q + t / 6 * (k1 + 2 * k2 + 2 * k3 + rate(t, q + t * k3)))

    def rotation(self, t: Number) -> Matrix:
        return rows(self.kernel(self.coordinates(t), self.u)["R"], 3)

    def position(self, t: Number) -> Matrix:
        return column(self.kernel(self.coordinates(t), self.u)["d"])


def hinge_properties(call: Call, generic: Call, source: Source, nu: int) -> tuple[Property, ...]:
    """A hinge's kernels against motion, balance of forces, and the generic kernels.

    `generic` calls the sweep's kernels for `nu` speeds.
    """
    worst, numbers = Worst(), random.Random(7)
    with mp.workdps(DIGITS):
        for turn in (None, "rest", "quarter turn"):
            p = source.parameter_values(len(source.parameters), numbers)
            q: list[Any] = [mpmath.mpf(v) for v in source.coordinate_values(numbers, turn)]
            u, s = some(nu, numbers), some(nu, numbers)
            drawn = numbers.getstate()

            def seen(
                at: list[Any], p: Numbers = p, u: Any = u, s: Any = s, drawn: Any = drawn
            ) -> Worst:
                one = Worst()
                numbers.setstate(drawn)
                _relative_motion(_Hinge(call, p, at, u, [0] * nu), nu, one)
                _bias_motion(_Hinge(call, p, at, u, s), nu, numbers, one)
                _specialised(call, generic, p, at, u, s, numbers, one)
                return one

            try:
                found = seen(q)
                if not found.passed:
                    found = _beside(_Hinge(call, p, q, u, [0] * nu), seen)
                worst.include(found)
            except ArithmeticError:  # a singular configuration of the coordinates
                continue
    return worst.properties()


def _beside(hinge: _Hinge, seen: Callable[[list[Any]], Worst]) -> Worst:
    """Evaluate the properties on both sides of a point where branches may meet.

    Differences across the point are wrong.  Continuous quantities are compared at the point;
    the bias may jump, and then lies between both sides.
    """
    before, after = hinge.coordinates(-BESIDE), hinge.coordinates(BESIDE)
    worst = seen(before)
    worst.include(seen(after))
    here, *sides = (hinge.kernel(q, hinge.u) for q in (hinge.q, before, after))
    for side in sides:
        got = [x for name in ("R", "d", "v", "w") for x in here[name]]
        other = [x for name in ("R", "d", "v", "w") for x in side[name]]
        worst.see("motion is continuous", got, other, CONTINUOUS)
    one, two = (side["c"] for side in sides)
    between = [
        max(min(a, b), min(max(a, b), c)) for a, b, c in zip(one, two, here["c"], strict=True)
    ]
    worst.see("bias c lies between both sides", here["c"], between, CONTINUOUS)
    return worst


def some(count: int, numbers: random.Random) -> list[Any]:
    """Random numbers in [-1, 1]."""
    return [mpmath.mpf(numbers.uniform(-1, 1)) for _ in range(count)]


def _relative_motion(hinge: _Hinge, nu: int, worst: Worst) -> None:
    found = hinge.kernel(hinge.q, hinge.u)
    if any(abs(x) > SINGULAR for x in found["qdot"]):
        raise ArithmeticError("singular coordinates")
    turn, turn_rate, turn_second = derivatives(hinge.rotation)
    _, rate, second = derivatives(hinge.position)
    worst.see("R^T R = I", turn.T * turn, mp.eye(3), ALGEBRA)
    velocity = [*(turn.T * rate), *_axial(turn.T * turn_rate)]
    worst.see("velocity by differences", [*found["v"], *found["w"]], velocity, DIFFERENCES)
    if nu:
        worst.see("H u = velocity", rows(found["H"], nu) * column(hinge.u), velocity, DIFFERENCES)
    spin_rate = _axial(turn_second * turn.T)
    bias = [*(turn.T * second), *(turn.T * spin_rate)]
    worst.see("bias c by differences", found["c"], bias, DIFFERENCES)


def _bias_motion(hinge: _Hinge, nu: int, numbers: random.Random, worst: Worst) -> None:
    """`forward` against the pose of the outboard body, differentiated in inertial axes."""
    connection = rotation(numbers)
    ro, v = column(some(3, numbers)), column(some(3, numbers))
    w, wd, a = (column(some(3, numbers)) for _ in range(3))
    second = cross(wd) + cross(w) * cross(w)

    def carrier(t: Number) -> Matrix:
        return mp.eye(3) + t * cross(w) + t**2 / 2 * second

    def point(t: Number) -> Matrix:
        lever = ro + connection * hinge.position(t)
        return t * v + t**2 / 2 * a + carrier(t) * lever

    inputs = {"Rt": list(connection), "ro": list(ro), "p": hinge.p, "q": hinge.q, "u": hinge.u}
    inputs |= {"s": hinge.s, "motion_I": [*w, *wd, *a]}
    found = hinge.call("forward", inputs)
    turn, rate, turn_second = derivatives(lambda t: carrier(t) * connection * hinge.rotation(t))
    _, _, acceleration = derivatives(point)
    back = turn.T * turn_second
    # R^T R'' = wd~ + w~ w~: its skew part is wd~.
    motion = [*_axial(turn.T * rate), *_axial(back), *(turn.T * acceleration)]
    worst.see("bias motion by differences", found["motion"], motion, DIFFERENCES)


def _specialised(
    call: Call, generic: Call, p: Any, q: Any, u: Any, s: Any, numbers: random.Random, worst: Worst
) -> None:
    """Specialised kernels equal the generic ones; both leave forces and moments in balance."""
    hinge = call("hinge", {"p": p, "q": q, "u": u})
    own: dict[str, Any] = {"p": p, "q": q}
    given = {"H": hinge["H"], "J": [0] * len(u)}
    connect = {"Rt": list(rotation(numbers)), "ro": some(3, numbers)}
    connect |= {"s": s, "motion_I": some(9, numbers)}
    relative = {name: hinge[name] for name in ("R", "d", "H", "v", "w", "c")}
    one = call("forward", {**connect, **own, "u": u})
    two = generic("forward", {**connect, **relative})
    for name in ("Rc", "r", "motion"):
        worst.see("forward: specialised = generic", one[name], two[name], ALGEBRA)
    balance = Balance.drawn(len(u), numbers)
    swept = [balance.sweep(call, own), balance.sweep(generic, given)]
    if any(abs(x) > SINGULAR for x in swept[1]["udot"]):
        raise ArithmeticError("singular coordinates")
    for name in swept[0]:
        worst.see(
            f"{_STEP_OF[name]}: specialised = generic", swept[0][name], swept[1][name], ALGEBRA
        )
    balance.see(swept[0], rows(hinge["H"], len(u)) if u else None, [0] * len(u), worst)


_STEP_OF = dict.fromkeys(("G", "g", "S_I", "e_I"), "condense")
_STEP_OF |= dict.fromkeys(("udot", "delta"), "recover")


@dataclass(frozen=True)
class Balance:
    """One body outboard of a hinge, swept and checked by d'Alembert's principle."""

    rotation: list[Any]
    shift: list[Any]
    inertia: list[Any]
    load: list[Any]
    efforts: list[Any]
    parent: list[Any]

    @classmethod
    def drawn(cls, nu: int, numbers: random.Random) -> Balance:
        half = mp.matrix([some(6, numbers) for _ in range(6)])
        full = half * half.T + mp.eye(6)
        upper = [full[i, j] for i in range(6) for j in range(i, 6)]
        return cls(
            list(rotation(numbers)), some(3, numbers), upper,
            some(6, numbers), some(nu, numbers), some(6, numbers),
        )  # fmt: skip

    def sweep(self, call: Call, extra: dict[str, Any]) -> dict[str, list[Any]]:
        """condense, then recover with a given acceleration of the parent."""
        place = {"Rc": self.rotation, "r": self.shift}
        outboard = {"floor": [0, 0], "S": self.inertia, "e": self.load, "tau": self.efforts}
        across = call("condense", {**place, **extra, **outboard})
        gains = {"G": across["G"], "g": across["g"], "delta_I": self.parent}
        return across | call("recover", {**place, **extra, **gains})

    def see(self, swept: dict[str, list[Any]], h: Matrix, rotor: list[Any], worst: Worst) -> None:
        turn, lever = rows(self.rotation, 3), cross(self.shift)
        delta, parent = column(swept["delta"]), column(self.parent)
        force = full(self.inertia, 6) * delta + column(self.load)
        if h is not None:
            felt = h.T * force + column([j * a for j, a in zip(rotor, swept["udot"], strict=True)])
            worst.see("H^T f + J udot = tau", felt, self.efforts, ALGEBRA)
        push = turn * force[:3]
        passed = [*push, *(turn * force[3:] + lever * push)]
        kept = full(swept["S_I"], 6) * parent + column(swept["e_I"])
        worst.see("load passed to the parent", kept, passed, ALGEBRA)
        carried = turn.T * (parent[:3] - lever * parent[3:])
        moved = [*carried, *(turn.T * parent[3:])]
        if h is not None:
            moved = list(column(moved) + h * column(swept["udot"]))
        worst.see("a = X a_I + H udot", swept["delta"], moved, ALGEBRA)


def sweep_properties(call: Call, nu: int) -> tuple[Property, ...]:
    """The generic sweep for random subspaces and rotor inertias."""
    worst, numbers = Worst(), random.Random(11)
    with mp.workdps(DIGITS):
        for _ in range(3):
            h, rotor = some(6 * nu, numbers), [abs(x) for x in some(nu, numbers)]
            balance = Balance.drawn(nu, numbers)
            swept = balance.sweep(call, {"H": h, "J": rotor})
            balance.see(swept, rows(h, nu) if nu else None, rotor, worst)
    return worst.properties()


# --- bodies and force elements ------------------------------------------------------------------


def body_properties(call: Call, source: Source, count: int) -> tuple[Property, ...]:
    """Power of inertia and bias load = rate of the kinetic energy; `count` parameters."""
    worst, numbers = Worst(), random.Random(13)
    with mp.workdps(DIGITS):
        for _ in range(3):
            own = source.parameter_values(len(source.parameters), numbers)
            frame = [*rotation(numbers), *some(3, numbers)] if count > len(own) else []
            _body_power(call, [*own, *frame], numbers, worst)
    return worst.properties()


def _body_power(call: Call, p: list[Any], numbers: random.Random, worst: Worst) -> None:
    v, w, a, alpha = (column(some(3, numbers)) for _ in range(4))
    inertia = full(call("inertia", {"p": p})["S"], 6)
    gyroscopic = call("bias_load", {"p": p, "motion": [*w, 0, 0, 0, 0, 0, 0]})["e"]
    load = call("bias_load", {"p": p, "motion": [*w, *alpha, *a]})["e"]
    needed = inertia * column([*a, *alpha]) + column(gyroscopic)
    worst.see("residual = S a + e", load, needed, ALGEBRA)
    v_rate = a - cross(w) * v

    def energy(t: Number) -> Matrix:
        moving = {"v": list(v + t * v_rate), "w": list(w + t * alpha)}
        return column(call("energy", {"p": p, **moving})["T"])

    power = (needed.T * column([*v, *w]))[0]
    worst.see("power of the residual = dT/dt", [power], derivatives(energy)[1], DIFFERENCES)


def force_properties(call: Call, source: Source, count: int) -> tuple[Property, ...]:
    """Power that a force element gives to its two ends = its lost power - dV/dt."""
    worst, numbers = Worst(), random.Random(17)
    with mp.workdps(DIGITS):
        for _ in range(4):
            p = source.parameter_values(count, numbers)
            _force_power(call, p, {e: _end(numbers) for e in "FT"}, numbers, worst)
    return worst.properties()


def _force_power(
    call: Call, p: Numbers, ends: dict[str, End], numbers: random.Random, worst: Worst
) -> None:
    given: dict[str, Any] = {"p": p, "t": some(1, numbers), "effort": some(1, numbers)}

    def at(t: Number) -> dict[str, list[Any]]:
        inputs = dict(given)
        for name, (axes, x, v, w) in ends.items():
            turned = axes + t * cross(w) * axes + t**2 / 2 * cross(w) * cross(w) * axes
            inputs |= {f"A_{name}": list(turned), f"x_{name}": list(x + t * v)}
            inputs |= {f"v_{name}": list(v), f"w_{name}": list(w)}
        return call("wrench", inputs)

    here = at(mpmath.mpf(0))
    _, rate, _ = derivatives(lambda t: column(at(t)["V"]))
    force, moment = column(here["F"]), column(here["M"])
    (_, x_f, v_f, w_f), (_, x_t, v_t, w_t) = ends["F"], ends["T"]
    back = -moment - cross(x_t - x_f) * force
    power = force.T * (v_t - v_f) + moment.T * w_t + back.T * w_f
    worst.see("power on both ends = P - dV/dt", power, [here["P"][0] - rate[0]], DIFFERENCES)


def _end(numbers: random.Random) -> End:
    x, v, w = (column(some(3, numbers)) for _ in range(3))
    return rotation(numbers), x, v, w


def rotation(numbers: random.Random) -> Matrix:
    """A rotation matrix, orthogonal to all digits."""
    q = column(some(4, numbers))
    return turn_of(q / mpmath.norm(q))


def turn_of(q: Any) -> Matrix:
    """Rotation matrix of a unit quaternion: I + 2 w e~ + 2 e~ e~."""
    e = cross(q[1:4])
    return mp.eye(3) + 2 * q[0] * e + 2 * e * e
