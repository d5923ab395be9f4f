"""A uniform beam that vibrates harmonically, by its dynamic stiffness: exact, without shapes.

Its shapes, two in each bending plane and one of twist and tension, are the displacements of its
far end.  The solution of the field equation between the ends at exp(s t) comes from the generated
kernels (derive/classical/harmonic_stiffness.py), whose only number is
zeta = -(rho A s^2 + c s) l^4 / (E I m), with c the drag per length and m = 1 + tau s + i eta what
damping in proportion to the stiffness and a loss factor make of E.  Its static part strains the
shapes alone; in directions without shapes the beam is rigid.  Rotary inertia is left out.
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
from .static_shapes import stiffness_of

Complex = NDArray[np.complex128]

#: Axes of displacement and rotation of the section by direction, in beam axes.
_AXES = {
    "y": ((0, 1, 0), (0, 0, 1)), "z": ((0, 0, 1), (0, -1, 0)),
    "axial": ((1, 0, 0), None), "twist": (None, (1, 0, 0)),
}  # fmt: skip
BENDING = ("y", "z")
#: Row of `BeamData.inertia` that turns with a bending section.
_TURNS = {"y": 1, "z": 2}
#: A zeta next to which no power but the first counts, and parts of a mass that are rounding.
_LEAST, _ROUNDING = 1e-30, 1e-13


@dataclass(frozen=True)
class Direction:
    """One direction of a beam.

    zeta = -(inertia s^2 + drag s) / m; `stiffness` is that of the kernel's matrix, whose rows move
    by `ends` (rows, 6 + n) of three rotations and three displacements of the frame, and the shapes.
    """

    bends: bool
    inertia: float
    drag: float
    stiffness: float
    ends: Array

    def stiffness_at(self, s: Complex, softened: Complex) -> Complex:
        """(k, 6 + n, 6 + n) in N and N*m at s (k,), less the static part; `softened` are the m."""
        zeta = -(self.inertia * s**2 + self.drag * s) / softened
        matrix, _ = _evaluated(self.bends, zeta)
        return np.asarray(
            self.ends.T @ (self.stiffness * softened[:, None, None] * matrix) @ self.ends
        )

    def rigid(self) -> Array:
        """(6, 6) mass of the frame in this direction, kg, kg*m, kg*m^2."""
        least = np.array([_LEAST], dtype=np.complex128)
        matrix = -_evaluated(self.bends, least)[0][0].real / _LEAST
        ends = self.ends[:, :6]
        return np.asarray(self.inertia * self.stiffness * (ends.T @ matrix @ ends))

    def clamped(self, omega: Array) -> NDArray[np.int64]:
        """(k,) natural motions below omega with both ends held (Wittrick and Williams 1971)."""
        zeta = self.inertia * omega**2
        z = zeta**0.25 if self.bends else np.sqrt(zeta)
        waves = np.floor(z / np.pi).astype(np.int64)
        if not self.bends:
            return waves
        _, divisor = _evaluated(True, zeta.astype(np.complex128))
        turned = (1 - (-1) ** waves * np.sign(divisor)) / 2
        return np.asarray(waves - turned, dtype=np.int64)


@dataclass(frozen=True)
class HarmonicBeam:
    """A beam whose shapes are displacements of its far end.

    `static` (n, n) is their stiffness, `rigid` (6, 6) the mass in all directions that have none,
    `delay` (s) the damping in parts of the stiffness, `loss` the loss factor.
    """

    directions: tuple[Direction, ...]
    static: Array
    rigid: Array
    delay: float
    loss: float

    @property
    def size(self) -> int:
        """Rotations and displacements of the frame, and shapes."""
        return 6 + len(self.static)

    @property
    def told(self) -> tuple[object, ...]:
        """Equal for beams that are."""
        parts = [(d.bends, d.inertia, d.drag, d.stiffness, d.ends.tobytes())
                 for d in self.directions]  # fmt: skip
        return *parts, self.static.tobytes(), self.rigid.tobytes(), self.delay, self.loss

    def stiffness(self, s: Complex) -> Complex:
        """(k, size, size): load on the frame and the shapes by their displacements at s (k,) in
        1/s."""
        softened = 1 + self.delay * s + 1j * self.loss
        found = np.zeros((len(s), self.size, self.size), dtype=np.complex128)
        found[:, :6, :6] = (s**2)[:, None, None] * self.rigid
        found[:, 6:, 6:] = softened[:, None, None] * self.static
        for one in self.directions:
            found += one.stiffness_at(s, softened)
        return found

    @property
    def frequency(self) -> float:
        """Where zeta is 1 in the slowest direction, rad/s: about that of the beam alone."""
        return float(min(one.inertia**-0.5 for one in self.directions))

    def undamped(self) -> HarmonicBeam:
        """The same without damping and drag."""
        still = tuple(replace(one, drag=0.0) for one in self.directions)
        return replace(self, directions=still, delay=0.0, loss=0.0)

    def clamped(self, omega: Array) -> NDArray[np.int64]:
        """(k,) natural motions below omega with both ends held, undamped."""
        return sum((one.clamped(omega) for one in self.directions), np.zeros(len(omega), np.int64))


def harmonic_beam(
    data: BeamData, body: ModalBody, rotation: Array, delay: float, loss: float
) -> HarmonicBeam:
    """Of a beam whose shapes are displacements of its far end; `body` is given in axes to which
    beam axes are turned by `rotation`."""
    found = tuple(_directions(data, body, rotation))
    rest = _frame_mass(body) - sum((one.rigid() for one in found), np.zeros((6, 6)))
    for direction in {name.rstrip("0123456789") for name in body.modes} & _TURNS.keys():
        axis = rotation @ np.array(_AXES[direction][1])
        turning = data.inertia[_TURNS[direction], 0] * data.length
        rest[:3, :3] -= turning * np.outer(axis, axis)
    size = np.sqrt(np.abs(np.diag(_frame_mass(body))))
    rest[np.abs(rest) <= _ROUNDING * np.outer(size, size)] = 0.0
    return HarmonicBeam(found, body.K, rest, delay, loss)


def _frame_mass(body: ModalBody) -> Array:
    """(6, 6) of a frame by three angular accelerations and three accelerations."""
    lever = np.cross(body.first, np.eye(3)).T
    turning = np.trace(body.second) * np.eye(3) - body.second
    return np.block([[turning, lever], [-lever, body.mass * np.eye(3)]])


def _directions(data: BeamData, body: ModalBody, rotation: Array) -> Iterator[Direction]:
    for direction in dict.fromkeys(name.rstrip("0123456789") for name in body.modes):
        bends = direction in BENDING
        stiffness = float(stiffness_of(data, direction)[0])
        mass = float(data.inertia[1:, 0].sum() if direction == "twist" else data.inertia[0, 0])
        drag = 0.0 if direction == "twist" else data.drag
        length = data.length
        scale, power = (stiffness / length**3, 4) if bends else (stiffness / length, 2)
        rows = list(_moved(body, rotation, direction, length if bends else 1.0))
        by = length**power / stiffness
        yield Direction(bends, mass * by, drag * by, scale, np.array(rows))


def _moved(body: ModalBody, rotation: Array, direction: str, length: float) -> Iterator[Array]:
    """What each row of the kernel's matrix is of frame and shapes."""
    along, about = _AXES[direction]
    for end in ("root", "tip"):
        port = body.ports[end]
        if along is not None:
            axis = rotation @ along
            yield np.concatenate([np.cross(port.position, axis), axis, axis @ port.phi])
        if about is not None:
            axis = rotation @ about
            yield length * np.concatenate([axis, np.zeros(3), axis @ port.theta])


def _evaluated(bends: bool, zeta: Complex) -> tuple[Complex, Array]:
    """(k, m, m) beyond the shapes, and the real part of its divisor, at zeta (k,)."""
    inputs = {"zeta": np.stack([zeta.real, zeta.imag])}
    found = beam_kernels.evaluate("harmonic_bending" if bends else "harmonic_rod", inputs)
    size = 4 if bends else 2
    upper = np.triu_indices(size)
    matrix = np.zeros((len(zeta), size, size), dtype=np.complex128)
    matrix[:, upper[0], upper[1]] = (found["D_re"] + 1j * found["D_im"]).T
    matrix[:, upper[1], upper[0]] = matrix[:, upper[0], upper[1]]
    return matrix, found["d"][0]
