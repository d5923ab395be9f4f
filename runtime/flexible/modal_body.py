"""ModalBody: one flexible body in its floating frame, as kernels and results use it.

A point at r0 of the undeformed body is displaced by

    u = phi(r0) eta - 1/2 eta^T g(r0) eta

in the axes of the floating frame F, where phi holds one vector field per mode and g is the
second-order displacement due to bending and twist.  All integrals are over the mass of the
undeformed body.  SI units; eta of bending and axial shapes in metres, of twist shapes in radians.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from mstmm.array_validation import Array, Integers
from mstmm.errors import SceneError
from mstmm.ir import KernelIR
from mstmm.ir.element_spec import builtin_kernel

from .beam.section_ports import BeamShapes
from .modal_parts import MassPoint, ModalPort, Moments, Station, Truncation

if TYPE_CHECKING:
    from .beam.exact_sections import ExactSections


@dataclass(frozen=True)
class Skin:
    """Surface of a body for display, frame axes.

    Undeformed `nodes` (N, 3) m; `phi` (3, N, n) their displacement per mode; `faces` (m, 3)
    triangles of nodes, none where only nodes are known.
    """

    nodes: Array
    phi: Array
    faces: Integers


@dataclass(frozen=True)
class ModalBody(Moments):
    """One flexible body: mass moments, stiffness, damping, ports and initial deformation.

    With `points` (quadrature variant) or `stations` (exact beam: its sections, ordered so that
    each comes after the one before it on its way from the supported section) the mass sits in them
    and the moments, of first order in eta, are not used for the motion.
    `drag` are the moments of the viscous drag per length (N s/m^2 in place of kg/m; motion of the
    axis only), None without drag.  `shapes` are those of a second-order beam, `exact` the strain
    shapes of an exact one.  `line_loads` of an exact beam give for each load per length the
    stations on which it acts and the length (m) that each of them stands for.  `resolved` is the
    highest frequency (rad/s) that the shapes of an elastic body resolve, `truncation` their
    truncation error in deflections; both None for beams.  `frame` is the kind of floating frame:
    "tangent", "chord", "mean", or one of them per bending plane ("chord/tangent": of y, of z).
    """

    name: str
    modes: tuple[str, ...]  #: "y1", "z1", "twist1", "axial1", "m1"
    K: Array  #: (n, n)
    D: Array  #: (n, n)
    ports: Mapping[str, ModalPort]
    points: tuple[MassPoint, ...] = ()
    stations: tuple[Station, ...] = ()
    exact: ExactSections | None = None
    line_loads: Mapping[str, tuple[tuple[int, float], ...]] = field(default_factory=dict)
    drag: Moments | None = None
    eta: Array = field(default_factory=lambda: np.zeros(0))
    etad: Array = field(default_factory=lambda: np.zeros(0))
    shapes: BeamShapes | None = None
    skin: Skin | None = None
    frame: str = ""
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    resolved: float | None = None
    truncation: Truncation | None = None
    unmoved_frame: str = ""  #: kind of frame with fewer shapes, if it differs

    @property
    def n(self) -> int:
        """Number of modes."""
        return len(self.modes)

    @property
    def has_axis(self) -> bool:
        """Whether it is a beam, with sections along an axis."""
        return self.shapes is not None or self.exact is not None

    @property
    def Mff(self) -> Array:
        """Modal mass matrix (n, n), with the frame fixed."""
        return np.einsum("aakl->kl", self.F)


# --- scales ---------------------------------------------------------------------------------------


def modal_sizes(body: ModalBody) -> Array:
    """Characteristic modal amplitudes (n,), the smaller of two per mode.

    At one of them some section turns by 1 rad, at the other the mass moves (rms) by the radius of
    gyration of the body.
    """
    radius = radius_of_gyration(body) or 1.0
    displacement = np.sqrt(np.abs(np.diag(body.Mff)) / max(float(body.mass), 1e-300))
    rotation = np.max([np.abs(port.theta).max(axis=0) for port in body.ports.values()], axis=0)
    if body.shapes is not None:
        sections = body.shapes.values_at(np.linspace(0.0, body.shapes.length, 2 * body.n + 3)).theta
        rotation = np.maximum(rotation, np.abs(sections).max(axis=(0, 1)))
    return np.asarray(1.0 / np.maximum(np.maximum(displacement / radius, rotation), 1e-300))


def radius_of_gyration(body: ModalBody) -> float:
    """Radius of gyration about the origin of the floating frame, m."""
    return float(np.sqrt(np.trace(body.second) / max(float(body.mass), 1e-300)))


# --- kernel inputs, and changes of frame ----------------------------------------------------------

_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
#: (a, b) with eps_iab = 1, by i.
_CYCLIC = ((1, 2), (2, 0), (0, 1))


def moment_inputs(body: Moments) -> dict[str, Array]:
    """Inputs p, C, P, B, Z_xx.., Y_x.., G_x.., M of the kernels of ("sweep", "modal").

    They are defined in `derive.flexible.modal_residual`.
    """
    e, f, g, x = body.E, body.F, body.G, body.X
    inputs = {
        "p": np.array([body.mass, *body.first, *(body.second[a, b] for a, b in _PAIRS)]),
        "C": body.C,
        "P": np.array([e[a, b] - e[b, a] for a, b in _CYCLIC]),
        "B": np.array([e[a, b] + e[b, a] for a, b in _PAIRS]),
    }
    for a, b in _PAIRS:
        name = "xyz"[a] + "xyz"[b]
        inputs[f"Z_{name}"] = f[a, b] + f[a, b].T - x[a, b] - x[b, a]
    for i, (a, b) in enumerate(_CYCLIC):
        inputs[f"Y_{'xyz'[i]}"] = (f[a, b] - x[a, b]) - (f[b, a] - x[b, a])
    for i in range(3):
        inputs[f"G_{'xyz'[i]}"] = g[i]
    inputs["M"] = f[0, 0] + f[1, 1] + f[2, 2]
    return inputs


def section_inputs(port: ModalPort) -> dict[str, Array]:
    """Inputs r, phi, theta, g_x .. h_z of the kernel "section" of ("sweep", "modal")."""
    names = [f"{kind}_{axis}" for kind in "gh" for axis in "xyz"]
    return {"r": port.position, "phi": port.phi, "theta": port.theta} | dict(
        zip(names, port.second_order, strict=True)
    )


def segment_inputs(station: Station) -> dict[str, Array]:
    """Inputs b, Bm of the kernel "segment" of ("sweep", "modal")."""
    return {"b": station.rest, "Bm": station.shapes}


M = TypeVar("M", bound=Moments)


def transform_body(body: ModalBody, rotation: Array, origin: Array) -> ModalBody:
    """Body in other axes about another origin.

    `rotation` (3, 3) turns new axes to old ones; `origin` (3,) is in old axes, m.
    """
    axes, shift = rotation, origin
    if np.array_equal(axes, np.eye(3)) and not np.any(shift):
        return body
    return replace(
        _transform_moments(body, axes, shift),
        ports={name: transform_section(port, axes, shift) for name, port in body.ports.items()},
        points=tuple(
            replace(point, port=transform_section(point.port, axes, shift)) for point in body.points
        ),
        stations=tuple(transform_station(station, axes, shift) for station in body.stations),
        drag=None if body.drag is None else _transform_moments(body.drag, axes, shift),
    )


def _transform_moments(body: M, rotation: Array, origin: Array) -> M:
    """Moments about another origin, in the axes `rotation`."""
    first = body.first - body.mass * origin
    second = body.second - np.outer(origin, body.first) - np.outer(first, origin)
    e = body.E - origin[:, None, None] * body.C[None]
    x = body.X - origin[:, None, None, None] * body.G[None]
    return replace(
        body,
        first=rotation.T @ first,
        second=rotation.T @ second @ rotation,
        C=rotation.T @ body.C,
        E=np.einsum("ia,jb,ijk->abk", rotation, rotation, e),
        F=np.einsum("ia,jb,ijkl->abkl", rotation, rotation, body.F),
        G=_rotate_components(rotation, body.G),
        X=np.einsum("ia,jb,ijkl->abkl", rotation, rotation, x),
    )


def transform_section(port: ModalPort, rotation: Array, origin: Array) -> ModalPort:
    """Section in other axes about another origin; arguments as in `transform_body`."""
    r = rotation
    return ModalPort(
        r.T @ (port.position - origin), r.T @ port.rotation, r.T @ port.phi, r.T @ port.theta,
        np.concatenate([_rotate_components(r, part) for part in np.split(port.second_order, 2)]),
    )  # fmt: skip


def transform_station(station: Station, rotation: Array, origin: Array) -> Station:
    """Station of a body in other axes about another origin; arguments as in `transform_body`.

    The axes of all sections are turned alike, so that strains and slices are in the new axes; those
    of an end stay.
    """
    if np.any(origin):
        raise ValueError("the supported section of an exact beam is its origin")
    r = rotation
    return replace(
        station,
        rest=_rotate_triples(r, station.rest),
        shapes=_rotate_triples(r, station.shapes),
        center=r.T @ station.center,
        inertia=r.T @ station.inertia @ r,
        rotation=r.T @ station.rotation if station.end else station.rotation,
    )


def _rotate_triples(rotation: Array, values: Array) -> Array:
    """Vectors (3) stacked along the first axis in the axes `rotation`."""
    vectors = values.reshape(-1, 3, *values.shape[1:])
    return np.asarray(np.einsum("ia,ki...->ka...", rotation, vectors)).reshape(values.shape)


def _rotate_components(rotation: Array, vectors: Array) -> Array:
    """Components (3, n, n) in the axes `rotation`."""
    return np.asarray(np.einsum("ia,ikl->akl", rotation, vectors))


def without_mass(body: ModalBody) -> ModalBody:
    """Body with stiffness and damping alone, for a body whose mass sits in points."""
    zeros = {name: np.zeros_like(getattr(body, name)) for name in "CEFGX"}
    return replace(body, mass=0.0, first=np.zeros(3), second=np.zeros((3, 3)), **zeros)


def kernel(name: str) -> KernelIR:
    """Kernel of the element "modal" with the given name."""
    return builtin_kernel("sweep_modal", name)


# --- rejection of bodies that cannot be computed in double precision ------------------------------


def checked_result(what: str, make: Callable[[], ModalBody]) -> ModalBody:
    """Body that `make` returns.

    Raises SceneError naming `what`, such as 'beam "b"', for a singular matrix or an overflow.
    """
    try:
        with np.errstate(all="ignore"):
            body = make()
    except np.linalg.LinAlgError as failure:
        raise _precision_error(what, str(failure).lower()) from None
    ports = [values for port in body.ports.values() for values in vars(port).values()]
    arrays = [body.second, body.C, body.E, body.F, body.G, body.X, body.K, body.D, *ports]
    if not all(np.isfinite(values).all() for values in arrays):
        raise _precision_error(what, "overflow")
    return body


def _precision_error(what: str, why: str) -> SceneError:
    return SceneError(
        f"{what}: its shapes and masses cannot be computed in double precision ({why}); look for "
        "masses, stiffnesses or lengths that differ by too many orders of magnitude, or use fewer "
        "shapes"
    )
