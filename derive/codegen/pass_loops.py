"""C of the looped engine: loops over subjects of passes, and sweeps that run them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import astuple, dataclass, replace

from ..schedule.differentiated_passes import D, ports_of
from ..schedule.pass_steps import (
    TIPS_TO_ROOT,
    Call,
    EachSpeed,
    ForEachDirection,
    Pass,
    Run,
    RunPass,
    Step,
    Sweep,
)
from ..schedule.slot_definitions import SLOTS
from ..schedule.sweeps import SWEEPS
from .cache_tiling import ChainedPasses, TiledRun, condition_text, tile_sweep
from .slot_storage import (
    BLOCK_SLOTS,
    LAYOUTS,
    SHARED_SLOTS,
    SPEED_SLOTS,
    VARIABLES,
    reads_variable,
    size_terms,
    slot_expression,
    slot_size,
)
from .step_text import is_fused_only

#: Number of subjects of a pass in a scene.
_SUBJECT_COUNTS = {
    "body": "n_bodies", "law": "n_laws", "load": "n_loads", "force": "n_forces",
    "drive": "n_drives", "speed": "nu", "row": "n_rows",
    "coupling": "n_couplings", "closure": "n_closures",
}  # fmt: skip
#: First index of a loop, where earlier subjects are visited with the bodies they close on.
_FIRST_INDICES = {"row": "model->first_ground_row"}
#: Subjects in the order of bodies: counter, number of subjects, and the last body that a subject
#: refers to.
_ORDERED_SUBJECTS = {
    "law": ("law", "n_laws", "model->laws[law].body"),
    "closure": ("loop", "n_closures", "mstmm_last_of(model, loop)"),
}
#: Laws of the bodies that a tile begins, in the order of bodies.
_LAW_RANGE = """\
        const int behind = law;
        while (law > 0 && model->laws[law - 1].body >= least) law--;
