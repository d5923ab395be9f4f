"""Risks: reasons not to take the numbers of a run as they are, whoever sees them.

A scene, the start of a run and what became of it are looked at by different rooms; all of them say
what they see as rows of this one kind.  docs/use/risks.md lists their names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from numbers import Real
from typing import Any

from .markup import Displayed, bullets, text

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


def advice(name: str, element: str, means: str, remedy: str) -> Risk:
    """A row that is only worth knowing."""
    return Risk(name, element, means, remedy, doubt=False)


def sentences(risks: Iterable[Risk]) -> tuple[str, ...]:
    """Their texts, each once."""
    return tuple(dict.fromkeys(map(str, risks)))


def order_risks(found: Iterable[Risk]) -> tuple[Risk, ...]:
    """Doubts first, each once; of what was seen before a run and in it the later row."""
    rows = tuple(dict.fromkeys(found))
    seen = {(risk.name, risk.element) for risk in rows if not risk.before}
    kept = (risk for risk in rows if not risk.before or (risk.name, risk.element) not in seen)
    return tuple(sorted(kept, key=lambda risk: not risk.doubt))


class DeferredRisks:
    """Risks that are looked for when somebody asks for them, once: an answer costs nothing more."""

    def __init__(self, find: Callable[[], Iterable[Risk]]) -> None:
        self._find: Callable[[], Iterable[Risk]] | None = find
        self._found: tuple[Risk, ...] = ()

    def __iter__(self) -> Iterator[Risk]:
        if self._find is not None:
            self._found, self._find = tuple(self._find()), None
        return iter(self._found)

    def __reduce__(self) -> tuple[type[tuple[Risk, ...]], tuple[tuple[Risk, ...]]]:
        return tuple, (tuple(self),)


class Assessed(Displayed):
    """An answer that says how far it can be trusted.

    Its class gives `findings`, the rows that its checks found, in any order.
    """

    findings: Iterable[Risk]

    @property
    def risks(self) -> tuple[Risk, ...]:
        """Everything that asks for attention, doubts first; empty for a clean answer."""
        return order_risks(self.findings)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The risks, one sentence each."""
        return sentences(self.risks)

    @property
    def trusted(self) -> bool:
        """True where no risk speaks against the numbers."""
        return not any(risk.doubt for risk in self.risks)

    @property
    def verdict(self) -> str:
        """Whether the answer can be trusted, and if not why, in one sentence."""
        objections = [risk for risk in self.risks if risk.doubt]
        if not objections:
            return "trusted: no check speaks against it"
        more = f" (and {len(objections) - 1} more)" if len(objections) > 1 else ""
        return f"NOT trusted: {objections[0].means}{more}"

    def assessment(self) -> dict[str, Any]:
        """Verdict and risks as plain data, for files."""
        return {
            "trusted": self.trusted, "warnings": list(self.warnings), "risks": to_rows(self.risks)
        }  # fmt: skip

    def _repr_html_(self) -> str:
        return f"<p>{text(repr(self))}</p><p>{text(self.verdict)}</p>{bullets(self.warnings)}"


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
