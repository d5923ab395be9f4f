"""Group passes into tiles of bodies, so that consecutive passes share cached data.

Passes that initialise each body independently often precede a pass from tips to root.  Memory
traffic of large scenes is reduced by running all of them on a tile of bodies: first the
initialisation, then the sweep.  The sweep adds to the numbers of parents, so that initialisation
also covers the parents of the tile.

Consecutive passes from root to tips only read parents that an earlier tile has completed, so that
they also run tile by tile (`ChainedPasses`).
"""

from __future__ import annotations

from dataclasses import dataclass

from ..schedule.differentiated_passes import D
from ..schedule.pass_steps import (
    ROOT_TO_TIPS,
    TIPS_TO_ROOT,
    Pass,
    Run,
    RunPass,
    Step,
    Sweep,
    all_steps,
)
from ..schedule.slot_definitions import ROLES
from .slot_storage import pass_variables, reads_variable

# --- conditions of the schedule -------------------------------------------------------------------

#: C conditions of the traits.
_TRAIT_TEXTS = {
    "own": "!(body->generic || state->required)",
    "parts": "(body->generic || state->required)", "section": "body->section",
    "whole": "body->kernels->body_motion && !body->section"
    " && (body->generic || state->required)",
    "directed": "body->kernels->directions && !body->placed && speeds == body->nu",
    "outward": "body->section && !body->section->inward", "modal": "body->modal",
    "segment": "body->section && body->section->Bm",
    "imposed": "mstmm_imposed_count(body, state->memory)",
    "idle": "mstmm_idle(state->observed, body)",
    "drag": "body->modal && body->modal->drag", "inverse": "state->given",
    "weightless": "state->required",
    "balance": "state->balance", "efforts": "state->efforts", "known": "state->hinges_known",
    "linked": "state->linked", "laws": "model->n_laws", "driven": "model->n_drives",
    "expressions": "model->n_values",
    "flexible": "model->n_flexible", "poses": "(model->needs_pose || model->product)",
    "driving": "(!state->given || state->residual)", "curved": "!body->straight",
    "steady": "body->steady", "placed": "body->placed", "own_load": "load->own",
    "own_force": "force->own", "from_body": "force->body_f >= 0", "to_body": "force->body_t >= 0",
    "turning": "body->turning",
    "moving": "!body->section && speeds", "product": "model->product",
    "shifted": "state->tangents->shifted", "coordinate": "law->kind == 0",
    "looped": "model->looped", "cut": "looped->closure",
    "omitted": "mstmm_is_skipped(state->model, state->observed, index)",
    "corrected": "state->level",
    "residual": "state->residual",
    "loop_hinge": "state->model->looped[law->body].closure",
    "hinged": "closure->kind == MSTMM_HINGE",
    "distance": "closure->kind == MSTMM_DISTANCE", "plane": "closure->kind == MSTMM_PLANE",
    "rolling": "closure->kind == MSTMM_ROLLING",
    "soft": "(state->model->rows[closure->rows[c]].softness > 0)",
    "inside": "(row->body >= 0)", "refined": "state->refined", "couplings": "model->n_couplings",
    "redundant": "(coupling->row < 0)",
    "coupled": "(pending->tau >= 0)",
    "gap_closing": "(state->closing > 0)",
    "position_gap": "state->level == MSTMM_GAP", "velocity_error": "state->level == MSTMM_SLIP",
    "unit_load": "state->tangents->unit",
    "effort": "force->effort", "qr": "model->qr",
    "rigid": "body->kernels->rigid",
    "on_body": "(body->parent >= 0)", "loads_read": "(state->observed || state->balance)",
}  # fmt: skip


#: Traits with another condition for planar scenes.
_PLANAR_TRAIT_TEXTS = {"omitted": "body->omitted", "idle": "body->idle"}


def condition_text(when: str, flat: bool = False) -> str:
    """C expression of a condition.  Raises ValueError for an unknown condition."""
    terms = []
    for name in when.split():
        text = _trait_text(name, flat)
        simple = "&&" not in text and "==" not in text
        if name.startswith("!"):
            opposite = text[1:] if text.startswith("!") else f"!{text}"
            text = opposite if simple else f"!({text})"
        terms.append(text)
    return " && ".join(terms)


def condition_variables(when: str, flat: bool = False) -> set[str]:
    """Variables that a condition reads."""
    texts = [_trait_text(item, flat) for item in when.split()]
    return {name for name in pass_variables(flat) for text in texts if reads_variable(text, name)}


def _trait_text(word: str, flat: bool) -> str:
    trait = word.lstrip("!")
    text = (_PLANAR_TRAIT_TEXTS.get(trait) if flat else None) or _TRAIT_TEXTS.get(trait)
    if text is None:
        raise ValueError(f"unknown condition {word!r}; expected one of {', '.join(_TRAIT_TEXTS)}")
    return text


# --- tiles ----------------------------------------------------------------------------------------

#: Owners of numbers that belong to other bodies, to expressions or to the whole scene.
_OTHER_OWNERS = (*ROLES, "inboard", "sums", "outer", "inner")
#: Owners that are complete when bodies are visited from root to tips; sums keep their order, and
#: rows are visited with the body on which they close.
_KNOWN_OWNERS = ("parent", "inboard", "sums", "meeting")


