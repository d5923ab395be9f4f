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
from .schedule_conditions import condition_text

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
