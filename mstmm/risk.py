"""Risks: findings about the reliability of an answer, in one form for all checks.

Different packages check a scene, the start of a run and its result; all of them report their
findings as rows of this one type.  docs/howto/warnings.md lists their names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from numbers import Real
from typing import Any

from .display import NotebookDisplay, bullets, text
from .plain_data import from_plain, stored_as, to_plain

#: Reactions of a run to its risks.
ON_RISK = ("warn", "refuse", "ignore")

#: Element of findings about a run as a whole.
RUN = "the run"


@dataclass(frozen=True)
class Risk:
    """Finding about an answer, with a remedy.

    Attributes:
        name: of the kind, such as "step-stability".
        element: element concerned, such as 'hinge "elbow"'; RUN for the run as a whole.
        description: the finding and its consequence, a sentence without a full stop.
        remedy: how to resolve or check it.
        value, limit: value found, and the limit beyond which it is a risk; None without a number.
        unit: of both; "1" for ratios.
        invalidates: whether it is an objection to the numbers; otherwise it is only information.
        seen_before_run: whether it was found before the run, in the scene and its initial state.
    """

    name: str
    element: str
    description: str = field(metadata=stored_as("means"))
    remedy: str
    value: float | None = field(default=None, metadata=stored_as("figure"))
    limit: float | None = None
    unit: str = "1"
    invalidates: bool = field(default=True, metadata=stored_as("doubt"))
    seen_before_run: bool = field(default=False, metadata=stored_as("before"))

    def __post_init__(self) -> None:
        for name in ("value", "limit"):  # plain numbers, whatever type they were computed in
            value = getattr(self, name)
            if isinstance(value, Real):
                object.__setattr__(self, name, float(value))

    def __str__(self) -> str:
        return f"{self.description}; {self.remedy}"


def information(name: str, element: str, description: str, remedy: str) -> Risk:
    """Create a risk that is information, no objection to the numbers."""
    return Risk(name, element, description, remedy, invalidates=False)


def sentences(risks: Iterable[Risk]) -> tuple[str, ...]:
    """Texts of the risks, without duplicates."""
    return tuple(dict.fromkeys(map(str, risks)))


def order_risks(found: Iterable[Risk]) -> tuple[Risk, ...]:
    """Order risks: objections first, without duplicates.

    A finding made both before and during a run keeps only the later row.
    """
    rows = tuple(dict.fromkeys(found))
    run_keys = {(risk.name, risk.element) for risk in rows if not risk.seen_before_run}
    remaining = (
        risk
        for risk in rows
        if not risk.seen_before_run or (risk.name, risk.element) not in run_keys
    )
    return tuple(sorted(remaining, key=lambda risk: not risk.invalidates))


class DeferredRisks:
    """Risks that are determined once, at their first use, so that the answer costs no more."""

    def __init__(self, find: Callable[[], Iterable[Risk]]) -> None:
        self._find: Callable[[], Iterable[Risk]] | None = find
        self._risks: tuple[Risk, ...] = ()

    def __iter__(self) -> Iterator[Risk]:
        if self._find is not None:
            self._risks, self._find = tuple(self._find()), None
        return iter(self._risks)

    def __reduce__(self) -> tuple[type[tuple[Risk, ...]], tuple[tuple[Risk, ...]]]:
        return tuple, (tuple(self),)


class AssessedResult(NotebookDisplay):
    """Base class of answers that report their reliability.

    A subclass provides `findings`, the rows of its checks, in any order.
    """

    findings: Iterable[Risk]

    @property
    def risks(self) -> tuple[Risk, ...]:
        """All findings, objections first; empty if the checks found nothing."""
        return order_risks(self.findings)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Risks, one sentence each."""
        return sentences(self.risks)

    @property
    def trusted(self) -> bool:
        """True if no risk is an objection to the numbers."""
        return not any(risk.invalidates for risk in self.risks)

    def verdict(self) -> str:
        """Whether the answer can be trusted, and if not why, in one sentence."""
        objections = [risk for risk in self.risks if risk.invalidates]
        if not objections:
            return "trusted: no check objects to it"
        suffix = f" (and {len(objections) - 1} more)" if len(objections) > 1 else ""
        return f"NOT trusted: {objections[0].description}{suffix}"

    def assessment(self) -> dict[str, Any]:
        """Verdict and risks as plain data, for files and JSON output."""
        return {
            "trusted": self.trusted, "warnings": list(self.warnings), "risks": to_rows(self.risks)
        }  # fmt: skip

    def _repr_html_(self) -> str:
        return f"<p>{text(repr(self))}</p><p>{text(self.verdict())}</p>{bullets(self.warnings)}"


def to_rows(risks: Iterable[Risk]) -> list[dict[str, Any]]:
    """Convert risks to plain data, for files."""
    return [to_plain(risk) for risk in risks]


def from_rows(rows: Iterable[Mapping[str, Any]]) -> tuple[Risk, ...]:
    """Restore risks from the result of `to_rows`.  TypeError for values of other types."""
    risks = tuple(from_plain(Risk, row) for row in rows)
    for risk in risks:
        texts = (risk.name, risk.element, risk.description, risk.remedy, risk.unit)
        numbers = (risk.value, risk.limit)
        if not all(isinstance(word, str) for word in texts) or not all(
            x is None or isinstance(x, (int, float))
            for x in (*numbers, risk.invalidates, risk.seen_before_run)
        ):
            raise TypeError("a risk holds values other than texts and numbers")
    return risks
