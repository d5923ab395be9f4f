"""Conversion of linear models to python-control (extra: control), with signal names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.optional_packages import missing_package_error

from .harmonic.steady_states import check_steady_outputs
from .input_channels import Channel, some_names
from .outputs.linear_outputs import outputs_of, rows_of
from .state_space import StateSpace


def output_matrices(
    linear: StateSpace, outputs: Sequence[str] | None, pushes: Sequence[Channel], b: Array
) -> tuple[tuple[str, ...], Array, Array]:
    """Output names, C (outputs, states) and D (outputs, pushes) of y = C z + D v.

    `b` (states, pushes) is the input matrix of d/dt z.
    """
    named = None if outputs is None else some_names("outputs", outputs)
    shown = outputs_of(linear, named)
    check_steady_outputs(linear, shown)
    c, d = linear.state_output_matrices(rows_of(linear, shown, pushes), b)
    return tuple(quantity.name for quantity in shown), c, d


def to_control(linear: StateSpace, outputs: Sequence[str] | None, disturbances: bool) -> Any:
    """Model as a `control.StateSpace`; see `Linear.to_control`."""
    try:
        import control
    except ImportError as error:
        raise missing_package_error("control", "a system for python-control", error) from None
    b, pushes = linear.B, linear.input_channels
    if disturbances:
        b, pushes = np.hstack([b, linear.B_disturbances]), (*pushes, *linear.disturbance_channels)
    if not pushes:
        raise SceneError(
            'the model has no inputs; give inputs, as in linearize(inputs=["shoulder.effort"])'
        )
    names, c, d = output_matrices(linear, outputs, pushes, b)
    return control.ss(
        linear.A, b, c, d, states=list(map(_signal, linear.state_names)),
        inputs=[_signal(entry.name) for entry in pushes], outputs=list(map(_signal, names)),
    )  # fmt: skip


def _signal(name: str) -> str:
    """Signal name without dots, which separate system and signal names in python-control."""
    return name.replace(".", "_").replace("[", "_").replace("]", "")
