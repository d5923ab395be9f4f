"""The classical product for a scene: generated kernels at 50 digits, chained by mpmath.

Geometry, loads and efforts come from the reference formulation, not from the engine.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from mstmm.ir import KernelIR
from mstmm.ir.element_spec import builtin_kernel
from tests.reference import laws
from tests.reference import newton_euler as dense
from tests.reference.jets import Array
from tests.reference.tree import Hinge, Tree, read
from tests.support.classical.classical_kernels import (
    chain_accelerations,
    run_precisely,
    spatial_inputs,
)
from tests.support.classical.dense_chain import Body

KERNELS = {"pin": "pin_spatial", "ball": "ball", "elastic": "acceleration"}


@cache
def generated_kernel(name: str) -> KernelIR:
    """The stored kernel of a classical matrix."""
    return builtin_kernel(f"classical_{name}", "transfer")


@dataclass(frozen=True)
class _Link:
    """A hinge with what its matrix needs, inertial axes."""

    hinge: Hinge
    axis: Array
    offset: Array
    effort: Array


class SceneProduct:
    """A chain of one hinge type in one state."""

    def __init__(self, scene: Mapping[str, Any], q: Array, u: Array, t: float) -> None:
        self.tree, self.q, self.u, self.t = read(scene), q, u, t
        self.at = dense.motion(self.tree, q, u)
        self.links = [self._link(self.tree.hinges[k]) for k in self.tree.order]
        self.wrenches = laws.external_wrenches(self.tree, self.at, q, u, t)

    def _link(self, hinge: Hinge) -> _Link:
        outboard = self.at.A[hinge.child] @ hinge.Rp
        offset = dense.relative(hinge, self.q, self.u).d
        effort = laws.hinge_effort(self.tree, hinge, self.q, self.u, self.t)
        if hinge.type != "pin":
            effort = (outboard @ effort.reshape(-1, 3).T).T.ravel()
        return _Link(
            hinge, outboard @ hinge.axis, self.at.A[hinge.parent] @ hinge.Ro @ offset, effort
        )

    def _body(self, k: int) -> Body:
        hinge = self.links[k].hinge
        number, turned = hinge.child, self.at.A[hinge.child]
        body = self.tree.bodies[number]
        last = k + 1 == len(self.links)
        output = np.zeros(3) if last else self.links[k + 1].hinge.ro - hinge.rp
        wrench = self.wrenches[number]
        return Body(
            body.mass, turned @ output, turned @ (body.center - hinge.rp),
            turned @ body.inertia @ turned.T, self.at.w[number], wrench[:3], wrench[3:],
        )  # fmt: skip

    def _elements(self) -> list[tuple[Any, Any]]:
        elements = []
        for k, link in enumerate(self.links):
            outboard = run_precisely(
                generated_kernel("body_spatial"), **spatial_inputs(self._body(k))
            )
            last = k + 1 == len(self.links)
            following = link if last else self.links[k + 1]
            values = {
                "a": link.axis, "u": self.u[link.hinge.u], "omega_I": self.at.w[link.hinge.parent],
                "a_n": following.axis, "d": link.offset,
                "d_n": 0 * link.offset if last else following.offset,
                "tau_n": 0 * link.effort if last else following.effort,
            }  # fmt: skip
            kernel = generated_kernel(KERNELS[link.hinge.type])
            wanted = {port.name for port in kernel.inputs}
            values = {name: value for name, value in values.items() if name in wanted}
            elements.append((run_precisely(kernel, **outboard, **values)["U_h"], outboard["U"]))
        return elements

    def accelerations(self) -> Array:
        """[acceleration of the input end; angular acceleration] per body, root to tip."""
        first = self.links[0]
        rows = {
            "pin": np.append(first.axis, np.zeros(3))[None, :],
            "ball": np.eye(3, 6),
            "elastic": _at_root(first.offset),
        }
        found = chain_accelerations(
            self._elements(), rows[first.hinge.type], [float(e) for e in first.effort]
        )
        return np.array(found)


def _at_root(offset: Array) -> Array:
    """(q, m - offset x q) from (m, q)."""
    out = np.zeros((6, 6))
    out[:3, 3:] = out[3:, :3] = np.eye(3)
    out[3:, 3:] = -np.column_stack([np.cross(offset, e) for e in np.eye(3)])
    return out


def chain_bodies(tree: Tree) -> list[str]:
    """Outboard ends of the hinges, root to tip, as references of the scene."""
    names = []
    for k in tree.order:
        hinge = tree.hinges[k]
        body = tree.bodies[hinge.child]
        ends = [name for name, end in body.ends.items() if end[0] is hinge.rp]
        names.append(".".join([body.name, *ends]))
    return names
