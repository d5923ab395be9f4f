"""A scene as a MuJoCo model, through MJCF: all hinge types but the screw; free hinges on ground.

The frame of a MuJoCo body is the outboard end of its hinge.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np

from tests.reference import laws
from tests.reference import newton_euler as dense
from tests.reference.algebra import quaternion_matrix, to_quaternion, triad
from tests.reference.jets import as_jet
from tests.reference.tree import Hinge, Tree, read

TYPES = ("fixed", "pin", "prismatic", "cylindrical", "universal", "ball", "planar", "gimbal")


def _text(values: Any) -> str:
    return " ".join(repr(float(v)) for v in np.ravel(values))


def _joints(hinge: Hinge) -> list[tuple[str, Any]]:
    """(type, axis) of the joints of one hinge, from the inboard side."""
    a, kind = hinge.axis, hinge.type
    e1, e2, n = triad(a, hinge.axis2 if kind == "planar" else None).T
    x, y, z = np.eye(3)
    joints: dict[str, list[tuple[str, Any]]] = {
        "fixed": [],
        "pin": [("hinge", a)],
        "prismatic": [("slide", a)],
        "cylindrical": [("slide", a), ("hinge", a)],
        "universal": [("hinge", a), ("hinge", hinge.axis2)],
        "ball": [("ball", None)],
        "planar": [("slide", e1), ("slide", e2), ("hinge", n)],
        "gimbal": [("hinge", z), ("hinge", y), ("hinge", x)],
        "free": [("free", None)],
        "elastic": [("free", None)],
    }
    return joints[kind]


class MujocoPeer:
    """Forward dynamics and mass matrix of a scene by MuJoCo, in the scene's q and u."""

    def __init__(
        self, scene: Mapping[str, Any] | Tree, meeting: Sequence[tuple[str, str]] = ()
    ) -> None:
        """`meeting`: pairs of ends of bodies that equality constraints keep together."""
        self.tree, self.meeting = read(scene), meeting
        root = ElementTree.Element("mujoco")
        ElementTree.SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
        ElementTree.SubElement(root, "option", gravity=_text(self.tree.gravity))
        nodes = {-1: ElementTree.SubElement(root, "worldbody")}
        for number in self.tree.order:
            hinge = self.tree.hinges[number]
            nodes[hinge.child] = self._body(nodes[hinge.parent], hinge)
        equality = ElementTree.SubElement(root, "equality")
        for k in range(len(meeting)):
            ElementTree.SubElement(
                equality, "connect", site1=f"{k}:0", site2=f"{k}:1", solimp="0.9999 0.9999 0.001"
            )
        self.model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, "unicode"))
        self.data = mujoco.MjData(self.model)
        self.model.dof_armature[:] = self.speeds(
            np.concatenate([np.zeros(0), *map(laws.reflected_inertia, self.tree.hinges)])
        )
        mujoco.mj_setConst(self.model, self.data)

    def _body(self, parent: Any, hinge: Hinge) -> Any:
        tree, body = self.tree, self.tree.bodies[hinge.child]
        if hinge.parent < 0:
            place, frame = hinge.ro, hinge.Ro
        else:
            held = next(h for h in tree.hinges if h.child == hinge.parent)
            place, frame = held.Rp.T @ (hinge.ro - held.rp), held.Rp.T @ hinge.Ro
        node = ElementTree.SubElement(
            parent, "body", name=body.name, pos=_text(place), quat=_text(to_quaternion(frame))
        )
        tensor = hinge.Rp.T @ body.inertia @ hinge.Rp
        entries = [tensor[i] for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        center = hinge.Rp.T @ (body.center - hinge.rp)
        ElementTree.SubElement(
            node, "inertial", pos=_text(center), mass=_text(body.mass), fullinertia=_text(entries)
        )
        for k, i in np.ndindex(len(self.meeting), 2):
            number, end, _ = tree.end(self.meeting[k][i])
            if number == hinge.child:
                where = _text(hinge.Rp.T @ (end - hinge.rp))
                ElementTree.SubElement(node, "site", name=f"{k}:{i}", pos=where)
        for i, (kind, axis) in enumerate(_joints(hinge)):
            joint = ElementTree.SubElement(node, "joint", name=f"{hinge.name}:{i}", type=kind)
            if axis is not None:
                joint.set("axis", _text(axis))
        return node

    def _places(self, hinge: Hinge) -> tuple[int, int]:
        """First place of the hinge in qpos and qvel."""
        joint = self.model.joint(f"{hinge.name}:0")
        return int(joint.qposadr[0]), int(joint.dofadr[0])

    @staticmethod
    def _reorder_gimbal(hinge: Hinge, values: Any) -> Any:
        return values[::-1] if hinge.type == "gimbal" else values

    def _moving(self) -> list[Hinge]:
        return [h for h in self.tree.hinges if h.type != "fixed"]

    def coordinates(self, q: Any) -> Any:
        """qpos; that of a free joint is the pose in the world."""
        out = np.zeros(self.model.nq)
        for hinge in self._moving():
            place, _ = self._places(hinge)
            value = self._reorder_gimbal(hinge, q[hinge.q])
            if hinge.type in ("free", "elastic"):
                turned = hinge.Ro @ quaternion_matrix(as_jet(value[3:])).x
                value = np.concatenate([hinge.ro + hinge.Ro @ value[:3], to_quaternion(turned)])
            out[place : place + len(value)] = value
        return out

    def _axes(self, hinge: Hinge, q: Any) -> Any:
        """Outboard axes of a free hinge in the world: MuJoCo's linear velocity is in world axes."""
        return hinge.Ro @ quaternion_matrix(as_jet(q[hinge.q][3:])).x

    def speeds(self, u: Any, q: Any = None) -> Any:
        """qvel (with q, for free hinges), or efforts and armatures in the same places."""
        out = np.zeros(self.model.nv)
        for hinge in self._moving():
            _, place = self._places(hinge)
            value = np.array(self._reorder_gimbal(hinge, u[hinge.u]))
            if hinge.type in ("free", "elastic") and q is not None:
                value[:3] = self._axes(hinge, q) @ value[:3]
            out[place : place + len(value)] = value
        return out

    def back(self, qacc: Any, q: Any, u: Any) -> Any:
        """udot: of a free hinge from the acceleration in world axes."""
        out = np.zeros(self.tree.nu)
        for hinge in self._moving():
            _, place = self._places(hinge)
            own = u[hinge.u]
            value = np.array(qacc[place : place + len(own)])
            if hinge.type in ("free", "elastic"):
                value[:3] = self._axes(hinge, q).T @ value[:3] - np.cross(own[3:], own[:3])
            out[hinge.u] = self._reorder_gimbal(hinge, value)
        return out

    def accelerations(self, q: Any, u: Any, t: float = 0.0) -> Any:
        """udot, the laws' efforts and external loads taken from the reference."""
        tree, data = self.tree, self.data
        data.qpos[:], data.qvel[:] = self.coordinates(q), self.speeds(u, q)
        effort = [laws.hinge_effort(tree, hinge, q, u, t) for hinge in tree.hinges]
        data.qfrc_applied[:] = self.speeds(np.concatenate([np.zeros(0), *effort]), q)
        at = dense.motion(tree, q, u)
        wrenches = laws.external_wrenches(tree, at, q, u, t)
        for i, body in enumerate(tree.bodies):
            wrenches[i, :3] -= body.mass * tree.gravity
            data.xfrc_applied[self.model.body(body.name).id] = wrenches[i]
        mujoco.mj_forward(self.model, data)
        return self.back(data.qacc, q, u)

    def mass_matrix(self, q: Any) -> Any:
        """Inertia in the scene's speeds (scenes without free hinges)."""
        self.data.qpos[:] = self.coordinates(q)
        mujoco.mj_forward(self.model, self.data)
        full = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, full)
        still = np.zeros(self.tree.nu)
        columns = np.array([self.back(column, q, still) for column in full])
        columns = columns.reshape(self.model.nv, self.tree.nu)
        return np.array([self.back(row, q, still) for row in columns.T])
