"""Registry of quantities: what can be asked of a state, a run or a linear model by name.

Every kind of quantity is declared once, by the kind of its owner: a body or end, a hinge, the
scene, or an element such as a spring.  Results, files, plots, expressions evaluated during a run
and linear models read these declarations.  Kinds without columns of an `Observation` are methods of
the values of their owner in `runtime/result`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from mstmm.errors import SceneError
from mstmm.ir.hinge_properties import effort_unit
from mstmm.scene import split_reference
from mstmm.scene.tables.body import BodyTable
from mstmm.scene.tables.scene_tables import SceneTables
from mstmm.scene.validators.scalars_and_vectors import GROUND
from mstmm.scene.validators.validation_messages import did_you_mean

from ..packing.coordinate_layout import HingeSlots

XYZ, WXYZ = ("x", "y", "z"), ("w", "x", "y", "z")
_FORCES, _MOMENTS = ("fx", "fy", "fz"), ("mx", "my", "mz")
_ANGLES = ("yaw", "pitch", "roll")


@dataclass(frozen=True)
class QuantityKind:
    """Kind of quantity of an owner: "velocity" of "rod1.tip" is "rod1.tip.velocity".

    Attributes:
        labels: names of the components, "rod1.tip.velocity.x"; empty for a scalar.
        short: their short names, "rod1.tip.vx"; empty without any.
        part, span: array of an `Observation`, and its first column and that after the last; "" if
            the quantity is computed otherwise.
        rates: the kind that is its rate, "" if none is.
        dual: load that works on it and order of its rate, for linear models; None if not linear.
        method: method of `Result` that returns it, if its name differs.
        listed: whether files hold it; other kinds take long to compute.
    """

    name: str
    unit: str
    long_name: str
    labels: tuple[str, ...] = ()
    short: tuple[str, ...] = ()
    part: str = ""
    span: tuple[int, int] = (0, 0)
    rates: str = ""
    dual: tuple[str, int] | None = None
    method: str = ""
    listed: bool = True

    @property
    def columns(self) -> slice:
        """Columns of the quantity in its part of an `Observation`."""
        return slice(*self.span)


Kinds = Mapping[str, QuantityKind]


def _by_name(*kinds: QuantityKind) -> Kinds:
    return {kind.name: kind for kind in kinds}


def _point(
    name: str, unit: str, short: tuple[str, ...], first: int, rates: str, load: str, order: int
) -> QuantityKind:
    """Kind of motion of a body or an end: columns of `Observation.points`."""
    long_name, span = name.replace("_", " "), (first, first + 3)
    return QuantityKind(name, unit, long_name, XYZ, short, "points", span, rates, (load, order))


#: Yaw and roll are continuous, pitch is within +-pi/2.
EULER_KIND = QuantityKind("euler", "rad", "Euler angles about z, y', x''", _ANGLES, _ANGLES)

#: Of a body or an end.
BODY_QUANTITIES = _by_name(
    _point("position", "m", XYZ, 0, "velocity", "force", 0),
    _point("velocity", "m/s", ("vx", "vy", "vz"), 3, "acceleration", "force", 1),
    _point("acceleration", "m/s2", ("ax", "ay", "az"), 6, "", "force", 2),
    QuantityKind(
        "orientation", "", "quaternion, body to inertial axes", WXYZ, ("qw", "qx", "qy", "qz")
    ),
    _point("angular_velocity", "rad/s", ("wx", "wy", "wz"), 9, "angular_acceleration", "moment", 1),
    _point("angular_acceleration", "rad/s2", ("alphax", "alphay", "alphaz"), 12, "", "moment", 2),
    EULER_KIND,
)

#: Columns of `Observation.points`.
POINT_COLUMNS = {kind.name: kind.columns for kind in BODY_QUANTITIES.values() if kind.part}

#: Of a body with mass, rigid or flexible.
MASS_QUANTITIES = _by_name(
    QuantityKind("momentum", "kg*m/s", "linear momentum", XYZ, method="body_momentum"),
    QuantityKind(
        "angular_momentum", "kg*m2/s", "angular momentum about the mass centre", XYZ,
        method="body_angular_momentum",
    ),
    QuantityKind("center_of_mass", "m", "position of the mass centre", XYZ),
    QuantityKind(
        "equivalent_velocity", "m/s", "velocity of a rigid body of the same momentum", XYZ
    ),
    QuantityKind(
        "equivalent_spin", "rad/s", "spin of a rigid body of the same angular momentum", XYZ,
        method="equivalent_angular_velocity",
    ),
)  # fmt: skip

#: Of a flexible body; energies by modes have the labels of its modes.
FLEXIBLE_QUANTITIES = _by_name(
    QuantityKind("modal_energy", "J", "energy by modes, strain and motion against the frame"),
    QuantityKind("strain_energy", "J", "strain energy"),
)

#: Of an end of a beam, in frame or section axes.
END_QUANTITIES = _by_name(
    QuantityKind("deflection", "m", "elastic displacement, frame axes", XYZ),
    QuantityKind("slope", "", "slope relative to the frame along", ("y", "z"), listed=False),
    QuantityKind(
        "section_force", "N", "force of the outboard part, section axes", XYZ, listed=False
    ),
    QuantityKind(
        "section_moment", "N*m", "moment of the outboard part, section axes", XYZ, listed=False
    ),
)

#: Of a hinge: loads of the inboard on the outboard side, angles of a quaternion, and powers.
HINGE_QUANTITIES = _by_name(
    QuantityKind(
        "force", "N", "force of the inboard on the outboard side", XYZ, _FORCES, "loads",
        (0, 3),
    ),
    QuantityKind(
        "moment", "N*m", "moment of the inboard on the outboard side at P", XYZ, _MOMENTS, "loads",
        (3, 6),
    ),
    EULER_KIND,
    QuantityKind("power", "W", "power of the effort"),
    QuantityKind("motor_power", "W", "power of the motor"),
)  # fmt: skip

#: Sums over the scene.
SUMS = _by_name(
    QuantityKind("energy", "J", "total energy", part="sums", span=(0, 3)),
    QuantityKind("energy.kinetic", "J", "kinetic energy", part="sums", span=(0, 1)),
    QuantityKind(
        "energy.gravity", "J", "potential energy of gravity", part="sums", span=(1, 2)
    ),
    QuantityKind(
        "energy.springs", "J", "energy of springs and of deformed bodies", part="sums",
        span=(2, 3),
    ),
    QuantityKind(
        "power", "W", "power of all non-conservative efforts", part="sums", span=(3, 4)
    ),
    QuantityKind("momentum", "kg*m/s", "linear momentum", XYZ, part="sums", span=(4, 7)),
    QuantityKind(
        "angular_momentum", "kg*m2/s", "angular momentum about the inertial origin", XYZ,
        part="sums", span=(7, 10),
    ),
)  # fmt: skip
WORK_KIND = QuantityKind("work", "J", "work of all non-conservative efforts", rates="power")

_ELEMENT_FORCE = QuantityKind("force", "N", "force on the end `to`", XYZ, _FORCES)

#: Of springs, bushings (deflections in their own axes), loads, and closures of loops.
ELEMENT_QUANTITIES: Mapping[str, Kinds] = {
    "spring": _by_name(
        QuantityKind("length", "m", "length", rates="length_rate"),
        QuantityKind("length_rate", "m/s", "rate of the length"),
        QuantityKind("effort", "N", "effort, which pushes the ends apart,"),
        _ELEMENT_FORCE,
        QuantityKind("power", "W", "power of the effort"),
        QuantityKind("motor", "N", "motor effort"),
        QuantityKind("motor_power", "W", "power of the motor"),
    ),
    "bushing": _by_name(
        _ELEMENT_FORCE,
        QuantityKind("moment", "N*m", "moment on the end `to`, about its point", XYZ, _MOMENTS),
        QuantityKind("deflection", "m", "displacement of the end `to` from rest, own axes", XYZ),
        QuantityKind("turn", "rad", "rotation vector of the end `to` from rest, own axes", XYZ),
    ),
    "load": _by_name(  # a load per length is given by its resultant
        QuantityKind("force", "N", "force", XYZ, _FORCES),
        QuantityKind("moment", "N*m", "moment", XYZ, _MOMENTS),
        QuantityKind("power", "W", "power"),
    ),
    "constraint": _by_name(
        QuantityKind("force", "N", "force on the end `to`", XYZ),
        QuantityKind("s", "", "parameter of the curve"),
        QuantityKind("load", "N", "load, along the normal,"),
        QuantityKind("friction", "N", "friction force"),
    ),
    "coupling": _by_name(QuantityKind("load", "", "load per derivative of its expression,")),
}


def components(kinds: Kinds) -> dict[str, tuple[QuantityKind, int]]:
    """Kind and column by the names of its components, "velocity.y" and "vy", and of a scalar."""
    found = {kind.name: (kind, 0) for kind in kinds.values() if not kind.labels}
    for kind in kinds.values():
        names = [(k, f"{kind.name}.{label}") for k, label in enumerate(kind.labels)]
        found |= {name: (kind, k) for k, name in (*names, *enumerate(kind.short))}
    return found


BODY_COMPONENTS, HINGE_COMPONENTS = components(BODY_QUANTITIES), components(HINGE_QUANTITIES)


# --- coordinates ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class CoordinateColumn:
    """Scalar of a hinge or of modes: entry `k` of its part of q, u, udot or efforts.

    `index` is its index in that array, `names` are its name and those by number: angle, q[0], q.
    """

    part: str
    k: int
    index: int
    kind: QuantityKind
    names: tuple[str, ...]


def coordinate_columns(slots: HingeSlots, efforts: bool = True) -> Iterator[CoordinateColumn]:
    """Coordinates, speeds, accelerations and, unless they are modes, efforts of a hinge."""
    accelerations = [acceleration_name(name) for name in slots.u_names]
    groups: list[tuple[str, str, int, Sequence[str], Sequence[str]]] = [
        ("q", "q", slots.q, slots.q_names, slots.q_units),
        ("u", "u", slots.u, slots.u_names, slots.u_units),
        ("udot", "udot", slots.u, accelerations, [rate_unit(unit) for unit in slots.u_units]),
    ]
    if efforts:
        effort_units = [effort_unit(unit) for unit in slots.u_units]
        names_of_efforts = effort_names(slots.u_names)
        groups.append(("efforts", "effort", slots.u, names_of_efforts, effort_units))
    for part, short, first, names, units in groups:
        for k, (name, unit) in enumerate(zip(names, units, strict=True)):
            kind = QuantityKind(name, unit, name.replace("_", " "))
            aliases = (f"{short}[{k}]", short) if len(names) == 1 else (f"{short}[{k}]",)
            yield CoordinateColumn(part, k, first + k, kind, (name, *aliases))


def effort_names(speeds: Sequence[str]) -> list[str]:
    """Names of the efforts of a hinge: effort for one speed, else effort_wx and so on."""
    if len(speeds) == 1:
        return ["effort"]
    return [f"effort_{name.removesuffix('_rate')}" for name in speeds]


def acceleration_name(speed: str) -> str:
    """Name of the derivative of a speed: angle_rate -> angle_acceleration, vx -> vx_dot."""
    stem = speed.removesuffix("_rate")
    return f"{stem}_acceleration" if stem != speed else f"{speed}_dot"


def rate_unit(unit: str) -> str:
    """Unit of the time derivative of a quantity: m/s -> m/s2."""
    return f"{unit}2" if unit.endswith("/s") else f"{unit or '1'}/s"


# --- owners ---------------------------------------------------------------------------------------


class BodyReferences(Collection[str]):
    """Names of all bodies and ends of a scene: "rod1", "rod1.tip".

    `scene` is the skeleton, in which flexible bodies appear as ordinary bodies with ends.
    """

    def __init__(self, scene: SceneTables) -> None:
        self.scene, self.bodies = scene, scene.bodies

    def canonical(self, reference: str) -> str | None:
        """Canonical name of a reference, or None if there is no such body or end.

        Chain members get their index; synonyms of other programs are resolved.
        """
        return self._find_canonical(reference) or self._find_canonical(
            self.scene.names.reference(reference)
        )

    def _find_canonical(self, reference: str) -> str | None:
        name, end_name = split_reference(reference)
        index = self.bodies.find(name)
        ends = self.bodies.ends(name)
        if index is None or ends is None or (end_name and end_name not in ends):
            return None
        return self.bodies.name(index) + (f".{end_name}" if end_name else "")

    def canonical_name(self, reference: str) -> str:
        """Canonical name of a body, an end or the ground; raises SceneError if unknown."""
        canonical_name = self.canonical(reference)
        if canonical_name is not None:
            return canonical_name
        if GROUND in (split_reference(reference)[0], self.scene.names.reference(reference)):
            return GROUND
        raise SceneError(self.unknown(reference))

    def unknown(self, reference: str) -> str:
        """Message for an unknown reference, with the nearest known name."""
        body = split_reference(reference)[0]
        if self.bodies.of_chain(body) and self.bodies.find(body) is None:
            return f'"{reference}": {self.bodies.missing(body)}'
        suggestion = did_you_mean(reference, (*self, *self.scene.names.body))
        return f'"{reference}": there is no such body or end in the scene{suggestion}'

    def __contains__(self, reference: object) -> bool:
        return isinstance(reference, str) and self.canonical(reference) is not None

    def __iter__(self) -> Iterator[str]:
        for body in self.scene.body:
            yield from _body_and_end_names(body.name, body)
        for chain in self.scene.chain:
            for k in range(chain.count):
                yield from _body_and_end_names(f"{chain.name}[{k}]", chain.body_of(k))

    def __len__(self) -> int:
        count = sum(1 + len(body.ends) for body in self.scene.body)
        for chain in self.scene.chain:
            full_periods, remainder = divmod(chain.count, len(chain.body))
            ends = [1 + len(body.ends) for body in chain.body]
            count += full_periods * sum(ends) + sum(ends[:remainder])
        return count


def _body_and_end_names(name: str, body: BodyTable) -> Iterator[str]:
    yield name
    for end in body.ends:
        yield f"{name}.{end}"
