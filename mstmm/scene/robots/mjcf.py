"""Reader of MJCF files, by the model that MuJoCo compiles from them (extra `robot`).

The frame of a body is given in its parent.  Its joints, each about its own anchor, move it in
series.  The link of a body has its origin at the anchor of the last joint; the joints before it
move massless links.  Values of joints are MuJoCo's qpos.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ...errors import SceneError
from ...numerics.rotations import (
    IDENTITY_POSE,
    ZERO,
    Matrix,
    Pose,
    Vector,
    from_quaternion,
    product,
    rotation_about,
    transpose,
)
from ...optional_packages import missing_package_error
from .mjcf_includes import Locations
from .robot_model import FIXED, ZERO_MATRIX, ImportNote, Joint, Link, Mimic, Robot, Visual, color

_FREE, _BALL, _SLIDE = 0, 1, 2
_HINGES = ("free", "ball", "prismatic", "pin")
#: Dynamic parts of a model that are left out, by the name of their count.
_COUNTED_UNSUPPORTED = {
    "nu": "actuators", "nsensor": "sensors", "nplugin": "plugins", "nflex": "flexible parts",
    "nkey": "keyframes",
}  # fmt: skip
#: Parts that are left out one by one: their count, and their section of the file.
_NAMED_UNSUPPORTED = {
    "tendon": ("ntendon", "tendon"), "pair": ("npair", "contact"),
    "exclude": ("nexclude", "contact"),
}  # fmt: skip
_JOINT_EQUALITY = 2
#: Flags that are also switched off by "constraint".
_CONSTRAINT_FLAGS = ("limit", "frictionloss", "equality")
#: Most characters quoted from a message of MuJoCo.
_MAX_QUOTED_LENGTH = 400
#: Number of geom groups that are drawn.
_DRAWN_GROUP_COUNT = 3


def read_mjcf(path: str, where: str, places: Locations | None = None) -> Robot:
    """Read a robot from an MJCF file.

    `where` is the name of the file in messages, `places` the locations of named elements.  Raises
    SceneError for files that MuJoCo does not compile, EnvironmentFailure without MuJoCo.
    """
    try:
        import mujoco
    except ImportError as error:
        raise missing_package_error("robot", f"{where}: MJCF", error) from None
    try:
        model = mujoco.MjModel.from_xml_path(path)
    except (ValueError, OSError, RuntimeError, MemoryError) as error:
        text = " ".join(str(error).split())
        text = text if len(text) <= _MAX_QUOTED_LENGTH else f"{text[:_MAX_QUOTED_LENGTH]}..."
        raise SceneError(f"{where}: MuJoCo cannot read the file: {text}") from None
    return _MjcfReader(mujoco, model, where, places or {}).robot()


class _MjcfReader:
    """Reader of a compiled MuJoCo model."""

    def __init__(self, mujoco: Any, model: Any, where: str, places: Locations) -> None:
        self._mujoco, self._m, self._file_name, self._locations = mujoco, model, where, places
        self._notes = list[ImportNote]()
        #: Body -> pose of its frame in its link.
        self._frame = {0: IDENTITY_POSE}

    def robot(self) -> Robot:
        """Read the robot of the model."""
        links, joints = [Link("world", where=self._file_name)], list[Joint]()
        for body in range(1, self._m.nbody):
            for link, joint in self._body(body):
                links.append(link)
                joints.append(joint)
        mimics = tuple(self._mimics())
        visuals = tuple(self._visuals())
        self._note_omissions()
        return Robot(
            "", self._file_name, tuple(links), tuple(joints), mimics, visuals, tuple(self._notes),
            ZERO if self._is_switched_off("gravity") else _vector(self._m.opt.gravity),
        )  # fmt: skip

    def _is_switched_off(self, what: str) -> bool:
        """Whether a <flag> of the file switches a feature off."""
        flags = (what, "constraint") if what in _CONSTRAINT_FLAGS else (what,)
        bits = (getattr(self._mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}") for flag in flags)
        return any(self._m.opt.disableflags & int(bit) for bit in bits)

    def _add_note(self, element: str, text: str, where: str = "") -> None:
        self._notes.append(ImportNote(where or self._file_name, element, text))

    def _location_of(self, tag: str, name: str, other: str = "") -> str:
        """File and line of a named element with one of two tags; else the file."""
        return self._locations.get((tag, name)) or self._locations.get(
            (other, name), self._file_name
        )

    def _name(self, kind: str, number: int) -> str:
        object_type = getattr(self._mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
        return self._mujoco.mj_id2name(self._m, object_type, number) or f"{kind}{number}"

    def _link_of(self, body: int) -> str:
        return "world" if body == 0 else self._name("body", body)

    def _body(self, body: int) -> Iterator[tuple[Link, Joint]]:
        """Links of a body with their inboard joints, from inboard to outboard."""
        m, name = self._m, self._link_of(body)
        first_joint, count = int(m.body_jntadr[body]), int(m.body_jntnum[body])
        parent = int(m.body_parentid[body])
        holder = self._link_of(parent)
        body_pose = Pose(_vector(m.body_pos[body]), _rotation(m.body_quat[body]))
        pose, previous_anchor = self._frame[parent].compose(body_pose), ZERO
        if count == 0:
            self._frame[body] = IDENTITY_POSE
            weld_joint = Joint(
                f"{name}/weld", FIXED, holder, name, pose, where=self._location_of("body", name)
            )
            yield self._mass(body, name), weld_joint
            return
        if count > 1:
            text = f"its {count} joints are hinges in series, with massless bodies between them"
            self._add_note(f"body {name!r}", text, self._location_of("body", name))
        for number in range(first_joint, first_joint + count):
            joint_type, is_last = int(m.jnt_type[number]), number == first_joint + count - 1
            joint_anchor, joint_pose = ZERO, IDENTITY_POSE
            if joint_type != _FREE:
                joint_anchor = _vector(m.jnt_pos[number])
                joint_pose = pose.compose(Pose(_subtract(joint_anchor, previous_anchor)))
            joint = self._name("joint", number)
            link_name = name if is_last else f"{name}/{joint}"
            joint_pose = joint_pose.compose(self._zero_pose(number, joint_type))
            if is_last:
                self._frame[body] = Pose(_subtract(ZERO, joint_anchor))
            where = self._location_of("joint", joint, "freejoint")
            link = self._mass(body, link_name) if is_last else Link(link_name, where=where)
            keys, hinge = self._keys(number, joint_type, joint, where), _HINGES[joint_type]
            yield link, Joint(joint, hinge, holder, link_name, joint_pose, keys, where)
            holder, pose, previous_anchor = link_name, IDENTITY_POSE, joint_anchor
        if any(previous_anchor):
            frame, at_body = f"{name}/frame", self._location_of("body", name)
            note_text = "its origin is at its joint; its original frame is an end"
            self._add_note(f"body {name!r}", note_text, at_body)
            weld_joint = Joint(frame, FIXED, name, frame, self._frame[body], where=at_body)
            yield Link(frame, where=at_body), weld_joint

    def _mass(self, body: int, name: str) -> Link:
        """Link with the mass of a body, in the frame of the link."""
        m, frame = self._m, self._frame[body]
        mass = float(m.body_mass[body])
        where = self._location_of("body", name)
        if mass == 0 and not m.body_inertia[body].any():
            return Link(name, where=where)
        turn = _rotation(m.body_iquat[body])
        a, b, c = map(float, m.body_inertia[body])
        principal: Matrix = ((a, 0.0, 0.0), (0.0, b, 0.0), (0.0, 0.0, c))
        inertia = product(product(turn, principal), transpose(turn))
        center = frame.compose(Pose(_vector(m.body_ipos[body]))).position
        return Link(name, mass, center, inertia if any((a, b, c)) else ZERO_MATRIX, where)

    def _zero_pose(self, number: int, kind: int) -> Pose:
        """Pose of a joint at 0 relative to its reference value."""
        if kind in (_FREE, _BALL):
            return IDENTITY_POSE
        reference = float(self._m.qpos0[self._m.jnt_qposadr[number]])
        if reference == 0:
            return IDENTITY_POSE
        axis = _vector(self._m.jnt_axis[number])
        if kind == _SLIDE:
            x, y, z = axis
            return Pose((-reference * x, -reference * y, -reference * z))
        return Pose(rotation=rotation_about(axis, -reference))

    def _keys(self, number: int, kind: int, joint: str, where: str) -> dict[str, Any]:
        m = self._m
        dof, first_value = int(m.jnt_dofadr[number]), int(m.jnt_qposadr[number])
        dof_end, value_end = dof + (6, 3, 1, 1)[kind], first_value + (7, 4, 1, 1)[kind]
        law: dict[str, Any] = {}
        for key, numbers in (("damping", m.dof_damping), ("inertia", m.dof_armature)):
            if key == "damping" and self._is_switched_off("damper"):
                continue
            if (values_found := [float(x) for x in numbers[dof:dof_end]]) and any(values_found):
                law[key] = values_found
        self._note_nonlinear_terms(number, dof, joint, where)
        friction_losses = [float(x) for x in m.dof_frictionloss[dof:dof_end]]
        if any(friction_losses) and not self._is_switched_off("frictionloss"):
            law["friction"] = [{"coulomb": x} for x in friction_losses]
            if kind == _FREE:
                text = "its friction acts along the axes of the body, in MuJoCo along world axes"
                self._add_note(f"joint {joint!r}", text, where)
        has_spring = not self._is_switched_off("spring")
        stiffness = float(m.jnt_stiffness[number].flat[0]) if has_spring else 0.0
        if stiffness and kind in (_FREE, _BALL):
            text = "its spring is left out; define it in the law of the hinge"
            self._add_note(f"joint {joint!r}", text, where)
        elif stiffness:
            law |= {"stiffness": stiffness, "rest": float(m.qpos_spring[first_value])}
        if m.jnt_limited[number] and not self._is_switched_off("limit"):
            if kind == _BALL:
                self._add_note(f"joint {joint!r}", "its limit is left out", where)
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
            lower_force, upper_force = map(float, m.jnt_actfrcrange[number])
            text = f"actuatorfrcrange from {lower_force:g} to {upper_force:g} left out"
            self._add_note(f"joint {joint!r}", text, where)
        start = [float(x) for x in m.qpos0[first_value:value_end]]
        return keys | ({"initial": {"q": start}} if any(start) else {})

    def _note_nonlinear_terms(self, number: int, dof: int, joint: str, where: str) -> None:
        """Add notes about nonlinear terms of springs and dampers, where MuJoCo has them."""
        features = (("spring", "jnt_stiffness", number), ("damper", "dof_damping", dof))
        for feature, key, index in features:
            terms = getattr(self._m, f"{key}poly", None)
            if terms is not None and terms[index].any() and not self._is_switched_off(feature):
                text = f"the nonlinear terms of its {feature} are left out"
                self._add_note(f"joint {joint!r}", text, where)

    def _mimics(self) -> Iterator[Mimic]:
        """Active joint equalities that are linear."""
        m, is_disabled = self._m, self._is_switched_off("equality")
        for number in range(m.neq):
            if is_disabled or not m.eq_active0[number]:
                self._leave_equality(number, "left out: switched off")
                continue
            coefficients = [float(x) for x in m.eq_data[number][:5]]
            first_joint, second_joint = int(m.eq_obj1id[number]), int(m.eq_obj2id[number])
            if m.eq_type[number] != _JOINT_EQUALITY or second_joint < 0 or any(coefficients[2:]):
                self._leave_equality(number)
                continue
            joints = (first_joint, second_joint)
            first_value, second_value = (float(m.qpos0[m.jnt_qposadr[one]]) for one in joints)
            offset = first_value + coefficients[0] - coefficients[1] * second_value
            follower, leader = (self._name("joint", one) for one in joints)
            yield Mimic(follower, leader, coefficients[1], offset)

    def _leave_equality(self, number: int, what: str = "left out") -> None:
        name, type_enum = self._name("equality", number), self._mujoco.mjtEq
        type_name = type_enum(int(self._m.eq_type[number])).name.removeprefix("mjEQ_").lower()
        self._add_note(
            f"equality {name!r} ({type_name})", what, self._location_of("equality", name)
        )

    def _visuals(self) -> Iterator[Visual]:
        m, geom_types, undrawn_count = self._m, self._mujoco.mjtGeom, 0
        for number in range(m.ngeom):
            is_plane = m.geom_type[number] == geom_types.mjGEOM_PLANE
            if is_plane or m.geom_group[number] >= _DRAWN_GROUP_COUNT:
                continue
            size = [float(x) for x in m.geom_size[number]]
            keys = _shape_keys(geom_types, int(m.geom_type[number]), size)
            if keys is None:
                undrawn_count += 1
                continue
            body = int(m.geom_bodyid[number])
            geom_pose = Pose(_vector(m.geom_pos[number]), _rotation(m.geom_quat[number]))
            keys["color"] = color(m.geom_rgba[number][:3])
            yield Visual(self._link_of(body), self._frame[body].compose(geom_pose), keys)
        if undrawn_count:
            text = f"{undrawn_count} of them are not drawn (meshes, ellipsoids, heights)"
            self._add_note("geom", text)

    def _note_omissions(self) -> None:
        m = self._m
        for key, description in _COUNTED_UNSUPPORTED.items():
            if count := int(getattr(m, key, 0)):
                self._add_note(description, f"left out, {count} of them")
        for description, (key, section) in _NAMED_UNSUPPORTED.items():
            for number in range(int(getattr(m, key, 0))):
                name = self._name(description, number)
                where = self._location_of(section, name)
                self._add_note(f"{description} {name!r}", "left out", where)
        if m.ngeom and (m.geom_contype.any() or m.geom_conaffinity.any()):
            self._add_note("contacts", "left out: bodies pass through each other and the ground")
        if m.body_gravcomp.any():
            self._add_note("gravcomp", "left out")
        if m.opt.density > 0 or m.opt.viscosity > 0:
            self._add_note("fluid", "fluid forces are left out")


def _shape_keys(kinds: Any, kind: int, size: list[float]) -> dict[str, Any] | None:
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


def _rotation(quaternion: Any) -> Matrix:
    return from_quaternion([float(x) for x in quaternion])


def _subtract(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
