"""Linear models for python-control (extra: control), with names of states, inputs and outputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.extras import missing

from .outputs import outputs_of, rows_of
from .state_space import StateSpace


def output_matrices(
    linear: StateSpace, outputs: Sequence[str] | None, pushes: Array
) -> tuple[tuple[str, ...], Array, Array]:
    """(names, C (outputs, 2 n), D (outputs, pushes)) of y = C (x, x') + D v, where `pushes` (2 n,
    k) is what v adds to d/dt (x, x')."""
    shown, n = outputs_of(linear, outputs), len(linear)
    places, rates, accelerations = rows_of(linear, shown)
    c, d = np.hstack([places, rates]), np.zeros((len(shown), pushes.shape[1]))
    if accelerations.any():
        c, d = c + accelerations @ linear.A[n:], accelerations @ pushes[n:]
    return tuple(one.name for one in shown), c, d


def to_control(linear: StateSpace, outputs: Sequence[str] | None, disturbances: bool) -> Any:
    """See `Linear.to_control`."""
    try:
        import control
    except ImportError as error:
        raise missing("control", "a system for python-control", error) from None
    b, inputs = linear.B, linear.inputs
    if disturbances:
        b, inputs = np.hstack([b, linear.B_disturbances]), (*inputs, *linear.disturbances)
    if not inputs:
        raise SceneError(
            'the model has no inputs: name some, as in linearize(inputs=["shoulder.effort"])'
        )
    names, c, d = output_matrices(linear, outputs, b)
    return control.ss(
        linear.A, b, c, d, states=list(map(_signal, linear.states)),
        inputs=list(map(_signal, inputs)), outputs=list(map(_signal, names)),
    )  # fmt: skip


def _signal(name: str) -> str:
    """A dot parts the names of systems and signals there."""
    return name.replace(".", "_").replace("[", "_").replace("]", "")
