"""Format-independent content of a `mstmm show` page: headings, quantities, formulas, code."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

from mstmm.errors import ElementError
from mstmm.ir import KernelIR, Port

from ..language.derivation import Derivation, Equation, Quantity
from .captions import as_text
from .entries import Declared, Named, Parts
from .formulas import stated
from .ir import listing
from .layout import Name, Node
from .measure import Columns
from .names import own_name, shown_name
from .text import box

STAGES = ("equations", "matrix", "ir", "c")

#: Meaning of the blocks of a transfer matrix, by the unit of a state's first block.
STATES = {
    "[m/s2": "blocks: acceleration, angular acceleration, moment, force, 1",
    "[m": "blocks: position, angle, moment, force, modal coordinates where there are any, 1",
}


@dataclass(frozen=True)
class ElementView:
    """One element to show; kernels and C are only made for a stage that needs them.

    `sources` are those of the element; of an element (`is_element`, not a step of the sweep) all
    other sources of derivations and kernels are those of the sweep.
    """

    name: str
    title: str
    derivations: tuple[Derivation, ...]
    kernels: Callable[[], Iterable[KernelIR]]
    c_text: Callable[[], str]
    sources: tuple[str, ...] = ()
    declared: Declared = field(default_factory=Declared)
    is_element: bool = False


@dataclass(frozen=True)
class Heading:
    """Title of a page (level 1), of a derivation (2) or of a part of it (3)."""

    text: str
    level: int


@dataclass(frozen=True)
class Paragraph:
    """Plain text; `kind` is "text", "note", "sources", or "sweep" for sources of the sweep."""

    text: str
    kind: str = "text"


@dataclass(frozen=True)
class QuantityRow:
    """One line of a table of quantities; `inner` ones are entries of the one above."""

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


def document(view: ElementView, at: str, measure: Columns) -> list[Item]:
    """Items of the page at a stage, of formulas that fit.  ElementError for an unknown stage."""
    builders: dict[str, Callable[[ElementView], list[Item]]] = {
        "equations": lambda v: _derived(v, _equations, measure),
        "matrix": lambda v: _derived(v, _matrices, measure),
        "ir": _kernels,
        "c": _c_source,
    }
    if at not in builders:
        raise ElementError(f"no stage {at!r}; there are {', '.join(STAGES)}")
    return [Heading(view.title, 1), *_sources(view, _all_sources(view)), *builders[at](view)]


def _all_sources(view: ElementView) -> tuple[str, ...]:
    found = [*view.sources, *(s for d in view.derivations for s in d.sources)]
    return tuple(dict.fromkeys(found))


def _sources(view: ElementView, sources: tuple[str, ...]) -> list[Item]:
    """Sources of the element, and apart from them those of the sweep."""
    return [
        Paragraph(one, "sweep" if view.is_element and one not in view.sources else "sources")
        for one in sources
    ]


def _derived(
    view: ElementView, part: Callable[[Derivation, Written], list[Item]], measure: Columns
) -> list[Item]:
    items: list[Item] = []
    for derivation in view.derivations:
        if len(view.derivations) > 1:
            items.append(Heading(derivation.title, 2))
        items += part(derivation, Written(derivation, view.declared, measure))
    return items


def _equations(derivation: Derivation, written: Written) -> list[Item]:
    """Items of quantities, premises and resulting equations."""
    items: list[Item] = [Heading("Given", 3), _quantities(derivation.inputs, written)]
    items += [Heading("Wanted", 3), _quantities(derivation.outputs, written)]
    if derivation.premises:
        items.append(Heading("Premises", 3))
        items += [written.formula(e) for e in derivation.premises]
    items.append(Heading("What follows" if derivation.premises else "Equations", 3))
    items += [written.formula(e) for e in derivation.definitions]
    return items + [Paragraph(note, "note") for note in derivation.notes]


def _matrices(derivation: Derivation, written: Written) -> list[Item]:
    """The definitions that follow from the premises, large matrices block by block."""
    items: list[Item] = [Heading("Result", 3), _quantities(derivation.outputs, written)]
    states = {q.name: STATES.get(q.unit.split(",")[0], "") for q in derivation.outputs}
    items += [
        written.formula(e, states.get(str(getattr(e.left, "name", "")), ""))
        for e in derivation.definitions
    ]
    return items + [Paragraph(note, "note") for note in derivation.notes]


def _quantities(quantities: Iterable[Quantity], written: Written) -> Quantities:
    rows: list[QuantityRow] = []
    names = written.names
    for q in quantities:
        if 0 in q.shape:
            continue
        symmetric = " (symmetric, upper triangle)" if q.symmetric else ""
        meaning = names.meaning(q.meaning) + symmetric
        shape = q.shape if q.shape[1] != 1 else q.shape[:1]
        rows.append(_row(q.name, shape, q.unit, meaning))
        rows += [] if q.sized else _entries(q.name, written.named.parts(q.name, q.rows))
    return Quantities(tuple(rows))


def _ports(ports: Iterable[Port], names: Declared) -> Quantities:
    rows: list[QuantityRow] = []
    for p in ports:
        if 0 in p.shape:
            continue
        meaning = names.meaning(p.meaning) + (" (added to)" if p.accumulate else "")
        rows.append(_row(p.name, p.shape, p.unit, meaning))
        rows += _entries(p.name, names.parts(p.name, p.length()))
    return Quantities(tuple(rows))


def _row(name: str, shape: tuple[int | str, ...], unit: str, meaning: str) -> QuantityRow:
    extents = " × ".join(map(str, shape)) or "1"
    return QuantityRow(Name(shown_name(name)), name, extents, unit, meaning)


def _entries(array: str, parts: Parts) -> Iterator[QuantityRow]:
    """Rows of the entries of an array, by the author's names."""
    first = 0
    for part in parts:
        symbol = Name(own_name(part.name) if part.length == 1 else shown_name(part.name))
        place = f"{array}[{first}]" if part.length == 1 else f"{array}[{first}...]"
        shape = " × ".join(map(str, part.shape if part.shape[1] != 1 else part.shape[:1]))
        yield QuantityRow(symbol, place, shape, part.unit, part.meaning, True)
        first += part.length


