"""Elements that the classical discrete-time method supports; others are rejected by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mstmm.errors import SceneError
from mstmm.ir.facts import HingeFacts
from mstmm.scene import Hinge

from ..pack.packed import Packed
from ..pack.system import LawNumbers

FREE, FIXED, PIN, BALL = "FREE", "FIXED", "PIN", "BALL"
ELASTIC, ELASTIC_PIN, ELASTIC_BALL = "ELASTIC", "ELASTIC_PIN", "ELASTIC_BALL"

WAY_OUT = "use another method, such as dop853"

_HINGES = "supported are fixed, pin, ball, elastic, and free on the ground"

#: Stiffness or damping about x, y, z -> kind of an elastic hinge.
_SPRUNG = {
    (True, True, True): ELASTIC,
    (True, True, False): ELASTIC_PIN,
    (False, False, False): ELASTIC_BALL,
}


@dataclass(frozen=True)
class Springs:
    """Springs and dampers of an elastic hinge, and the index of its twist in the run's memory."""

    law: LawNumbers
    twist: int


def hinge_kinds(packed: Packed) -> list[tuple[str, Springs | None]]:
    """Kind of the inboard hinge of every body, by place, with the springs of an elastic one.

    Raises SceneError that names an unsupported element.
    """
    _refuse_loads(packed)
    laws = _laws(packed)
    links = packed.topology.links
    return [
        _kind(packed.scene.hinges[link.hinge], link.parent < 0, laws.get(place, ()))
        for place, link in enumerate(links)
    ]


_LOADS = "the only supported loads are gravity and elastic hinges"


def _refuse_loads(packed: Packed) -> None:
    scene = packed.described
    for table, elements, why in (
        ("load", scene.load, _LOADS), ("spring", scene.spring, _LOADS),
        ("bushing", scene.bushing, _LOADS),
        ("event", scene.events, "its steps neither locate nor process events"),
    ):  # fmt: skip
        for element in elements:
            raise refused(f'{table} "{element.name}"', why)
    for body in packed.scene.bodies:
        if body.type != "rigid":
            raise refused(f'body "{body.name}"', f"the type {body.type} has no matrix")


def refused(what: str, why: str) -> SceneError:
    """Error for an element of a scene that has no matrix."""
    return SceneError(f"{what}: method dttmm-classical does not support it: {why}; {WAY_OUT}")


def _laws(packed: Packed) -> dict[int, list[Springs]]:
    """Laws by places of their bodies; SceneError for a law with an effort."""
    found: dict[int, list[Springs]] = {}
    for run in packed.system.laws:
        for law, body, twist, efforts in run.each():
            if any(place >= 0 for place in efforts):
                raise refused(_name(packed, body), "its matrices contain no efforts")
            found.setdefault(body, []).append(Springs(law, twist))
    return found


def _name(packed: Packed, place: int) -> str:
    return f'hinge "{packed.scene.hinges.name(packed.topology.links[place].hinge)}"'


def _kind(hinge: Hinge, on_ground: bool, laws: Sequence[Springs]) -> tuple[str, Springs | None]:
    what = f'hinge "{hinge.name}"'
    if hinge.drive is not None or any(hinge.law.inertia) or hinge.release is not None:
        raise refused(what, "drives, releases and rotor inertia have no matrix")
    kind = _held(hinge.facts)
    if kind is None:
        raise refused(what, f"the type {hinge.type} has no matrix; {_HINGES}")
    if kind != FREE and laws:
        raise refused(
            what, f"a law on a hinge of type {hinge.type} has no matrix; use an elastic hinge"
        )
    if kind != FREE:
        return kind, None
    if not laws:
        if not on_ground:
            raise refused(what, f"the hinge constrains nothing there; {_HINGES}")
        return FREE, None
    if len(laws) != 1 or laws[0].law.kernel != "six":
        raise refused(what, "its friction has no matrix")
    return _sprung(what, laws[0])


def _held(facts: HingeFacts | None) -> str | None:
    """Kind of a hinge by its free motions; None if there is no matrix."""
    if facts is None or not facts.steady:
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


def _sprung(what: str, springs: Springs) -> tuple[str, Springs]:
    """Kind of an elastic hinge by the directions of its springs and dampers."""
    p = springs.law.p
    if not all(p[k] > 0 or p[6 + k] > 0 for k in range(3)):
        raise refused(what, "it needs springs or dampers along x, y and z")
    x, y, z = (p[9 + k] > 0 or p[13 + k] > 0 for k in range(3))
    if (x, y, z) not in _SPRUNG:
        raise refused(what, "it needs springs or dampers about x, y and z, x and y, or none")
    return _SPRUNG[x, y, z], springs
