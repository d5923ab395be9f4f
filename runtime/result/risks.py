"""Risks that the numbers of a run show by themselves, and their order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from mstmm.risk import Risk

from ..integrate.reached import ReachedError
from .evidence import Drift

#: Distance of a quaternion's length from 1 that is a risk.
LENGTH = 1e-3


def ordered(found: Iterable[Risk]) -> tuple[Risk, ...]:
    """Doubts first, each once; of what was seen before the run and in it the later row."""
    rows = tuple(dict.fromkeys(found))
    seen = {(risk.name, risk.element) for risk in rows if not risk.before}
    kept = (risk for risk in rows if not risk.before or (risk.name, risk.element) not in seen)
    return tuple(sorted(kept, key=lambda risk: not risk.doubt))


def of_numbers(finite: bool, reached: ReachedError | None) -> Iterator[Risk]:
    """Numbers that are none, and a wanted error that was not reached."""
    if not finite:
        yield Risk("not-finite", "", "the states hold numbers that are not finite")
    if reached is not None and reached.risk is not None:
        yield reached.risk


def of_balances(drifts: Sequence[Drift], limit: float) -> Iterator[Risk]:
    """What is not known of energy and momentum, and what is not kept to a relative `limit`."""
    for drift in drifts:
        if not drift.known:
            yield Risk(
                _kind(drift), drift.name,
                f"{drift.name} cannot be balanced: it is beyond what numbers hold, or no sample "
                "gives it",
            )  # fmt: skip
    for drift in drifts:
        if drift.relative > limit:
            yield Risk(
                _kind(drift), drift.name, f"{drift.name} is not kept: it changes by {drift}",
                "the tolerance or the step is too coarse", drift.relative, limit,
            )  # fmt: skip


def of_quaternions(residual: float) -> Iterator[Risk]:
    """Quaternions that were far from length 1 before they were settled."""
    if residual > LENGTH:
        yield Risk(
            "quaternion-length", "",
            f"quaternions were {residual:.1e} off their length 1 between the steps: attitudes err "
            "by about as much", "take smaller tolerances, or a method of the package", residual,
            LENGTH,
        )  # fmt: skip


def _kind(drift: Drift) -> str:
    return "energy-drift" if drift.unit == "J" else "momentum-drift"


def of_speed(stability_limited: bool) -> Iterator[Risk]:
    """Advice for a run whose steps stability has set."""
    if stability_limited:
        yield Risk(
            "stiff", "",
            "many steps were as long as the stability of the explicit method allows: the scene is "
            'stiff for it (method = "auto" or "rodas4p2" may be faster), or the fixed step is too '
            "long", doubt=False,
        )  # fmt: skip