def _kernels(view: ElementView) -> list[Item]:
    items: list[Item] = []
    for kernel in view.kernels():
        counts = ", ".join(f"{count} {name}" for name, count in kernel.operation_counts().items())
        once = "; what stands inside loops is counted once" if kernel.size_symbol else ""
        items += [
            Heading(f"kernel {kernel.name}", 2),
            Paragraph(kernel.purpose or kernel.name),
            Paragraph(f"{kernel.flops()} floating-point operations ({counts}){once}", "note"),
            *_sources(view, tuple(s for s in kernel.sources if s not in _all_sources(view))),
            Heading("reads", 3),
            _ports(kernel.inputs, view.declared),
            Heading("writes", 3),
            _ports(kernel.outputs, view.declared),
            Heading("statements", 3),
            Code("\n".join(listing(kernel, view.declared))),
        ]
    return items


def _c_source(view: ElementView) -> list[Item]:
    items: list[Item] = []
    for kernel in view.kernels():
        items += [
            Heading(f"kernel {kernel.name}", 2),
            _ports((*kernel.inputs, *kernel.outputs), view.declared),
        ]
    return [*items, Heading("C", 2), Code(view.c_text().rstrip("\n"))]


def _all(kernel: KernelIR) -> tuple[Port, ...]:
    return (*kernel.inputs, *kernel.outputs)


class Written:
    """Equations of a derivation as formulas that fit, in the names of its author."""

    def __init__(self, derivation: Derivation, names: Declared, measure: Columns) -> None:
        self.names, self.measure = names, measure
        self.named = Named(derivation, names)

    def formula(self, e: Equation, labels: str = "") -> Formula:
        """Formula of an equation, with the meaning of its blocks."""
        zeros = ""
        if e.zeros:
            zeros = "entries " + ", ".join(f"({i + 1},{j + 1})" for i, j in e.zeros) + " vanish"
        remark = "; ".join(filter(None, (e.remark, zeros, labels)))
        shape = getattr(e.left, "shape", (1, 1))
        array = str(getattr(e.left, "name", ""))
        rows = self.names.labels(array, shape[0]) if shape[1] == 1 else ()
        right = e.right.xreplace(self.named.entries)
        lines = tuple(stated(e.left, right, rows, self.measure))
        return Formula("" if _says(e.name, lines) else e.name, lines, e.source, remark)


def _says(caption: str, lines: tuple[Node, ...]) -> bool:
    """Whether a caption only repeats its formula."""
    return len(lines) == 1 and as_text(caption).split() == box(lines[0]).lines[0].split()