"""


def loop_functions() -> list[str]:
    """C functions of every loop, followed by those of every sweep."""
    groups = [tile_sweep(sweep) for sweep in SWEEPS]
    runs = [run for parts in groups for part in parts for run in _separate_runs(part)]
    separate_passes = {run.whole.name: run.whole for run in runs if run.whole}
    tiles = [part for parts in groups for part in parts if not isinstance(part, Run)]
    return [
        *(_pass_loop(sweep_pass) for sweep_pass in separate_passes.values()),
        *(
            _tiled_function(group) if isinstance(group, TiledRun) else _chained_function(group)
            for group in tiles
        ),
        *(_sweep_function(sweep, parts) for sweep, parts in zip(SWEEPS, groups, strict=True)),
    ]


def _separate_runs(part: Run | TiledRun | ChainedPasses) -> Iterable[Run]:
    """Runs that need a separate loop."""
    if isinstance(part, Run):
        return [part]
    return part.runs if part.hindrances else []


def _pass_loop(whole: Pass) -> str:
    """C function that runs a pass for all subjects, in its order."""
    call_text, fetches = _subject_call(whole), ""
    if whole.spares_links:
        text = (
            "    for (int k = 0; k < model->n_runs; k++) {\n"
            "        const mstmm_branch *run = &model->runs[k];\n"
            f"        if (run->numbers && {condition_text(whole.spares_links)}) continue;\n"
            "        for (int i = run->first; i < run->first + run->count; i++) {\n"
            f"            {call_text.format(indent=' ' * 12)}        }}\n    }}\n"
        )
    else:
        count = f"model->{_SUBJECT_COUNTS[whole.subject]}"
        first = _FIRST_INDICES.get(whole.subject, "0")
        order, ahead = f"int i = {first}; i < {count}; i++", "MSTMM_TILE"
        if whole.order == TIPS_TO_ROOT:
            order, ahead = f"int i = {count} - 1; i >= {first}; i--", "-MSTMM_TILE"
        fetches = prefetch_function(whole.name, [whole])
        prefetch_text = f"        {_prefetch_call(whole.name, ahead)}" if fetches else ""
        text = (
            f"    for ({order}) {{\n{prefetch_text}        {call_text.format(indent=' ' * 8)}  "
            f"  }}\n"
        )
    head = f"static int mstmm_pass_{whole.name}(mstmm_state *state)\n{{\n"
    body = f"    const mstmm_model *model = state->model;\n{text}    return 0;\n"
    return f"{fetches}{head}{body}}}\n"


def _subject_call(whole: Pass, declared: str = "const int ") -> str:
    """C call of a pass for subject i, which returns failures."""
    given_arguments = "".join(f", {_given_pointer(slot)}" for slot in whole.given)
    return (
        f"{declared}code = mstmm_at_{whole.name}(state, i{given_arguments});\n"
        "{indent}if (code) return code;\n"
    )


def _given_pointer(slot: str) -> str:
    """C pointer to the usual storage of a slot that the caller passes."""
    _, _, name = slot.partition(".")
    block = "mstmm_block(model, state->workspace, model->bodies[i].parent)"
    return f"{block} + MSTMM_BLOCK_{name.upper()}"


def _prefetch_call(name: str, ahead: str) -> str:
    return f"if (mstmm_beyond_cache(model)) mstmm_fetch_{name}(state, i, {ahead});\n"


def _law_prefetch_call(ahead: str) -> str:
    return f"if (mstmm_beyond_cache(model)) mstmm_fetch_law(model, i, {ahead});\n"


def _tiled_function(group: TiledRun) -> str:
    """C function that starts and sweeps bodies tile by tile."""
    starting_passes = [run.whole for run in group.begun if run.whole is not None and not run.when]
    has_laws = any(run.whole is not None and run.whole.subject == "law" for run in group.begun)
    name = f"{group.swept.name}_tile"
    prefetch_text = _prefetch_call(name, "-MSTMM_TILE")
    laws = ", law = model->n_laws" if has_laws else ""
    call_text = _subject_call(group.swept, "").format(indent=" " * 12)
    return (
        f"{prefetch_function(name, [*starting_passes, group.swept])}"
        f"static int {group.function}(mstmm_state *state)\n{{\n"
        "    const mstmm_model *model = state->model;\n"
        f"    int code, begun = model->n_bodies{laws};\n"
        "    for (int end = begun; end > 0; end -= MSTMM_TILE) {\n"
        "        const int first = end > MSTMM_TILE ? end - MSTMM_TILE : 0;\n"
        "        const int least = mstmm_least_parent(model, first, end);\n"
        f"{_LAW_RANGE if has_laws else ''}{''.join(map(_tile_start_loop, group.begun))}"
        "        if (least < begun) begun = least;\n"
        "        for (int i = end - 1; i >= first; i--) {\n"
        f"            {prefetch_text}            {call_text}"
        "        }\n    }\n    return 0;\n}\n"
    )


def _chained_function(group: ChainedPasses) -> str:
    """C function that runs several passes on each tile of bodies, root to tips."""
    subjects = {sweep_pass.subject for sweep_pass in group.passes}
    counters = "".join(
        f", {subject_row[0]} = 0"
        for name, subject_row in _ORDERED_SUBJECTS.items()
        if name in subjects
    )
    name = f"{group.name}_chain"
    fetches = prefetch_function(name, group.passes)
    lines = []
    for sweep_pass in group.passes:
        call_text = _subject_call(sweep_pass, "").format(indent=" " * 12)
        if sweep_pass.subject in _ORDERED_SUBJECTS:
            lines.append(_ordered_subject_loop(sweep_pass, call_text))
            continue
        has_prefetch = sweep_pass is group.main and fetches
        prefetch_text = f"            {_prefetch_call(name, 'MSTMM_TILE')}" if has_prefetch else ""
        lines.append(
            f"        for (int i = first; i < end; i++) {{\n{prefetch_text}            "
            f"{call_text}        }}\n"
        )
    return (
        f"{fetches}static int {group.function}(mstmm_state *state)\n{{\n"
        "    const mstmm_model *model = state->model;\n"
        f"    int code{counters};\n"
        "    for (int first = 0; first < model->n_bodies; first += MSTMM_TILE) {\n"
        "        const int end = mstmm_end_of_tile(model, first);\n"
        f"{''.join(lines)}    }}\n    return 0;\n}}\n"
    )


def _ordered_subject_loop(whole: Pass, at: str) -> str:
    """C loop of a pass over the subjects of a tile that are in the order of its bodies."""
    counter, count, last_body = _ORDERED_SUBJECTS[whole.subject]
    prefetch_text = (
        f"            {_law_prefetch_call('MSTMM_TILE')}" if whole.subject == "law" else ""
    )
    return (
        f"        for (; {counter} < model->{count} && {last_body} < end; {counter}++) {{\n"
        f"            const int i = {counter};\n{prefetch_text}            {at}        }}\n"
    )


def _tile_start_loop(run: Run) -> str:
    """C loop of a pass over the bodies of a tile that are not started yet."""
    assert run.whole is not None
    indent = " " * 8
    opening, closing = "", ""
    if run.when:
        opening, closing = f"{indent}if ({condition_text(run.when)}) {{\n", f"{indent}}}\n"
        indent += "    "
    call_text = _subject_call(run.whole, "").format(indent=indent + "    ")
    if run.whole.subject == "law":
        text = f"{indent}for (int i = law; i < behind; i++) {{\n"
        text += f"{indent}    {_law_prefetch_call('-MSTMM_TILE')}"
    else:
        text = f"{indent}for (int i = begun - 1; i >= least; i--) {{\n"
    return f"{opening}{text}{indent}    {call_text}{indent}}}\n{closing}"


def _sweep_function(sweep: Sweep, parts: list[Run | TiledRun | ChainedPasses]) -> str:
    """C function that runs the passes of a sweep in order."""
    lines = ["    int code;"]
    for part in parts:
        if isinstance(part, Run):
            lines += _pass_call(part, "    ")
            continue
        tiles = [f"code = {part.function}(state);", "if (code) return code;"]
        if not part.hindrances:
            lines += [f"    {line}" for line in tiles]
            continue
        inside = [line for run in part.runs for line in _pass_call(run, " " * 8)]
        lines += [f"    if ({part.singly}) {{", *inside, "    } else {"]
        lines += [*(f"        {line}" for line in tiles), "    }"]
    if any("model->" in line.replace("state->model->", "") for line in lines):
        lines.insert(0, "    const mstmm_model *model = state->model;")
    body = "\n".join([*lines, "    return 0;"])
    head = f"/* {sweep.purpose} */\nint mstmm_run_{sweep.name}(mstmm_state *state)"
    return f"{head}\n{{\n{body}\n}}\n"


def _pass_call(run: Run, indent: str) -> list[str]:
    """C lines that run a pass over all its subjects, under its condition."""
    function_name = f"mstmm_pass_{run.whole.name}" if run.whole else f"mstmm_hook_{run.hook}"
    lines = [f"code = {function_name}(state);", "if (code) return code;"]
    if run.when:
        lines = [f"if ({condition_text(run.when)}) {{", *(f"    {line}" for line in lines), "}"]
    return [f"{indent}{line}" for line in lines]


# --- prefetching ----------------------------------------------------------------------------------

_SLOT_ATTRIBUTES = ("to", "source", "free", "imposed")
_BODY_VARIABLES = ("block", "d_block", "tangent", "nu", "nq")
#: Traits of steps that concern few bodies of a scene.
_RARE_TRAITS = {
    **dict.fromkeys(
        ("modal", "section", "outward", "segment", "placed", "drag", "imposed", "parts", "curved"),
        True,
    ),
    "directed": False,
}
#: Scene data that passes read of a body, stored contiguously
#: (runtime/packing/records/body_records.py).
_RECORD_SLOTS = ("connection.R", "body.rotor", "hinge.p", "body.p")
_RECORD_STARTS = ("body->connection", "body->rotor", "body->hinge_p", "body->body_p")
_RECORD_ENDS = (
    "body->rotor",
    "body->hinge_p",
    "body->body_p",
    "body->body_p + MSTMM_RIGID_NUMBERS",
)
#: Largest gap that is fetched as well: a cache line holds eight numbers.
_MAX_GAP = 8


@dataclass(frozen=True)
class _MemoryRange:
    """Contiguous numbers, `begin` to `end` for a hinge of one speed, and as C expressions."""

    variable: str
    start: int
    end: int
    first: str
    last: str


def prefetch_function(name: str, passes: Iterable[Pass]) -> str:
    """C function that prefetches the data of body `index` for the passes; "" if none.

    Planar passes need none: the data of a body are small enough for the hardware prefetcher."""
    passes = [sweep_pass for sweep_pass in passes if not sweep_pass.flat]
    slots = {
        slot
        for sweep_pass in passes
        if sweep_pass.subject == "body"
        for slot in _slots_of_pass(sweep_pass)
    }
    stretches = _merge_ranges(stretch for slot in slots if (stretch := _range_of_slot(slot)))
    if not stretches:
        return ""
    lines = [f"    mstmm_fetch({span.first}, {span.last});" for span in stretches]
    record_indices = [index for index, slot in enumerate(_RECORD_SLOTS) if slot in slots]
    if record_indices:
        lines.append(
            f"    mstmm_fetch({_RECORD_STARTS[record_indices[0]]}, "
            f"{_RECORD_ENDS[record_indices[-1]]});"
        )
    variables_read = [
        variable
        for variable in _BODY_VARIABLES
        if any(reads_variable(line, variable) for line in lines)
    ]
    declarations = [f"    {VARIABLES[variable][0]}" for variable in variables_read]
    parameters = "const mstmm_state *state, int index, int ahead"
    return (
        f"MSTMM_AT_ONCE void mstmm_fetch_{name}({parameters})\n{{\n"
        "    const mstmm_body *body = mstmm_coming(state->model, index, ahead);\n"
        "    if (!body) return;\n" + "\n".join([*declarations, *lines]) + "\n}\n"
    )


def _slots_of_pass(whole: Pass) -> Iterator[str]:
    for step in whole.steps:
        yield from _slots_of_step(step)


def _slots_of_step(step: Step) -> Iterator[str]:
    if is_fused_only(step) or any(
        _RARE_TRAITS.get(trait) == trait_value for trait, trait_value in step.traits
    ):
        return
    if isinstance(step, RunPass) and step.whole is not None:
        yield from _slots_of_pass(step.whole)
    elif isinstance(step, (EachSpeed, ForEachDirection)):
        for part in step.steps:
            yield from _slots_of_step(part)
    elif isinstance(step, Call):
        yield from ports_of(step).values()
    else:
        yield from (str(value) for name, value in vars(step).items() if name in _SLOT_ATTRIBUTES)


def _range_of_slot(slot: str) -> _MemoryRange | None:
    """Memory range of a slot of the body itself; None for other slots."""
    name = slot.partition("[")[0]
    slot_name = name.removeprefix(D)
    begin = _OFFSETS.get(SHARED_SLOTS.get(slot_name, slot_name))
    slot_location = slot_expression(name)
    if begin is None or slot_location is None or slot_name not in SLOTS:
        return None
    numbers = size_terms(slot_name).total()
    variables_read = (
        variable
        for variable in ("d_block", "block", "tangent")
        if reads_variable(slot_location.text, variable)
    )
    end_text = f"{slot_location.text} + {slot_size(slot_name).replace('free', 'nu')}"
    return _MemoryRange(
        next(variables_read, "body"), begin, begin + numbers, slot_location.text, end_text
    )


def _merge_ranges(stretches: Iterable[_MemoryRange]) -> list[_MemoryRange]:
    """Merge stretches separated by small gaps."""
    merged: list[_MemoryRange] = []
    for stretch in sorted(stretches, key=astuple):
        previous = merged[-1] if merged else None
        if (
            previous is None
            or previous.variable != stretch.variable
            or stretch.start > previous.end + _MAX_GAP
        ):
            merged.append(stretch)
        elif stretch.end > previous.end:
            merged[-1] = replace(previous, end=stretch.end, last=stretch.last)
    return merged


def _slot_offsets() -> dict[str, int]:
    """Offset of each slot in its layout, for a hinge of one speed."""
    offsets, offset = dict[str, int](), 0
    for slot in (*BLOCK_SLOTS, *SPEED_SLOTS):
        offsets[slot] = offset
        offset += size_terms(slot).total()
    tangent = LAYOUTS["tangent"].offsets("tangent")
    return offsets | {slot: terms.total() for slot, terms in tangent.items()}


_OFFSETS = _slot_offsets()
