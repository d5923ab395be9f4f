"""Parts of modal bodies: mass moments, sections, truncation error."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

from mstmm.array_validation import Array


@dataclass(frozen=True)
class Moments:
    """Integrals of the fields 1, r0, phi, g over a density (frame axes, about F's origin).

    C[a, k] = int phi_a,k;  E[a, b, k] = int r0_a phi_b,k;  F[a, b, k, l] = int phi_a,k phi_b,l;
    G[a, k, l] = int g_a,kl;  X[a, b, k, l] = int r0_a g_b,kl.
    """

    mass: float
    first: Array  #: (3,) int r0
    second: Array  #: (3, 3) int r0 r0^T
    C: Array  #: (3, n)
    E: Array  #: (3, 3, n)
    F: Array  #: (3, 3, n, n)
    G: Array  #: (3, n, n)
    X: Array  #: (3, 3, n, n)


@dataclass(frozen=True)
class ModalPort:
    """One end, or any other section, of a flexible body relative to its floating frame.

    The section's pose is R = exp(Psi~) rotation with Psi = theta eta - 1/2 eta^T h eta and
    d = position + phi eta - 1/2 eta^T g eta, where `second_order` holds g and then h.
    """

    position: Array  #: (3,) undeformed point, frame axes, m
    rotation: Array  #: (3, 3) undeformed axes of the end -> frame axes
    phi: Array  #: (3, n) displacement of the point per mode
    theta: Array  #: (3, n) rotation vector of the section per mode
    second_order: Array  #: (6, n, n) symmetric in the last two; zeros where linear

    @property
    def can_move(self) -> bool:
        """Whether the section can move relative to the floating frame."""
        return bool(np.any(self.phi) or np.any(self.theta) or np.any(self.second_order))


@dataclass(frozen=True)
class MassPoint:
    """A rigid slice with a part of the mass of a body (quadrature variant).

    `inertia` (3, 3) is about the point, in the section's axes, kg m^2.
    """

    mass: float
    inertia: Array
    port: ModalPort


@dataclass(frozen=True)
class Station:
    """Node of an exact beam: a section at the end of a segment, with a part of the mass.

    The segment starts at the node with the index `previous`; -1 is the supported section, whose
    axes are those of the flexible body.  `rest` and `shapes` are B1, B2, B3 of
    `derive.flexible.segment` at eta = 0 and per strain coordinate.  The rigid slice of `length` has
    `mass`, mass centre `center` and `inertia` about that centre, in the axes of the section.

    Attributes:
        x: section, m from the root.
        end: name of the end that the node is; "" for a station, which has mass only.
        rotation: (3, 3) axes of the end -> axes of the section.
    """

    x: float
    previous: int
    rest: Array  #: (18,)
    shapes: Array  #: (18, n)
    length: float = 0.0  #: m, of the slice
    mass: float = 0.0  #: kg
    center: Array = field(default_factory=lambda: np.zeros(3))  #: m
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))  #: kg m^2
    end: str = ""
    rotation: Array = field(default_factory=lambda: np.eye(3))


@dataclass(frozen=True)
class Truncation:
    """Static deflection of an elastic body under unit loads, in full and by its shapes.

    The loads are, in this order: force and moment (6) about the point of each of `ports`, the loads
    rho r0_a e_b (9, b running fastest) and -rho phi_k of a unit acceleration of each shape; body
    axes, all balanced by rigid accelerations of the body.

    Attributes:
        full_response, shape_response: (6 p, m) displacement and rotation of the ports per unit
            load, of the full model and of the shapes, relative to the mean motion of the mass.
    """

    ports: tuple[str, ...]
    full_response: Array
    shape_response: Array

    def missed_share(self, loads: Array, length: float) -> Array:
        """Share (n,) of the port deflection under `loads` (n, m) that the shapes do not represent.

        A radian counts as `length` (m); 0 without deflection.
        """
        sizes = np.tile(np.repeat([1.0, length], 3), len(self.ports))
        whole, missing = (
            np.linalg.norm(loads @ (deflection * sizes[:, None]).T, axis=1)
            for deflection in (self.full_response, self.full_response - self.shape_response)
        )
        return np.divide(
            missing, whole, out=np.zeros_like(whole), where=(whole > 0) & np.isfinite(whole)
        )


# --- large arrays and cached bodies ---------------------------------------------------------------

#: Numbers per chunk, 8 MB.
_CHUNK_SIZE = 2**20


def chunk_slices(count: int, entry_size: int) -> list[slice]:
    """Slices from 0 to `count`, each of at most a chunk of entries of `entry_size` numbers."""
    step = max(1, _CHUNK_SIZE // max(1, entry_size))
    return [slice(first, min(first + step, count)) for first in range(0, count, step)]


T = TypeVar("T")


@dataclass(frozen=True)
class CacheKey(Generic[T]):
    """Argument of a cached function: compared by `key`, which determines the relevant `value`."""

    key: Hashable
    value: T = field(compare=False)
