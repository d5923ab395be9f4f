"""Messages for failures of the engine: element, time, cause, remedy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from mstmm.border.failures import Failed
from mstmm.ir.statements import NEGATIVE
from mstmm.scene import Bushing

from ..pack.layout import OF_CONSTRAINT
from ..pack.packed import Packed


class Naming(Protocol):
    """Engine that names the elements at a place of the topology."""

    packed: Packed

    def hinge_name(self, position: int, /) -> str: ...
    def body_name(self, position: int, /) -> str: ...
    def is_flexible(self, position: int, /) -> bool: ...
    def closing(self, position: int, /) -> str: ...


def failure_text(engine: Naming, reason: int, element: int, code: int, t: float) -> str:
    """Message for `element`, which failed for `reason` at t (s); `code` is that of its kernel."""
    sentence = _SENTENCES.get(reason, _expression)
    return sentence(engine, element, f"at t = {t:.9g} s", code)


def _undetermined(engine: Naming, element: int, at: str, code: int) -> str:
    hinge = engine.hinge_name(element)
    if engine.is_flexible(element):
        body = engine.body_name(element).split("/")[0]
        return (
            f'hinge "{hinge}" {at}: what it moves has no positive inertia left: the shapes of the '
            f'flexible body "{body}" take all of it, or its deflection is beyond the stiffened '
            'model; use fewer shapes, frame = "chord" or "mean", quadrature = true, or split it '
            "into welded beams"
        )
    return (
        f'hinge "{hinge}" {at}: a motion of it is undetermined, because what it carries has no '
        "positive inertia in that direction (a thin rod on a ball, a point mass, collinear axes, "
        "three angles at their lock, a negative principal moment); give the body inertia, give the "
        "hinge rotor inertia (law.inertia), fix that motion, or use a ball hinge for three angles"
    )


def _force(engine: Naming, element: int, at: str, code: int) -> str:
    one = engine.packed.scene.forces[element]
    if isinstance(one, Bushing):
        return (
            f'bushing "{one.name}" {at}: its ends are rotated by more than 170 degrees from rest, '
            "beyond its law; make it stiffer, or replace it by a hinge with a law"
        )
    return (
        f'spring "{one.name}" {at}: its direction is undefined because its ends coincide; move one '
        "of them, or replace it by an elastic hinge or a bushing"
    )


def _expression(engine: Naming, element: int, at: str, code: int) -> str:
    return f"an expression of the scene cannot be evaluated {at}"


def _hinge(engine: Naming, element: int, at: str, code: int) -> str:
    name = engine.hinge_name(element)
    if name.endswith(OF_CONSTRAINT):
        curve = name.removesuffix(OF_CONSTRAINT)
        return f'constraint "{curve}" {at}: its curve, or a slope of it, is not finite there'
    return f'hinge "{name}" {at}: its definition fails in this state'


def _product_pivot(engine: Naming, element: int, at: str, code: int) -> str:
    return (
        f'hinge "{engine.hinge_name(element)}" {at}: the pivot of its classical matrix vanishes, '
        'so the product does not exist in this state; use sweep = "riccati"'
    )


def _product_error(engine: Naming, element: int, at: str, code: int) -> str:
    return (
        f"the product of transfer matrices {at}: its deviation from the Riccati sweep exceeds the "
        "requested accuracy (errors grow geometrically along the chain); "
        'use sweep = "riccati"'
    )


def _section(engine: Naming, element: int, at: str, code: int) -> str:
    name = engine.hinge_name(element).replace("/", ".")
    return (
        f'"{name}" {at}: a section turns by more than 1.5 rad against its floating frame, far '
        "beyond small deflections; split the body into several that are welded together"
    )


def _modes(engine: Naming, element: int, at: str, code: int) -> str:
    return (
        f'flexible body "{engine.body_name(element)}" {at}: its modal mass matrix is not positive '
        'definite; use fewer shapes, frame = "chord" or "mean", or quadrature = true'
    )


def _tangent(engine: Naming, element: int, at: str, code: int) -> str:
    name = engine.hinge_name(element) if element >= 0 else ""
    what = f'hinge "{name}"' if name else "force elements between bodies"
    if code == NEGATIVE:
        return (
            f"{what} {at}: an unstable motion grows faster than the step allows (a negative "
            "stiffness, a body that topples or buckles, inertia that vanishes); use a shorter "
            "step, or give the motion inertia (law.inertia) or a spring"
        )
    return (
        f"{what} {at}: the equations of an implicit step leave a motion undetermined: it has no "
        "inertia, stiffness or damping, or a negative stiffness cancels them; use a shorter step, "
        "or give the motion inertia (law.inertia) or a spring"
    )


def _controller(engine: Naming, element: int, at: str, code: int) -> str:
    name = engine.packed.described.controller[element].name
    return (
        f'controller "{name}" {at}: its measurement or output is not finite; check whether the '
        "closed loop is stable, perhaps with a shorter sample_time"
    )


def _loop(engine: Naming, element: int, at: str, code: int) -> str:
    way = engine.packed.behind() or (
        "start from model.assemble(q, u), or check whether links are stretched out in line "
        "(model.loops.singular), or a drive requires a motion that the mechanism cannot make"
    )
    return (
        f"{engine.closing(element)} {at}: the loop that it closes is open, and no state near "
        f"closes it; {way}"
    )


def _coupling(engine: Naming, element: int, at: str, code: int) -> str:
    return (
        f'coupling "{engine.packed.system.couplings[element].name}" {at}: it is not satisfied, and '
        "no state near satisfies it; check whether drives or other couplings contradict it"
    )


def _flat(engine: Naming, element: int, at: str, code: int) -> str:
    return (
        f"{engine.closing(element)} {at}: the disc is flat on its plane and touches it in more "
        "than a point; end the run before that by an [[event]], or start it upright"
    )


def _bounce(engine: Naming, element: int, at: str, code: int) -> str:
    return (
        f"{engine.packed.described.happening(element)} {at}: no motion can respond to its "
        "impact, because what it hits is driven or held; use another place for the bounce, or "
        "release the hinge"
    )


_SENTENCES: dict[int, Callable[[Naming, int, str, int], str]] = {
    Failed.UNDETERMINED: _undetermined, Failed.FORCE: _force, Failed.EXPRESSION: _expression,
    Failed.HINGE: _hinge, Failed.PRODUCT_PIVOT: _product_pivot,
    Failed.PRODUCT_ERROR: _product_error, Failed.SECTION: _section, Failed.MODES: _modes,
    Failed.TANGENT: _tangent, Failed.CONTROLLER: _controller, Failed.LOOP: _loop,
    Failed.BOUNCE: _bounce, Failed.COUPLING: _coupling, Failed.FLAT: _flat,
}  # fmt: skip
