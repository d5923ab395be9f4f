"""Group passes into tiles of bodies, so that consecutive passes share cached data.

Passes that initialise each body independently often precede a pass from tips to root.  Memory
traffic of large scenes is reduced by running all of them on a tile of bodies: first the
initialisation, then the sweep.  The sweep adds to the numbers of parents, so that initialisation
also covers the parents of the tile.

Consecutive passes from root to tips only read parents that an earlier tile has completed, so that
they also run tile by tile (`Chained`).
"""

from __future__ import annotations

from dataclasses import dataclass

from ..schedule.slope import D
from ..schedule.steps import ROOT_TO_TIPS, TIPS_TO_ROOT, Do, Pass, Run, Step, Sweep, inner
from ..schedule.words import ROLES
from .conditions import condition

#: Owners of numbers that belong to other bodies, to expressions or to the whole scene.
_OTHERS = (*ROLES, "inboard", "sums", "outer", "inner")
#: Owners that are complete when bodies are visited from root to tips; sums keep their order, and
#: rows are visited with the body on which they close.
_KNOWN = ("parent", "inboard", "sums", "meeting")


@dataclass(frozen=True)
class _Together:
    """Passes that run tile by tile, or separately if one of the `hindrances` runs.

    The `hindrances` are passes between them that cannot run in tiles."""

    runs: tuple[Run, ...]
    hindrances: tuple[Run, ...]

    @property
    def singly(self) -> str:
        """C condition under which the passes run one after the other; "" for never."""
        conditions = dict.fromkeys(condition(run.when) for run in self.hindrances)
        return " || ".join(f"({text})" if "&&" in text else text for text in conditions)


@dataclass(frozen=True)
class Tiled(_Together):
    """Passes `begun` for all bodies of a tile, then the pass `swept`, tips to root."""

    begun: tuple[Run, ...]
    swept: Pass

    @property
    def function(self) -> str:
        return f"mstmm_tiles_{self.swept.name}"


@dataclass(frozen=True)
class Chained(_Together):
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


def tiled(sweep: Sweep) -> list[Run | Tiled | Chained]:
    """Runs of a sweep, grouped where they run tile by tile."""
    found: list[Run | Tiled | Chained] = []
    rest: list[Run] = []
    for part in _swept(sweep):
        if isinstance(part, Run) and (part.when or _follows(part)):
            rest.append(part)
            continue
        found += [*_chained(sweep.name, rest), part]
        rest = []
    return [*found, *_chained(sweep.name, rest)]


def _follows(run: Run) -> bool:
    """Whether a pass only reads data that are complete in a visit from root to tips."""
    whole = run.whole
    if whole is not None and whole.subject == "closure":
        return True  # each is visited after the bodies that it reads
    return (
        whole is not None and whole.subject in ("body", "law") and whole.order == ROOT_TO_TIPS
        and not any(_of_others(step, _KNOWN) for top in whole.steps for step in inner(top))
    )  # fmt: skip


def _chained(name: str, runs: list[Run]) -> list[Run | Tiled | Chained]:
    """Chain the unconditional runs, if one of them visits all bodies."""
    always = [i for i, run in enumerate(runs) if not run.when]
    passes = tuple(run.whole for i in always if (run := runs[i]).whole is not None)
    main = [one for one in passes if one.subject == "body" and not one.spares_links]
    if len(passes) < 2 or not main:
        return list(runs)
    first, last = always[0], always[-1] + 1
    together = tuple(runs[first:last])
    hindrances = tuple(run for run in together if run.when)
    return [*runs[:first], Chained(together, hindrances, name, passes, main[0]), *runs[last:]]


def _swept(sweep: Sweep) -> list[Run | Tiled]:
    """Runs of a sweep, grouped with each pass from tips to root that they precede."""
    found: list[Run | Tiled] = []
    for run in sweep.runs:
        if run.whole is not None and run.whole.order == TIPS_TO_ROOT and not run.when:
            before = _beginning(found)
            if before:
                del found[-len(before) :]
                found.append(_together(before, run, run.whole))
                continue
        found.append(run)
    return found


def _beginning(runs: list[Run | Tiled]) -> list[Run]:
    """Last runs that can start a tile, from the first that visits every body."""
    behind: list[Run] = []
    found: list[Run] = []
    for run in reversed(runs):
        if isinstance(run, Tiled) or not (_alone(run) or run.when):
            break
        behind.insert(0, run)
        if _alone(run) and run.whole is not None and run.whole.subject == "body" and not run.when:
            found = list(behind)
    return found


def _together(before: list[Run], last: Run, swept: Pass) -> Tiled:
    begun = tuple(run for run in before if _alone(run))
    return Tiled((*before, last), tuple(run for run in before if not _alone(run)), begun, swept)


def _alone(run: Run) -> bool:
    """Whether a pass reads and writes numbers of its own body and no other."""
    whole = run.whole
    if whole is None or whole.subject not in ("body", "law") or whole.order == TIPS_TO_ROOT:
        return False
    steps = [part for step in whole.steps for part in inner(step)]
    return not any(_of_others(step) for step in steps) and not whole.given


def _of_others(step: Step, known: tuple[str, ...] = ()) -> bool:
    if not known and (("section", True) in step.traits or ("outward", True) in step.traits):
        return True
    if isinstance(step, Do):
        return False  # its steps are examined separately
    slots = [str(value) for value in vars(step).values()]
    slots += [slot for _, slot in getattr(step, "ports", ())]
    owners = {slot.removeprefix(D).split(".")[0] for slot in slots}
    return not owners.isdisjoint(set(_OTHERS) - set(known))
