"""What a page of `mstmm show` says, before any format: headings, quantities, formulas, code."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from mstmm.errors import ElementError
from mstmm.ir import KernelIR, Port

from ..language.derivation import Derivation, Equation, Quantity
from .formulas import stated
from .ir import listing
from .layout import Name, Node
from .names import shown_name

STAGES = ("equations", "matrix", "ir", "c")

#: What the blocks of a transfer matrix stand for, by the unit of a state's first block.
STATES = {
    "[m/s2": "blocks: acceleration, angular acceleration, moment, force, 1",
    "[m": "blocks: position, angle, moment, force, modal coordinates where there are any, 1",
}


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
        items += [_formula(e) for e in derivation.premises]
    else:
        items.append(Heading("Equations", 3))
        items += [_formula(e) for e in derivation.definitions]
    return items + [Paragraph(note, "note") for note in derivation.notes]


def _matrices(derivation: Derivation) -> list[Item]:
    """The definitions that follow from the premises, large matrices block by block."""
    items: list[Item] = [Heading("Result", 3), _quantities(derivation.outputs)]
    states = {q.name: STATES.get(q.unit.split(",")[0], "") for q in derivation.outputs}
    items += [
        _formula(e, states.get(str(getattr(e.left, "name", "")), ""))
        for e in derivation.definitions
    ]
    return items + [Paragraph(note, "note") for note in derivation.notes]


def _quantities(quantities: Iterable[Quantity]) -> Quantities:
    return Quantities(
        tuple(
            QuantityRow(
                Name(shown_name(q.name)),
                q.name,
                " × ".join(map(str, q.shape if q.shape[1] != 1 else q.shape[:1])),
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
        once = "; what stands inside loops is counted once" if kernel.size_symbol else ""
        items += [
            Heading(f"kernel {kernel.name}", 2),
            Paragraph(kernel.purpose or kernel.name),
            Paragraph(f"{kernel.flops()} floating-point operations ({counts}){once}", "note"),
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


def _formula(e: Equation, labels: str = "") -> Formula:
    zeros = ""
    if e.zeros:
        zeros = "entries " + ", ".join(f"({i + 1},{j + 1})" for i, j in e.zeros) + " vanish"
    remark = "; ".join(filter(None, (e.remark, zeros, labels)))
    return Formula(e.name, tuple(stated(e.left, e.right)), e.source, remark)
