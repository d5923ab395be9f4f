"""Exact dynamic stiffness of a uniform beam in harmonic vibration.

The shapes of the beam, two in each bending plane and one each of twist and tension, are the
displacements of its far end.  The solution of the field equation between the ends at exp(s t) comes
from the generated kernels (derive/classical/harmonic_stiffness.py).  Their only parameter is
zeta = -(rho A s^2 + c s) l^4 / (E I m), with c the drag per length and m = 1 + tau s + i eta the
factor of E due to stiffness-proportional damping and a loss factor.  The static part strains the
shapes alone; in directions without shapes the beam is rigid.  Rotary inertia is neglected.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from ..modal_body import ModalBody
from . import beam_kernels
from .beam_data import BeamData
from .static_shapes import direction_stiffness

Complex = NDArray[np.complex128]

#: Axes of displacement and rotation of the section by direction, in beam axes.
_AXES = {
    "y": ((0, 1, 0), (0, 0, 1)), "z": ((0, 0, 1), (0, -1, 0)),
    "axial": ((1, 0, 0), None), "twist": (None, (1, 0, 0)),
}  # fmt: skip
BENDING = ("y", "z")
#: Row of `BeamData.inertia` with the rotary inertia of a bending section.
_ROTARY_ROW = {"y": 1, "z": 2}
#: A zeta whose higher powers are negligible, and a share of a mass that is rounding.
_SMALL_ZETA, _ROUNDING = 1e-30, 1e-13


@dataclass(frozen=True)
class Direction:
    """Dynamic stiffness of a beam in one direction.

    zeta = -(inertia s^2 + drag s) / m.  `stiffness` scales the matrix of the kernel; `ends`
    (rows, 6 + n) are its displacements per three rotations and three displacements of the frame,
    and per shape.
    """

    is_bending: bool
    inertia: float
    drag: float
    stiffness: float
    ends: Array

    def stiffness_at(self, s: Complex, modulus_factor: Complex) -> Complex:
        """Dynamic stiffness (k, 6 + n, 6 + n) in N and N*m at s (k,), less the static part.

        `modulus_factor` (k,) is m.
        """
        zeta = -(self.inertia * s**2 + self.drag * s) / modulus_factor
        matrix, _ = _evaluate_kernel(self.is_bending, zeta)
        return np.asarray(
            self.ends.T @ (self.stiffness * modulus_factor[:, None, None] * matrix) @ self.ends
        )

    def rigid_mass(self) -> Array:
        """Mass (6, 6) of the frame in this direction, kg, kg*m, kg*m^2."""
        zeta = np.array([_SMALL_ZETA], dtype=np.complex128)
        matrix = -_evaluate_kernel(self.is_bending, zeta)[0][0].real / _SMALL_ZETA
        ends = self.ends[:, :6]
        return np.asarray(self.inertia * self.stiffness * (ends.T @ matrix @ ends))

    def clamped_mode_count(self, omega: Array) -> NDArray[np.int64]:
        """Number (k,) of natural frequencies below omega with both ends clamped.

        Wittrick and Williams 1971.
        """
        zeta = self.inertia * omega**2
        z = zeta**0.25 if self.is_bending else np.sqrt(zeta)
        waves = np.floor(z / np.pi).astype(np.int64)
        if not self.is_bending:
            return waves
        _, divisor = _evaluate_kernel(True, zeta.astype(np.complex128))
        correction = (1 - (-1) ** waves * np.sign(divisor)) / 2
        return np.asarray(waves - correction, dtype=np.int64)


@dataclass(frozen=True)
class HarmonicBeam:
    """Dynamic stiffness of a beam whose shapes are displacements of its far end.

    `static` (n, n) is the stiffness of the shapes, `rigid` (6, 6) the mass in all directions
    without shapes, `delay` (s) the stiffness-proportional damping, `loss` the loss factor.
    """

    directions: tuple[Direction, ...]
    static: Array
    rigid: Array
    delay: float
    loss: float

    @property
    def size(self) -> int:
        """Number of rotations and displacements of the frame, and shapes."""
        return 6 + len(self.static)

    @property
    def cache_key(self) -> tuple[object, ...]:
        """Key that is equal for equal beams."""
        parts = [(d.is_bending, d.inertia, d.drag, d.stiffness, d.ends.tobytes())
                 for d in self.directions]  # fmt: skip
        return *parts, self.static.tobytes(), self.rigid.tobytes(), self.delay, self.loss

    def stiffness(self, s: Complex) -> Complex:
        """Dynamic stiffness (k, size, size) of frame and shapes at s (k,) in 1/s."""
        modulus_factor = 1 + self.delay * s + 1j * self.loss
        total = np.zeros((len(s), self.size, self.size), dtype=np.complex128)
        total[:, :6, :6] = (s**2)[:, None, None] * self.rigid
        total[:, 6:, 6:] = modulus_factor[:, None, None] * self.static
        for direction in self.directions:
            total += direction.stiffness_at(s, modulus_factor)
        return total

    @property
    def frequency(self) -> float:
        """Scale of the lowest frequency of the beam, rad/s: zeta = 1 in the slowest direction."""
        return float(min(direction.inertia**-0.5 for direction in self.directions))

    def without_damping(self) -> HarmonicBeam:
        """Beam without damping and drag."""
        directions = tuple(replace(direction, drag=0.0) for direction in self.directions)
        return replace(self, directions=directions, delay=0.0, loss=0.0)

    def clamped_mode_count(self, omega: Array) -> NDArray[np.int64]:
        """Number (k,) of undamped natural frequencies below omega with both ends clamped."""
        counts = (direction.clamped_mode_count(omega) for direction in self.directions)
        return sum(counts, np.zeros(len(omega), np.int64))


def harmonic_beam(
    data: BeamData, body: ModalBody, rotation: Array, delay: float, loss: float
) -> HarmonicBeam:
    """Dynamic stiffness of a beam whose shapes are displacements of its far end.

    `body` is given in other axes; `rotation` turns beam axes to them.
    """
    directions = tuple(_directions(data, body, rotation))
    rigid = _frame_mass(body) - sum(
        (direction.rigid_mass() for direction in directions), np.zeros((6, 6))
    )
    for direction in {name.rstrip("0123456789") for name in body.modes} & _ROTARY_ROW.keys():
        axis = rotation @ np.array(_AXES[direction][1])
        inertia = data.inertia[_ROTARY_ROW[direction], 0] * data.length
        rigid[:3, :3] -= inertia * np.outer(axis, axis)
    scale = np.sqrt(np.abs(np.diag(_frame_mass(body))))
    rigid[np.abs(rigid) <= _ROUNDING * np.outer(scale, scale)] = 0.0
    return HarmonicBeam(directions, body.K, rigid, delay, loss)


def _frame_mass(body: ModalBody) -> Array:
    """Mass (6, 6) of a frame for three angular accelerations and three accelerations."""
    lever = np.cross(body.first, np.eye(3)).T
    inertia = np.trace(body.second) * np.eye(3) - body.second
    return np.block([[inertia, lever], [-lever, body.mass * np.eye(3)]])


def _directions(data: BeamData, body: ModalBody, rotation: Array) -> Iterator[Direction]:
    for direction in dict.fromkeys(name.rstrip("0123456789") for name in body.modes):
        bends = direction in BENDING
        stiffness = float(direction_stiffness(data, direction)[0])
        mass = float(data.inertia[1:, 0].sum() if direction == "twist" else data.inertia[0, 0])
        drag = 0.0 if direction == "twist" else data.drag
        length = data.length
        scale, power = (stiffness / length**3, 4) if bends else (stiffness / length, 2)
        rows = list(_end_rows(body, rotation, direction, length if bends else 1.0))
        time_scale = length**power / stiffness
        yield Direction(bends, mass * time_scale, drag * time_scale, scale, np.array(rows))


def _end_rows(body: ModalBody, rotation: Array, direction: str, length: float) -> Iterator[Array]:
    """Displacement of each row of the matrix of the kernel per motion of frame and shapes."""
    along, about = _AXES[direction]
    for end in ("root", "tip"):
        port = body.ports[end]
        if along is not None:
            axis = rotation @ along
            yield np.concatenate([np.cross(port.position, axis), axis, axis @ port.phi])
        if about is not None:
            axis = rotation @ about
            yield length * np.concatenate([axis, np.zeros(3), axis @ port.theta])


def _evaluate_kernel(bends: bool, zeta: Complex) -> tuple[Complex, Array]:
    """Matrix (k, m, m) less the static part, and the real part of its divisor, at zeta (k,)."""
    inputs = {"zeta": np.stack([zeta.real, zeta.imag])}
    outputs = beam_kernels.evaluate("harmonic_bending" if bends else "harmonic_rod", inputs)
    size = 4 if bends else 2
    upper = np.triu_indices(size)
    matrix = np.zeros((len(zeta), size, size), dtype=np.complex128)
    matrix[:, upper[0], upper[1]] = (outputs["D_re"] + 1j * outputs["D_im"]).T
    matrix[:, upper[1], upper[0]] = matrix[:, upper[0], upper[1]]
    return matrix, outputs["d"][0]
