"""Reader of MJCF files, by the model that MuJoCo compiles from them (extra `robot`).

The frame of a body is given in its parent.  Its joints, each about its own anchor, move it in
series.  The link of a body has its origin at the anchor of the last joint; the joints before it
move massless links.  Values of joints are MuJoCo's qpos.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ...errors import SceneError
from ...extras import missing
from ...numbers.pose import IN_PLACE, ZERO, Pose
from ...numbers.rotations import (
    Matrix,
    Vector,
    about,
    from_quaternion,
    product,
    transpose,
)
from .mjcf_files import Places
from .robot import (
    FIXED,
    NOTHING,
    Joint,
    Link,
    Look,
    Mimic,
    Note,
    Robot,
    color,
)

_FREE, _BALL, _SLIDE = 0, 1, 2
_HINGES = ("free", "ball", "prismatic", "pin")
#: Dynamic parts of a model that are left out, by the name of their count.
_LEFT = {
    "nu": "actuators", "nsensor": "sensors", "nplugin": "plugins", "nflex": "flexible parts",
    "nkey": "keyframes",
}  # fmt: skip
#: Parts that are left out one by one: their count, and their section of the file.
_NAMED = {
    "tendon": ("ntendon", "tendon"), "pair": ("npair", "contact"),
    "exclude": ("nexclude", "contact"),
}  # fmt: skip
_JOINT_EQUALITY = 2
#: Flags that are also switched off by "constraint".
_CONSTRAINTS = ("limit", "frictionloss", "equality")
#: Most characters quoted from a message of MuJoCo.
_LONGEST = 400
#: Number of geom groups that are drawn.
_SEEN = 3


def read_mjcf(path: str, where: str, places: Places | None = None) -> Robot:
    """Read a robot from an MJCF file.

    `where` is the name of the file in messages, `places` the locations of named elements.  Raises
    SceneError for files that MuJoCo does not compile, EnvironmentFailure without MuJoCo.
    """
    try:
        import mujoco
    except ImportError as error:
        raise missing("robot", f"{where}: MJCF", error) from None
    try:
        model = mujoco.MjModel.from_xml_path(path)
    except (ValueError, OSError, RuntimeError, MemoryError) as error:
        why = " ".join(str(error).split())
        why = why if len(why) <= _LONGEST else f"{why[:_LONGEST]}..."
        raise SceneError(f"{where}: MuJoCo cannot read the file: {why}") from None
    return _Reader(mujoco, model, where, places or {}).robot()


class _Reader:
    """Reader of a compiled MuJoCo model."""

    def __init__(self, mujoco: Any, model: Any, where: str, places: Places) -> None:
        self._mujoco, self._m, self._where, self._places = mujoco, model, where, places
        self._notes = list[Note]()
        #: Body -> pose of its frame in its link.
        self._frame = {0: IN_PLACE}

    def robot(self) -> Robot:
        """Read the robot of the model."""
        links, joints = [Link("world", where=self._where)], list[Joint]()
        for body in range(1, self._m.nbody):
            for link, joint in self._body(body):
                links.append(link)
                joints.append(joint)
        mimics = tuple(self._mimics())
        looks = tuple(self._looks())
        self._leave_out()
        return Robot(
            "", self._where, tuple(links), tuple(joints), mimics, looks, tuple(self._notes),
            ZERO if self._off("gravity") else _vector(self._m.opt.gravity),
        )  # fmt: skip

    def _off(self, what: str) -> bool:
        """Whether a <flag> of the file switches a feature off."""
        flags = (what, "constraint") if what in _CONSTRAINTS else (what,)
        bits = (getattr(self._mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}") for flag in flags)
        return any(self._m.opt.disableflags & int(bit) for bit in bits)

    def _tell(self, element: str, text: str, where: str = "") -> None:
        self._notes.append(Note(where or self._where, element, text))

    def _at(self, tag: str, name: str, other: str = "") -> str:
        """File and line of a named element with one of two tags; else the file."""
        return self._places.get((tag, name)) or self._places.get((other, name), self._where)

    def _name(self, kind: str, number: int) -> str:
        found = self._mujoco.mj_id2name(
            self._m, getattr(self._mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), number
        )
        return found or f"{kind}{number}"

    def _link_of(self, body: int) -> str:
        return "world" if body == 0 else self._name("body", body)

    def _body(self, body: int) -> Iterator[tuple[Link, Joint]]:
        """Links of a body with their inboard joints, from inboard to outboard."""
        m, name = self._m, self._link_of(body)
        first, count = int(m.body_jntadr[body]), int(m.body_jntnum[body])
        parent = int(m.body_parentid[body])
        holder = self._link_of(parent)
        at = Pose(_vector(m.body_pos[body]), _turn(m.body_quat[body]))
        pose, anchor = self._frame[parent].then(at), ZERO
        if count == 0:
            self._frame[body] = IN_PLACE
            weld = Joint(f"{name}/weld", FIXED, holder, name, pose, where=self._at("body", name))
            yield self._mass(body, name), weld
            return
        if count > 1:
            what = f"its {count} joints are hinges in series, with massless bodies between them"
            self._tell(f"body {name!r}", what, self._at("body", name))
        for number in range(first, first + count):
            kind, last = int(m.jnt_type[number]), number == first + count - 1
            place = ZERO if kind == _FREE else _vector(m.jnt_pos[number])
            moved = IN_PLACE if kind == _FREE else pose.then(Pose(_minus(place, anchor)))
            joint = self._name("joint", number)
            held = name if last else f"{name}/{joint}"
            moved = moved.then(self._back(number, kind))
            if last:
                self._frame[body] = Pose(_minus(ZERO, place))
            where = self._at("joint", joint, "freejoint")
            link = self._mass(body, held) if last else Link(held, where=where)
            keys = self._keys(number, kind, joint, where)
            yield link, Joint(joint, _HINGES[kind], holder, held, moved, keys, where)
            holder, pose, anchor = held, IN_PLACE, place
        if any(anchor):
            frame, at_body = f"{name}/frame", self._at("body", name)
            what = "its origin is at its joint; its original frame is an end"
            self._tell(f"body {name!r}", what, at_body)
            weld = Joint(frame, FIXED, name, frame, self._frame[body], where=at_body)
            yield Link(frame, where=at_body), weld

    def _mass(self, body: int, name: str) -> Link:
        """Link with the mass of a body, in the frame of the link."""
        m, frame = self._m, self._frame[body]
        mass = float(m.body_mass[body])
        where = self._at("body", name)
        if mass == 0 and not m.body_inertia[body].any():
            return Link(name, where=where)
        turn = _turn(m.body_iquat[body])
        a, b, c = map(float, m.body_inertia[body])
        principal: Matrix = ((a, 0.0, 0.0), (0.0, b, 0.0), (0.0, 0.0, c))
        inertia = product(product(turn, principal), transpose(turn))
        center = frame.then(Pose(_vector(m.body_ipos[body]))).position
        return Link(name, mass, center, inertia if any((a, b, c)) else NOTHING, where)

    def _back(self, number: int, kind: int) -> Pose:
        """Pose of a joint at 0 relative to its reference value."""
        if kind in (_FREE, _BALL):
            return IN_PLACE
        reference = float(self._m.qpos0[self._m.jnt_qposadr[number]])
        if reference == 0:
            return IN_PLACE
        axis = _vector(self._m.jnt_axis[number])
        if kind == _SLIDE:
            x, y, z = axis
            return Pose((-reference * x, -reference * y, -reference * z))
        return Pose(rotation=about(axis, -reference))

    def _keys(self, number: int, kind: int, joint: str, where: str) -> dict[str, Any]:
        m, dof, at = self._m, int(self._m.jnt_dofadr[number]), int(self._m.jnt_qposadr[number])
        stop, values = dof + (6, 3, 1, 1)[kind], at + (7, 4, 1, 1)[kind]
        law: dict[str, Any] = {}
        for key, numbers in (("damping", m.dof_damping), ("inertia", m.dof_armature)):
            if key == "damping" and self._off("damper"):
                continue
            if (found := [float(x) for x in numbers[dof:stop]]) and any(found):
                law[key] = found
        self._tell_of_curves(number, dof, joint, where)
        losses = [float(x) for x in m.dof_frictionloss[dof:stop]]
        if any(losses) and not self._off("frictionloss"):
            law["friction"] = [{"coulomb": x} for x in losses]
            if kind == _FREE:
                text = "its friction acts along the axes of the body, in MuJoCo along world axes"
                self._tell(f"joint {joint!r}", text, where)
        stiffness = 0.0 if self._off("spring") else float(m.jnt_stiffness[number].flat[0])
        if stiffness and kind in (_FREE, _BALL):
            text = "its spring is left out; define it in the law of the hinge"
            self._tell(f"joint {joint!r}", text, where)
        elif stiffness:
            law |= {"stiffness": stiffness, "rest": float(m.qpos_spring[at])}
        if m.jnt_limited[number] and not self._off("limit"):
            if kind == _BALL:
                self._tell(f"joint {joint!r}", "its limit is left out", where)
            else:
                lower, upper = map(float, m.jnt_range[number])
                law["limits"] = {"lower": lower, "upper": upper}
        keys: dict[str, Any] = {"law": law} if law else {}
        if kind == _FREE and "inertia" in law:
            keys["armature"] = law["inertia"][0]
        if "limits" in law:
            keys["rated"] = dict(law["limits"])
        if kind not in (_FREE, _BALL):
            keys["axis"] = _vector(m.jnt_axis[number])
        if m.jnt_actfrclimited[number]:
            least, most = map(float, m.jnt_actfrcrange[number])
            text = f"actuatorfrcrange from {least:g} to {most:g} left out"
            self._tell(f"joint {joint!r}", text, where)
        start = [float(x) for x in m.qpos0[at:values]]
        return keys | ({"initial": {"q": start}} if any(start) else {})

    def _tell_of_curves(self, number: int, dof: int, joint: str, where: str) -> None:
        """Add notes about nonlinear terms of springs and dampers, where MuJoCo has them."""
        for what, key, place in (
            ("spring", "jnt_stiffness", number),
            ("damper", "dof_damping", dof),
        ):
            terms = getattr(self._m, f"{key}poly", None)
            if terms is not None and terms[place].any() and not self._off(what):
                text = f"the nonlinear terms of its {what} are left out"
                self._tell(f"joint {joint!r}", text, where)

    def _mimics(self) -> Iterator[Mimic]:
        """Active joint equalities that are linear."""
        m, off = self._m, self._off("equality")
        for number in range(m.neq):
            if off or not m.eq_active0[number]:
                self._leave_equality(number, "left out: switched off")
                continue
            line = [float(x) for x in m.eq_data[number][:5]]
            one, other = int(m.eq_obj1id[number]), int(m.eq_obj2id[number])
            if m.eq_type[number] != _JOINT_EQUALITY or other < 0 or any(line[2:]):
                self._leave_equality(number)
                continue
            first, second = (float(m.qpos0[m.jnt_qposadr[each]]) for each in (one, other))
            offset = first + line[0] - line[1] * second
            yield Mimic(self._name("joint", one), self._name("joint", other), line[1], offset)

    def _leave_equality(self, number: int, what: str = "left out") -> None:
        name, kinds = self._name("equality", number), self._mujoco.mjtEq
        kind = kinds(int(self._m.eq_type[number])).name.removeprefix("mjEQ_").lower()
        self._tell(f"equality {name!r} ({kind})", what, self._at("equality", name))

    def _looks(self) -> Iterator[Look]:
        m, kinds, unseen = self._m, self._mujoco.mjtGeom, 0
        for number in range(m.ngeom):
            if m.geom_group[number] >= _SEEN or m.geom_type[number] == kinds.mjGEOM_PLANE:
                continue
            keys = _solid(kinds, int(m.geom_type[number]), [float(x) for x in m.geom_size[number]])
            if keys is None:
                unseen += 1
                continue
            body = int(m.geom_bodyid[number])
            at = Pose(_vector(m.geom_pos[number]), _turn(m.geom_quat[number]))
            keys["color"] = color(m.geom_rgba[number][:3])
            yield Look(self._link_of(body), self._frame[body].then(at), keys)
        if unseen:
            self._tell("geom", f"{unseen} of them are not drawn (meshes, ellipsoids, heights)")

    def _leave_out(self) -> None:
        m = self._m
        for key, what in _LEFT.items():
            if count := int(getattr(m, key, 0)):
                self._tell(what, f"left out, {count} of them")
        for what, (key, section) in _NAMED.items():
            for number in range(int(getattr(m, key, 0))):
                name = self._name(what, number)
                self._tell(f"{what} {name!r}", "left out", self._at(section, name))
        if m.ngeom and (m.geom_contype.any() or m.geom_conaffinity.any()):
            self._tell("contacts", "left out: bodies pass through each other and the ground")
        if m.body_gravcomp.any():
            self._tell("gravcomp", "left out")
        if m.opt.density > 0 or m.opt.viscosity > 0:
            self._tell("fluid", "fluid forces are left out")


def _solid(kinds: Any, kind: int, size: list[float]) -> dict[str, Any] | None:
    """Keys of a shape; MuJoCo stores half lengths."""
    if kind == kinds.mjGEOM_SPHERE:
        return {"type": "sphere", "radius": size[0]}
    if kind == kinds.mjGEOM_BOX:
        return {"type": "box", "size": [2 * x for x in size]}
    for name in ("capsule", "cylinder"):
        if kind == getattr(kinds, f"mjGEOM_{name.upper()}"):
            return {"type": name, "radius": size[0], "length": 2 * size[1]}
    return None


def _vector(numbers: Any) -> Vector:
    x, y, z = map(float, numbers)
    return (x, y, z)


def _turn(quaternion: Any) -> Matrix:
    return from_quaternion([float(x) for x in quaternion])


def _minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
