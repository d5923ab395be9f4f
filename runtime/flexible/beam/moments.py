"""Integrals over a beam: the generated integrands by Gauss quadrature along its pieces."""

from __future__ import annotations

import numpy as np

from ..modal_body import Array, Moments
from . import kernels as beam_kernels
from .beam_shapes import BeamShapes, without_noise
from .parts import slices


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
    sections."""
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
    g, moment = second_moments(shapes, density, x, w) if shapes.stiffening else _none(shapes.n)
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


def second_moments(shapes: BeamShapes, density: Array, x: Array, w: Array) -> tuple[Array, Array]:
    """G (3, n, n) and X (3, 3, n, n) of the second-order field under a density (3, m) at the points
    and weights of a quadrature."""
    g, lever = _none(shapes.n)
    for some in slices(len(x) if shapes.n else 0, 9 * shapes.n**2):
        found = beam_kernels.evaluate(
            "second_moments", _second_inputs(shapes, density[:, some], x[some])
        )
        g += found["G"] @ w[some]
        lever += found["X"] @ w[some]
    turned, length = shapes.second_scale, shapes.length
    arms = np.array([density[0] @ w * length**2, density[1] @ w, density[2] @ w])
    return (
        without_noise(_halved(g), density[0] @ w * length * turned),
        without_noise(_halved(lever), arms[:, None, None, None] * turned),
    )


def _second_inputs(shapes: BeamShapes, density: Array, x: Array) -> dict[str, Array]:
    second = shapes.second_order.at(x)
    turn = shapes.carried(shapes.rows(x, 1), shapes.rows(x, 0)[3])
    return {
        "x": x[None, None, None, :],
        "inertia": density[:, None, None, :],
        "turn_k": turn[:, :, None, :],
        "turn_l": turn[:, None, :, :],
        "g": np.moveaxis(second[:, :3], 0, 3),
        "h_turn": np.moveaxis(shapes.second_order.carried(second), 0, 3),
    }


def _halved(pairs: Array) -> Array:
    """Symmetric in the last two axes."""
    return (pairs + np.swapaxes(pairs, -1, -2)) / 2


def _none(n: int) -> tuple[Array, Array]:
    return np.zeros((3, n, n)), np.zeros((3, 3, n, n))


def _symmetric(upper: Array) -> Array:
    """3 x 3 from its upper triangle, row by row."""
    full = np.zeros((3, 3))
    full[np.triu_indices(3)] = upper
    return full + np.triu(full, 1).T
