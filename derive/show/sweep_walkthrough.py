"""Explanation of the sweep by its equations, for a hinge of two speeds.

Chapters: motion, absorption, hinge, port, recovery.  The equations are those of the kernels that
the schedule calls.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..catalogue.kernels import built_in_kernels
from ..definition.derivation import Derivation, Equation
from ..equations.rigid_body import newton_euler_form
from .document import FormulaWriter, Heading, Item, Paragraph
from .entry_names import DeclaredNames
from .formula_width import TextWidth

#: Element whose kernels are shown, and the last equation on the hinge before the port.
_ELEMENT, _ON_THE_HINGE = "generic2", "e_Q"


def walkthrough_items(measure: TextWidth) -> Iterator[Item]:
    """Chapters in the order of the sweep."""
    body, forward = newton_euler_form(), _kernel_derivation("forward")
    condense, recover = _kernel_derivation("condense"), _kernel_derivation("recover")
    names = [_left_name(e) for e in condense.definitions]
    port = names.index(_ON_THE_HINGE) + 1
    chapters = (
        ("Motion, root to tips",
         "With zero accelerations of the free speeds, the motion is passed from body to body.",
         forward, forward.definitions),
        ("Contribution of a body",
         "Deviations delta a from that motion require the load f = S a + e at the input end. The "
         "body adds its mass matrix to S, and to e the load that the motion above requires; the "
         "outboard bodies have already added their S and e.",
         body, body.definitions),
        ("Across a hinge, tips to root",
         "On the free speeds the load is the effort tau, which gives udot = g - G a and leaves "
         "S_Q and e_Q to the inboard side.",
         condense, condense.definitions[:port]),
        ("The port",
         "Transformed to the axes of the parent and to its point P, they are added to its own.",
         condense, condense.definitions[port:]),
        ("Recovery, root to tips",
         "At the root the deviation is zero. Every hinge computes its accelerations and passes "
         "the deviation on to the outboard body.",
         recover, recover.definitions),
    )  # fmt: skip
    for title, explanation, derivation, equations in chapters:
        yield Heading(title, 2)
        yield Paragraph(explanation)
        yield from _formula_items(derivation, equations, measure)


def _kernel_derivation(name: str) -> Derivation:
    kernel = next(k for k in built_in_kernels("sweep", _ELEMENT) if k.name == name)
    return kernel.derivation


def _left_name(equation: Equation) -> str:
    return str(getattr(equation.left, "name", ""))


def _formula_items(
    derivation: Derivation, equations: tuple[Equation, ...], measure: TextWidth
) -> Iterator[Item]:
    writer = FormulaWriter(derivation, DeclaredNames(), measure)
    for equation in equations:
        yield writer.formula(equation)
