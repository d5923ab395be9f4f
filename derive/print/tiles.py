"""Passes that are done tile by tile, so that what one brings into the cache the next finds there.

In front of a pass from tips to root often stand some that begin the numbers of every body and read
those of no other.  A scene that the cache does not hold is met once for all of them: a tile of
bodies is begun, and then swept.  What is swept adds to the numbers of parents, so that bodies are
begun ahead of the tile as far as its parents reach.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..schedule.slope import D
from ..schedule.steps import TIPS_TO_ROOT, Do, Pass, Run, Step, Sweep, inner
from ..schedule.words import ROLES
from .conditions import condition

#: Owners of numbers that belong to other bodies, to expressions or to the whole scene.
_OTHERS = (*ROLES, "inboard", "sums", "outer", "inner")


@dataclass(frozen=True)
class Tiled:
    """`begun` for all bodies of a tile, then `swept`; one pass after the other where one of the
    `hindrances` runs, which stand among them and fit into no tile."""

    runs: tuple[Run, ...]
    begun: tuple[Run, ...]
    hindrances: tuple[Run, ...]
    swept: Pass

    @property
    def singly(self) -> str:
        """C condition under which the passes run one after the other; "" for never."""
        conditions = dict.fromkeys(condition(run.when) for run in self.hindrances)
        return " || ".join(f"({text})" if "&&" in text else text for text in conditions)


def tiled(sweep: Sweep) -> list[Run | Tiled]:
    """The runs of a sweep, those together that go tile by tile."""
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
    return Tiled((*before, last), begun, tuple(run for run in before if not _alone(run)), swept)


def _alone(run: Run) -> bool:
    """Whether a pass reads and writes numbers of its own body and no other."""
    whole = run.whole
    if whole is None or whole.subject not in ("body", "law") or whole.order == TIPS_TO_ROOT:
        return False
    steps = [part for step in whole.steps for part in inner(step)]
    return not any(_of_others(step) for step in steps) and not whole.given


def _of_others(step: Step) -> bool:
    if ("section", True) in step.traits or ("outward", True) in step.traits:
        return True
    if isinstance(step, Do):
        return False  # its steps are met by themselves
    slots = [str(value) for value in vars(step).values()]
    slots += [slot for _, slot in getattr(step, "ports", ())]
    return any(slot.removeprefix(D).split(".")[0] in _OTHERS for slot in slots)
