"""Format-independent content of a `mstmm show` page: headings, quantities, formulas, code."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

from mstmm.errors import ElementError
from mstmm.ir import (
    OPERATIONS,
    Assign,
    Constant,
    Element,
    Guard,
    KernelIR,
    Operand,
    Port,
    Statement,
    Store,
    Sum,
)

from ..definition.derivation import Derivation, Equation, Quantity
from .captions import caption_text
from .formula_layout import Name, Node
from .formulas import equation_lines
from .line_breaking import TextWidth
from .plain_text import text_box
from .symbol_names import DeclaredNames, NamedEntries, Parts, parse_author_name, parse_name

# --- listing of a KernelIR, one statement per line; indices from zero as in the arrays ------------


def kernel_listing(kernel: KernelIR, names: DeclaredNames | None = None) -> list[str]:
    """All statements in order; entries of arrays by their declared names."""
    writer = _ListingWriter(kernel, names or DeclaredNames())
    return [line for statement in kernel.statements for line in writer.lines(statement)]


class _ListingWriter:
    """Statements of a kernel, with the declared names of array entries."""

    def __init__(self, kernel: KernelIR, names: DeclaredNames) -> None:
        ports = (*kernel.inputs, *kernel.outputs)
        self.names = {p.name: names.code_entries(p.name, p.length()) for p in ports}

    def lines(self, statement: Statement, indent: str = "") -> list[str]:
        if isinstance(statement, Assign):
            operands = [self.operand(a) for a in statement.args]
            value = OPERATIONS[statement.op].text.format(*operands)
            return [f"{indent}t{statement.number} = {value}"]
        if isinstance(statement, Sum):
            loop_index, value = statement.over, self.operand(statement.value)
            head = f"{indent}t{statement.number} = sum over {loop_index} < n of {value}"
            body = self.body(statement, indent)
            return [f"{head} with", *body] if body else [head]
        if isinstance(statement, Store):
            target = self.entry(statement.port, statement.index)
            loop_text = f"  for {', '.join(statement.loops)} < n" if statement.loops else ""
            value = self.operand(statement.value)
            return [*self.body(statement, indent), f"{target} = {value}{loop_text}"]
        if isinstance(statement, Guard):
            condition = self.operand(statement.condition)
            return [f"return code {statement.code} unless {condition}: {statement.message}"]
        return [
            f"{statement.port} = solve({statement.matrix}, {statement.right})  "
            f"else code {statement.code}: {statement.message}"
        ]

    def body(self, statement: Sum | Store, indent: str) -> list[str]:
        return [line for inner in statement.body for line in self.lines(inner, indent + "    ")]

    def operand(self, operand: Operand) -> str:
        if isinstance(operand, Constant):
            return operand.text
        if isinstance(operand, Element):
            return self.entry(operand.port, operand.index)
        return f"t{operand.number}"

    def entry(self, port: str, index: tuple[int | str, ...]) -> str:
        names = self.names.get(port)
        if names and len(index) == 1 and isinstance(index[0], int):
            return names[index[0]]
        return port + "".join(f"[{i}]" for i in index)


# --- items of a page ------------------------------------------------------------------------------

STAGES = ("equations", "matrix", "ir", "c")

#: Blocks of a transfer matrix, by the unit of the first block of the state.
STATES = {
    "[m/s2": "blocks: acceleration, angular acceleration, moment, force, 1",
    "[m": "blocks: position, angle, moment, force, modal coordinates where there are any, 1",
}


@dataclass(frozen=True)
class ElementView:
    """One element to show; kernels and C are made only for stages that need them.

    `sources` belong to the element.  If `is_element` (an element, not a step of the sweep), all
    other sources of derivations and kernels count as sources of the sweep.
    """

    name: str
    title: str
    derivations: tuple[Derivation, ...]
    kernels: Callable[[], Iterable[KernelIR]]
    c_text: Callable[[], str]
    sources: tuple[str, ...] = ()
    declared: DeclaredNames = field(default_factory=DeclaredNames)
    is_element: bool = False


@dataclass(frozen=True)
class Heading:
    """Title of a page (level 1), of a derivation (2) or of a section (3)."""

    text: str
    level: int


@dataclass(frozen=True)
class Paragraph:
    """Plain text; `kind` is "text", "note", "sources", or "sweep" for sources of the sweep."""

    text: str
    kind: str = "text"


@dataclass(frozen=True)
class QuantityRow:
    """One line of a table of quantities; `inner` rows are entries of the row above."""

    symbol: Node
    port: str
    shape: str
    unit: str
    meaning: str
    inner: bool = False


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


def document(view: ElementView, at: str, measure: TextWidth) -> list[Item]:
    """Items of the page at a stage, with formulas that fit.  Raises ElementError."""
    builders: dict[str, Callable[[ElementView], list[Item]]] = {
        "equations": lambda v: _derivation_items(v, _equation_items, measure),
        "matrix": lambda v: _derivation_items(v, _matrix_items, measure),
        "ir": _kernel_items,
        "c": _c_source_items,
    }
    if at not in builders:
        raise ElementError(f"unknown stage {at!r}; expected one of {', '.join(STAGES)}")
    return [
        Heading(view.title, 1),
        *_source_items(view, _collect_sources(view)),
        *builders[at](view),
    ]


def _collect_sources(view: ElementView) -> tuple[str, ...]:
    sources = [*view.sources, *(s for d in view.derivations for s in d.sources)]
    return tuple(dict.fromkeys(sources))


def _source_items(view: ElementView, sources: tuple[str, ...]) -> list[Item]:
    """Sources of the element, then separately those of the sweep."""
    return [
        Paragraph(source, "sweep" if view.is_element and source not in view.sources else "sources")
        for source in sources
    ]


def _derivation_items(
    view: ElementView, part: Callable[[Derivation, FormulaWriter], list[Item]], measure: TextWidth
) -> list[Item]:
    items: list[Item] = []
    for derivation in view.derivations:
        if len(view.derivations) > 1:
            items.append(Heading(derivation.title, 2))
        items += part(derivation, FormulaWriter(derivation, view.declared, measure))
    return items


def _equation_items(derivation: Derivation, written: FormulaWriter) -> list[Item]:
    """Items of quantities, premises and resulting equations."""
    items: list[Item] = [Heading("Given", 3), _quantity_table(derivation.inputs, written)]
    items += [Heading("Wanted", 3), _quantity_table(derivation.outputs, written)]
    if derivation.premises:
        items.append(Heading("Premises", 3))
        items += [written.formula(e) for e in derivation.premises]
    items.append(Heading("What follows" if derivation.premises else "Equations", 3))
    items += [written.formula(e) for e in derivation.definitions]
    return items + [Paragraph(note, "note") for note in derivation.notes]


def _matrix_items(derivation: Derivation, written: FormulaWriter) -> list[Item]:
    """Definitions that follow from the premises, large matrices block by block."""
    items: list[Item] = [Heading("Result", 3), _quantity_table(derivation.outputs, written)]
    states = {q.name: STATES.get(q.unit.split(",")[0], "") for q in derivation.outputs}
    items += [
        written.formula(e, states.get(str(getattr(e.left, "name", "")), ""))
        for e in derivation.definitions
    ]
    return items + [Paragraph(note, "note") for note in derivation.notes]


def _quantity_table(quantities: Iterable[Quantity], written: FormulaWriter) -> Quantities:
    rows: list[QuantityRow] = []
    names = written.names
    for q in quantities:
        if 0 in q.shape:
            continue
        symmetric = " (symmetric, upper triangle)" if q.symmetric else ""
        meaning = names.meaning(q.meaning) + symmetric
        shape = q.shape if q.shape[1] != 1 else q.shape[:1]
        rows.append(_quantity_row(q.name, shape, q.unit, meaning))
        rows += (
            [] if q.has_runtime_size else _entry_rows(q.name, written.named.parts(q.name, q.rows))
        )
    return Quantities(tuple(rows))


def _port_table(ports: Iterable[Port], names: DeclaredNames) -> Quantities:
    rows: list[QuantityRow] = []
    for p in ports:
        if 0 in p.shape:
            continue
        meaning = names.meaning(p.meaning) + (" (added to)" if p.accumulate else "")
        rows.append(_quantity_row(p.name, p.shape, p.unit, meaning))
        rows += _entry_rows(p.name, names.parts(p.name, p.length()))
    return Quantities(tuple(rows))


def _quantity_row(name: str, shape: tuple[int | str, ...], unit: str, meaning: str) -> QuantityRow:
    extents = " × ".join(map(str, shape)) or "1"
    return QuantityRow(Name(parse_name(name)), name, extents, unit, meaning)


def _entry_rows(array: str, parts: Parts) -> Iterator[QuantityRow]:
    """Rows of the entries of an array, with the declared names."""
    start = 0
    for part in parts:
        symbol = Name(parse_author_name(part.name) if part.length == 1 else parse_name(part.name))
        entry_text = f"{array}[{start}]" if part.length == 1 else f"{array}[{start}...]"
        shape = " × ".join(map(str, part.shape if part.shape[1] != 1 else part.shape[:1]))
        yield QuantityRow(symbol, entry_text, shape, part.unit, part.meaning, True)
        start += part.length


def _kernel_items(view: ElementView) -> list[Item]:
    items: list[Item] = []
    for kernel in view.kernels():
        counts = ", ".join(f"{count} {name}" for name, count in kernel.operation_counts().items())
        once = "; operations inside loops are counted once" if kernel.size_symbol else ""
        items += [
            Heading(f"kernel {kernel.name}", 2),
            Paragraph(kernel.purpose or kernel.name),
            Paragraph(f"{kernel.flops()} floating-point operations ({counts}){once}", "note"),
            *_source_items(
                view, tuple(s for s in kernel.sources if s not in _collect_sources(view))
            ),
            Heading("reads", 3),
            _port_table(kernel.inputs, view.declared),
            Heading("writes", 3),
            _port_table(kernel.outputs, view.declared),
            Heading("statements", 3),
            Code("\n".join(kernel_listing(kernel, view.declared))),
        ]
    return items


def _c_source_items(view: ElementView) -> list[Item]:
    items: list[Item] = []
    for kernel in view.kernels():
        items += [
            Heading(f"kernel {kernel.name}", 2),
            _port_table((*kernel.inputs, *kernel.outputs), view.declared),
        ]
    return [*items, Heading("C", 2), Code(view.c_text().rstrip("\n"))]


class FormulaWriter:
    """Formulas of a derivation that fit the page, with the declared names."""

    def __init__(self, derivation: Derivation, names: DeclaredNames, measure: TextWidth) -> None:
        self.names, self.measure = names, measure
        self.named = NamedEntries(derivation, names)

    def formula(self, e: Equation, labels: str = "") -> Formula:
        """Formula of an equation, with the description of its blocks."""
        zeros = ""
        if e.zeros:
            zeros = "entries " + ", ".join(f"({i + 1},{j + 1})" for i, j in e.zeros) + " vanish"
        remark = "; ".join(filter(None, (e.remark, zeros, labels)))
        shape = getattr(e.left, "shape", (1, 1))
        array = str(getattr(e.left, "name", ""))
        rows = self.names.labels(array, shape[0]) if shape[1] == 1 else ()
        right = e.right.xreplace(self.named.entries)
        lines = tuple(equation_lines(e.left, right, rows, self.measure))
        first_words = text_box(lines[0]).lines[0].split() if len(lines) == 1 else None
        is_repeated = caption_text(e.name).split() == first_words
        return Formula("" if is_repeated else e.name, lines, e.source, remark)
