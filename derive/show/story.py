"""The sweep explained by its equations, for a hinge of two speeds.

Chapters: motion, absorbing, hinge, port, recovery.  The equations are those of the kernels
that the schedule calls.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..catalogue.kernels import built_in_kernels
from ..equations.rigid_body import newton_euler_form
from ..language.derivation import Derivation, Equation
from .document import Heading, Item, Paragraph, Written
from .entries import Declared
from .measure import Columns

#: The element whose kernels are shown, and the last equation on the hinge before the port.
_ELEMENT, _ON_THE_HINGE = "generic2", "e_Q"


def story(measure: Columns) -> Iterator[Item]:
    """Chapters in the order of the sweep."""
    body, forward = newton_euler_form(), _kernel("forward")
    condense, recover = _kernel("condense"), _kernel("recover")
    names = [_left(e) for e in condense.definitions]
    port = names.index(_ON_THE_HINGE) + 1
    chapters = (
        ("Motion, root to tips",
         "With accelerations of the free speeds left zero, every hinge hands the motion on.",
         forward, forward.definitions),
        ("A body absorbed",
         "Deviations delta a from that motion need the load f = S a + e at the input end. The body "
         "alone brings its mass matrix to S, and to e what the motion above needs; what hangs on "
         "it has added its own S and e before.",
         body, body.definitions),
        ("Across a hinge, tips to root",
         "On the free speeds the load is the effort tau, which gives udot = g - G a and leaves "
         "S_Q and e_Q to the inboard side.",
         condense, condense.definitions[:port]),
        ("The port",
         "Turned to the axes of the parent and moved to its point P, they are added to its own.",
         condense, condense.definitions[port:]),
        ("Recovery, root to tips",
         "At the root the deviation is known: it is zero on the ground. Every hinge finds its "
         "accelerations and hands the deviation on.",
         recover, recover.definitions),
    )  # fmt: skip
    for title, said, derivation, equations in chapters:
        yield Heading(title, 2)
        yield Paragraph(said)
        yield from _told(derivation, equations, measure)


def _kernel(name: str) -> Derivation:
    found = next(k for k in built_in_kernels("sweep", _ELEMENT) if k.name == name)
    return found.derivation


def _left(equation: Equation) -> str:
    return str(getattr(equation.left, "name", ""))


def _told(
    derivation: Derivation, equations: tuple[Equation, ...], measure: Columns
) -> Iterator[Item]:
    written = Written(derivation, Declared(), measure)
    for equation in equations:
        yield written.formula(equation)
