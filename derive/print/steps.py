"""Steps of a pass as C: calls by the names of ports, and the little that moves numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator

from ..schedule.steps import (
    Add,
    Call,
    Copy,
    Do,
    EachSpeed,
    Evaluate,
    Gather,
    Pass,
    Pick,
    Spread,
    Step,
    inner,
)
from ..schedule.words import SLOTS
from .callers import MOST_SPEEDS, Callee
from .storage import VARIABLES, Place, place, size_of

#: Traits that only code for one scene has.
NEVER = frozenset({"staged", "link", "turned"})
#: Kernels' pointers in the records.
_POINTERS = {"hinge": "body->{}", "body": "body->{}", "law": "law->evaluate",
             "force": "force->wrench", "link": "at.{}"}  # fmt: skip


class StepText:
    """The steps of one pass.

    `locals` are the arrays of the function by their lengths, `given` the slots handed to it.
    """

    def __init__(self, kernels: dict[str, Callee], whole: Pass) -> None:
        self.kernels, self.name, self.subject = kernels, whole.name, whole.subject
        self.given = {slot: word_of(slot) for slot in whole.given}
        self.locals = self._local_sizes(whole)

    def _place(self, slot: str) -> Place:
        if slot in self.given:
            return Place(self.given[slot])
        found = place(slot)
        if found is not None:
            return found
        name, _, picked = slot.partition("[")
        if not name.startswith("local.") and name not in SLOTS:
            raise ValueError(f"pass {self.name}: there is no slot {name!r} (schedule/words.py)")
        text = f"{word_of(name)} + {picked.rstrip(']')}" if picked else word_of(name)
        return Place(text)

    def _local_sizes(self, whole: Pass) -> dict[str, int]:
        """Local arrays, as long as the longest port that they meet."""
        found: dict[str, int] = {}
        for step in whole.steps:
            if never(step) or isinstance(step, Do):
                continue
            for part in inner(step):
                for slot, size in self._used(part):
                    name = slot.partition("[")[0]
                    if slot not in self.given and place(name) is None:
                        found[word_of(name)] = max(found.get(word_of(name), 1), size)
        return found

    def _used(self, step: Step) -> Iterator[tuple[str, int]]:
        if isinstance(step, Call):
            callee, ports = self._callee(step), dict(step.ports)
            for port in (*callee.kernel.inputs, *callee.kernel.outputs):
                if port.name in ports:
                    yield ports[port.name], port.length(1)
                else:
                    yield f"local.unused_{port.name}", port.length(1)
        elif isinstance(step, Pick):
            yield step.to, step.rows * MOST_SPEEDS

    def _callee(self, step: Call) -> Callee:
        return self.kernels[step.kernel.replace("{nu}", "").replace("{free}", "")]

    def needs(self, step: Step) -> set[str]:
        """Variables that a step reads."""
        slots: list[str] = []
        more: set[str] = set()
        if isinstance(step, Call):
            slots = [slot for _, slot in step.ports]
            more = self._call_needs(step)
        elif isinstance(step, (Copy, Add)):
            slots = [step.to, *([step.source] if step.source else [])]
            more = {word for slot in slots for word in size_words(slot)}
        elif isinstance(step, Pick):
            slots, more = [step.to, step.source], {"nu", "speeds", "columns"}
        elif isinstance(step, Spread):
            slots = [step.to, step.free, *([step.imposed] if step.imposed else [])]
            more = {"nu", "speeds", "columns"}
        elif isinstance(step, Gather):
            slots, more = [step.to, step.places], {step.places.split(".")[0]}
        elif isinstance(step, Evaluate):
            slots, more = [step.to], {"force"}
        elif isinstance(step, EachSpeed):
            return {"body"}.union(*(self.needs(part) for part in step.steps))
        return more.union(*(self._place(slot).needs for slot in slots)) if slots else more

    def _call_needs(self, step: Call) -> set[str]:
        element = step.kernel.partition(".")[0]
        found = {"modal"} if self._callee(step).kernel.size_symbol else set()
        found |= {"nu"} if element == "generic{nu}" else set()
        found |= {"speeds", "columns"} if element == "generic{free}" else set()
        found |= {"hinge": {"body"}, "body": {"body"}, "law": {"law"}, "force": {"force"}}.get(
            element, set()
        )
        return found

    # --- steps ----------------------------------------------------------------------------------

    def lines(self, step: Step, indent: str) -> list[str]:
        if isinstance(step, Call):
            return self._call(step, indent)
        if isinstance(step, Do):
            assert step.whole is not None
            return [f"{indent}code = mstmm_at_{step.whole.name}(state, index);",
                    f"{indent}if (code) return code;"]  # fmt: skip
        if isinstance(step, (Copy, Add)):
            return self._moved(step, indent)
        if isinstance(step, Pick):
            return self._picked(step, indent)
        if isinstance(step, Spread):
            return self._spread(step, indent)
        if isinstance(step, Gather):
            to, places = self._place(step.to).text, self._place(step.places).text
            count = size_of(step.places)
            value = f"mstmm_value_at(state, {_entry(places)})"
            return [f"{indent}for (int j = 0; j < {count}; j++)",
                    f"{indent}    {_entry(to)} = {value};"]  # fmt: skip
        if isinstance(step, Evaluate):
            words = [self._place(slot).text for slot in (*dict(step.given).values(), step.to)]
            call = f"mstmm_given_effort(state, force->effort, {', '.join(words)})"
            return [f"{indent}code = {call};", *self._failed("expression", indent)]
        assert isinstance(step, EachSpeed)
        return self._each_speed(step, indent)

    def _call(self, step: Call, indent: str) -> list[str]:
        callee, ports = self._callee(step), dict(step.ports)
        words = [".n = modal->n"] if callee.kernel.size_symbol else []
        outputs = {port.name for port in callee.kernel.outputs}
        for port, name in callee.fields.items():
            slot = ports.get(port, f"local.unused_{port}")
            if port not in ports and port not in outputs:
                raise ValueError(f"{step.kernel}: no slot for the port {port!r}")
            words.append(f".{name} = {self._place(slot).text}")
        unknown = ports.keys() - callee.fields.keys()
        if unknown:
            raise ValueError(f"{step.kernel} has no port {', '.join(sorted(unknown))}")
        first = self._first(step, callee)
        call = f"{first}{_filled(words, indent)}"
        if step.kernel == "hinge.hinge":
            call = call.replace("mstmm_hinge_hinge(body->hinge,", "mstmm_hinge_of(state, body,")
        if not step.fails:
            return [f"{indent}{call};"]
        return [f"{indent}code = {call};", *self._failed(step.fails, indent)]

    def _first(self, step: Call, callee: Callee) -> str:
        element, _, kernel = step.kernel.partition(".")
        name = f"mstmm_{callee.name}"
        if callee.by == "name":
            return f"{name}("
        if callee.by == "pointer":
            return f"{name}({_POINTERS[element].format(kernel)},"
        count = {"generic{nu}": "nu", "generic{free}": "speeds"}.get(element, element[7:])
        return f"{name}({count},"

    def _failed(self, reason: str, indent: str) -> list[str]:
        state, index = ("at.state", "at.index") if self.subject == "link" else ("state", "index")
        macro = f"MSTMM_FAILED_{reason.upper()}"
        return [f"{indent}if (code) return mstmm_fail({state}, {macro}, {index}, code);"]

    def _moved(self, step: Copy | Add, indent: str) -> list[str]:
        to = self._place(step.to).text
        size = self._moved_size(step)
        if isinstance(step, Add):
            sign = "-=" if step.times < 0 else "+="
            factor = f"{abs(step.times)} * " if abs(step.times) != 1 else ""
            source = self._place(step.source).text
            if size == "1":
                return [f"{indent}{_entry(to, '0')} {sign} {factor}{_entry(source, '0')};"]
            return [f"{indent}for (int j = 0; j < {size}; j++)",
                    f"{indent}    {_entry(to)} {sign} {factor}{_entry(source)};"]  # fmt: skip
        if size == "1":
            value = _entry(self._place(step.source).text, "0") if step.source else "0"
            return [f"{indent}{_entry(to, '0')} = {value};"]
        if size.isdigit():
            if not step.source:
                return [f"{indent}memset({to}, 0, {size} * sizeof(real));"]
            source = self._place(step.source).text
            return [f"{indent}memcpy({to}, {source}, {size} * sizeof(real));"]
        value = _entry(self._place(step.source).text) if step.source else "0"
        return [f"{indent}for (int j = 0; j < {size}; j++)",
                f"{indent}    {_entry(to)} = {value};"]  # fmt: skip

    def _moved_size(self, step: Copy | Add) -> str:
        for slot in (step.to, step.source):
            if slot and not slot.startswith("local."):
                return size_of(slot)
        return str(self.locals[word_of(step.to)])

    def _picked(self, step: Pick, indent: str) -> list[str]:
        to, source = self._place(step.to).text, self._place(step.source).text
        if step.rows == 1:
            return [f"{indent}for (int k = 0; k < speeds; k++)",
                    f"{indent}    {_entry(to, 'k')} = {_entry(source, 'columns[k]')};"]  # fmt: skip
        return [f"{indent}for (int k = 0; k < speeds; k++)",
                f"{indent}    for (int row = 0; row < {step.rows}; row++)",
                f"{indent}        {_entry(to, 'row * speeds + k')} = "
                f"{_entry(source, 'row * nu + columns[k]')};"]  # fmt: skip

    def _spread(self, step: Spread, indent: str) -> list[str]:
        to, free = self._place(step.to).text, self._place(step.free).text
        imposed = _entry(self._place(step.imposed).text) if step.imposed else "0"
        return [
            f"{indent}for (int j = 0, k = 0; j < nu; j++)",
            f"{indent}    {_entry(to)} = k < speeds && columns[k] == j ? {_entry(free, 'k++')}",
            f"{indent}                 : {imposed};",
        ]

    def _each_speed(self, step: EachSpeed, indent: str) -> list[str]:
        only = [f"{indent}    if (!body->imposed_mask[k]) continue;"] if step.imposed else []
        lines = [line for part in step.steps for line in self.lines(part, indent + "    ")]
        return [f"{indent}for (int k = 0; k < body->nu; k++) {{", *only, *lines, f"{indent}}}"]


def _entry(text: str, place: str = "j") -> str:
    """An entry of an array that an expression points to."""
    if text.startswith("&"):
        return text[1:]
    return f"{text}[{place}]" if re.fullmatch(r"[\w.>-]+", text) else f"({text})[{place}]"


def size_words(slot: str) -> set[str]:
    """Variables that the length of a slot is told by."""
    if slot.startswith("local.") or "[" in slot:
        return set()
    return {word for word in size_of(slot).split(" * ") if word in VARIABLES}


def never(step: Step) -> bool:
    """Whether a step is for code of one scene alone."""
    return any(trait in NEVER and wanted for trait, wanted in step.traits)


def word_of(slot: str) -> str:
    """C name of a slot that is local or handed over."""
    owner, _, name = slot.partition(".")
    return name if owner == "local" else f"{owner}_{name}"


def _filled(words: list[str], indent: str) -> str:
    """Arguments over as many lines as they take."""
    line, lines = indent + "    ", []
    for place_, word in enumerate(words):
        word += "," if place_ + 1 < len(words) else ")"
        if len(line) + len(word) > 97 and line.strip():
            lines.append(line.rstrip())
            line = indent + "    "
        line += f"{word} "
    return "\n" + "\n".join([*lines, line.rstrip()])
