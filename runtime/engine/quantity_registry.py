"""Registry"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from mstmm.errors import SceneError
from mstmm.scene import split_reference
from mstmm.scene.tables.body import BodyTable
from mstmm.scene.tables.scene_tables import SceneTables
from mstmm.scene.validators.scalars_and_vectors import GROUND
from mstmm.scene.validators.validation_messages import did_you_mean


@dataclass(frozen=True)
class QuantityKind:
    """Vector quantity of a body or hinge: unit, long name, column labels and short names."""

    unit: str
    long_name: str
    labels: tuple[str, ...]
    short: tuple[str, ...]


XYZ, WXYZ = ("x", "y", "z"), ("w", "x", "y", "z")


#: Quantities of a body or an end, in the order of `Observation.points`.
BODY_QUANTITIES = {
    "position": QuantityKind("m", "position", XYZ, XYZ),
    "velocity": QuantityKind("m/s", "velocity", XYZ, ("vx", "vy", "vz")),
    "acceleration": QuantityKind("m/s2", "acceleration", XYZ, ("ax", "ay", "az")),
    "orientation": QuantityKind(
        "", "quaternion, body to inertial axes", WXYZ, ("qw", "qx", "qy", "qz")
    ),
    "angular_velocity": QuantityKind("rad/s", "angular velocity", XYZ, ("wx", "wy", "wz")),
    "angular_acceleration": QuantityKind(
        "rad/s2", "angular acceleration", XYZ, ("alphax", "alphay", "alphaz")
    ),
}

#: Loads that the inboard side of a hinge exerts on the outboard side.
HINGE_QUANTITIES = {
    "force": QuantityKind(
        "N", "force of the inboard on the outboard side", XYZ, ("fx", "fy", "fz")
    ),
    "moment": QuantityKind(
        "N*m", "moment of the inboard on the outboard side at P", XYZ, ("mx", "my", "mz")
    ),
}

#: Sums over the scene: unit, long name, columns of `Observation.sums`.
SUMS: dict[str, tuple[str, str, slice]] = {
    "energy": ("J", "total energy", slice(0, 3)),
    "energy.kinetic": ("J", "kinetic energy", slice(0, 1)),
    "energy.gravity": ("J", "potential energy of gravity", slice(1, 2)),
    "energy.springs": ("J", "energy of springs and of deformed bodies", slice(2, 3)),
    "power": ("W", "power of all non-conservative efforts", slice(3, 4)),
    "momentum": ("kg*m/s", "linear momentum", slice(4, 7)),
    "angular_momentum": ("kg*m2/s", "angular momentum about the inertial origin", slice(7, 10)),
}

#: Columns of `Observation.points`.
POINT_COLUMNS = {
    "position": slice(0, 3), "velocity": slice(3, 6), "acceleration": slice(6, 9),
    "angular_velocity": slice(9, 12), "angular_acceleration": slice(12, 15),
}  # fmt: skip


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
