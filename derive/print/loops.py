"""Loops over the subjects of passes, and the sweeps that run them, as C of the looped engine."""

from __future__ import annotations

from collections.abc import Iterable

from ..schedule.steps import TIPS_TO_ROOT, Pass, Run, Sweep
from ..schedule.sweeps import SWEEPS
from .conditions import condition
from .fetched import fetching
from .tiles import Chained, Tiled, tiled

#: Number of subjects of a pass in a scene.
_COUNTS = {
    "body": "n_bodies", "law": "n_laws", "load": "n_loads", "force": "n_forces",
    "drive": "n_drives", "speed": "nu", "row": "n_rows",
    "coupling": "n_couplings", "closure": "n_closures",
}  # fmt: skip
#: First index of a loop, where earlier subjects are visited with the bodies they close on.
_FIRSTS = {"row": "model->first_ground_row"}
#: Subjects in the order of bodies: counter, number of subjects, and the last body that a subject
#: refers to.
_BEHIND = {
    "law": ("law", "n_laws", "model->laws[law].body"),
    "closure": ("loop", "n_closures", "mstmm_last_of(model, loop)"),
}
#: Laws of the bodies that a tile begins, in the order of bodies.
_LAWS = """\
        const int behind = law;
        while (law > 0 && model->laws[law - 1].body >= least) law--;
"""


def loops() -> list[str]:
    """C functions of every loop, followed by those of every sweep."""
    groups = [tiled(sweep) for sweep in SWEEPS]
    runs = [run for parts in groups for part in parts for run in _singly(part)]
    singly = {run.whole.name: run.whole for run in runs if run.whole}
    tiles = [part for parts in groups for part in parts if not isinstance(part, Run)]
    return [
        *(_loop(whole) for whole in singly.values()),
        *(_tiles(group) if isinstance(group, Tiled) else _chained(group) for group in tiles),
        *(_sweep(sweep, parts) for sweep, parts in zip(SWEEPS, groups, strict=True)),
    ]


def _singly(part: Run | Tiled | Chained) -> Iterable[Run]:
    """Runs that need a separate loop."""
    if isinstance(part, Run):
        return [part]
    return part.runs if part.hindrances else []


def _loop(whole: Pass) -> str:
    """C function that runs a pass for all subjects, in its order."""
    at, fetches = _at(whole), ""
    if whole.spares_links:
        text = (
            "    for (int k = 0; k < model->n_runs; k++) {\n"
            "        const mstmm_branch *run = &model->runs[k];\n"
            f"        if (run->numbers && {condition(whole.spares_links)}) continue;\n"
            "        for (int i = run->first; i < run->first + run->count; i++) {\n"
            f"            {at.format(indent=' ' * 12)}        }}\n    }}\n"
        )
    else:
        count = f"model->{_COUNTS[whole.subject]}"
        first = _FIRSTS.get(whole.subject, "0")
        order, ahead = f"int i = {first}; i < {count}; i++", "MSTMM_TILE"
        if whole.order == TIPS_TO_ROOT:
            order, ahead = f"int i = {count} - 1; i >= {first}; i--", "-MSTMM_TILE"
        fetches = fetching(whole.name, [whole])
        fetched = f"        {_fetched(whole.name, ahead)}" if fetches else ""
        text = f"    for ({order}) {{\n{fetched}        {at.format(indent=' ' * 8)}    }}\n"
    head = f"static int mstmm_pass_{whole.name}(mstmm_state *state)\n{{\n"
    body = f"    const mstmm_model *model = state->model;\n{text}    return 0;\n"
    return f"{fetches}{head}{body}}}\n"


def _at(whole: Pass, declared: str = "const int ") -> str:
    """C call of a pass for subject i, which returns failures."""
    handed = "".join(f", {_handed(slot)}" for slot in whole.given)
    return (
        f"{declared}code = mstmm_at_{whole.name}(state, i{handed});\n"
        "{indent}if (code) return code;\n"
    )


def _handed(slot: str) -> str:
    """C pointer to the usual storage of a slot that the caller passes."""
    _, _, name = slot.partition(".")
    block = "mstmm_block(model, state->workspace, model->bodies[i].parent)"
    return f"{block} + MSTMM_BLOCK_{name.upper()}"


def _fetched(name: str, ahead: str) -> str:
    return f"if (mstmm_beyond_cache(model)) mstmm_fetch_{name}(state, i, {ahead});\n"


def _fetched_law(ahead: str) -> str:
    return f"if (mstmm_beyond_cache(model)) mstmm_fetch_law(model, i, {ahead});\n"


