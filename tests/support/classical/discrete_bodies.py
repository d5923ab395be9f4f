"""Bodies made of particles, and the linear form of their motion by differences, at 80 digits.

Nothing of the derivations is used: accelerations of particles, virtual power, central differences.
A body's coordinates are y = [r of the input end; angle of the frame; eta]; in space the angle is a
small rotation (inertial axes) from the predicted frame.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np

DIGITS = 80
STEP = mpmath.mpf(10) ** -25

Array = Any  # mpmath.matrix


def random_matrix(rng: np.random.Generator, rows: int, columns: int = 1) -> Array:
    """Uniform numbers in -1 ... 1."""
    return mpmath.matrix(rng.uniform(-1, 1, (rows, columns)).tolist())


def definite(rng: np.random.Generator, size: int) -> Array:
    """A symmetric positive definite matrix."""
    half = random_matrix(rng, size, size)
    return half * half.T + mpmath.eye(size)


def turn(rng: np.random.Generator) -> Array:
    """A rotation matrix."""
    with mpmath.workdps(DIGITS):
        w = random_matrix(rng, 4)
        w, x, y, z = w / mpmath.norm(w)
        return mpmath.matrix(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )


def cross(a: Array, b: Array) -> Array:
    """a x b of columns of three."""
    return mpmath.matrix(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def stack_columns(*columns: Array) -> Array:
    """Columns one below the other."""
    return mpmath.matrix([entry for column in columns for entry in column])


def differential(function: Callable[[Array], Array], size: int) -> Array:
    """Jacobian of `function` at zero by central differences."""
    columns = []
    for k in range(size):
        sides = []
        for sign in (1, -1):
            at = mpmath.zeros(size, 1)
            at[k] = sign * STEP
            sides.append(function(at))
        columns.append((sides[0] - sides[1]) / (2 * STEP))
    return mpmath.matrix([[c[i] for c in columns] for i in range(len(columns[0]))])


@dataclass(frozen=True)
class ParticleBody:
    """Particles with shapes (three rows, a column per mode), and the inputs of its kernel."""

    planar: bool
    modes: int
    masses: list[Any]
    places: list[Array]
    shapes: list[Array]
    values: dict[str, Array]

    @property
    def rigid_count(self) -> int:
        return 3 if self.planar else 6

    @property
    def shifts(self) -> int:
        return 2 if self.planar else 3

    # --- motion -----------------------------------------------------------------------------------

    def axes(self, step: Array) -> Array:
        """Frame axes (3 x 3), to first order in the step in space."""
        v = self.values
        if self.planar:
            angle = v["theta_p"][0] + step[2]
            c, s = mpmath.cos(angle), mpmath.sin(angle)
            return mpmath.matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        psi = step[3:6, 0]
        columns = [cross(psi, v["R_p"][:, k]) for k in range(3)]
        skewed = mpmath.matrix([[column[i] for column in columns] for i in range(3)])
        return v["R_p"] + skewed

    def eta(self, step: Array) -> Array:
        """Modal coordinates."""
        if not self.modes:
            return mpmath.zeros(0, 1)
        return self.values["eta_p"] + step[self.rigid_count :, 0]

    def inertia(self, step: Array) -> Array:
        """Rows (force, moment about the input end, modes) of everything but the ends' loads."""
        v, axes, eta = self.values, self.axes(step), self.eta(step)
        a_, c_ = v["A"][0], v["C"][0]
        r = v["r_p"] + step[: self.shifts, 0]
        felt = axes.T * self._three(a_ * r + v["B_r"] - v["g"])
        if self.planar:
            theta = v["theta_p"][0] + step[2]
            w = mpmath.matrix([0, 0, c_ * theta + v["D_theta"][0]])
            wd = mpmath.matrix([0, 0, a_ * theta + v["B_theta"][0]])
        else:
            turned = v["T"] * (v["R_p"].T * step[3:6, 0])
            w, wd = c_ * turned + v["D_w"], a_ * turned + v["B_w"]
        modal = (eta, eta, eta)
        if self.modes:
            modal = (eta, c_ * eta + v["D_eta"], a_ * eta + v["B_eta"])
        force, moment, shapes = self._inertial_loads(felt, w, wd, modal)
        force, moment = axes * force, axes * moment
        rows = [force, moment] if not self.planar else [force[:2, 0], moment[2:, 0]]
        outside = [v["f_r"], v["f_m"]]
        if self.modes:
            rows.append(shapes + v["K_f"] * eta + v["D_f"] * modal[1])
            outside.append(v["f_eta"])
        return stack_columns(*rows) - stack_columns(*outside)

    def _inertial_loads(
        self, felt: Array, w: Array, wd: Array, modal: tuple[Array, Array, Array]
    ) -> tuple[Array, Array, Array]:
        force, moment = mpmath.zeros(3, 1), mpmath.zeros(3, 1)
        shapes = mpmath.zeros(max(self.modes, 1), 1)
        for mass, rest, phi in zip(self.masses, self.places, self.shapes, strict=True):
            moved = [phi * x if self.modes else mpmath.zeros(3, 1) for x in modal]
            place = rest + moved[0]
            acceleration = (
                felt
                + cross(wd, place)
                + cross(w, cross(w, place))
                + 2 * cross(w, moved[1])
                + moved[2]
            )
            force += mass * acceleration
            moment += mass * cross(place, acceleration)
            if self.modes:
                shapes += mass * (phi.T * acceleration)
        return force, moment, shapes

    def _three(self, column: Array) -> Array:
        return column if len(column) == 3 else mpmath.matrix([column[0], column[1], 0])

    # --- ends -------------------------------------------------------------------------------------

    def arm(self, step: Array) -> Array:
        """Output end from the input end, inertial axes."""
        v = self.values
        if "L" in v:
            rest = mpmath.matrix([v["L"][0], 0, 0])
            phi = mpmath.zeros(3, self.modes)
            phi[1, :] = v["phi_O"]
        else:
            rest = self._three(v["r_e"])
            phi = self._shapes_at_end()
        moved = rest + phi * self.eta(step) if self.modes else rest
        return (self.axes(step) * moved)[: self.shifts, 0]

    def _shapes_at_end(self) -> Array:
        if not self.modes:
            return mpmath.zeros(3, 0)
        phi = mpmath.zeros(3, self.modes)
        phi[: self.shifts, :] = self.values["Phi_O"]
        return phi

    def slopes(self, end: str) -> Array:
        """Section rotation per mode at the end I or O, inertial axes (turns x n)."""
        shape = self.values[f"Theta_{end}"]
        return shape if self.planar else self.values["R_p"] * shape

    def end_loads(self, step: Array, q: Array, m: Array, m_input: Array) -> Array:
        """J_O^T f_O less the modal part of J_I^T f_I, at the loads q, m and m_input."""
        v, axes, arm = self.values, self.axes(step), self.arm(step)
        lever = cross(self._three(arm), self._three(q))
        rows = [q, (lever[2:, 0] if self.planar else lever) + m]
        if self.modes:
            phi = mpmath.zeros(3, self.modes)
            if "L" in v:
                phi[1, :] = v["phi_O"]
            else:
                phi = self._shapes_at_end()
            modal = phi.T * (axes.T * self._three(q))
            outer, inner = v["Theta_O"], v["Theta_I"]
            if self.planar:
                modal += outer.T * m - inner.T * m_input
            else:
                modal += outer.T * (axes.T * m) - inner.T * (axes.T * m_input)
                modal += v["K_g"] * step[6:, 0]
            rows.append(modal)
        return stack_columns(*rows)

    # --- the linear form --------------------------------------------------------------------------

    def linear(self) -> tuple[Array, Array]:
        """Z and F: rows Z step + F + J_O^T f_O - J_I^T f_I = 0, loads' turning included in Z."""
        v, size = self.values, self.rigid_count + self.modes
        turns = self.rigid_count - self.shifts
        zero = mpmath.zeros(size, 1)
        m, m_in = (v.get(name, mpmath.zeros(turns, 1)) for name in ("m_p", "m_pI"))

        def rows(step: Array) -> Array:
            return self.inertia(step) + self.end_loads(step, v["q_p"], m, m_in)

        return differential(rows, size), self.inertia(zero)

    def output_map(self) -> Array:
        """J_O: step -> step of (position, rotation) of the section at the output end."""
        size, shifts = self.rigid_count + self.modes, self.shifts

        def output_displacement(step: Array) -> Array:
            place = step[:shifts, 0] + self.arm(step)
            angle = step[shifts : self.rigid_count, 0]
            if self.modes:
                angle = angle + self.slopes("O") * step[self.rigid_count :, 0]
            return stack_columns(place, angle)

        return differential(output_displacement, size)


def kernel_inputs(body: ParticleBody, kernel: Any) -> dict[str, list[Any]]:
    """The body's numbers as its kernel takes them (symmetric ones as their upper triangle)."""
    found = {}
    for port in kernel.inputs:
        matrix = body.values[port.name]
        square = matrix.rows == matrix.cols > 1
        upper = square and port.length() < matrix.rows * matrix.cols
        found[port.name] = [
            matrix[i, j] for i in range(matrix.rows) for j in range(i if upper else 0, matrix.cols)
        ]
    return found
