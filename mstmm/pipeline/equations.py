"""`mstmm.equations`: equations of elements and scenes as text, LaTeX and HTML."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

import sympy as sp

from ..argument_validation import abbreviate, require_texts
from ..derive.catalogue.registry import BASES, Element, instance
from ..derive.schedule.forward_kinematics import FORWARD
from ..derive.schedule.pass_steps import Pass
from ..derive.schedule.riccati_sweep import CONDENSE, RECOVER
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
from ..derive.show.formula_layout import layout
from ..derive.show.formulas import equation_lines
from ..derive.show.line_breaking import TextWidth
from ..derive.show.show_page import render_page
from ..derive.show.subjects import element_view, view_of_element
from ..display import NotebookDisplay
from ..errors import ElementError, SceneError
from ..runtime.model.model import Model
from ..scene import Scene
from ..scene.checks.user_types import used_types
from ..scene.load import is_scene_file
from .symbolic_equations import Motion, SymbolicEquations, symbolic_equations

if TYPE_CHECKING:
    from ..runtime.model.model import Model


# --- tree -----------------------------------------------------------------------------------------

#: Largest number of lines of a tree or pass; longer ones end with the number omitted.
MAX_LINES = 60
_GROUND = "ground"


@dataclass(frozen=True)
class TreeEdge:
    """Hinge between two bodies, an edge of the drawn tree."""

    name: str
    type: str
    inboard: str
    outboard: str


def tree_edges(model: Model) -> list[TreeEdge]:
    """Hinges of a scene, including those of chains, excluding those of constraints."""
    return [
        TreeEdge(
            hinge.name,
            hinge.type,
            hinge.inboard.partition(".")[0],
            hinge.outboard.partition(".")[0],
        )
        for hinge in model.scene.hinges
    ]


def tree_lines(model: Model) -> list[str]:
    """Lines of the tree from the ground outwards: each hinge with the body that it carries."""
    hinges, cut = tree_edges(model), set(model.loops.cut_hinges)
    edges_by_body: dict[str, list[TreeEdge]] = {}
    for edge in hinges:
        edges_by_body.setdefault(edge.inboard, []).append(edge)
    lines = [_GROUND]
    stack = _branches(edges_by_body, _GROUND, "")
    while stack:
        edge, indent, is_last = stack.pop()
        mark = " (closes a loop)" if edge.name in cut else ""
        lines.append(
            f"{indent}{'└─' if is_last else '├─'} {edge.name} ({edge.type}) ─ {edge.outboard}{mark}"
        )
        if edge.name not in cut:
            stack += _branches(edges_by_body, edge.outboard, indent + ("   " if is_last else "│  "))
    return _truncate(lines)


def _branches(
    held: dict[str, list[TreeEdge]], body: str, before: str
) -> list[tuple[TreeEdge, str, bool]]:
    """Hinges on a body in reverse order, as needed by a stack."""
    edges = held.get(body, [])
    return [(edge, before, edge is edges[-1]) for edge in reversed(edges)]


def sweep_passes(model: Model) -> list[tuple[Pass, list[str]]]:
    """Passes of the sweep over a tree, each with the bodies in its order."""
    edges = [
        edge for edge in _edges_from_root(model) if edge.name not in set(model.loops.cut_hinges)
    ]
    outward_lines = _truncate([f"{j.inboard} → {j.outboard} across {j.name}" for j in edges])
    inward_lines = _truncate(
        [f"{j.outboard} → {j.inboard} across {j.name}" for j in reversed(edges)]
    )
    return [(FORWARD, outward_lines), (CONDENSE, inward_lines), (RECOVER, outward_lines)]


def _edges_from_root(model: Model) -> Iterator[TreeEdge]:
    remaining, reached_bodies = tree_edges(model), {_GROUND}
    while remaining:
        ready = [edge for edge in remaining if edge.inboard in reached_bodies]
        if not ready:
            return
        for edge in ready:
            reached_bodies.add(edge.outboard)
            remaining.remove(edge)
            yield edge


def _truncate(lines: list[str]) -> list[str]:
    if len(lines) <= MAX_LINES:
        return lines
    return [*lines[:MAX_LINES], f"... and {len(lines) - MAX_LINES} more"]


# --- page -----------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class EquationSheet(NotebookDisplay):
    """Page of equations: `text`, `latex` (needs amsmath) and `html`; notebooks display it.

    Attributes:
        closed: M(q) u' + h = tau of a scene, in SymPy; None for an element, and for a scene without
            a closed form, whose page states the reason.
    """

    title: str
    items: Callable[[TextWidth], list[Item]]
    closed: SymbolicEquations | None = None

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return f"<Equations: {self.title}>"

    @property
    def text(self) -> str:
        """Page as text, 100 columns wide."""
        return render_page(self.title, self.items, "text")

    @property
    def latex(self) -> str:
        """Page as a fragment of a LaTeX document (needs amsmath)."""
        return render_page(self.title, self.items, "latex")

    @property
    def html(self) -> str:
        """Page as one self-contained HTML document."""
        return render_page(self.title, self.items, "html")

    def _plain_text(self) -> str:
        return self.text

    def _repr_latex_(self) -> str:
        return self.latex

    def _repr_html_(self) -> str:
        page = escape(self.html)
        return f'<iframe srcdoc="{page}" style="width: 100%; height: 32rem; border: 0"></iframe>'


def equations(
    of: str | os.PathLike[str] | Scene | Model | Element, keep: Sequence[str] = ()
) -> EquationSheet:
    """Equations of an element, or of a scene: tree, passes of the sweep, closed form.

    The closed form M(q) u' + h(q, u, t) = tau is given for small trees.

    Args:
        of: name of an element ("pin", "force_spring"; `mstmm list`), a user-defined element, a
            scene, the path of its file, or its model.
        keep: numbers of the scene that stay symbols, such as "rod1.mass" or "gravity[1]".

    Raises ElementError for an unknown element, SceneError for an invalid scene, and for names in
    `keep` that it does not have.
    """
    keep = require_texts("keep", keep, "rod1.mass")
    if isinstance(of, str) and not is_scene_file(of):
        return _element_page(of, keep)
    if isinstance(of, str | os.PathLike | Scene):
        from .compilation import compile_scene

        return _model_page(compile_scene(of, engine="looped"), keep)
    from ..runtime.model.model import Model

    if isinstance(of, Model):
        return _model_page(of, keep)
    if not isinstance(of, Element):
        if not (isinstance(of, type) and issubclass(of, BASES)):
            raise ElementError(
                "equations: expected the name of an element, an element, a scene, its file or its "
                f"model, found {abbreviate(of)}"
            )
        of = instance(of)
    return _element_page(of, keep)


def _element_page(of: str | Element, keep: Sequence[str]) -> EquationSheet:
    if keep:
        raise ElementError("keep applies to scenes; parameters of an element are always symbols")
    shown = element_view(of) if isinstance(of, str) else view_of_element(of)
    return EquationSheet(shown.title, lambda measure: document(shown, "equations", measure))


def _model_page(model: Model, keep: Sequence[str] = ()) -> EquationSheet:
    """Sheet of a scene: its tree and passes, and closed equations where they are short enough."""
    closed_form: SymbolicEquations | None = None
    reason = ""
    try:
        closed_form = symbolic_equations(model, keep)
    except SceneError as error:
        if keep:
            raise
        reason = str(error)
    title = f"scene of {model.scene.summary}"
    return EquationSheet(title, lambda m: _items(model, title, closed_form, reason, m), closed_form)


def _items(
    model: Model, title: str, found: SymbolicEquations | None, refused: str, measure: TextWidth
) -> list[Item]:
    elements = ", ".join(
        f"mstmm show {kind}_{name}" for kind, name in sorted(used_types(model.scene))
    )
    items: list[Item] = [
        Heading(title, 1),
        Heading("Tree", 2),
        Code("\n".join(tree_lines(model))),
        Paragraph(f"Equations of its elements: {elements}."),
        Heading("Passes of the sweep", 2),
    ]
    if model.loops.cut_hinges:
        items.append(
            Paragraph(
                "Loads of closed loops are computed in addition: mstmm show sweep_loops, "
                "mstmm show sweep"
            )
        )
    for sweep_pass, lines in sweep_passes(model):
        items += [
            Paragraph(f"{sweep_pass.name}, {sweep_pass.order}: {sweep_pass.purpose}"),
            Code("\n".join(lines)),
        ]
    items.append(Heading("Equations in closed form", 2))
    notice = Paragraph(f"They are not available: {refused}.")
    return items + (_closed_form_items(found, measure) if found else [notice])


def _closed_form_items(found: SymbolicEquations, measure: TextWidth) -> list[Item]:
    free = [found.speeds[k] for k in found.free_speed_indices]
    rates = sp.Matrix([sp.Symbol(f"udot{str(motion.symbol)[1:]}") for motion in free])
    names = tuple(str(motion.symbol).partition("_")[2] for motion in free)
    n = len(free)
    m, h, tau, u = (sp.MatrixSymbol(name, n, k) for name, k in
                    (("M", n), ("h", 1), ("tau", 1), ("udot", 1)))  # fmt: skip
    rows = [*(_quantity_row(motion, "coordinate") for motion in found.coordinates),
            *(_quantity_row(motion, "speed") for motion in found.speeds)]  # fmt: skip
    symbol_rows = [QuantityRow(layout(s), name, "1", "", "") for name, s in
            (*found.parameters.items(), *found.inputs.items())]  # fmt: skip
    return [
        Quantities((*rows, *symbol_rows)),
        Formula("equations of motion", tuple(equation_lines(m * u + h, tau, measure=measure))),
        Formula("accelerations", tuple(equation_lines(u, rates, measure=measure))),
        Formula("mass matrix", tuple(equation_lines(m, found.M, measure=measure))),
        Formula(
            "inertia, gravity, laws and loads", tuple(equation_lines(h, found.h, names, measure))
        ),
        Paragraph(
            "tau are efforts on the speeds in addition to those of the laws. Numbers of the scene "
            "that are not kept as symbols have their values."
        ),
    ]


def _quantity_row(one: Motion, what: str) -> QuantityRow:
    return QuantityRow(
        layout(one.symbol), one.name, "1", one.unit, f"{what} of {one.name.rpartition('.')[0]}"
    )
