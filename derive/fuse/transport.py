"""Transport between two frames of a fused scene: of bias motion, of S and e, and of deviations.

A stage is the way from an inboard frame to an outboard one: rotation R (outboard to inboard axes)
and position d of the outboard origin, inboard axes.  A body has a constant stage to the inboard
hinge axes and the hinge's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from mstmm.ir.graph import Node
from mstmm.ir.structure import BodyStructure, Entries

from .inline import Nodes

#: Axes of which the sweep has screws; a turn about y is carried as any other.
AXES = ("x", "", "z")


class Fusion(Protocol):
    """What a stage needs of the fused sweep."""

    zero: Node

    def entries(self, entries: Entries) -> Nodes: ...
    def identity(self) -> Nodes: ...
    def zeros(self, count: int) -> Nodes: ...
    def sweep(self, nu: int, name: str, **inputs: Sequence[Node]) -> dict[str, Nodes]: ...
    def screw(self, name: str, **inputs: Sequence[Node]) -> dict[str, Nodes]: ...


class Stage:
    """One stage.

    S is carried across a screw by plain products: the double angle costs fewer operations, but
    takes the small moments behind a long chain from differences of large ones.
    """

    def __init__(self, fusion: Fusion, rotation: Nodes, position: Nodes) -> None:
        self.fusion, self.rotation, self.position = fusion, rotation, position

    def motion(self, motion: Nodes) -> Nodes:
        """Bias motion (w, wd, rdd) of the outboard frame, at rest in the inboard one."""
        f = self.fusion
        return f.sweep(
            0, "forward", Rt=self.rotation, ro=self.position, R=f.identity(), d=f.zeros(3), H=(),
            v=f.zeros(3), w=f.zeros(3), c=f.zeros(6), s=(), motion_I=motion,
        )["motion"]  # fmt: skip

    def motion_behind_hinge(self, motion: Nodes, hinge: dict[str, Nodes], s: Nodes) -> Nodes:
        """Bias motion of the body behind the hinge whose stage this is."""
        f = self.fusion
        arrays = {name: hinge[name] for name in ("R", "d", "H", "v", "w", "c")}
        return f.sweep(
            len(s), "forward", Rt=f.identity(), ro=f.zeros(3), **arrays, s=s, motion_I=motion
        )["motion"]

    def carried(self, w: Nodes) -> Nodes:
        """A rate of rotation in outboard axes."""
        return self.motion([*w, *self.fusion.zeros(6)])[:3]

    def condense(self, inertia: Nodes, load: Nodes) -> tuple[Nodes, Nodes]:
        """X^T S X and X^T e."""
        f, axis = self.fusion, self._screw_axis()
        if axis:
            k = AXES.index(axis)
            i, j = (k + 1) % 3, (k + 2) % 3
            found = f.screw(
                f"condense_{axis}", turn=[self.rotation[4 * i], self.rotation[3 * j + i]],
                d=[self.position[k]], S=inertia, e=load,
            )  # fmt: skip
            return found["S_I"], found["e_I"]
        rotation = self.rotation
        if all(entry.value is None for entry in rotation):
            turned = f.screw("condense_turn_by_trace", Rc=rotation, S=inertia, e=load)
            inertia, load, rotation = turned["S_I"], turned["e_I"], f.identity()
        found = f.sweep(
            0, "condense", Rc=rotation, r=self.position, H=(), J=(), floor=f.zeros(2), S=inertia,
            e=load, tau=(),
        )  # fmt: skip
        return found["S_I"], found["e_I"]

    def _screw_axis(self) -> str:
        """Axis about which this stage is a screw, "" if none or if the plain product folds."""
        for k, axis in enumerate(AXES):
            if not axis:
                continue
            others = [n for n in range(3) if n != k]
            cross = [self.rotation[3 * k + n] for n in others]
            cross += [self.rotation[3 * n + k] for n in others]
            aside = [self.position[n] for n in others]
            turns = self.rotation[4 * others[0]].value not in (0, 1, -1)
            if turns and all(x.value == 0 for x in (*cross, *aside)):
                return axis
        return ""

    def keeps(self, subspace: Nodes) -> bool:
        """Whether this stage is a screw about z that leaves a subspace along z as it is.

        Then the hinge can be eliminated behind the stage, in inboard axes, which takes the turn out
        of the chain of divisions.
        """
        nu = len(subspace) // 6
        aside = [subspace[row * nu + k] for row in (0, 1, 3, 4) for k in range(nu)]
        return nu > 0 and self._screw_axis() == "z" and all(x.value == 0 for x in aside)

    def still(self) -> Stage:
        """A stage without rotation and shift."""
        return Stage(self.fusion, self.fusion.identity(), self.fusion.zeros(3))

    def delta(self, delta: Nodes) -> Nodes:
        """X delta: deviation of the outboard frame, at rest in the inboard one."""
        found = self.fusion.sweep(
            0, "recover", Rc=self.rotation, r=self.position, H=(), G=(), g=(), delta_I=delta
        )
        return found["delta"]

    def delta_behind_hinge(
        self, delta: Nodes, subspace: Nodes, eliminated: dict[str, Nodes]
    ) -> tuple[Nodes, Nodes]:
        """(udot, deviation of the body behind the hinge) from what its elimination left."""
        if not subspace:
            return [], self.delta(delta)
        arrays = {name: eliminated[name] for name in ("F", "Z", "z", "W")}
        found = self.fusion.sweep(
            len(subspace) // 6, "recover_factored", Rc=self.rotation, r=self.position, H=subspace,
            delta_I=delta, **arrays,
        )  # fmt: skip
        return found["udot"], found["delta"]


def stages_of(fusion: Fusion, body: BodyStructure, hinge: dict[str, Nodes]) -> tuple[Stage, ...]:
    """Constant stages from the parent's frame to the inboard hinge axes, then the hinge's own."""
    if body.link:
        cosine, sine, shift, _, _ = fusion.entries(body.link)
        rotation, position = fusion.identity(), fusion.zeros(3)
        rotation[4], rotation[5], rotation[7], rotation[8] = cosine, -sine, sine, cosine
        position[0] = shift
    else:
        rotation, position = fusion.entries(body.rotation), fusion.entries(body.position)
    return Stage(fusion, rotation, position), Stage(fusion, hinge["R"], hinge["d"])
