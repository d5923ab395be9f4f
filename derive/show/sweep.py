"""The schedule of the sweep for a reader: sweeps, passes, slots and traits."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Iterator
from itertools import groupby

from mstmm.errors import ElementError

from ..print.callers import DIRECT, MOST_SPEEDS, POINTED, Specs
from ..print.sweep import passes, sweep_files
from ..schedule.slope import ports_of
from ..schedule.steps import (
    Add,
    Along,
    ByScrew,
    Call,
    ChooseBias,
    Copy,
    Do,
    Each,
    EachSpeed,
    Evaluate,
    Gather,
    JudgePivots,
    Move,
    Pass,
    Pick,
    Run,
    Spread,
    Step,
)
from ..schedule.sweeps import SWEEPS
from ..schedule.words import CONSTANTS, SLOTS, TRAITS
from .document import Code, Heading, Item, Paragraph
from .measure import Columns
from .page import FORMATS, printed
from .story import story
from .text import WIDTH

#: What the page explains before it lists anything.
_SAID = (
    "A sweep runs passes one after the other; a pass meets every body (law, load, ...) in turn and "
    "calls kernels over named slots: port=slot for what a kernel reads, and behind the arrow for "
    "what it gives (+= where it adds).  Of a slot x the derivative along a direction is the slot "
    "d:x.  Conditions and slots are explained in the end.  The loops "
    "of the looped engine are printed from this list, the fused engine replays it.  The kernels "
    "are elements: mstmm show sweep_frames, mstmm show pin."
)


def sweep_page(at: str, format: str, specs: Callable[[], Specs]) -> str:
    """The page of the schedule (stage "equations") or of the C printed from it ("c").

    `specs` gives the elements whose kernels are called.  Raises ElementError for another stage.
    """
    if at not in ("equations", "c"):
        raise ElementError(
            f"the sweep has no stage {at!r}; there are equations and c; its steps are elements of "
            "their own: mstmm show sweep_generic2"
        )
    if at == "c":
        text = "\n".join(sweep_files(specs()).values())
        return FORMATS[format]("The sweep", [Heading("The sweep as C", 1), Code(text)])
    steps = _Steps(specs())
    return printed("The sweep", lambda measure: list(_items(steps, measure)), format)


def _items(steps: _Steps, measure: Columns) -> Iterator[Item]:
    yield Heading("The sweep", 1)
    yield from story(measure)
    yield Heading("The schedule", 2)
    yield Paragraph(_SAID)
    for sweep in SWEEPS:
        yield Heading(f"sweep {_spaced(sweep.name)}", 2)
        yield Paragraph(sweep.purpose)
        yield Code("\n".join(map(_run, sweep.runs)))
    for whole in passes():
        yield Heading(f"pass {_spaced(whole.name)}", 2)
        yield Paragraph(whole.purpose)
        yield Code("\n".join([_head(whole), *steps.lines(whole.steps, 1)]))
    yield Heading("Conditions", 2)
    yield Code("\n".join(_row(name, 12, said) for name, said in TRAITS.items()))
    yield Heading("Slots", 2)
    yield Code("\n".join(_row(name, 12, said) for name, said in CONSTANTS.items()))
    yield Code(
        "\n".join(
            _row(f"{slot.name:20} {slot.size.replace(' ', ' x ')}", 30, slot.meaning)
            for slot in SLOTS.values()
        )
    )


def _spaced(name: str) -> str:
    return name.replace("_", " ")


def _run(run: Run) -> str:
    name = f"pass {_spaced(run.whole.name)}" if run.whole else f"by hand: {_spaced(run.hook)}"
    return f"  {name:34}{_when(run.when)}".rstrip()


def _head(whole: Pass) -> str:
    skipped = f", passing by where {_words(whole.skip)}" if whole.skip else ""
    spared = f", but not links where {_words(whole.spares_links)}" if whole.spares_links else ""
    return f"for every {whole.subject}, {whole.order}{skipped}{spared}"


def _words(when: str) -> str:
    return " and ".join(
        f"not {word[1:]}" if word.startswith("!") else word for word in when.split()
    )


def _when(when: str) -> str:
    return f"if {_words(when)}" if when else ""


class _Steps:
    """Steps as lines."""

    def __init__(self, specs: Specs) -> None:
        self.specs = specs

    def lines(self, steps: Iterable[Step], depth: int) -> list[str]:
        """Steps under the same condition stand together behind it."""
        lines = []
        for when, group in groupby(steps, key=lambda step: step.when):
            lines += [f"{'  ' * depth}{_when(when)}:"] if when else []
            for step in group:
                lines += self._step(step, depth + bool(when))
        return lines

    def _step(self, step: Step, depth: int) -> list[str]:
        indent = "  " * depth
        if isinstance(step, ByScrew):
            kinds = {
                "a screw about x": step.about_x, "a screw about z": step.about_z,
                "a rotation of which nothing is known": step.turning, "else": step.otherwise,
            }  # fmt: skip
            lines = [f"{indent}by what is known of {step.rotation} and {step.position}:"]
            for said, steps in kinds.items():
                lines += [f"{indent}  {said}:", *self.lines(steps, depth + 2)]
            return lines
        if isinstance(step, EachSpeed):
            which = "every imposed speed k" if step.imposed else "every speed k"
            return [f"{indent}for {which}:", *self.lines(step.steps, depth + 1)]
        if isinstance(step, Along):
            return [f"{indent}along {_DIRECTIONS[step.of]}:", *self.lines(step.steps, depth + 1)]
        if isinstance(step, Each):
            return [f"{indent}for {_EACH[step.of]}:", *self.lines(step.steps, depth + 1)]
        told = self._call(step) if isinstance(step, Call) else _TOLD[type(step)](step)
        return textwrap.wrap(
            indent + told, WIDTH, subsequent_indent=indent + "    ", break_long_words=False,
            break_on_hyphens=False,
        )  # fmt: skip

    def _call(self, step: Call) -> str:
        element, _, name = step.kernel.partition(".")
        key, name = self._like(element, name)
        kernel = next(k for k in self.specs[key].kernels if k.name == name)
        ports = ports_of(step)
        read = [f"{p.name}={ports[p.name]}" for p in kernel.inputs]
        given = [
            f"{p.name}{'+=' if p.accumulate else '='}{ports[p.name]}"
            for p in kernel.outputs
            if p.name in ports
        ]
        fails = f"  (fails: {step.fails})" if step.fails else ""
        return f"{step.kernel}({', '.join(read)}) -> {', '.join(given)}{fails}"

    @staticmethod
    def _like(element: str, name: str) -> tuple[tuple[str, str], str]:
        """An element whose kernel has the ports of the one that is called, and its name."""
        if element.startswith("generic{"):
            return ("sweep", f"generic{MOST_SPEEDS}"), name
        if element in POINTED:
            key, names = POINTED[element]
            return key, names.get(name, name)
        return DIRECT.get(element, ("sweep", element)), name


#: Directions, each with its number c.
_DIRECTIONS = {
    "free": "every free speed c of the hinge, and what changes with it in a step",
    "felt": "every free speed c of the hinge that the law feels",
    "rates": "every speed c of the hinge alone",
    "coordinates": "every coordinate c of the hinge alone",
    "law": "every unknown c that goes with a speed of the law",
    "modes": "every mode c, and what changes with it in a step",
    "motion": "every entry c of the body's motion",
    "spin": "every entry c of the body's angular velocity",
    "place": "every entry c of a change of the body's place",
    "turn": "every entry c of a turn of the body",
}

#: Rows met one by one.
_EACH = {
    "closings": "every row that closes on the body",
    "own": "every coupling of its own speeds",
    "openings": "every row that closes on the body, the other way round",
    "pending": "every row that is open across the hinge",
    "before": "every open row up to this one",
    "bent": "every row that ends of the flexible body bring",
    "bent_before": "every such row up to this one",
    "rows": "every row of the hinge, in direction c",
    "others": "every row that is coupled with it",
    "seconds": "every such row up to this one",
}


def _do(step: Do) -> str:
    assert step.whole is not None
    return f"pass {_spaced(step.whole.name)}"


def _add(step: Add) -> str:
    times = "" if abs(step.times) == 1 else f"{abs(step.times)} "
    return f"{step.to} {'-' if step.times < 0 else '+'}= {times}{step.source}"


_TOLD: dict[type, Callable[..., str]] = {
    Do: _do,
    Add: _add,
    Copy: lambda s: f"{s.to} = {s.source or '0'}",
    Pick: lambda s: (
        f"{s.to} = {'columns' if s.rows else 'rows and columns'} of {s.source} that belong to free "
        "speeds"
    ),
    Spread: lambda s: f"{s.to} = {s.free} on free speeds, {s.imposed or '0'} on the others",
    Move: lambda s: f"{s.to} = {s.source}",
    Gather: lambda s: f"{s.to} = expression values at {s.places}",
    Evaluate: lambda s: f"{s.to} = expression {s.expression}",
    ChooseBias: lambda s: (
        f"{s.motion} stopped along free unit columns of {s.subspace} by {s.chosen}"
    ),
    JudgePivots: lambda s: (
        f"{s.pivots} must exceed the rounding of {s.own}, or of {s.whole}  (fails: {s.fails})"
    ),
}  # fmt: skip


def _row(head: str, width: int, said: str) -> str:
    lines = textwrap.wrap(said, WIDTH - width - 3)
    rest = [" " * (width + 3) + line for line in lines[1:]]
    return "\n".join([f"  {head:{width}} {lines[0]}", *rest])