def _tiles(group: Tiled) -> str:
    """C function that starts and sweeps bodies tile by tile."""
    begun = [run.whole for run in group.begun if run.whole is not None and not run.when]
    of_laws = any(run.whole is not None and run.whole.subject == "law" for run in group.begun)
    name = f"{group.swept.name}_tile"
    fetched = _fetched(name, "-MSTMM_TILE")
    laws = ", law = model->n_laws" if of_laws else ""
    at = _at(group.swept, "").format(indent=" " * 12)
    return (
        f"{fetching(name, [*begun, group.swept])}"
        f"static int {group.function}(mstmm_state *state)\n{{\n"
        "    const mstmm_model *model = state->model;\n"
        f"    int code, begun = model->n_bodies{laws};\n"
        "    for (int end = begun; end > 0; end -= MSTMM_TILE) {\n"
        "        const int first = end > MSTMM_TILE ? end - MSTMM_TILE : 0;\n"
        "        const int least = mstmm_least_parent(model, first, end);\n"
        f"{_LAWS if of_laws else ''}{''.join(map(_begun, group.begun))}"
        "        if (least < begun) begun = least;\n"
        "        for (int i = end - 1; i >= first; i--) {\n"
        f"            {fetched}            {at}"
        "        }\n    }\n    return 0;\n}\n"
    )


def _chained(group: Chained) -> str:
    """C function that runs several passes on each tile of bodies, root to tips."""
    subjects = {whole.subject for whole in group.passes}
    counters = "".join(f", {one[0]} = 0" for name, one in _BEHIND.items() if name in subjects)
    name = f"{group.name}_chain"
    fetches = fetching(name, group.passes)
    lines = []
    for whole in group.passes:
        at = _at(whole, "").format(indent=" " * 12)
        if whole.subject in _BEHIND:
            lines.append(_behind(whole, at))
            continue
        asked = whole is group.main and fetches
        fetched = f"            {_fetched(name, 'MSTMM_TILE')}" if asked else ""
        lines.append(
            f"        for (int i = first; i < end; i++) {{\n{fetched}            {at}        }}\n"
        )
    return (
        f"{fetches}"
        f"static int {group.function}(mstmm_state *state)\n{{\n"
        "    const mstmm_model *model = state->model;\n"
        f"    int code{counters};\n"
        "    for (int first = 0; first < model->n_bodies; first += MSTMM_TILE) {\n"
        "        const int end = mstmm_end_of_tile(model, first);\n"
        f"{''.join(lines)}    }}\n    return 0;\n}}\n"
    )


def _behind(whole: Pass, at: str) -> str:
    """C loop of a pass over the subjects of a tile that are in the order of its bodies."""
    counter, count, last = _BEHIND[whole.subject]
    fetched = f"            {_fetched_law('MSTMM_TILE')}" if whole.subject == "law" else ""
    return (
        f"        for (; {counter} < model->{count} && {last} < end; {counter}++) {{\n"
        f"            const int i = {counter};\n{fetched}            {at}        }}\n"
    )


def _begun(run: Run) -> str:
    """C loop of a pass over the bodies of a tile that are not started yet."""
    assert run.whole is not None
    indent = " " * 8
    opened, closed = "", ""
    if run.when:
        opened, closed = f"{indent}if ({condition(run.when)}) {{\n", f"{indent}}}\n"
        indent += "    "
    at = _at(run.whole, "").format(indent=indent + "    ")
    if run.whole.subject == "law":
        text = f"{indent}for (int i = law; i < behind; i++) {{\n"
        text += f"{indent}    {_fetched_law('-MSTMM_TILE')}"
    else:
        text = f"{indent}for (int i = begun - 1; i >= least; i--) {{\n"
    return f"{opened}{text}{indent}    {at}{indent}}}\n{closed}"


def _sweep(sweep: Sweep, parts: list[Run | Tiled | Chained]) -> str:
    """C function that runs the passes of a sweep in order."""
    lines = ["    int code;"]
    for part in parts:
        if isinstance(part, Run):
            lines += _called(part, "    ")
            continue
        tiles = [f"code = {part.function}(state);", "if (code) return code;"]
        if not part.hindrances:
            lines += [f"    {line}" for line in tiles]
            continue
        inside = [line for run in part.runs for line in _called(run, " " * 8)]
        lines += [f"    if ({part.singly}) {{", *inside, "    } else {"]
        lines += [*(f"        {line}" for line in tiles), "    }"]
    if any("model->" in line.replace("state->model->", "") for line in lines):
        lines.insert(0, "    const mstmm_model *model = state->model;")
    body = "\n".join([*lines, "    return 0;"])
    head = f"/* {sweep.purpose} */\nint mstmm_run_{sweep.name}(mstmm_state *state)"
    return f"{head}\n{{\n{body}\n}}\n"


def _called(run: Run, indent: str) -> list[str]:
    """C lines that run a pass over all its subjects, under its condition."""
    called = f"mstmm_pass_{run.whole.name}" if run.whole else f"mstmm_hook_{run.hook}"
    lines = [f"code = {called}(state);", "if (code) return code;"]
    if run.when:
        lines = [f"if ({condition(run.when)}) {{", *(f"    {line}" for line in lines), "}"]
    return [f"{indent}{line}" for line in lines]
