"""Risks: reasons not to take the numbers of a run as they are, whoever sees them.

A scene, the start of a run and what became of it are looked at by different rooms; all of them say
what they see as rows of this one kind.  docs/use/risks.md lists their names.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from numbers import Real
from typing import Any

#: What a run may do about its risks.
ON_RISK = ("warn", "refuse", "ignore")

#: The element of what concerns a run as a whole.
RUN = "the run"


@dataclass(frozen=True)
class Risk:
    """One of them.

    Attributes:
        name: of the kind, such as "step-stability".
        element: what it is about, such as 'hinge "elbow"'; RUN for the run as a whole.
        means: what was seen and what follows from it, a sentence without its end.
        remedy: what to do about it.
        figure, limit: what was looked at, and from where on it is a risk; None without a number.
        unit: of both; "1" for ratios.
        doubt: it speaks against the numbers; else it is only worth knowing.
        before: it was seen before the run, in the scene and its start.
    """

    name: str
    element: str
    means: str
    remedy: str
    figure: float | None = None
    limit: float | None = None
    unit: str = "1"
    doubt: bool = True
    before: bool = False

    def __post_init__(self) -> None:
        for name in ("figure", "limit"):  # plain numbers, whatever they were computed by
            value = getattr(self, name)
            if isinstance(value, Real):
                object.__setattr__(self, name, float(value))

    def __str__(self) -> str:
        return f"{self.means}; {self.remedy}"


def sentences(risks: Iterable[Risk]) -> tuple[str, ...]:
    """Their texts, each once."""
    return tuple(dict.fromkeys(map(str, risks)))


def to_rows(risks: Iterable[Risk]) -> list[dict[str, Any]]:
    """Plain data, for files."""
    return [asdict(risk) for risk in risks]


def from_rows(rows: Iterable[Mapping[str, Any]]) -> tuple[Risk, ...]:
    """What `to_rows` gave.  TypeError where that is something else."""
    found = tuple(Risk(**row) for row in rows)
    for risk in found:
        words = (risk.name, risk.element, risk.means, risk.remedy, risk.unit)
        numbers = (risk.figure, risk.limit)
        if not all(isinstance(word, str) for word in words) or not all(
            x is None or isinstance(x, (int, float)) for x in (*numbers, risk.doubt, risk.before)
        ):
            raise TypeError("a risk that holds something else than words and numbers")
    return found
