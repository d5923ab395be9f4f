"""Messages for engine failures: element, time, cause, remedy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from mstmm.abi.failure_codes import FailureCode
from mstmm.ir.statements import NEGATIVE_DETERMINANT
from mstmm.scene import Bushing

from ..packing.coordinate_layout import OF_CONSTRAINT
from ..packing.packed_scene import PackedScene


class ElementNames(Protocol):
    """Engine that names the elements at a topology index."""

    packed: PackedScene

    def hinge_name(self, position: int, /) -> str: ...
    def body_name(self, position: int, /) -> str: ...
    def is_flexible(self, position: int, /) -> bool: ...
    def closing_label(self, position: int, /) -> str: ...


def failure_text(engine: ElementNames, reason: int, element: int, code: int, t: float) -> str:
    """Message for the failure of `element` at t (s); `code` is the failure code of its kernel."""
    make_text = _TEXT_BY_REASON.get(reason, _expression_text)
    return make_text(engine, element, f"at t = {t:.9g} s", code)


def _undetermined_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    hinge = engine.hinge_name(element)
    if engine.is_flexible(element):
        body = engine.body_name(element).split("/")[0]
        return (
            f'hinge "{hinge}" {at}: no positive inertia remains along its motion: the shapes of '
            f'flexible body "{body}" represent all of it, or its deflection is too large for the '
            'stiffened model; use fewer shapes, frame = "chord" or "mean", quadrature = true, or '
            "split it into welded beams"
        )
    return (
        f'hinge "{hinge}" {at}: its motion is undetermined, because the outboard bodies have no '
        "positive inertia along it (a thin rod on a ball hinge, a point mass, collinear axes, "
        "gimbal lock of three angles, a negative principal moment); give the body inertia, give "
        "the hinge rotor inertia (law.inertia), fix that motion, or use a ball hinge for three "
        "angles"
    )


def _force_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    force = engine.packed.scene.forces[element]
    if isinstance(force, Bushing):
        return (
            f'bushing "{force.name}" {at}: its ends are rotated by more than 170 degrees from '
            "rest, the limit of its law; make it stiffer, or replace it by a hinge with a law"
        )
    return (
        f'spring "{force.name}" {at}: its direction is undefined because its ends coincide; move '
        "one of them, or replace it by an elastic hinge or a bushing"
    )


def _expression_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    return f"an expression of the scene cannot be evaluated {at}"


def _hinge_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    name = engine.hinge_name(element)
    if name.endswith(OF_CONSTRAINT):
        curve = name.removesuffix(OF_CONSTRAINT)
        return f'constraint "{curve}" {at}: its curve or a derivative of it is not finite'
    return f'hinge "{name}" {at}: its definition cannot be evaluated at this state'


def _product_pivot_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    return (
        f'hinge "{engine.hinge_name(element)}" {at}: the pivot of its classical matrix vanishes, '
        'so that the product does not exist at this state; use sweep = "riccati"'
    )


def _product_error_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    return (
        f"the product of transfer matrices {at}: its deviation from the Riccati sweep exceeds the "
        "requested accuracy (errors grow geometrically along the chain); "
        'use sweep = "riccati"'
    )


def _section_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    name = engine.hinge_name(element).replace("/", ".")
    return (
        f'"{name}" {at}: a section rotates by more than 1.5 rad relative to its floating frame, '
        "the limit of small deflections; split the body into several welded bodies"
    )


def _modes_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    return (
        f'flexible body "{engine.body_name(element)}" {at}: its modal mass matrix is not positive '
        'definite; use fewer shapes, frame = "chord" or "mean", or quadrature = true'
    )


def _tangent_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    name = engine.hinge_name(element) if element >= 0 else ""
    subject = f'hinge "{name}"' if name else "force elements between bodies"
    if code == NEGATIVE_DETERMINANT:
        return (
            f"{subject} {at}: an unstable motion grows faster than the step allows (a negative "
            "stiffness, a body that topples or buckles, inertia that vanishes); use a shorter "
            "step, or give the motion inertia (law.inertia) or a spring"
        )
    return (
        f"{subject} {at}: a motion is undetermined in the equations of an implicit step: it has no "
        "inertia, stiffness or damping, or a negative stiffness cancels them; use a shorter step, "
        "or give the motion inertia (law.inertia) or a spring"
    )


def _controller_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    name = engine.packed.user_scene.controller[element].name
    return (
        f'controller "{name}" {at}: its measurement or output is not finite; check whether the '
        "closed loop is stable, perhaps with a shorter sample_time"
    )


def _loop_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    remedy = engine.packed.find_loop_cause() or (
        "start from model.assemble(q, u), or check whether links are stretched out in line "
        "(model.loops.singular), or a drive requires a motion that the mechanism cannot make"
    )
    return (
        f"{engine.closing_label(element)} {at}: its loop is open, and no nearby state closes it; "
        f"{remedy}"
    )


def _coupling_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    return (
        f'coupling "{engine.packed.system.couplings[element].name}" {at}: it is not satisfied, and '
        "no nearby state satisfies it; check whether drives or other couplings contradict it"
    )


def _flat_disc_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    return (
        f"{engine.closing_label(element)} {at}: the disc is flat on its plane and touches it in "
        "more than one point; end the run before that by an [[event]], or start it upright"
    )


def _bounce_text(engine: ElementNames, element: int, at: str, code: int) -> str:
    return (
        f"{engine.packed.user_scene.event_label(element)} {at}: no motion can respond to its "
        "impact, because the bodies in contact are driven or fixed; move the bounce to another "
        "body, or release the hinge"
    )


_TEXT_BY_REASON: dict[int, Callable[[ElementNames, int, str, int], str]] = {
    FailureCode.UNDETERMINED: _undetermined_text,
    FailureCode.FORCE: _force_text,
    FailureCode.EXPRESSION: _expression_text,
    FailureCode.HINGE: _hinge_text,
    FailureCode.PRODUCT_PIVOT: _product_pivot_text,
    FailureCode.PRODUCT_ERROR: _product_error_text,
    FailureCode.SECTION: _section_text,
    FailureCode.MODES: _modes_text,
    FailureCode.TANGENT: _tangent_text,
    FailureCode.CONTROLLER: _controller_text,
    FailureCode.LOOP: _loop_text,
    FailureCode.BOUNCE: _bounce_text,
    FailureCode.COUPLING: _coupling_text,
    FailureCode.FLAT: _flat_disc_text,
}
