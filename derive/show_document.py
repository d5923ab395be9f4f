"""What a page of `mstmm show` says, before any format: headings, quantities, formulas, code."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import sympy as sp

from mstmm.errors import ElementError
from mstmm.ir import KernelIR, Port

from .derivation import Derivation, Equation, Quantity
from .show_ir import listing
from .show_layout import Name, Node, Row, Table, Word, equation, layout
from .show_names import shown_name
from .show_recognise import recognise
from .show_text import box

STAGES = ("equations", "matrix", "ir", "c")

#: Blocks of the matrices of the method: state vectors, wrenches and accelerations.
PARTITIONS: dict[int, tuple[int, ...]] = {
    13: (3, 3, 3, 3, 1), 7: (2, 1, 1, 2, 1), 12: (3, 3, 3, 3), 9: (3, 3, 3), 6: (3, 3),
}  # fmt: skip

#: What the blocks of a transfer matrix stand for.
STATES = {
    (13, 13): "blocks: r̈, ω̇, m, q, 1",
    (7, 7): "blocks: r̈, θ̈, m, q, 1",
}

#: A block wider than this in text gets a name and is spelled out below the matrix.
CELL_WIDTH = 20
#: A formula wider than this in text is stated entry by entry.
FORMULA_WIDTH = 96


@dataclass(frozen=True)
class ElementView:
    """One element to show.  Kernels and C are made only when a stage asks for them."""

    name: str
    title: str
    derivations: tuple[Derivation, ...]
    kernels: Callable[[], Iterable[KernelIR]]
    c_text: Callable[[], str]
    sources: tuple[str, ...] = ()


@dataclass(frozen=True)
class Heading:
    """Title of a page (level 1), of a derivation (2) or of a part of it (3)."""

    text: str
    level: int


@dataclass(frozen=True)
class Paragraph:
    """Plain text; `kind` is "text", "note" or "sources"."""

    text: str
    kind: str = "text"


@dataclass(frozen=True)
class QuantityRow:
    """One line of a table of quantities."""

    symbol: Node
    port: str
    shape: str
    unit: str
    meaning: str


@dataclass(frozen=True)
class Quantities:
    """Table of quantities."""

    rows: tuple[QuantityRow, ...]


@dataclass(frozen=True)
class Formula:
    """A named equation as one or more displayed lines."""

    name: str
    lines: tuple[Node, ...]
    source: str = ""
    remark: str = ""


@dataclass(frozen=True)
class Code:
    """Preformatted text."""

    text: str


Item = Heading | Paragraph | Quantities | Formula | Code


def document(view: ElementView, at: str) -> list[Item]:
    """Items of the page at a stage.  Raises ElementError for an unknown stage."""
    builders: dict[str, Callable[[ElementView], list[Item]]] = {
        "equations": lambda v: _derived(v, _equations),
        "matrix": lambda v: _derived(v, _matrices),
        "ir": _kernels,
        "c": _c_source,
    }
    if at not in builders:
        raise ElementError(f"no stage {at!r}; there are {', '.join(STAGES)}")
    return [Heading(view.title, 1), *_sources(_all_sources(view)), *builders[at](view)]


def _all_sources(view: ElementView) -> tuple[str, ...]:
    found = [*view.sources, *(s for d in view.derivations for s in d.sources)]
    return tuple(dict.fromkeys(found))


def _sources(sources: tuple[str, ...]) -> list[Item]:
    return [Paragraph(source, "sources") for source in sources]


def _derived(view: ElementView, part: Callable[[Derivation], list[Item]]) -> list[Item]:
    items: list[Item] = []
    for derivation in view.derivations:
        if len(view.derivations) > 1:
            items.append(Heading(derivation.title, 2))
        items += part(derivation)
    return items


def _equations(derivation: Derivation) -> list[Item]:
    """Quantities, premises, and the definitions where nothing precedes them."""
    items: list[Item] = [Heading("Given", 3), _quantities(derivation.inputs)]
    items += [Heading("Wanted", 3), _quantities(derivation.outputs)]
    if derivation.premises:
        items.append(Heading("Premises", 3))
        items += [_formula(e, blocks=False) for e in derivation.premises]
    else:
        items.append(Heading("Equations", 3))
        items += [_formula(e, blocks=False) for e in derivation.definitions]
    return items + [Paragraph(note, "note") for note in derivation.notes]


def _matrices(derivation: Derivation) -> list[Item]:
    """The definitions that follow from the premises, large matrices block by block."""
    items: list[Item] = [Heading("Result", 3), _quantities(derivation.outputs)]
    items += [_formula(e, blocks=True) for e in derivation.definitions]
    return items + [Paragraph(note, "note") for note in derivation.notes]


def _quantities(quantities: Iterable[Quantity]) -> Quantities:
    return Quantities(
        tuple(
            QuantityRow(
                Name(shown_name(q.name)),
                q.name,
                f"{q.rows}" if q.columns == 1 else f"{q.rows} × {q.columns}",
                q.unit,
                q.meaning + (" (symmetric, upper triangle)" if q.symmetric else ""),
            )
            for q in quantities
        )
    )


def _ports(ports: Iterable[Port]) -> Quantities:
    return Quantities(
        tuple(
            QuantityRow(
                Name(shown_name(p.name)),
                p.name,
                " × ".join(map(str, p.shape)) or "1",
                p.unit,
                p.meaning + (" (added to)" if p.accumulate else ""),
            )
            for p in ports
        )
    )


def _kernels(view: ElementView) -> list[Item]:
    items: list[Item] = []
    for kernel in view.kernels():
        counts = ", ".join(f"{count} {name}" for name, count in kernel.operation_counts().items())
        items += [
            Heading(f"kernel {kernel.name}", 2),
            Paragraph(kernel.purpose or kernel.name),
            Paragraph(f"{kernel.flops()} floating-point operations ({counts})", "note"),
            *_sources(tuple(s for s in kernel.sources if s not in _all_sources(view))),
            Heading("reads", 3),
            _ports(kernel.inputs),
            Heading("writes", 3),
            _ports(kernel.outputs),
            Heading("statements", 3),
            Code("\n".join(listing(kernel))),
        ]
    return items


def _c_source(view: ElementView) -> list[Item]:
    items: list[Item] = []
    for kernel in view.kernels():
        items += [Heading(f"kernel {kernel.name}", 2), _ports((*kernel.inputs, *kernel.outputs))]
    return [*items, Heading("C", 2), Code(view.c_text().rstrip("\n"))]


# --- formulas ---------------------------------------------------------------------------------


def _formula(e: Equation, blocks: bool) -> Formula:
    lines = stated(e.left, e.right, blocks)
    zeros = ""
    if e.zeros:
        zeros = "entries " + ", ".join(f"({i + 1},{j + 1})" for i, j in e.zeros) + " vanish"
    labels = STATES.get(tuple(getattr(e.right, "shape", ()))) if blocks else None
    remark = "; ".join(filter(None, (e.remark, zeros, labels)))
    return Formula(e.name, tuple(lines), e.source, remark)


def stated(left: sp.Basic, right: sp.Basic, blocks: bool) -> list[Node]:
    """left = right as one line, block by block, or entry by entry where it is too wide."""
    shown = layout(left)
    if isinstance(right, sp.MatrixBase):
        if blocks and _is_partitioned(right) and recognise(right) is None:
            return _block_lines(shown, right)
        line = equation(shown, layout(right))
        fits = box(line).width <= FORMULA_WIDTH and len(box(line).lines) <= 8
        return [line] if fits or right.shape == (1, 1) else _entries(left, shown, right)
    line = equation(shown, layout(right))
    if box(line).width <= FORMULA_WIDTH:
        return [line]
    return _hoisted(shown, right, blocks) or [line]


def _is_partitioned(matrix: sp.MatrixBase) -> bool:
    return any(extent in PARTITIONS for extent in matrix.shape)


def _block_lines(shown: Node, matrix: sp.MatrixBase) -> list[Node]:
    """The matrix of its blocks, then the blocks that needed a name."""
    rows = PARTITIONS.get(matrix.rows, (matrix.rows,))
    columns = PARTITIONS.get(matrix.cols, (matrix.cols,))
    table: list[tuple[Node, ...]] = []
    below: list[Node] = []
    first = 0
    for i, height in enumerate(rows):
        start, cells = 0, []
        for j, width in enumerate(columns):
            block = matrix[first : first + height, start : start + width]
            cell = layout(block)
            drawn = box(cell)
            if len(drawn.lines) > 1 or drawn.width > CELL_WIDTH:
                name = _block_name(shown, i, j)
                below += _spelled(name, block)
                cell = name
            cells.append(cell)
            start += width
        table.append(tuple(cells))
        first += height
    return [equation(shown, Table(tuple(table))), *below]


def _spelled(name: Node, block: sp.MatrixBase) -> list[Node]:
    """A named block in one formula, or entry by entry where that is too wide."""
    line = equation(name, layout(block))
    if box(line).width <= FORMULA_WIDTH or block.shape == (1, 1):
        return [line]
    return _entries(None, name, block)


def _block_name(shown: Node, i: int, j: int) -> Node:
    name = shown.name if isinstance(shown, Name) else shown_name("B")
    return Name(name, "", f"⟨{i + 1}{j + 1}⟩")


def _entries(left: sp.Basic | None, shown: Node, matrix: sp.MatrixBase) -> list[Node]:
    """One line for every entry that does not vanish."""
    explicit_left = left.as_explicit() if isinstance(left, sp.MatrixSymbol) else None
    lines: list[Node] = []
    for i in range(matrix.rows):
        for j in range(matrix.cols):
            if matrix[i, j] != 0:
                if explicit_left is not None:
                    place = layout(explicit_left[i, j])
                else:
                    place = _entry_name(shown, i, j)
                lines.append(equation(place, layout(matrix[i, j])))
    if any(entry == 0 for entry in matrix):
        lines.append(Word("all other entries are 0"))
    return lines


def _entry_name(shown: Node, i: int, j: int) -> Node:
    if isinstance(shown, Name) and shown.index.startswith("⟨"):
        return Name(shown.name, shown.accent, f"{shown.index}{i + 1},{j + 1}")
    return Row((shown, Word(f"[{i + 1},{j + 1}]")))


def _hoisted(shown: Node, right: sp.Basic, blocks: bool) -> list[Node]:
    """Explicit matrices inside a wide expression become named matrices, stated below it."""
    wide = [
        m
        for m in sorted(right.atoms(sp.ImmutableDenseMatrix), key=sp.default_sort_key)
        if recognise(m) is None and box(layout(m)).width > 16
    ]
    if not wide:
        return []
    base = shown.name.base if isinstance(shown, Name) else "B"
    names = {m: sp.MatrixSymbol(f"{base}_{k}*", *m.shape) for k, m in enumerate(wide, start=1)}
    lines: list[Node] = [equation(shown, layout(right.xreplace(names)))]
    for matrix, name in names.items():
        lines += stated(name, matrix, blocks)
    return lines
