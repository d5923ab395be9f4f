"""C text of the steps of a pass: named kernel calls and copies."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from mstmm.abi.element_library import c_outputs

from ..schedule.differentiated_passes import SLOPE, D, DifferentiatedCall, ports_of
from ..schedule.pass_steps import (
    Add,
    Call,
    Copy,
    EachSpeed,
    Evaluate,
    ForEach,
    ForEachDirection,
    Gather,
    Move,
    Pass,
    RunPass,
    ScatterSpeeds,
    SelectColumns,
    Step,
    all_steps,
)
from ..schedule.slot_definitions import SLOTS
from .cache_tiling import condition_text, condition_variables
from .kernel_calls import MAX_SPEEDS, Callee
from .slot_storage import VARIABLES, SlotExpression, slot_expression, slot_size

#: Traits that only scene-specific code uses.
FUSED_ONLY_TRAITS = frozenset({"staged", "link", "rotated", "immobile"})
#: Directions: count, C statement that selects direction c, variables that both read.
_DIRECTION_LOOPS = {
    "free": ("speeds", "mstmm_aim_unknown(state, body, columns[c])", ("speeds", "columns", "body")),
    "law_inputs": (
        "speeds",
        "if (mstmm_law_ignores(body, law, columns[c])) continue;\n"
        "mstmm_aim_unknown(state, body, columns[c])",
        ("speeds", "columns", "body", "law"),
    ),
    "rates": ("nu", "mstmm_aim_rate(state, body, c)", ("nu", "body")),
    "coordinates": ("nq", "mstmm_aim_coordinate(state, body, c)", ("nq", "body")),
    "modes": ("n", "mstmm_aim_mode(state, modal, c)", ("n", "modal")),
    "law": ("law->n", "mstmm_aim_unknown(state, body, law->speed + c)", ("law", "body")),
    "motion": (
        "9", "mstmm_aim_motion(d_block + MSTMM_BLOCK_MOTION, c)", ("d_block",),
    ),
    "spin": (
        "3", "mstmm_aim_motion(d_block + MSTMM_BLOCK_MOTION, c)", ("d_block",),
    ),
    "place": ("9", "mstmm_aim_motion(place + MSTMM_PLACE_Z(0, 0), c)", ("place",)),
    "turn": ("3", "mstmm_aim_motion(place + MSTMM_PLACE_Z(0, 0), c)", ("place",)),
}  # fmt: skip
#: C statement that clears the selected direction.
_DIRECTION_RESETS = {
    **dict.fromkeys(
        ("free", "law_inputs", "rates", "coordinates", "law"), "mstmm_aim_nowhere(state, body)"
    ),
    "modes": "mstmm_aim_no_mode(state, modal)",
    **dict.fromkeys(("motion", "spin"), "mstmm_aim_motion(d_block + MSTMM_BLOCK_MOTION, -1)"),
    **dict.fromkeys(("place", "turn"), "mstmm_aim_motion(place + MSTMM_PLACE_Z(0, 0), -1)"),
}
#: Loops over rows: loop header, declaration, variables that both read.
_ROW_LOOPS = {
    "closings": (
        "int r = looped->first_row; r < looped->first_row + looped->n_rows; r++", "", ("looped",),
    ),
    "openings": (
        "int r = looped->first_row + looped->n_rows - 1; r >= looped->first_row; r--", "",
        ("looped",),
    ),
    "pending": (
        "int c = 0; c < looped->n_pending; c++",
        "const mstmm_pending *pending = &looped->pending[c];", ("looped", "loops"),
    ),
    "own": (
        "int c = 0; c < looped->n_own; c++", "const mstmm_own *own = &looped->own[c];",
        ("looped", "loops"),
    ),
    "before": ("int b = 0; b <= c; b++", "", ()),
    "bent": (
        "int c = 0; c < looped->n_bent; c++", "const mstmm_pending *bent = &looped->bent[c];",
        ("looped", "loops"),
    ),
    "bent_before": ("int b = 0; b <= c; b++", "", ()),
    "rows": ("int c = 0; c < 6; c++", "if (closure->rows[c] < 0) continue;", ("closure", "loops")),
    "others": (
        "int c = 0; c < row->n_others; c++", "const mstmm_other *other = &row->others[c];",
        ("row", "loops"),
    ),
    "seconds": ("int b = 0; b <= c; b++", "", ()),
}  # fmt: skip
#: Sizes of kernels for any size: C expression, variables that it reads.
_KERNEL_SIZES: dict[str, tuple[str, set[str]]] = {
    "modes": ("modal->n", {"modal"}),
    "free": ("speeds", {"speeds", "columns"}),
    "nq": ("nq", {"nq"}),
}
_INTERPRETED_CALLS = {
    "mstmm_hinge_hinge(body->kernels->hinge,": "mstmm_hinge_of(state, body,",
    "mstmm_hinge_hinge_slope(body->kernels->hinge_slope,": "mstmm_hinge_slope_of(state, body,",
    **{
        f"mstmm_hinge_{name}(body->kernels->{name},": f"mstmm_hinge_{name}_of(state, body,"
        for name in ("rates_by_coordinates", "rates_by_speeds")
    },
}
_KERNEL_POINTERS = {
    "hinge": "body->kernels->{}",
    "body": "body->kernels->{}",
    "law": "law->evaluate{}",
    "force": "force->wrench{}",
    "link": "at.{}",
}


class StepText:
    """C text of the steps of one pass.

    `locals` maps local arrays to their lengths, `given` the slots passed by the caller to C names.
    """

    def __init__(self, kernels: dict[str, Callee], whole: Pass) -> None:
        self.kernels, self.name, self.subject = kernels, whole.name, whole.subject
        self.flat, self.given_slots = whole.flat, {slot: local_name(slot) for slot in whole.given}
        self.subject_index = "index"
        self.locals = self._local_sizes(whole)

    def _slot_expression(self, slot: str) -> SlotExpression:
        if slot in self.given_slots:
            return SlotExpression(self.given_slots[slot])
        slot_location = slot_expression(slot, self.flat)
        if slot_location is not None:
            return slot_location
        name, _, entry_index = slot.partition("[")
        if not name.removeprefix(D).startswith("local.") and name.removeprefix(D) not in SLOTS:
            raise ValueError(f"pass {self.name}: unknown slot {name!r} (slot_definitions.py)")
        text = (
            f"{local_name(name)} + {entry_index.rstrip(']')}" if entry_index else local_name(name)
        )
        return SlotExpression(text)

    def _local_sizes(self, whole: Pass) -> dict[str, int]:
        """Local arrays, each as long as the longest port that uses it."""
        sizes: dict[str, int] = {}
        for step in whole.steps:
            for part in () if is_fused_only(step) else _own_steps(step):
                for slot, size in self._local_uses(part):
                    name, _, entry = slot.partition("[")
                    if slot not in self.given_slots and slot_expression(name, self.flat) is None:
                        size = MAX_SPEEDS if entry == "k]" else size
                        if local_name(name) in VARIABLES:
                            raise ValueError(f"pass {self.name}: {name!r} shadows a variable")
                        sizes[local_name(name)] = max(sizes.get(local_name(name), 1), size)
        return sizes

    def _local_uses(self, step: Step) -> Iterator[tuple[str, int]]:
        if isinstance(step, Call):
            callee, ports = self._callee(step), ports_of(step)
            mode_count = MAX_SPEEDS if ports.get("n") == "free" else 1
            for port in (*callee.kernel.inputs, *c_outputs(callee.kernel)):
                slot = ports.get(port.name, f"local.unused_{port.name}")
                yield slot, port.length(mode_count)
        elif isinstance(step, SelectColumns):
            rows = step.rows or MAX_SPEEDS
            yield step.to, rows * MAX_SPEEDS
            yield step.source, rows * MAX_SPEEDS

    def _callee(self, step: Call) -> Callee:
        element, _, name = step.kernel.partition(".")
        return self.kernels[f"{'generic' if element.startswith('generic') else element}.{name}"]

    def required_variables(self, step: Step) -> set[str]:
        """Variables that a step reads."""
        slots: list[str] = []
        variables: set[str] = set()
        if isinstance(step, Call):
            callee, ports = self._callee(step), ports_of(step)
            slots = [ports[port] for port in callee.fields if port in ports]
            variables = self._call_variables(step)
        elif isinstance(step, (Copy, Add)):
            slots = [step.to, *([step.source] if step.source else [])]
            variables = {variable for slot in slots for variable in size_variables(slot)}
        elif isinstance(step, Move):
            slots, variables = [step.to, step.source], {step.count} & VARIABLES.keys()
        elif isinstance(step, (ForEachDirection, ForEach)):
            parts = [
                self.required_variables(part) | condition_variables(part.when, self.flat)
                for part in step.steps
            ]
            table = _DIRECTION_LOOPS if isinstance(step, ForEachDirection) else _ROW_LOOPS
            return set(table[step.of][2]).union(*parts)
        elif isinstance(step, SelectColumns):
            slots, variables = [step.to, step.source], {"speeds", "columns"}
            variables |= {"nu"} if step.rows > 1 else set()
        elif isinstance(step, ScatterSpeeds):
            slots = [step.to, step.free, *([step.imposed] if step.imposed else [])]
            variables = {"nu", "speeds", "columns"}
        elif isinstance(step, Gather):
            slots, variables = [step.to, step.places], {step.places.split(".")[0]}
        elif isinstance(step, Evaluate):
            slots, variables = [step.to], {"force"}
        elif isinstance(step, EachSpeed):
            return {"body"}.union(*(self.required_variables(part) for part in step.steps))
        return (
            variables.union(*(self._slot_expression(slot).variables for slot in slots))
            if slots
            else variables
        )

    def _call_variables(self, step: Call) -> set[str]:
        element = step.kernel.partition(".")[0]
        variables: set[str] = set()
        if self._callee(step).kernel.size_symbol:
            variables |= _KERNEL_SIZES[dict(step.ports).get("n", "modes")][1]
        variables |= {"nu"} if element == "generic{nu}" else set()
        variables |= {"speeds", "columns"} if element == "generic{free}" else set()
        variables |= {"hinge": {"body"}, "body": {"body"}, "law": {"law"}, "force": {"force"}}.get(
            element, set()
        )
        return variables

    # --- steps ----------------------------------------------------------------------------------

    def lines(self, step: Step, indent: str) -> list[str]:
        if isinstance(step, Call):
            return self._call_lines(step, indent)
        if isinstance(step, RunPass):
            assert step.whole is not None
            return [f"{indent}code = mstmm_at_{step.whole.name}(state, {self.subject_index});",
                    f"{indent}if (code) return code;"]  # fmt: skip
        if isinstance(step, (Copy, Add)):
            return self._copy_lines(step, indent)
        if isinstance(step, Move):
            target, source = (
                self._slot_expression(step.to).text,
                self._slot_expression(step.source).text,
            )
            return [f"{indent}memcpy({target}, {source}, (size_t)({step.count}) * sizeof(real));"]
        if isinstance(step, ForEachDirection):
            return self._direction_lines(step, indent)
        if isinstance(step, ForEach):
            return self._row_loop_lines(step, indent)
        if isinstance(step, SelectColumns):
            return self._select_lines(step, indent)
        if isinstance(step, ScatterSpeeds):
            return self._scatter_lines(step, indent)
        if isinstance(step, Gather):
            target, value_indices = (
                self._slot_expression(step.to).text,
                self._slot_expression(step.places).text,
            )
            count = slot_size(step.places)
            state_text = "state->slope" if step.to.startswith(D) else "state"
            value = f"mstmm_value_at({state_text}, {_entry_text(value_indices)})"
            return [f"{indent}for (int j = 0; j < {count}; j++)",
                    f"{indent}    {_entry_text(target)} = {value};"]  # fmt: skip
        if isinstance(step, Evaluate):
            arguments = [
                self._slot_expression(slot).text for slot in (*dict(step.given).values(), step.to)
            ]
            call = f"mstmm_given_effort(state, force->effort, {', '.join(arguments)})"
            if step.to.startswith(D):
                arguments[1:1] = [
                    self._slot_expression(D + slot).text for slot in dict(step.given).values()
                ]
                call = (
                    f"mstmm_given_effort_slope(state, force->effort_slope, {', '.join(arguments)})"
                )
            return [f"{indent}code = {call};", *self._failure_lines("expression", indent)]
        assert isinstance(step, EachSpeed)
        return self._speed_loop_lines(step, indent)

    def _call_lines(self, step: Call, indent: str) -> list[str]:
        callee, ports = self._callee(step), ports_of(step)
        size = _KERNEL_SIZES[ports.pop("n", "modes")][0]
        arguments = [f".n = {size}"] if callee.kernel.size_symbol else []
        outputs = {port.name for port in callee.kernel.outputs}
        for port, name in callee.fields.items():
            slot = ports.get(port, f"local.unused_{port}")
            if port not in ports and port not in outputs:
                raise ValueError(f"{step.kernel}: no slot for the port {port!r}")
            arguments.append(f".{name} = {self._slot_expression(slot).text}")
        unknown = ports.keys() - callee.fields.keys()
        if unknown and not isinstance(step, DifferentiatedCall):
            raise ValueError(f"{step.kernel} has no port {', '.join(sorted(unknown))}")
        call_head = self._call_head(step, callee)
        call = f"{call_head}{_wrap_arguments(arguments, indent)}"
        call = call.replace(call_head, _INTERPRETED_CALLS.get(call_head, call_head))
        if not step.fails:
            return [f"{indent}{call};"]
        if step.fails == "tangent":
            call = f"mstmm_elimination_code(state, {call})"
        return [f"{indent}code = {call};", *self._failure_lines(step.fails, indent)]

    def _call_head(self, step: Call, callee: Callee) -> str:
        element, _, kernel = step.kernel.partition(".")
        name = f"mstmm_{callee.name}"
        if callee.call_kind == "name":
            return f"{name}("
        if callee.call_kind == "pointer":
            suffix = SLOPE if isinstance(step, DifferentiatedCall) else ""
            kernel_suffix = suffix if element in ("law", "force") else kernel
            return f"{name}({_KERNEL_POINTERS[element].format(kernel_suffix)},"
        count = {"generic{nu}": "nu", "generic{free}": "speeds"}.get(element, element[7:])
        return f"{name}({count},"

    def _failure_lines(self, reason: str, indent: str) -> list[str]:
        state, index = ("at.state", "at.index") if self.subject == "link" else ("state", "index")
        macro = f"MSTMM_FAILED_{reason.upper()}"
        return [f"{indent}if (code) return mstmm_fail({state}, {macro}, {index}, code);"]

    def _copy_lines(self, step: Copy | Add, indent: str) -> list[str]:
        target = self._slot_expression(step.to).text
        size = self._copy_size(step)
        if isinstance(step, Add):
            sign = "-=" if step.times < 0 else "+="
            factor = f"{abs(step.times)} * " if abs(step.times) != 1 else ""
            source = self._slot_expression(step.source).text
            if size == "1":
                return [
                    f"{indent}{_entry_text(target, '0')} {sign} {factor}{_entry_text(source, '0')};"
                ]
            return [
                f"{indent}for (int j = 0; j < {size}; j++)",
                f"{indent}    {_entry_text(target)} {sign} {factor}{_entry_text(source)};",
            ]
        if size == "1":
            value = (
                _entry_text(self._slot_expression(step.source).text, "0") if step.source else "0"
            )
            return [f"{indent}{_entry_text(target, '0')} = {value};"]
        if size.isdigit():
            if not step.source:
                return [f"{indent}memset({target}, 0, {size} * sizeof(real));"]
            source = self._slot_expression(step.source).text
            return [f"{indent}memcpy({target}, {source}, {size} * sizeof(real));"]
        if size.startswith("nu"):
            source = f", {self._slot_expression(step.source).text}" if step.source else ""
            return [f"{indent}mstmm_set{'' if source else '_zero'}({target}{source}, {size});"]
        value = _entry_text(self._slot_expression(step.source).text) if step.source else "0"
        return [f"{indent}for (int j = 0; j < {size}; j++)",
                f"{indent}    {_entry_text(target)} = {value};"]  # fmt: skip

    def _copy_size(self, step: Copy | Add) -> str:
        for slot in (step.to, step.source):
            if slot and not slot.removeprefix(D).startswith("local."):
                return slot_size(slot)
        return str(self.locals[local_name(step.to)])

    def _select_lines(self, step: SelectColumns, indent: str) -> list[str]:
        target, source = (
            self._slot_expression(step.to).text,
            self._slot_expression(step.source).text,
        )
        if step.rows == 1:
            return [
                f"{indent}for (int k = 0; k < speeds; k++)",
                f"{indent}    {_entry_text(target, 'k')} = {_entry_text(source, 'columns[k]')};",
            ]
        rows, row = (str(step.rows), "row") if step.rows else ("speeds", "columns[row]")
        return [f"{indent}for (int k = 0; k < speeds; k++)",
                f"{indent}    for (int row = 0; row < {rows}; row++)",
                f"{indent}        {_entry_text(target, 'row * speeds + k')} = "
                f"{_entry_text(source, f'{row} * nu + columns[k]')};"]  # fmt: skip

    def _scatter_lines(self, step: ScatterSpeeds, indent: str) -> list[str]:
        target, free = self._slot_expression(step.to).text, self._slot_expression(step.free).text
        imposed = _entry_text(self._slot_expression(step.imposed).text) if step.imposed else "0"
        return [
            f"{indent}for (int j = 0, k = 0; j < nu; j++)",
            f"{indent}    {_entry_text(target)} = k < speeds && columns[k] == j ? "
            f"{_entry_text(free, 'k++')}",
            f"{indent}                 : {imposed};",
        ]

    def _direction_lines(self, step: ForEachDirection, indent: str) -> list[str]:
        count, aim, _ = _DIRECTION_LOOPS[step.of]
        aims = f"{aim};".replace("\n", f"\n{indent}    ")
        lines = [f"{indent}for (int c = 0; c < {count}; c++) {{", f"{indent}    {aims}"]
        lines += self._inner_lines(step.steps, indent + "    ")
        return [*lines, f"{indent}}}", f"{indent}{_DIRECTION_RESETS[step.of]};"]

    def _inner_lines(self, steps: Iterable[Step], indent: str) -> list[str]:
        """C lines of steps in a loop, each under its condition."""
        lines = []
        for part in steps:
            if part.when:
                body_lines = self.lines(part, indent + "    ")
                lines += [
                    f"{indent}if ({condition_text(part.when, self.flat)}) {{",
                    *body_lines,
                    f"{indent}}}",
                ]
            else:
                lines += self.lines(part, indent)
        return lines

    def _row_loop_lines(self, step: ForEach, indent: str) -> list[str]:
        order, declaration, _ = _ROW_LOOPS[step.of]
        self.subject_index = "r" if step.of in ("closings", "openings") else self.subject_index
        body_lines = self._inner_lines(step.steps, indent + "    ")
        self.subject_index = "index"
        declaration_lines = [f"{indent}    {declaration}"] if declaration else []
        return [f"{indent}for ({order}) {{", *declaration_lines, *body_lines, f"{indent}}}"]

    def _speed_loop_lines(self, step: EachSpeed, indent: str) -> list[str]:
        condition_lines = (
            [f"{indent}    if (!body->imposed_mask[k]) continue;"] if step.imposed else []
        )
        lines = [line for part in step.steps for line in self.lines(part, indent + "    ")]
        return [
            f"{indent}for (int k = 0; k < body->nu; k++) {{",
            *condition_lines,
            *lines,
            f"{indent}}}",
        ]


def _entry_text(text: str, place: str = "j") -> str:
    """An entry of an array that an expression points to."""
    if text.startswith("&"):
        return text[1:]
    return f"{text}[{place}]" if re.fullmatch(r"[\w.>-]+", text) else f"({text})[{place}]"


def size_variables(slot: str) -> set[str]:
    """Variables in the length of a slot."""
    if slot.removeprefix(D).startswith("local.") or "[" in slot:
        return set()
    return {variable for variable in slot_size(slot).split(" * ") if variable in VARIABLES}


def _own_steps(step: Step) -> Iterator[Step]:
    """The step and its inner steps, except those in other functions."""
    if isinstance(step, (EachSpeed, ForEachDirection, ForEach)):
        for part in step.steps:
            yield from _own_steps(part)
    elif not isinstance(step, RunPass):
        yield from all_steps(step)


def is_fused_only(step: Step) -> bool:
    """Whether only scene-specific code runs a step."""
    return any(trait in FUSED_ONLY_TRAITS and trait_value for trait, trait_value in step.traits)


def local_name(slot: str) -> str:
    """C name of a slot that is local or passed by the caller."""
    if slot.startswith(D):
        return f"d_{local_name(slot.removeprefix(D))}"
    owner, _, name = slot.partition(".")
    return name if owner == "local" else f"{owner}_{name}"


def _wrap_arguments(words: list[str], indent: str) -> str:
    """Arguments wrapped over several lines."""
    line, lines = indent + "    ", []
    for index, argument in enumerate(words):
        argument += "," if index + 1 < len(words) else ")"
        if len(line) + len(argument) > 97 and line.strip():
            lines.append(line.rstrip())
            line = indent + "    "
        line += f"{argument} "
    return "\n" + "\n".join([*lines, line.rstrip()])