@dataclass(frozen=True)
class _TileGroup:
    """Passes that run tile by tile, or separately if one of the `hindrances` runs.

    The `hindrances` are passes between them that cannot run in tiles."""

    runs: tuple[Run, ...]
    hindrances: tuple[Run, ...]

    @property
    def singly(self) -> str:
        """C condition under which the passes run one after the other; "" for never."""
        conditions = dict.fromkeys(condition_text(run.when) for run in self.hindrances)
        return " || ".join(f"({text})" if "&&" in text else text for text in conditions)


@dataclass(frozen=True)
class TiledRun(_TileGroup):
    """Passes `begun` for all bodies of a tile, then the pass `swept`, tips to root."""

    begun: tuple[Run, ...]
    swept: Pass

    @property
    def function(self) -> str:
        return f"mstmm_tiles_{self.swept.name}"


@dataclass(frozen=True)
class ChainedPasses(_TileGroup):
    """Passes over bodies, laws and loops, in order for each tile, root to tips.

    The pass `main` prefetches the next tile."""

    sweep: str
    passes: tuple[Pass, ...]
    main: Pass

    @property
    def name(self) -> str:
        """Name of the group."""
        return f"{self.sweep}_{self.main.name}"

    @property
    def function(self) -> str:
        return f"mstmm_chain_{self.name}"


def tile_sweep(sweep: Sweep) -> list[Run | TiledRun | ChainedPasses]:
    """Runs of a sweep, grouped where they run tile by tile."""
    groups: list[Run | TiledRun | ChainedPasses] = []
    pending_runs: list[Run] = []
    for part in _group_sweep_tails(sweep):
        if isinstance(part, Run) and (part.when or _can_chain(part)):
            pending_runs.append(part)
            continue
        groups += [*_chain_runs(sweep.name, pending_runs), part]
        pending_runs = []
    return [*groups, *_chain_runs(sweep.name, pending_runs)]


def _can_chain(run: Run) -> bool:
    """Whether a pass only reads data that are complete in a visit from root to tips."""
    sweep_pass = run.whole
    if sweep_pass is not None and sweep_pass.subject == "closure":
        return True  # each is visited after the bodies that it reads
    return (
        sweep_pass is not None
        and sweep_pass.subject in ("body", "law")
        and sweep_pass.order == ROOT_TO_TIPS
        and not any(
            _uses_other_bodies(step, _KNOWN_OWNERS)
            for top in sweep_pass.steps
            for step in all_steps(top)
        )
    )


def _chain_runs(name: str, runs: list[Run]) -> list[Run | TiledRun | ChainedPasses]:
    """Chain the unconditional runs, if one of them visits all bodies."""
    unconditional = [i for i, run in enumerate(runs) if not run.when]
    passes = tuple(run.whole for i in unconditional if (run := runs[i]).whole is not None)
    main = [
        candidate
        for candidate in passes
        if candidate.subject == "body" and not candidate.spares_links
    ]
    if len(passes) < 2 or not main:
        return list(runs)
    start, stop = unconditional[0], unconditional[-1] + 1
    together = tuple(runs[start:stop])
    hindrances = tuple(run for run in together if run.when)
    return [*runs[:start], ChainedPasses(together, hindrances, name, passes, main[0]), *runs[stop:]]


def _group_sweep_tails(sweep: Sweep) -> list[Run | TiledRun]:
    """Runs of a sweep, grouped with each pass from tips to root that they precede."""
    groups: list[Run | TiledRun] = []
    for run in sweep.runs:
        if run.whole is not None and run.whole.order == TIPS_TO_ROOT and not run.when:
            leading = _leading_runs(groups)
            if leading:
                del groups[-len(leading) :]
                groups.append(_tiled_run(leading, run, run.whole))
                continue
        groups.append(run)
    return groups


def _leading_runs(runs: list[Run | TiledRun]) -> list[Run]:
    """Last runs that can start a tile, from the first that visits every body."""
    collected: list[Run] = []
    leading: list[Run] = []
    for run in reversed(runs):
        if isinstance(run, TiledRun) or not (_is_local_run(run) or run.when):
            break
        collected.insert(0, run)
        if (
            _is_local_run(run)
            and run.whole is not None
            and run.whole.subject == "body"
            and not run.when
        ):
            leading = list(collected)
    return leading


def _tiled_run(runs_before: list[Run], last: Run, swept: Pass) -> TiledRun:
    starting = tuple(run for run in runs_before if _is_local_run(run))
    return TiledRun(
        (*runs_before, last),
        tuple(run for run in runs_before if not _is_local_run(run)),
        starting,
        swept,
    )


def _is_local_run(run: Run) -> bool:
    """Whether a pass reads and writes only numbers of its own body."""
    sweep_pass = run.whole
    if (
        sweep_pass is None
        or sweep_pass.subject not in ("body", "law")
        or sweep_pass.order == TIPS_TO_ROOT
    ):
        return False
    steps = [part for step in sweep_pass.steps for part in all_steps(step)]
    return not any(_uses_other_bodies(step) for step in steps) and not sweep_pass.given


def _uses_other_bodies(step: Step, own_owners: tuple[str, ...] = ()) -> bool:
    if not own_owners and (("section", True) in step.traits or ("outward", True) in step.traits):
        return True
    if isinstance(step, RunPass):
        return False  # its steps are examined separately
    slots = [str(value) for value in vars(step).values()]
    slots += [slot for _, slot in getattr(step, "ports", ())]
    owners = {slot.removeprefix(D).split(".")[0] for slot in slots}
    return not owners.isdisjoint(set(_OTHER_OWNERS) - set(own_owners))
