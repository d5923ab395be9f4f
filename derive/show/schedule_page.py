"""Page of the sweep: its equations, and its schedule of sweeps, passes, slots and traits."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Iterator
from itertools import groupby

from mstmm.errors import ElementError

from ..catalogue.kernels import built_in_kernels
from ..codegen.kernel_calls import MAX_SPEEDS, NAMED_CALLEES, POINTER_CALLEES, Specs
from ..codegen.sweep_text import all_passes, sweep_files
from ..equations.rigid_body import newton_euler_form
from ..schedule.differentiated_passes import ports_of
from ..schedule.pass_steps import (
    Add,
    ByScrew,
    Call,
    CheckPivots,
    ChooseBias,
    Copy,
    EachSpeed,
    Evaluate,
    ForEach,
    ForEachDirection,
    Gather,
    Move,
    Pass,
    Run,
    RunPass,
    ScatterSpeeds,
    SelectColumns,
    Step,
)
from ..schedule.slot_definitions import CONSTANTS, SLOTS, TRAITS
from ..schedule.sweeps import SWEEPS
from .document import Code, FormulaWriter, Heading, Item, Paragraph
from .line_breaking import TextWidth
from .plain_text import WIDTH
from .show_page import FORMATS, render_page
from .symbol_names import DeclaredNames

#: Introduction of the page.
_EXPLANATION = (
    "A sweep is a sequence of passes. A pass visits every body (law, load, ...) in turn and calls "
    "kernels with named slots: port=slot for inputs, and after the arrow for outputs (+= if "
    "added).  The derivative of a slot x along a direction is the slot d:x.  Conditions and slots "
    "are listed at the end.  The looped engine's loops are generated from this list; the fused "
    "engine interprets it.  The kernels are elements: mstmm show sweep_frames, mstmm show pin."
)


def sweep_page(at: str, format: str, specs: Callable[[], Specs]) -> str:
    """The page of the schedule (stage "equations") or of the C printed from it ("c").

    `specs` gives the elements whose kernels are called.  Raises ElementError for another stage.
    """
    if at not in ("equations", "c"):
        raise ElementError(
            f"sweep: unknown stage {at!r}; expected equations or c; its steps are separate "
            "elements: mstmm show sweep_generic2"
        )
    if at == "c":
        text = "\n".join(sweep_files(specs()).values())
        return FORMATS[format]("The sweep", [Heading("The sweep as C", 1), Code(text)])
    steps = _StepWriter(specs())
    return render_page("The sweep", lambda measure: list(_page_items(steps, measure)), format)


def _page_items(steps: _StepWriter, measure: TextWidth) -> Iterator[Item]:
    yield Heading("The sweep", 1)
    yield from _equation_items(measure)
    yield Heading("The schedule", 2)
    yield Paragraph(_EXPLANATION)
    for sweep in SWEEPS:
        yield Heading(f"sweep {_spaced_name(sweep.name)}", 2)
        yield Paragraph(sweep.purpose)
        yield Code("\n".join(map(_run_line, sweep.runs)))
    for sweep_pass in all_passes():
        yield Heading(f"pass {_spaced_name(sweep_pass.name)}", 2)
        yield Paragraph(sweep_pass.purpose)
        yield Code("\n".join([_pass_heading(sweep_pass), *steps.lines(sweep_pass.steps, 1)]))
    yield Heading("Conditions", 2)
    yield Code(
        "\n".join(_definition_rows(name, 12, description) for name, description in TRAITS.items())
    )
    yield Heading("Slots", 2)
    yield Code(
        "\n".join(
            _definition_rows(name, 12, description) for name, description in CONSTANTS.items()
        )
    )
    yield Code(
        "\n".join(
            _definition_rows(f"{slot.name:20} {slot.size.replace(' ', ' x ')}", 30, slot.meaning)
            for slot in SLOTS.values()
        )
    )


def _spaced_name(name: str) -> str:
    return name.replace("_", " ")


def _run_line(run: Run) -> str:
    name = (
        f"pass {_spaced_name(run.whole.name)}" if run.whole else f"hook: {_spaced_name(run.hook)}"
    )
    return f"  {name:34}{_condition_prefix(run.when)}".rstrip()


def _pass_heading(whole: Pass) -> str:
    skip_text = f", passing by where {_condition_words(whole.skip)}" if whole.skip else ""
    link_text = (
        f", but not links where {_condition_words(whole.spares_links)}"
        if whole.spares_links
        else ""
    )
    return f"for every {whole.subject}, {whole.order}{skip_text}{link_text}"


def _condition_words(when: str) -> str:
    return " and ".join(
        f"not {trait[1:]}" if trait.startswith("!") else trait for trait in when.split()
    )


def _condition_prefix(when: str) -> str:
    return f"if {_condition_words(when)}" if when else ""


class _StepWriter:
    """Lines of text for steps."""

    def __init__(self, specs: Specs) -> None:
        self.specs = specs

    def lines(self, steps: Iterable[Step], depth: int) -> list[str]:
        """Lines of steps, grouped by condition."""
        lines = []
        for traits, group in groupby(steps, key=lambda step: step.when):
            lines += [f"{'  ' * depth}{_condition_prefix(traits)}:"] if traits else []
            for step in group:
                lines += self._step(step, depth + bool(traits))
        return lines

    def _step(self, step: Step, depth: int) -> list[str]:
        indent = "  " * depth
        if isinstance(step, ByScrew):
            kinds = {
                "a screw about x": step.about_x, "a screw about z": step.about_z,
                "a general rotation": step.turning, "else": step.otherwise,
            }  # fmt: skip
            lines = [f"{indent}depending on the structure of {step.rotation} and {step.position}:"]
            for case_name, steps in kinds.items():
                lines += [f"{indent}  {case_name}:", *self.lines(steps, depth + 2)]
            return lines
        if isinstance(step, EachSpeed):
            speed_text = "every prescribed speed k" if step.imposed else "every speed k"
            return [f"{indent}for {speed_text}:", *self.lines(step.steps, depth + 1)]
        if isinstance(step, ForEachDirection):
            return [
                f"{indent}along {_DIRECTION_TEXTS[step.of]}:",
                *self.lines(step.steps, depth + 1),
            ]
        if isinstance(step, ForEach):
            return [f"{indent}for {_ROW_LOOPS[step.of]}:", *self.lines(step.steps, depth + 1)]
        text = self._call(step) if isinstance(step, Call) else _STEP_TEXTS[type(step)](step)
        return textwrap.wrap(
            indent + text, WIDTH, subsequent_indent=indent + "    ", break_long_words=False,
            break_on_hyphens=False,
        )  # fmt: skip

    def _call(self, step: Call) -> str:
        element, _, name = step.kernel.partition(".")
        key, name = self._representative_kernel(element, name)
        kernel = next(k for k in self.specs[key].kernels if k.name == name)
        ports = ports_of(step)
        read_ports = [f"{p.name}={ports[p.name]}" for p in kernel.inputs]
        written_ports = [
            f"{p.name}{'+=' if p.accumulate else '='}{ports[p.name]}"
            for p in kernel.outputs
            if p.name in ports
        ]
        fails = f"  (fails: {step.fails})" if step.fails else ""
        return f"{step.kernel}({', '.join(read_ports)}) -> {', '.join(written_ports)}{fails}"

    @staticmethod
    def _representative_kernel(element: str, name: str) -> tuple[tuple[str, str], str]:
        """Element and kernel with the same ports as the called kernel."""
        if element.startswith("generic{"):
            return ("sweep", f"generic{MAX_SPEEDS}"), name
        if element in POINTER_CALLEES:
            key, names = POINTER_CALLEES[element]
            return key, names.get(name, name)
        return NAMED_CALLEES.get(element, ("sweep", element)), name


#: Texts of directions, numbered c.
_DIRECTION_TEXTS = {
    "free": "every free speed c of the hinge, with its dependent changes in a step",
    "law_inputs": "every free speed c of the hinge that affects the law",
    "rates": "every speed c of the hinge alone",
    "coordinates": "every coordinate c of the hinge alone",
    "law": "every unknown c of a speed of the law",
    "modes": "every mode c, with its dependent changes in a step",
    "motion": "every entry c of the body's motion",
    "spin": "every entry c of the body's angular velocity",
    "place": "every entry c of a displacement of the body",
    "turn": "every entry c of a rotation of the body",
}

#: Texts of loops over constraint rows.
_ROW_LOOPS = {
    "closings": "every row that closes on the body",
    "own": "every coupling of the hinge's speeds",
    "openings": "every row that closes on the body, in reverse order",
    "pending": "every row that is open across the hinge",
    "before": "every open row up to this one",
    "bent": "every row at ends of the flexible body",
    "bent_before": "every such row up to this one",
    "rows": "every row of the hinge, in direction c",
    "others": "every row coupled with it",
    "seconds": "every such row up to this one",
}


_STEP_TEXTS: dict[type, Callable[..., str]] = {
    RunPass: lambda s: f"pass {_spaced_name(s.whole.name)}",
    Add: lambda s: (
        f"{s.to} {'-' if s.times < 0 else '+'}= "
        f"{'' if abs(s.times) == 1 else f'{abs(s.times)} '}{s.source}"
    ),
    Copy: lambda s: f"{s.to} = {s.source or '0'}",
    SelectColumns: lambda s: (
        f"{s.to} = {'columns' if s.rows else 'rows and columns'} of {s.source} that belong to free "
        "speeds"
    ),
    ScatterSpeeds: lambda s: f"{s.to} = {s.free} on free speeds, {s.imposed or '0'} on the others",
    Move: lambda s: f"{s.to} = {s.source}",
    Gather: lambda s: f"{s.to} = expression values at {s.places}",
    Evaluate: lambda s: f"{s.to} = expression {s.expression}",
    ChooseBias: lambda s: (
        f"{s.motion} cancelled along free unit columns of {s.subspace} by {s.offset}"
    ),
    CheckPivots: lambda s: (
        f"{s.pivots} must exceed the rounding of {s.own}, or of {s.whole}  (fails: {s.fails})"
    ),
}  # fmt: skip


def _definition_rows(head: str, width: int, meaning: str) -> str:
    lines = textwrap.wrap(meaning, WIDTH - width - 3)
    continuation = [" " * (width + 3) + line for line in lines[1:]]
    return "\n".join([f"  {head:{width}} {lines[0]}", *continuation])


# --- sweep by its equations -----------------------------------------------------------------------

#: Element whose kernels are shown, and the last equation on the hinge before the port.
_ELEMENT, _ON_THE_HINGE = "generic2", "e_Q"


def _equation_items(measure: TextWidth) -> Iterator[Item]:
    """Chapters in the order of the sweep: motion, absorption, hinge, port, recovery."""
    kernels = {kernel.name: kernel for kernel in built_in_kernels("sweep", _ELEMENT)}
    body, forward = newton_euler_form(), kernels["forward"].derivation
    condense, recover = kernels["condense"].derivation, kernels["recover"].derivation
    names = [str(getattr(equation.left, "name", "")) for equation in condense.definitions]
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
        writer = FormulaWriter(derivation, DeclaredNames(), measure)
        yield from map(writer.formula, equations)
