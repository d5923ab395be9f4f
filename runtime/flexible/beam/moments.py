"""Integrals over a beam: the generated integrands by Gauss quadrature along its pieces."""

from __future__ import annotations

import numpy as np

from ..modal_body import Array, Moments
from . import kernels as beam_kernels
from .beam_shapes import BeamShapes, slices, without_noise


def mass_moments(shapes: BeamShapes) -> Moments:
    """Moments of the mass, with what bending and twist turn of the sections' inertia."""
    x, w = shapes.rule()
    return _moments(shapes, shapes.data.inertia[:, shapes.data.piece(x)], x, w)


def drag_moments(shapes: BeamShapes) -> Moments | None:
    """Moments of the viscous drag per length, which acts on the axis alone; None without drag."""
    if shapes.data.drag == 0.0:
        return None
    x, w = shapes.rule()
    density = np.zeros((3, len(x)))
    density[0] = shapes.data.drag
    return _moments(shapes, density, x, w)


def stiffness(shapes: BeamShapes) -> Array:
    """K (n, n) from the strain energy."""
    x, w = shapes.rule()
    data = shapes.data.stiffness[:, shapes.data.piece(x)]
    k = _integrals(shapes, "stiffness", data, x, w)["K"][0]
    k = (k + k.T) / 2
    size = np.sqrt(np.abs(np.diag(k)))
    return without_noise(k, np.outer(size, size))


def _integrals(shapes: BeamShapes, what: str, data: Array, x: Array, w: Array) -> dict[str, Array]:
    """Integrals of the kernel of two shapes; `data` are inertia or stiffness (., m) of the
    sections.  Taken in parts: all pairs of many shapes at all points fill gigabytes."""
    total: dict[str, Array] = {}
    for some in slices(len(x), shapes.n**2):
        inputs = _inputs(shapes, x[some])
        inputs[what] = data[:, None, None, some]
        for name, values in beam_kernels.evaluate("moments", inputs).items():
            part = values @ w[some]
            total[name] = total[name] + part if name in total else part
    return total


def _inputs(shapes: BeamShapes, x: Array) -> dict[str, Array]:
    """Inputs of the kernel of two shapes for all pairs k, l at all x; section data are zero."""
    values, slopes, bends = (shapes.rows(x, d) for d in range(3))
    rows = {
        "axis": values[:3],
        "turn": shapes.carried(slopes, values[3]),
        "strain": np.stack([slopes[0], slopes[3], bends[2], bends[1]]),
    }
    inputs = {"inertia": np.zeros((3, 1)), "stiffness": np.zeros((4, 1))}
    inputs["x"] = x[None, None, None, :]
    for name, array in rows.items():
        inputs[f"{name}_k"], inputs[f"{name}_l"] = array[:, :, None, :], array[:, None, :, :]
    return inputs


def _moments(shapes: BeamShapes, density: Array, x: Array, w: Array) -> Moments:
    rigid = beam_kernels.evaluate("rigid", {"x": x[None, :], "inertia": density})
    mass = float(rigid["mass"][0] @ w)
    first = rigid["first"] @ w
    second = _symmetric(rigid["second"] @ w)
    found = _integrals(shapes, "inertia", density, x, w)
    c, e, f = found["C"][:, :, 0], found["E"][:, :, :, 0], found["F"]
    modal = np.sqrt(np.abs(np.einsum("aakk->k", f)))
    lever = np.sqrt(np.abs(np.diag(second)))
    g, moment = _second_order(shapes, rigid["mass"][0] * w, rigid["first"][0] * w, x)
    return Moments(
        mass=mass,
        first=first,
        second=second,
        C=without_noise(c, np.sqrt(mass) * modal),
        E=without_noise(e, lever[:, None, None] * modal),
        F=without_noise(f, np.outer(modal, modal)),
        G=g,
        X=moment,
    )


def _second_order(shapes: BeamShapes, mass: Array, first: Array, x: Array) -> tuple[Array, Array]:
    """G and X: the shortening is along x, and so is the lever of every axis point."""
    n = shapes.n
    g, moment = np.zeros((3, n, n)), np.zeros((3, 3, n, n))
    if shapes.stiffening and n:
        along = shapes.at(x).shortening
        largest = np.abs(along).max(axis=0)
        size = np.sqrt(np.outer(np.diag(largest), np.diag(largest)))
        total, lever = np.einsum("m,mkl->kl", mass, along), np.einsum("m,mkl->kl", first, along)
        g[0] = without_noise((total + total.T) / 2, mass.sum() * size)
        moment[0, 0] = without_noise((lever + lever.T) / 2, np.abs(first).sum() * size)
    return g, moment


def _symmetric(upper: Array) -> Array:
    """3 x 3 from its upper triangle, row by row."""
    full = np.zeros((3, 3))
    full[np.triu_indices(3)] = upper
    return full + np.triu(full, 1).T
