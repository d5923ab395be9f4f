"""Scenes of one beam for the tests of its numbers."""

from __future__ import annotations

from typing import Any

from mstmm.runtime.flexible.flexible_bodies import modal_bodies
from mstmm.runtime.flexible.modal_body import ModalBody
from mstmm.scene import Scene

HELD: dict[str, Any] = {"type": "fixed"}
FREE: dict[str, Any] = {"type": "free"}
PIN: dict[str, Any] = {"type": "pin"}


def scene_of(hinge: dict[str, Any], at: str = "b", more: dict[str, Any] | None = None,
             **beam: Any) -> Scene:  # fmt: skip
    """A beam "b" (length 1, mass 1, EI 1 unless said) on a hinge "h" of the ground."""
    table = {
        "name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
        "polar_inertia_per_length": 1e-6, "modes": {"y": 3}, **beam,
    }  # fmt: skip
    more = dict(more or {})
    hinges = [{"name": "h", "inboard": "ground", "outboard": at, **hinge}, *more.pop("hinge", ())]
    return Scene(gravity=[0, 0, 0], beam=[table], hinge=hinges, **more)


def body_of(hinge: dict[str, Any], at: str = "b", more: dict[str, Any] | None = None,
            **beam: Any) -> ModalBody:  # fmt: skip
    """The numbers of the beam of `scene_of`."""
    return modal_bodies(scene_of(hinge, at, more, **beam))["b"]
