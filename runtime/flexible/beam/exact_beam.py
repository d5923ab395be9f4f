"""Exact beams as `ModalBody`: strain shapes, stations with the mass, ends, stiffness, damping.

The mass sits in rigid slices at Gauss points.  The default shapes are *strain modes*: strains of
the lowest vibrations about the shape at rest, with the motions that the inboard hinge permits and
with the inertia of the bodies outboard of the other ends.  They are combinations of Legendre
polynomials, so that any stiffness along the beam is treated alike.  Legendre polynomials themselves
represent static end loads and moments better; `basis = "auto"` selects them where a load, spring or
closed loop acts on an end.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import block_diag, eigh

from mstmm.array_validation import Array

from ..modal_body import ModalBody
from ..modal_parts import ModalPort, Moments, Station
from ..supports import Support, spatial_inertia
from .beam_data import BeamData
from .exact_sections import ExactSections
from .segment_chain import SegmentChain, gauss_sections, twist_at
from .static_shapes import direction_stiffness
from .strain_shapes import STRAIN_ROWS, StrainShapes, legendre_shapes

if TYPE_CHECKING:
    from mstmm.scene.tables.beam import Beam

LEGENDRE, STRAIN_MODES = "legendre", "modes"
#: Polynomials beyond the number of modes, and smallest number, from which strain modes are formed.
_EXTRA_POLYNOMIALS, _MIN_POLYNOMIALS = 7, 10
#: Stations beyond the number of shapes.  Two avoid phantom frequencies; with five the poses of
#: Legendre strains are accurate to 1e-8 at slopes of 1.5, and modes have errors of 1e-4.
_EXTRA_STATIONS = 5
#: Share of the largest inertia below which a motion counts as massless.
_MASSLESS_RATIO = 1e-13
#: Points at which shapes are scaled.
_SCALE_POINTS = 201


@dataclass(frozen=True)
class ExactBeamSetting:
    """Conditions of an exact beam in its scene.

    Attributes:
        data: sections and ends.
        counts: number of shapes by direction.
        basis: LEGENDRE or STRAIN_MODES.
        support: motion of the inboard end, axes of that end.
        inboard_end: its name.
        outboard_inertia: end -> inertia (6, 6) of the bodies outboard of it, axes and point of it.
        spans: load per length -> part of the beam on which it acts, m.
    """

    data: BeamData
    counts: Mapping[str, int]
    basis: str
    support: Support
    inboard_end: str
    outboard_inertia: Mapping[str, Array]
    spans: Mapping[str, tuple[float, float]]

    @property
    def start(self) -> float:
        """Supported section, m."""
        return self.data.ends[self.inboard_end][0]

    @property
    def station_count(self) -> int:
        """Number of stations with mass, about."""
        return max(self.counts.values()) + _EXTRA_STATIONS

    @property
    def ends(self) -> list[str]:
        """Ends away from the supported section."""
        return [name for name, (x, _) in self.data.ends.items() if x != self.start]


def exact_beam_body(beam: Beam, setting: ExactBeamSetting) -> ModalBody:
    """Modal body of an exact beam, damped by strain rates, without initial values and messages.

    Kelvin-Voigt: a strain xi with stiffness C has the load C (xi + tau xi'), so that
    D = int B^T diag(tau) C B.
    """
    shapes = _shapes(setting)
    chain, stations = _stations(setting, shapes, setting.station_count, setting.spans)
    moments = _moments(stations, chain)
    stiffness, viscosity = (
        _stiffness(setting.data, shapes, setting.station_count, np.array(factors))
        for factors in ((1.0,), beam.damping.strain)
    )
    return ModalBody(
        **vars(moments), name=beam.name, modes=shapes.names, K=stiffness, D=viscosity,
        ports=_ports(setting, chain), stations=stations,
        exact=ExactSections(setting.data, chain),
        line_loads=_line_loads(setting, stations), frame="tangent",
        notes=_notes(setting),
    )  # fmt: skip


def _notes(setting: ExactBeamSetting) -> tuple[str, ...]:
    kind = {LEGENDRE: "Legendre strains", STRAIN_MODES: "strain modes"}[setting.basis]
    return tuple(
        f"{direction}: {count} {kind}, exact kinematics"
        for direction, count in setting.counts.items()
        if count
    )


# --- shapes ---------------------------------------------------------------------------------------


def _shapes(setting: ExactBeamSetting) -> StrainShapes:
    counts = {direction: count for direction, count in setting.counts.items() if count}
    if setting.basis == LEGENDRE:
        return legendre_shapes(setting.data, counts)
    modes = {direction: _strain_modes(setting, direction, n) for direction, n in counts.items()}
    return StrainShapes(setting.data, modes)


def _strain_modes(setting: ExactBeamSetting, direction: str, count: int) -> Array:
    """Coefficients (polynomials, count) of the strains of the lowest vibrations in a direction."""
    degree = max(count + _EXTRA_POLYNOMIALS, _MIN_POLYNOMIALS)
    shapes = legendre_shapes(setting.data, {direction: degree})
    chain, stations = _stations(setting, shapes, degree + _EXTRA_STATIONS, {})
    supported = (
        block_diag(*[setting.data.ends[setting.inboard_end][1]] * 2) @ setting.support.motion
    )
    m = setting.support.speeds
    mass = block_diag(setting.support.inertia, np.zeros((degree, degree)))
    for station, rotation, position, twist in zip(stations, *chain.at_rest, strict=True):
        motion = np.hstack([twist_at(rotation, position, supported), twist])
        mass += motion.T @ _spatial_inertia(setting, station) @ motion
    stiffness = _stiffness(setting.data, shapes, degree + _EXTRA_STATIONS, np.ones(1))
    rigid = mass[:m, :m]
    free = np.linalg.pinv(rigid, rcond=_MASSLESS_RATIO, hermitian=True) @ mass[:m, m:]
    condensed = mass[m:, m:] - mass[m:, :m] @ free
    # Flexibilities are bounded, whereas a condensed mass may be singular.
    _, vectors = eigh(condensed, stiffness)
    return _with_unit_integral(setting.data, shapes, vectors[:, ::-1][:, :count])


def _with_unit_integral(data: BeamData, shapes: StrainShapes, vectors: Array) -> Array:
    """Columns of one direction whose integral along the beam (rad, m) is 1 where it is largest."""
    x = np.linspace(0.0, data.length, _SCALE_POINTS)
    (direction,) = shapes.coefficients
    row, sign = STRAIN_ROWS[direction]
    integrals = np.cumsum(sign * shapes.values_at(x)[:, row] @ vectors, axis=0) * (x[1] - x[0])
    largest = integrals[np.abs(integrals).argmax(axis=0), np.arange(vectors.shape[1])]
    return np.asarray(vectors / largest)


# --- mass and stiffness ---------------------------------------------------------------------------


def _stations(
    setting: ExactBeamSetting,
    shapes: StrainShapes,
    count: int,
    spans: Mapping[str, tuple[float, float]],
) -> tuple[SegmentChain, tuple[Station, ...]]:
    """Chain of about `count` stations with mass, and its stations and ends in their order.

    Further stations, without mass, are where the section changes, so that strains are smooth along
    each segment, and where loads act on a part of the beam.
    """
    data = setting.data
    x, weights = gauss_sections(data.breaks, count)
    lengths = {section: 0.0 for section in data.breaks[1:-1] if section != setting.start}
    lengths |= dict(zip(x.tolist(), weights.tolist(), strict=True))
    for span in spans.values():
        if span != (0.0, data.length):
            sections = gauss_sections(span, count)[0].tolist()
            lengths |= {section: lengths.get(section, 0.0) for section in sections}
    ends = np.array([data.ends[name][0] for name in setting.ends])
    chain = SegmentChain(shapes, setting.start, np.array(list(lengths)), ends)
    stations = [
        Station(x, previous, chain.rest[k], chain.slopes[k])
        for k, (x, previous) in enumerate(chain.links)
    ]
    for k, station in enumerate(stations[: len(lengths)]):
        section, length = data.sections(np.array([station.x])), lengths[station.x]
        stations[k] = replace(
            station, length=length, mass=float(section.mass_per_length[0]) * length,
            inertia=np.diag(section.rho_I[:, 0]) * length,
        )  # fmt: skip
    for k, name in enumerate(setting.ends, len(lengths)):
        stations[k] = replace(stations[k], end=name, rotation=data.ends[name][1])
    return chain, tuple(stations)


def _spatial_inertia(setting: ExactBeamSetting, station: Station) -> Array:
    """Spatial inertia (6, 6) of a slice, or outboard of an end, in the axes of the section."""
    if station.end:
        axes = block_diag(station.rotation, station.rotation)
        inertia = setting.outboard_inertia.get(station.end, np.zeros((6, 6)))
        return np.asarray(axes @ inertia @ axes.T)
    return spatial_inertia(station.mass, station.center, station.inertia)


def _stiffness(data: BeamData, shapes: StrainShapes, count: int, factors: Array) -> Array:
    """Integral of B^T diag(factors) C B, exact for polynomials and constant pieces.

    `factors` are one, or six by strain.
    """
    x, weights = gauss_sections(data.breaks, max(count, 2) * (len(data.breaks) - 1))
    stiffness = np.zeros((len(x), 6))
    for direction in shapes.coefficients:
        pieces = direction_stiffness(data, direction)
        stiffness[:, STRAIN_ROWS[direction][0]] = pieces[data.piece(x)]
    stiffness *= factors
    strains = shapes.values_at(x)
    return np.asarray(np.einsum("m,mi,mik,mil->kl", weights, stiffness, strains, strains))


def _moments(stations: tuple[Station, ...], chain: SegmentChain) -> Moments:
    """Moments of first order at rest, about the supported section."""
    n = chain.shapes.n
    mass, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    c, e, f = np.zeros((3, n)), np.zeros((3, 3, n)), np.zeros((3, 3, n, n))
    levi_civita = np.zeros((3, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        levi_civita[i, j, k], levi_civita[i, k, j] = 1.0, -1.0
    for station, r, d, twist in zip(stations, *chain.at_rest, strict=True):
        center = d + r @ station.center
        inertia = r @ station.inertia @ r.T
        spread = np.trace(inertia) / 2 * np.eye(3) - inertia
        turn = r @ twist[3:]
        shift = r @ twist[:3] + np.cross(turn, r @ station.center, axis=0)
        rotated = np.einsum("aij,ik->ajk", levi_civita, turn)  # of a point of the slice, per mode
        mass += station.mass
        first += station.mass * center
        second += station.mass * np.outer(center, center) + spread
        c += station.mass * shift
        e += station.mass * np.einsum("a,bk->abk", center, shift)
        e += np.einsum("aj,bjk->abk", spread, rotated)
        f += station.mass * np.einsum("ak,bl->abkl", shift, shift)
        f += np.einsum("ajk,bil,ji->abkl", rotated, rotated, spread)
    return Moments(mass, first, second, c, e, f, np.zeros((3, n, n)), np.zeros((3, 3, n, n)))


# --- ends and loads -------------------------------------------------------------------------------


def _ports(setting: ExactBeamSetting, chain: SegmentChain) -> dict[str, ModalPort]:
    """Ends with the linear fields of the beam at rest, axes of the supported section."""
    n, ports = chain.shapes.n, {}
    zeros = np.zeros((3, n))
    for name, (x, rotation) in setting.data.ends.items():
        r, d, phi, theta = np.eye(3), np.zeros(3), zeros, zeros
        if x != setting.start:
            index = len(chain.x) + setting.ends.index(name)
            r, d, twist = (values[index] for values in chain.at_rest)
            phi, theta = r @ twist[:3], r @ twist[3:]
        ports[name] = ModalPort(d, r @ rotation, phi, theta, np.zeros((6, n, n)))
    return ports


def _line_loads(
    setting: ExactBeamSetting, stations: tuple[Station, ...]
) -> dict[str, tuple[tuple[int, float], ...]]:
    """Indices of stations and lengths (m) on which each load per length acts."""
    loads = {}
    indices = {station.x: k for k, station in enumerate(stations) if not station.end}
    for name, span in setting.spans.items():
        lengths = {x: stations[k].length for x, k in indices.items()}
        if span != (0.0, setting.data.length):
            x, weights = gauss_sections(span, setting.station_count)
            lengths = dict(zip(x.tolist(), weights.tolist(), strict=True))
        loads[name] = tuple((indices[x], length) for x, length in lengths.items() if length)
    return loads
