"""`mstmm.equations`: equations of elements and scenes as text, LaTeX and HTML."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

import sympy as sp

from ..arguments import short, texts_of
from ..derive.catalogue.registry import BASES, Element, instance
from ..derive.show.document import (
    Code,
    Formula,
    Heading,
    Item,
    Paragraph,
    Quantities,
    QuantityRow,
    document,
)
from ..derive.show.formulas import stated
from ..derive.show.layout import layout
from ..derive.show.measure import Columns
from ..derive.show.page import printed
from ..derive.show.subjects import of_element, view
from ..errors import ElementError, SceneError
from ..markup import Displayed
from ..scene import Scene
from ..scene.checks.types import types
from ..scene.load import is_scene_file
from .closed import ClosedEquations, Motion, closed
from .drawing import path, tree

if TYPE_CHECKING:
    from ..runtime.model.model import Model


@dataclass(frozen=True, eq=False)
class Equations(Displayed):
    """Page of equations: `text`, `latex` (needs amsmath) and `html`; notebooks display it.

    Attributes:
        closed: M(q) u' + h = tau of a scene, in SymPy; None for an element, and for a scene without
            a closed form, whose page states the reason.
    """

    title: str
    items: Callable[[Columns], list[Item]]
    closed: ClosedEquations | None = None

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return f"<Equations: {self.title}>"

    @property
    def text(self) -> str:
        """Page as text, 100 columns wide."""
        return printed(self.title, self.items, "text")

    @property
    def latex(self) -> str:
        """Page as a fragment of a LaTeX document (needs amsmath)."""
        return printed(self.title, self.items, "latex")

    @property
    def html(self) -> str:
        """Page as one self-contained HTML document."""
        return printed(self.title, self.items, "html")

    def _plain(self) -> str:
        return self.text

    def _repr_latex_(self) -> str:
        return self.latex

    def _repr_html_(self) -> str:
        page = escape(self.html)
        return f'<iframe srcdoc="{page}" style="width: 100%; height: 32rem; border: 0"></iframe>'


def equations(
    of: str | os.PathLike[str] | Scene | Model | Element, keep: Sequence[str] = ()
) -> Equations:
    """Equations of an element, or of a scene: tree, passes of the sweep, closed form.

    The closed form M(q) u' + h(q, u, t) = tau is given for small trees.

    Args:
        of: name of an element ("pin", "force_spring"; `mstmm list`), a user-defined element, a
            scene, the path of its file, or its model.
        keep: numbers of the scene that stay symbols, such as "rod1.mass" or "gravity[1]".

    Raises ElementError for an unknown element, SceneError for an invalid scene, and for names in
    `keep` that it does not have.
    """
    keep = texts_of("keep", keep, "rod1.mass")
    if isinstance(of, str) and not is_scene_file(of):
        return _of_element(of, keep)
    if isinstance(of, str | os.PathLike | Scene):
        from .compilation import compile_scene

        return _of_model(compile_scene(of, engine="looped"), keep)
    from ..runtime.model.model import Model

    if isinstance(of, Model):
        return _of_model(of, keep)
    if not isinstance(of, Element):
        if not (isinstance(of, type) and issubclass(of, BASES)):
            raise ElementError(
                "equations: expected the name of an element, an element, a scene, its file or its "
                f"model, found {short(of)}"
            )
        of = instance(of)
    return _of_element(of, keep)


def _of_element(of: str | Element, keep: Sequence[str]) -> Equations:
    if keep:
        raise ElementError("keep applies to scenes; parameters of an element are always symbols")
    shown = view(of) if isinstance(of, str) else of_element(of)
    return Equations(shown.title, lambda measure: document(shown, "equations", measure))


def _of_model(model: Model, keep: Sequence[str] = ()) -> Equations:
    """Equations of a scene; see `equations`."""
    found: ClosedEquations | None = None
    refused = ""
    try:
        found = closed(model, keep)
    except SceneError as error:
        if keep:
            raise
        refused = str(error)
    title = f"scene of {model.scene.summary}"
    return Equations(title, lambda m: _items(model, title, found, refused, m), found)


def _items(
    model: Model, title: str, found: ClosedEquations | None, refused: str, measure: Columns
) -> list[Item]:
    elements = ", ".join(f"mstmm show {kind}_{name}" for kind, name in sorted(types(model.scene)))
    items: list[Item] = [
        Heading(title, 1),
        Heading("Tree", 2),
        Code("\n".join(tree(model))),
        Paragraph(f"Equations of its elements: {elements}."),
        Heading("Passes of the sweep", 2),
    ]
    if model.loops.cut:
        items.append(
            Paragraph(
                "Loads of closed loops are computed in addition: mstmm show sweep_loops, "
                "mstmm show sweep"
            )
        )
    for whole, lines in path(model):
        items += [
            Paragraph(f"{whole.name}, {whole.order}: {whole.purpose}"),
            Code("\n".join(lines)),
        ]
    items.append(Heading("Equations in closed form", 2))
    told = Paragraph(f"They are not available: {refused}.")
    return items + (_closed(found, measure) if found else [told])


def _closed(found: ClosedEquations, measure: Columns) -> list[Item]:
    free = [found.speeds[k] for k in found.free]
    rates = sp.Matrix([sp.Symbol(f"udot{str(one.symbol)[1:]}") for one in free])
    names = tuple(str(one.symbol).partition("_")[2] for one in free)
    n = len(free)
    m, h, tau, u = (sp.MatrixSymbol(name, n, k) for name, k in
                    (("M", n), ("h", 1), ("tau", 1), ("udot", 1)))  # fmt: skip
    rows = [*(_row(one, "coordinate") for one in found.coordinates),
            *(_row(one, "speed") for one in found.speeds)]  # fmt: skip
    kept = [QuantityRow(layout(s), name, "1", "", "") for name, s in
            (*found.parameters.items(), *found.inputs.items())]  # fmt: skip
    return [
        Quantities((*rows, *kept)),
        Formula("equations of motion", tuple(stated(m * u + h, tau, measure=measure))),
        Formula("accelerations", tuple(stated(u, rates, measure=measure))),
        Formula("mass matrix", tuple(stated(m, found.M, measure=measure))),
        Formula("inertia, gravity, laws and loads", tuple(stated(h, found.h, names, measure))),
        Paragraph(
            "tau are efforts on the speeds in addition to those of the laws. Numbers of the scene "
            "that are not kept as symbols have their values."
        ),
    ]


def _row(one: Motion, what: str) -> QuantityRow:
    return QuantityRow(
        layout(one.symbol), one.name, "1", one.unit, f"{what} of {one.name.rpartition('.')[0]}"
    )
