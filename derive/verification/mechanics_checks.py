"""Checks of kernels against the laws of mechanics, independent of their derivation.

Velocities and accelerations from differences along a motion at 60 digits, forces from energies,
balance of forces and moments, no work on closed paths.  Kernels are called by name through `Call`.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
from mpmath import mp

from .sample_points import InputSampler, Numbers

#: (kernel, inputs) -> outputs, flat, at `DIGITS` digits.
Call = Callable[[str, dict[str, Any]], dict[str, list[Any]]]
Matrix = Any
Number = Any
End = tuple[Matrix, Matrix, Matrix, Matrix]  # axes, position, velocity, angular velocity

DIGITS = 60
#: Step of the differences; their error is its square, plus 1e-60 over its square.
STEP = mpmath.mpf(10) ** -15
#: Limit for errors of differences, with a wide margin.
MAX_DIFFERENCE_ERROR = 1e-22
#: Limit for algebraic errors at 60 digits.
MAX_ALGEBRA_ERROR = 1e-40
#: Accelerations of a body of unit size above which its hinge's coordinates count as singular.
MAX_ACCELERATION = 1e9
#: Time before and after a point where branches meet, and the limit of a change across it.
BRANCH_DISTANCE = mpmath.mpf(10) ** -12
MAX_JUMP = 1e-6


@dataclass(frozen=True)
class Property:
    """A law of mechanics, the largest relative error found, and its limit."""

    name: str
    error: float
    limit: float

    @property
    def passed(self) -> bool:
        return self.error <= self.limit


class WorstErrors:
    """Largest error of each property."""

    def __init__(self) -> None:
        self._errors: dict[str, tuple[float, float]] = {}

    def record(self, name: str, got: Matrix, expected: Matrix, limit: float) -> None:
        got, expected = list(got), list(expected)
        scale = max([abs(x) for x in (*got, *expected)] + [mpmath.mpf(1) / 1000])
        gaps = [abs(a - b) / scale for a, b in zip(got, expected, strict=True)]
        error = float(max(gaps, default=0))
        error = error if error == error else float("inf")
        self._errors[name] = (max(error, self._errors.get(name, (0.0, 0.0))[0]), limit)

    def include(self, other: WorstErrors) -> None:
        """Merge the errors of another collection."""
        for name, (error, limit) in other._errors.items():
            self._errors[name] = (max(error, self._errors.get(name, (0.0, 0.0))[0]), limit)

    @property
    def passed(self) -> bool:
        return all(error <= limit for error, limit in self._errors.values())

    def properties(self) -> tuple[Property, ...]:
        return tuple(Property(name, *found) for name, found in self._errors.items())


# --- small matrices -----------------------------------------------------------------------------


def matrix_of_rows(values: Sequence[Any], width: int) -> Matrix:
    """Matrix of the numbers, with rows of this width."""
    return mp.matrix([list(values[i : i + width]) for i in range(0, len(values), width)])


def column_vector(values: Sequence[Any]) -> Matrix:
    """Column of the numbers."""
    return mp.matrix(list(values))


def cross_product_matrix(a: Any) -> Matrix:
    """Cross-product matrix."""
    return mp.matrix([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def _axial(m: Matrix) -> Matrix:
    return mp.matrix([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]) / 2


def symmetric_matrix(upper: Sequence[Any], n: int) -> Matrix:
    """Symmetric matrix from its upper triangle, row by row."""
    matrix, entries = mp.matrix(n, n), iter(upper)
    for i in range(n):
        for j in range(i, n):
            matrix[i, j] = matrix[j, i] = mpmath.mpf(next(entries))
    return matrix


def central_differences(path: Callable[[Number], Matrix]) -> tuple[Matrix, Matrix, Matrix]:
    """(value, rate, second derivative) at zero by central differences."""
    previous, value, following = path(-STEP), path(mpmath.mpf(0)), path(STEP)
    return value, (following - previous) / (2 * STEP), (following - 2 * value + previous) / STEP**2


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
        q = column_vector(self.q)

        def rate(at: Number, q_at: Matrix) -> Matrix:
            speeds = [u + s * at for u, s in zip(self.u, self.s, strict=True)]
            return column_vector(self.kernel(q_at, speeds)["qdot"])

        k1 = rate(mpmath.mpf(0), q)
        k2 = rate(t / 2, q + t / 2 * k1)
        k3 = rate(t / 2, q + t / 2 * k2)
        return list(q + t / 6 * (k1 + 2 * k2 + 2 * k3 + rate(t, q + t * k3)))

    def rotation(self, t: Number) -> Matrix:
        return matrix_of_rows(self.kernel(self.coordinates(t), self.u)["R"], 3)

    def position(self, t: Number) -> Matrix:
        return column_vector(self.kernel(self.coordinates(t), self.u)["d"])


def hinge_properties(
    call: Call, generic: Call, source: InputSampler, nu: int
) -> tuple[Property, ...]:
    """A hinge's kernels against motion, balance of forces, and the generic kernels.

    `generic` calls the sweep's kernels for `nu` speeds.
    """
    errors, numbers = WorstErrors(), random.Random(7)
    with mp.workdps(DIGITS):
        for turn in (None, "rest", "quarter turn"):
            p = source.parameter_values(len(source.parameters), numbers)
            q: list[Any] = [mpmath.mpf(v) for v in source.coordinate_values(numbers, turn)]
            u, s = random_numbers(nu, numbers), random_numbers(nu, numbers)
            random_state = numbers.getstate()

            def errors_at(
                at: list[Any],
                p: Numbers = p,
                u: Any = u,
                s: Any = s,
                random_state: Any = random_state,
            ) -> WorstErrors:
                state_errors = WorstErrors()
                numbers.setstate(random_state)
                _check_relative_motion(_Hinge(call, p, at, u, [0] * nu), nu, state_errors)
                _check_bias_motion(_Hinge(call, p, at, u, s), nu, numbers, state_errors)
                _check_specialised_kernels(call, generic, p, at, u, s, numbers, state_errors)
                return state_errors

            try:
                point_errors = errors_at(q)
                if not point_errors.passed:
                    point_errors = _check_near_branch(_Hinge(call, p, q, u, [0] * nu), errors_at)
                errors.include(point_errors)
            except ArithmeticError:  # a singular configuration of the coordinates
                continue
    return errors.properties()


def _check_near_branch(
    hinge: _Hinge, evaluate_errors: Callable[[list[Any]], WorstErrors]
) -> WorstErrors:
    """Evaluate the properties on both sides of a point where branches may meet.

    Differences across the point are wrong.  Continuous quantities are compared at the point;
    the bias may jump, and must then be between the values of both sides.
    """
    previous, following = hinge.coordinates(-BRANCH_DISTANCE), hinge.coordinates(BRANCH_DISTANCE)
    errors = evaluate_errors(previous)
    errors.include(evaluate_errors(following))
    outputs, *sides = (hinge.kernel(q, hinge.u) for q in (hinge.q, previous, following))
    for side in sides:
        computed = [x for name in ("R", "d", "v", "w") for x in outputs[name]]
        expected = [x for name in ("R", "d", "v", "w") for x in side[name]]
        errors.record("motion is continuous", computed, expected, MAX_JUMP)
    first_bias, second_bias = (side["c"] for side in sides)
    bounded_bias = [
        max(min(a, b), min(max(a, b), c))
        for a, b, c in zip(first_bias, second_bias, outputs["c"], strict=True)
    ]
    errors.record("bias c lies between both sides", outputs["c"], bounded_bias, MAX_JUMP)
    return errors


def random_numbers(count: int, numbers: random.Random) -> list[Any]:
    """Random numbers in [-1, 1]."""
    return [mpmath.mpf(numbers.uniform(-1, 1)) for _ in range(count)]


def _check_relative_motion(hinge: _Hinge, nu: int, worst: WorstErrors) -> None:
    outputs = hinge.kernel(hinge.q, hinge.u)
    if any(abs(x) > MAX_ACCELERATION for x in outputs["qdot"]):
        raise ArithmeticError("singular coordinates")
    turn, turn_rate, turn_second = central_differences(hinge.rotation)
    _, rate, second_derivative = central_differences(hinge.position)
    worst.record("R^T R = I", turn.T * turn, mp.eye(3), MAX_ALGEBRA_ERROR)
    velocity = [*(turn.T * rate), *_axial(turn.T * turn_rate)]
    worst.record(
        "velocity by differences", [*outputs["v"], *outputs["w"]], velocity, MAX_DIFFERENCE_ERROR
    )
    if nu:
        worst.record(
            "H u = velocity",
            matrix_of_rows(outputs["H"], nu) * column_vector(hinge.u),
            velocity,
            MAX_DIFFERENCE_ERROR,
        )
    spin_rate = _axial(turn_second * turn.T)
    bias = [*(turn.T * second_derivative), *(turn.T * spin_rate)]
    worst.record("bias c by differences", outputs["c"], bias, MAX_DIFFERENCE_ERROR)


def _check_bias_motion(hinge: _Hinge, nu: int, numbers: random.Random, worst: WorstErrors) -> None:
    """`forward` against the pose of the outboard body, differentiated in inertial axes."""
    connection = random_rotation(numbers)
    ro, v = column_vector(random_numbers(3, numbers)), column_vector(random_numbers(3, numbers))
    w, wd, a = (column_vector(random_numbers(3, numbers)) for _ in range(3))
    angular_term = cross_product_matrix(wd) + cross_product_matrix(w) * cross_product_matrix(w)

    def carrier(t: Number) -> Matrix:
        return mp.eye(3) + t * cross_product_matrix(w) + t**2 / 2 * angular_term

    def point(t: Number) -> Matrix:
        lever = ro + connection * hinge.position(t)
        return t * v + t**2 / 2 * a + carrier(t) * lever

    inputs = {"Rt": list(connection), "ro": list(ro), "p": hinge.p, "q": hinge.q, "u": hinge.u}
    inputs |= {"s": hinge.s, "motion_I": [*w, *wd, *a]}
    outputs = hinge.call("forward", inputs)
    turn, rate, turn_second = central_differences(
        lambda t: carrier(t) * connection * hinge.rotation(t)
    )
    _, _, acceleration = central_differences(point)
    back = turn.T * turn_second
    # R^T R'' = wd~ + w~ w~: its skew part is wd~.
    motion = [*_axial(turn.T * rate), *_axial(back), *(turn.T * acceleration)]
    worst.record("bias motion by differences", outputs["motion"], motion, MAX_DIFFERENCE_ERROR)


def _check_specialised_kernels(
    call: Call,
    generic: Call,
    p: Any,
    q: Any,
    u: Any,
    s: Any,
    numbers: random.Random,
    worst: WorstErrors,
) -> None:
    """Specialised kernels equal the generic ones; both leave forces and moments in balance."""
    hinge = call("hinge", {"p": p, "q": q, "u": u})
    parameters: dict[str, Any] = {"p": p, "q": q}
    subspace = {"H": hinge["H"], "J": [0] * len(u)}
    inputs = {"Rt": list(random_rotation(numbers)), "ro": random_numbers(3, numbers)}
    inputs |= {"s": s, "motion_I": random_numbers(9, numbers)}
    relative = {name: hinge[name] for name in ("R", "d", "H", "v", "w", "c")}
    specialised = call("forward", {**inputs, **parameters, "u": u})
    generic_outputs = generic("forward", {**inputs, **relative})
    for name in ("Rc", "r", "motion"):
        worst.record(
            "forward: specialised = generic",
            specialised[name],
            generic_outputs[name],
            MAX_ALGEBRA_ERROR,
        )
    balance = Balance.from_random_numbers(len(u), numbers)
    results = [balance.sweep(call, parameters), balance.sweep(generic, subspace)]
    if any(abs(x) > MAX_ACCELERATION for x in results[1]["udot"]):
        raise ArithmeticError("singular coordinates")
    for name in results[0]:
        worst.record(
            f"{_KERNEL_OF_OUTPUT[name]}: specialised = generic",
            results[0][name],
            results[1][name],
            MAX_ALGEBRA_ERROR,
        )
    balance.check_balance(
        results[0], matrix_of_rows(hinge["H"], len(u)) if u else None, [0] * len(u), worst
    )


_KERNEL_OF_OUTPUT = dict.fromkeys(("G", "g", "S_I", "e_I"), "condense")
_KERNEL_OF_OUTPUT |= dict.fromkeys(("udot", "delta"), "recover")


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
    def from_random_numbers(cls, nu: int, numbers: random.Random) -> Balance:
        factor = mp.matrix([random_numbers(6, numbers) for _ in range(6)])
        full = factor * factor.T + mp.eye(6)
        upper = [full[i, j] for i in range(6) for j in range(i, 6)]
        return cls(
            list(random_rotation(numbers)), random_numbers(3, numbers), upper,
            random_numbers(6, numbers), random_numbers(nu, numbers), random_numbers(6, numbers),
        )  # fmt: skip

    def sweep(self, call: Call, extra: dict[str, Any]) -> dict[str, list[Any]]:
        """condense, then recover with a given acceleration of the parent."""
        connection = {"Rc": self.rotation, "r": self.shift}
        outboard = {"floor": [0, 0], "S": self.inertia, "e": self.load, "tau": self.efforts}
        condensed = call("condense", {**connection, **extra, **outboard})
        gains = {"G": condensed["G"], "g": condensed["g"], "delta_I": self.parent}
        return condensed | call("recover", {**connection, **extra, **gains})

    def check_balance(
        self, swept: dict[str, list[Any]], h: Matrix, rotor: list[Any], worst: WorstErrors
    ) -> None:
        turn, lever = matrix_of_rows(self.rotation, 3), cross_product_matrix(self.shift)
        delta, parent = column_vector(swept["delta"]), column_vector(self.parent)
        force = symmetric_matrix(self.inertia, 6) * delta + column_vector(self.load)
        if h is not None:
            generalised_load = h.T * force + column_vector(
                [j * a for j, a in zip(rotor, swept["udot"], strict=True)]
            )
            worst.record("H^T f + J udot = tau", generalised_load, self.efforts, MAX_ALGEBRA_ERROR)
        push = turn * force[:3]
        expected_load = [*push, *(turn * force[3:] + lever * push)]
        parent_load = symmetric_matrix(swept["S_I"], 6) * parent + column_vector(swept["e_I"])
        worst.record("load passed to the parent", parent_load, expected_load, MAX_ALGEBRA_ERROR)
        translation = turn.T * (parent[:3] - lever * parent[3:])
        expected_motion = [*translation, *(turn.T * parent[3:])]
        if h is not None:
            expected_motion = list(
                column_vector(expected_motion) + h * column_vector(swept["udot"])
            )
        worst.record("a = X a_I + H udot", swept["delta"], expected_motion, MAX_ALGEBRA_ERROR)


def sweep_properties(call: Call, nu: int) -> tuple[Property, ...]:
    """The generic sweep for random subspaces and rotor inertias."""
    errors, numbers = WorstErrors(), random.Random(11)
    with mp.workdps(DIGITS):
        for _ in range(3):
            h, rotor = (
                random_numbers(6 * nu, numbers),
                [abs(x) for x in random_numbers(nu, numbers)],
            )
            balance = Balance.from_random_numbers(nu, numbers)
            swept = balance.sweep(call, {"H": h, "J": rotor})
            balance.check_balance(swept, matrix_of_rows(h, nu) if nu else None, rotor, errors)
    return errors.properties()


# --- bodies and force elements ------------------------------------------------------------------


def body_properties(call: Call, source: InputSampler, count: int) -> tuple[Property, ...]:
    """Power of inertia and bias load = rate of the kinetic energy; `count` parameters."""
    errors, numbers = WorstErrors(), random.Random(13)
    with mp.workdps(DIGITS):
        for _ in range(3):
            parameters = source.parameter_values(len(source.parameters), numbers)
            frame = (
                [*random_rotation(numbers), *random_numbers(3, numbers)]
                if count > len(parameters)
                else []
            )
            _check_body_power(call, [*parameters, *frame], numbers, errors)
    return errors.properties()


def _check_body_power(call: Call, p: list[Any], numbers: random.Random, worst: WorstErrors) -> None:
    v, w, a, alpha = (column_vector(random_numbers(3, numbers)) for _ in range(4))
    inertia = symmetric_matrix(call("inertia", {"p": p})["S"], 6)
    gyroscopic = call("bias_load", {"p": p, "motion": [*w, 0, 0, 0, 0, 0, 0]})["e"]
    load = call("bias_load", {"p": p, "motion": [*w, *alpha, *a]})["e"]
    expected_load = inertia * column_vector([*a, *alpha]) + column_vector(gyroscopic)
    worst.record("residual = S a + e", load, expected_load, MAX_ALGEBRA_ERROR)
    v_rate = a - cross_product_matrix(w) * v

    def energy(t: Number) -> Matrix:
        velocities = {"v": list(v + t * v_rate), "w": list(w + t * alpha)}
        return column_vector(call("energy", {"p": p, **velocities})["T"])

    power = (expected_load.T * column_vector([*v, *w]))[0]
    worst.record(
        "power of the residual = dT/dt",
        [power],
        central_differences(energy)[1],
        MAX_DIFFERENCE_ERROR,
    )


def force_properties(call: Call, source: InputSampler, count: int) -> tuple[Property, ...]:
    """Power of a force element on its two ends = its dissipated power - dV/dt."""
    errors, numbers = WorstErrors(), random.Random(17)
    with mp.workdps(DIGITS):
        for _ in range(4):
            p = source.parameter_values(count, numbers)
            _check_force_power(call, p, {e: _random_end(numbers) for e in "FT"}, numbers, errors)
    return errors.properties()


def _check_force_power(
    call: Call, p: Numbers, ends: dict[str, End], numbers: random.Random, worst: WorstErrors
) -> None:
    common_inputs: dict[str, Any] = {
        "p": p,
        "t": random_numbers(1, numbers),
        "effort": random_numbers(1, numbers),
    }

    def values_at(t: Number) -> dict[str, list[Any]]:
        inputs = dict(common_inputs)
        for name, (axes, x, v, w) in ends.items():
            rotated_axes = (
                axes
                + t * cross_product_matrix(w) * axes
                + t**2 / 2 * cross_product_matrix(w) * cross_product_matrix(w) * axes
            )
            inputs |= {f"A_{name}": list(rotated_axes), f"x_{name}": list(x + t * v)}
            inputs |= {f"v_{name}": list(v), f"w_{name}": list(w)}
        return call("wrench", inputs)

    outputs = values_at(mpmath.mpf(0))
    _, rate, _ = central_differences(lambda t: column_vector(values_at(t)["V"]))
    force, moment = column_vector(outputs["F"]), column_vector(outputs["M"])
    (_, x_f, v_f, w_f), (_, x_t, v_t, w_t) = ends["F"], ends["T"]
    back = -moment - cross_product_matrix(x_t - x_f) * force
    power = force.T * (v_t - v_f) + moment.T * w_t + back.T * w_f
    worst.record(
        "power on both ends = P - dV/dt", power, [outputs["P"][0] - rate[0]], MAX_DIFFERENCE_ERROR
    )


def _random_end(numbers: random.Random) -> End:
    x, v, w = (column_vector(random_numbers(3, numbers)) for _ in range(3))
    return random_rotation(numbers), x, v, w


def random_rotation(numbers: random.Random) -> Matrix:
    """A rotation matrix, orthogonal to all digits."""
    q = column_vector(random_numbers(4, numbers))
    return rotation_of_quaternion(q / mpmath.norm(q))


def rotation_of_quaternion(q: Any) -> Matrix:
    """Rotation matrix of a unit quaternion: I + 2 w e~ + 2 e~ e~."""
    e = cross_product_matrix(q[1:4])
    return mp.eye(3) + 2 * q[0] * e + 2 * e * e
