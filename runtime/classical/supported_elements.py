"""Elements that the classical discrete-time method supports; others are rejected by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mstmm.errors import SceneError
from mstmm.ir.hinge_properties import HingeProperties
from mstmm.scene import Hinge

from ..packing.packed_scene import PackedScene
from ..packing.system import LawNumbers

FREE, FIXED, PIN, BALL = "FREE", "FIXED", "PIN", "BALL"
ELASTIC, ELASTIC_PIN, ELASTIC_BALL = "ELASTIC", "ELASTIC_PIN", "ELASTIC_BALL"

REMEDY = "use another method, such as dop853"

_SUPPORTED_HINGES = "supported are fixed, pin, ball, elastic, and free on the ground"

#: Stiffness or damping about x, y, z -> kind of an elastic hinge.
_ELASTIC_KINDS = {
    (True, True, True): ELASTIC,
    (True, True, False): ELASTIC_PIN,
    (False, False, False): ELASTIC_BALL,
}


@dataclass(frozen=True)
class Springs:
    """Springs and dampers of an elastic hinge, and the index of its twist in the run's memory."""

    law: LawNumbers
    twist: int


def hinge_kinds(packed: PackedScene) -> list[tuple[str, Springs | None]]:
    """Kind of the inboard hinge of every body, by place, with the springs of an elastic one.

    Raises SceneError that names an unsupported element.
    """
    _check_loads(packed)
    laws = _laws_by_body(packed)
    links = packed.topology.links
    return [
        _hinge_kind(packed.scene.hinges[link.hinge], link.parent < 0, laws.get(place, ()))
        for place, link in enumerate(links)
    ]


_SUPPORTED_LOADS = "the only supported loads are gravity and elastic hinges"


def _check_loads(packed: PackedScene) -> None:
    scene = packed.user_scene
    for table, elements, reason in (
        ("load", scene.load, _SUPPORTED_LOADS), ("spring", scene.spring, _SUPPORTED_LOADS),
        ("bushing", scene.bushing, _SUPPORTED_LOADS),
        ("event", scene.events, "its steps neither locate nor process events"),
    ):  # fmt: skip
        for element in elements:
            raise unsupported_error(f'{table} "{element.name}"', reason)
    for body in packed.scene.bodies:
        if body.type != "rigid":
            raise unsupported_error(f'body "{body.name}"', f"the type {body.type} has no matrix")


def unsupported_error(what: str, why: str) -> SceneError:
    """Error for an element of a scene that has no matrix."""
    return SceneError(f"{what}: method dttmm-classical does not support it: {why}; {REMEDY}")


def _laws_by_body(packed: PackedScene) -> dict[int, list[Springs]]:
    """Laws by places of their bodies; SceneError for a law with an effort."""
    laws_found: dict[int, list[Springs]] = {}
    for law_batch in packed.system.laws:
        for law, body, twist, efforts in law_batch.iterate_laws():
            if any(place >= 0 for place in efforts):
                raise unsupported_error(
                    _hinge_label(packed, body), "its matrices contain no efforts"
                )
            laws_found.setdefault(body, []).append(Springs(law, twist))
    return laws_found


def _hinge_label(packed: PackedScene, place: int) -> str:
    return f'hinge "{packed.scene.hinges.name(packed.topology.links[place].hinge)}"'


def _hinge_kind(
    hinge: Hinge, on_ground: bool, laws: Sequence[Springs]
) -> tuple[str, Springs | None]:
    label = f'hinge "{hinge.name}"'
    if hinge.drive is not None or any(hinge.law.inertia) or hinge.release is not None:
        raise unsupported_error(label, "drives, releases and rotor inertia have no matrix")
    kind = _rigid_kind(hinge.facts)
    if kind is None:
        raise unsupported_error(label, f"the type {hinge.type} has no matrix; {_SUPPORTED_HINGES}")
    if kind != FREE and laws:
        raise unsupported_error(
            label, f"a law on a hinge of type {hinge.type} has no matrix; use an elastic hinge"
        )
    if kind != FREE:
        return kind, None
    if not laws:
        if not on_ground:
            raise unsupported_error(label, f"this hinge has no constraints; {_SUPPORTED_HINGES}")
        return FREE, None
    if len(laws) != 1 or laws[0].law.kernel != "six":
        raise unsupported_error(label, "its friction has no matrix")
    return _elastic_kind(label, laws[0])


def _rigid_kind(facts: HingeProperties | None) -> str | None:
    """Kind of a hinge by its free motions; None if there is no matrix."""
    if facts is None or not facts.constant_subspace:
        return None
    if facts.welds:
        return FIXED
    if facts.free_body:
        return FREE
    if facts.slides:
        return None
    if len(facts.turns) == 1 and facts.axial:
        return PIN
    return BALL if len(facts.turns) == 3 and facts.quaternion is not None else None


def _elastic_kind(what: str, springs: Springs) -> tuple[str, Springs]:
    """Kind of an elastic hinge by the directions of its springs and dampers."""
    p = springs.law.p
    if not all(p[k] > 0 or p[6 + k] > 0 for k in range(3)):
        raise unsupported_error(what, "it needs springs or dampers along x, y and z")
    x, y, z = (p[9 + k] > 0 or p[13 + k] > 0 for k in range(3))
    if (x, y, z) not in _ELASTIC_KINDS:
        raise unsupported_error(
            what, "it needs springs or dampers about x, y and z, x and y, or none"
        )
    return _ELASTIC_KINDS[x, y, z], springs
