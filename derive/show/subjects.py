"""Subjects of `mstmm show`: all elements and steps of the sweep, by name.

A full name is kind and name, as in the C files: hinge_pin, body_rigid, force_spring, sweep_frames,
classical_ball.  A name without kind means the first of these kinds that has it.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache, partial

from mstmm.errors import ElementError
from mstmm.ir.element_spec import ElementSpec

from ..catalogue.element_specs import generic_spec, shared_specs, spec_of
from ..catalogue.kernels import MAX_SPEEDS, Kernel, built_in, built_in_kernels, kernels_of
from ..catalogue.registry import Element, builtin_elements, kind_of
from ..classical.catalogue import classical_spec
from ..codegen.template_rendering import element_source
from ..definition.derivation import Derivation
from ..definition.element import Hinge
from ..elements.body_rigid import RigidBody
from ..equations.hinge import speeds_of
from ..equations.rigid_body import newton_euler_form
from .document import ElementView, Heading, Item, Paragraph, document
from .line_breaking import TextWidth
from .symbol_names import DeclaredNames, declared_names

__all__ = [
    "ELEMENT_KINDS",
    "ElementView",
    "element_view",
    "full_name",
    "full_names",
    "view_of_element",
]

ELEMENT_KINDS = ("hinge", "body", "force", "classical", "sweep")

#: Alias of an element: same motion, its law is in sweep_laws.
_ALIASES = {"hinge_elastic": ("hinge", "free")}


def full_names() -> list[str]:
    """All full names, by kind."""
    return list(_element_keys())


@cache
def _element_keys() -> dict[str, tuple[str, str]]:
    keys = sorted(built_in(), key=lambda key: ELEMENT_KINDS.index(key[0]))
    return {f"{kind}_{name}": (kind, name) for kind, name in keys} | _ALIASES


def full_name(name: str, available: Iterable[str]) -> str | None:
    """Full name for a name given by the user; None if there is none."""
    known_names = set(available)
    return next(
        (c for c in (name, *(f"{kind}_{name}" for kind in ELEMENT_KINDS)) if c in known_names), None
    )


def element_view(name: str) -> ElementView:
    """View of a built-in element.  Raises ElementError with a suggestion if unknown."""
    matched_name = full_name(name, _element_keys())
    if matched_name is None:
        short = [key.split("_", 1)[1] for key in _element_keys()]
        similar_names = difflib.get_close_matches(name, [*_element_keys(), *short], 1, 0.6)
        hint = (
            f'; did you mean "{similar_names[0]}"?'
            if similar_names
            else '; "mstmm list" shows the elements'
        )
        raise ElementError(f'element "{name:.60}": there is no such element{hint}')
    kind, element_name = _element_keys()[matched_name]
    for element in builtin_elements():
        if (kind_of(element), element.name) == (kind, element_name):
            return view_of_element(element)
    return _view_of_step(kind, element_name)


def view_of_element(element: Element) -> ElementView:
    """View of a hinge, body or force element, built-in or user-defined."""
    name = f"{kind_of(element)}_{element.name}"
    preceding = tuple(
        make() for kind, make in _PRECEDING_DERIVATIONS.items() if type(element) is kind
    )
    sources = (
        *element.sources,
        *(source for derivation in preceding for source in derivation.sources),
    )
    base_view = _make_view(
        name, element.title or element.name, kernels_of(element), sources,
        lambda: element_source(spec_of(element)), _names_of_element(element), preceding,
    )  # fmt: skip
    return replace(base_view, is_element=True)


#: Derivations shown before the equations of an element.
_PRECEDING_DERIVATIONS: dict[type, Callable[[], Derivation]] = {RigidBody: newton_euler_form}


def _names_of_element(element: Element) -> DeclaredNames:
    if isinstance(element, Hinge):
        return declared_names(element.coordinates, speeds_of(element), element.parameters)
    return declared_names((), (), element.parameters)


def _view_of_step(kind: str, name: str) -> ElementView:
    """View of a classical matrix or a step of the sweep."""
    spec = cache(partial(_spec_of_step, kind, name))
    kernels = built_in_kernels(kind, name)
    title = kernels[0].derivation.title if kind == "classical" else _STEP_TITLES.get(name, name)
    return _make_view(f"{kind}_{name}", title, kernels, (), lambda: element_source(spec()))


_STEP_TITLES = {
    "frames": "poses, points and loads",
    "laws": "laws on hinge coordinates",
    "beam": "Euler-Bernoulli beam",
    "modal": "flexible bodies",
} | {f"generic{nu}": f"sweep across a hinge with {nu} speeds" for nu in range(MAX_SPEEDS + 1)}


def _spec_of_step(kind: str, name: str) -> ElementSpec:
    if kind == "classical":
        return classical_spec(name)
    if name.startswith("generic"):
        return generic_spec(int(name.removeprefix("generic")))
    return next(spec for spec in shared_specs() if spec.name == name)


def _make_view(
    name: str,
    title: str,
    kernels: tuple[Kernel, ...],
    sources: tuple[str, ...],
    c_text: Callable[[], str],
    names: DeclaredNames | None = None,
    before: tuple[Derivation, ...] = (),
) -> ElementView:
    derivations = (*before, *(k.derivation for k in kernels))
    return ElementView(
        name, title, derivations, lambda: [kernel.ir() for kernel in kernels], c_text, sources,
        names or DeclaredNames(),
    )  # fmt: skip


# --- a hinge's classical transfer matrix and its motion subspace ----------------------------------

#: Hinges that have a classical matrix in acceleration form.
CLASSICAL_COUNTERPARTS = {"hinge_ball": "classical_ball", "hinge_pin": "classical_pin_spatial"}

_EXPLANATION = (
    "Both forms relate accelerations and loads on the two sides of a hinge. The classical matrix "
    "maps the state z_I of the inboard side to the state z_O of the outboard side. The relative "
    "acceleration follows from a block of the outboard body, so the matrix depends on hinge and "
    "body. The motion subspace H depends on the hinge only: the relative acceleration is H udot, "
    "and the load f satisfies H^T f = tau with the effort tau. The sweep then uses f = S a + e of "
    "the outboard body and factors D = H^T S H, which has one row for each free speed."
)


def classical_comparison(name: str) -> tuple[str, Callable[[TextWidth], list[Item]]]:
    """Title and items of a page that compares both forms of a hinge ("hinge_pin").

    Raises ElementError for a hinge without a classical matrix.
    """
    if name not in CLASSICAL_COUNTERPARTS:
        available = ", ".join(
            full_name.removeprefix("hinge_") for full_name in CLASSICAL_COUNTERPARTS
        )
        raise ElementError(f"{name}: no classical matrix exists; expected one of {available}")
    hinge_view = element_view(name)
    title = f"{hinge_view.title}, classical and by motion subspace"

    def items(measure: TextWidth) -> list[Item]:
        page_items: list[Item] = [Heading(title, 1), Paragraph(_EXPLANATION)]
        for heading, counterpart in (
            ("Classical transfer matrix", element_view(CLASSICAL_COUNTERPARTS[hinge_view.name])),
            ("Motion subspace", hinge_view),
        ):
            page_items += [Heading(heading, 2), *document(counterpart, "equations", measure)[1:]]
        return page_items

    return title, items
