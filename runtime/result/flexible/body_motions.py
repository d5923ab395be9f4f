"""Motions and section loads of the flexible bodies of a run."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.scene.checks.topology import inboard_hinges_by_body
from mstmm.scene.validators.validation_messages import did_you_mean

from .motion import Motion
from .section_loads import LineLoad, PointLoad

if TYPE_CHECKING:
    from mstmm.scene import Hinge, Load

    from ...engine.compiled_scene import CompiledScene
    from ...flexible.modal_body import ModalBody
    from ..observations import Observations


class FlexibleBodies:
    """Motions of the flexible bodies at the samples of a run, computed on first use."""

    def __init__(self, model: CompiledScene, observed: Observations) -> None:
        self.model, self.observations, self.run = model, observed, observed.run
        self.modal_bodies: Mapping[str, ModalBody] = model.flexible_bodies
        self.one_way: Collection[str] = ()  # one-way bodies, not part of the run
        self.unbalanced: Collection[str] = ()  # their end loads omit their vibration
        self._motions: dict[str, Motion] = {}

    def body(self, name: str, what: str) -> ModalBody:
        """Modal data of a flexible body; SceneError for a rigid or unknown body."""
        modal_body = self.modal_bodies.get(self.observations.references.canonical(name) or name)
        if modal_body is not None:
            return modal_body
        flexible_names = ", ".join(f'"{x}"' for x in self.modal_bodies)
        if name in self.observations.references:
            hint_text = (
                f"the flexible ones are {flexible_names}"
                if flexible_names
                else "the scene has none"
            )
            raise SceneError(f'"{name}": {what} exists for flexible bodies only; {hint_text}')
        hint = did_you_mean(name, self.modal_bodies)
        raise SceneError(f'"{name}": there is no such flexible body in the scene{hint}')

    def motion(self, name: str, what: str = "its motion") -> Motion:
        """Motion of one flexible body."""
        if name not in self._motions:
            body = self.body(name, what)
            slots = self.model.coordinate_layout.modal[name]
            points = self.observations.points(name)
            self._motions[name] = Motion(
                body, self.run.t, self.run.q[:, slots.q_slice], self.run.u[:, slots.u_slice],
                self.observations.columns("udot", (slots.u_slice,)), points[:, 0:3],
                points[:, 15:24].reshape(-1, 3, 3), points[:, 3:6], points[:, 9:12],
                points[:, 6:9], points[:, 12:15],
            )  # fmt: skip
        return self._motions[name]

    def coupled_start(self) -> tuple[CompiledScene, Array]:
        """Model in which all flexible bodies are coupled, and its q at the start of the run."""
        return self.model, self.run.first[1]

    @cached_property
    def gravity(self) -> Array:
        """Gravity (3,), m/s2, inertial axes."""
        return np.array(self.model.scene.gravity)

    # --- loads on a body ------------------------------------------------------------------------

    def inboard_end(self, name: str) -> str:
        """Name of the inboard end of a body."""
        hinge = self._holders.get(name)
        if hinge is None:
            raise SceneError(f'"{name}": this body has no inboard hinge')
        return hinge.outboard_end

    @cached_property
    def _holders(self) -> dict[str, Hinge]:
        return inboard_hinges_by_body(self.model.scene)

    def inboard_position(self, name: str) -> float:
        """Position x (m) of the section by which a beam is attached to the tree."""
        return float(self.modal_bodies[name].ports[self.inboard_end(name)].position[0])

    def load_at_end(self, name: str, end: str) -> tuple[Array, Array] | None:
        """External force and moment (n, 3) on a port, inertial axes; None if nothing is attached.

        Moments are about the section's point. Not available for the inboard end.
        """
        hinge_index = self.observations.engine.packed.hinge_position.get(f"{name}/{end}")
        if hinge_index is None:
            return None
        load = self.observations.columns("loads", (hinge_index,))
        return -load[:, :3], -load[:, 3:]

    def end_loads(self, name: str) -> dict[str, tuple[Array, Array]]:
        """External force and moment (n, 3) by port, inertial axes, except at the inboard end."""
        inboard_end, loads = self.inboard_end(name), dict[str, tuple[Array, Array]]()
        for port in self.modal_bodies[name].ports:
            load = None if port == inboard_end else self.load_at_end(name, port)
            if load is not None:
                loads[port] = load
        return loads

    def inboard_load(self, name: str) -> tuple[Array, Array]:
        """Force and moment (n, 3) of the inboard hinge on the inboard end, inertial axes.

        Moments are about the section's point.
        """
        hinge_index = self.observations.engine.packed.hinge_position[self._holders[name].name]
        load = self.observations.columns("loads", (hinge_index,))
        return load[:, :3], load[:, 3:]

    def point_loads(self, name: str) -> list[PointLoad]:
        """Concentrated loads on a beam, except at its inboard end."""
        body, line_load_names = (
            self.modal_bodies[name],
            {load.name for load in self._distributed_loads(name)},
        )
        result = []
        for port, load in self.end_loads(name).items():
            if port not in line_load_names:
                result.append(PointLoad(float(body.ports[port].position[0]), *load))
        return result

    def line_loads(self, name: str) -> list[LineLoad]:
        """Loads per length on a beam."""
        shapes, result = self.modal_bodies[name].shapes, []
        for load in self._distributed_loads(name):
            wrench = self.load_at_end(name, load.name)
            if shapes is not None and wrench is not None:
                first, last = load.span or (0.0, shapes.length)
                result.append(LineLoad(first, last, *wrench))
        return result

    def _distributed_loads(self, name: str) -> list[Load]:
        return [
            load for load in self.model.scene.load
            if load.on == name and load.force_per_length is not None
        ]  # fmt: skip
