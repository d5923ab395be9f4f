"""Linear models of spinning rotors in the fixed frame.

Perturbations x of coordinates outboard of a spinning hinge rotate with the rotor.  At steady spin
their displacements in inertial axes, twists d = P(t) x of all bodies, rotate too.  Where
P(t) = P(0) T(t) with T(t) = exp(W t), the perturbations in the fixed frame are y = T x, with
d = P(0) y.  They obey

    M y'' + (C - 2 M W) y' + (K - C W + M W^2) y = inputs,

with the matrices of x at t = 0.  The coefficients are constant for axisymmetric rotors on any
supports: T^-T M(t) T^-1 = M(0), and likewise for C and K.  Both conditions are checked at a later
state of the motion.  Coordinates of three or more equal blades use the W of multi-blade
coordinates.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import logm

from mstmm.array_validation import Array, Integers
from mstmm.display import abbreviate_names
from mstmm.errors import SceneError

from .blades import find_blades
from .displacements import displacements
from .frame_transform import FrameTransform
from .later_equations import SAME, later_equations, later_state

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

#: Relative tolerance for equal displacements; relative size of matrix entries that are rounding.
_ALIKE, _ROUNDING = 1e-7, 1e-11
#: Relative singular value of displacements below which a perturbation is unobservable.
_SEEN = 1e-9


def frame_of(linear: LinearEquations) -> str:
    """Frame of the perturbations: "rotating" if they rotate with spinning bodies, else "fixed"."""
    return "rotating" if _is_rotating(linear) else "fixed"


def _is_rotating(linear: LinearEquations) -> bool:
    if linear.frame_transform is not None or not len(linear) or not linear.state.u.any():
        return False
    now, then = (displacements(linear, state) for state in (linear.state, later_state(linear)))
    return bool(np.abs(then - now).max() > _ALIKE * np.abs(now).max(initial=0))


def fixed_frame_transform(linear: LinearEquations) -> FrameTransform:
    """Transformation to the fixed frame at the operating point of a linear model.

    Raises SceneError with the reason where the rotor is not axisymmetric.
    """
    there = later_equations(linear)
    dt = there.state.t - linear.state.t
    blades, rates = find_blades(linear), np.zeros((len(linear), len(linear)))
    is_outside_blades = np.ones(len(linear), dtype=bool)
    for group in blades:
        is_outside_blades[group.coordinates] = False
        for blade_columns in group.coordinates.T:
            rates[np.ix_(blade_columns, blade_columns)] = group.rates
    if is_outside_blades.any():
        turned = _later_rotation(linear, there, np.flatnonzero(is_outside_blades))
        rates[np.ix_(is_outside_blades, is_outside_blades)] = np.real(logm(turned)) / dt
    rates[np.abs(rates) < _ROUNDING * np.abs(rates).max(initial=0)] = 0.0
    carrying = FrameTransform(np.eye(len(linear)), rates)
    _check_constant_matrices(replace(linear, frame_transform=carrying))
    return carrying


def _later_rotation(
    linear: LinearEquations, there: LinearEquations, perturbations: Integers
) -> Array:
    """T (m, m) at the later state `there`, for `perturbations` (m,) outside blades."""
    now = displacements(linear, linear.state)[:, perturbations]
    then = displacements(there, there.state)[:, perturbations]
    size = np.linalg.norm(now, axis=0)
    unit = now / np.where(size > 0, size, 1.0)
    singular = np.linalg.svd(unit, compute_uv=False)
    if not size.all() or singular.min(initial=np.inf) < _SEEN * singular.max(initial=0):
        raise _no_frame("displacements of its bodies' ends do not determine its coordinates")
    rotation = np.linalg.lstsq(unit, then, rcond=None)[0]
    left = np.abs(unit @ rotation - then).max(axis=0) / np.linalg.norm(then, axis=0)
    if (left > _ALIKE).any():
        names = [linear.coordinate_names[k] for k in perturbations[left > _ALIKE]]
        raise _no_frame(
            f"the displacements by {abbreviate_names(names)} change their shape during rotation"
        )
    return np.asarray(rotation / size[:, None])


def _check_constant_matrices(linear: LinearEquations) -> None:
    """Raise SceneError where the matrices of y change along the motion."""
    there = later_equations(linear)
    scale = 1 / np.sqrt(np.abs(np.diag(linear.M)))
    mass, stiff = (_largest(matrix, scale) for matrix in (linear.M, linear.K))
    assert linear.frame_transform is not None
    fastest = max(np.sqrt(stiff / mass), float(np.abs(linear.frame_transform.rates).max()))
    for name, floor in (("M", mass), ("C", mass * fastest), ("K", mass * fastest**2)):
        now, then = (getattr(x, name) * np.outer(scale, scale) for x in (linear, there))
        rows = np.maximum(np.abs(now).max(axis=0), np.abs(now).max(axis=1))
        allowed = SAME * np.sqrt(np.outer(rows, rows)) + _ROUNDING * max(rows.max(), floor)
        wrong = np.abs(now - then) > allowed
        if wrong.any():
            names = [linear.coordinate_names[k] for k in np.flatnonzero(wrong.any(axis=0))]
            raise _no_frame(f"{_NAMES[name]} of {abbreviate_names(names)} changes during rotation")


_NAMES = {"M": "the inertia", "C": "the damping or gyroscopic load", "K": "the stiffness"}


def _largest(matrix: Array, scale: Array) -> float:
    return float(np.abs(matrix * np.outer(scale, scale)).max(initial=0))


def _no_frame(why: str) -> SceneError:
    return SceneError(
        f"fixed frame: the rotor is not axisymmetric and has no three or more equal blades: {why}"
    )
