"""Passes that are done tile by tile, so that what one brings into the cache the next finds there.

In front of a pass from tips to root often stand some that begin the numbers of every body and read
those of no other.  A scene that the cache does not hold is met once for all of them: a tile of
bodies is begun, and then swept.  What is swept adds to the numbers of parents, so that bodies are
begun ahead of the tile as far as its parents reach.

Passes from root to tips that follow one another read of others what parents have had since an
earlier tile, so that they go tile by tile together (`Chained`).
"""

from __future__ import annotations

from dataclasses import dataclass

from ..schedule.slope import D
from ..schedule.steps import ROOT_TO_TIPS, TIPS_TO_ROOT, Do, Pass, Run, Step, Sweep, inner
from ..schedule.words import ROLES
from .conditions import condition

#: Owners of numbers that belong to other bodies, to expressions or to the whole scene.
_OTHERS = (*ROLES, "inboard", "sums", "outer", "inner")
#: Those that stand already where bodies are met from root to tips; sums keep their order, and rows
#: are met with the body that they close on.
_KNOWN = ("parent", "inboard", "sums", "meeting")


@dataclass(frozen=True)
class _Together:
    """Passes that go tile by tile; one after the other where one of the `hindrances` runs, which
    stand among them and fit into no tile."""

    runs: tuple[Run, ...]
    hindrances: tuple[Run, ...]

    @property
    def singly(self) -> str:
        """C condition under which the passes run one after the other; "" for never."""
        conditions = dict.fromkeys(condition(run.when) for run in self.hindrances)
        return " || ".join(f"({text})" if "&&" in text else text for text in conditions)


@dataclass(frozen=True)
class Tiled(_Together):
    """`begun` for all bodies of a tile, then `swept`, tips to root."""

    begun: tuple[Run, ...]
    swept: Pass

    @property
    def function(self) -> str:
        return f"mstmm_tiles_{self.swept.name}"


@dataclass(frozen=True)
class Chained(_Together):
    """`passes` of bodies, laws and loops, one after the other for a tile, root to tips; while
    `main` goes over a tile the next is asked for."""

    sweep: str
    passes: tuple[Pass, ...]
    main: Pass

    @property
    def name(self) -> str:
        """Of the passes together."""
        return f"{self.sweep}_{self.main.name}"

    @property
    def function(self) -> str:
        return f"mstmm_chain_{self.name}"


def tiled(sweep: Sweep) -> list[Run | Tiled | Chained]:
    """The runs of a sweep, those together that go tile by tile."""
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
    """Whether a pass reads of others what is known where bodies are met from root to tips."""
    whole = run.whole
    if whole is not None and whole.subject == "closure":
        return True  # each is met behind the bodies that it reads
    return (
        whole is not None and whole.subject in ("body", "law") and whole.order == ROOT_TO_TIPS
        and not any(_of_others(step, _KNOWN) for top in whole.steps for step in inner(top))
    )  # fmt: skip


def _chained(name: str, runs: list[Run]) -> list[Run | Tiled | Chained]:
    """Runs with the unconditional ones among them together, if all bodies have part in one."""
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
    """The runs of a sweep, those together that end with one from tips to root."""
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
    """The last runs from one on that every body has part in, if all fit or may be absent."""
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
        return False  # its steps are met by themselves
    slots = [str(value) for value in vars(step).values()]
    slots += [slot for _, slot in getattr(step, "ports", ())]
    owners = {slot.removeprefix(D).split(".")[0] for slot in slots}
    return not owners.isdisjoint(set(_OTHERS) - set(known))
