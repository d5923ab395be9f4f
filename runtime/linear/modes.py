"""Natural motions of a linear model: frequencies, damping, shapes, and what carries them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig, eigh

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

if TYPE_CHECKING:
    from .equations import Equations
    from .pencil import Pencil

Complex = NDArray[np.complex128]

#: More coordinates than this have their slowest motions found without a matrix.
_DENSE = 400
#: A stiffness further from symmetric than this, in parts, is not that of a potential.
_SYMMETRIC = 1e-9
#: Rates in parts of the fastest that are rounding: eigenvalues are found to its square.
_ROUNDING = 1e-7


@dataclass(frozen=True, eq=False)
class Modes:
    """k motions x(t) = Re(shape exp(eigenvalue t)) near a state, by rising omega.

    Attributes:
        linear: the linear model.
        eigenvalues: (k,) complex, 1/s; of a pair the one with positive imaginary part.
        shapes: (n, k), real with unit modal mass where there is neither damping nor gyroscopic
            load, else complex with the largest entry 1.
        complete: whether no mode below the last one is missing; None where that is not counted.
    """

    linear: Equations = field(repr=False)
    eigenvalues: Complex
    shapes: NDArray[Any] = field(repr=False)
    complete: bool | None

    def __len__(self) -> int:
        return len(self.eigenvalues)

    @property
    def omega(self) -> Array:
        """(k,) |eigenvalue|, rad/s: of undamped motion its angular frequency."""
        return np.abs(self.eigenvalues)

    @property
    def frequency(self) -> Array:
        """(k,) frequency of the oscillation in Hz, 0 of what does not oscillate."""
        return np.abs(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def damping(self) -> Array:
        """(k,) in parts of the critical one; negative of what grows, 0 of what moves freely."""
        omega = self.omega
        rates = 0.0 - self.eigenvalues.real
        return np.divide(rates, omega, out=np.zeros_like(omega), where=omega > 0)

    def first(self, count: int) -> Modes:
        """The first of them."""
        return replace(self, eigenvalues=self.eigenvalues[:count], shapes=self.shapes[:, :count])

    @cached_property
    def _units(self) -> Array:
        """(k,) modal masses x* M x of the shapes."""
        moved = self._weighed(lambda pencil: pencil.mass)
        return np.real(np.einsum("ik,ik->k", np.conj(self.shapes), moved))

    def _weighed(self, product: Callable[[Pencil], Callable[[Array], Array]]) -> NDArray[Any]:
        """(n, k): an operator times every shape."""
        times = product(self.linear.pencil)
        columns = [times(x.real) + (1j * times(x.imag) if np.iscomplexobj(x) else 0.0)
                   for x in self.shapes.T]  # fmt: skip
        return np.array(columns).reshape(len(columns), len(self.linear)).T

    @cached_property
    def participation(self) -> NDArray[Any]:
        """(k, disturbances): how much of each shape a unit of each disturbance excites, x* W over
        the modal mass; of accelerations of the ground the participation factors, with their sign
        turned."""
        pushed = np.conj(self.shapes).T @ self.linear.W
        return np.asarray(pushed / self._units[:, None])

    @property
    def effective_mass(self) -> Array:
        """(k, disturbances) in kg for accelerations of the ground: |x* W|^2 over the modal mass.
        Over all undamped modes of a scene it adds up to the mass that moves."""
        return np.asarray(np.abs(self.participation) ** 2 * self._units[:, None])

    def strain(self) -> dict[str, Array]:
        """Owner of coordinates -> (k,): its part of the elastic energy of each shape, which laws
        of hinges and flexible bodies store; that of springs goes by the coordinates that strain
        them.  nan where a shape strains nothing."""
        linear = self.linear
        works = np.real(np.conj(self.shapes) * (linear.elastic @ self.shapes))
        total = works.sum(axis=0)
        with np.errstate(all="ignore"):
            shares = np.where(np.abs(total) > 0, works / total, np.nan)
        found: dict[str, Array] = {}
        for name, row in zip(linear.coordinates, shares, strict=True):
            owner = name.rpartition(".")[0]
            found[owner] = found.get(owner, 0.0) + row
        return found

    def displaced(self, k: int, amplitude: float) -> Array:
        """q (nq,) of the state moved by `amplitude` times the real part of shape k."""
        return self.linear.displaced(amplitude * np.real(self.shapes[:, k]))

    @property
    def growing(self) -> NDArray[np.bool_]:
        """(k,) which of them grow by themselves."""
        return self.eigenvalues.real > 0

    @property
    def undamped(self) -> bool:
        """Whether there is neither damping nor gyroscopic load in them."""
        return not np.iscomplexobj(self.shapes)


def modes(linear: Equations, count: int | None, damped: bool | None) -> Modes:
    """See `Linear.modes`."""
    few = count is not None and len(linear) > _DENSE and 4 * count <= len(linear)
    if count is None or not few or linear.turning is not None:
        found = _dense(linear, damped)
        return found if count is None else found.first(count)
    return _few(linear, count, damped)


def _few(linear: Equations, count: int, damped: bool | None) -> Modes:
    from . import lanczos

    pencil = linear.pencil
    x, y = np.random.default_rng(0).standard_normal((2, len(linear)))
    pressed = pencil.stiffness(x), pencil.stiffness(y)
    skew = abs(float(y @ pressed[0] - x @ pressed[1]))
    size = float(np.linalg.norm(pressed[0]) * np.linalg.norm(y))
    with_c = bool(pencil.damping(x).any()) if damped is None else damped
    if with_c or skew > _SYMMETRIC * size:
        slowest = lanczos.damped(pencil, count, with_c)
        return Modes(linear, slowest.values, slowest.shapes, None)
    slowest = lanczos.undamped(pencil, count)
    return _ordered(linear, slowest.values, slowest.shapes, slowest.complete)


def _dense(linear: Equations, damped: bool | None) -> Modes:
    """All motions, from the matrices."""
    with_c = linear.C.any() if damped is None else damped
    if with_c or not _from_potential(linear.K):
        return _general(linear, linear.C if with_c else np.zeros_like(linear.C))
    return _ordered(linear, *_symmetric(linear), True)


def _ordered(linear: Equations, squares: Array, shapes: Array, complete: bool | None) -> Modes:
    """Of omega^2; below 0 a motion grows and another decays, and the growing one is told."""
    rates = np.sqrt(np.abs(squares))
    values = np.where(squares < 0, rates + 0j, 1j * rates)
    order = np.argsort(rates, kind="stable")
    return Modes(linear, values[order], shapes[:, order], complete)


def _from_potential(stiffness: Array) -> bool:
    scale = np.abs(stiffness).max(initial=0)
    return bool(np.abs(stiffness - stiffness.T).max(initial=0) <= _SYMMETRIC * scale)


def _symmetric(linear: Equations) -> tuple[Array, Array]:
    stiffness, mass = (linear.K + linear.K.T) / 2, (linear.M + linear.M.T) / 2
    try:
        squares, shapes = eigh(stiffness, mass)
    except np.linalg.LinAlgError:
        raise _no_inertia(linear) from None
    rounding = (_ROUNDING**2) * np.abs(squares).max(initial=0)
    return np.where(np.abs(squares) <= rounding, 0.0, squares), shapes


def _general(linear: Equations, c: Array) -> Modes:
    """The quadratic problem, made linear."""
    n = len(linear)
    zero, one = np.zeros((n, n)), np.eye(n)
    a = np.block([[zero, one], [-linear.K, -c]])
    b = np.block([[one, zero], [zero, linear.M]])
    values, vectors = eig(a, b)
    if not np.isfinite(values).all():
        raise _no_inertia(linear)
    fastest = np.abs(values).max(initial=0)
    values = np.where(np.abs(values.imag) <= _ROUNDING * fastest, values.real, values)
    values = np.where(np.abs(values.real) <= _ROUNDING * fastest, 1j * values.imag, values)
    kept = np.flatnonzero(values.imag >= 0)
    kept = kept[np.argsort(np.abs(values[kept]), kind="stable")]
    shapes = vectors[:n, kept]
    places = np.abs(shapes).argmax(axis=0)
    shapes = shapes / shapes[places, np.arange(len(kept))]
    return Modes(linear, values[kept].astype(np.complex128), shapes, True)


def _no_inertia(linear: Equations) -> NumericalFailure:
    names = ", ".join(linear.coordinates[:3])
    return NumericalFailure(
        f"modes: the mass matrix of {names}, ... is not positive, so that some motion has no "
        "frequency; give what these move inertia"
    )
