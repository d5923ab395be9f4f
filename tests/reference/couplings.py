"""Rows of couplings by Taylor arithmetic, along the motion in which no speed changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import hinges as kinematics
from . import jets
from .expressions import evaluate
from .jets import Array, Jet
from .tree import Tree

_FUNCTIONS = {name: getattr(jets, name) for name in ("sin", "cos", "sqrt")}


def rows(
    couplings: Sequence[Mapping[str, Any]], tree: Tree, q: Array, u: Array, t: float = 0.0
) -> tuple[Array, Array, Array]:
    """C (rows, nu), the drift (rows,) and the slip (rows,) at a state."""
    speeds = np.vstack([u, 0 * u, np.eye(tree.nu)])
    scope: dict[str, Any] = {"t": Jet(np.full(len(speeds), t), 1.0)}
    for hinge in tree.hinges:
        own = speeds[:, hinge.u]
        motion = kinematics.coordinate_jet(hinge, q[hinge.q], own, 0 * own)
        scope[f"{hinge.name}.q"] = [motion[:, k] for k in range(motion.x.shape[1])]
        scope[f"{hinge.name}.u"] = [Jet(one) for one in own.T]
    found = [_levels(one, scope) for one in couplings]
    slips = np.array([slip for slip, _ in found]).reshape(-1, len(speeds))
    drifts = np.array([drift for _, drift in found]).reshape(-1, len(speeds))
    return slips[:, 2:] - slips[:, 1:2], drifts[:, 0], slips[:, 0]


def _levels(one: Mapping[str, Any], scope: Mapping[str, Any]) -> tuple[Array, Array]:
    """phi' and phi'' of a row, or of one of speeds its value and rate."""
    text = one.get("expression", one.get("speeds"))
    lack = jets.as_jet(evaluate(text, scope, _FUNCTIONS))
    lack = lack - evaluate(one.get("equals", 0), {"t": scope["t"]}, _FUNCTIONS)
    return (lack.x, lack.dx) if "speeds" in one else (lack.dx, lack.ddx)
